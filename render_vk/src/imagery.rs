//! Imagery on the device: one layer of a texture array a tile.
//!
//! In:    tiles that are new in their layers, the arena's drapes.
//! Out:   [`Imagery`]: set 2 of the ground's pipelines.
//! Keeps: the texture, what is still to be uploaded, room to stage a few tiles in.
//! Not here: which tile is in which layer (`overfly_core::mesh::drape`).

use crate::error::Fault;
use crate::vk::buffer::{Buffer, BufferInfo};
use crate::vk::commands::OneOff;
use crate::vk::descriptors::{Binding, Resource, Set, SetLayout};
use crate::vk::image::{Image, ImageInfo, Sampler};
use crate::vk::{Device, transfer};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::datasource::colour::{COLOUR_SIDE, byte_of, light_of};
use overfly_core::mesh::drape::{LAYERS, NewTile};
use std::collections::VecDeque;
use std::sync::Arc;

/// Levels of each layer: 129 texels a side, 64, 32, … 1.
const LEVELS: u32 = 8;
/// Tiles staged at once; a picture that has more takes more buffers for its time.
const TILES_STAGED: usize = 8;
/// Texels of all levels of one tile.
const TEXELS: usize = {
    let (mut all, mut level) = (0, 0);
    while level < LEVELS {
        let side = COLOUR_SIDE >> level;
        all += side * side;
        level += 1;
    }
    all
};

/// Red, green, blue with the sRGB curve; opacity.
type Texel = [u8; 4];

/// The texture of a scene with imagery.
pub(crate) struct Imagery {
    image: Image,
    pub(crate) set: Set,
    pending: VecDeque<NewTile>,
    _sampler: Sampler,
}

/// Room to stage tiles in, of one frame in flight; which layers were staged.
pub(crate) struct TileStaging {
    rows: Buffer,
    layers: Vec<u32>,
}

impl TileStaging {
    pub(crate) fn new(device: &Arc<Device>, name: &str) -> Result<Self, Fault> {
        let info = BufferInfo {
            name: &format!("{name}, tiles"),
            bytes: (TILES_STAGED * TEXELS * size_of::<Texel>()) as u64,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            location: MemoryLocation::CpuToGpu,
        };
        let layers = Vec::with_capacity(TILES_STAGED);
        Ok(Self { rows: Buffer::new(device, &info)?, layers })
    }
}

impl Imagery {
    /// What set 2 looks like.
    pub(crate) fn layout(device: &Arc<Device>) -> Result<SetLayout, Fault> {
        let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
        let bindings = [
            Binding { kind: vk::DescriptorType::STORAGE_BUFFER, stages: vertex },
            Binding { kind: vk::DescriptorType::SAMPLED_IMAGE, stages: fragment },
            Binding { kind: vk::DescriptorType::SAMPLER, stages: fragment },
        ];
        SetLayout::new(device, "imagery", &bindings)
    }

    /// A texture without any tile.
    pub(crate) fn new(
        device: &Arc<Device>,
        one_off: &mut OneOff,
        (layout, drapes): (&SetLayout, &Buffer),
    ) -> Result<Self, Fault> {
        let side = u32::try_from(COLOUR_SIDE).expect("a tile is 129 texels wide");
        let info = ImageInfo {
            name: "imagery",
            size_px: [side; 2],
            format: vk::Format::R8G8B8A8_SRGB,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
            aspect: vk::ImageAspectFlags::COLOR,
        };
        let image = Image::layered(device, &info, [LEVELS, LAYERS])?;
        one_off.run(|device, buffer| transfer::make_readable(device, buffer, &image))?;
        let sampler = Sampler::clamped(device, "imagery", 8.0)?;
        let resources = [
            Resource::Buffer(drapes),
            Resource::Image(image.view),
            Resource::Sampler(sampler.handle),
        ];
        let set = Set::new(layout, &resources)?;
        Ok(Self { image, set, pending: VecDeque::new(), _sampler: sampler })
    }

    /// Tiles that are new in their layers.
    pub(crate) fn note(&mut self, tiles: &[NewTile]) {
        self.pending.extend(tiles.iter().cloned());
    }

    /// Stages as many tiles as fit. True if there are more.
    pub(crate) fn stage(&mut self, staging: &mut TileStaging) -> bool {
        staging.layers.clear();
        let rows: &mut [Texel] = staging.rows.rows_mut();
        for rows in rows.chunks_exact_mut(TEXELS) {
            let Some((layer, tile)) = self.pending.pop_front() else { break };
            levels_of(&tile.rgba, rows);
            staging.layers.push(layer);
        }
        !self.pending.is_empty()
    }

    /// Records the copies of what was staged.
    pub(crate) fn record(&self, device: &Device, buffer: vk::CommandBuffer, staging: &TileStaging) {
        for (at, &layer) in (0_u64..).zip(&staging.layers) {
            let from = at * (TEXELS * size_of::<Texel>()) as u64;
            transfer::fill_layer(device, buffer, (&staging.rows, from), (&self.image, layer));
        }
    }
}

/// A tile and its smaller levels, one after the other, multiplied by their opacity so that they can
/// be filtered: each texel is the mean light of four.
fn levels_of(tile: &[Texel], out: &mut [Texel]) {
    for (to, &texel) in out.iter_mut().zip(tile) {
        *to = multiplied(texel);
    }
    let (mut from, mut side) = (0, COLOUR_SIDE);
    for _ in 1..LEVELS {
        let half = side / 2;
        let (finer, coarser) = out[from..].split_at_mut(side * side);
        for (at, texel) in coarser[..half * half].iter_mut().enumerate() {
            let first = at / half * 2 * side + at % half * 2;
            *texel = mean([0, 1, side, side + 1].map(|step| finer[first + step]));
        }
        from += side * side;
        side = half;
    }
}

/// A colour in light, times its opacity.
fn multiplied([r, g, b, alpha]: Texel) -> Texel {
    if alpha == u8::MAX {
        return [r, g, b, alpha];
    }
    let part = |byte| {
        let light = u32::from(light_of(byte)) * u32::from(alpha) / 255;
        byte_of(u16::try_from(light).expect("less than before"))
    };
    [part(r), part(g), part(b), alpha]
}

fn mean(four: [Texel; 4]) -> Texel {
    let colour = |i: usize| {
        let light: u32 = four.iter().map(|texel| u32::from(light_of(texel[i]))).sum();
        byte_of(u16::try_from(light / 4).expect("a mean of 16 bits"))
    };
    let opacity: u32 = four.iter().map(|texel| u32::from(texel[3])).sum();
    let alpha = u8::try_from((opacity + 2) / 4).expect("a mean of bytes");
    [colour(0), colour(1), colour(2), alpha]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smaller_levels_of_one_colour_are_that_colour_and_holes_add_nothing() {
        let mut tile = vec![[200, 100, 50, 255]; COLOUR_SIDE * COLOUR_SIDE];
        tile[0] = [0; 4];
        let mut out = vec![[9; 4]; TEXELS];
        levels_of(&tile, &mut out);
        let second = &out[COLOUR_SIDE * COLOUR_SIDE..];
        assert_eq!(second[0], multiplied([200, 100, 50, 191]));
        assert_eq!(second[1], [200, 100, 50, 255]);
        assert!(out[TEXELS - 1][3] >= 254);
    }

    #[test]
    fn black_and_white_mix_in_light() {
        let [black, white] = [[0, 0, 0, 255], [255; 4]];
        assert_eq!(mean([black, white, black, white]), [188, 188, 188, 255]);
        assert_eq!(multiplied([255, 255, 255, 128]), [188, 188, 188, 128]);
    }
}

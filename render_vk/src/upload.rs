//! The patch arena on the device, and which of its slots are out of date.
//!
//! In:    slots built by the frame, the patch arena of core.
//! Out:   staged vertices and the copies that bring them to the device.
//! Keeps: buffers of vertices, morphs, drapes and indices, one bit a slot.
//! Not here: when that is done (`drawing`, `record`).

use crate::error::Fault;
use crate::settings::RendererSettings;
use crate::vk::buffer::{Buffer, BufferInfo, bytes_of};
use crate::vk::{Device, commands::OneOff, transfer};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::mesh::drape::PatchDrape;
use overfly_core::mesh::{PatchMorph, PatchVertex, Patches, topology};
use std::sync::Arc;

/// Vertices staged at once; a frame that has more to upload takes more buffers for its time.
const STAGING_BYTES: u64 = 4 << 20;

/// Vertices of all patches, as the device has them.
pub(crate) struct Arena {
    pub(crate) vertices: Buffer,
    /// Where vertices begin; only where the scene morphs.
    pub(crate) morphs: Option<Buffer>,
    /// What lies over each slot; only where the scene has imagery.
    pub(crate) drapes: Option<Buffer>,
    pub(crate) indices: Buffer,
    pub(crate) indices_per_patch: u32,
    pub(crate) vertices_per_patch: u32,
    /// Bit s % 64 of word s / 64: what the device has of slot s is out of date.
    stale: Vec<u64>,
}

/// Copies from one staging buffer to the arena.
#[derive(Default)]
struct Copies {
    vertices: Vec<vk::BufferCopy>,
    morphs: Vec<vk::BufferCopy>,
    drapes: Vec<vk::BufferCopy>,
}

/// A buffer with patches that are on their way to the device.
pub(crate) struct Staging {
    rows: Buffer,
    copies: Copies,
}

impl Copies {
    fn clear(&mut self) {
        self.vertices.clear();
        self.morphs.clear();
        self.drapes.clear();
    }
}

/// What one staging buffer took.
#[derive(Clone, Copy, Default)]
pub(crate) struct Staged {
    pub(crate) patches: u32,
    pub(crate) bytes: u64,
    /// The staging buffer was full before the end.
    pub(crate) more: bool,
}

impl Arena {
    /// An arena all of whose slots are out of date.
    pub(crate) fn new(
        device: &Arc<Device>,
        one_off: &mut OneOff,
        settings: &RendererSettings,
    ) -> Result<Self, Fault> {
        let (patch_depth, patches_max) = (settings.patch_depth, settings.patches_max);
        let vertices_per_patch = settings.vertices_per_patch();
        let pattern: Vec<u16> = topology::indices(patch_depth)
            .into_iter()
            .map(|i| u16::try_from(i).expect("a patch has at most 153 vertices"))
            .collect();
        let column = |name, row: usize| {
            let info = BufferInfo {
                name,
                bytes: u64::from(patches_max) * u64::from(vertices_per_patch) * row as u64,
                usage: vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
                location: MemoryLocation::GpuOnly,
            };
            Buffer::new(device, &info)
        };
        let vertices = column("patch vertices", size_of::<PatchVertex>())?;
        let morphs = settings.morphs().then(|| column("patch morphs", size_of::<PatchMorph>()));
        let drapes = settings.imagery.then(|| {
            let info = BufferInfo {
                name: "patch drapes",
                bytes: u64::from(patches_max) * size_of::<PatchDrape>() as u64,
                usage: vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
                location: MemoryLocation::GpuOnly,
            };
            Buffer::new(device, &info)
        });
        let indices = index_buffer(device, one_off, &pattern)?;
        Ok(Self {
            vertices,
            morphs: morphs.transpose()?,
            drapes: drapes.transpose()?,
            indices,
            indices_per_patch: 3 << patch_depth,
            vertices_per_patch,
            stale: vec![u64::MAX; patches_max.div_ceil(64) as usize],
        })
    }

    /// A buffer to stage patches in; holds at least one.
    pub(crate) fn staging(&self, device: &Arc<Device>, name: &str) -> Result<Staging, Fault> {
        let patch: u64 = self.patch_bytes().iter().sum();
        let others = [self.morphs.as_ref(), self.drapes.as_ref()];
        let others: u64 = others.into_iter().flatten().map(|buffer| buffer.bytes).sum();
        let all = self.vertices.bytes + others;
        let info = BufferInfo {
            name: &format!("{name}, staging"),
            bytes: (STAGING_BYTES.min(all) / patch).max(1) * patch,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            location: MemoryLocation::CpuToGpu,
        };
        Ok(Staging { rows: Buffer::new(device, &info)?, copies: Copies::default() })
    }

    /// Bytes of one patch's vertices, of its morphs, of what lies over it.
    fn patch_bytes(&self) -> [u64; 3] {
        let vertices = u64::from(self.vertices_per_patch);
        let morph = if self.morphs.is_some() { size_of::<PatchMorph>() } else { 0 };
        let drape = if self.drapes.is_some() { size_of::<PatchDrape>() } else { 0 };
        [vertices * size_of::<PatchVertex>() as u64, vertices * morph as u64, drape as u64]
    }

    /// The device's copies of these slots are out of date. Slots beyond the arena are ignored.
    pub(crate) fn mark(&mut self, slots: &[u32]) {
        for &slot in slots {
            if let Some(word) = self.stale.get_mut(slot as usize / 64) {
                *word |= 1 << (slot % 64);
            }
        }
    }

    /// As after [`Arena::new`]: nothing that the device has is trusted.
    pub(crate) fn mark_all(&mut self) {
        self.stale.fill(u64::MAX);
    }

    /// Stages live slots that are out of date, in order of slot, until the buffer is full. They
    /// count as up to date from now on: the copies must be executed. Vertices are staged from the
    /// buffer's beginning on, then morphs, then drapes.
    pub(crate) fn stage(&mut self, patches: &Patches, staging: &mut Staging) -> Staged {
        let Staging { rows, copies } = staging;
        copies.clear();
        let mut staged = Staged::default();
        let [vertices, morphs, drapes] = self.patch_bytes();
        let room = rows.bytes / (vertices + morphs + drapes);
        let bytes = rows.mapped_mut();
        let mut put = |at: u64, from: &[u8]| {
            let at = usize::try_from(at).expect("staging is mapped, so it fits");
            bytes[at..][..from.len()].copy_from_slice(from);
        };
        let mut next = 0;
        while let Some(slot) = self.out_of_date(next, patches) {
            let at = u64::from(staged.patches);
            if at == room {
                staged.more = true;
                break;
            }
            self.stale[slot as usize / 64] &= !(1 << (slot % 64));
            put(at * vertices, bytes_of(patches.vertices_of(slot)));
            push_copy(&mut copies.vertices, at * vertices, u64::from(slot) * vertices, vertices);
            if morphs > 0 {
                let from = room * vertices + at * morphs;
                put(from, bytes_of(morphs_of(patches, slot)));
                push_copy(&mut copies.morphs, from, u64::from(slot) * morphs, morphs);
            }
            if drapes > 0 {
                let from = room * (vertices + morphs) + at * drapes;
                put(from, bytes_of(&patches.drapes[slot as usize..][..1]));
                push_copy(&mut copies.drapes, from, u64::from(slot) * drapes, drapes);
            }
            staged.bytes += vertices + morphs + drapes;
            staged.patches += 1;
            next = slot + 1;
        }
        staged
    }

    /// Records the copies of what was staged.
    pub(crate) fn record(&self, device: &Device, buffer: vk::CommandBuffer, staging: &Staging) {
        let Staging { rows, copies } = staging;
        let all = [
            (Some(&self.vertices), &copies.vertices),
            (self.morphs.as_ref(), &copies.morphs),
            (self.drapes.as_ref(), &copies.drapes),
        ];
        for (to, regions) in all {
            if let Some(to) = to.filter(|_| !regions.is_empty()) {
                transfer::copies(device, buffer, (rows, to), regions);
            }
        }
    }

    /// The first live slot at or after `next` that is out of date.
    fn out_of_date(&self, mut next: u32, patches: &Patches) -> Option<u32> {
        while next < patches.used_end() {
            let left = self.stale[next as usize / 64] >> (next % 64);
            if left == 0 {
                next = (next / 64 + 1) * 64;
                continue;
            }
            next += left.trailing_zeros();
            if matches!(patches.leaf.get(next as usize), Some(Some(_))) {
                return Some(next);
            }
            next += 1;
        }
        None
    }
}

/// The morphs of one slot.
fn morphs_of(patches: &Patches, slot: u32) -> &[PatchMorph] {
    let per_patch = patches.vertices_per_patch as usize;
    &patches.morphs[slot as usize * per_patch..][..per_patch]
}

/// Adds a copy, or lengthens the last one where it goes on.
fn push_copy(copies: &mut Vec<vk::BufferCopy>, src_offset: u64, dst_offset: u64, size: u64) {
    if let Some(last) = copies.last_mut()
        && last.src_offset + last.size == src_offset
        && last.dst_offset + last.size == dst_offset
    {
        last.size += size;
        return;
    }
    copies.push(vk::BufferCopy { src_offset, dst_offset, size });
}

fn index_buffer(
    device: &Arc<Device>,
    one_off: &mut OneOff,
    pattern: &[u16],
) -> Result<Buffer, Fault> {
    let bytes = bytes_of(pattern);
    let size = bytes.len() as u64;
    let mut staging = Buffer::new(
        device,
        &BufferInfo {
            name: "patch indices, staged",
            bytes: size,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            location: MemoryLocation::CpuToGpu,
        },
    )?;
    staging.mapped_mut().copy_from_slice(bytes);
    let indices = Buffer::new(
        device,
        &BufferInfo {
            name: "patch indices",
            bytes: size,
            usage: vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            location: MemoryLocation::GpuOnly,
        },
    )?;
    let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
    one_off.run(|device, buffer| {
        transfer::copies(device, buffer, (&staging, &indices), &copy);
    })?;
    Ok(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_slots_become_one_copy() {
        let mut copies = Vec::new();
        for (at, slot) in [3_u64, 4, 5, 9].into_iter().enumerate() {
            push_copy(&mut copies, 40 * at as u64, 40 * slot, 40);
        }
        let list: Vec<_> = copies.iter().map(|c| (c.src_offset, c.dst_offset, c.size)).collect();
        assert_eq!(list, [(0, 120, 120), (120, 360, 40)]);
    }
}

//! Stage `place`: which patches are drawn in which depth range of which view.
//!
//! In:    cameras, depth borders, live patches.
//! Out:   the draws of each view, near to far; their digest.
//! Keeps: one list a chunk and range, so that chunks are independent.
//! Not here: matrices and draws of Vulkan (`overfly_render_vk`).

use super::patches::Patches;
use crate::camera::Camera;
use crate::digest::{Chain, bits, mix};
use crate::frame::data::{RangeDraws, ViewDraws};
use crate::settings::DepthSettings;

/// Patch slots in one chunk: some 10 µs of work.
pub const CHUNK: usize = 1024;

/// Ranges overlap by this share of their border, so that no pixel falls between two.
pub const OVERLAP: f64 = 1e-3;

/// Most depth ranges of a view.
pub const RANGES_MAX: usize = 8;

/// Scratch of one chunk of slots: the slots that touch each range.
pub struct Block {
    lists: Vec<Vec<u32>>,
    digest: u64,
}

impl Block {
    /// As many blocks as `patches` slots need, with room in every list.
    pub fn for_patches(patches: u32, ranges: usize) -> Vec<Self> {
        let block =
            || Self { lists: (0..ranges).map(|_| Vec::with_capacity(CHUNK)).collect(), digest: 0 };
        (0..(patches as usize).div_ceil(CHUNK)).map(|_| block()).collect()
    }
}

/// Near and far border of each range from near to far, overlap included; the last is open.
pub fn ranges_of(near_m: f64, depth: &DepthSettings) -> impl Iterator<Item = (f64, f64)> {
    let splits = &depth.splits_m;
    (0..=splits.len()).map(move |i| {
        let near = if i == 0 { near_m } else { splits[i - 1] * (1.0 - OVERLAP) };
        let far = splits.get(i).map_or(f64::INFINITY, |split| split * (1.0 + OVERLAP));
        (near, far)
    })
}

/// Draws with room for all patches in every range, for one view.
pub fn empty_draws(camera: Camera, depth: &DepthSettings, patches: u32) -> ViewDraws {
    let range = |(near_m, far_m)| RangeDraws {
        near_m,
        far_m,
        patches: Vec::with_capacity(patches as usize),
    };
    ViewDraws { camera, ranges: ranges_of(camera.near_m, depth).map(range).collect() }
}

/// Places the slots of one chunk in the ranges of one view.
pub fn place_block(patches: &Patches, view: &ViewDraws, chunk: usize, block: &mut Block) {
    block.lists.iter_mut().for_each(Vec::clear);
    block.digest = 0;
    let camera = &view.camera;
    let end = (patches.used_end() as usize).min((chunk + 1) * CHUNK);
    for slot in chunk * CHUNK..end {
        if patches.leaf[slot].is_none() {
            continue;
        }
        let (to_centre, radius_m) = (patches.centre[slot] - camera.eye.0, patches.radius_m[slot]);
        if camera.side_planes.iter().any(|plane| plane.dot(to_centre) < -radius_m) {
            continue;
        }
        let depth_m = camera.forward.dot(to_centre);
        for (index, range) in view.ranges.iter().enumerate() {
            if depth_m + radius_m >= range.near_m && depth_m - radius_m <= range.far_m {
                block.lists[index].push(u32::try_from(slot).expect("slots are counted in u32"));
                let tag = mix(patches.content[slot].wrapping_add(index as u64));
                block.digest = block.digest.wrapping_add(tag);
            }
        }
    }
}

/// Joins the chunks of one view in their order. Returns the digest of its draws.
pub fn join(blocks: &[Block], view: &mut ViewDraws) -> u64 {
    let mut sum = 0_u64;
    for range in &mut view.ranges {
        range.patches.clear();
    }
    for block in blocks {
        sum = sum.wrapping_add(block.digest);
        for (range, list) in view.ranges.iter_mut().zip(&block.lists) {
            range.patches.extend_from_slice(list);
        }
    }
    let camera = &view.camera;
    let mut chain = Chain(sum);
    for vector in [camera.eye.0, camera.right, camera.up, camera.forward] {
        vector.to_array().into_iter().for_each(|c| chain.add(bits(c)));
    }
    chain.add(bits(camera.pixels_per_radian));
    chain.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_cover_all_depths_and_overlap_slightly() {
        let depth = DepthSettings { splits_m: vec![30.0, 1e4] };
        let ranges: Vec<_> = ranges_of(0.1, &depth).collect();
        assert_eq!(ranges.len(), 3);
        assert_eq!(ranges[0].0, 0.1);
        assert_eq!(ranges[2].1, f64::INFINITY);
        for pair in ranges.windows(2) {
            assert!(pair[0].1 > pair[1].0 && pair[0].1 < pair[1].0 * 1.003);
        }
    }
}

//! Stage `place`: which patches are drawn in which depth range of which view.
//!
//! In:    cameras, depth borders, live patches.
//! Out:   the draws of each view, near to far; their digest.
//! Keeps: for each view one bit a slot and range, and how far the camera may move before a group
//!        of slots must be looked at again.
//! Not here: the geometry of that (`bounds`), matrices and draws of Vulkan (`overfly_render_vk`).
//!
//! The result is what testing every slot in every frame gives, to the last bit: a group is passed
//! over only while none of its bits can have changed and none of its slots has. 2.6 bytes a slot
//! and view, and 4 for each range that a list has room for.

use super::bounds::{Borders, GROUP, Mask, RANGES_MAX, Sides};
use super::lists::{expand, without_lowest};
use super::patches::Patches;
use crate::camera::Camera;
use crate::digest::{Chain, bits, mix};
use crate::frame::data::{RangeDraws, ViewDraws};
use crate::settings::DepthSettings;

/// Groups in one block.
const GROUPS: usize = BLOCK_SLOTS / GROUP;

/// Patch slots in one block: some 10 µs of work when all are looked at.
const BLOCK_SLOTS: usize = 1024;

/// Blocks in one chunk of the loop over [`Placed::begin`]'s.
pub const BLOCK_GRAIN: usize = 2;

/// Slots of a list in one chunk: some 2 µs of work.
pub const LIST_GRAIN: usize = 8192;

/// Ranges overlap by this share of their border, so that no pixel falls between two.
pub const OVERLAP: f64 = 1e-3;

/// One group of slots in one view, as of when they were last looked at.
#[derive(Clone, Copy)]
struct Group {
    masks: [Mask; RANGES_MAX],
    /// Sum of the hashes of what is drawn.
    sum: u64,
    /// Stamp of the slots; `NEVER` before the first look.
    stamp: u64,
    /// The odometers then.
    at: Odometers,
    per_m: f64,
    per_radian: f64,
}

const NEVER: u64 = u64::MAX;

/// 1024 slots of one view; blocks are independent.
#[derive(Clone)]
pub struct Block {
    groups: [Group; GROUPS],
    sum: u64,
    counts: [u32; RANGES_MAX],
    /// Where its slots begin in each range's list.
    starts: [u32; RANGES_MAX],
}

/// How far a camera has come: upper bounds, so they only ever grow.
#[derive(Clone, Copy, Default)]
struct Odometers {
    path_m: f64,
    turn_radians: f64,
}

/// What the blocks of one view are placed by.
#[derive(Clone, Copy)]
pub struct Aim {
    borders: Borders,
    now: Odometers,
}

/// One view's draws as bits.
pub struct Placed {
    blocks: Vec<Block>,
    aim: Option<Aim>,
}

impl Group {
    const EMPTY: Self = Self {
        masks: [0; RANGES_MAX],
        sum: 0,
        stamp: NEVER,
        at: Odometers { path_m: 0.0, turn_radians: 0.0 },
        per_m: 0.0,
        per_radian: 0.0,
    };

    /// Whether no bit can have changed. A NaN, from an odometer without end, says no.
    fn holds(&self, stamp: u64, now: &Odometers) -> bool {
        let moved_m = now.path_m - self.at.path_m;
        let turned = now.turn_radians - self.at.turn_radians;
        let spent = moved_m * (1.0 + turned) * self.per_m + turned * self.per_radian;
        // The thousandth is for the rounding of this line and the one above.
        self.stamp == stamp && spent < 0.999
    }

    /// Looks at the group anew.
    fn look(&mut self, (patches, group): (&Patches, usize), aim: &Aim, sides: &mut Sides) {
        let seen = patches.bounds[group].seen(&aim.borders, sides);
        let content = &patches.content[group * GROUP..];
        let stamp = patches.stamps[group];
        if self.stamp != stamp {
            // The hashes of the old contents are gone with them: the sum begins anew.
            (self.masks, self.sum, self.stamp) = ([0; RANGES_MAX], 0, stamp);
        }
        for (range, (old, new)) in (0_u64..).zip(self.masks.into_iter().zip(seen.masks)) {
            let hashes = |mask| sum_of(mask, |bit| mix(content[bit].wrapping_add(range)));
            let gone = hashes(old & !new);
            self.sum = self.sum.wrapping_add(hashes(new & !old)).wrapping_sub(gone);
        }
        self.masks = seen.masks;
        self.at = aim.now;
        (self.per_m, self.per_radian) = (seen.per_m, seen.per_radian);
    }
}

impl Odometers {
    /// Both further, rounded up: so that a difference never falls short of the way between.
    fn advance(&mut self, (path_m, turn_radians): (f64, f64)) {
        if path_m > 0.0 {
            self.path_m = (self.path_m + path_m).next_up();
        }
        if turn_radians > 0.0 {
            self.turn_radians = (self.turn_radians + turn_radians).next_up();
        }
    }

    fn is_finite(&self) -> bool {
        self.path_m.is_finite() && self.turn_radians.is_finite()
    }
}

impl Placed {
    /// Bits for `patches` slots; nothing has been looked at.
    pub fn new(patches: u32) -> Self {
        let block = Block {
            groups: [Group::EMPTY; GROUPS],
            sum: 0,
            counts: [0; RANGES_MAX],
            starts: [0; RANGES_MAX],
        };
        Self { blocks: vec![block; (patches as usize).div_ceil(BLOCK_SLOTS)], aim: None }
    }

    /// The view's camera has moved: what to place by, and the blocks to place, each by
    /// [`place_blocks`].
    pub fn begin(&mut self, view: &ViewDraws, patches: &Patches) -> (Aim, &mut [Block]) {
        let ranges = view.ranges.iter().map(|range| (range.near_m, range.far_m));
        let borders = Borders::new(&view.camera, ranges);
        let mut now = Odometers::default();
        match &self.aim {
            Some(last) if last.borders.same_ranges(&borders) && last.now.is_finite() => {
                now = last.now;
                now.advance(borders.moved(&last.borders));
            }
            _ => self.forget(),
        }
        let aim = Aim { borders, now };
        self.aim = Some(aim);
        let used = (patches.used_end() as usize).div_ceil(BLOCK_SLOTS);
        (aim, &mut self.blocks[..used])
    }

    fn forget(&mut self) {
        let groups = self.blocks.iter_mut().flat_map(|block| &mut block.groups);
        groups.for_each(|group| group.stamp = NEVER);
    }

    /// Makes the view's lists as long as they must be; each is then to be written by
    /// [`Placed::list`]. Returns the digest of the draws.
    pub fn count(&mut self, view: &mut ViewDraws) -> u64 {
        let mut sum = 0_u64;
        let mut ends = [0; RANGES_MAX];
        for block in &mut self.blocks {
            sum = sum.wrapping_add(block.sum);
            block.starts = ends;
            ends.iter_mut().zip(block.counts).for_each(|(end, count)| *end += count);
        }
        for (range, end) in view.ranges.iter_mut().zip(ends) {
            range.patches.resize(end as usize, 0);
        }
        chained(sum, &view.camera)
    }

    /// Writes a part of a range's list: from its entry `first` on, as many as `out` is long.
    pub fn list(&self, range: usize, first: usize, out: &mut [u32]) {
        let start_of = |block: &Block| block.starts[range] as usize;
        let after = self.blocks.partition_point(|block| start_of(block) <= first);
        let at = after.checked_sub(1).expect("the first block begins at entry 0");
        let mut skip = first - start_of(&self.blocks[at]);
        let groups = self.blocks[at..].iter().flat_map(|block| &block.groups);
        let mut written = 0;
        for (mask, group) in groups.map(|group| group.masks[range]).zip(at * GROUPS..) {
            if written == out.len() {
                break;
            }
            if mask == 0 {
                continue;
            }
            let mask = if skip == 0 { mask } else { without_lowest(mask, &mut skip) };
            let base = u32::try_from(group * GROUP).expect("slots are counted in u32");
            written += expand(mask, base, &mut out[written..]);
        }
    }
}

/// Sum of a hash of each set bit.
fn sum_of(mut mask: Mask, hash: impl Fn(usize) -> u64) -> u64 {
    let mut sum = 0_u64;
    while mask != 0 {
        sum = sum.wrapping_add(hash(mask.trailing_zeros() as usize));
        mask &= mask - 1;
    }
    sum
}

/// The digest of draws whose hashes add up to `sum`, for a camera.
fn chained(sum: u64, camera: &Camera) -> u64 {
    let mut chain = Chain(sum);
    for vector in [camera.eye.0, camera.right, camera.up, camera.forward] {
        vector.to_array().into_iter().for_each(|c| chain.add(bits(c)));
    }
    chain.add(bits(camera.pixels_per_radian));
    chain.0
}

/// Places the slots of some blocks, the first of which is block `first`.
pub fn place_blocks(patches: &Patches, aim: &Aim, first: usize, blocks: &mut [Block]) {
    let mut sides = Sides::EMPTY;
    for (block, at) in blocks.iter_mut().zip(first..) {
        let mut looked = false;
        for (group, at) in block.groups.iter_mut().zip(at * GROUPS..patches.stamps.len()) {
            if !group.holds(patches.stamps[at], &aim.now) {
                group.look((patches, at), aim, &mut sides);
                looked = true;
            }
        }
        if looked {
            let sums = block.groups.iter().map(|group| group.sum);
            block.sum = sums.fold(0, u64::wrapping_add);
            for (range, count) in block.counts.iter_mut().enumerate() {
                *count = block.groups.iter().map(|group| group.masks[range].count_ones()).sum();
            }
        }
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

#[cfg(test)]
mod tests;

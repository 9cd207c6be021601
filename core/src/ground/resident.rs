//! What is known about one resident page beyond its samples: ranges and errors block by block.
//!
//! In:    a page, and whether there is a sea.
//! Out:   least and greatest surface over any square of 4 to 64 cells, errors, safe ranges.
//! Keeps: the page and some 5 KiB about it.
//! Not here: finding pages (`map`), the surface between samples (`surface`).

use super::place::Cell;
use crate::datasource::Page;
use crate::datasource::key::{PAGE_BITS, PAGE_SIDE};
use crate::datasource::page::{BOUND_SIDE, BOUND_STRIDE, Bound};
use crate::geodesy::narrow;
use std::sync::Arc;

/// Halvings of a page's side down to a block of [`BOUND_STRIDE`] cells.
pub const BLOCK_BITS: u8 = PAGE_BITS - 2;
/// Blocks along one side.
pub const BLOCKS: usize = 1 << BLOCK_BITS;

/// Bounds on the error of the triangles over one block, in metres.
#[derive(Clone, Copy, Default)]
pub struct Errors {
    /// Of even levels.
    pub even_m: f32,
    /// Of odd levels.
    pub odd_m: f32,
}

impl Errors {
    /// The one for triangles of this level.
    pub fn of_level(self, level: u8) -> f64 {
        f64::from(if level.is_multiple_of(2) { self.even_m } else { self.odd_m })
    }
}

/// Least and greatest height of the surface above the ellipsoid in metres, rounded outward.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Nothing lies lower.
    pub low_m: f32,
    /// Nothing lies higher.
    pub high_m: f32,
}

impl Range {
    const EMPTY: Self = Self { low_m: f32::INFINITY, high_m: f32::NEG_INFINITY };

    fn with(self, other: Self) -> Self {
        Self { low_m: self.low_m.min(other.low_m), high_m: self.high_m.max(other.high_m) }
    }
}

/// One resident page.
pub struct Resident {
    /// The page.
    pub page: Arc<Page>,
    /// Range of the ground itself over the whole page, and of every surface that this page or a
    /// deeper one serves there.
    pub ground: Range,
    /// The greatest error over any block, in metres.
    pub error_max_m: f64,
    errors: [Errors; BLOCKS * BLOCKS],
    /// Of the samples: the page, its quarters, … its blocks.
    ranges: [Range; 341],
}

impl Resident {
    /// Looks through a page once.
    pub fn new(page: Arc<Page>, sea: bool) -> Self {
        let mut errors = [Errors::default(); BLOCKS * BLOCKS];
        let mut ranges = [Range::EMPTY; 341];
        let mut ground = Range::EMPTY;
        for by in 0..BLOCKS {
            for bx in 0..BLOCKS {
                let (range, error) = (block_range(&page, sea, bx, by), block_errors(&page, bx, by));
                errors[by * BLOCKS + bx] = error;
                ranges[place(BLOCK_BITS, bx, by)] = range;
                ground = ground.with(ground_of(range, error));
            }
        }
        for bits in (0..BLOCK_BITS).rev() {
            for at in 0..1_usize << (2 * bits) {
                let (x, y) = (at & ((1 << bits) - 1), at >> bits);
                let kid = |dx: usize, dy: usize| ranges[place(bits + 1, 2 * x + dx, 2 * y + dy)];
                let all = kid(0, 0).with(kid(1, 0)).with(kid(0, 1)).with(kid(1, 1));
                ranges[place(bits, x, y)] = all;
            }
        }
        let worst_m = errors.iter().map(|e| e.even_m.max(e.odd_m)).fold(0.0, f32::max);
        Self { page, ground, error_max_m: f64::from(worst_m), errors, ranges }
    }

    /// Reads a little of what a height in a cell will need, so that it is in the cache.
    #[inline]
    pub fn touch(&self, cell: Cell) -> u32 {
        let key = self.page.key;
        let (x, y) = cell.block(key);
        let sample = |corner| self.page.heights_m[cell.sample(key, corner)].to_bits();
        sample([0, 0]) ^ sample([0, 2]) ^ self.errors(x, y).even_m.to_bits()
    }

    /// Errors over block (x, y).
    pub fn errors(&self, x: usize, y: usize) -> Errors {
        self.errors[y * BLOCKS + x]
    }

    /// Range of the ground itself over block (x, y), and of every surface that this page or a
    /// deeper one serves there.
    pub fn block_ground(&self, x: usize, y: usize) -> Range {
        ground_of(self.range(BLOCK_BITS, x, y), self.errors(x, y))
    }

    /// Range of the samples over square (x, y) of the 2^bits · 2^bits that make the page.
    pub fn range(&self, bits: u8, x: usize, y: usize) -> Range {
        self.ranges[place(bits, x, y)]
    }
}

/// From the samples of a block and its errors: the plane of a triangle sags below its corners by
/// less than its error, and the ground may lie an error lower still.
fn ground_of(samples: Range, errors: Errors) -> Range {
    let slack_m = errors.even_m.max(errors.odd_m);
    Range {
        low_m: (samples.low_m - 2.0 * slack_m).next_down(),
        high_m: (samples.high_m + slack_m).next_up(),
    }
}

fn place(bits: u8, x: usize, y: usize) -> usize {
    let before = ((1_usize << (2 * bits)) - 1) / 3;
    before + (y << bits) + x
}

/// Range of the samples (i, j) with i and j in the square of `size` cells from (i0, j0).
pub fn sample_range(page: &Page, sea: bool, (i0, j0): (usize, usize), size: usize) -> Range {
    let mut range = Range::EMPTY;
    for j in j0..=j0 + size {
        for i in i0..=i0 + size {
            let surface_m = narrow(page.surface_m(j * PAGE_SIDE + i, sea));
            range = range.with(Range { low_m: surface_m, high_m: surface_m });
        }
    }
    Range { low_m: range.low_m.next_down(), high_m: range.high_m.next_up() }
}

fn block_range(page: &Page, sea: bool, bx: usize, by: usize) -> Range {
    sample_range(page, sea, (bx * BOUND_STRIDE, by * BOUND_STRIDE), BOUND_STRIDE)
}

fn block_errors(page: &Page, bx: usize, by: usize) -> Errors {
    let corner = |dx: usize, dy: usize| page.bounds[(by + dy) * BOUND_SIDE + bx + dx];
    let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let worst = |of: fn(&Bound) -> f32| corners.iter().map(of).fold(0.0, f32::max);
    Errors { even_m: worst(|b| b.error_even_m), odd_m: worst(|b| b.error_odd_m) }
}

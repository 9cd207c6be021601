//! The tiles of every layer, from its last level up to the roots.
//!
//! In:    layers over rasters.
//! Out:   records in a spool: heights, weights and what is known of everything finer.
//! Keeps: nothing.
//! Not here: heights at lattice points (`block`, `fit`), marks and bytes (`marks`, `write`).
//!
//! A coarser tile takes every second sample of its four children: a point has one height at all
//! depths. Errors add up on the way: between two consecutive lattice levels surfaces differ most at
//! the new points, so each level adds the greatest such difference to what the finer one has.

use crate::block::{Block, FINE, Layer, Square};
use crate::fit::fit;
use crate::raster::RasterError;
use crate::spool::{BLOCKS, MARKS, Record, Spool, Stat};
use overfly_core::datasource::key::PAGE_BITS;
use overfly_core::datasource::page::SAMPLES;
use overfly_core::datasource::tile::{FULL, MARK_SIDE, MARK_STRIDE};
use overfly_core::datasource::{PAGE_SIDE, PageKey};
use overfly_core::geodesy::narrow;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

/// Points around a block whose heights are fitted along, and roughness is read from.
const MARGIN: usize = 32;
/// Tiles along a side of a block.
const TILES: u32 = 4;
/// Roughness is looked at within so many samples of a mark.
const AROUND: usize = 4;
/// Second differences of this share of the step are as rough as it gets.
const ROUGHEST: f64 = 0.02;

/// Tiles that are made at once: `span` along each side from the first on.
struct Cut {
    quadrant: u8,
    first: [u32; 2],
    span: u32,
}

/// Why tiles could not be made.
#[derive(Debug)]
pub enum MakeError {
    /// A raster could not be read.
    Raster(RasterError),
    /// The spool could not be written or read.
    Spool(io::Error),
    /// It was asked to stop.
    Stopped,
}

impl From<RasterError> for MakeError {
    fn from(error: RasterError) -> Self {
        Self::Raster(error)
    }
}

impl From<io::Error> for MakeError {
    fn from(error: io::Error) -> Self {
        Self::Spool(error)
    }
}

/// A layer and how its heights become whole numbers.
pub struct Making<'a> {
    /// Index of the layer.
    pub index: u8,
    /// Its rasters.
    pub layer: Layer<'a>,
    /// Depth of its last level.
    pub depth: u8,
    /// Heights are multiples of this. Metres.
    pub quantum_m: f64,
    /// Postings are met to this.
    pub slack_m: f64,
    /// Metres of one step of the last level, about.
    pub step_m: f64,
    /// Radius of the body in metres.
    pub radius_m: f64,
}

impl Making<'_> {
    /// Keys of the last level's tiles that may have weight, in order.
    pub fn last_keys(&self) -> Vec<PageKey> {
        let mut keys: Vec<PageKey> = (0..4).map(PageKey::root).collect();
        for depth in 0..=self.depth {
            keys = keys.into_par_iter().filter(|&key| self.touches(key)).collect();
            if depth < self.depth {
                keys = keys.iter().flat_map(|key| (0..4).map(|i| key.child(i))).collect();
            }
        }
        keys.sort_unstable();
        keys
    }

    fn touches(&self, key: PageKey) -> bool {
        let first = [key.x(), key.y()].map(|at| i64::from(at) * 64);
        let square = Square { quadrant: key.quadrant(), first, side: PAGE_SIDE };
        self.layer.touches(&square, key.depth() + PAGE_BITS, self.radius_m)
    }

    /// Makes the last level's tiles; `done` is told how many at a time.
    ///
    /// # Errors
    /// If something cannot be read or written, or it was asked to stop.
    pub fn last_level(
        &self,
        keys: &[PageKey],
        spool: &Spool,
        stop: &AtomicBool,
        done: &(dyn Fn(u64) + Sync),
    ) -> Result<(), MakeError> {
        let span = TILES.min(1 << self.depth);
        let mut blocks: BTreeMap<(u8, u32, u32), Vec<PageKey>> = BTreeMap::new();
        for &key in keys {
            let place = (key.quadrant(), key.x() / span, key.y() / span);
            blocks.entry(place).or_default().push(key);
        }
        let blocks: Vec<_> = blocks.into_iter().collect();
        blocks.par_iter().try_for_each(|((quadrant, x, y), keys)| {
            if stop.load(Ordering::Relaxed) {
                return Err(MakeError::Stopped);
            }
            let cut = Cut { quadrant: *quadrant, first: [x * span, y * span], span };
            if !self.block(&cut, keys, spool)? {
                keys.iter().try_for_each(|key| self.single(*key, spool))?;
            }
            done(keys.len() as u64);
            Ok(())
        })
    }

    /// One tile by itself.
    fn single(&self, key: PageKey, spool: &Spool) -> Result<(), MakeError> {
        let cut = Cut { quadrant: key.quadrant(), first: [key.x(), key.y()], span: 1 };
        self.block(&cut, &[key], spool).map(drop)
    }

    /// The tiles of one block; `false` where it must be cut.
    fn block(&self, cut: &Cut, keys: &[PageKey], spool: &Spool) -> Result<bool, MakeError> {
        let &Cut { quadrant, first, span } = cut;
        let margin = i64::try_from(MARGIN).expect("small");
        let square = Square {
            quadrant,
            first: first.map(|at| i64::from(at) * 64 - margin),
            side: span as usize * 64 + 1 + 2 * MARGIN,
        };
        let Some(mut block) = self.layer.block(&square, span == 1)? else { return Ok(false) };
        fit(&mut block, self.slack_m);
        for key in keys {
            let at = [key.x() - first[0], key.y() - first[1]].map(|at| at as usize * 64 + MARGIN);
            let record = self.record(&block, square.side, at);
            if record.weights[0].iter().any(|&weight| weight > 0) {
                spool.put(self.index, *key, &record)?;
            }
        }
        Ok(true)
    }

    fn record(&self, block: &Block, side: usize, [column, row]: [usize; 2]) -> Box<Record> {
        let mut record = bytemuck::zeroed_box::<Record>();
        for at in 0..SAMPLES {
            let from = (row + at / PAGE_SIDE) * side + column + at % PAGE_SIDE;
            record.quanta[0][at] = self.quantum(block.heights[from]);
            #[expect(clippy::cast_possible_truncation, reason = "a weight is at most 1")]
            #[expect(clippy::cast_sign_loss, reason = "and at least 0")]
            let weight = (block.weights[from] * f32::from(FULL)).round() as u8;
            record.weights[0][at] = weight;
            record.filled[0][at] = u8::from(block.filled[from]);
        }
        for mark in 0..MARKS {
            let (i, j) = (mark % MARK_SIDE * MARK_STRIDE, mark / MARK_SIDE * MARK_STRIDE);
            record.roughness[0][mark] = self.roughness(block, side, [column + i, row + j]);
        }
        let nodes = Nodes::of(&record.quanta[0], &record.weights[0], self.quantum_m);
        for (b, stats) in record.stats.iter_mut().enumerate() {
            for (a, stat) in stats.iter_mut().enumerate() {
                *stat = nodes.stat([a, b]);
                stat.centre_m = nodes.centre_m([a, b]);
                stat.error_m = [nodes.odd_m([a, b]), 0.0];
                let first = b * MARK_SIDE + a;
                let corners = [first, first + 1, first + MARK_SIDE, first + MARK_SIDE + 1];
                let roughest = corners.into_iter().map(|mark| record.roughness[0][mark]).max();
                stat.roughest = roughest.map_or(0, u32::from);
            }
        }
        record
    }

    fn quantum(&self, height: i64) -> i32 {
        #[expect(clippy::cast_possible_truncation, reason = "heights are below 2^24 quanta")]
        let quanta = (height as f64 / FINE / self.quantum_m).round() as i32;
        quanta
    }

    /// Mean second difference around a mark, against the step; the quanta's own is left out.
    fn roughness(&self, block: &Block, side: usize, [column, row]: [usize; 2]) -> u8 {
        let around = |at: usize| at - AROUND..=at + AROUND;
        let places = around(row).flat_map(|j| around(column).map(move |i| j * side + i));
        let (mut sum, mut count) = (0.0, 0);
        for (at, next) in places.flat_map(|at| [(at, 1), (at, side)]) {
            if let Some(bend) = bend(block, at, next) {
                sum += bend.unsigned_abs() as f64;
                count += 1;
            }
        }
        if count == 0 {
            return 0;
        }
        let bend_m = sum / f64::from(count) / FINE / 2.0 - 0.35 * self.quantum_m;
        let rough = (bend_m / (ROUGHEST * self.step_m)).clamp(0.0, 1.0) * 15.0;
        #[expect(clippy::cast_possible_truncation, reason = "at most 15")]
        #[expect(clippy::cast_sign_loss, reason = "at least 0")]
        let rough = rough.round() as u8;
        rough
    }

    /// Makes the tiles of one depth from those one deeper.
    ///
    /// # Errors
    /// If something cannot be read or written, or it was asked to stop.
    pub fn coarser(&self, depth: u8, spool: &Spool, stop: &AtomicBool) -> Result<(), MakeError> {
        let mut keys: Vec<_> =
            spool.keys(self.index, depth + 1).into_iter().filter_map(PageKey::parent).collect();
        keys.sort_unstable();
        keys.dedup();
        keys.par_iter().try_for_each(|&key| {
            if stop.load(Ordering::Relaxed) {
                return Err(MakeError::Stopped);
            }
            let record = self.parent(key, spool)?;
            Ok(spool.put(self.index, key, &record)?)
        })
    }

    fn parent(&self, key: PageKey, spool: &Spool) -> Result<Box<Record>, MakeError> {
        let mut record = bytemuck::zeroed_box::<Record>();
        record.stats = [[Stat::NONE; BLOCKS]; BLOCKS];
        for index in 0..4 {
            let Some(child) = spool.get(self.index, key.child(index))? else { continue };
            take(&mut record, index, &child);
        }
        let nodes = Nodes::of(&record.quanta[0], &record.weights[0], self.quantum_m);
        for (b, stats) in record.stats.iter_mut().enumerate() {
            for (a, stat) in stats.iter_mut().enumerate() {
                stat.centre_m = nodes.centre_m([a, b]);
                stat.error_m[0] = nodes.odd_m([a, b]) + stat.error_m[1];
            }
        }
        Ok(record)
    }
}

/// Second difference at a point of a block, where all three points are seen.
fn bend(block: &Block, at: usize, next: usize) -> Option<i64> {
    let is_seen = [at - next, at, at + next].iter().all(|&at| block.weights[at] > 0.0);
    let heights = &block.heights;
    is_seen.then(|| heights[at - next] - 2 * heights[at] + heights[at + next])
}

/// Every second sample and mark of child `index`, and what its blocks are together.
fn take(record: &mut Record, index: usize, child: &Record) {
    let half = (PAGE_SIDE - 1) / 2;
    let (column, row) = (index % 2 * half, index / 2 * half);
    for (i, j) in cells(half + 1) {
        let (to, from) = ((row + j) * PAGE_SIDE + column + i, 2 * j * PAGE_SIDE + 2 * i);
        record.quanta[0][to] = child.quanta[0][from];
        record.weights[0][to] = child.weights[0][from];
        record.filled[0][to] = child.filled[0][from];
    }
    let half = BLOCKS / 2;
    let (column, row) = (index % 2 * half, index / 2 * half);
    for (i, j) in cells(half + 1) {
        let (to, from) = ((row + j) * MARK_SIDE + column + i, 2 * j * MARK_SIDE + 2 * i);
        record.roughness[0][to] = child.roughness[0][from];
    }
    for (a, b) in cells(half) {
        let parts = [0, 1].map(|y| [0, 1].map(|x| child.stats[2 * b + y][2 * a + x]));
        record.stats[row + b][column + a] = joined(parts.as_flattened());
    }
}

/// Columns and rows of a square, row by row.
fn cells(side: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..side).flat_map(move |j| (0..side).map(move |i| (i, j)))
}

/// What four blocks are together, seen one level coarser.
fn joined(parts: &[Stat]) -> Stat {
    let mut whole = Stat { full: 1, ..Stat::NONE };
    for part in parts {
        whole.error_m[1] = whole.error_m[1].max(part.centre_m + part.error_m[0]);
        whole.slope_m = whole.slope_m.max(part.slope_m);
        whole.range_m =
            [whole.range_m[0].min(part.range_m[0]), whole.range_m[1].max(part.range_m[1])];
        whole.full &= part.full;
        whole.roughest = whole.roughest.max(part.roughest);
    }
    whole
}

/// The samples of a tile.
struct Nodes<'a> {
    quanta: &'a [i32; SAMPLES],
    weights: &'a [u8; SAMPLES],
    quantum_m: f64,
}

impl<'a> Nodes<'a> {
    fn of(quanta: &'a [i32; SAMPLES], weights: &'a [u8; SAMPLES], quantum_m: f64) -> Self {
        Self { quanta, weights, quantum_m }
    }

    fn places([a, b]: [usize; 2]) -> impl Iterator<Item = (usize, usize)> {
        let (column, row) = (a * MARK_STRIDE, b * MARK_STRIDE);
        cells(MARK_STRIDE + 1).map(move |(i, j)| (column + i, row + j))
    }

    fn height_m(&self, (i, j): (usize, usize)) -> Option<f64> {
        let at = j * PAGE_SIDE + i;
        (self.weights[at] > 0).then(|| f64::from(self.quanta[at]) * self.quantum_m)
    }

    /// Distance of a sample from the middle of two others, where all three are seen.
    fn strays_m(&self, at: (usize, usize), ends: [(usize, usize); 2]) -> f64 {
        match (self.height_m(at), self.height_m(ends[0]), self.height_m(ends[1])) {
            (Some(at), Some(a), Some(b)) => (at - f64::midpoint(a, b)).abs(),
            _ => 0.0,
        }
    }

    /// How far the centres of cells stray from the diagonals through them.
    fn centre_m(&self, block: [usize; 2]) -> f32 {
        let mut most_m = 0.0_f64;
        for (i, j) in Self::places(block).filter(|(i, j)| i % 2 == 1 && j % 2 == 1) {
            let (rising, falling) =
                ([(i - 1, j - 1), (i + 1, j + 1)], [(i - 1, j + 1), (i + 1, j - 1)]);
            let ends = if (i / 2) % 2 == (j / 2) % 2 { rising } else { falling };
            most_m = most_m.max(self.strays_m((i, j), ends));
        }
        narrow(most_m)
    }

    /// How far the middles of the next coarser grid's sides stray from them.
    fn odd_m(&self, block: [usize; 2]) -> f32 {
        let mut most_m = 0.0_f64;
        for (i, j) in Self::places(block) {
            let ends = match (i % 2, j % 2) {
                (1, 0) => [(i - 1, j), (i + 1, j)],
                (0, 1) => [(i, j - 1), (i, j + 1)],
                _ => continue,
            };
            most_m = most_m.max(self.strays_m((i, j), ends));
        }
        narrow(most_m)
    }

    /// Heights, steps and weights of a block of the last level.
    fn stat(&self, block: [usize; 2]) -> Stat {
        let mut stat = Stat { full: 1, ..Stat::NONE };
        for (i, j) in Self::places(block) {
            stat.full &= u32::from(self.weights[j * PAGE_SIDE + i] == FULL);
            let Some(height_m) = self.height_m((i, j)) else { continue };
            let range = &mut stat.range_m;
            *range = [range[0].min(narrow(height_m)), range[1].max(narrow(height_m))];
            for next in [(i + 1, j), (i, j + 1)] {
                let inside = next.0 < PAGE_SIDE && next.1 < PAGE_SIDE;
                let next_m = inside.then(|| self.height_m(next)).flatten();
                let step_m = next_m.map_or(0.0, |next_m| (next_m - height_m).abs());
                stat.slope_m = stat.slope_m.max(narrow(step_m));
            }
        }
        stat
    }
}

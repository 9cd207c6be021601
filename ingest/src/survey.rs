//! One raster looked at as a whole, and windows of it without voids.
//!
//! In:    a raster.
//! Out:   its range and voids; windows in which every posting has a height.
//! Keeps: a coarse picture of the raster, from which wide voids are filled.
//! Not here: formats (`raster`), the lattice (`block`).
//!
//! A void is filled from around it: each round of [`RIM`] gives the voids next to a height the mean
//! of their neighbours. The farther from a height, the more a coarse picture shows through, which
//! has no voids: the lowest of each block, since wide voids are mostly water, and blocks without
//! any height filled from those around them; what is within [`SEA_M`] of sea level there is the
//! sea. So a filled height depends on the raster alone, not on the window that asks for it.

use crate::raster::{Raster, RasterError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Postings from a void's edge to where the coarse picture alone fills it.
pub const RIM: usize = 16;
/// A wide void as close to sea level is taken for the sea: height 0.
pub const SEA_M: f32 = 10.0;
/// Blocks of the coarse picture along the longer side of a raster.
const BLOCKS: usize = 128;
/// Postings read at once while a raster is looked at.
const BAND_POSTINGS: usize = 1 << 20;

/// What was found in a raster.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Least and greatest height in metres; the least is above the greatest where all is void.
    pub range_m: [f32; 2],
    /// Postings without a height.
    pub voids: u64,
    /// Whether every height is a whole number of metres.
    pub whole_metres: bool,
    coarse: Coarse,
}

#[derive(Clone, Debug)]
struct Coarse {
    block: usize,
    columns: usize,
    rows: usize,
    heights_m: Vec<f32>,
}

/// A window of a raster in which every posting has a height.
pub struct Window {
    /// Column and row of its first posting.
    pub first: [i64; 2],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Heights in metres, row by row.
    pub heights_m: Vec<f32>,
    /// Whether the raster has no height there.
    pub void: Vec<bool>,
}

/// The lowest of the blocks in one band of rows, and what else was seen there.
struct Band {
    lowest_m: Vec<f32>,
    range_m: [f32; 2],
    voids: u64,
    whole_metres: bool,
}

impl Survey {
    /// Reads the whole raster once. `None` if `stop` was raised.
    ///
    /// # Errors
    /// If the raster cannot be read.
    pub fn of(raster: &Raster, stop: &AtomicBool) -> Result<Option<Self>, RasterError> {
        let (columns, rows) = (raster.grid.columns as usize, raster.grid.rows as usize);
        let block = columns.max(rows).div_ceil(BLOCKS).max(1);
        let across = columns.div_ceil(block);
        let bands: Result<Vec<_>, _> = (0..rows.div_ceil(block))
            .into_par_iter()
            .map(|band| {
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                Band::read(raster, band * block, block.min(rows - band * block), block).map(Some)
            })
            .collect();
        let Some(bands) = bands?.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };
        let mut survey = Self {
            range_m: [f32::MAX, f32::MIN],
            voids: 0,
            whole_metres: true,
            coarse: Coarse { block, columns: across, rows: bands.len(), heights_m: Vec::new() },
        };
        for band in &bands {
            survey.range_m[0] = survey.range_m[0].min(band.range_m[0]);
            survey.range_m[1] = survey.range_m[1].max(band.range_m[1]);
            survey.voids += band.voids;
            survey.whole_metres &= band.whole_metres;
            survey.coarse.heights_m.extend(&band.lowest_m);
        }
        survey.coarse.fill();
        Ok(Some(survey))
    }

    /// The window without voids. Columns run round the body or end at the border's heights; rows
    /// run over a pole where the raster reaches it, or end.
    ///
    /// # Errors
    /// If the raster cannot be read.
    pub fn window(
        &self,
        raster: &Raster,
        first: [i64; 2],
        [width, height]: [usize; 2],
    ) -> Result<Window, RasterError> {
        let rim = if self.voids > 0 { RIM } else { 0 };
        let wide = [width + 2 * rim, height + 2 * rim];
        let start = first.map(|at| at - i64::try_from(rim).expect("small"));
        let mut heights_m = read(raster, start, wide)?;
        let void: Vec<bool> = heights_m.iter().map(|height| height.is_nan()).collect();
        if void.contains(&true) {
            self.fill(&mut heights_m, start, wide);
        }
        let crop = |at: usize| {
            let row = (at / width + rim) * wide[0];
            row + at % width + rim
        };
        Ok(Window {
            first,
            width,
            height,
            heights_m: (0..width * height).map(|at| heights_m[crop(at)]).collect(),
            void: (0..width * height).map(|at| void[crop(at)]).collect(),
        })
    }

    fn fill(&self, heights_m: &mut [f32], start: [i64; 2], [width, height]: [usize; 2]) {
        let mut rounds = vec![0_u8; heights_m.len()];
        let mut todo: Vec<usize> =
            (0..heights_m.len()).filter(|&at| heights_m[at].is_nan()).collect();
        let last = u8::try_from(RIM).expect("small");
        for round in 1..=last {
            let mut found = Vec::new();
            todo.retain(|&at| {
                let mean_m = mean_near(heights_m, at, [width, height]);
                found.extend(mean_m.map(|mean_m| (at, mean_m)));
                mean_m.is_none()
            });
            for (at, height_m) in found {
                (heights_m[at], rounds[at]) = (height_m, round);
            }
        }
        for (at, height_m) in heights_m.iter_mut().enumerate() {
            let is_far = height_m.is_nan();
            if rounds[at] == 0 && !is_far {
                continue;
            }
            let place = [at % width, at / width].map(|along| i64::try_from(along).expect("small"));
            let coarse_m = self.coarse.at([start[0] + place[0], start[1] + place[1]]);
            // Near heights they alone count: a narrow void is bridged.
            let share = 2.0 * f32::from(rounds[at]) / f32::from(last) - 1.0;
            let share = share.max(0.0);
            *height_m = if is_far { coarse_m } else { *height_m + (coarse_m - *height_m) * share };
        }
    }
}

/// Mean of the known heights next to a posting, diagonally too; `None` where there are none.
fn mean_near(heights_m: &[f32], at: usize, [width, height]: [usize; 2]) -> Option<f32> {
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let near = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
    let (mut sum, mut count) = (0.0, 0);
    for height_m in near.map(|at| heights_m[at]).filter(|height| !height.is_nan()) {
        (sum, count) = (sum + f64::from(height_m), count + 1);
    }
    (count > 0).then(|| mean(sum, count))
}

impl Band {
    fn read(
        raster: &Raster,
        first_row: usize,
        rows: usize,
        block: usize,
    ) -> Result<Self, RasterError> {
        let columns = raster.grid.columns as usize;
        let mut band = Self {
            lowest_m: vec![f32::NAN; columns.div_ceil(block)],
            range_m: [f32::MAX, f32::MIN],
            voids: 0,
            whole_metres: true,
        };
        let at_once = (BAND_POSTINGS / columns).clamp(1, rows);
        let mut heights_m = Vec::new();
        for from in (0..rows).step_by(at_once) {
            let count = at_once.min(rows - from);
            let row = i64::try_from(first_row + from).expect("rows fit");
            raster.window(0, row, columns, count, &mut heights_m)?;
            for (at, &height_m) in heights_m.iter().enumerate() {
                band.add(at % columns / block, height_m);
            }
        }
        Ok(band)
    }

    fn add(&mut self, block: usize, height_m: f32) {
        if height_m.is_nan() {
            self.voids += 1;
            return;
        }
        self.range_m = [self.range_m[0].min(height_m), self.range_m[1].max(height_m)];
        self.whole_metres &= height_m == height_m.round();
        let lowest_m = &mut self.lowest_m[block];
        *lowest_m = lowest_m.min(height_m);
    }
}

impl Coarse {
    /// Blocks without a height take the mean of their neighbours, round by round.
    fn fill(&mut self) {
        if self.heights_m.iter().all(|height| height.is_nan()) {
            self.heights_m.fill(0.0);
        }
        let hollow: Vec<usize> =
            (0..self.heights_m.len()).filter(|&at| self.heights_m[at].is_nan()).collect();
        let mut left = hollow.len();
        while left > 0 {
            let found: Vec<_> = hollow
                .iter()
                .filter(|&&at| self.heights_m[at].is_nan())
                .filter_map(|&at| Some((at, self.around(at)?)))
                .collect();
            left -= found.len();
            found.into_iter().for_each(|(at, height_m)| self.heights_m[at] = height_m);
        }
        for _ in 0..32 {
            let smooth: Vec<_> =
                hollow.iter().filter_map(|&at| Some((at, self.around(at)?))).collect();
            smooth.into_iter().for_each(|(at, height_m)| self.heights_m[at] = height_m);
        }
    }

    fn around(&self, at: usize) -> Option<f32> {
        let (x, y) = (at % self.columns, at / self.columns);
        let (mut sum, mut count) = (0.0, 0);
        let mut add = |at: usize| {
            let height_m = self.heights_m[at];
            if !height_m.is_nan() {
                (sum, count) = (sum + f64::from(height_m), count + 1);
            }
        };
        if x > 0 {
            add(at - 1);
        }
        if x + 1 < self.columns {
            add(at + 1);
        }
        if y > 0 {
            add(at - self.columns);
        }
        if y + 1 < self.rows {
            add(at + self.columns);
        }
        (count > 0).then(|| mean(sum, count))
    }

    /// Bilinear between the middles of blocks; the sea is flat.
    fn at(&self, posting: [i64; 2]) -> f32 {
        let place = |along: i64, count: usize| {
            let at = (along as f64 + 0.5) / self.block as f64 - 0.5;
            let at = at.clamp(0.0, (count - 1) as f64);
            // Non-negative and small.
            #[expect(clippy::cast_possible_truncation, reason = "clamped to the picture")]
            let cell = (at as usize).min(count.saturating_sub(2));
            (cell, at - cell as f64)
        };
        let ((i, a), (j, b)) = (place(posting[0], self.columns), place(posting[1], self.rows));
        let at = |i: usize, j: usize| {
            let (i, j) = (i.min(self.columns - 1), j.min(self.rows - 1));
            f64::from(self.heights_m[j * self.columns + i])
        };
        let lower = at(i, j) * (1.0 - a) + at(i + 1, j) * a;
        let upper = at(i, j + 1) * (1.0 - a) + at(i + 1, j + 1) * a;
        let height_m = overfly_core::geodesy::narrow(lower * (1.0 - b) + upper * b);
        if height_m.abs() <= SEA_M { 0.0 } else { height_m }
    }
}

fn mean(sum: f64, count: u64) -> f32 {
    overfly_core::geodesy::narrow(sum / count as f64)
}

/// Heights of a window that may run over the raster's borders.
fn read(
    raster: &Raster,
    [x0, y0]: [i64; 2],
    [width, height]: [usize; 2],
) -> Result<Vec<f32>, RasterError> {
    let (columns, rows) = (i64::from(raster.grid.columns), i64::from(raster.grid.rows));
    let mut out = Vec::with_capacity(width * height);
    let mut part = Vec::new();
    let mut row = 0;
    while row < height {
        let y = y0 + i64::try_from(row).expect("small");
        let inside = (0..rows).contains(&y);
        let run = if inside {
            let left = usize::try_from(rows - y).unwrap_or(usize::MAX);
            left.min(height - row)
        } else {
            1
        };
        let (shift, y) = if inside { (0, y) } else { beyond(raster, y) };
        read_columns(raster, [x0 + shift, y], [width, run], columns, &mut part)?;
        out.extend_from_slice(&part);
        row += run;
    }
    Ok(out)
}

/// Where the row beyond the raster's end comes from: half-way round the body and back from the
/// pole, or the last row.
fn beyond(raster: &Raster, y: i64) -> (i64, i64) {
    let grid = &raster.grid;
    let rows = i64::from(grid.rows);
    let is_round = grid.wraps && grid.projection == crate::raster::Projection::PlateCarree;
    let half = i64::from(grid.columns) / 2;
    // Rows from the pole to row 0, and from the last row to the other pole.
    let to_pole = |lat_deg: f64| (90.0 - lat_deg.abs()) / grid.step[1].abs();
    let last_deg = grid.origin[1] + grid.step[1] * (rows - 1) as f64;
    let (gap, back) =
        if y < 0 { (to_pole(grid.origin[1]), -y) } else { (to_pole(last_deg), y - (rows - 1)) };
    #[expect(clippy::cast_possible_truncation, reason = "at most two rows")]
    let mirrored = back - (2.0 * gap).round().clamp(0.0, 2.0) as i64;
    let reaches = is_round && gap < 0.75 && (0..rows).contains(&mirrored);
    match (reaches, y < 0) {
        (true, true) => (half, mirrored),
        (true, false) => (half, rows - 1 - mirrored),
        (false, _) => (0, y.clamp(0, rows - 1)),
    }
}

fn read_columns(
    raster: &Raster,
    [x0, y]: [i64; 2],
    [width, run]: [usize; 2],
    columns: i64,
    out: &mut Vec<f32>,
) -> Result<(), RasterError> {
    if raster.grid.wraps {
        return raster.window(x0, y, width, run, out);
    }
    let end = x0 + i64::try_from(width).expect("small");
    let (from, to) = (x0.clamp(0, columns - 1), end.clamp(1, columns));
    let (from, to) = (from.min(to - 1), to.max(from + 1));
    let inner = usize::try_from(to - from).expect("at least one column");
    if (from, to) == (x0, end) {
        return raster.window(x0, y, width, run, out);
    }
    let mut part = Vec::new();
    raster.window(from, y, inner, run, &mut part)?;
    out.clear();
    for row in part.chunks_exact(inner) {
        out.extend(
            (x0..end).map(|x| row[usize::try_from(x.clamp(from, to - 1) - from).expect("≥ 0")]),
        );
    }
    Ok(())
}

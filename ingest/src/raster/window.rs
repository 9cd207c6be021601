//! A window of postings, put together from chunks.
//!
//! In:    a raster and a rectangle, in postings.
//! Out:   heights row by row, NaN where void and outside.
//! Keeps: nothing itself; chunks stay in the store.
//! Not here: decoding (each format), interpolation (the caller).

use super::samples::Samples;
use super::{Raster, RasterError};
use std::ops::Range;
use std::sync::Arc;

/// Most postings read at once: 128 MiB of f32.
pub const WINDOW_POSTINGS_MAX: usize = 1 << 25;

/// A run of columns that lie side by side in the raster.
struct Run {
    /// First column in the window.
    to: usize,
    /// Columns in the raster.
    from: Range<u64>,
}

impl Raster {
    /// Heights of a window whose upper left posting is (`x0`, `y0`), row by row, southwards.
    ///
    /// `out` is cleared and filled with `width` × `height` metres, at most
    /// [`WINDOW_POSTINGS_MAX`] of them. NaN where the file has a void and outside of the grid;
    /// columns go on round the body where the grid wraps.
    #[expect(clippy::too_many_arguments, reason = "a rectangle of four plain numbers")]
    pub fn window(
        &self,
        x0: i64,
        y0: i64,
        width: usize,
        height: usize,
        out: &mut Vec<f32>,
    ) -> Result<(), RasterError> {
        out.clear();
        let postings = width.checked_mul(height).filter(|&count| count <= WINDOW_POSTINGS_MAX);
        let Some(postings) = postings else {
            return Err(RasterError::WindowTooLarge { width, height });
        };
        out.resize(postings, f32::NAN);
        if postings == 0 {
            return Ok(());
        }
        let runs = self.runs(x0, width);
        let (skipped, rows) = overlap(y0, height, self.grid.rows);
        let mut row = rows.start;
        while row < rows.end {
            let band = self.band(row, rows.end);
            let first = skipped + to_usize(row - rows.start);
            let lines = to_usize(band.end - band.start);
            let out = &mut out[first * width..(first + lines) * width];
            for run in &runs {
                self.fill(run, &band, width, out)?;
            }
            row = band.end;
        }
        Ok(())
    }

    /// The rows from `row` on that come from the same row of chunks.
    fn band(&self, row: u64, end: u64) -> Range<u64> {
        let (tall, rows) = (u64::from(self.chunks.height), u64::from(self.grid.rows));
        let next = if self.chunks.flipped {
            let in_file = rows - 1 - row;
            rows - in_file / tall * tall
        } else {
            (row / tall + 1) * tall
        };
        row..next.min(end)
    }

    /// The window's columns as runs within the raster; round the body, if it goes round.
    fn runs(&self, x0: i64, width: usize) -> Vec<Run> {
        let columns = u64::from(self.grid.columns);
        if !self.grid.wraps {
            let (to, from) = overlap(x0, width, self.grid.columns);
            return if from.is_empty() { Vec::new() } else { vec![Run { to, from }] };
        }
        let mut runs = Vec::new();
        let mut to = 0;
        let mut start = x0.rem_euclid(i64::from(self.grid.columns)).unsigned_abs();
        while to < width {
            let count = to_usize(columns - start).min(width - to);
            runs.push(Run { to, from: start..start + to_u64(count) });
            to += count;
            start = 0;
        }
        runs
    }

    /// Copies one run of columns of one band of rows.
    fn fill(
        &self,
        run: &Run,
        band: &Range<u64>,
        width: usize,
        out: &mut [f32],
    ) -> Result<(), RasterError> {
        let wide = u64::from(self.chunks.width);
        let mut column = run.from.start;
        while column < run.from.end {
            let end = ((column / wide + 1) * wide).min(run.from.end);
            let first = run.to + to_usize(column - run.from.start);
            let samples = self.chunk(column, band.start)?;
            for (line, row) in band.clone().enumerate() {
                let start = line * width + first;
                let to = &mut out[start..start + to_usize(end - column)];
                samples.heights(self.in_chunk(column, row), &self.transfer, to);
            }
            column = end;
        }
        Ok(())
    }

    /// Row of the file that holds a row of the grid.
    fn file_row(&self, row: u64) -> u64 {
        if self.chunks.flipped { u64::from(self.grid.rows) - 1 - row } else { row }
    }

    fn chunk_number(&self, column: u64, row: u64) -> u64 {
        let down = self.file_row(row) / u64::from(self.chunks.height);
        down * self.chunks.across(&self.grid) + column / u64::from(self.chunks.width)
    }

    /// Where a posting lies in its chunk.
    fn in_chunk(&self, column: u64, row: u64) -> usize {
        let chunk = self.chunk_number(column, row);
        let stride = u64::from(self.chunks.extent(&self.grid, chunk)[0]);
        let row = self.file_row(row) % u64::from(self.chunks.height);
        to_usize(row * stride + column % u64::from(self.chunks.width))
    }

    /// The chunk of a posting, decoded now unless it is at hand.
    fn chunk(&self, column: u64, row: u64) -> Result<Arc<Samples>, RasterError> {
        let number = self.chunk_number(column, row);
        let key = (self.number, number);
        if let Some(samples) = self.store.get(key) {
            return Ok(samples);
        }
        let [width, height] = self.chunks.extent(&self.grid, number).map(u64::from);
        let bytes = to_usize(width * height * u64::from(self.chunks.number_bytes));
        self.store.load(key, bytes, || self.source.decode(self, number))
    }
}

/// The part of `start..start + count` that lies in `0..total`: how many are before it, and it.
fn overlap(start: i64, count: usize, total: u32) -> (usize, Range<u64>) {
    let count = i64::try_from(count).unwrap_or(i64::MAX);
    let first = start.clamp(0, i64::from(total));
    let last = start.saturating_add(count).clamp(first, i64::from(total));
    let skipped = if first == last { 0 } else { first.abs_diff(start) };
    (to_usize(skipped), first.unsigned_abs()..last.unsigned_abs())
}

fn to_usize(count: u64) -> usize {
    usize::try_from(count).expect("counts of postings in memory fit into memory")
}

fn to_u64(count: usize) -> u64 {
    u64::try_from(count).expect("usize has at most 64 bits")
}

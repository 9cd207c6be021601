//! Which pixels are looked at: one place in each cell of a grid over the picture.
//!
//! In:    size of the picture, how many rays, seed, frame.
//! Out:   [`Grid`]: pixels in f64, the same on every machine.
//! Keeps: nothing.
//! Not here: what the rays meet (`trace`, `raster`).

use glam::DVec2;
use overfly_core::digest::mix;

/// A grid of strata with one ray in each.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Grid {
    /// Strata in a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    size_px: [f64; 2],
    /// None where rays go through the middles of strata.
    seed: Option<u64>,
}

impl Grid {
    /// The coarsest grid of nearly square strata with at least `rays` of them.
    pub fn new(size_px: [f64; 2], rays: u32, (seed, frame): (u64, u64)) -> Self {
        let [width, height] = size_px;
        let side_px = (width * height / f64::from(rays.max(1))).sqrt();
        let across = |length_px: f64| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
            let count = (length_px / side_px).ceil() as u32;
            count.max(1)
        };
        let (columns, rows) = (across(width), across(height));
        Self { columns, rows, size_px, seed: Some(mix(seed ^ mix(frame))) }
    }

    /// The middles of all pixels, where a rasteriser looks.
    pub fn of_pixels([columns, rows]: [u32; 2]) -> Self {
        Self { columns, rows, size_px: [columns, rows].map(f64::from), seed: None }
    }

    /// How many rays.
    pub fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// Never: there is at least one stratum.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Pixel of ray (column, row).
    pub fn pixel(&self, column: u32, row: u32) -> DVec2 {
        let share = |bits: u64| (bits & 0xffff_ffff) as f64 / f64::from(u32::MAX);
        let [right, down] = self.seed.map_or([0.5; 2], |seed| {
            let bits = mix(seed.wrapping_add(u64::from(row) << 32 | u64::from(column)));
            [share(bits), share(bits >> 32)]
        });
        let [width, height] = self.size_px;
        DVec2::new(
            (f64::from(column) + right) * width / f64::from(self.columns),
            (f64::from(row) + down) * height / f64::from(self.rows),
        )
    }

    /// Width and height of a stratum in pixels.
    pub fn stratum_px(&self) -> DVec2 {
        let [width, height] = self.size_px;
        DVec2::new(width / f64::from(self.columns), height / f64::from(self.rows))
    }
}

//! One page: heights, normals, hidden layers, bounds, colour of a cell of the octahedral square.
//!
//! In:    filled by `generate`, on the host's loader threads.
//! Out:   samples by lattice point; bounds around a lattice point.
//! Keeps: its own arrays.
//! Not here: which pages are resident (`pages`).

use super::colour::ColourTile;
use super::key::{PAGE_SIDE, PageKey};
use crate::lattice::unfold;
use glam::IVec3;
use std::sync::Arc;

/// Samples of a page.
pub const SAMPLES: usize = PAGE_SIDE * PAGE_SIDE;
/// Bounds are kept for every fourth sample.
pub const BOUND_STRIDE: usize = 4;
/// Bounds along one side of a page.
pub const BOUND_SIDE: usize = (PAGE_SIDE - 1) / BOUND_STRIDE + 1;

/// What is known about the ground around one place, between and below the samples.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Bound {
    /// Bound on the height between the ground and the triangles of odd levels that this page
    /// serves, the ellipsoid's sagitta included. Metres.
    pub error_odd_m: f32,
    /// The same for even levels.
    pub error_even_m: f32,
    /// The same for all levels that finer pages serve: a needle stays one, sagitta does not.
    pub error_finer_m: f32,
    /// Bound on the difference in height to any place that a descendant of a diamond drawn from
    /// this page can reach. Metres.
    pub variation_m: f32,
}

impl Bound {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        error_odd_m: f32::INFINITY,
        error_even_m: f32::INFINITY,
        error_finer_m: f32::INFINITY,
        variation_m: f32::INFINITY,
    };

    fn max(self, other: Self) -> Self {
        let max = |a: f32, b: f32| if a > b { a } else { b };
        Self {
            error_odd_m: max(self.error_odd_m, other.error_odd_m),
            error_even_m: max(self.error_even_m, other.error_even_m),
            error_finer_m: max(self.error_finer_m, other.error_finer_m),
            variation_m: max(self.variation_m, other.variation_m),
        }
    }
}

/// Where a sample comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(u8)]
pub enum Origin {
    /// The procedural planet alone, or nothing where a scene has none.
    #[default]
    Procedural,
    /// Real elevation.
    Measured,
    /// A void of the real elevation, filled from around it or from coarser data.
    Filled,
}

/// What real elevation adds to a page: 21 KiB.
#[derive(Clone, PartialEq, Debug)]
pub struct Survey {
    /// Height of sea level above the ellipsoid at each sample: the geoid's undulation in metres.
    pub sea_level_m: [f32; SAMPLES],
    /// Bound on the difference of sea level to any place that a descendant of a diamond drawn from
    /// this page can reach. Metres.
    pub sea_level_variation_m: f32,
    /// Where each sample comes from.
    pub origin: [Origin; SAMPLES],
}

/// One page: about 54 KiB, all of it inline but the survey and the colour.
#[derive(Clone, PartialEq, Debug)]
pub struct Page {
    /// Which cell.
    pub key: PageKey,
    /// Heights above sea level in metres; sample (i, j) at `j * PAGE_SIDE + i`. Sea level is the
    /// ellipsoid where there is no survey.
    pub heights_m: [f32; SAMPLES],
    /// Body-fixed ground normals, octahedral encoding, ±32767 is ±1.
    pub normals: [[i16; 2]; SAMPLES],
    /// Roughness, rock, moisture, temperature.
    pub layers: [[u8; 4]; SAMPLES],
    /// Bounds; (i, j) at `j * BOUND_SIDE + i`.
    pub bounds: [Bound; BOUND_SIDE * BOUND_SIDE],
    /// What real elevation knows; pages of procedural planets have none.
    pub survey: Option<Box<Survey>>,
    /// The imagery of exactly this cell. Cells deeper than a scene's imagery have none: there the
    /// nearest ancestor's is seen.
    pub colour: Option<Arc<ColourTile>>,
    /// Hash of all of the above.
    pub content: u64,
}

impl Page {
    /// Bytes that it takes with its survey and its colour.
    pub fn bytes(&self) -> usize {
        let survey = if self.survey.is_some() { size_of::<Survey>() } else { 0 };
        let colour =
            self.colour.as_ref().map_or(0, |tile| size_of_val(&**tile) + size_of_val(&*tile.rgba));
        size_of::<Self>() + survey + colour
    }

    /// Index of the sample at a lattice point of this page.
    ///
    /// # Panics
    /// In debug builds, if the point is not a sample of this page.
    pub fn sample_index(&self, point: IVec3) -> usize {
        let (i, j) = self.cell(point, self.key.step());
        j * PAGE_SIDE + i
    }

    /// Sea level above the ellipsoid at sample `at`, in metres.
    pub fn sea_level_m(&self, at: usize) -> f64 {
        self.survey.as_ref().map_or(0.0, |survey| f64::from(survey.sea_level_m[at]))
    }

    /// Bound on how much sea level differs within reach of this page's diamonds, in metres.
    pub fn sea_level_variation_m(&self) -> f64 {
        self.survey.as_ref().map_or(0.0, |survey| f64::from(survey.sea_level_variation_m))
    }

    /// Height of the drawn surface above the ellipsoid at sample `at`, in metres: the ground, or
    /// where there is a sea and the ground lies below its level, the water.
    pub fn surface_m(&self, at: usize, sea: bool) -> f64 {
        let ground_m = f64::from(self.heights_m[at]);
        self.sea_level_m(at) + if sea && ground_m < 0.0 { 0.0 } else { ground_m }
    }

    /// The bound around a lattice point of this page: the worst of the kept ones that enclose it,
    /// so that pages which share the point agree.
    pub fn bound_at(&self, point: IVec3) -> Bound {
        let (i, j) = self.cell(point, self.key.step());
        let ends = |at: usize| [at / BOUND_STRIDE, at.div_ceil(BOUND_STRIDE)];
        let mut worst = Bound::default();
        for row in ends(j) {
            for column in ends(i) {
                worst = worst.max(self.bounds[row * BOUND_SIDE + column]);
            }
        }
        worst
    }

    fn cell(&self, point: IVec3, step: i32) -> (usize, usize) {
        let (u, v) = unfold(self.key.quadrant(), point);
        let (u0, v0) = self.key.origin();
        debug_assert!((u - u0) % step == 0 && (v - v0) % step == 0, "{point} is no sample");
        let place = |along: i32| usize::try_from(along / step).expect("the point is in the page");
        (place(u - u0), place(v - v0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::colour::COLOUR_TEXELS;
    use super::*;

    #[test]
    fn a_page_without_imagery_costs_what_it_did_before_there_was_any() {
        // So many bytes divide a scene's budget into pages, and flights' digests hang on how many.
        assert_eq!(size_of::<Page>(), 55_360);
    }

    #[test]
    fn bytes_are_those_of_page_survey_and_colour() {
        let key = PageKey::root(0);
        let mut page = Page {
            key,
            heights_m: [0.0; SAMPLES],
            normals: [[0; 2]; SAMPLES],
            layers: [[0; 4]; SAMPLES],
            bounds: [Bound::UNKNOWN; BOUND_SIDE * BOUND_SIDE],
            survey: None,
            colour: None,
            content: 0,
        };
        assert_eq!(page.bytes(), 55_360);
        let (sea_level_m, origin) = ([0.0; SAMPLES], [Origin::Measured; SAMPLES]);
        page.survey = Some(Box::new(Survey { sea_level_m, sea_level_variation_m: 0.0, origin }));
        // 65 × 65 samples of 4 bytes and 1, a number, padding.
        assert_eq!(page.bytes(), 55_360 + 21_132);
        let rgba = vec![[0; 4]; COLOUR_TEXELS].into();
        page.colour = Some(Arc::new(ColourTile { key, rgba, content: 0 }));
        // 129 × 129 texels of 4 bytes; key, address, length and content.
        assert_eq!(page.bytes(), 55_360 + 21_132 + 66_564 + 32);
    }
}

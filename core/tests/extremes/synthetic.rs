//! Synthetic ground: heights that no planet has, as pages with bounds that hold.
//!
//! In:    a [`Relief`], a body, a patch depth.
//! Out:   heights at lattice points and between, pages.
//! Keeps: nothing.
//! Not here: what is asserted.

use glam::{DVec3, IVec3};
use overfly_core::datasource::facts::{ArchiveFacts, Datum, FORMAT_VERSION};
use overfly_core::datasource::generate::encode;
use overfly_core::datasource::page::{BOUND_SIDE, BOUND_STRIDE, Bound, SAMPLES};
use overfly_core::datasource::{PAGE_SIDE, Page, PageKey};
use overfly_core::digest::{Chain, mix};
use overfly_core::geodesy::{Ellipsoid, narrow};
use overfly_core::lattice::{RADIUS, key_of, normal_of};
use overfly_core::lod::reach::{DIAGONAL, EXTENT_EVEN, NORM_MIN, edges};
use std::sync::Arc;

/// A height for every place of the lattice's octahedron, its points and all between.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Relief {
    /// The same everywhere.
    Flat { height_m: f64 },
    /// A cone on flat ground: `half` lattice units from its axis it is 0.
    Needle { at: IVec3, half: f64, height_m: f64 },
    /// A vertical step: ground of `height_m` where x is above `east_of` lattice units.
    Cliff { east_of: f64, height_m: f64 },
    /// Each lattice point has a height of its own, up to this far off 0.
    Noise { most_m: f64 },
    /// From `mean_m - swing_m` at the south pole to `mean_m + swing_m` at the north pole, along z.
    Tilt { mean_m: f64, swing_m: f64 },
}

impl Relief {
    /// Least and greatest height.
    pub fn range_m(&self) -> [f64; 2] {
        match *self {
            Self::Flat { height_m } => [height_m; 2],
            Self::Needle { height_m, .. } | Self::Cliff { height_m, .. } => {
                [height_m.min(0.0), height_m.max(0.0)]
            }
            Self::Noise { most_m } => [-most_m, most_m],
            Self::Tilt { mean_m, swing_m } => [mean_m - swing_m, mean_m + swing_m],
        }
    }

    /// The height at a place of the octahedron, in lattice units. Noise is only at lattice points.
    pub fn height_m(&self, place: DVec3) -> f64 {
        match *self {
            Self::Flat { height_m } => height_m,
            Self::Needle { at, half, height_m } => {
                let away = (place - at.as_dvec3()).length() / half;
                height_m * (1.0 - away).max(0.0)
            }
            Self::Cliff { east_of, height_m } => {
                if place.x > east_of {
                    height_m
                } else {
                    0.0
                }
            }
            Self::Noise { most_m } => {
                let point = IVec3::from_array(place.to_array().map(whole));
                let share = (mix(key_of(point)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
                most_m * share
            }
            Self::Tilt { mean_m, swing_m } => mean_m + swing_m * (place / place.length()).z,
        }
    }

    /// Bound on the difference in height of two places, one of them `place`, at most `reach`
    /// lattice units apart.
    pub fn rise_m(&self, place: DVec3, reach: f64) -> f64 {
        match *self {
            Self::Flat { .. } => 0.0,
            Self::Needle { at, half, height_m } => {
                let away = (place - at.as_dvec3()).length();
                if away - reach > half { 0.0 } else { height_m.abs() * (reach / half).min(1.0) }
            }
            Self::Cliff { east_of, height_m } => {
                if (place.x - east_of).abs() <= reach {
                    height_m.abs()
                } else {
                    0.0
                }
            }
            Self::Noise { most_m } => 2.0 * most_m,
            Self::Tilt { swing_m, .. } => swing_m * (reach / NORM_MIN).min(2.0),
        }
    }

    /// Bound on how far ground strays from a plane over an edge, somewhere within `reach`.
    fn residual_m(&self, place: DVec3, edge: f64, reach: f64) -> f64 {
        match *self {
            Self::Flat { .. } => 0.0,
            Self::Needle { at, half, height_m } => {
                let away = (place - at.as_dvec3()).length();
                let most = height_m.abs() * (edge / half).min(1.0);
                if away - reach > half { 0.0 } else { most }
            }
            Self::Cliff { .. } | Self::Noise { .. } => self.rise_m(place, reach),
            Self::Tilt { swing_m, .. } => {
                let chord = (edge / NORM_MIN).min(2.0);
                swing_m * chord * chord
            }
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a lattice coordinate")]
fn whole(c: f64) -> i32 {
    c.round() as i32
}

/// Ground of one relief on one body.
#[derive(Clone, Copy, Debug)]
pub struct Synthetic {
    pub relief: Relief,
    pub body: Ellipsoid,
    pub patch_depth: u8,
}

impl Synthetic {
    /// What a source of this ground says of itself.
    pub fn facts(&self) -> ArchiveFacts {
        ArchiveFacts {
            version: FORMAT_VERSION,
            body_name: "synthetic".into(),
            body: self.body,
            datum: Datum::Ellipsoid,
            height_range_m: self.relief.range_m(),
            content: 1,
            layers: Vec::new(),
        }
    }

    /// The height of the ground at a normal.
    pub fn height_m(&self, normal: DVec3) -> f64 {
        let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
        self.relief.height_m(normal * (f64::from(RADIUS) / sum))
    }

    /// One page.
    pub fn page(&self, key: PageKey) -> Arc<Page> {
        let mut page = Box::new(Page {
            key,
            heights_m: [0.0; SAMPLES],
            normals: [[0; 2]; SAMPLES],
            layers: [[0; 4]; SAMPLES],
            bounds: [Bound::default(); BOUND_SIDE * BOUND_SIDE],
            survey: None,
            colour: None,
            content: 0,
        });
        let mut chain = Chain::default();
        for (i, j) in (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j))) {
            let (point, at) = (key.sample(i, j), j * PAGE_SIDE + i);
            page.heights_m[at] = narrow(self.relief.height_m(point.as_dvec3()));
            page.normals[at] = encode(normal_of(point));
            chain.add(u64::from(page.heights_m[at].to_bits()));
            if i % BOUND_STRIDE == 0 && j % BOUND_STRIDE == 0 {
                let bound = self.bound(key, point);
                page.bounds[j / BOUND_STRIDE * BOUND_SIDE + i / BOUND_STRIDE] = bound;
                chain.add(u64::from(bound.error_odd_m.to_bits()));
            }
        }
        page.content = chain.0;
        Arc::from(page)
    }

    /// The bounds around a sample, as the generator has them: over all that a diamond near it and
    /// its descendants can reach. Ground far above the ellipsoid sags by more.
    fn bound(&self, key: PageKey, point: IVec3) -> Bound {
        let (step, place) = (f64::from(key.step()), point.as_dvec3());
        let leaf_side = step * f64::from(1_u32 << (self.patch_depth / 2));
        let reach = EXTENT_EVEN * leaf_side + DIAGONAL * step * 4.0;
        let norm = (place.length() - reach).max(NORM_MIN);
        let [least_m, most_m] = self.body.curvature_radii_m();
        let high_m = self.relief.range_m()[1].max(0.0);
        let [odd_m, even_m] = edges(self.patch_depth).map(|edge| {
            let chord = edge * step / norm;
            // A chord of the ground's own sphere cuts off this much; flat bodies turn faster.
            let sagitta_m = chord * chord * (most_m * most_m / least_m + high_m) / 8.0;
            // The edge reaches as far again beyond what the diamond does.
            let residual_m = self.relief.residual_m(place, edge * step, reach);
            narrow(sagitta_m + residual_m).next_up()
        });
        let variation_m = narrow(self.relief.rise_m(place, reach)).next_up();
        let error_finer_m = if self.patch_depth == 0 { odd_m } else { even_m };
        Bound { error_odd_m: odd_m, error_even_m: even_m, error_finer_m, variation_m }
    }
}

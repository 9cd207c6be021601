//! Makes the pages of the procedural planet: on the host's threads, never in a frame.
//!
//! In:    a page key; the planet, the body, the patch depth.
//! Out:   a [`Page`]. A pure function of these: any thread, any order, same bits.
//! Keeps: nothing but the immutable planet.
//! Not here: the planet's heights (`procedural`).

use super::key::{PAGE_SIDE, PageKey};
use super::page::{BOUND_SIDE, BOUND_STRIDE, Bound, Page, SAMPLES};
use super::procedural::{Planet, Sample};
use crate::digest::Chain;
use crate::geodesy::{Ellipsoid, narrow};
use crate::lattice::{cross_of, normal_of, signs, unfold};
use crate::lod::reach::{DIAGONAL, EXTENT_EVEN, NORM_MIN, edges};
use crate::settings::SceneSettings;
use glam::{DVec3, IVec3};
use std::sync::Arc;

/// Everything that the pages of one scene are made from.
pub struct Generator {
    planet: Planet,
    body: Ellipsoid,
    patch_depth: u8,
    sea: bool,
}

impl Generator {
    /// The generator of a scene's first source.
    pub fn new(settings: &SceneSettings) -> Self {
        let source = settings.sources.first().expect("a scene has a source");
        Self {
            planet: Planet::new(&source.procedural(&settings.body)),
            body: settings.body,
            patch_depth: settings.lod.patch_depth,
            sea: settings.sea,
        }
    }

    /// The planet itself, for exact heights without pages.
    pub fn planet(&self) -> &Planet {
        &self.planet
    }

    /// Makes one page.
    pub fn page(&self, key: PageKey) -> Arc<Page> {
        let mut page = Box::new(Page {
            key,
            heights_m: [0.0; SAMPLES],
            normals: [[0; 2]; SAMPLES],
            layers: [[0; 4]; SAMPLES],
            bounds: [Bound::default(); BOUND_SIDE * BOUND_SIDE],
            height_range_m: [f32::MAX, f32::MIN],
            survey: None,
            content: 0,
        });
        self.fill_samples(&mut page);
        self.fill_normals(&mut page);
        page.content = content_of(&page);
        Arc::from(page)
    }

    fn fill_samples(&self, page: &mut Page) {
        for (i, j) in places() {
            let point = page.key.sample(i, j);
            let sample = self.planet.sample(normal_of(point));
            let at = j * PAGE_SIDE + i;
            page.heights_m[at] = narrow(sample.height_m);
            let layers = sample.layers;
            page.layers[at] = [layers.roughness, layers.rock, layers.moisture, layers.temperature];
            let [low, high] = page.height_range_m;
            page.height_range_m = [low.min(page.heights_m[at]), high.max(page.heights_m[at])];
            if i % BOUND_STRIDE == 0 && j % BOUND_STRIDE == 0 {
                let bound = self.bound(page.key, point, &sample);
                page.bounds[j / BOUND_STRIDE * BOUND_SIDE + i / BOUND_STRIDE] = bound;
            }
        }
    }

    /// The bounds around a sample, over all that a diamond near it and its descendants can reach.
    fn bound(&self, key: PageKey, point: IVec3, sample: &Sample) -> Bound {
        let step = f64::from(key.step());
        let leaf_side = step * f64::from(1_u32 << (self.patch_depth / 2));
        let stride = DIAGONAL * step * 4.0;
        let reach = EXTENT_EVEN * leaf_side + stride;
        let norm = (point.as_dvec3().length() - reach).max(NORM_MIN);
        let [curvature_min, curvature_max] = self.body.curvature_radii_m();
        let metres = |lattice: f64| lattice / norm * curvature_max;
        let slope = self.planet.ruggedness_slope_per_m();
        let ruggedness = (sample.ruggedness + slope * metres(reach)).min(1.0);
        let variation_m = self.planet.variation_m(metres(reach), ruggedness);
        let drowned = self.sea && sample.height_m + variation_m < 0.0;
        let shore = self.sea && !drowned && sample.height_m - variation_m < 0.0;
        let error = |edge: f64| {
            let edge_m = metres(edge * step);
            let sagitta_m = edge_m * edge_m / (8.0 * curvature_min);
            let ground_m = if drowned { 0.0 } else { self.planet.residual_m(edge_m, ruggedness) };
            // Where water meets land, an edge that rises by d cuts the corner by d/4 at most.
            let corner_m =
                if shore { self.planet.variation_m(edge_m, ruggedness) / 4.0 } else { 0.0 };
            narrow(ground_m + corner_m + sagitta_m)
        };
        let [odd, even] = edges(self.patch_depth);
        Bound {
            error_odd_m: error(odd),
            error_even_m: error(even),
            variation_m: narrow(variation_m),
        }
    }

    /// Normals by central differences over the lattice cross, whichever page its arms lie in.
    fn fill_normals(&self, page: &mut Page) {
        for (i, j) in places() {
            let point = page.key.sample(i, j);
            let arms = cross_of(point, page.key.step());
            let [a, b, c, d] = arms.map(|arm| self.position(page, arm));
            let normal = (a - c).cross(b - d).normalize();
            let inward = normal.dot(normal_of(point)) < 0.0;
            page.normals[j * PAGE_SIDE + i] = encode(if inward { -normal } else { normal });
        }
    }

    fn position(&self, page: &Page, point: IVec3) -> DVec3 {
        let normal = normal_of(point);
        let height_m = sample_within(page, point)
            .unwrap_or_else(|| narrow(self.planet.sample(normal).height_m));
        self.body.surface_from_normal(normal) + normal * f64::from(height_m)
    }
}

/// Column and row of every sample, row by row.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j)))
}

/// The height at a lattice point if it is a sample of this page.
fn sample_within(page: &Page, point: IVec3) -> Option<f32> {
    let (sx, sy) = signs(page.key.quadrant());
    if sx * point.x < 0 || sy * point.y < 0 {
        return None;
    }
    let (u, v) = unfold(page.key.quadrant(), point);
    let (u0, v0) = page.key.origin();
    let inside = |along: i32| (0..=page.key.side()).contains(&along);
    (inside(u - u0) && inside(v - v0)).then(|| page.heights_m[page.sample_index(point)])
}

/// A unit vector in octahedral encoding, ±32767 is ±1. Error: 4e-5 rad.
#[expect(clippy::cast_possible_truncation, reason = "rounded to within ±32767")]
pub fn encode(unit: DVec3) -> [i16; 2] {
    let p = unit / (unit.x.abs() + unit.y.abs() + unit.z.abs());
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if p.z >= 0.0 {
        (p.x, p.y)
    } else {
        ((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    [(x * 32767.0).round() as i16, (y * 32767.0).round() as i16]
}

fn content_of(page: &Page) -> u64 {
    let mut chain = Chain::default();
    for at in 0..SAMPLES {
        let [a, b] = page.normals[at].map(|c| u64::from(c.cast_unsigned()));
        let layers = u64::from(u32::from_le_bytes(page.layers[at]));
        chain.add(u64::from(page.heights_m[at].to_bits()) << 32 | a << 16 | b);
        chain.add(layers);
    }
    for bound in &page.bounds {
        let bits = [bound.error_odd_m, bound.error_even_m, bound.variation_m].map(f32::to_bits);
        bits.into_iter().for_each(|b| chain.add(u64::from(b)));
    }
    chain.0
}

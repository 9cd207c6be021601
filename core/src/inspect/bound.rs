//! How closely the surface of a frame is certain to follow the ground, in its views: leaf by leaf.
//!
//! In:    a terrain between two frames, what the last one gave.
//! Out:   a bound in pixels, mostly below what the LOD promises while it chooses leaves.
//! Keeps: nothing; a frame that nobody asks does none of this.
//! Not here: priorities (`lod::screen_error`): they also bound what leaves would be split into.
//!
//! A leaf is first judged as a whole. Where that is not enough, as where a leaf is as large as it is
//! far, its small triangles are, each where it lies and by as much as its own vertices are on their
//! way: what the picture does not show of it does not count. Leaves are taken in the order of the
//! first bound, and those below what is certain anyway are never cut up.

use super::drawn::{points_of, way_of};
use crate::columns::Id;
use crate::frame::{FrameOutput, Terrain};
use crate::geodesy::Ellipsoid;
use crate::lattice::normal_of;
use crate::lod::reach::sag_between;
use crate::lod::screen_error::{Region, Sight, own_px};
use crate::mesh::morph::duration_ms;
use crate::mesh::topology::indices;
use glam::DVec3;

/// One leaf, its error in pixels as a whole.
struct Rough {
    error_px: f64,
    slot: u32,
}

impl Terrain {
    /// What is drawn of the surface in this frame, the last one, strays from the ground by no more than
    /// this in any of its views, in pixels. At most what its counts promise, which is told at no cost.
    ///
    /// Judges every leaf: some tens of nanoseconds each, and some microseconds each that matters.
    pub fn bound_px(&self, output: &FrameOutput) -> f64 {
        let (lod, patches) = (self.lod(), self.patches());
        let sights = &lod.sights;
        let settings = self.settings();
        let body = &settings.body;
        let [least_m, most_m] = body.curvature_radii_m();
        let now = (output.time_ms, duration_ms(settings.lod.morph_s));
        let region_of = |slot: u32| {
            let leaf = patches.leaf[slot as usize]?;
            Some((leaf, lod.cover.region[Id::new(leaf.diamond)]))
        };
        let left_m = |slot: u32| patches.morphs_of(slot).iter().map(|m| way_of(m, now).length());
        let rough = |slot: u32| {
            let (_, region) = region_of(slot)?;
            let way_m = left_m(slot).fold(0.0, f64::max);
            let error_px = own_px(&Region { error_m: region.error_m + way_m, ..region }, sights);
            Some(Rough { error_px, slot })
        };
        let mut all: Vec<_> = (0..patches.used_end()).filter_map(rough).collect();
        all.sort_unstable_by(|a, b| b.error_px.total_cmp(&a.error_px));
        let pattern = indices(patches.patch_depth);
        let mut certain_px = 0.0_f64;
        for Rough { error_px, slot } in all {
            if error_px <= certain_px {
                break;
            }
            let (leaf, region) = region_of(slot).expect("it was found before");
            let corners = lod.mesh.diamonds.shape(Id::new(leaf.diamond));
            let corners = corners.triangle(usize::from(leaf.side));
            let points: Vec<_> = points_of(corners, patches.patch_depth).collect();
            let left_m: Vec<_> = left_m(slot).collect();
            for triangle in pattern.chunks_exact(3) {
                let at = [0, 1, 2].map(|i| triangle[i] as usize);
                let way_m = at.map(|i| left_m.get(i).copied().unwrap_or(0.0));
                let way_m = way_m.into_iter().fold(0.0, f64::max);
                let normals = at.map(|i| normal_of(points[i]));
                let sag_m = sag_between(normals) * most_m * most_m / least_m;
                let within_m = region.high_m - region.low_m + sag_m;
                let error_m = region.error_m.min(within_m) + way_m;
                let spot = Spot { region: Region { error_m, ..region }, body, sights };
                let part_px = spot.error_px(normals, certain_px, CUTS);
                certain_px = certain_px.max(error_px.min(part_px));
            }
        }
        certain_px.min(output.counts.error_px_bound)
    }
}

/// How often a small triangle is cut in four, at most.
const CUTS: u32 = 3;

/// Triangles smaller than this share of their distance are not cut further.
const SMALL: f64 = 1.0 / 16.0;

/// What is known of a leaf that is looked at closely.
struct Spot<'a> {
    region: Region,
    body: &'a Ellipsoid,
    sights: &'a [Sight],
}

impl Spot<'_> {
    /// The error in pixels between some normals, exactly enough where it is more than `known_px`.
    fn error_px(&self, [a, b, c]: [DVec3; 3], known_px: f64, cuts: u32) -> f64 {
        let part = self.part_of([a, b, c]);
        let error_px = own_px(&part, self.sights);
        let is_large = |sight: &Sight| {
            part.cap * self.body.curvature_radii_m()[1] > SMALL * sight.distance_m(&part)
        };
        if error_px <= known_px || cuts == 0 || !self.sights.iter().any(is_large) {
            return error_px;
        }
        let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        let quarters = quarters.map(|quarter| self.error_px(quarter, known_px, cuts - 1));
        error_px.min(quarters.into_iter().fold(0.0, f64::max))
    }

    /// The part of the leaf's region between some normals.
    fn part_of(&self, normals: [DVec3; 3]) -> Region {
        let normal = (normals[0] + normals[1] + normals[2]).normalize();
        let chords = normals.map(|corner| (corner - normal).length());
        let cap = chords.into_iter().fold(0.0, f64::max) * (1.0 + 1e-12);
        // Sides are arcs of great circles: a corner is the farthest point while all are near.
        if cap > 1.0 {
            return self.region;
        }
        let surface = self.body.surface_from_normal(normal);
        Region { normal, surface, cap, own_cap: cap, kids_cap: cap, ..self.region }
    }
}

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
//!
//! A triangle that halves one of the coarser surface shows that one while its apex begins, and its own
//! in the end; on its way it lies between, so its error does too. Where something else moves as well,
//! the longest way that is left counts on top of its own error.

use super::drawn::{points_of, way_of};
use crate::columns::Id;
use crate::frame::{FrameOutput, Terrain};
use crate::geodesy::{Ecef, Ellipsoid, TwoFloat};
use crate::lattice::normal_of;
use crate::lod::reach::sag_between;
use crate::lod::screen_error::{Region, Sight, own_px};
use crate::mesh::morph::duration_ms;
use crate::mesh::patches::PatchVertex;
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
        let now = (output.time_ms, duration_ms(settings.lod.morph_s));
        let region_of = |diamond: u32| lod.cover.region[Id::new(diamond)];
        let rough = |slot: u32| {
            let region = region_of(patches.leaf[slot as usize]?.diamond);
            let ways = patches.morphs_of(slot).iter().map(|morph| way_of(morph, now).length());
            let error_m = region.error_m + ways.fold(0.0, f64::max);
            Some(Rough { error_px: own_px(&Region { error_m, ..region }, sights), slot })
        };
        let mut all: Vec<_> = (0..patches.used_end()).filter_map(rough).collect();
        all.sort_unstable_by(|a, b| b.error_px.total_cmp(&a.error_px));
        let pattern = indices(patches.patch_depth);
        let triangles: Vec<_> = pattern.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let mut certain_px = 0.0_f64;
        for Rough { error_px, slot } in all {
            if error_px <= certain_px {
                break;
            }
            let leaf = patches.leaf[slot as usize].expect("it was found before");
            let (id, side) = (Id::new(leaf.diamond), usize::from(leaf.side));
            let diamonds = &lod.mesh.diamonds;
            let parent = diamonds[id].parents()[side];
            let points = points_of(diamonds.shape(id).triangle(side), patches.patch_depth);
            let place = |vertex: &PatchVertex| {
                let TwoFloat { hi, lo } = vertex.position;
                DVec3::from_array(hi.map(f64::from)) + DVec3::from_array(lo.map(f64::from))
            };
            let close = Close {
                region: region_of(leaf.diamond),
                coarser_m: parent.map(|parent| lod.cover.region[parent].error_m),
                normals: points.map(normal_of).collect(),
                places: patches.vertices_of(slot).iter().map(place).collect(),
                ways: patches.morphs_of(slot).iter().map(|morph| way_of(morph, now)).collect(),
                left: patches
                    .morphs_of(slot)
                    .iter()
                    .map(|m| f64::from(m.left(now.0, now.1)))
                    .collect(),
                body,
                sights,
            };
            for (at, &triangle) in triangles.iter().enumerate() {
                let part_px = close.error_px(triangle, triangles.get(at ^ 1).copied(), certain_px);
                certain_px = certain_px.max(error_px.min(part_px));
            }
        }
        certain_px.min(output.counts.error_px_bound)
    }
}

/// A leaf that is looked at closely: columns by vertex, the last two empty where nothing morphs.
struct Close<'a> {
    region: Region,
    /// Error of drawing its parent unsplit, metres.
    coarser_m: Option<f64>,
    normals: Vec<DVec3>,
    places: Vec<DVec3>,
    /// What is left of its way, metres.
    ways: Vec<DVec3>,
    /// What is left of its way, as a share.
    left: Vec<f64>,
    body: &'a Ellipsoid,
    sights: &'a [Sight],
}

/// Metres, and share of a way, by which places differ at most that are the same but for rounding.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

impl Close<'_> {
    /// The error in pixels of a small triangle, exactly enough where it is more than `known_px`;
    /// `sibling` is the other half of the triangle that both were.
    fn error_px(&self, triangle: [u32; 3], sibling: Option<[u32; 3]>, known_px: f64) -> f64 {
        let at = triangle.map(|vertex| vertex as usize);
        let normals = at.map(|vertex| self.normals[vertex]);
        let [least_m, most_m] = self.body.curvature_radii_m();
        let sag_m = sag_between(normals) * most_m * most_m / least_m;
        let way_m = at.map(|vertex| self.way(vertex).length()).into_iter().fold(0.0, f64::max);
        let Region { low_m, high_m, .. } = self.region;
        let still_m = self.region.error_m.min(high_m - low_m + sag_m);
        let between_m = sibling.and_then(|sibling| self.between_m(triangle, sibling, still_m));
        let error_m = between_m.unwrap_or(f64::INFINITY).min(still_m + way_m);
        let heights_m =
            at.map(|vertex| self.body.geodetic_from_ecef(Ecef(self.places[vertex])).height_m);
        let lowest_m = heights_m.into_iter().fold(f64::INFINITY, f64::min);
        let highest_m = heights_m.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let region = Region {
            error_m,
            low_m: low_m.max(lowest_m - sag_m - way_m - error_m),
            high_m: high_m.min(highest_m + way_m + error_m),
            ..self.region
        };
        self.cut_px(&region, normals, (known_px, CUTS))
    }

    fn way(&self, vertex: usize) -> DVec3 {
        self.ways.get(vertex).copied().unwrap_or(DVec3::ZERO)
    }

    /// The error of a triangle whose apex alone moves, from the middle of the edge that it halved;
    /// `still_m` is what it will be. `None` where that is not so.
    fn between_m(&self, triangle: [u32; 3], sibling: [u32; 3], still_m: f64) -> Option<f64> {
        let apex = triangle[0] as usize;
        let alone = |of: [u32; 3], other: [u32; 3]| of.into_iter().find(|v| !other.contains(v));
        let ends = [alone(triangle, sibling)? as usize, alone(sibling, triangle)? as usize];
        let old = triangle.into_iter().chain(sibling).map(|vertex| vertex as usize);
        let rests = old.filter(|&vertex| vertex != apex).all(|at| self.way(at) == DVec3::ZERO);
        let left = self.left.get(apex).copied().unwrap_or(0.0);
        let middle = 0.5 * (self.places[ends[0]] + self.places[ends[1]]);
        let begun = (middle - self.places[apex]) * left;
        let [most_m, share] = ROUNDING;
        let is_halving = (begun - self.way(apex)).length() <= most_m + share * begun.length();
        (rests && is_halving).then_some((1.0 - left) * still_m + left * self.coarser_m?)
    }

    /// The error in pixels of a part of the leaf between some normals, cut up as far as it matters.
    fn cut_px(&self, whole: &Region, normals: [DVec3; 3], (known_px, cuts): (f64, u32)) -> f64 {
        let part = part_of(whole, normals, self.body);
        let error_px = own_px(&part, self.sights);
        let size_m = part.cap * self.body.curvature_radii_m()[1];
        let is_large = |sight: &Sight| size_m > SMALL * sight.distance_m(&part);
        if error_px <= known_px || cuts == 0 || !self.sights.iter().any(is_large) {
            return error_px;
        }
        let [a, b, c] = normals;
        let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        let quarters = quarters.map(|quarter| self.cut_px(whole, quarter, (known_px, cuts - 1)));
        error_px.min(quarters.into_iter().fold(0.0, f64::max))
    }
}

/// How often a small triangle is cut in four, at most.
const CUTS: u32 = 3;

/// Triangles smaller than this share of their distance are not cut further.
const SMALL: f64 = 1.0 / 16.0;

/// The part of a region between some normals.
fn part_of(whole: &Region, normals: [DVec3; 3], body: &Ellipsoid) -> Region {
    let normal = (normals[0] + normals[1] + normals[2]).normalize();
    let chords = normals.map(|corner| (corner - normal).length());
    let cap = chords.into_iter().fold(0.0, f64::max) * (1.0 + 1e-12);
    // Sides are arcs of great circles: a corner is the farthest point while all are near.
    if cap > 1.0 {
        return *whole;
    }
    let surface = body.surface_from_normal(normal);
    Region { normal, surface, cap, own_cap: cap, kids_cap: cap, ..*whole }
}

//! Where the drawn mesh stands: its height along any vertical, and how it is shaded there.
//!
//! In:    a drawn mesh, geodetic normals.
//! Out:   the leaf there, the height m(n) at which the vertical meets it, its shading normal.
//! Keeps: the mesh of one moment.
//! Not here: the reference ground (`reference`), the mesh along rays of the eye (`raster`).

use glam::DVec3;
use overfly_core::frame::Terrain;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::{Place, triangle_id};
use overfly_core::inspect::{DrawnLeaf, DrawnMesh};
use overfly_core::mesh::morph::duration_ms;

/// The mesh of one moment, ready to be asked.
#[derive(Clone, Debug)]
pub struct MeshThen {
    /// The mesh.
    pub drawn: DrawnMesh,
    /// Shading normals of its vertices, in the same order; of nearly unit length.
    pub normals: Vec<DVec3>,
    /// When it was drawn, on the frames' clock.
    pub time_ms: u32,
    body: Ellipsoid,
    /// Lattice levels that have leaves, one bit each.
    levels: u64,
}

/// Where a vertical meets the mesh.
#[derive(Clone, Copy, Debug)]
pub struct Foothold {
    /// Index of the leaf.
    pub leaf: usize,
    /// Height above the ellipsoid, metres.
    pub height_m: f64,
    /// Vertices of the small triangle, and the weights of the place on the lattice.
    pub corners: [usize; 3],
    /// Weights of these.
    pub weights: [f64; 3],
}

impl MeshThen {
    /// An empty one over a body.
    pub fn new(body: Ellipsoid) -> Self {
        let (drawn, normals) = (DrawnMesh::default(), Vec::new());
        Self { drawn, normals, time_ms: 0, body, levels: 0 }
    }

    /// Takes the mesh over as it was drawn at `time_ms`.
    pub fn take(&mut self, terrain: &Terrain, time_ms: u32) {
        terrain.drawn(time_ms, &mut self.drawn);
        self.time_ms = time_ms;
        self.note_levels();
        let (patches, morph_ms) = (terrain.patches(), duration_ms(terrain.settings().lod.morph_s));
        self.normals.clear();
        for leaf in &self.drawn.leaves {
            let (own, morphs) = (patches.vertices_of(leaf.slot), patches.morphs_of(leaf.slot));
            let turned = |at: usize, own: DVec3| match morphs.get(at).filter(|_| leaf.morphs) {
                Some(morph) => {
                    own.lerp(decode(morph.normal_oct), morph.left(time_ms, morph_ms).into())
                }
                None => own,
            };
            let all = own.iter().enumerate().map(|(at, own)| turned(at, decode(own.normal_oct)));
            self.normals.extend(all);
        }
    }

    /// After the mesh was changed by hand.
    pub fn note_levels(&mut self) {
        self.levels = self.drawn.leaves.iter().fold(0, |levels, leaf| levels | 1 << leaf.level);
    }

    /// The leaf around a normal, and where its vertical meets that; levels near `hint` are tried
    /// first. `None` only where the mesh has a hole.
    pub fn find(&self, normal: DVec3, hint: u8) -> Option<Foothold> {
        self.find_at(&Place::of(normal), normal, hint)
    }

    /// The same, where a leaf is known that may be the one around the normal.
    pub fn find_near(&self, normal: DVec3, guess: usize) -> Option<Foothold> {
        let place = Place::of(normal);
        let Some(leaf) = self.drawn.leaves.get(guess) else {
            return self.find_at(&place, normal, 30);
        };
        let (cell, corners, weights) = place.triangle(leaf.level);
        if triangle_id(corners.map(|corner| cell.point(corner))) != leaf.key {
            return self.find_at(&place, normal, leaf.level);
        }
        let turned = cell.point(corners[1]) != leaf.corners[1];
        Some(self.foothold(guess, (weights, turned), normal))
    }

    fn find_at(&self, place: &Place, normal: DVec3, hint: u8) -> Option<Foothold> {
        for step in 0..=u8::MAX {
            let level = match step % 2 {
                0 => hint.checked_add(step / 2),
                _ => hint.checked_sub(step / 2 + 1),
            };
            if step / 2 > 64 {
                break;
            }
            let Some(level) = level.filter(|&level| level < 64 && self.levels >> level & 1 == 1)
            else {
                continue;
            };
            let (cell, corners, weights) = place.triangle(level);
            let Some(leaf) = self.drawn.find(triangle_id(corners.map(|corner| cell.point(corner))))
            else {
                continue;
            };
            let turned = cell.point(corners[1]) != self.drawn.leaves[leaf].corners[1];
            return Some(self.foothold(leaf, (weights, turned), normal));
        }
        None
    }

    /// The leaf of a foothold.
    pub fn leaf(&self, foothold: &Foothold) -> &DrawnLeaf {
        &self.drawn.leaves[foothold.leaf]
    }

    /// Where a vertical meets the small triangle at these weights of apex and hypotenuse, whose ends
    /// may be named the other way round.
    fn foothold(
        &self,
        leaf: usize,
        (weights, turned): ([f64; 3], bool),
        normal: DVec3,
    ) -> Foothold {
        let [apex, second, third] = weights;
        let weights = if turned { [apex, third, second] } else { weights };
        let first = leaf * self.drawn.vertices_per_patch();
        let (corners, weights) = small_triangle(self.drawn.patch_depth, weights);
        let corners = corners.map(|at| first + at);
        let [a, b, c] = corners.map(|at| self.drawn.places[at]);
        let plane = (b - a).cross(c - a);
        let foot = self.body.surface_from_normal(normal);
        let height_m = (a - foot).dot(plane) / normal.dot(plane);
        Foothold { leaf, height_m, corners, weights }
    }

    /// The shading normal at a foothold, of any length.
    pub fn shading(&self, foothold: &Foothold) -> DVec3 {
        let [a, b, c] = foothold.corners.map(|at| self.normals[at]);
        let [wa, wb, wc] = foothold.weights;
        a * wa + b * wb + c * wc
    }
}

/// A normal from its octahedral encoding, ±32767 being ±1; of unit length.
fn decode(oct: [i16; 2]) -> DVec3 {
    let [x, y] = oct.map(|c| f64::from(c) / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    let inward = |c: f64| if c >= 0.0 { c - fold } else { c + fold };
    DVec3::new(inward(x), inward(y), z).normalize()
}

/// Indices of the corners of the small triangle at these weights, by halving as the mesh does, and
/// the weights of these corners.
fn small_triangle(patch_depth: u8, weights: [f64; 3]) -> ([usize; 3], [f64; 3]) {
    let n = 1_usize << (patch_depth / 2);
    let mut corners = [(0, 0), (n, 0), (n, n)];
    let [mut apex, mut start, mut end] = weights;
    for _ in 0..patch_depth {
        let [a, s, e] = corners;
        let middle = (usize::midpoint(s.0, e.0), usize::midpoint(s.1, e.1));
        if start >= end {
            corners = [middle, a, s];
            (apex, start, end) = (2.0 * end, apex, start - end);
        } else {
            corners = [middle, e, a];
            (apex, start, end) = (2.0 * start, end - start, apex);
        }
    }
    (corners.map(|(row, column)| row * (row + 1) / 2 + column), [apex, start, end])
}

//! Where the drawn mesh stands: its height along any vertical.
//!
//! In:    a drawn mesh, geodetic normals.
//! Out:   the leaf there, and the height m(n) at which the vertical meets it.
//! Keeps: the mesh of one moment.
//! Not here: the reference ground (`reference`), the mesh along rays of the eye (`raster`).

use glam::DVec3;
use overfly_core::frame::Terrain;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::{Place, triangle_id};
use overfly_core::inspect::{DrawnLeaf, DrawnMesh};

/// The mesh of one moment, ready to be asked.
#[derive(Clone, Debug)]
pub struct MeshThen {
    /// The mesh.
    pub drawn: DrawnMesh,
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
}

impl MeshThen {
    /// An empty one over a body.
    pub fn new(body: Ellipsoid) -> Self {
        Self { drawn: DrawnMesh::default(), body, levels: 0 }
    }

    /// Takes the mesh over as it was drawn at `time_ms`.
    pub fn take(&mut self, terrain: &Terrain, time_ms: u32) {
        terrain.drawn(time_ms, &mut self.drawn);
        self.note_levels();
    }

    /// After the mesh was changed by hand.
    pub fn note_levels(&mut self) {
        self.levels = self.drawn.leaves.iter().fold(0, |levels, leaf| levels | 1 << leaf.level);
    }

    /// The leaf around a normal, and where its vertical meets that; levels near `hint` are tried
    /// first. `None` only where the mesh has a hole.
    pub fn find(&self, normal: DVec3, hint: u8) -> Option<Foothold> {
        let place = Place::of(normal);
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
            let [apex, second, third] = weights;
            let turned = cell.point(corners[1]) != self.drawn.leaves[leaf].corners[1];
            let weights = if turned { [apex, third, second] } else { weights };
            return Some(Foothold { leaf, height_m: self.height_m(leaf, weights, normal) });
        }
        None
    }

    /// The leaf of a foothold.
    pub fn leaf(&self, foothold: &Foothold) -> &DrawnLeaf {
        &self.drawn.leaves[foothold.leaf]
    }

    /// Height at which a vertical meets the small triangle at these weights of apex and hypotenuse.
    fn height_m(&self, leaf: usize, weights: [f64; 3], normal: DVec3) -> f64 {
        let places = self.drawn.places_of(leaf);
        let [a, b, c] = small_triangle(self.drawn.patch_depth, weights).map(|at| places[at]);
        let plane = (b - a).cross(c - a);
        let foot = self.body.surface_from_normal(normal);
        (a - foot).dot(plane) / normal.dot(plane)
    }
}

/// Indices of the corners of the small triangle at these weights, by halving as the mesh does.
fn small_triangle(patch_depth: u8, weights: [f64; 3]) -> [usize; 3] {
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
    corners.map(|(row, column)| row * (row + 1) / 2 + column)
}

//! C4 and C5: rays that see through the mesh.
//!
//! In:    what each ray met of ground and mesh; the ground, to look around what is suspect.
//! Out:   counts.
//! Keeps: nothing.
//! Not here: cracks that the mesh's own structure shows (`cracks`).
//!
//! The mesh strays from the ground, and so do its outlines, against the sky and against what lies
//! farther: by the frame's bound at most, and hardly by more than four times the p99 of E1 and a
//! pixel. So a suspect ray is a hole only if all the ground around it, as far as the lesser of
//! both and a bit more, has no such outline.

use super::cast::Caster;
use super::raster::Raster;
use super::rays::Grid;
use super::reference::Hit;
use super::share::share;
use glam::{DVec2, DVec3};
use overfly_core::inspect::DrawnMesh;
use overfly_core::lattice::normal_of;
use overfly_core::mesh::topology::indices;

/// Beyond that outlines may differ by so much, in pixels.
const BESIDE_PX: f64 = 2.0;
/// Depths that differ by a smaller share agree whatever the mesh promises.
const AGREE: f64 = 0.002;

/// What is compared.
pub struct Seen<'a> {
    /// The ground.
    pub caster: Caster<'a>,
    /// The rays.
    pub grid: &'a Grid,
    /// Depth of the ground by ray; 0 where there is none.
    pub ground_m: &'a (dyn Fn(usize) -> f64 + Sync),
    /// The mesh by ray.
    pub raster: &'a Raster,
    /// The whole of it.
    pub mesh: &'a DrawnMesh,
    /// How far outlines may stray, in pixels.
    pub stray_px: f64,
}

impl Seen<'_> {
    /// How many rays are C4, and how many C5; counted on so many threads.
    pub fn count(&self, threads: usize) -> [u64; 2] {
        let rows = share(self.grid.rows as usize, threads, |row| {
            self.count_row(u32::try_from(row).expect("a row of strata"))
        });
        rows.into_iter().fold([0; 2], |all, row| [all[0] + row[0], all[1] + row[1]])
    }

    fn count_row(&self, row: u32) -> [u64; 2] {
        let mut counts = [0; 2];
        for column in 0..self.grid.columns {
            let at = self.at(column, row);
            let ground_m = (self.ground_m)(at);
            if ground_m <= 0.0 || !self.is_beyond(at) {
                continue;
            }
            let pixel = self.grid.pixel(column, row);
            if self.is_background(at, pixel) {
                counts[0] += u64::from(self.is_inside(pixel));
            } else if self.is_alone(column, row) {
                counts[1] += u64::from(self.is_even(at, pixel));
            }
        }
        counts
    }

    fn at(&self, column: u32, row: u32) -> usize {
        row as usize * self.grid.columns as usize + column as usize
    }

    /// The share of the depth by which mesh and ground may well differ: what outlines stray, as an
    /// angle.
    fn share(&self) -> f64 {
        (self.stray_px / self.caster.screen.scale_px).max(AGREE)
    }

    /// Whether the mesh is much farther than the ground, or nowhere.
    fn is_beyond(&self, at: usize) -> bool {
        self.raster.depth_m[at] > (self.ground_m)(at) * (1.0 + 10.0 * self.share())
    }

    /// Whether there is nothing but sky, or the inside of the mesh, which is not drawn.
    fn is_background(&self, at: usize, pixel: DVec2) -> bool {
        if !self.raster.depth_m[at].is_finite() {
            return true;
        }
        let screen = self.caster.screen;
        let ray = screen.to_body(screen.tangents(pixel));
        let leaf = self.raster.leaf[at] as usize;
        let places = self.mesh.places_of(leaf);
        let up = normal_of(self.mesh.leaves[leaf].corners[0]);
        // Of the triangles on the ray the one that is seen is the nearest.
        let faces = indices(self.mesh.patch_depth);
        let three = faces.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| places[i as usize]));
        let met = three.filter_map(|corners| facing((screen.eye, ray), corners, up));
        met.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, outward)| outward > 0.0)
    }

    /// Whether everything around shows ground.
    fn is_inside(&self, pixel: DVec2) -> bool {
        let around = self.caster.around(pixel, self.stray_px + BESIDE_PX);
        around.is_some_and(|around| around.iter().all(Option::is_some))
    }

    /// Whether the mesh agrees with the ground on all eight rays around.
    fn is_alone(&self, column: u32, row: u32) -> bool {
        let inner = |at: u32, count: u32| at > 0 && at + 1 < count;
        if !inner(column, self.grid.columns) || !inner(row, self.grid.rows) {
            return false;
        }
        let rows = row - 1..=row + 1;
        let mut around = rows.flat_map(|r| (column - 1..=column + 1).map(move |c| (c, r)));
        around.all(|(c, r)| {
            let at = self.at(c, r);
            (c, r) == (column, row) || ((self.ground_m)(at) > 0.0 && !self.is_beyond(at))
        })
    }

    /// Whether nowhere around the ground lies nearly as far as what the mesh shows: then that is
    /// not just an outline that strays.
    fn is_even(&self, at: usize, pixel: DVec2) -> bool {
        let farthest_m = f64::midpoint((self.ground_m)(at), self.raster.depth_m[at]);
        let whole_px = self.stray_px + BESIDE_PX;
        RINGS.into_iter().all(|ring| {
            let around = self.caster.around(pixel, whole_px * ring);
            let near = |hit: &Option<Hit>| hit.is_some_and(|hit| hit.depth_m < farthest_m);
            around.is_some_and(|around| around.iter().all(near))
        })
    }
}

/// How far from a suspect ray the ground is looked at, as shares of the whole distance.
const RINGS: [f64; 4] = [0.15, 0.4, 0.7, 1.0];

/// Where a ray meets a triangle, and the ray's part along the side of it that `up` is on.
fn facing((eye, ray): (DVec3, DVec3), corners: [DVec3; 3], up: DVec3) -> Option<(f64, f64)> {
    let [a, b, c] = corners.map(|corner| corner - eye);
    let [u, v, w] = [b.cross(c), c.cross(a), a.cross(b)].map(|side| ray.dot(side));
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let depth = a.dot(b.cross(c)) / (u + v + w);
    let plane = (b - a).cross(c - a);
    (inside && depth > 0.0).then(|| (depth, plane.dot(ray) * plane.dot(up)))
}

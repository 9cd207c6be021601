//! C4 and C5: rays that see through the mesh.
//!
//! In:    what each ray met of ground and mesh; the ground, to look around what is suspect.
//! Out:   counts.
//! Keeps: nothing.
//! Not here: cracks that the mesh's own structure shows (`cracks`).
//!
//! The mesh may stray from the ground by the frame's bound, and so may its outlines, against the
//! sky and against what lies farther. So a suspect ray is a hole only if all the ground around it,
//! as far as the bound and a bit more, has no such outline.

use super::cast::Caster;
use super::raster::Raster;
use super::rays::Grid;
use glam::DVec2;
use overfly_core::inspect::DrawnMesh;
use overfly_core::lattice::normal_of;

/// Beyond the bound outlines may differ by so much, in pixels.
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
    pub ground_m: &'a dyn Fn(usize) -> f64,
    /// The mesh by ray.
    pub raster: &'a Raster,
    /// Its leaves.
    pub mesh: &'a DrawnMesh,
    /// How far outlines may stray, in pixels.
    pub bound_px: f64,
}

impl Seen<'_> {
    /// How many rays are C4, and how many C5.
    pub fn count(&self) -> [u64; 2] {
        let mut counts = [0; 2];
        for (row, column) in
            (0..self.grid.rows).flat_map(|r| (0..self.grid.columns).map(move |c| (r, c)))
        {
            let at = self.at(column, row);
            let ground_m = (self.ground_m)(at);
            if ground_m <= 0.0 || !self.is_beyond(at) {
                continue;
            }
            let pixel = self.grid.pixel(column, row);
            if self.is_background(at, pixel) {
                counts[0] += u64::from(self.is_inside(pixel));
            } else if self.is_alone(column, row) {
                counts[1] += u64::from(self.is_even(pixel, ground_m, self.share(at)));
            }
        }
        counts
    }

    fn at(&self, column: u32, row: u32) -> usize {
        row as usize * self.grid.columns as usize + column as usize
    }

    /// The share of the depth by which mesh and ground may well differ.
    fn share(&self, at: usize) -> f64 {
        if !self.raster.depth_m[at].is_finite() {
            return AGREE;
        }
        let leaf = &self.mesh.leaves[self.raster.leaf[at] as usize];
        (leaf.error_m / (self.ground_m)(at)).max(AGREE)
    }

    /// Whether the mesh is much farther than the ground, or nowhere.
    fn is_beyond(&self, at: usize) -> bool {
        self.raster.depth_m[at] > (self.ground_m)(at) * (1.0 + 10.0 * self.share(at))
    }

    /// Whether there is nothing but sky, or the inside of the mesh, which is not drawn.
    fn is_background(&self, at: usize, pixel: DVec2) -> bool {
        if !self.raster.depth_m[at].is_finite() {
            return true;
        }
        let screen = self.caster.screen;
        let leaf = &self.mesh.leaves[self.raster.leaf[at] as usize];
        let up = leaf.corners.map(normal_of);
        screen.to_body(screen.tangents(pixel)).dot(up[0] + up[1] + up[2]) > 0.0
    }

    /// Whether everything around shows ground.
    fn is_inside(&self, pixel: DVec2) -> bool {
        let around = self.caster.around(pixel, self.bound_px + BESIDE_PX);
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

    /// Whether no ground around lies much farther.
    fn is_even(&self, pixel: DVec2, ground_m: f64, share: f64) -> bool {
        let farthest_m = ground_m * (1.0 + 5.0 * share);
        let around = self.caster.around(pixel, self.bound_px + BESIDE_PX);
        around.is_some_and(|around| {
            around.iter().all(|hit| hit.is_some_and(|hit| hit.depth_m <= farthest_m))
        })
    }
}

//! Collision patches: the triangles of one level over a disc, as physics engines take them.
//!
//! In:    a region, a level, a limit.
//! Out:   [`CollisionPatch`]: f32 around an f64 origin, each inner edge used once in each
//!        direction, ids that name the same vertex and triangle in every patch.
//! Keeps: nothing; buffers are the caller's.
//! Not here: single heights (`surface`).

use super::Ground;
use super::answer::{Answer, Query};
use super::place::{Cell, Corners, LEVEL_MAX};
use super::region::{Cap, Region, each_square};
use super::resident::Resident;
use crate::datasource::PageKey;
use crate::geodesy::{Ecef, Geodetic, narrow};
use crate::lattice::{key_of, middle, unfold};
use crate::lod::diamonds::leaf_key;
use core::fmt;
use glam::{DVec3, IVec3};

/// A piece of ground as a triangle mesh. Reuse one with [`Ground::fill_patch`]: its buffers stay.
#[derive(Clone, PartialEq, Debug)]
pub struct CollisionPatch {
    /// Where the axes of the vertices begin: the region's centre, at the surface there.
    pub origin: Geodetic,
    /// The same point, body-fixed.
    pub origin_ecef: Ecef,
    /// The level of all triangles.
    pub level: u8,
    /// East, north and up of each vertex from the origin, in metres.
    pub vertices: Vec<[f32; 3]>,
    /// Of each vertex, its lattice key; rising.
    pub vertex_ids: Vec<u64>,
    /// Three vertices each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle, the key of its hypotenuse's middle and its side of it.
    pub triangle_ids: Vec<u64>,
    corners: Vec<Corner>,
}

/// A corner of a triangle that was found.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Corner {
    id: u64,
    place: DVec3,
}

/// Why there is no patch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PatchFault {
    /// Not finite, latitude beyond ±π/2, negative radius, or level beyond [`LEVEL_MAX`].
    Refused,
    /// A page that the patch needs is not resident.
    NotReady {
        /// The first of them.
        page: PageKey,
    },
    /// The region holds more triangles than this.
    TooLarge {
        /// The limit.
        triangles_max: u32,
    },
}

impl fmt::Display for PatchFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused => write!(f, "the region or the level is not one"),
            Self::NotReady { page } => write!(f, "page {page:?} is not resident"),
            Self::TooLarge { triangles_max } => {
                write!(f, "the region holds more than {triangles_max} triangles of this level")
            }
        }
    }
}

impl core::error::Error for PatchFault {}

impl CollisionPatch {
    /// An empty patch, to be filled.
    pub fn new() -> Self {
        Self {
            origin: Geodetic { lat_rad: 0.0, lon_rad: 0.0, height_m: 0.0 },
            origin_ecef: Ecef(DVec3::ZERO),
            level: 0,
            vertices: Vec::new(),
            vertex_ids: Vec::new(),
            triangles: Vec::new(),
            triangle_ids: Vec::new(),
            corners: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.vertices.clear();
        self.vertex_ids.clear();
        self.triangles.clear();
        self.triangle_ids.clear();
        self.corners.clear();
    }
}

impl Default for CollisionPatch {
    fn default() -> Self {
        Self::new()
    }
}

impl Ground {
    /// The triangles of `level` over a region. Allocates.
    ///
    /// # Errors
    /// If the region is not one, or a page is not resident, or there are more than
    /// `triangles_max` triangles.
    pub fn collision_patch(
        &self,
        region: Region,
        level: u8,
        triangles_max: u32,
    ) -> Result<CollisionPatch, PatchFault> {
        let mut patch = CollisionPatch::new();
        self.fill_patch(region, level, triangles_max, &mut patch)?;
        Ok(patch)
    }

    /// The same into the caller's buffers, which grow at most to three corners a triangle. Without
    /// a patch, what was in them is lost.
    ///
    /// # Errors
    /// As for [`Self::collision_patch`].
    pub fn fill_patch(
        &self,
        region: Region,
        level: u8,
        triangles_max: u32,
        patch: &mut CollisionPatch,
    ) -> Result<(), PatchFault> {
        patch.clear();
        let cap = Cap::of(region, self.body()).filter(|_| level <= LEVEL_MAX);
        let cap = cap.ok_or(PatchFault::Refused)?;
        let mut fault = None;
        each_square(&cap, Cell::depth(level), &mut |square| {
            let cell = Cell { quadrant: square.quadrant, level, x: square.x, y: square.y };
            fault = self.add_cell(cell, triangles_max, patch).err();
            fault.is_none()
        });
        fault.map_or(Ok(()), Err)?;
        let Answer::Ok(ground) = self.height(region.centre, Query::Exact(level)) else {
            return Err(PatchFault::Refused);
        };
        patch.level = level;
        patch.origin = Geodetic { height_m: ground.height_m, ..region.centre };
        patch.origin_ecef = self.body().ecef_from_geodetic(patch.origin);
        number_vertices(patch);
        Ok(())
    }

    fn add_cell(
        &self,
        cell: Cell,
        triangles_max: u32,
        patch: &mut CollisionPatch,
    ) -> Result<(), PatchFault> {
        let key = cell.page();
        let page = self.map.find(key).ok_or(PatchFault::NotReady { page: key })?;
        for &corners in cell.triangles() {
            if patch.triangle_ids.len() >= triangles_max as usize {
                return Err(PatchFault::TooLarge { triangles_max });
            }
            self.add_triangle(page, &cell, corners, patch);
        }
        Ok(())
    }

    fn add_triangle(
        &self,
        page: &Resident,
        cell: &Cell,
        mut corners: Corners,
        patch: &mut CollisionPatch,
    ) {
        patch.triangle_ids.push(triangle_id(corners.map(|corner| cell.point(corner))));
        let triangle = self.shape.triangle(page, cell, corners);
        if cell.is_mirrored() {
            corners.swap(1, 2);
        }
        for (corner, place) in corners.into_iter().zip(triangle.corners) {
            patch.corners.push(Corner { id: key_of(cell.point(corner)), place });
        }
    }
}

/// Gives each distinct corner one vertex, in the order of their keys.
fn number_vertices(patch: &mut CollisionPatch) {
    let CollisionPatch { vertex_ids, triangles, corners, .. } = patch;
    vertex_ids.extend(corners.iter().map(|corner| corner.id));
    vertex_ids.sort_unstable();
    vertex_ids.dedup();
    patch.vertices.resize(vertex_ids.len(), [0.0; 3]);
    let to_local = patch.origin.enu_axes().transpose();
    for three in corners.chunks_exact(3) {
        let index = [0, 1, 2].map(|i: usize| {
            let at = vertex_ids.binary_search(&three[i].id).expect("every corner has its vertex");
            let local = to_local * (three[i].place - patch.origin_ecef.0);
            patch.vertices[at] = [narrow(local.x), narrow(local.y), narrow(local.z)];
            u32::try_from(at).expect("at most three vertices a triangle")
        });
        triangles.push(index);
    }
}

/// Names a triangle of any level by its apex and hypotenuse: the key of the hypotenuse's middle,
/// which no other two triangles share, and which of the two this is. A leaf of the drawn mesh has
/// the same corners, and so the same name, but for the order of the hypotenuse's ends, which does
/// not matter here.
pub fn triangle_id([apex, start, end]: [IVec3; 3]) -> u64 {
    let on_border = |axis: usize| start[axis] == 0 && end[axis] == 0;
    // A hypotenuse on a quadrant's border parts two quadrants, any other two halves of a square.
    let side = if on_border(0) {
        apex.x < 0
    } else if on_border(1) {
        apex.y < 0
    } else {
        let sum = start + end;
        let quadrant = match (sum.x >= 0, sum.y >= 0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        let [apex, start, end] = [apex, start, end].map(|point| unfold(quadrant, point));
        apex > (start.0 + end.0 - apex.0, start.1 + end.1 - apex.1)
    };
    leaf_key(key_of(middle(start, end)), usize::from(side))
}

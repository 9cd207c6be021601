//! The surface of a level: planes through lattice points, met by the vertical of a place.
//!
//! In:    the page and level that were chosen for a place.
//! Out:   [`Height`], corners in body-fixed metres.
//! Keeps: the body's shape.
//! Not here: choosing page and level (`choose`), which triangle (`place`).

use super::answer::Height;
use super::place::{Cell, Corners, LEVEL_BOUNDED, fold_f64};
use super::resident::Resident;
use crate::geodesy::Ellipsoid;
use crate::lattice::RADIUS;
use crate::lod::reach::{NORM_MIN, edges};
use glam::DVec3;

/// The body and whether it has a sea.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// The ellipsoid.
    pub body: Ellipsoid,
    /// Whether ground below sea level is covered by water.
    pub sea: bool,
    a2: f64,
    b2: f64,
}

/// All that a height is computed from, read from the page: so that many can be read at once.
#[derive(Clone, Copy)]
pub struct Reading {
    cell: Cell,
    corners: Corners,
    surface_m: [f64; 3],
    height: Height,
}

/// The corners of a triangle, counter-clockwise seen from outside, in body-fixed metres.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Where they are.
    pub corners: [DVec3; 3],
    /// The ellipsoid's normals there, of any length.
    pub normals: [DVec3; 3],
}

impl Shape {
    /// Of a body.
    pub fn new(body: Ellipsoid, sea: bool) -> Self {
        Self { body, sea, a2: body.a_m * body.a_m, b2: body.b_m() * body.b_m() }
    }

    /// The point at `height_m` over the ellipsoid along the normal in direction `p`, of any length.
    ///
    /// The same as `surface_from_normal(n) + n · height_m` for n = p/|p|, within 4 nm on the Earth.
    #[inline]
    pub fn lift(&self, p: DVec3, height_m: f64) -> DVec3 {
        let scaled = self.scaled(p);
        let (of_foot, of_normal) = (p.dot(scaled).sqrt(), p.length());
        // One division for both quotients.
        let both = 1.0 / (of_foot * of_normal);
        scaled * (both * of_normal) + p * (both * of_foot * height_m)
    }

    #[inline]
    fn scaled(&self, p: DVec3) -> DVec3 {
        DVec3::new(self.a2 * p.x, self.a2 * p.y, self.b2 * p.z)
    }

    /// The ellipsoid's point whose normal has the direction `p`, of any length.
    #[inline]
    pub fn foot(&self, p: DVec3) -> DVec3 {
        let scaled = self.scaled(p);
        scaled * (1.0 / p.dot(scaled).sqrt())
    }

    /// How the foot moves as `p` of unit length turns by `turn`, in metres.
    pub fn foot_turn(&self, p: DVec3, turn: DVec3) -> DVec3 {
        let (scaled, moved) = (self.scaled(p), self.scaled(turn));
        let square = p.dot(scaled);
        (moved - scaled * (p.dot(moved) / square)) / square.sqrt()
    }

    /// Bound on how far the plane of a level sags below the ellipsoid, for levels without bounds
    /// of their own.
    pub fn sagitta_m(&self, level: u8) -> f64 {
        let [curvature_min, curvature_max] = self.body.curvature_radii_m();
        let [odd, even] = edges(2);
        let edge = if level.is_multiple_of(2) { even } else { odd };
        let step = f64::from(RADIUS >> level.div_ceil(2));
        let edge_m = edge * step / NORM_MIN * curvature_max;
        (edge_m * edge_m / (8.0 * curvature_min)).min(self.body.a_m.max(self.body.b_m()))
    }

    /// Bound on the distance from the triangle of this cell to the ground and to finer levels.
    #[inline(always)]
    fn bound_m(&self, page: &Resident, cell: &Cell) -> f64 {
        if cell.level < LEVEL_BOUNDED {
            let relief_m = f64::from(page.ground.high_m) - f64::from(page.ground.low_m);
            return relief_m + self.sagitta_m(cell.level);
        }
        let (x, y) = cell.block(page.page.key);
        page.errors(x, y).of_level(cell.level)
    }

    /// Reads from `page` what the height in a triangle needs, at the place of these weights.
    #[inline(always)]
    pub fn read(
        &self,
        page: &Resident,
        (cell, corners, weights): (Cell, Corners, [f64; 3]),
    ) -> Reading {
        let key = page.page.key;
        let at = corners.map(|corner| cell.sample(key, corner));
        let mean = |of: [f64; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
        let ground_m = at.map(|at| f64::from(page.page.heights_m[at]));
        let mut surface_m = ground_m;
        let water = self.sea && mean(ground_m) < 0.0;
        let mut height = Height {
            height_m: 0.0,
            sea_level_m: 0.0,
            normal: DVec3::ZERO,
            level: cell.level,
            bound_m: self.bound_m(page, &cell),
            origin: crate::datasource::page::Origin::Procedural,
            water,
        };
        if self.sea {
            surface_m = surface_m.map(|m| if m < 0.0 { 0.0 } else { m });
        }
        if let Some(survey) = &page.page.survey {
            let sea_level_m = at.map(|at| f64::from(survey.sea_level_m[at]));
            (0..3).for_each(|i| surface_m[i] += sea_level_m[i]);
            height.sea_level_m = mean(sea_level_m);
            let later = usize::from(weights[1] > weights[0]);
            let nearest = if weights[2] > weights[later] { 2 } else { later };
            height.origin = survey.origin[at[nearest]];
        }
        Reading { cell, corners, surface_m, height }
    }

    /// The height where the vertical of `normal` meets the plane that was read.
    #[inline(always)]
    pub fn meet(&self, reading: &Reading, normal: DVec3) -> Height {
        let quadrant = reading.cell.quadrant;
        let corner = |i: usize| {
            let p = fold_f64(quadrant, reading.cell.unfolded(reading.corners[i]));
            self.lift(p, reading.surface_m[i])
        };
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        let plane = (b - a).cross(c - a);
        let (up, rise) = (normal.dot(plane), (a - self.foot(normal)).dot(plane));
        let length = plane.length();
        let outward = if up < 0.0 { -length } else { length };
        Height { height_m: rise / up, normal: plane * (1.0 / outward), ..reading.height }
    }

    /// A triangle of a cell.
    #[inline]
    pub fn triangle(&self, page: &Resident, cell: &Cell, mut corners: Corners) -> Triangle {
        if cell.is_mirrored() {
            corners.swap(1, 2);
        }
        let normals = corners.map(|corner| fold_f64(cell.quadrant, cell.unfolded(corner)));
        let corner = |i: usize| {
            let at = cell.sample(page.page.key, corners[i]);
            self.lift(normals[i], page.page.surface_m(at, self.sea))
        };
        Triangle { corners: [corner(0), corner(1), corner(2)], normals }
    }
}

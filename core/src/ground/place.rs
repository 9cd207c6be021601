//! Which triangle: from a direction to the cell and the triangle of any lattice level.
//!
//! In:    geodetic normals, lattice levels.
//! Out:   quadrant and (u, v) in f64; cells; their triangles; the page that serves a cell.
//! Keeps: nothing.
//! Not here: heights (`surface`), which level to take (`choose`).
//!
//! Level 2n cuts every square of side R/2ⁿ by one diagonal, through its corner with both indices
//! even and its corner with both odd; for n = 0 by the equator. Level 2n − 1 cuts every square of
//! side R/2ⁿ⁻¹ into four by its centre. `tests/ground.rs` holds this against real diamonds.

use crate::datasource::PageKey;
use crate::datasource::key::{PAGE_BITS, PAGE_SIDE};
use crate::lattice::{Quadrant, RADIUS, fold, signs};
use glam::{DVec3, IVec3};

/// Triangles of this level are the finest there are; the page that serves them has depth 22.
pub const LEVEL_MAX: u8 = crate::lattice::LEVEL_END - 1;
/// The coarsest level for which pages have bounds.
pub const LEVEL_BOUNDED: u8 = 2 * PAGE_BITS - 1;
/// No level needs deeper pages.
pub const DEPTH_END: u8 = LEVEL_MAX / 2 - PAGE_BITS;

/// Depth of the page that serves a level.
pub fn depth_of(level: u8) -> u8 {
    level.div_ceil(2).saturating_sub(PAGE_BITS)
}

/// The finest level that a page of this depth serves.
pub fn level_of(depth: u8) -> u8 {
    2 * (depth + PAGE_BITS)
}

/// A direction on the unfolded octahedral square, in lattice units, not rounded.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Place {
    /// Which base quadrant.
    pub quadrant: Quadrant,
    /// Along u, 0 to R.
    pub u: f64,
    /// Along v, 0 to R.
    pub v: f64,
}

/// Corners of a triangle in halves of its cell's side: right angle first, counter-clockwise in
/// (u, v).
pub type Corners = [[u8; 2]; 3];

const ANTI: [Corners; 2] = [[[0, 0], [2, 0], [0, 2]], [[2, 2], [0, 2], [2, 0]]];
const MAIN: [Corners; 2] = [[[2, 0], [2, 2], [0, 0]], [[0, 2], [0, 0], [2, 2]]];
const FOUR: [Corners; 4] = [
    [[1, 1], [0, 0], [2, 0]],
    [[1, 1], [2, 0], [2, 2]],
    [[1, 1], [2, 2], [0, 2]],
    [[1, 1], [0, 2], [0, 0]],
];

/// A square that a level cuts into triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cell {
    /// Which base quadrant.
    pub quadrant: Quadrant,
    /// The level that cuts it.
    pub level: u8,
    /// Column, in sides.
    pub x: u32,
    /// Row, in sides.
    pub y: u32,
}

impl Place {
    /// Where a geodetic normal points.
    #[inline]
    pub fn of(normal: DVec3) -> Self {
        let radius = f64::from(RADIUS);
        let (x, y) = (normal.x.abs(), normal.y.abs());
        let scale = radius / (x + y + normal.z.abs());
        // Rounding may lead out of the square by an ulp.
        let (x, y) = ((x * scale).min(radius), (y * scale).min(radius));
        let (u, v) = if normal.z >= 0.0 { (x, y) } else { (radius - y, radius - x) };
        let quadrant = match (normal.x >= 0.0, normal.y >= 0.0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        Self { quadrant, u, v }
    }

    /// Column and row of the square of side R/2^depth around it.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 2^30")]
    #[inline]
    pub fn square(&self, depth: u8) -> (u32, u32) {
        let count = 1_u32 << depth;
        let scale = f64::from(count) / f64::from(RADIUS);
        let index = |along: f64| ((along * scale) as u32).min(count - 1);
        (index(self.u), index(self.v))
    }

    /// The page of this depth around it.
    #[inline]
    pub fn page(&self, depth: u8) -> PageKey {
        let (x, y) = self.square(depth);
        PageKey::new(self.quadrant, depth, x, y)
    }

    /// The cell of this level around it, the triangle there, and the weights of its corners.
    #[inline]
    pub fn triangle(&self, level: u8) -> (Cell, Corners, [f64; 3]) {
        let depth = Cell::depth(level);
        let (x, y) = self.square(depth);
        let cell = Cell { quadrant: self.quadrant, level, x, y };
        let scale = f64::from(1_u32 << depth) / f64::from(RADIUS);
        // Both differences are exact.
        let (x, y) = (self.u * scale - f64::from(x), self.v * scale - f64::from(y));
        let cut = cell.cut();
        let (which, weights) = match cut {
            Cut::Main | Cut::Anti => halves((x, y), matches!(cut, Cut::Anti)),
            Cut::Four => match (y <= x, y <= 1.0 - x) {
                (true, true) => (0, [2.0 * y, 1.0 - x - y, x - y]),
                (true, false) => (1, [2.0 * (1.0 - x), x - y, x + y - 1.0]),
                (false, false) => (2, [2.0 * (1.0 - y), x + y - 1.0, y - x]),
                (false, true) => (3, [2.0 * x, y - x, 1.0 - x - y]),
            },
        };
        (cell, cell.triangles()[which], weights)
    }
}

/// Which half of a square, and the weights of its corners. Without branches: which half it is
/// nobody can foresee.
#[inline]
fn halves((x, y): (f64, f64), anti: bool) -> (usize, [f64; 3]) {
    let x = [x, 1.0 - x][usize::from(anti)];
    let above = x < y;
    let (low, high) = ([y, x][usize::from(above)], [x, y][usize::from(above)]);
    let others = [low, 1.0 - high];
    let turned = usize::from(above != anti);
    (usize::from(above), [high - low, others[turned], others[1 - turned]])
}

#[derive(Clone, Copy)]
enum Cut {
    Main,
    Anti,
    Four,
}

impl Cell {
    /// The cells of a level have side R/2^depth.
    pub fn depth(level: u8) -> u8 {
        level / 2
    }

    /// Its side in lattice units.
    pub fn side(&self) -> i32 {
        RADIUS >> Self::depth(self.level)
    }

    fn cut(&self) -> Cut {
        if !self.level.is_multiple_of(2) {
            Cut::Four
        } else if self.level == 0 || (self.x + self.y) % 2 == 1 {
            Cut::Anti
        } else {
            Cut::Main
        }
    }

    /// Its triangles.
    pub fn triangles(&self) -> &'static [Corners] {
        match self.cut() {
            Cut::Main => &MAIN,
            Cut::Anti => &ANTI,
            Cut::Four => &FOUR,
        }
    }

    /// Where a corner of one of its triangles lies on the unfolded square.
    #[inline]
    pub fn unfolded(&self, corner: [u8; 2]) -> (i32, i32) {
        let half = self.side() / 2;
        let along = |index: u32, corner: u8| (2 * index + u32::from(corner)).cast_signed() * half;
        (along(self.x, corner[0]), along(self.y, corner[1]))
    }

    /// The lattice point of a corner of one of its triangles.
    pub fn point(&self, corner: [u8; 2]) -> IVec3 {
        let (u, v) = self.unfolded(corner);
        fold(self.quadrant, u, v)
    }

    /// The page that serves it.
    pub fn page(&self) -> PageKey {
        let (depth, up) = (depth_of(self.level), Self::depth(self.level) - depth_of(self.level));
        PageKey::new(self.quadrant, depth, self.x >> up, self.y >> up)
    }

    /// Index of a corner's sample in the page that serves it.
    #[inline]
    pub fn sample(&self, page: PageKey, corner: [u8; 2]) -> usize {
        let (u, v) = self.unfolded(corner);
        let (u0, v0) = page.origin();
        let bits = page.step().trailing_zeros();
        let place = |along: i32| (along >> bits).cast_unsigned() as usize;
        place(v - v0) * PAGE_SIDE + place(u - u0)
    }

    /// The block of the page that serves it; the first of several where it is larger than one.
    #[inline]
    pub fn block(&self, page: PageKey) -> (usize, usize) {
        let at = self.sample(page, [0, 0]);
        (at % PAGE_SIDE / 4, at / PAGE_SIDE / 4)
    }

    /// Whether (u, v) runs clockwise in this quadrant, seen from outside.
    pub fn is_mirrored(&self) -> bool {
        let (sx, sy) = signs(self.quadrant);
        sx != sy
    }
}

/// The lattice point at (u, v) of a quadrant, in f64: exact.
#[inline]
pub fn fold_f64(quadrant: Quadrant, (u, v): (i32, i32)) -> DVec3 {
    fold(quadrant, u, v).as_dvec3()
}

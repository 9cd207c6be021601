//! A line over one small page: flat coordinates in which squares are parallelograms.
//!
//! In:    a page, a line, the part of it that may matter.
//! Out:   the part of the line over any square of the page, in a dozen operations.
//! Keeps: a few numbers, while the page is visited.
//! Not here: the walk (`walk`).
//!
//! The foot of a lattice point is a smooth function of (u, v) on each face of the octahedron. Its
//! first derivative at the page's middle makes every square a parallelogram; what is left is at
//! most half the second derivative times the squared distance. Seen from the centre of the body, a
//! point that moves along a line at distance D or more turns with a second derivative of at most
//! (1 + 3√3/8)/D², and D is at least R/√3: 4.95/R². The flattening adds less than a tenth of that
//! where it is below 1/50. So with 2.8·(d/R)² radii of curvature as slack nothing is lost.

use super::region::Square;
use super::resident::Resident;
use super::surface::Shape;
use super::walk::Line;
use crate::lattice::{RADIUS, fold};
use glam::DVec3;

/// Larger pages are not flat enough to gain by it.
const DEPTH_MIN: u8 = 7;

/// An affine function of (u, v), counted from the page's corner in its sides.
#[derive(Clone, Copy)]
struct Affine {
    offset: f64,
    u: f64,
    v: f64,
}

impl Affine {
    /// The middle, and half of the width, of its values over a square.
    #[inline]
    fn over(&self, u: f64, v: f64, half: f64) -> (f64, f64) {
        (self.offset + self.u * u + self.v * v, (self.u.abs() + self.v.abs()) * half)
    }
}

/// A line over one page.
pub struct Local {
    depth: u8,
    corner: (u32, u32),
    /// Distance of the foot beside the line, seen from above.
    beside: Affine,
    /// How far along the line.
    along: Affine,
    slack_m: f64,
    per_m: f64,
    span: (f64, f64),
    /// Height of the line's origin above the tangent plane of the page's middle.
    pub rise: f64,
    /// And its growth.
    pub climb: f64,
    cosine_min: f64,
}

impl Local {
    /// Of a page; `None` where it is too large, on the fold of the equator, the body too flat or
    /// the line too steep.
    pub fn new((shape, line): (&Shape, &Line), page: &Resident, span: (f64, f64)) -> Option<Self> {
        let square = Square::of(page.page.key);
        let count = 1_u32 << square.depth;
        if square.depth < DEPTH_MIN || square.x + square.y + 1 == count {
            return None;
        }
        let (up, angle) = square.cap();
        let climb = line.direction.dot(up);
        let level = line.direction - up * climb;
        let length = level.length();
        if length < 1e-3 || shape.body.f.abs() > 0.02 {
            return None;
        }
        let (foot, [u, v]) = (shape.foot(up), turns(shape, square, up));
        let (ahead, from_foot) = (level / length, line.origin - foot);
        let aside = up.cross(ahead);
        let [_, curvature_max_m] = shape.body.curvature_radii_m();
        let share = 1.224_8 / f64::from(count);
        let [low_m, high_m] = [page.ground.low_m, page.ground.high_m].map(|m| f64::from(m).abs());
        // Verticals lean against that of the middle.
        let lean_m = low_m.max(high_m) * angle * 1.01;
        let affine = |axis: DVec3, offset: f64| {
            let (u, v) = (u.dot(axis), v.dot(axis));
            Affine { offset: offset - 0.5 * (u + v), u, v }
        };
        Some(Self {
            depth: square.depth,
            corner: (square.x, square.y),
            beside: affine(aside, -from_foot.dot(aside)),
            along: affine(ahead, -from_foot.dot(ahead)),
            slack_m: 2.8 * share * share * curvature_max_m + lean_m + 1e-6,
            per_m: 1.0 / length,
            span,
            rise: from_foot.dot(up),
            climb,
            cosine_min: (1.0 - 0.5 * angle * angle).max(0.0),
        })
    }

    /// The part of the line over a square of the page.
    #[inline]
    pub fn span(&self, square: Square, end_m: f64) -> Option<(f64, f64)> {
        let bits = square.depth - self.depth;
        let side = 1.0 / f64::from(1_u32 << bits);
        let middle = |index: u32, corner: u32| (f64::from(index - (corner << bits)) + 0.5) * side;
        let (u, v) = (middle(square.x, self.corner.0), middle(square.y, self.corner.1));
        let (beside_m, width_m) = self.beside.over(u, v, 0.5 * side);
        if beside_m.abs() > width_m + self.slack_m {
            return None;
        }
        let (along_m, length_m) = self.along.over(u, v, 0.5 * side);
        let reach_m = length_m + self.slack_m;
        let from_m = ((along_m - reach_m) * self.per_m).max(self.span.0);
        let to_m = ((along_m + reach_m) * self.per_m).min(self.span.1).min(end_m);
        (from_m <= to_m).then_some((from_m, to_m))
    }

    /// The greatest height above the tangent plane of ground this high.
    #[inline]
    pub fn lowered_m(&self, high_m: f64) -> f64 {
        if high_m < 0.0 { high_m * self.cosine_min } else { high_m }
    }
}

/// How the foot moves from one side of a square to the other along u and v.
fn turns(shape: &Shape, square: Square, up: DVec3) -> [DVec3; 2] {
    let side = RADIUS >> square.depth;
    let (u, v) = (square.x.cast_signed() * side, square.y.cast_signed() * side);
    let middle = fold(square.quadrant, u + side / 2, v + side / 2).as_dvec3();
    let corner = fold(square.quadrant, u, v).as_dvec3();
    [(u + side, v), (u, v + side)].map(|(u, v)| {
        let edge = (fold(square.quadrant, u, v).as_dvec3() - corner) / middle.length();
        shape.foot_turn(up, edge - up * up.dot(edge))
    })
}

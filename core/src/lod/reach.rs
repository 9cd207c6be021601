//! How far a diamond and all its descendants reach, as pure functions of level and centre.
//!
//! In:    level and centre of a diamond.
//! Out:   lattice distances and the chord of the covering cap of normals; page depth of a level.
//! Keeps: nothing.
//! Not here: heights and errors (`screen_error`).
//!
//! Lengths are Euclidean, on the octahedron, in units of the cell's side s = R/2^(level div 2).
//! On a face one step along an axis of the square is √2 long, one along its steep diagonal √6.
//! A kid's centre lies √2/2 from an even diamond's and √6/4 from an odd one's, and grandkids are
//! half-size copies: so the geometric series 2·(√2/2 + √6/4) and 2·(√6/4 + √2/4) bound all
//! descendants; 1 % is added, so that rounding cannot break the nesting.

use super::diamonds::Shape;
use crate::datasource::key::PAGE_BITS;
use crate::lattice::{RADIUS, normal_of};
use crate::mesh::topology::segments;
use glam::{DVec3, IVec3};

/// Reach of an even diamond's descendants from its centre.
pub const EXTENT_EVEN: f64 = 1.01 * 2.639_1;
/// Reach of an odd diamond's descendants from its centre.
pub const EXTENT_ODD: f64 = 1.01 * 1.931_9;
/// Reach of an even diamond's kids' triangles from its centre: to a kid's and half its axis.
pub const KIDS_EVEN: f64 = 1.01 * 1.414_3;
/// Reach of an odd diamond's kids' triangles: to a kid's centre and half its steep diagonal.
pub const KIDS_ODD: f64 = 1.01 * 1.224_8;
/// Longest edge of one steep diagonal of a sample cell: √6 steps.
pub const DIAGONAL: f64 = 2.449_5;

/// Longest edges of the small triangles of odd and even levels, in sample steps.
///
/// Odd: two steps along an axis, 2√2. Even: one steep diagonal, or two where a patch is a single
/// triangle, since its page also holds the middle of its hypotenuse.
pub fn edges(patch_depth: u8) -> [f64; 2] {
    [2.828_5, if patch_depth == 0 { 2.0 * DIAGONAL } else { DIAGONAL }]
}

/// Least distance of the octahedron's surface from its centre: R/√3.
pub const NORM_MIN: f64 = RADIUS as f64 / 1.732_050_807_568_877_3;

/// Chord on the unit sphere from the diamond's normal to the farthest normal of a descendant.
///
/// Nested: a kid's cap lies within each of its parents' caps.
pub fn cap_of(level: u8, centre: IVec3) -> f64 {
    cap(level, centre, [EXTENT_EVEN, EXTENT_ODD])
}

/// Chord on the unit sphere from the diamond's normal to the farthest normal of its kids' triangles.
pub fn kids_cap_of(level: u8, centre: IVec3) -> f64 {
    cap(level, centre, [KIDS_EVEN, KIDS_ODD])
}

fn cap(level: u8, centre: IVec3, [even, odd]: [f64; 2]) -> f64 {
    let side = f64::from(RADIUS >> (level / 2));
    let extent = side * if level.is_multiple_of(2) { even } else { odd };
    let norm = centre.as_dvec3().length() - extent;
    extent / if norm > NORM_MIN { norm } else { NORM_MIN }
}

/// Chord on the unit sphere from the diamond's normal to the farthest normal of its two triangles.
///
/// Their sides are arcs of great circles, so the farthest is that of a corner while all lie in one
/// hemisphere around `normal`; at most `cap`, which is [`kids_cap_of`] the diamond.
pub fn own_cap_of(normal: DVec3, corners: [IVec3; 4], cap: f64) -> f64 {
    let normals = corners.map(normal_of);
    let far = |most: f64, corner: &DVec3| {
        let chord = (*corner - normal).length() * (1.0 + 1e-12);
        if chord > most { chord } else { most }
    };
    let own = normals.iter().fold(0.0, far);
    let is_small = normals.iter().all(|corner| corner.dot(normal) > 0.1);
    if is_small && own < cap { own } else { cap }
}

/// How far the small triangles of a diamond's leaves, of its kids' and of all finer descendants' sag
/// below a unit sphere, at most.
///
/// On one face of the octahedron all triangles of a level have the same three edges, up to their
/// sign; those of the next face are their mirror image. What an edge is long along the sphere varies
/// with the normal, within each part's cap. A plane through points on a sphere sags by half the
/// squared radius of the circle around them.
pub fn sags_of(
    normal: DVec3,
    shape: &Shape,
    patch_depth: u8,
    [own_cap, kids_cap, cap]: [f64; 3],
) -> [f64; 3] {
    let norm = shape.centre().as_dvec3().length();
    let sag = |edges: &[DVec3; 3], cap: f64| {
        // Along a face the norm changes by less than twice as much as the normal.
        let radius = (1.0 + 6.0 * cap) / (norm * (1.0 - 2.0 * cap)).max(NORM_MIN);
        let squares = edges.map(|edge| along_squared(edge, normal, cap));
        0.5 * radius * radius * around_squared(squares)
    };
    let edge = |from: IVec3, to: IVec3| (to - from).as_dvec3() / f64::from(segments(patch_depth));
    // Halving a triangle twice makes some whose hypotenuse lies across its own.
    let cut = |leg: DVec3, other: DVec3| [[leg, other, leg - other], [leg, other, leg + other]];
    let legs = [0, 1].map(|side| {
        let [apex, start, end] = shape.triangle(side);
        [edge(apex, start), edge(apex, end)]
    });
    let own = legs.map(|[leg, other]| cut(leg, other));
    let kids = legs.map(|[leg, other]| cut(0.5 * (leg - other), 0.5 * (leg + other)));
    let most = |triangles: &[[DVec3; 3]], cap: f64| {
        let images = (0..8).filter_map(|flips| mirror(normal, cap, flips));
        let sags = images.flat_map(|signs| {
            triangles.iter().map(move |edges| sag(&edges.map(|edge| edge * signs), cap))
        });
        sags.fold(0.0, f64::max)
    };
    let (own, kids) = (own.as_flattened(), kids.as_flattened());
    let own_sag = own.iter().map(|edges| sag(edges, own_cap)).fold(0.0, f64::max);
    // Grandkids are half-size copies.
    [own_sag, most(kids, kids_cap), 0.25 * most(own, cap).max(most(kids, cap))]
}

/// The signs of one of the faces that normals within `cap` lie on: bits of `flips` are axes.
fn mirror(normal: DVec3, cap: f64, flips: u8) -> Option<DVec3> {
    let sign = |axis: usize| {
        let flipped = flips >> axis & 1 == 1;
        let far = flipped && normal[axis].abs() > cap;
        (!far).then_some(if flipped { -1.0 } else { 1.0 })
    };
    Some(DVec3::new(sign(0)?, sign(1)?, sign(2)?))
}

/// The square of an edge's part along a sphere, at most, where the normal is within `cap` of `normal`.
fn along_squared(edge: DVec3, normal: DVec3, cap: f64) -> f64 {
    let length = edge.length();
    let up = (edge.dot(normal).abs() - cap * length).max(0.0);
    length * length - up * up
}

/// How far the plane through three points on a unit sphere sags below it between them.
pub fn sag_between(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    0.5 * around_squared([b - c, c - a, a - b].map(DVec3::length_squared))
}

/// The squared radius of the least circle around a triangle, from the squares of its sides.
fn around_squared(sides: [f64; 3]) -> f64 {
    let [a, b, c] = sides;
    let longest = a.max(b).max(c);
    let rest = a + b + c - longest;
    if rest <= longest {
        return 0.25 * longest;
    }
    let area = 2.0 * (a * b + b * c + c * a) - (a * a + b * b + c * c);
    // Of all acute triangles with this side the equilateral one needs the largest circle.
    (a * b * c / area).min(longest / 3.0)
}

/// Depth of the sample grid whose points are the vertices of level-`level` patches, and the
/// diamond's own centre: samples R/2^n apart.
pub fn grid_depth(level: u8, patch_depth: u8) -> u8 {
    let vertices = (level + patch_depth).div_ceil(2);
    let centre = level / 2 + 1;
    if vertices > centre { vertices } else { centre }
}

/// Depth of the page that serves a leaf triangle of this level.
pub fn page_depth(level: u8, patch_depth: u8) -> u8 {
    grid_depth(level, patch_depth).saturating_sub(PAGE_BITS)
}

/// Whether patches of this level use the page's finest grid: the page's bounds speak of them.
pub fn page_is_finest(level: u8, patch_depth: u8) -> bool {
    grid_depth(level, patch_depth) >= PAGE_BITS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{fold, middle};

    /// All descendants' centres of a quad, to some depth, with their levels.
    fn descend(quad: [IVec3; 4], level: u8, depth: u8, visit: &mut impl FnMut(IVec3, u8)) {
        let centre = middle(quad[0], quad[2]);
        visit(centre, level);
        if depth == 0 {
            return;
        }
        for edge in 0..4 {
            let (a, b) = (quad[edge], quad[(edge + 1) % 4]);
            let across = a + b - centre;
            if across.abs().element_sum() == RADIUS {
                descend([a, centre, b, across], level + 1, depth - 1, visit);
            }
        }
    }

    #[test]
    fn caps_cover_all_descendants_and_are_nested() {
        for (u, v) in [(4, 4), (4, 20), (12, 12), (20, 20), (44, 52), (60, 60)] {
            let at = |du: i32, dv: i32| fold(0, (u + du) << 24, (v + dv) << 24);
            let quad = [at(4, -4), at(4, 4), at(-4, 4), at(-4, -4)];
            let (centre, level) = (middle(quad[0], quad[2]), 6);
            let (normal, cap) = (normal_of(centre), cap_of(level, centre));
            descend(quad, level, 8, &mut |point, deeper| {
                let gap = (normal_of(point) - normal).length();
                assert!(gap + cap_of(deeper, point) <= cap || deeper == level, "{point} {deeper}");
            });
        }
    }
}

//! The octahedron lattice: every vertex is an integer point of |x| + |y| + |z| = 2³⁰.
//!
//! In:    lattice points, or (quadrant, u, v) of the unfolded octahedral square.
//! Out:   the other form, packed keys, surface normals, the four lattice neighbours.
//! Keeps: nothing.
//! Not here: diamonds (`lod`), pages (`datasource`), metres (`geodesy`).

use glam::{DVec3, IVec3};

/// The octahedron's radius in lattice units.
pub const RADIUS: i32 = 1 << 30;

/// Diamonds of this level and deeper do not exist: so every vertex keeps even coordinates and its
/// key fits 63 bits. On the Earth the finest edge is 2 cm.
pub const LEVEL_END: u8 = 57;

/// One of the four quadrants of the octahedral square: the base diamonds, eastward from +x+y.
///
/// A quadrant's square has +x or −x at one corner of u = R or v = R, the north pole at (0, 0) and
/// the south pole at (R, R).
pub type Quadrant = u8;

/// A lattice point as one integer: the tie breaker, and what tests compare.
///
/// Injective for points with even coordinates (all vertices above [`LEVEL_END`]).
pub fn key_of(point: IVec3) -> u64 {
    let half = |c: i32| (i64::from(c / 2) + (1 << 29)).unsigned_abs();
    (half(point.x) << 32) | (half(point.y) << 1) | u64::from(point.z < 0)
}

/// The geodetic surface normal at a lattice point: the point, normalised.
///
/// Error: 1.4e-16 rad, 0.9 nm on the Earth, at every level.
pub fn normal_of(point: IVec3) -> DVec3 {
    let p = point.as_dvec3();
    p / p.length()
}

/// The middle of an edge. Exact for every edge of a diamond above [`LEVEL_END`].
pub fn middle(a: IVec3, b: IVec3) -> IVec3 {
    IVec3::new((a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2)
}

/// Signs of x and y in a quadrant.
pub fn signs(quadrant: Quadrant) -> (i32, i32) {
    [(1, 1), (-1, 1), (-1, -1), (1, -1)][usize::from(quadrant & 3)]
}

/// Unfolds a lattice point of `quadrant` to (u, v) in [0, R]². Points on the quadrant's border may
/// be asked for in each quadrant that they touch.
pub fn unfold(quadrant: Quadrant, point: IVec3) -> (i32, i32) {
    debug_assert!(signs(quadrant).0 * point.x >= 0 && signs(quadrant).1 * point.y >= 0);
    let (x, y) = (point.x.abs(), point.y.abs());
    if point.z >= 0 { (x, y) } else { (RADIUS - y, RADIUS - x) }
}

/// Folds (u, v) of a quadrant back to the lattice point; the inverse of [`unfold`].
pub fn fold(quadrant: Quadrant, u: i32, v: i32) -> IVec3 {
    debug_assert!((0..=RADIUS).contains(&u) && (0..=RADIUS).contains(&v));
    let (sx, sy) = signs(quadrant);
    let above = RADIUS - u - v;
    if above >= 0 {
        IVec3::new(sx * u, sy * v, above)
    } else {
        IVec3::new(sx * (RADIUS - v), sy * (RADIUS - u), above)
    }
}

/// The lattice points at distance `step` along the square's two axes, in cyclic order: what
/// central differences are taken over. A function of the point alone, so two pages that share it
/// agree; the four equatorial corners, where the square has no such cross, use the four edges.
///
/// Requires the point's coordinates to be multiples of `step`.
pub fn cross_of(point: IVec3, step: i32) -> [IVec3; 4] {
    let IVec3 { x, y, z } = point;
    let hemisphere = |up: i32| {
        move |dx: i32, dy: i32| {
            let (x, y) = (x + dx, y + dy);
            IVec3::new(x, y, up * (RADIUS - x.abs() - y.abs()))
        }
    };
    if z != 0 {
        let at = hemisphere(z.signum());
        // Seen from outside, the south runs the other way round.
        let (dx, dy) = if z > 0 { ((step, 0), (0, step)) } else { ((0, step), (step, 0)) };
        return [at(dx.0, dx.1), at(dy.0, dy.1), at(-dx.0, -dx.1), at(-dy.0, -dy.1)];
    }
    let (north, south) = (hemisphere(1), hemisphere(-1));
    if x == 0 || y == 0 {
        let (inward, aside) = ((-step * x.signum(), -step * y.signum()), (y.signum(), x.signum()));
        let on = |side: i32| {
            north(inward.0 + side * step * aside.0.abs(), inward.1 + side * step * aside.1.abs())
        };
        return [on(1), north(inward.0, inward.1), on(-1), south(inward.0, inward.1)];
    }
    let (dx, dy) = (-step * x.signum(), -step * y.signum());
    [north(dx, 0), north(0, dy), south(0, dy), south(dx, 0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> [IVec3; 6] {
        [IVec3::X, IVec3::NEG_X, IVec3::Y, IVec3::NEG_Y, IVec3::Z, IVec3::NEG_Z].map(|p| p * RADIUS)
    }

    fn sample_points() -> Vec<(Quadrant, i32, i32)> {
        let steps = [0, 2, 1 << 20, RADIUS / 4, RADIUS / 2, 3 * (RADIUS / 4), RADIUS - 2, RADIUS];
        let mut points = Vec::new();
        for quadrant in 0..4 {
            for u in steps {
                points.extend(steps.map(|v| (quadrant, u, v)));
            }
        }
        points
    }

    #[test]
    fn folding_is_the_inverse_of_unfolding_and_stays_on_the_octahedron() {
        for (quadrant, u, v) in sample_points() {
            let point = fold(quadrant, u, v);
            assert_eq!(point.x.abs() + point.y.abs() + point.z.abs(), RADIUS);
            assert_eq!(fold(quadrant, unfold(quadrant, point).0, unfold(quadrant, point).1), point);
        }
    }

    #[test]
    fn keys_tell_all_points_apart() {
        let mut points: Vec<_> =
            sample_points().into_iter().map(|(q, u, v)| fold(q, u, v)).collect();
        points.extend(corners());
        points.sort_by_key(|p| (p.x, p.y, p.z));
        points.dedup();
        let mut keys: Vec<_> = points.iter().map(|&p| key_of(p)).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), points.len());
    }

    #[test]
    fn crosses_lie_on_the_octahedron_and_turn_counter_clockwise_seen_from_outside() {
        for (quadrant, u, v) in sample_points() {
            let point = fold(quadrant, u, v);
            let cross = cross_of(point, 2);
            for p in cross {
                assert_eq!(p.x.abs() + p.y.abs() + p.z.abs(), RADIUS, "{point} {p}");
                assert!((p - point).abs().max_element() <= 2);
            }
            let normal = (cross[0] - cross[2]).as_dvec3().cross((cross[1] - cross[3]).as_dvec3());
            let turn = normal.dot(point.as_dvec3());
            let flipped = point.z == 0 || u == 0 || v == 0 || u == RADIUS || v == RADIUS;
            assert!(turn > 0.0 || flipped, "{point}: {turn}");
            assert!(turn != 0.0, "{point} has a flat cross");
        }
    }
}

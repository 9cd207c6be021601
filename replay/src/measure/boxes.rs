//! Rays against boxes, four boxes at a time, in small numbers that err on the safe side.
//!
//! In:    boxes in f64, a ray.
//! Out:   which of four boxes the ray may enter, and not after where.
//! Keeps: nothing.
//! Not here: what lies in the boxes (`plate`, `reference`).
//!
//! Boxes within a box have corners of 16 bits: so most of what a ray looks at stays in the caches.
//! A box that the ray enters is never missed: corners are rounded outward, the origin's rounding
//! and that of the differences in f32 widen the box, and a share of 1e-6 is allowed for the products.

use glam::{DVec3, Vec4};
use overfly_core::geodesy::narrow;

/// Least and greatest corner.
#[derive(Clone, Copy, Debug)]
pub struct Box3 {
    /// Least coordinates.
    pub low: DVec3,
    /// Greatest coordinates.
    pub high: DVec3,
}

impl Box3 {
    /// Around nothing.
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// Around both.
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Grown on all sides.
    pub fn grown(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Distance from a point; 0 inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        (self.low - point).max(point - self.high).max(DVec3::ZERO).length()
    }
}

/// The grid on which corners of boxes lie: 65535 steps along each side of a box around all.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    low: DVec3,
    per_m: DVec3,
}

const STEPS: f64 = 65_535.0;

impl Steps {
    /// Within a box.
    pub fn new(whole: &Box3) -> Self {
        let size = whole.high - whole.low;
        // Flat boxes need no finer steps than this.
        let least = (1e-6 * size.max_element()).max(f64::MIN_POSITIVE);
        Self { low: whole.low, per_m: STEPS / size.max(DVec3::splat(least)) }
    }
}

/// Four boxes.
pub struct Quad {
    low: [[u16; 4]; 3],
    high: [[u16; 4]; 3],
}

impl Quad {
    /// Rounds four boxes outward.
    pub fn new(boxes: &[Box3; 4], steps: &Steps) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let whole = |step: f64| step.clamp(0.0, STEPS) as u16;
        let of = |place: DVec3| (place - steps.low) * steps.per_m;
        // Rounding in f64 is not worth a step, but may lead beyond one.
        let low = boxes.map(|of_all| (of(of_all.low) - 1e-3).floor());
        let high = boxes.map(|of_all| (of(of_all.high) + 1e-3).ceil());
        Self {
            low: [0, 1, 2].map(|axis: usize| low.map(|place| whole(place[axis]))),
            high: [0, 1, 2].map(|axis: usize| high.map(|place| whole(place[axis]))),
        }
    }

    /// One of the boxes, as large as it became.
    pub fn get(&self, at: usize, steps: &Steps) -> Box3 {
        let of = |corner: &[[u16; 4]; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| f64::from(corner[axis][at]));
            steps.low + DVec3::new(x, y, z) / steps.per_m
        };
        Box3 { low: of(&self.low), high: of(&self.high) }
    }
}

/// Where rays come from.
#[derive(Clone, Copy)]
pub struct Origin {
    /// Taken from least corners, and from greatest ones.
    less: [f32; 3],
    more: [f32; 3],
    per_m: DVec3,
}

/// What roundings of the origin, of differences and of corners at the end of the grid come to, as a
/// share of the coordinates.
const ROUNDING: f64 = 4.0 / 16_777_216.0;
/// What roundings of quotients come to.
const SHARE: f32 = 1.0 + 1e-6;
/// Slower rays along an axis move as fast as this.
const LEAST: f64 = 1e-18;

impl Origin {
    /// A point, in the axes of the boxes on a grid.
    pub fn new(from: DVec3, steps: &Steps) -> Self {
        let from = (from - steps.low) * steps.per_m;
        let slack = from.abs().max(DVec3::splat(STEPS)) * ROUNDING;
        Self {
            less: (from + slack).to_array().map(narrow),
            more: (from - slack).to_array().map(narrow),
            per_m: steps.per_m,
        }
    }
}

/// A ray, ready for boxes.
pub struct Ray {
    less: [Vec4; 3],
    more: [Vec4; 3],
    per: [Vec4; 3],
}

impl Ray {
    /// From an origin.
    #[inline]
    pub fn new(origin: &Origin, direction: DVec3) -> Self {
        let fast = |d: f64| if d.abs() < LEAST { LEAST.copysign(d) } else { d };
        Self {
            less: origin.less.map(Vec4::splat),
            more: origin.more.map(Vec4::splat),
            per: (direction * origin.per_m).to_array().map(|d| Vec4::splat(narrow(1.0 / fast(d)))),
        }
    }

    /// Where the ray enters four boxes, and which of them it does before `end`, a bit each.
    #[inline]
    pub fn enters(&self, quad: &Quad, end: f64) -> ([f32; 4], u32) {
        let mut enter = Vec4::ZERO;
        let mut leave = Vec4::splat(narrow(end));
        for axis in 0..3 {
            let [low, high] = [quad.low[axis], quad.high[axis]].map(lanes);
            let a = (low - self.less[axis]) * self.per[axis];
            let b = (high - self.more[axis]) * self.per[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        let met = enter.cmple(leave * SHARE).bitmask();
        ((enter * (2.0 - SHARE)).to_array(), met)
    }
}

fn lanes(steps: [u16; 4]) -> Vec4 {
    Vec4::from_array(steps.map(f32::from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::digest::mix;

    /// A number from -1 to 1.
    fn dice(seed: u64) -> f64 {
        (mix(seed) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn dice3(seed: u64) -> DVec3 {
        DVec3::new(dice(3 * seed), dice(3 * seed + 1), dice(3 * seed + 2))
    }

    #[test]
    fn a_box_that_a_ray_touches_is_never_missed() {
        for seed in 0..20_000_u64 {
            // From flat boxes before the eye to thin ones at the horizon.
            let away_m = libm::exp2(20.0 * dice(7 * seed));
            let (low, size) = (dice3(seed + 50_000) * 1e3, dice3(seed + 90_000).abs());
            let size = size * DVec3::new(1.0, 1.0, libm::exp2(-30.0 * dice(11 * seed).abs()));
            let target = Box3 { low, high: low + size };
            // Through a corner.
            let corner = [target.low, target.high][(seed % 2) as usize];
            let from = corner + dice3(seed + 130_000) * away_m;
            let mut direction = corner - from;
            if seed % 5 == 0 {
                direction.x = 0.0;
            }
            let from = corner - direction;
            let around = Box3 { low: low.min(dice3(seed) * 2e3), ..target };
            let steps = Steps::new(&around);
            let ray = Ray::new(&Origin::new(from, &steps), direction);
            let (entries, met) = ray.enters(&Quad::new(&[target; 4], &steps), 1.0);
            assert_eq!(met, 15, "seed {seed}: {target:?} from {from}");
            assert!(f64::from(entries[0]) <= 1.0, "seed {seed}");
        }
    }

    #[test]
    fn a_box_beside_a_ray_or_beyond_its_end_is_passed() {
        let low = DVec3::new(1.0, 1.0, 9.0);
        let target = Box3 { low, high: low + 1.0 };
        let steps = Steps::new(&target);
        let ray = |direction| Ray::new(&Origin::new(DVec3::ZERO, &steps), direction);
        let quad = Quad::new(&[target; 4], &steps);
        let direction = DVec3::new(0.15, 0.15, 1.0);
        assert_eq!(ray(direction).enters(&quad, f64::INFINITY).1, 15);
        assert_eq!(ray(direction).enters(&quad, 8.9).1, 0);
        assert_eq!(ray(-direction).enters(&quad, f64::INFINITY).1, 0);
        assert_eq!(ray(DVec3::new(0.0, 0.15, 1.0)).enters(&quad, f64::INFINITY).1, 0);
    }
}

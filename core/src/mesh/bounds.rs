//! Bounding spheres as columns, a group of slots each, and where they lie before a camera.
//!
//! In:    spheres of filled slots; the planes of a view and the borders of its depth ranges.
//! Out:   for each range, one bit a slot; how far the camera may move before a bit can change.
//! Keeps: x, y, z and radius of each sphere.
//! Not here: which slots are live (`patches`), draws and their digest (`place`).
//!
//! A sphere of radius r with its centre at d from the eye is in range k where
//! `m = min(p·d + r over the planes p, f·d + r − near, far − (f·d − r))` is not below 0. Let the
//! eye have moved by Δ and the planes and f, all unit vectors, each by at most ρ: then m has
//! changed by at most Δ(1 + ρ) + ρ|d|. So the bit stands while that is below |m|.

use crate::camera::Camera;
use glam::DVec3;

/// One bit for each slot of a group, slot 0 in the lowest.
pub type Mask = u32;

/// Slots in one group. Fewer would make more records to read in a frame in which nothing is due;
/// of more, one slot near a border makes all to be looked at again.
pub const GROUP: usize = Mask::BITS as usize;

/// Most depth ranges of a view.
pub const RANGES_MAX: usize = 8;

/// The radius of no sphere: in no range of any camera, however far that moves. Finite, so that
/// no infinity meets another.
const NOWHERE_M: f64 = f64::MIN / 4.0;

/// Minima in the making side by side.
const LANES: usize = 8;

/// Share of a length that bounds all rounding in m, many times over.
const ROUNDING: f64 = 1.0 / (1_u64 << 40) as f64;

/// The bounding spheres of a group: 32 bytes a slot.
#[derive(Clone, PartialEq, Debug)]
pub struct Bounds {
    x_m: [f64; GROUP],
    y_m: [f64; GROUP],
    z_m: [f64; GROUP],
    radius_m: [f64; GROUP],
}

/// The borders of one view: planes through the eye, and depth ranges.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Borders {
    eye: DVec3,
    planes: [DVec3; 4],
    forward: DVec3,
    ranges: usize,
    near_m: [f64; RANGES_MAX],
    far_m: [f64; RANGES_MAX],
}

/// Where the spheres of a group lie.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Seen {
    /// For each range the slots that touch it.
    pub masks: [Mask; RANGES_MAX],
    /// No bit changes while `metres moved · (1 + radians turned) · per_m + radians turned ·
    /// per_radian` is below 1, the turn being the greatest change of a unit vector.
    pub per_m: f64,
    /// See `per_m`.
    pub per_radian: f64,
}

impl Bounds {
    /// A group without a sphere.
    pub const EMPTY: Self = Self {
        x_m: [0.0; GROUP],
        y_m: [0.0; GROUP],
        z_m: [0.0; GROUP],
        radius_m: [NOWHERE_M; GROUP],
    };

    /// Sets the sphere of one slot of the group.
    pub fn set(&mut self, at: usize, centre: DVec3, radius_m: f64) {
        (self.x_m[at], self.y_m[at], self.z_m[at]) = (centre.x, centre.y, centre.z);
        self.radius_m[at] = radius_m;
    }

    /// Centre and radius of one slot of the group; `None` where there is no sphere.
    pub fn sphere(&self, at: usize) -> Option<(DVec3, f64)> {
        let centre = DVec3::new(self.x_m[at], self.y_m[at], self.z_m[at]);
        let radius_m = self.radius_m[at];
        (radius_m >= 0.0).then_some((centre, radius_m))
    }

    /// Takes the sphere of one slot away.
    pub fn clear(&mut self, at: usize) {
        self.set(at, DVec3::ZERO, NOWHERE_M);
    }

    /// The slots in each range, and for how long. Every loop here is free of branches, so that it
    /// becomes vector code; each number is what scalar code gives. `sides` is scratch.
    pub fn seen(&self, borders: &Borders, sides: &mut Sides) -> Seen {
        self.measure(borders, sides);
        let mut masks = [0; RANGES_MAX];
        for (range, mask) in masks[..borders.ranges].iter_mut().enumerate() {
            *mask = sides.within(borders.near_m[range], borders.far_m[range]);
        }
        let [least_m, least_radians] = self.slacks(sides);
        let per = |slack: f64| if slack > 0.0 { 1.0 / slack } else { f64::INFINITY };
        Seen { masks, per_m: per(least_m), per_radian: per(least_radians) }
    }

    /// The least |m| and the least |m| / |d|, both rounded down.
    fn slacks(&self, sides: &Sides) -> [f64; 2] {
        // Several minima at once, so that none waits for the one before.
        let (mut metres, mut radians) = ([f64::MAX; LANES], [f64::MAX; LANES]);
        for first in (0..GROUP).step_by(LANES) {
            for lane in 0..LANES {
                let i = first + lane;
                let away_m = sides.away_m[i];
                let slack_m = sides.slack_m[i] - ROUNDING * (away_m + self.radius_m[i]);
                metres[lane] = least(metres[lane], slack_m);
                radians[lane] = least(radians[lane], slack_m / away_m);
            }
        }
        [metres, radians].map(|lanes| lanes.into_iter().fold(f64::MAX, least))
    }

    fn measure(&self, borders: &Borders, sides: &mut Sides) {
        let Borders { eye, planes: [a, b, c, d], forward, .. } = borders;
        for i in 0..GROUP {
            let to = DVec3::new(self.x_m[i], self.y_m[i], self.z_m[i]) - *eye;
            let radius_m = self.radius_m[i];
            let nearest = least(least(a.dot(to), b.dot(to)), least(c.dot(to), d.dot(to)));
            let depth_m = forward.dot(to);
            sides.inside_m[i] = nearest + radius_m;
            sides.back_m[i] = depth_m + radius_m;
            sides.front_m[i] = depth_m - radius_m;
            // At least the distance; the millimetre keeps a quotient finite.
            sides.away_m[i] = to.x.abs() + to.y.abs() + to.z.abs() + 1e-3;
            sides.slack_m[i] = f64::MAX;
        }
    }
}

/// Scratch of [`Bounds::seen`]: what the ranges share, by slot.
pub struct Sides {
    /// The least p·d + r.
    inside_m: [f64; GROUP],
    /// Depth of the sphere's far and near end.
    back_m: [f64; GROUP],
    front_m: [f64; GROUP],
    /// Upper bound of |d|.
    away_m: [f64; GROUP],
    /// The least |m| so far.
    slack_m: [f64; GROUP],
}

impl Sides {
    /// Nothing measured.
    pub const EMPTY: Self = Self {
        inside_m: [0.0; GROUP],
        back_m: [0.0; GROUP],
        front_m: [0.0; GROUP],
        away_m: [0.0; GROUP],
        slack_m: [0.0; GROUP],
    };

    /// The slots within one range; a difference has the sign of the comparison it stands for.
    fn within(&mut self, near_m: f64, far_m: f64) -> Mask {
        let mut mask = 0_u64;
        for (i, bit) in BITS.into_iter().enumerate() {
            let range_m = least(self.back_m[i] - near_m, far_m - self.front_m[i]);
            let m = least(range_m, self.inside_m[i]);
            self.slack_m[i] = least(self.slack_m[i], m.abs());
            mask |= if m >= 0.0 { bit } else { 0 };
        }
        Mask::try_from(mask).expect("as many bits as slots")
    }
}

impl Borders {
    /// The borders of a camera and of its ranges, from near to far.
    ///
    /// # Panics
    /// If there are more than [`RANGES_MAX`].
    pub fn new(camera: &Camera, ranges: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut borders = Self {
            eye: camera.eye.0,
            planes: camera.side_planes,
            forward: camera.forward,
            ranges: 0,
            near_m: [0.0; RANGES_MAX],
            far_m: [0.0; RANGES_MAX],
        };
        for (near_m, far_m) in ranges {
            borders.near_m[borders.ranges] = near_m;
            borders.far_m[borders.ranges] = far_m;
            borders.ranges += 1;
        }
        borders
    }

    /// Whether both have the same ranges.
    pub fn same_ranges(&self, other: &Self) -> bool {
        (self.ranges, self.near_m, self.far_m) == (other.ranges, other.near_m, other.far_m)
    }

    /// Upper bounds on how far the eye and how far any unit vector moved between two: Δ and ρ.
    pub fn moved(&self, other: &Self) -> (f64, f64) {
        let mut turn_radians = (self.forward - other.forward).length();
        for (plane, old) in self.planes.iter().zip(&other.planes) {
            turn_radians = -least(-turn_radians, -(*plane - *old).length());
        }
        let up = 1.0 + ROUNDING;
        ((self.eye - other.eye).length() * up, turn_radians * up)
    }
}

/// As wide as what compares, so that both are lanes of one vector.
const BITS: [u64; GROUP] = {
    let mut bits = [0; GROUP];
    let mut i = 0;
    while i < GROUP {
        bits[i] = 1 << i;
        i += 1;
    }
    bits
};

/// The lesser: one instruction, other than `f64::min` with its rules for NaN.
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

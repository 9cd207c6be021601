//! From orbit to a roll along the ground.
//!
//! In:    the body and its ground.
//! Out:   three minutes at 60 Hz.
//! Keeps: nothing.
//! Not here: where it comes down (`landing`).

use super::Flight;
use super::landing::{Landing, choose};
use super::track::{Ramp, away, geodetic, heading, smooth_step};
use crate::pose::Pose;
use glam::DVec3;
use overfly_core::geodesy::trig::{acos, exp, ln};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::units::Radians;

const RATE_HZ: f64 = 60.0;
const FRAMES: usize = 10_801;
const END_S: f64 = 180.0;
/// The roll at the end begins here.
const ROLL_FRAME: usize = 160 * 60;
const RAMP: Ramp = Ramp { up_s: 18.0, down_s: 30.0, end_s: 160.0 };
/// Height above the ground in the roll.
const EYE_M: f64 = 2.0;
/// Metres forward for each metre down.
const GLIDE: f64 = 6.0;
/// Radians that the spiral turns while its radius grows e-fold.
const TURN: f64 = 0.2;
/// The last lift goes within these frames at the end.
const SETTLE_FRAMES: usize = 180;
/// Mountains are cleared by this part of the height above the landing.
const CLEARED: f64 = 0.25;

/// Three minutes at 60 Hz from 400 km (at most 0.0627 of the equatorial radius) to 2 m above the
/// ground, in a spiral whose height and radius fall at an even rate in logarithm; the last 20 s
/// roll at 10 m/s (at most 0.002 of the radius a second).
///
/// It comes down on land between 100 m and 1500 m high near a coast (`ground_height_m` below 0) and
/// near mountains, where there is such a place; see the module `landing`. No pose is lower than 2 m
/// above the ground under it; those of the roll are as much higher as a smooth ride over the ground
/// within 5 m asks for, the last by no more than the ground before it is rough: centimetres on the
/// Earth.
pub fn descent(body: &Ellipsoid, ground_height_m: &dyn Fn(Geodetic) -> f64) -> Flight {
    let landing = choose(body, ground_height_m);
    let path = Path::new(body, landing);
    let above_m: Vec<f64> = (0..FRAMES).map(|i| path.height_m(time_s(i))).collect();
    let normal = |i: usize| path.normal(path.radius(time_s(i), above_m[i]));
    let ground_m: Vec<f64> =
        (0..FRAMES).map(|i| ground_height_m(geodetic(normal(i), 0.0))).collect();
    let heights_m = ride(&above_m, &ground_m);
    let poses = (0..FRAMES).map(|i| path.pose(time_s(i), above_m[i], heights_m[i])).collect();
    Flight { name: "descent".into(), rate_hz: RATE_HZ, poses, raised_m: 0.0 }
}

fn time_s(frame: usize) -> f64 {
    frame as f64 / RATE_HZ
}

/// The spiral over the ellipsoid.
struct Path {
    landing: Landing,
    radius_m: f64,
    top_m: f64,
    roll_mps: f64,
    /// The spiral's centre is this far beyond the last pose; metres.
    beyond_m: f64,
    dip_rad: f64,
}

impl Path {
    fn new(body: &Ellipsoid, landing: Landing) -> Self {
        let radius_m = body.a_m;
        let top_m = (0.0627 * radius_m).min(400_000.0);
        Self {
            landing,
            radius_m,
            top_m,
            roll_mps: (0.002 * radius_m).min(10.0),
            beyond_m: (0.02 * radius_m).min(100.0),
            dip_rad: acos(radius_m / (radius_m + top_m)),
        }
    }

    /// Height above the ground of the landing.
    fn height_m(&self, time_s: f64) -> f64 {
        let left = 1.0 - RAMP.way_s(time_s) / RAMP.total_s();
        EYE_M * exp(ln(self.top_m / EYE_M) * left)
    }

    /// Distance from the spiral's centre, as an angle.
    fn radius(&self, time_s: f64, height_m: f64) -> f64 {
        let roll_m = self.roll_mps * (END_S - time_s);
        (self.beyond_m + roll_m + GLIDE * (height_m - EYE_M)) / self.radius_m
    }

    /// The point of the spiral at this distance from its centre.
    fn normal(&self, radius: f64) -> DVec3 {
        let azimuth = self.landing.azimuth_rad + TURN * ln(1.0 + radius / self.straight());
        away(self.landing.centre, azimuth, radius)
    }

    /// The spiral is straight well within this distance of its centre.
    fn straight(&self) -> f64 {
        10.0 * self.beyond_m / self.radius_m
    }

    fn pose(&self, time_s: f64, above_m: f64, height_m: f64) -> Pose {
        let radius = self.radius(time_s, above_m);
        let at = geodetic(self.normal(radius), height_m);
        let direction = self.normal(radius * (1.0 - 1e-5)) - self.normal(radius * (1.0 + 1e-5));
        let turning = RAMP.speed(time_s) * radius / (radius + self.straight());
        Pose {
            time_s,
            at,
            heading: Radians(heading(at, direction)),
            pitch: Radians(self.pitch(RAMP.way_s(time_s) / RAMP.total_s())),
            // Inward along the spiral the azimuth falls: a turn to the left.
            roll: Radians::from_degrees(-10.0 * turning),
        }
    }

    /// From the limb in the middle of the picture down to the ground, and up to the horizon.
    fn pitch(&self, progress: f64) -> f64 {
        let [down, level] = [-35.0, -6.0].map(|deg| Radians::from_degrees(deg).0);
        let first = smooth_step(progress / 0.25);
        let second = smooth_step((progress - 0.3) / 0.7);
        -self.dip_rad + (down + self.dip_rad) * first + (level - down) * second
    }
}

/// Heights above the ellipsoid that follow `above_m` over the landing and clear the ground.
///
/// Over the lowest ground of the roll the nominal height is `above_m`; what the ground under any
/// pose asks for beyond it is added as the smoothed maximum over a window in time, which lies above
/// every single demand because no weight reaches farther than the maximum does.
fn ride(above_m: &[f64], ground_m: &[f64]) -> Vec<f64> {
    let base_m = ground_m[ROLL_FRAME..].iter().copied().fold(f64::INFINITY, f64::min);
    let lack = |(&above_m, &ground_m): (&f64, &f64)| {
        let clear_m = EYE_M + CLEARED * (above_m - EYE_M);
        (ground_m + clear_m - base_m - above_m).max(0.0)
    };
    let lacks_m: Vec<f64> = above_m.iter().zip(ground_m).map(lack).collect();
    let last = lacks_m.len() - 1;
    let highest = |i: usize| {
        let window = window(last - i);
        let range = i.saturating_sub(window)..=(i + window).min(last);
        lacks_m[range].iter().copied().fold(0.0, f64::max)
    };
    let highest_m: Vec<f64> = (0..=last).map(highest).collect();
    let mut lifts_m: Vec<f64> = (0..=last).map(|i| smoothed(&highest_m, i)).collect();
    settle(&mut lifts_m, &lacks_m);
    lifts_m.iter().zip(above_m).map(|(lift_m, above_m)| base_m + above_m + lift_m).collect()
}

/// Lowers the end of the ride, smoothly over its last seconds, until some pose is as low as it may
/// be: the last one, unless the ground just before it is rough.
fn settle(lifts_m: &mut [f64], lacks_m: &[f64]) {
    let begin = lifts_m.len() - 1 - SETTLE_FRAMES;
    let share = |i: usize| smooth_step((i - begin) as f64 / SETTLE_FRAMES as f64);
    let spare_m = |i: usize| (lifts_m[i] - lacks_m[i]) / share(i);
    let by_m = (begin + 1..lifts_m.len()).map(spare_m).fold(f64::INFINITY, f64::min);
    for (i, lift_m) in lifts_m.iter_mut().enumerate().skip(begin) {
        *lift_m -= by_m * share(i);
    }
}

/// Frames to either side whose ground counts, `left` frames before the end: half a second in the
/// roll, up to 3.7 s before it.
fn window(left: usize) -> usize {
    30 + left.saturating_sub(1200) / 50
}

/// The weighted mean about frame `i`, as wide as the windows of all frames in it allow.
fn smoothed(values: &[f64], i: usize) -> f64 {
    let last = values.len() - 1;
    let reach = (1..).take_while(|&n| window(last.saturating_sub(i + n)) >= n).last().unwrap_or(0);
    let first = i.saturating_sub(reach);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (j, value) in values[first..=(i + reach).min(last)].iter().enumerate() {
        let u = i.abs_diff(first + j) as f64 / (reach + 1) as f64;
        let weight = (1.0 - u * u) * (1.0 - u * u);
        sum += weight * value;
        weights += weight;
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ride_clears_rough_ground_and_touches_down_to_its_height() {
        let mut above_m: Vec<f64> =
            (0..FRAMES).map(|i| 2.0 + (FRAMES - 1 - i) as f64 * 0.01).collect();
        above_m[ROLL_FRAME..].fill(EYE_M);
        let ground_m: Vec<f64> = (0..FRAMES).map(|i| (i * 7919 % 101) as f64 * 0.01).collect();
        let heights_m = ride(&above_m, &ground_m);
        let clear_m = |i: usize| heights_m[i] - ground_m[i];
        let lowest_m = (0..FRAMES).map(clear_m).fold(f64::INFINITY, f64::min);
        assert!((lowest_m - EYE_M).abs() < 1e-9, "{lowest_m} m");
        let slope_m: Vec<f64> = (0..FRAMES).map(|i| i as f64 * 0.05).collect();
        let end_m = ride(&above_m, &slope_m)[FRAMES - 1] - slope_m[FRAMES - 1];
        assert!((end_m - EYE_M).abs() < 0.05, "{end_m} m");
    }

    #[test]
    fn the_ride_is_smooth_over_a_step_of_the_ground() {
        let above_m = vec![EYE_M; FRAMES];
        let ground_m: Vec<f64> = (0..FRAMES).map(|i| if i < 10_000 { 0.0 } else { 1.0 }).collect();
        let heights_m = ride(&above_m, &ground_m);
        for three in heights_m.windows(3) {
            // A metre up within half a second at an even rate would take 16 m/s².
            assert!((three[2] - 2.0 * three[1] + three[0]).abs() * 3600.0 < 25.0);
        }
        assert_eq!((heights_m[9_000], heights_m[10_000]), (2.0, 3.0));
    }
}

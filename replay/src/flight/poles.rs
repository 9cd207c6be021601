//! A fast flight over both poles and along the antimeridian.
//!
//! In:    the body and its ground.
//! Out:   three minutes at 60 Hz.
//! Keeps: nothing.
//! Not here: the descent.

use super::Flight;
use super::track::{Ramp, geodetic, heading};
use crate::pose::Pose;
use core::f64::consts::PI;
use glam::DVec3;
use overfly_core::geodesy::trig::{cos, sin};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::units::Radians;

const RATE_HZ: f64 = 60.0;
const FRAMES: u32 = 10_801;
/// Degrees of the great circle a second: pole to pole, 20 000 km on the Earth, in 150 s.
const SPEED_DEG: f64 = 1.2;
/// The track swings this far to either side of the antimeridian.
const SWING_DEG: f64 = 3.0;
/// The track misses the poles by this part of the equatorial radius: 3 m on the Earth.
const MISS: f64 = 3.0 / 6_378_137.0;
const RAMP: Ramp = Ramp { up_s: 10.0, down_s: 10.0, end_s: 180.0 };

/// Three minutes at 60 Hz over the north pole (at 15 s), down the antimeridian, which it crosses
/// three times, and over the south pole (at 165 s), 1.2° of arc a second.
///
/// Heights go from 30 km to 60 km and back, at most 0.0047 to 0.0094 of the equatorial radius; the
/// flight is raised until its clearance is a tenth of its greatest height, where the ground is so
/// rough. The poses next to the poles are 3 m (scaled with the radius) away from them.
pub fn poles(body: &Ellipsoid, ground_height_m: &dyn Fn(Geodetic) -> f64) -> Flight {
    let top_m = (0.0094 * body.a_m).min(60_000.0);
    let pose = |i: u32| {
        let time_s = f64::from(i) / RATE_HZ;
        let arc_rad =
            Radians::from_degrees(SPEED_DEG * (RAMP.total_s() / 2.0 - RAMP.way_s(time_s)));
        pose_at(time_s, arc_rad.0, top_m)
    };
    let poses = (0..FRAMES).map(pose).collect();
    let flight = Flight { name: "poles".into(), rate_hz: RATE_HZ, poses, raised_m: 0.0 };
    flight.kept_above(top_m / 10.0, 6, ground_height_m)
}

/// The pose at an arc from where the track crosses the equator, north positive.
fn pose_at(time_s: f64, arc_rad: f64, top_m: f64) -> Pose {
    let height_m = top_m * (0.75 - 0.25 * cos(2.0 * PI * time_s / 90.0));
    let at = geodetic(normal_at(arc_rad), height_m);
    // By arc and not by time, so that it is as exact at rest; southward is falling arc.
    let step_rad = 1e-5;
    let direction = normal_at(arc_rad - step_rad) - normal_at(arc_rad + step_rad);
    let swing = sin(4.0 * arc_rad);
    Pose {
        time_s,
        at,
        heading: Radians(heading(at, direction)),
        pitch: Radians::from_degrees(-12.0 - 4.0 * cos(arc_rad)),
        roll: Radians::from_degrees(10.0 * swing * RAMP.speed(time_s)),
    }
}

/// The track: along the meridian of 180°, with a swing that is zero at the poles.
fn normal_at(arc_rad: f64) -> DVec3 {
    let aside = Radians::from_degrees(SWING_DEG).0 * sin(4.0 * arc_rad) + MISS;
    let along = DVec3::new(-cos(arc_rad), 0.0, sin(arc_rad));
    along * cos(aside) - DVec3::Y * sin(aside)
}

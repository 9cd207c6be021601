//! Attitudes over time: from the file, or as a coordinated turn would have them.
//!
//! In:    headings, pitches and rolls with their places; or a path.
//! Out:   orientations at times, to be made a curve of; angles of an orientation.
//! Keeps: nothing.
//! Not here: the path (`curve`).
//!
//! A coordinated turn has no side slip and no load across the wings: the nose points where the
//! aircraft goes over the ground, up by the angle at which it climbs, and the wings stand square to
//! gravity and the curve together. Wind and angle of attack are unknown, so they are left out.

use glam::{DQuat, DVec3};
use overfly_core::camera::orientation_from_attitude;
use overfly_core::geodesy::trig::{atan2, hypot};
use overfly_core::geodesy::{Geodetic, frames::Ecef};
use overfly_core::units::Radians;

const GRAVITY_MPS2: f64 = 9.806_65;
/// Below this speed a direction is noise: the last one is kept.
const MOVING_MPS: f64 = 2.5;
/// Time over which direction, climb and roll are smoothed, in seconds; each way.
const SMOOTHED_S: f64 = 0.6;
/// Steepest climb and bank that are believed without the file saying so, in radians.
const PITCH_MAX: f64 = 1.0;
const ROLL_MAX: f64 = 1.2;

/// Orientation as four numbers, on the same side as `before`: q and −q are the same turn.
pub(crate) fn quaternion(
    at: Geodetic,
    [heading, pitch, roll]: [f64; 3],
    before: Option<[f64; 4]>,
) -> [f64; 4] {
    let orientation =
        orientation_from_attitude(at, Radians(heading), Radians(pitch), Radians(roll));
    let now = orientation.to_array();
    let along: f64 = before.map_or(1.0, |before| (0..4).map(|i| before[i] * now[i]).sum());
    if along < 0.0 { now.map(|part| -part) } else { now }
}

/// Heading, pitch and roll of an orientation at a place, as numbers of any length.
pub(crate) fn angles(at: Geodetic, orientation: [f64; 4]) -> [f64; 3] {
    let turn = DQuat::from_array(orientation);
    let length = turn.length();
    let turn = if length > 1e-9 { turn / length } else { DQuat::IDENTITY };
    let axes = at.enu_axes();
    let local = |direction: DVec3| axes.transpose() * (turn * direction);
    let (nose, right, up) = (local(DVec3::NEG_Z), local(DVec3::X), local(DVec3::Y));
    let pitch = atan2(nose.z, hypot(nose.x, nose.y));
    [atan2(nose.x, nose.y), pitch, atan2(-right.z, up.z)]
}

/// Attitudes of coordinated turns along a path, given three points a little apart at each time.
pub(crate) struct Turns {
    directions: Vec<DVec3>,
    climbs: Vec<f64>,
    rolls: Vec<f64>,
}

/// The path near a time: a little before, at it, a little after; `half_s` apart.
pub(crate) struct Near {
    pub at: Geodetic,
    pub points: [Ecef; 3],
    pub half_s: f64,
}

impl Turns {
    /// Attitudes at `times_s`; `near` gives the path around the i-th.
    pub fn along(times_s: &[f64], near: &dyn Fn(usize) -> Near) -> Self {
        let count = times_s.len();
        let mut turns = Self {
            directions: vec![DVec3::ZERO; count],
            climbs: vec![0.0; count],
            rolls: vec![0.0; count],
        };
        for i in 0..count {
            turns.one(i, &near(i));
        }
        turns.keep_directions();
        both_ways(times_s, &mut turns.climbs);
        both_ways(times_s, &mut turns.rolls);
        for axis in 0..3 {
            let mut column: Vec<f64> = turns.directions.iter().map(|d| d[axis]).collect();
            both_ways(times_s, &mut column);
            for (direction, value) in turns.directions.iter_mut().zip(column) {
                direction[axis] = value;
            }
        }
        turns
    }

    fn one(&mut self, i: usize, near: &Near) {
        let [before, at, after] = near.points.map(|point| point.0);
        let axes = near.at.enu_axes();
        let velocity = axes.transpose() * ((after - before) / (2.0 * near.half_s));
        let bend = (after - at) - (at - before);
        let acceleration = axes.transpose() * (bend / (near.half_s * near.half_s));
        let speed = hypot(velocity.x, velocity.y);
        self.climbs[i] =
            atan2(velocity.z, speed.max(2.0 * MOVING_MPS)).clamp(-PITCH_MAX, PITCH_MAX);
        if speed < MOVING_MPS {
            return;
        }
        let forward = DVec3::new(velocity.x, velocity.y, 0.0) / speed;
        self.directions[i] = axes * forward;
        let across = acceleration.x * forward.y - acceleration.y * forward.x;
        let down = (GRAVITY_MPS2 + acceleration.z).max(0.3 * GRAVITY_MPS2);
        self.rolls[i] = atan2(across, down).clamp(-ROLL_MAX, ROLL_MAX);
    }

    /// Where nothing moves the nose stays as it was; before anything moves, as it will be.
    fn keep_directions(&mut self) {
        let first = self.directions.iter().copied().find(|direction| *direction != DVec3::ZERO);
        let mut last = first.unwrap_or(DVec3::ZERO);
        for direction in &mut self.directions {
            if *direction == DVec3::ZERO {
                *direction = last;
            }
            last = *direction;
        }
    }

    /// Heading, pitch and roll at the i-th time, which is spent at `at`.
    pub fn angles(&self, i: usize, at: Geodetic) -> [f64; 3] {
        let local = at.enu_axes().transpose() * self.directions[i];
        // A direction straight up is that of nothing that ever moved: north will do.
        let heading = if hypot(local.x, local.y) > 1e-9 { atan2(local.x, local.y) } else { 0.0 };
        [heading, self.climbs[i], self.rolls[i]]
    }
}

/// Smooths a column without shifting it: once forwards, once backwards.
fn both_ways(times_s: &[f64], column: &mut [f64]) {
    let mut state = column.first().copied().unwrap_or(0.0);
    for i in 1..column.len() {
        let step_s = times_s[i] - times_s[i - 1];
        state += (column[i] - state) * (step_s / (step_s + SMOOTHED_S));
        column[i] = state;
    }
    for i in (0..column.len().saturating_sub(1)).rev() {
        let step_s = times_s[i + 1] - times_s[i];
        state += (column[i] - state) * (step_s / (step_s + SMOOTHED_S));
        column[i] = state;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_come_back_from_an_orientation_at_any_place() {
        for (lat, lon) in [(46.0, -121.0), (-33.0, 179.999), (89.99, 12.0), (0.0, 0.0)] {
            let at = Geodetic::from_degrees(lat, lon, 100.0);
            for wanted in [[0.3, 0.2, -0.5], [-2.9, -1.2, 2.0], [1.5, 0.0, 0.0]] {
                let found = angles(at, quaternion(at, wanted, None));
                let off = (0..3).map(|i| (found[i] - wanted[i]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-9, "{found:?} for {wanted:?}");
            }
        }
    }

    #[test]
    fn orientations_that_follow_each_other_are_on_one_side() {
        let at = Geodetic::from_degrees(10.0, 10.0, 0.0);
        let mut before = quaternion(at, [0.0; 3], None);
        for k in 1..100 {
            let now = quaternion(at, [0.1 * f64::from(k), 0.0, 0.0], Some(before));
            let along: f64 = (0..4).map(|i| now[i] * before[i]).sum();
            assert!(along > 0.99);
            before = now;
        }
    }
}

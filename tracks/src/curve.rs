//! One recorded flight as a curve: a pose at any time.
//!
//! In:    rows of fixes that can be flown without a break, their heights.
//! Out:   [`Curve`]: position twice continuously differentiable, attitude too; poses at a rate.
//! Keeps: splines.
//! Not here: choosing rows (`clean`), heights (`datum`), the mathematics (`spline`, `envelope`).
//!
//! Directions from the Earth's centre line are smoothed as vectors and heights apart: so there is
//! no antimeridian and no pole, and a step of 25 ft does not touch a position that is known to a
//! metre. Heights do not swing below the fixes around them (`envelope`).

use crate::attitude::{Near, Turns, angles, quaternion};
use crate::envelope::{Envelope, held_above};
use crate::fixes::Fixes;
use crate::spline::{Spline, interval};
use core::f64::consts::{PI, TAU};
use glam::{DMat3, DVec3};
use overfly_core::geodesy::trig::{atan2, cos, hypot};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::units::Radians;
use overfly_replay::Pose;
use overfly_replay::resample::{GRID_ATTITUDE_RAD, GRID_M, GRID_RAD};

/// How far heights may swing below the fixes around, at least: 5 cm.
const SWING_M: f64 = 0.05;
/// Attitudes are estimated so often, in seconds, but for long intervals.
const ESTIMATED_S: f64 = 0.5;
const ESTIMATES_MAX: u32 = 64;
/// Half the time over which speeds and accelerations are differences.
const NEAR_S: f64 = 0.25;
/// An attitude of the file counts where at least so many fixes have one.
const ATTITUDES_LEAST: f64 = 0.5;

/// So many attitudes that all have one pitch and one roll, over such a climb, are none.
const FROZEN_FIXES: usize = 30;
const FROZEN_M: f64 = 50.0;

/// A flight between its first and last fix.
#[derive(Clone, PartialEq, Debug)]
pub struct Curve {
    /// What the file calls it; may be empty.
    pub name: String,
    /// Whether the file says that this is no aircraft, but a ship, a vehicle, a weapon.
    pub is_aside: bool,
    /// UTC of the first fix, since 1970, in nanoseconds.
    pub start_ns: i64,
    /// Fixes that it goes through.
    pub fixes: usize,
    /// Lines of the first and last fix.
    pub lines: [u32; 2],
    /// Whether attitudes are estimated, since the file has none.
    pub estimated: bool,
    /// Heights that the file lacks, and that are on a line between those around.
    pub heights_missing: usize,
    times_s: Vec<f64>,
    normals: Spline<3>,
    heights: Spline<1>,
    floor: Envelope,
    swing_m: f64,
    attitude_times_s: Vec<f64>,
    attitudes: Spline<4>,
    /// Added to heights: see [`Curve::lift_over`].
    lift: Option<(Vec<f64>, Envelope)>,
}

/// Heights of a curve's rows above the ellipsoid, all there; and their step.
pub(crate) struct RowHeights {
    pub height_m: Vec<f64>,
    pub step_m: f64,
    pub missing: usize,
}

impl Curve {
    /// The curve through rows; at least two, their times rising.
    pub(crate) fn through(fixes: &Fixes, rows: &[usize], heights: RowHeights) -> Self {
        let start_ns = fixes.time_ns[rows[0]];
        let seconds = |&row: &usize| (fixes.time_ns[row] - start_ns) as f64 / 1e9;
        let times_s: Vec<f64> = rows.iter().map(seconds).collect();
        let normals = normals(fixes, rows, &times_s);
        let half_m = heights.step_m / 2.0;
        let read: Vec<[f64; 1]> = heights.height_m.iter().map(|&h| [h]).collect();
        let boxed = |i: usize, [h]: [f64; 1]| [h.clamp(read[i][0] - half_m, read[i][0] + half_m)];
        let heights_spline = if half_m > 0.0 {
            Spline::within(&times_s, read.clone(), &boxed)
        } else {
            Spline::through(&times_s, read.clone())
        };
        let swing_m = half_m.max(SWING_M);
        let lowest: Vec<f64> = heights_spline.values().iter().map(|[h]| h - swing_m).collect();
        let track = fixes.track[rows[0]];
        let names = usize::try_from(track).unwrap_or(0);
        let mut curve = Self {
            name: fixes.names.get(names).cloned().unwrap_or_default(),
            is_aside: fixes.asides.contains(&track),
            start_ns,
            fixes: rows.len(),
            lines: [fixes.line[rows[0]], fixes.line[rows[rows.len() - 1]]],
            estimated: false,
            heights_missing: heights.missing,
            normals,
            floor: Envelope::below(&lowest, 2),
            heights: heights_spline,
            swing_m,
            attitude_times_s: Vec::new(),
            attitudes: Spline::through(&[0.0], vec![[0.0, 0.0, 0.0, 1.0]]),
            lift: None,
            times_s,
        };
        let known: Vec<usize> =
            (0..rows.len()).filter(|&i| fixes.attitude_rad[rows[i]][0].is_finite()).collect();
        let zero = |&i: &usize| fixes.attitude_rad[rows[i]] == [0.0; 3];
        let tilt = |&i: &usize| [fixes.attitude_rad[rows[i]][1], fixes.attitude_rad[rows[i]][2]];
        let climb_m = {
            let heights = || heights.height_m.iter().copied();
            heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min)
        };
        let is_frozen = known.len() >= FROZEN_FIXES
            && climb_m > FROZEN_M
            && known.windows(2).all(|pair| tilt(&pair[0]) == tilt(&pair[1]));
        let is_known = known.len() as f64 >= ATTITUDES_LEAST * rows.len() as f64;
        // Writers that know no attitude fill in zeros, or one pitch and roll throughout.
        if known.len() > 1 && is_known && !is_frozen && !known.iter().all(zero) {
            curve.take_attitudes(fixes, rows, &known);
        } else {
            curve.estimate_attitudes();
        }
        curve
    }

    fn take_attitudes(&mut self, fixes: &Fixes, rows: &[usize], known: &[usize]) {
        self.attitude_times_s = known.iter().map(|&i| self.times_s[i]).collect();
        let mut before = None;
        let mut read: Vec<[f64; 4]> = Vec::with_capacity(known.len());
        for &i in known {
            let row = rows[i];
            let (lat_rad, lon_rad) = (fixes.lat_rad[row], fixes.lon_rad[row]);
            let at = Geodetic { lat_rad, lon_rad, height_m: 0.0 };
            let now = quaternion(at, fixes.attitude_rad[row], before);
            before = Some(now);
            read.push(now);
        }
        // A turn by an angle changes the four numbers by at most half of it.
        let half = fixes.steps.attitude_rad / 4.0;
        let boxed = |i: usize, value: [f64; 4]| {
            core::array::from_fn(|c| value[c].clamp(read[i][c] - half, read[i][c] + half))
        };
        self.attitudes = if half > 0.0 {
            Spline::within(&self.attitude_times_s, read.clone(), &boxed)
        } else {
            Spline::through(&self.attitude_times_s, read.clone())
        };
    }

    fn estimate_attitudes(&mut self) {
        self.estimated = true;
        let mut times_s = vec![0.0];
        for pair in self.times_s.windows(2) {
            let step_s = pair[1] - pair[0];
            let parts = (1..ESTIMATES_MAX).find(|&n| f64::from(n) * ESTIMATED_S >= step_s);
            let parts = parts.unwrap_or(ESTIMATES_MAX);
            let part = |k: u32| pair[0] + step_s * f64::from(k) / f64::from(parts);
            times_s.extend((1..parts).map(part));
            times_s.push(pair[1]);
        }
        let half_s = NEAR_S.min(self.duration_s() / 2.0);
        let near = |i: usize| {
            let middle = times_s[i].clamp(half_s, self.duration_s() - half_s);
            let points = [middle - half_s, middle, middle + half_s]
                .map(|t| Ellipsoid::WGS84.ecef_from_geodetic(self.place(t)));
            Near { at: self.place(times_s[i]), points, half_s }
        };
        let turns = Turns::along(&times_s, &near);
        let mut before = None;
        let mut read = Vec::with_capacity(times_s.len());
        for (i, &time_s) in times_s.iter().enumerate() {
            let at = self.place(time_s);
            let now = quaternion(at, turns.angles(i, at), before);
            before = Some(now);
            read.push(now);
        }
        self.attitudes = Spline::through(&times_s, read);
        self.attitude_times_s = times_s;
    }

    /// From the first fix to the last, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Times of the fixes since the first, in seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Where the aircraft is; height above the ellipsoid of WGS 84.
    pub fn place(&self, time_s: f64) -> Geodetic {
        let time_s = time_s.clamp(0.0, self.duration_s());
        let i = interval(&self.times_s, time_s);
        let [x, y, z] = self.normals.at(&self.times_s, i, time_s);
        let [height_m] = self.heights.at(&self.times_s, i, time_s);
        let floor_m = self.floor.at(&self.times_s, i, time_s);
        let lift_m = self
            .lift
            .as_ref()
            .map_or(0.0, |(times_s, lift)| lift.at(times_s, interval(times_s, time_s), time_s));
        Geodetic {
            lat_rad: atan2(z, hypot(x, y)),
            lon_rad: atan2(y, x),
            height_m: held_above(height_m, floor_m, self.swing_m) + lift_m,
        }
    }

    /// The pose at a time: between the first fix and the last, held outside.
    pub fn pose(&self, time_s: f64) -> Pose {
        let at = self.place(time_s);
        let times_s = &self.attitude_times_s;
        let held_s = time_s.clamp(times_s[0], times_s[times_s.len() - 1]);
        let orientation = self.attitudes.at(times_s, interval(times_s, held_s), held_s);
        let [heading, pitch, roll] = angles(at, orientation);
        let heading = if heading < 0.0 { heading + TAU } else { heading };
        Pose { time_s, at, heading: Radians(heading), pitch: Radians(pitch), roll: Radians(roll) }
    }

    /// Poses there are at a rate.
    pub fn count(&self, rate_hz: f64) -> u64 {
        let last = (self.duration_s() * rate_hz + 1e-6).floor();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "casts saturate"
        )]
        let count = last as u64;
        count.saturating_add(1)
    }

    /// The poses at a rate, from the first fix on.
    pub fn poses(&self, rate_hz: f64) -> impl Iterator<Item = Pose> + '_ {
        (0..self.count(rate_hz)).map(move |index| self.frame(index, rate_hz))
    }

    /// One of the poses at a rate, rounded to the grids of overfly's own flights: 0.1 mm, a quarter
    /// of a millimetre, a tenth of an arc second.
    pub fn frame(&self, index: u64, rate_hz: f64) -> Pose {
        let pose = self.pose(index as f64 / rate_hz);
        let round = |value: f64, grid: f64| (value / grid).round() * grid;
        let angle = |angle: Radians| Radians(round(angle.0, GRID_ATTITUDE_RAD));
        let lon_rad = round(pose.at.lon_rad, GRID_RAD[1]);
        Pose {
            at: Geodetic {
                lat_rad: round(pose.at.lat_rad, GRID_RAD[0]).clamp(-PI / 2.0, PI / 2.0),
                lon_rad: if lon_rad.abs() > PI {
                    lon_rad - TAU * lon_rad.signum()
                } else {
                    lon_rad
                },
                height_m: round(pose.at.height_m, GRID_M),
            },
            heading: angle(pose.heading),
            pitch: angle(pose.pitch),
            roll: angle(pose.roll),
            ..pose
        }
    }

    /// Raises the curve where `ground_m` at its place, looked at every `step_s`, leaves less than
    /// `clearance_m` below it: smoothly, and as little as `reach_s` around allows. Returns the most
    /// that it was raised by, in metres. Where `ground_m` is not finite nothing is known to be in
    /// the way.
    pub fn lift_over(
        &mut self,
        clearance_m: f64,
        [step_s, reach_s]: [f64; 2],
        ground_m: &mut dyn FnMut(Geodetic) -> f64,
    ) -> f64 {
        self.lift = None;
        let count = self.count(1.0 / step_s);
        let mut times_s: Vec<f64> = (0..count).map(|i| i as f64 * step_s).collect();
        if self.duration_s() > times_s[times_s.len() - 1] {
            times_s.push(self.duration_s());
        }
        let mut lack = |&time_s: &f64| {
            let at = self.place(time_s);
            let lack_m = ground_m(at) + clearance_m - at.height_m;
            if lack_m > 0.0 { lack_m } else { 0.0 }
        };
        let lacks_m: Vec<f64> = times_s.iter().map(&mut lack).collect();
        let most_m = lacks_m.iter().fold(0.0, |most: f64, &lack| most.max(lack));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "casts saturate"
        )]
        let reach = (reach_s / step_s).ceil() as usize;
        if most_m > 0.0 {
            self.lift = Some((times_s, Envelope::above(&lacks_m, reach)));
        }
        most_m
    }
}

/// Unit normals of the ellipsoid at the rows, as a curve within half a step of the file's numbers.
fn normals(fixes: &Fixes, rows: &[usize], times_s: &[f64]) -> Spline<3> {
    let at = |row: usize| Geodetic {
        lat_rad: fixes.lat_rad[row],
        lon_rad: fixes.lon_rad[row],
        height_m: 0.0,
    };
    let read: Vec<[f64; 3]> = rows.iter().map(|&row| at(row).normal().to_array()).collect();
    let (north, east) = (fixes.steps.lat_rad / 2.0, fixes.steps.lon_rad / 2.0);
    if north <= 0.0 || east <= 0.0 {
        return Spline::through(times_s, read);
    }
    let axes_and_most = |&row: &usize| {
        let place = at(row);
        let east = east * cos(place.lat_rad).abs();
        (place.enu_axes(), DVec3::new(east, north, east.min(north)))
    };
    let boxes: Vec<(DMat3, DVec3)> = rows.iter().map(axes_and_most).collect();
    let boxed = |i: usize, value: [f64; 3]| {
        let (axes, most) = boxes[i];
        let centre = DVec3::from_array(read[i]);
        let off = axes.transpose() * (DVec3::from_array(value) - centre);
        (centre + axes * off.clamp(-most, most)).to_array()
    };
    Spline::within(times_s, read.clone(), &boxed)
}

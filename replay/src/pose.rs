//! Where the aircraft is at one time, and what a lens on it sees.
//!
//! In:    a pose of a flight, a lens of the scene, the size of the picture.
//! Out:   the view that core takes.
//! Keeps: nothing.
//! Not here: how poses come about (`flight`, `resample`).

use overfly_core::camera::{View, orientation_from_attitude};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::LensSettings;
use overfly_core::units::Radians;

/// Position and attitude at one time of a flight.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// Time since the start of the flight in seconds.
    pub time_s: f64,
    /// Where the eye is; the height is above the ellipsoid.
    pub at: Geodetic,
    /// Of the nose, clockwise from north.
    pub heading: Radians,
    /// Nose up.
    pub pitch: Radians,
    /// Right wing down.
    pub roll: Radians,
}

/// What `lens` sees from `pose`.
///
/// The lens's yaw is added to the heading and its pitch to the pitch: exact in level flight; in a
/// bank the lens stays on the horizon instead of turning with the wings.
pub fn view_of(pose: &Pose, lens: &LensSettings, size_px: [u32; 2], body: &Ellipsoid) -> View {
    let heading = Radians(pose.heading.0 + lens.yaw.0);
    let pitch = Radians(pose.pitch.0 + lens.pitch.0);
    View {
        eye: body.ecef_from_geodetic(pose.at),
        orientation: orientation_from_attitude(pose.at, heading, pitch, pose.roll),
        field_of_view: lens.field_of_view,
        size_px,
        near_m: lens.near_m,
    }
}

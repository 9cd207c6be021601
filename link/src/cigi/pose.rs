//! Poses: reference points and axes of entities and views on the body.
//!
//! In:    places, attitudes, offsets.
//! Out:   [`Pose`]s in body-fixed axes, camera orientations.
//! Keeps: nothing.
//! Not here: which entity hangs on which (`entities`).
//! Source: CIGI ICD 3.3, 3.1 and 3.2 (see [`crate::cigi`]): x forward, y right, z down; turns
//! about z, then y, then x.

use super::packet::Attitude;
use glam::{DMat3, DQuat, DVec3};
use overfly_core::geodesy::trig::{atan2, cos, hypot, sin};
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};

/// A reference point and the axes there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// The point, body-fixed.
    pub at: Ecef,
    /// Forward, right and down as columns, body-fixed.
    pub axes: DMat3,
    /// False where it hangs on ground that nobody knows yet: it is near sea level then.
    pub certain: bool,
}

/// North, east and down of a place as columns.
pub fn ned(at: Geodetic) -> DMat3 {
    let enu = at.enu_axes();
    DMat3::from_cols(enu.y_axis, enu.x_axis, -enu.z_axis)
}

fn about_z(angle_rad: f64) -> DMat3 {
    let (s, c) = (sin(angle_rad), cos(angle_rad));
    DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z)
}

fn about_y(angle_rad: f64) -> DMat3 {
    let (s, c) = (sin(angle_rad), cos(angle_rad));
    DMat3::from_cols(DVec3::new(c, 0.0, -s), DVec3::Y, DVec3::new(s, 0.0, c))
}

fn about_x(angle_rad: f64) -> DMat3 {
    let (s, c) = (sin(angle_rad), cos(angle_rad));
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c))
}

/// The turned axes in the axes that were turned.
pub fn turned(attitude: Attitude) -> DMat3 {
    about_z(attitude.yaw_rad) * about_y(attitude.pitch_rad) * about_x(attitude.roll_rad)
}

/// The axes of something that lies on a slope, nose along its heading.
pub fn on_slope(at: Geodetic, normal: DVec3, attitude: Attitude) -> DMat3 {
    let heading = ned(at) * DVec3::new(cos(attitude.yaw_rad), sin(attitude.yaw_rad), 0.0);
    let down = -normal;
    let right = down.cross(heading);
    if right.length_squared() < 1e-12 {
        // The nose points straight into the slope: there is no way to lie on it.
        return ned(at) * turned(attitude);
    }
    let right = right.normalize();
    let slope = DMat3::from_cols(right.cross(down), right, down);
    slope * about_y(attitude.pitch_rad) * about_x(attitude.roll_rad)
}

impl Pose {
    /// On the body.
    pub fn on(body: &Ellipsoid, at: Geodetic, attitude: Attitude) -> Self {
        let axes = ned(at) * turned(attitude);
        Self { at: body.ecef_from_geodetic(at), axes, certain: true }
    }

    /// A point in these axes.
    pub fn point(&self, offset_m: DVec3) -> Ecef {
        Ecef(self.at.0 + self.axes * offset_m)
    }

    /// What is moved and turned in these axes.
    pub fn then(&self, offset_m: DVec3, attitude: Attitude) -> Self {
        let axes = self.axes * turned(attitude);
        Self { at: self.point(offset_m), axes, certain: self.certain }
    }

    /// Camera axes (x right, y up, z backward) to body-fixed axes.
    pub fn camera(&self) -> DQuat {
        let DMat3 { x_axis: forward, y_axis: right, z_axis: down } = self.axes;
        DQuat::from_mat3(&DMat3::from_cols(right, -down, -forward))
    }
}

/// Azimuth clockwise from north and elevation above the horizontal of a direction, in degrees.
pub fn azimuth_elevation_deg(at: Geodetic, direction: DVec3) -> [f64; 2] {
    let enu = at.enu_axes().transpose() * direction;
    let degree = 180.0 / core::f64::consts::PI;
    [atan2(enu.x, enu.y) * degree, atan2(enu.z, hypot(enu.x, enu.y)) * degree]
}

/// The unit vector of an azimuth and an elevation in north, east, down or forward, right, down.
pub fn direction(azimuth_rad: f64, elevation_rad: f64) -> DVec3 {
    let level = cos(elevation_rad);
    DVec3::new(level * cos(azimuth_rad), level * sin(azimuth_rad), -sin(elevation_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::orientation_from_attitude;
    use overfly_core::units::Radians;

    #[test]
    fn a_camera_on_the_nose_looks_as_the_aircraft_does() {
        let at = Geodetic::from_degrees(46.8, -121.7, 2500.0);
        let attitude = Attitude { yaw_rad: 1.1, pitch_rad: -0.3, roll_rad: 0.7 };
        let pose = Pose::on(&Ellipsoid::WGS84, at, attitude);
        let wanted = orientation_from_attitude(at, Radians(1.1), Radians(-0.3), Radians(0.7));
        assert!(pose.camera().dot(wanted).abs() > 1.0 - 1e-12);
    }

    #[test]
    fn on_level_ground_a_slope_changes_nothing_and_on_a_slope_feet_are_on_it() {
        let at = Geodetic::from_degrees(-20.0, 30.0, 0.0);
        let attitude = Attitude { yaw_rad: 2.0, pitch_rad: 0.1, roll_rad: -0.2 };
        let level = on_slope(at, at.normal(), attitude);
        let flat = ned(at) * turned(attitude);
        assert!((level - flat).to_cols_array().iter().all(|part| part.abs() < 1e-12));
        let normal = (at.normal() + 0.3 * at.enu_axes().x_axis).normalize();
        let lying = on_slope(at, normal, Attitude { yaw_rad: 2.0, ..Attitude::default() });
        assert!((lying.z_axis + normal).length() < 1e-12);
        assert!((lying.x_axis.cross(lying.y_axis) - lying.z_axis).length() < 1e-12);
    }

    #[test]
    fn azimuth_and_elevation_go_there_and_back() {
        let at = Geodetic::from_degrees(12.0, -70.0, 0.0);
        let away = ned(at) * direction(2.5, -0.4);
        let [azimuth_deg, elevation_deg] = azimuth_elevation_deg(at, away);
        assert!((azimuth_deg.to_radians() - 2.5).abs() < 1e-12);
        assert!((elevation_deg.to_radians() + 0.4).abs() < 1e-12);
    }
}

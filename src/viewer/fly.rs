//! The free eye: where it is, where it looks, and how it flies over a body.
//!
//! In:    directions, angles, a speed, a time step; the ground beneath.
//! Out:   [`Eye`], and the view that it sees.
//! Keeps: nothing; a step that asks for nothing changes no bit.
//! Not here: keys (`keys`), what the ground's height is (`session`).
//!
//! An eye is a normal of the ellipsoid, a tangent and two numbers: nothing in it is singular at a
//! pole, and heading, latitude and longitude are only worked out for people.

use glam::{DMat3, DQuat, DVec3};
use overfly::core::camera::View;
use overfly::core::geodesy::trig::{atan2, cos, hypot, sin};
use overfly::core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly::core::settings::LensSettings;
use overfly::core::units::Radians;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// The eye is never nearer to the ground than this.
pub const ABOVE_GROUND_M: f64 = 1.0;
/// It is never higher than this.
pub const HEIGHT_MAX_M: f64 = 1e8;
/// Nor deeper than this part of the body's radius, where nobody knows the ground.
const DEPTH_MAX: f64 = 0.01;
/// Heights above the ground that it covers in a second, flown at factor 1.
const HEIGHTS_PER_S: f64 = 0.5;
/// Slowest speed at factor 1.
const SPEED_MIN_M_S: f64 = 1.0;

/// Where somebody looks from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Eye {
    /// Outward normal of the ellipsoid, of unit length.
    up: DVec3,
    /// Where it looks on the map: of unit length, at right angles to `up`.
    ahead: DVec3,
    height_m: f64,
    /// Above the horizontal, within ±π/2.
    pitch_rad: f64,
}

/// Where to fly: each from −1 to 1.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Motion {
    /// Where the eye looks.
    pub ahead: f64,
    /// To its right.
    pub right: f64,
    /// Away from the ground.
    pub up: f64,
}

/// Metres a second, `agl_m` above the ground: the same part of the picture a second at any height.
pub fn speed_m_s(agl_m: f64, factor: f64) -> f64 {
    (agl_m.min(HEIGHT_MAX_M) * HEIGHTS_PER_S).max(SPEED_MIN_M_S) * factor
}

impl Eye {
    /// At a place, looking along a heading (clockwise from north) and a pitch (upwards).
    pub fn new(at: Geodetic, heading: Radians, pitch: Radians) -> Self {
        let enu = at.enu_axes();
        let ahead = enu.y_axis * cos(heading.0) + enu.x_axis * sin(heading.0);
        Self { up: at.normal(), ahead, height_m: at.height_m, pitch_rad: pitch.0 }.tidied()
    }

    /// Where a view is seen from, without its roll.
    pub fn of_view(view: &View, body: &Ellipsoid) -> Self {
        let at = body.geodetic_from_ecef(view.eye);
        let up = at.normal();
        let axes = DMat3::from_quat(view.orientation.normalize());
        let forward = -axes.z_axis;
        let rise = forward.dot(up);
        let level = forward - up * rise;
        // Straight up or down the picture's upper edge says where ahead is.
        let ahead = if level.length() > 1e-9 { level } else { axes.y_axis * -rise };
        let pitch_rad = atan2(rise, level.length());
        Self { up, ahead, height_m: at.height_m, pitch_rad }.tidied()
    }

    /// Back to unit lengths, right angles and ranges.
    fn tidied(mut self) -> Self {
        self.up = self.up.normalize();
        self.ahead = (self.ahead - self.up * self.ahead.dot(self.up)).normalize();
        self.pitch_rad = self.pitch_rad.clamp(-FRAC_PI_2, FRAC_PI_2);
        self
    }

    /// The place, for people: at a pole the longitude is as good as any.
    pub fn place(&self) -> Geodetic {
        let up = self.up;
        let lat_rad = atan2(up.z, hypot(up.x, up.y));
        Geodetic { lat_rad, lon_rad: atan2(up.y, up.x), height_m: self.height_m }
    }

    /// Clockwise from north, from 0 to 2π.
    pub fn heading(&self) -> Radians {
        let enu = self.place().enu_axes();
        let heading_rad = atan2(self.ahead.dot(enu.x_axis), self.ahead.dot(enu.y_axis));
        Radians(if heading_rad < 0.0 { heading_rad + TAU } else { heading_rad })
    }

    /// Upwards.
    pub fn pitch(&self) -> Radians {
        Radians(self.pitch_rad)
    }

    /// Where it is, body-fixed.
    pub fn point(&self, body: &Ellipsoid) -> Ecef {
        Ecef(body.surface_from_normal(self.up) + self.up * self.height_m)
    }

    /// What it sees through a lens.
    pub fn view(&self, lens: &LensSettings, size_px: [u32; 2], body: &Ellipsoid) -> View {
        let (rise, level) = (sin(self.pitch_rad), cos(self.pitch_rad));
        let forward = self.ahead * level + self.up * rise;
        let top = self.up * level - self.ahead * rise;
        let axes = DMat3::from_cols(self.right(), top, -forward);
        View {
            eye: self.point(body),
            orientation: DQuat::from_mat3(&axes),
            field_of_view: lens.field_of_view,
            size_px,
            near_m: lens.near_m,
        }
    }

    fn right(&self) -> DVec3 {
        self.ahead.cross(self.up)
    }

    /// Looks further to the right and further up.
    pub fn turn(&mut self, right_rad: f64, up_rad: f64) {
        if right_rad == 0.0 && up_rad == 0.0 {
            return;
        }
        self.ahead = self.ahead * cos(right_rad) + self.right() * sin(right_rad);
        self.pitch_rad += up_rad;
        *self = self.tidied();
    }

    /// Flies on for a moment. What is level keeps its height: it follows the body's curve, as an
    /// aircraft does, and over a pole it goes on straight.
    pub fn fly(&mut self, motion: Motion, distance_m: f64, body: &Ellipsoid) {
        let (rise, level) = (sin(self.pitch_rad), cos(self.pitch_rad));
        let Motion { ahead, right, up } = motion;
        let longest = DVec3::new(ahead, right, up).length().max(1.0);
        let step_m = distance_m / longest;
        let climb_m = (ahead * rise + up) * step_m;
        let along_m = (self.ahead * (ahead * level) + self.right() * right) * step_m;
        if climb_m != 0.0 {
            let depth_m = DEPTH_MAX * body.b_m().min(body.a_m);
            self.height_m = (self.height_m + climb_m).clamp(-depth_m, HEIGHT_MAX_M);
        }
        let length_m = along_m.length();
        if length_m > 0.0 {
            let radius_m = (2.0 * body.a_m + body.b_m()) / 3.0 + self.height_m;
            let axis = self.up.cross(along_m / length_m);
            let angle_rad = (length_m / radius_m).min(FRAC_PI_4);
            self.up = turned(self.up, axis, angle_rad);
            self.ahead = turned(self.ahead, axis, angle_rad);
            *self = self.tidied();
        }
    }

    /// Rises where it is lower than [`ABOVE_GROUND_M`] over ground of this height.
    pub fn keep_above(&mut self, ground_m: f64) {
        self.height_m = self.height_m.max(ground_m + ABOVE_GROUND_M);
    }
}

/// Rodrigues' rotation about a unit axis.
fn turned(vector: DVec3, axis: DVec3, angle_rad: f64) -> DVec3 {
    let (s, c) = (sin(angle_rad), cos(angle_rad));
    vector * c + axis.cross(vector) * s + axis * (axis.dot(vector) * (1.0 - c))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Ellipsoid = Ellipsoid::WGS84;
    const AHEAD: Motion = Motion { ahead: 1.0, right: 0.0, up: 0.0 };

    fn eye(lat_deg: f64, lon_deg: f64, height_m: f64, look_deg: [f64; 2]) -> Eye {
        let at = Geodetic::from_degrees(lat_deg, lon_deg, height_m);
        Eye::new(at, Radians::from_degrees(look_deg[0]), Radians::from_degrees(look_deg[1]))
    }

    fn lens() -> LensSettings {
        LensSettings {
            name: "main".into(),
            field_of_view: Radians::from_degrees(60.0),
            yaw: Radians(0.0),
            pitch: Radians(0.0),
            near_m: 0.1,
        }
    }

    #[test]
    fn flying_ahead_over_a_pole_goes_on_straight() {
        for south in [1.0, -1.0] {
            let heading_deg = if south > 0.0 { 0.0 } else { 180.0 };
            let mut eye = eye(89.9 * south, 30.0, 1000.0, [heading_deg, 0.0]);
            let plane = eye.up.cross(eye.ahead);
            for _ in 0..400 {
                eye.fly(AHEAD, 100.0, &BODY);
                assert!(eye.up.dot(plane).abs() < 1e-13, "it leaves its great circle");
            }
            let (place, heading) = (eye.place(), eye.heading().to_degrees());
            assert!((place.lon_rad.to_degrees() - -150.0).abs() < 1e-6, "{place:?}");
            assert!((heading - (180.0 - heading_deg)).abs() < 1e-6, "{heading}");
            assert_eq!(place.height_m, 1000.0, "level flight keeps its height to the bit");
        }
    }

    #[test]
    fn holding_still_changes_no_bit() {
        let start = eye(46.85, -121.76, 4500.0, [233.0, -11.0]);
        let mut eye = start;
        for _ in 0..1000 {
            eye.fly(Motion::default(), 1e6, &BODY);
            eye.fly(AHEAD, 0.0, &BODY);
            eye.turn(0.0, 0.0);
            eye.keep_above(4390.0);
        }
        assert_eq!(eye, start);
    }

    #[test]
    fn it_never_comes_nearer_to_the_ground_than_a_metre() {
        let mut eye = eye(10.0, 10.0, 300.0, [0.0, -90.0]);
        for step in 0..200 {
            eye.fly(AHEAD, 10.0, &BODY);
            let ground_m = f64::from(step % 7) * 20.0;
            eye.keep_above(ground_m);
            assert!(eye.place().height_m >= ground_m + ABOVE_GROUND_M);
        }
    }

    #[test]
    fn any_height_from_a_metre_to_a_hundred_thousand_kilometres_is_flown_sanely() {
        let heights_m = [1.0, 100.0, 4e5, 1e8];
        let from = |height_m: f64| [0.0, 45.0, 90.0, -90.0].map(|lat_deg| (lat_deg, height_m));
        for (lat_deg, height_m) in heights_m.into_iter().flat_map(from) {
            let mut eye = eye(lat_deg, 179.9, height_m, [77.0, 5.0]);
            for step in 0..300_u32 {
                let motion = Motion { ahead: 1.0, right: 1.0, up: f64::from(step % 3) - 1.0 };
                let speed = speed_m_s(eye.place().height_m, 64.0);
                eye.turn(0.1, 0.01);
                eye.fly(motion, speed / 30.0, &BODY);
                eye.keep_above(0.0);
                assert_eq!(eye.view(&lens(), [640, 360], &BODY).check(), Ok(()));
            }
            assert!((eye.up.length() - 1.0).abs() < 1e-15);
            assert!(eye.up.dot(eye.ahead).abs() < 1e-15);
            assert!((ABOVE_GROUND_M..=HEIGHT_MAX_M).contains(&eye.place().height_m));
        }
    }

    #[test]
    fn speed_grows_with_the_height_and_never_stops() {
        assert_eq!(speed_m_s(-3.0, 1.0), 1.0);
        assert_eq!(speed_m_s(1000.0, 1.0), 500.0);
        assert_eq!(speed_m_s(1000.0, 0.25), 125.0);
        assert_eq!(speed_m_s(1e12, 1.0), 5e7);
    }

    #[test]
    fn a_view_gives_its_eye_back_straight_down_too() {
        for look_deg in [[0.0, 0.0], [123.0, -37.0], [300.0, 89.0], [45.0, -90.0], [45.0, 90.0]] {
            let eye = eye(-33.9, 151.2, 250.0, look_deg);
            let view = eye.view(&lens(), [640, 360], &BODY);
            let back = Eye::of_view(&view, &BODY);
            assert!((back.ahead - eye.ahead).length() < 1e-7, "{look_deg:?}");
            assert!((back.pitch_rad - eye.pitch_rad).abs() < 1e-7, "{look_deg:?}");
            assert!((back.point(&BODY).0 - view.eye.0).length() < 1e-8);
            let heading = back.heading().to_degrees();
            assert!((heading - look_deg[0]).abs() < 1e-5, "{heading}");
        }
    }

    #[test]
    fn it_sees_what_a_camera_of_the_same_attitude_sees() {
        let at = Geodetic::from_degrees(46.8, -121.7, 3000.0);
        let (heading, pitch) = (Radians::from_degrees(200.0), Radians::from_degrees(-20.0));
        let view = Eye::new(at, heading, pitch).view(&lens(), [640, 360], &BODY);
        let orientation =
            overfly::core::camera::orientation_from_attitude(at, heading, pitch, Radians(0.0));
        assert!(view.orientation.dot(orientation).abs() > 1.0 - 1e-15);
        assert!((view.eye.0 - BODY.ecef_from_geodetic(at).0).length() < 1e-8);
    }
}

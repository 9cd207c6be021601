//! The camera: a pose and a lens in f64, and what the LOD and the renderer derive from them.
//!
//! In:    [`View`]: eye in ECEF, orientation, field of view, size in pixels.
//! Out:   [`Camera`]: frustum planes through the eye, pixels per radian, depth ranges.
//! Keeps: nothing.
//! Not here: which diamonds are visible (`lod`), matrices in f32 (`overfly_render_vk`).

use crate::datasource::PageKey;
use crate::geodesy::{Ecef, Ellipsoid, Geodetic};
use crate::units::Radians;
use core::fmt;
use glam::{DMat3, DQuat, DVec3};

/// Narrower lenses would make priorities overflow.
const FIELD_OF_VIEW_MIN: Radians = Radians(1e-6);
/// So would nearer ground.
const NEAR_MIN_M: f64 = 1e-6;
/// Farther off than this squares of lengths could overflow in what is computed next, and f32 could.
const FAR_MAX_M: f64 = 1e30;

/// One view of a frame, as a host gives it and a recording keeps it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// Where the eye is.
    pub eye: Ecef,
    /// Camera axes (x right, y up, z backward) to body-fixed axes; need not be normalised.
    pub orientation: DQuat,
    /// Vertical field of view, in [1e-6, π).
    pub field_of_view: Radians,
    /// Width and height of the picture in pixels, at least 1.
    pub size_px: [u32; 2],
    /// Nothing nearer than this is drawn; at least 1e-6 metres.
    pub near_m: f64,
}

/// Why a frame cannot begin. Nothing was taken and the terrain is as it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ViewFault {
    /// A number of a view is NaN or infinite.
    NotFinite {
        /// Which field.
        field: &'static str,
        /// What was given.
        found: f64,
    },
    /// A coordinate of the eye, or the near distance, is beyond ±1e30 m.
    TooFar {
        /// Which field.
        field: &'static str,
        /// What was given, in metres.
        found_m: f64,
    },
    /// The orientation quaternion is zero.
    NoOrientation,
    /// The field of view is outside [1e-6, π).
    FieldOfView {
        /// What was given, in radians.
        found_rad: f64,
    },
    /// Width or height is zero.
    NoPixels {
        /// What was given.
        found_px: [u32; 2],
    },
    /// The near distance is less than 1e-6 m.
    Near {
        /// What was given, in metres.
        found_m: f64,
    },
    /// The time of the frame is NaN or infinite.
    Time {
        /// What was given, in seconds.
        found_s: f64,
    },
    /// An arrived page says what no ground can be.
    Page {
        /// Which page.
        key: PageKey,
        /// Which of its numbers.
        field: &'static str,
        /// What was found, in metres.
        found_m: f32,
        /// Least and greatest that it may be, in metres.
        allowed_m: [f32; 2],
    },
    /// The calling thread does not compute as IEEE 754 has it.
    Arithmetic {
        /// How, and what is allowed, as a sentence.
        sentence: &'static str,
    },
}

impl fmt::Display for ViewFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { field, found } => {
                write!(f, "view: {field} is {found}, allowed is any finite number")
            }
            Self::TooFar { field, found_m } => {
                write!(f, "view: {field} is {found_m:e} m, allowed is -1e30 to 1e30")
            }
            Self::NoOrientation => {
                write!(f, "view: orientation is the zero quaternion, allowed is any other")
            }
            Self::FieldOfView { found_rad } => {
                write!(
                    f,
                    "view: field of view is {found_rad} rad, allowed is 1e-6 to π, π excluded"
                )
            }
            Self::NoPixels { found_px: [width, height] } => {
                write!(f, "view: size is {width} by {height} pixels, allowed is 1 by 1 or more")
            }
            Self::Near { found_m } => {
                write!(f, "view: near distance is {found_m} m, allowed is 1e-6 or more")
            }
            Self::Time { found_s } => {
                write!(f, "time is {found_s} s, allowed is any finite number")
            }
            Self::Page { key, field, found_m, allowed_m: [least_m, most_m] } => write!(
                f,
                "page {key:?}: {field} is {found_m} m, allowed is {least_m} to {most_m:e}"
            ),
            Self::Arithmetic { sentence } => f.write_str(sentence),
        }
    }
}

impl core::error::Error for ViewFault {}

impl View {
    /// Checks every field.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), ViewFault> {
        self.check_finite()?;
        let eye = self.eye.0.to_array().map(|c| ("eye", c));
        for (field, found_m) in eye.into_iter().chain([("near distance", self.near_m)]) {
            if found_m.abs() > FAR_MAX_M {
                return Err(ViewFault::TooFar { field, found_m });
            }
        }
        if self.orientation.to_array() == [0.0; 4] {
            return Err(ViewFault::NoOrientation);
        }
        if !(self.field_of_view.0 >= FIELD_OF_VIEW_MIN.0
            && self.field_of_view.0 < core::f64::consts::PI)
        {
            return Err(ViewFault::FieldOfView { found_rad: self.field_of_view.0 });
        }
        if self.size_px.contains(&0) {
            return Err(ViewFault::NoPixels { found_px: self.size_px });
        }
        if self.near_m < NEAR_MIN_M {
            return Err(ViewFault::Near { found_m: self.near_m });
        }
        Ok(())
    }

    fn check_finite(&self) -> Result<(), ViewFault> {
        let eye = self.eye.0.to_array().map(|c| ("eye", c));
        let orientation = self.orientation.to_array().map(|c| ("orientation", c));
        let lens = [("field of view", self.field_of_view.0), ("near distance", self.near_m)];
        let mut all = eye.into_iter().chain(orientation).chain(lens);
        let fault = all.find(|(_, found)| !found.is_finite());
        fault.map_or(Ok(()), |(field, found)| Err(ViewFault::NotFinite { field, found }))
    }
}

/// A quaternion of length 1, from one of any length but zero. Where squares keep their digits it is
/// divided by its length alone.
fn normalised(orientation: DQuat) -> DQuat {
    let squared = orientation.length_squared();
    if squared > 1e-200 && squared < 1e200 {
        return orientation.normalize();
    }
    let most = orientation.to_array().into_iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let scaled = orientation.to_array().map(|c| c / most);
    DQuat::from_array(scaled).normalize()
}

/// The orientation of a camera that looks along the nose of an aircraft.
///
/// - In: heading clockwise from north, pitch nose up, roll right wing down; radians.
/// - Out: camera axes (x right, y up, z backward) to body-fixed axes.
pub fn orientation_from_attitude(
    at: Geodetic,
    heading: Radians,
    pitch: Radians,
    roll: Radians,
) -> DQuat {
    let half = core::f64::consts::FRAC_1_SQRT_2;
    // A quarter turn about x lays the camera, which looks down −z, along north.
    let nose_north = DQuat::from_xyzw(half, 0.0, 0.0, half);
    let to_enu = rotation(DVec3::Z, -heading.0)
        * rotation(DVec3::X, pitch.0)
        * rotation(DVec3::Y, roll.0)
        * nose_north;
    DQuat::from_mat3(&at.enu_axes()) * to_enu
}

/// A rotation about a unit axis, through overfly's own trigonometry.
fn rotation(axis: DVec3, angle_rad: f64) -> DQuat {
    let (s, c) =
        (crate::geodesy::trig::sin(angle_rad / 2.0), crate::geodesy::trig::cos(angle_rad / 2.0));
    DQuat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// What a view means to the stages: derived once a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Camera {
    /// Where the eye is.
    pub eye: Ecef,
    /// Geodetic normal under the eye.
    pub normal: DVec3,
    /// Height of the eye above the ellipsoid in metres.
    pub height_m: f64,
    /// Unit vector to the right of the picture, body-fixed axes.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Tangents of half the horizontal and half the vertical field of view.
    pub half_tangents: [f64; 2],
    /// Inward unit normals of the four side planes; all pass through the eye.
    pub side_planes: [DVec3; 4],
    /// Pixels per radian in the middle of the picture.
    pub pixels_per_radian: f64,
    /// How much larger an error looks in the picture's corner: 1/cos² of the corner's angle.
    pub corner_factor: f64,
    /// Nothing nearer than this is drawn, in metres.
    pub near_m: f64,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
}

impl Camera {
    /// The camera of a checked view before `body`.
    pub fn new(view: &View, body: &Ellipsoid) -> Self {
        let ground = body.geodetic_from_ecef(view.eye);
        let axes = DMat3::from_quat(normalised(view.orientation));
        let (right, up, forward) = (axes.x_axis, axes.y_axis, -axes.z_axis);
        let [width, height] = view.size_px.map(f64::from);
        let tan_y = crate::geodesy::trig::tan(view.field_of_view.0 / 2.0);
        let tan_x = tan_y * width / height;
        Self {
            eye: view.eye,
            normal: ground.normal(),
            height_m: ground.height_m,
            right,
            up,
            forward,
            half_tangents: [tan_x, tan_y],
            side_planes: [
                (forward * tan_x + right).normalize(),
                (forward * tan_x - right).normalize(),
                (forward * tan_y + up).normalize(),
                (forward * tan_y - up).normalize(),
            ],
            pixels_per_radian: height / (2.0 * tan_y),
            corner_factor: 1.0 + tan_x * tan_x + tan_y * tan_y,
            near_m: view.near_m,
            size_px: view.size_px,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level_view(at: Geodetic, heading_deg: f64) -> View {
        View {
            eye: Ellipsoid::WGS84.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(
                at,
                Radians::from_degrees(heading_deg),
                Radians(0.0),
                Radians(0.0),
            ),
            field_of_view: Radians::from_degrees(60.0),
            size_px: [1280, 720],
            near_m: 0.1,
        }
    }

    #[test]
    fn a_level_camera_heading_north_looks_north_with_the_sky_up() {
        let at = Geodetic::from_degrees(46.8, -121.7, 3000.0);
        let camera = Camera::new(&level_view(at, 0.0), &Ellipsoid::WGS84);
        let enu = at.enu_axes();
        assert!((camera.forward - enu.y_axis).length() < 1e-12);
        assert!((camera.up - enu.z_axis).length() < 1e-12);
        assert!((camera.right - enu.x_axis).length() < 1e-12);
        let east = Camera::new(&level_view(at, 90.0), &Ellipsoid::WGS84);
        assert!((east.forward - enu.x_axis).length() < 1e-12);
        assert!((camera.height_m - 3000.0).abs() < 1e-8);
    }

    #[test]
    fn side_planes_hold_what_the_picture_shows_and_nothing_else() {
        let at = Geodetic::from_degrees(10.0, 20.0, 1000.0);
        let c = Camera::new(&level_view(at, 33.0), &Ellipsoid::WGS84);
        let at_edge = |x: f64, y: f64| {
            c.forward + c.right * (x * c.half_tangents[0]) + c.up * (y * c.half_tangents[1])
        };
        let inside = |p: DVec3| c.side_planes.iter().all(|plane| plane.dot(p) >= 0.0);
        assert!(inside(at_edge(0.999, -0.999)) && inside(at_edge(-0.999, 0.999)));
        assert!(!inside(at_edge(1.001, 0.0)) && !inside(at_edge(0.0, -1.001)));
    }

    #[test]
    fn bad_views_are_refused_by_field() {
        let good = level_view(Geodetic::from_degrees(0.0, 0.0, 0.0), 0.0);
        assert_eq!(good.check(), Ok(()));
        let with = |change: fn(&mut View)| {
            let mut view = good;
            change(&mut view);
            view.check().unwrap_err()
        };
        let not_finite = with(|v| v.eye.0.x = f64::NAN);
        assert!(
            matches!(not_finite, ViewFault::NotFinite { field: "eye", found } if found.is_nan())
        );
        let far = with(|v| v.eye.0.z = -1e31);
        assert_eq!(far, ViewFault::TooFar { field: "eye", found_m: -1e31 });
        assert_eq!(with(|v| v.size_px = [7, 0]), ViewFault::NoPixels { found_px: [7, 0] });
        assert_eq!(with(|v| v.near_m = 0.0), ViewFault::Near { found_m: 0.0 });
        assert_eq!(
            with(|v| v.orientation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            ViewFault::NoOrientation
        );
        for fov in [0.0, -1.0, 1e-303, 9e-7, core::f64::consts::PI] {
            let mut view = good;
            view.field_of_view = Radians(fov);
            assert_eq!(view.check(), Err(ViewFault::FieldOfView { found_rad: fov }));
        }
    }
}

//! A view of a frame: where the eye is, where it looks, through which lens.
//!
//! In:    degrees, metres, pixels.
//! Out:   [`View`], which the scene's body makes a view of core of.
//! Keeps: nothing.
//! Not here: what a frame does with it.

use crate::arrays::{HEIGHT, LATITUDE, LONGITUDE, checked};
use overfly::core::camera::{self, orientation_from_attitude};
use overfly::core::geodesy::{Ellipsoid, Geodetic};
use overfly::core::units::Radians;
use pyo3::prelude::*;

/// An eye, where it looks, and its lens.
///
/// The height is above the ellipsoid. `look_deg` is heading clockwise from north, pitch above the
/// horizon and roll to the right; the field of view is the vertical one; nothing nearer than
/// `near_m` is drawn.
///
/// >>> import overfly
/// >>> overfly.View(46.85, -121.76, 5000.0, look_deg=(40.0, -8.0, 0.0)).height_m
/// 5000.0
#[pyclass(frozen, get_all, module = "overfly")]
pub struct View {
    /// Latitude of the eye in degrees.
    pub lat_deg: f64,
    /// Longitude of the eye in degrees.
    pub lon_deg: f64,
    /// Height of the eye above the ellipsoid in metres.
    pub height_m: f64,
    /// Heading, pitch and roll in degrees.
    pub look_deg: (f64, f64, f64),
    /// Vertical field of view in degrees.
    pub field_of_view_deg: f64,
    /// Width and height of the picture in pixels.
    pub size_px: (u32, u32),
    /// Nothing nearer than this is drawn, in metres.
    pub near_m: f64,
}

#[pymethods]
impl View {
    #[new]
    #[pyo3(signature = (lat_deg, lon_deg, height_m, *, look_deg=(0.0, 0.0, 0.0),
                        field_of_view_deg=60.0, size_px=(1280, 720), near_m=0.1),
           text_signature = "(lat_deg, lon_deg, height_m, *, look_deg=(0.0, 0.0, 0.0), \
                             field_of_view_deg=60.0, size_px=(1280, 720), near_m=0.1)")]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python, with defaults")]
    fn new(
        lat_deg: f64,
        lon_deg: f64,
        height_m: f64,
        look_deg: (f64, f64, f64),
        field_of_view_deg: f64,
        size_px: (u32, u32),
        near_m: f64,
    ) -> PyResult<Self> {
        checked(LATITUDE, lat_deg)?;
        checked(LONGITUDE, lon_deg)?;
        checked(HEIGHT, height_m)?;
        checked(("heading", [-720.0, 720.0]), look_deg.0)?;
        checked(("pitch", [-360.0, 360.0]), look_deg.1)?;
        checked(("roll", [-360.0, 360.0]), look_deg.2)?;
        checked(("field_of_view_deg", [0.01, 179.0]), field_of_view_deg)?;
        checked(("near_m", [0.001, 1e6]), near_m)?;
        checked(("width", [1.0, 16384.0]), size_px.0.into())?;
        checked(("height", [1.0, 16384.0]), size_px.1.into())?;
        Ok(Self { lat_deg, lon_deg, height_m, look_deg, field_of_view_deg, size_px, near_m })
    }

    fn __repr__(&self) -> String {
        let Self { lat_deg, lon_deg, height_m, look_deg, .. } = self;
        format!("View({lat_deg}, {lon_deg}, {height_m}, look_deg={look_deg:?})")
    }
}

impl View {
    /// Where the eye is.
    pub fn at(&self) -> Geodetic {
        Geodetic::from_degrees(self.lat_deg, self.lon_deg, self.height_m)
    }

    /// What core takes, with the eye at this place.
    pub fn seen_from(&self, at: Geodetic, body: &Ellipsoid) -> camera::View {
        let (heading, pitch, roll) = self.look_deg;
        let [heading, pitch, roll] = [heading, pitch, roll].map(Radians::from_degrees);
        camera::View {
            eye: body.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(at, heading, pitch, roll),
            field_of_view: Radians::from_degrees(self.field_of_view_deg),
            size_px: self.size_px.into(),
            near_m: self.near_m,
        }
    }
}

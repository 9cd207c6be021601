//! The frames: two worlds of number, f64 on the body and f32 before the eye, with one crossing.
//!
//! In:    f64 points on the body.
//! Out:   the same as two-float pairs or eye-relative f32.
//! Keeps: nothing.
//! Not here: the ellipsoid's formulas (`ellipsoid`).

use super::Ellipsoid;
use super::trig::{cos, sin};
use glam::{DMat3, DVec3, Vec3};

/// A point in body-centred, body-fixed axes. Metres, f64: 1 nm steps at the Earth's surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ecef(pub DVec3);

/// A geodetic position: latitude and longitude of the ellipsoid's normal, height above the
/// ellipsoid (not the geoid).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Geodetic {
    /// Latitude in radians, within ±π/2.
    pub lat_rad: f64,
    /// Longitude in radians, east positive.
    pub lon_rad: f64,
    /// Height above the ellipsoid in metres.
    pub height_m: f64,
}

/// A vector in the local east, north, up axes of some geodetic position. Metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Enu(pub DVec3);

/// A point relative to the eye, in body-fixed axes. Metres, f32: what shaders see.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EyeRel(pub Vec3);

/// A body-fixed point as the unevaluated sum of two f32 triples: 48 bits a coordinate.
///
/// Error: at most 2⁻⁴⁹ of the coordinate, 1.2e-8 m on the Earth.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct TwoFloat {
    /// The coordinate rounded to f32.
    pub hi: [f32; 3],
    /// What `hi` left, rounded to f32.
    pub lo: [f32; 3],
}

/// The only place where f64 becomes f32. Error: half an f32 ulp.
#[expect(clippy::cast_possible_truncation, reason = "this is the one named narrowing")]
pub const fn narrow(x: f64) -> f32 {
    x as f32
}

impl Ecef {
    /// This point seen from `eye`: subtract in f64, then narrow.
    ///
    /// Error: half an f32 ulp per axis of the *difference*: 0.5 mm at 16 km, 8 mm at 262 km.
    /// There is deliberately no `From<Ecef> for Vec3`.
    pub fn relative_to(self, eye: Ecef) -> EyeRel {
        let d = self.0 - eye.0;
        EyeRel(Vec3::new(narrow(d.x), narrow(d.y), narrow(d.z)))
    }

    /// This point as a two-float triple.
    pub fn two_float(self) -> TwoFloat {
        let split = |x: f64| {
            let hi = narrow(x);
            (hi, narrow(x - f64::from(hi)))
        };
        let [(xh, xl), (yh, yl), (zh, zl)] = [split(self.0.x), split(self.0.y), split(self.0.z)];
        TwoFloat { hi: [xh, yh, zh], lo: [xl, yl, zl] }
    }
}

impl TwoFloat {
    /// This point seen from `eye`, with the same f32 operations, in the same order, as the vertex
    /// shader: so the result is a function of the two points alone.
    ///
    /// Error: 2 f32 ulp of the difference, plus the 2⁻⁴⁸ of the two representations.
    /// Source: Møller–Knuth two-sum; the DSFUN90 `dssub` as used by virtual globes.
    pub fn relative_to(&self, eye: &TwoFloat) -> EyeRel {
        let axis = |i: usize| {
            let (a, b) = (self.hi[i], -eye.hi[i]);
            let sum = a + b;
            let bb = sum - a;
            let lost = (a - (sum - bb)) + (b - bb);
            sum + (lost + (self.lo[i] - eye.lo[i]))
        };
        EyeRel(Vec3::new(axis(0), axis(1), axis(2)))
    }
}

impl Geodetic {
    /// From degrees and metres, as people write positions.
    pub fn from_degrees(lat_deg: f64, lon_deg: f64, height_m: f64) -> Self {
        let rad = core::f64::consts::PI / 180.0;
        Self { lat_rad: lat_deg * rad, lon_rad: lon_deg * rad, height_m }
    }

    /// The ellipsoid's outward normal here.
    pub fn normal(&self) -> DVec3 {
        let c = cos(self.lat_rad);
        DVec3::new(c * cos(self.lon_rad), c * sin(self.lon_rad), sin(self.lat_rad))
    }

    /// East, north, up as columns: maps [`Enu`] vectors to body-fixed axes.
    pub fn enu_axes(&self) -> DMat3 {
        let (sin_lat, cos_lat) = (sin(self.lat_rad), cos(self.lat_rad));
        let (sin_lon, cos_lon) = (sin(self.lon_rad), cos(self.lon_rad));
        DMat3::from_cols(
            DVec3::new(-sin_lon, cos_lon, 0.0),
            DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
        )
    }
}

impl Enu {
    /// The body-fixed point at this offset from `origin`.
    pub fn to_ecef(self, origin: Geodetic, body: &Ellipsoid) -> Ecef {
        Ecef(body.ecef_from_geodetic(origin).0 + origin.enu_axes() * self.0)
    }

    /// The offset of `point` from `origin`.
    pub fn from_ecef(point: Ecef, origin: Geodetic, body: &Ellipsoid) -> Self {
        let away = point.0 - body.ecef_from_geodetic(origin).0;
        Self(origin.enu_axes().transpose() * away)
    }
}

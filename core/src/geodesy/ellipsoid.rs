//! The reference ellipsoid of a body: geodetic ↔ ECEF, surface points, curvature.
//!
//! In:    equatorial radius and flattening; geodetic positions, normals or ECEF points.
//! Out:   the same in another form.
//! Keeps: nothing.
//! Not here: terrain, geoid.
//! Source: NIMA TR 8350.2 (forward); Vermeille 2002 as rearranged by Karney 2011 (inverse).

use super::frames::{Ecef, Geodetic};
use super::trig::{atan2, cbrt, cos, hypot, sin};
use glam::DVec3;

/// An ellipsoid of revolution about the z axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ellipsoid {
    /// Equatorial radius in metres, above zero.
    pub a_m: f64,
    /// Flattening (a − b)/a, below 1; 0 is a sphere, negative is prolate.
    pub f: f64,
}

impl Ellipsoid {
    /// The Earth, WGS 84.
    pub const WGS84: Self = Self { a_m: 6_378_137.0, f: 1.0 / 298.257_223_563 };
    /// The Moon, IAU mean sphere.
    pub const MOON: Self = Self { a_m: 1_737_400.0, f: 0.0 };
    /// Mars, IAU 2000.
    pub const MARS: Self = Self { a_m: 3_396_190.0, f: 1.0 / 169.894_447_223_612 };

    /// Polar radius in metres.
    pub fn b_m(&self) -> f64 {
        self.a_m * (1.0 - self.f)
    }

    /// Smallest and largest radius of curvature anywhere on the surface, in metres.
    pub fn curvature_radii_m(&self) -> [f64; 2] {
        let (a, b) = (self.a_m, self.b_m());
        let (r, s) = (b * b / a, a * a / b);
        if r < s { [r, s] } else { [s, r] }
    }

    /// The point of the ellipsoid whose outward normal is `normal` (of unit length).
    ///
    /// Error: rounding only, below 4 nm on the Earth.
    pub fn surface_from_normal(&self, normal: DVec3) -> DVec3 {
        let (a2, b2) = (self.a_m * self.a_m, self.b_m() * self.b_m());
        let scaled = DVec3::new(a2 * normal.x, a2 * normal.y, b2 * normal.z);
        scaled / normal.dot(scaled).sqrt()
    }

    /// Geodetic to ECEF.
    ///
    /// - In: latitude within ±π/2 rad, any longitude, height in metres above the ellipsoid.
    /// - Error: rounding only, below 4 nm for heights under 100 km on the Earth.
    pub fn ecef_from_geodetic(&self, at: Geodetic) -> Ecef {
        let e2 = self.f * (2.0 - self.f);
        let (sin_lat, cos_lat) = (sin(at.lat_rad), cos(at.lat_rad));
        let prime_vertical = self.a_m / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        let across = (prime_vertical + at.height_m) * cos_lat;
        Ecef(DVec3::new(
            across * cos(at.lon_rad),
            across * sin(at.lon_rad),
            (prime_vertical * (1.0 - e2) + at.height_m) * sin_lat,
        ))
    }

    /// ECEF to geodetic, everywhere: poles, equator, centre, far away.
    ///
    /// - In: any finite point. On the axis the longitude is 0; the centre maps to the north pole.
    /// - Error: below 8 nm in position up to 5000 km; farther than 2a/ε the body is a point.
    pub fn geodetic_from_ecef(&self, point: Ecef) -> Geodetic {
        let p = point.0;
        let across = hypot(p.x, p.y);
        let (sin_lon, cos_lon) =
            if across == 0.0 { (0.0, 1.0) } else { (p.y / across, p.x / across) };
        let distance = hypot(across, p.z);
        let (sin_lat, cos_lat, height_m) = if distance > 2.0 * self.a_m / f64::EPSILON {
            let half = hypot(across / 2.0, p.z / 2.0);
            (p.z / 2.0 / half, across / 2.0 / half, distance)
        } else if self.f == 0.0 {
            let z = if distance == 0.0 { 1.0 } else { p.z };
            let norm = hypot(z, across);
            (z / norm, across / norm, distance - self.a_m)
        } else {
            self.meridian_inverse(across, p.z)
        };
        Geodetic { lat_rad: atan2(sin_lat, cos_lat), lon_rad: atan2(sin_lon, cos_lon), height_m }
    }

    /// Sine and cosine of the latitude and the height, of a point of the meridian half-plane.
    fn meridian_inverse(&self, across: f64, z: f64) -> (f64, f64, f64) {
        let oblate = self.f >= 0.0;
        let e2 = self.f * (2.0 - self.f);
        let (e2_abs, e4, e2m) = (e2.abs(), e2 * e2, (1.0 - self.f) * (1.0 - self.f));
        let equatorial = (across / self.a_m) * (across / self.a_m);
        let axial = e2m * (z / self.a_m) * (z / self.a_m);
        let r = (equatorial + axial - e4) / 6.0;
        let (p, q) = if oblate { (equatorial, axial) } else { (axial, equatorial) };
        if e4 * q == 0.0 && r <= 0.0 {
            // Inside the singular disc, where two latitudes answer: the height is the lower one's.
            let zz = (if oblate { e4 - p } else { p } / e2m).sqrt();
            let xx = if oblate { p } else { e4 - p }.sqrt();
            let norm = hypot(zz, xx);
            let sin_lat = if z < 0.0 { -zz / norm } else { zz / norm };
            let height = -self.a_m * if oblate { e2m } else { 1.0 } * norm / e2_abs;
            return (sin_lat, xx / norm, height);
        }
        let u = quartic_root(e4 * p * q / 4.0, r);
        let v = (u * u + e4 * q).sqrt();
        // For u < 0 the sum u + v cancels; this is the same number without.
        let uv = if u < 0.0 { e4 * q / (v - u) } else { u + v };
        let w = (e2_abs * (uv - q) / (2.0 * v)).max(0.0);
        let k = uv / ((uv + w * w).sqrt() + w);
        let (k1, k2) = if oblate { (k, k + e2) } else { (k - e2, k) };
        let norm = hypot(z / k1, across / k2);
        let height = (1.0 - e2m / k1) * hypot(k1 * across / k2, z);
        (z / k1 / norm, across / k2 / norm, height)
    }
}

/// The root of Vermeille's resolvent cubic that keeps its digits for every sign of `r`.
fn quartic_root(s: f64, r: f64) -> f64 {
    let (r2, r3) = (r * r, r * r * r);
    let discriminant = s * (2.0 * r3 + s);
    if discriminant < 0.0 {
        let angle = atan2((-discriminant).sqrt(), -(s + r3));
        return r + 2.0 * r * cos(angle / 3.0);
    }
    let sum = s + r3;
    let root = discriminant.sqrt();
    let t = cbrt(if sum < 0.0 { sum - root } else { sum + root });
    r + t + if t == 0.0 { 0.0 } else { r2 / t }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip_error_m(body: &Ellipsoid, point: DVec3) -> f64 {
        let there = body.geodetic_from_ecef(Ecef(point));
        (body.ecef_from_geodetic(there).0 - point).length()
    }

    #[test]
    fn round_trip_is_exact_to_nanometres_from_the_core_to_orbit() {
        let bodies = [Ellipsoid::WGS84, Ellipsoid::MOON, Ellipsoid::MARS];
        let heights_m = [-11_000.0, 0.0, 8848.0, 400_000.0, 3_000_000.0];
        let mut cases = Vec::new();
        for lat in -90..=90 {
            let lons = (-180..=180).step_by(15);
            cases.extend(lons.map(|lon| (f64::from(lat), f64::from(lon))));
        }
        for (lat, lon) in cases {
            for (body, height_m) in bodies.iter().flat_map(|b| heights_m.map(|h| (b, h))) {
                let at = Geodetic::from_degrees(lat, lon, height_m);
                let error = round_trip_error_m(body, body.ecef_from_geodetic(at).0);
                assert!(error < 8e-9, "{error} m at {lat} {lon} {height_m}");
            }
        }
    }

    #[test]
    fn poles_axis_centre_and_the_singular_disc_are_finite() {
        let body = Ellipsoid::WGS84;
        let pole = body.geodetic_from_ecef(Ecef(DVec3::new(0.0, 0.0, body.b_m() + 5.0)));
        assert_eq!(pole.lon_rad, 0.0);
        assert!((pole.height_m - 5.0).abs() < 4e-9);
        let centre = body.geodetic_from_ecef(Ecef(DVec3::ZERO));
        assert!((centre.lat_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((centre.height_m + body.b_m()).abs() < 1e-6);
        for r in [1.0, 1000.0, 42_000.0, 42_697.6, 50_000.0] {
            for z in [0.0, 1e-6, -30.0, 900.0] {
                assert!(round_trip_error_m(&body, DVec3::new(r, 0.0, z)) < 8e-9, "{r} {z}");
            }
        }
        assert!(body.geodetic_from_ecef(Ecef(DVec3::splat(1e25))).height_m.is_finite());
    }

    #[test]
    fn prolate_and_very_flat_bodies_round_trip() {
        for f in [-0.5, -0.01, 0.2, 0.5] {
            let body = Ellipsoid { a_m: 1.0e6, f };
            for (x, z) in [(1.2e6, 3e5), (9e5, -8e5), (2e6, 0.0), (10.0, 1.6e6)] {
                let error = round_trip_error_m(&body, DVec3::new(x, 100.0, z));
                assert!(error < 4e-9, "{error} m for f = {f}");
            }
        }
    }

    #[test]
    fn a_surface_point_has_the_normal_that_made_it() {
        let body = Ellipsoid::WGS84;
        for at in [(0.0, 0.0), (90.0, 0.0), (-90.0, 10.0), (47.3, 11.4), (-33.9, 151.2)] {
            let at = Geodetic::from_degrees(at.0, at.1, 0.0);
            let by_normal = body.surface_from_normal(at.normal());
            assert!((by_normal - body.ecef_from_geodetic(at).0).length() < 4e-9);
        }
    }
}

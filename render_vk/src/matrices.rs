//! What the shaders know of a view: eye, rotation, projection, light.
//!
//! In:    the camera of a view, the parts of the frame, a depth range.
//! Out:   [`ViewTerms`]: push constants.
//! Keeps: nothing.
//! Not here: the shaders' side of the same block (`shaders/air.wgsl`).

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::geodesy::narrow;
use overfly_core::scene::FrameParts;

/// The shaders' `View`: 124 bytes as thirty-one floats, below the 128 that every device takes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ViewTerms(pub(crate) [f32; 31]);

impl ViewTerms {
    /// All terms but the depth range's.
    pub(crate) fn new(camera: &Camera, parts: &FrameParts) -> Self {
        let eye = camera.eye.two_float();
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let [tan_x, tan_y] = camera.half_tangents;
        let radius_m = camera.eye.0.length() - camera.height_m;
        // Only bodies with a sea have air, until scenes name their atmosphere.
        let air = flag(parts.sea);
        let sun = parts.sun_direction.map_or(camera.normal, DVec3::normalize);
        let rows = [
            (eye.hi, air),
            (eye.lo, flag(parts.sea)),
            (narrowed(camera.right), narrow(1.0 / tan_x)),
            (narrowed(camera.up), narrow(1.0 / tan_y)),
            (narrowed(camera.forward), narrow(radius_m)),
            (narrowed(camera.normal), narrow(camera.height_m)),
            (narrowed(sun), flag(parts.sun_direction.is_some())),
        ];
        let mut terms = [0.0; 31];
        for (row, (vector, last)) in terms.chunks_exact_mut(4).zip(rows) {
            row[..3].copy_from_slice(&vector);
            row[3] = last;
        }
        terms[30] = narrow(1.0 / camera.pixels_per_radian);
        Self(terms)
    }

    /// The same view cut to one depth range.
    ///
    /// Clip z is slope · w + offset: with 1 near and 0 far, whatever the range, so that x, y and w
    /// of a vertex are the same bits in every range. An infinite far border has slope 0.
    pub(crate) fn in_range(mut self, near_m: f64, far_m: f64) -> Self {
        let (slope, offset) = if far_m.is_finite() {
            (-near_m / (far_m - near_m), near_m * (far_m / (far_m - near_m)))
        } else {
            (0.0, near_m)
        };
        self.0[28] = narrow(slope);
        self.0[29] = narrow(offset);
        self
    }
}

fn narrowed(v: DVec3) -> [f32; 3] {
    [narrow(v.x), narrow(v.y), narrow(v.z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{View, orientation_from_attitude};
    use overfly_core::geodesy::{Ellipsoid, Geodetic};
    use overfly_core::units::Radians;

    fn terms() -> ViewTerms {
        let at = Geodetic::from_degrees(47.0, 11.0, 2000.0);
        let level = Radians(0.0);
        let view = View {
            eye: Ellipsoid::WGS84.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(at, level, level, level),
            field_of_view: Radians::from_degrees(60.0),
            size_px: [1280, 720],
            near_m: 0.1,
        };
        let camera = Camera::new(&view, &Ellipsoid::WGS84);
        ViewTerms::new(&camera, &FrameParts { sun_direction: None, sea: true })
    }

    #[test]
    fn depth_is_one_at_the_near_border_and_zero_at_the_far_one() {
        let depth = |terms: &ViewTerms, w: f32| (terms.0[28] * w + terms.0[29]) / w;
        let finite = terms().in_range(10.0, 1000.0);
        assert!((depth(&finite, 10.0) - 1.0).abs() < 1e-6);
        assert!(depth(&finite, 1000.0).abs() < 1e-6);
        assert!(depth(&finite, 100.0) > depth(&finite, 200.0));
        let infinite = terms().in_range(10.0, f64::INFINITY);
        assert_eq!(depth(&infinite, 10.0), 1.0);
        assert!(depth(&infinite, 1e7) > 0.0);
    }

    #[test]
    fn a_range_changes_depth_terms_only() {
        let (a, b) = (terms().in_range(0.1, 100.0), terms().in_range(99.0, f64::INFINITY));
        assert_eq!(a.0[..28], b.0[..28]);
        assert_ne!(a.0[28..30], b.0[28..30]);
        assert_eq!(a.0[30], b.0[30]);
    }

    #[test]
    fn the_bodys_radius_is_the_one_under_the_eye() {
        let radius_m = terms().0[19];
        assert!((6.356e6..6.379e6).contains(&radius_m), "{radius_m}");
        assert_eq!(terms().0[23], 2000.0);
    }
}

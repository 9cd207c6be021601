//! What the shaders know of a view: eye, rotation, projection, light, time.
//!
//! In:    the camera of a view, the parts of the frame, a depth range.
//! Out:   [`ViewTerms`], a uniform block; [`RangeTerms`], push constants.
//! Keeps: nothing.
//! Not here: the shaders' side of the same blocks (`shaders/view.wgsl`).

use crate::picture::{Picture, Show};
use glam::DVec3;
use overfly_core::geodesy::narrow;
use overfly_core::settings::DepthOrder;

/// The shaders' `View`: what is the same in all depth ranges of a picture.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub(crate) struct ViewTerms {
    eye_hi: [f32; 3],
    air: f32,
    eye_lo: [f32; 3],
    sea: f32,
    right: [f32; 3],
    inverse_tan_x: f32,
    up: [f32; 3],
    inverse_tan_y: f32,
    forward: [f32; 3],
    body_radius_m: f32,
    eye_up: [f32; 3],
    eye_height_m: f32,
    sun: [f32; 3],
    sun_on: f32,
    pixel_rad: f32,
    now_ms: u32,
    morph_ms: f32,
    show: u32,
    tolerance_px: f32,
    vertices_per_patch: u32,
    pixels_inverse: [f32; 2],
}

const _: () = assert!(size_of::<ViewTerms>() == 144);

/// What of a renderer's settings the shaders know.
#[derive(Clone, Copy)]
pub(crate) struct Fixed {
    pub(crate) morph_ms: f32,
    pub(crate) tolerance_px: f32,
    pub(crate) vertices_per_patch: u32,
}

impl ViewTerms {
    pub(crate) fn new(picture: &Picture<'_>, fixed: &Fixed) -> Self {
        let (camera, parts) = (&picture.view.camera, picture.parts);
        let eye = camera.eye.two_float();
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let [tan_x, tan_y] = camera.half_tangents;
        let sun = parts.sun_direction.map_or(camera.normal, DVec3::normalize);
        Self {
            eye_hi: eye.hi,
            // Only bodies with a sea have air, until scenes name their atmosphere.
            air: flag(parts.sea),
            eye_lo: eye.lo,
            sea: flag(parts.sea),
            right: narrowed(camera.right),
            inverse_tan_x: narrow(1.0 / tan_x),
            up: narrowed(camera.up),
            inverse_tan_y: narrow(1.0 / tan_y),
            forward: narrowed(camera.forward),
            body_radius_m: narrow(camera.eye.0.length() - camera.height_m),
            eye_up: narrowed(camera.normal),
            eye_height_m: narrow(camera.height_m),
            sun: narrowed(sun),
            sun_on: flag(parts.sun_direction.is_some()),
            pixel_rad: narrow(1.0 / camera.pixels_per_radian),
            now_ms: picture.time_ms,
            morph_ms: fixed.morph_ms,
            show: picture.show.code(),
            tolerance_px: fixed.tolerance_px,
            vertices_per_patch: fixed.vertices_per_patch,
            pixels_inverse: camera.size_px.map(|n| narrow(1.0 / f64::from(n))),
        }
    }
}

impl Show {
    fn code(self) -> u32 {
        self as u32
    }
}

/// The shaders' `Range`: how depth runs in one depth range.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub(crate) struct RangeTerms {
    /// Clip z is slope · w + offset, so that x, y and w of a vertex are the same bits in every
    /// range.
    slope: f32,
    offset: f32,
    /// Depth of what is infinitely far.
    far: f32,
    index: u32,
}

const _: () = assert!(size_of::<RangeTerms>() == 16);

impl RangeTerms {
    /// The terms of range `index`, from `near_m` to `far_m`, which may be infinite.
    pub(crate) fn new(order: DepthOrder, [near_m, far_m]: [f64; 2], index: usize) -> Self {
        // Reversed: 1 at the near border and 0 at the far one.
        let (slope, offset) = if far_m.is_finite() {
            (-near_m / (far_m - near_m), near_m * (far_m / (far_m - near_m)))
        } else {
            (0.0, near_m)
        };
        let index = u32::try_from(index).expect("ranges are few");
        match order {
            DepthOrder::Reversed => {
                Self { slope: narrow(slope), offset: narrow(offset), far: 0.0, index }
            }
            DepthOrder::Forward => {
                Self { slope: narrow(1.0 - slope), offset: narrow(-offset), far: 1.0, index }
            }
        }
    }
}

fn narrowed(v: DVec3) -> [f32; 3] {
    [narrow(v.x), narrow(v.y), narrow(v.z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(terms: &RangeTerms, w: f32) -> f32 {
        (terms.slope * w + terms.offset) / w
    }

    #[test]
    fn reversed_depth_is_one_at_the_near_border_and_zero_at_the_far_one() {
        let finite = RangeTerms::new(DepthOrder::Reversed, [10.0, 1000.0], 0);
        assert!((depth(&finite, 10.0) - 1.0).abs() < 1e-6);
        assert!(depth(&finite, 1000.0).abs() < 1e-6);
        assert!(depth(&finite, 100.0) > depth(&finite, 200.0));
        let infinite = RangeTerms::new(DepthOrder::Reversed, [10.0, f64::INFINITY], 1);
        assert_eq!(depth(&infinite, 10.0), 1.0);
        assert!(depth(&infinite, 1e7) > 0.0);
    }

    #[test]
    fn forward_depth_is_zero_at_the_near_border_and_one_at_the_far_one() {
        let finite = RangeTerms::new(DepthOrder::Forward, [10.0, 1000.0], 0);
        assert!(depth(&finite, 10.0).abs() < 1e-6);
        assert!((depth(&finite, 1000.0) - 1.0).abs() < 1e-6);
        assert!(depth(&finite, 100.0) < depth(&finite, 200.0));
        let infinite = RangeTerms::new(DepthOrder::Forward, [10.0, f64::INFINITY], 0);
        assert_eq!((depth(&infinite, 10.0), infinite.far), (0.0, 1.0));
        assert!(depth(&infinite, 1e5) < 1.0);
    }
}

//! What the shaders know of a view: eye, rotation, projection, light, time.
//!
//! In:    the camera of a view, the parts of the frame, a depth range.
//! Out:   [`ViewTerms`], a uniform block; [`RangeTerms`], push constants; [`projection`] for hosts.
//! Keeps: nothing.
//! Not here: the shaders' side of the same blocks (`shaders/view.wgsl`).

use crate::picture::{Picture, Show};
use glam::DVec3;
use overfly_core::frame::data::ViewDraws;
use overfly_core::geodesy::narrow;
use overfly_core::projection::DepthTerms;
use overfly_core::settings::DepthOrder;

/// The shaders' `View`: what is the same in all depth ranges of a picture.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub(crate) struct ViewTerms {
    eye_hi: [f32; 3],
    pixel_rad: f32,
    eye_lo: [f32; 3],
    tolerance_px: f32,
    right: [f32; 3],
    inverse_tan_x: f32,
    up: [f32; 3],
    inverse_tan_y: f32,
    forward: [f32; 3],
    body_radius_m: f32,
    eye_up: [f32; 3],
    eye_height_m: f32,
    sun: [f32; 3],
    now_ms: u32,
    pixels_inverse: [f32; 2],
    morph_ms: f32,
    show: u32,
    vertices_per_patch: u32,
    _to_16: [u32; 3],
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
        let [tan_x, tan_y] = camera.half_tangents;
        let sun = parts.sun_direction.map_or(camera.normal, DVec3::normalize);
        Self {
            eye_hi: eye.hi,
            pixel_rad: narrow(1.0 / camera.pixels_per_radian),
            eye_lo: eye.lo,
            tolerance_px: fixed.tolerance_px,
            right: narrowed(camera.right),
            inverse_tan_x: narrow(1.0 / tan_x),
            up: narrowed(camera.up),
            inverse_tan_y: narrow(1.0 / tan_y),
            forward: narrowed(camera.forward),
            body_radius_m: narrow(camera.eye.0.length() - camera.height_m),
            eye_up: narrowed(camera.normal),
            eye_height_m: narrow(camera.height_m),
            sun: narrowed(sun),
            now_ms: picture.time_ms,
            pixels_inverse: camera.size_px.map(|n| narrow(1.0 / f64::from(n))),
            morph_ms: fixed.morph_ms,
            show: picture.show.code(),
            vertices_per_patch: fixed.vertices_per_patch,
            _to_16: [0; 3],
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
    /// The terms of range `index` between two borders, the far one of which may be infinite.
    pub(crate) fn new(order: DepthOrder, borders_m: [f64; 2], index: usize) -> Self {
        let DepthTerms { slope, offset, far } = DepthTerms::of(order, borders_m);
        let index = u32::try_from(index).expect("ranges are few");
        Self { slope, offset, far, index }
    }
}

/// The projection of one depth range of a view, as the ground is drawn with it: from eye space
/// (x right, y up, z backward, metres) to Vulkan's clip space (y down, z from 0 to w). Columns, as
/// shaders take them; `None` without such a range.
///
/// A host draws its own geometry with it after the range's ground, with the same order of depth:
/// `DepthOrder::Reversed` compares with `GREATER`. A point's z and w are the ground's to the last
/// bit; only what is between the range's `near_m` and `far_m` is seen.
pub fn projection(view: &ViewDraws, range: usize, order: DepthOrder) -> Option<[[f32; 4]; 4]> {
    let found = view.ranges.get(range)?;
    let terms = RangeTerms::new(order, [found.near_m, found.far_m], range);
    let [x, y] = view.camera.half_tangents.map(|tangent| narrow(1.0 / tangent));
    Some([
        [x, 0.0, 0.0, 0.0],
        [0.0, -y, 0.0, 0.0],
        [0.0, 0.0, -terms.slope, -1.0],
        [0.0, 0.0, terms.offset, 0.0],
    ])
}

fn narrowed(v: DVec3) -> [f32; 3] {
    [narrow(v.x), narrow(v.y), narrow(v.z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Camera, View};
    use overfly_core::frame::data::RangeDraws;
    use overfly_core::geodesy::{Ecef, Ellipsoid};
    use overfly_core::units::Radians;

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

    #[test]
    fn a_projection_takes_the_corners_of_the_picture_and_the_borders_of_the_range() {
        let view = View {
            eye: Ecef(DVec3::X * 7e6),
            orientation: glam::DQuat::IDENTITY,
            field_of_view: Radians(1.0),
            size_px: [200, 100],
            near_m: 0.5,
        };
        let camera = Camera::new(&view, &Ellipsoid::WGS84);
        let [tan_x, tan_y] = camera.half_tangents.map(narrow);
        let range = |near_m, far_m| RangeDraws { near_m, far_m, patches: Vec::new() };
        let ranges = vec![range(0.5, 32.0), range(30.0, f64::INFINITY)];
        let view = ViewDraws { camera, ranges };
        for (order, [near, far]) in
            [(DepthOrder::Reversed, [1.0, 0.0]), (DepthOrder::Forward, [0.0, 1.0])]
        {
            let columns = projection(&view, 0, order).unwrap();
            let clip = |at: [f32; 4]| {
                let row = |i: usize| (0..4).map(|j| columns[j][i] * at[j]).sum::<f32>();
                let w = row(3);
                [row(0) / w, row(1) / w, row(2) / w]
            };
            for (away_m, depth) in [(0.5, near), (32.0, far)] {
                // Right and up in eye space is right and up on a screen whose y runs down.
                let [x, y, z] = clip([tan_x * away_m, tan_y * away_m, -away_m, 1.0]);
                let off = [x - 1.0, y + 1.0, z - depth].map(f32::abs);
                assert!(off.iter().all(|off| *off < 1e-6), "{order:?}, {away_m} m: {off:?}");
            }
            assert!(projection(&view, 1, order).is_some());
            assert_eq!(projection(&view, 2, order), None);
        }
    }
}

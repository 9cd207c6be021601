//! What a renderer of its own needs of a view: eye, axes and lens as f32, and how depth runs.
//!
//! In:    a camera, the borders of a depth range.
//! Out:   [`EyeConstants`], [`DepthTerms`], and both as one matrix.
//! Keeps: nothing.
//! Not here: the camera in f64 (`camera`), which patch lies in which range (`mesh::place`).
//!
//! Clip space is Vulkan's: x to the right, y down, −w to w; z from 0 to w; w is the distance along
//! the view in metres. Where y points up, as in OpenGL and Direct3D, change the sign of y.

use crate::camera::Camera;
use crate::geodesy::{TwoFloat, narrow};
use crate::settings::DepthOrder;
use glam::DVec3;

/// What is the same for all that is drawn of a view.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct EyeConstants {
    /// Body-fixed eye in metres, within 2⁻⁴⁹ of each coordinate: subtract it from a vertex by
    /// [`TwoFloat::relative_to`], whose f32 operations shaders can repeat.
    pub eye: TwoFloat,
    /// Unit vectors to the right, to the top and into the picture, body-fixed axes.
    pub axes: [[f32; 3]; 3],
    /// Geodetic normal under the eye.
    pub eye_up: [f32; 3],
    /// 1 / tangent of half the horizontal and of half the vertical field of view.
    pub inverse_tangents: [f32; 2],
}

impl EyeConstants {
    /// The constants of a camera.
    pub fn of(camera: &Camera) -> Self {
        Self {
            eye: camera.eye.two_float(),
            axes: [camera.right, camera.up, camera.forward].map(narrowed),
            eye_up: narrowed(camera.normal),
            inverse_tangents: camera.half_tangents.map(|tangent| narrow(1.0 / tangent)),
        }
    }

    /// A vertex in the axes of the picture: right, up, forward, metres from the eye.
    ///
    /// Error: 3 f32 ulp of the distance; at 60° and 1000 pixels some 1e-4 pixels.
    pub fn pictured(&self, vertex: &TwoFloat) -> [f32; 3] {
        let from_eye = vertex.relative_to(&self.eye).0.to_array();
        self.axes.map(|axis| axis[0] * from_eye[0] + axis[1] * from_eye[1] + axis[2] * from_eye[2])
    }

    /// From metres off the eye, body-fixed axes, to clip space: four columns, as shaders take them.
    /// There is no translation in it, since vertices come with the eye subtracted.
    pub fn matrix(&self, depth: &DepthTerms) -> [[f32; 4]; 4] {
        let [right, up, forward] = self.axes;
        let [x, y] = self.inverse_tangents;
        let column = |i: usize| [x * right[i], -(y * up[i]), depth.slope * forward[i], forward[i]];
        [column(0), column(1), column(2), [0.0, 0.0, depth.offset, 0.0]]
    }
}

/// How depth runs in one depth range: clip z is `slope` · w + `offset`. So x, y and w of a vertex
/// are the same bits in every range.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct DepthTerms {
    /// No unit.
    pub slope: f32,
    /// Metres.
    pub offset: f32,
    /// Depth of what is infinitely far; clear the depth buffer with it.
    pub far: f32,
}

impl DepthTerms {
    /// The terms of a range from `near_m` to `far_m`, which may be infinite. Reversed depth is 1 at
    /// the near border and 0 at the far one, forward depth the other way round.
    pub fn of(order: DepthOrder, [near_m, far_m]: [f64; 2]) -> Self {
        let (slope, offset) = if far_m.is_finite() {
            (-near_m / (far_m - near_m), near_m * (far_m / (far_m - near_m)))
        } else {
            (0.0, near_m)
        };
        match order {
            DepthOrder::Reversed => Self { slope: narrow(slope), offset: narrow(offset), far: 0.0 },
            DepthOrder::Forward => {
                Self { slope: narrow(1.0 - slope), offset: narrow(-offset), far: 1.0 }
            }
        }
    }

    /// Depth of what is `w` metres off along the view.
    pub fn depth(&self, w: f32) -> f32 {
        (self.slope * w + self.offset) / w
    }
}

fn narrowed(v: DVec3) -> [f32; 3] {
    v.to_array().map(narrow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;
    use crate::geodesy::{Ecef, Ellipsoid};
    use crate::units::Radians;

    #[test]
    fn depth_is_one_and_zero_at_the_borders_in_both_orders() {
        for (order, [at_near, at_far]) in
            [(DepthOrder::Reversed, [1.0, 0.0]), (DepthOrder::Forward, [0.0, 1.0])]
        {
            let finite = DepthTerms::of(order, [10.0, 1000.0]);
            assert!((finite.depth(10.0) - at_near).abs() < 1e-6, "{order:?}");
            assert!((finite.depth(1000.0) - at_far).abs() < 1e-6, "{order:?}");
            let infinite = DepthTerms::of(order, [10.0, f64::INFINITY]);
            assert_eq!((infinite.depth(10.0), infinite.far), (at_near, at_far));
            assert!((infinite.depth(1e9) - at_far).abs() < 1e-6, "{order:?}");
        }
    }

    #[test]
    fn the_matrix_takes_the_pictures_corners_to_the_corners_of_clip_space() {
        let view = View {
            eye: Ecef(DVec3::new(6.378_2e6, -4e5, 3e3)),
            orientation: glam::DQuat::from_xyzw(0.1, -0.3, 0.2, 0.9),
            field_of_view: Radians(0.8),
            size_px: [640, 480],
            near_m: 1.0,
        };
        let camera = Camera::new(&view, &Ellipsoid::WGS84);
        let eye = EyeConstants::of(&camera);
        let depth = DepthTerms::of(DepthOrder::Reversed, [2.0, 900.0]);
        let matrix = eye.matrix(&depth);
        for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (0.0, 0.0)] {
            let [tan_x, tan_y] = camera.half_tangents;
            let ray = camera.forward + camera.right * (x * tan_x) + camera.up * (y * tan_y);
            let vertex = Ecef(camera.eye.0 + ray * 50.0).two_float();
            let o = vertex.relative_to(&eye.eye).0.to_array();
            let clip: [f32; 4] = core::array::from_fn(|row| {
                (0..3).map(|i| matrix[i][row] * o[i]).sum::<f32>() + matrix[3][row]
            });
            assert!((clip[3] - 50.0).abs() < 1e-4, "{clip:?}");
            assert!((f64::from(clip[0] / clip[3]) - x).abs() < 1e-6, "{clip:?}");
            assert!((f64::from(clip[1] / clip[3]) + y).abs() < 1e-6, "{clip:?}");
            assert!((clip[2] / clip[3] - depth.depth(50.0)).abs() < 1e-6, "{clip:?}");
            let pictured = eye.pictured(&vertex);
            assert!((pictured[2] - clip[3]).abs() < 1e-5, "{pictured:?}");
        }
    }
}

//! A fixed point of the ground stays where it is on the screen.
//!
//! In:    a vertex 1 m away, at the equator, at a pole and at ±180°; an eye that circles slowly.
//! Out:   how far from its f64 place it is drawn: rms within 0.01 pixels.
//! Keeps: nothing.
//! Not here: whether arithmetic on the device is that of the host (`self_test` in `src`).
//!
//! A hundredth of a pixel cannot be read from a picture. So the vertex is the corner of a
//! right-angled triangle, and the same eye looks at it through a lens so narrow that a hundredth
//! of a pixel of the picture in question becomes a pixel or more; there the corner's place is read.

mod stage;

use glam::{DMat3, DQuat, DVec2, DVec3};
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic, narrow, trig};
use overfly_core::mesh::Patches;
use overfly_core::scene::FrameParts;
use overfly_core::settings::VertexPrecision;
use overfly_core::units::Radians;
use overfly_jobs::Team;
use overfly_render_vk::{Backdrop, Picture, Renderer, RendererSettings, Show};

/// Side of the magnified picture in pixels.
const SIDE_PX: u32 = 128;
/// Height of the picture in question.
const HEIGHT_PX: f64 = 360.0;
const FRAMES: u32 = 1000;
const DISTANCE_M: f64 = 1.0;
/// Every so many frames are read from the device; all are computed.
const DRAWN_EVERY: usize = 10;
const NOTHING_ELSE: FrameParts = FrameParts { sun_direction: None, sea: false };

/// The equator, a pole, and the meridian at which longitudes jump.
const PLACES: [(&str, f64, f64); 3] =
    [("equator", 0.0, 30.0), ("pole", 90.0, 0.0), ("±180°", -17.3, 180.0)];

/// The corner (slot 0's apex) and the ends of its legs, as they are stored.
struct Corner {
    patches: Patches,
    apex: DVec3,
    legs: [DVec3; 2],
}

/// The eye of one frame: before the corner, a little aside, moving some 0.05 pixels a frame.
fn eye(at: Geodetic, frame: u32) -> DVec3 {
    let turned = f64::from(frame) * 1.5e-4;
    let (sin, cos) = (trig::sin(turned - 0.075), trig::cos(turned - 0.075));
    let enu = DVec3::new(sin * 0.8, -cos * 0.8, 0.6 + 0.003 * sin) * DISTANCE_M;
    Ellipsoid::WGS84.ecef_from_geodetic(at).0 + at.enu_axes() * enu
}

/// Looks beside the corner by up to half of `aside` of the picture, so that the corner is drawn
/// at another place between pixels in every frame.
fn camera(eye: DVec3, at: DVec3, (field_of_view, aside): (Radians, f64), frame: u32) -> Camera {
    let back = (eye - at).normalize();
    let right = at.normalize().cross(back).normalize();
    let up = back.cross(right);
    let wander = [0.17, 0.29].map(|step| {
        let cycle = step * f64::from(frame);
        (cycle - cycle.floor() - 0.5) * aside * field_of_view.0
    });
    let back = (back + right * wander[0] + up * wander[1]).normalize();
    let right = up.cross(back).normalize();
    let axes = DMat3::from_cols(right, back.cross(right), back);
    let orientation = DQuat::from_mat3(&axes);
    let size_px = [SIDE_PX; 2];
    let view = View { eye: Ecef(eye), orientation, field_of_view, size_px, near_m: 0.1 };
    Camera::new(&view, &Ellipsoid::WGS84)
}

/// Where a point is drawn in f64: pixels from the top left of the camera's picture.
fn projected(camera: &Camera, point: DVec3) -> DVec2 {
    let d = point - camera.eye.0;
    let depth_m = camera.forward.dot(d);
    let [tan_x, tan_y] = camera.half_tangents;
    let ndc = DVec2::new(camera.right.dot(d) / tan_x, -camera.up.dot(d) / tan_y) / depth_m;
    (ndc + 1.0) * 0.5 * f64::from(SIDE_PX)
}

/// The same with the operations of the shaders, in their order.
fn emulated(camera: &Camera, patches: &Patches, vertices: VertexPrecision) -> DVec2 {
    let position = patches.vertices[0].position;
    let axes = [camera.right, camera.up, camera.forward];
    let picture = match vertices {
        VertexPrecision::TwoFloat => {
            let [x, y, z] = position.relative_to(&camera.eye.two_float()).0.to_array();
            axes.map(|axis| {
                let [ax, ay, az] = axis.to_array().map(narrow);
                ax * x + ay * y + az * z
            })
        }
        VertexPrecision::EyeF64 => {
            let eye = camera.eye.0.to_array();
            let [x, y, z] = [0, 1, 2]
                .map(|i: usize| (f64::from(position.hi[i]) - eye[i]) + f64::from(position.lo[i]));
            axes.map(|axis| narrow(x * axis.x + y * axis.y + z * axis.z))
        }
    };
    let [inverse_x, inverse_y] = camera.half_tangents.map(|tan| narrow(1.0 / tan));
    let [x, y] = [picture[0] * inverse_x, -(picture[1] * inverse_y)];
    let ndc = DVec2::new(f64::from(x / picture[2]), f64::from(y / picture[2]));
    (ndc + 1.0) * 0.5 * f64::from(SIDE_PX)
}

/// A corner at a place, its legs as long as the magnified picture is wide, along its axes.
fn corner(at: Geodetic, field_of_view: Radians) -> Corner {
    let apex = Ellipsoid::WGS84.ecef_from_geodetic(at).0;
    let camera = camera(eye(at, FRAMES / 2), apex, (field_of_view, 0.0), 0);
    let leg_m = DISTANCE_M * field_of_view.0;
    let legs = [camera.right, -camera.up].map(|axis| apex + axis * leg_m);
    let patches = stage::triangles(&[[apex, legs[1], legs[0]]]);
    let stored = |i: usize| {
        let position = patches.vertices[i].position;
        let sum = |i: usize| f64::from(position.hi[i]) + f64::from(position.lo[i]);
        DVec3::new(sum(0), sum(1), sum(2))
    };
    Corner { apex: stored(0), legs: [stored(2), stored(1)], patches }
}

fn pixels(renderer: &mut Renderer, camera: Camera, patches: &Patches) -> Vec<u8> {
    let view = stage::draws(camera, &[0], &[0.1]);
    let picture = Picture {
        show: Show::Normals,
        backdrop: Backdrop::Colour(stage::MAGENTA),
        ..Picture::of(&view, patches, &NOTHING_ELSE)
    };
    renderer.draw(&picture, &Team::alone()).unwrap();
    renderer.read_pixels().unwrap()
}

/// How far from its f64 place the corner was drawn, in pixels of the magnified picture: read
/// where its edges begin, in a row below it and a column beside it.
fn read_off(pixels: &[u8], camera: &Camera, corner: &Corner) -> DVec2 {
    let is_ground = |x: u32, y: u32| {
        let at = 4 * (y * SIDE_PX + x) as usize;
        pixels[at..at + 3] != [255, 0, 255]
    };
    let apex = projected(camera, corner.apex);
    let [right, down] = corner.legs.map(|leg| projected(camera, leg) - apex);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in the picture")]
    let beyond = |px: f64| (px + 10.0) as u32;
    let (row, column) = (beyond(apex.y), beyond(apex.x));
    let left = (0..SIDE_PX).find(|&x| is_ground(x, row)).expect("a row of the triangle");
    let top = (0..SIDE_PX).find(|&y| is_ground(column, y)).expect("a column of the triangle");
    // The legs are not quite along the axes: where they cross the row and the column.
    let left_px = apex.x + (f64::from(row) + 0.5 - apex.y) * down.x / down.y;
    let top_px = apex.y + (f64::from(column) + 0.5 - apex.x) * right.y / right.x;
    // Covered are pixels whose middle is inside: on average those from half a pixel on.
    DVec2::new(f64::from(left) - left_px, f64::from(top) - top_px)
}

fn rms(errors: &[DVec2]) -> f64 {
    let sum: f64 = errors.iter().map(|error| error.length_squared()).sum();
    (sum / errors.len() as f64).sqrt()
}

/// Flies around a place and computes where the corner is drawn: rms error in pixels of a picture
/// `HEIGHT_PX` high.
fn computed_rms_px(at: Geodetic, vertices: VertexPrecision, lens: (Radians, f64)) -> f64 {
    let corner = corner(at, lens.0);
    let error = |frame| {
        let camera = camera(eye(at, frame), corner.apex, lens, frame);
        emulated(&camera, &corner.patches, vertices) - projected(&camera, corner.apex)
    };
    let errors: Vec<DVec2> = (0..FRAMES).map(error).collect();
    rms(&errors) * HEIGHT_PX / f64::from(SIDE_PX)
}

/// Flies around a place and reads where the corner is drawn through a lens that many times
/// narrower: rms and largest error, in the same pixels.
fn drawn_px(renderer: &mut Renderer, at: Geodetic, wide: Radians, times: f64) -> [f64; 2] {
    let lens = Radians(wide.0 / times);
    let corner = corner(at, lens);
    renderer.note_built(&[0]);
    let mut errors = Vec::new();
    for frame in (0..FRAMES).step_by(DRAWN_EVERY) {
        let camera = camera(eye(at, frame), corner.apex, (lens, 0.1), frame);
        let pixels = pixels(renderer, camera, &corner.patches);
        errors.push(read_off(&pixels, &camera, &corner));
    }
    let largest = errors.iter().map(|e| e.abs().max_element()).fold(0.0, f64::max);
    [rms(&errors), largest].map(|px| px * HEIGHT_PX / f64::from(SIDE_PX) / times)
}

fn settings(vertices: VertexPrecision) -> RendererSettings {
    RendererSettings { vertices, ..stage::settings([SIDE_PX; 2], 1) }
}

fn place((_, lat_deg, lon_deg): (&str, f64, f64)) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, 0.0)
}

#[test]
fn a_point_at_1_m_is_drawn_within_a_hundredth_of_a_pixel_anywhere_in_both_precisions() {
    let wide = Radians::from_degrees(60.0);
    for vertices in [VertexPrecision::TwoFloat, VertexPrecision::EyeF64] {
        let Some(mut renderer) = stage::renderer(&settings(vertices)) else { return };
        for name in PLACES {
            // Anywhere in the picture; and read from the device near its middle.
            let computed = computed_rms_px(place(name), vertices, (wide, 0.9));
            let [drawn, largest] = drawn_px(&mut renderer, place(name), wide, 1000.0);
            println!(
                "{vertices:?}, {}: computed {computed:.1e}, drawn {drawn:.1e}, at most \
                 {largest:.1e} px",
                name.0
            );
            assert!(computed <= 0.01 && drawn <= 0.01 && largest <= 0.01, "{name:?}");
        }
    }
}

#[test]
fn at_a_hundredth_of_a_degree_eye_f64_is_within_a_hundredth_of_a_pixel_and_two_float_is_not() {
    let Some(mut renderer) = stage::renderer(&settings(VertexPrecision::EyeF64)) else { return };
    let narrow = Radians::from_degrees(0.01);
    for name in PLACES {
        let [eye_f64, two_float] = [VertexPrecision::EyeF64, VertexPrecision::TwoFloat]
            .map(|vertices| computed_rms_px(place(name), vertices, (narrow, 0.9)));
        let [drawn, largest] = drawn_px(&mut renderer, place(name), narrow, 125.0);
        println!(
            "{}: EyeF64 computed {eye_f64:.1e}, drawn {drawn:.1e}, at most {largest:.1e} px; \
             TwoFloat computed {two_float:.2} px",
            name.0
        );
        // The magnified picture has a pixel for 0.0225 of these, and is read to half of that.
        assert!(eye_f64 <= 0.01 && drawn <= 0.01 && largest <= 0.0125, "{name:?}");
        // What the setting is for, and that the measurement sees it.
        assert!((0.01..2.0).contains(&two_float), "{name:?}");
    }
}

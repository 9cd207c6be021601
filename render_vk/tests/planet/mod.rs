//! A small planet to draw: 8 · 4ⁿ leaf patches on the WGS 84 ellipsoid, with hills.
//!
//! In:    depth of the leaves, height of the hills.
//! Out:   a patch arena, cameras, draws.
//! Keeps: nothing.
//! Not here: level of detail (`overfly_core`).

use glam::{DMat3, DQuat, DVec3, IVec3};
use overfly_core::camera::{Camera, View};
use overfly_core::frame::data::{RangeDraws, ViewDraws};
use overfly_core::geodesy::{Ecef, Ellipsoid, narrow};
use overfly_core::lattice::{RADIUS, middle, normal_of};
use overfly_core::mesh::patches::Leaf;
use overfly_core::mesh::{PatchVertex, Patches, topology};
use overfly_core::units::Radians;

/// Patches of 16 triangles.
pub const PATCH_DEPTH: u8 = 4;

/// A triangle of lattice points: apex, hypotenuse start and end, counter-clockwise from outside.
type Triangle = [IVec3; 3];

/// The octahedron's faces, each bisected `2 * n` times.
fn leaves(n: u32) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for (sx, sy) in [(1, 1), (-1, 1), (-1, -1), (1, -1)] {
        let (x, y) = (IVec3::X * (sx * RADIUS), IVec3::Y * (sy * RADIUS));
        let (start, end) = if sx * sy > 0 { (x, y) } else { (y, x) };
        triangles.push([IVec3::Z * RADIUS, start, end]);
        triangles.push([IVec3::Z * -RADIUS, end, start]);
    }
    for _ in 0..2 * n {
        triangles = triangles
            .into_iter()
            .flat_map(|[apex, start, end]| {
                let centre = middle(start, end);
                [[centre, apex, start], [centre, end, apex]]
            })
            .collect();
    }
    triangles
}

fn oct(n: DVec3) -> [i16; 2] {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if n.z >= 0.0 {
        (n.x, n.y)
    } else {
        ((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    };
    #[expect(clippy::cast_possible_truncation, reason = "within ±32767")]
    [x, y].map(|c| (c * 32767.0).round() as i16)
}

/// Smooth hills, as a function of the direction alone.
fn height_m(n: DVec3, hills_m: f64) -> f64 {
    let wave = |v: DVec3, f: f64| triangle_wave(v.x * f) * triangle_wave(v.y * f + 0.3 * v.z * f);
    let turned = DVec3::new(n.y + 0.31 * n.z, n.z - 0.17 * n.x, n.x + 0.23 * n.y);
    hills_m * (wave(n, 3.0) + 0.5 * wave(turned, 9.0) + 0.2 * wave(n + turned, 41.0))
}

/// A polynomial sine: period 2, within ±1, smooth enough for hills.
fn triangle_wave(x: f64) -> f64 {
    let t = x - 2.0 * (x / 2.0).floor() - 1.0;
    4.0 * t * (1.0 - t.abs())
}

fn point(n: DVec3, hills_m: f64) -> DVec3 {
    Ellipsoid::WGS84.surface_from_normal(n) + n * height_m(n, hills_m)
}

fn vertex(at: IVec3, hills_m: f64) -> PatchVertex {
    let n = normal_of(at);
    let aside = n.any_orthonormal_vector();
    let along = n.cross(aside);
    let step = 1e-4;
    let near = |v: DVec3| point((n + v * step).normalize(), hills_m);
    let slope = (near(aside) - near(-aside)).cross(near(along) - near(-along)).normalize();
    let height = height_m(n, hills_m);
    let byte = |x: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let byte = (x.clamp(0.0, 1.0) * 255.0) as u8;
        byte
    };
    let celsius = 30.0 - 45.0 * n.z * n.z - 0.0065 * height.max(0.0);
    let wet = 0.5 + 0.5 * triangle_wave(n.x * 5.0 + n.z * 3.0);
    let rocky = if hills_m > 0.0 { height / hills_m / 1.6 } else { 0.2 };
    PatchVertex {
        position: Ecef(point(n, hills_m)).two_float(),
        normal_oct: oct(slope),
        layers: [byte(0.5), byte(rocky), byte(wet), byte((celsius + 40.0) / 80.0)],
        height_m: narrow(height),
    }
}

/// The planet as 8 · 4ⁿ patches; slots in order.
pub fn patches(n: u32, hills_m: f64) -> Patches {
    let triangles = leaves(n);
    let capacity = u32::try_from(triangles.len()).unwrap();
    let mut patches = Patches::new(PATCH_DEPTH, capacity);
    let segments = topology::segments(PATCH_DEPTH) as i32;
    for (diamond, [apex, start, end]) in (0..).zip(triangles) {
        let slot = patches.take(Leaf { diamond, side: 0 }) as usize;
        let mut vertices = Vec::new();
        for row in 0..=segments {
            for column in 0..=row {
                let along = (start - apex) / segments * (row - column);
                let across = (end - apex) / segments * column;
                vertices.push(vertex(apex + along + across, hills_m));
            }
        }
        let per_patch = patches.vertices_per_patch as usize;
        patches.vertices[slot * per_patch..][..per_patch].copy_from_slice(&vertices);
    }
    patches
}

/// A view from `eye` to `target`: the sky is up, or north where the view is straight down.
pub fn camera(eye: DVec3, target: DVec3, size_px: [u32; 2], fov_deg: f64) -> Camera {
    let back = (eye - target).normalize();
    let down = back.dot(eye.normalize()) > 0.9;
    let right = if down { DVec3::Z } else { eye }.cross(back).normalize();
    let view = View {
        eye: Ecef(eye),
        orientation: DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)),
        field_of_view: Radians::from_degrees(fov_deg),
        size_px,
        near_m: 1.0,
    };
    Camera::new(&view, &Ellipsoid::WGS84)
}

/// All patches in every range between the rising borders; the last is infinite.
pub fn draws(camera: Camera, patches: &Patches, borders_m: &[f64]) -> ViewDraws {
    let all: Vec<u32> = (0..patches.used_end()).collect();
    let far = borders_m[1..].iter().map(|f| f * 1.001).chain([f64::INFINITY]);
    let range = |(&near_m, far_m)| RangeDraws { near_m, far_m, patches: all.clone() };
    ViewDraws { camera, ranges: borders_m.iter().zip(far).map(range).collect() }
}

//! What is on the screen, measured: radial pixel errors, pixels lost to f32, distributions.
//!
//! In:    a settled world over a sphere; its first view.
//! Out:   errors in pixels.
//! Keeps: the drawn triangles.
//! Not here: ellipsoids, occlusion by relief, whole flights (`overfly_replay`).

use crate::world::{World, unit};
use glam::{DVec2, DVec3, IVec3};
use overfly_core::camera::Camera;
use overfly_core::geodesy::{EyeRel, TwoFloat, narrow};
use overfly_core::lattice::normal_of;
use overfly_core::lod::audit::lattice_points;
use overfly_core::mesh::topology::indices;

/// A triangle of the octahedron and the places of its corners on the body.
struct Triangle {
    corners: [DVec3; 3],
    places: [DVec3; 3],
}

/// A leaf, its patch slot and its small triangles.
struct Leaf {
    slot: u32,
    whole: Triangle,
    small: Vec<Triangle>,
}

/// The drawn surface as seen from the body's centre.
pub struct Gauge {
    leaves: Vec<Leaf>,
}

/// Body-fixed place of a two-float triple.
pub fn place_of(position: TwoFloat) -> DVec3 {
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    wide(position.hi) + wide(position.lo)
}

/// Where a point lies before a camera: right, up, depth in metres.
fn before(camera: &Camera, away: DVec3) -> DVec3 {
    DVec3::new(camera.right.dot(away), camera.up.dot(away), camera.forward.dot(away))
}

/// The pixel of a point before a camera, from the picture's middle.
fn pixel_of(camera: &Camera, at: DVec3) -> Option<DVec2> {
    (at.z > camera.near_m).then(|| DVec2::new(at.x, at.y) / at.z * camera.pixels_per_radian)
}

/// Whether a pixel lies in the picture.
fn is_inside(camera: &Camera, pixel: DVec2) -> bool {
    let [width, height] = camera.size_px.map(f64::from);
    pixel.x.abs() <= width / 2.0 && pixel.y.abs() <= height / 2.0
}

impl Triangle {
    fn of(corners: [IVec3; 3], places: [DVec3; 3]) -> Self {
        Self { corners: corners.map(|c| c.as_dvec3()), places }
    }

    /// Whether a place of the octahedron lies in it, a hair beyond its border included.
    fn holds(&self, place: DVec3) -> bool {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let share = |from: DVec3, to: DVec3| (to - from).cross(place - from).dot(normal);
        let least = -1e-9 * normal.length_squared();
        let of = |place: DVec3| normal.dot(place - a).abs();
        of(place) <= 1e-9 * normal.length() * place.length()
            && share(a, b) >= least
            && share(b, c) >= least
            && share(c, a) >= least
    }

    /// Distance from the centre to the triangle in a direction.
    fn radius_m(&self, normal: DVec3) -> f64 {
        let [a, b, c] = self.places;
        let across = (b - a).cross(c - a);
        across.dot(a) / across.dot(normal)
    }
}

impl Gauge {
    pub fn of(world: &World) -> Self {
        let (lod, patches) = (world.terrain.lod(), world.terrain.patches());
        let pattern = indices(patches.patch_depth);
        let diamonds = &lod.mesh.diamonds;
        let mut leaves = Vec::new();
        for (id, side) in diamonds.ids().flat_map(|id| [(id, 0), (id, 1)]) {
            let Some(slot) = lod.cover.patches[id][side] else { continue };
            let corners = diamonds.shape(id).triangle(side);
            let points = lattice_points(corners, patches.patch_depth);
            let vertices = patches.vertices_of(slot);
            let small = pattern.chunks_exact(3).map(|t| {
                let at = [0, 1, 2].map(|i| t[i] as usize);
                Triangle::of(at.map(|i| points[i]), at.map(|i| place_of(vertices[i].position)))
            });
            let whole = Triangle::of(corners, corners.map(|c| c.as_dvec3()));
            leaves.push(Leaf { slot, whole, small: small.collect() });
        }
        Self { leaves }
    }

    /// Distance from the centre to the drawn surface in a direction, and the patch there.
    pub fn meet(&self, normal: DVec3) -> (f64, u32) {
        let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
        let place = normal * (f64::from(overfly_core::lattice::RADIUS) / sum);
        let around = self.leaves.iter().filter(|leaf| leaf.whole.holds(place));
        let mut small = around.flat_map(|leaf| leaf.small.iter().map(|small| (small, leaf.slot)));
        let (small, slot) = small.find(|(s, _)| s.holds(place)).expect("the surface is closed");
        (small.radius_m(normal), slot)
    }

    /// Distance from the centre to the drawn surface in a direction.
    pub fn radius_m(&self, normal: DVec3) -> f64 {
        self.meet(normal).0
    }

    /// Radial errors in pixels of `side`² rays through the picture that meet the sphere of
    /// `mean_m` above the body; rays that miss it are left out.
    pub fn errors_px(&self, world: &World, mean_m: f64, side: u32) -> Vec<f64> {
        let camera = &world.output.views[0].camera;
        let eye = camera.eye.0;
        let radius_m = world.body().a_m + mean_m;
        let mut errors_px = Vec::new();
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let jitter = |salt: u64| unit(u64::from(x) << 32 | u64::from(y) << 2 | salt);
            let at =
                |cell: u32, salt| (f64::from(cell) + jitter(salt)) / f64::from(side) * 2.0 - 1.0;
            let [right, up] = camera.half_tangents;
            let ray =
                camera.forward + camera.right * (at(x, 0) * right) + camera.up * (at(y, 1) * up);
            let Some(hit) = meet(eye, ray.normalize(), radius_m) else { continue };
            let normal = hit.normalize();
            let truth = pixel_of(camera, before(camera, world.surface(normal) - eye));
            let drawn = normal * self.radius_m(normal);
            let drawn = pixel_of(camera, before(camera, drawn - eye));
            let (Some(truth), Some(drawn)) = (truth, drawn) else { continue };
            if is_inside(camera, truth) {
                errors_px.push((truth - drawn).length());
            }
        }
        errors_px.sort_by(f64::total_cmp);
        errors_px
    }
}

/// Where a ray first meets a sphere around the centre, its digits kept close to the ground.
fn meet(eye: DVec3, ray: DVec3, radius_m: f64) -> Option<DVec3> {
    let (along, far_m) = (ray.dot(eye), eye.length());
    let power = (far_m - radius_m) * (far_m + radius_m);
    let root = along * along - power;
    (root >= 0.0 && along < 0.0).then(|| eye + ray * (power / (root.sqrt() - along)))
}

/// By how much more of `a` than of `b`, each sorted, is greater than some error: Kolmogorov's and
/// Smirnov's one-sided D, 0 where nothing of `a` is worse.
pub fn worse_by(a: &[f64], b: &[f64]) -> f64 {
    let share =
        |all: &[f64], most: f64| all.partition_point(|&one| one <= most) as f64 / all.len() as f64;
    let gap = |&at: &f64| share(b, at) - share(a, at);
    a.iter().chain(b).map(gap).fold(0.0, f64::max)
}

/// Farthest that f32 puts a vertex in the picture off its place in f64, in pixels: as two-float
/// pairs, and subtracted and rotated in f64. And how many vertices there were.
pub fn lost_px(world: &World) -> ([f64; 2], u32) {
    let camera = world.output.views[0].camera;
    let (lod, patches) = (world.terrain.lod(), world.terrain.patches());
    let pair = camera.eye.two_float();
    let (mut worst, mut seen) = ([0.0_f64; 2], 0);
    let diamonds = &lod.mesh.diamonds;
    for (id, side) in diamonds.ids().flat_map(|id| [(id, 0), (id, 1)]) {
        let Some(slot) = lod.cover.patches[id][side] else { continue };
        let corners = diamonds.shape(id).triangle(side);
        let points = lattice_points(corners, patches.patch_depth);
        for (point, vertex) in points.into_iter().zip(patches.vertices_of(slot)) {
            let normal = normal_of(point);
            let height_m = f64::from(narrow(world.height_m(normal)));
            let place = world.body().surface_from_normal(normal) + normal * height_m;
            let away = before(&camera, place - camera.eye.0);
            let Some(truth) = pixel_of(&camera, away).filter(|&px| is_inside(&camera, px)) else {
                continue;
            };
            let EyeRel(paired) = vertex.position.relative_to(&pair);
            let paired = before(&camera, paired.as_dvec3());
            let turned = before(&camera, place_of(vertex.position) - camera.eye.0);
            let turned = DVec3::from_array(turned.to_array().map(|c| f64::from(narrow(c))));
            seen += 1;
            for (worst, at) in worst.iter_mut().zip([paired, turned]) {
                let off_px =
                    pixel_of(&camera, at).map_or(f64::INFINITY, |px| (px - truth).length());
                *worst = worst.max(off_px);
            }
        }
    }
    (worst, seen)
}

/// Levels of the leaves, shallowest and deepest.
pub fn levels(world: &World) -> [u8; 2] {
    let lod = world.terrain.lod();
    let diamonds = &lod.mesh.diamonds;
    let leaves = diamonds.ids().filter(|&id| !diamonds[id].is_split());
    leaves
        .map(|id| diamonds[id].level())
        .fold([u8::MAX, 0], |[least, most], level| [least.min(level), most.max(level)])
}

//! Vertices before the eye, in f64: subtracted and rotated on the host in every frame.
//!
//! In:    two-float vertices, the camera, which slots are drawn.
//! Out:   one f32 triple a vertex in picture axes: right, up, forward.
//! Keeps: one bit a slot.
//! Not here: the other way, in the shader (`shaders/place_two_float.wgsl`).
//!
//! A triple is a function of the vertex and the camera alone, so patches that share a vertex get
//! the same bits. Error: half an f32 ulp of the difference's components, so at any field of view
//! some 1e-4 pixels.

use overfly_core::camera::Camera;
use overfly_core::geodesy::narrow;
use overfly_core::mesh::{PatchMorph, PatchVertex, Patches};
use overfly_jobs::Team;

/// Slots in one chunk: some 10 µs of work at 15 vertices a patch.
const GRAIN_SLOTS: usize = 256;
/// Vertices worked on together: enough to fill vector registers.
const LANES: usize = 8;

/// Which slots are drawn by any range.
#[derive(Default)]
pub(crate) struct Drawn(Vec<u64>);

impl Drawn {
    /// Notes the slots of some lists, all below `slots`.
    pub(crate) fn note<'a>(&mut self, slots: u32, lists: impl Iterator<Item = &'a [u32]>) {
        self.0.clear();
        self.0.resize(slots.div_ceil(64) as usize, 0);
        for &slot in lists.flatten() {
            self.0[slot as usize / 64] |= 1 << (slot % 64);
        }
    }

    fn has(&self, slot: usize) -> bool {
        self.0[slot / 64] >> (slot % 64) & 1 == 1
    }
}

/// The eye and its axes in f64, as columns.
struct Rows {
    eye: [f64; 3],
    axes: [[f64; 3]; 3],
}

/// What moves the vertices of this frame.
#[derive(Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) now_ms: u32,
    pub(crate) morph_ms: u32,
}

/// Places the drawn slots' vertices; others are left as they are.
pub(crate) fn place(
    (patches, drawn): (&Patches, &Drawn),
    camera: &Camera,
    moment: Moment,
    out: &mut [[f32; 3]],
    team: &Team<'_>,
) {
    let rows = Rows {
        eye: camera.eye.0.to_array(),
        axes: [camera.right, camera.up, camera.forward].map(|axis| axis.to_array()),
    };
    let per_patch = patches.vertices_per_patch as usize;
    let used = &mut out[..patches.used_end() as usize * per_patch];
    team.for_each_chunk(used, GRAIN_SLOTS * per_patch, |first, out| {
        for (slot, out) in (first / per_patch..).zip(out.chunks_exact_mut(per_patch)) {
            if drawn.has(slot) {
                let vertices = &patches.vertices[slot * per_patch..][..per_patch];
                let morphs = patches.morphs.get(slot * per_patch..).unwrap_or_default();
                place_patch(&rows, moment, (vertices, morphs), out);
            }
        }
    });
}

fn place_patch(
    rows: &Rows,
    moment: Moment,
    (vertices, morphs): (&[PatchVertex], &[PatchMorph]),
    out: &mut [[f32; 3]],
) {
    for (at, (vertices, out)) in vertices.chunks(LANES).zip(out.chunks_mut(LANES)).enumerate() {
        let mut offsets = [[0.0_f64; LANES]; 3];
        for (lane, vertex) in vertices.iter().enumerate() {
            for (axis, offsets) in offsets.iter_mut().enumerate() {
                let (hi, lo) = (vertex.position.hi[axis], vertex.position.lo[axis]);
                offsets[lane] = (f64::from(hi) - rows.eye[axis]) + f64::from(lo);
            }
        }
        let morphs = morphs.get(at * LANES..).unwrap_or_default();
        for (lane, morph) in morphs.iter().enumerate().take(vertices.len()) {
            let left = f64::from(morph.left(moment.now_ms, moment.morph_ms));
            for (offsets, from_m) in offsets.iter_mut().zip(morph.from_m) {
                offsets[lane] += left * f64::from(from_m);
            }
        }
        let [x, y, z] = &offsets;
        let turned = rows.axes.map(|[ax, ay, az]| {
            let mut turned = [0.0_f64; LANES];
            for (lane, turned) in turned.iter_mut().enumerate() {
                *turned = x[lane] * ax + y[lane] * ay + z[lane] * az;
            }
            turned
        });
        for (lane, out) in out.iter_mut().enumerate() {
            *out = [0, 1, 2].map(|axis: usize| narrow(turned[axis][lane]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use overfly_core::camera::View;
    use overfly_core::geodesy::{Ecef, Ellipsoid};
    use overfly_core::mesh::patches::Leaf;
    use overfly_core::units::Radians;

    #[test]
    fn drawn_patches_are_placed_to_half_a_unit_in_the_last_place() {
        let mut patches = Patches::new(4, 3);
        let per_patch = patches.vertices_per_patch as usize;
        for diamond in 0..3 {
            patches.take(Leaf { diamond, side: 0 });
        }
        let point = |i: usize| {
            let i = narrow(i as f64);
            let i = f64::from(i);
            DVec3::new(6.378e6 + 0.37 * i, 13.1 * i, -7.7 * i * i)
        };
        for (i, vertex) in patches.vertices.iter_mut().enumerate() {
            vertex.position = Ecef(point(i)).two_float();
        }
        let view = View {
            eye: Ecef(DVec3::new(6.378_1e6, 5.0, 3.0)),
            orientation: glam::DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9),
            field_of_view: Radians(1.0),
            size_px: [64, 64],
            near_m: 1.0,
        };
        let camera = Camera::new(&view, &Ellipsoid::WGS84);
        let mut drawn = Drawn::default();
        drawn.note(3, [&[0, 2][..]].into_iter());
        let mut out = vec![[9.0_f32; 3]; 3 * per_patch];
        let moment = Moment { now_ms: 0, morph_ms: 0 };
        place((&patches, &drawn), &camera, moment, &mut out, &Team::alone());
        for (i, place) in out.iter().enumerate() {
            if i / per_patch == 1 {
                assert_eq!(*place, [9.0; 3]);
                continue;
            }
            let d = point(i) - camera.eye.0;
            let exact = [camera.right, camera.up, camera.forward].map(|axis| axis.dot(d));
            for (found, exact) in place.iter().zip(exact) {
                // Half a unit in the last place, and the two-float's own 2^-49 of the radius.
                let allowed = exact.abs() * f64::from(f32::EPSILON) / 2.0 + 2e-8;
                assert!((f64::from(*found) - exact).abs() <= allowed, "{found} {exact}");
            }
        }
    }
}

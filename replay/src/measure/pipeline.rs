//! The arithmetic between a vertex and its pixel, as it is done in f32: M32 and J1.
//!
//! In:    uploaded vertices, the camera.
//! Out:   pixels as f32 has them; how far they are from those of f64, and how that varies.
//! Keeps: nothing.
//! Not here: the shaders themselves (`overfly_render_vk`), errors of the LOD (`frame`).
//!
//! The same operations in the same order as `shaders/place_two_float.wgsl` and `clip.wgsl`, or
//! for f64 vertices as `eye.rs`; then the division and the viewport, one rounding each. Devices
//! may divide worse than that, and all then round to their own grid of 1/256 pixel.

use super::frame::Measure;
use super::screen::Screen;
use super::spread::{Spread, Where};
use super::thorough::{Shot, spread_at, spread_of};
use glam::{DVec2, DVec3};
use overfly_core::camera::Camera;
use overfly_core::frame::{FrameOutput, Terrain};
use overfly_core::geodesy::{Ecef, TwoFloat, narrow};
use overfly_core::inspect::DrawnMesh;
use overfly_core::mesh::morph::duration_ms;
use overfly_core::mesh::{PatchMorph, PatchVertex};
use overfly_core::settings::{SceneSettings, VertexPrecision};

/// What a renderer knows of one view.
#[derive(Clone, Copy, Debug)]
pub struct Pipeline {
    precision: VertexPrecision,
    eye: TwoFloat,
    axes: [[f32; 3]; 3],
    inverse_tangents: [f32; 2],
    half_px: [f32; 2],
    eye_exact: DVec3,
    axes_exact: [DVec3; 3],
    now_ms: u32,
    morph_ms: u32,
}

impl Pipeline {
    /// For the view of a camera at a time on the frames' clock.
    pub fn new(scene: &SceneSettings, camera: &Camera, now_ms: u32) -> Self {
        let axes_exact = [camera.right, camera.up, camera.forward];
        Self {
            precision: scene.vertices,
            eye: camera.eye.two_float(),
            axes: axes_exact.map(|axis| axis.to_array().map(narrow)),
            inverse_tangents: camera.half_tangents.map(|tangent| narrow(1.0 / tangent)),
            half_px: camera.size_px.map(|px| narrow(f64::from(px)) * 0.5),
            eye_exact: camera.eye.0,
            axes_exact,
            now_ms,
            morph_ms: duration_ms(scene.lod.morph_s),
        }
    }

    /// The same view from another place.
    pub fn moved(&self, eye: DVec3) -> Self {
        Self { eye: Ecef(eye).two_float(), eye_exact: eye, ..*self }
    }

    /// The eye as f32 alone would have it: what must never be drawn with.
    pub fn coarse(&self) -> Self {
        let eye = TwoFloat { lo: [0.0; 3], ..self.eye };
        let eye_exact = DVec3::from_array(eye.hi.map(f64::from));
        Self { eye, eye_exact, ..*self }
    }

    /// What is left of a vertex's way.
    fn left(&self, morph: Option<&PatchMorph>) -> f32 {
        morph.map_or(0.0, |morph| morph.left(self.now_ms, self.morph_ms))
    }

    /// A vertex before the eye: right, up, forward.
    pub fn view(&self, vertex: &PatchVertex, morph: Option<&PatchMorph>) -> [f32; 3] {
        let (left, from_m) = (self.left(morph), morph.map_or([0.0; 3], |morph| morph.from_m));
        match self.precision {
            VertexPrecision::TwoFloat => {
                let away = vertex.position.relative_to(&self.eye).0.to_array();
                let away = [0, 1, 2].map(|axis: usize| away[axis] + left * from_m[axis]);
                self.axes.map(|[x, y, z]| x * away[0] + y * away[1] + z * away[2])
            }
            VertexPrecision::EyeF64 => {
                let way = DVec3::from_array(from_m.map(f64::from)) * f64::from(left);
                let away = wide(&vertex.position) - self.eye_exact + way;
                self.axes_exact.map(|axis| narrow(away.dot(axis)))
            }
        }
    }

    /// Pixel of a vertex before the eye; it must lie before it.
    pub fn pixel(&self, [x, y, z]: [f32; 3]) -> DVec2 {
        let [per_x, per_y] = self.inverse_tangents;
        let clip = [x * per_x, -(y * per_y)];
        let [px, py] = [0, 1].map(|i: usize| clip[i] / z * self.half_px[i] + self.half_px[i]);
        DVec2::new(f64::from(px), f64::from(py))
    }

    /// Where the uploaded bytes have a vertex, body-fixed metres.
    pub fn stored(&self, vertex: &PatchVertex, morph: Option<&PatchMorph>) -> DVec3 {
        let from_m = morph.map_or([0.0; 3], |morph| morph.from_m);
        wide(&vertex.position)
            + DVec3::from_array(from_m.map(f64::from)) * f64::from(self.left(morph))
    }
}

/// A two-float as f64: exact but for half an f64 ulp.
fn wide(position: &TwoFloat) -> DVec3 {
    DVec3::from_array(position.hi.map(f64::from)) + DVec3::from_array(position.lo.map(f64::from))
}

/// A vertex of the picture, as it is stored and as it is in f64.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// As it is uploaded.
    pub vertex: PatchVertex,
    /// Where it comes from, in scenes that morph.
    pub morph: Option<PatchMorph>,
    /// Where it is drawn, body-fixed metres.
    pub exact: DVec3,
}

/// The vertices of the draws of the first view that lie in its picture.
pub fn in_picture(
    (terrain, output): (&Terrain, &FrameOutput),
    mesh: &DrawnMesh,
    screen: &Screen,
) -> Vec<Drawn> {
    let patches = terrain.patches();
    let mut is_drawn = vec![false; patches.used_end() as usize];
    let ranges = &output.views[0].ranges;
    ranges.iter().flat_map(|range| &range.patches).for_each(|&s| is_drawn[s as usize] = true);
    let is_drawn = |at: &usize| is_drawn.get(mesh.leaves[*at].slot as usize) == Some(&true);
    let drawn = (0..mesh.leaves.len()).filter(is_drawn);
    let vertices = drawn.flat_map(|at| {
        let slot = mesh.leaves[at].slot;
        let (vertices, morphs) = (patches.vertices_of(slot), patches.morphs_of(slot));
        let exact = mesh.places_of(at).iter().zip(vertices).enumerate();
        exact.map(|(i, (&exact, &vertex))| Drawn { vertex, morph: morphs.get(i).copied(), exact })
    });
    let seen =
        |drawn: &Drawn| screen.view(drawn.exact).z >= screen.near_m && screen.shows(drawn.exact);
    vertices.filter(seen).collect()
}

/// The vertices of a frame that is measured.
pub(super) fn drawn(measure: &Measure, shot: &Shot<'_>) -> Vec<Drawn> {
    in_picture((shot.terrain, shot.output), &measure.now.drawn, &shot.screen)
}

/// M32 − M64 in pixels: of the uploaded bytes alone, and of all f32 arithmetic up to the pixel.
pub(super) fn arithmetic(measure: &Measure, shot: &Shot<'_>, all: &[Drawn]) -> [Spread; 2] {
    let camera = &shot.output.views[0].camera;
    let pipeline = Pipeline::new(shot.terrain.settings(), camera, shot.output.time_ms);
    let bytes = |drawn: &Drawn, exact: DVec2| {
        let stored = shot.screen.pixel(pipeline.stored(&drawn.vertex, drawn.morph.as_ref()))?;
        Some((stored - exact).length())
    };
    let whole = |drawn: &Drawn, exact: DVec2| {
        let view = pipeline.view(&drawn.vertex, drawn.morph.as_ref());
        Some((pipeline.pixel(view) - exact).length())
    };
    let stray = |of: &dyn Fn(&Drawn, DVec2) -> Option<f64>| {
        let (mut values, mut seen) = (Vec::with_capacity(all.len()), Vec::new());
        for drawn in all {
            let exact = shot.screen.pixel(drawn.exact);
            let Some(value) = exact.and_then(|exact| of(drawn, exact)) else { continue };
            values.push(value);
            seen.push(drawn.exact);
        }
        spread_at(&values, |at| {
            let pixel = shot.screen.pixel(seen[at]).unwrap_or_default();
            measure.place_of(seen[at].normalize(), pixel, shot.frame)
        })
    };
    [stray(&bytes), stray(&whole)]
}

/// Vertices whose jitter is looked at.
const TREMBLING: usize = 256;
/// Frames of the slow flight.
const STEPS: u32 = 64;
/// How far a vertex moves on the screen from one of them to the next.
const STEP_PX: f64 = 0.05;

/// J1: how the error of f32 varies while the eye moves slowly, and its greatest step.
pub(super) fn jitter(measure: &Measure, shot: &Shot<'_>, all: &[Drawn]) -> (Spread, f64) {
    let camera = &shot.output.views[0].camera;
    let pipeline = Pipeline::new(shot.terrain.settings(), camera, shot.output.time_ms);
    let mut found = Vec::new();
    let mut step_px = 0.0_f64;
    for drawn in all.iter().step_by(all.len().div_ceil(TREMBLING).max(1)) {
        let trembles = tremble(drawn, &|eye| pipeline.moved(eye), &shot.screen);
        let pixel = shot.screen.pixel(drawn.exact).unwrap_or_default();
        let place: Where = measure.place_of(drawn.exact.normalize(), pixel, shot.frame);
        found.push((trembles.rms_px, place));
        step_px = step_px.max(trembles.step_px);
    }
    (spread_of(&found), step_px)
}

/// How one vertex trembles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Tremble {
    /// Standard deviation of its error, pixels.
    pub rms_px: f64,
    /// Greatest change of its error from one frame to the next, pixels.
    pub step_px: f64,
}

/// Flies slowly past a vertex and holds the pixels of f32 against those of f64.
pub fn tremble(drawn: &Drawn, from: &dyn Fn(DVec3) -> Pipeline, screen: &Screen) -> Tremble {
    let depth_m = screen.view(drawn.exact).z;
    // Aslant, so that no axis stands still.
    let direction = (screen.axes[0] + screen.axes[1] * 0.5).normalize();
    let step_m = direction * (STEP_PX * depth_m / screen.scale_px);
    let errors = (0..STEPS).map(|step| {
        let eye = screen.eye + step_m * f64::from(step);
        let exact = Screen { eye, ..*screen }.pixel(drawn.exact).unwrap_or_default();
        let pipeline = from(eye);
        pipeline.pixel(pipeline.view(&drawn.vertex, drawn.morph.as_ref())) - exact
    });
    let track: Vec<DVec2> = errors.collect();
    let mean = track.iter().copied().sum::<DVec2>() / f64::from(STEPS);
    let squares: f64 = track.iter().map(|error| (*error - mean).length_squared()).sum();
    let steps = track.windows(2).map(|pair| (pair[1] - pair[0]).length());
    Tremble { rms_px: (squares / f64::from(STEPS)).sqrt(), step_px: steps.fold(0.0, f64::max) }
}

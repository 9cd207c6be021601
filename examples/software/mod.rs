//! A renderer without a graphics card: a frame's columns to a picture.
//!
//! In:    a scene, the output of its last frame.
//! Out:   a [`Canvas`] of one of its views.
//! Keeps: [`Painter`]: the vertices of all slots, as a graphics card would; the index pattern.
//! Not here: pixels (`raster`).

pub mod raster;

use overfly::core::camera::View;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{TwoFloat, narrow};
use overfly::core::mesh::shade::{Facing, evenly_lit, sunlit};
use overfly::core::projection::EyeConstants;
use overfly::{ColumnsFault, DrawColumns, FrameError, Overfly, VertexColumns};
use raster::{Canvas, Corner};

/// Most frames until the terrain has come up.
const FRAMES_MAX: usize = 4000;

/// A vertex as this renderer keeps it. It draws no morphs: its scenes have none.
#[derive(Clone, Copy)]
struct Vertex {
    at: TwoFloat,
    normal: [f32; 3],
    albedo: [f32; 3],
    height_m: f32,
}

const NOTHING: Vertex = Vertex {
    at: TwoFloat { hi: [0.0; 3], lo: [0.0; 3] },
    normal: [0.0; 3],
    albedo: [0.0; 3],
    height_m: 0.0,
};

/// What a renderer keeps from frame to frame.
pub struct Painter {
    vertices: Vec<Vertex>,
    per_patch: usize,
    indices: Vec<u32>,
    built: VertexColumns,
    draws: DrawColumns,
}

impl Painter {
    /// Room for all that a scene can show.
    pub fn new(overfly: &Overfly) -> Self {
        let per_patch = overfly.vertices_per_patch() as usize;
        let slots = overfly.terrain().limits().leaves as usize;
        Self {
            vertices: vec![NOTHING; slots * per_patch],
            per_patch,
            indices: overfly.indices(),
            built: VertexColumns::default(),
            draws: DrawColumns::default(),
        }
    }

    /// Takes over what is new in a frame: to be called after each, drawn or not.
    pub fn upload(&mut self, overfly: &Overfly, output: &FrameOutput) -> Result<(), ColumnsFault> {
        let Self { vertices, per_patch, built: new, .. } = self;
        overfly.vertices(&output.built, new)?;
        for (i, &slot) in new.slot.iter().enumerate() {
            let (from, to) = (i * *per_patch, slot as usize * *per_patch);
            for at in 0..*per_patch {
                let (hi, lo) = (new.hi[from + at], new.lo[from + at]);
                vertices[to + at] = Vertex {
                    at: TwoFloat { hi, lo },
                    normal: new.normal[from + at],
                    albedo: new.albedo[from + at],
                    height_m: new.height_m[from + at],
                };
            }
        }
        Ok(())
    }

    /// Draws a view of the last frame.
    pub fn draw(
        &mut self,
        overfly: &Overfly,
        output: &FrameOutput,
        view: usize,
    ) -> Result<Canvas, ColumnsFault> {
        overfly.columns(output, view, &mut self.draws)?;
        let camera = &output.views[view].camera;
        let scene = overfly.scene();
        let sun = scene.sun.map(|sun| sun.direction_at(0.0).to_array().map(narrow));
        let sight = Sight { eye: EyeConstants::of(camera), sun, sea: scene.sea };
        let near_m = narrow(camera.near_m);
        let mut canvas = Canvas::new(camera.size_px);
        // A patch on the border of two ranges is in both, and one depth buffer needs it once.
        self.draws.slot.sort_unstable();
        self.draws.slot.dedup();
        for &slot in &self.draws.slot {
            let patch = &self.vertices[slot as usize * self.per_patch..][..self.per_patch];
            let corners: Vec<Corner> = patch.iter().map(|vertex| sight.corner(vertex)).collect();
            for three in self.indices.chunks_exact(3) {
                let three = [three[0], three[1], three[2]].map(|i| corners[i as usize]);
                canvas.triangle(near_m, three);
            }
        }
        Ok(canvas)
    }

    /// Runs frames of one moment until the terrain has come up for its views.
    pub fn settle(
        &mut self,
        overfly: &mut Overfly,
        views: &[View],
        output: &mut FrameOutput,
    ) -> Result<(), FrameError> {
        let mut input = FrameInput::default();
        for _ in 0..FRAMES_MAX {
            input.views.clear();
            input.views.extend_from_slice(views);
            overfly.frame(&mut input, output)?;
            self.upload(overfly, output).expect("slots of this very frame");
            let counts = &output.counts;
            if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0 {
                break;
            }
        }
        Ok(())
    }
}

/// What the look of a vertex depends on besides itself.
struct Sight {
    eye: EyeConstants,
    sun: Option<[f32; 3]>,
    sea: bool,
}

impl Sight {
    fn corner(&self, vertex: &Vertex) -> Corner {
        let [right, up, forward] = self.eye.pictured(&vertex.at);
        let [across, upward] = self.eye.inverse_tangents;
        Corner { x: right * across, y: -(up * upward), w: forward, light: self.light(vertex) }
    }

    fn light(&self, vertex: &Vertex) -> [f32; 3] {
        let Some(sun) = self.sun else {
            return evenly_lit(vertex.albedo, dot(vertex.normal, self.eye.eye_up));
        };
        let away_m = dot(vertex.at.hi, vertex.at.hi).sqrt();
        let facing = Facing {
            normal_sun: dot(vertex.normal, sun),
            normal_up: dot(vertex.normal, vertex.at.hi) / away_m,
            sun_up: dot(sun, vertex.at.hi) / away_m,
        };
        sunlit(vertex.albedo, facing, vertex.height_m, self.sea)
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

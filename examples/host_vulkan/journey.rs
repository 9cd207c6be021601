//! A terrain that comes up around an eye, and the pictures of it.
//!
//! In:    a preset; where the eye is and where it looks.
//! Out:   pictures for a renderer, which is told of every frame.
//! Keeps: overfly, its loader, the last frame.
//! Not here: Vulkan.

use super::Outcome;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::loader::Loader;
use overfly::render_vk::{HostRenderer, RendererSettings};
use overfly::{Overfly, config};

/// Frames in which any terrain has come up.
const FRAMES_MAX: usize = 4000;
/// Time from frame to frame.
const STEP_S: f64 = 0.1;

/// Degrees, metres above the ground.
#[derive(Clone, Copy)]
pub struct Eye {
    pub lat_deg: f64,
    pub lon_deg: f64,
    pub above_m: f64,
    pub heading_deg: f64,
    pub pitch_deg: f64,
}

/// A terrain and where it is looked at from.
pub struct Journey {
    pub overfly: Overfly,
    pub output: FrameOutput,
    pub size_px: [u32; 2],
    scene: SceneSettings,
    input: FrameInput,
    loader: Loader,
}

impl Journey {
    /// A scene that has not come up yet.
    pub fn new(scene: SceneSettings, size_px: [u32; 2]) -> Outcome<Self> {
        let overfly = Overfly::new(&scene, 1)?;
        let loader = overfly.loader(2)?;
        let (input, output) = (FrameInput::default(), FrameOutput::default());
        Ok(Self { overfly, output, size_px, scene, input, loader })
    }

    /// The Earth's preset with few enough triangles for a software device.
    pub fn earth(size_px: [u32; 2]) -> Outcome<Self> {
        let mut scene = config::load("earth").map_err(|faults| format!("{faults:?}"))?;
        scene.lod.triangles_max = 60_000;
        Self::new(scene, size_px)
    }

    /// What a renderer of this scene is made for.
    pub fn settings(&self) -> RendererSettings {
        RendererSettings::of(&self.scene, self.overfly.terrain().limits(), self.size_px)
    }

    /// Runs one frame with the pages that the last one wanted.
    pub fn frame(&mut self, eye: Eye, renderers: &mut [&mut HostRenderer]) -> Outcome<()> {
        let ground = Geodetic::from_degrees(eye.lat_deg, eye.lon_deg, 0.0);
        let height_m = self.overfly.ground_height_m(ground)? + eye.above_m;
        let at = Geodetic::from_degrees(eye.lat_deg, eye.lon_deg, height_m);
        let [heading, pitch] = [eye.heading_deg, eye.pitch_deg].map(Radians::from_degrees);
        let lens = &self.scene.views[0];
        self.loader.fetch(&self.output.wanted, &mut self.input.arrived);
        self.input.time_s += STEP_S;
        self.input.views.clear();
        self.input.views.push(View {
            eye: self.scene.body.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(at, heading, pitch, Radians(0.0)),
            field_of_view: lens.field_of_view,
            size_px: self.size_px,
            near_m: lens.near_m,
        });
        self.overfly.frame(&mut self.input, &mut self.output)?;
        for renderer in renderers {
            renderer.note_built(&self.output.built);
            renderer.note_tiles(&self.output.tiles);
        }
        Ok(())
    }

    /// Stays until the terrain has come up.
    pub fn settle(&mut self, eye: Eye, renderers: &mut [&mut HostRenderer]) -> Outcome<()> {
        for _ in 0..FRAMES_MAX {
            self.frame(eye, renderers)?;
            let counts = &self.output.counts;
            if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0 {
                return Ok(());
            }
        }
        Err(format!("the terrain has not come up in {FRAMES_MAX} frames").into())
    }
}

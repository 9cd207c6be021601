//! The terrain backend of a flight simulator: a whole planet, a known error, a frame rate that
//! holds.
//!
//! In:    a scene, a pose each frame, pages from a loader.
//! Out:   draws, finished pictures, counts and a digest of each frame.
//! Keeps: [`Overfly`]: terrain, workers, graph, renderer.
//! Not here: the stages (`overfly_core`), Vulkan (`overfly_render_vk`), files (`overfly_replay`).
#![forbid(unsafe_code)]

pub use overfly_config as config;
pub use overfly_core as core;
pub use overfly_jobs as jobs;
pub use overfly_render_vk as render_vk;
pub use overfly_replay as replay;

pub mod loader;

/// The README's program is compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

use crate::core::camera::ViewFault;
use crate::core::datasource::generate::Generator;
use crate::core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use crate::core::geodesy::Geodetic;
use crate::core::scene::{FrameParts, extract, world_of};
use crate::core::settings::SceneSettings;
use crate::jobs::{Graph, Span, Spans, StagePanic, StartError, Team, Workers};
use crate::render_vk::{DrawError, DrawReport, Renderer};
use crate::replay::Flight;
use loader::Loader;
use parking_lot::Mutex;
use std::fmt;
use std::sync::Arc;

/// Name of the stage that records and submits the pictures.
pub const RECORD: Span = Span("render_vk.record");

/// What the stages of one graph share.
struct House {
    terrain: Terrain,
    drawing: Mutex<Drawing>,
}

#[derive(Default)]
struct Drawing {
    renderer: Option<Renderer>,
    parts: FrameParts,
    /// View to draw in this frame, if any.
    view: Option<usize>,
    report: Option<Result<DrawReport, DrawError>>,
}

/// A scene with everything that it needs to run.
pub struct Overfly {
    house: House,
    graph: Graph<House>,
    workers: Workers,
    generator: Arc<Generator>,
    world: hecs::World,
}

/// Why a frame failed.
#[derive(Debug)]
pub enum FrameError {
    /// A view cannot be used; the state is as it was.
    View(ViewFault),
    /// A stage panicked: a bug of ours.
    Stage(StagePanic),
    /// Vulkan failed; the terrain is not touched by that.
    Draw(DrawError),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View(fault) => fault.fmt(f),
            Self::Stage(panic) => panic.fmt(f),
            Self::Draw(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FrameError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::View(fault) => Some(fault),
            Self::Stage(panic) => Some(panic),
            Self::Draw(error) => Some(error),
        }
    }
}

impl Overfly {
    /// A scene with `workers` threads beside the caller; 0 is fine.
    ///
    /// # Errors
    /// If the system refuses a thread, or `workers` is above 64.
    pub fn new(settings: &SceneSettings, workers: usize) -> Result<Self, StartError> {
        let generator = Arc::new(Generator::new(settings));
        let terrain = Terrain::new(settings, &generator);
        let mut graph = Graph::new();
        let placed = add_stages(&mut graph, |house: &House| &house.terrain);
        graph.stage(RECORD, &[placed], |house: &House, team| {
            let mut drawing = house.drawing.lock();
            let output = house.terrain.output().lock();
            let Drawing { renderer, parts, view, report } = &mut *drawing;
            let Some(renderer) = renderer else { return };
            renderer.note_built(&output.built);
            if let Some(view) = view.and_then(|index| output.views.get(index)) {
                *report = Some(renderer.draw(view, &house.terrain.patches(), parts, team));
            }
        });
        Ok(Self {
            house: House { terrain, drawing: Mutex::default() },
            graph,
            workers: Workers::new(workers)?,
            generator,
            world: world_of(settings),
        })
    }

    /// The renderer that shall draw from now on; its settings must be made for this scene.
    pub fn set_renderer(&mut self, renderer: Renderer) {
        self.house.drawing.lock().renderer = Some(renderer);
    }

    /// Runs one frame. Pages are taken out of `input.arrived`.
    ///
    /// # Errors
    /// A view that cannot be used, or a bug.
    pub fn frame(
        &mut self,
        input: &mut FrameInput,
        output: &mut FrameOutput,
    ) -> Result<(), FrameError> {
        self.run(input, output, None).map(|_| ())
    }

    /// Runs one frame and draws one of its views, if there is a renderer.
    ///
    /// # Errors
    /// As [`Self::frame`]; or Vulkan failed.
    pub fn frame_drawn(
        &mut self,
        input: &mut FrameInput,
        output: &mut FrameOutput,
        view: usize,
    ) -> Result<Option<DrawReport>, FrameError> {
        self.run(input, output, Some(view))
    }

    fn run(
        &mut self,
        input: &mut FrameInput,
        output: &mut FrameOutput,
        view: Option<usize>,
    ) -> Result<Option<DrawReport>, FrameError> {
        self.house.terrain.begin(input).map_err(FrameError::View)?;
        let drawing = self.house.drawing.get_mut();
        (drawing.view, drawing.parts) = (view, extract(&self.world));
        let ran = self.graph.run(&self.house, &self.workers);
        self.house.terrain.finish(output);
        ran.map_err(FrameError::Stage)?;
        self.house.drawing.get_mut().report.take().transpose().map_err(FrameError::Draw)
    }

    /// Draws another view of the last frame, on the caller alone; `None` without a renderer or
    /// such a view.
    ///
    /// # Errors
    /// Vulkan failed.
    pub fn draw(
        &mut self,
        output: &FrameOutput,
        view: usize,
    ) -> Result<Option<DrawReport>, DrawError> {
        let Drawing { renderer, parts, .. } = self.house.drawing.get_mut();
        let (Some(renderer), Some(view)) = (renderer, output.views.get(view)) else {
            return Ok(None);
        };
        renderer.draw(view, &self.house.terrain.patches(), parts, &Team::alone()).map(Some)
    }

    /// Lends the renderer, to read pictures and messages.
    pub fn with_renderer<R>(&mut self, read: impl FnOnce(&mut Renderer) -> R) -> Option<R> {
        self.house.drawing.get_mut().renderer.as_mut().map(read)
    }

    /// The terrain: settings, limits, audits.
    pub fn terrain(&self) -> &Terrain {
        &self.house.terrain
    }

    /// The optional parts of the scene; change them between frames.
    pub fn world_mut(&mut self) -> &mut hecs::World {
        &mut self.world
    }

    /// Times of the last frame's stages.
    pub fn spans(&self) -> &Spans {
        self.graph.spans()
    }

    /// A loader with `threads` threads for this scene's pages.
    ///
    /// # Errors
    /// If the system refuses a thread.
    pub fn loader(&self, threads: usize) -> std::io::Result<Loader> {
        Loader::new(self.generator.clone(), threads)
    }

    /// Exact height of the ground above the ellipsoid at a place, in metres: a pure function of
    /// the scene and the place, whatever is loaded.
    pub fn ground_height_m(&self, at: Geodetic) -> f64 {
        self.generator.planet().map_or(0.0, |planet| planet.sample(at.normal()).height_m)
    }

    /// A bundled flight over this scene's body and ground: `rainier`, `descent` or `poles`.
    pub fn flight(&self, name: &str) -> Option<Flight> {
        let body = &self.house.terrain.settings().body;
        crate::replay::flight(name, body, &|at| self.ground_height_m(at))
    }
}

//! A scene that is drawn: its renderer, and the stage that records pictures.
//!
//! In:    a renderer, looks; views of frames.
//! Out:   pictures, or what they are made from for a renderer of the host.
//! Keeps: [`Drawing`].
//! Not here: Vulkan (`overfly_render_vk`); `undrawn` stands in for this without the feature `vulkan`.

use crate::core::frame::data::ViewDraws;
use crate::core::frame::{FrameInput, FrameOutput, Terrain};
use crate::core::inspect::PatchInfo;
use crate::core::scene::{FrameParts, extract};
use crate::error::FrameError;
use crate::jobs::{Span, StageId, Team};
use crate::render_vk::{Backdrop, DrawReport, Overlay, Picture, Renderer, Show};
use crate::{House, Overfly};

pub use crate::render_vk::DrawError;

/// Name of the stage that records and submits the pictures.
pub const RECORD: Span = Span("render_vk.record");

/// What pictures show from now on, besides the scene.
#[derive(Default)]
pub struct Looks {
    /// What the ground is coloured by.
    pub show: Show,
    /// Drawn over everything.
    pub overlay: Overlay,
    /// What is behind the ground.
    pub backdrop: Backdrop,
}

/// The renderer of a scene, if it was given one, and what its pictures are made from.
pub(crate) struct Drawing {
    renderer: Option<Renderer>,
    /// The stage that pictures are recorded after.
    placed: StageId,
    /// Of the last frame.
    time_s: f64,
    parts: FrameParts,
    looks: Looks,
    infos: Vec<PatchInfo>,
    /// View to draw in this frame, if any.
    view: Option<usize>,
    report: Option<Result<DrawReport, DrawError>>,
}

impl Drawing {
    /// Without a renderer; a frame's draws are there after this stage.
    pub(crate) fn after(placed: StageId) -> Self {
        Self {
            renderer: None,
            placed,
            time_s: 0.0,
            parts: FrameParts::default(),
            looks: Looks::default(),
            infos: Vec::new(),
            view: None,
            report: None,
        }
    }

    /// A frame of this time begins. Only a renderer asks the world what pictures of it show.
    pub(crate) fn note_scene(&mut self, world: &hecs::World, time_s: f64) {
        self.time_s = time_s;
        if self.renderer.is_some() {
            self.parts = extract(world, time_s);
        }
    }

    /// The terrain is another one.
    pub(crate) fn begin_anew(&mut self, terrain: &Terrain) {
        if let Some(renderer) = &mut self.renderer {
            renderer.note_tiles(&terrain.tiles());
        }
    }

    /// Draws a view of a terrain, if there is a renderer.
    fn draw(
        &mut self,
        terrain: &Terrain,
        (view, time_ms): (&ViewDraws, u32),
        team: &Team<'_>,
    ) -> Option<Result<DrawReport, DrawError>> {
        let Self { renderer, parts, looks, infos, .. } = self;
        let renderer = renderer.as_mut()?;
        let draw = |picture: &Picture<'_>| renderer.draw(picture, team);
        Some(lend(terrain, (view, time_ms), (parts, looks, infos), draw))
    }
}

/// The last stage of frames that have a renderer.
fn record_drawing(house: &House, team: &Team<'_>) {
    let mut drawing = house.drawing.lock();
    let mut output = house.terrain.output().lock();
    let Some(renderer) = &mut drawing.renderer else { return };
    renderer.note_built(&output.built);
    renderer.note_tiles(&output.tiles);
    if let Some(view) = drawing.view.and_then(|index| output.views.get(index)) {
        drawing.report = drawing.draw(&house.terrain, (view, output.time_ms), team);
    }
    let totals = drawing.renderer.as_ref().map(Renderer::device_totals);
    output.device = totals.unwrap_or_default();
}

/// Lends what a picture of a view of a terrain is made from.
fn lend<R>(
    terrain: &Terrain,
    (view, time_ms): (&ViewDraws, u32),
    (parts, looks, infos): (&FrameParts, &Looks, &mut Vec<PatchInfo>),
    draw: impl FnOnce(&Picture<'_>) -> R,
) -> R {
    infos.clear();
    if looks.show.needs_infos() {
        terrain.inspect(infos);
    }
    draw(&Picture {
        view,
        patches: &terrain.patches(),
        parts,
        time_ms,
        show: looks.show,
        infos,
        overlay: &looks.overlay,
        backdrop: looks.backdrop,
    })
}

impl Overfly {
    /// The renderer that shall draw from now on; its settings must be made for this scene.
    pub fn set_renderer(&mut self, mut renderer: Renderer) {
        renderer.note_tiles(&self.house.terrain.tiles());
        let drawing = self.house.drawing.get_mut();
        if drawing.renderer.replace(renderer).is_none() {
            self.graph.stage(RECORD, &[drawing.placed], record_drawing);
        }
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
        self.house.drawing.get_mut().view = Some(view);
        let ran = self.frame(input, output);
        let drawing = self.house.drawing.get_mut();
        drawing.view = None;
        let report = drawing.report.take();
        ran?;
        report.transpose().map_err(FrameError::Draw)
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
        let Some(view) = output.views.get(view) else { return Ok(None) };
        let House { terrain, drawing } = &mut self.house;
        let drawing = drawing.get_mut();
        drawing.parts = extract(&self.world, drawing.time_s);
        drawing.draw(terrain, (view, output.time_ms), &Team::alone()).transpose()
    }

    /// Lends what a picture of a view of the last frame is made from, for a renderer that the host
    /// keeps, as `render_vk::HostRenderer`; `None` without such a view. Such a renderer is told of
    /// every frame's `built` and `tiles`, and of `terrain().tiles()` when it is made.
    pub fn with_picture<R>(
        &mut self,
        output: &FrameOutput,
        view: usize,
        draw: impl FnOnce(&Picture<'_>) -> R,
    ) -> Option<R> {
        let view = output.views.get(view)?;
        let House { terrain, drawing } = &mut self.house;
        let Drawing { time_s, looks, infos, .. } = drawing.get_mut();
        let parts = extract(&self.world, *time_s);
        Some(lend(terrain, (view, output.time_ms), (&parts, looks, infos), draw))
    }

    /// What pictures show from now on; change it between frames.
    pub fn looks_mut(&mut self) -> &mut Looks {
        &mut self.house.drawing.get_mut().looks
    }

    /// Lends the renderer, to read pictures and messages.
    pub fn with_renderer<R>(&mut self, read: impl FnOnce(&mut Renderer) -> R) -> Option<R> {
        self.house.drawing.get_mut().renderer.as_mut().map(read)
    }
}

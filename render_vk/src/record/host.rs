//! Draws on a host's device, into the host's command buffers, inside the host's passes.
//!
//! In:    a [`HostDevice`], a [`HostTarget`]; pictures, as for [`crate::Renderer`].
//! Out:   uploads and draws in command buffers that the host submits.
//! Keeps: pipelines, patches and imagery on the device; what is in flight.
//! Not here: targets, clears, passes, layouts, submits, fences: they are the host's.

use super::Ready;
use crate::DrawReport;
use crate::drawing::Drawing;
use crate::error::{DrawError, StartError};
use crate::picture::Picture;
use crate::settings::RendererSettings;
use crate::vk::Device;
use crate::vk::commands::OneOff;
use crate::vk::host::{HostDevice, HostTarget};
use ash::vk;
use overfly_core::frame::data::DeviceTotals;
use overfly_core::mesh::drape::NewTile;
use overfly_jobs::Team;
use std::sync::Arc;

/// Where a host records: one of its command buffers, for one of its frames in flight.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HostFrame {
    /// The command buffer that is being recorded.
    pub buffer: vk::CommandBuffer,
    /// Which frame in flight it is for, below [`RendererSettings::frames_in_flight`]. A frame that
    /// shows several views takes an index for each.
    pub index: u32,
}

/// Records pictures for a host that owns everything around them.
///
/// A frame of the host: [`Self::note_built`] and [`Self::note_tiles`]; once the device has finished
/// what this index drew last, [`Self::record_uploads`] before the pass begins; in the pass, from the
/// farthest range to the nearest, clear the depth and [`Self::record_range`]. After a range its
/// depth is there for the host's own geometry, drawn with [`crate::projection`] of that range.
///
/// Recording binds pipelines, descriptor sets 0 to 2, push constants, vertex and index buffers, and
/// sets viewport and scissor; the host sets its own again. Nothing is submitted after [`Self::new`].
pub struct HostRenderer {
    drawing: Drawing,
}

impl HostRenderer {
    /// Takes memory on the host's device, makes the pipelines, copies what never changes and tests
    /// the driver's arithmetic: submits to the queue and waits. `size_px`, `keep_depth` and
    /// `validation` of the settings mean nothing here: pictures are as large as their views.
    ///
    /// # Safety
    /// - All handles, the pass's too, are null or good, belong together and stay so until the
    ///   renderer is dropped; the Vulkan library stays loaded as long.
    /// - The device was made with `host.features` for `host.api_version`, `host.queue` is of
    ///   `host.queue_family`, and the instance has `VK_EXT_debug_utils` if `host.debug_utils`.
    /// - The pass and its subpass are as `target` says, with one colour attachment and no view mask.
    /// - Nobody else uses the queue during the call.
    /// - When the renderer is dropped, the device has finished whatever it recorded.
    ///
    /// # Errors
    /// [`StartError`]: what was lent cannot be drawn with, a setting is out of range, the driver
    /// reorders float arithmetic, or a call failed. The host's objects are as before.
    pub unsafe fn new(
        settings: &RendererSettings,
        host: &HostDevice,
        target: &HostTarget,
    ) -> Result<Self, StartError> {
        settings.check()?;
        // SAFETY: the caller's first two promises, which outlast the device's owners: they are all
        // in the renderer.
        let device = Arc::new(unsafe { Device::lent(host) }?);
        // SAFETY: the device was just checked.
        let into = unsafe { target.check(host, settings.depth_format) }?;
        let mut one_off = OneOff::new(&device)?;
        Ok(Self { drawing: Drawing::new(&device, settings, into, &mut one_off)? })
    }

    /// What it was made for.
    pub fn settings(&self) -> &RendererSettings {
        &self.drawing.settings
    }

    /// Tells which slots were built in a frame, as [`crate::Renderer::note_built`].
    pub fn note_built(&mut self, slots: &[u32]) {
        self.drawing.arena.mark(slots);
    }

    /// Tells which tiles of imagery are new in their layers, as [`crate::Renderer::note_tiles`].
    pub fn note_tiles(&mut self, tiles: &[NewTile]) {
        self.drawing.note_tiles(tiles);
    }

    /// Tells that a command buffer with uploads was thrown away instead of submitted: every patch
    /// is uploaded again. In a scene with imagery tell of all its tiles again as well.
    pub fn note_lost(&mut self) {
        self.drawing.arena.mark_all();
    }

    /// Makes a picture ready and records the copies of what is new, with the barriers that they
    /// need. Outside a pass, once for each frame and index, before its draws.
    ///
    /// # Safety
    /// - The buffer is a primary or secondary one that is being recorded, outside a pass, by this
    ///   thread only, from a pool of the renderer's queue family.
    /// - The device has finished everything that was recorded with this index before.
    /// - Buffers are submitted in the order in which their uploads were recorded, to one queue.
    ///
    /// # Errors
    /// [`DrawError`]: the picture does not fit the settings, there is no frame of this index, or a
    /// call failed; nothing was recorded. After a failed call every patch is uploaded again.
    pub unsafe fn record_uploads(
        &mut self,
        frame: HostFrame,
        picture: &Picture<'_>,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        let index = self.index_of(frame)?;
        let report = self.drawing.prepare(index, picture, team)?;
        Ready::new(&self.drawing, index).copies(frame.buffer);
        Ok(report)
    }

    /// Records the draws of one depth range; the farthest also draws the sky, unless the picture's
    /// backdrop is a colour, which the host clears to. The picture's top left corner is at `at_px`
    /// of the target.
    ///
    /// # Safety
    /// - The buffer is being recorded by this thread only, inside the subpass that the renderer was
    ///   made for or one of a compatible pass, and is executed after that of [`Self::record_uploads`].
    /// - The picture fits the pass's area: corners are not negative, sizes within the device's
    ///   limits.
    /// - The depth was cleared since another range was drawn: to 0 if it is reversed, else to 1.
    ///
    /// # Errors
    /// [`DrawError`]: there is no such frame or range; nothing was recorded.
    pub unsafe fn record_range(
        &self,
        frame: HostFrame,
        range: usize,
        at_px: [i32; 2],
    ) -> Result<(), DrawError> {
        let ready = self.ready(frame)?;
        let plan = &ready.in_flight.plan;
        if range >= plan.ranges.len() {
            return Err(DrawError::Range { found: range, ranges: plan.ranges.len() });
        }
        ready.place(frame.buffer, at_px);
        for &chunk in plan.chunks.iter().filter(|chunk| chunk.range == range) {
            ready.chunk(frame.buffer, chunk);
        }
        if plan.has_sky && range == plan.farthest() {
            ready.sky(frame.buffer);
        }
        Ok(())
    }

    /// Records the picture's overlay, over whatever was drawn; nothing where it has none.
    ///
    /// # Safety
    /// - As [`Self::record_range`], but for the depth, which is neither read nor written.
    ///
    /// # Errors
    /// [`DrawError`]: there is no such frame; nothing was recorded.
    pub unsafe fn record_overlay(
        &self,
        frame: HostFrame,
        at_px: [i32; 2],
    ) -> Result<(), DrawError> {
        let ready = self.ready(frame)?;
        if ready.in_flight.rings.overlay_corners > 0 {
            ready.place(frame.buffer, at_px);
            ready.overlay(frame.buffer);
        }
        Ok(())
    }

    /// Device memory that is taken now.
    pub fn device_totals(&self) -> DeviceTotals {
        self.drawing.device.memory.totals()
    }

    fn ready(&self, frame: HostFrame) -> Result<Ready<'_>, DrawError> {
        let ready = Ready::new(&self.drawing, self.index_of(frame)?);
        let is_ready = !ready.in_flight.plan.ranges.is_empty();
        is_ready.then_some(ready).ok_or(DrawError::NothingDrawn)
    }

    fn index_of(&self, frame: HostFrame) -> Result<usize, DrawError> {
        let frames = self.drawing.settings.frames_in_flight;
        let known = frame.index < frames;
        known.then_some(frame.index as usize).ok_or(DrawError::Frame { found: frame.index, frames })
    }
}

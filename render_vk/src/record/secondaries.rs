//! The command buffers of our own frames.
//!
//! In:    a picture that was made ready, our targets.
//! Out:   one secondary buffer a chunk, one for the sky, one for the overlay, one primary over all.
//! Keeps: command pools, buffers and a fence of each frame in flight.
//! Not here: what is in them (`record`), who calls when (`Renderer`).
//!
//! Each (range, chunk of patches) is one secondary buffer. Chunks are dealt to a fixed number of
//! lanes, each with its own command pool, so any worker can record any lane, and what is recorded
//! follows from the draws alone.

use super::{Chunk, Ready, count};
use crate::drawing::Drawing;
use crate::error::{DrawError, Fault, failed};
use crate::picture::Backdrop;
use crate::targets::{RangePasses, Targets};
use crate::vk::Device;
use crate::vk::commands::{Fence, Pool, begin, end};
use crate::vk::pipeline::RenderPass;
use ash::vk;
use overfly_core::settings::DepthOrder;
use overfly_jobs::Team;
use std::sync::Arc;

/// Command pools of a frame in flight; no more threads than this can record at once.
const LANES: usize = 16;

/// What all recording of a frame reads.
pub(crate) struct Scene<'a> {
    pub(crate) drawing: &'a Drawing,
    /// Which frame in flight it is.
    pub(crate) index: usize,
    pub(crate) range_passes: &'a RangePasses,
    pub(crate) targets: &'a Targets,
    pub(crate) backdrop: Backdrop,
}

/// A command pool and its secondary buffers.
struct Lane {
    pool: Pool,
    buffers: Vec<vk::CommandBuffer>,
    fault: Option<Fault>,
}

/// The command buffers of one frame in flight, and the fence that tells when it is over.
pub(crate) struct Frame {
    pub(crate) fence: Fence,
    pool: Pool,
    primary: vk::CommandBuffer,
    sky: vk::CommandBuffer,
    overlay: vk::CommandBuffer,
    lanes: Vec<Lane>,
    executed: Vec<vk::CommandBuffer>,
}

impl Frame {
    pub(crate) fn new(device: &Arc<Device>, index: u32) -> Result<Self, Fault> {
        let name = format!("frame {index}");
        let mut pool = Pool::new(device, &name)?;
        let lane = |lane: usize| {
            let pool = Pool::new(device, &format!("{name}, lane {lane}"))?;
            Ok(Lane { pool, buffers: Vec::new(), fault: None })
        };
        Ok(Self {
            fence: Fence::new(device, &name)?,
            primary: pool.buffer(vk::CommandBufferLevel::PRIMARY)?,
            sky: pool.buffer(vk::CommandBufferLevel::SECONDARY)?,
            overlay: pool.buffer(vk::CommandBufferLevel::SECONDARY)?,
            pool,
            lanes: (0..LANES).map(lane).collect::<Result<_, Fault>>()?,
            executed: Vec::new(),
        })
    }

    /// Records the picture, on this and other workers, and submits it. The fence must have been
    /// waited for. Returns how many secondaries there are.
    pub(crate) fn submit(&mut self, scene: &Scene<'_>, team: &Team<'_>) -> Result<u32, DrawError> {
        let secondaries = self.record_secondaries(scene, team)?;
        self.record_primary(scene)?;
        self.fence.submit(self.primary)?;
        Ok(secondaries)
    }

    fn record_secondaries(&mut self, scene: &Scene<'_>, team: &Team<'_>) -> Result<u32, Fault> {
        self.pool.reset()?;
        let ready = scene.ready();
        let (plan, rings) = (&ready.in_flight.plan, &ready.in_flight.rings);
        if plan.has_sky {
            secondary(scene, self.sky, |buffer| ready.sky(buffer))?;
        }
        if rings.overlay_corners > 0 {
            secondary(scene, self.overlay, |buffer| ready.overlay(buffer))?;
        }
        let chunks = &plan.chunks;
        let a_lane = chunks.len().div_ceil(LANES).max(1);
        team.for_each_chunk(&mut self.lanes, 1, |first, lanes| {
            for (lane, index) in lanes.iter_mut().zip(first..) {
                let begin = (index * a_lane).min(chunks.len());
                let end = (begin + a_lane).min(chunks.len());
                lane.fault = lane.record(scene, &chunks[begin..end]).err();
            }
        });
        if let Some(fault) = self.lanes.iter_mut().find_map(|lane| lane.fault.take()) {
            return Err(fault);
        }
        let others = usize::from(plan.has_sky) + usize::from(rings.overlay_corners > 0);
        Ok(count(chunks.len() + others))
    }

    /// Records the primary over the copies and the secondaries.
    fn record_primary(&mut self, scene: &Scene<'_>) -> Result<(), Fault> {
        let (ready, primary) = (scene.ready(), self.primary);
        let (plan, rings) = (&ready.in_flight.plan, &ready.in_flight.rings);
        begin(&scene.drawing.device, primary)?;
        ready.copies(primary);
        let a_lane = plan.chunks.len().div_ceil(LANES).max(1);
        for range in (0..=plan.farthest()).rev() {
            self.executed.clear();
            let numbered = plan.chunks.iter().enumerate();
            let own = numbered.filter(|(_, chunk)| chunk.range == range);
            let buffers = own.map(|(i, _)| self.lanes[i / a_lane].buffers[i % a_lane]);
            self.executed.extend(buffers);
            let first = range == plan.farthest();
            if first && plan.has_sky {
                self.executed.push(self.sky);
            }
            if range == 0 && rings.overlay_corners > 0 {
                self.executed.push(self.overlay);
            }
            let passes = scene.range_passes;
            let pass = if first { &passes.first } else { &passes.next };
            // The first pass clears the picture, and the nearest one leaves the depth.
            let kept = range == 0 && scene.drawing.settings.keep_depth;
            if first || kept || !self.executed.is_empty() {
                range_pass(scene, primary, pass, &self.executed);
            }
        }
        end(&scene.drawing.device, primary)
    }
}

impl Scene<'_> {
    fn ready(&self) -> Ready<'_> {
        Ready::new(self.drawing, self.index)
    }
}

impl Lane {
    fn record(&mut self, scene: &Scene<'_>, chunks: &[Chunk]) -> Result<(), Fault> {
        if chunks.is_empty() {
            return Ok(());
        }
        self.pool.reset()?;
        while self.buffers.len() < chunks.len() {
            self.buffers.push(self.pool.buffer(vk::CommandBufferLevel::SECONDARY)?);
        }
        for (&chunk, &buffer) in chunks.iter().zip(&self.buffers) {
            secondary(scene, buffer, |buffer| scene.ready().chunk(buffer, chunk))?;
        }
        Ok(())
    }
}

/// Begins a secondary buffer inside the pass, lets `draw` fill it, ends it.
fn secondary(
    scene: &Scene<'_>,
    buffer: vk::CommandBuffer,
    draw: impl FnOnce(vk::CommandBuffer),
) -> Result<(), Fault> {
    let inherited = vk::CommandBufferInheritanceInfo::default()
        .render_pass(scene.range_passes.first.handle)
        .framebuffer(scene.targets.framebuffer.handle);
    let flags = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT
        | vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE;
    let info = vk::CommandBufferBeginInfo::default().flags(flags).inheritance_info(&inherited);
    let device = &scene.drawing.device;
    // SAFETY: the buffer's pool was reset and is used by this thread only: a lane's is behind the
    // lane's `&mut`, the frame's behind the frame's.
    unsafe { device.handle.begin_command_buffer(buffer, &info) }
        .map_err(failed("vkBeginCommandBuffer"))?;
    scene.ready().place(buffer, [0, 0]);
    draw(buffer);
    end(device, buffer)
}

fn range_pass(
    scene: &Scene<'_>,
    primary: vk::CommandBuffer,
    pass: &RenderPass,
    secondaries: &[vk::CommandBuffer],
) {
    let [r, g, b] = match scene.backdrop {
        Backdrop::Sky => [0.0; 3],
        Backdrop::Colour(colour) => colour,
    };
    let depth = match scene.drawing.settings.depth_order {
        DepthOrder::Reversed => 0.0,
        DepthOrder::Forward => 1.0,
    };
    // Passes that load colour ignore the first.
    let clear = [
        vk::ClearValue { color: vk::ClearColorValue { float32: [r, g, b, 1.0] } },
        vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } },
    ];
    let info = vk::RenderPassBeginInfo::default()
        .render_pass(pass.handle)
        .framebuffer(scene.targets.framebuffer.handle)
        .render_area(scene.targets.area())
        .clear_values(&clear);
    let contents = vk::SubpassContents::SECONDARY_COMMAND_BUFFERS;
    let device = &scene.drawing.device.handle;
    // SAFETY: the primary is being recorded, outside a pass; pass and framebuffer are compatible
    // and have two attachments; the secondaries are recorded for a compatible pass, not pending,
    // and each is executed once.
    unsafe {
        device.cmd_begin_render_pass(primary, &info, contents);
        if !secondaries.is_empty() {
            device.cmd_execute_commands(primary, secondaries);
        }
        device.cmd_end_render_pass(primary);
    }
}

//! Records the command buffers of a frame.
//!
//! In:    a view's draws cut into chunks, pipelines, targets, staged copies.
//! Out:   one secondary buffer a chunk, one for the sky, one primary over all.
//! Keeps: command pools, buffers, fence and staging of each frame in flight.
//! Not here: who calls when (`Renderer`).
//!
//! Chunks of 256 patches are dealt to a fixed number of lanes, each with its own command pool, so
//! any worker can record any lane, and what is recorded follows from the draws alone.

use crate::error::{DrawError, Fault, failed};
use crate::matrices::ViewTerms;
use crate::passes::{Passes, VIEW_STAGES};
use crate::targets::Targets;
use crate::upload::Arena;
use crate::vk::buffer::bytes_of;
use crate::vk::commands::{Fence, Pool, begin, end};
use crate::vk::pipeline::RenderPass;
use crate::vk::{Buffer, Device, transfer};
use ash::vk;
use overfly_core::frame::data::ViewDraws;
use overfly_jobs::Team;
use std::sync::Arc;

/// Patches in one secondary buffer: some 20 µs of recording.
const CHUNK_PATCHES: usize = 256;
/// Command pools of a frame in flight; no more threads than this can record at once.
const LANES: usize = 32;

/// What all recording of a frame reads.
pub(crate) struct Scene<'a> {
    pub(crate) device: &'a Device,
    pub(crate) targets: &'a Targets,
    pub(crate) passes: &'a Passes,
    pub(crate) arena: &'a Arena,
    pub(crate) view: &'a ViewDraws,
    /// The view's terms; those of the depth range are set by chunk.
    pub(crate) terms: ViewTerms,
}

/// Patches `first .. end` of a range's list.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Chunk {
    range: usize,
    first: usize,
    end: usize,
}

/// A command pool and its secondary buffers.
struct Lane {
    pool: Pool,
    buffers: Vec<vk::CommandBuffer>,
    fault: Option<Fault>,
}

/// Everything that must not be touched while the device works on a frame.
pub(crate) struct Frame {
    pub(crate) fence: Fence,
    pub(crate) staging: Buffer,
    pool: Pool,
    primary: vk::CommandBuffer,
    sky: vk::CommandBuffer,
    lanes: Vec<Lane>,
    chunks: Vec<Chunk>,
    executed: Vec<vk::CommandBuffer>,
}

impl Frame {
    pub(crate) fn new(device: &Arc<Device>, arena: &Arena, index: u32) -> Result<Self, Fault> {
        let mut pool = Pool::new(device, &format!("frame {index}"))?;
        let lane = |lane: usize| {
            let pool = Pool::new(device, &format!("frame {index}, lane {lane}"))?;
            Ok(Lane { pool, buffers: Vec::new(), fault: None })
        };
        Ok(Self {
            fence: Fence::new(device, &format!("frame {index}"))?,
            staging: arena.staging(device, &format!("frame {index}, staging"))?,
            primary: pool.buffer(vk::CommandBufferLevel::PRIMARY)?,
            sky: pool.buffer(vk::CommandBufferLevel::SECONDARY)?,
            pool,
            lanes: (0..LANES).map(lane).collect::<Result<_, Fault>>()?,
            chunks: Vec::new(),
            executed: Vec::new(),
        })
    }

    /// Records the secondaries, on this and other workers. The fence must have been waited for.
    pub(crate) fn record_secondaries(
        &mut self,
        scene: &Scene<'_>,
        team: &Team<'_>,
    ) -> Result<u32, DrawError> {
        cut(scene.view, &mut self.chunks);
        self.pool.reset()?;
        secondary(scene, self.sky, |device, buffer| draw_sky(scene, device, buffer))?;
        let chunks = &self.chunks;
        let a_lane = chunks.len().div_ceil(LANES).max(1);
        team.for_each_chunk(&mut self.lanes, 1, |first, lanes| {
            for (lane, index) in lanes.iter_mut().zip(first..) {
                let begin = (index * a_lane).min(chunks.len());
                let end = (begin + a_lane).min(chunks.len());
                lane.fault = lane.record(scene, &chunks[begin..end]).err();
            }
        });
        if let Some(fault) = self.lanes.iter_mut().find_map(|lane| lane.fault.take()) {
            return Err(fault.into());
        }
        Ok(u32::try_from(chunks.len() + 1).expect("patches are counted in 32 bits"))
    }

    /// Records the primary over the copies and the secondaries.
    pub(crate) fn record_primary(
        &mut self,
        scene: &Scene<'_>,
        staged: &[vk::BufferCopy],
    ) -> Result<vk::CommandBuffer, Fault> {
        let primary = self.primary;
        begin(scene.device, primary)?;
        if !staged.is_empty() {
            transfer::copies(scene.device, primary, (&self.staging, &scene.arena.vertices), staged);
        }
        let a_lane = self.chunks.len().div_ceil(LANES).max(1);
        let farthest = scene.view.ranges.len().saturating_sub(1);
        for range in (0..=farthest).rev() {
            self.executed.clear();
            let numbered = self.chunks.iter().enumerate();
            let own = numbered.filter(|(_, chunk)| chunk.range == range);
            let buffers = own.map(|(i, _)| self.lanes[i / a_lane].buffers[i % a_lane]);
            self.executed.extend(buffers);
            let first = range == farthest;
            if first {
                self.executed.push(self.sky);
            }
            let targets = scene.targets;
            let pass = if first { &targets.first_pass } else { &targets.next_pass };
            if !self.executed.is_empty() {
                range_pass(scene, primary, pass, &self.executed);
            }
        }
        end(scene.device, primary)?;
        Ok(primary)
    }
}

impl Lane {
    fn record(&mut self, scene: &Scene<'_>, chunks: &[Chunk]) -> Result<(), Fault> {
        self.pool.reset()?;
        while self.buffers.len() < chunks.len() {
            self.buffers.push(self.pool.buffer(vk::CommandBufferLevel::SECONDARY)?);
        }
        for (chunk, &buffer) in chunks.iter().zip(&self.buffers) {
            secondary(scene, buffer, |device, buffer| draw_chunk(scene, device, buffer, *chunk))?;
        }
        Ok(())
    }
}

/// Cuts the lists of all ranges into chunks: by their lengths, never by the number of workers.
fn cut(view: &ViewDraws, chunks: &mut Vec<Chunk>) {
    chunks.clear();
    for (range, draws) in view.ranges.iter().enumerate() {
        for first in (0..draws.patches.len()).step_by(CHUNK_PATCHES) {
            let end = (first + CHUNK_PATCHES).min(draws.patches.len());
            chunks.push(Chunk { range, first, end });
        }
    }
}

/// Begins a secondary buffer inside the pass, lets `draw` fill it, ends it.
fn secondary(
    scene: &Scene<'_>,
    buffer: vk::CommandBuffer,
    draw: impl FnOnce(&ash::Device, vk::CommandBuffer),
) -> Result<(), Fault> {
    let inherited = vk::CommandBufferInheritanceInfo::default()
        .render_pass(scene.targets.first_pass.handle)
        .framebuffer(scene.targets.framebuffer.handle);
    let flags = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT
        | vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE;
    let info = vk::CommandBufferBeginInfo::default().flags(flags).inheritance_info(&inherited);
    // SAFETY: the buffer's pool was reset and is used by this thread only: a lane's is behind the
    // lane's `&mut`, the frame's behind the frame's.
    unsafe { scene.device.handle.begin_command_buffer(buffer, &info) }
        .map_err(failed("vkBeginCommandBuffer"))?;
    draw(&scene.device.handle, buffer);
    end(scene.device, buffer)
}

fn draw_sky(scene: &Scene<'_>, device: &ash::Device, buffer: vk::CommandBuffer) {
    let graphics = vk::PipelineBindPoint::GRAPHICS;
    let terms = bytes_of(&scene.terms.0);
    // SAFETY: the buffer is being recorded inside a compatible pass; the pipeline has this layout,
    // whose push range is the terms' size, and needs no vertex buffer.
    unsafe {
        device.cmd_bind_pipeline(buffer, graphics, scene.passes.sky.handle);
        device.cmd_push_constants(buffer, scene.passes.layout.handle, VIEW_STAGES, 0, terms);
        device.cmd_draw(buffer, 3, 1, 0, 0);
    }
}

fn draw_chunk(scene: &Scene<'_>, device: &ash::Device, buffer: vk::CommandBuffer, chunk: Chunk) {
    let (arena, passes) = (scene.arena, scene.passes);
    let range = &scene.view.ranges[chunk.range];
    let terms = scene.terms.in_range(range.near_m, range.far_m);
    let graphics = vk::PipelineBindPoint::GRAPHICS;
    // SAFETY: the buffer is being recorded inside a compatible pass; the pipeline has this layout,
    // whose push range is the terms' size; both buffers live as long as the renderer.
    unsafe {
        device.cmd_bind_pipeline(buffer, graphics, passes.terrain.handle);
        device.cmd_bind_vertex_buffers(buffer, 0, &[arena.vertices.handle], &[0]);
        device.cmd_bind_index_buffer(buffer, arena.indices.handle, 0, vk::IndexType::UINT16);
        let bytes = bytes_of(&terms.0);
        device.cmd_push_constants(buffer, passes.layout.handle, VIEW_STAGES, 0, bytes);
    }
    for &slot in &range.patches[chunk.first..chunk.end] {
        let first = i32::try_from(slot * arena.vertices_per_patch)
            .expect("the settings' check bounds the arena's vertices");
        // SAFETY: the renderer checked that the slot is below `patches_max`, so its vertices are
        // inside the vertex buffer; the indices are those of one patch.
        unsafe { device.cmd_draw_indexed(buffer, arena.indices_per_patch, 1, 0, first, 0) };
    }
}

fn range_pass(
    scene: &Scene<'_>,
    primary: vk::CommandBuffer,
    pass: &RenderPass,
    secondaries: &[vk::CommandBuffer],
) {
    // Colour is cleared to black and depth to far; passes that load colour ignore the first.
    let clear = [
        vk::ClearValue { color: vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] } },
        vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } },
    ];
    let info = vk::RenderPassBeginInfo::default()
        .render_pass(pass.handle)
        .framebuffer(scene.targets.framebuffer.handle)
        .render_area(scene.targets.area())
        .clear_values(&clear);
    let contents = vk::SubpassContents::SECONDARY_COMMAND_BUFFERS;
    let device = &scene.device.handle;
    // SAFETY: the primary is being recorded, outside a pass; pass and framebuffer are compatible
    // and have two attachments; the secondaries are recorded for a compatible pass, not pending,
    // and each is executed once.
    unsafe {
        device.cmd_begin_render_pass(primary, &info, contents);
        device.cmd_execute_commands(primary, secondaries);
        device.cmd_end_render_pass(primary);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::{Camera, View};
    use overfly_core::frame::data::RangeDraws;
    use overfly_core::geodesy::{Ecef, Ellipsoid};
    use overfly_core::units::Radians;

    #[test]
    fn chunks_follow_from_the_lists_alone() {
        let view = View {
            eye: Ecef(glam::DVec3::X * 7e6),
            orientation: glam::DQuat::IDENTITY,
            field_of_view: Radians(1.0),
            size_px: [64, 64],
            near_m: 1.0,
        };
        let range = |patches: u32| RangeDraws {
            near_m: 1.0,
            far_m: f64::INFINITY,
            patches: (0..patches).collect(),
        };
        let camera = Camera::new(&view, &Ellipsoid::WGS84);
        let draws = ViewDraws { camera, ranges: vec![range(0), range(256), range(300)] };
        let mut chunks = Vec::new();
        cut(&draws, &mut chunks);
        let list: Vec<_> = chunks.iter().map(|c| (c.range, c.first, c.end)).collect();
        assert_eq!(list, [(1, 0, 256), (2, 0, 256), (2, 256, 300)]);
    }
}

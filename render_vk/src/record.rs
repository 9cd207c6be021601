//! Records the command buffers of a frame.
//!
//! In:    a picture's draws cut into chunks, pipelines, targets, staged copies.
//! Out:   one secondary buffer a chunk, one for the sky, one for the overlay, one primary over all.
//! Keeps: command pools, buffers, fence, staging and rings of each frame in flight.
//! Not here: who calls when (`Renderer`).
//!
//! Each (range, chunk of patches) is one secondary buffer with one multi-draw-indirect, whose rows
//! the workers write together; nearly always a range is one chunk. Chunks are dealt to a fixed
//! number of lanes, each with its own command pool, so any worker can record any lane, and what is
//! recorded follows from the draws alone.

use crate::error::{DrawError, Fault, failed};
use crate::imagery::{Imagery, TileStaging};
use crate::matrices::RangeTerms;
use crate::passes::terrain::{MORPHS, PLACES, VERTICES};
use crate::passes::{Passes, VIEW_STAGES};
use crate::picture::{Backdrop, Picture, Show};
use crate::rings::Rings;
use crate::settings::RendererSettings;
use crate::targets::{RangePasses, Targets};
use crate::upload::{Arena, Copies};
use crate::vk::buffer::bytes_of;
use crate::vk::commands::{Fence, Pool, begin, end};
use crate::vk::pipeline::RenderPass;
use crate::vk::{Buffer, Device};
use ash::vk;
use overfly_core::settings::DepthOrder;
use overfly_jobs::Team;
use std::sync::Arc;

/// Patches in one secondary buffer: fewer than every device draws with one indirect call.
const CHUNK_PATCHES: usize = 16_384;
/// Command pools of a frame in flight; no more threads than this can record at once.
const LANES: usize = 16;

/// What all recording of a frame reads.
pub(crate) struct Scene<'a> {
    pub(crate) device: &'a Device,
    pub(crate) settings: &'a RendererSettings,
    pub(crate) range_passes: &'a RangePasses,
    pub(crate) targets: &'a Targets,
    pub(crate) passes: &'a Passes,
    pub(crate) arena: &'a Arena,
    pub(crate) imagery: Option<&'a Imagery>,
    pub(crate) picture: &'a Picture<'a>,
    /// Slots to draw in each range.
    pub(crate) lists: &'a [&'a [u32]],
}

/// Some rows of a range's draws.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Chunk {
    range: usize,
    first_row: usize,
    rows: usize,
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
    pub(crate) rings: Rings,
    pub(crate) tiles: Option<TileStaging>,
    pool: Pool,
    primary: vk::CommandBuffer,
    sky: vk::CommandBuffer,
    overlay: vk::CommandBuffer,
    lanes: Vec<Lane>,
    chunks: Vec<Chunk>,
    executed: Vec<vk::CommandBuffer>,
}

impl Frame {
    pub(crate) fn new(
        device: &Arc<Device>,
        arena: &Arena,
        (passes, settings): (&Passes, &RendererSettings),
        index: u32,
    ) -> Result<Self, Fault> {
        let name = format!("frame {index}");
        let mut pool = Pool::new(device, &name)?;
        let lane = |lane: usize| {
            let pool = Pool::new(device, &format!("{name}, lane {lane}"))?;
            Ok(Lane { pool, buffers: Vec::new(), fault: None })
        };
        Ok(Self {
            fence: Fence::new(device, &name)?,
            staging: arena.staging(device, &format!("{name}, staging"))?,
            rings: Rings::new(device, passes, settings, &name)?,
            tiles: settings.imagery.then(|| TileStaging::new(device, &name)).transpose()?,
            primary: pool.buffer(vk::CommandBufferLevel::PRIMARY)?,
            sky: pool.buffer(vk::CommandBufferLevel::SECONDARY)?,
            overlay: pool.buffer(vk::CommandBufferLevel::SECONDARY)?,
            pool,
            lanes: (0..LANES).map(lane).collect::<Result<_, Fault>>()?,
            chunks: Vec::new(),
            executed: Vec::new(),
        })
    }

    /// Writes the draws and records the secondaries, on this and other workers. The fence must
    /// have been waited for. Returns how many secondaries and how many indirect commands there are.
    pub(crate) fn record_secondaries(
        &mut self,
        scene: &Scene<'_>,
        team: &Team<'_>,
    ) -> Result<(u32, u32), DrawError> {
        cut(scene.lists, &mut self.chunks);
        let mut first = 0;
        for slots in scene.lists {
            self.rings.write_draws((first, slots), scene.arena, team);
            first += slots.len();
        }
        self.pool.reset()?;
        let rings = &self.rings;
        if scene.picture.backdrop == Backdrop::Sky {
            secondary(scene, self.sky, |buffer| draw_sky(scene, rings, buffer))?;
        }
        if rings.overlay_corners > 0 {
            secondary(scene, self.overlay, |buffer| draw_overlay(scene, rings, buffer))?;
        }
        let chunks = &self.chunks;
        let a_lane = chunks.len().div_ceil(LANES).max(1);
        team.for_each_chunk(&mut self.lanes, 1, |first, lanes| {
            for (lane, index) in lanes.iter_mut().zip(first..) {
                let begin = (index * a_lane).min(chunks.len());
                let end = (begin + a_lane).min(chunks.len());
                lane.fault = lane.record(scene, rings, &chunks[begin..end]).err();
            }
        });
        if let Some(fault) = self.lanes.iter_mut().find_map(|lane| lane.fault.take()) {
            return Err(fault.into());
        }
        let others = usize::from(scene.picture.backdrop == Backdrop::Sky)
            + usize::from(rings.overlay_corners > 0);
        let count = |n: usize| u32::try_from(n).expect("patches are counted in 32 bits");
        Ok((count(chunks.len() + others), count(chunks.len())))
    }

    /// Records the primary over the copies and the secondaries.
    pub(crate) fn record_primary(
        &mut self,
        scene: &Scene<'_>,
        copies: &Copies,
    ) -> Result<vk::CommandBuffer, Fault> {
        let primary = self.primary;
        begin(scene.device, primary)?;
        copies.record(scene.device, primary, (&self.staging, scene.arena));
        if let (Some(imagery), Some(tiles)) = (scene.imagery, &self.tiles) {
            imagery.record(scene.device, primary, tiles);
        }
        let a_lane = self.chunks.len().div_ceil(LANES).max(1);
        let farthest = scene.lists.len().saturating_sub(1);
        for range in (0..=farthest).rev() {
            self.executed.clear();
            let numbered = self.chunks.iter().enumerate();
            let own = numbered.filter(|(_, chunk)| chunk.range == range);
            let buffers = own.map(|(i, _)| self.lanes[i / a_lane].buffers[i % a_lane]);
            self.executed.extend(buffers);
            let first = range == farthest;
            if first && scene.picture.backdrop == Backdrop::Sky {
                self.executed.push(self.sky);
            }
            if range == 0 && self.rings.overlay_corners > 0 {
                self.executed.push(self.overlay);
            }
            let passes = scene.range_passes;
            let pass = if first { &passes.first } else { &passes.next };
            // The first pass clears the picture, and the nearest one leaves the depth.
            let kept = range == 0 && scene.settings.keep_depth;
            if first || kept || !self.executed.is_empty() {
                range_pass(scene, primary, pass, &self.executed);
            }
        }
        end(scene.device, primary)?;
        Ok(primary)
    }
}

impl Lane {
    fn record(&mut self, scene: &Scene<'_>, rings: &Rings, chunks: &[Chunk]) -> Result<(), Fault> {
        if chunks.is_empty() {
            return Ok(());
        }
        self.pool.reset()?;
        while self.buffers.len() < chunks.len() {
            self.buffers.push(self.pool.buffer(vk::CommandBufferLevel::SECONDARY)?);
        }
        for (&chunk, &buffer) in chunks.iter().zip(&self.buffers) {
            secondary(scene, buffer, |buffer| draw_chunk(scene, rings, buffer, chunk))?;
        }
        Ok(())
    }
}

/// Cuts the lists of all ranges into chunks: by their lengths, never by the number of workers.
fn cut(lists: &[&[u32]], chunks: &mut Vec<Chunk>) {
    chunks.clear();
    let mut start = 0;
    for (range, slots) in lists.iter().enumerate() {
        for first in (0..slots.len()).step_by(CHUNK_PATCHES) {
            let rows = CHUNK_PATCHES.min(slots.len() - first);
            chunks.push(Chunk { range, first_row: start + first, rows });
        }
        start += slots.len();
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
    let area = scene.targets.area();
    let [width, height] =
        scene.targets.size_px.map(|n| overfly_core::geodesy::narrow(f64::from(n)));
    let viewport = vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
    let device = &scene.device.handle;
    // SAFETY: the buffer's pool was reset and is used by this thread only: a lane's is behind the
    // lane's `&mut`, the frame's behind the frame's.
    unsafe {
        device.begin_command_buffer(buffer, &info).map_err(failed("vkBeginCommandBuffer"))?;
        device.cmd_set_viewport(buffer, 0, &[viewport]);
        device.cmd_set_scissor(buffer, 0, &[area]);
    }
    draw(buffer);
    end(scene.device, buffer)
}

/// Binds a pipeline with the view, and the terms of a range.
fn bind(
    scene: &Scene<'_>,
    rings: &Rings,
    (buffer, range): (vk::CommandBuffer, usize),
    pipeline: vk::Pipeline,
) {
    let graphics = vk::PipelineBindPoint::GRAPHICS;
    let (device, layout) = (&scene.device.handle, scene.passes.layout.handle);
    let order = scene.settings.depth_order;
    let [near_m, far_m] = scene
        .picture
        .view
        .ranges
        .get(range)
        .map_or([1.0, f64::INFINITY], |range| [range.near_m, range.far_m]);
    let terms = RangeTerms::new(order, [near_m, far_m], range);
    let view = [rings.view_set.handle];
    // SAFETY: the buffer is being recorded inside a compatible pass; the pipeline has this layout,
    // whose push range is the terms' size and whose set 0 is the view's; set 1 is bound for the
    // pipelines that read it.
    unsafe {
        device.cmd_bind_pipeline(buffer, graphics, pipeline);
        device.cmd_bind_descriptor_sets(buffer, graphics, layout, 0, &view, &[]);
        if let Some(infos) = rings.infos_set() {
            device.cmd_bind_descriptor_sets(buffer, graphics, layout, 1, &[infos.handle], &[]);
        }
        if let Some(imagery) = scene.imagery {
            device.cmd_bind_descriptor_sets(
                buffer,
                graphics,
                layout,
                2,
                &[imagery.set.handle],
                &[],
            );
        }
        device.cmd_push_constants(buffer, layout, VIEW_STAGES, 0, bytes_of(&[terms]));
    }
}

fn draw_sky(scene: &Scene<'_>, rings: &Rings, buffer: vk::CommandBuffer) {
    let farthest = scene.lists.len().saturating_sub(1);
    bind(scene, rings, (buffer, farthest), scene.passes.sky.handle);
    // SAFETY: the pipeline bound above needs no vertex buffer.
    unsafe { scene.device.handle.cmd_draw(buffer, 3, 1, 0, 0) };
}

fn draw_overlay(scene: &Scene<'_>, rings: &Rings, buffer: vk::CommandBuffer) {
    let pipeline = scene.passes.overlay.as_ref().expect("made before it is recorded");
    let corners = rings.overlay.as_ref().expect("made with its corners").handle;
    bind(scene, rings, (buffer, 0), pipeline.handle);
    // SAFETY: the buffer holds as many corners as were written.
    unsafe {
        scene.device.handle.cmd_bind_vertex_buffers(buffer, 0, &[corners], &[0]);
        scene.device.handle.cmd_draw(buffer, rings.overlay_corners, 1, 0, 0);
    }
}

fn draw_chunk(scene: &Scene<'_>, rings: &Rings, buffer: vk::CommandBuffer, chunk: Chunk) {
    let (arena, passes) = (scene.arena, scene.passes);
    let pipeline = if scene.picture.show == Show::Shaded {
        &passes.terrain
    } else {
        passes.debug.as_ref().expect("made before it is recorded")
    };
    bind(scene, rings, (buffer, chunk.range), pipeline.handle);
    let row = size_of::<vk::DrawIndexedIndirectCommand>();
    let stride = u32::try_from(row).expect("a row is 20 bytes");
    let rows = u32::try_from(chunk.rows).expect("at most CHUNK_PATCHES");
    let device = &scene.device.handle;
    let vertices = [(VERTICES, Some(&arena.vertices)), (MORPHS, arena.morphs.as_ref())];
    let places = [(PLACES, rings.places.as_ref())];
    // SAFETY: the vertex buffers that the pipeline reads are bound and live as long as the
    // renderer; the rows were written from slots that the renderer checked to be below
    // `patches_max`, so their vertices are inside the buffers; the indices are those of one patch.
    unsafe {
        for (binding, vertices) in vertices.into_iter().chain(places) {
            if let Some(vertices) = vertices {
                device.cmd_bind_vertex_buffers(buffer, binding, &[vertices.handle], &[0]);
            }
        }
        device.cmd_bind_index_buffer(buffer, arena.indices.handle, 0, vk::IndexType::UINT16);
        let at = (chunk.first_row * row) as u64;
        device.cmd_draw_indexed_indirect(buffer, rings.draws.handle, at, rows, stride);
    }
}

fn range_pass(
    scene: &Scene<'_>,
    primary: vk::CommandBuffer,
    pass: &RenderPass,
    secondaries: &[vk::CommandBuffer],
) {
    let [r, g, b] = match scene.picture.backdrop {
        Backdrop::Sky => [0.0; 3],
        Backdrop::Colour(colour) => colour,
    };
    let depth = match scene.settings.depth_order {
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
    let device = &scene.device.handle;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_follow_from_the_lists_alone() {
        let all: Vec<u32> = (0..20_000).collect();
        let mut chunks = Vec::new();
        cut(&[&[], &all[..16_384], &all], &mut chunks);
        let list: Vec<_> = chunks.iter().map(|c| (c.range, c.first_row, c.rows)).collect();
        assert_eq!(list, [(1, 0, 16_384), (2, 16_384, 16_384), (2, 32_768, 3616)]);
    }
}

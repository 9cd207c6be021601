//! Records a picture that was made ready into command buffers.
//!
//! In:    [`Drawing`]: pipelines, arena, what is in flight.
//! Out:   copies, the draws of each depth range, the sky, the overlay.
//! Keeps: what is to be recorded for each frame in flight: [`Plan`].
//! Not here: whose command buffers they are (`secondaries`: our own; `host`: a host's).
//!
//! A range is cut into chunks of patches, each one multi-draw-indirect, whose rows the workers wrote
//! together; nearly always a range is one chunk.

pub(crate) mod host;
pub(crate) mod secondaries;

use crate::drawing::{Drawing, InFlight};
use crate::matrices::RangeTerms;
use crate::parts::Lit;
use crate::passes::VIEW_STAGES;
use crate::passes::terrain::{MORPHS, PLACES, VERTICES};
use crate::picture::{Backdrop, Picture, Show};
use crate::vk::buffer::bytes_of;
use ash::vk;
use overfly_core::geodesy::narrow;
use overfly_core::settings::DepthOrder;

/// Patches drawn by one command: fewer than every device draws with one indirect call.
const CHUNK_PATCHES: usize = 16_384;

/// Some rows of a range's draws.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Chunk {
    range: usize,
    first_row: usize,
    rows: usize,
}

/// What is to be recorded of a picture.
#[derive(Default)]
pub(crate) struct Plan {
    /// Terms of each range, from near to far. A view without ranges has one, empty; before the
    /// first picture there is none.
    ranges: Vec<RangeTerms>,
    chunks: Vec<Chunk>,
    is_debug: bool,
    has_sky: bool,
    lit: Lit,
    size_px: [u32; 2],
}

impl Plan {
    /// Plans the draws of a picture: by the lengths of its lists, never by the number of workers.
    /// Returns how many indirect commands there are.
    pub(crate) fn set(
        &mut self,
        picture: &Picture<'_>,
        lists: &[&[u32]],
        order: DepthOrder,
    ) -> u32 {
        let ranges = picture.view.ranges.iter().map(|range| [range.near_m, range.far_m]);
        let none = ranges.len() == 0;
        let ranges = ranges.chain(none.then_some([1.0, f64::INFINITY]));
        self.ranges.clear();
        self.ranges.extend(ranges.enumerate().map(|(i, range)| RangeTerms::new(order, range, i)));
        cut(lists, &mut self.chunks);
        self.is_debug = picture.show != Show::Shaded;
        self.has_sky = picture.backdrop == Backdrop::Sky;
        self.lit = Lit::of(picture.parts);
        self.size_px = picture.view.camera.size_px;
        count(self.chunks.len())
    }

    /// As before the first picture.
    pub(crate) fn clear(&mut self) {
        self.ranges.clear();
        self.chunks.clear();
    }

    /// Index of the farthest range.
    fn farthest(&self) -> usize {
        self.ranges.len().saturating_sub(1)
    }
}

/// Cuts the lists of all ranges into chunks.
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

fn count(n: usize) -> u32 {
    u32::try_from(n).expect("patches are counted in 32 bits")
}

/// A picture that was made ready, and what it is drawn with.
#[derive(Clone, Copy)]
struct Ready<'a> {
    drawing: &'a Drawing,
    in_flight: &'a InFlight,
}

impl<'a> Ready<'a> {
    fn new(drawing: &'a Drawing, index: usize) -> Self {
        Self { drawing, in_flight: &drawing.in_flight[index] }
    }

    /// Records the copies of what was staged, outside a pass.
    fn copies(self, buffer: vk::CommandBuffer) {
        let Drawing { device, arena, imagery, .. } = self.drawing;
        for staging in &self.in_flight.staging {
            arena.record(device, buffer, staging);
        }
        for tiles in &self.in_flight.tiles {
            imagery.as_ref().expect("there are tiles").record(device, buffer, tiles);
        }
    }

    /// Sets what is drawn to: as large as the picture, with its corner at a place of the target.
    fn place(self, buffer: vk::CommandBuffer, [x, y]: [i32; 2]) {
        let [width, height] = self.in_flight.plan.size_px;
        let extent = vk::Extent2D { width, height };
        let area = vk::Rect2D { offset: vk::Offset2D { x, y }, extent };
        let [x, y] = [x, y].map(|n| narrow(f64::from(n)));
        let [width, height] = [width, height].map(|n| narrow(f64::from(n)));
        let (min_depth, max_depth) = (0.0, 1.0);
        let viewport = vk::Viewport { x, y, width, height, min_depth, max_depth };
        let device = &self.drawing.device.handle;
        // SAFETY: the buffer is being recorded; the picture fits the target.
        unsafe {
            device.cmd_set_viewport(buffer, 0, &[viewport]);
            device.cmd_set_scissor(buffer, 0, &[area]);
        }
    }

    /// Binds a pipeline with the view, and the terms of a range.
    fn bind(self, buffer: vk::CommandBuffer, range: usize, pipeline: vk::Pipeline) {
        let Self { drawing, in_flight: InFlight { rings, plan, .. } } = self;
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        let (device, layout) = (&drawing.device.handle, drawing.passes.layout.handle);
        let infos = rings.infos_set().map(|infos| infos.handle);
        let imagery = drawing.imagery.as_ref().map(|imagery| imagery.set.handle);
        let sets = [(0, Some(rings.view_set.handle)), (1, infos), (2, imagery)];
        let terms = &plan.ranges[range..=range];
        // SAFETY: the buffer is being recorded inside a compatible pass; the pipeline has this
        // layout, whose push range is the terms' size and whose set 0 is the view's; sets 1 and 2
        // are bound for the pipelines that read them.
        unsafe {
            device.cmd_bind_pipeline(buffer, graphics, pipeline);
            for (number, set) in sets {
                let Some(set) = set else { continue };
                device.cmd_bind_descriptor_sets(buffer, graphics, layout, number, &[set], &[]);
            }
            device.cmd_push_constants(buffer, layout, VIEW_STAGES, 0, bytes_of(terms));
        }
    }

    fn sky(self, buffer: vk::CommandBuffer) {
        let range = self.in_flight.plan.farthest();
        let skies = &self.drawing.passes.sky;
        let pipeline = skies[self.in_flight.plan.lit.index()].as_ref();
        let pipeline = pipeline.expect("made before it is recorded");
        self.bind(buffer, range, pipeline.handle);
        // SAFETY: the pipeline bound above needs no vertex buffer.
        unsafe { self.drawing.device.handle.cmd_draw(buffer, 3, 1, 0, 0) };
    }

    fn overlay(self, buffer: vk::CommandBuffer) {
        let Self { drawing, in_flight: InFlight { rings, .. } } = self;
        let pipeline = drawing.passes.overlay.as_ref().expect("made before it is recorded");
        let corners = rings.overlay.as_ref().expect("made with its corners").handle;
        self.bind(buffer, 0, pipeline.handle);
        let device = &drawing.device.handle;
        // SAFETY: the buffer holds as many corners as were written.
        unsafe {
            device.cmd_bind_vertex_buffers(buffer, 0, &[corners], &[0]);
            device.cmd_draw(buffer, rings.overlay_corners, 1, 0, 0);
        }
    }

    fn chunk(self, buffer: vk::CommandBuffer, chunk: Chunk) {
        let Self { drawing, in_flight: InFlight { rings, plan, .. } } = self;
        let (arena, passes) = (&drawing.arena, &drawing.passes);
        let made = if plan.is_debug { &passes.debug } else { &passes.terrain[plan.lit.index()] };
        let pipeline = made.as_ref().expect("made before it is recorded");
        self.bind(buffer, chunk.range, pipeline.handle);
        let row = size_of::<vk::DrawIndexedIndirectCommand>();
        let stride = u32::try_from(row).expect("a row is 20 bytes");
        let rows = u32::try_from(chunk.rows).expect("at most CHUNK_PATCHES");
        let device = &drawing.device.handle;
        let vertices = [(VERTICES, Some(&arena.vertices)), (MORPHS, arena.morphs.as_ref())];
        let places = [(PLACES, rings.places.as_ref())];
        // SAFETY: the vertex buffers that the pipeline reads are bound and live as long as the
        // renderer; the rows were written from slots that were checked to be below `patches_max`,
        // so their vertices are inside the buffers; the indices are those of one patch.
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

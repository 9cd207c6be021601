//! What the host writes for one frame in flight: its size is fixed at the start, so nothing grows.
//!
//! In:    a picture.
//! Out:   the view's terms, indirect draws, places before the eye, patch infos, overlay corners.
//! Keeps: mapped buffers; those of optional parts from the first time on that they are needed.
//! Not here: staging of vertices (`upload`), recording (`record`).

use crate::error::Fault;
use crate::eye::{self, Drawn, Moment};
use crate::matrices::ViewTerms;
use crate::overlay::OverlayVertex;
use crate::passes::Passes;
use crate::picture::Picture;
use crate::settings::RendererSettings;
use crate::upload::Arena;
use crate::vk::descriptors::{Resource, Set};
use crate::vk::{Buffer, Device, buffer::BufferInfo};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::inspect::PatchInfo;
use overfly_core::settings::VertexPrecision;
use overfly_jobs::Team;
use std::sync::Arc;

/// Draws written in one chunk: some 10 µs of work.
const DRAW_GRAIN: usize = 4096;
/// Corners of an overlay: what is beyond is not drawn. 2.25 MiB.
const OVERLAY_MAX: usize = 3 << 16;

/// A buffer of patch infos, and the set that shows it to shaders.
struct Infos {
    rows: Buffer,
    set: Set,
}

/// The mapped buffers of one frame in flight.
pub(crate) struct Rings {
    pub(crate) view_set: Set,
    pub(crate) draws: Buffer,
    /// Places of all vertices before the eye; only where the host places them.
    pub(crate) places: Option<Buffer>,
    /// Corners of the overlay, and how many of them there are.
    pub(crate) overlay: Option<Buffer>,
    pub(crate) overlay_corners: u32,
    view: Buffer,
    infos: Option<Infos>,
    drawn: Drawn,
    name: String,
    device: Arc<Device>,
}

impl Rings {
    pub(crate) fn new(
        device: &Arc<Device>,
        passes: &Passes,
        settings: &RendererSettings,
        name: &str,
    ) -> Result<Self, Fault> {
        let rows = |what: &str, rows: u64, row: usize, usage| {
            mapped(device, &format!("{name}, {what}"), (rows, row), usage)
        };
        let patches = u64::from(settings.patches_max);
        let uniform = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let view = rows("view", 1, size_of::<ViewTerms>(), uniform)?;
        let draw = size_of::<vk::DrawIndexedIndirectCommand>();
        let all = patches * u64::from(settings.ranges_max);
        let draws = rows("draws", all, draw, vk::BufferUsageFlags::INDIRECT_BUFFER)?;
        let places = (settings.vertices == VertexPrecision::EyeF64).then(|| {
            let vertices = patches * u64::from(settings.vertices_per_patch());
            let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
            rows("places", vertices, size_of::<[f32; 3]>(), usage)
        });
        let detail = &passes.detail;
        let (image, sampler) = (detail.image.view, detail.sampler.handle);
        let all = [Resource::Buffer(&view), Resource::Image(image), Resource::Sampler(sampler)];
        Ok(Self {
            view_set: Set::new(&passes.view, &all)?,
            draws,
            places: places.transpose()?,
            overlay: None,
            overlay_corners: 0,
            view,
            infos: None,
            drawn: Drawn::default(),
            name: name.to_owned(),
            device: Arc::clone(device),
        })
    }

    /// The set of patch infos, where they were written.
    pub(crate) fn infos_set(&self) -> Option<&Set> {
        self.infos.as_ref().map(|infos| &infos.set)
    }

    pub(crate) fn write_view(&mut self, terms: ViewTerms) {
        self.view.rows_mut()[0] = terms;
    }

    /// Writes the draws of a list of slots, from row `first` on.
    pub(crate) fn write_draws(
        &mut self,
        (first, slots): (usize, &[u32]),
        arena: &Arena,
        team: &Team<'_>,
    ) {
        let rows: &mut [vk::DrawIndexedIndirectCommand] = self.draws.rows_mut();
        let rows = &mut rows[first..first + slots.len()];
        let (index_count, vertices) = (arena.indices_per_patch, arena.vertices_per_patch);
        team.for_each_chunk(rows, DRAW_GRAIN, |first, rows| {
            for (row, &slot) in rows.iter_mut().zip(&slots[first..]) {
                *row = vk::DrawIndexedIndirectCommand {
                    index_count,
                    instance_count: 1,
                    first_index: 0,
                    vertex_offset: (slot * vertices).cast_signed(),
                    first_instance: 0,
                };
            }
        });
    }

    /// Places the vertices of all listed slots before the eye, where that is the host's task.
    pub(crate) fn write_places<'a>(
        &mut self,
        picture: &Picture<'_>,
        lists: impl Iterator<Item = &'a [u32]>,
        morph_ms: u32,
        team: &Team<'_>,
    ) {
        let Some(places) = &mut self.places else { return };
        self.drawn.note(picture.patches.used_end(), lists);
        let moment = Moment { now_ms: picture.time_ms, morph_ms };
        let camera = &picture.view.camera;
        let target = places.rows_mut();
        eye::place((picture.patches, &self.drawn), camera, moment, target, team);
    }

    /// Writes what debug views show; slots beyond `infos` show as zeros.
    pub(crate) fn write_infos(
        &mut self,
        passes: &Passes,
        patches_max: u32,
        infos: &[PatchInfo],
    ) -> Result<(), Fault> {
        if self.infos.is_none() {
            let name = format!("{}, patch infos", self.name);
            let size = (u64::from(patches_max), size_of::<PatchInfo>());
            let rows = mapped(&self.device, &name, size, vk::BufferUsageFlags::STORAGE_BUFFER)?;
            let set = Set::new(&passes.infos, &[Resource::Buffer(&rows)])?;
            self.infos = Some(Infos { rows, set });
        }
        let rows = self.infos.as_mut().expect("made above").rows.rows_mut();
        let known = infos.len().min(rows.len());
        rows[..known].copy_from_slice(&infos[..known]);
        rows[known..].fill(PatchInfo::default());
        Ok(())
    }

    /// Writes an overlay's corners; `scratch` is theirs.
    pub(crate) fn write_overlay(
        &mut self,
        picture: &Picture<'_>,
        scratch: &mut Vec<OverlayVertex>,
    ) -> Result<(), Fault> {
        self.overlay_corners = 0;
        if picture.overlay.is_empty() {
            return Ok(());
        }
        if self.overlay.is_none() {
            let name = format!("{}, overlay", self.name);
            let size = (OVERLAY_MAX as u64, size_of::<OverlayVertex>());
            let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
            self.overlay = Some(mapped(&self.device, &name, size, usage)?);
        }
        picture.overlay.triangles(&picture.view.camera, scratch);
        let count = scratch.len().min(OVERLAY_MAX);
        let rows = self.overlay.as_mut().expect("made above").rows_mut();
        rows[..count].copy_from_slice(&scratch[..count]);
        self.overlay_corners = u32::try_from(count).expect("bounded above");
        Ok(())
    }
}

fn mapped(
    device: &Arc<Device>,
    name: &str,
    (rows, row): (u64, usize),
    usage: vk::BufferUsageFlags,
) -> Result<Buffer, Fault> {
    let location = MemoryLocation::CpuToGpu;
    Buffer::new(device, &BufferInfo { name, bytes: rows * row as u64, usage, location })
}

//! The pipelines that a picture is drawn with.
//!
//! In:    render passes, compiled shaders.
//! Out:   [`Passes`].
//! Keeps: pipelines and their layout.
//! Not here: recording (`record`).

mod sky;
mod terrain;

use crate::error::Fault;
use crate::targets::Targets;
use crate::vk::Device;
use crate::vk::pipeline::{Layout, Pipeline};
use ash::vk;
use std::sync::Arc;

/// Stages that read the view.
pub(crate) const VIEW_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

/// Size of the shaders' `View`.
const VIEW_BYTES: u32 = 124;
const _: () = assert!(size_of::<crate::matrices::ViewTerms>() == VIEW_BYTES as usize);

/// All pipelines. They share one layout: the view as push constants, no descriptors.
pub(crate) struct Passes {
    pub(crate) layout: Layout,
    pub(crate) terrain: Pipeline,
    pub(crate) sky: Pipeline,
}

impl Passes {
    pub(crate) fn new(device: &Arc<Device>, targets: &Targets) -> Result<Self, Fault> {
        let ranges = [vk::PushConstantRange::default().stage_flags(VIEW_STAGES).size(VIEW_BYTES)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        let layout = Layout::new(device, "view", &info)?;
        let terrain = terrain::pipeline(device, &layout, targets)?;
        let sky = sky::pipeline(device, &layout, targets)?;
        Ok(Self { layout, terrain, sky })
    }
}

//! The pipelines that a picture is drawn with.
//!
//! In:    a subpass to draw into, compiled shaders, settings.
//! Out:   [`Passes`].
//! Keeps: layouts; the ground's pipeline, others once they were asked for.
//! Not here: recording (`record`).

mod overlay;
mod sky;
pub(crate) mod terrain;

use crate::detail::Detail;
use crate::error::Fault;
use crate::imagery::Imagery;
use crate::matrices::RangeTerms;
use crate::settings::RendererSettings;
use crate::vk::Device;
use crate::vk::commands::OneOff;
use crate::vk::descriptors::{Binding, SetLayout};
use crate::vk::pipeline::{Layout, Pipeline, Subpass};
use ash::vk;
use overfly_core::settings::DepthOrder;
use std::sync::Arc;

/// Stages that read the view and the range.
pub(crate) const VIEW_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

/// Size of the shaders' `Range`.
const RANGE_BYTES: u32 = 16;
const _: () = assert!(size_of::<RangeTerms>() == RANGE_BYTES as usize);

/// What pipelines are made from.
pub(crate) struct PassInfo<'a> {
    pub(crate) device: &'a Arc<Device>,
    pub(crate) into: Subpass,
    pub(crate) settings: &'a RendererSettings,
}

/// All pipelines. The range is push constants; set 0 is the view and the ground's detail, set 1
/// what debug views show, set 2 imagery.
pub(crate) struct Passes {
    pub(crate) detail: Detail,
    pub(crate) view: SetLayout,
    pub(crate) infos: SetLayout,
    pub(crate) imagery: Option<SetLayout>,
    pub(crate) layout: Layout,
    pub(crate) terrain: Pipeline,
    pub(crate) sky: Option<Pipeline>,
    pub(crate) debug: Option<Pipeline>,
    pub(crate) overlay: Option<Pipeline>,
}

/// What a picture has beside the ground.
#[derive(Clone, Copy)]
pub(crate) struct Beside {
    pub(crate) sky: bool,
    pub(crate) debug: bool,
    pub(crate) overlay: bool,
}

impl Passes {
    /// The pipeline of the ground.
    pub(crate) fn new(info: &PassInfo<'_>, one_off: &mut OneOff) -> Result<Self, Fault> {
        let device = info.device;
        let uniform = vk::DescriptorType::UNIFORM_BUFFER;
        let storage = vk::DescriptorType::STORAGE_BUFFER;
        let stages = vk::ShaderStageFlags::FRAGMENT;
        let view = [
            Binding { kind: uniform, stages: VIEW_STAGES },
            Binding { kind: vk::DescriptorType::SAMPLED_IMAGE, stages },
            Binding { kind: vk::DescriptorType::SAMPLER, stages },
        ];
        let view = SetLayout::new(device, "view", &view)?;
        let infos = SetLayout::new(device, "patch infos", &[Binding { kind: storage, stages }])?;
        let ranges = [vk::PushConstantRange::default().stage_flags(VIEW_STAGES).size(RANGE_BYTES)];
        let imagery = info.settings.imagery.then(|| Imagery::layout(device)).transpose()?;
        let handles = [Some(view.handle), Some(infos.handle), imagery.as_ref().map(|i| i.handle)];
        let sets: Vec<_> = handles.into_iter().flatten().collect();
        let create = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&sets)
            .push_constant_ranges(&ranges);
        let layout = Layout::new(device, "picture", &create)?;
        let detail = Detail::new(device, one_off)?;
        let terrain = terrain::pipeline(info, &layout, false)?;
        let (sky, debug, overlay) = (None, None, None);
        Ok(Self { detail, view, infos, imagery, layout, terrain, sky, debug, overlay })
    }

    /// Makes what a picture needs beside the ground, the first time.
    pub(crate) fn complete(&mut self, info: &PassInfo<'_>, beside: Beside) -> Result<(), Fault> {
        let Beside { sky, debug, overlay } = beside;
        if sky && self.sky.is_none() {
            self.sky = Some(sky::pipeline(info, &self.layout)?);
        }
        if debug && self.debug.is_none() {
            self.debug = Some(terrain::pipeline(info, &self.layout, true)?);
        }
        if overlay && self.overlay.is_none() {
            self.overlay = Some(overlay::pipeline(info, &self.layout)?);
        }
        Ok(())
    }

    /// How many pipelines there are.
    pub(crate) fn count(&self) -> u32 {
        let others = [&self.sky, &self.debug, &self.overlay];
        others.into_iter().flatten().fold(1, |count, _| count + 1)
    }
}

/// The comparison that lets the nearer surface win.
fn nearer(order: DepthOrder) -> vk::CompareOp {
    match order {
        DepthOrder::Reversed => vk::CompareOp::GREATER,
        DepthOrder::Forward => vk::CompareOp::LESS,
    }
}

//! The pipelines that a picture is drawn with.
//!
//! In:    a subpass to draw into, compiled shaders, settings.
//! Out:   [`Passes`].
//! Keeps: layouts; the pipelines that the settings name, others once they were asked for.
//! Not here: recording (`record`).

mod overlay;
mod sky;
pub(crate) mod terrain;

use crate::detail::Detail;
use crate::error::Fault;
use crate::imagery::Imagery;
use crate::matrices::RangeTerms;
use crate::parts::{Asked, Lit, check};
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
    /// By [`Lit::index`].
    pub(crate) terrain: [Option<Pipeline>; Lit::COUNT],
    /// By [`Lit::index`].
    pub(crate) sky: [Option<Pipeline>; Lit::COUNT],
    pub(crate) debug: Option<Pipeline>,
    pub(crate) overlay: Option<Pipeline>,
}

impl Passes {
    /// The ground's pipeline of what the settings name.
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
        let (terrain, sky) = Default::default();
        let (debug, overlay) = (None, None);
        let mut made = Self { detail, view, infos, imagery, layout, terrain, sky, debug, overlay };
        made.complete(info, info.settings.asked())?;
        Ok(made)
    }

    /// Makes what a picture needs, the first time.
    pub(crate) fn complete(&mut self, info: &PassInfo<'_>, asked: Asked) -> Result<(), Fault> {
        check(asked)?;
        let Asked { lit, sky, debug, overlay, .. } = asked;
        let layout = &self.layout;
        let ground = &mut self.terrain[lit.index()];
        if !debug && ground.is_none() {
            *ground = Some(terrain::pipeline(info, layout, Some(lit))?);
        }
        let behind = &mut self.sky[lit.index()];
        if sky && behind.is_none() {
            *behind = Some(sky::pipeline(info, layout, lit)?);
        }
        if debug && self.debug.is_none() {
            self.debug = Some(terrain::pipeline(info, layout, None)?);
        }
        if overlay && self.overlay.is_none() {
            self.overlay = Some(overlay::pipeline(info, layout)?);
        }
        Ok(())
    }

    /// How many pipelines there are.
    pub(crate) fn count(&self) -> u32 {
        let lit = self.terrain.iter().chain(&self.sky);
        let all = lit.chain([&self.debug, &self.overlay]);
        all.flatten().fold(0, |count, _| count + 1)
    }
}

/// The comparison that lets the nearer surface win.
fn nearer(order: DepthOrder) -> vk::CompareOp {
    match order {
        DepthOrder::Reversed => vk::CompareOp::GREATER,
        DepthOrder::Forward => vk::CompareOp::LESS,
    }
}

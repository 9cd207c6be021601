//! What is drawn into: colour and depth, and the render passes over them.
//!
//! In:    depth format, the picture's size.
//! Out:   [`RangePasses`], [`Targets`].
//! Keeps: two passes; two images, a framebuffer, a buffer to read pixels from.
//! Not here: what is drawn (`passes`).
//!
//! Depth ranges share the images: each range is one instance of a render pass, the first clears
//! colour and depth, later ones depth only. Classic render passes, because the validation layer of
//! stable distributions finds no attachment hazards with dynamic rendering.

use crate::error::{Fault, StartError};
use crate::vk::image::{Image, ImageInfo};
use crate::vk::pipeline::{Framebuffer, RenderPass, Subpass};
use crate::vk::{Buffer, Device, buffer::BufferInfo};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::settings::DepthFormat;
use std::sync::Arc;

/// Stores linear light with the sRGB curve; every device can draw to it.
const COLOUR: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// The render passes of a renderer, whatever the size of its pictures.
pub(crate) struct RangePasses {
    pub(crate) first: RenderPass,
    pub(crate) next: RenderPass,
    depth: vk::Format,
    keep_depth: bool,
}

impl RangePasses {
    pub(crate) fn new(
        device: &Arc<Device>,
        format: DepthFormat,
        keep_depth: bool,
    ) -> Result<Self, StartError> {
        let depth = depth_format(device, format)?;
        let first = pass(device, ("first range", true), depth, keep_depth)?;
        let next = pass(device, ("next range", false), depth, keep_depth)?;
        Ok(Self { first, next, depth, keep_depth })
    }

    /// What pipelines for either are made for.
    pub(crate) fn subpass(&self) -> Subpass {
        Subpass { pass: self.first.handle, index: 0, samples: vk::SampleCountFlags::TYPE_1 }
    }
}

/// The device's format for depth: 24 bits come with or without eight that nobody uses.
fn depth_format(device: &Device, format: DepthFormat) -> Result<vk::Format, StartError> {
    let (name, candidates): (_, &[vk::Format]) = match format {
        DepthFormat::D32F => ("D32F", &[vk::Format::D32_SFLOAT]),
        DepthFormat::D24 => {
            ("D24", &[vk::Format::X8_D24_UNORM_PACK32, vk::Format::D24_UNORM_S8_UINT])
        }
    };
    let able = |format: &&vk::Format| {
        let features = device.image_features(**format);
        features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT)
    };
    let found = candidates.iter().find(able);
    found.copied().ok_or(StartError::NoDepthFormat { format: name })
}

/// The images of pictures of one size.
pub(crate) struct Targets {
    pub(crate) size_px: [u32; 2],
    pub(crate) framebuffer: Framebuffer,
    pub(crate) colour: Image,
    pub(crate) pixels: Buffer,
    pub(crate) depth: Image,
}

impl Targets {
    pub(crate) fn new(
        device: &Arc<Device>,
        passes: &RangePasses,
        size_px: [u32; 2],
    ) -> Result<Self, Fault> {
        let image = |name, format, usage, aspect| {
            Image::new(device, &ImageInfo { name, size_px, format, usage, aspect })
        };
        let colour = image(
            "colour",
            COLOUR,
            vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
            vk::ImageAspectFlags::COLOR,
        )?;
        let read = if passes.keep_depth {
            vk::ImageUsageFlags::TRANSFER_SRC
        } else {
            vk::ImageUsageFlags::empty()
        };
        let stencil = if passes.depth == vk::Format::D24_UNORM_S8_UINT {
            vk::ImageAspectFlags::STENCIL
        } else {
            vk::ImageAspectFlags::empty()
        };
        let depth = image(
            "depth",
            passes.depth,
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | read,
            vk::ImageAspectFlags::DEPTH | stencil,
        )?;
        let views = [colour.view, depth.view];
        let framebuffer = Framebuffer::new(device, &passes.first, &views, size_px)?;
        let pixels = Buffer::new(
            device,
            &BufferInfo {
                name: "pixels",
                bytes: 4 * u64::from(size_px[0]) * u64::from(size_px[1]),
                usage: vk::BufferUsageFlags::TRANSFER_DST,
                location: MemoryLocation::GpuToCpu,
            },
        )?;
        Ok(Self { size_px, framebuffer, colour, pixels, depth })
    }

    /// All of the picture.
    pub(crate) fn area(&self) -> vk::Rect2D {
        let [width, height] = self.size_px;
        vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } }
    }
}

/// A pass that clears depth, and colour too if it is the `first` of a picture. Both are
/// compatible: they differ in what they load only.
fn pass(
    device: &Arc<Device>,
    (name, first): (&str, bool),
    depth: vk::Format,
    keep_depth: bool,
) -> Result<RenderPass, Fault> {
    let kept =
        if keep_depth { vk::AttachmentStoreOp::STORE } else { vk::AttachmentStoreOp::DONT_CARE };
    let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let colour = vk::AttachmentDescription::default()
        .format(COLOUR)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(if first { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD })
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
        .initial_layout(if first { vk::ImageLayout::UNDEFINED } else { drawn })
        .final_layout(drawn);
    let depth = vk::AttachmentDescription::default()
        .format(depth)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(kept)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
        .final_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
    let attachments = [colour, depth];
    let colours = [vk::AttachmentReference { attachment: 0, layout: drawn }];
    let depth_use = vk::AttachmentReference {
        attachment: 1,
        layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    };
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&colours)
        .depth_stencil_attachment(&depth_use)];
    let dependencies = [after_earlier_passes()];
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses)
        .dependencies(&dependencies);
    RenderPass::new(device, name, &info)
}

/// Drawing waits for the drawing of earlier passes and frames, and for pixels being read.
fn after_earlier_passes() -> vk::SubpassDependency {
    let attachments = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
        | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    let writes =
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let reads =
        vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ;
    vk::SubpassDependency::default()
        .src_subpass(vk::SUBPASS_EXTERNAL)
        .dst_subpass(0)
        .src_stage_mask(attachments | vk::PipelineStageFlags::TRANSFER)
        .src_access_mask(writes)
        .dst_stage_mask(attachments)
        .dst_access_mask(writes | reads)
}

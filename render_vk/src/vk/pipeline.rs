//! Render passes, framebuffers, pipelines.
//!
//! In:    attachments, shader words, fixed state.
//! Out:   [`RenderPass`], [`Framebuffer`], [`Pipeline`].
//! Keeps: the objects.
//! Not here: which passes there are (`targets`, `passes`).

use super::Device;
use crate::error::{Fault, failed};
use ash::vk;
use std::sync::Arc;

/// A render pass.
pub(crate) struct RenderPass {
    pub(crate) handle: vk::RenderPass,
    device: Arc<Device>,
}

impl RenderPass {
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        info: &vk::RenderPassCreateInfo<'_>,
    ) -> Result<Self, Fault> {
        // SAFETY: `info` points to live arrays: the borrow says so.
        let handle = unsafe { device.handle.create_render_pass(info, None) }
            .map_err(failed("vkCreateRenderPass"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for RenderPass {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_render_pass(self.handle, None) };
    }
}

/// A framebuffer.
pub(crate) struct Framebuffer {
    pub(crate) handle: vk::Framebuffer,
    device: Arc<Device>,
}

impl Framebuffer {
    pub(crate) fn new(
        device: &Arc<Device>,
        pass: &RenderPass,
        views: &[vk::ImageView],
        size_px: [u32; 2],
    ) -> Result<Self, Fault> {
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.handle)
            .attachments(views)
            .width(size_px[0])
            .height(size_px[1])
            .layers(1);
        // SAFETY: pass and views are this device's; the caller gives one view an attachment, of
        // this size.
        let handle = unsafe { device.handle.create_framebuffer(&info, None) }
            .map_err(failed("vkCreateFramebuffer"))?;
        device.name(handle, "picture");
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Framebuffer {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_framebuffer(self.handle, None) };
    }
}

/// A pipeline layout.
pub(crate) struct Layout {
    pub(crate) handle: vk::PipelineLayout,
    device: Arc<Device>,
}

impl Layout {
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        info: &vk::PipelineLayoutCreateInfo<'_>,
    ) -> Result<Self, Fault> {
        // SAFETY: `info` points to live arrays; push ranges are at most 128 bytes, which every
        // device allows.
        let handle = unsafe { device.handle.create_pipeline_layout(info, None) }
            .map_err(failed("vkCreatePipelineLayout"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Layout {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_pipeline_layout(self.handle, None) };
    }
}

/// A shader module; needed only while pipelines are made.
pub(crate) struct Shader {
    handle: vk::ShaderModule,
    device: Arc<Device>,
}

impl Shader {
    pub(crate) fn new(device: &Arc<Device>, name: &str, words: &[u32]) -> Result<Self, Fault> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are a module that naga validated at build time.
        let handle = unsafe { device.handle.create_shader_module(&info, None) }
            .map_err(failed("vkCreateShaderModule"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Shader {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once; pipelines do not need it any more.
        unsafe { self.device.handle.destroy_shader_module(self.handle, None) };
    }
}

/// What pipelines draw into: a subpass with one colour attachment and depth.
#[derive(Clone, Copy)]
pub(crate) struct Subpass {
    pub(crate) pass: vk::RenderPass,
    pub(crate) index: u32,
    pub(crate) samples: vk::SampleCountFlags,
}

/// What differs between the graphics pipelines.
pub(crate) struct GraphicsInfo<'a> {
    pub(crate) name: &'a str,
    /// Modules of the entry points `vertex` and `fragment`.
    pub(crate) words: [&'a [u32]; 2],
    pub(crate) into: Subpass,
    pub(crate) bindings: &'a [vk::VertexInputBindingDescription],
    pub(crate) attributes: &'a [vk::VertexInputAttributeDescription],
    pub(crate) cull: vk::CullModeFlags,
    /// No test at all without a comparison.
    pub(crate) depth_compare: Option<vk::CompareOp>,
    pub(crate) depth_write: bool,
    /// Whether alpha is opacity.
    pub(crate) blend: bool,
}

/// A pipeline.
pub(crate) struct Pipeline {
    pub(crate) handle: vk::Pipeline,
    device: Arc<Device>,
}

impl Pipeline {
    /// Triangles, counter-clockwise in front; viewport and scissor are set while recording.
    pub(crate) fn graphics(
        device: &Arc<Device>,
        layout: &Layout,
        info: &GraphicsInfo<'_>,
    ) -> Result<Self, Fault> {
        let [vertex, fragment] = info.words;
        let vertex = Shader::new(device, info.name, vertex)?;
        let fragment = Shader::new(device, info.name, fragment)?;
        let stage = vk::PipelineShaderStageCreateInfo::default();
        let stages = [
            stage.stage(vk::ShaderStageFlags::VERTEX).module(vertex.handle).name(c"vertex"),
            stage.stage(vk::ShaderStageFlags::FRAGMENT).module(fragment.handle).name(c"fragment"),
        ];
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(info.bindings)
            .vertex_attribute_descriptions(info.attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport =
            vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(info.cull)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(info.into.samples);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(info.depth_compare.is_some())
            .depth_write_enable(info.depth_write)
            .depth_compare_op(info.depth_compare.unwrap_or(vk::CompareOp::ALWAYS));
        let colours = [vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(info.blend)
            .src_color_blend_factor(vk::BlendFactor::SRC_ALPHA)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&colours);
        let create = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout.handle)
            .render_pass(info.into.pass)
            .subpass(info.into.index);
        let cache = vk::PipelineCache::null();
        // SAFETY: layout, pass and shaders are this device's and alive, and everything `create`
        // points to outlives the call.
        let made = unsafe { device.handle.create_graphics_pipelines(cache, &[create], None) };
        Self::owned(device, info.name, made, "vkCreateGraphicsPipelines")
    }

    /// A compute pipeline of entry point `main`.
    pub(crate) fn compute(
        device: &Arc<Device>,
        layout: &Layout,
        name: &str,
        words: &[u32],
    ) -> Result<Self, Fault> {
        let shader = Shader::new(device, name, words)?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(shader.handle)
            .name(c"main");
        let create = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout.handle);
        let cache = vk::PipelineCache::null();
        // SAFETY: layout and shader are this device's and alive.
        let made = unsafe { device.handle.create_compute_pipelines(cache, &[create], None) };
        Self::owned(device, name, made, "vkCreateComputePipelines")
    }

    fn owned(
        device: &Arc<Device>,
        name: &str,
        made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
        call: &'static str,
    ) -> Result<Self, Fault> {
        // One was asked for, so where the call failed there is none to destroy.
        let handle = made.map_err(|(_, result)| failed(call)(result))?[0];
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_pipeline(self.handle, None) };
    }
}

//! The host's own geometry: coloured triangles before the eye.
//!
//! In:    corners in eye space (x right, y up, z backward, metres); the projection of a depth range.
//! Out:   draws that are depth-tested against what is there.
//! Keeps: a pipeline, a vertex buffer.
//! Not here: what the triangles are (`cockpit.rs`).

use super::Outcome;
use super::canvas::{Canvas, mapped_buffer};
use super::host::Host;
use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use overfly::core::settings::DepthOrder;
use overfly::render_vk::ash::vk;
use std::rc::Rc;

const SHADER: &str = "
struct Range { projection: mat4x4<f32> }
var<immediate> range: Range;

struct Point {
    @builtin(position) position: vec4<f32>,
    @location(0) colour: vec3<f32>,
}

@vertex
fn vertex(@location(0) at: vec3<f32>, @location(1) colour: vec3<f32>) -> Point {
    return Point(range.projection * vec4<f32>(at, 1.0), colour);
}

@fragment
fn fragment(point: Point) -> @location(0) vec4<f32> {
    return vec4<f32>(point.colour, 1.0);
}
";

/// Where a corner is, and its colour in linear light.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Corner {
    pub at_m: [f32; 3],
    pub colour: [f32; 3],
}

/// Triangles on the device.
pub struct Solids {
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    corners: (vk::Buffer, vk::DeviceMemory),
    count: u32,
    host: Rc<Host>,
}

impl Solids {
    /// Triangles of three corners each, seen from both sides.
    pub fn new(canvas: &Canvas, corners: &[Corner], order: DepthOrder) -> Outcome<Self> {
        let (host, device) = (Rc::clone(&canvas.host), &canvas.host.device);
        let buffer =
            mapped_buffer(&host, size_of_val(corners) as u64, vk::BufferUsageFlags::VERTEX_BUFFER)?;
        let ranges =
            [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(64)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        // SAFETY: the memory is mapped by nobody else and holds the corners, which are floats.
        let layout = unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let to = device.map_memory(buffer.1, 0, vk::WHOLE_SIZE, flags)?;
            to.cast::<Corner>().copy_from_nonoverlapping(corners.as_ptr(), corners.len());
            device.unmap_memory(buffer.1);
            device.create_pipeline_layout(&info, None)?
        };
        let pipeline = create_pipeline(canvas, layout, order)?;
        let count = u32::try_from(corners.len())?;
        Ok(Self { pipeline, layout, corners: buffer, count, host })
    }

    /// Records the draw, with the columns of a range's projection.
    ///
    /// # Safety
    /// - The buffer is being recorded, inside the canvas's pass.
    pub unsafe fn draw(
        &self,
        canvas: &Canvas,
        buffer: vk::CommandBuffer,
        projection: &[[f32; 4]; 4],
    ) {
        let bytes: Vec<u8> = projection.iter().flatten().flat_map(|x| x.to_ne_bytes()).collect();
        let (device, graphics) = (&self.host.device, vk::PipelineBindPoint::GRAPHICS);
        let stages = vk::ShaderStageFlags::VERTEX;
        // SAFETY: the caller's promise; the pipeline was made for the pass, the buffer holds as
        // many corners. Overfly left its own viewport, so this sets another.
        unsafe {
            canvas.whole(buffer);
            device.cmd_bind_pipeline(buffer, graphics, self.pipeline);
            device.cmd_push_constants(buffer, self.layout, stages, 0, &bytes);
            device.cmd_bind_vertex_buffers(buffer, 0, &[self.corners.0], &[0]);
            device.cmd_draw(buffer, self.count, 1, 0, 0);
        }
    }
}

impl Drop for Solids {
    fn drop(&mut self) {
        let device = &self.host.device;
        // SAFETY: all were made by this device and are destroyed once, when it is idle.
        unsafe {
            let _ = device.device_wait_idle();
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_buffer(self.corners.0, None);
            device.free_memory(self.corners.1, None);
        }
    }
}

/// The shader as Vulkan takes it.
fn compiled() -> Outcome<Vec<u32>> {
    let module = naga::front::wgsl::parse_str(SHADER)?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module)?;
    // The projection is Vulkan's already: nothing is to be flipped.
    let flags = spv::WriterFlags::empty();
    let options = spv::Options { lang_version: (1, 3), flags, ..spv::Options::default() };
    Ok(spv::write_vec(&module, &info, &options, None)?)
}

fn create_pipeline(
    canvas: &Canvas,
    layout: vk::PipelineLayout,
    order: DepthOrder,
) -> Outcome<vk::Pipeline> {
    let device = &canvas.host.device;
    let words = compiled()?;
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: naga validated the words.
    let shader = unsafe { device.create_shader_module(&info, None) }?;
    let stage = vk::PipelineShaderStageCreateInfo::default().module(shader);
    let stages = [
        stage.stage(vk::ShaderStageFlags::VERTEX).name(c"vertex"),
        stage.stage(vk::ShaderStageFlags::FRAGMENT).name(c"fragment"),
    ];
    let bindings = [vk::VertexInputBindingDescription::default().stride(24)];
    let attribute = |location, offset| {
        let format = vk::Format::R32G32B32_SFLOAT;
        vk::VertexInputAttributeDescription { location, binding: 0, format, offset }
    };
    let attributes = [attribute(0, 0), attribute(1, 12)];
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport =
        vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    // The comparison that overfly's ground has: the nearer one wins.
    let nearer = match order {
        DepthOrder::Reversed => vk::CompareOp::GREATER,
        DepthOrder::Forward => vk::CompareOp::LESS,
    };
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(nearer);
    let colours = [vk::PipelineColorBlendAttachmentState::default()
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
        .layout(layout)
        .render_pass(canvas.pass);
    let cache = vk::PipelineCache::null();
    // SAFETY: all that `create` names is alive; the shader is not needed afterwards.
    unsafe {
        let made = device.create_graphics_pipelines(cache, &[create], None);
        device.destroy_shader_module(shader, None);
        Ok(made.map_err(|(_, result)| result)?[0])
    }
}

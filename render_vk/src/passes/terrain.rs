//! The ground: patches out of the vertex arena.
//!
//! In:    vertices as [`PatchVertex`], the view.
//! Out:   colour and depth.
//! Keeps: nothing.
//! Not here: which patches (`record`), colours (`shaders/terrain.wgsl`).

use crate::error::Fault;
use crate::shaders;
use crate::targets::Targets;
use crate::vk::Device;
use crate::vk::pipeline::{GraphicsInfo, Layout, Pipeline};
use ash::vk;
use core::mem::offset_of;
use overfly_core::geodesy::TwoFloat;
use overfly_core::mesh::PatchVertex;
use std::sync::Arc;

/// Reversed depth, back faces culled: the ground is closed and is seen from outside.
pub(crate) fn pipeline(
    device: &Arc<Device>,
    layout: &Layout,
    targets: &Targets,
) -> Result<Pipeline, Fault> {
    let stride = u32::try_from(size_of::<PatchVertex>()).expect("a vertex is 36 bytes");
    let bindings = [vk::VertexInputBindingDescription::default()
        .stride(stride)
        .input_rate(vk::VertexInputRate::VERTEX)];
    let position = offset_of!(PatchVertex, position);
    let attributes = [
        attribute(0, vk::Format::R32G32B32_SFLOAT, position + offset_of!(TwoFloat, hi)),
        attribute(1, vk::Format::R32G32B32_SFLOAT, position + offset_of!(TwoFloat, lo)),
        attribute(2, vk::Format::R16G16_SNORM, offset_of!(PatchVertex, normal_oct)),
        attribute(3, vk::Format::R8G8B8A8_UNORM, offset_of!(PatchVertex, layers)),
        attribute(4, vk::Format::R32_SFLOAT, offset_of!(PatchVertex, height_m)),
    ];
    let info = GraphicsInfo {
        name: "terrain",
        words: &shaders::terrain(),
        pass: &targets.first_pass,
        size_px: targets.size_px,
        bindings: &bindings,
        attributes: &attributes,
        cull: vk::CullModeFlags::BACK,
        depth_compare: vk::CompareOp::GREATER,
        depth_write: true,
    };
    Pipeline::graphics(device, layout, &info)
}

fn attribute(
    location: u32,
    format: vk::Format,
    offset: usize,
) -> vk::VertexInputAttributeDescription {
    let offset = u32::try_from(offset).expect("a vertex is 36 bytes");
    vk::VertexInputAttributeDescription { location, binding: 0, format, offset }
}

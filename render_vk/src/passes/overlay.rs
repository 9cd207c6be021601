//! The overlay: flat triangles over the finished picture.
//!
//! In:    [`OverlayVertex`]s in pixels.
//! Out:   colour, blended. No depth.
//! Keeps: nothing.
//! Not here: what is written (`overlay`).

use super::PassInfo;
use crate::error::Fault;
use crate::overlay::OverlayVertex;
use crate::shaders;
use crate::vk::pipeline::{GraphicsInfo, Layout, Pipeline};
use ash::vk;
use core::mem::offset_of;

/// Drawn last in the nearest range.
pub(crate) fn pipeline(info: &PassInfo<'_>, layout: &Layout) -> Result<Pipeline, Fault> {
    let stride = u32::try_from(size_of::<OverlayVertex>()).expect("a vertex is 12 bytes");
    let bindings = [vk::VertexInputBindingDescription::default()
        .stride(stride)
        .input_rate(vk::VertexInputRate::VERTEX)];
    let attribute = |location, format, offset: usize| {
        let offset = u32::try_from(offset).expect("a vertex is 12 bytes");
        vk::VertexInputAttributeDescription { location, binding: 0, format, offset }
    };
    let attributes = [
        attribute(0, vk::Format::R32G32_SFLOAT, offset_of!(OverlayVertex, at_px)),
        attribute(1, vk::Format::R8G8B8A8_UNORM, offset_of!(OverlayVertex, colour)),
    ];
    let words = shaders::overlay();
    let graphics = GraphicsInfo {
        name: "overlay",
        words: [&words, &words],
        into: info.into,
        bindings: &bindings,
        attributes: &attributes,
        cull: vk::CullModeFlags::NONE,
        depth_compare: None,
        depth_write: false,
        blend: true,
    };
    Pipeline::graphics(info.device, layout, &graphics)
}

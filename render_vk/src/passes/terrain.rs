//! The ground: patches out of the vertex arena.
//!
//! In:    vertices as [`PatchVertex`], [`PatchMorph`]s, places before the eye; the view.
//! Out:   colour and depth.
//! Keeps: nothing.
//! Not here: which patches (`record`), colours (`shaders`).

use super::{PassInfo, nearer};
use crate::error::Fault;
use crate::parts::Lit;
use crate::shaders::{self, Ground};
use crate::vk::pipeline::{GraphicsInfo, Layout, Pipeline};
use ash::vk;
use core::mem::offset_of;
use overfly_core::geodesy::TwoFloat;
use overfly_core::mesh::{PatchMorph, PatchVertex};
use overfly_core::settings::VertexPrecision;

/// Vertex buffer bindings.
pub(crate) const VERTICES: u32 = 0;
pub(crate) const MORPHS: u32 = 1;
pub(crate) const PLACES: u32 = 2;

/// As one sees it in a light, or for debug views. Depth test and write, back faces culled: the ground is closed and is seen from outside.
pub(crate) fn pipeline(
    info: &PassInfo<'_>,
    layout: &Layout,
    lit: Option<Lit>,
) -> Result<Pipeline, Fault> {
    let (placed, morphs) = (info.settings.vertices, info.settings.morphs());
    let ground = match (lit, info.settings.imagery) {
        (None, _) => Ground::Debug,
        (Some(lit), true) => Ground::Draped(lit),
        (Some(lit), false) => Ground::Plain(lit),
    };
    let in_eye = placed == VertexPrecision::EyeF64;
    let mut bindings = vec![binding(VERTICES, size_of::<PatchVertex>())];
    let mut attributes = attributes_of_vertices(!in_eye);
    if morphs {
        bindings.push(binding(MORPHS, size_of::<PatchMorph>()));
        attributes.extend(attributes_of_morphs());
    }
    if in_eye {
        bindings.push(binding(PLACES, size_of::<[f32; 3]>()));
        attributes.push(attribute(PLACES, 0, vk::Format::R32G32B32_SFLOAT, 0));
    }
    let graphics = GraphicsInfo {
        name: if lit.is_none() { "terrain, debug" } else { "terrain" },
        words: [&shaders::ground(placed, morphs, ground), &shaders::terrain(ground)],
        into: info.into,
        bindings: &bindings,
        attributes: &attributes,
        cull: vk::CullModeFlags::BACK,
        depth_compare: Some(nearer(info.settings.depth_order)),
        depth_write: true,
        blend: false,
    };
    Pipeline::graphics(info.device, layout, &graphics)
}

fn attributes_of_vertices(with_position: bool) -> Vec<vk::VertexInputAttributeDescription> {
    let position = offset_of!(PatchVertex, position);
    let triple = vk::Format::R32G32B32_SFLOAT;
    let mut list = Vec::new();
    if with_position {
        list.push(attribute(VERTICES, 0, triple, position + offset_of!(TwoFloat, hi)));
        list.push(attribute(VERTICES, 1, triple, position + offset_of!(TwoFloat, lo)));
    }
    let (oct, byte) = (vk::Format::R16G16_SNORM, vk::Format::R8G8B8A8_UNORM);
    list.push(attribute(VERTICES, 2, oct, offset_of!(PatchVertex, normal_oct)));
    list.push(attribute(VERTICES, 3, byte, offset_of!(PatchVertex, layers)));
    let height = offset_of!(PatchVertex, height_m);
    list.push(attribute(VERTICES, 4, vk::Format::R32_SFLOAT, height));
    list
}

fn attributes_of_morphs() -> [vk::VertexInputAttributeDescription; 4] {
    let at = |location, format, offset| attribute(MORPHS, location, format, offset);
    [
        at(5, vk::Format::R32G32B32_SFLOAT, offset_of!(PatchMorph, from_m)),
        at(6, vk::Format::R16G16_SNORM, offset_of!(PatchMorph, normal_oct)),
        at(7, vk::Format::R8G8B8A8_UNORM, offset_of!(PatchMorph, layers)),
        at(8, vk::Format::R32_UINT, offset_of!(PatchMorph, born_ms)),
    ]
}

fn binding(number: u32, stride: usize) -> vk::VertexInputBindingDescription {
    vk::VertexInputBindingDescription::default()
        .binding(number)
        .stride(u32::try_from(stride).expect("a vertex is a few bytes"))
        .input_rate(vk::VertexInputRate::VERTEX)
}

fn attribute(
    binding: u32,
    location: u32,
    format: vk::Format,
    offset: usize,
) -> vk::VertexInputAttributeDescription {
    let offset = u32::try_from(offset).expect("a vertex is a few bytes");
    vk::VertexInputAttributeDescription { location, binding, format, offset }
}

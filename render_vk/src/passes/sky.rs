//! The sky: one triangle behind everything.
//!
//! In:    the view; no vertices.
//! Out:   colour where the farthest range has no ground. No depth.
//! Keeps: nothing.
//! Not here: the air's arithmetic (`shaders/air.wgsl`).

use super::{PassInfo, nearer};
use crate::error::Fault;
use crate::parts::Lit;
use crate::shaders;
use crate::vk::pipeline::{GraphicsInfo, Layout, Pipeline};
use ash::vk;

/// Drawn last in the farthest range, infinitely far: so only pixels without ground are shaded.
pub(crate) fn pipeline(info: &PassInfo<'_>, layout: &Layout, lit: Lit) -> Result<Pipeline, Fault> {
    let words = shaders::sky(lit);
    let compare = match nearer(info.settings.depth_order) {
        vk::CompareOp::GREATER => vk::CompareOp::GREATER_OR_EQUAL,
        _ => vk::CompareOp::LESS_OR_EQUAL,
    };
    let graphics = GraphicsInfo {
        name: "sky",
        words: [&words, &words],
        into: info.into,
        bindings: &[],
        attributes: &[],
        cull: vk::CullModeFlags::NONE,
        depth_compare: Some(compare),
        depth_write: false,
        blend: false,
    };
    Pipeline::graphics(info.device, layout, &graphics)
}

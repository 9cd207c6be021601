//! The sky: one triangle behind everything.
//!
//! In:    the view; no vertices.
//! Out:   colour where the farthest range has no ground. No depth.
//! Keeps: nothing.
//! Not here: the air's arithmetic (`shaders/air.wgsl`).

use crate::error::Fault;
use crate::shaders;
use crate::targets::Targets;
use crate::vk::Device;
use crate::vk::pipeline::{GraphicsInfo, Layout, Pipeline};
use ash::vk;
use std::sync::Arc;

/// Drawn last in the farthest range, at depth 0: so only pixels without ground are shaded.
pub(crate) fn pipeline(
    device: &Arc<Device>,
    layout: &Layout,
    targets: &Targets,
) -> Result<Pipeline, Fault> {
    let info = GraphicsInfo {
        name: "sky",
        words: &shaders::sky(),
        pass: &targets.first_pass,
        size_px: targets.size_px,
        bindings: &[],
        attributes: &[],
        cull: vk::CullModeFlags::NONE,
        depth_compare: vk::CompareOp::GREATER_OR_EQUAL,
        depth_write: false,
    };
    Pipeline::graphics(device, layout, &info)
}

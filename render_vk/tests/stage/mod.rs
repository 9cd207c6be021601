//! Where tests play: a renderer or none, and triangles put before a camera.
//!
//! In:    settings; corners in f64.
//! Out:   [`Renderer`] or `None`, patch arenas, draws, pixels that stand out.
//! Keeps: nothing.
//! Not here: a planet (`planet`), what is asserted (the tests).

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::frame::data::{RangeDraws, ViewDraws};
use overfly_core::geodesy::Ecef;
use overfly_core::mesh::patches::Leaf;
use overfly_core::mesh::{PatchVertex, Patches};
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_render_vk::{Renderer, RendererSettings, StartError};

/// Pure magenta, which no ground is: what a test sees through a hole.
pub const MAGENTA: [f32; 3] = [1.0, 0.0, 1.0];

/// One float range that runs backward, whole patches, nothing that moves, no validation.
pub fn settings(size_px: [u32; 2], patches_max: u32) -> RendererSettings {
    RendererSettings {
        patch_depth: 0,
        patches_max,
        size_px,
        ranges_max: 8,
        depth_format: DepthFormat::D32F,
        depth_order: DepthOrder::Reversed,
        vertices: VertexPrecision::TwoFloat,
        morph_s: 0.0,
        sea: false,
        sun: false,
        imagery: false,
        tolerance_px: 1.0,
        keep_depth: false,
        frames_in_flight: 2,
        validation: false,
    }
}

/// A renderer, or `None` after telling why there is none and that this is allowed.
pub fn renderer(settings: &RendererSettings) -> Option<Renderer> {
    let fault = match Renderer::new(settings) {
        Ok(renderer) => return Some(renderer),
        Err(fault) => fault,
    };
    let absent =
        matches!(fault, StartError::NoLibrary { .. } | StartError::NoDevice | StartError::NoLayer);
    assert!(absent, "{fault}");
    let required = std::env::var_os("OVERFLY_REQUIRE_GPU").is_some_and(|v| v == "1");
    assert!(!required, "OVERFLY_REQUIRE_GPU=1, but {fault}");
    println!("skipped: {fault}");
    None
}

/// Patches of one triangle each, counter-clockwise as seen; slots in order.
pub fn triangles(corners: &[[DVec3; 3]]) -> Patches {
    let mut patches = Patches::new(0, u32::try_from(corners.len()).unwrap());
    for (diamond, corners) in (0..).zip(corners) {
        let slot = patches.take(Leaf { diamond, side: 0 }) as usize;
        for (vertex, &corner) in patches.vertices[3 * slot..][..3].iter_mut().zip(corners) {
            *vertex = PatchVertex { position: Ecef(corner).two_float(), ..PatchVertex::EMPTY };
        }
    }
    patches
}

/// These slots in every range between the rising borders; the last is infinite.
pub fn draws(camera: Camera, slots: &[u32], borders_m: &[f64]) -> ViewDraws {
    let far = borders_m[1..].iter().map(|f| f * 1.001).chain([f64::INFINITY]);
    let range = |(&near_m, far_m)| RangeDraws { near_m, far_m, patches: slots.to_vec() };
    ViewDraws { camera, ranges: borders_m.iter().zip(far).map(range).collect() }
}

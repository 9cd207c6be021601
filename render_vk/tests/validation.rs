//! Vulkan is used as it wants to be: every view, every depth setting, from start to shutdown.
//!
//! In:    the planet of `planet`, the Khronos validation layer with all that it can check.
//! Out:   no message while drawing, none when it ends; a planted hazard is reported.
//! Keeps: a folder for the layer's log, thrown away.
//! Not here: real scenes (`tests/contracts/validation.rs` of the workspace), windows.
//!
//! The layer reads its settings when it is loaded, so each test runs itself once more in a process
//! of its own. What it says after a renderer is gone is in its log only.

mod planet;
#[expect(dead_code, reason = "settings and skipping only: there is a planet to draw")]
mod stage;

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::frame::data::ViewDraws;
use overfly_core::inspect::PatchInfo;
use overfly_core::mesh::{PatchMorph, Patches};
use overfly_core::scene::FrameParts;
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_jobs::Team;
use overfly_render_vk::{Backdrop, Overlay, Picture, Renderer, RendererSettings, Show};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

const SIZE_PX: [u32; 2] = [64, 48];
const PATCHES: u32 = 8 << 4;
/// As `ranges: Auto` has them over the Earth, for all but reversed floats.
const AUTO_M: [f64; 4] = [0.1, 17.8, 3180.0, 5.7e5];
const THREE_M: [f64; 3] = [0.1, 30.0, 1e4];

/// Format, order, near borders.
type Depth = (DepthFormat, DepthOrder, &'static [f64]);

const DEPTHS: [Depth; 5] = [
    (DepthFormat::D32F, DepthOrder::Reversed, &[0.1]),
    (DepthFormat::D32F, DepthOrder::Forward, &AUTO_M),
    (DepthFormat::D24, DepthOrder::Reversed, &AUTO_M),
    (DepthFormat::D24, DepthOrder::Forward, &AUTO_M),
    (DepthFormat::D32F, DepthOrder::Reversed, &THREE_M),
];

/// Runs a test of this file in a process of its own with a layer that checks everything. `None`
/// in that process, else whether it passed and what the layer logged.
fn alone(test: &str) -> Option<(bool, String)> {
    const MARK: &str = "OVERFLY_VALIDATED";
    if std::env::var_os(MARK).is_some() {
        return None;
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).unwrap();
    let (log, layer) = (folder.join("log.txt"), folder.join("vk_layer_settings.txt"));
    let _ = fs::remove_file(&log);
    let text = format!(
        "khronos_validation.debug_action = VK_DBG_LAYER_ACTION_LOG_MSG\n\
         khronos_validation.report_flags = error,warn\n\
         khronos_validation.log_filename = {}\n\
         khronos_validation.enables = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT,\
         VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT\n",
        log.display()
    );
    fs::write(&layer, text).unwrap();
    let mut child = Command::new(std::env::current_exe().unwrap());
    let child = child
        .args(["--exact", test, "--nocapture"])
        .env(MARK, "1")
        .env("VK_LAYER_SETTINGS_PATH", &layer)
        .env("VK_LAYER_ENABLES", "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT");
    let passed = child.status().unwrap().success();
    Some((passed, fs::read_to_string(&log).unwrap_or_default()))
}

fn settings(depth: Depth, vertices: VertexPrecision, morph_s: f64) -> RendererSettings {
    RendererSettings {
        patch_depth: planet::PATCH_DEPTH,
        depth_format: depth.0,
        depth_order: depth.1,
        vertices,
        morph_s,
        keep_depth: true,
        validation: true,
        ..stage::settings(SIZE_PX, PATCHES)
    }
}

fn far_camera(size_px: [u32; 2]) -> Camera {
    planet::camera(DVec3::new(0.8, 0.5, 0.33).normalize() * 2.5e7, DVec3::ZERO, size_px, 40.0)
}

fn low_camera(size_px: [u32; 2]) -> Camera {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.45e6;
    planet::camera(eye, DVec3::new(0.7, 0.5, 0.53).normalize() * 6.36e6, size_px, 60.0)
}

fn scene(morphs: bool) -> (Patches, Vec<PatchInfo>) {
    let mut patches = planet::patches(2, 4000.0);
    if morphs {
        let morph = PatchMorph { from_m: [900.0, 0.0, -400.0], born_ms: 100, ..PatchMorph::EMPTY };
        patches.morphs = vec![morph; patches.vertices.len()];
    }
    let info = PatchInfo { error_px: 0.7, level: 5, page_depth: 3, lacking: 0, seen: 1 };
    let infos = vec![info; patches.used_end() as usize];
    (patches, infos)
}

fn draw(
    renderer: &mut Renderer,
    (view, patches, infos): (&ViewDraws, &Patches, &[PatchInfo]),
    show: Show,
    overlay: &Overlay,
) {
    let sun_direction = Some(DVec3::new(1.0, 0.4, 0.3).normalize());
    let parts = FrameParts { sun_direction, sea: true };
    let sky = show != Show::Culled;
    let picture = Picture {
        time_ms: 300,
        show,
        infos,
        overlay,
        backdrop: if sky { Backdrop::Sky } else { Backdrop::Colour(stage::MAGENTA) },
        ..Picture::of(view, patches, &parts)
    };
    renderer.draw(&picture, &Team::alone()).unwrap();
}

/// From the first picture through all views, resizes and jumps.
fn use_all(renderer: &mut Renderer, borders_m: &[f64], (patches, infos): (&Patches, &[PatchInfo])) {
    let mut overlay = Overlay::default();
    overlay.text([2.0, 2.0], 1.0, [255, 255, 255, 255], "HUD");
    overlay.segment(DVec3::X * 6.4e6, DVec3::Y * 6.4e6, [255, 0, 0, 128]);
    for show in Show::ALL {
        let view = planet::draws(low_camera(SIZE_PX), patches, borders_m);
        draw(renderer, (&view, patches, infos), show, &Overlay::EMPTY);
        // Twice, since each frame in flight has buffers of its own.
        draw(renderer, (&view, patches, infos), show, &overlay);
        draw(renderer, (&view, patches, infos), show, &overlay);
        renderer.read_pixels().unwrap();
        renderer.read_depth().unwrap();
    }
    let before = renderer.device_totals();
    for step in 0..20_u32 {
        let size_px = [[64, 48], [1, 1], [97, 33], [48, 64]][(step % 4) as usize];
        renderer.resize(size_px).unwrap();
        // The eye jumps, and with it everything is built anew.
        let camera = [far_camera, low_camera][(step % 2) as usize];
        let view = planet::draws(camera(size_px), patches, borders_m);
        renderer.note_built(&(0..patches.used_end()).collect::<Vec<_>>());
        draw(renderer, (&view, patches, infos), Show::Shaded, &overlay);
    }
    renderer.resize(SIZE_PX).unwrap();
    assert_eq!(renderer.device_totals(), before, "memory after resizing");
}

#[test]
fn every_view_and_depth_setting_leaves_the_layer_silent_from_start_to_shutdown() {
    let test = "every_view_and_depth_setting_leaves_the_layer_silent_from_start_to_shutdown";
    if let Some((passed, log)) = alone(test) {
        assert!(passed);
        assert!(log.is_empty(), "the layer's log: {log}");
        return;
    }
    let places = [VertexPrecision::TwoFloat, VertexPrecision::EyeF64];
    let variants = places.into_iter().flat_map(|place| DEPTHS.map(|depth| (place, depth)));
    for (index, (vertices, depth)) in variants.enumerate() {
        // Five depths: so each comes with and without morphs.
        let morph_s = if index % 2 == 0 { 0.5 } else { 0.0 };
        let settings = settings(depth, vertices, morph_s);
        let Some(mut renderer) = stage::renderer(&settings) else { return };
        let (patches, infos) = scene(morph_s > 0.0);
        use_all(&mut renderer, depth.2, (&patches, &infos));
        let messages = renderer.validation_messages();
        assert!(messages.is_empty(), "{settings:?}: {}", messages.join("\n"));
    }
}

#[test]
fn a_planted_hazard_is_in_the_messages_and_in_the_log() {
    let test = "a_planted_hazard_is_in_the_messages_and_in_the_log";
    let settings = settings(DEPTHS[0], VertexPrecision::TwoFloat, 0.0);
    if let Some((passed, log)) = alone(test) {
        assert!(passed);
        let skipped = stage::renderer(&settings).is_none();
        assert!(skipped || log.contains("READ-AFTER-WRITE") || log.contains("READ_AFTER_WRITE"));
        return;
    }
    let Some(mut renderer) = stage::renderer(&settings) else { return };
    renderer.cause_hazard_on_purpose().unwrap();
    let messages = renderer.validation_messages();
    assert!(messages.iter().any(|m| m.contains("READ-AFTER-WRITE")), "{messages:?}");
}

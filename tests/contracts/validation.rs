//! Every preset in every debug view and depth setting leaves the validation layer silent.
//!
//! In:    presets with few triangles, a bundled flight; the Khronos validation layer, or none.
//! Out:   no message; skipped by name without a device or layer.
//! Keeps: nothing.
//! Not here: hazards planted on purpose, the layer's log at shutdown (`render_vk/tests`).

use super::flights::Tour;
use super::pictures::device;
use overfly::core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly::render_vk::{Renderer, RendererSettings, Show};
use overfly::{Overfly, config};
use std::process::Command;

const SIZES_PX: [[u32; 2]; 2] = [[64, 48], [33, 97]];
/// As `ranges: Auto` has them over the Earth.
const AUTO_M: [f64; 3] = [17.8, 3180.0, 5.7e5];

const DEPTHS: [(DepthFormat, DepthOrder, &[f64]); 5] = [
    (DepthFormat::D32F, DepthOrder::Reversed, &[]),
    (DepthFormat::D32F, DepthOrder::Forward, &AUTO_M),
    (DepthFormat::D24, DepthOrder::Reversed, &AUTO_M),
    (DepthFormat::D24, DepthOrder::Forward, &AUTO_M),
    (DepthFormat::D32F, DepthOrder::Reversed, &[30.0, 1e4]),
];

fn tour(preset: &str, depth: usize) -> Tour {
    let mut scene = config::load(preset).unwrap();
    let (format, order, splits_m) = DEPTHS[depth];
    (scene.depth.format, scene.depth.order) = (format, order);
    scene.depth.splits_m = splits_m.to_vec();
    scene.lod.triangles_max = 4000;
    scene.vertices =
        [VertexPrecision::TwoFloat, VertexPrecision::EyeF64][(depth + preset.len()) % 2];
    let overfly = Overfly::new(&scene, 1).unwrap();
    let mut tour = Tour::over(overfly, scene, "descent");
    let limits = tour.overfly.terrain().limits();
    let settings = RendererSettings::of(&tour.scene, limits, SIZES_PX[0]);
    let settings = RendererSettings { validation: true, keep_depth: true, ..settings };
    tour.overfly.set_renderer(Renderer::new(&settings).unwrap());
    tour
}

/// A frame of the flight at a size, drawn.
fn frame(tour: &mut Tour, index: usize, size_px: [u32; 2]) {
    tour.overfly.with_renderer(|renderer| renderer.resize(size_px).unwrap());
    let pose = &tour.flight.poses[index];
    tour.input.time_s = pose.time_s;
    tour.input.views.clear();
    let view = overfly::replay::view_of(pose, &tour.scene.views[0], size_px, &tour.scene.body);
    tour.input.views.push(view);
    tour.loader.fetch(&tour.output.wanted, &mut tour.input.arrived);
    tour.overfly.frame_drawn(&mut tour.input, &mut tour.output, 0).unwrap();
}

/// Starts, shows everything, jumps and resizes; then reads what the layer said.
fn use_all(preset: &str, depth: usize) {
    let mut tour = tour(preset, depth);
    let frames = tour.flight.poses.len();
    for (step, show) in Show::ALL.into_iter().enumerate() {
        tour.overfly.looks_mut().show = show;
        tour.overfly.looks_mut().overlay.text([1.0, 1.0], 1.0, [255; 4], show.name());
        // Some frames in a row, then a jump to elsewhere and to another size.
        let first = (step * 5 % 8) * frames / 9;
        let size_px = SIZES_PX[step % 2];
        (first..first + 3).for_each(|index| frame(&mut tour, index, size_px));
        tour.overfly.with_renderer(|renderer| {
            renderer.read_pixels().unwrap();
            renderer.read_depth().unwrap();
        });
    }
    let messages = tour.overfly.with_renderer(|r| r.validation_messages()).unwrap();
    assert!(messages.is_empty(), "{preset}, {:?}: {}", DEPTHS[depth], messages.join("\n"));
}

#[test]
fn every_preset_view_and_depth_setting_leaves_the_layer_silent() {
    let test = "every_preset_view_and_depth_setting_leaves_the_layer_silent";
    const CHECKS: &str = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    if !device(test) {
        return;
    }
    let layers = overfly::render_vk::layers().unwrap();
    if !layers.iter().any(|layer| layer == "VK_LAYER_KHRONOS_validation") {
        println!("{test} skipped: no layer");
        return;
    }
    // The layer reads this when it is loaded, so in a process of its own.
    if std::env::var_os("VK_LAYER_ENABLES").is_none() {
        let mut child = Command::new(std::env::current_exe().unwrap());
        let name = format!("contracts::validation::{test}");
        let child = child.args(["--exact", &name, "--nocapture"]).env("VK_LAYER_ENABLES", CHECKS);
        assert!(child.status().unwrap().success());
        return;
    }
    for preset in ["earth", "moon", "small"] {
        (0..DEPTHS.len()).for_each(|depth| use_all(preset, depth));
    }
}

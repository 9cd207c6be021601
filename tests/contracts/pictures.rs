//! Pictures: drawing changes nothing, and Vulkan is used as it wants to be.
//!
//! In:    the built binary and library; a Vulkan device, or none.
//! Out:   passes or fails; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: a folder for each test, thrown away.
//! Not here: the renderer's own tests (`render_vk`).

use super::command_line::command;
use super::flights::Tour;
use overfly::render_vk::{Renderer, RendererSettings, devices};

/// Whether there is a device; says so where there is none.
pub fn device(test: &str) -> bool {
    let found = devices().is_ok_and(|devices| !devices.is_empty());
    let required = std::env::var("OVERFLY_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(found || !required, "OVERFLY_REQUIRE_GPU=1 and no Vulkan device");
    if !found {
        println!("{test} skipped: no Vulkan device");
    }
    found
}

fn with_renderer(mut tour: Tour) -> Tour {
    let limits = tour.overfly.terrain().limits();
    let renderer = Renderer::new(&RendererSettings::of(&tour.scene, limits, [640, 360]));
    tour.overfly.set_renderer(renderer.unwrap());
    tour
}

#[test]
fn drawing_does_not_change_a_bit_and_a_still_camera_uploads_nothing() {
    if !device("drawing_does_not_change_a_bit_and_a_still_camera_uploads_nothing") {
        return;
    }
    let mut plain = Tour::new("descent", "small", 1);
    let mut drawn = with_renderer(Tour::new("descent", "small", 1));
    for index in (0..8000).step_by(400) {
        plain.frame(index, false);
        drawn.frame(index, true);
        assert_eq!(plain.output.digest, drawn.output.digest, "frame {index}");
    }
    drawn.settle(8000);
    drawn.frame(8000, true);
    let first = drawn.overfly.with_renderer(|renderer| renderer.read_pixels().unwrap());
    let report = drawn.overfly.frame_drawn(&mut drawn.input, &mut drawn.output, 0);
    assert_eq!(report.unwrap().unwrap().uploaded_patches, 0);
    drop(first);
}

#[test]
fn stills_of_all_flights_leave_the_validation_layer_silent() {
    if !device("stills_of_all_flights_leave_the_validation_layer_silent") {
        return;
    }
    let layers = overfly::render_vk::layers().unwrap();
    if !layers.iter().any(|layer| layer == "VK_LAYER_KHRONOS_validation") {
        println!("stills_of_all_flights_leave_the_validation_layer_silent skipped: no layer");
        return;
    }
    for flight in overfly::replay::BUNDLED {
        let folder = tempfile::tempdir().unwrap();
        let done = command()
            .args(["replay", flight, "--validate", "--stills", "3", "--size", "320x180"])
            .args(["--frames", "0..10800", "--out"])
            .arg(folder.path())
            .env(
                "VK_LAYER_ENABLES",
                "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:\
                 VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT",
            )
            .output()
            .unwrap();
        let out = String::from_utf8_lossy(&done.stdout);
        let err = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{flight}: {out}{err}");
        assert!(out.contains("validation messages: 0"), "{flight}: {out}{err}");
        let stills = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(stills, 4, "three stills and a contact sheet");
    }
}

//! Pictures of a made-up planet, looked at pixel by pixel.
//!
//! In:    the planet of `planet`, drawn without a window.
//! Out:   no cracks, same pictures however they are cut and recorded, clean validation.
//! Keeps: nothing.
//! Not here: whether it looks good (`examples/ball.rs`).
//!
//! Without a Vulkan device the tests print so and pass, unless `OVERFLY_REQUIRE_GPU=1`.

mod planet;

use glam::DVec3;
use overfly_core::camera::Camera;
use overfly_core::frame::data::ViewDraws;
use overfly_core::mesh::Patches;
use overfly_core::scene::FrameParts;
use overfly_core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly_jobs::{Graph, Span, Team, Workers};
use overfly_render_vk::{DrawError, Picture, Renderer, RendererSettings, StartError};
use std::process::Command;
use std::sync::Mutex;

const SIZE_PX: [u32; 2] = [480, 320];
const DISTANCE_M: f64 = 2.5e7;
/// Black where there is no ground: no air, and lit from all sides.
const AIRLESS: FrameParts = FrameParts { sun_direction: None, sea: false };

fn earth() -> FrameParts {
    FrameParts { sun_direction: Some(DVec3::new(1.0, 0.4, 0.3).normalize()), sea: true }
}

fn settings(validation: bool) -> RendererSettings {
    RendererSettings {
        patch_depth: planet::PATCH_DEPTH,
        patches_max: 8 << 8,
        size_px: SIZE_PX,
        ranges_max: 3,
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
        validation,
    }
}

/// A renderer, or `None` after telling why there is none and that this is allowed.
fn renderer(validation: bool) -> Option<Renderer> {
    let fault = match Renderer::new(&settings(validation)) {
        Ok(renderer) => return Some(renderer),
        Err(fault) => fault,
    };
    let absent = matches!(fault, StartError::NoLibrary { .. } | StartError::NoDevice);
    let no_layer = matches!(fault, StartError::NoLayer);
    assert!(absent || no_layer, "{fault}");
    let required = std::env::var_os("OVERFLY_REQUIRE_GPU").is_some_and(|v| v == "1");
    assert!(!required, "OVERFLY_REQUIRE_GPU=1, but {fault}");
    println!("skipped: {}", if absent { "no Vulkan device" } else { "no validation layer" });
    None
}

fn far_camera() -> Camera {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * DISTANCE_M;
    planet::camera(eye, DVec3::ZERO, SIZE_PX, 40.0)
}

/// Over the hills, with ground from near to the horizon.
fn low_camera() -> Camera {
    let eye = DVec3::new(0.8, 0.5, 0.33).normalize() * 6.45e6;
    let target = DVec3::new(0.7, 0.5, 0.53).normalize() * 6.36e6;
    planet::camera(eye, target, SIZE_PX, 60.0)
}

fn picture(
    renderer: &mut Renderer,
    (view, patches): (&ViewDraws, &Patches),
    parts: &FrameParts,
    team: &Team<'_>,
) -> Vec<u8> {
    renderer.draw(&Picture::of(view, patches, parts), team).unwrap();
    renderer.read_pixels().unwrap()
}

fn pixel(picture: &[u8], x: u32, y: u32) -> [u8; 3] {
    let at = 4 * (y * SIZE_PX[0] + x) as usize;
    [picture[at], picture[at + 1], picture[at + 2]]
}

fn different_pixels(a: &[u8], b: &[u8]) -> usize {
    assert_eq!(a.len(), b.len());
    a.chunks_exact(4).zip(b.chunks_exact(4)).filter(|(a, b)| a != b).count()
}

#[test]
fn the_planet_is_a_round_disc_without_holes_in_black_space() {
    let Some(mut renderer) = renderer(false) else { return };
    let patches = planet::patches(4, 0.0);
    let view = planet::draws(far_camera(), &patches, &[1.0]);
    let shown = picture(&mut renderer, (&view, &patches), &AIRLESS, &Team::alone());
    let pixels_per_radian = view.camera.pixels_per_radian;
    // The limb is where lines of sight graze; the ellipsoid is between its two radii.
    let limb_px = |radius_m: f64| {
        radius_m / (DISTANCE_M * DISTANCE_M - radius_m * radius_m).sqrt() * pixels_per_radian
    };
    let (inner, outer) = (limb_px(6.35e6) - 1.5, limb_px(6.379e6) + 1.5);
    let mut inside = 0;
    for y in 0..SIZE_PX[1] {
        for x in 0..SIZE_PX[0] {
            let (dx, dy) = (f64::from(x) + 0.5 - 240.0, f64::from(y) + 0.5 - 160.0);
            let from_middle = (dx * dx + dy * dy).sqrt();
            let black = pixel(&shown, x, y) == [0, 0, 0];
            assert!(from_middle > inner || !black, "a hole at {x}, {y}");
            assert!(from_middle < outer || black, "ground in space at {x}, {y}");
            inside += usize::from(!black);
        }
    }
    assert!(inside > 10_000, "only {inside} pixels of ground");
}

#[test]
fn the_picture_is_not_mirrored_and_shows_the_near_side() {
    let Some(mut renderer) = renderer(false) else { return };
    let mut patches = planet::patches(4, 0.0);
    let paint = |v: &mut overfly_core::mesh::PatchVertex| {
        let [x, y, z] = v.position.hi;
        // Seen from +x the north-east quarter is bright; the far side is not, so that it shows if
        // the wrong faces are culled.
        let bright = x > 0.0 && y > 0.0 && z > 0.0;
        v.layers = if bright { [255, 255, 0, 0] } else { [0, 0, 0, 0] };
    };
    patches.vertices.iter_mut().for_each(paint);
    let camera = planet::camera(DVec3::X * DISTANCE_M, DVec3::ZERO, SIZE_PX, 40.0);
    let view = planet::draws(camera, &patches, &[1.0]);
    let shown = picture(&mut renderer, (&view, &patches), &AIRLESS, &Team::alone());
    let green = |x, y| pixel(&shown, x, y)[1];
    let north_east = green(270, 130);
    for (x, y) in [(210, 130), (210, 190), (270, 190)] {
        let other = green(x, y);
        assert!(other > 0 && north_east > other + 30, "{north_east} and {other} at {x}, {y}");
    }
}

#[test]
fn three_depth_ranges_give_the_picture_of_one() {
    let Some(mut renderer) = renderer(false) else { return };
    let patches = planet::patches(4, 4000.0);
    let team = Team::alone();
    for (camera, borders_m) in [
        (far_camera(), [1.0, 1.8e7, 2.1e7]),
        (far_camera(), [1.0, 1e3, 1.9e7]),
        (low_camera(), [1.0, 2e5, 6e5]),
    ] {
        let one = planet::draws(camera, &patches, &borders_m[..1]);
        let three = planet::draws(camera, &patches, &borders_m);
        let one = picture(&mut renderer, (&one, &patches), &earth(), &team);
        let three = picture(&mut renderer, (&three, &patches), &earth(), &team);
        let different = different_pixels(&one, &three);
        let allowed = (SIZE_PX[0] * SIZE_PX[1]) as usize / 2000;
        assert!(different <= allowed, "{different} pixels differ, {borders_m:?}");
    }
}

#[test]
fn the_same_draws_give_the_same_bits_and_nothing_to_upload() {
    let Some(mut renderer) = renderer(false) else { return };
    let patches = planet::patches(4, 4000.0);
    let view = planet::draws(low_camera(), &patches, &[1.0, 2e5]);
    let team = Team::alone();
    renderer.note_built(&(0..patches.used_end()).collect::<Vec<_>>());
    let first = renderer.draw(&Picture::of(&view, &patches, &earth()), &team).unwrap();
    let picture = renderer.read_pixels().unwrap();
    assert_eq!(first.uploaded_patches, 8 << 8);
    assert_eq!(first.uploaded_bytes, u64::from(first.uploaded_patches) * 15 * 36);
    assert_eq!((first.draws, first.triangles), (2 * (8 << 8), 2 * (8 << 12)));
    assert_eq!((first.secondaries, first.commands), (2 + 1, 2));
    for _ in 0..3 {
        let again = renderer.draw(&Picture::of(&view, &patches, &earth()), &team).unwrap();
        assert_eq!((again.uploaded_patches, again.uploaded_bytes), (0, 0));
        assert!(renderer.read_pixels().unwrap() == picture);
    }
    renderer.note_built(&[7, 8, 2000, u32::MAX]);
    assert_eq!(
        renderer.draw(&Picture::of(&view, &patches, &earth()), &team).unwrap().uploaded_patches,
        3
    );
}

#[test]
fn more_patches_than_the_staging_buffer_holds_arrive_all() {
    // Fifteen vertices of 36 bytes: 4 MiB hold 7767 patches of 8192.
    let large = RendererSettings { patches_max: 8 << 10, ..settings(false) };
    if renderer(false).is_none() {
        return;
    }
    let mut renderer = Renderer::new(&large).unwrap();
    let patches = planet::patches(5, 0.0);
    let view = planet::draws(far_camera(), &patches, &[1.0]);
    let team = Team::alone();
    let report = renderer.draw(&Picture::of(&view, &patches, &AIRLESS), &team).unwrap();
    assert_eq!(report.uploaded_patches, 8 << 10);
    let first = renderer.read_pixels().unwrap();
    renderer.note_built(&(0..patches.used_end()).collect::<Vec<_>>());
    let again = picture(&mut renderer, (&view, &patches), &AIRLESS, &team);
    assert!(first == again);
    assert!(pixel(&first, 240, 160) != [0, 0, 0]);
}

struct Shared {
    renderer: Renderer,
    view: ViewDraws,
    patches: Patches,
    shown: Vec<u8>,
}

#[test]
fn recording_alone_or_on_two_workers_gives_the_same_bits() {
    for vertices in [VertexPrecision::TwoFloat, VertexPrecision::EyeF64] {
        for borders_m in [&[1.0][..], &[1.0, 2e5, 6e5]] {
            if renderer(false).is_none() {
                return;
            }
            let settings = RendererSettings { vertices, ..settings(false) };
            two_workers_agree_with_one(Renderer::new(&settings).unwrap(), borders_m);
        }
    }
}

fn two_workers_agree_with_one(mut renderer: Renderer, borders_m: &[f64]) {
    let patches = planet::patches(4, 4000.0);
    let view = planet::draws(low_camera(), &patches, borders_m);
    let alone = picture(&mut renderer, (&view, &patches), &earth(), &Team::alone());
    let shared = Mutex::new(Shared { renderer, view, patches, shown: Vec::new() });
    let workers = Workers::new(2).unwrap();
    let mut graph = Graph::<Mutex<Shared>>::new();
    graph.stage(Span("test.draw"), &[], |shared, team| {
        assert_eq!(team.workers(), 2);
        let Shared { renderer, view, patches, shown } = &mut *shared.lock().unwrap();
        *shown = picture(renderer, (view, patches), &earth(), team);
    });
    for _ in 0..4 {
        graph.run(&shared, &workers).unwrap();
        assert!(shared.lock().unwrap().shown == alone);
    }
}

#[test]
fn draws_that_do_not_fit_the_renderer_are_refused_and_it_stays_usable() {
    let Some(mut renderer) = renderer(false) else { return };
    let mut patches = planet::patches(4, 0.0);
    let team = Team::alone();
    assert!(matches!(renderer.read_pixels(), Err(DrawError::NothingDrawn)));
    let good = planet::draws(far_camera(), &patches, &[1.0]);
    let other_size = planet::camera(DVec3::X * 1e7, DVec3::ZERO, [64, 64], 40.0);
    let mut refused = |view: &ViewDraws, patches: &Patches| {
        renderer.draw(&Picture::of(view, patches, &AIRLESS), &team).unwrap_err().to_string()
    };
    let text = refused(&planet::draws(other_size, &patches, &[1.0]), &patches);
    assert_eq!(text, "the view is 64 x 64 pixels, the renderer's pictures are 480 x 320");
    let text = refused(&planet::draws(far_camera(), &patches, &[1.0, 2.0, 3.0, 4.0]), &patches);
    assert_eq!(text, "the view has 4 depth ranges, the renderer allows 3");
    let text = refused(&good, &Patches::new(6, 10));
    assert_eq!(text, "the arena has 10 patches of depth 6, the renderer 2048 of depth 4");
    patches.give_back(5);
    assert_eq!(refused(&good, &patches), "the view draws slot 5, which holds no patch");
    patches.take(overfly_core::mesh::patches::Leaf { diamond: 5, side: 0 });
    assert!(renderer.draw(&Picture::of(&good, &patches, &AIRLESS), &team).is_ok());
}

#[test]
fn settings_out_of_range_are_named() {
    let with = |change: fn(&mut RendererSettings)| {
        let mut settings = settings(false);
        change(&mut settings);
        Renderer::new(&settings).err().unwrap().to_string()
    };
    assert_eq!(
        with(|s| s.patch_depth = 3),
        "renderer: patch_depth is 3, allowed is 0, 2, 4, 6 or 8"
    );
    assert_eq!(with(|s| s.ranges_max = 0), "renderer: ranges_max is 0, allowed is 1 to 16");
    assert_eq!(
        with(|s| s.patches_max = u32::MAX),
        "renderer: patches_max is 4294967295, allowed is 1 to 143165576"
    );
}

/// Runs one test of this file in a process of its own, with one variable set.
fn passes_alone(test: &str, variable: &str, value: &str) -> bool {
    let mut child = Command::new(std::env::current_exe().unwrap());
    let child = child.args(["--exact", test, "--nocapture"]).env(variable, value);
    child.status().unwrap().success()
}

#[test]
fn validation_finds_a_planted_hazard_and_nothing_else() {
    // Only read when the layer is loaded; without it hazards between submits go unseen.
    const CHECKS: &str = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    if std::env::var_os("VK_LAYER_ENABLES").is_none() {
        let test = "validation_finds_a_planted_hazard_and_nothing_else";
        assert!(passes_alone(test, "VK_LAYER_ENABLES", CHECKS));
        return;
    }
    let Some(mut renderer) = renderer(true) else { return };
    let patches = planet::patches(3, 4000.0);
    for (frame, borders_m) in (0..6).zip([&[1.0][..], &[1.0, 2e5, 6e5], &[1.0, 2e5]].iter().cycle())
    {
        let view = planet::draws(low_camera(), &patches, borders_m);
        renderer.note_built(&[frame, frame + 60, frame + 61]);
        renderer.draw(&Picture::of(&view, &patches, &earth()), &Team::alone()).unwrap();
        if frame % 2 == 1 {
            renderer.read_pixels().unwrap();
        }
    }
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "{}", messages.join("\n"));
    renderer.cause_hazard_on_purpose().unwrap();
    let messages = renderer.validation_messages();
    assert!(messages.iter().any(|m| m.contains("READ-AFTER-WRITE")), "{messages:?}");
}

#[test]
fn without_a_driver_there_is_an_error_that_names_the_package() {
    if std::env::var_os("VK_ICD_FILENAMES").is_none() {
        let test = "without_a_driver_there_is_an_error_that_names_the_package";
        assert!(passes_alone(test, "VK_ICD_FILENAMES", "/dev/null"));
        return;
    }
    let fault = Renderer::new(&settings(false)).err().unwrap();
    let text = fault.to_string();
    match fault {
        StartError::NoDevice => assert!(text.contains("mesa-vulkan-drivers"), "{text}"),
        StartError::NoLibrary { .. } => assert!(text.contains("libvulkan1"), "{text}"),
        other => panic!("{other}"),
    }
    assert!(overfly_render_vk::devices().is_err());
}

#[test]
fn devices_and_layers_can_be_listed() {
    let Some(renderer) = renderer(false) else { return };
    let devices = overfly_render_vk::devices().unwrap();
    let line = renderer.device_line();
    let own = devices.iter().find(|d| line.starts_with(&d.name)).unwrap();
    assert!(line.ends_with(&own.api_version) && !own.driver.is_empty(), "{own:?}, {line}");
    assert!(overfly_render_vk::layers().is_ok());
}

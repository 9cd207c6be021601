//! A host with its own Vulkan: the same pictures, nothing for the validation layer to say.
//!
//! In:    the host of the examples, presets; a Vulkan device and the Khronos layer, or none.
//! Out:   passes or fails; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: a folder for the examples' pictures, thrown away.
//! Not here: the renderer with a device of its own (`pictures`, `render_vk/tests`).

#[path = "../../examples/host_vulkan/mod.rs"]
#[expect(dead_code, reason = "the examples' command line is theirs")]
mod host_vulkan;

use super::pictures::device;
use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::frames::{Pane, draw};
use host_vulkan::host::{Host, Idle};
use host_vulkan::journey::{Eye, Journey};
use host_vulkan::solids::{Corner, Solids};
use overfly::config;
use overfly::core::settings::{DepthFormat, DepthOrder, SceneSettings, VertexPrecision};
use overfly::jobs::Team;
use overfly::render_vk::ash::vk;
use overfly::render_vk::{
    HostDevice, HostFrame, HostRenderer, HostTarget, Renderer, RendererSettings, Show, projection,
};
use std::path::Path;
use std::process::Command;
use std::rc::Rc;

const SIZE_PX: [u32; 2] = [240, 160];
const MEADOW: Eye =
    Eye { lat_deg: 46.85, lon_deg: -121.76, above_m: 1.6, heading_deg: 300.0, pitch_deg: -20.0 };
/// Ranges of `ranges: Auto` over the Earth.
const AUTO_M: [f64; 3] = [17.8, 3180.0, 5.7e5];

/// Whether to go on. Without a device not; and the layer reads its environment when it is loaded,
/// so the test runs in a process of its own.
fn go_on(test: &str) -> bool {
    const CHECKS: &str = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    if !device(test) {
        return false;
    }
    if std::env::var_os("VK_LAYER_ENABLES").is_some() {
        return true;
    }
    let mut child = Command::new(std::env::current_exe().unwrap());
    let name = format!("contracts::hosting::{test}");
    let child = child.args(["--exact", &name, "--nocapture"]).env("VK_LAYER_ENABLES", CHECKS);
    assert!(child.status().unwrap().success());
    false
}

/// Ends the host and asserts that the layer had nothing to say, objects that are left included.
fn end(host: Rc<Host>) {
    let (messages, validates) = (host.messages(), host.validates);
    assert_eq!(Rc::strong_count(&host), 1, "something of the host is still in use");
    drop(host);
    let messages = messages.lock().unwrap();
    assert!(messages.is_empty(), "{}", messages.join("\n"));
    if !validates {
        println!("messages unchecked: no validation layer");
    }
}

fn settings(journey: &Journey) -> RendererSettings {
    RendererSettings { frames_in_flight: IN_FLIGHT, ..journey.settings() }
}

/// A renderer for a canvas, told of all that a journey has.
fn renderer(canvas: &Canvas, journey: &Journey) -> HostRenderer {
    let (settings, host) = (settings(journey), &canvas.host);
    // SAFETY: the handles are good and belong together; each test waits until the device is idle
    // before it drops the renderer, and that before canvas and host.
    let made = unsafe { HostRenderer::new(&settings, &host.lend(), &canvas.target()) };
    let mut made = made.unwrap();
    made.note_tiles(&journey.overfly.terrain().tiles());
    made
}

/// The picture of the last frame, as a renderer with a device of its own draws it.
fn own_picture(journey: &mut Journey) -> Vec<u8> {
    journey.overfly.draw(&journey.output, 0).unwrap().unwrap();
    journey.overfly.with_renderer(|own| own.read_pixels().unwrap()).unwrap()
}

/// The picture of the last frame, as the host draws it: twice, so that both frames in flight do.
fn host_picture(
    (canvas, at_px): (&mut Canvas, [i32; 2]),
    host: &mut HostRenderer,
    journey: &mut Journey,
) -> Vec<u8> {
    let Journey { overfly, output, .. } = journey;
    let drawn = overfly.with_picture(output, 0, |picture| {
        (0..IN_FLIGHT).try_for_each(|_| {
            draw(canvas, &mut [Pane { renderer: host, picture, at_px }], |_, _| {})
        })
    });
    drawn.unwrap().unwrap();
    canvas.read_pixels().unwrap()
}

/// How many pixels differ between rows of the same widths.
fn different<'a>(a: impl Iterator<Item = &'a [u8]>, b: impl Iterator<Item = &'a [u8]>) -> usize {
    let pixels = a.zip(b).flat_map(|(a, b)| a.chunks_exact(4).zip(b.chunks_exact(4)));
    pixels.filter(|(a, b)| a != b).count()
}

/// A preset with depth and vertices set to something else.
fn scene(
    preset: &str,
    (format, order, splits_m): (DepthFormat, DepthOrder, &[f64]),
    vertices: VertexPrecision,
) -> SceneSettings {
    let mut scene = config::load(preset).unwrap();
    (scene.depth.format, scene.depth.order) = (format, order);
    scene.depth.splits_m = splits_m.to_vec();
    scene.vertices = vertices;
    scene
}

#[test]
fn a_host_s_picture_is_the_renderer_s_to_the_last_byte() {
    if !go_on("a_host_s_picture_is_the_renderer_s_to_the_last_byte") {
        return;
    }
    let three = (DepthFormat::D32F, DepthOrder::Reversed, &[30.0, 1e4][..]);
    let one = (DepthFormat::D32F, DepthOrder::Reversed, &[][..]);
    let four = (DepthFormat::D24, DepthOrder::Forward, &AUTO_M[..]);
    for (preset, depth, vertices, above_m) in [
        ("earth", three, VertexPrecision::TwoFloat, 1.6),
        ("moon", four, VertexPrecision::EyeF64, 900.0),
        ("small", one, VertexPrecision::TwoFloat, 300.0),
    ] {
        let mut journey = Journey::new(scene(preset, depth, vertices), SIZE_PX).unwrap();
        let host = Rc::new(Host::new().unwrap());
        let mut canvas = Canvas::new(&host, SIZE_PX, &settings(&journey)).unwrap();
        let mut drawn = renderer(&canvas, &journey);
        let eye = Eye { above_m, ..MEADOW };
        journey.settle(eye, &mut [&mut drawn]).unwrap();
        journey.overfly.set_renderer(Renderer::new(&journey.settings()).unwrap());
        let before = drawn.device_totals();
        for (step, show) in (0_u32..).zip([Show::Shaded, Show::Shaded, Show::Level, Show::Shaded]) {
            // On the way down, so that patches come, go and morph.
            let eye = Eye { above_m: above_m * (1.0 - 0.05 * f64::from(step)), ..eye };
            journey.frame(eye, &mut [&mut drawn]).unwrap();
            let looks = journey.overfly.looks_mut();
            looks.show = show;
            looks.overlay.clear();
            looks.overlay.text([4.0, 4.0], 2.0, [255; 4], show.name());
            let expected = own_picture(&mut journey);
            let found = host_picture((&mut canvas, [0, 0]), &mut drawn, &mut journey);
            let differ = different(expected.chunks(4), found.chunks(4));
            assert_eq!(differ, 0, "{preset}, {show:?}");
            assert!(found.chunks_exact(4).any(|pixel| pixel != &found[..4]), "one colour");
            if (preset, step) == ("earth", 0) {
                // The whole terrain is new: more than one staging buffer holds.
                assert!(drawn.device_totals().allocations > before.allocations);
            }
        }
        // The overlay and what debug views show have a buffer each for every frame in flight;
        // staging beyond the first is gone.
        let kept = before.allocations + 2 * IN_FLIGHT;
        assert_eq!(drawn.device_totals().allocations, kept, "{preset}");
        host.wait_idle().unwrap();
        drop(drawn);
        drop(canvas);
        end(host);
    }
}

#[test]
fn two_renderers_share_a_device_and_a_pass_and_go_in_any_order() {
    if !go_on("two_renderers_share_a_device_and_a_pass_and_go_in_any_order") {
        return;
    }
    let depth = (DepthFormat::D32F, DepthOrder::Reversed, &[30.0, 1e4][..]);
    let journey = |preset| {
        let mut scene = scene(preset, depth, VertexPrecision::TwoFloat);
        scene.lod.triangles_max = 20_000;
        Journey::new(scene, SIZE_PX).unwrap()
    };
    for first_goes_first in [true, false] {
        let (mut earth, mut moon) = (journey("earth"), journey("moon"));
        let host = Rc::new(Host::new().unwrap());
        let wide = [2 * SIZE_PX[0], SIZE_PX[1]];
        let mut canvas = Canvas::new(&host, wide, &settings(&earth)).unwrap();
        let (mut left, mut right) = (renderer(&canvas, &earth), renderer(&canvas, &moon));
        earth.settle(MEADOW, &mut [&mut left]).unwrap();
        moon.settle(MEADOW, &mut [&mut right]).unwrap();
        let at_px = [i32::try_from(SIZE_PX[0]).unwrap(), 0];
        for _ in 0..3 {
            draw_both(&mut canvas, (&mut left, &mut earth), (&mut right, &mut moon), at_px);
        }
        let both = canvas.read_pixels().unwrap();
        let last = if first_goes_first {
            host.wait_idle().unwrap();
            drop(left);
            let alone = host_picture((&mut canvas, at_px), &mut right, &mut moon);
            drop(right);
            (1, alone, moon)
        } else {
            host.wait_idle().unwrap();
            drop(right);
            let alone = host_picture((&mut canvas, [0, 0]), &mut left, &mut earth);
            drop(left);
            (0, alone, earth)
        };
        shows_the_same_half(&both, last);
        drop(canvas);
        end(host);
    }
}

/// One frame with the pictures of two journeys, the second at `at_px`.
fn draw_both(
    canvas: &mut Canvas,
    (left, first): (&mut HostRenderer, &mut Journey),
    (right, second): (&mut HostRenderer, &mut Journey),
    at_px: [i32; 2],
) {
    let drawn = first.overfly.with_picture(&first.output, 0, |one| {
        second.overfly.with_picture(&second.output, 0, |other| {
            let left = Pane { renderer: left, picture: one, at_px: [0, 0] };
            let right = Pane { renderer: right, picture: other, at_px };
            draw(canvas, &mut [left, right], |_, _| {})
        })
    });
    drawn.flatten().unwrap().unwrap();
}

/// A half of two pictures is the same with the other half and alone; and as a renderer with a
/// device of its own draws it. Rasterisation rounds where the half is, so a few pixels of the right
/// one may differ from that.
fn shows_the_same_half(both: &[u8], (half, alone, mut journey): (usize, Vec<u8>, Journey)) {
    let row = 4 * SIZE_PX[0] as usize;
    let rows = |pixels: &'_ [u8]| {
        let rows = pixels.chunks_exact(row).skip(half).step_by(2);
        rows.map(<[u8]>::to_vec).collect::<Vec<_>>().concat()
    };
    assert!(rows(both) == rows(&alone), "half {half} is another with its neighbour");
    journey.overfly.set_renderer(Renderer::new(&journey.settings()).unwrap());
    let expected = own_picture(&mut journey);
    let found = rows(both);
    let differ = different(expected.chunks(4), found.chunks(4));
    println!("half {half}: {differ} of {} pixels differ", found.len() / 4);
    assert!(differ <= if half == 0 { 0 } else { found.len() / 4 / 200 }, "half {half}: {differ}");
}

#[test]
fn the_layer_tells_of_an_object_that_is_left_behind() {
    let test = "the_layer_tells_of_an_object_that_is_left_behind";
    if !go_on(test) {
        return;
    }
    let host = Host::new().unwrap();
    if !host.validates {
        println!("{test} skipped: no layer");
        return;
    }
    let messages = host.messages();
    // SAFETY: creating a fence has no condition; that it is left behind is the point.
    unsafe { host.device.create_fence(&vk::FenceCreateInfo::default(), None) }.unwrap();
    drop(host);
    assert!(!messages.lock().unwrap().is_empty());
}

#[test]
fn the_host_s_geometry_and_the_ground_hide_each_other_by_depth() {
    if !go_on("the_host_s_geometry_and_the_ground_hide_each_other_by_depth") {
        return;
    }
    const AWAY_M: f32 = 6.0;
    let depth = (DepthFormat::D32F, DepthOrder::Reversed, &[30.0, 1e4][..]);
    let scene = scene("earth", depth, VertexPrecision::TwoFloat);
    let mut journey = Journey::new(scene, SIZE_PX).unwrap();
    let host = Rc::new(Host::new().unwrap());
    let settings = settings(&journey);
    let mut canvas = Canvas::new(&host, SIZE_PX, &settings).unwrap();
    // A wall across the view, magenta, which no ground is.
    let corner = |x, y| Corner { at_m: [x, y, -AWAY_M], colour: [1.0, 0.0, 1.0] };
    let [a, b, c, d] = [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)];
    let wall = Solids::new(&canvas, &[a, b, c, a, c, d], settings.depth_order).unwrap();
    let mut drawn = renderer(&canvas, &journey);
    journey.settle(MEADOW, &mut [&mut drawn]).unwrap();
    let keeping = RendererSettings { keep_depth: true, ..settings };
    journey.overfly.set_renderer(Renderer::new(&keeping).unwrap());
    let ground = own_picture(&mut journey);
    let depth = journey.overfly.with_renderer(|own| own.read_depth().unwrap()).unwrap();
    let columns = projection(&journey.output.views[0], 0, settings.depth_order).unwrap();
    let wall_depth = (columns[3][2] - columns[2][2] * AWAY_M) / AWAY_M;
    let Journey { overfly, output, .. } = &mut journey;
    let done = overfly.with_picture(output, 0, |picture| {
        let pane = Pane { renderer: &mut drawn, picture, at_px: [0, 0] };
        draw(&mut canvas, &mut [pane], |canvas, buffer| {
            // SAFETY: `draw` calls this inside the canvas's pass.
            unsafe { wall.draw(canvas, buffer, &columns) };
        })
    });
    done.unwrap().unwrap();
    let found = canvas.read_pixels().unwrap();
    let (mut before, mut behind) = (0, 0);
    for ((found, ground), depth) in found.chunks_exact(4).zip(ground.chunks_exact(4)).zip(depth) {
        if (depth - wall_depth).abs() < 1e-6 {
            continue;
        }
        let is_ground = depth > wall_depth;
        let expected = if is_ground { ground } else { &[255, 0, 255, 255] };
        assert_eq!(found, expected, "depth {depth}, the wall's {wall_depth}");
        *(if is_ground { &mut before } else { &mut behind }) += 1;
    }
    let fifth = SIZE_PX[0] * SIZE_PX[1] / 5;
    assert!(before > fifth && behind > fifth, "{before} pixels of ground, {behind} of wall");
    host.wait_idle().unwrap();
    drop(drawn);
    drop(wall);
    drop(canvas);
    end(host);
}

/// What a renderer says to a device and target that were changed.
fn refused(
    canvas: &Canvas,
    journey: &Journey,
    change: fn(&mut HostDevice, &mut HostTarget, &mut RendererSettings),
) -> String {
    let (mut device, mut target) = (canvas.host.lend(), canvas.target());
    let mut settings = settings(journey);
    change(&mut device, &mut target, &mut settings);
    // SAFETY: handles are null or good; whatever else was changed is found before it is used.
    let made = unsafe { HostRenderer::new(&settings, &device, &target) };
    made.err().expect("it cannot be drawn with").to_string()
}

#[test]
fn what_a_host_lends_wrongly_is_named() {
    if !go_on("what_a_host_lends_wrongly_is_named") {
        return;
    }
    let depth = (DepthFormat::D32F, DepthOrder::Reversed, &[][..]);
    let mut journey =
        Journey::new(scene("small", depth, VertexPrecision::TwoFloat), SIZE_PX).unwrap();
    let host = Rc::new(Host::new().unwrap());
    let mut canvas = Canvas::new(&host, SIZE_PX, &settings(&journey)).unwrap();
    let said = |change| refused(&canvas, &journey, change);
    for (found, expected) in [
        (
            said(|device, _, _| device.features = vk::PhysicalDeviceFeatures::default()),
            "the host's features is without multiDrawIndirect, allowed is required_features()",
        ),
        (
            said(|device, _, _| device.api_version = vk::API_VERSION_1_0),
            "Vulkan 1.0.0 is too old, 1.1 is needed",
        ),
        (
            said(|device, _, _| device.queue_family = 99),
            "the host's queue_family is 99, allowed is a family that draws and computes",
        ),
        (
            said(|device, _, _| device.physical_device = vk::PhysicalDevice::null()),
            "the host's physical_device is null, allowed is a handle",
        ),
        (
            said(|device, _, _| device.queue = vk::Queue::null()),
            "the host's queue is null, allowed is a handle",
        ),
        (
            said(|_, target, _| target.render_pass = vk::RenderPass::null()),
            "the host's render_pass is null, allowed is a handle",
        ),
        (
            said(|_, target, _| target.colour_format = vk::Format::R32_UINT),
            "the host's colour_format is R32_UINT, \
             allowed is one that the device draws to and blends",
        ),
        (
            said(|_, _, settings| settings.depth_format = DepthFormat::D24),
            "the host's depth_format is D32_SFLOAT, allowed is one of 24 bits (D24)",
        ),
        (
            said(|_, target, _| target.samples = vk::SampleCountFlags::TYPE_64),
            "the host's samples is TYPE_64, allowed is one count that the device has",
        ),
        (
            said(|_, _, settings| settings.frames_in_flight = 17),
            "renderer: frames_in_flight is 17, allowed is 1 to 16",
        ),
    ] {
        assert_eq!(found, expected);
    }
    frames_and_ranges_that_are_not_there(&mut canvas, &mut journey);
    drop(canvas);
    end(host);
}

fn frames_and_ranges_that_are_not_there(canvas: &mut Canvas, journey: &mut Journey) {
    let mut drawn = renderer(canvas, journey);
    journey.frame(MEADOW, &mut [&mut drawn]).unwrap();
    let host = Rc::clone(&canvas.host);
    let _idle = Idle(&host);
    let (buffer, index) = canvas.begin().unwrap();
    let [good, bad] = [index, IN_FLIGHT].map(|index| HostFrame { buffer, index });
    let Journey { overfly, output, .. } = journey;
    let done = overfly.with_picture(output, 0, |picture| {
        // SAFETY: the buffer is being recorded, outside a pass; what is refused records nothing.
        unsafe {
            let early = drawn.record_range(good, 0, [0, 0]).unwrap_err();
            assert_eq!(early.to_string(), "nothing was drawn yet");
            let error = drawn.record_uploads(bad, picture, &Team::alone()).unwrap_err();
            assert_eq!(error.to_string(), "there is no frame 2 in flight, the renderer has 2");
            drawn.record_uploads(good, picture, &Team::alone()).unwrap();
            let error = drawn.record_range(good, 1, [0, 0]).unwrap_err();
            assert_eq!(error.to_string(), "there is no depth range 1, the frame's view has 1");
        }
    });
    done.unwrap();
    canvas.submit().unwrap();
}

#[test]
fn the_examples_draw_their_pictures_without_a_message() {
    let test = "the_examples_draw_their_pictures_without_a_message";
    if !go_on(test) {
        return;
    }
    let built = Path::new(env!("CARGO_BIN_EXE_overfly")).with_file_name("examples");
    for name in ["own_vulkan", "cockpit"] {
        let program = built.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
        let required = std::env::var("OVERFLY_REQUIRE_GPU").is_ok_and(|value| value == "1");
        assert!(program.exists() || !required, "{} is not built", program.display());
        if !program.exists() {
            println!("{test} skipped: `cargo test` without --test builds {name}");
            continue;
        }
        let refused = Command::new(&program).arg("--oat").output().unwrap();
        assert_eq!(refused.status.code(), Some(1), "{name}");
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("picture.png");
        let done = Command::new(&program).arg("--out").arg(&file).output().unwrap();
        let out = String::from_utf8_lossy(&done.stdout);
        let err = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{name}: {out}{err}");
        let silent = out.contains("validation messages: 0");
        assert!(silent || out.contains("validation layer: not installed"), "{name}: {out}");
        let picture = image::open(&file).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (960, 540), "{name}");
        let at = |[x, y]: [u32; 2]| picture.get_pixel(x, y).0;
        let ground = |at: [u8; 3]| at[1] > at[2] && at[1] > 60;
        assert!(ground(at([480, 330])), "{name}: {:?}", at([480, 330]));
        if name == "own_vulkan" {
            let [r, g, b] = at([480, 60]);
            assert!(b > g && g > r, "no sky: {r}, {g}, {b}");
            continue;
        }
        // A leg, the upper part of its wheel, and grass where the lower part would be.
        assert!(at([600, 400])[0] > 100 && at([600, 400])[1] < 60, "{:?}", at([600, 400]));
        assert!(at([636, 440])[1] < 60, "{:?}", at([636, 440]));
        assert!(ground(at([609, 483])), "{:?}", at([609, 483]));
    }
}

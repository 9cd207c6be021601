//! Drawing into a host's command buffers: the façade's pixels, and nothing for the layer to say.
//!
//! In:    the host of the root's examples, the example in C; a Vulkan device and the Khronos layer.
//! Out:   test results; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: nothing.
//! Not here: what is refused, and handles (`renderers`).

/// What is around overfly's draws in the root's examples.
#[path = "../../../examples/host_vulkan"]
#[expect(dead_code, reason = "the examples use the rest")]
pub mod host_vulkan {
    pub mod canvas;
    pub mod frames;
    pub mod host;

    /// What most of it returns.
    pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;
}

use super::calls::*;
use super::examples::{built_with, out_of};
use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::frames::{Pane, draw};
use host_vulkan::host::Host;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::render_vk::ash::{self, vk};
use overfly::render_vk::{HostRenderer, RendererSettings, Show, devices};
use overfly::{Overfly, Pages, config};
use overfly_c::drawing::*;
use overfly_c::renderer::*;
use overfly_c::scene::*;
use overfly_c::terrain::*;
use std::process::Command;
use std::rc::Rc;
use vk::Handle;

/// What [`look`] looks at.
pub const SIZE_PX: [u32; 2] = [640, 360];

/// Whether to go on. Without a device not; and the layer reads its environment when it is loaded,
/// so the test runs in a process of its own.
pub fn go_on(module: &str, test: &str) -> bool {
    const CHECKS: &str = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    let found = devices().is_ok_and(|devices| !devices.is_empty());
    let required = std::env::var("OVERFLY_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(found || !required, "OVERFLY_REQUIRE_GPU=1 and no Vulkan device");
    if !found {
        println!("{test} skipped: no Vulkan device");
        return false;
    }
    if std::env::var_os("VK_LAYER_ENABLES").is_some() {
        return true;
    }
    let mut child = Command::new(std::env::current_exe().unwrap());
    let child = child.args(["--exact", &format!("{module}::{test}"), "--nocapture"]);
    assert!(child.env("VK_LAYER_ENABLES", CHECKS).status().unwrap().success());
    false
}

/// Ends the host and asserts that the layer had nothing to say, objects that are left included.
pub fn end(host: Rc<Host>) {
    let (messages, validates) = (host.messages(), host.validates);
    assert_eq!(Rc::strong_count(&host), 1, "something of the host is still in use");
    drop(host);
    let messages = messages.lock().unwrap();
    assert!(messages.is_empty(), "{}", messages.join("\n"));
    if !validates {
        println!("messages unchecked: no validation layer");
    }
}

/// What C says of a host's device.
pub fn lent(host: &Host) -> ovf_device {
    // SAFETY: loading runs the Vulkan loader's initialisers, which are sound. The host has it too, so
    // it stays when this goes.
    let entry = unsafe { ash::Entry::load() }.unwrap();
    let find = entry.static_fn().get_instance_proc_addr;
    // SAFETY: a pointer to a function, which is cast back before it is called.
    let find = unsafe { std::mem::transmute::<vk::PFN_vkGetInstanceProcAddr, AnyFunction>(find) };
    let pointer = |raw: u64| usize::try_from(raw).unwrap() as *mut _;
    ovf_device {
        queue_family: host.family,
        api_version: vk::API_VERSION_1_1,
        debug_utils: u32::from(host.validates),
        multi_draw_indirect: 1,
        get_instance_proc_addr: Some(find),
        instance: pointer(host.instance.handle().as_raw()),
        physical_device: pointer(host.physical.as_raw()),
        device: pointer(host.device.handle().as_raw()),
        queue: pointer(host.queue.as_raw()),
        ..sized()
    }
}

/// Any function, as C names it.
pub type AnyFunction = unsafe extern "C" fn();

/// What C says of a canvas.
pub fn target(canvas: &Canvas) -> ovf_target {
    let target = canvas.target();
    let number = |format: vk::Format| u32::try_from(format.as_raw()).unwrap();
    ovf_target {
        subpass: target.subpass,
        render_pass: target.render_pass.as_raw(),
        colour_format: number(target.colour_format),
        depth_format: number(target.depth_format),
        samples: target.samples.as_raw(),
        ..sized()
    }
}

/// A renderer of a terrain for a canvas.
pub fn renderer_of(terrain: ovf_terrain, canvas: &Canvas) -> ovf_renderer {
    let (device, target) = (lent(&canvas.host), target(canvas));
    let settings = ovf_renderer_settings { frames_in_flight: IN_FLIGHT, ..sized() };
    let mut renderer = ovf_renderer { bits: 0 };
    // SAFETY: the handles are good; each test waits until the device is idle before it destroys the
    // renderer, and that before canvas and host.
    must(unsafe { ovf_renderer_new_v1(terrain, &settings, &device, &target, &raw mut renderer) });
    renderer
}

/// One of the canvas's frames, as C names it.
pub fn frame_of((buffer, index): (vk::CommandBuffer, u32)) -> ovf_host_frame {
    let command_buffer = usize::try_from(buffer.as_raw()).unwrap() as *mut _;
    ovf_host_frame { index, command_buffer, ..sized() }
}

/// Records a picture as C does, and submits it.
pub fn draw_in_c(
    canvas: &mut Canvas,
    renderer: ovf_renderer,
    picture: ovf_picture,
) -> ovf_draw_report {
    let (buffer, index) = canvas.begin().unwrap();
    let frame = frame_of((buffer, index));
    let mut report = sized::<ovf_draw_report>();
    // SAFETY: all pointers are of values that outlive the calls; the buffer is being recorded,
    // outside the pass, then in it; `begin` has waited for the frame that had this index.
    unsafe {
        must(ovf_renderer_record_uploads(renderer, &frame, &picture, &raw mut report));
        canvas.begin_pass(buffer);
        for range in (0..report.ranges).rev() {
            canvas.clear_depth(buffer);
            must(ovf_renderer_record_range(renderer, &frame, range, 0, 0));
        }
        canvas.host.device.cmd_end_render_pass(buffer);
    }
    canvas.submit().unwrap();
    report
}

/// The façade with a renderer on the host's device, beside which C's is held.
struct Facade {
    overfly: Overfly,
    output: FrameOutput,
    canvas: Canvas,
    // Before the canvas's host, when all is dropped: see `close`.
    renderer: HostRenderer,
}

impl Facade {
    fn new(host: &Rc<Host>, scene: &SceneSettings, size_px: [u32; 2]) -> Self {
        let pages = Pages::Waited { threads: 1 };
        let overfly =
            Overfly::new(scene, overfly::Host { pages, ..overfly::Host::default() }).unwrap();
        let limits = overfly.terrain().limits();
        let settings = RendererSettings::of(scene, limits, size_px);
        let settings = RendererSettings { frames_in_flight: IN_FLIGHT, ..settings };
        let canvas = Canvas::new(host, size_px, &settings).unwrap();
        // SAFETY: the handles are good; `close` waits until the device is idle.
        let made = unsafe { HostRenderer::new(&settings, &host.lend(), &canvas.target()) };
        Self { overfly, output: FrameOutput::default(), canvas, renderer: made.unwrap() }
    }

    fn fly(&mut self, time_s: f64, view: View, scene: Option<SceneSettings>) {
        let scene = scene.map(Box::new);
        let mut input = FrameInput { time_s, views: vec![view], scene, ..FrameInput::default() };
        self.overfly.frame(&mut input, &mut self.output).unwrap();
        self.renderer.note_built(&self.output.built);
        self.renderer.note_tiles(&self.output.tiles);
    }

    fn draw(&mut self, show: Show) -> Vec<u8> {
        self.overfly.looks_mut().show = show;
        let Self { overfly, output, canvas, renderer } = self;
        let drawn = overfly.with_picture(output, 0, |picture| {
            draw(canvas, &mut [Pane { renderer, picture, at_px: [0, 0] }], |_, _| {})
        });
        drawn.unwrap().unwrap();
        self.canvas.read_pixels().unwrap()
    }

    fn close(self) {
        self.canvas.host.wait_idle().unwrap();
        drop(self.renderer);
    }
}

fn edited(terrain: ovf_terrain, frame: usize, sea: u32) {
    let edit = ovf_edit { changes: OVF_EDIT_SEA, sea, ..sized() };
    fly(terrain, frame, Some(&edit));
}

#[test]
fn a_host_in_c_draws_the_facade_s_picture_to_the_last_byte() {
    if !go_on("drawing", "a_host_in_c_draws_the_facade_s_picture_to_the_last_byte") {
        return;
    }
    let host = Rc::new(Host::new().unwrap());
    let scene = config::load("small").unwrap();
    let mut facade = Facade::new(&host, &scene, SIZE_PX);
    let mut canvas = Canvas::new(&host, SIZE_PX, facade.renderer.settings()).unwrap();
    let terrain = open_small(Some(&waiting()));
    let renderer = renderer_of(terrain, &canvas);
    let mut uploaded = Vec::new();
    for frame in 0..60 {
        // At 40 the sea goes, so that the terrain begins anew under its renderers.
        let changed = (frame == 40).then(|| SceneSettings { sea: false, ..scene.clone() });
        facade.fly(frame as f64 / 60.0, look_in_rust(frame, &scene), changed);
        match frame {
            40 => edited(terrain, frame, 0),
            _ => drop(fly(terrain, frame, None)),
        }
        // The façade's renderer is told of every frame; C's finds out when it records.
        if frame < 20 || frame % 4 != 3 {
            continue;
        }
        let (show, number) = match frame % 3 {
            0 => (Show::Shaded, OVF_SHOW_SHADED),
            1 => (Show::Level, OVF_SHOW_LEVEL),
            _ => (Show::Normals, OVF_SHOW_NORMALS),
        };
        let expected = facade.draw(show);
        let report = draw_in_c(&mut canvas, renderer, ovf_picture { show: number, ..sized() });
        let found = canvas.read_pixels().unwrap();
        assert!(expected == found, "frame {frame}, {show:?}");
        assert!(found.chunks_exact(4).any(|pixel| pixel != &found[..4]), "one colour");
        assert_eq!(report.ranges, 3);
        assert!(report.draws > 0 && report.commands > 0 && report.triangles > 0);
        uploaded.push(report.uploaded_patches);
    }
    let (first, later) = uploaded.split_first().unwrap();
    println!("patches uploaded: {first}, then {later:?}");
    assert!(later[..4].iter().all(|count| count < first), "only what is new is copied");
    facade.close();
    must(ovf_renderer_destroy(renderer));
    must(ovf_terrain_destroy(terrain));
    drop(canvas);
    end(host);
}

/// The scene of `examples/c/own_vulkan.c`.
fn hills() -> SceneSettings {
    let mut scene = config::load("earth").unwrap();
    scene.lod.triangles_max = 60_000;
    scene
}

/// What it looks at.
fn look_at_hills(step: u32, scene: &SceneSettings) -> View {
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    let at = Geodetic {
        lat_rad: 46.85 * DEGREE,
        lon_rad: (-121.76 + 1e-4 * f64::from(step)) * DEGREE,
        height_m: EYE_HEIGHT_M,
    };
    let [yaw, pitch, roll] = [40.0 * DEGREE, -8.0 * DEGREE, 0.0].map(Radians);
    View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, yaw, pitch, roll),
        field_of_view: Radians(60.0 * DEGREE),
        size_px: [960, 540],
        near_m: 0.1,
    }
}

const EYE_HEIGHT_M: f64 = 3000.0;

#[test]
fn the_example_in_c_draws_the_facade_s_picture_without_a_message() {
    let test = "the_example_in_c_draws_the_facade_s_picture_without_a_message";
    if !go_on("drawing", test) {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let header = ["/usr/include", "/usr/local/include"];
    if !header.iter().any(|at| std::path::Path::new(at).join("vulkan/vulkan.h").exists()) {
        println!("{test} skipped: vulkan/vulkan.h is not installed");
        return;
    }
    let built = built_with("cc", "own_vulkan.c", (out.path(), &["-lvulkan"]));
    let Some(program) = built else { return };
    assert_eq!(Command::new(&program).status().unwrap().code(), Some(2), "no file is named");
    let file = out.path().join("picture.ppm");
    let said = out_of(&Command::new(&program).arg(&file).output().unwrap());
    let silent = said.contains("validation messages: 0");
    assert!(silent || said.contains("validation layer: not installed"), "{said}");
    let picture = ppm(&file);

    let host = Rc::new(Host::new().unwrap());
    let scene = hills();
    let mut facade = Facade::new(&host, &scene, [960, 540]);
    let mut frame = 0;
    let mut fly = |facade: &mut Facade, step| {
        facade.fly(0.1 * f64::from(frame), look_at_hills(step, &scene), None);
        frame += 1;
        let counts = &facade.output.counts;
        counts.leaves == 0 || counts.splits + counts.merges + counts.wanted > 0
    };
    while fly(&mut facade, 0) {}
    let mut expected = Vec::new();
    for step in 0..8 {
        fly(&mut facade, step);
        expected = facade.draw(Show::Shaded);
    }
    let expected: Vec<u8> = expected.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    assert_eq!(picture.len(), expected.len());
    let differ = picture.chunks(3).zip(expected.chunks(3)).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels of {}", expected.len() / 3);
    let at = |x: usize, y: usize| &expected[3 * (960 * y + x)..][..3];
    let (sky, ground) = (at(480, 60), at(480, 400));
    assert!(sky[2] > sky[0], "no sky: {sky:?}");
    assert!(ground[1] > ground[2], "no ground: {ground:?}");
    facade.close();
    end(host);
}

/// The pixels of a binary PPM with a head of three lines.
fn ppm(file: &std::path::Path) -> Vec<u8> {
    let bytes = std::fs::read(file).unwrap();
    let mut parts = bytes.splitn(4, |&byte| byte == b'\n');
    assert_eq!(parts.next(), Some(&b"P6"[..]));
    assert_eq!(parts.next(), Some(&b"960 540"[..]));
    assert_eq!(parts.next(), Some(&b"255"[..]));
    parts.next().unwrap().to_vec()
}

#[test]
fn projections_are_the_facade_s() {
    let terrain = open_small(Some(&waiting()));
    let (mut overfly, mut output) = (opened_in_rust(), FrameOutput::default());
    for frame in 0..3 {
        fly(terrain, frame, None);
        fly_in_rust(&mut overfly, frame, &mut output);
    }
    let order = overfly.scene().depth.order;
    for range in 0..3_u32 {
        let mut found = [f32::NAN; 16];
        // SAFETY: the pointer is of 16 numbers that outlive the call.
        must(unsafe { ovf_terrain_projection(terrain, 0, range, found.as_mut_ptr()) });
        let expected =
            overfly::render_vk::projection(&output.views[0], range as usize, order).unwrap();
        assert_eq!(
            found.map(f32::to_bits),
            expected.as_flattened().try_into().map(|all: [f32; 16]| all.map(f32::to_bits)).unwrap()
        );
    }
    must(ovf_terrain_destroy(terrain));
}

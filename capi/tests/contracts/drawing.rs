//! Drawing into a host's command buffers: the façade's pixels, and nothing for the layer to say.
//!
//! In:    the host of the root's examples, the example in C; a Vulkan device and the Khronos layer.
//! Out:   test results; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: pictures and archives of imagery in folders, thrown away.
//! Not here: what is refused, and handles (`renderers`); what is over a picture (`overlays`).

use super::calls::*;
use super::examples::{built_with, out_of};
use super::lent::host_vulkan::canvas::{Canvas, IN_FLIGHT};
use super::lent::host_vulkan::frames::{Pane, draw};
use super::lent::host_vulkan::host::Host;
use super::lent::*;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::ingest::{ImageryOptions, build_imagery};
use overfly::render_vk::{Backdrop, HostRenderer, RendererSettings, Show};
use overfly::{Overfly, Pages, config};
use overfly_c::drawing::*;
use overfly_c::renderer::*;
use overfly_c::scene::*;
use overfly_c::terrain::*;
use std::path::Path;
use std::process::Command;
use std::ptr::null_mut;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

/// The façade with a renderer on the host's device, beside which C's is held.
pub struct Facade {
    pub overfly: Overfly,
    output: FrameOutput,
    canvas: Canvas,
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
        let mut renderer = made.unwrap();
        renderer.note_tiles(&overfly.terrain().tiles());
        Self { overfly, output: FrameOutput::default(), canvas, renderer }
    }

    fn fly(&mut self, time_s: f64, views: Vec<View>, scene: Option<SceneSettings>) {
        let scene = scene.map(Box::new);
        let mut input = FrameInput { time_s, views, scene, ..FrameInput::default() };
        self.overfly.frame(&mut input, &mut self.output).unwrap();
        self.renderer.note_built(&self.output.built);
        self.renderer.note_tiles(&self.output.tiles);
    }

    /// A view of the last frame, its corner at `at_px` of the canvas.
    pub fn draw(&mut self, (view, at_px): (usize, [i32; 2]), show: Show) -> Vec<u8> {
        self.overfly.looks_mut().show = show;
        let Self { overfly, output, canvas, renderer } = self;
        let drawn = overfly.with_picture(output, view, |picture| {
            draw(canvas, &mut [Pane { renderer, picture, at_px }], |_, _| {})
        });
        drawn.unwrap().unwrap();
        self.canvas.read_pixels().unwrap()
    }

    fn close(self) {
        self.canvas.host.wait_idle().unwrap();
        drop(self.renderer);
    }
}

/// The same terrain twice, each with a renderer and a canvas on one device.
pub struct Both {
    pub facade: Facade,
    pub terrain: ovf_terrain,
    pub renderer: ovf_renderer,
    pub canvas: Canvas,
    scene: SceneSettings,
}

impl Both {
    pub fn new(scene: SceneSettings) -> Self {
        let host = Rc::new(Host::new().unwrap());
        let facade = Facade::new(&host, &scene, SIZE_PX);
        let canvas = Canvas::new(&host, SIZE_PX, facade.renderer.settings()).unwrap();
        let text = config::write(&scene).unwrap();
        let terrain = open_text(&text, Some(&waiting())).unwrap();
        Self { facade, terrain, renderer: renderer_of(terrain, &canvas), canvas, scene }
    }

    /// Flies a frame of [`dive`]; with a sea or without from here on.
    pub fn fly(&mut self, frame: usize, sea: Option<bool>) {
        let changed = sea.map(|sea| SceneSettings { sea, ..self.scene.clone() });
        let view = dive_in_rust(frame, &self.scene);
        self.facade.fly(frame as f64 / 60.0, vec![view], changed);
        let edit = sea.map(|sea| ovf_edit { changes: OVF_EDIT_SEA, sea: sea.into(), ..sized() });
        fly_views(self.terrain, frame, &[dive(frame)], edit.as_ref());
    }

    /// Draws the last frame with both and holds one picture against the other.
    fn draws_the_same(&mut self, frame: usize) -> ovf_draw_report {
        let (show, number) = match frame % 3 {
            0 => (Show::Shaded, OVF_SHOW_SHADED),
            1 => (Show::Level, OVF_SHOW_LEVEL),
            _ => (Show::Normals, OVF_SHOW_NORMALS),
        };
        let expected = self.facade.draw((0, [0, 0]), show);
        let picture = ovf_picture { show: number, ..sized() };
        let report = draw_in_c(&mut self.canvas, self.renderer, picture);
        let found = self.canvas.read_pixels().unwrap();
        assert!(expected == found, "frame {frame}, {show:?}");
        assert!(found.chunks_exact(4).any(|pixel| pixel != &found[..4]), "one colour");
        assert!(report.draws > 0 && report.commands > 0 && report.triangles > 0);
        assert_eq!(report.ranges, 3);
        report
    }

    /// The same without a sky, where what the host cleared to shows beside the ground.
    fn leaves_the_host_s_backdrop(&mut self) {
        self.facade.overfly.looks_mut().backdrop = Backdrop::Colour([0.0; 3]);
        let expected = self.facade.draw((0, [0, 0]), Show::Shaded);
        let picture = ovf_picture { backdrop: OVF_BACKDROP_HOST, ..sized() };
        draw_in_c(&mut self.canvas, self.renderer, picture);
        let found = self.canvas.read_pixels().unwrap();
        assert!(expected == found);
        let (all, ground) = (found.len() / 4, found.chunks_exact(4).filter(|p| *p != [0; 4]));
        let ground = ground.count();
        println!("{ground} of {all} pixels are ground");
        assert!(ground > all / 2 && ground < all, "{ground} of {all} pixels");
    }

    pub fn close(self) {
        let host = Rc::clone(&self.canvas.host);
        self.facade.close();
        must(ovf_renderer_destroy(self.renderer));
        must(ovf_terrain_destroy(self.terrain));
        drop(self.canvas);
        end(host);
    }
}

#[test]
fn a_host_in_c_draws_the_facade_s_picture_to_the_last_byte() {
    if !go_on("drawing", "a_host_in_c_draws_the_facade_s_picture_to_the_last_byte") {
        return;
    }
    let mut both = Both::new(config::load("small").unwrap());
    let mut uploaded = Vec::new();
    for frame in 0..60 {
        // At 40 the sea goes, so that the terrain begins anew under its renderers.
        both.fly(frame, (frame == 40).then_some(false));
        // The façade's renderer is told of every frame; C's finds out when it records.
        if frame >= 20 && frame % 4 == 3 {
            uploaded.push(both.draws_the_same(frame).uploaded_patches);
        }
    }
    let (first, later) = uploaded.split_first().unwrap();
    println!("patches uploaded: {first}, then {later:?}");
    both.leaves_the_host_s_backdrop();
    assert!(later[..4].iter().all(|count| count < first), "only what is new is copied");
    both.close();
}

/// A scene with a picture over all of the ground.
fn draped(folder: &Path) -> SceneSettings {
    let mut scene = config::load("small").unwrap();
    let [input, output] = ["over.png", "over.pmtiles"].map(|name| folder.join(name));
    let chequers = |x: u32, y: u32| match (x / 4 + y / 4) % 2 {
        0 => image::Rgba([250, 10, 10, 255]),
        _ => image::Rgba([10, 10, 250, 255]),
    };
    image::RgbaImage::from_fn(512, 256, chequers).save(&input).unwrap();
    scene.imagery.push(output.display().to_string());
    let options = ImageryOptions {
        input,
        projection: None,
        bounds_deg: None,
        attribution: String::new(),
        output,
        body: ("small".into(), scene.body),
    };
    build_imagery(&options, &AtomicBool::new(false), &|_| {}).unwrap();
    scene
}

#[test]
fn imagery_reaches_renderers_that_are_early_late_or_have_lost_a_buffer() {
    if !go_on("drawing", "imagery_reaches_renderers_that_are_early_late_or_have_lost_a_buffer") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut both = Both::new(draped(folder.path()));
    (0..30).for_each(|frame| both.fly(frame, None));
    both.draws_the_same(30);
    let found = both.canvas.read_pixels().unwrap();
    let red = |pixel: &&[u8]| pixel[0] > 90 && pixel[2] < 60;
    let reds = found.chunks_exact(4).filter(red).count();
    assert!(reds > 10_000, "{reds} pixels of the picture's red");
    must(ovf_renderer_note_lost(both.renderer));
    (31..40).for_each(|frame| both.fly(frame, None));
    let lost = both.draws_the_same(42);
    must(ovf_renderer_destroy(both.renderer));
    both.renderer = renderer_of(both.terrain, &both.canvas);
    let late = both.draws_the_same(42);
    assert_eq!(late.uploaded_patches, lost.uploaded_patches, "both have all to copy");
    both.close();
}

#[test]
fn two_views_stand_side_by_side_in_one_pass() {
    if !go_on("drawing", "two_views_stand_side_by_side_in_one_pass") {
        return;
    }
    let [width, height] = SIZE_PX;
    let wide = [2 * width, height];
    let right = i32::try_from(width).unwrap();
    let host = Rc::new(Host::new().unwrap());
    let scene = config::load("small").unwrap();
    let mut facade = Facade::new(&host, &scene, wide);
    let mut canvas = Canvas::new(&host, wide, facade.renderer.settings()).unwrap();
    let terrain = open_small(Some(&waiting()));
    // Each view has as many frames in flight as the canvas.
    let renderer = renderer_with(terrain, &canvas, 2 * IN_FLIGHT);
    for frame in 0..20 {
        let looks = [frame, frame + 70];
        let views = looks.map(|frame| dive_in_rust(frame, &scene)).to_vec();
        facade.fly(frame as f64 / 60.0, views, None);
        fly_views(terrain, frame, &looks.map(dive), None);
    }
    let (buffer, index) = canvas.begin().unwrap();
    let frames = [index, index + IN_FLIGHT].map(|index| frame_of((buffer, index)));
    // SAFETY: as in `draw_in_c`; both views are within the canvas.
    unsafe {
        for (view, frame) in (0..).zip(&frames) {
            let picture = ovf_picture { view, ..sized() };
            must(ovf_renderer_record_uploads(renderer, frame, &picture, null_mut()));
        }
        canvas.begin_pass(buffer);
        for range in (0..3).rev() {
            canvas.clear_depth(buffer);
            for (frame, left_px) in frames.iter().zip([0, right]) {
                must(ovf_renderer_record_range(renderer, frame, range, left_px, 0));
            }
        }
        canvas.host.device.cmd_end_render_pass(buffer);
    }
    canvas.submit().unwrap();
    let found = canvas.read_pixels().unwrap();
    for (half, at_px) in [[0, 0], [right, 0]].into_iter().enumerate() {
        let expected = facade.draw((half, at_px), Show::Shaded);
        let rows = |pixels: &[u8]| {
            let halves = pixels.chunks_exact(4 * width as usize).skip(half).step_by(2);
            halves.map(<[u8]>::to_vec).collect::<Vec<_>>().concat()
        };
        assert!(rows(&expected) == rows(&found), "view {half}");
    }
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
        height_m: 3000.0,
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

#[test]
fn the_example_in_c_draws_the_facade_s_picture_without_a_message() {
    let test = "the_example_in_c_draws_the_facade_s_picture_without_a_message";
    if !go_on("drawing", test) {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let header = ["/usr/include", "/usr/local/include"];
    if !header.iter().any(|at| Path::new(at).join("vulkan/vulkan.h").exists()) {
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
        facade.fly(0.1 * f64::from(frame), vec![look_at_hills(step, &scene)], None);
        frame += 1;
        let counts = &facade.output.counts;
        counts.leaves == 0 || counts.splits + counts.merges + counts.wanted > 0
    };
    while fly(&mut facade, 0) {}
    let mut expected = Vec::new();
    for step in 0..8 {
        fly(&mut facade, step);
        expected = facade.draw((0, [0, 0]), Show::Shaded);
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
fn ppm(file: &Path) -> Vec<u8> {
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
        let view = &output.views[0];
        let expected = overfly::render_vk::projection(view, range as usize, order).unwrap();
        let bits = |numbers: &[f32]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(expected.as_flattened()), "range {range}");
    }
    must(ovf_terrain_destroy(terrain));
}

//! Extreme cases that need the renderer or the whole: borders of depth, resizes, lost renderers.
//!
//! In:    presets, poses of their own; a Vulkan device, or none.
//! Out:   passes or fails; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: nothing.
//! Not here: all other cases (`core/tests/extremes`), scene files (`config/tests/extremes.rs`).

use super::pictures::device;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::digest::mix;
use overfly::core::frame::data::{RangeDraws, ViewDraws};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Geodetic};
use overfly::core::settings::{DepthFormat, DepthOrder, SceneSettings};
use overfly::core::units::Radians;
use overfly::loader::Loader;
use overfly::render_vk::{DrawError, Renderer, RendererSettings};
use overfly::{FrameError, Overfly, config};

const SIZE_PX: [u32; 2] = [320, 180];

/// A scene, a pose and all its pages.
struct Scene {
    overfly: Overfly,
    settings: SceneSettings,
    loader: Loader,
    input: FrameInput,
    output: FrameOutput,
}

impl Scene {
    fn new(settings: SceneSettings, workers: usize) -> Self {
        let overfly = Overfly::new(&settings, workers).unwrap();
        let loader = overfly.loader(2).unwrap();
        let (input, output) = (FrameInput::default(), FrameOutput::default());
        Self { overfly, settings, loader, input, output }
    }

    fn renderer(&self) -> Renderer {
        let limits = self.overfly.terrain().limits();
        Renderer::new(&RendererSettings::of(&self.settings, limits, SIZE_PX)).unwrap()
    }

    fn view(&self, at: Geodetic, pitch_deg: f64) -> View {
        let pitch = Radians::from_degrees(pitch_deg);
        View {
            eye: self.settings.body.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(at, Radians(0.5), pitch, Radians(0.0)),
            field_of_view: Radians::from_degrees(60.0),
            size_px: SIZE_PX,
            near_m: 0.1,
        }
    }

    /// One frame, drawn or not.
    fn frame(&mut self, view: View, drawn: bool) -> Result<(), FrameError> {
        self.input.views = vec![view];
        self.loader.fetch(&self.output.wanted, &mut self.input.arrived);
        if drawn {
            self.overfly.frame_drawn(&mut self.input, &mut self.output, 0).map(|_| ())
        } else {
            self.overfly.frame(&mut self.input, &mut self.output)
        }
    }

    fn settle(&mut self, view: View) {
        for _ in 0..2000 {
            self.frame(view, false).unwrap();
            let counts = &self.output.counts;
            if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0 {
                return;
            }
        }
        panic!("no fixed point: {:?}", self.output.counts);
    }

    /// The picture of some draws.
    fn picture(&mut self, draws: ViewDraws) -> (Vec<u8>, ViewDraws) {
        let own = std::mem::replace(&mut self.output.views[0], draws);
        self.overfly.draw(&self.output, 0).unwrap();
        let read = |renderer: &mut Renderer| renderer.read_pixels().unwrap();
        let pixels = self.overfly.with_renderer(read).unwrap();
        (pixels, std::mem::replace(&mut self.output.views[0], own))
    }
}

/// A view's draws in one range: every patch of any of them, or none.
fn in_one_range(view: &ViewDraws, drawn: bool) -> ViewDraws {
    let mut patches: Vec<u32> = view.ranges.iter().flat_map(|r| r.patches.clone()).collect();
    patches.retain(|_| drawn);
    patches.sort_unstable();
    patches.dedup();
    let near_m = view.ranges[0].near_m;
    ViewDraws {
        camera: view.camera,
        ranges: vec![RangeDraws { near_m, far_m: f64::INFINITY, patches }],
    }
}

/// Of the last frame's draws: pixels that the ranges leave empty though one range fills them, those that they fill though it
/// leaves them empty, and those of another colour.
fn compare(scene: &mut Scene) -> [usize; 3] {
    let view = &scene.output.views[0];
    let (one, none) = (in_one_range(view, true), in_one_range(view, false));
    scene.overfly.draw(&scene.output, 0).unwrap();
    let read = |renderer: &mut Renderer| renderer.read_pixels().unwrap();
    let ranges = scene.overfly.with_renderer(read).unwrap();
    let (one, _) = scene.picture(one);
    let (none, _) = scene.picture(none);
    let mut found = [0; 3];
    let pixels = ranges.chunks_exact(4).zip(one.chunks_exact(4)).zip(none.chunks_exact(4));
    for ((ranges, one), none) in pixels {
        found[0] += usize::from(ranges == none && one != none);
        found[1] += usize::from(ranges != none && one == none);
        found[2] += usize::from(ranges != one);
    }
    let ground = one.chunks_exact(4).zip(none.chunks_exact(4)).filter(|(a, b)| a != b).count();
    assert!(ground > 10_000, "{ground} pixels show ground");
    found
}

/// Over a sea, straight down, with borders exactly at the depth of the nearest water, a hair before
/// it and a hair behind; and close above it, where every triangle crosses several ranges.
#[test]
fn case_39_no_pixel_is_missing_where_depth_is_exactly_a_border_and_triangles_cross_all_ranges() {
    if !device("case_39_no_pixel_is_missing_where_depth_is_exactly_a_border") {
        return;
    }
    let border_m = 40.0_f64;
    let cases: [(f64, f64, Vec<f64>); 4] = [
        (border_m, -90.0, vec![border_m]),
        (border_m, -90.0, vec![border_m.next_down(), border_m.next_up()]),
        (border_m, -90.0, vec![border_m * 0.999, border_m, border_m * 1.001]),
        (6.0, -25.0, vec![7.0, 8.0, 9.0, 11.0, 14.0, 20.0, 40.0]),
    ];
    for (height_m, pitch_deg, splits_m) in cases {
        for order in [DepthOrder::Reversed, DepthOrder::Forward] {
            let mut settings = config::load("small").unwrap();
            settings.depth.splits_m = splits_m.clone();
            (settings.depth.format, settings.depth.order) = (DepthFormat::D32F, order);
            settings.lod.morph_s = 0.0;
            let mut scene = Scene::new(settings, 1);
            let renderer = scene.renderer();
            scene.overfly.set_renderer(renderer);
            let sea = deep_sea(&scene);
            let view = scene.view(Geodetic { height_m, ..sea }, pitch_deg);
            scene.settle(view);
            let ranges = &scene.output.views[0].ranges;
            let crossing = ranges.iter().map(|range| range.patches.len()).sum::<usize>();
            let [missing, added, other] = compare(&mut scene);
            println!("{height_m} m, {order:?}: {missing} missing, {added} added, {other} other");
            assert!(crossing > in_one_range(&scene.output.views[0], true).ranges[0].patches.len());
            assert_eq!((missing, added), (0, 0), "{height_m} m, {splits_m:?}, {order:?}");
            assert!(other <= (SIZE_PX[0] * SIZE_PX[1]) as usize / 2000, "{other} differ");
        }
    }
}

/// What the comparison is worth: ranges with a gap between them do miss pixels.
#[test]
fn case_39_a_gap_between_two_ranges_is_seen() {
    if !device("case_39_a_gap_between_two_ranges_is_seen") {
        return;
    }
    let mut settings = config::load("small").unwrap();
    settings.depth.splits_m = vec![40.0];
    let mut scene = Scene::new(settings, 1);
    let renderer = scene.renderer();
    scene.overfly.set_renderer(renderer);
    let sea = deep_sea(&scene);
    scene.settle(scene.view(Geodetic { height_m: 20.0, ..sea }, -30.0));
    assert_eq!(compare(&mut scene)[..2], [0, 0]);
    let ranges = &mut scene.output.views[0].ranges;
    (ranges[0].far_m, ranges[1].near_m) = (38.0, 42.0);
    let [missing, ..] = compare(&mut scene);
    assert!(missing > 100, "{missing} pixels between 38 and 42 m");
}

/// A place far from all land.
fn deep_sea(scene: &Scene) -> Geodetic {
    let unit = |seed: u64| (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64;
    let places = (0..400_u64)
        .map(|i| Geodetic::from_degrees(120.0 * unit(i) - 60.0, 360.0 * unit(!i) - 180.0, 0.0));
    let rated = places.map(|at| (scene.overfly.ground_height_m(at).unwrap(), at));
    let around = |at: Geodetic| {
        let turns = (0..12).map(|i| f64::from(i) * 0.5);
        turns.map(move |turn| {
            let (x, y) = (
                0.1 * overfly::core::geodesy::trig::cos(turn),
                0.1 * overfly::core::geodesy::trig::sin(turn),
            );
            Geodetic { lat_rad: at.lat_rad + x, lon_rad: at.lon_rad + y, height_m: 0.0 }
        })
    };
    let wet = |at: Geodetic| scene.overfly.ground_height_m(at).unwrap() <= 0.0;
    let mut seas = rated.filter(|&(height_m, at)| height_m <= 0.0 && around(at).all(wet));
    seas.next().expect("there is a sea").1
}

/// The Earth is a point or none at all; what a shader makes of it must not spill over the picture.
#[test]
fn case_09_from_1e12_to_1e30_m_the_picture_is_the_sky() {
    if !device("case_09_from_1e12_to_1e30_m_the_picture_is_the_sky") {
        return;
    }
    let mut scene = Scene::new(config::load("earth").unwrap(), 1);
    let renderer = scene.renderer();
    scene.overfly.set_renderer(renderer);
    for far_m in [1e12, 1e18, 1e19, 1e25, 9e29] {
        let mut view = scene.view(Geodetic::from_degrees(20.0, 30.0, 0.0), -90.0);
        view.eye = Ecef(view.eye.0.normalize() * far_m);
        scene.settle(view);
        scene.overfly.draw(&scene.output, 0).unwrap();
        let read = |renderer: &mut Renderer| renderer.read_pixels().unwrap();
        let drawn = scene.overfly.with_renderer(read).unwrap();
        let none = in_one_range(&scene.output.views[0], false);
        let (none, _) = scene.picture(none);
        let other = drawn.chunks_exact(4).zip(none.chunks_exact(4)).filter(|(a, b)| a != b);
        let other = other.count();
        assert!(other <= 4, "{other} pixels show a planet that is a point, {far_m} m away");
    }
}

/// A renderer that has another size than the view fails to draw, as one whose device is lost fails;
/// no driver here loses its device when asked, so it is taken away and another one put in its place.
#[test]
fn case_42_a_resize_in_the_middle_of_a_frame_and_a_new_device_leave_the_state_alone() {
    if !device("case_42_a_resize_in_the_middle_of_a_frame_and_a_new_device_leave_the_state_alone") {
        return;
    }
    let settings = config::load("small").unwrap();
    let [mut plain, mut drawn] = [0, 1].map(|_| Scene::new(settings.clone(), 1));
    let renderer = drawn.renderer();
    drawn.overfly.set_renderer(renderer);
    let steady = drawn.renderer();
    plain.overfly.set_renderer(steady);
    let sea = deep_sea(&plain);
    let mut failed = 0;
    for frame in 0..90_u32 {
        let turned = sea.lat_rad + 1e-3 * f64::from(frame);
        let view = plain.view(Geodetic { lat_rad: turned, height_m: 60.0, ..sea }, -20.0);
        let resized = frame % 10 == 3;
        if frame % 30 == 17 {
            let renderer = drawn.renderer();
            drawn.overfly.set_renderer(renderer);
        }
        let size_px = if resized { [64, 48] } else { SIZE_PX };
        drawn.overfly.with_renderer(|renderer| renderer.resize(size_px).unwrap());
        plain.frame(view, false).unwrap();
        match drawn.frame(view, true) {
            Ok(()) => assert!(!resized),
            Err(FrameError::Draw(DrawError::Size { .. })) if resized => failed += 1,
            Err(error) => panic!("frame {frame}: {error}"),
        }
        assert_eq!(plain.output.digest, drawn.output.digest, "frame {frame}");
        assert_eq!(plain.output.wanted, drawn.output.wanted);
    }
    assert_eq!(failed, 9);
    let read = |scene: &mut Scene| {
        scene.overfly.draw(&scene.output, 0).unwrap();
        scene.overfly.with_renderer(|renderer| renderer.read_pixels().unwrap()).unwrap()
    };
    assert!(read(&mut plain) == read(&mut drawn), "and the picture is that of a calm renderer");
}

/// Refused frames change nothing of the whole, either.
#[test]
fn case_13_a_refused_view_says_why_and_the_next_frame_is_as_if_it_had_never_been() {
    let mut scene = Scene::new(config::load("small").unwrap(), 1);
    let view = scene.view(Geodetic::from_degrees(10.0, 20.0, 200.0), -30.0);
    scene.settle(view);
    let before = scene.output.digest;
    let mut lost = view;
    lost.eye = Ecef(view.eye.0 * f64::NAN);
    let fault = scene.frame(lost, false).unwrap_err();
    assert_eq!(fault.to_string(), "view: eye is NaN, allowed is any finite number");
    scene.frame(view, false).unwrap();
    assert_eq!(scene.output.digest, before);
}

#[test]
fn case_41_worker_counts_from_1_to_64_give_one_digest_and_65_are_refused() {
    let digests = [1, 2, 3, 7, 64].map(|workers| {
        let mut scene = Scene::new(config::load("small").unwrap(), workers);
        let mut sum = 0_u64;
        for frame in 0..40_u32 {
            let at = Geodetic::from_degrees(0.2 * f64::from(frame), 20.0, 150.0);
            scene.input.time_s = f64::from(frame) / 60.0;
            let view = scene.view(at, -20.0);
            scene.frame(view, false).unwrap();
            sum = mix(sum ^ scene.output.digest.all());
        }
        sum
    });
    assert!(digests.iter().all(|digest| *digest == digests[0]), "{digests:x?}");
    let Err(fault) = Overfly::new(&config::load("small").unwrap(), 65) else {
        panic!("65 workers were taken")
    };
    assert_eq!(fault.to_string(), "65 workers were asked for, at most 64 are possible");
}

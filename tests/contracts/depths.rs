//! Depth ranges: as many as the format and order need, and the same picture however many.
//!
//! In:    presets, bundled flights; a Vulkan device, or none.
//! Out:   passes or fails; skipped by name without a device, unless `OVERFLY_REQUIRE_GPU` is 1.
//! Keeps: nothing.
//! Not here: which surfaces a range tells apart (`render_vk/tests/depth.rs`).

use super::flights::Tour;
use super::pictures::device;
use overfly::core::frame::data::{RangeDraws, ViewDraws};
use overfly::core::settings::{DepthFormat, DepthOrder, SceneSettings, VertexPrecision};
use overfly::render_vk::{Renderer, RendererSettings};
use overfly::{Overfly, config};

const SIZE_PX: [u32; 2] = [640, 360];
/// Far over near of a range in which surfaces 1e-4 apart never fight.
const RATIO: f64 = 300.0;

/// A preset's file with `depth` set to something else.
fn with_depth(preset: &str, depth: &str) -> SceneSettings {
    let text = config::preset(preset).expect("bundled");
    let (mut lines, mut inside) = (Vec::new(), false);
    for line in text.lines() {
        let begins = line.starts_with("    depth:");
        if begins {
            lines.push(format!("    depth: ({depth}),"));
        } else if !inside {
            lines.push(line.to_owned());
        }
        inside = (begins || inside) && !line.starts_with("    )") && !line.ends_with("),");
    }
    assert!(lines.iter().any(|line| line.starts_with("    depth:")), "{preset} has no depth");
    let text = lines.join("\n");
    config::read(&text, preset).unwrap_or_else(|faults| panic!("{preset}, {depth}: {faults:?}"))
}

#[test]
fn auto_takes_ranges_in_which_surfaces_1e_4_apart_do_not_fight_and_no_more_than_needed() {
    for preset in ["earth", "moon", "small"] {
        for (format, order) in
            [("D24", "Forward"), ("D24", "Reversed"), ("D32F", "Forward"), ("D32F", "Reversed")]
        {
            let depth = format!("format: {format}, order: {order}, ranges: Auto");
            let scene = with_depth(preset, &depth);
            let near_m = scene.views.iter().map(|lens| lens.near_m).fold(f64::INFINITY, f64::min);
            let far_m = 16.0 * scene.body.a_m;
            let splits_m = &scene.depth.splits_m;
            if (format, order) == ("D32F", "Reversed") {
                assert!(splits_m.is_empty(), "{preset}: {splits_m:?}");
                continue;
            }
            let borders = [&[near_m], &splits_m[..], &[far_m]].concat();
            for pair in borders.windows(2) {
                assert!(pair[1] / pair[0] <= RATIO * 1.000_001, "{preset}, {depth}: {borders:?}");
            }
            let one_less = (0..splits_m.len()).fold(near_m, |reach_m, _| reach_m * RATIO);
            assert!(one_less < far_m, "{preset}, {depth}: {borders:?}");
        }
    }
}

/// A view's draws in one range: every patch of any of them.
fn in_one_range(view: &ViewDraws) -> ViewDraws {
    let mut patches: Vec<u32> = view.ranges.iter().flat_map(|r| r.patches.clone()).collect();
    patches.sort_unstable();
    patches.dedup();
    let near_m = view.ranges[0].near_m;
    let range = RangeDraws { near_m, far_m: f64::INFINITY, patches };
    ViewDraws { camera: view.camera, ranges: vec![range] }
}

/// A flight over a scene as its preset has it, but for precision and morphs.
fn tour(flight: &str, preset: &str, vertices: VertexPrecision, morph_s: f64) -> Tour {
    let mut scene = config::load(preset).unwrap();
    scene.depth.format = DepthFormat::D32F;
    scene.depth.order = DepthOrder::Reversed;
    scene.depth.splits_m = vec![30.0, 1e4];
    scene.lod.morph_s = morph_s;
    scene.vertices = vertices;
    let overfly = Overfly::new(&scene, 1).unwrap();
    let limits = *overfly.terrain().limits();
    let mut tour = Tour::over(overfly, scene, flight);
    let settings = RendererSettings::of(&tour.scene, &limits, SIZE_PX);
    tour.overfly.set_renderer(Renderer::new(&settings).unwrap());
    tour
}

/// Pixels that differ between the view's ranges and one for all, in the last frame.
fn different(tour: &mut Tour) -> usize {
    let read = |tour: &mut Tour| {
        tour.overfly.draw(&tour.output, 0).unwrap();
        tour.overfly.with_renderer(|renderer| renderer.read_pixels().unwrap()).unwrap()
    };
    assert_eq!(tour.output.views[0].ranges.len(), 3);
    let three = read(tour);
    let merged = in_one_range(&tour.output.views[0]);
    let own = std::mem::replace(&mut tour.output.views[0], merged);
    let one = read(tour);
    tour.output.views[0] = own;
    one.chunks_exact(4).zip(three.chunks_exact(4)).filter(|(a, b)| a != b).count()
}

#[test]
fn three_ranges_and_one_show_the_same_ground() {
    if !device("three_ranges_and_one_show_the_same_ground") {
        return;
    }
    let allowed = (SIZE_PX[0] * SIZE_PX[1]) as usize / 2000;
    let mut worst = 0;
    for (flight, preset, vertices, morph_s) in [
        ("rainier", "earth", VertexPrecision::TwoFloat, 0.5),
        ("descent", "moon", VertexPrecision::EyeF64, 0.0),
        ("poles", "small", VertexPrecision::EyeF64, 0.5),
        ("descent", "earth", VertexPrecision::TwoFloat, 0.0),
    ] {
        let mut tour = tour(flight, preset, vertices, morph_s);
        let frames = tour.flight.poses.len();
        for part in 1..=5 {
            // Some frames in a row, so that pages come and vertices are on their way.
            let last = (frames * part / 5).saturating_sub(1 + 100 * part);
            for index in last - 25..=last {
                tour.input.time_s = tour.flight.poses[index].time_s;
                tour.frame(index, index == last);
            }
            let found = different(&mut tour);
            assert!(found <= allowed, "{found} pixels differ, {flight} over {preset}, {last}");
            worst = worst.max(found);
        }
    }
    println!("at most {worst} of {} pixels differ", SIZE_PX[0] * SIZE_PX[1]);
}

//! No hole in the ground, at any moment of any bundled flight.
//!
//! In:    bundled flights over presets, while vertices move; a Vulkan device, or none.
//! Out:   no magenta below the horizon, no pixel that looks through the ground at what is far.
//! Keeps: nothing.
//! Not here: the mesh's own audit (`flights`), holes of a made-up planet (`render_vk/tests`).
//!
//! Nothing is drawn behind the ground, which is cleared in magenta. Sky is magenta that hangs
//! together up to the picture's border; all other magenta further than 2 pixels from it is a hole.
//! Cracks through which further ground is seen are lone far pixels among near ones.
//! `OVERFLY_CRACK_FRAMES=500` looks at so many frames of each flight.

use super::flights::Tour;
use super::pictures::device;
use overfly::core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly::render_vk::{Backdrop, Renderer, RendererSettings, Show};
use overfly::{Overfly, config};

const SIZE: [usize; 2] = [640, 360];
const MAGENTA: [u8; 3] = [255, 0, 255];
/// Magenta so near the sky is the horizon's own jagged line.
const HORIZON_PX: usize = 2;
/// A lone pixel so many times as far as its neighbours, which agree within a fifth.
const FAR_TIMES: f32 = 3.0;
const AGREE: f32 = 0.2;
const AGREEING: usize = 7;

/// A picture: what is magenta, and how far ground is, infinite where there is none.
struct Shot {
    magenta: Vec<bool>,
    distance_m: Vec<f32>,
}

/// A flight over a scene whose vertices move, drawn in one reversed float range.
fn tour(flight: &str, preset: &str, vertices: VertexPrecision) -> Tour {
    let mut scene = config::load(preset).unwrap();
    scene.depth.format = DepthFormat::D32F;
    scene.depth.order = DepthOrder::Reversed;
    scene.depth.splits_m.clear();
    scene.lod.morph_s = 0.5;
    scene.vertices = vertices;
    let mut overfly = Overfly::new(&scene, 1).unwrap();
    let size_px = SIZE.map(|n| u32::try_from(n).unwrap());
    let settings = RendererSettings::of(&scene, overfly.terrain().limits(), size_px);
    let renderer = Renderer::new(&RendererSettings { keep_depth: true, ..settings });
    overfly.set_renderer(renderer.unwrap());
    let looks = overfly.looks_mut();
    (looks.show, looks.backdrop) = (Show::Normals, Backdrop::Colour([1.0, 0.0, 1.0]));
    Tour::over(overfly, scene, flight)
}

/// Draws the last frame's view, or another in its place.
fn shot(tour: &mut Tour) -> Shot {
    tour.overfly.draw(&tour.output, 0).unwrap();
    let near_m = overfly::core::geodesy::narrow(tour.output.views[0].ranges[0].near_m);
    let read =
        |renderer: &mut Renderer| (renderer.read_pixels().unwrap(), renderer.read_depth().unwrap());
    let (pixels, depths) = tour.overfly.with_renderer(read).unwrap();
    Shot {
        magenta: pixels.chunks_exact(4).map(|p| p[..3] == MAGENTA).collect(),
        distance_m: depths.iter().map(|depth| near_m / depth).collect(),
    }
}

/// Pixels within `reach` of one, itself among them.
fn around(at: usize, reach: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (at % SIZE[0], at / SIZE[0]);
    let rows = y.saturating_sub(reach)..=(y + reach).min(SIZE[1] - 1);
    let columns = x.saturating_sub(reach)..=(x + reach).min(SIZE[0] - 1);
    rows.flat_map(move |y| columns.clone().map(move |x| y * SIZE[0] + x))
}

impl Shot {
    /// Magenta pixels that are neither sky nor within [`HORIZON_PX`] of it.
    fn holes(&self) -> Vec<usize> {
        let [width, height] = SIZE;
        let is_border = |at: usize| {
            let (x, y) = (at % width, at / width);
            x == 0 || y == 0 || x == width - 1 || y == height - 1
        };
        let mut sky = vec![false; width * height];
        let mut next: Vec<usize> =
            (0..sky.len()).filter(|&at| is_border(at) && self.magenta[at]).collect();
        next.iter().for_each(|&at| sky[at] = true);
        while let Some(at) = next.pop() {
            let new = |beside: &usize| self.magenta[*beside] && !sky[*beside];
            let found = next.len();
            next.extend(around(at, 1).filter(new));
            next[found..].iter().for_each(|&beside| sky[beside] = true);
        }
        let at_sky = |at: usize| around(at, HORIZON_PX).any(|beside| sky[beside]);
        (0..sky.len()).filter(|&at| self.magenta[at] && !at_sky(at)).collect()
    }

    /// Pixels that are much further than the eight around them, most of which agree.
    fn lone_far(&self) -> Vec<usize> {
        let inner = |&at: &usize| {
            (1..SIZE[0] - 1).contains(&(at % SIZE[0])) && (1..SIZE[1] - 1).contains(&(at / SIZE[0]))
        };
        let lone = |&at: &usize| {
            let mut beside: Vec<f32> = around(at, 1).map(|n| self.distance_m[n]).collect();
            beside.sort_unstable_by(f32::total_cmp);
            let middle = beside[4];
            let agree = |m: &&f32| (*m / middle - 1.0).abs() <= AGREE;
            middle.is_finite()
                && self.distance_m[at] > FAR_TIMES * middle
                && beside.iter().filter(agree).count() >= AGREEING
        };
        (0..self.distance_m.len()).filter(inner).filter(lone).collect()
    }
}

/// Frames of each flight that are looked at.
fn frames() -> usize {
    std::env::var("OVERFLY_CRACK_FRAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(20)
}

/// Looks at frames spread over a flight; before each it flies some frames in a row.
fn fly(flight: &str, preset: &str, vertices: VertexPrecision) {
    let mut tour = tour(flight, preset, vertices);
    let (all, count) = (tour.flight.poses.len(), frames());
    let (mut moving, mut ground) = (0, 0);
    let mut first = 0;
    for part in 1..=count {
        let last = (all * part / count).saturating_sub(1);
        for index in first.max(last.saturating_sub(12))..=last {
            tour.input.time_s = tour.flight.poses[index].time_s;
            tour.frame(index, false);
        }
        first = last + 1;
        moving += usize::from(tour.output.counts.splits > 0);
        let shot = shot(&mut tour);
        let (holes, lone) = (shot.holes(), shot.lone_far());
        let places = |found: &[usize]| {
            let place = |at: &usize| (at % SIZE[0], at / SIZE[0]);
            found.iter().take(9).map(place).collect::<Vec<_>>()
        };
        assert!(holes.is_empty(), "{flight}, frame {last}: holes {:?}", places(&holes));
        assert!(lone.is_empty(), "{flight}, frame {last}: lone far pixels {:?}", places(&lone));
        ground += shot.magenta.iter().filter(|magenta| !**magenta).count();
    }
    println!(
        "{flight}: {count} frames, {moving} of them while splitting, {ground} pixels of ground"
    );
    assert!(moving * 4 >= count, "vertices hardly move: {moving} of {count}");
    assert!(ground > count * 50_000, "hardly any ground: {ground} pixels in {count} frames");
}

#[test]
fn no_crack_along_rainier() {
    if device("no_crack_along_rainier") {
        fly("rainier", "earth", VertexPrecision::TwoFloat);
    }
}

#[test]
fn no_crack_along_descent() {
    if device("no_crack_along_descent") {
        fly("descent", "moon", VertexPrecision::EyeF64);
    }
}

#[test]
fn no_crack_along_poles() {
    if device("no_crack_along_poles") {
        fly("poles", "small", VertexPrecision::TwoFloat);
    }
}

/// The nearest patches in the middle of the picture, the nearest first.
fn patches_in_the_middle(tour: &Tour) -> Vec<u32> {
    let view = &tour.output.views[0];
    let camera = &view.camera;
    let patches = tour.overfly.terrain().patches();
    let depth_m = |slot: &u32| {
        let (centre, _) = patches.sphere(*slot)?;
        let d = centre - camera.eye.0;
        let z = camera.forward.dot(d);
        let inside = |axis: glam::DVec3, tan: f64| axis.dot(d).abs() < 0.6 * tan * z;
        let [tan_x, tan_y] = camera.half_tangents;
        (z > 0.0 && inside(camera.right, tan_x) && inside(camera.up, tan_y)).then_some((z, *slot))
    };
    let mut seen: Vec<_> = view.ranges[0].patches.iter().filter_map(depth_m).collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.into_iter().map(|(_, slot)| slot).collect()
}

#[test]
fn a_patch_that_is_not_drawn_is_a_hole() {
    if !device("a_patch_that_is_not_drawn_is_a_hole") {
        return;
    }
    let mut tour = tour("rainier", "small", VertexPrecision::TwoFloat);
    tour.settle(4000);
    assert!(shot(&mut tour).holes().is_empty());
    let all = tour.output.views[0].ranges[0].patches.clone();
    let mut found = 0;
    for &slot in &patches_in_the_middle(&tour)[..12] {
        let patches = &mut tour.output.views[0].ranges[0].patches;
        patches.retain(|&drawn| drawn != slot);
        assert_eq!(patches.len() + 1, all.len());
        found += usize::from(!shot(&mut tour).holes().is_empty());
        tour.output.views[0].ranges[0].patches.clone_from(&all);
    }
    // Some of them lie behind a hill or face away.
    println!("{found} of 12 lacking patches are seen");
    assert!(found >= 6, "only {found} of 12 lacking patches are seen");
}

#[test]
fn holes_and_lone_far_pixels_are_found() {
    let clean = || Shot {
        magenta: vec![false; SIZE[0] * SIZE[1]],
        distance_m: vec![100.0; SIZE[0] * SIZE[1]],
    };
    let at = 200 * SIZE[0] + 300;
    let mut shot = clean();
    shot.magenta[..50 * SIZE[0]].fill(true);
    shot.magenta[51 * SIZE[0] + 9] = true;
    assert!(shot.holes().is_empty() && shot.lone_far().is_empty());
    shot.magenta[at] = true;
    assert_eq!(shot.holes(), [at]);
    let mut shot = clean();
    shot.distance_m[at] = 1000.0;
    assert_eq!(shot.lone_far(), [at]);
    shot.distance_m[at + 1] = 1000.0;
    assert_eq!(shot.lone_far(), [at, at + 1]);
}

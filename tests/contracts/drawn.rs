//! What is measured is what is drawn: the mesh that errors are taken from, and Vulkan's pictures.
//!
//! In:    bundled flights over presets, while vertices move; a Vulkan device, or none.
//! Out:   in every pixel the same leaf at the same depth, but where an edge passes its middle.
//! Keeps: nothing.
//! Not here: what the mesh is measured against (`replay/tests/measure.rs`), holes (`cracks`).
//!
//! The rays of `measure` go through the middles of pixels here. Leaves are told apart by colour:
//! the debug view of levels is given a random level for each slot.

use super::flights::Tour;
use super::pictures::device;
use overfly::core::digest::mix;
use overfly::core::geodesy::trig;
use overfly::core::inspect::PatchInfo;
use overfly::core::scene::FrameParts;
use overfly::core::settings::{DepthFormat, DepthOrder, VertexPrecision};
use overfly::jobs::Team;
use overfly::render_vk::{Backdrop, Picture, Renderer, RendererSettings, Show};
use overfly::replay::measure::mesh::MeshThen;
use overfly::replay::measure::raster::Raster;
use overfly::replay::measure::rays::Grid;
use overfly::replay::measure::screen::Screen;
use overfly::{Overfly, config};

const SIZE_PX: [u32; 2] = [640, 360];
/// Linear colours of levels 1 to 5; that of 0 is too like the last.
const COLOURS: [[f32; 3]; 5] = [
    [0.80, 0.35, 0.02],
    [0.02, 0.35, 0.17],
    [0.85, 0.75, 0.05],
    [0.35, 0.02, 0.30],
    [0.10, 0.46, 0.80],
];

/// The colour of a slot.
fn colour_of(slot: u32) -> u8 {
    u8::try_from(mix(u64::from(slot)) % 5).unwrap()
}

/// The colour that a pixel is nearest to, whatever its brightness.
fn nearest(pixel: &[u8]) -> u8 {
    let linear = |byte: u8| trig::exp(2.2 * trig::ln((f64::from(byte) + 0.5) / 255.0));
    let likeness = |colour: &[f32; 3]| {
        let (mut product, mut square) = (0.0, 0.0);
        for (byte, part) in pixel.iter().zip(colour) {
            product += linear(*byte) * f64::from(*part);
            square += f64::from(part * part);
        }
        product / square.sqrt()
    };
    let all = (0_u8..).zip(&COLOURS).map(|(at, colour)| (likeness(colour), at));
    all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
}

/// A flight, and what draws it in one reversed float range, whose depth is kept.
fn tour(flight: &str, preset: &str, vertices: VertexPrecision) -> (Tour, Renderer) {
    let mut scene = config::load(preset).unwrap();
    (scene.depth.format, scene.depth.order) = (DepthFormat::D32F, DepthOrder::Reversed);
    scene.depth.splits_m.clear();
    scene.vertices = vertices;
    let overfly = Overfly::new(&scene, 1).unwrap();
    let settings = RendererSettings::of(&scene, overfly.terrain().limits(), SIZE_PX);
    let renderer = Renderer::new(&RendererSettings { keep_depth: true, ..settings }).unwrap();
    (Tour::over(overfly, scene, flight), renderer)
}

/// Colours of the leaves and depths in metres, row by row; no colour and infinite where there is none.
struct Shot {
    colours: Vec<Option<u8>>,
    depths_m: Vec<f64>,
}

/// As Vulkan draws the last frame.
fn drawn(tour: &Tour, renderer: &mut Renderer) -> Shot {
    let view = &tour.output.views[0];
    let near_m = view.ranges[0].near_m;
    let slots = tour.overfly.terrain().patches().used_end();
    let info = |slot| PatchInfo { level: 1 + colour_of(slot), ..PatchInfo::default() };
    let infos: Vec<PatchInfo> = (0..slots).map(info).collect();
    let terrain = tour.overfly.terrain();
    let patches = terrain.patches();
    let parts = FrameParts { sun_direction: None, sea: tour.scene.sea };
    let picture = Picture {
        show: Show::Level,
        infos: &infos,
        backdrop: Backdrop::Colour([0.0; 3]),
        time_ms: tour.output.time_ms,
        ..Picture::of(view, &patches, &parts)
    };
    renderer.draw(&picture, &Team::alone()).unwrap();
    let (pixels, depths) = (renderer.read_pixels().unwrap(), renderer.read_depth().unwrap());
    let is_ground = |depth: f32| depth > 0.0;
    let colour = |(pixel, &depth): (&[u8], &f32)| is_ground(depth).then(|| nearest(&pixel[..3]));
    Shot {
        colours: pixels.chunks_exact(4).zip(&depths).map(colour).collect(),
        depths_m: depths.iter().map(|&depth| near_m / f64::from(depth)).collect(),
    }
}

/// As `measure` sees it.
fn measured(tour: &Tour) -> Shot {
    let mut mesh = MeshThen::new(tour.scene.body);
    mesh.take(tour.overfly.terrain(), tour.output.time_ms);
    let screen = Screen::new(&tour.output.views[0].camera);
    let mut raster = Raster::default();
    raster.draw(&mesh.drawn, (&screen, &Grid::of_pixels(SIZE_PX)), 2);
    let colour = |(&leaf, &depth_m): (&u32, &f64)| {
        depth_m.is_finite().then(|| colour_of(mesh.drawn.leaves[leaf as usize].slot))
    };
    let colours = raster.leaf.iter().zip(&raster.depth_m).map(colour).collect();
    Shot { colours, depths_m: raster.depth_m }
}

/// The pixel itself and those around it.
fn around(at: usize) -> impl Iterator<Item = usize> {
    let [width, height] = SIZE_PX.map(|n| n as usize);
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
    let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

fn agree(flight: &str, preset: &str, vertices: VertexPrecision, frames: &[usize]) {
    let (mut tour, mut renderer) = tour(flight, preset, vertices);
    let (mut next, mut moving) = (0, 0);
    for &last in frames {
        for index in next.max(last.saturating_sub(20))..=last {
            tour.frame(index, false);
            renderer.note_built(&tour.output.built);
        }
        next = last + 1;
        moving += tour.output.counts.splits;
        let (theirs, ours) = (drawn(&tour, &mut renderer), measured(&tour));
        let is_same = |at: usize| theirs.colours[at] == ours.colours[at];
        let (same, other): (Vec<usize>, Vec<usize>) =
            (0..ours.colours.len()).partition(|&at| is_same(at));
        let beside = |&at: &usize| around(at).any(|n| ours.colours[n] == theirs.colours[at]);
        let far = other.iter().filter(|at| !beside(at)).count();
        let ground = same.into_iter().filter(|&at| ours.colours[at].is_some());
        let mut off: Vec<f64> =
            ground.map(|at| (theirs.depths_m[at] / ours.depths_m[at] - 1.0).abs()).collect();
        off.sort_unstable_by(f64::total_cmp);
        let count = off.len();
        let (p50, p999) = (off[count / 2], off[count * 999 / 1000]);
        let what = format!(
            "{flight} over {preset}, frame {last}: {count} pixels of ground, {} of another leaf, \
             {far} of them not beside it; depths off by {p50:.1e}, {p999:.1e} in one of 1000",
            other.len()
        );
        println!("{what}");
        assert!(count > 50_000 && other.len() <= count / 500 && far <= count / 5000, "{what}");
        assert!(p50 <= 2e-7 && p999 <= 1e-5, "{what}");
    }
    assert!(moving > 0, "{flight} over {preset}: nothing morphs");
}

#[test]
fn what_is_measured_is_what_vulkan_draws() {
    if !device("what_is_measured_is_what_vulkan_draws") {
        return;
    }
    agree("rainier", "earth", VertexPrecision::TwoFloat, &[60, 6000]);
    agree("descent", "small", VertexPrecision::EyeF64, &[60, 4000, 9000]);
    agree("poles", "moon", VertexPrecision::TwoFloat, &[400, 5000]);
}

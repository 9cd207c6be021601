//! Columns of a frame: what they say, that they repeat, and that who draws them sees what we draw.
//!
//! In:    bundled flights, presets; the example `own_renderer`; a Vulkan device, or none.
//! Out:   passes or fails; pictures are skipped by name without a device.
//! Keeps: a folder for pictures, thrown away.
//! Not here: the other examples (`examples`), how Vulkan draws (`render_vk/tests`).

use super::command_line::command;
use super::examples::example;
use super::flights::Tour;
use super::pictures::device;
use overfly::core::camera::View;
use overfly::core::mesh::shade::SHARED;
use overfly::core::projection::{DepthTerms, EyeConstants};
use overfly::core::settings::{DepthFormat, DepthOrder, SceneSettings};
use overfly::render_vk::{Backdrop, Renderer, RendererSettings};
use overfly::{DrawColumns, Host, Overfly, Pages, VertexColumns, Workers, config};
use software::Painter;
use std::collections::BTreeMap;
use std::path::Path;

#[expect(dead_code, reason = "only the example writes its picture")]
#[path = "../../examples/software/mod.rs"]
mod software;

/// Draws and vertices of one view.
fn columns_of(tour: &Tour) -> (DrawColumns, VertexColumns) {
    let (mut draws, mut vertices) = (DrawColumns::default(), VertexColumns::default());
    tour.overfly.columns(&tour.output, 0, &mut draws).unwrap();
    let mut slots = draws.slot.clone();
    slots.sort_unstable();
    slots.dedup();
    tour.overfly.vertices(&slots, &mut vertices).unwrap();
    (draws, vertices)
}

#[test]
fn columns_are_the_same_bits_on_0_and_2_workers() {
    let mut tours = [0, 2].map(|workers| Tour::new("descent", "small", workers));
    for index in (0..9000).step_by(300) {
        tours.iter_mut().for_each(|tour| tour.frame(index, false));
        let [alone, helped] = tours.each_ref().map(columns_of);
        assert_eq!(alone, helped, "frame {index}");
        assert!(index < 600 || alone.0.rows() > 100, "frame {index}: {} draws", alone.0.rows());
    }
}

#[test]
fn columns_say_what_the_draws_and_the_arena_say() {
    let mut tour = Tour::new("rainier", "earth", 1);
    (4000..4060).for_each(|index| tour.frame(index, false));
    let (draws, vertices) = columns_of(&tour);
    let patches = tour.overfly.terrain().patches();
    let rows = tour.output.views[0].ranges.iter().zip(0_u8..);
    let rows = rows.flat_map(|(range, at)| range.patches.iter().map(move |&slot| (at, slot)));
    assert!(draws.range.iter().copied().zip(draws.slot.iter().copied()).eq(rows));
    for column in [draws.key.len(), draws.level.len(), draws.error_m.len()] {
        assert_eq!(column, draws.rows());
    }

    // One key a slot, one slot a key; its level and error are those of the mesh.
    let slots: BTreeMap<_, _> = draws.key.iter().zip(&draws.slot).collect();
    let keys: BTreeMap<_, _> = draws.slot.iter().zip(&draws.key).collect();
    assert_eq!((slots.len(), vertices.slot.len()), (keys.len(), keys.len()));
    let mut mesh = overfly::core::inspect::DrawnMesh::default();
    tour.overfly.terrain().drawn(tour.output.time_ms, &mut mesh);
    for row in 0..draws.rows() {
        let leaf = &mesh.leaves[mesh.find(draws.key[row]).expect("a leaf of the mesh")];
        let found = (draws.slot[row], draws.level[row], draws.error_m[row]);
        assert_eq!(found, (leaf.slot, leaf.level, leaf.error_m));
    }

    let per_patch = tour.overfly.vertices_per_patch() as usize;
    assert_eq!(vertices.vertices(), vertices.slot.len() * per_patch);
    let every = [vertices.normal.len(), vertices.albedo.len(), vertices.start_ms.len()];
    assert_eq!(every, [vertices.vertices(); 3]);
    for (i, &slot) in vertices.slot.iter().enumerate() {
        for (j, own) in patches.vertices_of(slot).iter().enumerate() {
            let at = i * per_patch + j;
            assert_eq!((vertices.hi[at], vertices.lo[at]), (own.position.hi, own.position.lo));
            let length2: f32 = vertices.normal[at].iter().map(|c| c * c).sum();
            assert!((length2 - 1.0).abs() < 1e-6, "{length2}");
            assert!(vertices.albedo[at].iter().all(|c| (0.0..=1.0).contains(c)));
        }
    }
    assert_eq!(tour.overfly.indices().len(), 3 << tour.scene.lod.patch_depth);
}

#[test]
fn what_is_built_in_each_frame_is_all_that_a_renderer_must_take() {
    let mut tour = Tour::new("descent", "small", 1);
    let per_patch = tour.overfly.vertices_per_patch() as usize;
    let slots = tour.overfly.terrain().limits().leaves as usize;
    let mut kept = vec![[[0.0_f32; 3]; 2]; slots * per_patch];
    let mut built = VertexColumns::default();
    for index in (2000..6000).step_by(40) {
        tour.frame(index, false);
        tour.overfly.vertices(&tour.output.built, &mut built).unwrap();
        for (i, &slot) in built.slot.iter().enumerate() {
            for j in 0..per_patch {
                let at = i * per_patch + j;
                kept[slot as usize * per_patch + j] = [built.hi[at], built.lo[at]];
            }
        }
        let (_, all) = columns_of(&tour);
        for (i, &slot) in all.slot.iter().enumerate() {
            let (from, to) = (i * per_patch, slot as usize * per_patch);
            let same = (0..per_patch).all(|j| kept[to + j] == [all.hi[from + j], all.lo[from + j]]);
            assert!(same, "frame {index}, slot {slot}");
        }
    }
}

#[test]
fn columns_that_cannot_be_are_refused_and_left_empty() {
    let mut tour = Tour::new("poles", "small", 0);
    let (mut draws, mut vertices) = (DrawColumns::default(), VertexColumns::default());
    let mut refused = |tour: &Tour, view| {
        let fault = tour.overfly.columns(&tour.output, view, &mut draws).unwrap_err();
        assert_eq!(draws, DrawColumns::default());
        fault.to_string()
    };
    assert!(refused(&tour, 0).contains("0 frames of this ground were run"));
    (0..30).for_each(|index| tour.frame(index, false));
    assert_eq!(refused(&tour, 1), "view 1 is not in the frame, which has 1");
    tour.output.frame -= 1;
    assert!(refused(&tour, 0).contains("frame 28, but 30 frames"));
    let fault = tour.overfly.vertices(&[0, u32::MAX], &mut vertices).unwrap_err().to_string();
    assert!(fault.contains("slot 4294967295 shows nothing, allowed are"), "{fault}");
    assert_eq!(vertices, VertexColumns::default());
}

#[test]
fn colours_have_the_numbers_of_the_shaders() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("render_vk/shaders");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let names = ["light", "no_sun", "air", "no_air", "land", "regolith", "sea"];
    let text: String = names.map(|name| read(&format!("{name}.wgsl"))).concat();
    let numbers = |line: &str| -> Vec<f32> {
        let value = line.split('=').nth(1).unwrap().split(';').next().unwrap();
        let inner = value.split('(').next_back().unwrap().trim_end().trim_end_matches(')');
        inner.split(',').map(|number| number.trim().parse().unwrap()).collect()
    };
    for (name, ours) in SHARED {
        let start = format!("const {name}: ");
        let line = text.lines().find(|line| line.starts_with(&start));
        assert_eq!(numbers(line.unwrap_or_else(|| panic!("no {name}"))), ours, "{name}");
    }
}

/// A scene in one reversed float range, at rest, so that depth can be compared.
fn scene(preset: &str) -> SceneSettings {
    let mut scene = config::load(preset).unwrap();
    (scene.depth.format, scene.depth.order) = (DepthFormat::D32F, DepthOrder::Reversed);
    scene.depth.splits_m.clear();
    scene.lod.morph_s = 0.0;
    scene
}

/// A view of a flight.
fn view(overfly: &Overfly, index: usize) -> View {
    let scene = overfly.scene();
    let pose = &overfly.flight("descent").unwrap().poses[index];
    overfly::replay::view_of(pose, &scene.views[0], [640, 360], &scene.body)
}

#[test]
fn a_renderer_of_the_hosts_covers_the_same_pixels_at_the_same_depth() {
    if !device("a_renderer_of_the_hosts_covers_the_same_pixels_at_the_same_depth") {
        return;
    }
    let scene = scene("small");
    let host =
        Host { workers: Workers::Caller, pages: Pages::Waited { threads: 1 }, ..Host::default() };
    let mut overfly = Overfly::new(&scene, host).unwrap();
    let settings = RendererSettings::of(&scene, overfly.terrain().limits(), [640, 360]);
    let settings = RendererSettings { keep_depth: true, ..settings };
    overfly.set_renderer(Renderer::new(&settings).unwrap());
    overfly.looks_mut().backdrop = Backdrop::Colour([1.0, 0.0, 1.0]);
    let mut painter = Painter::new(&overfly);
    let mut output = overfly::core::frame::FrameOutput::default();
    for index in [0, 4000, 9000, 10_800] {
        let view = view(&overfly, index);
        painter.settle(&mut overfly, &[view], &mut output).unwrap();
        let canvas = painter.draw(&overfly, &output, 0).unwrap();
        overfly.draw(&output, 0).unwrap();
        let depths = overfly.with_renderer(|r| r.read_depth().unwrap()).unwrap();
        let terms = DepthTerms::of(scene.depth.order, [view.near_m, f64::INFINITY]);
        let (mut covered, mut uncovered, mut deeper) = (0_u32, 0_u32, 0_u32);
        for (theirs, ours) in canvas.nearness.iter().zip(&depths) {
            let (is_theirs, is_ours) = (*theirs > 0.0, *ours > 0.0);
            covered += u32::from(is_ours);
            uncovered += u32::from(is_theirs != is_ours);
            let both = is_theirs && is_ours;
            let ratio = terms.depth(1.0 / theirs) / ours;
            deeper += u32::from(both && (ratio - 1.0).abs() > 1e-3);
        }
        println!("frame {index}: {covered} covered, {uncovered} not by both, {deeper} deeper");
        assert!(covered > 20_000, "frame {index}: {covered} pixels of ground");
        assert!(uncovered <= 5 && deeper <= covered / 5000, "{index}: {uncovered}, {deeper}");
    }
}

#[test]
fn the_constants_of_an_eye_take_vertices_where_the_camera_has_them() {
    let mut tour = Tour::new("rainier", "earth", 0);
    (4000..4030).for_each(|index| tour.frame(index, false));
    let camera = &tour.output.views[0].camera;
    let eye = EyeConstants::of(camera);
    let patches = tour.overfly.terrain().patches();
    let (mut worst, mut seen) = (0.0_f64, 0);
    for &slot in &tour.output.views[0].ranges[1].patches {
        for vertex in patches.vertices_of(slot) {
            let [hi, lo] = [vertex.position.hi, vertex.position.lo];
            let wide = |i: usize| f64::from(hi[i]) + f64::from(lo[i]);
            let away = glam::DVec3::new(wide(0), wide(1), wide(2)) - camera.eye.0;
            let exact = [camera.right, camera.up, camera.forward].map(|axis| axis.dot(away));
            let found = eye.pictured(&vertex.position).map(f64::from);
            let off = (0..3).map(|i| (found[i] - exact[i]).abs()).fold(0.0, f64::max);
            worst = worst.max(off / away.length());
            seen += 1;
        }
    }
    println!("{seen} vertices, at most {worst:.1e} of their distance off");
    assert!(seen > 1000 && worst < 3.0 * f64::from(f32::EPSILON), "{seen} {worst:e}");
}

/// Three bytes a pixel.
fn pixels(path: &Path) -> Vec<[i32; 3]> {
    let picture = image::open(path).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (640, 360));
    picture.pixels().map(|pixel| pixel.0.map(i32::from)).collect()
}

/// The file of a scene.
fn scene_file(folder: &Path, text: &str) -> String {
    let path = folder.join("scene.ron");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The same place drawn by the example and by `overfly still`.
fn both(folder: &Path, scene: &str, [at, heading, pitch]: [&str; 3]) -> [Vec<[i32; 3]>; 2] {
    let (own, ours) = (folder.join("own.png"), folder.join("ours.png"));
    let look = format!("{heading},{pitch}");
    let done = example(
        "own_renderer",
        &[
            "--scene",
            scene,
            &format!("--at={at}"),
            &format!("--look={look}"),
            "--out",
            own.to_str().unwrap(),
        ],
    );
    assert!(done.code == 0 && done.out.contains("pixels show ground"), "{done:?}");
    let still = command()
        .args(["still", "--scene", scene, "--agl", "--size", "640x360"])
        .args([format!("--at={at}"), format!("--look={look}"), "--out".into()])
        .arg(&ours)
        .output()
        .unwrap();
    assert!(still.status.success(), "{}", String::from_utf8_lossy(&still.stderr));
    [pixels(&own), pixels(&ours)]
}

/// Means over squares of 20 pixels.
fn squares(picture: &[[i32; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; 32 * 18];
    for (at, pixel) in picture.iter().enumerate() {
        let sum = &mut sums[at / 640 / 20 * 32 + at % 640 / 20];
        (0..3).for_each(|i| sum[i] += f64::from(pixel[i]) / 400.0);
    }
    sums
}

/// How two pictures differ, of 255: on the whole, and square by square on average and at most.
#[derive(Debug)]
struct Difference {
    whole: f64,
    square: f64,
    worst: f64,
}

impl Difference {
    fn of([own, ours]: &[Vec<[i32; 3]>; 2]) -> Self {
        let (own, ours) = (squares(own), squares(ours));
        let count = own.len() as f64;
        let most = |off: [f64; 3]| off.into_iter().map(f64::abs).fold(0.0, f64::max);
        let off =
            own.iter().zip(&ours).map(|(own, ours)| [0, 1, 2].map(|i: usize| own[i] - ours[i]));
        let off: Vec<[f64; 3]> = off.collect();
        Self {
            whole: most(
                [0, 1, 2].map(|i: usize| off.iter().map(|off| off[i]).sum::<f64>() / count),
            ),
            square: off.iter().copied().map(most).sum::<f64>() / count,
            worst: off.iter().copied().map(most).fold(0.0, f64::max),
        }
    }
}

/// A planet without air: the sky is black and ground is not, so that the outline compares too.
const MOON: &str = "Scene(body: Sphere(radius_m: 1000.0), lod: (morph_s: 0.0), depth: (ranges: 1), \
     sources: [Procedural(seed: 7, style: Cratered)], \
     sun: Some((latitude_deg: 50.0, longitude_deg: 60.0)))";
/// The small planet without a sun: lit evenly, so that light in air that is thick beside its radius
/// does not count.
const SMALL: &str = "Scene(body: Sphere(radius_m: 1000.0), lod: (morph_s: 0.0), depth: (ranges: 1), \
     sources: [Procedural(seed: 1)], sea: true, sun: None)";
const EARTH: &str = "Scene(body: Wgs84, lod: (morph_s: 0.0), sources: [Procedural(seed: 2029)], \
     sea: true, sun: Some((latitude_deg: 30.0, longitude_deg: -100.0)))";

#[test]
fn the_examples_picture_of_a_moon_has_the_outline_of_ours() {
    if !device("the_examples_picture_of_a_moon_has_the_outline_of_ours") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_file(folder.path(), MOON);
    let [own, ours] = both(folder.path(), &scene, ["20,30,120", "70", "-30"]);
    let is_ground = |pixel: &[i32; 3]| *pixel != [0; 3];
    let outline = own.iter().zip(&ours).filter(|(own, ours)| is_ground(own) != is_ground(ours));
    let (outline, ground) = (outline.count(), ours.iter().filter(|p| is_ground(p)).count());
    println!("{outline} pixels of the outline, {ground} of ground");
    assert!(ground > 50_000 && ground < 600 * 360, "{ground} pixels of ground");
    assert!(outline <= 5, "{outline} pixels are ground in one picture only");
}

/// The shaders' grain is the difference: it makes squares brighter and darker by as much as it is
/// strong on what lies there: little on snow, most between sand and plants. Whole pictures differ
/// less, but for grass, since the grain's widest patches are wider than the picture. Air is the
/// other difference: so the eye is near.
#[test]
fn the_examples_pictures_have_the_colours_of_ours_but_for_grain() {
    if !device("the_examples_pictures_have_the_colours_of_ours_but_for_grain") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (what, scene, pose, allowed) in [
        ("regolith", MOON, ["20,30,120", "70", "-30"], [1.0, 3.0, 20.0]),
        ("snow", EARTH, ["80,-40,2000", "90", "-80"], [0.5, 1.0, 4.0]),
        ("beach", SMALL, ["20,30,150", "90", "-80"], [4.0, 8.0, 50.0]),
        ("grass", EARTH, ["46.85,-121.76,400", "90", "-60"], [16.0, 18.0, 35.0]),
    ] {
        let scene = scene_file(folder.path(), scene);
        let found = Difference::of(&both(folder.path(), &scene, pose));
        println!("{what}: {found:.1?} of 255");
        let Difference { whole, square, worst } = found;
        let all = [whole, square, worst].into_iter().zip(allowed);
        assert!(all.into_iter().all(|(found, allowed)| found <= allowed), "{what}: {found:?}");
    }
}

//! Mutations: a deliberate fault in each thing that is measured, and the metric that is for it.
//!
//! In:    a small flight over a procedural planet; faults made by hand in meshes, pages, bounds.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: how large errors are on real flights (`overfly measure`).
//!
//! Each fault must make its own metrics fire, those and no others; without a fault none does.

use glam::DVec3;
use overfly_core::camera::{View, orientation_from_attitude};
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::ground::{Place, triangle_id};
use overfly_core::inspect::DrawnLeaf;
use overfly_core::lattice::{middle, normal_of};
use overfly_core::lod::audit::lattice_points;
use overfly_core::settings::{DepthFormat, DepthOrder, SceneSettings};
use overfly_core::units::Radians;
use overfly_jobs::{Graph, Workers};
use overfly_replay::measure::depth::Buffer;
use overfly_replay::measure::heights::answer_error_m;
use overfly_replay::measure::mesh::MeshThen;
use overfly_replay::measure::pipeline::{Pipeline, in_picture, tremble};
use overfly_replay::measure::screen::Screen;
use overfly_replay::measure::{FlightErrors, Measure, MeasureSettings, PagePart, cracks};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

/// A terrain that has come up before one view.
struct Stand {
    scene: SceneSettings,
    generator: Generator,
    terrain: Terrain,
    output: FrameOutput,
    /// Pages that were made: making them is most of what these tests do.
    pages: Mutex<BTreeMap<(PageKey, PagePart), Arc<Page>>>,
}

/// Of the whole planet.
const RADIUS_M: f64 = 1000.0;

fn scene(triangles_max: u32, tolerance_px: f64) -> SceneSettings {
    let text = format!(
        "Scene(body: Sphere(radius_m: {RADIUS_M:?}), sources: [Procedural(seed: 7, finest_m: 1.0)], sea: true, \
         lod: (triangles_max: {triangles_max}, tolerance_px: {tolerance_px:?}))"
    );
    overfly_config::read(&text, "test").unwrap()
}

/// So high above the ground at some place on land, pitched so many degrees.
fn stand(scene: SceneSettings, above_m: f64, pitch_deg: f64) -> Stand {
    let generator = Generator::new(&scene);
    let planet = generator.planet().unwrap();
    let lands = (0..360).map(|i| Geodetic::from_degrees(20.0, f64::from(i), 0.0));
    let high = lands.max_by(|a, b| {
        let height_m = |at: &Geodetic| planet.sample(at.normal()).height_m;
        height_m(a).total_cmp(&height_m(b))
    });
    let mut at = high.unwrap();
    at.height_m = planet.sample(at.normal()).height_m + above_m;
    let view = View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(
            at,
            Radians(1.0),
            Radians::from_degrees(pitch_deg),
            Radians(0.0),
        ),
        field_of_view: Radians(1.0),
        size_px: [320, 180],
        near_m: 0.1,
    };
    let terrain = Terrain::new(&scene, &generator);
    let mut graph = Graph::new();
    add_stages(&mut graph, |terrain: &Terrain| terrain);
    let workers = Workers::new(1).unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    for _ in 0..2000 {
        input.views = vec![view];
        input.arrived.extend(output.wanted.iter().map(|&key| generator.page(key)));
        terrain.begin(&mut input).unwrap();
        graph.run(&terrain, &workers).unwrap();
        terrain.finish(&mut output);
        let counts = &output.counts;
        if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted + counts.admitted == 0
        {
            return Stand { scene, generator, terrain, output, pages: Mutex::default() };
        }
    }
    panic!("no fixed point: {:?}", output.counts);
}

impl Stand {
    /// Measures the view twice, the second time after `spoil` had the mesh; what it says of that.
    fn errors(&self, spoil: impl FnOnce(&mut MeshThen, &Measure)) -> FlightErrors {
        self.errors_of(4000, spoil)
    }

    fn errors_of(&self, rays: u32, spoil: impl FnOnce(&mut MeshThen, &Measure)) -> FlightErrors {
        self.errors_on(1, rays, spoil)
    }

    fn errors_on(
        &self,
        threads: usize,
        rays: u32,
        spoil: impl FnOnce(&mut MeshThen, &Measure),
    ) -> FlightErrors {
        let make = |key: PageKey, part: PagePart| -> Option<Arc<Page>> {
            let mut pages = self.pages.lock().unwrap();
            let page = || match part {
                PagePart::Heights => self.generator.bare_page_from(key, &[]),
                PagePart::Whole => self.generator.page(key),
            };
            Some(pages.entry((key, part)).or_insert_with(page).clone())
        };
        let settings = MeasureSettings {
            rays,
            threads,
            thorough_every: 1,
            cross_every: 2,
            ..MeasureSettings::default()
        };
        let mut measure = Measure::new(&self.terrain, settings);
        let frame = (&self.terrain, &self.output);
        measure.frame(frame, 0, &make, &mut FlightErrors::default());
        let mut flight = FlightErrors::default();
        measure.take(frame.0, frame.1);
        let mut spoilt = measure.now.clone();
        spoil(&mut spoilt, &measure);
        measure.now = spoilt;
        measure.judge(frame, 1, &make, &mut flight);
        flight
    }
}

#[test]
fn any_number_of_threads_measures_the_same_and_a_stopped_frame_is_none() {
    let stand = stand(scene(3000, 1.0), 30.0, -10.0);
    let [one, four] = [1, 4].map(|threads| stand.errors_on(threads, 4000, |_, _| {}).frames);
    assert_eq!(format!("{one:?}"), format!("{four:?}"));
    let mut measure = Measure::new(&stand.terrain, MeasureSettings::default());
    measure.stop_on(Arc::new(AtomicBool::new(true)));
    let (frame, mut flight) = ((&stand.terrain, &stand.output), FlightErrors::default());
    assert!(!measure.frame(frame, 0, &|key, _| Some(stand.generator.page(key)), &mut flight));
    assert!(flight.frames.is_empty());
}

/// Limits that a sound frame of these tests keeps, by name in the metric vector.
const LIMITS: [(&str, f64); 16] = [
    ("e3_ppm", 2000.0),
    ("e5_max", 1.0),
    ("p1_max_px", 1e-6),
    ("p3_max_deg", 1e-4),
    ("c1_edges", 0.0),
    ("c2_junctions", 0.0),
    ("c3_points", 0.0),
    ("c4_rays", 0.0),
    ("c5_rays", 0.0),
    ("lost_rays", 0.0),
    ("h1_max_m", 1e-8),
    ("h2_step_max_m", 1e-7),
    ("j1_rms_px", 1e-4),
    ("j1_step_px", 5e-4),
    ("m32_max_px", 1e-5),
    ("z1_d32f_share", 3e-7),
];

/// The metrics that are beyond their limits.
fn fired(errors: &FlightErrors) -> Vec<&'static str> {
    let over = |&&(name, limit): &&(&str, f64)| {
        let value = errors.value(name);
        assert!(!value.is_nan(), "{name} was not measured");
        value > limit
    };
    LIMITS.iter().filter(over).map(|(name, _)| *name).collect()
}

/// The leaf that most rays see, of those that lie within the picture by far.
fn seen_leaf(measure: &Measure) -> usize {
    seen_leaves(measure)[0]
}

/// All of those, by how many rays see them.
fn seen_leaves(measure: &Measure) -> Vec<usize> {
    let mut counts = vec![0_u32; measure.now.drawn.leaves.len()];
    let rays = measure.raster.depth_m.iter().zip(&measure.raster.leaf);
    let middle = measure.raster.leaf.len() / 3;
    rays.skip(middle)
        .take(middle)
        .filter(|(depth_m, _)| depth_m.is_finite())
        .for_each(|(_, &leaf)| counts[leaf as usize] += 1);
    let mut leaves: Vec<_> = (0..counts.len()).filter(|&leaf| counts[leaf] > 0).collect();
    leaves.sort_by_key(|&leaf| core::cmp::Reverse(counts[leaf]));
    leaves
}

#[test]
fn faults_in_a_mesh_fire_their_own_metrics_and_no_others() {
    let stand = stand(scene(20_000, 1.0), 60.0, -20.0);
    let sound = stand.errors(|_, _| {});
    assert_eq!(fired(&sound), [""; 0], "{:?}", sound.vector());
    assert!(sound.value("e1_max_px") > 0.0);
    // Nothing moves where nothing changes, to the last bit.
    for name in ["p1_max_px", "p3_max_deg", "h2_step_max_m"] {
        assert_eq!(sound.value(name), 0.0, "{name}");
    }
    assert!(sound.value("thorough_frames_count") == 1.0);

    // A vertex moved by 1 cm in f64, but not where it was uploaded from.
    let moved = stand.errors(|mesh, measure| {
        let leaf = seen_leaf(measure);
        let at = leaf * mesh.drawn.vertices_per_patch() + 4;
        let up = mesh.drawn.places[at].normalize();
        mesh.drawn.places[at] += up * 0.01;
    });
    assert_eq!(fired(&moved), ["m32_max_px"], "{:?}", moved.value("m32_max_px"));

    // A patch cut in two beside one that is not, with heights to the bit where they were.
    let junction = stand.errors(|mesh, measure| cut(mesh, seen_leaf(measure)));
    assert_eq!(fired(&junction), ["c1_edges", "c2_junctions"]);
    let e1_px = [&junction, &sound].map(|errors| errors.value("e1_max_px"));
    assert!((e1_px[0] - e1_px[1]).abs() < 1e-6, "{e1_px:?}");

    // A patch that is not there, on a slope behind which farther ground rises: no ray sees the mesh
    // from inside. Some may see the sky: that is E3 as well.
    let without = |nth: usize| stand.errors(|mesh, of| remove(mesh, seen_leaves(of)[nth]));
    let before_ground = |missing: &FlightErrors| missing.value("c4_rays") == 0.0;
    let missing = (0..32).map(without).find(before_ground).expect("a leaf before farther ground");
    let beyond_sky = fired(&missing).into_iter().filter(|&name| name != "e3_ppm");
    assert_eq!(beyond_sky.collect::<Vec<_>>(), ["c1_edges", "lost_rays"]);

    // A patch whose shading turns, and that is drawn anew.
    let turned = stand.errors(|mesh, measure| {
        let leaf = seen_leaf(measure);
        let n = mesh.drawn.vertices_per_patch();
        mesh.drawn.leaves[leaf].content ^= 1;
        mesh.normals[leaf * n..][..n].iter_mut().for_each(|normal| *normal += DVec3::X * 0.01);
    });
    assert_eq!(fired(&turned), ["p3_max_deg"]);
}

#[test]
fn a_patch_that_hangs_behind_the_ground_is_a_hidden_crack() {
    let stand = stand(scene(20_000, 1.0), 60.0, -20.0);
    let eye = stand.output.views[0].camera.eye.0;
    let behind = stand.errors_of(500, |mesh, measure| {
        // One that a single ray sees: its neighbours see the ground in front.
        let mut counts = vec![0_u32; mesh.drawn.leaves.len()];
        measure.raster.leaf.iter().for_each(|&leaf| counts[leaf as usize] += 1);
        let n = mesh.drawn.vertices_per_patch();
        let columns = measure.map().0;
        let lower = measure.raster.leaf.iter().enumerate().skip(measure.raster.leaf.len() * 2 / 3);
        let inner =
            lower.filter(|(at, _)| (columns / 4..columns * 3 / 4).contains(&(at % columns)));
        let mut single = inner.filter(|(_, leaf)| counts[**leaf as usize] == 1);
        let leaf = *single.next().expect("some are small").1 as usize;
        for place in &mut mesh.drawn.places[leaf * n..][..n] {
            *place = eye + (*place - eye) * 2.0;
        }
    });
    let fired = fired(&behind);
    assert!(fired.contains(&"c5_rays") && !fired.contains(&"c4_rays"), "{fired:?}");
}

#[test]
fn half_a_bound_does_not_hold() {
    let mut stand = stand(scene(20_000, 1.0), 60.0, -20.0);
    let sound = stand.errors(|_, _| {});
    assert!(fired(&sound).is_empty() && sound.faults().is_empty());
    // As tight as a bound can be, and then half of that.
    stand.output.counts.error_px_bound = sound.value("e1_max_px");
    assert!(fired(&stand.errors(|_, _| {})).is_empty());
    stand.output.counts.error_px_bound *= 0.5;
    let halved = stand.errors(|_, _| {});
    assert_eq!(fired(&halved), ["e5_max"]);
    assert!(halved.faults()[0].starts_with("E5"), "{:?}", halved.faults());
}

#[test]
fn an_eye_in_f32_jitters_and_a_vertex_in_two_places_is_found() {
    let stand = stand(scene(20_000, 2.0), 5.0, -30.0);
    let (terrain, output) = (&stand.terrain, &stand.output);
    let camera = &output.views[0].camera;
    let screen = Screen::new(camera);
    let mut mesh = MeshThen::new(stand.scene.body);
    mesh.take(terrain, output.time_ms);
    let vertices = in_picture((terrain, output), &mesh.drawn, &screen);
    assert!(vertices.len() > 50, "{}", vertices.len());
    let pipeline = Pipeline::new(&stand.scene, camera, output.time_ms);
    for drawn in vertices.iter().step_by(10) {
        let sound = tremble(drawn, &|eye| pipeline.moved(eye), &screen);
        assert!(sound.rms_px <= 1e-4 && sound.step_px <= 5e-4, "{sound:?}");
    }
    let nearest = vertices.iter().min_by(|a, b| {
        let depth_m = |drawn: &overfly_replay::measure::pipeline::Drawn| screen.view(drawn.exact).z;
        depth_m(a).total_cmp(&depth_m(b))
    });
    let coarse = tremble(nearest.unwrap(), &|eye| pipeline.moved(eye).coarse(), &screen);
    assert!(coarse.rms_px > 1e-4 && coarse.step_px > 5e-4, "{coarse:?}");

    let mut uploaded = cracks::uploaded(terrain, output);
    assert_eq!(cracks::points_apart(&mut uploaded.clone()), 0);
    let twice = uploaded[0];
    uploaded.push((twice.0, [twice.1[0] ^ 1, twice.1[1], twice.1[2]]));
    assert_eq!(cracks::points_apart(&mut uploaded), 1);
}

#[test]
fn a_page_whose_samples_are_off_by_one_answers_wrongly() {
    let scene = scene(3000, 2.0);
    let generator = Generator::new(&scene);
    let (mut worst_m, mut caught) = (0.0_f64, 0);
    for i in 0..40 {
        let at = Geodetic::from_degrees(-80.0 + 4.1 * f64::from(i), 9.3 * f64::from(i), 0.0);
        let normal = at.normal();
        let level = 20 + u8::try_from(i % 13).unwrap();
        let truth = generator.page(Place::of(normal).triangle(level).0.page());
        let body = (&scene.body, scene.sea);
        let error_m = answer_error_m(body, [&truth, &truth], normal, level).unwrap();
        worst_m = worst_m.max(error_m);
        let mut shifted = Page::clone(&truth);
        shifted.heights_m.rotate_left(1);
        let error_m = answer_error_m(body, [&Arc::new(shifted), &truth], normal, level).unwrap();
        let land = truth.heights_m.iter().all(|&height_m| height_m > 0.0);
        assert!(!land || error_m > 1e-8, "{at:?} at level {level}: {error_m}");
        caught += u32::from(error_m > 1e-8);
    }
    assert!(worst_m <= 1e-8, "{worst_m}");
    assert!(caught >= 8, "{caught}");
}

#[test]
fn one_range_of_24_bits_cannot_order_what_one_of_floats_can() {
    let ranges = vec![[0.1, 1e8]];
    let fixed = Buffer { format: DepthFormat::D24, order: DepthOrder::Forward, ranges };
    let ranges = vec![[0.1, f64::INFINITY]];
    let float = Buffer { format: DepthFormat::D32F, order: DepthOrder::Reversed, ranges };
    for depth_m in [1e3_f32, 1e4, 1e5, 1e6] {
        let farther_m = depth_m * 1.000_001;
        assert!(float.tells_apart(depth_m, farther_m), "{depth_m}");
        assert!(!fixed.tells_apart(depth_m, farther_m), "{depth_m}");
    }
}

#[test]
fn a_mesh_refined_to_the_tolerance_carries_the_gear_within_a_centimetre() {
    // Straight down from 3 m: half a pixel, of 165 a radian, is 9 mm there.
    let stand = stand(scene(60_000, 0.5), 3.0, -90.0);
    let errors = stand.errors(|_, _| {});
    assert!(errors.value("h2_gear_max_m") <= 0.01, "{:?}", errors.value("h2_gear_max_m"));
    assert_eq!(fired(&errors), [""; 0]);

    // Without a patch there is nothing to be seen below but the inside of the planet.
    let missing = stand.errors(|mesh, measure| remove(mesh, seen_leaf(measure)));
    assert_eq!(fired(&missing), ["c1_edges", "c4_rays", "lost_rays"]);
}

/// Removes a leaf.
fn remove(mesh: &mut MeshThen, leaf: usize) {
    let n = mesh.drawn.vertices_per_patch();
    mesh.drawn.leaves.remove(leaf);
    mesh.drawn.places.drain(leaf * n..(leaf + 1) * n);
    mesh.normals.drain(leaf * n..(leaf + 1) * n);
    mesh.note_levels();
}

/// Cuts a leaf in two as a split does, its neighbours aside, on the surface that is there.
fn cut(mesh: &mut MeshThen, leaf: usize) {
    let whole = mesh.clone();
    let old = mesh.drawn.leaves[leaf];
    remove(mesh, leaf);
    let [apex, start, end] = old.corners;
    let centre = middle(start, end);
    for corners in [[centre, apex, start], [centre, end, apex]] {
        // They are in no arena.
        let kid = DrawnLeaf { corners, level: old.level + 1, slot: u32::MAX, ..old };
        insert(mesh, &whole, kid);
    }
    mesh.note_levels();
}

fn insert(mesh: &mut MeshThen, surface: &MeshThen, leaf: DrawnLeaf) {
    let n = mesh.drawn.vertices_per_patch();
    let leaf = DrawnLeaf { key: triangle_id(leaf.corners), ..leaf };
    let at = mesh.drawn.leaves.partition_point(|other| other.key < leaf.key);
    let body = Ellipsoid { a_m: RADIUS_M, f: 0.0 };
    let points = lattice_points(leaf.corners, mesh.drawn.patch_depth);
    let inside = leaf.corners.iter().map(|&corner| normal_of(corner)).sum::<DVec3>() / 3.0;
    let (mut places, mut normals) = (Vec::new(), Vec::new());
    for point in points {
        let normal = normal_of(point);
        let foothold = surface.find(normal, leaf.level).unwrap();
        places.push(body.surface_from_normal(normal) + normal * foothold.height_m);
        // Beyond the border a neighbour may be shaded otherwise.
        let within = surface.find(normal.lerp(inside, 1e-9), leaf.level).unwrap();
        normals.push(surface.shading(&within));
    }
    mesh.drawn.leaves.insert(at, leaf);
    mesh.drawn.places.splice(at * n..at * n, places);
    mesh.normals.splice(at * n..at * n, normals);
}

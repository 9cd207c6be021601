//! Digests of the bundled flights over the bundled scenes.
//!
//! In:    flights and presets; pages arrive in the frame after they were wanted.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: the same through the façade, by workers and recordings (`tests/contracts`).
//!
//! The same in debug and release, on every machine: a change of these is a change of behaviour.
//! This package needs few others, so that its release build is soon made.

use overfly_core::datasource::generate::Generator;
use overfly_core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use overfly_core::settings::SceneSettings;
use overfly_jobs::{Graph, Workers};
use overfly_replay::{RunDigest, flight, view_of};

/// The digest of some frames of a flight over a scene.
fn digest_of(name: &str, scene: &SceneSettings, frames: impl Iterator<Item = usize>) -> u64 {
    let generator = Generator::new(scene);
    let planet = generator.planet().expect("presets are procedural");
    let height_m = |at: overfly_core::geodesy::Geodetic| planet.sample(at.normal()).height_m;
    let flight = flight(name, &scene.body, &height_m).expect("bundled");
    let terrain = Terrain::new(scene, &generator);
    let mut graph = Graph::new();
    add_stages(&mut graph, |terrain: &Terrain| terrain);
    let workers = Workers::new(1).unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    let mut run = RunDigest::default();
    for index in frames {
        let pose = &flight.poses[index];
        input.time_s = pose.time_s;
        input.views.clear();
        let lenses = scene.views.iter();
        input.views.extend(lenses.map(|lens| view_of(pose, lens, [640, 360], &scene.body)));
        input.arrived.extend(output.wanted.iter().map(|&key| generator.page(key)));
        terrain.begin(&mut input).unwrap();
        graph.run(&terrain, &workers).unwrap();
        terrain.finish(&mut output);
        run.add(&output.digest);
    }
    run.value()
}

fn holds(flight: &str, scene: &str, golden: u64) {
    let mut scene = overfly_config::load(scene).unwrap();
    scene.lod.morph_s = 0.0;
    let found = digest_of(flight, &scene, (0..10_000).step_by(50));
    assert_eq!(found, golden, "{found:#x}");
}

#[test]
fn the_golden_digest_of_rainier_over_the_earth_holds() {
    holds("rainier", "earth", 0xf30f_8b26_d676_7993);
}

#[test]
fn the_golden_digest_of_descent_over_the_moon_holds() {
    holds("descent", "moon", 0xfea2_6549_6357_01e5);
}

#[test]
fn the_golden_digest_of_poles_over_a_small_planet_holds() {
    holds("poles", "small", 0xb51f_0d5c_a0c4_a87b);
}

/// As above, with vertices on their way from the surface that they refine.
#[test]
fn the_golden_digest_of_morphing_vertices_holds() {
    let scene = overfly_config::load("small").unwrap();
    let found = digest_of("descent", &scene, 2400..2600);
    assert_eq!(found, 0x2fae_84b0_da11_0598, "{found:#x}");
}

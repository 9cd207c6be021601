//! The bundled flights over the bundled scenes: closed, the same on every machine, still when still.
//!
//! In:    flights and presets.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: golden digests (`replay/tests/goldens.rs`), the command line (`recordings`).

use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::loader::Loader;
use overfly::replay::{Flight, view_of};
use overfly::{Overfly, config};

/// A flight in the making: pages arrive in the frame after they were wanted.
pub struct Tour {
    pub overfly: Overfly,
    pub scene: SceneSettings,
    pub flight: Flight,
    pub input: FrameInput,
    pub output: FrameOutput,
    pub loader: Loader,
}

impl Tour {
    pub fn new(flight: &str, scene: &str, workers: usize) -> Self {
        let scene = config::load(scene).unwrap();
        let overfly = Overfly::new(&scene, workers).unwrap();
        Self::over(overfly, scene, flight)
    }

    /// As [`Self::new`], over a scene whose vertices are where they belong at once.
    pub fn without_morphs(flight: &str, scene: &str, workers: usize) -> Self {
        let mut scene = config::load(scene).unwrap();
        scene.lod.morph_s = 0.0;
        let overfly = Overfly::new(&scene, workers).unwrap();
        Self::over(overfly, scene, flight)
    }

    pub fn over(overfly: Overfly, scene: SceneSettings, flight: &str) -> Self {
        Self {
            flight: overfly.flight(flight).unwrap(),
            loader: overfly.loader(2).unwrap(),
            input: FrameInput::default(),
            output: FrameOutput::default(),
            overfly,
            scene,
        }
    }

    /// Frame `index`, drawn or not, with the pages that the last frame wanted.
    pub fn frame(&mut self, index: usize, drawn: bool) {
        self.loader.fetch(&self.output.wanted, &mut self.input.arrived);
        self.fly(index, drawn);
    }

    /// Frame `index` with the pages that are there.
    fn fly(&mut self, index: usize, drawn: bool) {
        self.input.views.clear();
        let pose = &self.flight.poses[index];
        self.input.time_s = pose.time_s;
        for lens in &self.scene.views {
            self.input.views.push(view_of(pose, lens, [640, 360], &self.scene.body));
        }
        if drawn {
            self.overfly.frame_drawn(&mut self.input, &mut self.output, 0).unwrap();
        } else {
            self.overfly.frame(&mut self.input, &mut self.output).unwrap();
        }
    }

    /// Repeats frame `index` until nothing changes.
    pub fn settle(&mut self, index: usize) {
        for _ in 0..2000 {
            self.frame(index, false);
            let counts = &self.output.counts;
            if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0 {
                return;
            }
        }
        panic!("no fixed point: {:?}", self.output.counts);
    }
}

/// Flies all of a flight and audits every two hundredth frame.
fn closed_all_the_way(flight: &str) {
    let mut tour = Tour::new(flight, "earth", 0);
    let (mut audited, mut most) = (0, 0);
    for index in 0..tour.flight.poses.len() {
        tour.frame(index, false);
        most = most.max(tour.output.counts.triangles);
        if index % 200 == 0 {
            tour.overfly.terrain().audit().unwrap_or_else(|what| panic!("frame {index}: {what}"));
            audited += 1;
        }
    }
    assert!(audited > 50);
    assert!(most > 50_000, "{most}");
}

#[test]
fn the_surface_is_closed_all_along_rainier() {
    closed_all_the_way("rainier");
}

#[test]
fn the_surface_is_closed_all_along_descent() {
    closed_all_the_way("descent");
}

#[test]
fn the_surface_is_closed_all_along_poles() {
    closed_all_the_way("poles");
}

/// Flies every fiftieth frame with 0, 1, 2 and 4 workers side by side: what the first wants is
/// made once and given to all.
fn same_for_any_workers(flight: &str, scene: &str) {
    let mut alone = Tour::new(flight, scene, 0);
    let mut others = [1, 2, 4].map(|workers| Tour::new(flight, scene, workers));
    for index in (0..6000).step_by(50) {
        alone.loader.fetch(&alone.output.wanted, &mut alone.input.arrived);
        for tour in &mut others {
            tour.input.arrived.clone_from(&alone.input.arrived);
            tour.fly(index, false);
        }
        alone.fly(index, false);
        for tour in &others {
            assert_eq!(tour.output.digest, alone.output.digest, "frame {index} of {flight}");
            assert_eq!(tour.output.wanted, alone.output.wanted, "frame {index} of {flight}");
        }
    }
    assert!(alone.output.counts.triangles > 10_000);
}

#[test]
fn worker_counts_do_not_change_a_bit_of_rainier_over_the_earth() {
    same_for_any_workers("rainier", "earth");
}

#[test]
fn worker_counts_do_not_change_a_bit_of_descent_over_the_moon() {
    same_for_any_workers("descent", "moon");
}

#[test]
fn worker_counts_do_not_change_a_bit_of_poles_over_a_small_planet() {
    same_for_any_workers("poles", "small");
}

#[test]
fn a_still_camera_rests_on_the_mesh_of_a_cold_start() {
    let mut settled = Tour::without_morphs("descent", "small", 0);
    (0..3000).step_by(40).for_each(|index| settled.frame(index, false));
    settled.settle(2900);
    let digest = settled.output.digest;
    settled.frame(2900, false);
    let counts = settled.output.counts;
    assert_eq!((counts.splits, counts.merges, counts.built, counts.wanted), (0, 0, 0, 0));
    assert_eq!(settled.output.digest, digest);
    let mut cold = Tour::without_morphs("descent", "small", 0);
    cold.settle(2900);
    assert_eq!(cold.output.digest.mesh, digest.mesh);
    assert_eq!(cold.output.digest.vertices, digest.vertices);
}

//! Cases 10, 11, 12 and 40: 100 km a frame, teleports, spins, a day of circles.
//!
//! In:    flights faster than any aircraft, over ground with all its pages at hand.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: time that leaps (`numbers`).

use crate::rig::{scene, view};
use crate::synthetic::Relief;
use crate::world::{EARTH, World, bare, sphere, unit};
use overfly_core::camera::View;
use overfly_core::frame::FrameCounts;
use overfly_core::geodesy::Geodetic;
use std::collections::BTreeSet;

/// Nobody did more in a frame than the counts allow.
fn keeps_to_its_counts(world: &World) {
    let (counts, lod) = (world.output.counts, world.terrain.settings().lod);
    let FrameCounts { splits, merges, wanted, triangles, .. } = counts;
    assert!(splits <= lod.splits_max && merges <= lod.merges_max, "{counts:?}");
    assert!(wanted <= lod.wanted_max && triangles <= lod.triangles_max, "{counts:?}");
    assert!(counts.pages <= world.terrain.limits().pages, "{counts:?}");
    assert!(counts.diamonds <= world.terrain.limits().diamonds, "{counts:?}");
}

#[test]
fn case_10_a_hundred_km_a_frame_to_the_antipode_and_back_leaves_the_mesh_of_a_cold_start() {
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 12.0;
    (settings.lod.splits_max, settings.lod.merges_max) = (150, 150);
    let looking = |lon: f64| view(&EARTH, Geodetic::from_degrees(10.0, lon, 8e3), 80.0, -15.0);
    let home = [looking(30.0)];
    let mut cold = World::procedural(&settings);
    let cold_frames = cold.settle(&home);
    let mut world = World::procedural(&settings);
    let step_deg = 1e5 / EARTH.a_m * 180.0 / core::f64::consts::PI;
    let steps = 200;
    for step in 0..2 * steps {
        let along = f64::from(if step < steps { step } else { 2 * steps - step });
        world.frame(&[looking(30.0 + along * step_deg)]);
        keeps_to_its_counts(&world);
    }
    let frames = world.settle(&home);
    println!("{frames} frames after the flight, {cold_frames} from nothing");
    assert!(frames <= cold_frames + 60, "{frames} against {cold_frames}");
    world.check();
    let (warm, cold) = (world.output.digest, cold.output.digest);
    assert_eq!((warm.mesh, warm.vertices), (cold.mesh, cold.vertices));
}

#[test]
fn case_11_a_thousand_teleports_fill_no_queue_beyond_its_end() {
    let body = sphere(6.4e6);
    let mut settings = bare(body, 2, 8_000);
    settings.lod.tolerance.0 = 2.0;
    (settings.lod.splits_max, settings.lod.merges_max, settings.lod.wanted_max) = (60, 60, 4);
    settings.memory.pages_bytes = 60 * size_of::<overfly_core::datasource::Page>() as u64;
    let mut world = World::synthetic(&settings, Relief::Noise { most_m: 300.0 });
    for frame in 0..1000_u64 {
        let place = |salt: u64| unit(frame << 8 | salt) * 180.0 - 90.0;
        let at = Geodetic::from_degrees(place(1), 2.0 * place(2), 1e3 + 1e5 * unit(frame));
        world.frame(&[view(&body, at, 4.0 * place(3), place(4))]);
        keeps_to_its_counts(&world);
        assert!(world.input.arrived.is_empty(), "all that arrived was taken or handed back");
        if frame % 250 == 249 {
            world.check();
        }
    }
    // Nothing is left behind: home again it is as in a world that never left.
    let home = [view(&body, Geodetic::from_degrees(20.0, 30.0, 3e9), 0.0, -90.0)];
    let mut fresh = World::synthetic(&settings, Relief::Noise { most_m: 300.0 });
    let (back, cold) = (world.settled(&home), fresh.settled(&home));
    assert!(
        world.output.counts.error_px_bound == settings.lod.tolerance.0,
        "{:?}",
        world.output.counts
    );
    assert_eq!((back.mesh, back.vertices), (cold.mesh, cold.vertices));
}

/// Centres of the split diamonds: what the mesh is.
fn split(world: &World) -> BTreeSet<[i32; 3]> {
    let lod = world.terrain.lod();
    let diamonds = &lod.mesh.diamonds;
    let split = diamonds.ids().filter(|&id| diamonds[id].is_split());
    split.map(|id| diamonds[id].centre().to_array()).collect()
}

#[test]
fn case_12_a_spin_of_half_a_turn_a_frame_splits_and_merges_no_diamond_twice() {
    let body = sphere(6.4e6);
    let mut settings = bare(body, 4, 30_000);
    (settings.lod.splits_max, settings.lod.merges_max) = (40, 40);
    let mut world = World::synthetic(&settings, Relief::Noise { most_m: 300.0 });
    let mut before = split(&world);
    let mut operations = 0;
    for frame in 0..240 {
        let heading_deg = 30.0 + 180.0 * f64::from(frame % 2);
        let at = Geodetic::from_degrees(20.0, 30.0, 3e3);
        world.frame(&[view(&body, at, heading_deg, -10.0)]);
        keeps_to_its_counts(&world);
        let now = split(&world);
        let (made, gone) = (now.difference(&before).count(), before.difference(&now).count());
        let FrameCounts { splits, merges, .. } = world.output.counts;
        // A diamond that did both in one frame would count in the operations, not in the sets.
        assert_eq!((made, gone), (splits as usize, merges as usize), "frame {frame}");
        operations += splits + merges;
        before = now;
    }
    world.check();
    assert!(operations > 3_000, "it is kept busy: {operations}");
}

/// A day at 60 Hz is 5.2 million frames: `OVERFLY_CIRCLES` asks for as many circles of 90 frames as
/// one likes, 57 600 for the day; a minute is enough for some hundred. Each circle must pass through the very states of the one before.
#[test]
fn case_40_circling_all_day_comes_back_to_the_same_state_at_the_same_pose() {
    let asked = std::env::var("OVERFLY_CIRCLES").ok().and_then(|circles| circles.parse().ok());
    let circles: u32 = asked.unwrap_or(6);
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 16.0;
    (settings.lod.splits_max, settings.lod.merges_max, settings.lod.wanted_max) =
        (u32::MAX, u32::MAX, 4096);
    let mut world = World::procedural(&settings);
    let turn = |frame: u32| -> View {
        let heading_deg = 4.0 * f64::from(frame);
        let around = Geodetic::from_degrees(0.0, heading_deg, 0.0).normal() * 0.3;
        let at = Geodetic::from_degrees(20.0 + around.y, 30.0 - around.x, 6e3);
        view(&EARTH, at, -heading_deg, -15.0)
    };
    let mut states = Vec::new();
    let mut most = [0; 3];
    for circle in 0..circles {
        for frame in 0..90 {
            // Until nothing is under way, so that a pose has one state.
            world.input.time_s += 1.0 / 60.0;
            world.settle(&[turn(frame)]);
            let digest = world.output.digest;
            let state = (digest.mesh, digest.vertices, digest.draws);
            let counts = world.output.counts;
            let sizes = [counts.pages, counts.diamonds, counts.leaves];
            match circle {
                0 => states.push((digest.mesh, digest.vertices)),
                _ => assert_eq!((state.0, state.1), states[frame as usize], "{circle} {frame}"),
            }
            if circle < 2 {
                most = [0, 1, 2].map(|i| most[i].max(sizes[i]));
            }
            assert!((0..3).all(|i| sizes[i] <= most[i]), "memory is flat: {sizes:?} {most:?}");
        }
    }
    world.check();
    let unlike: BTreeSet<_> = states.iter().collect();
    assert!(unlike.len() > 45, "the poses are different: {}", unlike.len());
}

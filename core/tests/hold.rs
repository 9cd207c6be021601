//! A held mesh stays as it is while the views move on, and afterwards goes on as if nothing were.
//!
//! In:    flights in which some frames are held.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: which key holds it (the window).

mod rig;

use overfly_core::camera::View;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use rig::{Rig, scene, view};

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn along(frame: u32) -> View {
    let at = f64::from(frame);
    let here = Geodetic::from_degrees(46.8, -121.8 + 2e-3 * at, 3_000.0 + 20.0 * at);
    view(&EARTH, here, 80.0 + 1.5 * at, -15.0)
}

fn fly(rig: &mut Rig, frame: u32, holds: bool) {
    rig.input.hold_lod = holds;
    rig.input.time_s = f64::from(frame) / 60.0;
    rig.frame(&[along(frame)], |_| true);
}

#[test]
fn a_held_mesh_stays_and_only_the_draws_follow() {
    let mut settings = scene(4, 60_000);
    settings.lod.morph_s = 0.5;
    let mut rig = Rig::new(&settings, 0);
    // Held in the middle of its growth, when pages are on their way.
    let mut start = 0;
    while rig.output.wanted.is_empty() || rig.output.counts.leaves < 500 {
        fly(&mut rig, start, false);
        start += 1;
        assert!(start < 200, "{:?}", rig.output.counts);
    }
    let (given, digest, before) = (rig.output.wanted.len(), rig.output.digest, rig.output.counts);
    let mut draws = vec![digest.draws];
    for frame in start..start + 40 {
        fly(&mut rig, frame, true);
        let (now, counts) = (rig.output.digest, rig.output.counts);
        let kept = [now.pages, now.mesh, now.vertices];
        assert_eq!(kept, [digest.pages, digest.mesh, digest.vertices], "frame {frame}");
        let sizes =
            |c: overfly_core::frame::FrameCounts| (c.leaves, c.triangles, c.diamonds, c.pages);
        assert_eq!(sizes(counts), sizes(before));
        let work = [counts.splits, counts.merges, counts.evaluations, counts.blocked, counts.built];
        assert_eq!((work, counts.admitted, counts.evicted), ([0; 5], 0, 0));
        let given = if frame == start { given } else { 0 };
        assert_eq!((counts.refused as usize, rig.output.evicted.len()), (given, given));
        assert!(rig.output.wanted.is_empty() && rig.output.built.is_empty());
        assert!(counts.drawn > 0);
        draws.push(now.draws);
    }
    draws.sort_unstable();
    draws.dedup();
    assert_eq!(draws.len(), 41, "each view has its own draws");
    rig.audit();
    fly(&mut rig, start + 40, false);
    assert!(rig.output.counts.splits > 0 && rig.output.counts.evaluations > 0);
    assert_ne!(rig.output.digest.mesh, digest.mesh);
    rig.audit();
}

#[test]
fn after_a_hold_judging_what_is_due_is_judging_everything() {
    for (patch_depth, budget, tolerance_px) in
        [(0, 12_000, 2.0), (4, 60_000, 2.0), (4, 60_000, 80.0)]
    {
        let mut settings = scene(patch_depth, budget);
        settings.lod.tolerance.0 = tolerance_px;
        (settings.lod.splits_max, settings.lod.merges_max) = (60, 60);
        let mut lazy = Rig::new(&settings, 0);
        let mut all = Rig::new(&settings, 0);
        all.terrain.judge_all(true);
        let mut judged = [0; 2];
        for frame in 0..200 {
            // Long holds, short ones, and one across which several splits wait for pages.
            let holds = matches!(frame % 100, 20..45 | 50 | 52..54 | 90..99);
            fly(&mut lazy, frame, holds);
            fly(&mut all, frame, holds);
            assert_eq!(lazy.output.digest, all.output.digest, "frame {frame}");
            assert_eq!(lazy.output.wanted, all.output.wanted, "frame {frame}");
            judged[0] += u64::from(lazy.output.counts.evaluations);
            judged[1] += u64::from(all.output.counts.evaluations);
            if frame % 50 == 46 {
                lazy.audit();
            }
        }
        assert!(judged[0] < judged[1], "{judged:?}");
    }
}

#[test]
fn a_mesh_that_was_held_settles_where_it_would_have() {
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 100.0;
    let mut held = Rig::new(&settings, 0);
    let mut free = Rig::new(&settings, 0);
    for frame in 0..80 {
        fly(&mut held, frame, frame >= 20);
        fly(&mut free, frame, false);
    }
    assert_ne!(held.output.digest.mesh, free.output.digest.mesh);
    // Inputs change places with those of the frame before, and each keeps its flag.
    (80..82).for_each(|frame| fly(&mut held, frame, false));
    held.settle(&[along(80)]);
    free.settle(&[along(80)]);
    assert_eq!(held.output.counts.error_px_bound, 100.0, "{:?}", held.output.counts);
    assert_eq!(held.output.digest.mesh, free.output.digest.mesh);
    assert_eq!(held.output.digest.vertices, free.output.digest.vertices);
}

#[test]
fn a_hold_from_the_start_shows_nothing_and_asks_for_nothing() {
    let mut rig = Rig::new(&scene(4, 20_000), 0);
    (0..3).for_each(|frame| fly(&mut rig, frame, true));
    let counts = rig.output.counts;
    assert_eq!((counts.leaves, counts.wanted, counts.drawn), (0, 0, 0));
    (3..10).for_each(|frame| fly(&mut rig, frame, false));
    assert!(rig.output.counts.leaves >= 8);
}

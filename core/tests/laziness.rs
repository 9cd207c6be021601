//! Judging only what is due gives the mesh of judging everything: every frame, whatever happens.
//!
//! In:    flights: straight, turning, jumping, zooming, with pages late; budgets and tolerances.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: the surface's own rules (`surface`), times (`benches`).

mod rig;

use overfly_core::camera::View;
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::SceneSettings;
use overfly_core::units::Radians;
use proptest::prelude::*;
use rig::{Rig, scene, view};

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn at(lat_deg: f64, lon_deg: f64, height_m: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, height_m)
}

/// Flies both ways side by side and compares every frame. Returns the diamonds judged by each.
fn side_by_side(
    settings: &SceneSettings,
    frames: u32,
    mut views_of: impl FnMut(u32) -> Vec<View>,
    mut lets: impl FnMut(u32, usize) -> bool,
) -> [u64; 2] {
    let mut lazy = Rig::new(settings, 0);
    let mut all = Rig::new(settings, 0);
    all.terrain.judge_all(true);
    let mut judged = [0, 0];
    for frame in 0..frames {
        let views = views_of(frame);
        lazy.frame(&views, |page| lets(frame, page));
        all.frame(&views, |page| lets(frame, page));
        let (a, b) = (&lazy.output, &all.output);
        judged[0] += u64::from(a.counts.evaluations);
        judged[1] += u64::from(b.counts.evaluations);
        assert_eq!(a.digest, b.digest, "frame {frame}: {:?}\n{:?}", a.counts, b.counts);
        assert_eq!(a.wanted, b.wanted, "frame {frame}");
        let work = |rig: &Rig| {
            let counts = &rig.output.counts;
            (counts.splits, counts.merges, counts.blocked, counts.leaves)
        };
        assert_eq!(work(&lazy), work(&all), "frame {frame}");
        if frame % 64 == 63 {
            lazy.audit();
        }
    }
    judged
}

#[test]
fn a_straight_flight_in_the_budget() {
    for (patch_depth, budget) in [(0, 20_000), (4, 60_000)] {
        let settings = scene(patch_depth, budget);
        let views = |frame: u32| {
            let lon = -121.8 + 2e-4 * f64::from(frame);
            vec![view(&EARTH, at(46.8, lon, 3_000.0), 80.0, -8.0)]
        };
        let [lazy, all] = side_by_side(&settings, 300, views, |_, _| true);
        println!("k = {patch_depth}: {lazy} judged instead of {all}");
        assert!(lazy * 4 < all, "{lazy} of {all}");
    }
}

#[test]
fn a_descent_to_the_tolerance_and_a_climb_back() {
    let mut settings = scene(4, 400_000);
    settings.lod.tolerance.0 = 60.0;
    let views = |frame: u32| {
        let part = (f64::from(frame) / 200.0 - 1.0).abs();
        let height_m = 2_000.0 + 60_000.0 * part * part;
        vec![view(&EARTH, at(46.8, -121.8 + 1e-4 * f64::from(frame), height_m), 60.0, -20.0)]
    };
    let [lazy, all] = side_by_side(&settings, 400, views, |_, _| true);
    println!("{lazy} judged instead of {all}");
    assert!(lazy * 3 < all, "{lazy} of {all}");
}

#[test]
fn turns_rolls_jumps_and_zooms_with_late_pages() {
    for (patch_depth, budget, tolerance_px) in
        [(0, 12_000, 2.0), (4, 50_000, 2.0), (4, 50_000, 80.0)]
    {
        let mut settings = scene(patch_depth, budget);
        settings.lod.tolerance.0 = tolerance_px;
        (settings.lod.splits_max, settings.lod.merges_max) = (60, 60);
        settings.memory.pages_bytes = 4 << 20;
        let views = |frame: u32| {
            let (turn, leg) = (f64::from(frame), frame / 90);
            let jump = [0.0, 3.0, -20.0, 0.4][leg as usize % 4];
            let here = at(46.8 + jump, -121.8 + jump + 1e-4 * turn, 2_500.0 + 40.0 * turn);
            let mut one = view(&EARTH, here, 2.5 * turn, -10.0 - 0.1 * turn);
            one.field_of_view = Radians::from_degrees(if leg % 2 == 0 {
                60.0
            } else {
                60.0 - 0.4 * f64::from(frame % 90)
            });
            vec![one]
        };
        let lets = |frame: u32, page: usize| mix(u64::from(frame) * 64 + page as u64) & 3 == 0;
        side_by_side(&settings, 360, views, lets);
    }
}

#[test]
fn several_views_that_come_and_go() {
    let settings = scene(4, 60_000);
    let views = |frame: u32| {
        let here = at(20.0 + 1e-4 * f64::from(frame), 30.0, 9_000.0);
        let count = [1, 2, 3, 2][frame as usize / 40 % 4];
        let one = |i: u32| {
            let mut one = view(&EARTH, here, 120.0 * f64::from(i) + 0.2 * f64::from(frame), -15.0);
            one.near_m = if frame < 100 { 0.1 } else { 500.0 };
            one
        };
        (0..count).map(one).collect()
    };
    side_by_side(&settings, 200, views, |_, _| true);
}

#[test]
fn below_the_ground_and_far_out_in_space() {
    let settings = scene(4, 30_000);
    let heights_m = [5_000.0, -11_100.0, -200_000.0, -6_300_000.0, 1e7, 1e12, 1e18, -40.0, 3.0];
    let views = |frame: u32| {
        let height_m = heights_m[frame as usize / 25 % heights_m.len()];
        let here =
            at(12.0, 1e-5 * f64::from(frame), height_m * (1.0 + 1e-4 * f64::from(frame % 25)));
        vec![view(&EARTH, here, 10.0, -30.0)]
    };
    side_by_side(&settings, 225, views, |_, _| true);
}

#[test]
fn a_slow_flight_after_a_way_between_the_stars() {
    let mut settings = scene(4, 40_000);
    settings.lod.tolerance.0 = 60.0;
    let views = |frame: u32| {
        let height_m = if (2..4).contains(&frame) { 1e16 } else { 3_000.0 };
        vec![view(&EARTH, at(46.8, -121.8 + 1e-5 * f64::from(frame), height_m), 80.0, -8.0)]
    };
    side_by_side(&settings, 3_600, views, |_, _| true);
}

#[test]
fn the_narrowest_lens_and_the_nearest_ground() {
    let settings = scene(4, 30_000);
    let lenses_rad = [1.0, 1e-6, 1e-5, 0.5];
    let views = |frame: u32| {
        let mut one = view(&EARTH, at(46.8, -121.8 + 1e-5 * f64::from(frame), 3_000.0), 80.0, -8.0);
        one.near_m = if frame < 30 { 1e-6 } else { 0.1 };
        one.field_of_view = Radians(lenses_rad[frame as usize / 6 % lenses_rad.len()]);
        vec![one]
    };
    side_by_side(&settings, 60, views, |_, _| true);
}

#[test]
fn a_still_eye_is_judged_no_more() {
    let mut rig = Rig::new(&scene(4, 60_000), 0);
    let views = [view(&EARTH, at(46.8, -121.8, 3_000.0), 80.0, -8.0)];
    rig.settle(&views);
    for _ in 0..3 {
        rig.frame(&views, |_| true);
        assert_eq!(rig.output.counts.evaluations, 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_flight_gives_the_same_frames(
        patch_depth in prop::sample::select(vec![0_u8, 2, 4]),
        budget in 2_000_u32..30_000,
        tolerance_px in 1.0..200.0_f64,
        speed in -7.0..-1.0_f64,
        legs in prop::collection::vec((-80.0..80.0_f64, -180.0..180.0_f64, 0.5..6.0_f64, -3.0..3.0_f64, 0_u64..u64::MAX), 2..4),
    ) {
        let mut settings = scene(patch_depth, budget.max(16 << patch_depth));
        settings.lod.tolerance.0 = tolerance_px;
        let step_deg = libm::exp10(speed);
        let views = |frame: u32| {
            let (lat, lon, log_height, turn, _) = legs[frame as usize / 40 % legs.len()];
            let along = f64::from(frame % 40);
            let here = at(lat, lon + step_deg * along, libm::exp10(log_height) * (1.0 + 0.002 * along));
            vec![view(&EARTH, here, lon + turn * along, -25.0)]
        };
        let lets = |frame: u32, page: usize| {
            let mask = legs[frame as usize / 40 % legs.len()].4;
            mask >> ((page as u64 * 7 + u64::from(frame)) % 64) & 1 == 1
        };
        side_by_side(&settings, 40 * u32::try_from(legs.len()).unwrap(), views, lets);
    }
}

//! The surface as a whole: closed, consistent, converging, the same whatever the history.
//!
//! In:    poses, random flights with pages withheld.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: the bundled flights (the root package's contracts).

mod rig;

use overfly_core::geodesy::trig::exp;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::lattice::{fold, key_of};
use proptest::prelude::*;
use rig::{Rig, scene, view};

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn at(lat_deg: f64, lon_deg: f64, height_m: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, height_m)
}

#[test]
fn a_still_camera_reaches_a_fixed_point_and_then_nothing_happens() {
    for (patch_depth, height_m) in [(0, 9_000.0), (4, 2.0e6), (4, 9_000.0), (8, 12_000.0)] {
        let mut rig = Rig::new(&scene(patch_depth, 100_000), 0);
        let views = [view(&EARTH, at(20.0, 30.0, height_m), 40.0, -20.0)];
        let frames = rig.settle(&views);
        println!("k={patch_depth} {height_m} m: {frames} frames, {:?}", rig.output.counts);
        rig.audit();
        let digest = rig.output.digest;
        for _ in 0..3 {
            rig.frame(&views, |_| true);
            let counts = rig.output.counts;
            assert_eq!((counts.splits, counts.merges, counts.built), (0, 0, 0));
            assert_eq!(rig.output.digest, digest);
        }
    }
}

#[test]
fn where_the_tolerance_decides_the_mesh_does_not_depend_on_history() {
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 8.0;
    let goal = [view(&EARTH, at(20.0, 30.0, 9_000.0), 40.0, -20.0)];
    let mut cold = Rig::new(&settings, 0);
    cold.settle(&goal);
    assert!(cold.output.counts.error_px_bound <= 8.0, "{:?}", cold.output.counts);
    let mut warm = Rig::new(&settings, 0);
    for (lat, heading) in [(21.0, 0.0), (20.5, 180.0), (-60.0, 20.0), (20.1, 220.0)] {
        let views = [view(&EARTH, at(lat, 30.0, 20_000.0), heading, -5.0)];
        warm.settle(&views);
    }
    warm.settle(&goal);
    assert_eq!(warm.output.digest.mesh, cold.output.digest.mesh);
    assert_eq!(warm.output.digest.vertices, cold.output.digest.vertices);
}

#[test]
fn the_budget_is_never_exceeded_and_is_used() {
    let mut settings = scene(4, 20_000);
    settings.lod.tolerance.0 = 0.02;
    let mut rig = Rig::new(&settings, 0);
    for step in 0..120 {
        let position = at(-10.0 + 0.02 * f64::from(step), 12.0, 3_000.0);
        rig.frame(&[view(&EARTH, position, f64::from(step), -10.0)], |_| true);
        assert!(rig.output.counts.triangles <= 20_000);
    }
    rig.settle(&[view(&EARTH, at(-7.6, 12.0, 3_000.0), 10.0, -10.0)]);
    assert!(rig.output.counts.triangles > 19_000, "{:?}", rig.output.counts);
    rig.audit();
}

#[test]
fn no_frame_spends_more_operations_than_its_counts_allow() {
    let mut settings = scene(2, 50_000);
    (settings.lod.splits_max, settings.lod.merges_max) = (50, 30);
    let mut rig = Rig::new(&settings, 0);
    for step in 0..200 {
        let lon = if step / 50 % 2 == 0 { 10.0 } else { -170.0 };
        rig.frame(&[view(&EARTH, at(5.0, lon, 5_000.0), 0.0, -15.0)], |_| true);
        let counts = rig.output.counts;
        assert!(counts.splits <= 50 && counts.merges <= 30, "{counts:?}");
    }
}

#[test]
fn the_deepest_level_is_kept_and_its_error_is_told() {
    for level_max in [0, 1, 9, 20] {
        let mut settings = scene(2, 50_000);
        settings.lod.level_max = level_max;
        let mut rig = Rig::new(&settings, 0);
        rig.settle(&[view(&EARTH, at(46.8, -121.8, 3_000.0), 0.0, -30.0)]);
        rig.audit();
        let lod = rig.terrain.lod();
        let diamonds = &lod.mesh.diamonds;
        let leaves = diamonds.ids().filter(|&id| lod.cover.patches[id] != [None; 2]);
        let deepest = leaves.map(|id| diamonds[id].level());
        assert_eq!(deepest.max(), Some(level_max));
        assert!(rig.output.counts.error_px_bound > settings.lod.tolerance.0);
    }
}

#[test]
fn several_views_refine_for_each_of_them() {
    let mut settings = scene(4, 400_000);
    settings.lod.tolerance.0 = 10.0;
    let views = [
        view(&EARTH, at(20.0, 30.0, 9_000.0), 40.0, -20.0),
        view(&EARTH, at(20.0, 30.0, 9_000.0), 220.0, -20.0),
    ];
    let alone = views.map(|one| {
        let mut rig = Rig::new(&settings, 0);
        rig.settle(&[one]);
        rig.output.counts.leaves
    });
    let mut both = Rig::new(&settings, 0);
    both.settle(&views);
    let counts = both.output.counts;
    assert!(counts.leaves > alone[0].max(alone[1]), "{counts:?} alone {alone:?}");
    assert_eq!(both.output.views.len(), 2);
    both.audit();
}

#[test]
fn extreme_poses_are_no_event() {
    let mut rig = Rig::new(&scene(4, 30_000), 1);
    for (lat, lon, height_m) in [
        (90.0, 0.0, 1_000.0),
        (-90.0, 0.0, 10.0),
        (0.0, 0.0, 500.0),
        (0.0, 90.0, 500.0),
        (0.0, 180.0, 500.0),
        (45.0, 45.0, 1.0e9),
        (45.0, 45.0, 1.5e11),
        (45.0, 45.0, 1.0e18),
        (45.0, 45.0, -100_000.0),
        (12.0, 0.0, -6_300_000.0),
        (12.0, 0.0, -6_356_752.0),
    ] {
        rig.settle(&[view(&EARTH, at(lat, lon, height_m), 10.0, -30.0)]);
        rig.audit();
        assert!(rig.output.counts.error_px_bound.is_finite());
    }
    assert!(rig.output.counts.leaves >= 8);
}

#[test]
fn a_bad_view_is_refused_and_the_state_stays() {
    let mut rig = Rig::new(&scene(4, 30_000), 0);
    let good = view(&EARTH, at(1.0, 2.0, 3_000.0), 10.0, -30.0);
    rig.settle(&[good]);
    let digest = rig.output.digest;
    let mut bad = good;
    bad.eye.0.y = f64::NAN;
    rig.input.views = vec![bad];
    assert!(rig.terrain.begin(&mut rig.input).is_err());
    rig.frame(&[good], |_| true);
    assert_eq!(rig.output.digest, digest);
}

#[test]
fn workers_do_not_change_a_bit() {
    let digests = [0, 1, 3].map(|workers| {
        let mut rig = Rig::new(&scene(4, 60_000), workers);
        let mut sum = 0_u64;
        for step in 0..60 {
            let position = at(0.01 * f64::from(step), 77.0, 2_500.0);
            rig.frame(&[view(&EARTH, position, 3.0 * f64::from(step), -8.0)], |_| true);
            sum = overfly_core::digest::mix(sum ^ rig.output.digest.all());
        }
        sum
    });
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}

#[test]
fn page_borders_are_bit_equal_across_quadrants_and_depths() {
    use overfly_core::datasource::PageKey;
    let rig = Rig::new(&scene(4, 30_000), 0);
    let keys = [
        PageKey::root(0),
        PageKey::root(1),
        PageKey::root(3),
        PageKey::new(0, 1, 1, 0),
        PageKey::new(0, 1, 0, 0),
        PageKey::new(3, 1, 1, 0),
    ];
    let pages = keys.map(|key| rig.generator.page(key));
    let mut seen = std::collections::BTreeMap::new();
    let mut shared = 0;
    for page in &pages {
        for j in 0..65 {
            for i in 0..65 {
                let point = page.key.sample(i, j);
                let at = page.sample_index(point);
                let height = page.heights_m[at].to_bits();
                assert_eq!(*seen.entry(key_of(point)).or_insert(height), height, "{point}");
                let depth = page.key.depth();
                let key = (u64::from(depth) + 1) << 63 ^ key_of(point) ^ u64::from(depth) << 62;
                let normal = u32::from(page.normals[at][0].cast_unsigned()) << 16
                    | u32::from(page.normals[at][1].cast_unsigned());
                let kept = *seen.entry(!key).or_insert(normal);
                assert_eq!(kept, normal, "normal at {point}");
                shared += u32::from(kept == normal);
            }
        }
    }
    assert!(shared > 65 * 65);
    assert_eq!(pages[0].sample_index(fold(0, 0, 0)), 0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_flight_with_any_late_pages_keeps_the_surface_whole(
        patch_depth in prop::sample::select(vec![0_u8, 2, 4, 6]),
        budget in 2_000_u32..12_000,
        pages in 12_u64..200,
        steps in prop::collection::vec((-90.0..90.0_f64, -180.0..180.0_f64, 0.0..6.5_f64, 0_u64..u64::MAX), 3..8),
    ) {
        let mut settings = scene(patch_depth, budget.max(16 << patch_depth));
        settings.memory.pages_bytes = pages * size_of::<overfly_core::datasource::Page>() as u64;
        settings.lod.splits_max = 60;
        settings.lod.merges_max = 60;
        let mut rig = Rig::new(&settings, 0);
        for (lat, lon, log_height, mask) in steps {
            let looking = view(&EARTH, at(lat, lon, exp(log_height * core::f64::consts::LN_10)), lon, -25.0);
            for turn in 0..6_u64 {
                rig.frame(&[looking], |i| mask >> ((i as u64 * 7 + turn) % 64) & 1 == 1);
                prop_assert!(rig.output.counts.triangles <= settings.lod.triangles_max);
                prop_assert!(u64::from(rig.output.counts.pages) <= pages);
            }
            rig.audit();
        }
    }
}

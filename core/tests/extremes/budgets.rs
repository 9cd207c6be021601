//! Cases 32 to 36: budgets of 0 to u64::MAX, levels, tolerances.
//!
//! In:    settings at and beyond their ends.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: how scene files word this (`config/tests/extremes.rs`).

use crate::gauge::levels;
use crate::rig::{scene, view};
use crate::synthetic::Relief;
use crate::world::{World, bare, sphere};
use overfly_core::camera::View;
use overfly_core::datasource::generate::Generator;
use overfly_core::frame::Terrain;
use overfly_core::geodesy::Geodetic;
use overfly_core::limits::Limits;
use overfly_core::settings::SceneSettings;
use overfly_core::units::Pixels;

const NOISE: Relief = Relief::Noise { most_m: 100.0 };

fn settings(patch_depth: u8, triangles_max: u32) -> SceneSettings {
    bare(sphere(6.4e6), patch_depth, triangles_max)
}

fn looking(settings: &SceneSettings) -> View {
    view(&settings.body, Geodetic::from_degrees(20.0, 30.0, 2e3), 30.0, -30.0)
}

/// What settings are refused with, in words, before anything is allocated.
fn refused(settings: &SceneSettings) -> String {
    let generator = Generator::new(&scene(4, 30_000));
    let words = match Terrain::checked(settings, &generator) {
        Ok(_) => panic!("{settings:?} were taken"),
        Err(fault) => fault.to_string(),
    };
    assert_eq!(Limits::checked(settings).unwrap_err().to_string(), words);
    words
}

/// No budget is too small to say what it is: less than the root mesh is refused.
#[test]
fn case_32_a_budget_of_nothing_is_refused_and_a_count_of_nothing_does_nothing() {
    let words = refused(&settings(0, 0));
    assert_eq!(words, "lod.triangles_max is 0, allowed is 8 to 16000000");
    let mut none = settings(0, 30_000);
    (none.lod.splits_max, none.lod.merges_max) = (0, 0);
    none.memory.pages_bytes = 0;
    let mut world = World::synthetic(&none, NOISE);
    world.settled(&[looking(&none)]);
    assert_eq!((world.output.counts.leaves, world.output.counts.pages), (8, 4));
    assert!(world.output.counts.error_px_bound > none.lod.tolerance.0, "and it is told");
    none.lod.wanted_max = 0;
    let mut world = World::synthetic(&none, NOISE);
    for _ in 0..10 {
        world.frame(&[looking(&none)]);
    }
    assert_eq!(world.output.counts.leaves, 8, "roots come in any case");
    let mut sightless = World::synthetic(&settings(4, 30_000), NOISE);
    for _ in 0..10 {
        sightless.frame(&[]);
    }
    assert_eq!((sightless.output.counts.leaves, sightless.output.views.len()), (8, 0));
}

#[test]
fn case_33_a_budget_of_1_to_8_is_refused_or_the_root_mesh() {
    for patch_depth in [0, 2, 4, 6, 8] {
        let least = 8_u32 << patch_depth;
        for triangles_max in [1, 2, 4, 7, least - 1] {
            let words = refused(&settings(patch_depth, triangles_max));
            let range = format!("{least} to 16000000");
            assert_eq!(words, format!("lod.triangles_max is {triangles_max}, allowed is {range}"));
        }
        for more in [0, 1] {
            let settings = settings(patch_depth, least + more);
            let mut world = World::synthetic(&settings, NOISE);
            world.settled(&[looking(&settings)]);
            assert_eq!((world.output.counts.leaves, world.output.counts.triangles), (8, least));
            assert!(world.output.counts.error_px_bound > settings.lod.tolerance.0);
        }
    }
}

#[test]
fn case_34_budgets_beyond_all_are_refused_and_the_greatest_ends_at_the_last_level() {
    for triangles_max in [16_000_001, 1 << 31, u32::MAX] {
        let words = refused(&settings(8, triangles_max));
        let expected = format!("lod.triangles_max is {triangles_max}, allowed is 2048 to 16000000");
        assert_eq!(words, expected);
    }
    let mut most = settings(8, 16_000_000);
    (most.lod.splits_max, most.lod.merges_max, most.lod.wanted_max) = (u32::MAX, u32::MAX, 256);
    most.memory.pages_bytes = u64::MAX;
    most.lod.level_max = 14;
    let limits = Limits::of(&most);
    assert_eq!((limits.pages, limits.leaves, limits.built), (1 << 21, 62_500, 62_500));
    let mut world = World::synthetic(&most, NOISE);
    world.settled(&[looking(&most)]);
    let counts = world.output.counts;
    assert!(counts.triangles < 16_000_000 && counts.leaves > 300, "{counts:?}");
    assert_eq!(levels(&world)[1], 14, "the last level ended it");
    assert!(counts.error_px_bound > most.lod.tolerance.0, "and the bound says so: {counts:?}");
}

/// Levels end at 56, patches included: keys fit 64 bits, and no lattice is finer.
#[test]
fn case_35_levels_end_at_56_and_level_0_is_the_root_mesh() {
    for (patch_depth, level_max) in [(0, 57), (0, 60), (4, 53), (8, 49), (4, u8::MAX)] {
        let mut deep = settings(patch_depth, 30_000);
        deep.lod.level_max = level_max;
        let expected =
            format!("lod.level_max is {level_max}, allowed is 0 to {}", 56 - patch_depth);
        assert_eq!(refused(&deep), expected);
    }
    let mut flat = settings(4, 30_000);
    flat.lod.level_max = 0;
    let mut world = World::synthetic(&flat, NOISE);
    world.settled(&[looking(&flat)]);
    assert_eq!((world.output.counts.leaves, levels(&world)), (8, [0, 0]));
    // The last level there is, on a body where its cells are a quarter of a metre.
    let mut deep = bare(sphere(1e8), 0, 40_000);
    (deep.lod.level_max, deep.lod.splits_max) = (56, 4000);
    let mut world = World::synthetic(&deep, Relief::Noise { most_m: 0.5 });
    let mut near = looking(&deep);
    near.eye = deep.body.ecef_from_geodetic(Geodetic::from_degrees(20.0, 30.0, 1.0));
    world.settled(&[near]);
    assert_eq!(levels(&world)[1], 56);
}

#[test]
fn case_36_a_tolerance_of_0_uses_it_all_an_infinite_one_nothing_and_nan_is_refused() {
    let mut settings = settings(4, 20_000);
    for bad in [f64::NAN, -1.0, f64::NEG_INFINITY] {
        settings.lod.tolerance = Pixels(bad);
        let expected = format!("lod.tolerance_px is {bad:?}, allowed is 0.0 to inf");
        assert_eq!(refused(&settings), expected);
    }
    for (tolerance_px, least, most) in
        [(0.0, 19_900, 20_000), (5e-324, 19_900, 20_000), (f64::INFINITY, 128, 128)]
    {
        settings.lod.tolerance = Pixels(tolerance_px);
        let mut world = World::synthetic(&settings, NOISE);
        world.settle(&[looking(&settings)]);
        world.terrain.audit().unwrap();
        let counts = world.output.counts;
        assert!((least..=most).contains(&counts.triangles), "{tolerance_px}: {counts:?}");
        assert_eq!(counts.error_px_bound == tolerance_px, tolerance_px == f64::INFINITY);
    }
}

#[test]
fn case_36_other_settings_that_are_no_numbers_or_no_order_are_refused() {
    let mut bad = settings(4, 20_000);
    bad.lod.morph_s = f64::NAN;
    assert!(refused(&bad).starts_with("lod.morph_s is NaN, allowed is 0.0 to "));
    let mut bad = settings(4, 20_000);
    bad.lod.patch_depth = 3;
    assert_eq!(refused(&bad), "lod.patch_depth is 3, allowed is 0, 2, 4, 6 or 8");
    for splits_m in [vec![2.0, 1.0], vec![f64::NAN], vec![0.0], vec![f64::INFINITY], vec![1.0; 8]] {
        let mut bad = settings(4, 20_000);
        bad.depth.splits_m = splits_m;
        let words = refused(&bad);
        assert!(
            words.ends_with("allowed is at most 7 finite distances above 0, rising"),
            "{words}"
        );
    }
}

//! Cases 13 to 18 and 28: NaN, infinities, zero, lenses, sizes and times at their ends.
//!
//! In:    views and times that are wrong, or right and extreme.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: control bits of the processor (`host`), settings (`budgets`).

use crate::gauge::{levels, lost_px};
use crate::rig::{scene, view};
use crate::synthetic::Relief;
use crate::world::{EARTH, World, bare, down_on, sphere};
use glam::{DQuat, DVec3};
use overfly_core::camera::{View, ViewFault};
use overfly_core::geodesy::Geodetic;
use overfly_core::units::Radians;

fn good() -> View {
    view(&EARTH, Geodetic::from_degrees(46.8, -121.8, 5e3), 30.0, -30.0)
}

fn settled() -> World {
    let mut world = World::procedural(&scene(4, 30_000));
    world.settled(&[good()]);
    world
}

/// The words for a view that must be refused; nothing may change by it.
fn refused(world: &mut World, change: impl FnOnce(&mut View)) -> String {
    let before = world.output.digest;
    let mut bad = good();
    change(&mut bad);
    let words = world.try_frame(&[good(), bad]).unwrap_err().to_string();
    assert_eq!(world.input.views.len(), 2, "nothing was taken");
    world.frame(&[good()]);
    assert_eq!(world.output.digest, before, "{words}");
    assert_eq!(world.output.counts.splits + world.output.counts.merges, 0);
    words
}

#[test]
fn case_13_nan_and_infinities_are_refused_by_name_and_nothing_changes() {
    let mut world = settled();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::NAN] {
        let finite = format!("is {bad}, allowed is any finite number");
        for axis in 0..3 {
            let words = refused(&mut world, |view| view.eye.0[axis] = bad);
            assert_eq!(words, format!("view: eye {finite}"));
        }
        for axis in 0..4 {
            let words = refused(&mut world, |view| {
                let mut all = view.orientation.to_array();
                all[axis] = bad;
                view.orientation = DQuat::from_array(all);
            });
            assert_eq!(words, format!("view: orientation {finite}"));
        }
        let words = refused(&mut world, |view| view.field_of_view = Radians(bad));
        assert_eq!(words, format!("view: field of view {finite}"));
        let words = refused(&mut world, |view| view.near_m = bad);
        assert_eq!(words, format!("view: near distance {finite}"));
        let (before, time_ms) = (world.output.digest, world.output.time_ms);
        world.input.time_s = bad;
        let words = world.try_frame(&[good()]).unwrap_err().to_string();
        assert_eq!(words, format!("time is {bad} s, allowed is any finite number"));
        world.input.time_s = 0.0;
        world.frame(&[good()]);
        assert_eq!((world.output.digest, world.output.time_ms), (before, time_ms));
    }
    let words = refused(&mut world, |view| view.eye.0.x = 1e300);
    assert_eq!(words, "view: eye is 1e300 m, allowed is -1e30 to 1e30");
    let words = refused(&mut world, |view| view.near_m = 1e31);
    assert_eq!(words, "view: near distance is 1e31 m, allowed is -1e30 to 1e30");
    let words = refused(&mut world, |view| view.near_m = -0.5);
    assert_eq!(words, "view: near distance is -0.5 m, allowed is 1e-6 or more");
}

#[test]
fn case_14_orientations_of_any_length_but_zero_are_the_same_view() {
    let mut world = settled();
    for zero in [0.0, -0.0] {
        let words = refused(&mut world, |view| {
            view.orientation = DQuat::from_xyzw(zero, 0.0, zero, 0.0);
        });
        assert_eq!(words, "view: orientation is the zero quaternion, allowed is any other");
    }
    let before = world.output.views[0].camera;
    for length in [2.0, 1e-3, 1e-180, 1e-300, 1e180, 1e300, -1.0] {
        let mut long = good();
        long.orientation = DQuat::from_array(long.orientation.to_array().map(|c| c * length));
        world.frame(&[long]);
        world.check();
        let camera = world.output.views[0].camera;
        for (a, b) in [(before.forward, camera.forward), (before.up, camera.up)] {
            assert!((a - b).length() < 1e-14, "{length}: {a} {b}");
        }
    }
    let mut least = good();
    least.orientation = DQuat::from_xyzw(0.0, 5e-324, 0.0, 0.0);
    world.frame(&[least]);
    assert_eq!(world.output.views[0].camera.forward, DVec3::Z, "even the least denormal");
}

#[test]
fn case_15_pictures_without_pixels_are_refused_and_one_pixel_or_one_line_is_none() {
    let mut world = settled();
    for size_px in [[0, 0], [0, 9], [9, 0]] {
        let words = refused(&mut world, |view| view.size_px = size_px);
        let [width, height] = size_px;
        let expected =
            format!("view: size is {width} by {height} pixels, allowed is 1 by 1 or more");
        assert_eq!(words, expected);
    }
    for size_px in [[1, 1], [16_384, 1], [1, 16_384], [u32::MAX, 1], [1, u32::MAX]] {
        let mut thin = good();
        thin.size_px = size_px;
        world.settled(&[thin]);
        let camera = &world.output.views[0].camera;
        assert!(camera.half_tangents.into_iter().all(|t| t > 0.0 && t.is_finite()), "{camera:?}");
    }
}

/// A lens of this many degrees over the Earth, 1920 by 1080 pixels.
fn lens(degrees: f64, at: Geodetic, pitch_deg: f64) -> View {
    let mut view = view(&EARTH, at, 30.0, pitch_deg);
    (view.field_of_view, view.size_px) = (Radians::from_degrees(degrees), [1920, 1080]);
    view
}

/// The two-float pairs of the shader are subtracted in world axes, whose f32 shows at such a lens;
/// what is subtracted and rotated in f64 does not.
#[test]
fn case_16_through_a_lens_of_a_hundredth_of_a_degree_only_f64_is_steady() {
    let mut settings = scene(4, 200_000);
    (settings.lod.splits_max, settings.lod.wanted_max) = (4000, 256);
    let mut world = World::procedural(&settings);
    let here = world.eye_above_land(2e4);
    world.settled(&[lens(0.01, here, -40.0)]);
    let camera = &world.output.views[0].camera;
    assert!((camera.pixels_per_radian / 6.19e6 - 1.0).abs() < 0.01, "{}", camera.pixels_per_radian);
    let ([pair_px, eye_px], seen) = lost_px(&world);
    println!("{pair_px:.2e} px as pairs, {eye_px:.2e} px in f64, {seen} vertices");
    assert!(seen > 1000 && eye_px < 2.5e-4, "{eye_px} of {seen}");
    assert!(pair_px > 10.0 * eye_px, "else the precision would not matter: {pair_px}");
    let [_, deepest] = levels(&world);
    assert!(deepest > 30, "{deepest}");
    // Without a tolerance to reach, the deepest level ends it and the bound says by how much.
    settings.lod.level_max = 24;
    let mut shallow = World::procedural(&settings);
    shallow.settled(&[lens(0.01, here, -40.0)]);
    assert_eq!(levels(&shallow)[1], 24);
    assert!(shallow.output.counts.error_px_bound > 100.0, "{:?}", shallow.output.counts);
}

#[test]
fn case_17_through_a_lens_of_179_degrees_the_corner_factor_is_finite_and_counted() {
    let mut world = World::procedural(&scene(4, 60_000));
    let here = world.eye_above_land(3e3);
    world.settled(&[lens(179.0, here, -20.0)]);
    let camera = &world.output.views[0].camera;
    assert!((camera.pixels_per_radian - 4.7).abs() < 0.05, "{}", camera.pixels_per_radian);
    let corner = camera.corner_factor;
    assert!(corner > 5e4 && corner.is_finite(), "1/cos² of the corner is {corner}");
    assert!(world.output.counts.error_px_bound > 2.0, "the budget ends it, and is told");
    // A sample of other places showed 4.6e-3; ours comes nearer to the corner.
    let ([pair_px, eye_px], seen) = lost_px(&world);
    println!("{pair_px:.2e} px as pairs, {eye_px:.2e} px in f64, {seen} vertices");
    assert!(seen > 1000 && pair_px < 6e-3 && eye_px < 2.5e-4, "{pair_px} {eye_px}");
    let mut widest = lens(60.0, here, -20.0);
    widest.field_of_view = Radians(core::f64::consts::PI.next_down());
    world.settled(&[widest]);
}

#[test]
fn case_18_lenses_of_180_degrees_0_and_less_are_refused() {
    let mut world = settled();
    for degrees in [180.0, 0.0, -0.0, -60.0, 360.0, 1e-300] {
        let words = refused(&mut world, |v| v.field_of_view = Radians::from_degrees(degrees));
        assert!(words.starts_with("view: field of view is "), "{words}");
        assert!(words.ends_with(" rad, allowed is 1e-6 to π, π excluded"), "{words}");
    }
}

/// Time that goes back is a seek, which flights and replays do: it is taken, ends all morphs and
/// leaves the mesh as it is. Nothing but a number that is none is refused (case 13).
#[test]
fn case_28_time_that_stands_goes_back_or_leaps_changes_no_bit_of_a_settled_mesh() {
    let body = sphere(6.4e6);
    for morph_s in [0.0, 0.5] {
        let mut settings = bare(body, 4, 30_000);
        settings.lod.morph_s = morph_s;
        let mut world = World::synthetic(&settings, Relief::Flat { height_m: 0.0 });
        let looking = [down_on(&body, Geodetic::from_degrees(20.0, 30.0, 3e4))];
        world.input.time_s = 10.0;
        world.settled(&looking);
        for time_s in [10.0, 10.0, 9.0, -5.0, 1e9, 1e9, -1e9, 0.0, f64::MAX, f64::MIN] {
            let (before, then_ms) = (world.output.digest, world.output.time_ms);
            world.input.time_s = time_s;
            world.frame(&looking);
            world.check();
            assert_eq!(world.output.digest, before, "{time_s} s, morphs of {morph_s} s");
            assert_eq!(world.output.counts.built, 0);
            let step_ms = world.output.time_ms.wrapping_sub(then_ms);
            assert!(step_ms <= u32::MAX / 2, "the frame's clock never runs back: {step_ms}");
        }
    }
    // A leap in time with one in place is a teleport: the mesh is a cold start's.
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 16.0;
    let there = [view(&EARTH, Geodetic::from_degrees(-20.0, 130.0, 9e3), 10.0, -20.0)];
    let mut warm = World::procedural(&settings);
    warm.settled(&[good()]);
    warm.input.time_s = 1e9;
    let warm = warm.settled(&there);
    let cold = World::procedural(&settings).settled(&there);
    assert_eq!((warm.mesh, warm.vertices), (cold.mesh, cold.vertices));
}

#[test]
fn case_13_faults_name_what_was_found() {
    let fault = ViewFault::NotFinite { field: "eye", found: f64::NEG_INFINITY };
    assert_eq!(fault.to_string(), "view: eye is -inf, allowed is any finite number");
}

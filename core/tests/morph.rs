//! Morphing: watertight at every moment, born on the surface that was drawn, at home at the end.
//!
//! In:    descents, turns and climbs with time running, standing, leaping and wrapping.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: what a shader makes of it (`overfly_render_vk`).

mod rig;

use glam::{DVec3, IVec3};
use overfly_core::camera::View;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::lattice::{RADIUS, fold, key_of, signs, unfold};
use overfly_core::lod::audit::lattice_points;
use overfly_core::mesh::morph::duration_ms;
use overfly_core::mesh::{PatchMorph, PatchVertex};
use overfly_core::settings::SceneSettings;
use rig::{Rig, scene, view};
use std::collections::BTreeMap;

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn morphing(patch_depth: u8, triangles_max: u32, morph_s: f64) -> SceneSettings {
    let mut settings = scene(patch_depth, triangles_max);
    settings.lod.morph_s = morph_s;
    (settings.lod.splits_max, settings.lod.merges_max) = (60, 60);
    settings
}

/// Down and forward, with turns that merge what lies behind.
fn descent(frame: u32) -> View {
    let at = f64::from(frame);
    let height_m = 2_000.0 + 400_000.0 * libm::exp(-at / 25.0);
    let here = Geodetic::from_degrees(46.8 + 1e-3 * at, -121.8, height_m);
    view(&EARTH, here, 3.0 * at, -30.0)
}

fn fly(rig: &mut Rig, view: View, time_s: f64) {
    rig.input.time_s = time_s;
    rig.frame(&[view], |_| true);
}

/// A vertex as one patch draws it.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Drawn {
    point: IVec3,
    own: DVec3,
    /// What it is drawn at: all bits that a renderer reads.
    bits: [[u32; 3]; 3],
    at: DVec3,
    from: DVec3,
    left: f32,
    born_ms: u32,
}

fn drawn(point: IVec3, vertex: &PatchVertex, morph: &PatchMorph, left: f32) -> Drawn {
    let (hi, lo) = (vertex.position.hi, vertex.position.lo);
    let offset = morph.from_m.map(|m| left * m + 0.0);
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let own = wide(hi) + wide(lo);
    Drawn {
        point,
        own,
        bits: [hi, lo, offset].map(|v| v.map(f32::to_bits)),
        at: own + wide(offset),
        from: wide(morph.from_m),
        left,
        born_ms: morph.born_ms,
    }
}

/// Every drawn vertex by key, and how often a patch drew a moving one that another had drawn.
///
/// # Panics
/// Where two patches draw one lattice point at two places.
fn surface(rig: &Rig) -> (BTreeMap<u64, Drawn>, u32) {
    let (lod, patches) = (rig.terrain.lod(), rig.terrain.patches());
    let settings = rig.terrain.settings().lod;
    let (now_ms, morph_ms) = (rig.output.time_ms, duration_ms(settings.morph_s));
    let (mut all, mut shared) = (BTreeMap::new(), 0);
    let diamonds = &lod.mesh.diamonds;
    for (id, side) in diamonds.ids().flat_map(|id| [(id, 0), (id, 1)]) {
        let Some(slot) = lod.cover.patches[id][side] else { continue };
        let points = lattice_points(diamonds.shape(id).triangle(side), settings.patch_depth);
        let data = patches.vertices_of(slot).iter().zip(patches.morphs_of(slot));
        assert_eq!(patches.morphs_of(slot).len(), points.len());
        for (point, (vertex, morph)) in points.into_iter().zip(data) {
            let new = drawn(point, vertex, morph, morph.left(now_ms, morph_ms));
            let Some(kept) = all.insert(key_of(point), new) else { continue };
            assert_eq!(kept.bits, new.bits, "{point} of {id:?}: {kept:?} {new:?}");
            if is_moving(&kept) {
                assert_eq!((kept.from, kept.born_ms), (new.from, new.born_ms), "{point}");
                shared += 1;
            }
        }
    }
    (all, shared)
}

fn is_moving(one: &Drawn) -> bool {
    one.left > 0.0 && one.from != DVec3::ZERO
}

/// The ends of the edge that a lattice point halves, from its coordinates alone: on a grid line
/// the neighbours along it; in the middle of a cell two opposite corners, those whose places on the
/// coarser grid are both even or both odd, but on the octahedron's own faces the other two.
fn ends_of(point: IVec3) -> [IVec3; 2] {
    let quadrant = (0..4)
        .find(|&q| {
            let (sx, sy) = signs(q);
            sx * point.x >= 0 && sy * point.y >= 0
        })
        .unwrap();
    let (u, v) = unfold(quadrant, point);
    let step = 1 << (u | v).trailing_zeros();
    let odd = |along: i32| along / step % 2 == 1;
    let (du, dv) = match (odd(u), odd(v)) {
        (true, false) => (step, 0),
        (false, true) => (0, step),
        _ => {
            let parity = (u + step) / (2 * step) + (v + step) / (2 * step);
            let same = parity % 2 == 0;
            let rising = if 2 * step == RADIUS { false } else { same };
            (step, if rising { step } else { -step })
        }
    };
    [fold(quadrant, u + du, v + dv), fold(quadrant, u - du, v - dv)]
}

/// Where the surface of a frame was drawn at a lattice point, and how far that moves in `share` of
/// a morph.
fn seen_at(before: &BTreeMap<u64, Drawn>, point: IVec3, share: f64) -> (DVec3, f64) {
    if let Some(one) = before.get(&key_of(point)) {
        return (one.at, one.from.length() * share.min(f64::from(one.left)));
    }
    let [a, b] = ends_of(point).map(|end| seen_at(before, end, share));
    ((a.0 + b.0) * 0.5, (a.1 + b.1) * 0.5)
}

#[test]
fn all_patches_draw_a_shared_vertex_at_one_place_at_every_moment() {
    for (patch_depth, budget, morph_s) in
        [(0, 8_000, 0.5), (2, 16_000, 0.3), (4, 40_000, 0.5), (4, 40_000, 3.0)]
    {
        let mut rig = Rig::new(&morphing(patch_depth, budget, morph_s), 0);
        let (mut moving, mut shared, mut merges) = (0, 0, 0);
        for frame in 0..160 {
            fly(&mut rig, descent(frame), 100.0 + f64::from(frame) / 60.0);
            let (all, twice) = surface(&rig);
            moving += all.values().filter(|one| is_moving(one)).count();
            (shared, merges) = (shared + twice, merges + rig.output.counts.merges);
            if frame % 40 == 39 {
                rig.audit();
            }
        }
        println!("k = {patch_depth}: {moving} moving, {shared} shared, {merges} merges");
        assert!(moving > 10_000 && shared > 10_000 && merges > 100, "{moving} {shared} {merges}");
    }
}

/// A vertex born now is in the middle of where its ends are drawn; whether one of them moves.
fn is_born_between(one: &Drawn, all: &BTreeMap<u64, Drawn>) -> bool {
    assert_eq!(one.left, 1.0);
    let [a, b] = ends_of(one.point).map(|end| all[&key_of(end)]);
    let gap_m = (one.at - (a.at + b.at) * 0.5).length();
    // Half an f32 ulp of each offset, and of each two-float place.
    let reach_m = one.from.length() + a.from.length() + b.from.length();
    let bound_m = reach_m / f64::from(1 << 23) + 5e-8;
    assert!(gap_m <= bound_m, "{one:?} is {gap_m} m off, {bound_m} allowed");
    is_moving(&a) || is_moving(&b)
}

/// A vertex is no farther from where the surface was than in `share` of a morph it may be; by
/// what part of that it moved.
fn share_moved(one: &Drawn, before: &BTreeMap<u64, Drawn>, share: f64) -> f64 {
    let (was, allowed_m) = seen_at(before, one.point, share);
    let moved_m = (one.at - was).length();
    let bound_m = allowed_m * 1.001 + one.from.length() * 1e-6 + 1e-7;
    assert!(moved_m <= bound_m, "{one:?} moved {moved_m} m of {allowed_m}");
    moved_m / bound_m
}

#[test]
fn new_vertices_are_born_on_the_surface_and_nothing_jumps() {
    for (patch_depth, budget, morph_s) in [(0, 8_000, 0.4), (2, 16_000, 0.4), (4, 40_000, 1.0)] {
        let mut rig = Rig::new(&morphing(patch_depth, budget, morph_s), 0);
        let (mut born, mut on_the_way, mut worst_share) = (0, 0, 0.0_f64);
        let mut before = BTreeMap::new();
        let mut before_ms = 0;
        // Comes up while time stands, as flights do: no vertex then has farther to go than the
        // edge that it halves is long.
        (0..80).for_each(|_| fly(&mut rig, descent(0), 1.0));
        for frame in 0..140 {
            fly(&mut rig, descent(frame), 1.0 + f64::from(frame + 1) / 60.0);
            let (all, _) = surface(&rig);
            let now_ms = rig.output.time_ms;
            let share = f64::from(now_ms - before_ms) / (1e3 * morph_s);
            for one in all.values().filter(|one| is_moving(one) && one.born_ms == now_ms) {
                born += 1;
                on_the_way += u32::from(is_born_between(one, &all));
            }
            for one in all.values().filter(|_| !before.is_empty()) {
                worst_share = worst_share.max(share_moved(one, &before, share));
            }
            (before, before_ms) = (all, now_ms);
        }
        println!("k = {patch_depth}: {born} born, {on_the_way} over moving ends, {worst_share}");
        assert!(born > 2_000 && on_the_way > 500, "{born} {on_the_way}");
        assert!(worst_share > 0.9, "the bound is met: {worst_share}");
    }
}

#[test]
fn after_the_morph_every_vertex_is_exactly_at_its_own_place() {
    let mut rig = Rig::new(&morphing(4, 40_000, 0.5), 0);
    let looking = descent(100);
    let (mut frame, mut moving) = (0_u32, 0);
    loop {
        fly(&mut rig, looking, f64::from(frame) / 60.0);
        let counts = rig.output.counts;
        moving += surface(&rig).0.values().filter(|one| is_moving(one)).count();
        frame += 1;
        if counts.leaves > 8 && counts.splits + counts.merges + counts.wanted == 0 {
            break;
        }
        assert!(frame < 1_000);
    }
    assert!(moving > 1_000);
    let settled = rig.output.digest;
    fly(&mut rig, looking, f64::from(frame) / 60.0 + 0.5);
    assert_eq!((rig.output.digest, rig.output.counts.built), (settled, 0), "time builds nothing");
    for one in surface(&rig).0.values() {
        assert_eq!((is_moving(one), one.at), (false, one.own));
    }
}

#[test]
fn a_leap_back_in_time_ends_all_morphs_and_tears_nothing() {
    let mut rig = Rig::new(&morphing(4, 40_000, 1.0), 0);
    // Starts where milliseconds wrap, leaps back in mid-flight, then far ahead.
    let wrap_s = 4_294_967.296;
    let time_s = |frame: u32| match frame {
        0..60 => wrap_s - 0.5 + f64::from(frame) / 60.0,
        60..120 => 3.0 + f64::from(frame) / 60.0,
        _ => 7_000_000.0 + f64::from(frame) / 60.0,
    };
    for frame in 0..180 {
        let (all, _) = {
            fly(&mut rig, descent(frame), time_s(frame));
            surface(&rig)
        };
        let now_ms = rig.output.time_ms;
        let moving = all.values().filter(|one| is_moving(one));
        if frame == 60 || frame == 120 {
            assert!(moving.clone().all(|one| one.born_ms == now_ms), "only what is new moves");
        }
        assert!(moving.count() > 0 || frame < 10, "frame {frame}");
    }
    rig.audit();
}

#[test]
fn a_split_after_a_merge_is_a_new_birth() {
    let mut rig = Rig::new(&morphing(4, 20_000, 0.5), 0);
    let (near, far) = (descent(120), {
        let here = Geodetic::from_degrees(-46.8, 58.2, 2_000.0);
        view(&EARTH, here, 10.0, -30.0)
    });
    let mut frame = 0_u32;
    let mut births = Vec::new();
    for leg in [near, far, near] {
        for _ in 0..150 {
            fly(&mut rig, leg, f64::from(frame) / 60.0);
            let (all, _) = surface(&rig);
            births.extend(
                all.values().filter(|one| is_moving(one)).map(|o| (key_of(o.point), o.born_ms)),
            );
            frame += 1;
        }
    }
    births.sort_unstable();
    births.dedup();
    let again = births.windows(2).filter(|two| two[0].0 == two[1].0 && two[1].1 > two[0].1 + 2_000);
    assert!(again.count() > 500);
}

#[test]
fn spheres_enclose_where_vertices_begin() {
    let mut rig = Rig::new(&morphing(2, 16_000, 1.0), 0);
    let mut outside_own = 0;
    for frame in 0..80 {
        fly(&mut rig, descent(frame), f64::from(frame) / 60.0);
        let patches = rig.terrain.patches();
        for (slot, leaf) in (0..patches.used_end()).zip(&patches.leaf) {
            let (Some(_), Some((centre, radius_m))) = (leaf, patches.sphere(slot)) else {
                continue;
            };
            let mut own_m = 0.0_f64;
            for (vertex, morph) in patches.vertices_of(slot).iter().zip(patches.morphs_of(slot)) {
                let one = drawn(IVec3::ZERO, vertex, morph, 1.0);
                assert!((one.at - centre).length() <= radius_m * (1.0 + 1e-9) + 1e-6);
                own_m = own_m.max((one.own - centre).length());
            }
            outside_own += u32::from(radius_m > own_m * (1.0 + 1e-6));
        }
    }
    assert!(outside_own > 100, "some begin farther out: {outside_own}");
}

#[test]
fn a_scene_that_does_not_morph_has_no_column() {
    let mut still = Rig::new(&morphing(4, 20_000, 0.0), 0);
    let mut rig = Rig::new(&morphing(4, 20_000, 0.5), 0);
    for frame in 0..60 {
        fly(&mut still, descent(frame), f64::from(frame) / 60.0);
        fly(&mut rig, descent(frame), f64::from(frame) / 60.0);
        let (a, b) = (still.output.digest, rig.output.digest);
        assert_eq!((a.mesh, a.pages), (b.mesh, b.pages), "time changes no mesh");
    }
    assert_ne!(still.output.digest.vertices, rig.output.digest.vertices);
    let patches = still.terrain.patches();
    assert_eq!((patches.morphs.capacity(), patches.morphs_of(3).len()), (0, 0));
    assert!(still.terrain.lod().cover.split_ms.as_slice().is_empty());
    assert_eq!(duration_ms(0.0), 0);
    assert_eq!((duration_ms(1e-9), duration_ms(0.25), duration_ms(1e300)), (1, 250, 1 << 30));
}

#[test]
fn workers_do_not_change_a_bit_of_a_morph() {
    let digests = [0, 2].map(|workers| {
        let mut rig = Rig::new(&morphing(4, 40_000, 0.5), workers);
        let mut sum = 0_u64;
        for frame in 0..90 {
            fly(&mut rig, descent(frame), f64::from(frame) / 60.0);
            sum = overfly_core::digest::mix(sum ^ rig.output.digest.all());
        }
        sum
    });
    assert_eq!(digests[0], digests[1]);
}

#[test]
fn what_is_left_falls_in_a_straight_line_and_is_nothing_outside() {
    let morph = PatchMorph { born_ms: u32::MAX - 99, ..PatchMorph::EMPTY };
    let left = |after_ms: u32| morph.left(morph.born_ms.wrapping_add(after_ms), 400);
    assert_eq!([0, 100, 200, 399].map(left), [1.0, 0.75, 0.5, 1.0 - 399.0 / 400.0]);
    assert_eq!([400, 401, u32::MAX, 1 << 31].map(left), [0.0; 4]);
    assert_eq!(morph.left(morph.born_ms, 0), 0.0);
}

//! What debug views are told, held against the mesh and its counts.
//!
//! In:    settled meshes, pages withheld.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: colours and lines on the screen.

mod rig;

use glam::DVec3;
use overfly_core::camera::View;
use overfly_core::geodesy::frames::narrow;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::inspect::{BOUND_LINES, PatchInfo};
use rig::{Rig, scene, view};

const EARTH: Ellipsoid = Ellipsoid::WGS84;

fn over(lat_deg: f64, height_m: f64) -> View {
    view(&EARTH, Geodetic::from_degrees(lat_deg, -121.8, height_m), 30.0, -20.0)
}

fn inspected(rig: &Rig) -> Vec<PatchInfo> {
    let mut infos = vec![PatchInfo { level: 9, ..PatchInfo::default() }; 3];
    rig.terrain.inspect(&mut infos);
    infos
}

/// What live patches are told; checks that there is one a leaf and that free slots have nothing.
fn of_leaves(rig: &Rig) -> Vec<PatchInfo> {
    let infos = inspected(rig);
    let patches = rig.terrain.patches();
    assert_eq!(infos.len(), patches.used_end() as usize);
    let (mut live, mut free) = (Vec::new(), 0);
    for (info, leaf) in infos.into_iter().zip(&patches.leaf) {
        match leaf {
            Some(_) => live.push(info),
            None => {
                assert_eq!(info, PatchInfo::default());
                free += 1;
            }
        }
    }
    assert_eq!(live.len(), rig.output.counts.leaves as usize);
    assert_eq!(free, patches.used_end() - patches.live());
    live
}

fn worst_px(infos: &[PatchInfo]) -> f32 {
    infos.iter().fold(0.0, |worst, info| worst.max(info.error_px))
}

#[test]
fn where_the_tolerance_decides_no_patch_is_worse() {
    let mut settings = scene(4, 1_000_000);
    settings.lod.tolerance.0 = 4.0;
    let mut rig = Rig::new(&settings, 0);
    rig.settle(&[over(46.8, 30_000.0)]);
    rig.settle(&[over(46.8, 90_000.0)]);
    assert_eq!(rig.output.counts.error_px_bound, 4.0);
    let infos = of_leaves(&rig);
    assert!(worst_px(&infos) <= 4.0 && worst_px(&infos) > 2.0);
    let seen = infos.iter().filter(|info| info.seen == 1).count();
    assert!(seen > 10 && seen < infos.len(), "{seen} of {}", infos.len());
    assert!(infos.iter().all(|info| info.lacking == 0));
    assert!(infos.iter().all(|info| info.seen == 1 || info.error_px == 0.0));
    let deepest = infos.iter().map(|info| info.level).max().unwrap();
    let shallow = infos.iter().map(|info| info.level).min().unwrap();
    assert!(shallow < 6 && deepest > 12, "{shallow} to {deepest}");
    for info in &infos {
        let page_depth = overfly_core::lod::reach::page_depth(info.level, 4);
        assert_eq!(info.page_depth, page_depth);
    }
}

#[test]
fn where_the_deepest_level_ends_it_the_worst_patch_is_the_bound_of_the_frame() {
    let mut settings = scene(4, 100_000);
    settings.lod.level_max = 9;
    let mut rig = Rig::new(&settings, 0);
    rig.settle(&[over(46.8, 9_000.0)]);
    let infos = of_leaves(&rig);
    let bound_px = rig.output.counts.error_px_bound;
    assert!(bound_px > settings.lod.tolerance.0);
    assert_eq!(worst_px(&infos), narrow(bound_px));
    let worst = infos.iter().find(|info| info.error_px == narrow(bound_px)).unwrap();
    assert_eq!((worst.level, worst.seen), (9, 1));
}

#[test]
fn patches_tell_how_many_levels_a_page_costs_them() {
    let mut settings = scene(4, 100_000);
    settings.lod.tolerance.0 = 4.0;
    let mut rig = Rig::new(&settings, 0);
    let view = over(46.8, 9_000.0);
    // Only root pages arrive: 4 wanted first.
    for frame in 0..40 {
        rig.frame(&[view], |_| frame < 3);
    }
    let counts = rig.output.counts;
    assert!(counts.blocked > 0, "{counts:?}");
    let infos = of_leaves(&rig);
    assert_eq!(worst_px(&infos), narrow(counts.error_px_bound));
    let waiting = infos.iter().filter(|info| info.lacking > 0);
    assert!(waiting.clone().count() >= counts.blocked as usize);
    for info in waiting.clone() {
        let levels = i32::from(info.lacking);
        let squared = f64::from(info.error_px / 4.0) * f64::from(info.error_px / 4.0);
        let fits = squared <= libm::ldexp(1.0, levels) * 1.0001;
        assert!(fits && squared > libm::ldexp(1.0, levels - 1) * 0.9999, "{info:?}");
    }
    assert!(infos.iter().all(|info| info.lacking == 0 || info.error_px > 4.0));
    rig.settle(&[view]);
    let after = of_leaves(&rig);
    assert!(after.iter().all(|info| info.lacking == 0));
    assert!(waiting.map(|info| info.lacking).max() > Some(1));
}

#[test]
fn a_held_mesh_is_judged_by_the_views_that_it_was_made_for() {
    let mut rig = Rig::new(&scene(4, 60_000), 0);
    rig.settle(&[over(46.8, 9_000.0)]);
    let before = worst_px(&of_leaves(&rig));
    rig.input.hold_lod = true;
    rig.frame(&[over(46.8, 300.0)], |_| true);
    let after = worst_px(&of_leaves(&rig));
    assert_eq!(after, before);
    rig.input.hold_lod = false;
    rig.frame(&[over(46.8, 300.0)], |_| false);
    let judged = worst_px(&of_leaves(&rig));
    assert_ne!(judged, before);
}

#[test]
fn bounds_are_circles_around_the_patches_the_nearest_first() {
    let mut rig = Rig::new(&scene(4, 60_000), 0);
    let view = over(46.8, 9_000.0);
    rig.settle(&[view]);
    let near = view.eye.0;
    let mut lines = Vec::new();
    rig.terrain.bound_lines(near, f64::INFINITY, usize::MAX, &mut lines);
    assert_eq!(lines.len(), rig.output.counts.leaves as usize * BOUND_LINES);
    let patches = rig.terrain.patches();
    let mut spheres: Vec<_> =
        (0..patches.used_end()).filter_map(|slot| patches.sphere(slot)).collect();
    let away_m = |&(centre, radius_m): &(DVec3, f64)| (centre - near).length() - radius_m;
    spheres.sort_by(|a, b| away_m(a).total_cmp(&away_m(b)));
    for (sphere, lines) in spheres.iter().zip(lines.chunks(BOUND_LINES)) {
        let ends = lines.iter().flatten();
        let off_m = ends.map(|end| ((*end - sphere.0).length() - sphere.1).abs());
        assert!(off_m.fold(0.0, f64::max) < 1e-6 + 1e-9 * sphere.1);
    }
    let within = spheres.iter().filter(|sphere| away_m(sphere) <= 20_000.0).count();
    rig.terrain.bound_lines(near, 20_000.0, usize::MAX, &mut lines);
    assert!(within > 3 && lines.len() == within * BOUND_LINES, "{within}");
    rig.terrain.bound_lines(near, 20_000.0, 3 * BOUND_LINES - 1, &mut lines);
    assert_eq!(lines.len(), 2 * BOUND_LINES);
}

#[test]
fn diamonds_point_at_their_parents_on_the_ground() {
    let mut rig = Rig::new(&scene(4, 60_000), 0);
    let view = over(46.8, 9_000.0);
    rig.settle(&[view]);
    let near = view.eye.0;
    let mut lines = Vec::new();
    rig.terrain.diamond_lines(near, f64::INFINITY, usize::MAX, &mut lines);
    let lod = rig.terrain.lod();
    let diamonds = &lod.mesh.diamonds;
    let unsplit = diamonds.ids().filter(|&id| !diamonds[id].is_split());
    let links: usize = unsplit.map(|id| diamonds[id].parents().into_iter().flatten().count()).sum();
    assert!(links > 1_000 && lines.len() == links, "{links}");
    for place in lines.iter().flatten().step_by(7) {
        let there = EARTH.geodetic_from_ecef(Ecef(*place));
        let ground_m = rig.generator.planet().unwrap().sample(there.normal()).height_m.max(0.0);
        assert!((there.height_m - ground_m).abs() < 2e-3, "{} and {ground_m}", there.height_m);
    }
    let all = lines.clone();
    rig.terrain.diamond_lines(near, 100_000.0, usize::MAX, &mut lines);
    assert!(!lines.is_empty() && lines.len() < all.len());
    assert!(lines.iter().all(|[from, _]| (*from - near).length() <= 100_000.0));
    let nearest: Vec<_> = lines[..5].to_vec();
    rig.terrain.diamond_lines(near, 100_000.0, 5, &mut lines);
    assert!(lines.len() >= 4 && nearest.starts_with(&lines));
}

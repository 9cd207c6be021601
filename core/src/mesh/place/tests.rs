//! Draws of moving views against a test of every slot in every frame.
//!
//! In:    spheres and cameras made from hashes.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: bundled flights, whose digests the contracts hold.

use super::*;
use crate::camera::View;
use crate::geodesy::{Ecef, Ellipsoid};
use crate::mesh::patches::{BuiltPatch, Leaf};
use crate::settings::{DepthFormat, DepthOrder};
use crate::units::Radians;
use glam::{DQuat, DVec3};

const SLOTS: u32 = 3000;

/// The number of a hash, in −1..1.
fn signed(seed: u64) -> f64 {
    f64::from(u32::try_from(mix(seed) >> 32).unwrap()) / f64::from(1_u32 << 31) - 1.0
}

fn vector(seed: u64) -> DVec3 {
    DVec3::new(signed(seed), signed(seed + 1_000_003), signed(seed + 2_000_003))
}

fn ground() -> DVec3 {
    DVec3::new(4e6, 3e6, 3.9e6)
}

fn fill(patches: &mut Patches, slot: u32, seed: u64) {
    let (centre, radius_m) = sphere(seed);
    let content = mix(seed) | 1;
    let vertices = [crate::mesh::PatchVertex::EMPTY; 3];
    patches.fill(slot, BuiltPatch { centre, radius_m, content }, &vertices);
}

fn camera(eye: DVec3, orientation: DQuat) -> Camera {
    let view = View {
        eye: Ecef(eye),
        orientation,
        field_of_view: Radians::from_degrees(60.0),
        size_px: [1280, 720],
        near_m: 0.1,
    };
    Camera::new(&view, &Ellipsoid::WGS84)
}

/// What the stage promises: each slot against each plane and range.
fn oracle(
    patches: &Patches,
    spheres: &[Option<(DVec3, f64)>],
    view: &ViewDraws,
) -> (Vec<Vec<u32>>, u64) {
    let camera = &view.camera;
    let mut lists = vec![Vec::new(); view.ranges.len()];
    let mut sum = 0_u64;
    for (slot, sphere) in (0_u32..).zip(spheres) {
        let Some((centre, radius_m)) = *sphere else { continue };
        let to = centre - camera.eye.0;
        if camera.side_planes.iter().any(|plane| plane.dot(to) < -radius_m) {
            continue;
        }
        let depth_m = camera.forward.dot(to);
        for (index, range) in (0_u64..).zip(&view.ranges) {
            if depth_m + radius_m >= range.near_m && depth_m - radius_m <= range.far_m {
                lists[usize::try_from(index).unwrap()].push(slot);
                let tag = mix(patches.content[slot as usize].wrapping_add(index));
                sum = sum.wrapping_add(tag);
            }
        }
    }
    (lists, sum)
}

/// Sizes and distances over six decades, so that borders of all ranges are met.
fn sphere(seed: u64) -> (DVec3, f64) {
    let reach_m = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5][usize::try_from(mix(seed) % 6).unwrap()];
    (ground() + vector(seed) * reach_m, signed(seed + 5).abs() * reach_m * 0.1)
}

/// Eye and turn of a frame: stands, creeps, flies, turns, and jumps once in a while.
fn pose(frame: u64, eye: DVec3, turn: DQuat) -> (DVec3, DQuat) {
    match frame % 40 {
        0 => (ground() + vector(frame) * 1e5, turn),
        1 => (ground(), DQuat::from_euler(glam::EulerRot::XYZ, signed(frame), 1.0, 2.0)),
        2..6 => (eye, turn),
        6..15 => (eye + vector(frame) * 1e-3, turn),
        15..25 => (eye + DVec3::new(1.3, -0.4, 0.2), turn),
        25..32 => (eye, turn * DQuat::from_xyzw(0.0, 1e-4, 0.0, 1.0)),
        _ => (eye + DVec3::X * 0.7, turn * DQuat::from_xyzw(1e-3, 2e-3, -1e-3, 1.0)),
    }
}

#[test]
fn draws_are_those_of_testing_every_slot_in_every_frame() {
    let mut patches = Patches::new(0, SLOTS);
    let mut spheres = vec![None; SLOTS as usize];
    for diamond in 0..SLOTS - 100 {
        let slot = patches.take(Leaf { diamond, side: 0 });
        fill(&mut patches, slot, slot.into());
        spheres[slot as usize] = Some(sphere(slot.into()));
    }
    let depth = DepthSettings {
        format: DepthFormat::D32F,
        order: DepthOrder::Reversed,
        splits_m: vec![30.0, 1e4],
    };
    let (mut eye, mut turn) = (ground(), DQuat::IDENTITY);
    let mut view = empty_draws(camera(eye, turn), &depth, SLOTS);
    let mut placed = Placed::new(SLOTS);
    let (mut looks, mut drawn) = (0, 0);
    for frame in 0..400 {
        // Some slots go, and some of these come back with another patch.
        for change in 0..u32::from(frame % 3 == 0) * 9 {
            let slot = u32::try_from(mix(frame * 31 + u64::from(change)) % 2900).unwrap();
            if spheres[slot as usize].take().is_some() {
                patches.give_back(slot);
            }
            if change % 3 != 0 {
                let slot = patches.take(Leaf { diamond: slot, side: 1 });
                fill(&mut patches, slot, frame * 7919 + u64::from(slot));
                spheres[slot as usize] = Some(sphere(frame * 7919 + u64::from(slot)));
            }
        }
        (eye, turn) = pose(frame, eye, turn);
        view.camera = camera(eye, turn);
        let (aim, blocks) = placed.begin(&view, &patches);
        let stamps = patches.stamps.iter();
        let groups = || blocks.iter().flat_map(|block| &block.groups);
        looks += stamps.zip(groups()).filter(|(s, group)| !group.holds(**s, &aim.now)).count();
        place_blocks(&patches, &aim, 0, blocks);
        let digest = placed.count(&mut view);
        let (lists, sum) = oracle(&patches, &spheres, &view);
        for (index, range) in view.ranges.iter_mut().enumerate() {
            // Written in parts that end anywhere.
            range.patches.fill(u32::MAX);
            for (part, out) in range.patches.chunks_mut(177).enumerate() {
                placed.list(index, part * 177, out);
            }
            assert_eq!(range.patches, lists[index], "frame {frame}, range {index}");
            drawn += lists[index].len();
        }
        assert_eq!(placed.blocks.iter().fold(0, |s, block| block.sum.wrapping_add(s)), sum);
        assert_eq!(digest, chained(sum, &view.camera));
    }
    // Neither all groups in all frames, nor an empty picture.
    assert!(looks < 400 * patches.stamps.len() * 3 / 4, "{looks} looks");
    assert!(drawn > 100_000, "{drawn} drawn");
}

#[test]
fn another_set_of_ranges_begins_anew() {
    let mut patches = Patches::new(0, 64);
    let slot = patches.take(Leaf { diamond: 0, side: 0 });
    fill(&mut patches, slot, 0);
    let eye = sphere(0).0 + DVec3::Z * 100.0;
    let mut placed = Placed::new(64);
    for (splits_m, expected) in [(vec![50.0], [0, 1]), (vec![5000.0], [1, 0])] {
        let depth =
            DepthSettings { format: DepthFormat::D32F, order: DepthOrder::Reversed, splits_m };
        let mut view = empty_draws(camera(eye, DQuat::IDENTITY), &depth, 64);
        let (aim, blocks) = placed.begin(&view, &patches);
        place_blocks(&patches, &aim, 0, blocks);
        placed.count(&mut view);
        let counts: Vec<usize> = view.ranges.iter().map(|range| range.patches.len()).collect();
        assert_eq!(counts, expected);
    }
}

#[test]
fn ranges_cover_all_depths_and_overlap_slightly() {
    let depth = DepthSettings {
        format: DepthFormat::D32F,
        order: DepthOrder::Reversed,
        splits_m: vec![30.0, 1e4],
    };
    let ranges: Vec<_> = ranges_of(0.1, &depth).collect();
    assert_eq!(ranges.len(), 3);
    assert_eq!(ranges[0].0, 0.1);
    assert_eq!(ranges[2].1, f64::INFINITY);
    for pair in ranges.windows(2) {
        assert!(pair[0].1 > pair[1].0 && pair[0].1 < pair[1].0 * 1.003);
    }
}

//! Columns through the C border are the façade's, and short buffers are told and left alone.
//!
//! In:    the flight of `examples/c/flight.c`, buffers of all lengths.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: heights (`queries`).

use super::calls::*;
use overfly::core::frame::FrameOutput;
use overfly::core::mesh::topology;
use overfly_c::columns::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ptr::{null, null_mut};

const FRAMES: usize = 30;

fn flown_terrain() -> ovf_terrain {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, FRAMES);
    terrain
}

fn limits(terrain: ovf_terrain) -> ovf_limits {
    let mut limits = sized();
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_terrain_limits(terrain, &raw mut limits) });
    limits
}

/// Asks for the count, then for all, then with one too few.
fn all<T: Clone + PartialEq + std::fmt::Debug>(
    blank: T,
    call: impl Fn(*mut T, u64, *mut u64) -> ovf_status,
) -> Vec<T> {
    let mut count = 0;
    must(call(null_mut(), 0, &raw mut count));
    let mut items = vec![blank.clone(); usize::try_from(count).unwrap()];
    let needed = count;
    must(call(items.as_mut_ptr(), count, &raw mut count));
    assert_eq!(count, needed);
    if count > 0 {
        let mut short = vec![blank.clone(); items.len()];
        assert_eq!(call(short.as_mut_ptr(), count - 1, &raw mut count), OVF_SHORT_BUFFER);
        assert!(last_error().contains("needed are"), "{}", last_error());
        assert_eq!(count, needed);
        assert!(short.iter().all(|item| *item == blank), "nothing was written");
    }
    items
}

#[test]
fn patches_vertices_and_indices_are_those_of_the_facade() {
    let terrain = flown_terrain();
    let (mut overfly, mut out) = (opened_in_rust(), FrameOutput::default());
    (0..FRAMES).for_each(|frame| fly_in_rust(&mut overfly, frame, &mut out));
    let limits = limits(terrain);
    let patches = overfly.terrain().patches();
    assert_eq!(limits.patches_max, overfly.terrain().limits().leaves);
    assert_eq!((limits.body_a_m, limits.body_f), (1000.0, 0.0));
    let depth = (limits.depth_format, limits.depth_order);
    assert_eq!(depth, (OVF_DEPTH_D32F, OVF_DEPTH_REVERSED));
    // A program that was built before there was depth in it.
    let mut older = ovf_limits { struct_size: 64, depth_format: 77, depth_order: 78, ..sized() };
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_terrain_limits(terrain, &raw mut older) });
    assert_eq!((older.patches_max, older.body_a_m), (limits.patches_max, 1000.0));
    assert_eq!((older.struct_size, older.depth_format, older.depth_order), (64, 77, 78));

    // SAFETY: `all` gives buffers that are as long as they say; so in all calls below.
    let indices =
        all(7, |to, room, count| unsafe { ovf_terrain_indices(terrain, to, room, count) });
    assert_eq!(indices, topology::indices(patches.patch_depth));
    // SAFETY: as above.
    let built = all(7, |to, room, count| unsafe { ovf_terrain_built(terrain, to, room, count) });
    assert_eq!(built, out.built);
    // SAFETY: as above.
    let wanted = all(7, |to, room, count| unsafe { ovf_terrain_wanted(terrain, to, room, count) });
    assert_eq!(wanted, out.wanted.iter().map(|key| key.bits()).collect::<Vec<_>>());
    let mut ranges = vec![<ovf_range as bytemuck::Zeroable>::zeroed(); 9];
    let mut count = 0;
    // SAFETY: as above.
    must(unsafe { ovf_terrain_ranges(terrain, 0, ranges.as_mut_ptr(), 9, &raw mut count) });
    assert_eq!(count, u64::from(limits.ranges_per_view));
    let counts: Vec<_> = out.views[0].ranges.iter().map(|range| range.patches.len()).collect();
    let found: Vec<_> = ranges[..counts.len()].iter().map(|it| it.patch_count as usize).collect();
    assert_eq!(found, counts);

    let drawn = counts.iter().sum::<usize>();
    let (mut slot, mut range) = (vec![0; drawn], vec![9; drawn]);
    let (mut key, mut level, mut radius) = (vec![0; drawn], vec![0; drawn], vec![0.0; drawn]);
    let columns = ovf_patch_columns {
        slot: slot.as_mut_ptr(),
        key: key.as_mut_ptr(),
        level: level.as_mut_ptr(),
        range: range.as_mut_ptr(),
        radius_m: radius.as_mut_ptr(),
        ..sized()
    };
    let room = drawn as u64;
    // SAFETY: as above, all five columns.
    must(unsafe { ovf_terrain_patches(terrain, 0, &raw const columns, room, &raw mut count) });
    assert_eq!(count, room);
    let listed = out.views[0].ranges.iter().flat_map(|range| range.patches.iter().copied());
    assert_eq!(slot, listed.collect::<Vec<_>>());
    assert!(level.iter().all(|&level| level > 0) && radius.iter().all(|&radius| radius > 0.0));
    let mut distinct = key.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let mut slots = slot.clone();
    slots.sort_unstable();
    slots.dedup();
    assert_eq!(distinct.len(), slots.len(), "a key a slot");

    let each = patches.vertices_per_patch as usize;
    let mut vertices = vec![<ovf_vertex as bytemuck::Zeroable>::zeroed(); slots.len() * each];
    let (asked, room) = (slots.len() as u64, vertices.len() as u64);
    // SAFETY: as above.
    let call = |room: u64, to: *mut ovf_vertex| unsafe {
        ovf_terrain_vertices(terrain, slots.as_ptr(), asked, to, room)
    };
    assert_eq!(call(room - 1, vertices.as_mut_ptr()), OVF_SHORT_BUFFER);
    must(call(room, vertices.as_mut_ptr()));
    for (&slot, found) in slots.iter().zip(vertices.chunks(each)) {
        for (vertex, found) in patches.vertices_of(slot).iter().zip(found) {
            assert_eq!(found.position_hi_m, vertex.position.hi);
            assert_eq!(found.position_lo_m, vertex.position.lo);
            assert_eq!((found.normal_oct, found.layers), (vertex.normal_oct, vertex.layers));
            assert_eq!(found.height_m.to_bits(), vertex.height_m.to_bits());
        }
    }
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn slots_and_views_that_are_not_there_are_refused() {
    let terrain = flown_terrain();
    let mut vertex = vec![<ovf_vertex as bytemuck::Zeroable>::zeroed(); 1000];
    let slot = u32::MAX;
    // SAFETY: the buffers are as long as they say.
    let status =
        unsafe { ovf_terrain_vertices(terrain, &raw const slot, 1, vertex.as_mut_ptr(), 1000) };
    assert_eq!(status, OVF_INVALID);
    assert!(last_error().contains("allowed is below"), "{}", last_error());
    let mut eye = sized();
    // SAFETY: the pointer is of a value that outlives the call.
    assert_eq!(unsafe { ovf_terrain_eye(terrain, 1, &raw mut eye) }, OVF_INVALID);
    let mut count = 0;
    // SAFETY: null columns with no room ask for the count.
    must(unsafe { ovf_terrain_patches(terrain, 0, null(), 0, &raw mut count) });
    assert!(count > 0);
    // SAFETY: null columns are refused before they are used.
    let status = unsafe { ovf_terrain_patches(terrain, 0, null(), 9, &raw mut count) };
    assert_eq!(status, OVF_NULL_POINTER);
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn vertices_of_a_scene_that_morphs_have_where_they_begin() {
    let terrain = flown_terrain();
    let limits = limits(terrain);
    let slot = 0;
    let mut morphs = vec![<ovf_morph as bytemuck::Zeroable>::zeroed(); 2000];
    // SAFETY: the buffers are as long as they say.
    let status =
        unsafe { ovf_terrain_morphs(terrain, &raw const slot, 1, morphs.as_mut_ptr(), 2000) };
    assert_eq!(status, if limits.morphs == 1 { OVF_OK } else { OVF_INVALID }, "{}", last_error());
    assert_eq!(limits.morphs == 1, limits.morph_ms > 0);
    must(ovf_terrain_destroy(terrain));
}

//! Whatever is handed over: a status and a sentence, and the terrain flies on as if nothing was.
//!
//! In:    null, NaN, infinities, wrong sizes, unknown constants, texts that are none.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: stale handles (`handles`), short buffers (`columns`).

use super::calls::*;
use overfly_c::columns::*;
use overfly_c::frame::*;
use overfly_c::ground::*;
use overfly_c::host::*;
use overfly_c::queries::*;
use overfly_c::rays::*;
use overfly_c::recording::*;
use overfly_c::regions::*;
use overfly_c::scene::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ptr::{null, null_mut};

const BAD: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// Asserts how a call ended, and that its sentence names what was wrong.
#[track_caller]
fn ends(status: ovf_status, wanted: ovf_status, says: &str) {
    assert_eq!(status, wanted, "{}", last_error());
    let said = last_error();
    assert!(said.contains(says), "`{said}` does not say `{says}`");
    assert!(!said.ends_with('.') && !said.contains('\n') || wanted == OVF_SCENE, "{said}");
}

#[test]
fn null_is_answered_by_every_function() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 2);
    let ground = ground_of(terrain);
    let query: ovf_query = sized();
    let q = &raw const query;
    let at = [1000.0, 0.0, 0.0];
    let p = at.as_ptr();
    let region: ovf_region = sized();
    let r = &raw const region;
    // SAFETY: what is not null is good; null is what is tested.
    let statuses = unsafe {
        [
            ovf_terrain_new_v1(null(), null(), &mut ovf_terrain { bits: 0 }),
            ovf_terrain_new_v1(null(), null(), null_mut()),
            ovf_terrain_work(terrain, null_mut()),
            ovf_terrain_frame(terrain, null(), null_mut()),
            ovf_terrain_last_frame(terrain, null_mut()),
            ovf_terrain_limits(terrain, null_mut()),
            ovf_terrain_indices(terrain, null_mut(), 9, &mut 0),
            ovf_terrain_indices(terrain, null_mut(), 0, null_mut()),
            ovf_terrain_built(terrain, null_mut(), 0, null_mut()),
            ovf_terrain_vertices(terrain, null(), 3, null_mut(), 0),
            ovf_terrain_vertices(terrain, &0, 1, null_mut(), 1000),
            ovf_terrain_morphs(terrain, null(), 3, null_mut(), 1000),
            ovf_terrain_ranges(terrain, 0, null_mut(), 0, null_mut()),
            ovf_terrain_patches(terrain, 0, null(), 0, null_mut()),
            ovf_terrain_eye(terrain, 0, null_mut()),
            ovf_terrain_wanted(terrain, null_mut(), 0, null_mut()),
            ovf_terrain_fault(terrain, 0, null_mut(), null_mut(), 0, &mut 0),
            ovf_terrain_fault(terrain, 0, &mut 0, null_mut(), 0, null_mut()),
            ovf_terrain_scene_text(terrain, null_mut(), 0, null_mut()),
            ovf_terrain_ground(terrain, null_mut()),
            ovf_ground_to_geodetic(ground, null(), &mut 0.0, &mut 0.0, &mut 0.0),
            ovf_ground_to_geodetic(ground, p, &mut 0.0, null_mut(), &mut 0.0),
            ovf_ground_to_ecef(ground, 0.0, 0.0, 0.0, null_mut()),
            ovf_ground_height(ground, 0.0, 0.0, null(), &mut sized()),
            ovf_ground_height(ground, 0.0, 0.0, q, null_mut()),
            ovf_ground_heights(ground, null(), 0, q, &sized()),
            ovf_ground_heights(ground, &sized(), 1, q, &sized()),
            ovf_ground_heights(ground, &sized(), 0, q, null()),
            ovf_ground_contact(ground, null(), q, &mut sized()),
            ovf_ground_contact(ground, p, null(), &mut sized()),
            ovf_ground_contact(ground, p, q, null_mut()),
            ovf_ground_ray(ground, null(), p, 1.0, q, &mut sized()),
            ovf_ground_ray(ground, p, null(), 1.0, q, &mut sized()),
            ovf_ground_ray(ground, p, p, 1.0, q, null_mut()),
            ovf_ground_line_of_sight(ground, null(), p, 0, q, &mut sized()),
            ovf_ground_line_of_sight(ground, p, p, 0, q, null_mut()),
            ovf_terrain_request(terrain, null(), 12, &mut 0),
            ovf_terrain_request(terrain, r, 12, null_mut()),
            ovf_terrain_readiness(terrain, null(), 12, &mut sized()),
            ovf_ground_readiness(ground, r, 12, null_mut()),
            ovf_ground_min_max(ground, null(), &mut sized()),
            ovf_terrain_record(terrain, null(), c"a".as_ptr(), 60.0),
            ovf_terrain_record(terrain, c"a".as_ptr(), null(), 60.0),
            ovf_terrain_finish_recording(terrain, null_mut()),
        ]
    };
    for (index, status) in statuses.into_iter().enumerate() {
        assert_eq!(status, OVF_NULL_POINTER, "call {index}");
    }
    assert_eq!(last_error(), "frames is null");
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn wrong_sizes_are_refused_and_nothing_is_written() {
    let terrain = open_small(Some(&waiting()));
    let most = u32::try_from(size_of::<ovf_frame>()).unwrap();
    for struct_size in [0, 3, 4, 8, most - 8, most - 1, most + 1, most + 8, u32::MAX] {
        let mut frame = ovf_frame { struct_size, digest: 77, ..sized() };
        let input = sized();
        // SAFETY: both structs are whole, whatever they say.
        let status = unsafe { ovf_terrain_frame(terrain, &raw const input, &raw mut frame) };
        ends(status, OVF_STRUCT_SIZE, "sizeof(ovf_frame)");
        assert_eq!((frame.struct_size, frame.digest), (struct_size, 77));
        let input = ovf_frame_input { struct_size, ..sized() };
        // SAFETY: as above.
        let status = unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) };
        ends(status, OVF_STRUCT_SIZE, "sizeof(ovf_frame_input)");
    }
    let views = [look(0), ovf_view { struct_size: 8, ..look(0) }];
    let input = ovf_frame_input { view_count: 2, views: views.as_ptr(), ..sized() };
    // SAFETY: as above.
    let status = unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) };
    ends(status, OVF_STRUCT_SIZE, "views: struct_size is 8");
    let scene = ovf_scene { struct_size: 1, preset: c"small".as_ptr(), ..sized() };
    ends(open(&scene, None).unwrap_err(), OVF_STRUCT_SIZE, "sizeof(ovf_scene)");
    let host = ovf_host { struct_size: 0, ..sized() };
    let scene = ovf_scene { struct_size: 32, ..scene };
    ends(open(&scene, Some(&host)).unwrap_err(), OVF_STRUCT_SIZE, "sizeof(ovf_host)");
    assert_eq!(flown(terrain, 10), numbers_in_rust(10), "what was refused left no trace");
    must(ovf_terrain_destroy(terrain));
}

/// A change that makes a good view bad, and what shall be said of it.
type Spoil = (fn(&mut ovf_view, f64), &'static str);

#[test]
fn views_that_cannot_be_are_refused_and_leave_no_trace() {
    let terrain = open_small(Some(&waiting()));
    let frame = |view: ovf_view| {
        let input = ovf_frame_input { view_count: 1, views: &raw const view, ..sized() };
        // SAFETY: all pointers are of values that outlive the call.
        unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) }
    };
    let spoils: [Spoil; 7] = [
        (|view, bad| view.eye_lat_rad = bad, "latitude"),
        (|view, bad| view.eye_lon_rad = bad, "longitude"),
        (|view, bad| view.eye_height_m = bad, "height"),
        (|view, bad| view.yaw_rad = bad, "orientation"),
        (|view, bad| view.pitch_rad = bad, "orientation"),
        (|view, bad| view.field_of_view_rad = bad, "field of view"),
        (|view, bad| view.near_m = bad, "near"),
    ];
    for (spoil, says) in spoils {
        for bad in BAD {
            let mut view = look(0);
            spoil(&mut view, bad);
            ends(frame(view), OVF_INVALID, says);
        }
    }
    let ecef = |eye_ecef_m, camera_to_ecef_xyzw| ovf_view {
        eye: OVF_EYE_ECEF,
        attitude: OVF_ATTITUDE_QUATERNION,
        eye_ecef_m,
        camera_to_ecef_xyzw,
        ..look(0)
    };
    for bad in BAD.into_iter().chain([f64::MAX]) {
        ends(frame(ecef([bad, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])), OVF_INVALID, "eye");
        let angles = ovf_view { eye: OVF_EYE_ECEF, eye_ecef_m: [bad; 3], ..look(0) };
        ends(frame(angles), OVF_INVALID, "view");
    }
    ends(frame(ecef([2000.0, 0.0, 0.0], [0.0; 4])), OVF_INVALID, "zero quaternion");
    ends(frame(ovf_view { eye: 2, ..look(0) }), OVF_INVALID, "eye is 2");
    ends(frame(ovf_view { attitude: 9, ..look(0) }), OVF_INVALID, "attitude is 9");
    ends(frame(ovf_view { width_px: 0, ..look(0) }), OVF_INVALID, "0 by 360 pixels");
    for (input, says) in [
        (ovf_frame_input { view_count: 65, ..sized() }, "view_count is 65"),
        (ovf_frame_input { hold_lod: 2, ..sized() }, "hold_lod is 2"),
        (ovf_frame_input { time_s: f64::NAN, ..sized() }, "time_s is NaN"),
    ] {
        // SAFETY: as above.
        let status = unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) };
        ends(status, OVF_INVALID, says);
    }
    assert_eq!(flown(terrain, 10), numbers_in_rust(10));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn edits_that_cannot_be_are_refused_and_leave_no_trace() {
    let terrain = open_small(Some(&waiting()));
    let scene = ovf_scene { preset: c"earth".as_ptr(), ..sized() };
    let edit = |edit: ovf_edit| {
        let input = ovf_frame_input { edit: &raw const edit, ..sized() };
        // SAFETY: all pointers are of values that outlive the call.
        unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) }
    };
    let whole = |scene: *const ovf_scene| ovf_edit { changes: OVF_EDIT_SCENE, scene, ..sized() };
    ends(edit(ovf_edit { changes: 8, ..sized() }), OVF_INVALID, "changes is 0x8");
    ends(edit(whole(null())), OVF_NULL_POINTER, "scene is null");
    ends(edit(whole(&raw const scene)), OVF_SCENE, "body cannot change");
    let sun = |sun, first| ovf_edit {
        changes: OVF_EDIT_SUN,
        sun,
        sun_start_unix_s: f64::NAN,
        sun_direction_ecef: [first, 0.0, 0.0],
        ..sized()
    };
    ends(edit(sun(4, 1.0)), OVF_INVALID, "sun is 4");
    ends(edit(sun(OVF_SUN_CLOCK, 1.0)), OVF_INVALID, "sun_start_unix_s is NaN");
    for bad in BAD.into_iter().chain([0.0]) {
        ends(edit(sun(OVF_SUN_FIXED, bad)), OVF_INVALID, "sun_direction_ecef");
    }
    let sea = ovf_edit { changes: OVF_EDIT_SEA, sea: 2, ..sized() };
    ends(edit(sea), OVF_INVALID, "sea is 2");
    assert_eq!(flown(terrain, 10), numbers_in_rust(10));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn scenes_and_hosts_that_cannot_be_are_refused() {
    let scene = |change: fn(&mut ovf_scene)| {
        let mut scene = sized();
        change(&mut scene);
        open(&scene, None).unwrap_err()
    };
    ends(scene(|_| {}), OVF_INVALID, "0 of preset, path and text are given");
    let two = scene(|it| (it.preset, it.text) = (c"small".as_ptr(), c"Scene()".as_ptr()));
    ends(two, OVF_INVALID, "2 of preset");
    ends(scene(|it| it.preset = c"mars".as_ptr()), OVF_SCENE, "allowed are earth, moon, small");
    ends(scene(|it| it.path = c"small".as_ptr()), OVF_SCENE, "./small");
    ends(scene(|it| it.path = c"/no/such.ron".as_ptr()), OVF_SCENE, "/no/such.ron");
    ends(scene(|it| it.text = c"Scene(".as_ptr()), OVF_SCENE, "text");
    ends(scene(|it| it.text = c"\xff\xfe".as_ptr()), OVF_INVALID, "text is not UTF-8");
    let host = |change: fn(&mut ovf_host)| {
        let mut host = sized();
        change(&mut host);
        open(&ovf_scene { preset: c"small".as_ptr(), ..sized() }, Some(&host)).unwrap_err()
    };
    ends(host(|it| it.workers = 4), OVF_INVALID, "workers is 4");
    ends(host(|it| it.pages = 3), OVF_INVALID, "pages is 3");
    ends(host(|it| it.worker_count = 65), OVF_INVALID, "worker_count is 65");
    ends(host(|it| it.loader_threads = 65), OVF_INVALID, "loader_threads is 65");
    ends(host(|it| it.workers = OVF_WORKERS_SPAWNED), OVF_INVALID, "spawn is null");
}

#[test]
fn questions_that_are_none_are_refused() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 2);
    let ground = ground_of(terrain);
    let best = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let q = &raw const best;
    let good = [2000.0, 0.0, 0.0];
    for bad in BAD {
        let at = [0.0, bad, 0.0];
        let (p, g) = (at.as_ptr(), good.as_ptr());
        // SAFETY: all pointers are of values that outlive the call; so in all calls below.
        unsafe {
            ends(ovf_ground_height(ground, bad, 0.0, q, &mut sized()), OVF_INVALID, "latitude");
            ends(ovf_ground_height(ground, 0.0, bad, q, &mut sized()), OVF_INVALID, "longitude");
            ends(ovf_ground_contact(ground, p, q, &mut sized()), OVF_INVALID, "point_ecef_m");
            ends(ovf_ground_ray(ground, p, g, 1.0, q, &mut sized()), OVF_INVALID, "origin");
            ends(ovf_ground_ray(ground, g, p, 1.0, q, &mut sized()), OVF_INVALID, "direction");
            let sight = ovf_ground_line_of_sight(ground, g, p, 0, q, &mut sized());
            ends(sight, OVF_INVALID, "to_ecef_m");
            ends(
                ovf_ground_to_ecef(ground, 0.0, 0.0, bad, [0.0; 3].as_mut_ptr()),
                OVF_INVALID,
                "height",
            );
            let back = ovf_ground_to_geodetic(ground, p, &mut 0.0, &mut 0.0, &mut 0.0);
            ends(back, OVF_INVALID, "point_ecef_m");
            let region = ovf_region { radius_m: bad, ..sized() };
            let min_max = ovf_ground_min_max(ground, &raw const region, &mut sized());
            ends(min_max, OVF_INVALID, "radius_m");
            let region = ovf_region { centre_lat_rad: bad, ..sized() };
            let ticket = ovf_terrain_request(terrain, &raw const region, 12, &mut 0);
            ends(ticket, OVF_INVALID, "region: centre: latitude");
            let recording = ovf_terrain_record(terrain, c"a".as_ptr(), c"a".as_ptr(), bad);
            ends(recording, OVF_INVALID, "rate_hz");
        }
    }
    let query = |query: ovf_query| {
        // SAFETY: as above.
        unsafe { ovf_ground_height(ground, 0.0, 0.0, &raw const query, &mut sized()) }
    };
    ends(query(ovf_query { kind: 3, ..sized() }), OVF_INVALID, "kind is 3");
    ends(query(ovf_query { level: 57, ..sized() }), OVF_INVALID, "level is 57");
    let within = |bound_max_m| ovf_query { kind: OVF_QUERY_WITHIN, bound_max_m, ..sized() };
    ends(query(within(f64::NAN)), OVF_INVALID, "bound_max_m is NaN");
    ends(query(within(-1.0)), OVF_INVALID, "bound_max_m is -1");
    let (g, zero, region) = (good.as_ptr(), [0.0; 3], sized());
    // SAFETY: as above.
    unsafe {
        ends(
            ovf_ground_ray(ground, g, zero.as_ptr(), 1.0, q, &mut sized()),
            OVF_INVALID,
            "direction",
        );
        ends(ovf_ground_ray(ground, g, g, f64::NAN, q, &mut sized()), OVF_INVALID, "max_m is NaN");
        let sight = ovf_ground_line_of_sight(ground, g, g, 2, q, &mut sized());
        ends(sight, OVF_INVALID, "refraction is 2");
        let level = ovf_terrain_readiness(terrain, &raw const region, 57, &mut sized());
        ends(level, OVF_INVALID, "level is 57");
        let big = ovf_region { radius_m: 1e4, ..region };
        let ticket = ovf_terrain_request(terrain, &raw const big, 40, &mut 0);
        assert!([OVF_INVALID, OVF_FULL].contains(&ticket), "{}", last_error());
        let late = ovf_terrain_record(terrain, c"late.ovf".as_ptr(), c"late".as_ptr(), 60.0);
        ends(late, OVF_RECORDING, "2 frames were run");
    }
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn counts_and_places_in_memory_that_cannot_be_are_refused() {
    let terrain = open_small(Some(&waiting()));
    let ground = ground_of(terrain);
    let numbers = [0.0; 8];
    let start = numbers.as_ptr();
    let query = sized();
    let heights = |places: ovf_places, count| {
        // SAFETY: what is refused is not read.
        unsafe { ovf_ground_heights(ground, &raw const places, count, &raw const query, &sized()) }
    };
    let places = ovf_places { lat_rad: start, lon_rad: start, ..sized() };
    ends(heights(places, u64::MAX), OVF_INVALID, "elements, allowed are at most");
    let odd = start.wrapping_byte_add(1);
    let crooked = ovf_places { lat_rad: odd, ..places };
    ends(heights(crooked, 2), OVF_NULL_POINTER, "not aligned to 8 bytes");
    let both = ovf_places { lat_deg: start, ..places };
    ends(heights(both, 2), OVF_INVALID, "both radians and degrees");
    must(heights(places, 8));
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn each_thread_has_its_own_last_sentence() {
    assert_eq!(ovf_terrain_destroy(ovf_terrain { bits: 5 }), OVF_STALE);
    let here = last_error();
    let there = std::thread::spawn(|| {
        let first = last_error();
        assert_eq!(ovf_ground_destroy(ovf_ground { bits: 0 }), OVF_STALE);
        (first, last_error())
    });
    let (first, then) = there.join().unwrap();
    assert_eq!((first.as_str(), then.as_str()), ("", "the ground's handle is 0, which names none"));
    assert_eq!(last_error(), here);
    assert_eq!(overfly_c::version::ovf_version(), 0x100, "0.1.0");
}

//! Handles that were destroyed, twice or at once, are of another kind or were never given out.
//!
//! In:    terrains and snapshots, several threads.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: pointers (`junk`).

use super::calls::*;
use overfly_c::columns::ovf_terrain_limits;
use overfly_c::frame::ovf_terrain_frame;
use overfly_c::ground::*;
use overfly_c::queries::*;
use overfly_c::regions::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

#[test]
fn a_terrain_is_destroyed_once_and_then_stale_everywhere() {
    let terrain = open_small(None);
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_terrain_destroy(terrain), OVF_STALE);
    assert!(last_error().contains("was destroyed, or never was"), "{}", last_error());
    let input = sized();
    // SAFETY: the pointer is of a value that outlives the call.
    let status = unsafe { ovf_terrain_frame(terrain, &raw const input, std::ptr::null_mut()) };
    assert_eq!(status, OVF_STALE);
    let mut helped = 0;
    // SAFETY: as above.
    assert_eq!(unsafe { ovf_terrain_work(terrain, &raw mut helped) }, OVF_STALE);
    let next = open_small(None);
    assert_ne!(next, terrain, "a number never comes twice");
    must(ovf_terrain_destroy(next));
}

#[test]
fn a_number_of_another_kind_or_none_is_refused() {
    let terrain = open_small(None);
    let ground = ground_of(terrain);
    for bits in [0, 1, u64::MAX, ground.bits, terrain.bits + 1, terrain.bits ^ 1 << 30] {
        assert_eq!(ovf_terrain_destroy(ovf_terrain { bits }), OVF_STALE, "{bits:#x}");
    }
    for bits in [0, 1, u64::MAX, terrain.bits, ground.bits ^ 1 << 30] {
        assert_eq!(ovf_ground_destroy(ovf_ground { bits }), OVF_STALE, "{bits:#x}");
    }
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_terrain_release(terrain, 0), OVF_STALE);
}

#[test]
fn a_snapshot_outlives_its_terrain_and_goes_under_threads_that_ask() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 5);
    let query = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let ask = |ground: ovf_ground| {
        let mut height = sized::<ovf_height>();
        // SAFETY: all pointers are of values that outlive the call.
        let status =
            unsafe { ovf_ground_height(ground, 0.25, 0.3, &raw const query, &raw mut height) };
        (status, height.height_m.to_bits())
    };
    let first = ground_of(terrain);
    let expected = ask(first);
    must(ovf_ground_destroy(first));
    let (current, stops) = (AtomicU64::new(0), AtomicBool::new(false));
    let answers = AtomicU64::new(0);
    let destroyed = AtomicU64::new(0);
    let ask_and_destroy = || {
        while !stops.load(Ordering::Relaxed) {
            let ground = ovf_ground { bits: current.load(Ordering::Relaxed) };
            let (status, bits) = ask(ground);
            assert!([OVF_OK, OVF_STALE].contains(&status), "{}", last_error());
            if status == OVF_OK {
                assert_eq!(bits, expected.1);
                answers.fetch_add(1, Ordering::Relaxed);
                // Another thread may have been faster: once in all it works.
                let gone = ovf_ground_destroy(ground);
                destroyed.fetch_add(u64::from(gone == OVF_OK), Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        (0..3).for_each(|_| drop(scope.spawn(ask_and_destroy)));
        let mut given = 0;
        while given < 300 || answers.load(Ordering::Relaxed) < 100 {
            current.store(ground_of(terrain).bits, Ordering::Relaxed);
            given += 1;
            while destroyed.load(Ordering::Relaxed) < given {
                std::thread::yield_now();
            }
        }
        stops.store(true, Ordering::Relaxed);
    });
    let last = ground_of(terrain);
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ask(last), expected);
    must(ovf_ground_destroy(last));
}

#[test]
fn calls_on_one_terrain_at_once_end_as_busy_and_disturb_nothing() {
    let terrain = open_small(Some(&waiting()));
    let stops = AtomicBool::new(false);
    let busy = AtomicU64::new(0);
    let ask = || {
        while !stops.load(Ordering::Relaxed) {
            let mut limits = sized();
            // SAFETY: the pointer is of a value that outlives the call.
            let status = unsafe { ovf_terrain_limits(terrain, &raw mut limits) };
            assert!([OVF_OK, OVF_BUSY].contains(&status), "{}", last_error());
            busy.fetch_add(u64::from(status == OVF_BUSY), Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        (0..2).for_each(|_| drop(scope.spawn(ask)));
        let mut frame = 0;
        while frame < 20 || busy.load(Ordering::Relaxed) == 0 {
            let view = look(frame);
            let input = overfly_c::frame::ovf_frame_input {
                view_count: 1,
                views: &raw const view,
                time_s: frame as f64 / 60.0,
                ..sized()
            };
            // SAFETY: all pointers are of values that outlive the call.
            let status =
                unsafe { ovf_terrain_frame(terrain, &raw const input, std::ptr::null_mut()) };
            assert!([OVF_OK, OVF_BUSY].contains(&status), "{}", last_error());
            frame += usize::from(status == OVF_OK);
        }
        stops.store(true, Ordering::Relaxed);
    });
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn threads_that_destroy_one_terrain_succeed_once_in_all() {
    for _ in 0..5 {
        let terrain = open_small(Some(&waiting()));
        flown(terrain, 2);
        let done = AtomicU64::new(0);
        let destroy = || {
            let status = ovf_terrain_destroy(terrain);
            assert!([OVF_OK, OVF_STALE, OVF_BUSY].contains(&status));
            done.fetch_add(u64::from(status == OVF_OK), Ordering::Relaxed);
        };
        std::thread::scope(|scope| (0..3).for_each(|_| drop(scope.spawn(destroy))));
        assert_eq!(done.into_inner(), 1);
    }
}

#[test]
fn requested_ground_comes_and_is_given_back_once() {
    let terrain = open_small(Some(&waiting()));
    let region = ovf_region { centre_lat_rad: 0.3, centre_lon_rad: 1.0, radius_m: 20.0, ..sized() };
    let mut ticket = 0;
    // SAFETY: all pointers are of values that outlive the call.
    must(unsafe { ovf_terrain_request(terrain, &raw const region, 18, &raw mut ticket) });
    let mut readiness = sized::<ovf_readiness>();
    while readiness.fraction < 1.0 {
        std::thread::yield_now();
        // SAFETY: as above.
        must(unsafe { ovf_terrain_readiness(terrain, &raw const region, 18, &raw mut readiness) });
    }
    assert_eq!((readiness.missing, readiness.has_level, readiness.worst_level), (0, 1, 18));
    let ground = ground_of(terrain);
    let query = ovf_query { kind: OVF_QUERY_EXACT, level: 18, ..sized() };
    let mut height = sized::<ovf_height>();
    // SAFETY: as above.
    must(unsafe { ovf_ground_height(ground, 0.3, 1.0, &raw const query, &raw mut height) });
    assert_eq!((height.answer, height.level), (OVF_ANSWER_OK, 18));
    let mut bounds = sized::<ovf_min_max>();
    // SAFETY: as above.
    must(unsafe { ovf_ground_min_max(ground, &raw const region, &raw mut bounds) });
    assert!(bounds.low_m <= height.height_m && height.height_m <= bounds.high_m);
    must(ovf_terrain_release(terrain, ticket));
    assert_eq!(ovf_terrain_release(terrain, ticket), OVF_STALE);
    // SAFETY: as above.
    must(unsafe { ovf_ground_readiness(ground, &raw const region, 18, &raw mut readiness) });
    assert_eq!(readiness.missing, 0, "the snapshot keeps what it has");
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

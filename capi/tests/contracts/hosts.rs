//! What a host brings through the C border: threads, a scheduler, pages, reads of its own.
//!
//! In:    C functions of a made-up host.
//! Out:   test results.
//! Keeps: an archive in a folder that is thrown away.
//! Not here: how frames share work (`overfly_jobs`).

#[path = "../../../tests/contracts/hills.rs"]
#[expect(dead_code, reason = "the façade's own tests use the rest")]
mod hills;

use super::calls::*;
use hills::Hills;
use overfly_c::columns::{ovf_terrain_fault, ovf_terrain_wanted};
use overfly_c::ground::ovf_ground_destroy;
use overfly_c::host::*;
use overfly_c::queries::*;
use overfly_c::scene::ovf_scene;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

/// A scheduler with one thread, and how often it was called.
#[derive(Default)]
struct Scheduler {
    terrain: AtomicU64,
    waiting: Mutex<Vec<u64>>,
    spawned: AtomicU64,
    finished: AtomicU64,
    stops: AtomicBool,
}

unsafe extern "C" fn spawn(user: *mut c_void, task: u64) -> u64 {
    // SAFETY: the test hands its scheduler over, which outlives the terrain.
    let scheduler = unsafe { &*user.cast::<Scheduler>() };
    scheduler.waiting.lock().unwrap().push(task);
    scheduler.spawned.fetch_add(1, Ordering::Relaxed) + 1
}

unsafe extern "C" fn finish(user: *mut c_void, spawned: u64) {
    assert!(spawned > 0);
    // SAFETY: as above.
    let scheduler = unsafe { &*user.cast::<Scheduler>() };
    scheduler.finished.fetch_add(1, Ordering::Relaxed);
}

#[test]
fn tasks_run_in_the_hosts_scheduler_late_twice_or_never() {
    let mut scheduler = Scheduler::default();
    let host = ovf_host {
        workers: OVF_WORKERS_SPAWNED,
        worker_count: 2,
        user: (&raw mut scheduler).cast(),
        spawn: Some(spawn),
        finish: Some(finish),
        ..waiting()
    };
    let terrain = open_small(Some(&host));
    scheduler.terrain.store(terrain.bits, Ordering::Relaxed);
    let shared = &scheduler;
    let run = || {
        while !shared.stops.load(Ordering::Relaxed) {
            let task = shared.waiting.lock().unwrap().pop();
            if let Some(task) = task {
                must(ovf_terrain_run_task(terrain, task));
                must(ovf_terrain_run_task(terrain, task));
            }
            std::thread::yield_now();
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(run);
        assert_eq!(flown(terrain, 40), numbers_in_rust(40));
        shared.stops.store(true, Ordering::Relaxed);
    });
    assert!(scheduler.spawned.load(Ordering::Relaxed) >= 80);
    let [spawned, finished] = [&scheduler.spawned, &scheduler.finished];
    assert_eq!(spawned.load(Ordering::Relaxed), finished.load(Ordering::Relaxed));
    must(ovf_terrain_run_task(terrain, u64::MAX));
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_terrain_run_task(terrain, 1), OVF_STALE);
}

#[test]
fn threads_of_the_host_help_when_they_have_time() {
    let host = ovf_host { workers: OVF_WORKERS_LENT, worker_count: 2, ..waiting() };
    let terrain = open_small(Some(&host));
    let (stops, helps) = (AtomicBool::new(false), AtomicU64::new(0));
    let work = || {
        while !stops.load(Ordering::Relaxed) {
            let mut helped = 7;
            // SAFETY: the pointer is of a value that outlives the call.
            must(unsafe { ovf_terrain_work(terrain, &raw mut helped) });
            helps.fetch_add(u64::from(helped), Ordering::Relaxed);
            std::thread::yield_now();
        }
    };
    std::thread::scope(|scope| {
        (0..3).for_each(|_| drop(scope.spawn(work)));
        assert_eq!(flown(terrain, 40), numbers_in_rust(40));
        while helps.load(Ordering::Relaxed) == 0 {
            fly(terrain, 39, None);
        }
        stops.store(true, Ordering::Relaxed);
    });
    must(ovf_terrain_destroy(terrain));
}

fn wanted(terrain: ovf_terrain) -> Vec<u64> {
    let mut keys = vec![0; 4096];
    let mut count = 0;
    // SAFETY: the buffer is as long as it says.
    must(unsafe { ovf_terrain_wanted(terrain, keys.as_mut_ptr(), 4096, &raw mut count) });
    keys.truncate(usize::try_from(count).unwrap());
    keys
}

#[test]
fn pages_that_the_hosts_threads_make_are_those_that_overfly_would() {
    let host = ovf_host { pages: OVF_PAGES_HOST, ..sized() };
    let terrain = open_small(Some(&host));
    let mut digests = Vec::new();
    for frame in 0..40 {
        digests.push(fly(terrain, frame, None).digest);
        for key in wanted(terrain) {
            must(ovf_terrain_load_page(terrain, key));
        }
    }
    assert_eq!(digests, numbers_in_rust(40));
    assert_eq!(ovf_terrain_load_page(terrain, u64::MAX), OVF_INVALID);
    assert!(last_error().contains("names no page"), "{}", last_error());
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_terrain_load_page(terrain, 0), OVF_STALE);
}

/// An archive in memory of the host, and what its reads end in instead where that is not 0.
struct Pack {
    bytes: Vec<u8>,
    reads: AtomicU64,
    fails: AtomicI64,
}

unsafe extern "C" fn read(
    user: *mut c_void,
    location: *const c_char,
    offset: u64,
    length: u64,
    buffer: *mut u8,
) -> i64 {
    // SAFETY: the test hands its pack over, which outlives the terrain.
    let pack = unsafe { &*user.cast::<Pack>() };
    // SAFETY: it ends with a NUL.
    assert_eq!(unsafe { CStr::from_ptr(location) }, c"pack:/hills");
    pack.reads.fetch_add(1, Ordering::Relaxed);
    let fails = pack.fails.load(Ordering::Relaxed);
    if fails != 0 {
        return fails;
    }
    let from = usize::try_from(offset).unwrap().min(pack.bytes.len());
    let count = usize::try_from(length).unwrap().min(pack.bytes.len() - from);
    // SAFETY: the buffer has room for `length` bytes, and `count` is no more.
    unsafe { pack.bytes[from..].as_ptr().copy_to_nonoverlapping(buffer, count) };
    i64::try_from(count).unwrap()
}

/// Heights of a strip across the hills.
fn strip(terrain: ovf_terrain) -> Vec<f64> {
    let ground = ground_of(terrain);
    let places: Vec<f64> = (1..50).map(|i| f64::from(i) * 0.02).collect();
    let mut heights = vec![0.0; places.len()];
    let at = ovf_places { lat_rad: places.as_ptr(), lon_rad: places.as_ptr(), ..sized() };
    let columns = ovf_height_columns { height_m: heights.as_mut_ptr(), ..sized() };
    let query = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let count = places.len() as u64;
    // SAFETY: all arrays have as many places.
    must(unsafe {
        ovf_ground_heights(ground, &raw const at, count, &raw const query, &raw const columns)
    });
    must(ovf_ground_destroy(ground));
    heights
}

#[test]
fn archives_that_the_host_reads_give_the_ground_that_files_give() {
    let hills = Hills::new();
    let path = CString::new(hills.scene_name()).unwrap();
    let filed = open(&ovf_scene { path: path.as_ptr(), ..sized() }, Some(&waiting())).unwrap();
    let digests = flown(filed, 20);
    let heights = strip(filed);
    must(ovf_terrain_destroy(filed));

    let bytes = std::fs::read(hills.archive()).unwrap();
    let mut pack = Pack { bytes, reads: AtomicU64::new(0), fails: AtomicI64::new(0) };
    let host = ovf_host { user: (&raw mut pack).cast(), read: Some(read), ..waiting() };
    let text = std::fs::read_to_string(hills.scene()).unwrap();
    let text = text.replace("hills.pmtiles", "pack:/hills");
    let packed = open_text(&text, Some(&host)).unwrap_or_else(|_| panic!("{}", last_error()));
    assert_eq!(flown(packed, 20), digests);
    assert_eq!(strip(packed), heights);
    assert!(heights.iter().all(|height| height.is_finite()));
    assert!(pack.reads.load(Ordering::Relaxed) > 10);
    must(ovf_terrain_destroy(packed));
}

#[test]
fn reads_that_fail_are_named_and_leave_the_ground_coarser() {
    let hills = Hills::new();
    let bytes = std::fs::read(hills.archive()).unwrap();
    let mut pack = Pack { bytes, reads: AtomicU64::new(0), fails: AtomicI64::new(-5) };
    let host = ovf_host { user: (&raw mut pack).cast(), read: Some(read), ..waiting() };
    let text = std::fs::read_to_string(hills.scene()).unwrap();
    let text = text.replace("hills.pmtiles", "pack:/hills");
    assert_eq!(open_text(&text, Some(&host)).unwrap_err(), OVF_SCENE);
    let said = "archive pack:/hills: the host cannot read it: its read function gave -5";
    assert_eq!(last_error(), said);
    pack.fails.store(i64::MAX, Ordering::Relaxed);
    assert_eq!(open_text(&text, Some(&host)).unwrap_err(), OVF_SCENE);
    pack.fails.store(0, Ordering::Relaxed);
    let terrain = open_text(&text, Some(&host)).unwrap();
    pack.fails.store(-5, Ordering::Relaxed);
    fly(terrain, 0, None);
    fly(terrain, 1, None);
    let (mut key, mut count, mut text) = (0, 0, [0; 300]);
    let buffer = text.as_mut_ptr();
    // SAFETY: the buffer is as long as it says.
    must(unsafe { ovf_terrain_fault(terrain, 0, &raw mut key, buffer, 300, &raw mut count) });
    // SAFETY: it was filled with a text and the NUL at its end.
    let text = unsafe { CStr::from_ptr(text.as_ptr()) }.to_str().unwrap();
    assert!(text.ends_with("gave -5"), "{text}");
    must(ovf_terrain_destroy(terrain));
}

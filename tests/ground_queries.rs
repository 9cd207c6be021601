//! Gear contacts at 120 Hz from four threads of a host while frames run: the same bits as alone, and
//! no allocation.
//!
//! In:    the planet `small`, a camera that dives from orbit, a counting allocator.
//! Out:   passes or fails.
//! Keeps: allocations of each thread.
//! Not here: how long a contact takes (`benches/contacts`), other questions (`core/tests`).
//!
//! There is nothing to wait for either: a `Ground` is the body's shape and pages behind `Arc`s, whose
//! counts no query touches; queries take `&self`, and in it lies no lock and no cell.

use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Ellipsoid, Enu, Geodetic};
use overfly::core::ground::{Answer, Contact, Ground, Query, Region};
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};
use parking_lot::Mutex;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::panic::RefUnwindSafe;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends allocates after its locals are gone; nobody asks about that.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is passed on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps this function's contract, which is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // Giving memory back may take a lock as well.
        count();
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

const THREADS: usize = 4;
const AIRCRAFT: usize = 10;
const CONTACTS: usize = 12;
const RATE_HZ: f64 = 120.0;
/// One second.
const STEPS: usize = 120;
const FRAMES: u32 = 90;
/// Samples 1.5 m apart.
const QUERY: Query = Query::Exact(20);
const AERODROME: Region =
    Region { centre: Geodetic { lat_rad: -0.698, lon_rad: -1.047, height_m: 0.0 }, radius_m: 80.0 };

/// Where a wheel is: ten aircraft taxi in all directions, their wheels a few metres around them.
fn wheel(body: &Ellipsoid, aircraft: usize, step: usize, contact: usize) -> Ecef {
    let away_m = 5.0 * aircraft as f64 + 8.0 * step as f64 / RATE_HZ;
    let centre = Geodetic { height_m: 20.0, ..AERODROME.centre };
    let turn = Geodetic::from_degrees(0.0, 36.0 * aircraft as f64, 0.0).normal();
    let around = Geodetic::from_degrees(0.0, 30.0 * contact as f64, 0.0).normal();
    Enu(turn * away_m + around * 3.0).to_ecef(centre, body)
}

fn wheels_of(body: &Ellipsoid, aircraft: usize) -> Vec<Ecef> {
    let steps = (0..STEPS).flat_map(|step| (0..CONTACTS).map(move |contact| (step, contact)));
    steps.map(|(step, contact)| wheel(body, aircraft, step, contact)).collect()
}

/// An overfly with the aerodrome's pages, after as many frames as they took to come.
fn ready() -> Overfly {
    let mut scene = config::load("small").unwrap();
    // So few that pages go while the camera climbs.
    scene.memory.pages_bytes = 8 << 20;
    let host =
        Host { workers: Workers::Own(1), pages: Pages::Waited { threads: 1 }, ..Host::default() };
    let mut overfly = Overfly::new(&scene, host).unwrap();
    let Query::Exact(level) = QUERY else { panic!("a level is asked for") };
    let _ticket = overfly.request(AERODROME, level).unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    while overfly.readiness(AERODROME, level).unwrap().missing > 0 {
        overfly.frame(&mut input, &mut output).unwrap();
        std::thread::yield_now();
    }
    overfly
}

/// A camera above the aerodrome, which it nears from orbit to some 20 m above the ground.
fn dive(overfly: &Overfly, frame: u32) -> View {
    let scene = overfly.scene();
    let near = f64::from(frame) / f64::from(FRAMES);
    let at = Geodetic { height_m: 5000.0 * (1.0 - near) + 30.0 * near, ..AERODROME.centre };
    let down = Radians::from_degrees(-70.0);
    View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, Radians(0.3), down, Radians(0.0)),
        field_of_view: Radians(1.0),
        size_px: [640, 360],
        near_m: 0.1,
    }
}

/// A thread's contacts, again and again with the newest ground, until frames end.
struct Fleet<'a> {
    newest: &'a Mutex<Ground>,
    ends: &'a AtomicBool,
    rounds: &'a AtomicUsize,
}

impl Fleet<'_> {
    /// Answers that were not those of `alone`, and allocations while they were asked for.
    fn fly(&self, asked: &[(Ecef, Answer<Contact>)]) -> (usize, u64) {
        let (mut others, mut allocations) = (0, 0);
        while !self.ends.load(Ordering::Acquire) {
            for step in asked.chunks(CONTACTS) {
                // How a host hands snapshots over is its own affair; here it is a lock and a clone.
                let ground = self.newest.lock().clone();
                let before = ALLOCATIONS.get();
                let is_other = |(wheel, alone): &&(Ecef, _)| ground.agl(*wheel, QUERY) != *alone;
                others += step.iter().filter(is_other).count();
                allocations += ALLOCATIONS.get() - before;
                // Frames need the processor too.
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            self.rounds.fetch_add(1, Ordering::AcqRel);
        }
        (others, allocations)
    }
}

#[test]
fn contacts_from_four_threads_while_frames_run_are_the_same_bits_as_alone() {
    let alone = ready().ground();
    let mut overfly = ready();
    let body = overfly.scene().body;
    let asked = |aircraft| {
        let wheels = wheels_of(&body, aircraft).into_iter();
        wheels.map(|wheel| (wheel, alone.agl(wheel, QUERY))).collect::<Vec<_>>()
    };
    let fleets: Vec<Vec<_>> = (0..THREADS)
        .map(|thread| (thread..AIRCRAFT).step_by(THREADS).flat_map(asked).collect())
        .collect();
    let all: usize = fleets.iter().map(Vec::len).sum();
    assert_eq!(all, AIRCRAFT * CONTACTS * STEPS);
    assert!(fleets.iter().flatten().all(|(_, answer)| matches!(answer, Answer::Ok(_))));

    let newest = Mutex::new(overfly.ground());
    let (ends, rounds) = (AtomicBool::new(false), AtomicUsize::new(0));
    let fleet = Fleet { newest: &newest, ends: &ends, rounds: &rounds };
    let (mut came, mut went) = (0, 0);
    let answers = std::thread::scope(|scope| {
        let fleet = &fleet;
        let threads = fleets.iter().map(|asked| scope.spawn(move || fleet.fly(asked)));
        let threads: Vec<_> = threads.collect();
        let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
        let mut frame = 0;
        // Down and up again, until all threads have come round.
        while frame < 2 * FRAMES || rounds.load(Ordering::Acquire) < 2 * THREADS {
            input.views.push(dive(&overfly, FRAMES - frame.abs_diff(FRAMES).min(FRAMES)));
            overfly.frame(&mut input, &mut output).unwrap();
            input.views.clear();
            (came, went) = (came + output.counts.admitted, went + output.counts.evicted);
            *newest.lock() = overfly.ground();
            frame += 1;
        }
        ends.store(true, Ordering::Release);
        threads.into_iter().map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    println!("{} rounds, {came} pages came, {went} went", rounds.load(Ordering::Acquire));
    assert!(came > 50 && went > 50, "{came} pages came, {went} went while contacts were asked for");
    assert_eq!(answers, vec![(0, 0); THREADS], "other answers than alone, allocations");
}

#[test]
fn allocations_are_seen_by_the_thread_that_makes_them() {
    let before = ALLOCATIONS.get();
    std::thread::scope(|scope| scope.spawn(|| drop(vec![0_u8; 100])).join().unwrap());
    let spawned = ALLOCATIONS.get() - before;
    drop(std::hint::black_box(vec![0_u8; 100]));
    assert_eq!(ALLOCATIONS.get() - before - spawned, 2, "one, and given back");
}

#[test]
fn a_ground_is_for_any_thread_and_holds_no_cell_and_no_lock_of_ours() {
    // What holds a cell, or a lock of parking_lot, the only ones in core, is not `RefUnwindSafe`.
    fn holds_none<T: Send + Sync + Clone + RefUnwindSafe + 'static>() {}
    holds_none::<Ground>();
}

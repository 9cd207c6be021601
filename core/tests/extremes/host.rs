//! Cases 30, 31 and 41: what the host did to the processor, and how many threads there are.
//!
//! In:    control bits set as a host's libraries set them; 1 to 64 workers.
//! Out:   passes or fails; skipped by name where control bits cannot be set.
//! Keeps: nothing: each test of control bits has a thread of its own.
//! Not here: what is computed by (`overfly_jobs::check_arithmetic`).

use crate::rig::view;
use crate::synthetic::Relief;
use crate::world::{EARTH, World, bare, down_on, sphere};
use overfly_core::digest::mix;
use overfly_core::geodesy::Geodetic;
use overfly_jobs::{StartError, Workers, check_arithmetic};
use std::thread;

#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
mod control {
    //! The C library's floating-point environment: its last four bytes are the MXCSR.

    /// `fenv_t` of x86-64.
    #[repr(C, align(8))]
    pub struct Environment {
        x87: [u32; 7],
        mxcsr: u32,
    }

    // SAFETY: both are C99's, without preconditions but that the reference is to a whole `fenv_t`.
    unsafe extern "C" {
        safe fn fegetenv(environment: &mut Environment) -> i32;
        safe fn fesetenv(environment: &Environment) -> i32;
    }

    /// Denormal operands are zero; denormal results are; rounding is up, down, to zero.
    pub const DAZ: u32 = 1 << 6;
    pub const FTZ: u32 = 1 << 15;
    pub const UP: u32 = 2 << 13;
    pub const DOWN: u32 = 1 << 13;
    pub const TO_ZERO: u32 = 3 << 13;

    /// Runs `work` with some bits set.
    pub fn with<T>(bits: u32, work: impl FnOnce() -> T) -> T {
        let mut own = Environment { x87: [0; 7], mxcsr: 0 };
        assert_eq!(fegetenv(&mut own), 0);
        let changed = Environment { x87: own.x87, mxcsr: own.mxcsr | bits };
        assert_eq!(fesetenv(&changed), 0);
        let done = work();
        assert_eq!(fesetenv(&own), 0);
        done
    }
}

/// What `begin` says with some control bits set; the state must be as it was.
#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
fn refused_with(bits: u32) -> String {
    let body = sphere(6.4e6);
    let looking = [down_on(&body, Geodetic::from_degrees(20.0, 30.0, 1e5))];
    let elsewhere = [down_on(&body, Geodetic::from_degrees(-20.0, 30.0, 1e5))];
    let mut world = World::synthetic(&bare(body, 4, 30_000), Relief::Flat { height_m: 1e-40 });
    let before = world.settled(&looking);
    world.input.views = elsewhere.to_vec();
    let (terrain, input) = (&world.terrain, &mut world.input);
    let fault = control::with(bits, || terrain.begin(input).unwrap_err());
    assert_eq!(world.input.views, elsewhere, "nothing was taken");
    world.frame(&looking);
    assert_eq!(world.output.digest, before);
    let started = control::with(bits, || Workers::new(2).map(drop).unwrap_err());
    assert!(matches!(started, StartError::Arithmetic(_)), "{started}");
    assert!(started.to_string().ends_with(&fault.to_string()), "{started}");
    assert_eq!(check_arithmetic(), Ok(()));
    fault.to_string()
}

#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
#[test]
fn case_30_threads_that_flush_denormals_are_refused_by_cause() {
    let words = |bits| thread::spawn(move || refused_with(bits)).join().unwrap();
    assert!(words(control::FTZ).contains("flushes denormal results to zero (FTZ)"));
    assert!(words(control::DAZ).contains("reads denormal numbers as zero (DAZ)"));
    assert!(words(control::FTZ | control::DAZ).contains("(DAZ), allowed is IEEE 754"));
}

#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
#[test]
fn case_31_threads_that_round_otherwise_are_refused_by_cause() {
    let words = |bits| thread::spawn(move || refused_with(bits)).join().unwrap();
    for (bits, way) in
        [(control::UP, "upward"), (control::DOWN, "downward"), (control::TO_ZERO, "toward zero")]
    {
        let expected = format!("this thread rounds {way}, allowed is rounding to nearest");
        assert_eq!(words(bits), expected);
    }
}

/// A thread that a host lends and that would compute other bits does not help.
#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
#[test]
fn case_30_lent_threads_that_flush_denormals_are_sent_away() {
    let options = overfly_jobs::WorkerOptions { seats: 2, ..Default::default() };
    let workers = Workers::with(options).unwrap();
    let _frame = workers.frame();
    let lent = |bits| {
        thread::scope(|scope| {
            scope.spawn(|| control::with(bits, || workers.join_as_worker())).join().unwrap()
        })
    };
    assert!(!lent(control::FTZ) && !lent(control::UP));
}

#[cfg(not(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64")))]
#[test]
fn case_30_and_31_control_bits_cannot_be_set_here() {
    println!("case_30 and case_31 skipped: control bits are set on x86-64 with glibc only");
    assert_eq!(check_arithmetic(), Ok(()));
}

#[test]
fn case_41_one_to_64_threads_make_the_same_bits() {
    let mut settings = bare(EARTH, 4, 60_000);
    settings.lod.morph_s = 0.5;
    let digests = [0, 1, 2, 3, 7, 64].map(|workers| {
        let noise = Relief::Noise { most_m: 500.0 };
        let mut world = World::with_workers(&settings, noise, workers);
        let mut sum = 0_u64;
        for step in 0..40 {
            let at = Geodetic::from_degrees(0.01 * f64::from(step), 77.0, 2_500.0);
            world.input.time_s = f64::from(step) / 60.0;
            world.frame(&[view(&EARTH, at, 3.0 * f64::from(step), -8.0)]);
            sum = mix(sum ^ world.output.digest.all());
        }
        assert!(world.output.counts.leaves > 1000, "{:?}", world.output.counts);
        sum
    });
    assert!(digests.iter().all(|digest| *digest == digests[0]), "{digests:x?}");
    let Err(fault) = Workers::new(65) else { panic!("65 workers were taken") };
    assert_eq!(fault.to_string(), "65 workers were asked for, at most 64 are possible");
}

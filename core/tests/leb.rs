//! The engine's mesh is the LEB workload's at every listed frame, alone and with another thread.
//!
//! In:    the reference answers; the recursion at frames that nobody listed.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: times (`benches/leb.rs`), the recursion itself (`leb_reference`).

#[path = "../leb/mod.rs"]
mod leb;

use leb::answers::{ANSWERS, Answer};
use leb::engine::{Engine, Shared};
use leb::recursion::{self, Rule};
use leb::workload::{Flight, Path, Preset, Speed};

/// Flies through all frames listed for a preset and a flight; how many were compared.
fn fly(preset: Preset, flight: Flight, threads: usize) -> usize {
    let is_of = |answer: &&Answer| answer.preset == preset && answer.flight == flight;
    let answers: Vec<&Answer> = ANSWERS.iter().filter(is_of).collect();
    let last = answers.iter().map(|answer| answer.frame).max().unwrap();
    let mut shared = Shared::new(preset, threads).unwrap();
    for frame in 0..=last {
        shared.frame(flight.eye(frame));
        for answer in answers.iter().filter(|answer| answer.frame == frame) {
            let (tally, digest) = shared.engine().digest();
            let found = (tally.leaves, tally.deepest, digest);
            assert_eq!(found, (answer.leaves, answer.deepest, answer.digest), "{answer:?}");
        }
    }
    answers.len()
}

const FLIGHTS: [Flight; 3] = [
    Flight { path: Path::Cruise, speed: Speed::V1 },
    Flight { path: Path::Cruise, speed: Speed::V10 },
    Flight { path: Path::Dive, speed: Speed::V10 },
];

#[test]
fn every_listed_frame_of_50k_alone_and_with_another_thread() {
    for threads in [0, 1] {
        assert_eq!(FLIGHTS.map(|flight| fly(Preset::L50k, flight, threads)), [6; 3]);
    }
}

#[test]
fn every_listed_frame_of_200k_alone_and_with_another_thread() {
    for threads in [0, 1] {
        assert_eq!(FLIGHTS.map(|flight| fly(Preset::L200k, flight, threads)), [6; 3]);
    }
}

#[test]
fn every_listed_frame_of_1m() {
    assert_eq!(FLIGHTS.map(|flight| fly(Preset::L1M, flight, 1)), [6; 3]);
}

#[test]
fn at_a_speed_beyond_the_counts_the_mesh_lags_and_neither_side_starves() {
    let preset = Preset::L50k;
    let flight = FLIGHTS[1];
    let mut engine = Engine::capped(preset, 40);
    let mut frames_up = 0;
    while engine.frame(flight.eye(0)).splits > 0 {
        frames_up += 1;
        assert!(frames_up < 2_000, "no end of the cold start");
    }
    assert_eq!(engine.tally().leaves, preset.cruise_start().0);
    let (mut splits, mut merges) = (0, 0);
    for frame in 1..=600 {
        let done = engine.frame(flight.eye(frame));
        assert!(done.splits <= 40 && done.merges <= 40);
        (splits, merges) = (splits + done.splits, merges + done.merges);
        if frame % 50 == 0 {
            let wanted =
                recursion::count(&Rule::new(preset.threshold_squared(), flight.eye(frame)));
            let leaves = engine.tally().leaves as f64 / wanted.leaves as f64;
            assert!((0.8..1.25).contains(&leaves), "frame {frame}: {leaves} of the leaves");
        }
    }
    // Some 94 splits and 92 merges a frame would be needed: both counts are spent.
    assert!(splits > 39 * 590 && merges > 39 * 590, "{splits} splits, {merges} merges");
    for _ in 0..3_000 {
        engine.frame(flight.eye(600));
    }
    let (tally, digest) =
        recursion::digest(&Rule::new(preset.threshold_squared(), flight.eye(600)));
    assert_eq!(engine.digest(), (tally, digest), "once the eye rests, the mesh is the exact one");
}

#[test]
fn turns_stops_and_jumps_leave_the_mesh_of_the_recursion() {
    let preset = Preset::L50k;
    let mut engine = Engine::new(preset);
    let mut lazy = Engine::new(preset);
    engine.judges_all = true;
    let (mut at, mut judged) = ([0.4, 0.4, 1.0 / 64.0], [0_u64; 2]);
    for frame in 0..400_u32 {
        let turn = f64::from(frame) * 0.013;
        let (east, north) = (libm::cos(turn), libm::sin(2.0 * turn));
        at = match frame % 100 {
            99 => [0.1 + 0.002 * f64::from(frame), 0.9 - 0.002 * f64::from(frame), 0.02],
            40..=49 => at,
            _ => [at[0] + 2e-4 * east, at[1] + 2e-4 * north, at[2] + 2e-6 * north],
        };
        let counts = [lazy.frame(at), engine.frame(at)];
        judged[0] += u64::from(counts[0].evaluations);
        judged[1] += u64::from(counts[1].evaluations);
        assert_eq!((counts[0].splits, counts[0].merges), (counts[1].splits, counts[1].merges));
        if frame % 20 == 0 || frame % 100 >= 98 {
            let rule = Rule::new(preset.threshold_squared(), at);
            let (tally, digest) = recursion::digest(&rule);
            assert_eq!(lazy.digest(), (tally, digest), "frame {frame}");
        }
    }
    println!("{} judged instead of {}", judged[0], judged[1]);
    assert!(judged[0] * 5 < judged[1], "{judged:?}");
}

//! The LEB workload timed: ours against full recursion, frame by frame in the same run.
//!
//! In:    presets on the command line; all but 16M without any.
//! Out:   a table: medians, p99, their ratio, work a frame, bytes a leaf, cold start.
//! Keeps: nothing.
//! Not here: digests at every listed frame (`tests/leb.rs`).

#[path = "../leb/mod.rs"]
mod leb;

use leb::engine::Engine;
use leb::recursion::{Rule, count};
use leb::stats::{PerFrame, Row, Summary, header};
use leb::workload::{Flight, Path, Preset, Speed};
use overfly_jobs::now_ns;

const FLIGHTS: [Flight; 3] = [
    Flight { path: Path::Cruise, speed: Speed::V1 },
    Flight { path: Path::Cruise, speed: Speed::V10 },
    Flight { path: Path::Dive, speed: Speed::V10 },
];

/// Frames of a flight after the cold start; a dive ends there.
const FRAMES: u32 = 600;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let mut presets = Vec::new();
    for word in &words {
        match word.parse::<Preset>() {
            Ok(preset) => presets.push(preset),
            Err(fault) => {
                eprintln!(
                    "leb: {fault}\nusage: cargo bench -p overfly-core --bench leb -- [PRESET…]"
                );
                std::process::exit(2);
            }
        }
    }
    if presets.is_empty() {
        presets.extend(Preset::ALL.into_iter().filter(|&preset| preset != Preset::L16M));
    }
    println!("one thread; medians and p99 of {FRAMES} frames, ours and the recursion in turn");
    println!("{}", header());
    for preset in presets {
        for flight in FLIGHTS {
            println!("{}", fly(preset, flight));
        }
    }
}

fn fly(preset: Preset, flight: Flight) -> Row {
    let mut engine = Engine::new(preset);
    let timed = |work: &mut dyn FnMut()| {
        let begin_ns = now_ns();
        work();
        (now_ns() - begin_ns) as f64 * 1e-6
    };
    let cold_start_ms = timed(&mut || {
        engine.frame(flight.eye(0));
    });
    let (mut ours_ms, mut recursion_ms) = (Vec::new(), Vec::new());
    let mut work = PerFrame { evaluations: 0.0, splits: 0.0, merges: 0.0 };
    for frame in 1..=FRAMES {
        let eye = flight.eye(frame);
        ours_ms.push(timed(&mut || {
            let done = engine.frame(eye);
            work.evaluations += f64::from(done.evaluations) / f64::from(FRAMES);
            work.splits += f64::from(done.splits) / f64::from(FRAMES);
            work.merges += f64::from(done.merges) / f64::from(FRAMES);
        }));
        let rule = Rule::new(preset.threshold_squared(), eye);
        recursion_ms.push(timed(&mut || {
            std::hint::black_box(count(&rule));
        }));
    }
    let (tally, digest) = engine.digest();
    let reference =
        leb::recursion::digest(&Rule::new(preset.threshold_squared(), flight.eye(FRAMES)));
    assert_eq!(
        (tally.leaves, tally.deepest, digest),
        (reference.0.leaves, reference.0.deepest, reference.1)
    );
    Row {
        preset,
        flight,
        leaves: tally.leaves,
        ours: Summary::of(&mut ours_ms),
        recursion: Summary::of(&mut recursion_ms),
        work,
        bytes_per_leaf: engine.bytes() as f64 / tally.leaves as f64,
        cold_start_ms,
    }
}

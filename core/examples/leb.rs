//! The LEB workload from the command line: frames as lines, then medians.
//!
//! In:    preset, path, speed, number of frames.
//! Out:   `frame leaves depth digest` a frame, then a line of medians.
//! Keeps: nothing.
//! Not here: the comparison with the recursion (`cargo bench -p overfly-core --bench leb`).

#[path = "../leb/mod.rs"]
mod leb;

use leb::engine::Engine;
use leb::stats::Summary;
use leb::workload::{Flight, Preset};
use overfly_jobs::now_ns;
use std::io::{self, Write};
use std::process::ExitCode;

const USAGE: &str = "\
usage: leb PRESET PATH SPEED FRAMES [WORKERS]

Flies the LEB workload and prints `frame leaves depth digest` for frame 0, which is a cold start,
and for each of the FRAMES frames after it, then a line of medians.

  PRESET   50k, 200k, 1M, 4M or 16M: leaves on frame 0 of a cruise
  PATH     cruise: level at 1/64 of the square; dive: from 8 times that height in 600 frames
  SPEED    v1: 1/24000 of the square a frame; v10: ten times that
  FRAMES   0 or more";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.iter().any(|word| word == "--help" || word == "-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("leb: {fault}\n\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn run(words: &[String]) -> Result<(), String> {
    let [preset, path, speed, frames] = words else {
        return Err(format!("4 words are needed, {} were given", words.len()));
    };
    let preset: Preset = preset.parse().map_err(|fault| format!("{fault}"))?;
    let flight = Flight {
        path: path.parse().map_err(|fault| format!("{fault}"))?,
        speed: speed.parse().map_err(|fault| format!("{fault}"))?,
    };
    let frames: u32 = frames
        .parse()
        .map_err(|_| format!("FRAMES is \"{frames}\", allowed are 0 to {}", u32::MAX))?;
    fly(preset, flight, frames).map_err(|fault| fault.to_string())
}

fn fly(preset: Preset, flight: Flight, frames: u32) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let mut engine = Engine::new(preset);
    let (mut times_ms, mut cold_ms) = (Vec::new(), 0.0);
    let mut work = [Vec::new(), Vec::new(), Vec::new()];
    for frame in 0..=frames {
        let eye = flight.eye(frame);
        let begin_ns = now_ns();
        let done = engine.frame(eye);
        let took_ms = (now_ns() - begin_ns) as f64 * 1e-6;
        if frame == 0 {
            cold_ms = took_ms;
        } else {
            times_ms.push(took_ms);
            let counts = [done.evaluations, done.splits, done.merges].map(f64::from);
            work.iter_mut().zip(counts).for_each(|(all, one)| all.push(one));
        }
        let (tally, digest) = engine.digest();
        writeln!(out, "{frame} {} {} {digest:016x}", tally.leaves, tally.deepest)?;
    }
    write!(out, "cold start {cold_ms:.3} ms")?;
    if frames > 0 {
        let times = Summary::of(&mut times_ms);
        let [evaluations, splits, merges] = work.map(|mut all| Summary::of(&mut all).median_ms);
        write!(out, ", median {:.4} ms, p99 {:.4} ms", times.median_ms, times.p99_ms)?;
        write!(out, ", evaluations {evaluations}, splits {splits}, merges {merges}")?;
    }
    writeln!(out)
}

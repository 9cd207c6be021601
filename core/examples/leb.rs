//! The LEB workload from the command line: frames as lines, then medians.
//!
//! In:    preset, path, speed, number of frames.
//! Out:   `frame leaves depth digest` a frame, then a line of medians.
//! Keeps: nothing.
//! Not here: the comparison with the recursion (`cargo bench -p overfly-core --bench leb`).

#[path = "../leb/mod.rs"]
mod leb;

use leb::engine::Shared;
use leb::stats::Summary;
use leb::workload::{Flight, Preset};
use overfly_jobs::now_ns;
use std::error::Error;
use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

const USAGE: &str = "\
usage: leb PRESET PATH SPEED FRAMES [THREADS]

Flies the LEB workload and prints `frame leaves depth digest` for frame 0, which is a cold start,
and for each of the FRAMES frames after it, then a line of medians. The flight is flown twice:
once to be timed, once to be digested.

  PRESET   50k, 200k, 1M, 4M or 16M: leaves on frame 0 of a cruise
  PATH     cruise: level at 1/64 of the square; dive: from 8 times that height in 600 frames
  SPEED    v1: 1/24000 of the square a frame; v10: ten times that
  FRAMES   0 or more
  THREADS  0 to 64 beside the main one, 0 without it; the mesh is the same for any number";

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
    let (words, threads) = match words {
        [words @ .., threads] if words.len() == 4 => (words, number("THREADS", threads, 64)?),
        words => (words, 0),
    };
    let [preset, path, speed, frames] = words else {
        return Err(format!("4 or 5 words are needed, {} were given", words.len()));
    };
    let preset: Preset = preset.parse().map_err(|fault| format!("{fault}"))?;
    let path = path.parse().map_err(|fault| format!("{fault}"))?;
    let speed = speed.parse().map_err(|fault| format!("{fault}"))?;
    let frames = number("FRAMES", frames, u32::MAX)?;
    fly(preset, Flight { path, speed }, (frames, threads)).map_err(|fault| fault.to_string())
}

fn number(name: &str, word: &str, most: u32) -> Result<u32, String> {
    let found = word.parse().ok().filter(|&number| number <= most);
    found.ok_or_else(|| format!("{name} is \"{word}\", allowed are 0 to {most}"))
}

fn fly(
    preset: Preset,
    flight: Flight,
    (frames, threads): (u32, u32),
) -> Result<(), Box<dyn Error>> {
    let mut out = BufWriter::new(io::stdout().lock());
    let timed = time(Shared::new(preset, threads as usize)?, flight, frames);
    let mut shared = Shared::new(preset, threads as usize)?;
    for frame in 0..=frames {
        shared.frame(flight.eye(frame));
        let (tally, digest) = shared.engine().digest();
        writeln!(out, "{frame} {} {} {digest:016x}", tally.leaves, tally.deepest)?;
    }
    writeln!(out, "{timed}")?;
    Ok(out.flush()?)
}

/// Flies and says how long frames took and what was done in them.
fn time(mut shared: Shared, flight: Flight, frames: u32) -> String {
    let (mut times_ms, mut work) = (Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
    for frame in 0..=frames {
        let eye = flight.eye(frame);
        let begin_ns = now_ns();
        let done = shared.frame(eye);
        times_ms.push((now_ns() - begin_ns) as f64 * 1e-6);
        let counts = [done.evaluations, done.splits, done.merges].map(f64::from);
        work.iter_mut().zip(counts).for_each(|(all, one)| all.push(one));
    }
    let cold_ms = times_ms.remove(0);
    let cold = format!("cold start {cold_ms:.3} ms");
    if times_ms.is_empty() {
        return cold;
    }
    let times = Summary::of(&mut times_ms);
    let [evaluations, splits, merges] = work.map(|mut all| Summary::of(&mut all[1..]).median_ms);
    format!(
        "{cold}, median {:.4} ms, p99 {:.4} ms, median evaluations {evaluations}, splits {splits}, \
         merges {merges}",
        times.median_ms, times.p99_ms
    )
}

//! The planet's own workload timed: as shipped, judging everything, recursing, on the same frames.
//!
//! In:    flights, frames and repeats on the command line; the preset `earth`.
//! Out:   a table for each flight and patch depth; with `--json`, all frames of each.
//! Keeps: nothing.
//! Not here: flying (`fly`), the walk (`recursion`), the table (`report`).

mod fly;
mod recursion;
mod report;

use clap::Parser;
use fly::{Case, fly};
use overfly::core::settings::SceneSettings;
use std::error::Error;
use std::path::PathBuf;

const AFTER_HELP: &str = "\
Columns: `lazy` is the terrain as shipped; `full` the same terrain judging every diamond in every
frame, flown beside it and held against it by digest; `recursion` walks the same mesh from the base
and only recomputes every priority: no splits, no merges, no queues.

Examples:
  cargo bench --bench planet
  cargo bench --bench planet -- --only rainier --frames 100000 --json planet.json
  cargo bench --bench planet -- --alone --repeats 5";

/// Times of the planet's stages over bundled flights, against full evaluation and recursion
#[derive(Parser)]
#[command(name = "planet", after_help = AFTER_HELP)]
struct Args {
    /// Frames of each flight, in windows spread evenly over it; beyond its length, all of it
    #[arg(long, value_name = "N", default_value_t = 1200, value_parser = at_least_one)]
    frames: usize,
    /// Windows; each begins once the terrain has come up
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = at_least_one)]
    windows: usize,
    /// Only this flight
    #[arg(long, value_parser = ["rainier", "descent"])]
    only: Option<String>,
    /// Threads beside the caller
    #[arg(long, value_name = "N", default_value_t = 1)]
    workers: usize,
    /// Every flight is flown so often, and each time is the least of them: other programs disturb
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least_one)]
    repeats: usize,
    /// Recurses in every N-th frame
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = at_least_one)]
    every: usize,
    /// Flies `lazy` alone, so that nothing else empties its caches between the frames
    #[arg(long)]
    alone: bool,
    /// Writes all frames' times and counts to a file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Cargo says so.
    #[arg(long, hide = true)]
    bench: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if count >= 1 => Ok(count),
        _ => Err("a whole number, 1 or more".into()),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let flights = match &args.only {
        Some(name) => vec![name.as_str()],
        None => vec!["rainier", "descent"],
    };
    println!(
        "preset earth, 1280x720, {} worker(s) beside the caller; times in ms, each the least of {} \
         run(s){}",
        args.workers,
        args.repeats,
        if args.alone { "; lazy alone" } else { "; lazy and full in turn, frame by frame" }
    );
    let mut flown = Vec::new();
    for flight in flights {
        for patch_depth in [4, 0] {
            let case = Case {
                flight,
                scene: scene(patch_depth)?,
                frames: args.frames,
                windows: args.windows,
                workers: args.workers,
                repeats: args.repeats,
                every: args.every,
                alone: args.alone,
            };
            let columns = fly(&case)?;
            print!("\n{}", report::table(&case, &columns));
            flown.push(report::json(&case, &columns));
        }
    }
    if let Some(path) = &args.json {
        let object = serde_json::json!({
            "format": "overfly-planet-1",
            "workers": args.workers,
            "repeats": args.repeats,
            "alone": args.alone,
            "flown": flown,
        });
        std::fs::write(path, object.to_string())
            .map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// The preset with 100 000 triangles, a leaf being drawn as 2^`patch_depth` of them.
fn scene(patch_depth: u8) -> Result<SceneSettings, Box<dyn Error>> {
    let mut scene = overfly::config::load("earth")?;
    scene.lod.triangles_max = 100_000;
    scene.lod.patch_depth = patch_depth;
    Ok(scene)
}

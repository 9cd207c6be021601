//! The command line: each command is one thin file over the library.
//!
//! In:    arguments.
//! Out:   tables, files, an exit code: 0 good, 1 diverged, 2 bad input, 130 interrupted.
//! Keeps: nothing.
//! Not here: what the commands do (`cli`), the window (`viewer`).
#![deny(unsafe_code)]

#[macro_use]
mod cli;
mod heap;
mod viewer;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Terrain backend of a flight simulator: replays flights over a whole planet, frame by frame.
#[derive(Parser)]
#[command(version, about, after_help = cli::EXIT_CODES, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Flies a flight or plays a recording: times every stage, draws stills, checks digests.
    Replay(cli::replay::Arguments),
    /// Draws one picture from one place.
    Still(cli::still::Arguments),
    /// Opens a window to fly in, and to watch flights and recordings.
    View(cli::view::Arguments),
    /// Measures how far what is drawn strays from the ground, over a flight.
    Measure(cli::measure::Arguments),
    /// Holds a flight's frames against a budget, a baseline or another program, as in CI.
    Budget(Box<cli::budget::Arguments>),
    /// Says what differs between two runs of `budget`: speed, work or result, and where first.
    Diff(cli::budget::DiffArguments),
    /// Sweeps the knobs of a scene over a flight: what each costs, and what it buys.
    Trade(cli::trade::Arguments),
    /// Writes the scene to take for a stated error or a stated budget, and tries it.
    Recommend(cli::trade::recommend::Arguments),
    /// Checks a scene file and shows what it resolves to; all faults at once.
    Check(cli::check::Arguments),
    /// Says how high the ground is at places, and how sure that is; CSV or JSON.
    Probe(cli::probe::Arguments),
    /// Builds an archive of real elevation from GeoTIFF, SRTM or PNG.
    Ingest(cli::ingest::Arguments),
    /// Makes a flight of a recording in another format: IGC, GPX, KML, X-Plane, Tacview, NMEA, ADS-B.
    Import(cli::import::Arguments),
    /// Answers other simulators over UDP: CIGI 3.3, FlightGear's native FDM.
    Serve(cli::serve::Arguments),
    /// Shows what this machine has and lacks: Vulkan devices, layers, cores.
    Doctor,
}

fn main() -> ExitCode {
    // Other commands know themselves which of their values may begin with a hyphen.
    let probes = std::env::args_os().nth(1).is_some_and(|command| command == "probe");
    let arguments = if probes {
        Arguments::parse_from(cli::places::guarded(std::env::args_os()))
    } else {
        Arguments::parse()
    };
    let outcome = match arguments.command {
        Command::Replay(arguments) => cli::replay::run(&arguments),
        Command::Still(arguments) => cli::still::run(&arguments),
        Command::View(arguments) => cli::view::run(&arguments),
        Command::Measure(arguments) => cli::measure::run(&arguments),
        Command::Budget(arguments) => cli::budget::run(&arguments),
        Command::Diff(arguments) => cli::budget::run_diff(&arguments),
        Command::Trade(arguments) => cli::trade::run(&arguments),
        Command::Recommend(arguments) => cli::trade::recommend::run(&arguments),
        Command::Check(arguments) => cli::check::run(&arguments),
        Command::Probe(arguments) => cli::probe::run(&arguments),
        Command::Ingest(arguments) => cli::ingest::run(&arguments),
        Command::Import(arguments) => cli::import::run(&arguments),
        Command::Serve(arguments) => cli::serve::run(&arguments),
        Command::Doctor => Ok(cli::doctor::run()),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("overfly: {error}");
        ExitCode::from(cli::BAD_INPUT)
    })
}

//! The command line: each command is one thin file over the library.
//!
//! In:    arguments.
//! Out:   tables, files, an exit code: 0 good, 1 diverged, 2 bad input, 130 interrupted.
//! Keeps: nothing.
//! Not here: what the commands do (`cli`).
#![forbid(unsafe_code)]

mod cli;

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
    /// Checks a scene file and shows what it resolves to; all faults at once.
    Check(cli::check::Arguments),
    /// Shows what this machine has and lacks: Vulkan devices, layers, cores.
    Doctor,
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Replay(arguments) => cli::replay::run(&arguments),
        Command::Check(arguments) => cli::check::run(&arguments),
        Command::Doctor => Ok(cli::doctor::run()),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("overfly: {error}");
        ExitCode::from(cli::BAD_INPUT)
    })
}

//! The commands and what they share.
//!
//! In:    parsed arguments.
//! Out:   exit codes.
//! Keeps: nothing.
//! Not here: the library (`overfly`).

pub mod check;
pub mod columns;
pub mod doctor;
pub mod json;
pub mod replay;
pub mod report;
pub mod run;
pub mod source;
pub mod stills;

use std::path::Path;

/// A replay left the recorded states.
pub const DIVERGED: u8 = 1;
/// `doctor` found no way to draw.
pub const NO_DEVICE: u8 = 1;
/// Arguments or files cannot be used.
pub const BAD_INPUT: u8 = 2;
/// Ctrl-C, after the summary.
pub const INTERRUPTED: u8 = 130;

/// Shown under `--help`.
pub const EXIT_CODES: &str = "\
Exit codes: 0 good, 1 a replay diverged from its recording (doctor: nothing to draw on),
2 bad input, 130 interrupted.

Examples:
  overfly doctor
  overfly replay rainier --no-render
  overfly replay descent --stills 8 --size 1280x720
  overfly replay poles --record poles.ovf --loader-delay-ms 50
  overfly replay poles.ovf --workers 0";

/// What ends a command early, in words for the user.
pub type Failure = Box<dyn std::error::Error>;

/// Writes a file beside its place and renames it there, so that a kill leaves the old one or none.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let failed = |error| format!("{}: {error}", path.display());
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    std::fs::write(&beside, bytes).map_err(failed)?;
    std::fs::rename(&beside, path).map_err(failed)?;
    Ok(())
}

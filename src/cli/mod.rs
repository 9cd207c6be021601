//! The commands and what they share.
//!
//! In:    parsed arguments.
//! Out:   exit codes.
//! Keeps: nothing.
//! Not here: the library (`overfly`).

/// Prints a line. A reader that went away, as in `overfly … | head`, is no reason to stop a run.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

pub mod answers;
pub mod budget;
pub mod check;
pub mod columns;
pub mod doctor;
pub mod flown;
pub mod import;
pub mod ingest;
pub mod json;
pub mod measure;
pub mod places;
pub mod probe;
pub mod replay;
pub mod report;
pub mod run;
pub mod serve;
pub mod source;
pub mod still;
pub mod stills;
pub mod trade;
pub mod view;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

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
  overfly still --at 46.85,-121.76,5000 --look 40,-8 -o rainier.png
  overfly replay poles --no-render --record poles.ovf --loader-delay-ms 50
  overfly replay poles.ovf --no-render --workers 0
  overfly replay flight.igc
  overfly probe --at 46.8523,-121.7603";

/// What ends a command early, in words for the user.
pub type Failure = Box<dyn std::error::Error>;

/// Where a run writes to, checked before it begins: links are followed, missing folders made;
/// refused is what is no regular file, and what the run reads or writes already.
pub fn place_of(path: &Path, taken: &mut Vec<PathBuf>) -> Result<PathBuf, Failure> {
    let failed = |error| format!("{}: {error}", path.display());
    let refused = |why| Err(format!("{}: {why}", path.display()).into());
    let place = match std::fs::metadata(path) {
        Ok(about) if about.is_file() => path.canonicalize().map_err(failed)?,
        Ok(_) => return refused("is there and is not a regular file"),
        Err(_) if path.is_symlink() => return refused("is a link to nothing"),
        Err(_) => {
            let Some(name) = path.file_name() else { return refused("names no file") };
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            let folder = parent.unwrap_or(Path::new("."));
            std::fs::create_dir_all(folder).map_err(failed)?;
            folder.canonicalize().map_err(failed)?.join(name)
        }
    };
    // Also what is read may be called so: what a killed run left is a file like any other.
    if taken.contains(&place) || taken.contains(&beside(&place)) {
        return refused("is an input or another output of this run already");
    }
    taken.push(place.clone());
    Ok(place)
}

/// The files that a run reads by these names, for [`place_of`]: of `flight.igc#2` the file, and what
/// describes its columns.
pub fn read_by<'a>(names: impl IntoIterator<Item = Option<&'a String>>) -> Vec<PathBuf> {
    let files = names.into_iter().flatten().map(|name| import::split(name).0);
    let files = files.flat_map(|file| [file.to_owned(), import::columns_of(file)]);
    files.filter_map(|file| file.canonicalize().ok()).collect()
}

/// Where a file is written while it is not whole.
pub fn beside(path: &Path) -> PathBuf {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    beside.into()
}

/// Writes a file beside its place and renames it there, so that a kill leaves the old one or none.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_by(path, |file| file.write_all(bytes))
}

/// The same of a file too large to be in memory beforehand: `write` writes all of it.
pub fn write_by(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Failure> {
    let failed = |error| format!("{}: {error}", path.display());
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let beside = beside(path);
    let whole = File::create(&beside).map(BufWriter::new).and_then(|mut file| {
        write(&mut file)?;
        file.flush()
    });
    let written = whole.and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // What is half written helps nobody; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&beside);
    }
    Ok(written.map_err(failed)?)
}

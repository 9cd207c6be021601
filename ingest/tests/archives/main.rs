//! What the ingest makes: archives held against their sources, and the ground read from them.
//!
//! In:    small rasters written here, and `../shared/data` where it is present.
//! Out:   pass or fail; what needs absent data says so by name.
//! Keeps: temporary folders while a test runs.
//! Not here: reading rasters (`../rasters`), archives on servers (`overfly_archive`).
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "test rasters are small and made of numbers chosen here"
)]

mod atlas;
mod bounds;
mod layers;
mod pages;
mod rasters;
mod real;
mod robust;
mod seams;
#[expect(dead_code, reason = "the other binary writes more layouts than this one")]
#[path = "../rasters/tiff_file.rs"]
mod tiff_file;

use std::path::{Path, PathBuf};

/// Real data beside the project; `None`, after saying so, where there is none.
fn shared_data(test: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("{test}: skipped: no ../shared/data");
    None
}

/// Whether inputs that take minutes shall be tested, too; says so by name if not.
fn is_slow_wanted(test: &str) -> bool {
    let wanted = std::env::var_os("OVERFLY_SLOW").is_some();
    if !wanted {
        eprintln!("{test}: skipped: OVERFLY_SLOW is not set");
    }
    wanted
}

//! What the ingest reads: every format and layout, the real files, hostile ones, the geoid.
//!
//! In:    small files written here, and `../shared/data` where it is present.
//! Out:   pass or fail; what needs absent data says so by name.
//! Keeps: temporary folders while a test runs.
//! Not here: what is made of the heights.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "test files are small and made of numbers chosen here"
)]

mod fuzz;
mod geoid;
mod geotiff;
mod other_formats;
mod shared_data;
mod tiff_file;

use overfly_ingest::raster::{OpenOptions, Raster, open};
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

/// Writes a file into a folder of its own and opens it.
fn opened(name: &str, bytes: &[u8], options: &OpenOptions) -> (tempfile::TempDir, Raster) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mut rasters = open(&path, options).unwrap();
    assert_eq!(rasters.len(), 1);
    (folder, rasters.pop().unwrap())
}

/// What opening a file says that must not be read.
fn refusal(name: &str, bytes: &[u8], options: &OpenOptions) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    open(&path, options).map(drop).unwrap_err().to_string()
}

/// All heights of a raster.
fn all(raster: &Raster) -> Vec<f32> {
    let [columns, rows] = [raster.grid.columns, raster.grid.rows].map(|count| count as usize);
    let mut out = Vec::new();
    raster.window(0, 0, columns, rows, &mut out).unwrap();
    out
}

//! Builds that cannot end well leave what was there before, and say why.
//!
//! In:    outputs that cannot be written, inputs that are damaged, a stop at any moment.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: damaged rasters by themselves (`../rasters/fuzz`).

use crate::atlas::build;
use crate::is_slow_wanted;
use crate::rasters::{Sheet, options, rugged_m};
use overfly_ingest::{BuildOptions, IngestError};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tiff::encoder::compression::{CompressionAlgorithm, Deflate, DeflateLevel};

const OLD: &[u8] = b"what was there before";

fn small(folder: &Path) -> PathBuf {
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [101, 101]);
    sheet.write_whole(&folder.join("small.tif"), rugged_m)
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_folder_that_is_missing_and_a_directory_as_output_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let input = small(folder.path());
    let missing = folder.path().join("no/such/a.pmtiles");
    let error = build(&options(std::slice::from_ref(&input), &missing)).unwrap_err();
    assert!(matches!(&error, IngestError::Output { path, .. } if *path == missing), "{error}");
    assert!(error.to_string().contains("no/such/a.pmtiles"), "{error}");
    let directory = folder.path().join("dir.pmtiles");
    fs::create_dir(&directory).unwrap();
    let error = build(&options(&[input], &directory)).unwrap_err();
    assert!(matches!(&error, IngestError::Output { path, .. } if *path == directory), "{error}");
    assert_eq!(names(folder.path()), ["dir.pmtiles", "small.tif"]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_must_not_be_written_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let name = "a_folder_that_must_not_be_written_is_refused";
    let folder = tempfile::tempdir().unwrap();
    let input = small(folder.path());
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("probe"), b"").is_ok() {
        eprintln!("{name}: skipped: this user may write anywhere");
        return;
    }
    let error = build(&options(&[input], &closed.join("a.pmtiles"))).unwrap_err();
    assert!(matches!(error, IngestError::Output { .. }), "{error}");
}

#[test]
fn a_stop_at_any_moment_leaves_the_old_archive_and_no_part_of_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let built = options(&[small(folder.path())], &folder.path().join("a.pmtiles"));
    fs::write(&built.output, OLD).unwrap();
    let events = AtomicU64::new(0);
    let count = |_| {
        events.fetch_add(1, Ordering::Relaxed);
    };
    overfly_ingest::build(&built, &AtomicBool::new(false), &count).unwrap();
    let events = events.into_inner();
    assert!(events > 3);
    let whole = fs::read(&built.output).unwrap();
    let mut stopped = 0;
    for moment in 0..events {
        fs::write(&built.output, OLD).unwrap();
        let (stop, seen) = (AtomicBool::new(moment == 0), AtomicU64::new(0));
        let raise = |_| {
            if seen.fetch_add(1, Ordering::Relaxed) + 1 >= moment {
                stop.store(true, Ordering::Relaxed);
            }
        };
        // Where the last batch was being written already, the archive is complete.
        let is_new = overfly_ingest::build(&built, &stop, &raise).is_ok();
        let found = fs::read(&built.output).unwrap();
        assert!(if is_new { found == whole } else { found == OLD }, "moment {moment}");
        assert_eq!(names(folder.path()), ["a.pmtiles", "small.tif"], "moment {moment}");
        stopped += u64::from(!is_new);
    }
    assert!(stopped >= events / 2, "{stopped} of {events}");
}

#[test]
fn one_damaged_input_of_several_is_named_and_the_old_archive_stays() {
    let folder = tempfile::tempdir().unwrap();
    let good = small(folder.path());
    let bytes = fs::read(&good).unwrap();
    let bad = folder.path().join("damaged.tif");
    let mut scratched = bytes.clone();
    // The first strip's first bytes: nothing there can be unpacked.
    scratched[8..72].fill(0xA5);
    let cut = bytes[..bytes.len() / 2].to_vec();
    for damaged in [scratched, cut, Vec::new(), b"no raster at all".to_vec()] {
        fs::write(&bad, damaged).unwrap();
        let built = options(&[good.clone(), bad.clone()], &folder.path().join("a.pmtiles"));
        fs::write(&built.output, OLD).unwrap();
        let error = build(&built).unwrap_err();
        assert!(error.to_string().contains("damaged.tif"), "{error}");
        assert_eq!(fs::read(&built.output).unwrap(), OLD);
        assert_eq!(names(folder.path()), ["a.pmtiles", "damaged.tif", "small.tif"]);
    }
}

#[test]
fn nothing_to_ingest_and_a_missing_input_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.pmtiles");
    assert!(matches!(build(&options(&[], &output)), Err(IngestError::NoInput)));
    let error = build(&options(&[folder.path().join("none.tif")], &output)).unwrap_err();
    assert!(error.to_string().contains("none.tif"), "{error}");
    assert!(names(folder.path()).is_empty());
}

/// Postings along a side of the large raster, and of its tiles, all of which are the same.
const SIDE: u32 = 12_000;
const TILE: u32 = 256;

/// A tiled GeoTIFF of int16 whose directory names one and the same tile over and over.
fn write_large(path: &Path) {
    let height_m = |at: u32| {
        let [x, y] = [at % TILE, at / TILE].map(|at| f64::from(at.min(TILE - at)));
        (10.0 + x * 3.0 + y * 2.0) as i16
    };
    let raw: Vec<u8> = (0..TILE * TILE).flat_map(|at| height_m(at).to_le_bytes()).collect();
    let mut tile = Vec::new();
    Deflate::with_level(DeflateLevel::Fast).write_to(&mut tile, &raw).unwrap();
    let count = SIDE.div_ceil(TILE) * SIDE.div_ceil(TILE);
    let step_deg = 1.0 / 3600.0_f64;
    let doubles = [step_deg, step_deg, 0.0, 0.0, 0.0, 0.0, 5.0, 50.0, 0.0];
    let keys: [u16; 16] = [1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 2, 2048, 0, 1, 4326];
    let tile_len = u32::try_from(tile.len()).unwrap();
    let doubles_at = 8 + tile_len.next_multiple_of(8);
    let (keys_at, offsets_at) = (doubles_at + 72, doubles_at + 72 + 32);
    let (sizes_at, directory_at) = (offsets_at + 4 * count, offsets_at + 8 * count);
    // Tag, type (3 short, 4 long, 12 double), how many, value or where.
    let entries: [[u32; 4]; 13] = [
        [256, 4, 1, SIDE],
        [257, 4, 1, SIDE],
        [258, 3, 1, 16],
        [259, 3, 1, 8],
        [262, 3, 1, 1],
        [277, 3, 1, 1],
        [322, 4, 1, TILE],
        [323, 4, 1, TILE],
        [324, 4, count, offsets_at],
        [325, 4, count, sizes_at],
        [339, 3, 1, 2],
        [33550, 12, 3, doubles_at],
        [33922, 12, 6, doubles_at + 24],
    ];
    let mut file = b"II*\0".to_vec();
    file.extend(directory_at.to_le_bytes());
    file.extend(&tile);
    file.resize(doubles_at as usize, 0);
    file.extend(doubles.iter().flat_map(|number| number.to_le_bytes()));
    file.extend(keys.iter().flat_map(|number| number.to_le_bytes()));
    file.extend((0..count).flat_map(|_| 8_u32.to_le_bytes()));
    file.extend((0..count).flat_map(|_| tile_len.to_le_bytes()));
    file.extend(14_u16.to_le_bytes());
    for [tag, kind, count, value] in entries.into_iter().chain([[34735, 3, 16, keys_at]]) {
        file.extend(u16::try_from(tag).unwrap().to_le_bytes());
        file.extend(u16::try_from(kind).unwrap().to_le_bytes());
        file.extend(count.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend(0_u32.to_le_bytes());
    fs::File::create(path).unwrap().write_all(&file).unwrap();
}

/// Greatest memory of this process so far in KiB.
fn peak_kib() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Set for the process that builds alone, so that its memory is that of the build.
const ALONE: &str = "OVERFLY_BUILDS_ALONE";

#[cfg(target_os = "linux")]
#[test]
fn a_raster_of_12000_by_12000_is_built_in_less_than_512_mib() {
    let name = "a_raster_of_12000_by_12000_is_built_in_less_than_512_mib";
    if let Some(folder) = std::env::var_os(ALONE) {
        let folder = PathBuf::from(folder);
        let built = options(&[folder.join("large.tif")], &folder.join("a.pmtiles"));
        let level_max = std::env::var("OVERFLY_LEVEL").ok().map(|level| level.parse().unwrap());
        let report = build(&BuildOptions { level_max, ..built }).unwrap();
        let mib = peak_kib() / 1024;
        println!("{name}: {mib} MiB, {} tiles, {} bytes", report.tiles, report.bytes);
        assert!(mib < 512, "{mib} MiB");
        return;
    }
    if !is_slow_wanted(name) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_large(&folder.path().join("large.tif"));
    let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
    let test = format!("robust::{name}");
    let status = alone.args(["--exact", &test, "--nocapture"]).env(ALONE, folder.path()).status();
    assert!(status.unwrap().success());
}

//! How long building an archive takes, and how that grows with the data.
//!
//! In:    SRTM tiles of synthetic hills, written into a temporary folder.
//! Out:   criterion's report: one, two and four 3″ tiles, one 1″ tile.
//! Keeps: nothing.
//! Not here: queries (`core/benches/ground.rs`).

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use overfly_archive::Datum;
use overfly_core::digest::mix;
use overfly_core::geodesy::Ellipsoid;
use overfly_ingest::raster::OpenOptions;
use overfly_ingest::{BuildOptions, build};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// An SRTM tile: ridges of several lengths and a metre or two of noise, as radar has it.
fn write_tile(folder: &Path, lon_deg: u32, side: u32) -> PathBuf {
    let wave = |at: f64| {
        let part = at - at.floor();
        4.0 * part * (1.0 - part)
    };
    let mut bytes = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let [x, y] = [column, row].map(|at| f64::from(at) / f64::from(side - 1));
            let ridges = 900.0 * wave(2.0 * x + y) + 300.0 * wave(9.0 * y - 4.0 * x);
            let noise = (mix(u64::from(row) << 32 | u64::from(column)) % 5) as f64;
            let height_m = 200.0 + ridges + 60.0 * wave(40.0 * (x + y)) + noise;
            #[expect(clippy::cast_possible_truncation, reason = "below 2000")]
            bytes.extend((height_m as i16).to_be_bytes());
        }
    }
    let path = folder.join(format!("N47E{lon_deg:03}.hgt"));
    std::fs::write(&path, bytes).expect("the temporary folder takes files");
    path
}

fn options(inputs: Vec<PathBuf>, folder: &Path) -> BuildOptions {
    BuildOptions {
        inputs,
        open: OpenOptions::default(),
        output: folder.join("out.pmtiles"),
        body: ("Earth".into(), Ellipsoid::WGS84),
        datum: Datum::Ellipsoid,
        geoid: None,
        blend_m: None,
        level_max: None,
        density: None,
    }
}

fn growth(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let tiles: Vec<_> = (10..14).map(|lon| write_tile(folder.path(), lon, 1201)).collect();
    let fine = write_tile(folder.path(), 20, 3601);
    let mut group = criterion.benchmark_group("ingest");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    let cases = [
        ("one 3\" tile", tiles[..1].to_vec(), 1201_u64 * 1201),
        ("two 3\" tiles", tiles[..2].to_vec(), 2 * 1201 * 1201),
        ("four 3\" tiles", tiles, 4 * 1201 * 1201),
        ("one 1\" tile", vec![fine], 3601 * 3601),
    ];
    for (name, inputs, postings) in cases {
        let options = options(inputs, folder.path());
        group.throughput(Throughput::Elements(postings));
        group.bench_function(name, |bencher| {
            bencher.iter(|| build(&options, &AtomicBool::new(false), &|_| {}).expect("it builds"));
        });
    }
    group.finish();
}

criterion_group!(benches, growth);
criterion_main!(benches);

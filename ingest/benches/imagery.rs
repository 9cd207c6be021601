//! How long an archive of imagery takes to build, and how large it is.
//!
//! In:    a PNG of a made-up world, 2048 and 4096 columns wide, written into a temporary folder.
//! Out:   criterion's report; tiles and bytes on standard error.
//! Keeps: nothing.
//! Not here: heights (`ingest`).

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use overfly_core::digest::mix;
use overfly_core::geodesy::Ellipsoid;
use overfly_ingest::{ImageryOptions, build_imagery};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Bands of land and sea with the grain of a photograph.
fn write_world(folder: &Path, width: u32) -> PathBuf {
    let path = folder.join(format!("world-{width}.png"));
    let file = File::create(&path).expect("the temporary folder takes files");
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, width / 2);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let wave = |at: f64| {
        let part = at - at.floor();
        4.0 * part * (1.0 - part)
    };
    let mut data = Vec::new();
    for row in 0..width / 2 {
        for column in 0..width {
            let [x, y] = [column, row].map(|at| f64::from(at) / f64::from(width));
            let land = wave(3.0 * x + 2.0 * y) * wave(5.0 * y - 2.0 * x) + 0.3 * wave(40.0 * x);
            let grain = (mix(u64::from(row) << 32 | u64::from(column)) % 7) as f64;
            let base = if land > 0.5 { [90.0, 100.0, 60.0] } else { [15.0, 40.0, 80.0] };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a byte")]
            data.extend(base.map(|part| (part + 60.0 * land + grain).clamp(0.0, 255.0) as u8));
        }
    }
    let mut writer = encoder.write_header().expect("the temporary folder takes files");
    writer.write_image_data(&data).expect("the temporary folder takes files");
    writer.finish().expect("the temporary folder takes files");
    path
}

fn growth(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut group = criterion.benchmark_group("imagery");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    for width in [2048, 4096] {
        let options = ImageryOptions {
            input: write_world(folder.path(), width),
            projection: None,
            bounds_deg: None,
            attribution: String::new(),
            output: folder.path().join("out.pmtiles"),
            body: ("Earth".into(), Ellipsoid::WGS84),
        };
        let build = || build_imagery(&options, &AtomicBool::new(false), &|_| {});
        let report = build().expect("it builds");
        eprintln!(
            "{width}: {} bytes in, {} tiles, {} bytes",
            report.bytes_in, report.tiles, report.bytes
        );
        group.throughput(Throughput::Elements(u64::from(width) * u64::from(width / 2)));
        group.bench_function(format!("{width} columns"), |bencher| {
            bencher.iter(|| build().expect("it builds"));
        });
    }
    group.finish();
}

criterion_group!(benches, growth);
criterion_main!(benches);

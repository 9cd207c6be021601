//! The ground under a recorded flight: as high as the flight model that flew it found.
//!
//! In:    the ingested 3″ tile of Mount Rainier over a global base; the log of a C172.
//! Out:   passes or fails; skipped by name where the data is not there.
//! Keeps: a folder for the archive, thrown away.
//! Not here: the ingest (`overfly_ingest`), made-up ground (`grounds`).

use overfly::archive::{Datum, OpenOptions};
use overfly::config;
use overfly::core::geodesy::{Ellipsoid, Geodetic};
use overfly::core::ground::Query;
use overfly::ingest::{BuildOptions, build, raster};
use overfly::sources::Sources;
use overfly::surveyor::Surveyor;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Real elevation and flights, beside the repository; says so where they are not.
fn data(test: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let found = folder.is_dir();
    if !found {
        println!("{test} skipped: no {}", folder.display());
    }
    found.then_some(folder)
}

fn ingest(data: &Path, output: PathBuf) {
    let dem = data.join("dem");
    let options = BuildOptions {
        inputs: ["etopo20_1080x540_i16.tif", "mt_rainier_90m.tif"].map(|f| dem.join(f)).to_vec(),
        open: raster::OpenOptions::default(),
        output,
        body: ("Earth".into(), Ellipsoid::WGS84),
        datum: Datum::Egm96,
        geoid: Some(dem.join("egm96_15.gtx")),
        blend_m: None,
        level_max: None,
        // At the default the ground between postings strays farther from their bilinear surface, by
        // which the log was made: 3.5 m rms.
        density: Some(2.2),
    };
    build(&options, &AtomicBool::new(false), &|_| ()).unwrap();
}

/// Position, height above sea level and above the ground of every line of the log.
fn log(path: &Path) -> Vec<(Geodetic, f64, f64)> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let titles = reader.headers().unwrap().clone();
    let column = |title: &str| titles.iter().position(|found| found == title).unwrap();
    let columns = ["lat_deg", "lon_deg", "alt_msl_m", "agl_m"].map(column);
    let line = |record: csv::StringRecord| {
        let [lat, lon, msl_m, agl_m] = columns.map(|at| record[at].parse::<f64>().unwrap());
        (Geodetic::from_degrees(lat, lon, 0.0), msl_m, agl_m)
    };
    reader.records().map(|record| line(record.unwrap())).collect()
}

#[test]
fn heights_above_the_ground_along_rainier_are_those_of_the_log_within_3_m_rms() {
    let test = "heights_above_the_ground_along_rainier_are_those_of_the_log_within_3_m_rms";
    let Some(data) = data(test) else { return };
    let folder = tempfile::tempdir().unwrap();
    ingest(&data, folder.path().join("rainier.pmtiles"));
    let scene = folder.path().join("rainier.ron");
    let text =
        "Scene(body: Wgs84, sources: [Archive(\"rainier.pmtiles\"), Procedural(seed: 2029)])";
    std::fs::write(&scene, text).unwrap();
    let scene = config::load(&scene.display().to_string()).unwrap();
    let sources = Sources::open(&scene, &OpenOptions::default()).unwrap();
    let mut surveyor = Surveyor::new(Arc::new(sources), 512);
    let log = log(&data.join("flights/rainier/c172_10hz.csv"));
    assert!(log.len() > 5000);
    let mut worst_m: f64 = 0.0;
    let mut squares = 0.0;
    for &(at, msl_m, agl_m) in &log {
        let answer = surveyor.height(at, Query::BestResident).unwrap();
        let ground = answer.ok().expect("a surveyor loads what it needs");
        let difference_m = msl_m - (ground.height_m - ground.sea_level_m) - agl_m;
        squares += difference_m * difference_m;
        worst_m = worst_m.max(difference_m.abs());
    }
    let rms_m = (squares / log.len() as f64).sqrt();
    println!("{} positions: rms {rms_m:.3} m, at most {worst_m:.3} m", log.len());
    assert!(rms_m <= 3.0, "rms {rms_m} m, at most {worst_m} m");
}

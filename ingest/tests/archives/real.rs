//! The real files as archives: how near their postings, how many bytes, whatever the threads.
//!
//! In:    `../shared/data/dem`.
//! Out:   pass or fail, or a line that it was skipped.
//! Keeps: nothing.
//! Not here: pages (`pages`, `seams`), bounds (`bounds`).

use crate::atlas::{Atlas, EARTH, at, build, verify};
use crate::rasters::options;
use crate::{is_slow_wanted, shared_data};
use overfly_core::datasource::facts::Datum;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::Query;
use overfly_ingest::raster::{Raster, open};
use overfly_ingest::{BuildOptions, Difference, Report};
use std::io::Cursor;
use std::path::Path;
use tiff::encoder::colortype::GrayI16;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder};

/// Strips have so many bytes before they are packed, unless rows are longer: the TIFF
/// specification's advice, and GDAL's default.
const STRIP_BYTES: u32 = 8192;

/// All postings as int16.
fn postings(raster: &Raster) -> Vec<i16> {
    let (columns, rows) = (raster.grid.columns as usize, i64::from(raster.grid.rows));
    let (mut all, mut part) = (Vec::new(), Vec::new());
    for row in 0..rows {
        raster.window(0, row, columns, 1, &mut part).unwrap();
        all.extend(part.iter().map(|m| if m.is_nan() { i16::MIN } else { *m as i16 }));
    }
    all
}

/// Bytes of the same postings as GeoTIFF: strips, deflated, no predictor.
fn deflated(raster: &Raster) -> u64 {
    let mut file = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut file).unwrap();
    let mut encoder = encoder.with_compression(Compression::Deflate(DeflateLevel::Balanced));
    let [columns, rows] = [raster.grid.columns, raster.grid.rows];
    let mut image = encoder.new_image::<GrayI16>(columns, rows).unwrap();
    image.rows_per_strip(STRIP_BYTES / (2 * columns)).unwrap();
    image.write_data(&postings(raster)).unwrap();
    file.into_inner().len() as u64
}

fn of(data: &Path, files: &[&str], folder: &Path) -> BuildOptions {
    let inputs: Vec<_> = files.iter().map(|file| data.join("dem").join(file)).collect();
    let geoid = Some(data.join("dem/egm96_15.gtx"));
    BuildOptions { datum: Datum::Egm96, geoid, ..options(&inputs, &folder.join("a.pmtiles")) }
}

/// Builds, compares, and holds the bytes against GeoTIFF's.
fn built(options: &BuildOptions) -> (Report, Vec<Difference>) {
    let report = build(options).unwrap();
    let differences = verify(options);
    let mut plain = 0;
    for input in &options.inputs {
        plain += open(input, &options.open).unwrap().iter().map(deflated).sum::<u64>();
    }
    let on_disk = std::fs::metadata(&options.output).unwrap().len();
    assert_eq!(report.bytes, on_disk);
    let share = report.bytes as f64 / plain as f64;
    for found in &differences {
        let name = found.name.file_name().unwrap().to_string_lossy();
        let Difference { level, compared, hidden, rms_m, p99_m, max_m, .. } = found;
        eprintln!(
            "{name}: level {level}, {compared} compared, {hidden} hidden, rms {rms_m:.3}, \
             p99 {p99_m:.2}, max {max_m:.2} m; {share:.3} of {plain} bytes"
        );
    }
    assert!(share <= 1.5, "{share}");
    (report, differences)
}

fn check_srtm(options: &BuildOptions) {
    let (report, differences) = built(options);
    let compared: u64 = differences.iter().map(|found| found.compared + found.hidden).sum();
    assert_eq!(compared, report.postings[0] - report.postings[1], "every posting is accounted for");
    for found in differences {
        assert!(found.compared * 100 >= (found.compared + found.hidden) * 99, "{found:?}");
        assert!(found.rms_m <= 0.5 && found.max_m <= 6.0, "{found:?}");
    }
}

#[test]
fn rainier_comes_back_and_its_summit_is_as_high_as_the_grids() {
    let name = "rainier_comes_back_and_its_summit_is_as_high_as_the_grids";
    let Some(data) = shared_data(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let options = of(&data, &["mt_rainier_90m.tif"], folder.path());
    check_srtm(&options);
    let atlas = Atlas::open(&[&options.output], EARTH);
    let ground = atlas.ground(at(46.8523, -121.7603), atlas.depth());
    let mut highest = (f64::MIN, at(0.0, 0.0));
    for step in 0..200 * 200 {
        let [north, east] = [step / 200, step % 200].map(|i| f64::from(i - 100) * 1e-4);
        let place = at(46.8523 + north, -121.7603 + east);
        if let Some(found) = ground.height(place, Query::BestResident).found() {
            let height_m = found.height_m - found.sea_level_m;
            if height_m > highest.0 {
                highest = (height_m, place);
            }
        }
    }
    let (height_m, place) = highest;
    eprintln!("{name}: {height_m:.2} m at {place:?}");
    assert!((height_m - 4371.0).abs() <= 3.0, "{height_m}");
    assert!((place.lat_rad.to_degrees() - 46.8523).abs() < 0.005, "{place:?}");
    assert!((place.lon_rad.to_degrees() + 121.7603).abs() < 0.005, "{place:?}");
}

#[test]
fn neighbouring_srtm_tiles_come_back_as_one() {
    let Some(data) = shared_data("neighbouring_srtm_tiles_come_back_as_one") else { return };
    let folder = tempfile::tempdir().unwrap();
    check_srtm(&of(&data, &["N49E011.hgt.zip", "N50E011.hgt.zip"], folder.path()));
}

#[test]
fn fuji_and_nice_come_back() {
    let Some(data) = shared_data("fuji_and_nice_come_back") else { return };
    let folder = tempfile::tempdir().unwrap();
    check_srtm(&of(&data, &["N43E007.hgt.zip"], folder.path()));
    check_srtm(&of(&data, &["mt_fuji_90m.tif"], folder.path()));
}

#[test]
fn a_tile_of_one_arc_second_comes_back() {
    let name = "a_tile_of_one_arc_second_comes_back";
    let Some(data) = shared_data(name).filter(|_| is_slow_wanted(name)) else { return };
    let folder = tempfile::tempdir().unwrap();
    check_srtm(&of(&data, &["N48W125.hgt.zip"], folder.path()));
}

#[test]
fn the_earth_and_mars_come_back() {
    let Some(data) = shared_data("the_earth_and_mars_come_back") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mars = Ellipsoid { a_m: 3_396_000.0, f: 0.0 };
    let earth = of(&data, &["etopo20_1080x540_i16.tif"], folder.path());
    let red = of(&data, &["mars_mola_1440x720_i16.tif"], folder.path());
    let red =
        BuildOptions { body: ("mars".into(), mars), datum: Datum::Ellipsoid, geoid: None, ..red };
    for options in [earth, red] {
        let (report, differences) = built(&options);
        assert_eq!(differences.len(), 1);
        let [found] = &differences[..] else { unreachable!("one source") };
        assert_eq!((found.compared, found.hidden), (report.postings[0], 0));
        // Where a face of the octahedron is widest Mars has more postings than points.
        assert!(found.rms_m <= 40.0 && found.p99_m <= 200.0, "{found:?}");
    }
}

#[test]
fn archives_are_the_same_from_any_number_of_threads() {
    let Some(data) = shared_data("archives_are_the_same_from_any_number_of_threads") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let options = of(&data, &["etopo20_1080x540_i16.tif", "N49E011.hgt.zip"], folder.path());
    let bytes = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build(&options)).unwrap();
        std::fs::read(&options.output).unwrap()
    });
    assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2], "bytes depend on threads");
}

//! Small rasters of chosen ground, as GeoTIFF files.
//!
//! In:    corner, step, size, a height for every place.
//! Out:   files; options to build archives from them.
//! Keeps: nothing.
//! Not here: layouts of files (`tiff_file`).

use crate::tiff_file::{Number, Packing, TiffFile};
use overfly_core::datasource::facts::Datum;
use overfly_core::digest::mix;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::geodesy::trig::{cos, sin};
use overfly_ingest::BuildOptions;
use overfly_ingest::raster::OpenOptions;
use std::path::{Path, PathBuf};

/// What a raster has where it has no height.
pub const VOID: f64 = -32768.0;

/// Postings in degrees, from the north-west one on.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Longitude and latitude of the first.
    pub first_deg: [f64; 2],
    /// From one to the next, east and south.
    pub step_deg: [f64; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Sheet {
    /// Square cells.
    pub fn new(first_deg: [f64; 2], step_deg: f64, size: [u32; 2]) -> Self {
        Self { first_deg, step_deg: [step_deg; 2], size }
    }

    /// The whole body, no posting on a pole or on ±180°.
    pub fn world(step_deg: f64) -> Self {
        let size = [360.0, 180.0].map(|turn| (turn / step_deg).round() as u32);
        let half = 0.5 * step_deg;
        Self::new([-180.0 + half, 90.0 - half], step_deg, size)
    }

    /// Longitude and latitude of a posting.
    pub fn place_deg(&self, column: u32, row: u32) -> [f64; 2] {
        let east = f64::from(column) * self.step_deg[0];
        [self.first_deg[0] + east, self.first_deg[1] - f64::from(row) * self.step_deg[1]]
    }

    /// A file of int16, or of float32, with this height at each longitude and latitude.
    pub fn write(
        &self,
        path: &Path,
        number: Number,
        height_m: impl Fn(f64, f64) -> f64,
    ) -> PathBuf {
        let [columns, rows] = self.size;
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let height = |(column, row)| {
            let [lon, lat] = self.place_deg(column, row);
            let height_m = height_m(lon, lat);
            if number == Number::I16 { height_m.round() } else { height_m }
        };
        let file = TiffFile {
            number,
            packing: Packing::Deflate,
            rows_per_strip: 16,
            scale: vec![self.step_deg[0], self.step_deg[1], 0.0],
            tie: vec![0.0, 0.0, 0.0, self.first_deg[0], self.first_deg[1], 0.0],
            keys: vec![[1024, 2], [1025, 2], [2048, 4326], [2054, 9102]],
            nodata: Some("-32768".into()),
            ..TiffFile::new(self.size, places.map(height).collect())
        };
        std::fs::write(path, file.bytes()).unwrap();
        path.to_owned()
    }

    /// A file of int16.
    pub fn write_whole(&self, path: &Path, height_m: impl Fn(f64, f64) -> f64) -> PathBuf {
        self.write(path, Number::I16, height_m)
    }
}

/// Rugged ground with a coast, −500 to 2400 m: waves of several lengths and rubble.
pub fn rugged_m(lon_deg: f64, lat_deg: f64) -> f64 {
    let wave = |per_degree: f64, turn: f64| {
        let [x, y] = [lon_deg, lat_deg].map(|deg| (deg * per_degree * 360.0 + turn).to_radians());
        sin(x) * cos(y)
    };
    let cell = |deg: f64| ((deg + 400.0) * 3600.0).round() as u64;
    let rubble = (mix(cell(lon_deg) << 32 | cell(lat_deg)) >> 40) as f64 / f64::from(1 << 24);
    950.0
        + 900.0 * wave(1.7, 20.0)
        + 350.0 * wave(7.3, 70.0)
        + 120.0 * wave(31.0, 5.0)
        + 60.0 * rubble
}

/// Ground of continents, −5000 to 5000 m, the same on both sides of ±180°.
pub fn world_m(lon_deg: f64, lat_deg: f64) -> f64 {
    let wave = |east: f64, north: f64| {
        sin((lon_deg * east).to_radians()) * cos((lat_deg * north).to_radians())
    };
    let taper = cos(lat_deg.to_radians());
    taper * (2500.0 * wave(1.0, 2.0) + 1500.0 * wave(4.0, 5.0) + 900.0 * wave(9.0, 13.0))
        + 300.0 * sin((3.0 * lat_deg).to_radians())
}

/// An archive of these inputs above the ellipsoid of the Earth.
pub fn options(inputs: &[PathBuf], output: &Path) -> BuildOptions {
    BuildOptions {
        inputs: inputs.to_vec(),
        open: OpenOptions::default(),
        output: output.to_owned(),
        body: ("earth".into(), Ellipsoid::WGS84),
        datum: Datum::Ellipsoid,
        geoid: None,
        blend_m: None,
        level_max: None,
        density: None,
    }
}

//! Where the postings of a raster lie on the body.
//!
//! In:    longitude and latitude in radians, or a place in postings.
//! Out:   the other one.
//! Keeps: nothing.
//! Not here: heights (`Raster`), ellipsoidal heights (`geoid`).

use overfly_core::geodesy::trig;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Radius of the sphere behind Web Mercator (EPSG:3857), in metres, on any body.
pub const MERCATOR_RADIUS_M: f64 = 6_378_137.0;

/// How longitude and latitude become columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Degrees of longitude and latitude, as EPSG:4326 and the geographic systems of other bodies.
    PlateCarree,
    /// Metres of EPSG:3857.
    WebMercator,
}

/// A lattice of postings. Rows run south, columns east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// What `origin` and `step` count in.
    pub projection: Projection,
    /// Postings from west to east.
    pub columns: u32,
    /// Postings from north to south.
    pub rows: u32,
    /// The place of posting (0, 0) itself (of the pixel's centre, where pixels are areas):
    /// longitude and latitude in degrees, or Mercator x and y in metres.
    pub origin: [f64; 2],
    /// From one posting to the next, east (> 0) and south (< 0), in the unit of `origin`.
    pub step: [f64; 2],
    /// Whether the columns go exactly once round the body, so that column −1 is the last one.
    pub wraps: bool,
}

impl Grid {
    /// A grid that knows by itself whether it goes once round the body: within a hundredth of
    /// a posting.
    pub fn new(projection: Projection, size: [u32; 2], origin: [f64; 2], step: [f64; 2]) -> Self {
        let round = f64::from(size[0]) * step[0] - period(projection);
        let wraps = round.abs() < 0.01 * step[0].abs();
        Self { projection, columns: size[0], rows: size[1], origin, step, wraps }
    }

    /// Column and row, in postings with fraction, of a place; it may lie outside the grid.
    ///
    /// Of all longitudes that differ by full turns, the one next to the grid's middle is taken.
    /// `None` where the projection has no such place: the poles in Mercator, and NaN.
    pub fn place(&self, lon_rad: f64, lat_rad: f64) -> Option<[f64; 2]> {
        let [x, y] = match self.projection {
            Projection::PlateCarree => [lon_rad.to_degrees(), lat_rad.to_degrees()],
            Projection::WebMercator => [lon_rad * MERCATOR_RADIUS_M, mercator_north_m(lat_rad)?],
        };
        let turn = period(self.projection);
        let middle = 0.5 * (f64::from(self.columns) - 1.0) * self.step[0];
        let east = x - self.origin[0];
        let east = east - turn * ((east - middle) / turn).round();
        let place = [east / self.step[0], (y - self.origin[1]) / self.step[1]];
        place.iter().all(|part| part.is_finite()).then_some(place)
    }

    /// Longitude (in (−π, π]) and latitude in radians of a place in postings.
    pub fn lon_lat(&self, column: f64, row: f64) -> [f64; 2] {
        let x = self.origin[0] + column * self.step[0];
        let y = self.origin[1] + row * self.step[1];
        let (lon_rad, lat_rad) = match self.projection {
            Projection::PlateCarree => (x.to_radians(), y.to_radians()),
            Projection::WebMercator => (x / MERCATOR_RADIUS_M, mercator_lat_rad(y)),
        };
        let lon_rad = if lon_rad > -PI && lon_rad <= PI {
            lon_rad
        } else {
            PI - (PI - lon_rad).rem_euclid(TAU)
        };
        [lon_rad, lat_rad]
    }

    /// Distance between neighbouring postings, east and north, in metres on a sphere of
    /// `radius_m`, at the grid's middle row.
    ///
    /// Plate carrée: the north spacing is the same everywhere, the east spacing goes with the
    /// cosine of latitude. Mercator: both go with it.
    pub fn spacing_m(&self, radius_m: f64) -> [f64; 2] {
        let middle_row = 0.5 * (f64::from(self.rows) - 1.0);
        let cos_lat = trig::cos(self.lon_lat(0.0, middle_row)[1]).abs();
        let [east, north] = [self.step[0].abs(), self.step[1].abs()];
        match self.projection {
            Projection::PlateCarree => {
                [east.to_radians() * cos_lat * radius_m, north.to_radians() * radius_m]
            }
            Projection::WebMercator => {
                let metres = cos_lat * radius_m / MERCATOR_RADIUS_M;
                [east * metres, north * metres]
            }
        }
    }
}

/// A full turn in the unit of x.
fn period(projection: Projection) -> f64 {
    match projection {
        Projection::PlateCarree => 360.0,
        Projection::WebMercator => TAU * MERCATOR_RADIUS_M,
    }
}

/// y of EPSG:3857. Even in sign, so that the two hemispheres mirror each other to the bit.
fn mercator_north_m(lat_rad: f64) -> Option<f64> {
    // cos(π/2) is 6e-17 in f64: closer than this there is no y worth having.
    let beyond = lat_rad.is_nan() || lat_rad.abs() >= FRAC_PI_2 - 1e-9;
    if beyond {
        return None;
    }
    let tan = trig::tan(lat_rad.abs());
    let north = MERCATOR_RADIUS_M * trig::ln(tan + trig::hypot(1.0, tan));
    Some(north.copysign(lat_rad))
}

fn mercator_lat_rad(y: f64) -> f64 {
    let grown = trig::exp((y / MERCATOR_RADIUS_M).abs());
    trig::atan2(0.5 * (grown - 1.0 / grown), 1.0).copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(projection: Projection, columns: u32, rows: u32) -> Grid {
        let step = period(projection) / f64::from(columns);
        let top = 0.5 * (f64::from(rows) - 1.0) * step;
        let origin = [-0.5 * period(projection) + 0.5 * step, top];
        Grid::new(projection, [columns, rows], origin, [step, -step])
    }

    #[test]
    fn places_and_positions_are_inverse_in_both_projections() {
        for projection in [Projection::PlateCarree, Projection::WebMercator] {
            let grid = world(projection, 4096, 2048);
            for (column, row) in [(0.0, 0.0), (4095.0, 2047.0), (17.25, 1023.5), (2047.5, 3.0)] {
                let [lon, lat] = grid.lon_lat(column, row);
                let back = grid.place(lon, lat).unwrap();
                assert!((back[0] - column).abs() < 1e-9, "{projection:?} {back:?} {column}");
                assert!((back[1] - row).abs() < 1e-9, "{projection:?} {back:?} {row}");
            }
        }
    }

    #[test]
    fn longitudes_are_brought_to_the_grid_across_the_antimeridian() {
        let grid = Grid::new(Projection::PlateCarree, [21, 11], [179.0, 10.0], [0.1, -0.1]);
        assert!(!grid.wraps);
        let [column, _] = grid.place((-180.0_f64).to_radians(), 0.1).unwrap();
        assert!((column - 10.0).abs() < 1e-9, "{column}");
        let [column, _] = grid.place(181.0_f64.to_radians(), 0.1).unwrap();
        assert!((column - 20.0).abs() < 1e-9, "{column}");
        let [lon, _] = grid.lon_lat(20.0, 0.0);
        assert!((lon - (-179.0_f64).to_radians()).abs() < 1e-12, "{lon}");
    }

    #[test]
    fn mercator_has_no_poles_and_the_known_square() {
        let grid = world(Projection::WebMercator, 256, 256);
        assert!(grid.wraps);
        assert_eq!(grid.place(0.0, FRAC_PI_2), None);
        assert_eq!(grid.place(0.0, -FRAC_PI_2), None);
        assert_eq!(grid.place(0.0, f64::NAN), None);
        // The square's edge lies at 85.0511287798066 degrees.
        let [_, row] = grid.place(0.0, 85.051_128_779_806_6_f64.to_radians()).unwrap();
        assert!((row + 0.5).abs() < 1e-9, "{row}");
    }

    #[test]
    fn spacing_is_of_the_middle_row() {
        let grid = Grid::new(
            Projection::PlateCarree,
            [1201, 1201],
            [7.0, 61.0],
            [1.0 / 1200.0, -1.0 / 1200.0],
        );
        let [east, north] = grid.spacing_m(6_371_000.0);
        assert!((north - 92.66).abs() < 0.01, "{north}");
        assert!((east - north * 60.5_f64.to_radians().cos_by_trig()).abs() < 1e-9, "{east}");
    }

    trait CosByTrig {
        fn cos_by_trig(self) -> f64;
    }

    impl CosByTrig for f64 {
        fn cos_by_trig(self) -> f64 {
            trig::cos(self)
        }
    }
}

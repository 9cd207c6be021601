//! Where a picture lies, and which tiles may show something of it.
//!
//! In:    the picture's size and georeference; projection and bounds as the caller gives them.
//! Out:   a [`Grid`] of pixels; the depth that its pixels ask for; keys.
//! Keeps: nothing.
//! Not here: colours (`texels`).

use super::picture::Picture;
use crate::block::lon_lat_of;
use crate::raster::{Grid, MERCATOR_RADIUS_M, Projection, RasterError};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::colour::{COLOUR_BITS, COLOUR_DEPTH_MAX, COLOUR_SIDE, texel_point};
use overfly_core::geodesy::trig;
use overfly_core::lattice::normal_of;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Bounds in Mercator end here, in degrees: beyond, pixels become larger than any picture.
const MERCATOR_LAT_MAX: f64 = 89.0;

/// The grid of a picture's pixels.
///
/// # Errors
/// The picture does not say where it lies, its shape is not that of the whole body, it says so
/// twice, or the bounds are none.
pub fn grid_of(
    picture: &Picture,
    projection: Option<Projection>,
    bounds_deg: Option<[f64; 4]>,
) -> Result<Grid, RasterError> {
    let refused = |found: String, advice| RasterError::unsupported(&picture.name, found, advice);
    if let Some((grid, _)) = picture.georeference {
        if projection.is_some() || bounds_deg.is_some() {
            let given = if bounds_deg.is_some() { "--bounds" } else { "--projection" };
            let found = format!("{given} is given, but the file says itself where it lies");
            return Err(refused(found, "leave it out"));
        }
        return Ok(grid);
    }
    let projection = projection.unwrap_or(Projection::PlateCarree);
    let [columns, rows] = picture.size;
    let [west, south, east, north] = match (bounds_deg, projection) {
        (Some(bounds), _) => edges(picture, projection, bounds)?,
        (None, Projection::PlateCarree) if u64::from(columns) == 2 * u64::from(rows) => {
            [-180.0, -90.0, 180.0, 90.0]
        }
        (None, Projection::WebMercator) if columns == rows => {
            let edge = PI * MERCATOR_RADIUS_M;
            [-edge, -edge, edge, edge]
        }
        (None, _) => {
            let shape = match projection {
                Projection::PlateCarree => "the whole body is twice as wide as high",
                Projection::WebMercator => "the whole Mercator square is as wide as high",
            };
            let found = format!("its size is {columns} × {rows} pixels, but {shape}");
            return Err(refused(
                found,
                "give its edges in degrees: --bounds WEST,SOUTH,EAST,NORTH",
            ));
        }
    };
    let step = [(east - west) / f64::from(columns), (south - north) / f64::from(rows)];
    let origin = [west + 0.5 * step[0], north + 0.5 * step[1]];
    Ok(Grid::new(projection, picture.size, origin, step))
}

/// Bounds in the unit of the projection.
fn edges(
    picture: &Picture,
    projection: Projection,
    bounds: [f64; 4],
) -> Result<[f64; 4], RasterError> {
    let [west, south, east, north] = bounds;
    let most = if projection == Projection::WebMercator { MERCATOR_LAT_MAX } else { 90.0 };
    let wide = 0.0 < east - west && east - west <= 360.0 && west.abs() <= 540.0;
    let high = -most <= south && south < north && north <= most;
    if !(wide && high) {
        let found = format!("its bounds are {bounds:?}");
        let advice = format!(
            "allowed are WEST < EAST, at most 360 apart, and SOUTH < NORTH from -{most} to {most}"
        );
        return Err(RasterError::unsupported(&picture.name, found, advice));
    }
    Ok(match projection {
        Projection::PlateCarree => bounds,
        Projection::WebMercator => {
            let x = |degrees: f64| degrees.to_radians() * MERCATOR_RADIUS_M;
            let y = |degrees: f64| {
                let tan = trig::tan(degrees.to_radians().abs());
                let north = MERCATOR_RADIUS_M * trig::ln(tan + trig::hypot(1.0, tan));
                north.copysign(degrees)
            };
            [x(west), y(south), x(east), y(north)]
        }
    })
}

/// The depth whose texels are as dense as the pixels in the picture's middle, or just denser.
pub fn depth_of(grid: &Grid) -> u8 {
    let middle = grid.lon_lat(0.5 * f64::from(grid.columns - 1), 0.5 * f64::from(grid.rows - 1));
    let normal =
        overfly_core::geodesy::Geodetic { lat_rad: middle[1], lon_rad: middle[0], height_m: 0.0 }
            .normal();
    let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
    // A unit of the square is so much of the unit sphere; on the mean where it goes round.
    let share = if grid.wraps { PI } else { sum * sum * sum };
    let [east, north] = grid.spacing_m(1.0);
    let enough = |&depth: &u8| {
        let step = texel_step(depth);
        share * step * step <= east * north
    };
    (0..COLOUR_DEPTH_MAX).find(enough).unwrap_or(COLOUR_DEPTH_MAX)
}

/// Distance of texels along the square's axes; the quadrant is 1.
pub fn texel_step(depth: u8) -> f64 {
    1.0 / (1_u64 << (depth + COLOUR_BITS)) as f64
}

/// A part of the body between two latitudes and around a longitude. Radians.
struct Region {
    south: f64,
    north: f64,
    middle: f64,
    half_width: f64,
}

/// Keys of all tiles down to `depth` that may show something of a picture.
pub fn keys(grid: &Grid, depth: u8) -> Vec<PageKey> {
    let (columns, rows) = (f64::from(grid.columns), f64::from(grid.rows));
    let [_, north] = grid.lon_lat(0.0, -0.5);
    let [_, south] = grid.lon_lat(0.0, rows - 0.5);
    let [middle, _] = grid.lon_lat(0.5 * (columns - 1.0), 0.0);
    let turn = match grid.projection {
        Projection::PlateCarree => 360.0,
        Projection::WebMercator => TAU * MERCATOR_RADIUS_M,
    };
    let half_width = 0.5 * columns * grid.step[0] / turn * TAU;
    let region = Region { south, north, middle, half_width };
    let mut found = Vec::new();
    let mut open: Vec<PageKey> = (0..4).map(PageKey::root).collect();
    while let Some(key) = open.pop() {
        if !region.may_meet(key) {
            continue;
        }
        found.push(key);
        if key.depth() < depth {
            open.extend((0..4).map(|index| key.child(index)));
        }
    }
    found
}

impl Region {
    /// Whether a tile, with what its border texels take in from beyond it, may meet the region.
    fn may_meet(&self, key: PageKey) -> bool {
        if key.depth() < 2 {
            return true;
        }
        let last = COLOUR_SIDE - 1;
        let normal = |i: usize, j: usize| normal_of(texel_point(key, i, j));
        let centre = normal(last / 2, last / 2);
        // Sides of tiles are great circles, so a cap that holds the corners holds all of it.
        let corners = [normal(0, 0), normal(last, 0), normal(0, last), normal(last, last)];
        let reach =
            corners.map(|corner| trig::atan2(centre.cross(corner).length(), centre.dot(corner)));
        let margin = 6.0 * texel_step(key.depth());
        let reach = reach.into_iter().fold(0.0, f64::max) + margin;
        let [lon, lat] = lon_lat_of(centre);
        if lat + reach < self.south || lat - reach > self.north {
            return false;
        }
        if lat.abs() + reach >= FRAC_PI_2 {
            return true;
        }
        let (sin, cos) = (trig::sin(reach), trig::cos(lat));
        let width = trig::atan2(sin, (cos * cos - sin * sin).max(0.0).sqrt());
        let apart = (lon - self.middle + PI).rem_euclid(TAU) - PI;
        apart.abs() <= self.half_width + width
    }
}

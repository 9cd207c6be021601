//! How high the geoid, mean sea level, lies above the ellipsoid.
//!
//! In:    a latitude and a longitude; a GTX grid, or nothing.
//! Out:   the undulation there in metres: ellipsoidal height = height above the geoid + it.
//! Keeps: a grid of undulations, filled in as it is asked for.
//! Not here: heights of the ground (`raster`).
//! Source: EGM96 (NGA), harmonics to degree 360 by the `egm96` crate.

mod gtx;
mod nodes;

use crate::raster::RasterError;
use nodes::{NodeGrid, Place};
use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// A geoid as a grid of undulations, bilinear between its nodes. Shared between threads freely.
pub struct Geoid {
    grid: NodeGrid,
    nodes: Nodes,
}

enum Nodes {
    /// All of them, from a file.
    Read(Vec<f32>),
    /// Bits of those computed so far; NaN where none was yet. Two threads that compute the same
    /// one get the same bits, so neither waits.
    Computed(Vec<AtomicU32>),
}

/// Distance between the nodes at which EGM96's harmonics are summed.
///
/// A node costs 0.6 to 1 ms, once, when first asked for, on whichever thread asks; all of a
/// 1° tile's 25 cost about 20 ms. Errors are those of bilinear interpolation, measured against
/// the harmonics themselves at 2000 random points of the globe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeSpacing {
    /// 15 arc minutes, as the official grid: rms 4 cm, worst 35 cm. The nodes agree with that
    /// grid's to 0.2 mm. The world has 1 038 240 nodes: some 10 to 17 minutes of one core.
    Arcmin15,
    /// 30 arc minutes: rms 16 cm, worst 1.6 m. The world has 259 920 nodes: 3 to 4 minutes.
    Arcmin30,
    /// One degree: rms 51 cm, worst 6 m. The world has 65 160 nodes: about one minute.
    Degree1,
}

impl Geoid {
    /// EGM96 from its harmonics, every 15 arc minutes. Nothing is computed yet.
    pub fn egm96() -> Self {
        Self::egm96_spaced(NodeSpacing::Arcmin15)
    }

    /// EGM96 from its harmonics at wider nodes, for whole worlds: see [`NodeSpacing`].
    pub fn egm96_spaced(spacing: NodeSpacing) -> Self {
        let per_degree = match spacing {
            NodeSpacing::Arcmin15 => 4,
            NodeSpacing::Arcmin30 => 2,
            NodeSpacing::Degree1 => 1,
        };
        let step = 1.0 / f64::from(per_degree);
        let grid =
            NodeGrid::new([360 * per_degree, 180 * per_degree + 1], [-180.0, -90.0], [step; 2]);
        let empty = || AtomicU32::new(f32::NAN.to_bits());
        let nodes = (0..grid.count()).map(|_| empty()).collect();
        Self { grid, nodes: Nodes::Computed(nodes) }
    }

    /// A geoid from a GTX grid, the format of NOAA's VDatum, whole Earth or part of it.
    pub fn from_gtx(path: &Path) -> Result<Self, RasterError> {
        let (grid, nodes) = gtx::read(path)?;
        Ok(Self { grid, nodes: Nodes::Read(nodes) })
    }

    /// Height of the geoid above the ellipsoid, in metres; NaN outside a regional grid and at
    /// its voids. Latitudes beyond a pole count as the pole.
    pub fn undulation_m(&self, lat_rad: f64, lon_rad: f64) -> f64 {
        let Some(Place { column, row, next, fraction: [east, north] }) =
            self.grid.place(lat_rad, lon_rad)
        else {
            return f64::NAN;
        };
        let mix = |a: f64, b: f64, t: f64| if t == 0.0 { a } else { a + (b - a) * t };
        let along = |row| {
            let west = self.node_m(column, row);
            if east == 0.0 { west } else { mix(west, self.node_m(next, row), east) }
        };
        let south = along(row);
        if north == 0.0 { south } else { mix(south, along(row + 1), north) }
    }

    fn node_m(&self, column: u32, row: u32) -> f64 {
        let index = self.grid.index(column, row);
        let node = match &self.nodes {
            Nodes::Read(nodes) => return f64::from(nodes[index]),
            Nodes::Computed(nodes) => &nodes[index],
        };
        let known = f32::from_bits(node.load(Ordering::Relaxed));
        if !known.is_nan() {
            return f64::from(known);
        }
        let [lon_deg, lat_deg] = self.grid.lon_lat_deg(column, row);
        // A pole is one place, whatever its longitude.
        let lon_deg = if lat_deg.abs() == 90.0 { 0.0 } else { lon_deg };
        let summed = egm96::egm96_compute_altitude_offset(lat_deg, lon_deg);
        let summed = overfly_core::geodesy::narrow(summed);
        node.store(summed.to_bits(), Ordering::Relaxed);
        f64::from(summed)
    }
}

impl fmt::Debug for Geoid {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.debug_struct("Geoid").field("grid", &self.grid).finish_non_exhaustive()
    }
}

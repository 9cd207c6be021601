//! Nodes of a geoid grid: which ones lie round a place.
//!
//! In:    a latitude and a longitude.
//! Out:   the lower left of the four nodes round them, and where between they are.
//! Keeps: nothing.
//! Not here: undulations.

/// Nodes in rows that run north, columns that run east.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeGrid {
    columns: u32,
    rows: u32,
    /// Longitude and latitude of node (0, 0), in degrees.
    origin_deg: [f64; 2],
    step_deg: [f64; 2],
    /// Whether the columns go once round.
    wraps: bool,
}

/// A place between four nodes.
#[derive(Debug, PartialEq)]
pub(super) struct Place {
    /// The column to the west, and the one to the east.
    pub column: u32,
    pub next: u32,
    /// The row to the south; the other is the one after it, and needed only if `fraction[1]` > 0.
    pub row: u32,
    /// How far on to the next column and row, in [0, 1).
    pub fraction: [f64; 2],
}

impl NodeGrid {
    pub fn new(size: [u32; 2], origin_deg: [f64; 2], step_deg: [f64; 2]) -> Self {
        let round = f64::from(size[0]) * step_deg[0];
        let wraps = (round - 360.0).abs() < 0.01 * step_deg[0];
        Self { columns: size[0], rows: size[1], origin_deg, step_deg, wraps }
    }

    pub fn count(&self) -> usize {
        self.index(0, self.rows)
    }

    pub fn index(&self, column: u32, row: u32) -> usize {
        let index = u64::from(row) * u64::from(self.columns) + u64::from(column);
        usize::try_from(index).expect("grids are held in memory")
    }

    /// Where a node lies.
    pub fn lon_lat_deg(&self, column: u32, row: u32) -> [f64; 2] {
        [
            self.origin_deg[0] + f64::from(column) * self.step_deg[0],
            self.origin_deg[1] + f64::from(row) * self.step_deg[1],
        ]
    }

    /// `None` outside the grid. Latitudes beyond a pole count as the pole.
    pub fn place(&self, lat_rad: f64, lon_rad: f64) -> Option<Place> {
        let lat_deg = lat_rad.to_degrees().clamp(-90.0, 90.0);
        let east_deg = (lon_rad.to_degrees() - self.origin_deg[0]).rem_euclid(360.0);
        // A rounding short of the first column is not a turn beyond it.
        let east_deg = if east_deg > 360.0 - 1e-9 { 0.0 } else { east_deg };
        let rows = self.cell((lat_deg - self.origin_deg[1]) / self.step_deg[1], self.rows)?;
        let at = east_deg / self.step_deg[0];
        let (column, east) = if self.wraps {
            let (column, _) = self.cell(at.floor(), self.columns)?;
            (column, at - at.floor())
        } else {
            self.cell(at, self.columns)?
        };
        let next = if column + 1 == self.columns && self.wraps { 0 } else { column + 1 };
        Some(Place { column, next, row: rows.0, fraction: [east, rows.1] })
    }

    /// Number of the node before `at` among `count`, and the fraction behind it. The edges have
    /// a little slack for angles that were radians.
    fn cell(&self, at: f64, count: u32) -> Option<(u32, f64)> {
        let last = f64::from(count - 1);
        if !(-1e-9..=last + 1e-9).contains(&at) {
            return None;
        }
        let at = at.clamp(0.0, last);
        let whole = at.floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..count")]
        let number = whole as u32;
        Some((number, at - whole))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_column_of_a_world_is_followed_by_the_first() {
        let grid = NodeGrid::new([1440, 721], [-180.0, -90.0], [0.25, 0.25]);
        let place = grid.place(0.0, 179.875_f64.to_radians()).unwrap();
        assert_eq!((place.column, place.next, place.row), (1439, 0, 360));
        assert!((place.fraction[0] - 0.5).abs() < 1e-9);
        assert_eq!(grid.place(0.0, 180_f64.to_radians()).unwrap().column, 0);
        assert_eq!(grid.place(0.0, (-1e-17_f64 - 180.0).to_radians()).unwrap().column, 0);
    }

    #[test]
    fn poles_are_rows_and_beyond_them_nothing_changes() {
        let grid = NodeGrid::new([360, 181], [-180.0, -90.0], [1.0, 1.0]);
        let north = grid.place(90_f64.to_radians(), 0.0).unwrap();
        assert_eq!((north.row, north.fraction[1]), (180, 0.0));
        assert_eq!(grid.place(2.0, 0.0), Some(north));
        assert_eq!(grid.place(-2.0, 0.0).unwrap().row, 0);
    }

    #[test]
    fn a_region_ends_at_its_edges() {
        let grid = NodeGrid::new([11, 11], [5.0, 45.0], [0.1, 0.1]);
        assert!(grid.place(45_f64.to_radians(), 5_f64.to_radians()).is_some());
        assert!(grid.place(46_f64.to_radians(), 6_f64.to_radians()).is_some());
        assert!(grid.place(46.01_f64.to_radians(), 6_f64.to_radians()).is_none());
        assert!(grid.place(45_f64.to_radians(), 4.99_f64.to_radians()).is_none());
        assert!(grid.place(f64::NAN, 0.1).is_none());
        assert!(grid.place(0.8, f64::NAN).is_none());
    }
}

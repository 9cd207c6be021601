//! A tile: what the layers of one archive know of one cell, as whole numbers.
//!
//! In:    filled by `overfly_ingest`, or decoded from an archive's bytes by `codec`.
//! Out:   heights, weights, sea level and marks at lattice points within the cell.
//! Keeps: its own arrays.
//! Not here: bytes (`codec`), what several layers and the planet add up to (`compose`).
//!
//! Everything is a pure function of the lattice point: a point that two tiles share has the same
//! numbers in both, whatever their depth. Between the samples of a layer's last level, heights go
//! on linearly over the triangles of the even lattice level, in exact integers.

use super::key::{PAGE_BITS, PAGE_SIDE, PageKey};
use super::page::SAMPLES;
use crate::lattice::unfold;
use glam::IVec3;

/// A weight of 1.
pub const FULL: u8 = 255;
/// Marks are kept for every eighth sample.
pub const MARK_STRIDE: usize = 8;
/// Marks along one side of a tile.
pub const MARK_SIDE: usize = (PAGE_SIDE - 1) / MARK_STRIDE + 1;
/// Marks speak of everything within this many samples of them along both axes: as far as the
/// descendants of a diamond at the mark reach when patches have depth 4 or less, which is 7.6.
/// The boxes around the marks that enclose a place cover the box around the place. Deeper patches
/// reach farther: they read the marks of a coarser tile.
pub const MARK_REACH: usize = 8;
/// Unit of [`Mark::range`], in metres.
pub const RANGE_UNIT_M: f64 = 8.0;
/// Sea level is kept in this unit, in metres.
pub const SEA_LEVEL_UNIT_M: f64 = 1.0 / 32.0;
/// Sea level is kept on no finer grid than R/2^10: 6 to 15 km on the Earth.
pub const SEA_LEVEL_GRID_MAX: u8 = 10;

/// What the layers of one archive know of one cell.
#[derive(Clone, PartialEq, Debug)]
pub struct Tile {
    /// Which cell.
    pub key: PageKey,
    /// Its layers, by rising depth; only those with something in this cell.
    pub layers: Vec<LayerTile>,
}

/// What one layer knows of one cell.
#[derive(Clone, PartialEq, Debug)]
pub struct LayerTile {
    /// Index among the archive's layers.
    pub layer: u8,
    /// Heights above sea level in the layer's quanta; sample (i, j) at `j * PAGE_SIDE + i`.
    /// Meaningless where the weight is 0.
    pub quanta: Box<[i32; SAMPLES]>,
    /// Share of this layer in what is seen, of [`FULL`]; `None`: all of it everywhere.
    pub weights: Option<Box<[u8; SAMPLES]>>,
    /// Where the source had a void; `None`: nowhere.
    pub filled: Option<Box<[bool; SAMPLES]>>,
    /// Sea level above the ellipsoid in [`SEA_LEVEL_UNIT_M`], on [`sea_level_side`]² points.
    pub sea_level: Vec<i32>,
    /// Marks; (i, j) at `j * MARK_SIDE + i`.
    pub marks: Box<[Mark; MARK_SIDE * MARK_SIDE]>,
}

/// Bounds around one sample, over everything within [`MARK_REACH`], finer data included. The first
/// four are logarithmic, see [`metres_of`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Mark {
    /// Height between the layer and the triangles of the odd level whose finest samples these are.
    pub error_odd: u8,
    /// The same for the even level.
    pub error_even: u8,
    /// Difference to the height at the mark, where it has weight.
    pub variation: u8,
    /// Greatest height difference along an axis between neighbouring samples of the last level.
    pub slope: u8,
    /// How rough the ground is, 0 to 15: what finer detail grows with.
    pub roughness: u8,
    /// The greatest roughness around.
    pub roughest: u8,
    /// Whether the layer has less than full weight somewhere around.
    pub edge: bool,
    /// At an edge: least and greatest height where it has weight, in [`RANGE_UNIT_M`], rounded
    /// outwards; the least is above the greatest where it has none.
    pub range: [i16; 2],
}

/// A layer at one place.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Reading {
    /// Share of the layer, 0 to 1.
    pub weight: f64,
    /// Height above sea level times the weight, in metres.
    pub weighted_m: f64,
    /// Sea level above the ellipsoid in metres.
    pub sea_level_m: f64,
    /// Whether the nearest sample filled a void.
    pub filled: bool,
    /// Offsets from the sample before, as shares of a step of the tile, along u and v.
    pub between: [f64; 2],
}

/// Samples of a tile that enclose a place: the cell's first corner and the way from there, in
/// 1/`parts` of a step.
#[derive(Clone, Copy)]
struct Spot {
    column: usize,
    row: usize,
    along: [i64; 2],
    parts: i64,
}

/// The greatest logarithmic bound.
pub const BOUND_MAX: u8 = 91;

/// Metres of a logarithmic bound: 0, then from 1 mm on 30 % more each, to 20 000 km.
pub fn metres_of(bound: u8) -> f64 {
    const LEAST_M: f64 = 1e-3;
    const MORE: f64 = 1.3;
    let power = |exponent: u32| {
        let (mut result, mut factor, mut left) = (1.0, MORE, exponent);
        while left > 0 {
            if left & 1 == 1 {
                result *= factor;
            }
            (factor, left) = (factor * factor, left >> 1);
        }
        result
    };
    if bound == 0 { 0.0 } else { LEAST_M * power(u32::from(bound) - 1) }
}

/// The least bound that is not below `metres`.
pub fn bound_of(metres: f64) -> u8 {
    let (mut below, mut enough) = (0_u8, BOUND_MAX);
    if metres <= 0.0 {
        return 0;
    }
    while enough - below > 1 {
        let middle = below + (enough - below) / 2;
        if metres_of(middle) < metres { below = middle } else { enough = middle }
    }
    enough
}

/// The grid R/2^g on which a layer of this depth keeps sea level.
pub fn sea_level_grid(layer_depth: u8) -> u8 {
    (layer_depth + PAGE_BITS - 1).min(SEA_LEVEL_GRID_MAX)
}

/// Points of sea level along one side of a tile: those of the grid, two at least, or all samples.
pub fn sea_level_side(tile_depth: u8, grid: u8) -> usize {
    (1 << grid.saturating_sub(tile_depth).min(PAGE_BITS)) + 1
}

impl LayerTile {
    /// The layer's weight at sample `at`, of [`FULL`].
    pub fn weight(&self, at: usize) -> u8 {
        self.weights.as_ref().map_or(FULL, |weights| weights[at])
    }

    /// Reads the layer at a lattice point of the tile `key`, which may lie between its samples.
    /// `grid` is the layer's [`sea_level_grid`].
    pub fn read(&self, key: PageKey, point: IVec3, quantum_m: f64, grid: u8) -> Reading {
        let spot = Spot::new(key, point);
        let [(a, wa), (b, wb), (c, wc)] = spot.corners();
        let (mut weight, mut weighted, mut nearest) = (0, 0, (a, wa));
        for (at, share) in [(a, wa), (b, wb), (c, wc)] {
            let part = share * i64::from(self.weight(at));
            weight += part;
            weighted += part * i64::from(self.quanta[at]);
            nearest = if share > nearest.1 { (at, share) } else { nearest };
        }
        let whole = (spot.parts * i64::from(FULL)) as f64;
        Reading {
            weight: weight as f64 / whole,
            weighted_m: weighted as f64 / whole * quantum_m,
            sea_level_m: self.sea_level_m(key, point, grid),
            filled: self.filled.as_ref().is_some_and(|filled| filled[nearest.0]),
            between: spot.along.map(|along| along as f64 / spot.parts as f64),
        }
    }

    /// Sea level at a lattice point: bilinear between the points of its grid. The product of
    /// integers is exact, so tiles of all depths agree.
    fn sea_level_m(&self, key: PageKey, point: IVec3, grid: u8) -> f64 {
        let side = sea_level_side(key.depth(), grid);
        if self.sea_level.len() != side * side {
            return 0.0;
        }
        let (u, v) = unfold(key.quadrant(), point);
        let (u0, v0) = key.origin();
        // The tile's own cells, or the one cell of the grid that holds the tile.
        let cell = (key.side() >> (side - 1).ilog2()).max(crate::lattice::RADIUS >> grid);
        let ([base_u, base_v], last) = if side > 2 || key.depth() <= grid {
            ([u0, v0], i32::try_from(side - 2).expect("at most 63"))
        } else {
            ([u0 / cell * cell, v0 / cell * cell], 0)
        };
        let place = |along: i32| {
            let index = (along / cell).min(last);
            (usize::try_from(index).expect("inside the tile"), i64::from(along - index * cell))
        };
        let ((i, a), (j, b)) = (place(u - base_u), place(v - base_v));
        let at = |i: usize, j: usize| i64::from(self.sea_level[j * side + i]);
        let whole = i64::from(cell);
        // In halves, so that the product of a 30-bit cell with itself stays exact in 128 bits.
        let lower = i128::from(at(i, j) * (whole - a) + at(i + 1, j) * a);
        let upper = i128::from(at(i, j + 1) * (whole - a) + at(i + 1, j + 1) * a);
        let sum = lower * i128::from(whole - b) + upper * i128::from(b);
        sum as f64 / (whole as f64 * whole as f64) * SEA_LEVEL_UNIT_M
    }

    /// The worst of the marks around a lattice point of the tile.
    pub fn mark_around(&self, key: PageKey, point: IVec3) -> Mark {
        let spot = Spot::new(key, point);
        let mut worst: Option<Mark> = None;
        for at in spot.marks() {
            let mark = self.marks[at];
            worst = Some(worst.map_or(mark, |worst| worst.worse(mark)));
        }
        worst.expect("four marks")
    }

    /// Least and greatest height that the marks around a lattice point speak of, in metres; only
    /// where none of them is at an edge.
    pub fn range_around(&self, key: PageKey, point: IVec3, quantum_m: f64) -> [f64; 2] {
        let spot = Spot::new(key, point);
        let mut range_m = [f64::MAX, f64::MIN];
        for at in spot.marks() {
            let (i, j) = (at % MARK_SIDE * MARK_STRIDE, at / MARK_SIDE * MARK_STRIDE);
            let height_m = f64::from(self.quanta[j * PAGE_SIDE + i]) * quantum_m;
            let variation_m = metres_of(self.marks[at].variation);
            let [low_m, high_m] = range_m;
            range_m = [low_m.min(height_m - variation_m), high_m.max(height_m + variation_m)];
        }
        range_m
    }

    /// Roughness at a place of the tile, 0 to 1: bilinear between marks.
    pub fn roughness(&self, key: PageKey, point: IVec3) -> f64 {
        let spot = Spot::new(key, point);
        let place = |at: usize, along: i64| {
            let cell = (at / MARK_STRIDE).min(MARK_SIDE - 2);
            let within = (at - cell * MARK_STRIDE) as f64 + along as f64 / spot.parts as f64;
            (cell, within / MARK_STRIDE as f64)
        };
        let ((i, a), (j, b)) = (place(spot.column, spot.along[0]), place(spot.row, spot.along[1]));
        let at = |i: usize, j: usize| f64::from(self.marks[j * MARK_SIDE + i].roughness);
        let lower = at(i, j) * (1.0 - a) + at(i + 1, j) * a;
        let upper = at(i, j + 1) * (1.0 - a) + at(i + 1, j + 1) * a;
        (lower * (1.0 - b) + upper * b) / 15.0
    }
}

impl Mark {
    /// What holds where both hold.
    pub fn worse(self, other: Self) -> Self {
        let (none, also_none) = (self.range[0] > self.range[1], other.range[0] > other.range[1]);
        let [low, high] = [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])];
        let range = match (none, also_none) {
            (true, _) => other.range,
            (_, true) => self.range,
            _ => [low, high],
        };
        Self {
            error_odd: self.error_odd.max(other.error_odd),
            error_even: self.error_even.max(other.error_even),
            variation: self.variation.max(other.variation),
            slope: self.slope.max(other.slope),
            roughness: self.roughness.max(other.roughness),
            roughest: self.roughest.max(other.roughest),
            edge: self.edge || other.edge,
            range,
        }
    }
}

impl Spot {
    fn new(key: PageKey, point: IVec3) -> Self {
        let (u, v) = unfold(key.quadrant(), point);
        let (u0, v0) = key.origin();
        let step = key.step();
        let place = |along: i32| {
            let last = PAGE_SIDE - 2;
            let at = usize::try_from(along / step).expect("the point is in the tile").min(last);
            let before = i32::try_from(at).expect("at most 63") * step;
            (at, i64::from(along - before))
        };
        let ((column, a), (row, b)) = (place(u - u0), place(v - v0));
        Self { column, row, along: [a, b], parts: i64::from(step) }
    }

    /// The marks around the place: four, or the same one several times.
    fn marks(&self) -> [usize; 4] {
        let ends = |at: usize, more: bool| {
            let next = at + usize::from(more);
            [at / MARK_STRIDE, next.div_ceil(MARK_STRIDE).min(MARK_SIDE - 1)]
        };
        let columns = ends(self.column, self.along[0] > 0);
        let [first, last] = ends(self.row, self.along[1] > 0).map(|row| row * MARK_SIDE);
        [first + columns[0], first + columns[1], last + columns[0], last + columns[1]]
    }

    /// The corners of the triangle that holds the place, with their shares of `parts`. The
    /// diagonal of a cell joins the corner whose indices are both odd with that of both even.
    fn corners(&self) -> [(usize, i64); 3] {
        let first = self.row * PAGE_SIDE + self.column;
        let (right, up) = (first + 1, first + PAGE_SIDE);
        let ([a, b], whole) = (self.along, self.parts);
        if self.column % 2 == self.row % 2 {
            if a >= b {
                [(first, whole - a), (right, a - b), (up + 1, b)]
            } else {
                [(first, whole - b), (up, b - a), (up + 1, a)]
            }
        } else if a + b <= whole {
            [(first, whole - a - b), (right, a), (up, b)]
        } else {
            [(up + 1, a + b - whole), (up, whole - a), (right, whole - b)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_the_least_that_hold() {
        assert_eq!((metres_of(0), bound_of(0.0), bound_of(-1.0)), (0.0, 0, 0));
        for bound in 1..BOUND_MAX {
            let metres = metres_of(bound);
            assert_eq!(bound_of(metres), bound);
            assert_eq!(bound_of(metres * 1.001), bound + 1);
            assert!(metres_of(bound + 1) / metres < 1.3001);
        }
        assert!(metres_of(BOUND_MAX) > 1.7e7);
    }

    fn slanted(key: PageKey, layer_depth: u8) -> LayerTile {
        let mut quanta = Box::new([0; SAMPLES]);
        for j in 0..PAGE_SIDE {
            for i in 0..PAGE_SIDE {
                let point = key.sample(i, j);
                quanta[j * PAGE_SIDE + i] = (point.x >> 12) - (point.z >> 14);
            }
        }
        let side = sea_level_side(key.depth(), sea_level_grid(layer_depth));
        LayerTile {
            layer: 0,
            quanta,
            weights: None,
            filled: None,
            sea_level: (0..).take(side * side).map(|at| at * 31 % 977).collect(),
            marks: Box::new([Mark::default(); MARK_SIDE * MARK_SIDE]),
        }
    }

    #[test]
    fn a_reading_between_samples_lies_on_their_triangle() {
        let key = PageKey::new(1, 5, 3, 9);
        let tile = slanted(key, 5);
        for (i, j) in [(0, 0), (7, 12), (63, 63), (20, 1)] {
            let [a, b] = [key.sample(i, j), key.sample(i + 1, j)];
            let at = |p| tile.read(key, p, 0.5, 10);
            let middle = at((a + b) / 2);
            assert_eq!(middle.weighted_m, (at(a).weighted_m + at(b).weighted_m) / 2.0);
            assert_eq!((middle.weight, middle.between), (1.0, [0.5, 0.0]));
        }
    }

    #[test]
    fn sea_level_is_the_same_from_tiles_of_all_depths() {
        // Depth 12 holds one cell's corners; its parents the grid's points around it.
        let grid = 10;
        let height = |u: i32, v: i32| ((u >> 20) * 37 + (v >> 20) * 11) % 3001;
        let tile_of = |key: PageKey| {
            let mut tile = slanted(key, 12);
            let side = sea_level_side(key.depth(), grid);
            let cell = (key.side() >> (side - 1).ilog2()).max(crate::lattice::RADIUS >> grid);
            let (u0, v0) = key.origin();
            let (u0, v0) = (u0 / cell * cell, v0 / cell * cell);
            let along = 0..i32::try_from(side).unwrap();
            let places = along.clone().flat_map(|j| along.clone().map(move |i| (i, j)));
            tile.sea_level = places.map(|(i, j)| height(u0 + i * cell, v0 + j * cell)).collect();
            tile
        };
        let deep = PageKey::new(2, 12, 1000, 777);
        for point in [deep.sample(0, 0), deep.sample(33, 8), deep.sample(64, 64)] {
            let expected = tile_of(deep).sea_level_m(deep, point, grid);
            for depth in 6..12 {
                let key = deep.ancestor(depth);
                let found = tile_of(key).sea_level_m(key, point, grid);
                assert_eq!(found, expected, "depth {depth}");
            }
        }
    }
}

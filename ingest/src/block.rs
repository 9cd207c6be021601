//! A block of lattice points: where they lie, and what a layer's rasters say there.
//!
//! In:    a square of one grid of one quadrant, with a margin; the rasters of a layer.
//! Out:   heights, weights and filled voids at its points; the postings among them.
//! Keeps: nothing.
//! Not here: fitting heights to postings (`fit`), tiles (`pyramid`).
//!
//! Every value is a function of the point alone, so that blocks which share a point agree. Points
//! beyond the quadrant are those of its neighbours, by reflection.

use crate::raster::{Grid, Projection, Raster, RasterError};
use crate::survey::{Survey, Window};
use glam::{DVec3, IVec3};
use overfly_core::geodesy::narrow;
use overfly_core::geodesy::trig::{atan2, cos, sin};
use overfly_core::lattice::{Quadrant, fold, normal_of};
use std::f64::consts::FRAC_PI_2;

/// Heights are fitted in this part of a metre.
pub const FINE: f64 = 65_536.0;
/// Postings read for one block at most; larger blocks are cut.
const POSTINGS_MAX: usize = 6 << 20;

/// Share of a blend over which weight stays full outside a raster: some lattice points.
const PLATEAU: f64 = 0.25;

/// A raster of a layer, finest first within it.
pub struct Sheet<'a> {
    /// The raster.
    pub raster: &'a Raster,
    /// What it holds.
    pub survey: &'a Survey,
    /// East and north distance of its postings in metres.
    pub spacing_m: [f64; 2],
}

/// A layer as blocks see it.
pub struct Layer<'a> {
    /// Its rasters; where two overlap, the first is seen.
    pub sheets: Vec<Sheet<'a>>,
    /// Width over which rasters are blended into each other and into what lies beneath.
    pub blend_m: f64,
    /// Lattice points lie R/2^grid apart.
    pub grid: u8,
}

/// A square of lattice points.
#[derive(Clone, Copy, Debug)]
pub struct Square {
    /// Of which quadrant.
    pub quadrant: Quadrant,
    /// First point in steps of the grid, the margin included; may lie beyond the quadrant.
    pub first: [i64; 2],
    /// Points along a side, the margin included.
    pub side: usize,
}

/// What the rasters say at the points of a square, row by row.
pub struct Block {
    /// Heights above the datum in 1/[`FINE`] metres.
    pub heights: Vec<i64>,
    /// Weight of the layer, 0 to 1.
    pub weights: Vec<f32>,
    /// Whether the height fills a void.
    pub filled: Vec<bool>,
    /// Postings within the square.
    pub postings: Vec<Posting>,
}

/// A posting, and the triangle of points around it.
#[derive(Clone, Copy)]
pub struct Posting {
    /// Points of the block.
    pub corners: [u32; 3],
    /// Their shares, of 65536.
    pub shares: [i32; 3],
    /// Height in 1/[`FINE`] metres.
    pub height: i64,
}

/// Longitude and latitude of a normal, in radians.
pub fn lon_lat_of(normal: DVec3) -> [f64; 2] {
    let across = (normal.x * normal.x + normal.y * normal.y).sqrt();
    [atan2(normal.y, normal.x), atan2(normal.z, across)]
}

impl Square {
    /// The lattice point at (column, row), reflected into a neighbour where it lies beyond.
    pub fn point(&self, grid: u8, column: usize, row: usize) -> IVec3 {
        let whole = 1_i64 << grid;
        let place = |first: i64, at: usize| first + i64::try_from(at).expect("small");
        let (u, v) = (place(self.first[0], column), place(self.first[1], row));
        let (quadrant, [u, v]) = reflect(self.quadrant, [u, v], whole);
        let lattice = |at: i64| i32::try_from(at << (30 - grid)).expect("within the quadrant");
        fold(quadrant, lattice(u), lattice(v))
    }

    /// Ways a normal can lie in this square, as fractional columns and rows: one, or several where
    /// the square's margin folds over a corner.
    fn places(&self, grid: u8, normal: DVec3) -> impl Iterator<Item = [f64; 2]> {
        let whole = f64::from(1_u32 << grid);
        let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
        let [x, y] = [normal.x.abs(), normal.y.abs()].map(|part| part / sum * whole);
        let [u, v] = if normal.z >= 0.0 { [x, y] } else { [whole - y, whole - x] };
        let (sx, sy) = overfly_core::lattice::signs(self.quadrant);
        let away = [normal.x * f64::from(sx) < 0.0, normal.y * f64::from(sy) < 0.0];
        // Across x = 0 lie u < 0 in the north and v > R in the south; across y = 0 the others.
        let both: [[f64; 2]; 4] = match away {
            [false, false] => [[u, v]; 4],
            [true, false] => [[-u, v], [u, 2.0 * whole - v], [-u, v], [-u, v]],
            [false, true] => [[u, -v], [2.0 * whole - u, v], [u, -v], [u, -v]],
            [true, true] => [
                [-u, -v],
                [2.0 * whole - u, 2.0 * whole - v],
                [-u, 2.0 * whole - v],
                [2.0 * whole - u, -v],
            ],
        };
        let first = self.first.map(|at| at as f64);
        let last = (self.side - 1) as f64;
        let ways = match away {
            [false, false] => 1,
            [true, true] => 4,
            _ => 2,
        };
        both.into_iter().take(ways).filter_map(move |[u, v]| {
            let place = [u - first[0], v - first[1]];
            place.iter().all(|at| (0.0..last).contains(at)).then_some(place)
        })
    }
}

/// A point of the plane around a quadrant, as a point of the quadrant that really lies there.
pub fn reflect(quadrant: Quadrant, [u, v]: [i64; 2], whole: i64) -> (Quadrant, [i64; 2]) {
    let (sx, sy) = overfly_core::lattice::signs(quadrant);
    // Crossing u = 0 or v = R crosses x = 0; crossing v = 0 or u = R crosses y = 0.
    let across_x = (u < 0) != (v > whole);
    let across_y = (v < 0) != (u > whole);
    let mirrored = |sign: i32, is: bool| if is { -sign } else { sign };
    let signs = (mirrored(sx, across_x), mirrored(sy, across_y));
    let found = (0..4).find(|&q| overfly_core::lattice::signs(q) == signs);
    let back = |at: i64| {
        if at < 0 {
            -at
        } else if at > whole {
            2 * whole - at
        } else {
            at
        }
    };
    (found.expect("four quadrants have all signs"), [back(u), back(v)])
}

/// How a raster stands to one point.
#[derive(Clone, Copy)]
struct Stand {
    /// Column and row in postings, moved to the raster's border if outside.
    place: [f64; 2],
    /// 1 within the raster, falling to 0 outside.
    weight: f64,
    /// 0 at the border and outside, rising to 1 within.
    inner: f64,
    inside: bool,
}

/// How the rasters of a layer make the height at a point.
struct Mixture {
    /// Sheets with their shares; sum 1.
    shares: Vec<(usize, f64)>,
    /// The layer's weight.
    weight: f64,
}

impl Sheet<'_> {
    fn stand(&self, lon_lat: [f64; 2], blend_m: f64) -> Option<Stand> {
        let grid = &self.raster.grid;
        let place = grid.place(lon_lat[0], lon_lat[1])?;
        let last = [f64::from(grid.columns) - 1.0, f64::from(grid.rows) - 1.0];
        let (mut outside_m, mut inside_m) = (0.0_f64, f64::MAX);
        let mut held = place;
        // Meridians come together towards the poles.
        let middle = grid.lon_lat(0.0, 0.5 * last[1])[1];
        let narrowing = cos(lon_lat[1]).max(0.0) / cos(middle).max(1e-3);
        for axis in 0..2 {
            let round = axis == 0 && grid.wraps;
            let polar = axis == 1 && grid.wraps && self.reaches_pole(place[1] > 0.5 * last[1]);
            if round || polar {
                continue;
            }
            // Half a nanoposting keeps borders that are equal on paper equal in binary.
            let beyond = (-place[axis]).max(place[axis] - last[axis]) - 1e-6;
            let posting_m = self.spacing_m[axis] * if axis == 0 { narrowing } else { 1.0 };
            outside_m = outside_m.max(beyond * posting_m);
            let within = place[axis].min(last[axis] - place[axis]).max(0.0);
            inside_m = inside_m.min(within * posting_m);
            held[axis] = place[axis].clamp(0.0, last[axis]);
        }
        if outside_m >= blend_m {
            return None;
        }
        // Full weight goes on a little, so that border postings have it all around.
        let fall = ((outside_m / blend_m - PLATEAU) / (1.0 - PLATEAU)).max(0.0);
        let inside = outside_m <= 0.0;
        let inner = if inside { (inside_m / blend_m).min(1.0) } else { 0.0 };
        Some(Stand { place: held, weight: 1.0 - fall * fall * (3.0 - 2.0 * fall), inner, inside })
    }

    /// Whether the raster's last row, or its first, is about the pole.
    fn reaches_pole(&self, last: bool) -> bool {
        let grid = &self.raster.grid;
        let row = if last { f64::from(grid.rows) - 1.0 } else { 0.0 };
        let from_pole = FRAC_PI_2 - grid.lon_lat(0.0, row)[1].abs();
        grid.projection == Projection::PlateCarree
            && from_pole <= 0.75 * grid.step[1].abs().to_radians()
    }
}

impl Layer<'_> {
    /// Whether any raster may have weight within the square, whose points lie R/2^`grid` apart.
    pub fn touches(&self, square: &Square, grid: u8, radius_m: f64) -> bool {
        const STEPS: usize = 4;
        let last = square.side - 1;
        let normals: Vec<DVec3> = (0..(STEPS + 1) * (STEPS + 1))
            .map(|at| [at % (STEPS + 1), at / (STEPS + 1)].map(|at| at * last / STEPS))
            .map(|[i, j]| normal_of(square.point(grid, i, j)))
            .collect();
        // No place of the square is farther from all of these points than the widest gap.
        let next = |at: usize| [at + 1, at + STEPS + 1, at + STEPS + 2];
        let gaps = (0..normals.len()).filter(|at| at % (STEPS + 1) < STEPS).flat_map(|at| {
            next(at).into_iter().filter_map({
                let normals = &normals;
                move |next| Some((*normals.get(next)? - normals[at]).length())
            })
        });
        let gap_m = gaps.fold(0.0, f64::max) * radius_m;
        normals.iter().any(|&normal| {
            let at = lon_lat_of(normal);
            self.sheets.iter().any(|s| s.stand(at, self.blend_m + 2.0 * gap_m).is_some())
        })
    }

    fn mixture(&self, lon_lat: [f64; 2], stands: &mut Vec<Option<Stand>>) -> Option<Mixture> {
        stands.clear();
        stands.extend(self.sheets.iter().map(|sheet| sheet.stand(lon_lat, self.blend_m)));
        let known = || stands.iter().enumerate().filter_map(|(i, stand)| Some((i, (*stand)?)));
        let mut shares: Vec<(usize, f64)> = Vec::new();
        // The least important first: each within it is covered by what comes after.
        for (index, stand) in
            known().filter(|(_, stand)| stand.inside).collect::<Vec<_>>().into_iter().rev()
        {
            let covers = if shares.is_empty() { 1.0 } else { stand.inner };
            shares.iter_mut().for_each(|(_, share)| *share *= 1.0 - covers);
            shares.push((index, covers));
        }
        let inside = !shares.is_empty();
        if !inside {
            let sum: f64 = known().map(|(_, stand)| stand.weight).sum();
            shares.extend(known().map(|(index, stand)| (index, stand.weight / sum)));
        }
        shares.retain(|(_, share)| *share > 0.0);
        let weight = known().map(|(_, stand)| stand.weight).fold(0.0, f64::max);
        (!shares.is_empty() && weight > 0.0).then_some(Mixture { shares, weight })
    }

    /// Whether the layer has any weight at a place.
    pub fn is_seen(&self, lon_lat: [f64; 2]) -> bool {
        self.sheets.iter().any(|sheet| sheet.stand(lon_lat, self.blend_m).is_some())
    }

    /// Whether a posting of sheet `index` is what is seen at its place.
    pub fn shows(&self, index: usize, lon_lat: [f64; 2]) -> bool {
        self.mixture(lon_lat, &mut Vec::new())
            .is_some_and(|mixture| matches!(mixture.shares[..], [(only, _)] if only == index))
    }

    /// What the rasters say in a square; `None` where too many postings lie in it at once.
    ///
    /// # Errors
    /// If a raster cannot be read.
    pub fn block(&self, square: &Square, all_at_once: bool) -> Result<Option<Block>, RasterError> {
        let count = square.side * square.side;
        let mut stands = Vec::new();
        let mut mixtures = Vec::with_capacity(count);
        let mut spans = vec![Span::default(); self.sheets.len()];
        for at in 0..count {
            let point = square.point(self.grid, at % square.side, at / square.side);
            let mixture = self.mixture(lon_lat_of(normal_of(point)), &mut stands);
            for &(index, _) in mixture.iter().flat_map(|mixture| &mixture.shares) {
                let stand = stands[index].expect("a share has a stand");
                spans[index].add(stand.place, &self.sheets[index].raster.grid);
            }
            mixtures.push(mixture.map(|mixture| {
                let place = |index: usize| stands[index].expect("a share has a stand").place;
                let shares = mixture.shares.iter().map(|&(i, share)| (i, share, place(i)));
                (shares.collect::<Vec<_>>(), mixture.weight)
            }));
        }
        let mut windows = Vec::new();
        for (sheet, span) in self.sheets.iter().zip(&spans) {
            let Some((first, size)) = span.window(&sheet.raster.grid) else {
                windows.push(None);
                continue;
            };
            if size[0] * size[1] > POSTINGS_MAX && !all_at_once {
                return Ok(None);
            }
            windows.push(Some(sheet.survey.window(sheet.raster, first, size)?));
        }
        let mut block = Block {
            heights: vec![0; count],
            weights: vec![0.0; count],
            filled: vec![false; count],
            postings: Vec::new(),
        };
        for (at, mixture) in mixtures.into_iter().enumerate() {
            let Some((shares, weight)) = mixture else { continue };
            let mut height_m = 0.0;
            for &(index, share, place) in &shares {
                let window = windows[index].as_ref().expect("a share has a window");
                let place = spans[index].unrolled(place, &self.sheets[index].raster.grid);
                height_m += share * window.bilinear(place);
                block.filled[at] |= share >= 0.5 && window.is_void(place);
            }
            block.heights[at] = fine(height_m);
            block.weights[at] = narrow(weight);
        }
        for (index, window) in windows.iter().enumerate() {
            if let Some(window) = window {
                self.gather(index, window, square, &mut block);
            }
        }
        Ok(Some(block))
    }

    /// The postings of a window that are seen and lie in the square.
    fn gather(&self, index: usize, window: &Window, square: &Square, block: &mut Block) {
        let grid = &self.sheets[index].raster.grid;
        let alone = self.sheets.len() == 1;
        let meridians = window.meridians(grid);
        for j in 0..window.height {
            let row = window.first[1] + i64::try_from(j).expect("small");
            if !(0..i64::from(grid.rows)).contains(&row) {
                continue;
            }
            let lat = grid.lon_lat(0.0, row as f64)[1];
            let parallel = [cos(lat), sin(lat)];
            let is_seen = |meridian: &&Meridian| {
                let whole = !window.void[j * window.width + meridian.column];
                whole && (alone || self.shows(index, [meridian.lon_rad, lat]))
            };
            for meridian in meridians.iter().filter(is_seen) {
                let height_m = window.heights_m[j * window.width + meridian.column];
                let normal = meridian.normal(parallel);
                self.put(square, normal, f64::from(height_m), &mut block.postings);
            }
        }
    }

    fn put(&self, square: &Square, normal: DVec3, height_m: f64, out: &mut Vec<Posting>) {
        let height = fine(height_m);
        out.extend(square.places(self.grid, normal).map(|place| posting(square, place, height)));
    }
}

impl Meridian {
    fn normal(&self, [cos_lat, sin_lat]: [f64; 2]) -> DVec3 {
        DVec3::new(cos_lat * self.cos, cos_lat * self.sin, sin_lat)
    }
}

/// The triangle around a place. Shares are whole parts of 65536, so that a reflected square finds
/// the same ones.
fn posting(square: &Square, [x, y]: [f64; 2], height: i64) -> Posting {
    let whole = 1_i32 << 16;
    #[expect(clippy::cast_possible_truncation, reason = "places lie within the square")]
    let split = |at: f64| (at.floor() as usize, ((at - at.floor()) * 65_536.0).round() as i32);
    let ((column, a), (row, b)) = (split(x), split(y));
    let first = row * square.side + column;
    let (right, up) = (first + 1, first + square.side);
    let even = |first: i64, at: usize| (first + i64::try_from(at).expect("small")).rem_euclid(2);
    let (corners, shares) = if even(square.first[0], column) == even(square.first[1], row) {
        if a >= b {
            ([first, right, up + 1], [whole - a, a - b, b])
        } else {
            ([first, up, up + 1], [whole - b, b - a, a])
        }
    } else if a + b <= whole {
        ([first, right, up], [whole - a - b, a, b])
    } else {
        ([up + 1, up, right], [a + b - whole, whole - a, whole - b])
    };
    Posting { corners: corners.map(|at| u32::try_from(at).expect("small")), shares, height }
}

fn fine(height_m: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "heights are below 1e6 m")]
    let fine = (height_m * FINE).round() as i64;
    fine
}

/// A column of a window that its raster has.
struct Meridian {
    /// Which of the window's.
    column: usize,
    lon_rad: f64,
    cos: f64,
    sin: f64,
}

/// The postings that points of a block lie among.
#[derive(Clone, Default)]
struct Span {
    /// Least and greatest column and row, columns unrolled from the first one seen.
    range: Option<[[f64; 2]; 2]>,
}

impl Span {
    fn add(&mut self, place: [f64; 2], grid: &Grid) {
        let [x, y] = self.unrolled(place, grid);
        let range = self.range.get_or_insert([[x, x], [y, y]]);
        range[0] = [range[0][0].min(x), range[0][1].max(x)];
        range[1] = [range[1][0].min(y), range[1][1].max(y)];
    }

    /// The place with its column within half a turn of the span's middle.
    fn unrolled(&self, [x, y]: [f64; 2], grid: &Grid) -> [f64; 2] {
        let Some([[low, high], _]) = self.range.filter(|_| grid.wraps) else { return [x, y] };
        let turn = f64::from(grid.columns);
        let middle = f64::midpoint(low, high);
        [x - turn * ((x - middle) / turn).round(), y]
    }

    /// First posting and size of the window, with some room around.
    fn window(&self, grid: &Grid) -> Option<([i64; 2], [usize; 2])> {
        let [columns, rows] = self.range?;
        #[expect(clippy::cast_possible_truncation, reason = "places lie in the raster")]
        let mut ends =
            [columns, rows].map(|[low, high]| [low.floor() as i64 - 2, high.ceil() as i64 + 3]);
        let turn = i64::from(grid.columns);
        if grid.wraps && ends[0][1] - ends[0][0] > turn / 2 {
            // Unrolling by a middle that moved may be off by a turn: take the whole round, twice.
            let middle = i64::midpoint(ends[0][0], ends[0][1]);
            ends[0] = [middle - turn - 4, middle + turn + 4];
        }
        let size = ends.map(|[low, high]| usize::try_from(high - low).expect("positive"));
        Some((ends.map(|[low, _]| low), size))
    }
}

impl Window {
    /// Its columns, once round the body at most.
    fn meridians(&self, grid: &Grid) -> Vec<Meridian> {
        let round = if grid.wraps { grid.columns as usize } else { self.width };
        let known = |column: i64| grid.wraps || (0..i64::from(grid.columns)).contains(&column);
        let columns = (self.first[0]..).zip(0..self.width.min(round));
        let meridian = |(at, column): (i64, usize)| {
            let lon_rad = grid.lon_lat(at as f64, 0.0)[0];
            Meridian { column, lon_rad, cos: cos(lon_rad), sin: sin(lon_rad) }
        };
        columns.filter(|&(at, _)| known(at)).map(meridian).collect()
    }

    fn cell(&self, place: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let limits = [self.width, self.height];
        let mut cell = [0; 2];
        let mut part = [0.0; 2];
        for axis in 0..2 {
            let at = place[axis] - self.first[axis] as f64;
            #[expect(clippy::cast_possible_truncation, reason = "clamped to the window")]
            let whole = (at.floor().max(1.0) as usize).min(limits[axis] - 3);
            (cell[axis], part[axis]) = (whole, (at - whole as f64).clamp(0.0, 1.0));
        }
        (cell, part)
    }

    /// Between the four postings around a place: what is commonly taken for the ground there.
    fn bilinear(&self, place: [f64; 2]) -> f64 {
        let ([column, row], [a, b]) = self.cell(place);
        let first = row * self.width + column;
        let at = |at: usize| f64::from(self.heights_m[at]);
        let lower = at(first) * (1.0 - a) + at(first + 1) * a;
        let upper = at(first + self.width) * (1.0 - a) + at(first + self.width + 1) * a;
        lower * (1.0 - b) + upper * b
    }

    fn is_void(&self, place: [f64; 2]) -> bool {
        let ([column, row], part) = self.cell(place);
        let near = [column + usize::from(part[0] > 0.5), row + usize::from(part[1] > 0.5)];
        self.void[near[1] * self.width + near[0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::lattice::RADIUS;

    /// Neighbours lie side by side, and the place between them is found there.
    fn assert_cell_is_small(square: &Square, grid: u8, i: usize, j: usize) {
        let at = |i, j| square.point(grid, i, j).as_dvec3();
        let step = f64::from(RADIUS >> grid);
        assert!((at(i, j) - at(i + 1, j)).length() < 2.5 * step, "{square:?} {i} {j}");
        assert!((at(i, j) - at(i, j + 1)).length() < 2.5 * step, "{square:?} {i} {j}");
        let middle = normal_of(((at(i, j) + at(i + 1, j)) / 2.0).as_ivec3());
        let found = square
            .places(grid, middle)
            .any(|[x, y]| (x - i as f64 - 0.5).abs() < 1e-3 && (y - j as f64).abs() < 1e-3);
        assert!(found || j == 0, "{square:?} {i} {j}");
    }

    #[test]
    fn reflected_points_lie_beside_the_border() {
        let (grid, side) = (8, 9);
        for quadrant in 0..4 {
            for first in [[-4, 100], [100, -4], [252, 30], [30, 252], [-4, -4], [252, 252]] {
                let square = Square { quadrant, first, side };
                let cells = (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (i, j)));
                cells.for_each(|(i, j)| assert_cell_is_small(&square, grid, i, j));
            }
        }
    }
}

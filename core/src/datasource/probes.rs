//! What the ground does between the samples of a page, and around it: looked at, not guessed.
//!
//! In:    a page's samples, a way to ask the ground at any lattice point.
//! Out:   [`Findings`] around any sample: residuals, range and rise of the ground within reach.
//! Keeps: one [`Block`] for each four by four cells of the page and of the apron around it.
//! Not here: what bounds are made of them (`generate`).
//!
//! Bounds from the octaves alone add up what never adds up: they are 10 to 100 times what a frame
//! shows. So every cell is probed at an inner point, the ground being asked with all of its
//! octaves, and the largest residual in reach counts, times [`surprise`] for what lies between.
//!
//! Reach. In sides of its square, along either axis of the unfolded octahedron, the descendants of
//! an even diamond lie within 1/2 + 1/2 + 1/4 + 1/8 + … = 3/2 of its centre: kids on the sides of
//! the square, their kids half as large, and so on. Those of an odd one lie within 1. The side is
//! 2^(k/2) samples for an even diamond, twice that for an odd one.
//!
//! What is known about a block is the same in every page whose apron holds it: so pages that share
//! a sample agree on its bound.

use super::key::{PAGE_SIDE, PageKey};
use super::page::{BOUND_SIDE, BOUND_STRIDE};
use super::procedural::Style;
use crate::geodesy::narrow;
use crate::lattice::{RADIUS, fold};
use core::ops::Range;
use glam::IVec3;

/// The ground strays from triangles by at most this many times what any probe within reach shows.
///
/// Calibrated, not proven: 64 probes at least are in reach of a diamond, and the middles of all
/// edges. With what [`hidden`] adds, random points of all triangles of meshes at eleven places over
/// planets of eight seeds strayed by 0.95 of their bound at most; `core/tests/bounds.rs` and the
/// measured flights hold it. Craters stand alone where noise is everywhere, so that more of them is
/// missed.
pub fn surprise(style: Style) -> f64 {
    match style {
        Style::Earthlike => 1.3,
        Style::Cratered => 8.0,
    }
}

/// And by so much of what the octaves bound on ground as rugged as was seen: what no probe shows, a
/// stream bed or a knoll that is alone, is as large as the octaves there have it. Where all is rugged
/// less stands out.
///
/// Calibrated as [`surprise`] is, over planets of eight seeds: with 0.05 everywhere, errors on gentle
/// ground were up to 1.25 of their bounds.
pub fn hidden(ruggedness: f64) -> f64 {
    let [gentle, rugged] = [(0.1, 0.18), (0.4, 0.06)];
    let along = ((ruggedness - gentle.0) / (rugged.0 - gentle.0)).clamp(0.0, 1.0);
    gentle.1 + along * (rugged.1 - gentle.1)
}

/// Probes lie on eighths of a cell.
const PARTS: i32 = 8;
/// Blocks along one side of a page.
const BLOCKS: usize = BOUND_SIDE - 1;
/// Where the cells of a block's first quarter are probed, in eighths: half of them in their middle,
/// where smooth ground strays most. The other quarters are mirror images, as they must be for pages
/// beyond the borders of a quadrant to find the same.
const PROBES: [(i32, i32); 4] = [(5, 3), (3, 5), (4, 4), (4, 4)];

/// What is looked at of the ground at a place.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Height above the ellipsoid, below water too, metres.
    pub height_m: f64,
    /// From 0, smooth, to 1.
    pub ruggedness: f64,
}

/// What is known about one block.
#[derive(Clone, Copy, Debug)]
struct Block {
    odd_m: f64,
    even_m: f64,
    shore_m: [f64; 2],
    low_m: f64,
    high_m: f64,
    ruggedness: f64,
}

/// What is known about the ground within reach of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Findings {
    /// Largest residuals of the triangles of odd and of even levels, metres.
    pub residual_m: [f64; 2],
    /// What edges of odd and of even levels cut of the corner between water at height 0 and land, at
    /// most, metres.
    pub shore_m: [f64; 2],
    /// Least and greatest height seen, metres.
    pub range_m: [f64; 2],
    /// Largest range of any block, metres.
    pub relief_m: f64,
    /// Largest ruggedness seen.
    pub ruggedness: f64,
}

/// The blocks of a page and of its apron.
pub struct Probes {
    reach: Reach,
    side: usize,
    blocks: Vec<Block>,
}

/// How far diamonds reach from the bounds around their centre, in blocks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reach {
    /// Odd diamonds.
    pub odd: usize,
    /// Even diamonds.
    pub even: usize,
}

/// What is looked at: a page, how its patches are cut, what the planet is like.
#[derive(Clone, Copy)]
pub struct Site {
    /// The page.
    pub key: PageKey,
    /// A leaf is 2^k triangles.
    pub patch_depth: u8,
    /// What the planet is like.
    pub style: Style,
    /// Whether water covers what lies below height 0.
    pub sea: bool,
}

impl Reach {
    /// In scenes of this patch depth.
    ///
    /// Centres of odd diamonds lie on kept bounds from k = 4 on, those of even ones from k = 6 on;
    /// others lie between bounds, of which all four count.
    pub fn of(patch_depth: u8) -> Self {
        let [odd, even] = match patch_depth / 2 {
            0 | 1 => [1, 1],
            2 => [2, 1],
            half => [(1 << half) / 2, 3 * (1 << half) / 8],
        };
        Self { odd, even }
    }
}

impl Probes {
    /// Looks at the ground in and around a page; `own` are its samples, `look` tells of any lattice
    /// points. `None` where the lattice has no points between samples.
    pub fn new(
        site: Site,
        own: &[Spot],
        mut look: impl FnMut(&[IVec3]) -> Vec<Spot>,
    ) -> Option<Self> {
        if site.key.step() < PARTS {
            return None;
        }
        let reach = Reach::of(site.patch_depth);
        let apron = reach.odd;
        let field = Field::new(site, apron, own, &mut look);
        let side = BLOCKS + 2 * apron;
        let places = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
        let probes = places.clone().flat_map(probes_of);
        let points: Vec<_> = probes.map(|(cell, parts)| field.point(cell, parts)).collect();
        let seen = look(&points);
        let seen = seen.chunks_exact(BOUND_STRIDE * BOUND_STRIDE);
        let blocks = places.zip(seen).map(|(at, seen)| field.block(at, seen)).collect();
        Some(Self { reach, side, blocks })
    }

    /// All blocks within reach of the bound at (i, j).
    pub fn around(&self, i: usize, j: usize) -> Findings {
        let mut found = Findings {
            residual_m: [0.0; 2],
            shore_m: [0.0; 2],
            range_m: [f64::INFINITY, f64::NEG_INFINITY],
            relief_m: 0.0,
            ruggedness: 0.0,
        };
        let apron = self.reach.odd;
        for y in j..j + 2 * apron {
            for block in &self.blocks[y * self.side + i..][..2 * apron] {
                found.residual_m[0] = greater(found.residual_m[0], block.odd_m);
                found.shore_m[0] = greater(found.shore_m[0], block.shore_m[0]);
                found.range_m[0] = -greater(-found.range_m[0], -block.low_m);
                found.range_m[1] = greater(found.range_m[1], block.high_m);
                found.relief_m = greater(found.relief_m, block.high_m - block.low_m);
                found.ruggedness = greater(found.ruggedness, block.ruggedness);
            }
        }
        let (first, count) = (apron - self.reach.even, 2 * self.reach.even);
        for y in j + first..j + first + count {
            for block in &self.blocks[y * self.side + i + first..][..count] {
                found.residual_m[1] = greater(found.residual_m[1], block.even_m);
                found.shore_m[1] = greater(found.shore_m[1], block.shore_m[1]);
            }
        }
        found
    }
}

/// Heights of a page's samples and of those around it.
struct Field {
    site: Site,
    /// Samples beyond each border.
    apron: usize,
    side: usize,
    spots: Vec<Spot>,
}

impl Field {
    fn new(
        site: Site,
        blocks: usize,
        own: &[Spot],
        look: &mut impl FnMut(&[IVec3]) -> Vec<Spot>,
    ) -> Self {
        let apron = blocks * BOUND_STRIDE;
        let side = PAGE_SIDE + 2 * apron;
        let within = |at: usize| (apron..apron + PAGE_SIDE).contains(&at);
        let mut field = Self { site, apron, side, spots: Vec::with_capacity(side * side) };
        let places = (0..side).flat_map(|j| (0..side).map(move |i| (i, j)));
        let is_own = |(i, j): (usize, usize)| within(i) && within(j);
        let around = places.clone().filter(|&at| !is_own(at));
        let points: Vec<_> = around.map(|at| field.point(at, (0, 0))).collect();
        let mut around = look(&points).into_iter();
        for (i, j) in places {
            let spot = if is_own((i, j)) {
                own[(j - apron) * PAGE_SIDE + i - apron]
            } else {
                around.next().expect("a spot for every point")
            };
            // As the page that holds it would keep it.
            let height_m = f64::from(narrow(spot.height_m));
            field.spots.push(Spot { height_m, ..spot });
        }
        field
    }

    fn at(&self, (i, j): (usize, usize)) -> f64 {
        self.spots[j * self.side + i].height_m
    }

    /// A block: all of its samples, the middles of its edges, what its probes have seen.
    fn block(&self, (x, y): (usize, usize), seen: &[Spot]) -> Block {
        let mut block = Block::EMPTY;
        let (i0, j0) = (x * BOUND_STRIDE, y * BOUND_STRIDE);
        for j in j0..=j0 + BOUND_STRIDE {
            for i in i0..=i0 + BOUND_STRIDE {
                block.see(self.spots[j * self.side + i]);
            }
        }
        // The hypotenuses of odd triangles are the sides of squares of two by two cells.
        for (j, i) in [0, 2, 4].into_iter().flat_map(|j| [0, 2].map(|i| (j, i))) {
            for (a, b, c) in [((i, j), (i + 1, j), (i + 2, j)), ((j, i), (j, i + 1), (j, i + 2))] {
                let at = |(i, j): (usize, usize)| self.at((i0 + i, j0 + j));
                let bend_m = (at(b) - f64::midpoint(at(a), at(c))).abs();
                block.odd_m = greater(block.odd_m, bend_m);
                block.even_m = greater(block.even_m, HALVED * bend_m);
            }
        }
        if self.site.patch_depth == 0 {
            for (j, i) in [0, 2].into_iter().flat_map(|j| [0, 2].map(|i| (j0 + j, i0 + i))) {
                block.even_m = greater(block.even_m, self.bend_m((i, j)));
            }
        }
        for ((cell, parts), &spot) in probes_of((x, y)).zip(seen) {
            block.see(spot);
            let [odd_m, even_m] = self.planes_m(cell, parts).map(|m| (spot.height_m - m).abs());
            block.odd_m = greater(block.odd_m, odd_m);
            block.even_m = greater(block.even_m, even_m);
        }
        if self.site.sea {
            self.flood((i0, j0), &mut block);
        }
        block
    }

    /// What lies under water is not drawn; where water and land meet, edges cut corners.
    fn flood(&self, at: (usize, usize), block: &mut Block) {
        let doubt_m = surprise(self.site.style) * greater(block.odd_m, block.even_m);
        if block.high_m < -doubt_m {
            (block.odd_m, block.even_m) = (0.0, 0.0);
        } else if block.low_m < doubt_m {
            // Few of the probes are on land there: its rise between them counts as if unseen.
            let rise_m = 0.25 * greater(block.high_m, 0.0);
            block.shore_m = self.shore_m(at, doubt_m).map(|cut_m| greater(cut_m, rise_m));
        }
    }

    /// Where an edge runs from a metres below the water to b above it, the corner between water and
    /// land is cut by ab/(a + b). The ground may be higher or lower than the edge by `doubt_m`, as ends
    /// of finer edges are.
    fn shore_m(&self, (i0, j0): (usize, usize), doubt_m: f64) -> [f64; 2] {
        let cut_m = |a: (usize, usize), b: (usize, usize)| {
            let (a_m, b_m) = (self.at(a), self.at(b));
            let (low_m, high_m) = if a_m < b_m { (a_m, b_m) } else { (b_m, a_m) };
            let (below_m, above_m) = (doubt_m - low_m, high_m + doubt_m);
            let cuts = below_m > 0.0 && above_m > 0.0;
            if cuts { below_m * above_m / (below_m + above_m) } else { 0.0 }
        };
        // The edges of a square of so many cells: two sides and both diagonals.
        let square = |(i, j): (usize, usize), size: usize| {
            let [a, b, c, d] = [(i, j), (i + size, j), (i, j + size), (i + size, j + size)];
            [cut_m(a, b), cut_m(c, d), cut_m(a, c), cut_m(b, d), cut_m(a, d), cut_m(b, c)]
        };
        let most = |size: usize, edges: Range<usize>| {
            let along = (0..BOUND_STRIDE).step_by(size);
            let places = along.clone().flat_map(|j| along.clone().map(move |i| (i0 + i, j0 + j)));
            let of_square = |at| square(at, size)[edges.clone()].iter().copied().fold(0.0, greater);
            places.map(of_square).fold(0.0, greater)
        };
        // Odd: the sides of two by two cells, and halves of their diagonals. Even: all of one cell; of
        // two by two where a patch is a single triangle.
        let even_m = most(if self.site.patch_depth == 0 { 2 } else { 1 }, 0..6);
        [greater(most(2, 0..4), most(1, 4..6)), even_m]
    }

    /// How far the diagonal that cuts a square of two by two cells strays in its middle.
    fn bend_m(&self, (i, j): (usize, usize)) -> f64 {
        let [mut a, mut b] = [(0, 0), (2, 2)];
        if self.is_anti((i, j), 2) {
            [a, b] = [(2, 0), (0, 2)];
        }
        let [a, b] = [a, b].map(|(di, dj)| self.at((i + di, j + dj)));
        (self.at((i + 1, j + 1)) - f64::midpoint(a, b)).abs()
    }

    /// Heights of the triangles of odd and of even levels at some place within a cell.
    fn planes_m(&self, (i, j): (usize, usize), (a, b): (i32, i32)) -> [f64; 2] {
        let share = |part: i32| f64::from(part) / f64::from(PARTS);
        let (wide_i, wide_j) = (i / 2 * 2, j / 2 * 2);
        let wide = ((i - wide_i) as f64 + share(a), (j - wide_j) as f64 + share(b));
        let wide = (0.5 * wide.0, 0.5 * wide.1);
        let square = |size: usize, (i, j): (usize, usize)| {
            [(0, 0), (size, 0), (0, size), (size, size)].map(|(di, dj)| self.at((i + di, j + dj)))
        };
        let [h00, h10, h01, h11] = square(2, (wide_i, wide_j));
        let four = [h00, h10, h01, h11, self.at((wide_i + 1, wide_j + 1))];
        let even_m = if self.site.patch_depth == 0 {
            // A patch is a single triangle, and its page holds the middle of its hypotenuse.
            cut_in_two([h00, h10, h01, h11], self.is_anti((wide_i, wide_j), 2), wide)
        } else {
            cut_in_two(square(1, (i, j)), self.is_anti((i, j), 1), (share(a), share(b)))
        };
        [cut_in_four(four, wide), even_m]
    }

    /// Whether the diagonal of a square of `size` cells runs from its (1, 0) to its (0, 1).
    fn is_anti(&self, (i, j): (usize, usize), size: usize) -> bool {
        let (u0, v0) = self.site.key.origin();
        let step = self.site.key.step();
        if size == 2 && 2 * step == RADIUS || step == RADIUS {
            return true;
        }
        let first = |origin: i32| (origin / step).cast_unsigned() as usize;
        // The apron is a whole number of blocks, which does not change what is odd.
        ((first(u0) + i) / size + (first(v0) + j) / size) % 2 == 1
    }

    /// The lattice point at a sample and some parts of a cell further on.
    fn point(&self, at: (usize, usize), parts: (i32, i32)) -> IVec3 {
        beyond(self.site.key, self.apron, at, parts)
    }
}

/// The lattice point at a sample of a page and of so many samples around it, and some eighths of a
/// cell further on, wherever it lies.
pub fn beyond(key: PageKey, apron: usize, (i, j): (usize, usize), (a, b): (i32, i32)) -> IVec3 {
    let (u0, v0) = key.origin();
    let step = i64::from(key.step());
    let along = |origin: i32, at: usize, part: i32| {
        let at = at as i64 - apron as i64;
        i64::from(origin) + at * step + step / i64::from(PARTS) * i64::from(part)
    };
    let (u, v) = (along(u0, i, a), along(v0, j, b));
    let radius = i64::from(RADIUS);
    // Beyond u = 0 and v = R the sign of x changes, beyond v = 0 and u = R that of y.
    let flips_x = u < 0 || v > radius;
    let flips_y = v < 0 || u > radius;
    let within = |at: i64| {
        let at = if at < 0 { -at } else { at };
        let at = if at > radius { 2 * radius - at } else { at };
        i32::try_from(at.clamp(0, radius)).expect("within the square")
    };
    let mut point = fold(key.quadrant(), within(u), within(v));
    if flips_x {
        point.x = -point.x;
    }
    if flips_y {
        point.y = -point.y;
    }
    point
}

/// The least share of an odd triangle's bend that is expected of the even ones within it: a half
/// on smooth ground, more at a crease.
const HALVED: f64 = 0.7;

/// The cells of a block, and where each is probed.
fn probes_of((x, y): (usize, usize)) -> impl Iterator<Item = ((usize, usize), (i32, i32))> {
    let cells = (0..BOUND_STRIDE).flat_map(|j| (0..BOUND_STRIDE).map(move |i| (i, j)));
    cells.map(move |(i, j)| ((x * BOUND_STRIDE + i, y * BOUND_STRIDE + j), probe((i, j))))
}

/// Where the cell (i, j) of a block is probed.
fn probe((i, j): (usize, usize)) -> (i32, i32) {
    let half = BOUND_STRIDE / 2;
    let mirrored = |at: usize| if at < half { at } else { BOUND_STRIDE - 1 - at };
    let (a, b) = PROBES[mirrored(i) + half * mirrored(j)];
    (if i < half { a } else { PARTS - a }, if j < half { b } else { PARTS - b })
}

fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

impl Block {
    const EMPTY: Self = Self {
        odd_m: 0.0,
        even_m: 0.0,
        shore_m: [0.0; 2],
        low_m: f64::INFINITY,
        high_m: f64::NEG_INFINITY,
        ruggedness: 0.0,
    };

    fn see(&mut self, Spot { height_m, ruggedness }: Spot) {
        self.low_m = if height_m < self.low_m { height_m } else { self.low_m };
        self.high_m = if height_m > self.high_m { height_m } else { self.high_m };
        self.ruggedness = greater(self.ruggedness, ruggedness);
    }
}

/// Height of a unit square's two triangles at a place; corners are (0, 0), (1, 0), (0, 1), (1, 1).
fn cut_in_two([h00, h10, h01, h11]: [f64; 4], anti: bool, (x, y): (f64, f64)) -> f64 {
    match (anti, if anti { x + y < 1.0 } else { x > y }) {
        (true, true) => h00 + x * (h10 - h00) + y * (h01 - h00),
        (true, false) => h11 + (1.0 - x) * (h01 - h11) + (1.0 - y) * (h10 - h11),
        (false, true) => h10 + (1.0 - x) * (h00 - h10) + y * (h11 - h10),
        (false, false) => h01 + x * (h11 - h01) + (1.0 - y) * (h00 - h01),
    }
}

/// Height of a unit square's four triangles around its centre, the fifth height.
fn cut_in_four([h00, h10, h01, h11, centre]: [f64; 5], (x, y): (f64, f64)) -> f64 {
    // The weight of the centre is twice the distance from the nearest side.
    let (to_side, a, b, along) = match (y <= x, y <= 1.0 - x) {
        (true, true) => (y, h00, h10, x),
        (true, false) => (1.0 - x, h10, h11, y),
        (false, false) => (1.0 - y, h01, h11, x),
        (false, true) => (x, h00, h01, y),
    };
    centre * (2.0 * to_side) + a * (1.0 - along - to_side) + b * (along - to_side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasource::page::SAMPLES;

    fn samples(key: PageKey) -> Vec<IVec3> {
        let places = (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j)));
        places.map(|(i, j)| key.sample(i, j)).collect()
    }

    fn look(points: &[IVec3], ground_m: &impl Fn(IVec3) -> f64) -> Vec<Spot> {
        points.iter().map(|&at| Spot { height_m: ground_m(at), ruggedness: 0.0 }).collect()
    }

    #[test]
    fn both_cuts_meet_their_corners_and_planes() {
        let plane = |x: f64, y: f64| 3.0 + 2.0 * x - 5.0 * y;
        let corners = [plane(0.0, 0.0), plane(1.0, 0.0), plane(0.0, 1.0), plane(1.0, 1.0)];
        let [a, b, c, d] = corners;
        for (x, y) in [(0.1, 0.2), (0.9, 0.3), (0.6, 0.95), (0.05, 0.7), (0.5, 0.5)] {
            for anti in [false, true] {
                assert!((cut_in_two(corners, anti, (x, y)) - plane(x, y)).abs() < 1e-12);
            }
            let four = cut_in_four([a, b, c, d, plane(0.5, 0.5)], (x, y));
            assert!((four - plane(x, y)).abs() < 1e-12);
        }
        let bent = [0.0, 1.0, 1.0, 0.0];
        assert_eq!(cut_in_two(bent, true, (0.5, 0.5)), 1.0);
        assert_eq!(cut_in_two(bent, false, (0.5, 0.5)), 0.0);
        assert_eq!(cut_in_four([0.0, 0.0, 0.0, 0.0, 8.0], (0.5, 0.25)), 4.0);
    }

    #[test]
    fn residuals_of_a_plane_are_nothing_and_those_of_a_bowl_follow_the_cell() {
        let key = PageKey::new(1, 9, 300, 77);
        let (u0, v0) = key.origin();
        let at = |point: IVec3| {
            let (u, v) = crate::lattice::unfold(1, point);
            (f64::from(u - u0) / f64::from(key.step()), f64::from(v - v0) / f64::from(key.step()))
        };
        for bowl in [0.0, 0.5] {
            let ground_m = |point: IVec3| {
                let (i, j) = at(point);
                7.0 + 0.25 * i - j + bowl * (i * i + j * j)
            };
            let own = look(&samples(key), &ground_m);
            let site = Site { key, patch_depth: 4, style: Style::Earthlike, sea: true };
            let found = Probes::new(site, &own, |points| look(points, &ground_m));
            let found = found.unwrap().around(8, 8);
            // Half a cell away from both ends the bowl lies a quarter of its strength lower.
            let [odd_m, even_m] = found.residual_m;
            assert!(even_m <= HALVED * bowl + 1e-3 && odd_m <= bowl + 1e-3, "{found:?}");
            assert!(even_m >= 0.3 * bowl && odd_m >= 0.6 * bowl, "{found:?}");
        }
    }

    #[test]
    fn the_apron_goes_on_beyond_the_borders_of_a_quadrant() {
        let mut flat = |points: &[IVec3]| look(points, &|_| 0.0);
        let own = [Spot { height_m: 0.0, ruggedness: 0.0 }; SAMPLES];
        for (x, y) in [(0, 0), (15, 0), (0, 15), (15, 15)] {
            let site = Site {
                key: PageKey::new(0, 4, x, y),
                patch_depth: 4,
                style: Style::Earthlike,
                sea: true,
            };
            let field = Field::new(site, 2, &own, &mut flat);
            for at in [(0, 0), (5, 40), (40, 5), (80, 28), (28, 80), (80, 80)] {
                let point = field.point(at, (3, 5));
                assert_eq!(point.abs().element_sum(), RADIUS, "{point}");
            }
            let [inner, outer] =
                [8, 7].map(|i| crate::lattice::normal_of(field.point((i, 28), (0, 0))));
            let step = f64::from(site.key.step()) / f64::from(RADIUS);
            assert!((inner - outer).length() < 4.0 * step, "{:?}", site.key);
        }
    }

    #[test]
    fn pages_that_share_a_sample_find_the_same_around_it() {
        let ground_m = |point: IVec3| {
            let p = point.as_dvec3() / f64::from(RADIUS) * 3e4;
            1e3 * (p.x * 1.7 + (p.y * 0.9).fract() + 0.3 * p.z * (p.x * 1.1).fract())
        };
        let findings = |key: PageKey, i: usize, j: usize| {
            let own = look(&samples(key), &ground_m);
            let site = Site { key, patch_depth: 4, style: Style::Earthlike, sea: true };
            let found = Probes::new(site, &own, |points| look(points, &ground_m)).unwrap();
            let Findings { residual_m, shore_m, range_m, relief_m, .. } = found.around(i, j);
            ([residual_m, shore_m, range_m], relief_m)
        };
        let own = |x, y| PageKey::new(0, 7, x, y);
        for j in [0, 5, 16] {
            // Within a quadrant, and across x = 0 into the next.
            assert_eq!(findings(own(30, 9), 16, j), findings(own(31, 9), 0, j));
            assert_eq!(findings(own(0, 9), 0, j), findings(PageKey::new(1, 7, 0, 9), 0, j));
            assert_eq!(findings(own(40, 127), j, 16), findings(PageKey::new(1, 7, 40, 127), j, 16));
        }
    }
}

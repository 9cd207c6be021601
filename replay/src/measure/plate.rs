//! One page of the reference ground: places in f64, and boxes around every square of them.
//!
//! In:    a page; a ray in the plate's axes.
//! Out:   where the ray first meets the plate's triangles.
//! Keeps: its page, a local frame, 65 × 65 places, a pyramid of boxes: some 170 KiB.
//! Not here: which plates a frame needs (`reference`), how a ray meets boxes (`boxes`).
//! Source: Woop, Benthin, Wald, "Watertight ray/triangle intersection", 2013.
//!
//! Triangles are those of the page's even lattice level, as the drawn mesh would have them. A box
//! holds all corners of its triangles, and so the triangles: no peak is ever skipped. A skirt hangs
//! from the border, so that no ray slips between two plates of different depth.

use super::boxes::{Box3, Origin, Quad, Ray, Steps};
use glam::{DMat3, DVec3};
use overfly_core::datasource::key::{PAGE_BITS, PAGE_SIDE};
use overfly_core::datasource::page::{BOUND_SIDE, SAMPLES};
use overfly_core::datasource::{Page, PageKey};
use overfly_core::geodesy::Ellipsoid;
use overfly_core::lattice::normal_of;
use std::sync::Arc;

/// Squares of two by two cells are the smallest that have a box.
const LEAF_BITS: u8 = PAGE_BITS - 1;
/// Squares of all sizes: 1 + 4 + … + 4⁵.
const BOXES: usize = ((1 << (2 * (LEAF_BITS as usize + 1))) - 1) / 3;
/// Those that are cut in four: 1 + 4 + … + 4⁴.
const QUADS: usize = ((1 << (2 * LEAF_BITS as usize)) - 1) / 3;

/// One page of the reference ground.
pub struct Plate {
    /// Its page.
    pub key: PageKey,
    /// The page itself.
    pub page: Arc<Page>,
    /// Middle of the page, body-fixed.
    pub origin: DVec3,
    /// From body-fixed axes to the plate's: the third is the vertical of its middle.
    pub axes: DMat3,
    /// Longest side of a cell, metres.
    pub cell_m: f64,
    /// Greatest height of the samples, metres.
    pub high_m: f64,
    /// Least height of the samples, metres.
    pub low_m: f64,
    whole: Box3,
    steps: Steps,
    quarters: [Box3; 4],
    sea: bool,
    places: Vec<DVec3>,
    quads: Vec<Quad>,
    skirt_m: f64,
}

/// What plates below another one may have.
pub struct Finer {
    /// The page, with its bounds.
    pub page: Arc<Page>,
    /// How far the ground strays from the triangles at most, as the page has it; metres.
    pub error_max_m: f64,
    quarters: [Box3; 4],
}

/// A square of a plate: one of 2^bits by 2^bits, counted quarter by quarter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Part {
    /// How often the plate was cut in four.
    pub bits: u8,
    /// Which of the parts.
    pub at: u16,
}

impl Part {
    /// All of the plate.
    pub const WHOLE: Self = Self { bits: 0, at: 0 };

    /// Its quarters.
    pub fn quarters(self) -> [Self; 4] {
        [0, 1, 2, 3].map(|kid| Self { bits: self.bits + 1, at: 4 * self.at + kid })
    }
}

/// Where a ray met a plate: a triangle of a cell, or the skirt below one of its edges.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Along the ray, in lengths of its direction.
    pub t: f64,
    /// The corners, as (i, j) of the page's samples.
    pub corners: [(usize, usize); 3],
    /// Their weights; below a skirt's edge those of the edge.
    pub weights: [f64; 3],
}

impl Plate {
    /// Looks through a page once: some 400 µs.
    pub fn new(page: Arc<Page>, body: &Ellipsoid, sea: bool) -> Self {
        let key = page.key;
        let middle = PAGE_SIDE / 2;
        let up = normal_of(key.sample(middle, middle));
        let origin = body.surface_from_normal(up);
        let aside = if up.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
        let east = aside.cross(up).normalize();
        let axes = DMat3::from_cols(east, up.cross(east), up).transpose();
        let (mut low_m, mut high_m) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut places = Vec::with_capacity(SAMPLES);
        for (j, i) in (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (j, i))) {
            let normal = normal_of(key.sample(i, j));
            let surface_m = page.surface_m(j * PAGE_SIDE + i, sea);
            (low_m, high_m) = (low_m.min(surface_m), high_m.max(surface_m));
            let place = body.surface_from_normal(normal) + normal * surface_m;
            places.push(axes * (place - origin));
        }
        let last = PAGE_SIDE - 1;
        let across = |at: usize| (places[at] - places[0]).length();
        let cell_m = across(last).max(across(last * PAGE_SIDE)) / last as f64;
        let mut plate = Self {
            key,
            origin,
            axes,
            cell_m,
            high_m,
            low_m,
            whole: Box3::EMPTY,
            steps: Steps::new(&Box3::EMPTY),
            quarters: [Box3::EMPTY; 4],
            sea,
            places,
            quads: Vec::with_capacity(QUADS),
            skirt_m: 0.5 * cell_m,
            page,
        };
        plate.fill_boxes();
        plate
    }

    /// Place of a sample in the plate's axes.
    fn at(&self, i: usize, j: usize) -> DVec3 {
        self.places[j * PAGE_SIDE + i]
    }

    fn fill_boxes(&mut self) {
        let side = 1_usize << LEAF_BITS;
        let mut boxes = vec![Box3::EMPTY; BOXES];
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let mut found = Box3::EMPTY;
            for (j, i) in (0..3).flat_map(|j| (0..3).map(move |i| (2 * y + j, 2 * x + i))) {
                let at = self.at(i, j);
                found = found.with(Box3 { low: at, high: at });
            }
            if is_border(x, y) {
                found.low.z -= self.skirt_m;
            }
            boxes[place(LEAF_BITS, x, y)] = found;
        }
        for bits in (0..LEAF_BITS).rev() {
            for (y, x) in (0..1 << bits).flat_map(|y| (0..1 << bits).map(move |x| (y, x))) {
                let kids = KIDS.map(|(dx, dy)| boxes[place(bits + 1, 2 * x + dx, 2 * y + dy)]);
                boxes[place(bits, x, y)] = kids.into_iter().fold(Box3::EMPTY, Box3::with);
            }
        }
        self.whole = boxes[0];
        self.steps = Steps::new(&self.whole);
        for bits in 0..LEAF_BITS {
            for at in 0..1 << (2 * bits) {
                let (x, y) = square(at);
                let kids = KIDS.map(|(dx, dy)| boxes[place(bits + 1, 2 * x + dx, 2 * y + dy)]);
                self.quads.push(Quad::new(&kids, &self.steps));
            }
        }
        for (index, (x, y)) in KIDS.into_iter().enumerate() {
            self.quarters[index] = boxes[place(1, x, y)];
        }
    }

    /// The box around everything, in the plate's axes.
    pub fn whole(&self) -> Box3 {
        self.whole
    }

    /// A part of it.
    pub fn part(&self, part: Part) -> Box3 {
        let Part { bits, at } = part;
        if bits == 0 {
            return self.whole;
        }
        let quad = &self.quads[first_of(bits - 1) + usize::from(at / 4)];
        quad.get(usize::from(at % 4), &self.steps)
    }

    /// Where rays come from, for [`Self::meet`]: a point in the plate's axes.
    pub fn origin(&self, from: DVec3) -> Origin {
        Origin::new(from, &self.steps)
    }

    /// A point in the plate's axes.
    pub fn local(&self, point: DVec3) -> DVec3 {
        self.axes * (point - self.origin)
    }

    /// Body-fixed corner of a triangle that was met.
    pub fn corner(&self, (i, j): (usize, usize)) -> DVec3 {
        self.origin + self.axes.transpose() * self.at(i, j)
    }

    /// Height of the surface at a sample, metres.
    pub fn surface_m(&self, (i, j): (usize, usize)) -> f64 {
        self.page.surface_m(j * PAGE_SIDE + i, self.sea)
    }

    /// Where a ray in the plate's axes first meets a part of the plate before `end`. `origin` is where it
    /// comes from, as [`Self::origin`] has it.
    pub fn meet(
        &self,
        part: Part,
        origin: &Origin,
        (from, direction): (DVec3, DVec3),
        end: f64,
    ) -> Option<Meeting> {
        let ray = Ray::new(origin, direction);
        let shear = Shear::new(from, direction);
        let mut best: Option<Meeting> = None;
        let mut until = end;
        let mut stack = [(0.0, 0_u8, 0_u16); 4 * LEAF_BITS as usize];
        stack[0] = (0.0, part.bits, part.at);
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (t, bits, at) = stack[count];
            if f64::from(t) > until {
                continue;
            }
            if bits == LEAF_BITS {
                best =
                    self.meet_square((from, direction, &shear), square(at.into()), until).or(best);
                until = best.map_or(until, |found| found.t);
                continue;
            }
            let (entries, met) = ray.enters(&self.quads[first_of(bits) + usize::from(at)], until);
            let first = count;
            for (kid, t) in (0..4).zip(entries) {
                // The nearest lies on top.
                stack[count] = (t, bits + 1, 4 * at + kid);
                count += (met >> kid & 1) as usize;
                sink(&mut stack[first..count]);
            }
        }
        best
    }

    /// The triangles of two by two cells, and their skirts.
    #[inline]
    fn meet_square(
        &self,
        (from, direction, shear): (DVec3, DVec3, &Shear),
        (x, y): (usize, usize),
        end: f64,
    ) -> Option<Meeting> {
        let mut best = shear.meet(|(i, j)| self.at(2 * x + i, 2 * y + j), end).map(|found| {
            let corners = found.corners.map(|(i, j)| (2 * x + i, 2 * y + j));
            Meeting { corners, ..found }
        });
        let mut until = best.map_or(end, |found| found.t);
        if is_border(x, y) {
            let cells = KIDS.map(|(dx, dy)| (2 * x + dx, 2 * y + dy));
            for edge in cells.into_iter().flat_map(|(i, j)| self.border(i, j)).flatten() {
                best = self.meet_skirt((from, direction), edge, until).or(best);
                until = best.map_or(until, |found| found.t);
            }
        }
        best
    }

    /// Those edges of a cell that lie on the border.
    fn border(&self, i: usize, j: usize) -> [Option<[(usize, usize); 2]>; 4] {
        let last = PAGE_SIDE - 2;
        let edge = |on: bool, a, b| on.then_some([a, b]);
        [
            edge(i == 0, (i, j), (i, j + 1)),
            edge(i == last, (i + 1, j), (i + 1, j + 1)),
            edge(j == 0, (i, j), (i + 1, j)),
            edge(j == last, (i, j + 1), (i + 1, j + 1)),
        ]
    }

    fn meet_skirt(
        &self,
        (from, direction): (DVec3, DVec3),
        [a, b]: [(usize, usize); 2],
        end: f64,
    ) -> Option<Meeting> {
        let down = DVec3::new(0.0, 0.0, -self.skirt_m);
        let (top, next) = (self.at(a.0, a.1), self.at(b.0, b.1));
        let upper = meet_triangle(from, direction, [top, next, top + down], end);
        let (t, along) = if let Some((t, weights)) = upper {
            (t, weights[1])
        } else {
            let lower = [next + down, top + down, next];
            let (t, weights) = meet_triangle(from, direction, lower, end)?;
            (t, weights[0] + weights[2])
        };
        Some(Meeting { t, corners: [a, b, a], weights: [1.0 - along, along, 0.0] })
    }
}

impl Finer {
    /// From a plate and its page, bounds and all.
    pub fn new(page: Arc<Page>, plate: &Plate) -> Self {
        let errors_m = [0, 1, 2, 3].map(|quarter| error_m(&page, quarter));
        let grown = |quarter: usize| plate.quarters[quarter].grown(errors_m[quarter]);
        Self {
            error_max_m: errors_m.into_iter().fold(0.0, f64::max),
            quarters: [0, 1, 2, 3].map(grown),
            page,
        }
    }

    /// The box around all that finer plates of a quarter may have, in the plate's axes; counted as
    /// pages count their children.
    pub fn quarter(&self, index: usize) -> Box3 {
        self.quarters[index]
    }
}

/// How far the ground of a quarter strays from the triangles at most, as the page has it.
fn error_m(page: &Page, quarter: usize) -> f64 {
    let half = BOUND_SIDE / 2;
    let (i0, j0) = (quarter % 2 * half, quarter / 2 * half);
    let all = (j0..=j0 + half).flat_map(|j| (i0..=i0 + half).map(move |i| (i, j)));
    let bounds = all.map(|(i, j)| &page.bounds[j * BOUND_SIDE + i]);
    bounds.map(|bound| f64::from(bound.error_odd_m.max(bound.error_even_m))).fold(0.0, f64::max)
}

/// The triangles of two by two cells all meet in the middle: diagonals join corners that are both
/// even or both odd, and pages begin at even ones. This is the ring around it.
const RING: [(usize, usize); 8] = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
const MIDDLE: (usize, usize) = (1, 1);

/// Quarters of a square, counted as pages count their children.
const KIDS: [(usize, usize); 4] = [(0, 0), (1, 0), (0, 1), (1, 1)];

fn is_border(x: usize, y: usize) -> bool {
    let last = (1 << LEAF_BITS) - 1;
    x == 0 || y == 0 || x == last || y == last
}

/// Space sheared so that a ray runs along the third axis from its origin.
struct Shear {
    from: DVec3,
    axes: [DVec3; 3],
    per: f64,
}

impl Shear {
    fn new(from: DVec3, direction: DVec3) -> Self {
        let away = direction.abs();
        let [x, y, z] = if away.z >= away.x && away.z >= away.y {
            [DVec3::X, DVec3::Y, DVec3::Z]
        } else if away.x >= away.y {
            [DVec3::Y, DVec3::Z, DVec3::X]
        } else {
            [DVec3::Z, DVec3::X, DVec3::Y]
        };
        let per = 1.0 / direction.dot(z);
        let slope = |axis: DVec3| axis - z * (direction.dot(axis) * per);
        Self { from, axes: [slope(x), slope(y), z], per }
    }

    /// Where the ray first meets the triangles between a ring and its middle. Two triangles see
    /// their common edge alike to the last bit: no ray slips through.
    #[inline]
    fn meet(&self, at: impl Fn((usize, usize)) -> DVec3, end: f64) -> Option<Meeting> {
        let [right, up, _] = self.axes;
        let middle = at(MIDDLE) - self.from;
        let ring = RING.map(|of| at(of) - self.from);
        let (x, y) = (middle.dot(right), middle.dot(up));
        let (xs, ys) = (ring.map(|of| of.dot(right)), ring.map(|of| of.dot(up)));
        let (mut spokes, mut rims) = ([0.0; 9], [0.0; 8]);
        for i in 0..8 {
            let next = (i + 1) % 8;
            spokes[i] = x * ys[i] - y * xs[i];
            rims[i] = xs[i] * ys[next] - ys[i] * xs[next];
        }
        spokes[8] = spokes[0];
        let mut inside = 0_u32;
        for i in 0..8 {
            let sides = [rims[i], -spokes[i + 1], spokes[i]];
            let left = (sides[0] >= 0.0) & (sides[1] >= 0.0) & (sides[2] >= 0.0);
            let right = (sides[0] <= 0.0) & (sides[1] <= 0.0) & (sides[2] <= 0.0);
            inside |= u32::from(left | right) << i;
        }
        let mut best: Option<Meeting> = None;
        while inside != 0 {
            let i = inside.trailing_zeros() as usize;
            inside &= inside - 1;
            let next = (i + 1) % 8;
            let sides = [rims[i], -spokes[i + 1], spokes[i]];
            let scale = 1.0 / (sides[0] + sides[1] + sides[2]);
            let weights = sides.map(|side| side * scale);
            let places = [middle, ring[i], ring[next]].map(|of| of.dot(self.axes[2]));
            let along = weights[0] * places[0] + weights[1] * places[1] + weights[2] * places[2];
            let t = along * self.per;
            // NaN of a triangle seen edge-on fails this.
            if t >= 0.0 && t <= best.map_or(end, |best| best.t) {
                best = Some(Meeting { t, corners: [MIDDLE, RING[i], RING[next]], weights });
            }
        }
        best
    }
}

/// Moves the last of a falling list to its place.
fn sink(list: &mut [(f32, u8, u16)]) {
    for at in (1..list.len()).rev() {
        if list[at - 1].0 >= list[at].0 {
            return;
        }
        list.swap(at - 1, at);
    }
}

/// Column and row of a square: squares are counted quarter by quarter.
fn square(at: usize) -> (usize, usize) {
    let every_second = |bits: usize| {
        let bits = bits & 0x555;
        let bits = (bits | bits >> 1) & 0x333;
        let bits = (bits | bits >> 2) & 0xf0f;
        (bits | bits >> 4) & 0xff
    };
    (every_second(at), every_second(at >> 1))
}

/// How many squares there are of less than so many bits.
fn first_of(bits: u8) -> usize {
    ((1_usize << (2 * bits)) - 1) / 3
}

/// Where the box of square (x, y) of 2^bits by 2^bits stands.
fn place(bits: u8, x: usize, y: usize) -> usize {
    first_of(bits) + (y << bits) + x
}

/// Where a ray meets a triangle, from either side, and the weights of its corners.
///
/// Source: Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
#[inline]
fn meet_triangle(
    from: DVec3,
    direction: DVec3,
    [a, b, c]: [DVec3; 3],
    end: f64,
) -> Option<(f64, [f64; 3])> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    let scale = 1.0 / determinant;
    let away = from - a;
    let u = away.dot(p) * scale;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = away.cross(ab);
    let v = direction.dot(q) * scale;
    let t = ac.dot(q) * scale;
    // NaN of a triangle seen edge-on fails these as well.
    (v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t <= end).then_some((t, [1.0 - u - v, u, v]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::ground::Cell;
    use std::collections::BTreeSet;

    fn half(of: u8) -> usize {
        assert_eq!(of % 2, 0);
        usize::from(of / 2)
    }

    #[test]
    fn squares_are_counted_quarter_by_quarter() {
        for at in 0..1024 {
            let ((x, y), (px, py)) = (square(at), square(at / 4));
            assert_eq!((x - 2 * px, y - 2 * py), KIDS[at % 4]);
        }
        assert_eq!(square(0), (0, 0));
    }

    #[test]
    fn the_triangles_of_a_plate_are_those_of_the_lattice() {
        let level = 2 * (3 + PAGE_BITS);
        let own: BTreeSet<BTreeSet<(usize, usize)>> =
            (0..8).map(|i| BTreeSet::from([MIDDLE, RING[i], RING[(i + 1) % 8]])).collect();
        for (quadrant, x, y) in [(0, 0, 0), (1, 64, 128), (2, 62, 2), (3, 130, 388)] {
            let of_cell = |(dx, dy): (usize, usize)| {
                let [x, y] = [(x, dx), (y, dy)].map(|(at, d)| at + u32::try_from(d).unwrap());
                let cell = Cell { quadrant, level, x, y };
                // Corners are counted in halves of cells.
                let place = move |of: [u8; 2]| (dx + half(of[0]), dy + half(of[1]));
                cell.triangles().iter().map(move |of| BTreeSet::from(of.map(place)))
            };
            let all: BTreeSet<_> = KIDS.into_iter().flat_map(of_cell).collect();
            assert_eq!(all, own);
        }
    }
}

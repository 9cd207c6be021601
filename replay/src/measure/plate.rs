//! One page of the reference ground: places in f64, and boxes around every square of them.
//!
//! In:    a page; a ray in the plate's axes.
//! Out:   where the ray first meets the plate's triangles.
//! Keeps: a local frame, 65 × 65 places, a pyramid of boxes: some 240 KiB.
//! Not here: which plates a frame needs (`reference`).
//!
//! Triangles are those of the page's even lattice level, as the drawn mesh would have them. A box
//! holds all corners of its triangles, and so the triangles: no peak is ever skipped. A skirt hangs
//! from the border, so that no ray slips between two plates of different depth.

use glam::{DMat3, DVec3};
use overfly_core::datasource::key::{PAGE_BITS, PAGE_SIDE};
use overfly_core::datasource::page::SAMPLES;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::Cell;
use overfly_core::lattice::normal_of;

/// Squares of two by two cells are the smallest that have a box.
const LEAF_BITS: u8 = PAGE_BITS - 1;
/// Boxes of a plate: 1 + 4 + … + 4⁵.
const BOXES: usize = ((1 << (2 * (LEAF_BITS as usize + 1))) - 1) / 3;

/// Least and greatest corner.
#[derive(Clone, Copy, Debug)]
pub struct Box3 {
    /// Least coordinates.
    pub low: DVec3,
    /// Greatest coordinates.
    pub high: DVec3,
}

/// One page of the reference ground.
pub struct Plate {
    /// Its page.
    pub key: PageKey,
    /// Middle of the page, body-fixed.
    pub origin: DVec3,
    /// From body-fixed axes to the plate's: the third is the vertical of its middle.
    pub axes: DMat3,
    /// How far the ground strays from the triangles at most, as the page has it; metres.
    pub error_max_m: f64,
    /// Longest side of a cell, metres.
    pub cell_m: f64,
    /// Greatest height of the samples, metres.
    pub high_m: f64,
    /// Least height of the samples, metres.
    pub low_m: f64,
    surface_m: Vec<f64>,
    places: Vec<DVec3>,
    boxes: Vec<Box3>,
    skirt_m: f64,
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

impl Box3 {
    const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Grown on all sides.
    pub fn grown(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Where a ray enters, if it does before `end`. Division by zero gives infinities, as it must.
    #[inline]
    fn entry(&self, from: DVec3, per: DVec3, end: f64) -> Option<f64> {
        let (a, b) = ((self.low - from) * per, (self.high - from) * per);
        let (near, far) = (a.min(b), a.max(b));
        let enter = near.max_element().max(0.0);
        let leave = far.min_element().min(end);
        (enter <= leave).then_some(enter)
    }

    /// Distance from a point; 0 inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        (self.low - point).max(point - self.high).max(DVec3::ZERO).length()
    }
}

impl Plate {
    /// Looks through a page once: some 300 µs.
    pub fn new(page: &Page, body: &Ellipsoid, sea: bool) -> Self {
        let key = page.key;
        let middle = PAGE_SIDE / 2;
        let up = normal_of(key.sample(middle, middle));
        let origin = body.surface_from_normal(up);
        let aside = if up.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
        let east = aside.cross(up).normalize();
        let axes = DMat3::from_cols(east, up.cross(east), up).transpose();
        let mut plate = Self {
            key,
            origin,
            axes,
            error_max_m: 0.0,
            cell_m: 0.0,
            high_m: f64::NEG_INFINITY,
            low_m: f64::INFINITY,
            surface_m: Vec::with_capacity(SAMPLES),
            places: Vec::with_capacity(SAMPLES),
            boxes: vec![Box3::EMPTY; BOXES],
            skirt_m: 0.0,
        };
        for (j, i) in (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (j, i))) {
            let normal = normal_of(key.sample(i, j));
            let surface_m = page.surface_m(j * PAGE_SIDE + i, sea);
            plate.low_m = plate.low_m.min(surface_m);
            plate.high_m = plate.high_m.max(surface_m);
            let place = body.surface_from_normal(normal) + normal * surface_m;
            plate.surface_m.push(surface_m);
            plate.places.push(axes * (place - origin));
        }
        for bound in &page.bounds {
            let error_m = bound.error_odd_m.max(bound.error_even_m);
            plate.error_max_m = plate.error_max_m.max(f64::from(error_m));
        }
        let last = PAGE_SIDE - 1;
        let across = |(i, j): (usize, usize)| (plate.at(i, j) - plate.at(0, 0)).length();
        plate.cell_m = across((last, 0)).max(across((0, last))) / last as f64;
        plate.skirt_m = 0.5 * plate.cell_m;
        plate.fill_boxes();
        plate
    }

    /// Place of a sample in the plate's axes.
    fn at(&self, i: usize, j: usize) -> DVec3 {
        self.places[j * PAGE_SIDE + i]
    }

    fn fill_boxes(&mut self) {
        let side = 1_usize << LEAF_BITS;
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let mut found = Box3::EMPTY;
            for (j, i) in (0..3).flat_map(|j| (0..3).map(move |i| (2 * y + j, 2 * x + i))) {
                let at = self.at(i, j);
                found = found.with(Box3 { low: at, high: at });
            }
            if x == 0 || y == 0 || x + 1 == side || y + 1 == side {
                found.low.z -= self.skirt_m;
            }
            self.boxes[place(LEAF_BITS, x, y)] = found;
        }
        for bits in (0..LEAF_BITS).rev() {
            for (y, x) in (0..1 << bits).flat_map(|y| (0..1 << bits).map(move |x| (y, x))) {
                let kid =
                    |dx: usize, dy: usize| self.boxes[place(bits + 1, 2 * x + dx, 2 * y + dy)];
                let all = kid(0, 0).with(kid(1, 0)).with(kid(0, 1)).with(kid(1, 1));
                self.boxes[place(bits, x, y)] = all;
            }
        }
    }

    /// The box around everything, in the plate's axes.
    pub fn whole(&self) -> Box3 {
        self.boxes[0]
    }

    /// The box around a quarter, in the plate's axes; counted as pages count their children.
    pub fn quarter(&self, index: usize) -> Box3 {
        self.boxes[place(1, index % 2, index / 2)]
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
        self.surface_m[j * PAGE_SIDE + i]
    }

    /// Where a ray in the plate's axes first meets the plate before `end`.
    pub fn meet(&self, from: DVec3, direction: DVec3, end: f64) -> Option<Meeting> {
        let per = direction.recip();
        let mut best: Option<Meeting> = None;
        let mut until = end;
        let mut stack = [(0.0, 0_u8, 0_usize, 0_usize); 4 * LEAF_BITS as usize];
        let mut count = 0;
        if let Some(t) = self.boxes[0].entry(from, per, until) {
            stack[0] = (t, 0, 0, 0);
            count = 1;
        }
        while count > 0 {
            count -= 1;
            let (t, bits, x, y) = stack[count];
            if t > until {
                continue;
            }
            if bits == LEAF_BITS {
                best = self.meet_square((from, direction), (x, y), until).or(best);
                until = best.map_or(until, |found| found.t);
                continue;
            }
            let first = count;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = (2 * x + dx, 2 * y + dy);
                let entry = self.boxes[place(bits + 1, x, y)].entry(from, per, until);
                // The nearest lies on top.
                stack[count] = (entry.unwrap_or(f64::INFINITY), bits + 1, x, y);
                count += usize::from(entry.is_some());
                sink(&mut stack[first..count]);
            }
        }
        best
    }

    /// The triangles of two by two cells, and their skirts.
    fn meet_square(
        &self,
        (from, direction): (DVec3, DVec3),
        (x, y): (usize, usize),
        end: f64,
    ) -> Option<Meeting> {
        let mut best: Option<Meeting> = None;
        let mut until = end;
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (i, j) = (2 * x + dx, 2 * y + dy);
            for corners in self.triangles(i, j) {
                best = self.meet_corners((from, direction), corners, until).or(best);
                until = best.map_or(until, |found| found.t);
            }
            for edge in self.border(i, j).into_iter().flatten() {
                best = self.meet_skirt((from, direction), edge, until).or(best);
                until = best.map_or(until, |found| found.t);
            }
        }
        best
    }

    fn meet_corners(
        &self,
        (from, direction): (DVec3, DVec3),
        corners: [(usize, usize); 3],
        end: f64,
    ) -> Option<Meeting> {
        let places = corners.map(|(i, j)| self.at(i, j));
        let (t, weights) = meet_triangle(from, direction, places, end)?;
        Some(Meeting { t, corners, weights })
    }

    /// Both triangles of a cell.
    fn triangles(&self, i: usize, j: usize) -> [[(usize, usize); 3]; 2] {
        let index =
            |of: u32, at: usize| (of << PAGE_BITS) + u32::try_from(at).expect("a cell of a page");
        let level = 2 * (self.key.depth() + PAGE_BITS);
        let cell = Cell {
            quadrant: self.key.quadrant(),
            level,
            x: index(self.key.x(), i),
            y: index(self.key.y(), j),
        };
        let triangles = cell.triangles();
        [0, 1].map(|which: usize| {
            triangles[which].map(|[u, v]| (i + usize::from(u / 2), j + usize::from(v / 2)))
        })
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

/// Moves the last of a falling list to its place.
fn sink(list: &mut [(f64, u8, usize, usize)]) {
    for at in (1..list.len()).rev() {
        if list[at - 1].0 >= list[at].0 {
            return;
        }
        list.swap(at - 1, at);
    }
}

/// Where the box of square (x, y) of 2^bits by 2^bits stands.
fn place(bits: u8, x: usize, y: usize) -> usize {
    ((1_usize << (2 * bits)) - 1) / 3 + (y << bits) + x
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

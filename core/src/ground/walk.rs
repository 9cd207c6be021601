//! The walk along a line: every triangle that it could meet, nearest first, most of them skipped.
//!
//! In:    a line, a query, the resident pages.
//! Out:   where the line first passes below the surface, or where it comes closest to it.
//! Keeps: nothing.
//! Not here: what is made of it (`ray`, `sight`).
//!
//! A square of the lattice with all that stands on it lies in a cylinder around the vertical of its
//! middle, and below a plane: the ellipsoid is convex, so it lies below its tangent plane, and
//! ground of height h at most h above that. Both tests are exact, so that no peak is skipped. A
//! triangle stands for the prism below it, whose walls it shares with its neighbours: so the line
//! also meets the steps between ground of different levels.

use super::Ground;
use super::answer::Query;
use super::choose::choose;
use super::local::Local;
use super::place::{Cell, DEPTH_END, Place, depth_of, level_of};
use super::region::Square;
use super::resident::{BLOCK_BITS, Resident, sample_range};
use super::surface::Triangle;
use crate::datasource::key::PAGE_BITS;
use crate::datasource::page::BOUND_STRIDE;
use glam::DVec3;

/// A straight line, or one that the air bends.
#[derive(Clone, Copy)]
pub struct Line {
    /// Where it begins.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// Where it ends.
    pub length_m: f64,
    /// It rises above its chord by this times the distances to both ends.
    pub bend_per_m: f64,
}

impl Line {
    /// The point of the chord at distance `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// How far the line lies above it.
    pub fn bend_m(&self, t: f64) -> f64 {
        self.bend_per_m * t * (self.length_m - t)
    }
}

/// What a walk looks for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// The first place below the surface.
    FirstHit,
    /// The place that is least above it.
    Clearance,
}

/// A triangle on the way.
#[derive(Clone, Copy)]
pub struct Meeting {
    /// Distance along the line.
    pub distance_m: f64,
    /// Outward, of any length.
    pub normal: DVec3,
    /// Its level.
    pub level: u8,
}

/// A walk and what it has found.
pub struct Walk<'a> {
    ground: &'a Ground,
    line: Line,
    query: Query,
    goal: Goal,
    /// No page deeper than this can be asked for.
    depth_end: u8,
    curvature_max_m: f64,
    /// Nothing farther away matters.
    pub end_m: f64,
    /// Nothing that the line passes higher than this above matters.
    pub margin_m: f64,
    /// The best so far.
    pub met: Option<Meeting>,
    /// Where the line first passed so low over ground coarser than asked for that finer ground
    /// might have mattered.
    pub coarser_from_m: f64,
    /// Where ground that is not there first mattered.
    pub unknown_from_m: f64,
}

/// A square to visit, with the page that serves it.
#[derive(Clone, Copy)]
struct Task<'a> {
    span: (f64, f64),
    square: Square,
    page: &'a Resident,
    finer: Option<&'a Resident>,
}

/// How a page serves a square: at which level, and by how much finer ground may stand out of it;
/// nothing where the level is the one that was asked for.
#[derive(Clone, Copy)]
struct Service {
    level: u8,
    slack_m: f64,
    coarser: bool,
}

/// Up to four squares, nearest first.
struct Tasks<'a> {
    list: [Option<Task<'a>>; 4],
    count: usize,
}

impl<'a> Tasks<'a> {
    fn new() -> Self {
        Self { list: [None; 4], count: 0 }
    }

    fn add(&mut self, task: Task<'a>) {
        let mut at = self.count;
        while at > 0 && self.list[at - 1].is_some_and(|before| before.span.0 > task.span.0) {
            self.list[at] = self.list[at - 1];
            at -= 1;
        }
        self.list[at] = Some(task);
        self.count += 1;
    }
}

impl<'a> Walk<'a> {
    /// A walk that has not begun.
    pub fn new(ground: &'a Ground, line: Line, query: Query, goal: Goal) -> Self {
        let depth_end = if let Query::Exact(level) = query { depth_of(level) } else { DEPTH_END };
        let [_, curvature_max_m] = ground.shape.body.curvature_radii_m();
        Self {
            ground,
            line,
            query,
            goal,
            depth_end,
            curvature_max_m,
            end_m: line.length_m,
            margin_m: 0.0,
            met: None,
            coarser_from_m: f64::INFINITY,
            unknown_from_m: f64::INFINITY,
        }
    }

    /// Walks.
    pub fn run(&mut self) {
        let mut tasks = Tasks::new();
        for quadrant in 0..4 {
            let square = Square { quadrant, depth: 0, x: 0, y: 0 };
            let page = self.ground.map.find(square.page());
            // Ground that nobody knows may be as high as the body is wide.
            let high_m = page.map_or(self.curvature_max_m, |page| f64::from(page.ground.high_m));
            let Some(span) = self.span(square, high_m) else { continue };
            match page {
                Some(page) => tasks.add(Task { span, square, page, finer: None }),
                None => self.unknown_from_m = self.unknown_from_m.min(span.0),
            }
        }
        for task in tasks.list.into_iter().flatten() {
            self.page(task.page, task.span);
        }
    }

    fn is_late(&self, from_m: f64) -> bool {
        from_m > self.end_m
    }

    /// Visits a page and all that lies below it.
    fn page(&mut self, page: &'a Resident, span: (f64, f64)) {
        let square = Square::of(page.page.key);
        let local = Local::new((&self.ground.shape, &self.line), page, span);
        if square.depth >= self.depth_end {
            self.part((page, local.as_ref()), square, self.service(page));
            return;
        }
        let mut tasks = Tasks::new();
        for square in (0..4).map(|index| square.child(index)) {
            let high_m = f64::from(page.ground.high_m);
            if let Some(span) = self.span_in(local.as_ref(), square, high_m) {
                let finer = self.ground.map.find(square.page());
                tasks.add(Task { span, square, page, finer });
            }
        }
        for Task { span, square, page, finer } in tasks.list.into_iter().flatten() {
            if self.is_late(span.0) {
                continue;
            }
            let within = matches!(self.query, Query::Within(_));
            if finer.is_none() || within {
                self.part((page, local.as_ref()), square, self.service(page));
            }
            // The finer page knows better how high its ground is.
            let high_m = finer.map_or(0.0, |finer| f64::from(finer.ground.high_m));
            if let Some(finer) = finer
                && let Some(span) = self.span_in(local.as_ref(), square, high_m)
            {
                self.page(finer, span);
            }
        }
    }

    /// How a page serves this query, unless its blocks differ.
    fn service(&self, page: &Resident) -> Service {
        let finest = level_of(page.page.key.depth());
        let asked = if let Query::Exact(level) = self.query { level } else { finest };
        if asked <= finest {
            return Service { level: asked, slack_m: 0.0, coarser: false };
        }
        Service { level: finest, slack_m: page.error_max_m, coarser: true }
    }

    /// Visits the triangles of one page over one square of it.
    fn part(
        &mut self,
        (page, local): (&'a Resident, Option<&Local>),
        square: Square,
        mut service: Service,
    ) {
        let bits = square.depth - page.page.key.depth();
        if bits == BLOCK_BITS && matches!(self.query, Query::Within(_)) {
            let Some(own) = self.service_of_block(page, square) else { return };
            service = own;
        }
        let level = service.level;
        if square.depth == Cell::depth(level) {
            let cell = Cell { quadrant: square.quadrant, level, x: square.x, y: square.y };
            for &corners in cell.triangles() {
                let triangle = self.ground.shape.triangle(page, &cell, corners);
                self.triangle(&triangle, service);
            }
            return;
        }
        let mut tasks = Tasks::new();
        for square in (0..4).map(|index| square.child(index)) {
            let high_m = self.high_m(page, square) + service.slack_m;
            if let Some(span) = self.span_in(local, square, high_m) {
                tasks.add(Task { span, square, page, finer: None });
            }
        }
        for task in tasks.list.into_iter().flatten() {
            if !self.is_late(task.span.0) {
                self.part((page, local), task.square, service);
            }
        }
    }

    /// How a page serves a block of it, if this page is the one that answers there.
    fn service_of_block(&mut self, page: &'a Resident, square: Square) -> Option<Service> {
        let side = f64::from(crate::lattice::RADIUS >> square.depth);
        let along = |index: u32| (f64::from(index) + 0.5) * side;
        let (u, v) = (along(square.x), along(square.y));
        let place = Place { quadrant: square.quadrant, u, v };
        let choice = choose(place, self.query, &mut |key| self.ground.map.find(key))?;
        let slack_m = if choice.coarser { page.error_max_m } else { 0.0 };
        let service = Service { level: choice.level, slack_m, coarser: choice.coarser };
        (choice.page.page.key == page.page.key).then_some(service)
    }

    /// The highest sample of a page over one square of it.
    fn high_m(&self, page: &Resident, square: Square) -> f64 {
        let bits = square.depth - page.page.key.depth();
        let mask = (1_u32 << bits) - 1;
        let (x, y) = ((square.x & mask) as usize, (square.y & mask) as usize);
        if bits <= BLOCK_BITS {
            return f64::from(page.range(bits, x, y).high_m);
        }
        let size = 1 << (PAGE_BITS - bits);
        debug_assert!(size < BOUND_STRIDE);
        let range = sample_range(&page.page, self.ground.shape.sea, (x * size, y * size), size);
        f64::from(range.high_m)
    }

    /// [`Self::span`], faster where the line over the page is known.
    fn span_in(&self, local: Option<&Local>, square: Square, high_m: f64) -> Option<(f64, f64)> {
        let Some(local) = local else { return self.span(square, high_m) };
        let (from, to) = local.span(square, self.end_m)?;
        let bend_m = self.line.bend_m(from).min(self.line.bend_m(to));
        let ceiling_m = local.lowered_m(high_m) + self.margin_m + 1e-6 - bend_m;
        clip((from, to), local.rise - ceiling_m, local.climb)
    }

    /// The part of the line that may lie below `high_m` and the margin over a square.
    fn span(&self, square: Square, high_m: f64) -> Option<(f64, f64)> {
        let (up, angle) = square.cap();
        let foot = self.ground.shape.foot(up);
        let above_m = high_m.max(0.0);
        // One hundredth more than the verticals reach covers the walls of prisms.
        let radius_m = 1.01 * (self.curvature_max_m + above_m) * angle + 1e-6;
        // The line seen from its point nearest to the foot, where numbers are small.
        let nearest_m = (foot - self.line.origin).dot(self.line.direction);
        let away = self.line.at(nearest_m) - foot;
        let (rise, climb) = (away.dot(up), self.line.direction.dot(up));
        let (aside, drift) = (away - up * rise, self.line.direction - up * climb);
        let (a, b) = (drift.length_squared(), aside.dot(drift));
        let c = aside.length_squared() - radius_m * radius_m;
        let (mut from, mut to) = (-nearest_m, self.end_m - nearest_m);
        if a > 1e-20 {
            let discriminant = b * b - a * c;
            if discriminant < 0.0 {
                return None;
            }
            let root = discriminant.sqrt();
            (from, to) = (from.max((-b - root) / a), to.min((root - b) / a));
        } else if c > 0.0 {
            return None;
        }
        if from > to {
            return None;
        }
        // The bend is concave, so that it is least at an end.
        let bend_m = self.line.bend_m(from + nearest_m).min(self.line.bend_m(to + nearest_m));
        let lowered_m =
            if high_m < 0.0 { high_m * (1.0 - 0.5 * angle * angle).max(0.0) } else { high_m };
        let ceiling_m = lowered_m + self.margin_m + 1e-6 - bend_m;
        (from, to) = clip((from, to), rise - ceiling_m, climb)?;
        // The far side of the body is not below the near side.
        (from, to) =
            clip((from, to), -rise - 0.5 * self.ground.shape.body.b_m() - radius_m, -climb)?;
        Some((from + nearest_m, to + nearest_m))
    }

    /// Looks at the part of the line over or under one triangle.
    fn triangle(&mut self, triangle: &Triangle, service: Service) {
        let [a, b, c] = triangle.corners;
        let middle_m = (a - self.line.origin).dot(self.line.direction);
        let middle = self.line.at(middle_m);
        let mut span = (-middle_m, self.end_m - middle_m);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let edge = triangle.corners[j] - triangle.corners[i];
            let wall = edge.cross(triangle.normals[i] + triangle.normals[j]);
            let slack = 1e-8 * wall.abs().element_sum();
            let inside = (middle - triangle.corners[i]).dot(wall) - slack;
            let Some(left) = clip(span, inside, self.line.direction.dot(wall)) else { return };
            span = left;
        }
        let plane = (b - a).cross(c - a);
        let up = (triangle.normals[0] + triangle.normals[1] + triangle.normals[2]).normalize();
        if (middle + self.line.direction * span.0).dot(up) < 0.0 {
            return;
        }
        let lean = up.dot(plane);
        let bent = lean * self.line.bend_per_m;
        let height = Parabola {
            square: -bent,
            slope: self.line.direction.dot(plane) + bent * (self.line.length_m - 2.0 * middle_m),
            offset: (middle - a).dot(plane) + bent * middle_m * (self.line.length_m - middle_m),
        };
        // A concave function is least at an end.
        let least_m = height.at(span.0).min(height.at(span.1)) / lean;
        if service.coarser && least_m <= service.slack_m + self.margin_m {
            self.coarser_from_m = self.coarser_from_m.min(span.0 + middle_m);
        }
        let place = match self.goal {
            Goal::FirstHit => height.first_below(span),
            Goal::Clearance if least_m < self.margin_m => {
                Some(if height.at(span.0) <= height.at(span.1) { span.0 } else { span.1 })
            }
            Goal::Clearance => None,
        };
        let Some(s) = place else { return };
        let distance_m = s + middle_m;
        self.met = Some(Meeting { distance_m, normal: plane, level: service.level });
        match self.goal {
            Goal::FirstHit => self.end_m = distance_m,
            Goal::Clearance => self.margin_m = least_m,
        }
    }
}

/// offset + slope·s + square·s², with `square` at most 0.
#[derive(Clone, Copy)]
struct Parabola {
    offset: f64,
    slope: f64,
    square: f64,
}

impl Parabola {
    fn at(&self, s: f64) -> f64 {
        self.offset + s * (self.slope + s * self.square)
    }

    /// The first place of a span where the parabola is not above 0.
    fn first_below(&self, (from, to): (f64, f64)) -> Option<f64> {
        if self.at(from) <= 0.0 {
            return Some(from);
        }
        if self.at(to) > 0.0 {
            return None;
        }
        let root = (self.slope * self.slope - 4.0 * self.square * self.offset).max(0.0).sqrt();
        let s = if self.slope <= 0.0 {
            2.0 * self.offset / (root - self.slope)
        } else {
            (-self.slope - root) / (2.0 * self.square)
        };
        Some(s.clamp(from, to))
    }
}

/// The part of a span where offset + slope·s is at most 0.
#[inline]
pub(super) fn clip((from, to): (f64, f64), offset: f64, slope: f64) -> Option<(f64, f64)> {
    if slope == 0.0 {
        return (offset <= 0.0).then_some((from, to));
    }
    let zero = -offset / slope;
    let (from, to) = if slope > 0.0 { (from, to.min(zero)) } else { (from.max(zero), to) };
    (from <= to).then_some((from, to))
}

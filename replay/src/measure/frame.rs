//! The errors of one frame, ray by ray, and of a flight, frame by frame.
//!
//! In:    a terrain after a frame, that frame's output, pages.
//! Out:   [`FrameErrors`]; [`FlightErrors`].
//! Keeps: [`Measure`]: the reference, the meshes of this frame and of the one before.
//! Not here: what a single ray meets (`reference`, `raster`, `mesh`), the costly metrics
//!        (`thorough`), names and units (`report`).
//!
//! E1, the radial pixel error: a ray meets the ground at x, whose geodetic normal is n. The mesh
//! meets the vertical of n at m; the error is the distance of the pixels of m and x. P1, the pop:
//! the distance of the pixels of m now and m in the frame before, both as seen now; counted where
//! the place was in the picture of the frame before as well.

use super::cast::Caster;
use super::errors::{FlightErrors, FrameErrors};
use super::holes::Seen;
use super::mesh::{Foothold, MeshThen};
use super::nearby::Nearby;
use super::raster::Raster;
use super::rays::Grid;
use super::reference::{Hit, MakePage, PagePart, Reference};
use super::screen::Screen;
use super::share::share;
use super::spread::{Gathered, Spread, Where};
use super::thorough;
use glam::{DVec2, DVec3};
use overfly_core::camera::Camera;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::frame::{FrameOutput, Terrain};
use overfly_core::geodesy::{Ecef, Ellipsoid};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// How a flight is measured.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeasureSettings {
    /// Rays of a frame, at least.
    pub rays: u32,
    /// Where in their strata they lie.
    pub seed: u64,
    /// Cells of the reference look no larger than this, in pixels.
    pub cell_px: f64,
    /// Threads that trace rays, the caller's included.
    pub threads: usize,
    /// Every so many measured frames the costly metrics are measured too, the first one included;
    /// 0 is never.
    pub thorough_every: u64,
    /// Every so many measured frames a part of E1 is found a second way, the first one included;
    /// 0 is never.
    pub cross_every: u64,
}

impl Default for MeasureSettings {
    fn default() -> Self {
        Self {
            rays: 100_000,
            seed: 1,
            cell_px: 1.0,
            threads: 1,
            thorough_every: 30,
            cross_every: 90,
        }
    }
}

/// What one ray found. Where there is nothing to tell a number is negative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) e1_px: f64,
    pub(super) e2_share: f64,
    pub(super) e2_m: f64,
    pub(super) p1_px: f64,
    pub(super) p3_deg: f64,
    /// 0 where there is no ground.
    pub(super) ground_m: f64,
    pub(super) normal: DVec3,
    pub(super) lost: bool,
}

impl Found {
    const NOTHING: Self = Self {
        e1_px: -1.0,
        e2_share: -1.0,
        e2_m: -1.0,
        p1_px: -1.0,
        p3_deg: -1.0,
        ground_m: 0.0,
        normal: DVec3::ZERO,
        lost: false,
    };
}

/// What the last ray found, near which the next one looks.
#[derive(Default)]
struct Last {
    /// Leaf of the mesh.
    leaf: usize,
    /// Of this leaf it is known whether it stays as it was in the frame before.
    asked: Option<usize>,
    stays: bool,
}

/// What is told of a frame beside its mesh.
#[derive(Clone, Copy)]
struct Shown {
    camera: Camera,
    bound_px: f64,
    triangles: u32,
}

impl Shown {
    fn of(terrain: &Terrain, output: &FrameOutput) -> Self {
        let (bound_px, triangles) = (terrain.bound_px(output), output.counts.triangles);
        Self { camera: output.views[0].camera, bound_px, triangles }
    }
}

/// A frame as it was drawn, apart from its terrain: that may run on while this is measured.
pub struct Taken {
    mesh: MeshThen,
    shown: Option<Shown>,
}

impl Taken {
    /// None yet, of terrains over a body.
    pub fn new(body: Ellipsoid) -> Self {
        Self { mesh: MeshThen::new(body), shown: None }
    }

    /// Takes the first view of the frame that a terrain has just run.
    pub fn take(&mut self, terrain: &Terrain, output: &FrameOutput) {
        self.mesh.take(terrain, output.time_ms);
        self.shown = Some(Shown::of(terrain, output));
    }
}

/// Measures the frames of a flight.
pub struct Measure {
    pub(super) settings: MeasureSettings,
    pub(super) body: Ellipsoid,
    /// The ground itself.
    pub reference: Reference,
    /// The mesh of the frame that was taken last.
    pub now: MeshThen,
    /// The mesh of the frame before.
    pub before: MeshThen,
    /// The picture of the frame before, if pops can be counted from it.
    then: Option<Screen>,
    /// The picture of the frame that was taken last.
    seen: Option<Screen>,
    /// What was told of it, if it came apart from its terrain.
    shown: Option<Shown>,
    /// What the rays of the frame that was measured last meet of the mesh.
    pub raster: Raster,
    pub(super) found: Vec<Found>,
    grid: Option<Grid>,
    measured: u64,
    stop: Arc<AtomicBool>,
}

impl Measure {
    /// For the terrains of one scene.
    pub fn new(terrain: &Terrain, settings: MeasureSettings) -> Self {
        let scene = terrain.settings();
        Self {
            settings,
            body: scene.body,
            reference: Reference::new(scene.body, scene.sea, settings.cell_px),
            now: MeshThen::new(scene.body),
            before: MeshThen::new(scene.body),
            then: None,
            seen: None,
            shown: None,
            raster: Raster::default(),
            found: Vec::new(),
            grid: None,
            measured: 0,
            stop: Arc::default(),
        }
    }

    /// Gives up soon after this flag is set, even within a frame.
    pub fn stop_on(&mut self, stop: Arc<AtomicBool>) {
        self.stop = stop;
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Takes the mesh of a frame over; the one taken before it becomes what pops are counted from.
    /// For a frame that is not measured itself this is all that there is to do, and it need only
    /// be done for the last one before a frame that is.
    pub fn take(&mut self, terrain: &Terrain, output: &FrameOutput) {
        std::mem::swap(&mut self.now, &mut self.before);
        self.now.take(terrain, output.time_ms);
        self.then = self.seen.replace(Screen::new(&output.views[0].camera));
    }

    /// The same for a frame that was taken apart from its terrain; another one is handed back, of
    /// which only the memory counts.
    pub fn accept(&mut self, taken: &mut Taken) {
        std::mem::swap(&mut self.now, &mut self.before);
        std::mem::swap(&mut self.now, &mut taken.mesh);
        self.shown = taken.shown.take();
        let shown = self.shown.as_ref().expect("a frame was taken");
        self.then = self.seen.replace(Screen::new(&shown.camera));
    }

    /// Nothing pops from the last frame to the next: other frames lie between, or the camera was
    /// cut.
    pub fn cut(&mut self) {
        self.seen = None;
    }

    /// Measures the first view of the frame that a terrain has just run. The frame before must
    /// have been taken or measured, else pops are not counted. False if it was stopped: then there
    /// is nothing of this frame.
    pub fn frame(
        &mut self,
        (terrain, output): (&Terrain, &FrameOutput),
        frame: u64,
        make: MakePage<'_>,
        flight: &mut FlightErrors,
    ) -> bool {
        self.take(terrain, output);
        self.judge((terrain, output), frame, make, flight)
    }

    /// Whether the next frame is one of those in which the costly metrics are measured, which need
    /// its terrain.
    pub fn needs_terrain(&self) -> bool {
        self.is_due(self.settings.thorough_every)
    }

    fn is_due(&self, every: u64) -> bool {
        every > 0 && self.measured.is_multiple_of(every)
    }

    /// Measures the frame whose mesh was taken last: [`Self::now`] is what is judged.
    pub fn judge(
        &mut self,
        (terrain, output): (&Terrain, &FrameOutput),
        frame: u64,
        make: MakePage<'_>,
        flight: &mut FlightErrors,
    ) -> bool {
        self.judge_shown(Shown::of(terrain, output), Some((terrain, output)), (frame, make), flight)
    }

    /// Measures the frame that was [accepted](Self::accept) last, which [needs no
    /// terrain](Self::needs_terrain).
    pub fn judge_accepted(
        &mut self,
        frame: u64,
        make: MakePage<'_>,
        flight: &mut FlightErrors,
    ) -> bool {
        assert!(!self.needs_terrain(), "this frame's costly metrics are due");
        let shown = self.shown.take().expect("a frame was accepted");
        self.judge_shown(shown, None, (frame, make), flight)
    }

    fn judge_shown(
        &mut self,
        Shown { camera, bound_px, triangles }: Shown,
        whole: Option<(&Terrain, &FrameOutput)>,
        (frame, make): (u64, MakePage<'_>),
        flight: &mut FlightErrors,
    ) -> bool {
        let camera = &camera;
        let screen = Screen::new(camera);
        let grid = Grid::new(screen.size_px, self.settings.rays, (self.settings.seed, frame));
        self.grid = Some(grid);
        let mut errors = FrameErrors {
            frame,
            bound_px,
            rays: grid.len() as u64,
            mesh_triangles: u64::from(triangles),
            ..FrameErrors::default()
        };
        self.place_eye(camera, &mut errors);
        if self.then.is_some_and(|then| is_cut(&then, &screen, errors.above_m)) {
            self.then = None;
            flight.cuts += 1;
        }
        if self.then.is_some() {
            errors.gap_ms = self.now.time_ms.wrapping_sub(self.before.time_ms);
        }
        self.reference.begin();
        self.raster.draw(&self.now.drawn, (&screen, &grid), self.settings.threads);
        self.trace((&screen, &grid), make);
        if self.is_stopped() {
            return false;
        }
        errors.stretched = u64::from(self.raster.stretched);
        errors.triangles = u64::from(self.raster.triangles);
        self.gather(&grid, &mut errors, flight);
        self.count_holes((&screen, &grid), make, &mut errors);
        let due = [self.settings.thorough_every, self.settings.cross_every];
        let due = due.map(|every| self.is_due(every));
        errors.thorough = whole.and_then(|(terrain, output)| {
            let shot = thorough::Shot { terrain, output, screen, grid, make, frame };
            thorough::measure(self, &shot, due)
        });
        if self.is_stopped() {
            return false;
        }
        errors.missing_pages = self.reference.missing();
        self.measured += 1;
        flight.frames.push(errors);
        true
    }

    fn place_eye(&self, camera: &Camera, errors: &mut FrameErrors) {
        let at = self.body.geodetic_from_ecef(camera.eye);
        errors.eye = [at.lat_rad.to_degrees(), at.lon_rad.to_degrees(), at.height_m];
        let foothold = self.now.find(camera.normal, 30);
        errors.above_m = foothold.map_or(f64::NAN, |found| at.height_m - found.height_m);
    }

    /// A page: the reference's own, if it has it.
    pub(super) fn page(
        &self,
        shot: &thorough::Shot<'_>,
        (key, part): (PageKey, PagePart),
    ) -> Option<Arc<Page>> {
        self.reference.page(key, part).or_else(|| (shot.make)(key, part))
    }

    /// Pages, made on all threads where they must be; none after it was stopped.
    pub(super) fn pages(
        &self,
        shot: &thorough::Shot<'_>,
        (keys, part): (&[PageKey], PagePart),
    ) -> Vec<Option<Arc<Page>>> {
        let make = |at: usize| {
            if self.is_stopped() { None } else { self.page(shot, (keys[at], part)) }
        };
        share(keys.len(), self.settings.threads, make)
    }

    /// Whether there is a frame before, from which pops are counted.
    pub(super) fn has_before(&self) -> bool {
        self.then.is_some()
    }

    /// All rays, tile by tile on all threads; each result has its own place.
    fn trace(&mut self, (screen, grid): (&Screen, &Grid), make: MakePage<'_>) {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        found.resize(grid.len(), Found::NOTHING);
        let columns = grid.columns as usize;
        let caster = Caster { reference: &self.reference, screen, make };
        let bands: Vec<Mutex<&mut [Found]>> =
            found.chunks_mut(columns * TILE).map(Mutex::new).collect();
        share(bands.len(), self.settings.threads, |at| {
            let mut rays = bands[at].lock().unwrap_or_else(PoisonError::into_inner);
            self.trace_band(&caster, grid, at * TILE, &mut rays);
        });
        self.found = found;
    }

    fn trace_band(&self, caster: &Caster<'_>, grid: &Grid, first: usize, rays: &mut [Found]) {
        let columns = grid.columns as usize;
        let rows = rays.len() / columns;
        let stratum = grid.stratum_px();
        for left in (0..columns).step_by(TILE) {
            let right = (left + TILE).min(columns);
            let corner = |column: usize, row: usize| {
                DVec2::new(column as f64, (first + row) as f64) * stratum
            };
            if self.is_stopped() {
                return;
            }
            let mut nearby = caster.within(corner(left, 0), corner(right, rows));
            let mut last = Last::default();
            for (row, column) in (0..rows).flat_map(|row| (left..right).map(move |c| (row, c))) {
                let at = (column, first + row);
                rays[row * columns + column] =
                    self.trace_ray(caster, (&mut nearby, grid), at, &mut last);
            }
        }
    }

    /// The ray of stratum (column, row).
    fn trace_ray<'a>(
        &self,
        caster: &Caster<'a>,
        (nearby, grid): (&mut Nearby<'a>, &Grid),
        (column, row): (usize, usize),
        last: &mut Last,
    ) -> Found {
        let [c, r] = [column, row].map(|at| u32::try_from(at).expect("a stratum"));
        let pixel = grid.pixel(c, r);
        let Some(hit) = caster.meet(nearby, pixel) else { return Found::NOTHING };
        let ray = row * grid.columns as usize + column;
        let mesh_m = self.raster.depth_m[ray];
        if mesh_m.is_finite() {
            last.leaf = self.raster.leaf[ray] as usize;
        }
        let found = self.compare(caster.screen, &hit, last);
        if !mesh_m.is_finite() {
            return found;
        }
        let along_m = (mesh_m - hit.depth_m).abs();
        let length = caster.screen.tangents(pixel).length();
        Found { e2_share: along_m / hit.depth_m, e2_m: along_m * length, ..found }
    }

    fn compare(&self, screen: &Screen, hit: &Hit, last: &mut Last) -> Found {
        let mut found = Found { ground_m: hit.depth_m, normal: hit.normal, ..Found::NOTHING };
        let Some(now) = self.now.find_near(hit.normal, last.leaf) else {
            return Found { lost: true, ..found };
        };
        last.leaf = now.leaf;
        let mesh = hit.place + hit.normal * (now.height_m - hit.height_m);
        let (Some(a), Some(b)) = (screen.pixel(mesh), screen.pixel(hit.place)) else {
            return found;
        };
        found.e1_px = (a - b).length();
        if self.then.is_some_and(|then| then.shows(hit.place)) {
            let pop = self.pop(screen, hit, (&now, a), last);
            (found.p1_px, found.p3_deg) = pop.unwrap_or((0.0, 0.0));
        }
        found
    }

    /// How far the mesh moved on the screen since the frame before, the screen being now's, and
    /// by how many degrees its shading normal turned.
    fn pop(
        &self,
        screen: &Screen,
        hit: &Hit,
        (now, pixel): (&Foothold, DVec2),
        last: &mut Last,
    ) -> Option<(f64, f64)> {
        let leaf = self.now.leaf(now);
        if last.asked != Some(now.leaf) {
            let same = |at: usize| {
                let was = &self.before.drawn.leaves[at];
                was.content == leaf.content && !was.morphs && !leaf.morphs
            };
            last.asked = Some(now.leaf);
            last.stays = self.before.drawn.find(leaf.key).is_some_and(same);
        }
        if last.stays {
            return None;
        }
        let then = self.before.find(hit.normal, leaf.level)?;
        let mesh = hit.place + hit.normal * (then.height_m - hit.height_m);
        let turned_rad = angle_rad(self.now.shading(now), self.before.shading(&then));
        Some(((screen.pixel(mesh)? - pixel).length(), turned_rad.to_degrees()))
    }

    fn gather(&self, grid: &Grid, errors: &mut FrameErrors, flight: &mut FlightErrors) {
        let frame = errors.frame;
        let of = |value: fn(&Found) -> f64, spread: &mut Spread, gathered: &mut Gathered| {
            let met = |&at: &usize| value(&self.found[at]) >= 0.0;
            let met: Vec<usize> = (0..self.found.len()).filter(met).collect();
            let mut values: Vec<f64> = met.iter().map(|&at| value(&self.found[at])).collect();
            *spread = Spread::of(&mut values, |at| self.place(grid, met[at], frame));
            gathered.add(&values, spread);
        };
        type Value = fn(&Found) -> f64;
        let all: [(Value, &mut Spread, &mut Gathered); 5] = [
            (|found| found.e1_px, &mut errors.e1_px, &mut flight.e1_px),
            (|found| found.e2_share, &mut errors.e2_share, &mut flight.e2_share),
            (|found| found.e2_m, &mut errors.e2_m, &mut flight.e2_m),
            (|found| found.p1_px, &mut errors.p1_px, &mut flight.p1_px),
            (|found| found.p3_deg, &mut errors.p3_deg, &mut flight.p3_deg),
        ];
        let all = all.map(Mutex::new);
        share(all.len(), self.settings.threads, |at| {
            let mut one = all[at].lock().unwrap_or_else(PoisonError::into_inner);
            let (value, spread, gathered) = &mut *one;
            of(*value, spread, gathered);
        });
        let count = |is: fn(&Found) -> bool| self.found.iter().filter(|f| is(f)).count() as u64;
        errors.lost = count(|found| found.lost);
        errors.p1_above_half = count(|found| found.p1_px > 0.5);
    }

    /// Where a ray met the ground.
    fn place(&self, grid: &Grid, ray: usize, frame: u64) -> Where {
        let columns = grid.columns as usize;
        let [c, r] = [ray % columns, ray / columns];
        let [c, r] = [c, r].map(|at| u32::try_from(at).expect("a stratum"));
        self.place_of(self.found[ray].normal, grid.pixel(c, r), frame)
    }

    /// A place by its normal.
    pub(super) fn place_of(&self, normal: DVec3, pixel: DVec2, frame: u64) -> Where {
        let at = self.body.geodetic_from_ecef(Ecef(self.body.surface_from_normal(normal)));
        Where {
            frame,
            lat_deg: at.lat_rad.to_degrees(),
            lon_deg: at.lon_rad.to_degrees(),
            pixel: pixel.to_array(),
        }
    }

    fn count_holes(
        &self,
        (screen, grid): (&Screen, &Grid),
        make: MakePage<'_>,
        errors: &mut FrameErrors,
    ) {
        let ground = |at: usize| self.found[at].ground_m > 0.0;
        let mesh = |at: usize| self.raster.depth_m[at].is_finite();
        let differ = (0..grid.len()).filter(|&at| ground(at) != mesh(at));
        errors.e3_rays = differ.count() as u64;
        let seen = Seen {
            caster: Caster { reference: &self.reference, screen, make },
            grid,
            ground_m: &|at| self.found[at].ground_m,
            raster: &self.raster,
            mesh: &self.now.drawn,
            stray_px: errors.bound_px.min(4.0 * errors.e1_px.p99 + 1.0),
        };
        [errors.holes, errors.pinholes] = seen.count(self.settings.threads);
    }

    /// E1 of every ray of the frame that was measured last, row by row, and how many are in a row;
    /// negative where there is none.
    pub fn map(&self) -> (usize, Vec<f64>) {
        let columns = self.grid.map_or(0, |grid| grid.columns as usize);
        (columns, self.found.iter().map(|found| found.e1_px).collect())
    }
}

/// Whether the eye has jumped or turned so far that it is another view.
fn is_cut(then: &Screen, now: &Screen, above_m: f64) -> bool {
    let reach_m = 100.0_f64.max(0.2 * above_m.abs());
    let turned = then.axes.iter().zip(&now.axes).any(|(then, now)| then.dot(*now) < 0.5);
    turned || (then.eye - now.eye).length() > reach_m
}

/// Angle between two vectors, also where it is tiny.
fn angle_rad(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Strata along one side of a tile, whose rays look at the same plates.
const TILE: usize = 16;

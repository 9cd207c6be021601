//! The errors of one frame, ray by ray, and of a flight, frame by frame.
//!
//! In:    a terrain after a frame, that frame's output, pages.
//! Out:   [`FrameErrors`]; [`FlightErrors`].
//! Keeps: [`Measure`]: the reference, the meshes of this frame and of the one before.
//! Not here: what a single ray meets (`reference`, `raster`, `mesh`).
//!
//! E1, the radial pixel error: a ray meets the ground at x, whose geodetic normal is n. The mesh
//! meets the vertical of n at m; the error is the distance of the pixels of m and x. P1, the pop:
//! the distance of the pixels of m now and m in the frame before, both as seen now.

use super::errors::{FlightErrors, FrameErrors};
use super::mesh::MeshThen;
use super::raster::Raster;
use super::rays::Grid;
use super::reference::{Hit, MakePage, Reference};
use super::screen::Screen;
use super::spread::{Gathered, Spread, Where};
use glam::{DVec2, DVec3};
use overfly_core::camera::Camera;
use overfly_core::frame::{FrameOutput, Terrain};
use overfly_core::geodesy::{Ecef, Ellipsoid};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};

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
}

impl Default for MeasureSettings {
    fn default() -> Self {
        Self { rays: 100_000, seed: 1, cell_px: 1.0, threads: 1 }
    }
}

/// What one ray found.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Distance of mesh and ground on the screen; negative where there is none to tell.
    e1_px: f64,
    e2_share: f64,
    p1_px: f64,
    ground_m: f64,
    normal: DVec3,
    lost: bool,
}

/// Measures the frames of a flight.
pub struct Measure {
    settings: MeasureSettings,
    body: Ellipsoid,
    /// The ground itself.
    pub reference: Reference,
    /// The mesh of the frame that was measured last.
    pub now: MeshThen,
    before: MeshThen,
    has_before: bool,
    raster: Raster,
    found: Vec<Found>,
    grid: Option<Grid>,
}

impl Measure {
    /// For the terrains of one scene.
    pub fn new(terrain: &Terrain, settings: MeasureSettings) -> Self {
        let scene = terrain.settings();
        Self {
            settings,
            body: scene.body,
            reference: Reference::new(scene.body, scene.sea, settings.cell_px, settings.threads),
            now: MeshThen::new(scene.body),
            before: MeshThen::new(scene.body),
            has_before: false,
            raster: Raster::default(),
            found: Vec::new(),
            grid: None,
        }
    }

    /// Remembers a frame that is not measured itself: pops of the next are counted from it.
    pub fn note(&mut self, terrain: &Terrain, output: &FrameOutput) {
        self.now.take(terrain, output.time_ms);
        self.has_before = true;
    }

    /// Nothing pops from the last frame to the next: the camera was cut.
    pub fn cut(&mut self) {
        self.has_before = false;
    }

    /// Measures the first view of the frame that a terrain has just run. The frame before must
    /// have been noted or measured, else pops are not counted.
    pub fn frame(
        &mut self,
        (terrain, output): (&Terrain, &FrameOutput),
        frame: u64,
        make: MakePage<'_>,
        flight: &mut FlightErrors,
    ) {
        std::mem::swap(&mut self.now, &mut self.before);
        self.now.take(terrain, output.time_ms);
        let camera = &output.views[0].camera;
        let screen = Screen::new(camera);
        let grid = Grid::new(screen.size_px, self.settings.rays, (self.settings.seed, frame));
        self.grid = Some(grid);
        self.reference.gather(&screen, make);
        self.raster.draw(&self.now.drawn, &screen, &grid);
        self.trace(&screen, &grid);
        let mut errors = FrameErrors {
            frame,
            bound_px: output.counts.error_px_bound,
            rays: grid.len() as u64,
            stretched: u64::from(self.raster.stretched),
            triangles: u64::from(self.raster.triangles),
            missing_pages: self.reference.missing as u64,
            ..FrameErrors::default()
        };
        self.place_eye(camera, &mut errors);
        self.gather(&grid, &mut errors, flight);
        self.count_holes(&grid, &mut errors);
        self.has_before = true;
        flight.frames.push(errors);
    }

    fn place_eye(&self, camera: &Camera, errors: &mut FrameErrors) {
        let at = self.body.geodetic_from_ecef(camera.eye);
        errors.eye = [at.lat_rad.to_degrees(), at.lon_rad.to_degrees(), at.height_m];
        let foothold = self.now.find(camera.normal, 30);
        errors.above_m = foothold.map_or(f64::NAN, |found| at.height_m - found.height_m);
    }

    /// All rays, tile by tile on all threads; each result has its own place.
    fn trace(&mut self, screen: &Screen, grid: &Grid) {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        found.resize(grid.len(), Found::default());
        let columns = grid.columns as usize;
        let bands: Vec<Mutex<(usize, &mut [Found])>> =
            found.chunks_mut(columns * TILE).enumerate().map(Mutex::new).collect();
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(band) = bands.get(next.fetch_add(1, Ordering::Relaxed)) {
                let mut band = band.lock().unwrap_or_else(PoisonError::into_inner);
                let (at, rays) = &mut *band;
                self.trace_band(screen, grid, (*at * TILE, rays));
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.settings.threads.max(1) {
                scope.spawn(work);
            }
            work();
        });
        self.found = found;
    }

    fn trace_band(&self, screen: &Screen, grid: &Grid, (first, rays): (usize, &mut [Found])) {
        let columns = grid.columns as usize;
        let rows = rays.len() / columns;
        let stratum = grid.stratum_px();
        for left in (0..columns).step_by(TILE) {
            let right = (left + TILE).min(columns);
            let corner = |column: usize, row: usize| {
                let pixel = DVec2::new(column as f64, (first + row) as f64) * stratum;
                screen.to_body(screen.tangents(pixel))
            };
            let corners =
                [corner(left, 0), corner(right, 0), corner(right, rows), corner(left, rows)];
            let middle = corners[0] + corners[1] + corners[2] + corners[3];
            let planes = [0, 1, 2, 3].map(|i| {
                let plane = corners[(i + 1) % 4].cross(corners[i]).normalize();
                if plane.dot(middle) < 0.0 { -plane } else { plane }
            });
            let nearby = self.reference.nearby(screen.eye, &planes);
            let mut level = 30;
            for (row, column) in (0..rows).flat_map(|row| (left..right).map(move |c| (row, c))) {
                let [c, r] = [column, first + row].map(|at| u32::try_from(at).expect("a stratum"));
                let direction = screen.to_body(screen.tangents(grid.pixel(c, r)));
                let hit = self.reference.meet(&nearby, screen.eye, direction);
                let at = row * columns + column;
                rays[at] = Found { e1_px: -1.0, ..Found::default() };
                let Some(hit) = hit.filter(|hit| hit.depth_m >= screen.near_m) else { continue };
                let mesh_m = self.raster.depth_m[(first + row) * columns + column];
                rays[at] = self.compare(screen, (&hit, mesh_m), &mut level);
            }
        }
    }

    fn compare(&self, screen: &Screen, (hit, mesh_m): (&Hit, f64), level: &mut u8) -> Found {
        let mut found = Found {
            e1_px: -1.0,
            e2_share: (mesh_m - hit.depth_m).abs() / hit.depth_m,
            ground_m: hit.depth_m,
            normal: hit.normal,
            ..Found::default()
        };
        let Some(now) = self.now.find(hit.normal, *level) else {
            return Found { lost: true, ..found };
        };
        *level = self.now.leaf(&now).level;
        let mesh = hit.place + hit.normal * (now.height_m - hit.height_m);
        let (Some(a), Some(b)) = (screen.pixel(mesh), screen.pixel(hit.place)) else {
            return found;
        };
        found.e1_px = (a - b).length();
        found.p1_px = self.pop_px(screen, hit, (now, a)).unwrap_or(0.0);
        found
    }

    /// How far the mesh moved on the screen since the frame before, the screen being now's.
    fn pop_px(
        &self,
        screen: &Screen,
        hit: &Hit,
        (now, pixel): (super::mesh::Foothold, DVec2),
    ) -> Option<f64> {
        let leaf = self.now.leaf(&now);
        let same = |at: usize| {
            let was = &self.before.drawn.leaves[at];
            was.content == leaf.content && !was.morphs && !leaf.morphs
        };
        if !self.has_before || self.before.drawn.find(leaf.key).is_some_and(same) {
            return None;
        }
        let then = self.before.find(hit.normal, leaf.level)?;
        let mesh = hit.place + hit.normal * (then.height_m - hit.height_m);
        Some((screen.pixel(mesh)? - pixel).length())
    }

    fn gather(&mut self, grid: &Grid, errors: &mut FrameErrors, flight: &mut FlightErrors) {
        let met: Vec<usize> =
            (0..self.found.len()).filter(|&at| self.found[at].e1_px >= 0.0).collect();
        let seen = |at: usize| {
            let index = met[at];
            let place = Ecef(self.body.surface_from_normal(self.found[index].normal));
            let place = self.body.geodetic_from_ecef(place);
            let columns = grid.columns as usize;
            let [c, r] = [index % columns, index / columns];
            let [c, r] = [c, r].map(|at| u32::try_from(at).expect("a stratum"));
            Where {
                frame: errors.frame,
                lat_deg: place.lat_rad.to_degrees(),
                lon_deg: place.lon_rad.to_degrees(),
                pixel: grid.pixel(c, r).to_array(),
            }
        };
        let of = |value: fn(&Found) -> f64, gathered: &mut Gathered| {
            let mut values: Vec<f64> = met.iter().map(|&at| value(&self.found[at])).collect();
            let spread = Spread::of(&mut values, seen);
            gathered.add(&values, &spread);
            spread
        };
        let e1_px = of(|found| found.e1_px, &mut flight.e1_px);
        let e2_share = of(|found| found.e2_share.min(1e9), &mut flight.e2_share);
        let p1_px = of(|found| found.p1_px, &mut flight.p1_px);
        (errors.e1_px, errors.e2_share, errors.p1_px) = (e1_px, e2_share, p1_px);
        errors.lost = self.found.iter().filter(|found| found.lost).count() as u64;
    }

    /// Rays that only one of both meets, and what of them is a hole: all eight around it meet
    /// both, and agree.
    fn count_holes(&self, grid: &Grid, errors: &mut FrameErrors) {
        let (columns, rows) = (grid.columns as usize, grid.rows as usize);
        let ground = |at: usize| self.found[at].ground_m > 0.0;
        let mesh = |at: usize| self.raster.depth_m[at].is_finite();
        let differ = (0..grid.len()).filter(|&at| ground(at) != mesh(at));
        errors.e3_rays = differ.count() as u64;
        for (row, column) in (1..rows.saturating_sub(1))
            .flat_map(|r| (1..columns.saturating_sub(1)).map(move |c| (r, c)))
        {
            let at = row * columns + column;
            if !ground(at) {
                continue;
            }
            let ratio = |at: usize| self.raster.depth_m[at] / self.found[at].ground_m;
            let agrees = |at: usize| ground(at) && mesh(at) && (ratio(at) - 1.0).abs() < AGREE;
            let around = [at - columns - 1, at - columns, at - columns + 1, at - 1, at + 1]
                .into_iter()
                .chain([at + columns - 1, at + columns, at + columns + 1]);
            if !mesh(at) && around.clone().all(agrees) {
                errors.holes += 1;
            } else if mesh(at) && ratio(at) > 1.0 + 10.0 * AGREE && around.clone().all(agrees) {
                errors.pinholes += 1;
            }
        }
    }

    /// E1 of every ray of the frame that was measured last, row by row, and how many are in a row;
    /// negative where there is none.
    pub fn map(&self) -> (usize, Vec<f64>) {
        let columns = self.grid.map_or(0, |grid| grid.columns as usize);
        (columns, self.found.iter().map(|found| found.e1_px).collect())
    }
}

/// Strata along one side of a tile, whose rays look at the same plates.
const TILE: usize = 16;
/// Depths of mesh and ground that differ by less agree.
const AGREE: f64 = 0.02;

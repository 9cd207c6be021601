//! The ground that errors are measured against: plates as fine as the picture can show.
//!
//! In:    the projection of a frame; pages, made when they are needed.
//! Out:   the plates of a frame; where rays meet them.
//! Keeps: the plates of the last frames.
//! Not here: a single plate (`plate`), what is made of the hits (`error`).
//!
//! A plate is fine enough when its cells look no larger than a stated share of a pixel; a coarser
//! one is halved into four. What the reference itself leaves out is stated, not hidden: the page's
//! own bound of what its triangles miss, and a sample of it that `error` measures.

use super::plate::{Box3, Meeting, Plate};
use super::screen::Screen;
use glam::DVec3;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::LEVEL_MAX;
use overfly_core::lod::screen_error::Horizon;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Makes pages: any thread may ask; `None` where it cannot be made.
pub type MakePage<'a> = &'a (dyn Fn(PageKey) -> Option<Arc<Page>> + Sync);

/// Plates that were not needed for this many measured frames are dropped.
const IDLE_FRAMES: u64 = 90;
/// No deeper pages: their level is the last.
const DEPTH_LAST: u8 = LEVEL_MAX / 2 - 6;

/// The reference ground of a scene.
pub struct Reference {
    body: Ellipsoid,
    sea: bool,
    /// A cell looks no larger than this, in pixels.
    cell_px: f64,
    threads: usize,
    plates: BTreeMap<PageKey, Kept>,
    frame: u64,
    /// Plates of this frame, the nearest first.
    shown: Vec<Shown>,
    /// Pages that could not be made in this frame: the ground is coarser there.
    pub missing: usize,
}

struct Kept {
    plate: Arc<Plate>,
    used: u64,
}

/// A plate that this frame may see.
struct Shown {
    plate: Arc<Plate>,
    eye: DVec3,
    nearest_m: f64,
    centre: DVec3,
    radius_m: f64,
}

/// Where a ray met the ground.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Depth along the view direction, metres.
    pub depth_m: f64,
    /// Geodetic normal of the place.
    pub normal: DVec3,
    /// The place, body-fixed metres.
    pub place: DVec3,
    /// Height above the ellipsoid, metres.
    pub height_m: f64,
}

/// The plates that some tile of the picture may show.
pub struct Nearby(Vec<u32>);

impl Reference {
    /// Nothing yet.
    pub fn new(body: Ellipsoid, sea: bool, cell_px: f64, threads: usize) -> Self {
        let (plates, shown) = (BTreeMap::new(), Vec::new());
        Self { body, sea, cell_px, threads, plates, frame: 0, shown, missing: 0 }
    }

    /// Plates that are kept.
    pub fn plates(&self) -> usize {
        self.plates.len()
    }

    /// Plates that this frame may see.
    pub fn shown(&self) -> usize {
        self.shown.len()
    }

    /// Gathers the plates of a frame.
    pub fn gather(&mut self, screen: &Screen, make: MakePage<'_>) {
        self.frame += 1;
        self.missing = 0;
        self.shown.clear();
        let mut wave: Vec<PageKey> = (0..4).map(PageKey::root).collect();
        let mut floor_m = 0.0_f64;
        while !wave.is_empty() {
            self.load(&wave, make);
            let mut next = Vec::new();
            if wave[0].depth() == 0 {
                let roots = wave.iter().filter_map(|key| self.plates.get(key));
                floor_m =
                    roots.map(|kept| kept.plate.low_m - kept.plate.error_max_m).fold(0.0, f64::min);
            }
            let horizon = Horizon::new(&self.body, [floor_m.max(-0.5 * self.body.b_m()), 0.0]);
            for key in &wave {
                self.show_or_split(*key, (screen, &horizon), &mut next);
            }
            wave = next;
        }
        self.shown.sort_by(|a, b| a.nearest_m.total_cmp(&b.nearest_m));
        let oldest = self.frame.saturating_sub(IDLE_FRAMES);
        self.plates.retain(|_, kept| kept.used >= oldest);
    }

    /// Shows a plate, or finds its children where it is too coarse. A page that cannot be made is
    /// stood in for by its parent.
    fn show_or_split(&mut self, key: PageKey, eyes: (&Screen, &Horizon), next: &mut Vec<PageKey>) {
        let Some(kept) = self.plates.get_mut(&key) else {
            let parent = key.parent().and_then(|parent| self.plates.get(&parent));
            let stand_in = parent.map(|kept| kept.plate.clone());
            stand_in.into_iter().for_each(|plate| self.show(plate, eyes.0));
            return;
        };
        kept.used = self.frame;
        let plate = kept.plate.clone();
        if !self.split(&plate, eyes, next) {
            self.show(plate, eyes.0);
        }
    }

    /// Whether a plate is too coarse for where it lies; then its children are due.
    fn split(
        &mut self,
        plate: &Plate,
        (screen, horizon): (&Screen, &Horizon),
        next: &mut Vec<PageKey>,
    ) -> bool {
        let eye = plate.local(screen.eye);
        let nearest_m = plate.whole().distance(eye).max(screen.near_m);
        let cell_px = plate.cell_m * screen.scale_px / nearest_m;
        if cell_px <= self.cell_px || plate.key.depth() >= DEPTH_LAST {
            return false;
        }
        let planes = side_planes(screen).map(|plane| plate.axes * plane);
        let eye_up_m = self.body.geodetic_from_ecef(overfly_core::geodesy::Ecef(screen.eye));
        let below = eye_up_m.height_m <= horizon.floor_m;
        let high_m = plate.high_m + plate.error_max_m;
        let reach_m = horizon.tangent_m(eye_up_m.height_m) + horizon.tangent_m(high_m);
        for index in 0..4 {
            let around = plate.quarter(index).grown(plate.error_max_m);
            let seen = planes.iter().all(|plane| farthest(&around, *plane, eye) >= 0.0);
            if seen && (below || around.distance(eye) <= reach_m) {
                next.push(plate.key.child(index));
            }
        }
        true
    }

    fn show(&mut self, plate: Arc<Plate>, screen: &Screen) {
        let eye = plate.local(screen.eye);
        let whole = plate.whole();
        let middle = (whole.low + whole.high) * 0.5;
        self.shown.push(Shown {
            eye,
            nearest_m: whole.distance(eye),
            centre: plate.origin + plate.axes.transpose() * middle,
            radius_m: (whole.high - middle).length(),
            plate,
        });
    }

    /// Makes what is missing of a wave, on all threads.
    fn load(&mut self, wave: &[PageKey], make: MakePage<'_>) {
        let missing: Vec<PageKey> =
            wave.iter().filter(|key| !self.plates.contains_key(key)).copied().collect();
        let (made, next) = (Mutex::new(Vec::new()), AtomicUsize::new(0));
        let work = || {
            while let Some(&key) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                let plate = make(key).map(|page| Plate::new(&page, &self.body, self.sea));
                let mut made = made.lock().unwrap_or_else(PoisonError::into_inner);
                made.push((key, plate));
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.threads.min(missing.len()).max(1) {
                scope.spawn(work);
            }
            work();
        });
        for (key, plate) in made.into_inner().unwrap_or_else(PoisonError::into_inner) {
            match plate {
                Some(plate) => {
                    self.plates.insert(key, Kept { plate: Arc::new(plate), used: self.frame });
                }
                None => self.missing += 1,
            }
        }
    }

    /// The plates that some rays may meet, given the planes around them.
    pub fn nearby(&self, eye: DVec3, planes: &[DVec3; 4]) -> Nearby {
        let meets = |shown: &Shown| {
            let away = shown.centre - eye;
            planes.iter().all(|plane| plane.dot(away) >= -shown.radius_m)
        };
        let found = (0_u32..).zip(&self.shown).filter(|(_, shown)| meets(shown));
        Nearby(found.map(|(at, _)| at).collect())
    }

    /// Where a ray first meets the ground; `direction` has depth 1.
    pub fn meet(&self, nearby: &Nearby, eye: DVec3, direction: DVec3) -> Option<Hit> {
        let mut best: Option<(Meeting, &Plate)> = None;
        let mut end = f64::INFINITY;
        let length = direction.length();
        for &at in &nearby.0 {
            let shown = &self.shown[at as usize];
            if shown.nearest_m > end * length {
                break;
            }
            let away = shown.centre - eye;
            let along = away.dot(direction) / (length * length);
            let beside = (away - direction * along).length_squared();
            if beside > shown.radius_m * shown.radius_m {
                continue;
            }
            let local = shown.plate.axes * direction;
            if let Some(found) = shown.plate.meet(shown.eye, local, end) {
                end = found.t;
                best = Some((found, &shown.plate));
            }
        }
        best.map(|(found, plate)| self.hit(&found, plate))
    }

    /// The place of a meeting: its normal is that of its weights on the lattice, and its height
    /// where the vertical there meets the triangle's plane.
    fn hit(&self, found: &Meeting, plate: &Plate) -> Hit {
        let points = found.corners.map(|(i, j)| plate.key.sample(i, j).as_dvec3());
        let [wa, wb, wc] = found.weights;
        let normal = (points[0] * wa + points[1] * wb + points[2] * wc).normalize();
        let foot = self.body.surface_from_normal(normal);
        let [a, b, c] = found.corners.map(|corner| plate.corner(corner));
        let plane = (b - a).cross(c - a);
        let level_m = found.corners.map(|corner| plate.surface_m(corner));
        let height_m = if plane == DVec3::ZERO {
            // Below an edge: a skirt.
            level_m[0] * wa + level_m[1] * wb
        } else {
            (a - foot).dot(plane) / normal.dot(plane)
        };
        Hit { depth_m: found.t, normal, place: foot + normal * height_m, height_m }
    }
}

/// The four planes through the eye that bound the picture, pointing inward.
fn side_planes(screen: &Screen) -> [DVec3; 4] {
    let [right, up, forward] = screen.axes;
    let [x, y] = screen.size_px.map(|size_px| 0.5 * size_px / screen.scale_px);
    [forward * x + right, forward * x - right, forward * y + up, forward * y - up]
        .map(DVec3::normalize)
}

/// Greatest value of a plane through `eye` over a box.
fn farthest(around: &Box3, plane: DVec3, eye: DVec3) -> f64 {
    let (a, b) = ((around.low - eye) * plane, (around.high - eye) * plane);
    a.max(b).element_sum()
}

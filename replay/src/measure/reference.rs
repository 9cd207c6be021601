//! The ground that errors are measured against: plates as fine as the picture can show.
//!
//! In:    the eye of a frame; pages, made when a ray first needs them.
//! Out:   where rays meet the ground.
//! Keeps: the plates of the last frames, as a tree.
//! Not here: a single plate (`plate`), the way of a ray (`nearby`), what is made of the hits.
//!
//! A plate is fine enough when its cells look no larger than a stated share of a pixel; in place of
//! a coarser one stand its four children. Rays choose: a child is made when the first ray enters
//! the box around all that it may have before it has met nearer ground. So what lies behind ridges
//! is never made, and bounds, which take twice as long as heights, only for plates that have
//! children. What a ray meets hangs on that ray and the eye alone, in whatever order and on
//! whatever thread rays are cast. What the reference itself leaves out is stated, not hidden: what
//! lies below its cells.

use super::plate::{Finer, Meeting, Plate};
use glam::DVec3;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::geodesy::Ellipsoid;
use overfly_core::ground::LEVEL_MAX;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Makes pages: any thread may ask; `None` where it cannot be made.
pub type MakePage<'a> = &'a (dyn Fn(PageKey, PagePart) -> Option<Arc<Page>> + Sync);

/// What is wanted of a page. Heights are the same either way.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum PagePart {
    /// Heights alone: bounds are infinite and normals are none, or all is there.
    Heights,
    /// All of it.
    Whole,
}

/// Plates that were not needed for this many measured frames are dropped.
const IDLE_FRAMES: u64 = 90;
/// No deeper pages: their level is the last.
pub(super) const DEPTH_LAST: u8 = LEVEL_MAX / 2 - 6;

/// The reference ground of a scene.
pub struct Reference {
    body: Ellipsoid,
    sea: bool,
    /// A cell looks no larger than this, in pixels.
    cell_px: f64,
    roots: [Node; 4],
    frame: u64,
    /// Pages that could not be made in this frame: the ground is coarser there.
    missing: AtomicU64,
    made: AtomicU64,
}

/// A plate that may be made.
pub(super) struct Node {
    pub(super) key: PageKey,
    used: AtomicU64,
    /// `None` where the page cannot be made.
    plate: OnceLock<Option<Box<Plate>>>,
    /// What is known of finer plates, where the eye came so near that it was asked for.
    finer: OnceLock<Option<Box<Finer>>>,
    kids: OnceLock<Box<[Node; 4]>>,
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

impl Node {
    fn new(key: PageKey) -> Self {
        Self {
            key,
            used: AtomicU64::new(0),
            plate: OnceLock::new(),
            finer: OnceLock::new(),
            kids: OnceLock::new(),
        }
    }

    pub(super) fn kids(&self) -> &[Self; 4] {
        self.kids.get_or_init(|| Box::new([0, 1, 2, 3].map(|at| Self::new(self.key.child(at)))))
    }

    /// Drops what was not used since, and what could not be made: that is tried again.
    fn forget(&mut self, oldest: u64) {
        if self.plate.get().is_some_and(Option::is_none) {
            self.plate = OnceLock::new();
        }
        if self.finer.get().is_some_and(Option::is_none) {
            self.finer = OnceLock::new();
        }
        let Some(kids) = self.kids.get_mut() else { return };
        if kids.iter().all(|kid| kid.used.load(Ordering::Relaxed) < oldest) {
            self.kids = OnceLock::new();
        } else {
            kids.iter_mut().for_each(|kid| kid.forget(oldest));
        }
    }
}

impl Reference {
    /// Nothing yet.
    pub fn new(body: Ellipsoid, sea: bool, cell_px: f64) -> Self {
        let roots = [0, 1, 2, 3].map(|quadrant| Node::new(PageKey::root(quadrant)));
        let (missing, made) = (AtomicU64::new(0), AtomicU64::new(0));
        Self { body, sea, cell_px, roots, frame: 0, missing, made }
    }

    /// Plates that were ever made.
    pub fn made(&self) -> u64 {
        self.made.load(Ordering::Relaxed)
    }

    /// Pages that some ray of this frame needed and that could not be made: the ground is coarser
    /// there.
    pub fn missing(&self) -> u64 {
        self.missing.load(Ordering::Relaxed)
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.frame += 1;
        self.missing = AtomicU64::new(0);
        let oldest = self.frame.saturating_sub(IDLE_FRAMES);
        self.roots.iter_mut().for_each(|root| root.forget(oldest));
    }

    /// A page, if as much of it was made for a plate that is still kept.
    pub fn page(&self, key: PageKey, part: PagePart) -> Option<Arc<Page>> {
        let mut node = &self.roots[usize::from(key.quadrant())];
        for depth in (0..key.depth()).rev() {
            let bit = |of: u32| (of >> depth & 1) as usize;
            node = &node.kids.get()?[2 * bit(key.y()) + bit(key.x())];
        }
        let whole = || node.finer.get()?.as_ref().map(|finer| finer.page.clone());
        let heights = || node.plate.get()?.as_ref().map(|plate| plate.page.clone());
        whole().or_else(|| heights().filter(|_| part == PagePart::Heights))
    }

    /// The plate of a node, made now if it must be.
    pub(super) fn plate<'a>(&self, node: &'a Node, make: MakePage<'_>) -> Option<&'a Plate> {
        node.used.store(self.frame, Ordering::Relaxed);
        let plate = node.plate.get_or_init(|| {
            let page = make(node.key, PagePart::Heights);
            let count = if page.is_some() { &self.made } else { &self.missing };
            count.fetch_add(1, Ordering::Relaxed);
            page.map(|page| Box::new(Plate::new(page, &self.body, self.sea)))
        });
        plate.as_deref()
    }

    /// What finer plates below that of a node may have, found out now if it must be.
    pub(super) fn finer<'a>(
        &self,
        (node, plate): (&'a Node, &Plate),
        make: MakePage<'_>,
    ) -> Option<&'a Finer> {
        let finer = node.finer.get_or_init(|| {
            let page = make(node.key, PagePart::Whole);
            if page.is_none() {
                self.missing.fetch_add(1, Ordering::Relaxed);
            }
            page.map(|page| Box::new(Finer::new(page, plate)))
        });
        finer.as_deref()
    }

    pub(super) fn roots(&self) -> impl Iterator<Item = &Node> {
        self.roots.iter()
    }

    pub(super) fn body(&self) -> &Ellipsoid {
        &self.body
    }

    pub(super) fn cell_px(&self) -> f64 {
        self.cell_px
    }

    /// The place of a meeting: its normal is that of its weights on the lattice, and its height
    /// where the vertical there meets the triangle's plane.
    pub(super) fn hit(&self, found: &Meeting, plate: &Plate) -> Hit {
        let points = found.corners.map(|(i, j)| plate.key.sample(i, j).as_dvec3());
        let [wa, wb, wc] = found.weights;
        let normal = (points[0] * wa + points[1] * wb + points[2] * wc).normalize();
        let foot = self.body.surface_from_normal(normal);
        let [a, b, c] = found.corners.map(|corner| plate.corner(corner));
        let plane = (b - a).cross(c - a);
        let height_m = if plane == DVec3::ZERO {
            // Below an edge: a skirt.
            let [from_m, to_m, _] = found.corners.map(|corner| plate.surface_m(corner));
            from_m * wa + to_m * wb
        } else {
            (a - foot).dot(plane) / normal.dot(plane)
        };
        Hit { depth_m: found.t, normal, place: foot + normal * height_m, height_m }
    }
}

//! Regions: which pages they need, how many of them are there, how high the ground is in them.
//!
//! In:    discs on the ellipsoid, levels.
//! Out:   page keys, [`Readiness`], [`MinMax`].
//! Keeps: nothing.
//! Not here: rays (`walk`), triangles (`patch`).
//!
//! A square of the lattice is tested by its covering cap of normals, so that a page may be named
//! that the region only nearly touches, and none is forgotten.

use super::answer::{Answer, MinMax, Readiness};
use super::place::{DEPTH_END, LEVEL_MAX, depth_of, level_of};
use super::resident::{BLOCK_BITS, Range, Resident};
use super::{Ground, is_place};
use crate::datasource::PageKey;
use crate::geodesy::{Ellipsoid, Geodetic};
use crate::lattice::{Quadrant, RADIUS, fold};
use crate::lod::reach::NORM_MIN;
use core::fmt;
use glam::DVec3;

/// All places whose distance from `centre` along the ellipsoid is at most `radius_m`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Region {
    /// The middle; its height is not looked at.
    pub centre: Geodetic,
    /// Metres, 0 or more.
    pub radius_m: f64,
}

/// Why a region was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RegionFault {
    /// Not finite, latitude beyond ±π/2, negative radius, or level beyond [`LEVEL_MAX`].
    Refused,
    /// The region needs more pages than this.
    TooLarge {
        /// The limit.
        pages_max: u32,
    },
}

impl fmt::Display for RegionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused => write!(f, "the region or the level is not one"),
            Self::TooLarge { pages_max } => {
                write!(f, "the region needs more than {pages_max} pages at this level")
            }
        }
    }
}

impl core::error::Error for RegionFault {}

/// A square of side R/2^depth of the lattice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Square {
    /// Which base quadrant.
    pub quadrant: Quadrant,
    /// Halvings of the quadrant's side, at most 28.
    pub depth: u8,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

impl Square {
    /// The square of a page.
    pub fn of(key: PageKey) -> Self {
        Self { quadrant: key.quadrant(), depth: key.depth(), x: key.x(), y: key.y() }
    }

    /// One of its quarters.
    pub fn child(self, index: u8) -> Self {
        let (dx, dy) = (u32::from(index & 1), u32::from(index >> 1));
        Self { depth: self.depth + 1, x: 2 * self.x + dx, y: 2 * self.y + dy, ..self }
    }

    /// Its page.
    pub fn page(self) -> PageKey {
        PageKey::new(self.quadrant, self.depth, self.x, self.y)
    }

    /// Normal at its middle, and a bound on the angle to any normal in it.
    ///
    /// No point is farther from the middle than half a steep diagonal, √6/2 sides; the angle
    /// between two points is at most 2·asin of half the chord of their directions.
    pub fn cap(self) -> (DVec3, f64) {
        let side = RADIUS >> self.depth;
        let along = |index: u32| index.cast_signed() * side + side / 2;
        let p = fold(self.quadrant, along(self.x), along(self.y)).as_dvec3();
        let (norm, extent) = (p.length(), 1.224_8 * f64::from(side));
        let chord = (extent / (norm - extent).max(NORM_MIN)).min(2.0);
        (p / norm, chord * (1.0 + 0.15 * chord * chord))
    }
}

/// A region as a cap of normals.
#[derive(Clone, Copy)]
pub struct Cap {
    normal: DVec3,
    angle_rad: f64,
}

impl Cap {
    /// Of a region; `None` where it is not one.
    pub fn of(region: Region, body: &Ellipsoid) -> Option<Self> {
        let sound =
            is_place(region.centre) && region.radius_m >= 0.0 && region.radius_m.is_finite();
        let [curvature_min, _] = body.curvature_radii_m();
        let angle_rad = region.radius_m / curvature_min * (1.0 + 1e-9) + 1e-12;
        sound.then(|| Self { normal: region.centre.normal(), angle_rad })
    }

    /// Whether it may reach into a square: chords are shorter than angles.
    pub fn meets(&self, square: Square) -> bool {
        let (normal, angle_rad) = square.cap();
        (normal - self.normal).length() <= self.angle_rad + angle_rad
    }
}

/// Visits the squares of one depth that the cap may reach into, quarter by quarter. Stops where
/// `visit` says so.
pub fn each_square(cap: &Cap, depth: u8, visit: &mut impl FnMut(Square) -> bool) -> bool {
    (0..4).all(|quadrant| descend(cap, Square { quadrant, depth: 0, x: 0, y: 0 }, depth, visit))
}

fn descend(cap: &Cap, square: Square, depth: u8, visit: &mut impl FnMut(Square) -> bool) -> bool {
    if !cap.meets(square) {
        return true;
    }
    if square.depth == depth {
        return visit(square);
    }
    (0..4).all(|index| descend(cap, square.child(index), depth, visit))
}

/// More pages than this no question about readiness may need.
const PAGES_MAX: u32 = 1 << 20;

impl Ground {
    /// All pages that heights of `level` anywhere in the region need, from the roots down: parents
    /// first, sorted by key. Allocates. Does not depend on what is resident.
    ///
    /// # Errors
    /// If the region is not one, or needs more than `pages_max` pages.
    pub fn pages_of(
        &self,
        region: Region,
        level: u8,
        pages_max: u32,
    ) -> Result<Vec<PageKey>, RegionFault> {
        let mut pages = Vec::new();
        self.each_page(region, level, pages_max, &mut |page| pages.push(page))?;
        pages.sort_unstable();
        Ok(pages)
    }

    /// How much of what `level` needs in the region is resident.
    ///
    /// # Errors
    /// If the region is not one, or needs more than a million pages.
    pub fn readiness(&self, region: Region, level: u8) -> Result<Readiness, RegionFault> {
        let (mut needed, mut missing) = (0_u32, 0_u32);
        let mut worst_level = Some(level);
        self.each_page(region, level, PAGES_MAX, &mut |page| {
            needed += 1;
            if self.contains(page) {
                return;
            }
            missing += 1;
            let here = page.depth().checked_sub(1).map(level_of);
            worst_level = worst_level.min(here);
        })?;
        let fraction = f64::from(needed - missing) / f64::from(needed);
        Ok(Readiness { fraction, worst_level, missing })
    }

    /// Visits the pages that a region needs, parents before their children.
    fn each_page(
        &self,
        region: Region,
        level: u8,
        pages_max: u32,
        visit: &mut impl FnMut(PageKey),
    ) -> Result<(), RegionFault> {
        let cap = Cap::of(region, self.body()).filter(|_| level <= LEVEL_MAX);
        let cap = cap.ok_or(RegionFault::Refused)?;
        let mut pages = 0;
        for depth in 0..=depth_of(level) {
            let fits = each_square(&cap, depth, &mut |square| {
                visit(square.page());
                pages += 1;
                pages <= pages_max
            });
            if !fits {
                return Err(RegionFault::TooLarge { pages_max });
            }
        }
        Ok(())
    }

    /// Bounds on the ground over a region, from the finest pages that are resident: `Ok` where
    /// something is resident everywhere, else `NotReady`.
    pub fn min_max(&self, region: Region) -> Answer<MinMax> {
        let Some(cap) = Cap::of(region, self.body()) else { return Answer::Refused };
        let mut search = Search { ground: self, cap, found: None };
        for quadrant in 0..4 {
            let root = Square { quadrant, depth: 0, x: 0, y: 0 };
            if !search.cap.meets(root) {
                continue;
            }
            let Some(page) = self.map.find(root.page()) else { return Answer::NotReady };
            search.page(page, page.ground);
        }
        search.found.map_or(Answer::NotReady, Answer::Ok)
    }
}

/// A search for the lowest and the highest ground: what cannot widen the bounds is not visited.
struct Search<'a> {
    ground: &'a Ground,
    cap: Cap,
    found: Option<MinMax>,
}

impl Search<'_> {
    fn widens(&self, range: Range) -> bool {
        self.found.is_none_or(|found| {
            f64::from(range.low_m) < found.low_m || f64::from(range.high_m) > found.high_m
        })
    }

    /// Visits a page whose ground lies within `outer`.
    fn page(&mut self, page: &Resident, outer: Range) {
        let square = Square::of(page.page.key);
        for index in 0..4 {
            let child = square.child(index);
            if !self.widens(outer) || !self.cap.meets(child) {
                continue;
            }
            let finer = (square.depth < DEPTH_END).then(|| self.ground.map.find(child.page()));
            match finer.flatten() {
                Some(finer) => self.page(finer, meet(outer, finer.ground)),
                None => self.blocks(page, child, outer),
            }
        }
    }

    /// Visits the blocks of a page within one of its squares.
    fn blocks(&mut self, page: &Resident, square: Square, outer: Range) {
        let key = page.page.key;
        let bits = square.depth - key.depth();
        let mask = (1_u32 << bits) - 1;
        let (x, y) = ((square.x & mask) as usize, (square.y & mask) as usize);
        if bits == BLOCK_BITS {
            let range = meet(outer, page.block_ground(x, y));
            let level = level_of(key.depth());
            let found = self.found.get_or_insert(MinMax {
                low_m: f64::from(range.low_m),
                high_m: f64::from(range.high_m),
                level,
            });
            found.low_m = found.low_m.min(f64::from(range.low_m));
            found.high_m = found.high_m.max(f64::from(range.high_m));
            found.level = found.level.min(level);
            return;
        }
        for child in (0..4).map(|index| square.child(index)) {
            if self.cap.meets(child) {
                self.blocks(page, child, outer);
            }
        }
    }
}

/// Where both hold.
fn meet(a: Range, b: Range) -> Range {
    Range { low_m: a.low_m.max(b.low_m), high_m: a.high_m.min(b.high_m) }
}

//! Which page: a cell of the quadtree over one quadrant of the octahedral square.
//!
//! In:    quadrant, depth, column, row.
//! Out:   [`PageKey`], packed into 64 bits; its lattice extent.
//! Keeps: nothing.
//! Not here: what a page holds (`page`), which are resident (`pages`).

use crate::lattice::{Quadrant, RADIUS, fold, signs};
use core::fmt;
use glam::IVec3;

/// A page's samples are 2^6 + 1 a side.
pub const PAGE_BITS: u8 = 6;
/// Samples along one side of a page.
pub const PAGE_SIDE: usize = (1 << PAGE_BITS) + 1;
/// Pages no deeper than this: their samples are 2 lattice units apart.
pub const DEPTH_MAX: u8 = 29 - PAGE_BITS;

/// Names one page. Ordered by depth, then quadrant, column and row.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageKey(u64);

impl PageKey {
    /// The page at column `x` and row `y` of depth `depth`.
    ///
    /// # Panics
    /// If the depth is beyond [`DEPTH_MAX`] or the cell outside the square.
    pub fn new(quadrant: Quadrant, depth: u8, x: u32, y: u32) -> Self {
        assert!(quadrant < 4 && depth <= DEPTH_MAX && x >> depth == 0 && y >> depth == 0);
        Self(
            (u64::from(depth) << 58)
                | (u64::from(quadrant) << 56)
                | (u64::from(x) << 28)
                | u64::from(y),
        )
    }

    /// The root page of a quadrant.
    pub fn root(quadrant: Quadrant) -> Self {
        Self::new(quadrant, 0, 0, 0)
    }

    /// Back from its 64 bits; `None` where they name no page.
    pub fn from_bits(bits: u64) -> Option<Self> {
        let key = Self(bits);
        let fits =
            key.depth() <= DEPTH_MAX && key.x() >> key.depth() == 0 && key.y() >> key.depth() == 0;
        fits.then_some(key)
    }

    /// As 64 bits, for files and digests.
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The cell in the whole octahedral square, as tile archives count: zoom, column and row from
    /// the square's lower left corner (−x−y). The north pole is in the middle, the south pole at
    /// all four corners. A tile keeps its quadrant's own u and v, away from the pole.
    pub fn zxy(self) -> (u8, u32, u32) {
        let half = 1 << self.depth();
        let (sx, sy) = signs(self.quadrant());
        let place = |sign: i32, along: u32| if sign > 0 { half + along } else { half - 1 - along };
        (self.depth() + 1, place(sx, self.x()), place(sy, self.y()))
    }

    /// The page of a tile; `None` where the tile is no page.
    pub fn from_zxy(z: u8, x: u32, y: u32) -> Option<Self> {
        let depth = z.checked_sub(1).filter(|&depth| depth <= DEPTH_MAX)?;
        let half = 1_u32 << depth;
        if x >> z != 0 || y >> z != 0 {
            return None;
        }
        let (east, north) = (x >= half, y >= half);
        let quadrant = (0..4)
            .find(|&q| signs(q) == (if east { 1 } else { -1 }, if north { 1 } else { -1 }))?;
        let along =
            |positive: bool, place: u32| if positive { place - half } else { half - 1 - place };
        Some(Self::new(quadrant, depth, along(east, x), along(north, y)))
    }

    /// The page of some lesser depth that holds this one, or itself.
    ///
    /// # Panics
    /// If `depth` is greater than its own.
    pub fn ancestor(self, depth: u8) -> Self {
        let up = self.depth() - depth;
        Self::new(self.quadrant(), depth, self.x() >> up, self.y() >> up)
    }

    /// Depth in the quadtree; roots are 0.
    pub fn depth(self) -> u8 {
        (self.0 >> 58) as u8
    }

    /// Which base quadrant.
    pub fn quadrant(self) -> Quadrant {
        (self.0 >> 56 & 3) as u8
    }

    /// Column, along u.
    pub fn x(self) -> u32 {
        (self.0 >> 28 & 0xFFF_FFFF) as u32
    }

    /// Row, along v.
    pub fn y(self) -> u32 {
        (self.0 & 0xFFF_FFFF) as u32
    }

    /// The page that holds this one; `None` for roots.
    pub fn parent(self) -> Option<Self> {
        let depth = self.depth().checked_sub(1)?;
        Some(Self::new(self.quadrant(), depth, self.x() / 2, self.y() / 2))
    }

    /// Which child of its parent: 0 to 3, columns first.
    pub fn child_index(self) -> usize {
        usize::from((self.x() & 1) == 1) + 2 * usize::from((self.y() & 1) == 1)
    }

    /// The child at (column, row) offset in {0, 1}².
    pub fn child(self, index: usize) -> Self {
        let (dx, dy) = (u32::from(index & 1 == 1), u32::from(index & 2 == 2));
        Self::new(self.quadrant(), self.depth() + 1, 2 * self.x() + dx, 2 * self.y() + dy)
    }

    /// Side of the page in lattice units along u and v.
    pub fn side(self) -> i32 {
        RADIUS >> self.depth()
    }

    /// Distance of two samples in lattice units; at least 2.
    pub fn step(self) -> i32 {
        self.side() >> PAGE_BITS
    }

    /// The corner with the least u and v.
    #[expect(clippy::cast_possible_wrap, reason = "28 bits")]
    pub fn origin(self) -> (i32, i32) {
        (self.x() as i32 * self.side(), self.y() as i32 * self.side())
    }

    /// The lattice point of sample (i, j).
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "below 65")]
    pub fn sample(self, i: usize, j: usize) -> IVec3 {
        let (u, v) = self.origin();
        fold(self.quadrant(), u + i as i32 * self.step(), v + j as i32 * self.step())
    }
}

impl fmt::Debug for PageKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}/{}", self.depth(), self.quadrant(), self.x(), self.y())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_keeps_its_parts_and_its_family() {
        let key = PageKey::new(3, 7, 100, 27);
        assert_eq!((key.quadrant(), key.depth(), key.x(), key.y()), (3, 7, 100, 27));
        assert_eq!(PageKey::from_bits(key.bits()), Some(key));
        for index in 0..4 {
            let child = key.child(index);
            assert_eq!(child.parent(), Some(key));
            assert_eq!(child.child_index(), index);
            assert_eq!(child.step() * 2, key.step());
        }
        for key in (0..4).flat_map(|q| [PageKey::root(q), PageKey::new(q, 9, 511, 3)]) {
            let (z, x, y) = key.zxy();
            assert_eq!(PageKey::from_zxy(z, x, y), Some(key));
        }
        assert_eq!(PageKey::from_zxy(0, 0, 0), None);
        assert_eq!(PageKey::root(2).parent(), None);
        assert_eq!(PageKey::from_bits(u64::MAX), None);
        assert_eq!(PageKey::new(0, DEPTH_MAX, 0, 0).step(), 2);
    }
}

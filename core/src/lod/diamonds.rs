//! The diamonds of a surface, as columns: two leaf triangles on a common hypotenuse, one vertex.
//!
//! In:    capacity; bounds and links set by `operate`.
//! Out:   every field by [`DiamondId`].
//! Keeps: topology, regions, priorities, the running mesh digest.
//! Not here: splitting and merging (`operate`), queues (`queues`).
//!
//! A diamond's corners run counter-clockwise seen from outside: end 0, apex 0, end 1, apex 1. Its
//! centre is the middle of the hypotenuse (end 0, end 1). The apexes are the centres of its two
//! parents, so triangle `side` (0 or 1) belongs to the mesh where parent `side` is split and the
//! diamond is not. Kid e lies on the edge from corner e to corner e + 1; kids 0 and 1 touch
//! side 0, kids 2 and 3 side 1.

use super::screen_error::Region;
use crate::columns::{Column, Id, Pool};
use crate::datasource::Page;
use crate::digest::mix;
use crate::lattice::{key_of, middle};
use glam::IVec3;

/// Names one diamond of the pool.
pub enum Diamond {}

/// Index of a diamond.
pub type DiamondId = Id<Diamond>;

/// What a diamond is, whichever way it was reached: a function of its place in the lattice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shape {
    /// Ends of the hypotenuse.
    pub ends: [IVec3; 2],
    /// Right-angled corners: the parents' centres; the poles for base diamonds.
    pub apexes: [IVec3; 2],
    /// 0 for the base; each kid is one deeper.
    pub level: u8,
}

impl Shape {
    /// Its vertex: the middle of the hypotenuse.
    pub fn centre(&self) -> IVec3 {
        middle(self.ends[0], self.ends[1])
    }

    /// The four corners, counter-clockwise.
    pub fn corners(&self) -> [IVec3; 4] {
        [self.ends[0], self.apexes[0], self.ends[1], self.apexes[1]]
    }

    /// Corners of triangle `side`: apex, then the hypotenuse; counter-clockwise.
    pub fn triangle(&self, side: usize) -> [IVec3; 3] {
        [self.apexes[side], self.ends[1 - side], self.ends[side]]
    }
}

/// Links and state of one diamond.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Node {
    /// Key of the centre: ties, digests.
    pub key: u64,
    /// Corners and level.
    pub shape: Shape,
    /// Parents by side; empty for base diamonds.
    pub parents: [Option<DiamondId>; 2],
    /// Which kid of each parent this is.
    pub slots: [u8; 2],
    /// Kids by edge; a kid has a record while one of its parents is split.
    pub kids: [Option<DiamondId>; 4],
    /// Page that serves each side's triangle; held while that parent is split.
    pub pages: [Option<Id<Page>>; 2],
    /// Patch slot of each side's leaf triangle; empty unless it is a leaf.
    pub patches: [Option<u32>; 2],
    /// Whether it is split.
    pub split: bool,
    /// How many of its kids are split.
    pub split_kids: u8,
    /// Frame of its last split or merge.
    pub touched: u64,
}

impl Node {
    const EMPTY: Self = Self {
        key: 0,
        shape: Shape { ends: [IVec3::ZERO; 2], apexes: [IVec3::ZERO; 2], level: 0 },
        parents: [None; 2],
        slots: [0; 2],
        kids: [None; 4],
        pages: [None; 2],
        patches: [None; 2],
        split: false,
        split_kids: 0,
        touched: u64::MAX,
    };

    /// Whether triangle `side` is there: its parent is split, or it is of the base.
    pub fn has_side(&self, side: usize) -> bool {
        self.pages[side].is_some()
    }
}

/// Every diamond with a record.
pub struct Diamonds {
    /// Which places are taken.
    pub pool: Pool<Diamond>,
    /// Links and state.
    pub node: Column<Diamond, Node>,
    /// Bounds; read by every priority pass.
    pub region: Column<Diamond, Region>,
    /// Exact priority in pixels as of the frame in which it was last computed.
    pub priority_px: Column<Diamond, f64>,
    /// The base, once the root pages are resident.
    pub base: Option<[DiamondId; 4]>,
    /// Leaf triangles.
    pub leaves: u32,
    digest: u64,
}

impl Diamonds {
    /// No diamonds yet.
    pub fn new(capacity: u32) -> Self {
        Self {
            pool: Pool::new(capacity),
            node: Column::new(capacity, || Node::EMPTY),
            region: Column::new(capacity, Region::default),
            priority_px: Column::new(capacity, || 0.0),
            base: None,
            leaves: 0,
            digest: 0,
        }
    }

    /// A record for a diamond of this shape, linked to nothing yet.
    pub fn take(&mut self, shape: Shape) -> DiamondId {
        let id = self.pool.take().expect("limits hold a record for every split and leaf");
        self.node[id] = Node { key: key_of(shape.centre()), shape, ..Node::EMPTY };
        id
    }

    /// Gives a record back.
    pub fn give_back(&mut self, id: DiamondId) {
        self.node[id] = Node::EMPTY;
        self.region[id] = Region::default();
        self.priority_px[id] = 0.0;
        self.pool.give_back(id);
    }

    /// The edge of the neighbour, and the neighbour itself, that shares kid `edge` of `id`.
    ///
    /// Requires the parent on that edge's side to be split, so that the neighbour has a record.
    pub fn across(&self, id: DiamondId, edge: usize) -> (DiamondId, usize) {
        let node = &self.node[id];
        let side = edge / 2;
        let Some(parent) = node.parents[side] else {
            return self.across_base(id, edge);
        };
        let first = edge.is_multiple_of(2);
        let slot = usize::from(node.slots[side]);
        let turn = if first { slot + 1 } else { slot + 3 };
        let neighbour = self.node[parent].kids[turn & 3].expect("a split parent has all kids");
        let other_side = usize::from(self.node[neighbour].parents[1] == Some(parent));
        (neighbour, 2 * other_side + usize::from(first))
    }

    /// Base diamonds meet along the octahedron's meridians.
    fn across_base(&self, id: DiamondId, edge: usize) -> (DiamondId, usize) {
        let base = self.base.expect("the base exists");
        let quadrant = base.iter().position(|&b| b == id).expect("only the base has no parents");
        let (turn, other_edge) = [(1, 1), (3, 0), (3, 3), (1, 2)][edge];
        (base[(quadrant + turn) & 3], other_edge)
    }

    /// Counts a leaf triangle in or out of the mesh digest.
    pub fn count_leaf(&mut self, id: DiamondId, side: usize, there: bool) {
        let key = leaf_key(self.node[id].key, side);
        if there {
            self.leaves += 1;
            self.digest = self.digest.wrapping_add(mix(key));
        } else {
            self.leaves -= 1;
            self.digest = self.digest.wrapping_sub(mix(key));
        }
    }

    /// Sum of the hashes of all leaf triangles.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// All ids that may be taken.
    pub fn ids(&self) -> impl Iterator<Item = DiamondId> + use<> {
        (0..self.pool.used_end()).map(Id::new)
    }
}

/// One number for a leaf triangle.
pub fn leaf_key(diamond_key: u64, side: usize) -> u64 {
    diamond_key << 1 | u64::from(side == 1)
}

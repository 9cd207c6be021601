//! The diamonds of a surface: two leaf triangles on a common hypotenuse, one vertex, 64 bytes.
//!
//! In:    which diamond to split or merge.
//! Out:   shapes, links and roles by [`DiamondId`].
//! Keeps: one record a diamond, a cache line each, and the free list.
//! Not here: what the planet hangs on a diamond (`cover`), when to split (`refine`).
//!
//! A diamond's corners run counter-clockwise seen from outside: end 0, apex 0, end 1, apex 1. Its
//! centre is the middle of the hypotenuse (end 0, end 1). The apexes are the centres of its two
//! parents, so triangle `side` (0 or 1) belongs to the mesh where parent `side` is split and the
//! diamond is not. Kid e lies on the edge from corner e to corner e + 1; kids 0 and 1 touch
//! side 0, kids 2 and 3 side 1.
//!
//! Only the centre and one end are kept: the other end is as far on the other side, the apexes
//! are the parents' centres.

use crate::columns::{Column, Id};
use crate::lattice::{RADIUS, key_of, middle};
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

/// What may become of a diamond next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// Unsplit: it may be split.
    Leaf,
    /// Split, and none of its kids is: it may be merged.
    Parent,
    /// Split with split kids: it stays.
    Interior,
}

/// Where the agenda keeps a diamond.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Seat {
    /// The record is free; `place` is the next free one.
    Free,
    /// Nowhere: interior, or between two seats.
    None,
    /// In a bin; `place` says where.
    Bin,
    /// In a front heap; `place` is the stamp of its entry.
    Front,
}

/// One diamond. Hot fields only, and all of them: whoever looks at one loads one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Record {
    kids: [Option<DiamondId>; 4],
    parents: [Option<DiamondId>; 2],
    centre: IVec3,
    end: IVec3,
    /// Where the agenda keeps it, read by [`Record::seat`].
    pub place: u32,
    touched: u32,
    level: u8,
    /// Which container `place` speaks of.
    pub seat: Seat,
    split_kids: u8,
    /// Bits 0-1 and 2-3: which kid of parent 0 and 1 it is; 4 and 5: side 0 and 1 there; 6: split.
    bits: u8,
}

const _: () = assert!(size_of::<Record>() == 64);

const SIDE: u8 = 1 << 4;
const SPLIT: u8 = 1 << 6;
/// No frame has touched the record.
const NEVER: u32 = u32::MAX;

impl Record {
    const EMPTY: Self = Self {
        kids: [None; 4],
        parents: [None; 2],
        centre: IVec3::ZERO,
        end: IVec3::ZERO,
        place: 0,
        touched: NEVER,
        level: 0,
        seat: Seat::Free,
        split_kids: 0,
        bits: 0,
    };

    /// Its vertex.
    pub fn centre(&self) -> IVec3 {
        self.centre
    }

    /// 0 for the base; each kid is one deeper.
    pub fn level(&self) -> u8 {
        self.level
    }

    /// Key of the centre: ties, digests.
    pub fn key(&self) -> u64 {
        key_of(self.centre)
    }

    /// Parents by side; empty for base diamonds.
    pub fn parents(&self) -> [Option<DiamondId>; 2] {
        self.parents
    }

    /// Kids by edge; a kid has a record while one of its parents is split.
    pub fn kids(&self) -> [Option<DiamondId>; 4] {
        self.kids
    }

    /// Which kid of its parent `side` this is.
    pub fn slot(&self, side: usize) -> usize {
        usize::from(self.bits >> (2 * side) & 3)
    }

    /// Whether triangle `side` is there: its parent is split, or it is of the base.
    pub fn has_side(&self, side: usize) -> bool {
        self.bits & (SIDE << side) != 0
    }

    /// Whether it is split.
    pub fn is_split(&self) -> bool {
        self.bits & SPLIT != 0
    }

    /// How many of its kids are split.
    pub fn split_kids(&self) -> u8 {
        self.split_kids
    }

    /// What may become of it.
    pub fn role(&self) -> Role {
        match (self.is_split(), self.split_kids) {
            (false, _) => Role::Leaf,
            (true, 0) => Role::Parent,
            (true, _) => Role::Interior,
        }
    }

    /// Whether it was split or merged in this frame.
    pub fn is_touched(&self, frame: u32) -> bool {
        self.touched == frame
    }

    /// Which of its sides lies on `parent`'s side.
    pub fn side_of(&self, parent: DiamondId) -> usize {
        usize::from(self.parents[1] == Some(parent))
    }
}

/// Every diamond with a record.
pub struct Diamonds {
    records: Column<Diamond, Record>,
    base: Option<[DiamondId; 4]>,
    leaves: u32,
    live: u32,
    used_end: u32,
    capacity: u32,
    free: Option<DiamondId>,
}

impl core::ops::Index<DiamondId> for Diamonds {
    type Output = Record;
    fn index(&self, id: DiamondId) -> &Record {
        &self.records[id]
    }
}

impl core::ops::IndexMut<DiamondId> for Diamonds {
    fn index_mut(&mut self, id: DiamondId) -> &mut Record {
        &mut self.records[id]
    }
}

impl Diamonds {
    /// No diamonds yet.
    pub fn new(capacity: u32) -> Self {
        Self {
            records: Column::new(capacity, || Record::EMPTY),
            base: None,
            leaves: 0,
            live: 0,
            used_end: 0,
            capacity,
            free: None,
        }
    }

    /// The base, once it is there: one diamond a quadrant.
    pub fn base(&self) -> Option<[DiamondId; 4]> {
        self.base
    }

    /// Leaf triangles.
    pub fn leaves(&self) -> u32 {
        self.leaves
    }

    /// Diamonds with a record.
    pub fn live(&self) -> u32 {
        self.live
    }

    /// Records at and beyond this index were never taken.
    pub fn used_end(&self) -> u32 {
        self.used_end
    }

    /// All diamonds with a record, by index.
    pub fn ids(&self) -> impl Iterator<Item = DiamondId> + use<'_> {
        let all = (0..self.used_end).map(Id::new);
        all.filter(|&id| self[id].seat != Seat::Free)
    }

    /// The free list, the next to be taken first.
    pub fn free(&self) -> impl Iterator<Item = DiamondId> + use<'_> {
        core::iter::successors(self.free, |&id| next_free(self[id].place))
    }

    /// Loads records into the cache, all at once: a loop that does nothing else waits for memory
    /// once, not at every record.
    pub fn warm(&self, ids: &[DiamondId]) {
        core::hint::black_box(ids.iter().fold(0, |sum, &id| sum ^ self[id].level));
    }

    /// Corners and level.
    pub fn shape(&self, id: DiamondId) -> Shape {
        let record = &self[id];
        let pole = |side: usize| IVec3::Z * if side == 0 { RADIUS } else { -RADIUS };
        let apex = |side: usize| record.parents[side].map_or(pole(side), |p| self[p].centre);
        let offset = record.end - record.centre;
        Shape {
            ends: [record.end, record.centre - offset],
            apexes: [apex(0), apex(1)],
            level: record.level,
        }
    }

    /// Creates the base octahedron, eight leaf triangles.
    pub fn create_base(&mut self) -> [DiamondId; 4] {
        let base = [0, 1, 2, 3].map(|quadrant| {
            let shape = base_shape(quadrant);
            let id = self.take();
            let record = &mut self.records[id];
            (record.centre, record.end) = (shape.centre(), shape.ends[0]);
            record.bits = SIDE | SIDE << 1;
            id
        });
        self.leaves = 8;
        self.base = Some(base);
        base
    }

    /// Splits a leaf whose parents are split: each side's triangle becomes two, of the kids.
    pub fn split(&mut self, id: DiamondId, frame: u32) {
        debug_assert!(!self[id].is_split() && self[id].has_side(0) && self[id].has_side(1));
        let shape = self.shape(id);
        for edge in 0..4 {
            let kid = match self[id].kids[edge] {
                Some(kid) => kid,
                None => self.create_kid((id, &shape), edge),
            };
            let kid = &mut self.records[kid];
            kid.bits |= SIDE << kid.side_of(id);
        }
        let record = &mut self.records[id];
        record.bits |= SPLIT;
        record.touched = frame;
        for parent in record.parents.into_iter().flatten() {
            self.records[parent].split_kids += 1;
        }
        self.leaves += 2;
    }

    /// Merges a parent: the exact inverse of [`Self::split`]. `gone` is called with each kid that
    /// loses its record, before it does.
    pub fn merge(&mut self, id: DiamondId, frame: u32, mut gone: impl FnMut(&mut Self, DiamondId)) {
        debug_assert_eq!(self[id].role(), Role::Parent);
        for edge in 0..4 {
            let kid = self[id].kids[edge].expect("a split diamond has all kids");
            let side = self[kid].side_of(id);
            self.records[kid].bits &= !(SIDE << side);
            if !self[kid].has_side(1 - side) {
                gone(self, kid);
                self.give_back(kid);
            }
        }
        let record = &mut self.records[id];
        record.bits &= !SPLIT;
        record.touched = frame;
        for parent in record.parents.into_iter().flatten() {
            self.records[parent].split_kids -= 1;
        }
        self.leaves -= 2;
    }

    /// A record for kid `edge`, linked to both parents; the lesser key is parent 0.
    fn create_kid(&mut self, (id, shape): (DiamondId, &Shape), edge: usize) -> DiamondId {
        let (neighbour, other_edge) = self.across(id, edge);
        let corners = shape.corners();
        let (from, to) = (corners[edge], corners[(edge + 1) & 3]);
        let here_first = self[id].key() < self[neighbour].key();
        let ((first, slot), (second, other_slot), end) = if here_first {
            ((id, edge), (neighbour, other_edge), to)
        } else {
            ((neighbour, other_edge), (id, edge), from)
        };
        let kid = self.take();
        let bits = slot | other_slot << 2;
        let record = &mut self.records[kid];
        record.parents = [Some(first), Some(second)];
        (record.centre, record.end) = (middle(from, to), end);
        record.level = shape.level + 1;
        record.bits = u8::try_from(bits).expect("two numbers below 4");
        self.records[id].kids[edge] = Some(kid);
        self.records[neighbour].kids[other_edge] = Some(kid);
        kid
    }

    /// The edge of the neighbour, and the neighbour itself, that shares kid `edge` of `id`.
    ///
    /// Requires the parent on that edge's side to be split, so that the neighbour has a record.
    pub fn across(&self, id: DiamondId, edge: usize) -> (DiamondId, usize) {
        let record = &self[id];
        let side = edge / 2;
        let Some(parent) = record.parents[side] else {
            return self.across_base(id, edge);
        };
        let first = edge.is_multiple_of(2);
        let turn = record.slot(side) + if first { 1 } else { 3 };
        let neighbour = self[parent].kids[turn & 3].expect("a split parent has all kids");
        (neighbour, 2 * self[neighbour].side_of(parent) + usize::from(first))
    }

    /// Base diamonds meet along the octahedron's meridians.
    fn across_base(&self, id: DiamondId, edge: usize) -> (DiamondId, usize) {
        let base = self.base.expect("the base exists");
        let quadrant = base.iter().position(|&b| b == id).expect("only the base has no parents");
        let (turn, other_edge) = [(1, 1), (3, 0), (3, 3), (1, 2)][edge];
        (base[(quadrant + turn) & 3], other_edge)
    }

    fn take(&mut self) -> DiamondId {
        let id = match self.free {
            Some(id) => {
                self.free = next_free(self[id].place);
                id
            }
            None => {
                assert!(self.used_end < self.capacity, "limits hold a record for every diamond");
                self.used_end += 1;
                Id::new(self.used_end - 1)
            }
        };
        self.live += 1;
        self.records[id] = Record { seat: Seat::None, ..Record::EMPTY };
        id
    }

    /// Unlinks a diamond without sides from both parents and gives its record back.
    fn give_back(&mut self, id: DiamondId) {
        let record = self[id];
        for side in 0..2 {
            let parent = record.parents[side].expect("kids have parents");
            self.records[parent].kids[record.slot(side)] = None;
        }
        let next = self.free.map_or(0, |next| next.index() + 1);
        self.records[id] = Record { place: next, ..Record::EMPTY };
        self.free = Some(id);
        self.live -= 1;
    }
}

fn next_free(place: u32) -> Option<DiamondId> {
    place.checked_sub(1).map(Id::new)
}

/// The base diamond of a quadrant: ends east and west on the equator, apexes north and south.
pub fn base_shape(quadrant: u8) -> Shape {
    let (sx, sy) = crate::lattice::signs(quadrant);
    let (x, y) = (IVec3::X * sx * RADIUS, IVec3::Y * sy * RADIUS);
    let ends = if sx == sy { [y, x] } else { [x, y] };
    Shape { ends, apexes: [IVec3::Z * RADIUS, IVec3::NEG_Z * RADIUS], level: 0 }
}

/// One number for a leaf triangle.
pub fn leaf_key(diamond_key: u64, side: usize) -> u64 {
    diamond_key << 1 | u64::from(side == 1)
}

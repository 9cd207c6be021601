//! The diamonds whose exact priority matters in this frame, the first of them at hand.
//!
//! In:    diamonds on the wrong side of their threshold, with exact priorities.
//! Out:   the first of them: the greatest leaf, the least parent.
//! Keeps: an occupancy bit for each 1/64 octave of priority, a heap of the foremost octave part.
//! Not here: those whose side is certain (`wheel`).
//!
//! A bin is 1/64 octave of priority: the exponent and six mantissa bits of the f64, so finding it
//! needs no logarithm. Only the foremost bin is sorted, as a heap; ties go by level and key.

use super::bins::Bins;
use super::diamonds::{Diamond, DiamondId, Diamonds, Seat};
use crate::columns::Column;
use core::cmp::Ordering;

/// Bins of one such set.
pub const URGENT_BINS: u32 = 64 * 64;

/// Bit pattern of 2⁻²⁰ px, shifted: everything smaller but 0 shares bin 1.
const BASE: u64 = (1023 - 20) << 6;

/// A diamond's standing among others.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rank {
    /// Exact priority in pixels.
    pub priority_px: f64,
    /// Its level: parents before kids.
    pub level: u8,
    /// Its key.
    pub key: u64,
}

impl Rank {
    /// Total order, the greatest is split first and merged last.
    pub fn order(&self, other: &Self) -> Ordering {
        self.priority_px
            .total_cmp(&other.priority_px)
            .then(other.level.cmp(&self.level))
            .then(other.key.cmp(&self.key))
    }
}

/// The bin of a priority: monotone, exact to 1/64 octave.
fn bucket_of(priority_px: f64) -> u32 {
    if priority_px <= 0.0 {
        return 0;
    }
    let step = (priority_px.to_bits() >> 46).saturating_sub(BASE).clamp(1, 64 * 64 - 1);
    u32::try_from(step).expect("clamped to the bins")
}

/// What the set works on besides itself.
pub struct Seating<'a> {
    /// The diamonds, for seats and ties.
    pub diamonds: &'a mut Diamonds,
    /// The bins that all seats share.
    pub bins: &'a mut Bins,
    /// Exact priorities of urgent diamonds in pixels.
    pub priority_px: &'a Column<Diamond, f64>,
}

impl Seating<'_> {
    /// The standing of an urgent diamond.
    pub fn rank(&self, id: DiamondId) -> Rank {
        let record = &self.diamonds[id];
        let priority_px = self.priority_px[id];
        Rank { priority_px, level: record.level(), key: record.key() }
    }

    fn order(&self, a: DiamondId, b: DiamondId) -> Ordering {
        let exact = self.priority_px[a].total_cmp(&self.priority_px[b]);
        exact.then_with(|| self.rank(a).order(&self.rank(b)))
    }
}

/// One set of urgent diamonds.
pub struct Urgent {
    /// Its bins are this one and the [`URGENT_BINS`] from it.
    first_bin: u32,
    /// What the first of the set is: the greatest of leaves, the least of parents.
    wins: Ordering,
    occupied: [u64; 64],
    /// Heap of all that are in `front_bin` or beyond it.
    front: Vec<DiamondId>,
    front_bin: u32,
}

impl Urgent {
    /// An empty set over the bins from `first_bin`, whose first is the one that `wins`.
    pub fn new(first_bin: u32, wins: Ordering, capacity: u32) -> Self {
        Self { first_bin, wins, occupied: [0; 64], front: Vec::with_capacity(capacity as usize), front_bin: URGENT_BINS }
    }

    /// Bins from the least urgent to the most.
    fn step_of(&self, priority_px: f64) -> u32 {
        let bucket = bucket_of(priority_px);
        if self.wins == Ordering::Greater { bucket } else { URGENT_BINS - 1 - bucket }
    }

    /// Seats a diamond that is nowhere.
    pub fn push(&mut self, seating: &mut Seating<'_>, id: DiamondId) {
        let step = self.step_of(seating.priority_px[id]);
        if step >= self.front_bin {
            self.front.push(id);
            seating.diamonds[id].seat = Seat::Front;
            self.rise(seating, self.front.len() - 1);
        } else {
            seating.bins.push(seating.diamonds, self.first_bin + step, id);
            self.occupied[step as usize / 64] |= 1 << (step % 64);
        }
    }

    /// Takes a diamond out of the front heap.
    pub fn remove_from_front(&mut self, seating: &mut Seating<'_>, id: DiamondId) {
        let at = seating.diamonds[id].place as usize;
        debug_assert_eq!(self.front[at], id);
        seating.diamonds[id].seat = Seat::None;
        self.front.swap_remove(at);
        if at < self.front.len() {
            seating.diamonds[self.front[at]].place = index(at);
            self.rise(seating, at);
            self.sink(seating, at);
        }
    }

    /// Notes that one of the set's bins has become empty.
    pub fn emptied(&mut self, bin: u32) {
        let step = bin - self.first_bin;
        self.occupied[step as usize / 64] &= !(1 << (step % 64));
    }

    /// Whether a bin is one of the set's.
    pub fn owns(&self, bin: u32) -> bool {
        (self.first_bin..self.first_bin + URGENT_BINS).contains(&bin)
    }

    /// The first of the set.
    pub fn first(&mut self, seating: &mut Seating<'_>) -> Option<DiamondId> {
        if self.front.is_empty() {
            let word = self.occupied.iter().rposition(|&word| word != 0)?;
            let step = index(word) * 64 + 63 - self.occupied[word].leading_zeros();
            seating.bins.drain(self.first_bin + step, &mut self.front);
            self.emptied(self.first_bin + step);
            self.front_bin = step;
            for at in 0..self.front.len() {
                let record = &mut seating.diamonds[self.front[at]];
                (record.seat, record.place) = (Seat::Front, index(at));
            }
            for at in (0..self.front.len() / 2).rev() {
                self.sink(seating, at);
            }
        }
        self.front.first().copied()
    }

    /// Empties the set into `out`; the diamonds are nowhere then.
    pub fn drain(&mut self, seating: &mut Seating<'_>, out: &mut Vec<DiamondId>) {
        for &id in &self.front {
            seating.diamonds[id].seat = Seat::None;
        }
        out.append(&mut self.front);
        self.front_bin = URGENT_BINS;
        for word in 0..64_u32 {
            while self.occupied[word as usize] != 0 {
                let step = word * 64 + self.occupied[word as usize].trailing_zeros();
                seating.bins.drain(self.first_bin + step, out);
                self.emptied(self.first_bin + step);
            }
        }
    }

    fn before(&self, seating: &Seating<'_>, a: usize, b: usize) -> bool {
        seating.order(self.front[a], self.front[b]) == self.wins
    }

    fn rise(&mut self, seating: &mut Seating<'_>, mut at: usize) {
        while at > 0 && self.before(seating, at, (at - 1) / 2) {
            self.swap(seating, at, (at - 1) / 2);
            at = (at - 1) / 2;
        }
        seating.diamonds[self.front[at]].place = index(at);
    }

    fn sink(&mut self, seating: &mut Seating<'_>, mut at: usize) {
        loop {
            let mut first = at;
            for kid in [2 * at + 1, 2 * at + 2] {
                if kid < self.front.len() && self.before(seating, kid, first) {
                    first = kid;
                }
            }
            if first == at {
                return;
            }
            self.swap(seating, at, first);
            at = first;
        }
    }

    fn swap(&mut self, seating: &mut Seating<'_>, a: usize, b: usize) {
        self.front.swap(a, b);
        seating.diamonds[self.front[a]].place = index(a);
        seating.diamonds[self.front[b]].place = index(b);
    }

    /// Adds the set's content to a list, in no order.
    pub fn list(&self, bins: &Bins, out: &mut Vec<DiamondId>) {
        out.extend_from_slice(&self.front);
        for (word, mut bits) in self.occupied.iter().copied().enumerate() {
            while bits != 0 {
                bins.list(self.first_bin + index(word) * 64 + bits.trailing_zeros(), out);
                bits &= bits - 1;
            }
        }
    }
}

fn index(at: usize) -> u32 {
    u32::try_from(at).expect("diamonds are counted in u32")
}

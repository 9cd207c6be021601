//! The diamonds whose exact priority matters in this frame, the first of them at hand.
//!
//! In:    diamonds on the wrong side of their threshold, with exact priorities.
//! Out:   the first of them: the greatest leaf, the least parent.
//! Keeps: an occupancy bit a bin, a heap of the foremost bin.
//! Not here: those whose side is certain (`wheel`).
//!
//! Bins divide priorities around a threshold, where most of them are: 1/4096 octave within 1/4
//! octave of it, 1/64 octave beyond. An f64's bits grow almost like its logarithm, so finding a bin
//! needs none. Only the foremost bin is sorted, as a heap; ties go by level and key.

use super::bins::Bins;
use super::diamonds::{Diamond, DiamondId, Diamonds, Seat};
use crate::columns::{Column, Id};
use core::cmp::Ordering;
use std::collections::BinaryHeap;

/// Bins of one such set.
pub const URGENT_BINS: u32 = 8192;
const WORDS: usize = URGENT_BINS as usize / 64;

/// Bits of an f64 that make 1/4096 octave, 1/64 octave and 1/4 octave.
const FINE: u32 = 52 - 12;
const COARSE: u32 = 52 - 6;
const QUARTER: i64 = 1 << 50;

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

/// The bin of a priority, from 0 to [`URGENT_BINS`]: monotone; half of the bins are on each side
/// of the threshold.
#[inline]
fn bucket_of(priority_px: f64, threshold_px: f64) -> u32 {
    let over = priority_px.to_bits().cast_signed() - threshold_px.to_bits().cast_signed();
    let step = if over >= QUARTER {
        1024 + ((over - QUARTER) >> COARSE).min(3071)
    } else if over >= -QUARTER {
        over >> FINE
    } else {
        -1024 + ((over + QUARTER) >> COARSE).max(-3072)
    };
    u32::try_from(step + 4096).expect("clamped to the bins")
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
}

/// An entry of the heap: whose place is taken by the greatest. Derived from [`Rank`], so that
/// comparing needs no look at the diamond.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    priority: u64,
    level: u8,
    key: u64,
    /// The diamond's `place` while this entry is its seat; another's is stale.
    stamp: u32,
    index: u32,
}

impl Entry {
    fn new(rank: Rank, wins: Ordering, (stamp, id): (u32, DiamondId)) -> Self {
        // Priorities are not negative, so their bits are in their order.
        let (priority, index) = (rank.priority_px.to_bits(), id.index());
        if wins == Ordering::Greater {
            Self { priority, level: !rank.level, key: !rank.key, stamp, index }
        } else {
            Self { priority: !priority, level: rank.level, key: rank.key, stamp, index }
        }
    }

    /// The diamond, if this is still its seat.
    fn seated(&self, diamonds: &Diamonds) -> Option<DiamondId> {
        let id = Id::new(self.index);
        let record = &diamonds[id];
        (record.seat == Seat::Front && record.place == self.stamp).then_some(id)
    }
}

/// One set of urgent diamonds.
pub struct Urgent {
    /// Its bins are this one and the [`URGENT_BINS`] from it.
    first_bin: u32,
    /// What the first of the set is: the greatest of leaves, the least of parents.
    wins: Ordering,
    occupied: [u64; WORDS],
    /// Heap of all that are in `front_bin` or beyond it, and of stale entries.
    front: BinaryHeap<Entry>,
    front_bin: u32,
    /// The foremost bin on its way into the heap.
    drained: Vec<DiamondId>,
    stamp: u32,
    /// Where the bins are finest; changes only while the set is empty.
    threshold_px: f64,
}

impl Urgent {
    /// An empty set over the bins from `first_bin`, whose first is the one that `wins`.
    pub fn new(first_bin: u32, wins: Ordering, capacity: u32) -> Self {
        Self {
            first_bin,
            wins,
            occupied: [0; WORDS],
            front: BinaryHeap::with_capacity(capacity as usize),
            front_bin: URGENT_BINS,
            drained: Vec::with_capacity(capacity as usize),
            // Even for leaves and odd for parents: an entry of the one is never a seat in the other.
            stamp: u32::from(wins == Ordering::Less),
            threshold_px: 1.0,
        }
    }

    /// Bins from the least urgent to the most.
    fn step_of(&self, priority_px: f64) -> u32 {
        let bucket = bucket_of(priority_px, self.threshold_px);
        if self.wins == Ordering::Greater { bucket } else { URGENT_BINS - 1 - bucket }
    }

    /// Seats a diamond that is nowhere.
    pub fn push(&mut self, seating: &mut Seating<'_>, id: DiamondId) {
        let step = self.step_of(seating.priority_px[id]);
        if step >= self.front_bin {
            self.push_front(seating, id);
        } else {
            seating.bins.push(seating.diamonds, self.first_bin + step, id);
            self.occupied[step as usize / 64] |= 1 << (step % 64);
        }
    }

    fn push_front(&mut self, seating: &mut Seating<'_>, id: DiamondId) {
        self.stamp = self.stamp.wrapping_add(2);
        let record = &mut seating.diamonds[id];
        (record.seat, record.place) = (Seat::Front, self.stamp);
        self.front.push(Entry::new(seating.rank(id), self.wins, (self.stamp, id)));
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
        loop {
            let is_stale = |entry: &Entry| entry.seated(seating.diamonds).is_none();
            while self.front.peek().is_some_and(is_stale) {
                self.front.pop();
            }
            if let Some(entry) = self.front.peek() {
                return Some(Id::new(entry.index));
            }
            let word = self.occupied.iter().rposition(|&word| word != 0)?;
            let step = index(word) * 64 + 63 - self.occupied[word].leading_zeros();
            let mut drained = core::mem::take(&mut self.drained);
            seating.bins.drain(self.first_bin + step, &mut drained);
            self.emptied(self.first_bin + step);
            self.front_bin = step;
            drained.drain(..).for_each(|id| self.push_front(seating, id));
            self.drained = drained;
        }
    }

    /// Empties the set into `out`; the diamonds are nowhere then. From here on bins are finest
    /// around `threshold_px`.
    pub fn drain(
        &mut self,
        seating: &mut Seating<'_>,
        threshold_px: f64,
        out: &mut Vec<DiamondId>,
    ) {
        self.threshold_px = threshold_px;
        for entry in self.front.drain() {
            let Some(id) = entry.seated(seating.diamonds) else { continue };
            seating.diamonds[id].seat = Seat::None;
            out.push(id);
        }
        self.front_bin = URGENT_BINS;
        for word in 0..index(WORDS) {
            while self.occupied[word as usize] != 0 {
                let step = word * 64 + self.occupied[word as usize].trailing_zeros();
                seating.bins.drain(self.first_bin + step, out);
                self.emptied(self.first_bin + step);
            }
        }
    }

    /// Adds the content of the foremost bins to a list, the most urgent bin first, until it is as
    /// long as `most` or more.
    pub fn list_first(
        &self,
        (diamonds, bins): (&Diamonds, &Bins),
        most: usize,
        out: &mut Vec<DiamondId>,
    ) {
        out.extend(self.front.iter().filter_map(|entry| entry.seated(diamonds)));
        for (word, mut bits) in self.occupied.iter().copied().enumerate().rev() {
            while bits != 0 && out.len() < most {
                let bit = 63 - bits.leading_zeros();
                bins.list(self.first_bin + index(word) * 64 + bit, out);
                bits &= !(1 << bit);
            }
        }
    }

    /// Adds the set's content to a list, in no order.
    pub fn list(&self, (diamonds, bins): (&Diamonds, &Bins), out: &mut Vec<DiamondId>) {
        out.extend(self.front.iter().filter_map(|entry| entry.seated(diamonds)));
        for (word, mut bits) in self.occupied.iter().copied().enumerate() {
            while bits != 0 {
                bins.list(self.first_bin + index(word) * 64 + bits.trailing_zeros(), out);
                bits &= bits - 1;
            }
        }
    }
}

#[inline]
fn index(at: usize) -> u32 {
    u32::try_from(at).expect("diamonds are counted in u32")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_are_monotone_and_finest_at_the_threshold() {
        for threshold_px in [0.01, 1.0, 37.0, 1e6] {
            let mut last = bucket_of(0.0, threshold_px);
            assert_eq!(last, 0);
            let mut priority_px = 1e-7;
            while priority_px < 1e11 {
                let bucket = bucket_of(priority_px, threshold_px);
                assert!(bucket >= last && bucket < URGENT_BINS);
                last = bucket;
                priority_px *= 1.000_3;
            }
            assert_eq!(bucket_of(threshold_px, threshold_px), 4096);
            assert_eq!(bucket_of(f64::INFINITY, threshold_px), bucket_of(f64::MAX, threshold_px));
            assert!(bucket_of(threshold_px * 1.001, threshold_px) > 4096);
            assert!(bucket_of(threshold_px * 0.999, threshold_px) < 4096);
        }
    }

    /// Takes all of a set, seated in some rotation, and compares with a plain sort.
    fn sorts(wins: Ordering, given: [f64; 4], rotation: usize) {
        let mut diamonds = Diamonds::new(4);
        let base = diamonds.create_base();
        let mut priority_px = Column::new(4, || 0.0);
        base.iter().zip(given).for_each(|(&id, px)| priority_px[id] = px);
        let bins = &mut Bins::new(URGENT_BINS, 4);
        let seating = &mut Seating { diamonds: &mut diamonds, bins, priority_px: &priority_px };
        let mut expected = base;
        expected.sort_by(|&a, &b| seating.rank(a).order(&seating.rank(b)));
        if wins == Ordering::Greater {
            expected.reverse();
        }
        let mut set = Urgent::new(0, wins, 4);
        (0..4).for_each(|i| set.push(seating, base[(i + rotation) % 4]));
        for id in expected {
            assert_eq!(set.first(seating), Some(id), "{given:?}");
            seating.diamonds[id].seat = Seat::None;
        }
        assert_eq!(set.first(seating), None);
    }

    #[test]
    fn the_first_is_found_in_any_order_of_insertion_and_removal() {
        for given in [[3.0, 1.0, 1.0, 0.0], [1.0, 1.0001, 1.0002, 9.0], [0.0; 4]] {
            for rotation in 0..4 {
                sorts(Ordering::Greater, given, rotation);
                sorts(Ordering::Less, given, rotation);
            }
        }
    }

    #[test]
    fn a_seat_given_up_in_one_set_is_no_seat_in_it_when_the_other_gives_one() {
        let mut diamonds = Diamonds::new(4);
        let [id, ..] = diamonds.create_base();
        let priority_px = Column::new(4, || 1.0);
        let bins = &mut Bins::new(2 * URGENT_BINS, 4);
        let seating = &mut Seating { diamonds: &mut diamonds, bins, priority_px: &priority_px };
        let mut leaves = Urgent::new(0, Ordering::Greater, 4);
        let mut parents = Urgent::new(URGENT_BINS, Ordering::Less, 4);
        leaves.push(seating, id);
        assert_eq!(leaves.first(seating), Some(id));
        seating.diamonds[id].seat = Seat::None;
        parents.push(seating, id);
        assert_eq!(parents.first(seating), Some(id));
        assert_eq!(leaves.first(seating), None);
    }
}

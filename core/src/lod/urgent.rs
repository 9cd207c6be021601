//! The diamonds whose exact priority matters in this frame, the first of them at hand.
//!
//! In:    diamonds on the wrong side of their threshold, with exact priorities.
//! Out:   the first of them: the greatest leaf, the least parent.
//! Keeps: an occupancy bit a bin, a heap of the foremost bin.
//! Not here: those whose side is certain (`wheel`).
//!
//! Bins divide priorities around a threshold, where most of them are: 1/4096 octave within 1/4
//! octave of it, 1/16 octave beyond. An f64's bits grow almost like its logarithm, so finding a bin
//! needs none. Only the foremost bin is sorted, as a heap; ties go by level and key.

use super::bins::Bins;
use super::diamonds::{Diamond, DiamondId, Diamonds, Seat};
use crate::columns::Column;
use core::cmp::Ordering;

/// Bins of one such set.
pub const URGENT_BINS: u32 = 64 * 64;

/// Bits of an f64 that make 1/4096 octave, 1/16 octave and 1/4 octave.
const FINE: u32 = 52 - 12;
const COARSE: u32 = 52 - 4;
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
        1024 + ((over - QUARTER) >> COARSE).min(1023)
    } else if over >= -QUARTER {
        over >> FINE
    } else {
        -1024 + ((over + QUARTER) >> COARSE).max(-1024)
    };
    u32::try_from(step + 2048).expect("clamped to the bins")
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
    /// Where the bins are finest; changes only while the set is empty.
    threshold_px: f64,
}

impl Urgent {
    /// An empty set over the bins from `first_bin`, whose first is the one that `wins`.
    pub fn new(first_bin: u32, wins: Ordering, capacity: u32) -> Self {
        Self {
            first_bin,
            wins,
            occupied: [0; 64],
            front: Vec::with_capacity(capacity as usize),
            front_bin: URGENT_BINS,
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

    /// Empties the set into `out`; the diamonds are nowhere then. From here on bins are finest
    /// around `threshold_px`.
    pub fn drain(
        &mut self,
        seating: &mut Seating<'_>,
        threshold_px: f64,
        out: &mut Vec<DiamondId>,
    ) {
        self.threshold_px = threshold_px;
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
            let first = self.first_of(seating, at);
            if first == at {
                return;
            }
            self.swap(seating, at, first);
            at = first;
        }
    }

    /// The first of a place of the heap and both below it.
    fn first_of(&self, seating: &Seating<'_>, at: usize) -> usize {
        let (left, right) = (2 * at + 1, 2 * at + 2);
        let better = |kid, than| kid < self.front.len() && self.before(seating, kid, than);
        let first = if better(left, at) { left } else { at };
        if better(right, first) { right } else { first }
    }

    fn swap(&mut self, seating: &mut Seating<'_>, a: usize, b: usize) {
        self.front.swap(a, b);
        seating.diamonds[self.front[a]].place = index(a);
        seating.diamonds[self.front[b]].place = index(b);
    }

    /// Adds the content of the foremost bins to a list, the most urgent bin first, until it is as
    /// long as `most` or more.
    pub fn list_first(&self, bins: &Bins, most: usize, out: &mut Vec<DiamondId>) {
        out.extend_from_slice(&self.front);
        for (word, mut bits) in self.occupied.iter().copied().enumerate().rev() {
            while bits != 0 && out.len() < most {
                let bit = 63 - bits.leading_zeros();
                bins.list(self.first_bin + index(word) * 64 + bit, out);
                bits &= !(1 << bit);
            }
        }
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
            assert_eq!(bucket_of(threshold_px, threshold_px), 2048);
            assert_eq!(bucket_of(f64::INFINITY, threshold_px), bucket_of(f64::MAX, threshold_px));
            assert!(bucket_of(threshold_px * 1.001, threshold_px) > 2048);
            assert!(bucket_of(threshold_px * 0.999, threshold_px) < 2048);
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
        expected.sort_by(|&a, &b| seating.order(a, b));
        if wins == Ordering::Greater {
            expected.reverse();
        }
        let mut set = Urgent::new(0, wins, 4);
        (0..4).for_each(|i| set.push(seating, base[(i + rotation) % 4]));
        for id in expected {
            assert_eq!(set.first(seating), Some(id), "{given:?}");
            set.remove_from_front(seating, id);
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
}

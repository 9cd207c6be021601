//! The queues of diamonds, split and merge before all: bucketed by quantised priority, linked through columns.
//!
//! In:    diamonds with an exact priority and a key.
//! Out:   the first to split, the first to merge; O(1) insert, remove and re-bucket.
//! Keeps: bucket heads, an occupancy bit a bucket, links.
//! Not here: priorities (`screen_error`), what a split does (`operate`).
//!
//! A bucket is 1/64 octave of priority: the exponent and six mantissa bits of the f64, so finding
//! it needs no logarithm. Within a bucket the exact priority decides, ties go by level and key.

use super::diamonds::{Diamond, DiamondId};
use crate::columns::Column;
use core::cmp::Ordering;

/// Buckets of a queue; the first holds priority 0.
pub const BUCKETS: usize = 64 * 64;

/// Bit pattern of 2⁻²⁰ px, shifted: everything smaller but 0 shares bucket 1.
const BASE: u64 = (1023 - 20) << 6;

/// In which queue a diamond is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Queue {
    /// In none: interior or free.
    None,
    /// Unsplit, may be split.
    Split,
    /// Split without split kids, may be merged.
    Merge,
    /// Unsplit, waits for a page until the next frame.
    Blocked,
    /// Unsplit at the deepest level: here only so that its error is known.
    Deepest,
}

/// A diamond's standing in its queue.
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

/// Links of one diamond in its bucket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Link {
    /// Which queue.
    pub queue: Queue,
    bucket: u16,
    next: Option<DiamondId>,
    previous: Option<DiamondId>,
}

impl Link {
    /// In no queue.
    pub const FREE: Self = Self { queue: Queue::None, bucket: 0, next: None, previous: None };
}

/// The bucket of a priority: monotone, exact to 1/64 octave.
pub fn bucket_of(priority_px: f64) -> u16 {
    if priority_px <= 0.0 {
        return 0;
    }
    let step = (priority_px.to_bits() >> 46).saturating_sub(BASE).clamp(1, BUCKETS as u64 - 1);
    u16::try_from(step).expect("clamped to the buckets")
}

struct Buckets {
    heads: Vec<Option<DiamondId>>,
    occupied: [u64; BUCKETS / 64],
    len: u32,
}

impl Buckets {
    fn new() -> Self {
        Self { heads: vec![None; BUCKETS], occupied: [0; BUCKETS / 64], len: 0 }
    }

    fn highest_at_or_below(&self, bucket: usize) -> Option<usize> {
        let mut word = bucket / 64;
        let mut bits = self.occupied[word] & (u64::MAX >> (63 - bucket % 64));
        while bits == 0 {
            word = word.checked_sub(1)?;
            bits = self.occupied[word];
        }
        Some(word * 64 + 63 - bits.leading_zeros() as usize)
    }

    fn lowest_at_or_above(&self, bucket: usize) -> Option<usize> {
        let mut word = bucket / 64;
        let mut bits = self.occupied[word] & (u64::MAX << (bucket % 64));
        while bits == 0 {
            word += 1;
            bits = *self.occupied.get(word)?;
        }
        Some(word * 64 + bits.trailing_zeros() as usize)
    }
}

/// The four queues and the links of every diamond.
pub struct Queues {
    /// Links by diamond.
    pub link: Column<Diamond, Link>,
    split: Buckets,
    merge: Buckets,
    blocked: Buckets,
    deepest: Buckets,
}

impl Queues {
    /// Empty queues for a pool of diamonds.
    pub fn new(capacity: u32) -> Self {
        Self {
            link: Column::new(capacity, || Link::FREE),
            split: Buckets::new(),
            merge: Buckets::new(),
            blocked: Buckets::new(),
            deepest: Buckets::new(),
        }
    }

    fn buckets(&mut self, queue: Queue) -> &mut Buckets {
        match queue {
            Queue::Split => &mut self.split,
            Queue::Merge => &mut self.merge,
            Queue::Blocked => &mut self.blocked,
            Queue::Deepest => &mut self.deepest,
            Queue::None => unreachable!("no buckets for diamonds in no queue"),
        }
    }

    /// Diamonds in the split, merge, blocked and deepest queue.
    pub fn lengths(&self) -> [u32; 4] {
        [self.split.len, self.merge.len, self.blocked.len, self.deepest.len]
    }

    /// Puts a diamond that is in no queue into one.
    pub fn insert(&mut self, id: DiamondId, queue: Queue, priority_px: f64) {
        debug_assert_eq!(self.link[id].queue, Queue::None);
        let bucket = bucket_of(priority_px);
        let buckets = self.buckets(queue);
        let next = buckets.heads[usize::from(bucket)].replace(id);
        buckets.occupied[usize::from(bucket / 64)] |= 1 << (bucket % 64);
        buckets.len += 1;
        self.link[id] = Link { queue, bucket, next, previous: None };
        if let Some(next) = next {
            self.link[next].previous = Some(id);
        }
    }

    /// Takes a diamond out of its queue, if it is in one.
    pub fn remove(&mut self, id: DiamondId) {
        let Link { queue, bucket, next, previous } = self.link[id];
        if queue == Queue::None {
            return;
        }
        self.link[id] = Link::FREE;
        if let Some(next) = next {
            self.link[next].previous = previous;
        }
        if let Some(previous) = previous {
            self.link[previous].next = next;
        }
        let buckets = self.buckets(queue);
        buckets.len -= 1;
        if previous.is_none() {
            buckets.heads[usize::from(bucket)] = next;
            if next.is_none() {
                buckets.occupied[usize::from(bucket / 64)] &= !(1 << (bucket % 64));
            }
        }
    }

    /// Moves a diamond whose priority changed to its bucket; stays where it is if that is its own.
    pub fn rebucket(&mut self, id: DiamondId, priority_px: f64) {
        let Link { queue, bucket, .. } = self.link[id];
        if queue != Queue::None && bucket != bucket_of(priority_px) {
            self.remove(id);
            self.insert(id, queue, priority_px);
        }
    }

    /// Any diamond of the blocked queue.
    pub fn first_blocked(&self) -> Option<DiamondId> {
        self.blocked.heads[self.blocked.highest_at_or_below(BUCKETS - 1)?]
    }

    /// The greatest of the split queue.
    pub fn first_to_split(&self, rank: impl Fn(DiamondId) -> Rank) -> Option<DiamondId> {
        self.greatest(&self.split, &rank)
    }

    /// The greatest priority of all unsplit diamonds, whichever queue they are in.
    pub fn worst_px(&self, rank: impl Fn(DiamondId) -> Rank) -> f64 {
        let of = |buckets| self.greatest(buckets, &rank).map_or(0.0, |id| rank(id).priority_px);
        [&self.split, &self.blocked, &self.deepest].map(of).into_iter().fold(0.0, f64::max)
    }

    fn greatest(&self, buckets: &Buckets, rank: &impl Fn(DiamondId) -> Rank) -> Option<DiamondId> {
        let bucket = buckets.highest_at_or_below(BUCKETS - 1)?;
        self.best(buckets.heads[bucket], rank, Ordering::Greater, &|_| true)
    }

    /// The least of the merge queue among those that `may` be merged.
    pub fn first_to_merge(
        &self,
        rank: impl Fn(DiamondId) -> Rank,
        may: impl Fn(DiamondId) -> bool,
    ) -> Option<DiamondId> {
        let mut from = 0;
        while from < BUCKETS {
            let bucket = self.merge.lowest_at_or_above(from)?;
            let found = self.best(self.merge.heads[bucket], &rank, Ordering::Less, &may);
            if found.is_some() {
                return found;
            }
            from = bucket + 1;
        }
        None
    }

    fn best(
        &self,
        head: Option<DiamondId>,
        rank: &impl Fn(DiamondId) -> Rank,
        wins: Ordering,
        may: &impl Fn(DiamondId) -> bool,
    ) -> Option<DiamondId> {
        let (mut at, mut best) = (head, None::<(DiamondId, Rank)>);
        while let Some(id) = at {
            at = self.link[id].next;
            let standing = rank(id);
            let better = best.is_none_or(|(_, other)| standing.order(&other) == wins);
            if better && may(id) {
                best = Some((id, standing));
            }
        }
        best.map(|(id, _)| id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Id;

    #[test]
    fn buckets_are_monotone_and_fine() {
        let mut last = 0;
        let mut priority_px = 1e-7;
        while priority_px < 1e11 {
            let bucket = bucket_of(priority_px);
            assert!(bucket >= last);
            last = bucket;
            priority_px *= 1.003;
        }
        assert_eq!(bucket_of(0.0), 0);
        assert!(bucket_of(1.02) > bucket_of(1.0));
        assert!(usize::from(bucket_of(f64::INFINITY)) == BUCKETS - 1);
    }

    #[test]
    fn the_first_is_found_in_any_order_of_insertion_and_removal() {
        let mut queues = Queues::new(200);
        let priority = |i: u32| f64::from((i * 7919) % 97) * 0.37;
        let rank = |id: DiamondId| Rank {
            priority_px: priority(id.index()),
            level: 3,
            key: u64::from(id.index()),
        };
        (0..200).for_each(|i| queues.insert(Id::new(i), Queue::Merge, priority(i)));
        let mut expected: Vec<u32> = (0..200).collect();
        expected.sort_by(|&a, &b| rank(Id::new(a)).order(&rank(Id::new(b))));
        for index in expected {
            let found = queues.first_to_merge(rank, |_| true).unwrap();
            assert_eq!(found.index(), index);
            queues.remove(found);
        }
        assert_eq!(queues.lengths(), [0; 4]);
        assert_eq!(queues.first_to_merge(rank, |_| true), None);
    }
}

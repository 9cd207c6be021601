//! A count of items handed out to whoever takes part, over when the last one leaves.
//!
//! In:    a number of items and how to cut it; workers that enter, claim and leave.
//! Out:   each item's number once; to exactly one worker the news that all are done.
//! Keeps: one word, which ends as it must be for the next [`Tickets::open`].
//! Not here: what an item is (`walk`), who is told to come (`crew`).

use crate::sync::{Shim, Word};
use crossbeam::utils::CachePadded;
use std::ops::Range;
use std::sync::atomic::Ordering;

/// Most items of one opening: 28 bits.
pub(crate) const ITEMS_MAX: usize = (1 << COUNT_BIT) - 1;

const COUNT_BIT: u32 = 28;
const INSIDE_BIT: u32 = 56;
const FIELD: u64 = (1 << COUNT_BIT) - 1;

/// How many of the remaining items one claim takes.
#[derive(Clone, Copy)]
pub(crate) struct Share {
    /// A claim takes one of that many parts of the rest: few claims at the start, when they would
    /// be contended, and short ones at the end, when somebody waits for them.
    pub(crate) parts: u64,
    /// At most that many.
    pub(crate) most: u64,
}

impl Share {
    fn of(self, rest: u64) -> u64 {
        (rest / self.parts).clamp(1, self.most)
    }
}

/// Items claimed at once.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Batch {
    pub(crate) items: Range<usize>,
    /// Nothing is left to claim: entering is over.
    pub(crate) last: bool,
    /// The word after this claim: a guess for the next.
    word: u64,
}

impl Batch {
    /// How many items were unclaimed after this claim.
    pub(crate) fn left(&self) -> usize {
        count_in(self.word) - self.items.end
    }
}

/// How many items there are.
fn count_in(word: u64) -> usize {
    usize::try_from(word >> COUNT_BIT & FIELD).expect("28 bits fit")
}

/// The word: how many are inside (8 bits), how many items there are (28), the next one (28).
///
/// All in one word, so that entering includes the first claim, nobody can be inside without having
/// had an item, and a worker that comes late finds nothing to claim instead of a count to mend.
pub(crate) struct Tickets<S: Shim> {
    word: CachePadded<S::Word>,
}

impl<S: Shim> Tickets<S> {
    pub(crate) fn new() -> Self {
        Tickets { word: CachePadded::new(S::Word::new(0)) }
    }

    /// Starts handing out `count` items, 1 to [`ITEMS_MAX`]; the caller is inside with the first.
    pub(crate) fn open(&self, count: usize, share: Share) -> Batch {
        debug_assert!((1..=ITEMS_MAX).contains(&count));
        let count = count as u64;
        let end = share.of(count);
        let word = 1 << INSIDE_BIT | count << COUNT_BIT | end;
        // Release: who enters sees what the opener wrote before.
        self.word.store(word, Ordering::Release);
        batch(word, end)
    }

    /// Starts handing out `count` items to others; the caller is not inside. Then nobody can say
    /// who leaves last.
    pub(crate) fn offer(&self, count: usize) {
        debug_assert!((1..=ITEMS_MAX).contains(&count));
        self.word.store((count as u64) << COUNT_BIT, Ordering::Release);
    }

    /// Number of items of this opening.
    pub(crate) fn count(&self) -> usize {
        count_in(self.word.load(Ordering::Relaxed))
    }

    /// Takes part, with a first claim; `None` if nothing is left.
    pub(crate) fn enter(&self, share: Share) -> Option<Batch> {
        self.take(self.word.load(Ordering::Relaxed), share, 1 << INSIDE_BIT)
    }

    /// Claims more items for a worker inside that has claimed `own`; `None` if nothing is left.
    pub(crate) fn claim(&self, own: &Batch, share: Share) -> Option<Batch> {
        // An exchange with a guess, and not a load before it: where the others write all the time
        // the cache line would move twice.
        self.take(own.word, share, 0)
    }

    fn take(&self, mut word: u64, share: Share, entering: u64) -> Option<Batch> {
        loop {
            let (next, count) = (word & FIELD, word >> COUNT_BIT & FIELD);
            if next == count {
                return None;
            }
            let step = share.of(count - next);
            let claimed = word + entering + step;
            match self.word.replace(word, claimed) {
                Ok(_) => return Some(batch(claimed, step)),
                Err(now) => word = now,
            }
        }
    }

    /// Withdraws the items nobody claimed.
    pub(crate) fn stop(&self) {
        let mut word = self.word.load(Ordering::Relaxed);
        loop {
            let (next, count) = (word & FIELD, word >> COUNT_BIT & FIELD);
            if next == count {
                return;
            }
            match self.word.replace(word, word + count - next) {
                Ok(_) => return,
                Err(now) => word = now,
            }
        }
    }

    /// Ends the part of a worker to whom [`Tickets::claim`] said `None`, or who stopped; `true` to
    /// the last one, who sees all that the others did.
    pub(crate) fn leave(&self) -> bool {
        // Entering ended before anyone left, so the count inside falls to 0 exactly once.
        self.word.fetch_sub(1 << INSIDE_BIT, Ordering::AcqRel) >> INSIDE_BIT == 1
    }
}

/// The last `step` items that were claimed when the word was that.
fn batch(word: u64, step: u64) -> Batch {
    let (end, count) = (word & FIELD, word >> COUNT_BIT & FIELD);
    let number = |value: u64| usize::try_from(value).expect("28 bits fit");
    Batch { items: number(end - step)..number(end), last: end == count, word }
}

//! What may be started: a set of small numbers that any worker adds to and removes from.
//!
//! In:    numbers below a limit known when the graph is compiled.
//! Out:   the lowest numbers first, so stages added first start first.
//! Keeps: one bit per number; no order of arrival, no capacity to exceed, nothing to allocate.
//! Not here: what a number means (`plan`), who looks (`walk`).

use crate::sync::{Shim, Word};
use std::sync::atomic::Ordering;

/// A set of numbers.
///
/// Bits and not a queue: adding and removing are one atomic operation each without a retry, a
/// number cannot be in it twice, and a worker that stops halfway through leaves no hole that
/// others must wait for.
pub(crate) struct Ready<S: Shim> {
    bits: Box<[S::Word]>,
    /// Which words of `bits` were used since the last [`Ready::arm`]. Not taken back when a word
    /// becomes empty: that would race with an addition.
    used: Box<[S::Word]>,
}

impl<S: Shim> Ready<S> {
    /// An empty set of numbers below `limit`.
    pub(crate) fn new(limit: usize) -> Self {
        let words = |count: usize| (0..count).map(|_| S::Word::new(0)).collect();
        let count = limit.div_ceil(64);
        Ready { bits: words(count), used: words(count.div_ceil(64)) }
    }

    /// Forgets which words were used. Only while the set is empty and nobody else looks.
    pub(crate) fn arm(&self) {
        self.used.iter().for_each(|word| word.store(0, Ordering::Relaxed));
    }

    /// Adds a number; what was written before is seen by who removes it.
    pub(crate) fn add(&self, number: usize) {
        let word = number / 64;
        self.bits[word].fetch_or(1 << (number % 64), Ordering::Release);
        let used = 1 << (word % 64);
        if self.used[word / 64].load(Ordering::Relaxed) & used == 0 {
            self.used[word / 64].fetch_or(used, Ordering::Release);
        }
    }

    /// Removes a number; `false` if somebody else did.
    pub(crate) fn remove(&self, number: usize) -> bool {
        let bit = 1 << (number % 64);
        self.bits[number / 64].fetch_and(!bit, Ordering::AcqRel) & bit != 0
    }

    /// Shows the numbers whose bits are in `mask`, the same for each word, to `choose` in rising
    /// order until it returns something.
    pub(crate) fn find<T>(
        &self,
        mask: u64,
        mut choose: impl FnMut(usize) -> Option<T>,
    ) -> Option<T> {
        let mut in_word = |word: usize| {
            let bits = self.bits[word].load(Ordering::Acquire) & mask;
            ones(bits).find_map(|bit| choose(word * 64 + bit))
        };
        self.used.iter().enumerate().find_map(|(group, used)| {
            ones(used.load(Ordering::Acquire)).find_map(|word| in_word(group * 64 + word))
        })
    }
}

/// The positions of the bits that are set, rising.
pub(crate) fn ones(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = bits.trailing_zeros() as usize;
        bits &= bits.checked_sub(1)?;
        Some(at)
    })
}

//! A seeded disturbance of the schedule, to show that results do not depend on it.
//!
//! In:    a seed.
//! Out:   coins and pauses, per worker repeatable.
//! Keeps: one state per worker.
//! Not here: what is disturbed (`walk`: choice, order and size of claims; `scope`: of chunks).

use crossbeam::utils::CachePadded;
use std::hint;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// Random numbers for each worker.
pub(crate) struct Chaos {
    states: Box<[CachePadded<AtomicU64>]>,
}

impl Chaos {
    pub(crate) fn new(seed: u64, lanes: usize) -> Chaos {
        let state = |lane: usize| CachePadded::new(AtomicU64::new(seed ^ (lane as u64 + 1) << 48));
        Chaos { states: (0..lanes).map(state).collect() }
    }

    /// A number below `end`: Steele's SplitMix64.
    fn below(&self, lane: usize, end: u64) -> u64 {
        let state = &self.states[lane];
        let at = state.load(Ordering::Relaxed).wrapping_add(0x9E37_79B9_7F4A_7C15);
        state.store(at, Ordering::Relaxed);
        let mixed = (at ^ at >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ mixed >> 31) % end
    }

    /// Heads or tails.
    pub(crate) fn coin(&self, lane: usize) -> bool {
        self.below(lane, 2) == 0
    }

    /// Nothing, a little, or long enough for everyone else to go by.
    pub(crate) fn pause(&self, lane: usize) {
        match self.below(lane, 64) {
            0 => thread::sleep(Duration::from_micros(self.below(lane, 60))),
            1..8 => thread::yield_now(),
            8..24 => (0..self.below(lane, 400)).for_each(|_| hint::spin_loop()),
            _ => {}
        }
    }
}

//! How a thread waits: a bounded spin, then a bell.
//!
//! In:    a condition that another thread makes true, or a bell that it rings.
//! Out:   the waiting thread goes on; between spin and bell it uses no CPU.
//! Keeps: one ring per bell, so a ring before the wait is not lost.
//! Not here: who waits for what (`scope` for loops, `workers` for work).

use crate::spans::now_ns;
use std::hint;
use std::sync::{Condvar, Mutex, PoisonError};

/// How long a thread spins before it sleeps. Bridges the gap between two stages; sleeping there
/// costs a wake-up of 50 to 90 µs, spinning longer starves a host that shares the cores.
const SPIN_NS: u64 = 30_000;

/// Polls between two looks at the clock.
const POLLS: u32 = 16;

/// Spins until `done`, for at most [`SPIN_NS`]; what `done` said last.
pub(crate) fn spin_until(done: impl Fn() -> bool) -> bool {
    if done() {
        return true;
    }
    let start_ns = now_ns();
    while now_ns() - start_ns < SPIN_NS {
        for _ in 0..POLLS {
            hint::spin_loop();
            if done() {
                return true;
            }
        }
    }
    false
}

/// Wakes one thread. Rings add up to one. A wait may return early, from an old ring: callers wait
/// in a loop over their condition.
///
/// The standard lock and not `parking_lot`, which allocates when a thread first blocks, and not
/// `thread::park`, whose token the host's own code on this thread may be waiting for.
#[derive(Default)]
pub(crate) struct Bell {
    rung: Mutex<bool>,
    changed: Condvar,
}

impl Bell {
    /// Lets the waiting thread, or the next one to wait, go on.
    pub(crate) fn ring(&self) {
        *self.rung.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.changed.notify_one();
    }

    /// Sleeps until the bell is rung, and takes the ring away.
    pub(crate) fn wait(&self) {
        let mut rung = self.rung.lock().unwrap_or_else(PoisonError::into_inner);
        while !*rung {
            rung = self.changed.wait(rung).unwrap_or_else(PoisonError::into_inner);
        }
        *rung = false;
    }
}

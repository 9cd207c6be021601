//! Whether a server is worth asking: one that failed is left alone for a while.
//!
//! In:    outcomes of requests, the time.
//! Out:   leave to ask, or a refusal that costs nothing.
//! Keeps: failures in a row, until when to rest.
//! Not here: retries within one request (`server`).

use crate::fault::ArchiveFault;
use parking_lot::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The state of one server.
pub(crate) struct Breaker {
    failures_max: u32,
    cool_down_ns: u64,
    closed: AtomicBool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    failures_in_a_row: u32,
    rest_until_ns: u64,
    last: String,
}

impl Breaker {
    pub(crate) fn new(failures_max: u32, cool_down: Duration) -> Self {
        Self {
            failures_max: failures_max.max(1),
            cool_down_ns: u64::try_from(cool_down.as_nanos()).unwrap_or(u64::MAX),
            closed: AtomicBool::new(false),
            state: Mutex::default(),
        }
    }

    /// Leave to ask at `now_ns`. After a rest one caller gets it; the others wait for how it
    /// fares.
    pub(crate) fn admit(&self, now_ns: u64) -> Result<(), ArchiveFault> {
        if self.is_closed() {
            return Err(ArchiveFault::Closed);
        }
        let mut state = self.state.lock();
        if state.failures_in_a_row >= self.failures_max {
            if now_ns < state.rest_until_ns {
                return Err(ArchiveFault::Resting(state.last.clone()));
            }
            state.rest_until_ns = now_ns.saturating_add(self.cool_down_ns);
        }
        Ok(())
    }

    pub(crate) fn succeeded(&self) {
        self.state.lock().failures_in_a_row = 0;
    }

    pub(crate) fn failed(&self, now_ns: u64, what: &str) {
        let mut state = self.state.lock();
        state.failures_in_a_row = state.failures_in_a_row.saturating_add(1);
        state.rest_until_ns = now_ns.saturating_add(self.cool_down_ns);
        state.last = what.to_owned();
    }

    pub(crate) fn is_resting(&self, now_ns: u64) -> bool {
        let state = self.state.lock();
        state.failures_in_a_row >= self.failures_max && now_ns < state.rest_until_ns
    }

    /// From now on nobody gets leave.
    pub(crate) fn close(&self) {
        self.closed.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_enough_failures_nobody_asks_until_the_rest_is_over() {
        let breaker = Breaker::new(2, Duration::from_nanos(100));
        breaker.failed(0, "no");
        assert!(breaker.admit(1).is_ok());
        breaker.failed(10, "never");
        assert!(matches!(breaker.admit(109), Err(ArchiveFault::Resting(last)) if last == "never"));
        assert!(breaker.is_resting(109));
        assert!(breaker.admit(110).is_ok());
        assert!(breaker.admit(111).is_err(), "only one tries after a rest");
        breaker.succeeded();
        assert!(breaker.admit(112).is_ok());
        breaker.close();
        assert!(matches!(breaker.admit(113), Err(ArchiveFault::Closed)));
    }
}

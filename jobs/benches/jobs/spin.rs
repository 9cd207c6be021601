//! Work of a known length that touches no memory.
//!
//! In:    a number of steps, each of which waits for the one before.
//! Out:   that much time gone; how many steps last how long on this machine.
//! Keeps: nothing.
//! Not here: how much work each chunk has (`workloads`).

use overfly_jobs::now_ns;
use std::hint::black_box;

/// Steps of the probe that calibrates; some 50 µs.
const PROBE_STEPS: u32 = 40_000;

/// Goes through that many dependent steps of xorshift64.
#[inline]
pub fn spin_work(steps: u32) {
    // The compiler knows neither the seed nor that the result is not used, so every step stays.
    let mut state = black_box(0x9e37_79b9_7f4a_7c15_u64);
    for _ in 0..steps {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
    }
    black_box(state);
}

/// How fast this machine takes steps.
#[derive(Clone, Copy)]
pub struct Pace {
    probe_ns: u64,
}

impl Pace {
    /// Measures the machine: the fastest of 200 probes, which no interruption made slower.
    pub fn calibrate() -> Pace {
        let probe = || {
            let begin_ns = now_ns();
            spin_work(PROBE_STEPS);
            now_ns() - begin_ns
        };
        Pace { probe_ns: (0..200).map(|_| probe()).min().unwrap_or(1).max(1) }
    }

    /// Steps that last so long.
    pub fn steps(self, work_ns: u64) -> u32 {
        u32::try_from(work_ns * u64::from(PROBE_STEPS) / self.probe_ns)
            .expect("a chunk lasts less than a second")
    }
}

//! What the system knows of this process, and where its threads run: a stand-in.
//!
//! In:    a core to stay on, which is ignored.
//! Out:   zeros.
//! Keeps: nothing.
//! Not here: Linux, where this report is made (`system_linux`).

use std::thread::available_parallelism;

/// How many cores this process may use.
pub fn core_count() -> usize {
    available_parallelism().map_or(1, usize::from)
}

/// The `place`-th core, were threads pinned here.
pub fn core(place: usize) -> usize {
    place % core_count()
}

/// Leaves the thread where the system puts it.
pub fn pin_to_core(_place: usize) {}

/// Not known here: 0.
pub fn cpu_ns() -> u64 {
    0
}

/// Not known here: 0.
pub fn voluntary_switches() -> u64 {
    0
}

//! What the system knows of this process, and where its threads run: Linux.
//!
//! In:    a core to stay on.
//! Out:   processor time and voluntary context switches of the process so far.
//! Keeps: which cores the process may use.
//! Not here: wall time (`overfly_jobs::now_ns`), other systems (`system_other`).

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::sys::resource::{UsageWho, getrusage};
use nix::time::{ClockId, clock_gettime};
use nix::unistd::Pid;
use std::sync::OnceLock;

/// The cores that this process may use: those of its first thread before it was pinned.
fn cores() -> &'static [usize] {
    static CORES: OnceLock<Vec<usize>> = OnceLock::new();
    CORES.get_or_init(|| {
        let set = sched_getaffinity(Pid::from_raw(0)).expect("a thread may ask about itself");
        (0..CpuSet::count()).filter(|&core| set.is_set(core).unwrap_or(false)).collect()
    })
}

/// How many cores this process may use.
pub fn core_count() -> usize {
    cores().len()
}

/// The `place`-th of the cores of this process, counted round.
pub fn core(place: usize) -> usize {
    cores()[place % cores().len()]
}

/// Keeps the calling thread on the `place`-th of the cores of this process, counted round. The
/// first call must come from the first thread.
pub fn pin_to_core(place: usize) {
    let mut set = CpuSet::new();
    set.set(core(place)).expect("the core is from such a set");
    sched_setaffinity(Pid::from_raw(0), &set).expect("the core is one that this process may use");
}

/// Processor time of all threads so far, in nanoseconds.
pub fn cpu_ns() -> u64 {
    let time = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).expect("Linux has this clock");
    let seconds = u64::try_from(time.tv_sec()).expect("processor time is not negative");
    let rest_ns = u64::try_from(time.tv_nsec()).expect("processor time is not negative");
    seconds * 1_000_000_000 + rest_ns
}

/// How often a thread of this process gave its core up by itself, so far.
pub fn voluntary_switches() -> u64 {
    let usage = getrusage(UsageWho::RUSAGE_SELF).expect("a process may ask about itself");
    u64::try_from(usage.voluntary_context_switches()).expect("a count is not negative")
}

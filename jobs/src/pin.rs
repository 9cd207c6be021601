//! Threads bound to cores, where the system can.
//!
//! In:    the number of a core.
//! Out:   the calling thread runs nowhere else.
//! Keeps: nothing.
//! Not here: which thread belongs where (the host knows).

use std::collections::BTreeSet;
use std::io;

/// Binds the calling thread to one core. Does nothing where the system is not Linux.
///
/// Some kernels put a woken thread on the core of its waker, which is just then busy.
///
/// # Errors
/// What the system says, for instance if there is no such core.
pub fn pin_this_thread(core: usize) -> io::Result<()> {
    bind(core)
}

/// How many different cores of that list the calling thread may not run on.
pub(crate) fn count_elsewhere(cores: &[usize]) -> usize {
    let distinct: BTreeSet<usize> = cores.iter().copied().collect();
    distinct.into_iter().filter(|&core| is_elsewhere(core)).count()
}

#[cfg(target_os = "linux")]
fn is_elsewhere(core: usize) -> bool {
    use nix::sched::sched_getaffinity;
    use nix::unistd::Pid;
    // What the system does not say is taken for a core we may use.
    sched_getaffinity(Pid::from_raw(0)).is_ok_and(|own| own.is_set(core) == Ok(false))
}

#[cfg(not(target_os = "linux"))]
fn is_elsewhere(_: usize) -> bool {
    false
}

#[cfg(target_os = "linux")]
fn bind(core: usize) -> io::Result<()> {
    use nix::sched::{CpuSet, sched_setaffinity};
    use nix::unistd::Pid;
    let mut cores = CpuSet::new();
    cores.set(core)?;
    // 0 is the calling thread.
    Ok(sched_setaffinity(Pid::from_raw(0), &cores)?)
}

#[cfg(not(target_os = "linux"))]
#[expect(clippy::unnecessary_wraps, reason = "systems that can may refuse")]
fn bind(_: usize) -> io::Result<()> {
    Ok(())
}

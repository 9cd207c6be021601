//! Threads bound to cores, where the system can.
//!
//! In:    the number of a core.
//! Out:   the calling thread runs nowhere else.
//! Keeps: nothing.
//! Not here: which thread belongs where (the host knows).

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

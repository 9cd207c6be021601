//! Functions of the host that overfly calls.
//!
//! In:    pointers to C functions, and the host's own pointer for them.
//! Out:   closures for the façade.
//! Keeps: both, as long as the terrain lives.
//! Not here: which threads call them when (`host` says).

use crate::tasks::Tasks;
use std::ffi::{CString, c_char, c_void};
use std::sync::Arc;

/// As `ovf_host.spawn`. The header has these types spelt out.
pub type Spawn = unsafe extern "C" fn(user: *mut c_void, task: u64) -> u64;
/// As `ovf_host.finish`.
pub type Finish = unsafe extern "C" fn(user: *mut c_void, spawned: u64);
/// As `ovf_host.read`.
pub type Read = unsafe extern "C" fn(
    user: *mut c_void,
    location: *const c_char,
    offset_bytes: u64,
    length_bytes: u64,
    buffer: *mut u8,
) -> i64;

/// The host's own pointer, which only goes back to it.
#[derive(Clone, Copy)]
pub struct User(pub *mut c_void);

// SAFETY: it is never looked into here, and the host vouched that its functions may be called with
// it from any thread.
unsafe impl Send for User {}
// SAFETY: as above.
unsafe impl Sync for User {}

impl User {
    /// A closure that calls this has all of `self`, and so may go to another thread.
    fn pointer(self) -> *mut c_void {
        self.0
    }

    /// A closure that hands tasks to the host.
    pub fn spawner(self, spawn: Spawn, tasks: Arc<Tasks>) -> impl Fn(overfly::jobs::Task) -> u64 {
        move |task| {
            let user = self.pointer();
            // SAFETY: the host vouched for its function when it made the terrain.
            unsafe { spawn(user, tasks.keep(task)) }
        }
    }

    /// A closure that tells the host that tasks are over.
    pub fn finisher(self, finish: Finish) -> impl Fn(u64) {
        move |spawned| {
            let user = self.pointer();
            // SAFETY: as above.
            unsafe { finish(user, spawned) }
        }
    }

    /// A closure that has the host read.
    pub fn reader(self, read: Read) -> impl Fn(&str, u64, &mut [u8]) -> Result<usize, String> {
        move |location, offset, buffer| {
            let user = self.pointer();
            let location = CString::new(location).map_err(|error| error.to_string())?;
            let length = buffer.len() as u64;
            // SAFETY: as above; the buffer has as many bytes as it is told.
            let found =
                unsafe { read(user, location.as_ptr(), offset, length, buffer.as_mut_ptr()) };
            usize::try_from(found).map_err(|_| format!("its read function gave {found}"))
        }
    }
}

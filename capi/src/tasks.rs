//! Parts of frames that wait in the host's scheduler.
//!
//! In:    tasks of the frames.
//! Out:   numbers for the host; the task of a number, once.
//! Keeps: [`Tasks`]: the last tasks, as many as one frame may have.
//! Not here: what a task does (`overfly_jobs`).
//!
//! A new frame's task takes the place of an old one that the host has not run: by then its frame is
//! over, and there is nothing left for it to do. So hosts may run them late, twice or never.

use overfly::jobs::Task;
use parking_lot::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Tasks of one frame are no more than this.
const PLACES: u64 = 64;

/// The tasks of one terrain that were not run yet.
pub struct Tasks {
    places: Vec<Mutex<Option<(u64, Task)>>>,
    next: AtomicU64,
}

impl Tasks {
    /// None yet.
    pub fn new() -> Self {
        let places = (0..PLACES).map(|_| Mutex::new(None)).collect();
        Self { places, next: AtomicU64::new(1) }
    }

    /// Keeps a task; its number comes back.
    pub fn keep(&self, task: Task) -> u64 {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        *self.place(number).lock() = Some((number, task));
        number
    }

    /// The task of a number, if it was not taken yet and no later one has its place.
    pub fn take(&self, number: u64) -> Option<Task> {
        let mut place = self.place(number).lock();
        place.take_if(|(kept, _)| *kept == number).map(|(_, task)| task)
    }

    fn place(&self, number: u64) -> &Mutex<Option<(u64, Task)>> {
        &self.places[usize::try_from(number % PLACES).expect("below 64")]
    }
}

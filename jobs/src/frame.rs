//! A frame: the time in which workers are kept awake.
//!
//! In:    [`Workers::frame`](crate::Workers::frame), or a run without one.
//! Out:   workers that spin instead of sleeping; lent threads and the host's tasks that stay.
//! Keeps: nothing.
//! Not here: what is done in it (`graph`), sleeping and waking (`crew`).

use crate::workers::Workers;
use std::cell::Cell;
use std::marker::PhantomData;

thread_local! {
    /// How many frames and visits this thread is in.
    static ENGAGEMENTS: Cell<u32> = const { Cell::new(0) };
}

/// Whether this thread takes part in a frame: it has one open, works in one, or is a worker of any
/// [`Workers`], even one that sleeps. For who counts what frames do, as an allocator; it allocates
/// nothing and can be asked anywhere.
pub fn takes_part() -> bool {
    Engaged::anywhere()
}

/// While one exists, this thread takes part in something and must not be lent: it would wait for
/// itself.
pub(crate) struct Engaged(PhantomData<*const ()>);

impl Engaged {
    pub(crate) fn new() -> Engaged {
        ENGAGEMENTS.set(ENGAGEMENTS.get() + 1);
        Engaged(PhantomData)
    }

    /// Whether this thread is in a frame or a visit, of any workers.
    pub(crate) fn anywhere() -> bool {
        ENGAGEMENTS.get() > 0
    }
}

impl Drop for Engaged {
    fn drop(&mut self) {
        ENGAGEMENTS.set(ENGAGEMENTS.get() - 1);
    }
}

/// An open frame; dropping it ends it. Made by [`Workers::frame`].
///
/// While it is open, workers without work spin, each time for at most
/// [`WorkerOptions::spin_us`](crate::WorkerOptions), before they sleep; when it closes they sleep
/// at once. Frames may overlap; the last to close counts.
#[must_use = "dropping the frame ends it"]
pub struct Frame<'w> {
    workers: &'w Workers,
    /// Also keeps the frame on its thread.
    _engaged: Engaged,
}

impl<'w> Frame<'w> {
    /// Opens a frame and wakes everyone.
    pub(crate) fn wake_all(workers: &'w Workers) -> Frame<'w> {
        Frame::open(workers, true)
    }

    /// Opens the frame of one run, which wakes as many as it has work for.
    pub(crate) fn of_run(workers: &'w Workers) -> Frame<'w> {
        Frame::open(workers, false)
    }

    fn open(workers: &'w Workers, wake: bool) -> Frame<'w> {
        let frame = Frame { workers, _engaged: Engaged::new() };
        // If the host's callback panics, the frame is there to be closed.
        workers.open_frame(wake);
        frame
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        self.workers.close_frame();
    }
}

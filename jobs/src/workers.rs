//! Worker threads: started once, asleep between runs, woken by what is posted.
//!
//! In:    a thread count; runs and parallel-fors posted by [`crate::Graph`] and [`crate::Team`].
//! Out:   threads that join what is posted until there is nothing more.
//! Keeps: one lane (slot, sleep flag, bell) per thread, lane 0 for whoever calls `run`.
//! Not here: the order of stages (`run`), the lifetime of what is joined (`scope`).

use crate::scope::{Claim, Slot};
use crate::wait::{Bell, spin_until};
use crossbeam::utils::CachePadded;
use std::error::Error;
use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};

/// Most threads of one [`Workers`].
const WORKERS_MAX: usize = 64;

/// Why the workers could not be started.
#[derive(Debug)]
pub enum StartError {
    /// More than 64 were asked for.
    TooMany {
        /// The number asked for.
        asked: usize,
    },
    /// The system refused a thread. Those already started have ended.
    Spawn(io::Error),
}

impl fmt::Display for StartError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StartError::TooMany { asked } => {
                write!(out, "{asked} workers were asked for, at most {WORKERS_MAX} are possible")
            }
            StartError::Spawn(_) => write!(out, "a worker thread could not be started"),
        }
    }
}

impl Error for StartError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            StartError::TooMany { .. } => None,
            StartError::Spawn(cause) => Some(cause),
        }
    }
}

/// Threads that help whoever calls [`crate::Graph::run`]. They sleep between runs; dropping ends
/// and joins them.
///
/// They serve one run at a time. A run that finds them busy with another, of a second host thread
/// or from inside a stage, is done by its caller alone.
pub struct Workers {
    crew: Arc<Crew>,
    threads: Vec<JoinHandle<()>>,
}

impl Workers {
    /// Starts `workers` threads, 0 to 64, beside the caller. With 0 everything runs on the caller.
    ///
    /// # Errors
    /// [`StartError`] if the number is too large or the system refuses a thread.
    pub fn new(workers: usize) -> Result<Workers, StartError> {
        if workers > WORKERS_MAX {
            return Err(StartError::TooMany { asked: workers });
        }
        let crew = Arc::new(Crew::new(workers));
        let mut started = Workers { crew, threads: Vec::with_capacity(workers) };
        for lane in 1..=workers {
            let crew = Arc::clone(&started.crew);
            let thread = Builder::new()
                .name(format!("overfly-{lane}"))
                .spawn(move || crew.serve(lane))
                .map_err(StartError::Spawn)?;
            started.threads.push(thread);
        }
        Ok(started)
    }

    /// Number of threads beside the caller.
    pub fn count(&self) -> usize {
        self.crew.count()
    }

    /// What the threads and the caller share.
    pub(crate) fn crew(&self) -> &Crew {
        &self.crew
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.crew.stop.store(true, Ordering::Release);
        self.crew.announce(self.threads.len());
        for thread in self.threads.drain(..) {
            // Workers catch every panic of a stage; one that got here is reported already, and a
            // second panic inside a drop would only hide it.
            let _ = thread.join();
        }
    }
}

/// One worker's place.
#[derive(Default)]
struct Lane {
    /// The parallel-for under way on this lane.
    posted: Slot,
    /// [`Crew::news`] before the last look for work. Only this lane's thread uses it.
    seen: AtomicU64,
    /// This lane waits for its bell; who sets it to false rings.
    asleep: AtomicBool,
    bell: Bell,
}

/// What all lanes share.
///
/// No wake-up is lost because of one order, the same for every run, loop and end: the poster
/// publishes, raises `news`, then reads the sleep flags; the sleeper raises its flag, then reads
/// `news`. All four are sequentially consistent, so one of the two sees the other.
pub(crate) struct Crew {
    lanes: Box<[CachePadded<Lane>]>,
    /// The run under way.
    run: Slot,
    /// Rises whenever there may be something new to do. The one word idle workers spin on.
    news: CachePadded<AtomicU64>,
    /// Not below the number of lanes asleep: saves posters the look at every lane.
    sleepers: CachePadded<AtomicUsize>,
    stop: AtomicBool,
}

impl Crew {
    fn new(workers: usize) -> Crew {
        Crew {
            lanes: (0..=workers).map(|_| CachePadded::default()).collect(),
            run: Slot::default(),
            news: CachePadded::default(),
            sleepers: CachePadded::default(),
            stop: AtomicBool::new(false),
        }
    }

    /// Number of lanes beside the caller's.
    pub(crate) fn count(&self) -> usize {
        self.lanes.len() - 1
    }

    /// Takes the workers for a run; `None` while they serve another.
    pub(crate) fn claim_run(&self) -> Option<Claim<'_>> {
        self.run.claim()
    }

    /// Takes the lane's slot for a parallel-for; `None` if one is under way.
    pub(crate) fn claim_loop(&self, lane: usize) -> Option<Claim<'_>> {
        self.lanes[lane].posted.claim()
    }

    /// Joins a parallel-for of another lane; `false` if there was none.
    pub(crate) fn join_loop(&self, lane: usize) -> bool {
        let others = self.lanes[lane + 1..].iter().chain(&self.lanes[..lane]);
        let mut joined = false;
        for other in others {
            joined |= other.posted.join(lane);
        }
        joined
    }

    /// Says that up to `jobs` threads could start on something new, and wakes as many sleepers.
    pub(crate) fn announce(&self, jobs: usize) {
        if jobs == 0 {
            return;
        }
        self.news.fetch_add(1, Ordering::SeqCst);
        let mut jobs = jobs;
        for lane in &self.lanes {
            if jobs == 0 || self.sleepers.load(Ordering::SeqCst) == 0 {
                return;
            }
            if self.wake(lane) {
                jobs -= 1;
            }
        }
    }

    /// Says that the run is over: frees those who spin and wakes the caller if it sleeps.
    pub(crate) fn announce_end(&self) {
        self.news.fetch_add(1, Ordering::SeqCst);
        self.wake(&self.lanes[0]);
    }

    fn wake(&self, lane: &Lane) -> bool {
        let woken = lane.asleep.load(Ordering::SeqCst) && lane.asleep.swap(false, Ordering::SeqCst);
        if woken {
            self.sleepers.fetch_sub(1, Ordering::SeqCst);
            lane.bell.ring();
        }
        woken
    }

    /// To be called before looking for work: what is posted from now on counts as news.
    pub(crate) fn look(&self, lane: usize) {
        self.lanes[lane].seen.store(self.news.load(Ordering::SeqCst), Ordering::Relaxed);
    }

    /// Spins until there is news since [`Crew::look`]; `false` if that took too long.
    pub(crate) fn spin(&self, lane: usize) -> bool {
        let seen = self.lanes[lane].seen.load(Ordering::Relaxed);
        spin_until(|| self.news.load(Ordering::Acquire) != seen)
    }

    /// Sleeps until it is woken; returns at once if there is news since [`Crew::look`].
    pub(crate) fn sleep(&self, lane: usize) {
        let lane = &self.lanes[lane];
        // Before the flag, so that the count is never below the number of flags raised.
        self.sleepers.fetch_add(1, Ordering::SeqCst);
        lane.asleep.store(true, Ordering::SeqCst);
        if self.news.load(Ordering::SeqCst) == lane.seen.load(Ordering::Relaxed) {
            while lane.asleep.load(Ordering::SeqCst) {
                lane.bell.wait();
            }
        } else if lane.asleep.swap(false, Ordering::SeqCst) {
            self.sleepers.fetch_sub(1, Ordering::SeqCst);
        }
    }

    /// A worker's life.
    fn serve(&self, lane: usize) {
        loop {
            self.look(lane);
            if self.stop.load(Ordering::Acquire) {
                return;
            }
            // The run looks again before it gives up, so the sleep starts from its last look.
            self.run.join(lane);
            self.sleep(lane);
        }
    }
}

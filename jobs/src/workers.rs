//! Worker threads: our own, the host's, or lent ones; asleep between frames.
//!
//! In:    how many, where, for how long they may spin; or the host's two callbacks.
//! Out:   threads that join what is posted; frames.
//! Keeps: the threads until dropped, the handles of the host's tasks while a frame is open.
//! Not here: what workers share and how they sleep (`crew`), the order of stages (`walk`).

use crate::arithmetic::{ArithmeticFault, check_arithmetic};
use crate::chaos::Chaos;
use crate::crew::{Crew, CrewSize, LANES_MAX};
use crate::frame::{Engaged, Frame};
use crate::pin::{count_elsewhere, pin_this_thread};
use parking_lot::Mutex;
use std::error::Error;
use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::{Builder, JoinHandle, available_parallelism};

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
    /// The system refused to bind a thread to its core. All threads have ended.
    Pin(io::Error),
    /// Threads would inherit arithmetic that is not IEEE 754's from this one.
    Arithmetic(ArithmeticFault),
}

impl fmt::Display for StartError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StartError::TooMany { asked } => {
                write!(out, "{asked} workers were asked for, at most {LANES_MAX} are possible")
            }
            StartError::Spawn(_) => write!(out, "a worker thread could not be started"),
            StartError::Pin(_) => write!(out, "a worker thread could not be bound to its core"),
            StartError::Arithmetic(fault) => write!(out, "workers cannot be started: {fault}"),
        }
    }
}

impl Error for StartError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            // Its sentence is in the message already.
            StartError::TooMany { .. } | StartError::Arithmetic(_) => None,
            StartError::Spawn(cause) | StartError::Pin(cause) => Some(cause),
        }
    }
}

/// How [`Workers::with`] makes workers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WorkerOptions {
    /// Threads beside the caller; with 0 everything runs on the caller.
    pub count: usize,
    /// Places for threads that the host lends with [`Workers::join_as_worker`]. `count` and
    /// `seats` together are at most 64.
    pub seats: usize,
    /// Longest spin, in microseconds, before a thread without work sleeps inside a frame. A
    /// wake-up costs 50 to 90 µs; a spinning thread takes a core from the host. With more threads
    /// than cores, those without a core of their own never spin.
    pub spin_us: u32,
    /// Threads are called this, a dash and their number, from 1.
    pub name: String,
    /// Thread `n` (from 1) is bound to the core `pin_to_cores[n - 1]`, if there is that entry and
    /// the system is Linux.
    pub pin_to_cores: Vec<usize>,
    /// A seed to disturb the schedule with: random choices and pauses, chunks one by one and from
    /// the last to the first. Results must not change; a host's tests can show that they do not.
    pub chaos: Option<u64>,
}

impl Default for WorkerOptions {
    fn default() -> Self {
        WorkerOptions {
            count: 0,
            seats: 0,
            spin_us: 200,
            name: "overfly".to_owned(),
            pin_to_cores: Vec::new(),
            chaos: None,
        }
    }
}

/// The callbacks of a host that has threads of its own.
struct Host {
    enqueue: Box<dyn Fn(Task) -> u64 + Send + Sync>,
    finish: Box<dyn Fn(u64) + Send + Sync>,
    /// What `enqueue` returned in this frame.
    handles: Mutex<Vec<u64>>,
}

/// Threads that help whoever calls [`Graph::run`](crate::Graph::run). They sleep between frames;
/// dropping ends and joins those that are ours.
///
/// They serve one run at a time. A run that finds them busy with another, of a second host thread
/// or from inside a stage, is done by its caller alone.
pub struct Workers {
    crew: Arc<Crew>,
    threads: Vec<JoinHandle<()>>,
    host: Option<Host>,
}

impl Workers {
    /// No workers: the caller does everything.
    pub fn none() -> Workers {
        Workers::unstarted(&WorkerOptions::default(), None)
    }

    /// Starts `workers` threads, 0 to 64, beside the caller.
    ///
    /// # Errors
    /// [`StartError`] as in [`Workers::with`].
    pub fn new(workers: usize) -> Result<Workers, StartError> {
        Workers::with(WorkerOptions { count: workers, ..WorkerOptions::default() })
    }

    /// Starts threads as the options say.
    ///
    /// # Errors
    /// [`StartError`] if there are too many, if this thread's arithmetic, which they inherit, is
    /// not IEEE 754's, or if the system refuses a thread or its core.
    pub fn with(options: WorkerOptions) -> Result<Workers, StartError> {
        check_arithmetic().map_err(StartError::Arithmetic)?;
        let asked = options.count.saturating_add(options.seats);
        if asked > LANES_MAX {
            return Err(StartError::TooMany { asked });
        }
        let mut started = Workers::unstarted(&options, None);
        let (report, pinned) = channel();
        for lane in 1..=options.count {
            let core = options.pin_to_cores.get(lane - 1).copied();
            let (crew, report) = (Arc::clone(&started.crew), report.clone());
            let thread = Builder::new()
                .name(format!("{}-{lane}", options.name))
                .spawn(move || live(&crew, lane, core, report))
                .map_err(StartError::Spawn)?;
            started.threads.push(thread);
        }
        drop(report);
        pinned.iter().collect::<io::Result<()>>().map_err(StartError::Pin)?;
        Ok(started)
    }

    /// Uses threads of the host: when a frame opens, `enqueue` is called with `tasks` [`Task`]s,
    /// one after the other; when it closes, `finish` is called with what `enqueue` returned, in
    /// the same order.
    ///
    /// The host may run a task on any of its threads, at once inside `enqueue`, late, or never.
    /// `finish` need not wait for it: a task whose frame is closed returns at once, and one that
    /// works comes back soon after `finish` is called.
    ///
    /// # Errors
    /// [`StartError::TooMany`] if `tasks` is above 64.
    pub fn host(
        tasks: usize,
        enqueue: impl Fn(Task) -> u64 + Send + Sync + 'static,
        finish: impl Fn(u64) + Send + Sync + 'static,
    ) -> Result<Workers, StartError> {
        if tasks > LANES_MAX {
            return Err(StartError::TooMany { asked: tasks });
        }
        let host = Host {
            enqueue: Box::new(enqueue),
            finish: Box::new(finish),
            handles: Mutex::new(Vec::with_capacity(tasks)),
        };
        let options = WorkerOptions { seats: tasks, ..WorkerOptions::default() };
        Ok(Workers::unstarted(&options, Some(host)))
    }

    fn unstarted(options: &WorkerOptions, host: Option<Host>) -> Workers {
        let lanes = options.count + options.seats + 1;
        // The caller's cores, which threads without one of their own inherit, and those it is kept
        // off but a worker is bound to.
        let own = available_parallelism().map_or(1, |cores| cores.get());
        let pins = &options.pin_to_cores[..options.pin_to_cores.len().min(options.count)];
        let size = CrewSize {
            own: options.count,
            seats: options.seats,
            spin_ns: u64::from(options.spin_us) * 1000,
            spinners: own + count_elsewhere(pins),
        };
        let chaos = options.chaos.map(|seed| Chaos::new(seed, lanes));
        Workers { crew: Arc::new(Crew::new(&size, chaos)), threads: Vec::new(), host }
    }

    /// Number of threads that may help the caller: own threads, seats, or the host's tasks.
    pub fn count(&self) -> usize {
        self.crew.count()
    }

    /// Opens a frame: wakes everyone at once, so that they are there when the first stage with
    /// chunks is. Call it when a frame's serial part begins.
    pub fn frame(&self) -> Frame<'_> {
        Frame::wake_all(self)
    }

    /// Lends this thread until the frame that is open now closes. `false`, at once, if none is
    /// open, if all seats are taken, if this thread is in a frame itself or works already, or if
    /// it would compute other bits than the caller ([`check_arithmetic`]).
    pub fn join_as_worker(&self) -> bool {
        self.crew.opening().is_some_and(|opening| visit(&self.crew, opening))
    }

    /// What the threads and the caller share.
    pub(crate) fn crew(&self) -> &Crew {
        &self.crew
    }

    /// Opens a frame; calls the host if it is the only one.
    pub(crate) fn open_frame(&self, wake: bool) {
        let first = self.crew.open_frame(wake);
        let Some(host) = self.host.as_ref().filter(|_| first) else { return };
        let Some(opening) = self.crew.opening() else { return };
        for _ in 0..self.crew.seats() {
            let handle = (host.enqueue)(Task { crew: Arc::clone(&self.crew), opening });
            host.handles.lock().push(handle);
        }
    }

    /// Closes a frame; calls the host if it was the last one.
    pub(crate) fn close_frame(&self) {
        if self.crew.close_frame()
            && let Some(host) = &self.host
        {
            let mut handles = host.handles.lock();
            handles.drain(..).for_each(|handle| (host.finish)(handle));
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.crew.stop();
        for thread in self.threads.drain(..) {
            // Workers catch every panic of a stage; one that got here is reported already, and a
            // second panic inside a drop would only hide it.
            let _ = thread.join();
        }
    }
}

/// A worker's thread.
fn live(crew: &Crew, lane: usize, core: Option<usize>, report: Sender<io::Result<()>>) {
    let pinned = core.map_or(Ok(()), pin_this_thread);
    let works = pinned.is_ok();
    // Nobody listens any more if another thread was refused; then the crew stops, too.
    let _ = report.send(pinned);
    drop(report);
    if works {
        let _engaged = Engaged::new();
        crew.serve(lane);
    }
}

fn visit(crew: &Crew, opening: u64) -> bool {
    if Engaged::anywhere() || check_arithmetic().is_err() {
        return false;
    }
    let _engaged = Engaged::new();
    crew.visit(opening)
}

/// A worker's part of one frame, for a host to run on one of its threads; see [`Workers::host`].
///
/// It may be run late or dropped, and may outlive the workers.
pub struct Task {
    crew: Arc<Crew>,
    opening: u64,
}

impl Task {
    /// Works until the task's frame closes. Returns at once if it is closed already, if this
    /// thread is in a frame itself or works already, or if it would compute other bits.
    pub fn run(self) {
        visit(&self.crew, self.opening);
    }
}

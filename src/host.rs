//! What a host brings to a scene: threads, how pages come, patience with servers.
//!
//! In:    the host's choices, as data.
//! Out:   [`Host`], for `Overfly::new`.
//! Keeps: nothing.
//! Not here: what the threads do (`overfly_jobs`), the loader itself (`loader`).

use crate::archive::OpenOptions;
use crate::jobs::{self, StartError, Task, WorkerOptions};
use std::fmt;

/// What a host brings. A number of own workers becomes a host whose pages the host itself brings.
#[derive(Default)]
pub struct Host {
    /// Who helps with a frame beside its caller.
    pub workers: Workers,
    /// How pages come.
    pub pages: Pages,
    /// How long a silent server is waited for.
    pub patience: OpenOptions,
}

impl From<usize> for Host {
    fn from(workers: usize) -> Self {
        Self { workers: Workers::Own(workers), ..Self::default() }
    }
}

/// Who helps with a frame beside its caller. What comes out is the same bits with all of them.
#[derive(Default)]
pub enum Workers {
    /// Nobody: no thread is started.
    #[default]
    Caller,
    /// So many threads of our own, 0 to 64; they sleep between frames.
    Own(usize),
    /// Threads of the host.
    Host(HostThreads),
}

/// Threads of the host, lent for parts of a frame.
pub enum HostThreads {
    /// At most so many, 0 to 64, which call `join_as_worker` of `Overfly::crew` when they have time.
    Lent {
        /// How many may help at once.
        most: usize,
    },
    /// When a frame opens, `enqueue` is called with each of its tasks; when it closes, `finish` is
    /// called with what `enqueue` returned. A task may run on any thread, late, or never.
    Spawned {
        /// Tasks of a frame, 0 to 64.
        tasks: usize,
        /// Gives a task to the host's scheduler; a handle comes back.
        enqueue: Box<dyn Fn(Task) -> u64 + Send + Sync>,
        /// The frame of this handle is over.
        finish: Box<dyn Fn(u64) + Send + Sync>,
    },
}

impl fmt::Debug for HostThreads {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lent { most } => write!(f, "Lent {{ most: {most} }}"),
            Self::Spawned { tasks, .. } => write!(f, "Spawned {{ tasks: {tasks} }}"),
        }
    }
}

impl Workers {
    pub(crate) fn start(self) -> Result<jobs::Workers, StartError> {
        match self {
            Self::Caller => Ok(jobs::Workers::none()),
            Self::Own(count) => jobs::Workers::new(count),
            Self::Host(HostThreads::Lent { most }) => {
                jobs::Workers::with(WorkerOptions { seats: most, ..WorkerOptions::default() })
            }
            Self::Host(HostThreads::Spawned { tasks, enqueue, finish }) => {
                jobs::Workers::host(tasks, enqueue, finish)
            }
        }
    }
}

/// How pages come into a frame. They are part of what a recording keeps, so all of them replay.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Pages {
    /// The host fills `FrameInput::arrived`, from a [`Loader`](crate::loader::Loader) or from I/O
    /// of its own.
    #[default]
    Host,
    /// Loader threads of ours make what a frame wants; it arrives when it is ready. Frames wait for
    /// nothing; which page comes when depends on the machine.
    AsReady {
        /// At least one is started.
        threads: usize,
    },
    /// What a frame wants arrives in the next one, which waits for it: the same frames on every
    /// machine, for tests and analyses.
    Waited {
        /// At least one is started.
        threads: usize,
    },
}

//! A request to leave out what is not begun.
//!
//! In:    [`Cancel::cancel`], from any thread, a stage included.
//! Out:   stages not yet begun are skipped; the run says so.
//! Keeps: one flag, until [`Cancel::reset`].
//! Not here: skipping (`walk`).

use crate::run::StagePanic;
use std::error::Error;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag to end a run early; see [`Graph::run_unless`](crate::Graph::run_unless).
#[derive(Default, Debug)]
pub struct Cancel {
    flag: AtomicBool,
}

impl Cancel {
    /// A flag that is not set.
    pub const fn new() -> Cancel {
        Cancel { flag: AtomicBool::new(false) }
    }

    /// Sets the flag. Stages under way are not disturbed.
    pub fn cancel(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Takes the flag back, for the next run.
    pub fn reset(&self) {
        self.flag.store(false, Ordering::Relaxed);
    }

    /// Whether the flag is set; a long stage may look, too.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }
}

/// Why a run did not do everything.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Stopped {
    /// A stage panicked; stages may have been cancelled, too.
    Panicked(StagePanic),
    /// At least one stage was skipped because of a [`Cancel`].
    Cancelled,
}

impl fmt::Display for Stopped {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stopped::Panicked(_) => write!(out, "a stage panicked"),
            Stopped::Cancelled => write!(out, "the run was cancelled"),
        }
    }
}

impl Error for Stopped {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Stopped::Panicked(panic) => Some(panic),
            Stopped::Cancelled => None,
        }
    }
}

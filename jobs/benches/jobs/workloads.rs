//! The workloads: what an iteration is, how often it is repeated, what counts as fast.
//!
//! In:    nothing.
//! Out:   [`WORKLOADS`], and the work of every chunk.
//! Keeps: nothing.
//! Not here: the jobs (`board`), the schedulers, the clock (`measure`).

use crate::board::{Board, CHAIN, Shape, WIDE};
use crate::spin::Pace;

/// The work of the chunks of a frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// None.
    Empty,
    /// So many nanoseconds each.
    Even(u64),
    /// From a quarter to seven quarters of 20 µs.
    Skewed,
}

/// What happens between the iterations.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Pause {
    /// Nothing: the next one follows at once.
    None,
    /// 5 ms of sleep.
    Idle,
    /// 5 ms of sleep, then 100 µs of work of the caller, before which a scheduler that can be told
    /// that a frame begins is told so. Neither is part of the time.
    IdleThenSerial,
}

/// One kind of iteration under one condition.
pub struct Workload {
    /// As the table and `--only` call it.
    pub name: &'static str,
    /// The jobs.
    pub shape: Shape,
    /// Their work.
    pub work: Work,
    /// What lies between two iterations.
    pub pause: Pause,
    /// A thread outside all schedulers keeps the last of the cores busy.
    pub hog: bool,
    /// Iterations in one turn of one scheduler.
    pub iterations: usize,
    /// What our own scheduler is to reach.
    pub goal: Goal,
}

/// What our own scheduler is to reach, beside a heap that is not called. All are upper bounds but
/// for the share, which is a lower one.
#[derive(Clone, Copy)]
pub enum Goal {
    /// Nothing of its own.
    None,
    /// No job that waits in vain for another.
    NoGiveUp,
    /// The median per job or chunk, in nanoseconds.
    PerJobNs(f64),
    /// The median of the iteration, in microseconds.
    MedianUs(f64),
    /// The share of the speed of plain threads.
    OfPlain(f64),
    /// The median over the ideal, and the processor time over the work.
    OverIdealAndCpu(f64, f64),
    /// The 99th percentile of the iteration, in microseconds.
    P99Us(f64),
}

const EMPTY: Workload = Workload {
    name: "",
    shape: Shape::Frame,
    work: Work::Empty,
    pause: Pause::None,
    hog: false,
    iterations: 100,
    goal: Goal::None,
};

const FRAME2: Work = Work::Even(2_000);
const FRAME20: Work = Work::Even(20_000);

/// All of them, in the order of the table.
pub const WORKLOADS: [Workload; 12] = [
    Workload {
        name: "fan",
        shape: Shape::Fan,
        iterations: 30,
        goal: Goal::PerJobNs(40.0),
        ..EMPTY
    },
    Workload { name: "pfor", shape: Shape::Pfor, goal: Goal::PerJobNs(1.0), ..EMPTY },
    Workload { name: "chain", shape: Shape::Chain, goal: Goal::PerJobNs(6.0), ..EMPTY },
    Workload { name: "frame0", iterations: 200, goal: Goal::MedianUs(7.0), ..EMPTY },
    Workload { name: "frame2", work: FRAME2, goal: Goal::OfPlain(0.97), ..EMPTY },
    Workload { name: "frame20", work: FRAME20, iterations: 8, ..EMPTY },
    Workload {
        name: "skew",
        work: Work::Skewed,
        iterations: 8,
        goal: Goal::OfPlain(0.98),
        ..EMPTY
    },
    Workload {
        name: "wake",
        shape: Shape::Pair,
        pause: Pause::Idle,
        iterations: 8,
        goal: Goal::NoGiveUp,
        ..EMPTY
    },
    Workload { name: "cold2", work: FRAME2, pause: Pause::Idle, iterations: 8, ..EMPTY },
    Workload {
        name: "cold2_prewake",
        work: FRAME2,
        pause: Pause::IdleThenSerial,
        iterations: 8,
        goal: Goal::OverIdealAndCpu(1.05, 1.3),
        ..EMPTY
    },
    Workload {
        name: "hog_frame2",
        work: FRAME2,
        hog: true,
        iterations: 50,
        goal: Goal::P99Us(1200.0),
        ..EMPTY
    },
    Workload { name: "hog_frame20", work: FRAME20, hog: true, iterations: 6, ..EMPTY },
];

impl Workload {
    /// Writes the work of its chunks on the board.
    pub fn lay_out(&self, board: &Board, pace: Pace) {
        let work = self.work;
        board.set_steps(|stage, chunk| match work {
            Work::Empty => 0,
            Work::Even(chunk_ns) => pace.steps(chunk_ns),
            Work::Skewed => {
                let place = ((37 * chunk + 11 * stage) % 64) as u64;
                pace.steps(5_000 + 30_000 * place / 63)
            }
        });
    }

    /// Jobs or chunks that the time of an iteration is divided by; `None` where it is not.
    pub fn jobs(&self) -> Option<f64> {
        match self.shape {
            Shape::Fan | Shape::Pfor => Some(WIDE as f64),
            Shape::Chain => Some(CHAIN as f64),
            Shape::Frame | Shape::Pair => None,
        }
    }

    /// True if two jobs meet, so that the start of the later one is worth a line.
    pub fn meets(&self) -> bool {
        self.shape == Shape::Pair
    }

    /// True if the caller sleeps before every iteration.
    pub fn sleeps(&self) -> bool {
        self.pause != Pause::None
    }

    /// True if iterations follow one another at once and no other thread wants the cores.
    pub fn is_back_to_back(&self) -> bool {
        self.pause == Pause::None && !self.hog
    }

    /// True if it takes two threads to mean anything.
    pub fn needs_two(&self) -> bool {
        self.shape == Shape::Pair || self.hog
    }
}

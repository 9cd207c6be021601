//! What the report asks of a scheduler, and the one that is none.
//!
//! In:    a shape to run once.
//! Out:   all its jobs done when the call returns.
//! Keeps: each scheduler its threads and what it built beforehand.
//! Not here: the schedulers with threads (`ours`, `with_rayon`, `plain`), the clock (`measure`).

use crate::board::{Board, CHAIN, CHUNKS, STAGES, Shape, WIDE};
use crate::ours::{Manner, Ours};
use crate::plain::Plain;
use crate::with_rayon::{Rayon, Splitting};
use crate::workloads::Workload;
use overfly_jobs::now_ns;

/// One of those that stand side by side in the table.
///
/// A trait, because the clock must not know whom it measures.
pub trait Scheduler {
    /// As the table calls it.
    fn name(&self) -> &'static str;

    /// True if it has a way to run this workload.
    fn takes(&self, workload: &Workload) -> bool;

    /// Its turn begins.
    fn enter(&mut self, _workload: &Workload) {}

    /// Its turn is over: its threads must leave the cores to the others.
    fn leave(&mut self) {}

    /// Runs one iteration.
    fn run(&mut self, shape: Shape);

    /// Runs one iteration behind a serial stage of the caller, and may use the time of that stage
    /// to wake its threads. Returns the nanoseconds of the iteration without that stage.
    fn run_behind(&mut self, serial: &dyn Fn(), shape: Shape) -> u64 {
        serial();
        let begin_ns = now_ns();
        self.run(shape);
        now_ns() - begin_ns
    }
}

/// All schedulers for so many threads, the caller included. The first is [`Serial`].
pub fn all(board: &'static Board, threads: usize) -> Vec<Box<dyn Scheduler>> {
    vec![
        Box::new(Serial { board }),
        Box::new(Plain::new(board, threads)),
        Box::new(Rayon::new(board, threads, Splitting::EveryChunk)),
        Box::new(Rayon::new(board, threads, Splitting::Adaptive)),
        Box::new(Ours::new(board, threads, Manner::Framed)),
        Box::new(Ours::new(board, threads, Manner::Unframed)),
        Box::new(Ours::new(board, threads, Manner::WithSpans)),
    ]
}

/// Plain loops of the caller.
pub struct Serial {
    board: &'static Board,
}

impl Scheduler for Serial {
    fn name(&self) -> &'static str {
        "serial"
    }

    fn takes(&self, workload: &Workload) -> bool {
        workload.shape != Shape::Pair
    }

    fn run(&mut self, shape: Shape) {
        match shape {
            Shape::Fan => {
                self.board.mark(WIDE);
                (0..WIDE).for_each(|job| self.board.mark(job));
                self.board.mark(WIDE + 1);
            }
            Shape::Pfor => (0..WIDE).for_each(|job| self.board.mark(job)),
            Shape::Chain => (0..CHAIN).for_each(|job| self.board.link(job)),
            Shape::Frame => {
                for stage in 0..STAGES {
                    (0..CHUNKS).for_each(|chunk| self.board.chunk(stage, chunk));
                }
            }
            Shape::Pair => unreachable!("one thread cannot meet itself"),
        }
    }
}

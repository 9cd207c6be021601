//! rayon, with the caller as a member of its pool.
//!
//! In:    a shape to run once.
//! Out:   all its jobs done.
//! Keeps: one pool for the whole program, since a thread can be the member of one only.
//! Not here: the other schedulers.

use crate::board::{Board, CHAIN, CHUNKS, STAGES, Shape, WIDE};
use crate::schedulers::Scheduler;
use crate::system::pin_to_core;
use crate::workloads::Workload;
use rayon::prelude::*;
use rayon::{Scope, ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, OnceLock};

/// Where rayon cuts a loop.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Splitting {
    /// At every chunk, as the workloads ask: any chunk can go to any thread.
    EveryChunk,
    /// Where rayon likes to.
    Adaptive,
}

/// rayon as a scheduler.
pub struct Rayon {
    board: &'static Board,
    pool: Arc<ThreadPool>,
    splitting: Splitting,
}

impl Rayon {
    /// Uses the pool of the program, of which the thread that made it is a member.
    pub fn new(board: &'static Board, threads: usize, splitting: Splitting) -> Rayon {
        static POOL: OnceLock<Arc<ThreadPool>> = OnceLock::new();
        let pool = POOL.get_or_init(|| {
            let pool = ThreadPoolBuilder::new()
                .num_threads(threads)
                .use_current_thread()
                .start_handler(pin_to_core)
                .build();
            Arc::new(pool.expect("the system gives a few threads"))
        });
        Rayon { board, pool: Arc::clone(pool), splitting }
    }

    fn each(&self, count: usize, body: impl Fn(usize) + Sync + Send) {
        let chunks = (0..count).into_par_iter();
        match self.splitting {
            Splitting::EveryChunk => chunks.with_max_len(1).for_each(body),
            Splitting::Adaptive => chunks.for_each(body),
        }
    }
}

impl Scheduler for Rayon {
    fn name(&self) -> &'static str {
        match self.splitting {
            Splitting::EveryChunk => "rayon",
            Splitting::Adaptive => "rayon_adaptive",
        }
    }

    fn takes(&self, workload: &Workload) -> bool {
        let loops = matches!(workload.shape, Shape::Pfor | Shape::Frame);
        self.splitting == Splitting::EveryChunk || loops
    }

    fn run(&mut self, shape: Shape) {
        let board = self.board;
        self.pool.install(|| match shape {
            Shape::Fan => {
                board.mark(WIDE);
                rayon::scope(|scope| {
                    (0..WIDE).for_each(|job| scope.spawn(move |_| board.mark(job)));
                });
                board.mark(WIDE + 1);
            }
            Shape::Pfor => self.each(WIDE, |chunk| board.mark(chunk)),
            Shape::Chain => rayon::scope(|scope| link(scope, board, 0)),
            Shape::Frame => {
                for stage in 0..STAGES {
                    self.each(CHUNKS, |chunk| board.chunk(stage, chunk));
                }
            }
            Shape::Pair => {
                rayon::join(|| board.meet(0), || board.meet(1));
            }
        });
    }
}

/// A job of the chain, which spawns the next one.
fn link(scope: &Scope<'static>, board: &'static Board, job: usize) {
    board.link(job);
    if job + 1 < CHAIN {
        scope.spawn(move |scope| link(scope, board, job + 1));
    }
}

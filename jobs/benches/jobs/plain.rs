//! Threads of their own that spin: what the machine gives when nothing schedules.
//!
//! In:    a shape to run once.
//! Out:   all its jobs done.
//! Keeps: threads that spin during their turn, also between iterations, and sleep outside it.
//! Not here: anything a program could afford; this is the floor that the others are held against.

use crate::board::{Board, CHAIN, CHUNKS, STAGES, Shape, WIDE};
use crate::schedulers::Scheduler;
use crate::system::pin_to_core;
use crate::workloads::Workload;
use crossbeam::utils::CachePadded;
use std::hint::spin_loop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};

/// Plain threads as a scheduler.
pub struct Plain {
    gang: Arc<Gang>,
    threads: Vec<JoinHandle<()>>,
}

/// What the caller and the threads share.
struct Gang {
    board: &'static Board,
    size: usize,
    /// Rises with every iteration; published with release, after `shape` and the cursors are set.
    round: CachePadded<AtomicU32>,
    shape: AtomicU32,
    /// The next chunk of each stage, where the chunks have work.
    cursors: [CachePadded<AtomicUsize>; STAGES],
    /// Threads through with each stage, since the program began.
    arrivals: [CachePadded<AtomicUsize>; STAGES],
    /// The turn is on: spin instead of sleep.
    open: AtomicBool,
    stop: AtomicBool,
}

/// The shapes that need the threads, as numbers.
const SHAPES: [Shape; 4] = [Shape::Fan, Shape::Pfor, Shape::Frame, Shape::Pair];

impl Plain {
    /// Starts `threads` less one threads, asleep.
    pub fn new(board: &'static Board, threads: usize) -> Plain {
        let gang = Arc::new(Gang {
            board,
            size: threads,
            round: CachePadded::default(),
            shape: AtomicU32::new(0),
            cursors: Default::default(),
            arrivals: Default::default(),
            open: AtomicBool::new(false),
            stop: AtomicBool::new(false),
        });
        let start = |member| {
            let gang = Arc::clone(&gang);
            thread::spawn(move || gang.serve(member))
        };
        Plain { threads: (1..threads).map(start).collect(), gang }
    }
}

impl Drop for Plain {
    fn drop(&mut self) {
        self.gang.stop.store(true, Ordering::Release);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            thread.join().expect("the jobs do not panic");
        }
    }
}

impl Scheduler for Plain {
    fn name(&self) -> &'static str {
        "plain"
    }

    fn takes(&self, _workload: &Workload) -> bool {
        true
    }

    fn enter(&mut self, _workload: &Workload) {
        self.gang.open.store(true, Ordering::Release);
        self.threads.iter().for_each(|thread| thread.thread().unpark());
    }

    fn leave(&mut self) {
        self.gang.open.store(false, Ordering::Release);
    }

    fn run(&mut self, shape: Shape) {
        let gang = &*self.gang;
        let Some(number) = SHAPES.iter().position(|&known| known == shape) else {
            (0..CHAIN).for_each(|job| gang.board.link(job));
            return;
        };
        gang.cursors.iter().for_each(|cursor| cursor.store(0, Ordering::Relaxed));
        gang.shape.store(u32::try_from(number).expect("there are four"), Ordering::Relaxed);
        if shape == Shape::Fan {
            gang.board.mark(WIDE);
        }
        gang.round.fetch_add(1, Ordering::Release);
        gang.share(0, shape);
        if shape == Shape::Fan {
            gang.board.mark(WIDE + 1);
        }
    }
}

impl Gang {
    fn serve(&self, member: usize) {
        pin_to_core(member);
        let mut done = 0;
        while !self.stop.load(Ordering::Acquire) {
            let round = self.round.load(Ordering::Acquire);
            if round != done {
                let shape = SHAPES[self.shape.load(Ordering::Relaxed) as usize];
                self.share(member, shape);
                done = round;
            } else if self.open.load(Ordering::Acquire) {
                spin_loop();
            } else {
                thread::park();
            }
        }
    }

    /// One member's part of an iteration.
    fn share(&self, member: usize, shape: Shape) {
        match shape {
            Shape::Fan | Shape::Pfor => {
                self.part(member, WIDE).for_each(|job| self.board.mark(job));
                self.gather(0);
            }
            Shape::Frame if self.board.has_work() => {
                for stage in 0..STAGES {
                    self.drain(stage);
                    self.gather(stage);
                }
            }
            Shape::Frame => {
                for stage in 0..STAGES {
                    let part = self.part(member, CHUNKS);
                    part.for_each(|chunk| self.board.chunk(stage, chunk));
                    self.gather(stage);
                }
            }
            Shape::Pair if member < 2 => {
                self.board.meet(member);
                self.gather(0);
            }
            Shape::Pair => self.gather(0),
            Shape::Chain => unreachable!("the caller does a chain alone"),
        }
    }

    /// A member's part of so many jobs of equal length.
    fn part(&self, member: usize, count: usize) -> std::ops::Range<usize> {
        count * member / self.size..count * (member + 1) / self.size
    }

    /// Takes chunk after chunk until none is left.
    fn drain(&self, stage: usize) {
        loop {
            let chunk = self.cursors[stage].fetch_add(1, Ordering::Relaxed);
            if chunk >= CHUNKS {
                return;
            }
            self.board.chunk(stage, chunk);
        }
    }

    /// Waits until all members are through with the stage.
    fn gather(&self, stage: usize) {
        let before = self.arrivals[stage].fetch_add(1, Ordering::AcqRel);
        let all = (before / self.size + 1) * self.size;
        while self.arrivals[stage].load(Ordering::Acquire) < all {
            spin_loop();
        }
    }
}

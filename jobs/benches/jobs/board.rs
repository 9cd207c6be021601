//! What the jobs of all workloads do, and the proof that they did it.
//!
//! In:    an epoch per iteration; calls of the jobs, from any thread.
//! Out:   the epoch in every used slot; a count of jobs that ran before what they follow.
//! Keeps: slots, the work of every chunk of a frame, the marks of the two jobs that meet.
//! Not here: who calls the jobs, and when (the schedulers).

use crate::spin::spin_work;
use crossbeam::utils::CachePadded;
use overfly_jobs::now_ns;
use std::hint::spin_loop;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Jobs of `fan` between source and sink, and chunks of `pfor`.
pub const WIDE: usize = 10_000;
/// Jobs of `chain`.
pub const CHAIN: usize = 1_000;
/// Stages of a frame, one after the other.
pub const STAGES: usize = 8;
/// Chunks of a stage of a frame.
pub const CHUNKS: usize = 64;
/// Slots, used or not.
const SLOTS: usize = 16_384;
/// When a job of `wake` no longer waits for the other.
const GIVE_UP_NS: u64 = 2_000_000;

/// What one iteration is made of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A source, [`WIDE`] empty jobs, a sink.
    Fan,
    /// One loop over [`WIDE`] empty chunks.
    Pfor,
    /// [`CHAIN`] empty jobs, one after the other.
    Chain,
    /// [`STAGES`] loops of [`CHUNKS`] chunks, one after the other.
    Frame,
    /// Two jobs that wait for each other.
    Pair,
}

impl Shape {
    /// Slots that an iteration fills.
    fn slots(self) -> usize {
        match self {
            Shape::Fan => WIDE + 2,
            Shape::Pfor => WIDE,
            Shape::Chain => CHAIN,
            Shape::Frame => STAGES * CHUNKS,
            Shape::Pair => 2,
        }
    }
}

/// Shared by all jobs. Only this iteration's epoch and the work are read; everything is relaxed,
/// so that order comes from the scheduler and from nothing else.
pub struct Board {
    epoch: CachePadded<AtomicU32>,
    slots: Box<[AtomicU32]>,
    /// Steps of chunk `c` of stage `s` at `s * CHUNKS + c`; all 0 in frames of empty chunks.
    steps: Box<[AtomicU32]>,
    /// Jobs that ran before one that they follow.
    faults: AtomicU64,
    /// Jobs of a pair that never saw the other.
    give_ups: AtomicU64,
    flags: [CachePadded<AtomicU32>; 2],
    starts_ns: [CachePadded<AtomicU64>; 2],
}

impl Board {
    /// An empty board at epoch 0, with chunks without work.
    pub fn new() -> Board {
        let zeros = |count: usize| (0..count).map(|_| AtomicU32::new(0)).collect();
        Board {
            epoch: CachePadded::default(),
            slots: zeros(SLOTS),
            steps: zeros(STAGES * CHUNKS),
            faults: AtomicU64::new(0),
            give_ups: AtomicU64::new(0),
            flags: Default::default(),
            starts_ns: Default::default(),
        }
    }

    /// Gives every chunk of a frame its work.
    pub fn set_steps(&self, of: impl Fn(usize, usize) -> u32) {
        for (index, steps) in self.steps.iter().enumerate() {
            steps.store(of(index / CHUNKS, index % CHUNKS), Ordering::Relaxed);
        }
    }

    /// True if a chunk of the frame has work.
    pub fn has_work(&self) -> bool {
        self.steps[0].load(Ordering::Relaxed) > 0
    }

    /// Begins an iteration.
    pub fn next_epoch(&self) {
        self.epoch.fetch_add(1, Ordering::Release);
    }

    /// Jobs that gave up waiting for the other of their pair, since the last call.
    pub fn take_give_ups(&self) -> u64 {
        self.give_ups.swap(0, Ordering::Relaxed)
    }

    /// What is wrong with the iterations since the last call; `None` if nothing is.
    pub fn fault(&self, shape: Shape) -> Option<String> {
        let epoch = self.now();
        let used = &self.slots[..shape.slots()];
        let stale = used.iter().filter(|slot| slot.load(Ordering::Relaxed) != epoch).count();
        let early = self.faults.swap(0, Ordering::Relaxed);
        (stale > 0 || early > 0)
            .then(|| format!("{stale} jobs did not run, {early} ran before one they follow"))
    }

    /// When the later job of the last pair began.
    pub fn later_start_ns(&self) -> u64 {
        let [a, b] = &self.starts_ns;
        a.load(Ordering::Relaxed).max(b.load(Ordering::Relaxed))
    }

    fn now(&self) -> u32 {
        self.epoch.load(Ordering::Relaxed)
    }

    /// A job that does nothing but leave its mark. The source of a fan is `WIDE`, its sink the one
    /// after.
    #[inline]
    pub fn mark(&self, job: usize) {
        self.slots[job].store(self.now(), Ordering::Relaxed);
    }

    /// A job of the chain.
    #[inline]
    pub fn link(&self, job: usize) {
        let epoch = self.now();
        if job > 0 && self.slots[job - 1].load(Ordering::Relaxed) != epoch {
            self.faults.fetch_add(1, Ordering::Relaxed);
        }
        self.slots[job].store(epoch, Ordering::Relaxed);
    }

    /// A chunk of a frame.
    #[inline]
    pub fn chunk(&self, stage: usize, chunk: usize) {
        let epoch = self.now();
        let slot = stage * CHUNKS + chunk;
        if stage > 0 {
            let before = slot - chunk - CHUNKS + 7 * chunk % CHUNKS;
            if self.slots[before].load(Ordering::Relaxed) != epoch {
                self.faults.fetch_add(1, Ordering::Relaxed);
            }
        }
        let steps = self.steps[slot].load(Ordering::Relaxed);
        if steps > 0 {
            spin_work(steps);
        }
        self.slots[slot].store(epoch, Ordering::Relaxed);
    }

    /// One of two jobs that wait for each other.
    pub fn meet(&self, job: usize) {
        let begin_ns = now_ns();
        let epoch = self.now();
        self.starts_ns[job].store(begin_ns, Ordering::Relaxed);
        self.flags[job].store(epoch, Ordering::Release);
        while self.flags[1 - job].load(Ordering::Acquire) != epoch {
            if now_ns() - begin_ns > GIVE_UP_NS {
                self.give_ups.fetch_add(1, Ordering::Relaxed);
                break;
            }
            spin_loop();
        }
        self.mark(job);
    }
}

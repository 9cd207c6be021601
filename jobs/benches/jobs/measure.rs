//! Turns and rounds: every scheduler runs every workload, one after the other, again and again.
//!
//! In:    schedulers, a workload, a number of rounds.
//! Out:   [`Samples`] per scheduler: times, processor time, switches, heap calls.
//! Keeps: nothing between workloads.
//! Not here: percentiles and goals (`summary`), printing (`table`).

use crate::board::Board;
use crate::heap;
use crate::schedulers::Scheduler;
use crate::spin::{Pace, spin_work};
use crate::system::{cpu_ns, pin_to_core, voluntary_switches};
use crate::workloads::{Pause, Work, Workload};
use overfly_jobs::now_ns;
use std::cell::Cell;
use std::hint::spin_loop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Iterations before the first that counts.
const WARM_UP: usize = 100;
/// Iterations before the first that counts of each turn.
const TURN_WARM_UP: usize = 3;
/// Beside a hog, a thread that has slept through the turns of the others is favoured by the system
/// for some milliseconds; those do not count either.
const HOG_WARM_UP_NS: u64 = 50_000_000;
const IDLE: Duration = Duration::from_millis(5);
const SERIAL_NS: u64 = 100_000;

/// What one scheduler took for one workload. Sums are over the iterations that counted.
pub struct Samples {
    /// Its name.
    pub scheduler: &'static str,
    /// Times of the iterations, in nanoseconds, in the order they ran.
    pub times_ns: Vec<u64>,
    /// From an iteration's begin to the start of its later job; only where two jobs meet.
    pub later_ns: Vec<u64>,
    /// Processor time of the process, less the serial stages of the caller.
    pub cpu_ns: u64,
    /// Voluntary context switches of all threads, the caller's own 5 ms sleeps included.
    pub switches: u64,
    /// Calls to the allocator.
    pub heap_calls: u64,
    /// Jobs that waited 2 ms in vain for the other of their pair.
    pub give_ups: u64,
}

/// What all workloads are measured with.
pub struct Bench {
    /// What the jobs write to.
    pub board: &'static Board,
    /// The speed of this machine.
    pub pace: Pace,
    /// The caller included.
    pub threads: usize,
    /// Turns of each scheduler in each workload.
    pub rounds: usize,
}

impl Bench {
    /// Runs one workload with all schedulers that take it: in each round each has its turn, and the
    /// order moves on by one, so that what drifts hits all of them alike.
    ///
    /// # Errors
    /// What was wrong, if a scheduler left a job out or ran it too early.
    pub fn run(
        &self,
        workload: &Workload,
        schedulers: &mut [Box<dyn Scheduler>],
    ) -> Result<Vec<Samples>, String> {
        let mut takers: Vec<_> =
            schedulers.iter_mut().filter(|scheduler| scheduler.takes(workload)).collect();
        let capacity = self.rounds * workload.iterations;
        let mut all: Vec<_> =
            takers.iter().map(|taker| Samples::new(taker.name(), capacity)).collect();
        for taker in &mut takers {
            self.warm_up(workload, &mut ***taker);
        }
        workload.lay_out(self.board, self.pace);
        let _hog = workload.hog.then(|| Hog::start(self.threads - 1));
        for round in 0..self.rounds {
            for turn in 0..takers.len() {
                let turn = (turn + round) % takers.len();
                self.turn(workload, &mut **takers[turn], &mut all[turn])?;
            }
        }
        Ok(all)
    }

    /// Lets graphs and threads meet. The chunks are empty, which takes the least time: what is to
    /// be allocated is allocated for their number.
    fn warm_up(&self, workload: &Workload, scheduler: &mut dyn Scheduler) {
        Workload { work: Work::Empty, ..*workload }.lay_out(self.board, self.pace);
        scheduler.enter(workload);
        for _ in 0..WARM_UP {
            self.board.next_epoch();
            scheduler.run(workload.shape);
        }
        scheduler.leave();
    }

    /// The first iterations of a turn, which do not count.
    fn settle(&self, workload: &Workload, scheduler: &mut dyn Scheduler) {
        let begin_ns = now_ns();
        let least_ns = if workload.hog { HOG_WARM_UP_NS } else { 0 };
        let mut iterations = 0;
        while iterations < TURN_WARM_UP || now_ns() - begin_ns < least_ns {
            self.board.next_epoch();
            scheduler.run(workload.shape);
            iterations += 1;
        }
    }

    fn turn(
        &self,
        workload: &Workload,
        scheduler: &mut dyn Scheduler,
        samples: &mut Samples,
    ) -> Result<(), String> {
        scheduler.enter(workload);
        self.settle(workload, scheduler);
        self.board.take_give_ups();
        let serial_ns = Cell::new(0);
        let serial = || {
            let begin_ns = now_ns();
            spin_work(self.pace.steps(SERIAL_NS));
            serial_ns.set(serial_ns.get() + now_ns() - begin_ns);
        };
        let before = (cpu_ns(), voluntary_switches(), heap::calls());
        for _ in 0..workload.iterations {
            if workload.pause != Pause::None {
                thread::sleep(IDLE);
            }
            self.board.next_epoch();
            let begin_ns = now_ns();
            let time_ns = if workload.pause == Pause::IdleThenSerial {
                scheduler.run_behind(&serial, workload.shape)
            } else {
                scheduler.run(workload.shape);
                now_ns() - begin_ns
            };
            samples.times_ns.push(time_ns);
            samples.later_ns.push(self.board.later_start_ns().saturating_sub(begin_ns));
        }
        samples.cpu_ns += (cpu_ns() - before.0).saturating_sub(serial_ns.get());
        samples.switches += voluntary_switches() - before.1;
        samples.heap_calls += heap::calls() - before.2;
        samples.give_ups += self.board.take_give_ups();
        scheduler.leave();
        let fault = self.board.fault(workload.shape);
        fault.map_or(Ok(()), |fault| Err(format!("{}: {fault}", scheduler.name())))
    }

    /// The processor time of the process while nobody wants anything from a scheduler whose threads
    /// have just worked, and its voluntary context switches.
    pub fn idle(
        &self,
        workload: &Workload,
        scheduler: &mut dyn Scheduler,
        pause: Duration,
    ) -> (u64, u64) {
        workload.lay_out(self.board, self.pace);
        scheduler.enter(workload);
        self.settle(workload, scheduler);
        // Let those who spin a while before they sleep do so: that belongs to the frame.
        thread::sleep(IDLE);
        let before = (cpu_ns(), voluntary_switches());
        thread::sleep(pause);
        let idle = (cpu_ns() - before.0, voluntary_switches() - before.1);
        scheduler.leave();
        idle
    }
}

impl Samples {
    fn new(scheduler: &'static str, capacity: usize) -> Samples {
        Samples {
            scheduler,
            times_ns: Vec::with_capacity(capacity),
            later_ns: Vec::with_capacity(capacity),
            cpu_ns: 0,
            switches: 0,
            heap_calls: 0,
            give_ups: 0,
        }
    }
}

/// A thread of the host that keeps a core busy until it is dropped.
struct Hog {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Hog {
    fn start(core: usize) -> Hog {
        let stop = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            pin_to_core(core);
            while !told.load(Ordering::Relaxed) {
                spin_loop();
            }
        });
        Hog { stop, thread: Some(thread) }
    }
}

impl Drop for Hog {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let joined = self.thread.take().map(JoinHandle::join);
        assert!(joined.is_none_or(|result| result.is_ok()), "a hog has nothing to panic about");
    }
}

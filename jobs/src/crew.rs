//! What all workers share: what is posted, who sleeps, whether a frame is open.
//!
//! In:    runs and loops to be joined; frames opened and closed; threads that offer themselves.
//! Out:   workers awake when there is something to do, spinning only inside a frame.
//! Keeps: one lane (slot, bell, last look) per worker, lane 0 for whoever calls `run`.
//! Not here: the order of stages (`walk`), threads and hosts (`workers`).

use crate::chaos::Chaos;
use crate::ready::ones;
use crate::scope::{Claim, Slot};
use crate::sync::{Bell, Shim, Std, Word};
use crossbeam::utils::CachePadded;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most workers of one crew, those of lent threads included.
pub(crate) const LANES_MAX: usize = 64;

/// Bits of [`Crew::frame`]: how many frames are open. Above: which opening this is.
const OPEN: u64 = 0xFFFF;
const OPENING: u64 = OPEN + 1;

/// How a crew is made.
pub(crate) struct CrewSize {
    /// Workers with threads of their own; lanes `1..=own`.
    pub(crate) own: usize,
    /// Lanes above those, for threads that come and go.
    pub(crate) seats: usize,
    /// Longest spin inside a frame.
    pub(crate) spin_ns: u64,
    /// Lanes below that number spin; with more threads than cores the others sleep at once.
    pub(crate) spinners: usize,
}

/// One worker's place.
struct Lane<S: Shim> {
    /// The loop under way on this lane.
    posted: Slot<S>,
    /// [`Crew::news`] before the last look for work. Only this lane's thread uses it.
    seen: AtomicU64,
    /// What `seen` was when this lane last spun in vain.
    tired: AtomicU64,
    bell: S::Bell,
}

/// Who sleeps, or is about to. Whoever clears a mark rings.
struct Asleep<S: Shim> {
    /// Bit `lane - 1` for each worker.
    workers: S::Word,
    leader: S::Word,
}

/// What all lanes share.
///
/// No wake-up is lost because of one word, `news`. The poster publishes, raises `news`, then reads
/// the marks of the sleepers. The sleeper sets its mark, then exchanges `news` for itself if it is
/// what it was before the last look. If the exchange comes first, the poster sees the mark; if it
/// comes later, it fails. Both are read-modify-writes of one word: no fence is needed.
pub(crate) struct Crew<S: Shim = Std> {
    lanes: Box<[CachePadded<Lane<S>>]>,
    /// The run under way.
    run: Slot<S>,
    /// Rises whenever there may be something new to do. The one word idle workers spin on.
    news: CachePadded<S::Word>,
    asleep: CachePadded<Asleep<S>>,
    frame: CachePadded<S::Word>,
    /// Bit `lane - 1` for each seat without a thread.
    vacant: S::Word,
    /// Bits of all seats.
    seats: u64,
    /// Bits of all lanes that spin.
    spinners: u64,
    stop: S::Word,
    spin_ns: u64,
    chaos: Option<Chaos>,
}

/// A loop whose owner wakes sleepers only once it has seen how long chunks last. Those awake have
/// come by then: waking for a loop of a few microseconds costs more than the loop.
pub(crate) struct Call<'c, S: Shim = Std> {
    crew: &'c Crew<S>,
    /// When the loop began; `None` when there is nobody to wake any more.
    begin_ns: Option<u64>,
}

impl<S: Shim> Call<'_, S> {
    /// To be called between chunks, while the owner has `done` some and `left` are unclaimed.
    #[inline]
    pub(crate) fn progress(&mut self, done: usize, left: usize) {
        if let Some(begin_ns) = self.begin_ns {
            self.judge(S::now_ns() - begin_ns, done as u64, left);
        }
    }

    /// Wakes sleepers if the chunks left would keep the owner for long. It takes one itself.
    fn judge(&mut self, took_ns: u64, done: u64, left: usize) {
        if left > 1 && took_ns.saturating_mul(left as u64) >= S::WORTH_NS * done {
            self.begin_ns = None;
            self.crew.wake_any(left - 1);
        }
    }
}

/// Bits of lanes `1..=count`.
fn first_bits(count: usize) -> u64 {
    if count < 64 { (1 << count) - 1 } else { u64::MAX }
}

fn bit(lane: usize) -> u64 {
    1 << (lane - 1)
}

impl<S: Shim> Crew<S> {
    pub(crate) fn new(size: &CrewSize, chaos: Option<Chaos>) -> Self {
        let count = size.own + size.seats;
        debug_assert!(count <= LANES_MAX);
        let lane = |_| Lane {
            posted: Slot::new(),
            seen: AtomicU64::new(0),
            tired: AtomicU64::new(u64::MAX),
            bell: Bell::new(),
        };
        let seats = first_bits(count) & !first_bits(size.own);
        Crew {
            lanes: (0..=count).map(lane).map(CachePadded::new).collect(),
            run: Slot::new(),
            news: CachePadded::new(S::Word::new(0)),
            asleep: CachePadded::new(Asleep { workers: S::Word::new(0), leader: S::Word::new(0) }),
            frame: CachePadded::new(S::Word::new(0)),
            vacant: S::Word::new(seats),
            seats,
            spinners: first_bits(size.spinners.saturating_sub(1)),
            stop: S::Word::new(0),
            spin_ns: size.spin_ns,
            chaos,
        }
    }

    /// Number of lanes beside the caller's.
    #[inline]
    pub(crate) fn count(&self) -> usize {
        self.lanes.len() - 1
    }

    /// Number of lanes for threads that come and go.
    pub(crate) fn seats(&self) -> usize {
        self.seats.count_ones() as usize
    }

    /// The disturbance of the schedule, if one was asked for.
    #[inline]
    pub(crate) fn chaos(&self) -> Option<&Chaos> {
        self.chaos.as_ref()
    }

    /// Takes the crew for a run; `None` while it serves another.
    pub(crate) fn claim_run(&self) -> Option<Claim<'_, S>> {
        self.run.claim()
    }

    /// Joins the run under way, until it is over or has nothing to do for a while; `false` if there
    /// is none.
    pub(crate) fn join_run(&self, lane: usize) -> bool {
        self.run.join(lane)
    }

    /// Takes the lane's slot for a loop; `None` if one is under way.
    pub(crate) fn claim_loop(&self, lane: usize) -> Option<Claim<'_, S>> {
        self.lanes[lane].posted.claim()
    }

    /// Joins the loops of other lanes; `false` if there was none.
    pub(crate) fn join_loop(&self, lane: usize) -> bool {
        let others = self.lanes[lane + 1..].iter().chain(&self.lanes[..lane]);
        let mut joined = false;
        for other in others {
            joined |= other.posted.join(lane);
        }
        joined
    }

    /// Says that up to `jobs` threads could start on something new, and wakes as many sleepers.
    #[inline]
    pub(crate) fn announce(&self, jobs: usize) {
        if jobs > 0 {
            self.raise();
            self.wake_any(jobs);
        }
    }

    fn wake_any(&self, jobs: usize) {
        let woken = usize::from(self.wake_leader());
        if jobs > woken {
            self.wake(u64::MAX, jobs - woken);
        }
    }

    /// Says that up to `jobs` threads could join a loop of the caller's: those awake come, sleepers
    /// are left to the [`Call`].
    pub(crate) fn announce_loop(&self, jobs: usize) -> Call<'_, S> {
        let mut call = Call { crew: self, begin_ns: None };
        if jobs > 0 {
            self.raise();
            match self.chaos {
                Some(_) => self.wake_any(jobs),
                None => call.begin_ns = self.anyone_sleeps().then(S::now_ns),
            }
        }
        call
    }

    /// Whether a worker or the caller sleeps.
    pub(crate) fn anyone_sleeps(&self) -> bool {
        let asleep = &self.asleep;
        let workers = asleep.workers.load(Ordering::Acquire);
        workers | asleep.leader.load(Ordering::Acquire) != 0
    }

    /// Says that there is something for the leader.
    pub(crate) fn call_leader(&self) {
        self.raise();
        self.wake_leader();
    }

    /// Says that the run is over: frees those who spin and wakes the caller if it sleeps.
    pub(crate) fn announce_end(&self) {
        self.call_leader();
    }

    fn raise(&self) {
        // AcqRel: publishes what is new, and sees the marks of those who slept before.
        self.news.fetch_add(1, Ordering::AcqRel);
    }

    fn wake_leader(&self) -> bool {
        let asleep = &self.asleep.leader;
        let woken = asleep.load(Ordering::Acquire) != 0 && asleep.replace(1, 0).is_ok();
        if woken {
            self.lanes[0].bell.ring();
        }
        woken
    }

    /// Wakes up to `count` workers of `lanes`, the lowest first.
    fn wake(&self, lanes: u64, count: usize) {
        let asleep = self.asleep.workers.load(Ordering::Acquire) & lanes;
        let mut count = count;
        for index in ones(asleep) {
            if count == 0 {
                return;
            }
            let bit = 1 << index;
            if self.asleep.workers.fetch_and(!bit, Ordering::AcqRel) & bit != 0 {
                self.lanes[index + 1].bell.ring();
                count -= 1;
            }
        }
    }

    /// To be called before looking for work: what is posted from now on counts as news.
    #[inline]
    pub(crate) fn look(&self, lane: usize) {
        self.lanes[lane].seen.store(self.news.load(Ordering::Acquire), Ordering::Relaxed);
    }

    /// Whether nothing has happened since [`Crew::look`].
    fn is_quiet(&self, lane: usize) -> bool {
        self.news.load(Ordering::Acquire) == self.lanes[lane].seen.load(Ordering::Relaxed)
    }

    /// Whether this lane has spun in vain since [`Crew::look`].
    fn is_tired(&self, lane: usize) -> bool {
        let at = &self.lanes[lane];
        at.tired.load(Ordering::Relaxed) == at.seen.load(Ordering::Relaxed)
    }

    /// Spins until there is news since [`Crew::look`]; `false` if that took too long.
    pub(crate) fn spin(&self, lane: usize) -> bool {
        let spins = lane == 0 || self.spinners & bit(lane) != 0;
        let news = S::spin_until(if spins { self.spin_ns } else { 0 }, || !self.is_quiet(lane));
        if !news {
            let at = &self.lanes[lane];
            at.tired.store(at.seen.load(Ordering::Relaxed), Ordering::Relaxed);
        }
        news
    }

    /// Sleeps until it is woken; returns at once if there is news since [`Crew::look`].
    pub(crate) fn sleep(&self, lane: usize) {
        let at = &self.lanes[lane];
        let (marks, mark) = match lane {
            0 => (&self.asleep.leader, 1),
            _ => (&self.asleep.workers, bit(lane)),
        };
        marks.fetch_or(mark, Ordering::AcqRel);
        let seen = at.seen.load(Ordering::Relaxed);
        if self.news.replace(seen, seen).is_ok() {
            while marks.load(Ordering::Acquire) & mark != 0 {
                at.bell.wait();
            }
        } else {
            // A waker that was faster rings; the next wait takes that for an old ring.
            marks.fetch_and(!mark, Ordering::AcqRel);
        }
    }

    /// Opens a frame: from now on idle workers spin. Wakes those who would if `wake`. Returns
    /// whether it is the only one open.
    pub(crate) fn open_frame(&self, wake: bool) -> bool {
        let mut frame = self.frame.load(Ordering::Relaxed);
        loop {
            let opening = if frame & OPEN == 0 { OPENING } else { 0 };
            match self.frame.replace(frame, frame + opening + 1) {
                Ok(_) => break,
                Err(now) => frame = now,
            }
        }
        let first = frame & OPEN == 0;
        if first && wake {
            self.raise();
            self.wake(self.spinners & !self.seats, LANES_MAX);
        }
        first
    }

    /// Closes a frame: when it was the last open one, workers go to sleep and lent threads leave.
    /// Returns whether it was.
    pub(crate) fn close_frame(&self) -> bool {
        let last = self.frame.fetch_sub(1, Ordering::AcqRel) & OPEN == 1;
        if last {
            self.raise();
            self.wake(self.seats, LANES_MAX);
        }
        last
    }

    /// The opening under way, or `None` between frames.
    pub(crate) fn opening(&self) -> Option<u64> {
        let frame = self.frame.load(Ordering::Acquire);
        (frame & OPEN != 0).then_some(frame / OPENING)
    }

    /// Ends all workers.
    pub(crate) fn stop(&self) {
        self.stop.store(1, Ordering::Release);
        self.raise();
        self.wake(u64::MAX, LANES_MAX);
    }

    /// The life of a worker: until the crew stops.
    pub(crate) fn serve(&self, lane: usize) {
        self.work_while(lane, || true, || self.opening().is_some());
    }

    /// The visit of a lent thread: until the frame of that opening closes. `false` if it is over
    /// already, or if all seats are taken.
    pub(crate) fn visit(&self, opening: u64) -> bool {
        let here = || self.opening() == Some(opening);
        if !here() {
            return false;
        }
        let Some(lane) = self.sit_down() else { return false };
        self.work_while(lane, here, here);
        self.vacant.fetch_or(bit(lane), Ordering::AcqRel);
        true
    }

    fn sit_down(&self) -> Option<usize> {
        let mut vacant = self.vacant.load(Ordering::Relaxed);
        while vacant != 0 {
            let lowest = vacant & vacant.wrapping_neg();
            match self.vacant.replace(vacant, vacant & !lowest) {
                Ok(_) => return Some(lowest.trailing_zeros() as usize + 1),
                Err(now) => vacant = now,
            }
        }
        None
    }

    fn work_while(&self, lane: usize, stays: impl Fn() -> bool, spins: impl Fn() -> bool) {
        loop {
            self.look(lane);
            if self.stop.load(Ordering::Acquire) != 0 || !stays() {
                return;
            }
            self.join_run(lane);
            // Inside the run it looked again, and may have spun in vain: then the sleep starts from
            // that last look.
            let spins = !self.is_tired(lane) && spins();
            if !self.is_quiet(lane) || spins && self.spin(lane) {
                continue;
            }
            self.sleep(lane);
        }
    }
}

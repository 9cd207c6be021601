//! Work that lives on one thread's stack and that others join: the only unsafe code of the crate.
//!
//! In:    a job (a closure borrowed by its owner), or slices to be cut into chunks.
//! Out:   the job run by whoever takes a ticket; each chunk handed out once.
//! Keeps: a [`Slot`] outlives its jobs; nothing of a job remains when [`Claim::open`] returns.
//! Not here: who wakes whom (`workers`), panics and times (`team`).

use crate::sync::{Bell, Pointer, Shim, Std, Word};
use crossbeam::utils::CachePadded;
use std::marker::PhantomData;
use std::ops::Range;
use std::slice;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bits of [`Slot::state`]: how many threads run the job besides its owner.
const INSIDE: u64 = 0xFFFF;
/// The owner sleeps; the last one inside rings.
const OWNER_SLEEPS: u64 = 1 << 16;
/// The slot has an owner.
const CLAIMED: u64 = 1 << 17;
/// One ticket: the right of one thread to enter. The upper half of the state counts them.
const TICKET: u64 = 1 << 32;

/// How long an owner spins for those inside before it sleeps: they are busy with their last chunk,
/// or see the end of the run and leave.
const CLOSE_SPIN_NS: u64 = 100_000;

/// A place where one job at a time is posted for others to join.
///
/// Tickets are a count here and not entries of a queue: withdrawing those that nobody took is one
/// store instead of a search, and a thread that is descheduled between taking and starting a
/// ticket cannot exist.
pub(crate) struct Slot<S: Shim = Std> {
    state: CachePadded<S::Word>,
    /// Points to a `&dyn Fn(usize) + Sync` on the owner's stack. Meaningful only to those inside.
    job: S::Pointer,
    bell: S::Bell,
}

impl<S: Shim> Slot<S> {
    /// A slot without an owner.
    pub(crate) fn new() -> Self {
        Slot { state: CachePadded::new(S::Word::new(0)), job: Pointer::new(), bell: Bell::new() }
    }

    /// Makes the calling thread the slot's owner; `None` while there is another.
    pub(crate) fn claim(&self) -> Option<Claim<'_, S>> {
        // Lazily: a claim that was never won must not exist, for its drop frees the slot.
        self.state.replace(0, CLAIMED).is_ok().then(|| Claim { slot: self })
    }

    /// Takes a ticket and runs the posted job as worker `lane`; `false` if there is no ticket.
    pub(crate) fn join(&self, lane: usize) -> bool {
        let mut state = self.state.load(Ordering::Relaxed);
        loop {
            if state < TICKET {
                return false;
            }
            // It acquires: pairs with the store that opened the slot.
            match self.state.replace(state, state - TICKET + 1) {
                Ok(_) => break,
                Err(now) => state = now,
            }
        }
        let _leave = Leave { slot: self };
        let job = self.job.get().cast_const().cast::<&(dyn Fn(usize) + Sync)>();
        // SAFETY: there was a ticket, so `Claim::open` had stored `job` before, and we count as
        // inside since the exchange, so `open` has not returned and cannot until `_leave` drops:
        // its local, and the closure which that borrows, are alive. The closure is `Sync`.
        unsafe { (*job)(lane) };
        true
    }

    /// Withdraws the tickets and waits until nobody is inside.
    fn close(&self) {
        self.state.fetch_and(TICKET - 1, Ordering::Relaxed);
        // Acquire: pairs with `Leave`, so what the joiners wrote is seen by the owner.
        let empty = || self.state.load(Ordering::Acquire) & INSIDE == 0;
        if !S::spin_until(CLOSE_SPIN_NS, empty) {
            self.state.fetch_or(OWNER_SLEEPS, Ordering::Relaxed);
            while !empty() {
                self.bell.wait();
            }
        }
        self.state.store(0, Ordering::Release);
    }
}

/// Counts a joiner out, also when the job unwinds.
struct Leave<'s, S: Shim> {
    slot: &'s Slot<S>,
}

impl<S: Shim> Drop for Leave<'_, S> {
    fn drop(&mut self) {
        // After this line the job may be gone; the slot is not.
        let before = self.slot.state.fetch_sub(1, Ordering::AcqRel);
        if before & INSIDE == 1 && before & OWNER_SLEEPS != 0 {
            self.slot.bell.ring();
        }
    }
}

/// Ownership of a [`Slot`]; given back when dropped.
pub(crate) struct Claim<'s, S: Shim = Std> {
    slot: &'s Slot<S>,
}

impl<S: Shim> Claim<'_, S> {
    /// Posts `job` for up to `tickets` joiners and meanwhile runs `own` on this thread. Returns, or
    /// unwinds, after the last joiner has left.
    pub(crate) fn open<R>(
        self,
        job: &(dyn Fn(usize) + Sync),
        tickets: u32,
        own: impl FnOnce() -> R,
    ) -> R {
        let job: &(dyn Fn(usize) + Sync) = job;
        // Declared after `job` and so dropped, which closes the slot, before it.
        let close = self;
        close.slot.job.set((&raw const job).cast_mut().cast::<()>());
        close.slot.state.store(CLAIMED + u64::from(tickets) * TICKET, Ordering::Release);
        own()
    }
}

impl<S: Shim> Drop for Claim<'_, S> {
    fn drop(&mut self) {
        self.slot.close();
    }
}

/// Told, between batches, how many numbers this thread has done and how many are left to take.
pub(crate) type Progress<'a> = &'a mut dyn FnMut(usize, usize);

/// Hands out the numbers `0..count`, each once, to any number of threads.
pub(crate) struct Cursor {
    next: CachePadded<AtomicUsize>,
    count: usize,
    shares: usize,
    backwards: bool,
}

impl Cursor {
    /// A cursor over `0..count` for about `shares` threads; from the last to the first, each one
    /// for itself, if `backwards`.
    pub(crate) fn new(count: usize, shares: usize, backwards: bool) -> Cursor {
        let next = CachePadded::new(AtomicUsize::new(0));
        Cursor { next, count, shares: shares.max(1), backwards }
    }

    /// About how many threads share the numbers; at least 1.
    pub(crate) fn shares(&self) -> usize {
        self.shares
    }

    /// Calls `body` with the numbers that other threads leave; `false` if there were none. Between
    /// batches of them calls `progress` with how many it has done and how many are left to take.
    pub(crate) fn drain(&self, progress: Progress<'_>, mut body: impl FnMut(usize)) -> bool {
        let mut done = 0;
        while let Some(range) = self.take() {
            let left = self.count - range.end;
            done += range.len();
            if self.backwards {
                range.for_each(|number| body(self.count - 1 - number));
            } else {
                range.for_each(&mut body);
            }
            progress(done, left);
        }
        done > 0
    }

    /// Ends the handing out: what is left will never be handed out.
    pub(crate) fn stop(&self) {
        self.next.store(self.count, Ordering::Relaxed);
    }

    /// The next numbers: a quarter of a fair share of the rest, so that few exchanges are
    /// contended at the start and the last batches are short. The first one comes alone: it shows
    /// how long they last.
    fn take(&self) -> Option<Range<usize>> {
        let mut first = self.next.load(Ordering::Relaxed);
        loop {
            if first >= self.count {
                return None;
            }
            let part = (self.count - first) / (4 * self.shares);
            let batch = if self.backwards || first == 0 { 1 } else { part.max(1) };
            // Relaxed: the numbers carry no data; the slot orders what the bodies write.
            match self.next.compare_exchange_weak(
                first,
                first + batch,
                Ordering::Relaxed,
                Ordering::Relaxed,
            ) {
                Ok(_) => return Some(first..first + batch),
                Err(now) => first = now,
            }
        }
    }
}

/// Two slices cut at the same multiples of `grain`, each chunk handed out once.
///
/// The chunks are those of `a`; where `b` is shorter its chunks are short or empty.
pub(crate) struct Chunks<'a, A, B> {
    a: Pieces<'a, A>,
    b: Pieces<'a, B>,
    grain: usize,
    cursor: Cursor,
}

impl<'a, A: Send, B: Send> Chunks<'a, A, B> {
    /// Cuts both slices; `grain` is at least 1. `cursor` makes one for a number of chunks.
    pub(crate) fn new(
        a: &'a mut [A],
        b: &'a mut [B],
        grain: usize,
        cursor: impl FnOnce(usize) -> Cursor,
    ) -> Self {
        let cursor = cursor(a.len().div_ceil(grain));
        Chunks { a: Pieces::new(a), b: Pieces::new(b), grain, cursor }
    }

    /// The cursor over the chunks.
    pub(crate) fn cursor(&self) -> &Cursor {
        &self.cursor
    }

    /// Calls `body` with the first index and the elements of the chunks that other threads leave;
    /// `false` if there were none.
    pub(crate) fn drain(
        &self,
        progress: Progress<'_>,
        body: impl Fn(usize, &mut [A], &mut [B]),
    ) -> bool {
        self.cursor.drain(progress, |chunk| {
            let first = chunk * self.grain;
            // SAFETY: the cursor is this value's own, counts once to its end and never back, so
            // each `chunk` comes up in one call only, and chunks of different numbers do not
            // overlap.
            let (a, b) = unsafe { (self.a.at(first, self.grain), self.b.at(first, self.grain)) };
            body(first, a, b);
        })
    }
}

/// A slice whose parts go to different threads.
struct Pieces<'a, T> {
    start: *mut T,
    len: usize,
    borrowed: PhantomData<&'a mut [T]>,
}

// SAFETY: sharing `Pieces` allows no more than `at`, whose callers obtain disjoint `&mut [T]`; for
// those to go to other threads `T: Send` is what is needed.
unsafe impl<T: Send> Sync for Pieces<'_, T> {}

impl<'a, T> Pieces<'a, T> {
    fn new(items: &'a mut [T]) -> Self {
        Pieces { start: items.as_mut_ptr(), len: items.len(), borrowed: PhantomData }
    }

    /// The elements `first..first + len`, as far as there are any.
    ///
    /// # Safety
    /// - No two calls on one `Pieces` may overlap.
    unsafe fn at(&self, first: usize, len: usize) -> &'a mut [T] {
        let first = first.min(self.len);
        let len = len.min(self.len - first);
        // SAFETY: `first + len <= self.len`, so this is inside the slice borrowed for 'a, and by
        // this function's contract it is the only reference to these elements.
        unsafe { slice::from_raw_parts_mut(self.start.add(first), len) }
    }
}

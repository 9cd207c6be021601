//! What the protocols need of threads, so that the same code runs for real and in model checkers.
//!
//! In:    the standard library; in tests loom and shuttle as well.
//! Out:   [`Shim`]: one kind of atomic word, an atomic pointer, a bell, a bounded spin.
//! Keeps: nothing.
//! Not here: the protocols (`scope`, `tickets`, `ready`, `crew`, `walk`).

use crate::spans::now_ns;
use std::hint;
use std::sync::atomic::Ordering;

/// One implementation of atomics and waiting. The protocols never use sequential consistency and
/// no fences: loom does not model the first, thread sanitizers do not see the second.
pub(crate) trait Shim: Sized + 'static {
    /// All counters, masks and flags.
    type Word: Word;
    /// Where a posted job is.
    type Pointer: Pointer;
    /// How a thread sleeps.
    type Bell: Bell;

    /// What there is to do must last that long to be worth waking somebody: a wake-up takes 50 to
    /// 90 µs, and the system may put whoever wakes on the core of the waker.
    const WORTH_NS: u64;

    /// A clock that only compares; model checkers have one that stands still.
    fn now_ns() -> u64;

    /// Spins until `done`, for at most `budget_ns`; what `done` said last.
    fn spin_until(budget_ns: u64, done: impl Fn() -> bool) -> bool;
}

/// An atomic `u64`.
pub(crate) trait Word: Send + Sync {
    fn new(value: u64) -> Self;
    fn load(&self, order: Ordering) -> u64;
    fn store(&self, value: u64, order: Ordering);
    fn fetch_add(&self, value: u64, order: Ordering) -> u64;
    fn fetch_sub(&self, value: u64, order: Ordering) -> u64;
    fn fetch_and(&self, value: u64, order: Ordering) -> u64;
    fn fetch_or(&self, value: u64, order: Ordering) -> u64;

    /// Exchanges, with acquire and release, if the value is `current`; else returns the value.
    fn replace(&self, current: u64, new: u64) -> Result<u64, u64>;
}

/// An atomic pointer, always relaxed: a word beside it orders its uses.
pub(crate) trait Pointer: Send + Sync {
    fn new() -> Self;
    fn get(&self) -> *mut ();
    fn set(&self, to: *mut ());
}

/// Wakes one thread. Rings add up to one. A wait may return early, from an old ring: callers wait
/// in a loop over their condition.
///
/// A lock of the standard library and not of `parking_lot`, which allocates when a thread first
/// blocks, and not `thread::park`, whose token the host's own code on this thread may wait for.
pub(crate) trait Bell: Send + Sync {
    fn new() -> Self;
    /// Lets the waiting thread, or the next one to wait, go on.
    fn ring(&self);
    /// Sleeps until the bell is rung, and takes the ring away.
    fn wait(&self);
}

/// Implements the shim's traits for a crate that has the modules of the standard library.
macro_rules! shim {
    ($shim:ident, $root:ident) => {
        const _: () = {
            use std::sync::PoisonError;
            use $crate::sync::{Bell, Pointer, Word};
            use $root::sync::atomic::{AtomicPtr, AtomicU64, Ordering};
            use $root::sync::{Condvar, Mutex};

            impl Word for AtomicU64 {
                #[inline]
                fn new(value: u64) -> Self {
                    AtomicU64::new(value)
                }
                #[inline]
                fn load(&self, order: Ordering) -> u64 {
                    self.load(order)
                }
                #[inline]
                fn store(&self, value: u64, order: Ordering) {
                    self.store(value, order);
                }
                #[inline]
                fn fetch_add(&self, value: u64, order: Ordering) -> u64 {
                    self.fetch_add(value, order)
                }
                #[inline]
                fn fetch_sub(&self, value: u64, order: Ordering) -> u64 {
                    self.fetch_sub(value, order)
                }
                #[inline]
                fn fetch_and(&self, value: u64, order: Ordering) -> u64 {
                    self.fetch_and(value, order)
                }
                #[inline]
                fn fetch_or(&self, value: u64, order: Ordering) -> u64 {
                    self.fetch_or(value, order)
                }
                #[inline]
                fn replace(&self, current: u64, new: u64) -> Result<u64, u64> {
                    self.compare_exchange(current, new, Ordering::AcqRel, Ordering::Acquire)
                }
            }

            impl Pointer for AtomicPtr<()> {
                fn new() -> Self {
                    AtomicPtr::new(std::ptr::null_mut())
                }
                fn get(&self) -> *mut () {
                    self.load(Ordering::Relaxed)
                }
                fn set(&self, to: *mut ()) {
                    self.store(to, Ordering::Relaxed);
                }
            }

            impl Bell for (Mutex<bool>, Condvar) {
                fn new() -> Self {
                    (Mutex::new(false), Condvar::new())
                }
                fn ring(&self) {
                    *self.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
                    self.1.notify_one();
                }
                fn wait(&self) {
                    let mut rung = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                    while !*rung {
                        rung = self.1.wait(rung).unwrap_or_else(PoisonError::into_inner);
                    }
                    *rung = false;
                }
            }

            impl $crate::sync::Shim for $shim {
                type Word = AtomicU64;
                type Pointer = AtomicPtr<()>;
                type Bell = (Mutex<bool>, Condvar);
                const WORTH_NS: u64 = $shim::WORTH_WAKING_NS;

                fn now_ns() -> u64 {
                    $shim::clock_ns()
                }

                fn spin_until(budget_ns: u64, done: impl Fn() -> bool) -> bool {
                    $shim::spin(budget_ns, done)
                }
            }
        };
    };
}
#[cfg(test)]
pub(crate) use shim;

/// The standard library.
pub(crate) struct Std;

shim!(Std, std);

/// Polls between two looks at the clock.
const POLLS: u32 = 32;

impl Std {
    const WORTH_WAKING_NS: u64 = 30_000;

    fn clock_ns() -> u64 {
        now_ns()
    }

    /// Pauses and polls; looks at the clock now and then. Never yields: a yield under a busy host
    /// thread gives away a whole slice of the scheduler, and parking does that better.
    fn spin(budget_ns: u64, done: impl Fn() -> bool) -> bool {
        if done() {
            return true;
        }
        if budget_ns == 0 {
            return false;
        }
        let start_ns = now_ns();
        let poll = |_| {
            hint::spin_loop();
            done()
        };
        while !(0..POLLS).any(poll) {
            if now_ns() - start_ns >= budget_ns {
                return false;
            }
        }
        true
    }
}

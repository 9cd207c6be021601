//! Work that is shared among threads.
//!
//! In:    how many pieces of work, how many threads.
//! Out:   what came of each piece, in their order, whichever thread did it.
//! Keeps: nothing.
//! Not here: what the work is.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Does so many pieces of work on so many threads, the caller's included.
pub fn share<T: Send>(count: usize, threads: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let (done, next) = (Mutex::new(Vec::with_capacity(count)), AtomicUsize::new(0));
    let each = || {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if at >= count {
                return;
            }
            let found = work(at);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((at, found));
        }
    };
    std::thread::scope(|scope| {
        (1..threads.min(count)).for_each(|_| drop(scope.spawn(each)));
        each();
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_unstable_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, found)| found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_done_once_and_in_its_place() {
        for threads in [0, 1, 2, 5] {
            let squares = share(100, threads, |at| at * at);
            assert_eq!(squares, (0..100).map(|at| at * at).collect::<Vec<_>>());
            assert!(share(0, threads, |at| at).is_empty());
        }
    }
}

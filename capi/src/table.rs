//! Handles: numbers that name what C holds, and are checked at each use.
//!
//! In:    values that C may name; handles that may be anything.
//! Out:   the value for as long as a call lasts, or that the handle is stale.
//! Keeps: [`Table`]: a fixed number of places, each empty or with one value and its handle.
//! Not here: which kinds there are (`terrain`, `ground`).
//!
//! A handle is kind, serial number and place in 64 bits. No serial number comes twice, so that a
//! handle never names the next one's value. Looking one up takes no lock and, but for a thread's
//! first time, no memory; who takes a value out does not wait for those who still use it.

use crate::status::{Fault, OVF_FULL, OVF_STALE};
use arc_swap::{ArcSwapOption, Guard};
use parking_lot::Mutex;
use std::ops::Deref;
use std::sync::Arc;

/// Bits of a handle that are its place.
const PLACE_BITS: u32 = 12;
/// Bits of a handle that are its serial number: a million a second last for eight years.
const SERIAL_BITS: u32 = 48;

/// Values of one kind that C holds, at most `PLACES`.
pub struct Table<T: 'static, const PLACES: usize> {
    /// 1 to 15, so that no handle is 0.
    kind: u64,
    name: &'static str,
    places: [ArcSwapOption<Named<T>>; PLACES],
    free: Mutex<Free>,
}

struct Named<T> {
    handle: u64,
    value: T,
}

/// Places that are empty: those given back, and all from `unused` on.
struct Free {
    given_back: Vec<usize>,
    unused: usize,
    serial: u64,
}

/// A value that is in use: it stays until this is dropped.
pub struct Held<T>(Arc<Named<T>>);

impl<T> Deref for Held<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.value
    }
}

/// As [`Held`], for short calls: counts nothing that other threads count.
pub struct Lent<T>(Guard<Option<Arc<Named<T>>>>);

impl<T> Deref for Lent<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.as_ref().expect("an empty place was lent to nobody").value
    }
}

impl<T, const PLACES: usize> Table<T, PLACES> {
    /// An empty one, of the kind `kind`, 1 to 15, called `name`.
    pub const fn new(kind: u64, name: &'static str) -> Self {
        assert!(PLACES <= 1 << PLACE_BITS && 0 < kind && kind < 16);
        Self {
            kind,
            name,
            places: [const { ArcSwapOption::const_empty() }; PLACES],
            free: Mutex::new(Free { given_back: Vec::new(), unused: 0, serial: 0 }),
        }
    }

    /// Takes a value in; its handle comes back.
    pub fn insert(&self, value: T) -> Result<u64, Fault> {
        let (place, serial) = {
            let mut free = self.free.lock();
            let place = free.given_back.pop().or_else(|| {
                let place = Some(free.unused).filter(|&place| place < PLACES);
                free.unused += usize::from(place.is_some());
                place
            });
            let Some(place) = place else {
                let name = self.name;
                let sentence =
                    format!("{PLACES} {name}s are open, allowed are no more: destroy some");
                return Err(Fault::new(OVF_FULL, sentence));
            };
            free.serial += 1;
            (place, free.serial)
        };
        let handle = self.kind << (PLACE_BITS + SERIAL_BITS) | serial << PLACE_BITS | place as u64;
        self.places[place].store(Some(Arc::new(Named { handle, value })));
        Ok(handle)
    }

    /// The value of a handle, for a short call.
    pub fn lend(&self, handle: u64) -> Result<Lent<T>, Fault> {
        let found = self.place(handle).map(ArcSwapOption::load);
        found
            .filter(|found| found.as_ref().is_some_and(|named| named.handle == handle))
            .map(Lent)
            .ok_or_else(|| self.stale(handle))
    }

    /// The value of a handle, for a call that may last.
    pub fn hold(&self, handle: u64) -> Result<Held<T>, Fault> {
        let found = self.place(handle).and_then(ArcSwapOption::load_full);
        found.filter(|named| named.handle == handle).map(Held).ok_or_else(|| self.stale(handle))
    }

    /// Takes a value out. It goes when the last call that uses it ends.
    pub fn remove(&self, handle: u64) -> Result<(), Fault> {
        let lent = self.lend(handle)?;
        let place = self.place(handle).expect("it was found there");
        let before = place.compare_and_swap(&*lent.0, None);
        let won = before.as_ref().is_some_and(|named| named.handle == handle);
        if !won {
            return Err(self.stale(handle));
        }
        self.free.lock().given_back.push(index_of(handle));
        Ok(())
    }

    fn place(&self, handle: u64) -> Option<&ArcSwapOption<Named<T>>> {
        self.places.get(index_of(handle))
    }

    fn stale(&self, handle: u64) -> Fault {
        let name = self.name;
        let sentence = match handle >> (PLACE_BITS + SERIAL_BITS) {
            _ if handle == 0 => format!("the {name}'s handle is 0, which names none"),
            kind if kind == self.kind => {
                format!("the {name} {handle:#x} is not there: it was destroyed, or never was")
            }
            _ => format!("{handle:#x} is not the handle of a {name}"),
        };
        Fault::new(OVF_STALE, sentence)
    }
}

fn index_of(handle: u64) -> usize {
    usize::try_from(handle & ((1 << PLACE_BITS) - 1)).expect("12 bits fit")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn handles_are_told_apart_and_never_come_twice() {
        let table = Table::<u32, 2>::new(3, "thing");
        let (a, b) = (table.insert(1).unwrap(), table.insert(2).unwrap());
        let full = table.insert(3).unwrap_err();
        assert_eq!(full.status, OVF_FULL);
        assert_eq!((*table.lend(a).unwrap(), *table.hold(b).unwrap()), (1, 2));
        table.remove(a).unwrap();
        let c = table.insert(3).unwrap();
        assert_ne!(a, c);
        for stale in [a, 0, u64::MAX, 1, c ^ 1 << 20, c ^ 1 << 60, c ^ 1] {
            let fault = table.lend(stale).err().unwrap_or_else(|| panic!("{stale:#x}"));
            assert_eq!(fault.status, OVF_STALE, "{}", fault.sentence);
            assert!(table.hold(stale).is_err() && table.remove(stale).is_err());
        }
        assert_eq!(*table.lend(c).unwrap(), 3);
    }

    #[test]
    fn a_value_in_use_outlives_its_handle_and_goes_once() {
        struct Counts(Arc<AtomicU64>);
        impl Drop for Counts {
            fn drop(&mut self) {
                self.0.fetch_add(1, Ordering::Relaxed);
            }
        }
        let dropped = Arc::new(AtomicU64::new(0));
        let table = Table::<Counts, 1>::new(1, "thing");
        let handle = table.insert(Counts(dropped.clone())).unwrap();
        let held = table.hold(handle).unwrap();
        table.remove(handle).unwrap();
        assert!(table.lend(handle).is_err());
        assert_eq!(dropped.load(Ordering::Relaxed), 0);
        drop(held);
        assert_eq!(dropped.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn threads_that_destroy_one_handle_succeed_once_in_all() {
        let table = Table::<u64, 8>::new(1, "thing");
        for round in 0..500 {
            let handle = table.insert(round).unwrap();
            let removed = AtomicU64::new(0);
            let remove = || {
                assert!(table.lend(handle).map_or(true, |value| *value == round));
                removed.fetch_add(u64::from(table.remove(handle).is_ok()), Ordering::Relaxed);
            };
            std::thread::scope(|scope| (0..2).for_each(|_| drop(scope.spawn(remove))));
            assert_eq!(removed.into_inner(), 1);
        }
    }
}

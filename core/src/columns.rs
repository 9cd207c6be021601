//! Typed indices and the columns that they index: the only container of terrain state.
//!
//! In:    capacities, fixed at start-up.
//! Out:   [`Id`], [`Column`], [`Pool`].
//! Keeps: nothing of its own.
//! Not here: what the columns mean.

use core::fmt;
use core::marker::PhantomData;
use core::num::NonZeroU32;
use core::ops::{Index, IndexMut};

/// Index of one `T` in the pool of all `T`s. Four bytes, also inside `Option`.
pub struct Id<T> {
    one_based: NonZeroU32,
    tag: PhantomData<fn() -> T>,
}

const _: () = assert!(size_of::<Option<Id<()>>>() == 4);

impl<T> Id<T> {
    /// The id of the `index`-th place.
    pub fn new(index: u32) -> Self {
        let one_based = NonZeroU32::new(index + 1).expect("an index is below u32::MAX");
        Self { one_based, tag: PhantomData }
    }

    /// Its place, counted from 0.
    pub fn index(self) -> u32 {
        self.one_based.get() - 1
    }
}

impl<T> Clone for Id<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Id<T> {}
impl<T> PartialEq for Id<T> {
    fn eq(&self, other: &Self) -> bool {
        self.one_based == other.one_based
    }
}
impl<T> Eq for Id<T> {}
impl<T> fmt::Debug for Id<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.index())
    }
}

/// One value for each place of the pool of `T`s.
pub struct Column<T, V> {
    values: Vec<V>,
    tag: PhantomData<fn() -> T>,
}

impl<T, V> Column<T, V> {
    /// A column of `capacity` places, each made by `empty`.
    pub fn new(capacity: u32, empty: impl FnMut() -> V) -> Self {
        let mut values = Vec::new();
        values.resize_with(capacity as usize, empty);
        Self { values, tag: PhantomData }
    }

    /// All places by index, for passes over the whole pool.
    pub fn as_slice(&self) -> &[V] {
        &self.values
    }

    /// All places by index, for passes over the whole pool.
    pub fn as_mut_slice(&mut self) -> &mut [V] {
        &mut self.values
    }
}

impl<T, V> Index<Id<T>> for Column<T, V> {
    type Output = V;
    fn index(&self, id: Id<T>) -> &V {
        &self.values[id.index() as usize]
    }
}

impl<T, V> IndexMut<Id<T>> for Column<T, V> {
    fn index_mut(&mut self, id: Id<T>) -> &mut V {
        &mut self.values[id.index() as usize]
    }
}

/// Which places of a pool are taken: fixed capacity, the place given back last is taken first.
pub struct Pool<T> {
    free: Vec<Id<T>>,
    used_end: u32,
    capacity: u32,
}

impl<T> Pool<T> {
    /// A pool with all places free.
    pub fn new(capacity: u32) -> Self {
        Self { free: Vec::with_capacity(capacity as usize), used_end: 0, capacity }
    }

    /// Takes a place; `None` when all are taken.
    pub fn take(&mut self) -> Option<Id<T>> {
        if let Some(id) = self.free.pop() {
            return Some(id);
        }
        (self.used_end < self.capacity).then(|| {
            self.used_end += 1;
            Id::new(self.used_end - 1)
        })
    }

    /// Gives a taken place back.
    pub fn give_back(&mut self, id: Id<T>) {
        debug_assert!(
            id.index() < self.used_end && !self.free.contains(&id) || self.free.len() > 64
        );
        self.free.push(id);
    }

    /// Places at and beyond this index were never taken.
    pub fn used_end(&self) -> u32 {
        self.used_end
    }

    /// Places taken now.
    pub fn live(&self) -> u32 {
        self.used_end - u32::try_from(self.free.len()).expect("no more free places than places")
    }

    /// Places that can still be taken.
    pub fn room(&self) -> u32 {
        self.capacity - self.live()
    }

    /// The free list, for tests that hold it against the columns.
    pub fn free(&self) -> &[Id<T>] {
        &self.free
    }
}

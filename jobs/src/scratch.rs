//! Memory that a stage needs only while it runs, one block per worker.
//!
//! In:    a size in bytes, fixed when the graph meets the workers.
//! Out:   slices of plain values, all with the value asked for.
//! Keeps: the blocks; what was in them is forgotten between bodies.
//! Not here: outputs (they belong to the context, by stage and chunk, never by worker).

use bytemuck::Pod;
use crossbeam::utils::CachePadded;
use parking_lot::Mutex;
use std::error::Error;
use std::fmt;

/// A request that did not fit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ScratchFull {
    /// What was asked for, in bytes.
    pub asked_bytes: usize,
    /// What was left, in bytes.
    pub left_bytes: usize,
    /// Size of the worker's block, in bytes.
    pub capacity_bytes: usize,
}

impl fmt::Display for ScratchFull {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ScratchFull { asked_bytes, left_bytes, capacity_bytes } = self;
        write!(out, "{asked_bytes} bytes of scratch were asked for, ")?;
        write!(out, "{left_bytes} of {capacity_bytes} are left")
    }
}

impl Error for ScratchFull {}

/// A worker's block while one body runs: a chunk, or a closure given to
/// [`Team::scratch`](crate::Team::scratch).
///
/// Slices live as long as the body; the next body on this worker starts with the whole block.
pub struct Scratch<'a> {
    rest: &'a mut [u8],
    capacity_bytes: usize,
}

impl<'a> Scratch<'a> {
    pub(crate) fn new(block: &'a mut [u128]) -> Scratch<'a> {
        let rest: &mut [u8] = bytemuck::cast_slice_mut(block);
        Scratch { capacity_bytes: rest.len(), rest }
    }

    /// All of it that is left, for one body.
    #[inline]
    pub(crate) fn anew(&mut self) -> Scratch<'_> {
        Scratch { capacity_bytes: self.rest.len(), rest: self.rest }
    }

    /// `len` times `value`.
    ///
    /// # Panics
    /// With the text of [`ScratchFull`] if the block is too small; see
    /// [`Graph::scratch_bytes`](crate::Graph::scratch_bytes).
    pub fn slice<T: Pod>(&mut self, len: usize, value: T) -> &'a mut [T] {
        match self.try_slice(len, value) {
            Ok(slice) => slice,
            Err(full) => panic!("{full}"),
        }
    }

    /// `len` times `value`, or why not.
    ///
    /// # Errors
    /// [`ScratchFull`] if the block is too small; nothing is taken then.
    pub fn try_slice<T: Pod>(&mut self, len: usize, value: T) -> Result<&'a mut [T], ScratchFull> {
        const { assert!(size_of::<T>() > 0, "a slice of nothing needs no memory") };
        let asked_bytes = len.saturating_mul(size_of::<T>());
        let gap = self.rest.as_ptr().align_offset(align_of::<T>());
        let full = ScratchFull {
            asked_bytes,
            left_bytes: self.rest.len().saturating_sub(gap),
            capacity_bytes: self.capacity_bytes,
        };
        if asked_bytes > full.left_bytes {
            return Err(full);
        }
        if asked_bytes == 0 {
            return Ok(&mut []);
        }
        let (_, rest) = std::mem::take(&mut self.rest).split_at_mut(gap);
        let (taken, rest) = rest.split_at_mut(asked_bytes);
        self.rest = rest;
        let slice: &'a mut [T] = bytemuck::cast_slice_mut(taken);
        slice.fill(value);
        Ok(slice)
    }

    /// What is left, in bytes; up to 15 fewer can be had if a slice must be aligned.
    pub fn left_bytes(&self) -> usize {
        self.rest.len()
    }
}

/// The blocks of all workers.
#[derive(Default)]
pub(crate) struct Blocks {
    blocks: Vec<CachePadded<Mutex<Box<[u128]>>>>,
    words: usize,
}

impl Blocks {
    /// Sets the size of each block. Those that exist are dropped.
    pub(crate) fn resize(&mut self, bytes: usize) {
        self.blocks.clear();
        self.words = bytes.div_ceil(size_of::<u128>());
    }

    /// Makes room for `lanes` workers and caller.
    pub(crate) fn begin(&mut self, lanes: usize) {
        while self.blocks.len() < lanes {
            let block = vec![0; self.words].into_boxed_slice();
            self.blocks.push(CachePadded::new(Mutex::new(block)));
        }
    }

    /// Lends the block of a worker to `body`; an empty one while it is lent already.
    pub(crate) fn lend<R>(&self, lane: usize, body: impl FnOnce(&mut [u128]) -> R) -> R {
        match self.blocks[lane].try_lock() {
            Some(mut block) => body(&mut block),
            None => body(&mut []),
        }
    }
}

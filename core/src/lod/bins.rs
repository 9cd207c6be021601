//! Bins of diamonds: unordered bags that share one store, with exact removal in constant time.
//!
//! In:    a bin's number and a diamond; the place of one to be removed.
//! Out:   places; a bin's content when it is drained.
//! Keeps: chunks of 14 ids, a cache line each, chained from every bin's last one.
//! Not here: what a bin means (`wheel`, `urgent`), who sits where (`agenda`).
//!
//! Lists linked through the diamonds would cost a cache miss for each step of a walk; here a walk
//! reads 14 ids at once and the diamonds are then visited independently of each other.

use super::diamonds::{DiamondId, Diamonds, Seat};

/// Ids in one chunk.
const CHUNK: u32 = 14;
/// No chunk.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Chunk {
    /// Those beyond the bin's end are stale.
    ids: [DiamondId; CHUNK as usize],
    /// The chunk before in the same bin, full; in the free list, the next free one.
    previous: u32,
    bin: u32,
}

const _: () = assert!(size_of::<Chunk>() == 64);

/// The last chunk of a bin and how many ids it holds; all before it are full.
#[derive(Clone, Copy)]
struct Tail {
    chunk: u32,
    len: u32,
    /// Ids in the whole bin.
    count: u32,
}

const EMPTY: Tail = Tail { chunk: NONE, len: CHUNK, count: 0 };

/// All bins.
pub struct Bins {
    chunks: Vec<Chunk>,
    tails: Vec<Tail>,
    free: u32,
}

impl Bins {
    /// `bins` empty bins that hold up to `capacity` diamonds together.
    pub fn new(bins: u32, capacity: u32) -> Self {
        // Every bin may end in a chunk with a single id.
        let chunks = capacity / CHUNK + bins.min(capacity);
        Self {
            chunks: Vec::with_capacity(chunks as usize),
            tails: vec![EMPTY; bins as usize],
            free: NONE,
        }
    }

    /// Bytes of the chunks that are or were in use.
    pub fn bytes(&self) -> usize {
        self.chunks.len() * size_of::<Chunk>() + self.tails.len() * size_of::<Tail>()
    }

    /// Whether a bin holds nothing.
    pub fn is_empty(&self, bin: u32) -> bool {
        self.tails[bin as usize].chunk == NONE
    }

    /// Puts a diamond into a bin and writes its seat; whether the bin was empty.
    #[inline]
    pub fn push(&mut self, diamonds: &mut Diamonds, bin: u32, id: DiamondId) -> bool {
        let tail = &mut self.tails[bin as usize];
        let was_empty = tail.chunk == NONE;
        if tail.len < CHUNK {
            self.chunks[tail.chunk as usize].ids[tail.len as usize] = id;
            tail.len += 1;
            tail.count += 1;
        } else {
            let Tail { chunk: previous, count, .. } = *tail;
            let chunk = self.take_chunk((bin, previous), id);
            self.tails[bin as usize] = Tail { chunk, len: 1, count: count + 1 };
        }
        let Tail { chunk, len, .. } = self.tails[bin as usize];
        let record = &mut diamonds[id];
        debug_assert!(record.seat == Seat::None || record.seat == Seat::Bin, "drained or new");
        (record.seat, record.place) = (Seat::Bin, chunk * 16 + len - 1);
        was_empty
    }

    /// Takes a diamond out of its bin; returns the bin. The bin's last fills the gap.
    pub fn remove(&mut self, diamonds: &mut Diamonds, id: DiamondId) -> u32 {
        let record = &mut diamonds[id];
        debug_assert_eq!(record.seat, Seat::Bin);
        let place = record.place;
        record.seat = Seat::None;
        let (chunk, at) = (place / 16, place % 16);
        let bin = self.chunks[chunk as usize].bin;
        let Tail { chunk: tail, len, count } = self.tails[bin as usize];
        let last = self.chunks[tail as usize].ids[len as usize - 1];
        if last != id {
            self.chunks[chunk as usize].ids[at as usize] = last;
            diamonds[last].place = place;
        }
        self.tails[bin as usize] = if len > 1 {
            Tail { chunk: tail, len: len - 1, count: count - 1 }
        } else {
            let previous = self.chunks[tail as usize].previous;
            self.give_chunk_back(tail);
            Tail { chunk: previous, len: CHUNK, count: count - 1 }
        };
        bin
    }

    /// Empties a bin into `out`. The diamonds' seats still say [`Seat::Bin`] until they are given
    /// another: nothing may be removed in between.
    pub fn drain(&mut self, bin: u32, out: &mut Vec<DiamondId>) {
        self.drain_some(bin, u32::MAX, out);
    }

    /// Ids in a bin.
    pub fn count(&self, bin: u32) -> u32 {
        self.tails[bin as usize].count
    }

    /// Takes the last chunks of a bin, `most` ids or a few more, into `out` as [`Self::drain`]
    /// does; whether the bin is empty then.
    pub fn drain_some(&mut self, bin: u32, most: u32, out: &mut Vec<DiamondId>) -> bool {
        let enough = out.len() + most as usize;
        let Tail { mut chunk, mut len, mut count } = self.tails[bin as usize];
        while chunk != NONE && out.len() < enough {
            let Chunk { ids, previous, .. } = &self.chunks[chunk as usize];
            out.extend_from_slice(&ids[..len as usize]);
            let previous = *previous;
            self.give_chunk_back(chunk);
            (chunk, len, count) = (previous, CHUNK, count - len);
        }
        self.tails[bin as usize] = Tail { chunk, len, count };
        chunk == NONE
    }

    /// Loads what removing these diamonds would touch into the cache, all at once.
    pub fn warm(&self, diamonds: &Diamonds, ids: &mut [DiamondId]) {
        let chunk_of = |id: DiamondId| &self.chunks[(diamonds[id].place / 16) as usize];
        core::hint::black_box(ids.iter().fold(0, |sum, &id| sum ^ chunk_of(id).bin));
        let tail_of = |id: DiamondId| self.tails[chunk_of(id).bin as usize];
        core::hint::black_box(ids.iter().fold(0, |sum, &id| sum ^ tail_of(id).len));
        for id in &mut *ids {
            let Tail { chunk, len, .. } = tail_of(*id);
            *id = self.chunks[chunk as usize].ids[len as usize - 1];
        }
        diamonds.warm(ids);
    }

    fn take_chunk(&mut self, (bin, previous): (u32, u32), first: DiamondId) -> u32 {
        let fresh = Chunk { ids: [first; CHUNK as usize], previous, bin };
        if self.free == NONE {
            self.chunks.push(fresh);
            return u32::try_from(self.chunks.len() - 1).expect("chunks are counted in u32");
        }
        let chunk = self.free;
        self.free = self.chunks[chunk as usize].previous;
        self.chunks[chunk as usize] = fresh;
        chunk
    }

    fn give_chunk_back(&mut self, chunk: u32) {
        self.chunks[chunk as usize].previous = self.free;
        self.free = chunk;
    }

    /// Adds the ids of one bin to a list; they stay.
    pub fn list(&self, bin: u32, out: &mut Vec<DiamondId>) {
        let Tail { mut chunk, mut len, .. } = self.tails[bin as usize];
        while chunk != NONE {
            let Chunk { ids, previous, .. } = &self.chunks[chunk as usize];
            out.extend_from_slice(&ids[..len as usize]);
            (chunk, len) = (*previous, CHUNK);
        }
    }

    /// Whether `place` holds `id`, for checks.
    pub fn holds(&self, place: u32, id: DiamondId) -> bool {
        let chunk = self.chunks.get((place / 16) as usize);
        chunk.is_some_and(|chunk| chunk.ids.get((place % 16) as usize) == Some(&id))
    }
}

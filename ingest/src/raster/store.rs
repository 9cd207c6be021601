//! Decoded chunks of all rasters within one budget, and one scratch file for what streams.
//!
//! In:    chunks as they are decoded; rows of formats that can only be read in order.
//! Out:   the same chunks again, shared; the same rows by position.
//! Keeps: at most the budget of decoded bytes, the longest unused dropped first.
//! Not here: decoding (each format).

use super::RasterError;
use super::samples::Samples;
use lru::LruCache;
use parking_lot::Mutex;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Budget of decoded chunks when nothing else is said, in bytes.
pub const CACHE_BYTES: usize = 96 << 20;

/// What a chunk costs beside its samples: keys, links, the allocation itself.
const ENTRY_BYTES: usize = 128;

/// Chunks larger than this are decoded one at a time, whatever raster they are of: memory stays
/// bounded, and threads that need the same one decode it once.
pub(crate) const ALONE_BYTES: usize = 4 << 20;

/// Decoders of TIFF files left open at the same time; each holds a file handle.
const OPEN_DECODERS_MAX: usize = 64;

/// Number of a raster among all that share a store, and of a chunk in it.
type Key = (u64, u64);

/// What all rasters opened with the same options share: decoded chunks and a scratch file.
///
/// The budget covers decoded chunks, those being decoded included. One chunk larger than the
/// budget is allowed and then lives alone; chunks that were dropped while a thread still copies
/// from them live until it has, which adds at most one chunk per thread.
pub struct ChunkStore {
    chunks: Mutex<Chunks>,
    budget_bytes: usize,
    /// Held while a large chunk is decoded.
    alone: Mutex<()>,
    scratch: Mutex<Scratch>,
    rasters: AtomicU64,
    decoders: AtomicUsize,
}

struct Chunks {
    of: LruCache<Key, Arc<Samples>>,
    /// Bytes of `of` and of those being decoded.
    bytes: usize,
}

#[derive(Default)]
struct Scratch {
    /// Unnamed, so that it is gone with the process. `None` until first written.
    file: Option<File>,
    end: u64,
}

impl ChunkStore {
    /// An empty store that keeps at most `budget_bytes` of decoded chunks.
    pub fn new(budget_bytes: usize) -> Arc<Self> {
        Arc::new(Self {
            chunks: Mutex::new(Chunks { of: LruCache::unbounded(), bytes: 0 }),
            budget_bytes,
            alone: Mutex::default(),
            scratch: Mutex::default(),
            rasters: AtomicU64::new(0),
            decoders: AtomicUsize::new(0),
        })
    }

    /// Decoded bytes held now, those being decoded included.
    pub fn bytes(&self) -> usize {
        self.chunks.lock().bytes
    }

    /// A number for one more raster.
    pub(crate) fn register(&self) -> u64 {
        self.rasters.fetch_add(1, Ordering::Relaxed)
    }

    /// The chunk, if it is here.
    pub(crate) fn get(&self, key: Key) -> Option<Arc<Samples>> {
        self.chunks.lock().of.get(&key).cloned()
    }

    /// Decodes a chunk of `bytes` into the store. Nobody waits for it but the caller and, if it
    /// is large, those who need a large one too.
    pub(crate) fn load(
        &self,
        key: Key,
        bytes: usize,
        decode: impl FnOnce() -> Result<Samples, RasterError>,
    ) -> Result<Arc<Samples>, RasterError> {
        let _alone = (bytes > ALONE_BYTES).then(|| self.alone.lock());
        if let Some(samples) = self.get(key) {
            return Ok(samples);
        }
        self.chunks.lock().make_room(bytes, self.budget_bytes);
        let decoded = decode();
        let mut chunks = self.chunks.lock();
        chunks.bytes -= bytes;
        let samples = Arc::new(decoded?);
        let held = samples.bytes() + ENTRY_BYTES;
        chunks.make_room(held, self.budget_bytes);
        if let Some(twin) = chunks.of.put(key, samples.clone()) {
            chunks.bytes -= twin.bytes() + ENTRY_BYTES;
        }
        Ok(samples)
    }

    /// Drops what a raster left behind.
    pub(crate) fn forget(&self, raster: u64) {
        let mut chunks = self.chunks.lock();
        let gone: Vec<Key> =
            chunks.of.iter().map(|(&key, _)| key).filter(|key| key.0 == raster).collect();
        for key in gone {
            let samples = chunks.of.pop(&key).expect("listed under the same lock");
            chunks.bytes -= samples.bytes() + ENTRY_BYTES;
        }
    }

    /// Whether one more decoder may stay open.
    pub(crate) fn keep_decoder(&self) -> bool {
        let open = self.decoders.fetch_add(1, Ordering::Relaxed);
        if open >= OPEN_DECODERS_MAX {
            self.drop_decoders(1);
        }
        open < OPEN_DECODERS_MAX
    }

    /// That many kept decoders were closed.
    pub(crate) fn drop_decoders(&self, count: usize) {
        self.decoders.fetch_sub(count, Ordering::Relaxed);
    }

    /// Sets `bytes` of the scratch file aside and returns where they begin.
    pub(crate) fn reserve_scratch(&self, bytes: u64) -> io::Result<u64> {
        let mut scratch = self.scratch.lock();
        if scratch.file.is_none() {
            scratch.file = Some(tempfile::tempfile()?);
        }
        let start = scratch.end;
        scratch.end = start.saturating_add(bytes);
        Ok(start)
    }

    /// Writes to the scratch file.
    pub(crate) fn write_scratch(&self, at: u64, bytes: &[u8]) -> io::Result<()> {
        self.with_scratch(at, |file| file.write_all(bytes))
    }

    /// Reads from the scratch file.
    pub(crate) fn read_scratch(&self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        self.with_scratch(at, |file| file.read_exact(bytes))
    }

    fn with_scratch(
        &self,
        at: u64,
        work: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut scratch = self.scratch.lock();
        let file = scratch.file.as_mut().ok_or(io::ErrorKind::NotFound)?;
        file.seek(SeekFrom::Start(at))?;
        work(file)
    }
}

impl Chunks {
    /// Takes `bytes` of the budget, and drops the longest unused until they fit.
    fn make_room(&mut self, bytes: usize, budget_bytes: usize) {
        self.bytes += bytes;
        while self.bytes > budget_bytes {
            let Some((_, oldest)) = self.of.pop_lru() else { return };
            self.bytes -= oldest.bytes() + ENTRY_BYTES;
        }
    }
}

impl std::fmt::Debug for ChunkStore {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.debug_struct("ChunkStore").field("budget_bytes", &self.budget_bytes).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(bytes: usize) -> Result<Samples, RasterError> {
        Ok(Samples::U8(vec![7; bytes]))
    }

    #[test]
    fn the_budget_holds_and_the_longest_unused_goes_first() {
        let store = ChunkStore::new(4000);
        for number in 0..3 {
            store.load((0, number), 1000, || chunk(1000)).unwrap();
        }
        assert!(store.get((0, 0)).is_some());
        store.load((0, 3), 1000, || chunk(1000)).unwrap();
        assert!(store.bytes() <= 4000, "{}", store.bytes());
        assert!(store.get((0, 1)).is_none(), "the longest unused stayed");
        assert!(store.get((0, 0)).is_some(), "the one just used went");
    }

    #[test]
    fn a_failed_chunk_costs_nothing_and_a_huge_one_lives_alone() {
        let store = ChunkStore::new(4000);
        let fail = || Err(RasterError::WindowTooLarge { width: 1, height: 1 });
        assert!(store.load((0, 0), 3000, fail).is_err());
        assert_eq!(store.bytes(), 0);
        store.load((0, 1), 1000, || chunk(1000)).unwrap();
        store.load((0, 2), 9000, || chunk(9000)).unwrap();
        assert!(store.get((0, 1)).is_none());
        store.load((0, 3), 1000, || chunk(1000)).unwrap();
        assert!(store.bytes() <= 4000, "{}", store.bytes());
        store.forget(0);
        assert_eq!(store.bytes(), 0);
    }

    #[test]
    fn a_large_chunk_that_several_threads_need_is_decoded_once() {
        let store = ChunkStore::new(4000);
        let decoded = AtomicUsize::new(0);
        let decode = || {
            decoded.fetch_add(1, Ordering::Relaxed);
            chunk(1000)
        };
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| store.load((0, 0), ALONE_BYTES + 1, decode).unwrap());
            }
        });
        assert_eq!(decoded.into_inner(), 1);
    }

    #[test]
    fn scratch_ranges_do_not_overlap() {
        let store = ChunkStore::new(0);
        let first = store.reserve_scratch(4).unwrap();
        let second = store.reserve_scratch(4).unwrap();
        store.write_scratch(second, b"efgh").unwrap();
        store.write_scratch(first, b"abcd").unwrap();
        let mut back = [0; 8];
        store.read_scratch(0, &mut back).unwrap();
        assert_eq!(&back, b"abcdefgh");
        assert!(store.read_scratch(6, &mut back).is_err());
    }
}

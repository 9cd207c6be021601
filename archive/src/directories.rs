//! Directories that were read, up to a number of bytes: planets have more than fit.
//!
//! In:    directories from the `pmtiles` crate, by offset.
//! Out:   the entry of a tile.
//! Keeps: the directories used last, 64 MiB.
//! Not here: the root directory, which the crate keeps.

use parking_lot::Mutex;
use pmtiles::{DirEntry, Directory, DirectoryCache, PmtResult, TileId};
use std::collections::BTreeMap;
use std::sync::Arc;

const BYTES_MAX: usize = 64 << 20;

/// The cache of one archive.
#[derive(Default)]
pub(crate) struct Directories(Mutex<Kept>);

#[derive(Default)]
struct Kept {
    by_offset: BTreeMap<u64, Slot>,
    bytes: usize,
    uses: u64,
}

struct Slot {
    directory: Arc<Directory>,
    last_use: u64,
}

impl Kept {
    fn get(&mut self, offset: u64) -> Option<Arc<Directory>> {
        self.uses += 1;
        let slot = self.by_offset.get_mut(&offset)?;
        slot.last_use = self.uses;
        Some(slot.directory.clone())
    }

    fn put(&mut self, offset: u64, directory: Arc<Directory>, bytes_max: usize) {
        self.bytes += directory.get_approx_byte_size();
        let slot = Slot { directory, last_use: self.uses };
        if let Some(before) = self.by_offset.insert(offset, slot) {
            self.bytes -= before.directory.get_approx_byte_size();
        }
        while self.bytes > bytes_max {
            let oldest = self.by_offset.iter().min_by_key(|(_, slot)| slot.last_use);
            let Some(oldest) = oldest.map(|(&offset, _)| offset) else { break };
            let slot = self.by_offset.remove(&oldest).expect("it was just found");
            self.bytes -= slot.directory.get_approx_byte_size();
        }
    }
}

impl DirectoryCache for Directories {
    async fn get_dir_entry_or_insert(
        &self,
        offset: u64,
        tile_id: TileId,
        fetcher: impl Future<Output = PmtResult<Directory>> + Send,
    ) -> PmtResult<Option<DirEntry>> {
        // Read without the lock: a slow server must not hold up who finds theirs here.
        let kept = self.0.lock().get(offset);
        let directory = match kept {
            Some(directory) => directory,
            None => {
                let directory = Arc::new(fetcher.await?);
                self.0.lock().put(offset, directory.clone(), BYTES_MAX);
                directory
            }
        };
        Ok(directory.find_tile_id(tile_id).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;

    /// A directory of `count` entries: counts, id steps, run lengths, lengths, offsets plus one.
    fn directory(count: u8) -> Arc<Directory> {
        let mut bytes = vec![count];
        (0..4).for_each(|_| bytes.extend(vec![1; usize::from(count)]));
        Arc::new(Directory::try_from(Bytes::from(bytes)).unwrap())
    }

    #[test]
    fn the_directory_not_used_for_longest_goes_first() {
        let mut kept = Kept::default();
        let each = directory(100).get_approx_byte_size();
        for offset in 0..3 {
            kept.put(offset, directory(100), 3 * each);
            assert!(kept.get(offset).is_some());
        }
        assert!(kept.get(0).is_some());
        kept.put(3, directory(100), 3 * each);
        let present: Vec<u64> = kept.by_offset.keys().copied().collect();
        assert_eq!(present, [0, 2, 3]);
        kept.put(3, directory(50), 3 * each);
        assert_eq!(kept.bytes, 2 * each + directory(50).get_approx_byte_size());
    }

    #[test]
    fn a_directory_larger_than_the_limit_is_not_kept() {
        let mut kept = Kept::default();
        kept.put(0, directory(100), 100);
        assert!(kept.get(0).is_none());
        assert_eq!(kept.bytes, 0);
    }
}

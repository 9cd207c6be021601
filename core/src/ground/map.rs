//! Resident pages by key: 256 shards of open addressing, shared between snapshots until changed.
//!
//! In:    pages that come and go.
//! Out:   a page by its key.
//! Keeps: the shards. A clone shares them; a change copies the shard that it touches.
//! Not here: what is done with pages.

use super::resident::Resident;
use crate::datasource::PageKey;
use crate::digest::mix;
use std::sync::Arc;

const SHARDS: usize = 256;

#[derive(Clone)]
struct Slot {
    key: u64,
    /// Empty while the slot is free.
    page: Option<Arc<Resident>>,
}

#[derive(Clone, Default)]
struct Shard {
    /// None, or a power of two, at most three quarters of them taken.
    slots: Vec<Slot>,
    taken: usize,
}

/// All resident pages.
#[derive(Clone)]
pub struct PageMap {
    shards: Vec<Arc<Shard>>,
    pages: usize,
}

/// Which shard, and where probing begins.
#[expect(clippy::cast_possible_truncation, reason = "only low bits of the hash are used")]
fn places(key: PageKey) -> (usize, usize) {
    let hash = mix(key.bits());
    ((hash >> 56) as usize, hash as u32 as usize)
}

impl PageMap {
    /// No pages.
    pub fn new() -> Self {
        let shards = (0..SHARDS).map(|_| Arc::new(Shard::default())).collect();
        Self { shards, pages: 0 }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.pages
    }

    /// The page of this key.
    #[inline]
    pub fn find(&self, key: PageKey) -> Option<&Resident> {
        let (shard, start) = places(key);
        let slots = &self.shards[shard].slots;
        let mask = slots.len().wrapping_sub(1);
        let mut at = start & mask;
        // Every shard with slots has a free one, at which probing ends.
        while let Some(Slot { key: found, page: Some(page) }) = slots.get(at) {
            if *found == key.bits() {
                return Some(page);
            }
            at = (at + 1) & mask;
        }
        None
    }

    /// Takes a page in; gives back the one that had its key.
    pub fn insert(&mut self, page: Resident) -> Option<Arc<Resident>> {
        let (shard, _) = places(page.page.key);
        let old = Arc::make_mut(&mut self.shards[shard]).insert(Arc::new(page));
        self.pages += usize::from(old.is_none());
        old
    }

    /// Takes a page out.
    pub fn remove(&mut self, key: PageKey) -> Option<Arc<Resident>> {
        self.find(key)?;
        let (shard, _) = places(key);
        self.pages -= 1;
        Arc::make_mut(&mut self.shards[shard]).remove(key)
    }
}

impl Shard {
    fn seek(&self, key: PageKey) -> usize {
        let mask = self.slots.len() - 1;
        let mut at = places(key).1 & mask;
        while self.slots[at].page.is_some() && self.slots[at].key != key.bits() {
            at = (at + 1) & mask;
        }
        at
    }

    fn insert(&mut self, page: Arc<Resident>) -> Option<Arc<Resident>> {
        if 4 * (self.taken + 1) > 3 * self.slots.len() {
            self.grow();
        }
        let key = page.page.key;
        let at = self.seek(key);
        let old =
            core::mem::replace(&mut self.slots[at], Slot { key: key.bits(), page: Some(page) });
        self.taken += usize::from(old.page.is_none());
        old.page
    }

    fn grow(&mut self) {
        let larger = (2 * self.slots.len()).max(4);
        let old = core::mem::replace(&mut self.slots, vec![Slot { key: 0, page: None }; larger]);
        self.taken = 0;
        for page in old.into_iter().filter_map(|slot| slot.page) {
            self.insert(page);
        }
    }

    /// Frees the slot and closes the gap, so that probing never meets a false end.
    fn remove(&mut self, key: PageKey) -> Option<Arc<Resident>> {
        let mask = self.slots.len() - 1;
        let mut gap = self.seek(key);
        let removed = self.slots[gap].page.take();
        self.taken -= usize::from(removed.is_some());
        let mut at = (gap + 1) & mask;
        while let Some(page) = &self.slots[at].page {
            let home = places(page.page.key).1 & mask;
            if (at.wrapping_sub(home) & mask) >= (at.wrapping_sub(gap) & mask) {
                self.slots.swap(gap, at);
                gap = at;
            }
            at = (at + 1) & mask;
        }
        removed
    }
}

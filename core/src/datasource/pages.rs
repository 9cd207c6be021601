//! The resident pages: a quadtree of fixed capacity for each quadrant.
//!
//! In:    arrived pages, in the order of the frame's input.
//! Out:   samples and bounds by page id; evicted pages, so that their memory is used again.
//! Keeps: pages, family links, use counts.
//! Not here: making pages (`generate`), deciding what is wanted (`lod`).

use super::key::PageKey;
use super::page::Page;
use crate::columns::{Column, Id, Pool};
use crate::digest::mix;
use std::sync::Arc;

/// All resident pages, as columns.
pub struct Pages {
    /// The samples; empty while the place is free.
    pub page: Column<Page, Option<Arc<Page>>>,
    /// Resident children by [`PageKey::child_index`].
    pub children: Column<Page, [Option<Id<Page>>; 4]>,
    /// The parent; empty for roots.
    pub parent: Column<Page, Option<Id<Page>>>,
    /// Diamond sides that read this page. A page with users, children or no parent stays.
    pub users: Column<Page, u32>,
    /// Frame in which it arrived or lost its last user.
    pub last_use: Column<Page, u64>,
    roots: [Option<Id<Page>>; 4],
    pool: Pool<Page>,
    digest: u64,
}

/// What became of the arrived pages of one frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Admission {
    /// Taken in.
    pub admitted: u32,
    /// Thrown out to make room.
    pub evicted: u32,
    /// Not taken: already resident, no parent, or no room.
    pub refused: u32,
}

impl Pages {
    /// An empty pool.
    pub fn new(capacity: u32) -> Self {
        Self {
            page: Column::new(capacity, || None),
            children: Column::new(capacity, || [None; 4]),
            parent: Column::new(capacity, || None),
            users: Column::new(capacity, || 0),
            last_use: Column::new(capacity, || 0),
            roots: [None; 4],
            pool: Pool::new(capacity),
            digest: 0,
        }
    }

    /// The four root pages, once all have arrived.
    pub fn roots(&self) -> Option<[Id<Page>; 4]> {
        let [a, b, c, d] = self.roots;
        Some([a?, b?, c?, d?])
    }

    /// A resident page.
    pub fn get(&self, id: Id<Page>) -> &Page {
        self.page[id].as_deref().expect("an id in use names a resident page")
    }

    /// Looks a page up by walking down from its root.
    pub fn find(&self, key: PageKey) -> Option<Id<Page>> {
        match key.parent() {
            None => self.roots[usize::from(key.quadrant())],
            Some(parent) => self.children[self.find(parent)?][key.child_index()],
        }
    }

    /// Pages resident now.
    pub fn resident(&self) -> u32 {
        self.pool.live()
    }

    /// Sum of the hashes of all resident pages.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// How many more pages could be taken in `frame`: free places and evictable pages.
    pub fn room(&self, frame: u64) -> u32 {
        let free = self.pool.room();
        if free >= 4096 {
            return free;
        }
        let evictable = self.ids().filter(|&id| self.evictable(id, frame)).count();
        free + u32::try_from(evictable).expect("no more pages than capacity")
    }

    /// One more diamond side reads this page.
    pub fn hold(&mut self, id: Id<Page>) {
        self.users[id] += 1;
    }

    /// One diamond side less reads this page.
    pub fn release(&mut self, id: Id<Page>, frame: u64) {
        self.users[id] -= 1;
        self.last_use[id] = frame;
    }

    /// Stage `admit`: takes arrived pages in, in their order, evicting what nobody uses.
    pub fn admit(
        &mut self,
        arrived: &mut Vec<Arc<Page>>,
        frame: u64,
        evicted: &mut Vec<Arc<Page>>,
    ) -> Admission {
        let mut done = Admission::default();
        for page in arrived.drain(..) {
            let key = page.key;
            let parent = key.parent().map(|parent| self.find(parent));
            if parent == Some(None) || self.find(key).is_some() {
                done.refused += 1;
                evicted.push(page);
                continue;
            }
            if self.pool.room() == 0 && !self.evict_one(frame, evicted) {
                done.refused += 1;
                evicted.push(page);
                continue;
            }
            done.admitted += 1;
            self.insert(page, parent.flatten(), frame);
        }
        done.evicted = u32::try_from(evicted.len()).expect("few pages") - done.refused;
        done
    }

    fn insert(&mut self, page: Arc<Page>, parent: Option<Id<Page>>, frame: u64) {
        let key = page.key;
        let id = self.pool.take().expect("room was checked or made");
        self.digest = self.digest.wrapping_add(mix(mix(key.bits()) ^ page.content));
        self.page[id] = Some(page);
        self.children[id] = [None; 4];
        self.parent[id] = parent;
        self.users[id] = 0;
        self.last_use[id] = frame;
        match parent {
            None => self.roots[usize::from(key.quadrant())] = Some(id),
            Some(parent) => self.children[parent][key.child_index()] = Some(id),
        }
    }

    /// Evicts the page that has been idle longest, the greater key first among equals.
    fn evict_one(&mut self, frame: u64, evicted: &mut Vec<Arc<Page>>) -> bool {
        let idle = self.ids().filter(|&id| self.evictable(id, frame));
        let oldest = idle.min_by_key(|&id| (self.last_use[id], !self.get(id).key.bits()));
        let Some(id) = oldest else { return false };
        let page = self.page[id].take().expect("an evictable page is resident");
        self.digest = self.digest.wrapping_sub(mix(mix(page.key.bits()) ^ page.content));
        let parent = self.parent[id].expect("roots are not evictable");
        self.children[parent][page.key.child_index()] = None;
        self.last_use[parent] = frame;
        self.pool.give_back(id);
        evicted.push(page);
        true
    }

    fn evictable(&self, id: Id<Page>, frame: u64) -> bool {
        self.page[id].is_some()
            && self.users[id] == 0
            && self.parent[id].is_some()
            && self.children[id] == [None; 4]
            && self.last_use[id] < frame
    }

    fn ids(&self) -> impl Iterator<Item = Id<Page>> + use<> {
        (0..self.pool.used_end()).map(Id::new)
    }
}

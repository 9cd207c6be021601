//! The ground of what is resident: the LOD's pages and the requested ones, kept up to date.
//!
//! In:    which pages came or went in a frame; the LOD's pages and the requested ones.
//! Out:   a [`Ground`], made from the same pages that are drawn.
//! Keeps: the ground, from when it was first asked for on; keys that changed since.
//! Not here: heights (`overfly_core::ground`), requests themselves (`requests`).

use crate::core::datasource::pages::Pages;
use crate::core::datasource::{Page, PageKey};
use crate::core::geodesy::Ellipsoid;
use crate::core::ground::Ground;
use crate::requests::Requests;
use std::sync::Arc;

/// More changes than this, and the ground is made anew when it is asked for.
const CHANGES_MAX: usize = 4096;

/// The ground and what it has to catch up with: a frame only notes keys, so that it allocates
/// nothing, and a host that never asks pays nothing.
pub struct ResidentGround {
    body: Ellipsoid,
    sea: bool,
    /// Empty until asked for, and where too much has changed since.
    ground: Option<Ground>,
    changed: Vec<PageKey>,
}

impl ResidentGround {
    /// Nobody has asked yet.
    pub fn new(body: Ellipsoid, sea: bool) -> Self {
        Self { body, sea, ground: None, changed: Vec::new() }
    }

    /// These pages may have come or gone.
    pub fn note(&mut self, keys: impl Iterator<Item = PageKey>) {
        if self.ground.is_none() {
            return;
        }
        for key in keys {
            if self.changed.len() == CHANGES_MAX {
                self.changed.clear();
                self.ground = None;
                return;
            }
            self.changed.push(key);
        }
    }

    /// The ground of exactly what the LOD and the requests have now.
    pub fn follow(&mut self, pages: &Pages, requests: &Requests) -> &Ground {
        let ground = match self.ground.take() {
            None => {
                self.changed.reserve(CHANGES_MAX);
                self.anew(pages, requests)
            }
            Some(mut ground) => {
                for key in self.changed.drain(..) {
                    match resident(pages, key).or_else(|| requests.page(key).cloned()) {
                        Some(page) => drop(ground.insert(page)),
                        None => drop(ground.remove(key)),
                    }
                }
                ground
            }
        };
        self.ground.insert(ground)
    }

    fn anew(&self, pages: &Pages, requests: &Requests) -> Ground {
        let mut ground = Ground::new(self.body, self.sea);
        for page in pages.page.as_slice().iter().flatten() {
            ground.insert(page.clone());
        }
        for page in requests.pages() {
            if !ground.contains(page.key) {
                ground.insert(page.clone());
            }
        }
        ground
    }
}

/// The LOD's page of a key.
pub fn resident(pages: &Pages, key: PageKey) -> Option<Arc<Page>> {
    pages.find(key).and_then(|id| pages.page[id].clone())
}

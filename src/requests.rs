//! Regions of ground that a host asked for: their pages are fetched and stay until released.
//!
//! In:    regions and levels, as lists of pages; pages from a loader of its own.
//! Out:   pages for the ground, beside those of the LOD.
//! Keeps: tickets, the pages that they hold, a loader thread from the first request on.
//! Not here: which pages a region needs (`overfly_core::ground`), the ground itself (`resident`).

use crate::core::datasource::{Page, PageKey};
use crate::core::ground::RegionFault;
use crate::loader::Loader;
use crate::sources::{SourceError, Sources};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// So many pages are asked of the loader at a time.
const WINDOW: usize = 64;

/// What holds the pages of a requested region; give it to `Overfly::release`.
#[derive(PartialEq, Eq, PartialOrd, Ord, Debug)]
#[must_use = "the pages stay until the ticket is released"]
pub struct Ticket(u64);

/// Why a region cannot be requested.
#[derive(Debug)]
pub enum RequestError {
    /// It is none, or by itself larger than all requests together may be.
    Region(RegionFault),
    /// Together with what other tickets hold it is too large.
    Full {
        /// Pages that tickets hold.
        held: u32,
        /// Pages that this region would add.
        more: u32,
        /// Pages that all tickets together may hold.
        pages_max: u32,
    },
    /// The system refused the loader's thread.
    Thread(std::io::Error),
}

impl fmt::Display for RequestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Region(fault) => fault.fmt(f),
            Self::Full { held, more, pages_max } => write!(
                f,
                "the region needs {more} more pages, {held} are held by other requests, and all \
                 together may hold {pages_max}: release some, or raise memory.pages_mib"
            ),
            Self::Thread(_) => write!(f, "the thread that loads regions could not be started"),
        }
    }
}

impl std::error::Error for RequestError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Region(fault) => Some(fault),
            Self::Full { .. } => None,
            Self::Thread(error) => Some(error),
        }
    }
}

/// All requests of one scene.
pub struct Requests {
    sources: Arc<Sources>,
    pages_max: u32,
    loader: Option<Loader>,
    next: u64,
    tickets: BTreeMap<u64, Vec<PageKey>>,
    held: BTreeMap<PageKey, Held>,
    /// Pages that came before their parents.
    early: BTreeMap<PageKey, Arc<Page>>,
    arrived: Vec<Arc<Page>>,
    missing: usize,
}

struct Held {
    tickets: u32,
    /// Empty until it has come.
    page: Option<Arc<Page>>,
}

impl Requests {
    /// None yet.
    pub fn new(sources: Arc<Sources>, pages_max: u32) -> Self {
        Self {
            sources,
            pages_max,
            loader: None,
            next: 0,
            tickets: BTreeMap::new(),
            held: BTreeMap::new(),
            early: BTreeMap::new(),
            arrived: Vec::new(),
            missing: 0,
        }
    }

    /// None any more, of other sources; old tickets hold nothing, and are never given out again.
    pub fn begin_anew(&mut self, sources: Arc<Sources>) {
        *self = Self { next: self.next, ..Self::new(sources, self.pages_max) };
    }

    /// Pages that all requests together may hold.
    pub fn pages_max(&self) -> u32 {
        self.pages_max
    }

    /// Holds `pages`, which are closed under parents; those that `resident` has are there at once.
    ///
    /// # Errors
    /// They are too many, or there is no thread to load them.
    pub fn add(
        &mut self,
        pages: Vec<PageKey>,
        resident: impl Fn(PageKey) -> Option<Arc<Page>>,
    ) -> Result<Ticket, RequestError> {
        let more = pages.iter().filter(|key| !self.held.contains_key(key)).count();
        if self.held.len() + more > self.pages_max as usize {
            let count = |pages: usize| u32::try_from(pages).unwrap_or(u32::MAX);
            let (held, more) = (count(self.held.len()), count(more));
            return Err(RequestError::Full { held, more, pages_max: self.pages_max });
        }
        if self.loader.is_none() {
            let loader = Loader::new(self.sources.clone(), 1).map_err(RequestError::Thread)?;
            self.loader = Some(loader);
        }
        for &key in &pages {
            let held = self.held.entry(key).or_insert_with(|| {
                let page = resident(key);
                self.missing += usize::from(page.is_none());
                Held { tickets: 0, page }
            });
            held.tickets += 1;
        }
        self.next += 1;
        self.tickets.insert(self.next, pages);
        self.ask();
        Ok(Ticket(self.next))
    }

    /// Gives pages back; `gone` hears of those that no ticket holds any more.
    pub fn release(&mut self, ticket: &Ticket, mut gone: impl FnMut(PageKey)) {
        for key in self.tickets.remove(&ticket.0).unwrap_or_default() {
            let held = self.held.get_mut(&key).expect("a ticket's pages are held");
            held.tickets -= 1;
            if held.tickets == 0 {
                self.missing -= usize::from(held.page.is_none());
                self.held.remove(&key);
                self.early.remove(&key);
                gone(key);
            }
        }
        self.ask();
    }

    /// Takes in what the loader has made; `came` hears of pages that are now held, parents first.
    pub fn collect(&mut self, mut came: impl FnMut(PageKey)) {
        if self.missing == 0 {
            return;
        }
        let loader = self.loader.as_mut().expect("what is missing was asked for");
        loader.collect(&mut self.arrived);
        for page in self.arrived.drain(..) {
            if self.held.get(&page.key).is_some_and(|held| held.page.is_none()) {
                self.early.insert(page.key, page);
            }
        }
        // Parents sort before their children, so one pass lets in all that can be let in.
        let (held, missing) = (&mut self.held, &mut self.missing);
        self.early.retain(|&key, page| {
            let has_parent = key
                .parent()
                .is_none_or(|parent| held.get(&parent).is_some_and(|held| held.page.is_some()));
            if has_parent && let Some(held) = held.get_mut(&key) {
                held.page = Some(page.clone());
                *missing -= 1;
                came(key);
            }
            !has_parent
        });
        self.ask();
    }

    /// A page that a ticket holds.
    pub fn page(&self, key: PageKey) -> Option<&Arc<Page>> {
        self.held.get(&key)?.page.as_ref()
    }

    /// All pages that tickets hold and that have come.
    pub fn pages(&self) -> impl Iterator<Item = &Arc<Page>> {
        self.held.values().filter_map(|held| held.page.as_ref())
    }

    /// Pages that could not be loaded when they were last asked for, and why.
    pub fn faults(&self) -> impl Iterator<Item = (PageKey, &SourceError)> {
        self.loader.iter().flat_map(Loader::faults)
    }

    /// Asks the loader for the next pages, the coarsest first; those that failed rest meanwhile.
    fn ask(&mut self) {
        let Some(loader) = &mut self.loader else { return };
        let lacking = self.held.iter().filter(|(_, held)| held.page.is_none());
        let lacking = lacking.map(|(&key, _)| key);
        let open = lacking.filter(|&key| !self.early.contains_key(&key) && !loader.rests(key));
        let window: Vec<_> = open.take(WINDOW).collect();
        loader.request(&window, 0);
    }
}

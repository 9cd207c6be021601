//! How pages get from the loader into frames, where the host leaves that to us.
//!
//! In:    what each frame wants.
//! Out:   pages for the next frames.
//! Keeps: [`Loading`]: the loader, and what the last frame wanted.
//! Not here: the loader's threads (`loader`), what a host chooses (`host`).

use crate::core::datasource::{Page, PageKey};
use crate::host::Pages;
use crate::loader::Loader;
use crate::sources::{SourceError, Sources};
use std::io;
use std::sync::Arc;

/// The loader of a scene, if the host leaves loading to us.
pub(crate) struct Loading {
    pages: Pages,
    loader: Option<Loader>,
    wanted: Vec<PageKey>,
}

impl Loading {
    pub fn new(pages: Pages, sources: &Arc<Sources>) -> io::Result<Self> {
        let loader = match pages {
            Pages::Host => None,
            Pages::AsReady { threads } | Pages::Waited { threads } => {
                Some(Loader::new(sources.clone(), threads)?)
            }
        };
        Ok(Self { pages, loader, wanted: Vec::new() })
    }

    /// Appends what arrives in this frame.
    pub fn collect(&mut self, arrived: &mut Vec<Arc<Page>>) {
        let Some(loader) = &mut self.loader else { return };
        match self.pages {
            Pages::Waited { .. } => loader.fetch(&self.wanted, arrived),
            _ => loader.collect(arrived),
        }
    }

    /// Has made what a frame wanted.
    pub fn request(&mut self, wanted: &[PageKey]) {
        let Some(loader) = &mut self.loader else { return };
        match self.pages {
            Pages::Waited { .. } => {
                self.wanted.clear();
                self.wanted.extend_from_slice(wanted);
            }
            _ => loader.request(wanted, 0),
        }
    }

    /// Pages come from elsewhere from now on.
    pub fn follow(&mut self, sources: &Arc<Sources>) -> io::Result<()> {
        *self = Self::new(self.pages, sources)?;
        Ok(())
    }

    /// Pages that could not be made when they were last asked for, and why.
    pub fn faults(&self) -> impl Iterator<Item = (PageKey, &SourceError)> {
        self.loader.iter().flat_map(Loader::faults)
    }
}

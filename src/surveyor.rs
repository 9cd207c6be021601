//! Heights for tools: whatever a question needs is loaded before it is answered.
//!
//! In:    places, queries; a scene's sources.
//! Out:   answers that never lack a page, or why a page cannot be had.
//! Keeps: a ground of bounded size: the pages used last.
//! Not here: heights of what is resident, without waiting (`overfly_core::ground`).

use crate::core::datasource::PageKey;
use crate::core::datasource::key::PAGE_BITS;
use crate::core::geodesy::Geodetic;
use crate::core::ground::{Answer, Ground, LEVEL_MAX, Place, Query};
use crate::sources::{SourceError, Sources, level_of};
use glam::DVec3;
use lru::LruCache;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// A question may need a page of every depth, and a few around a page's corner.
const PAGES_LEAST: usize = 64;
/// How far beside a direction its neighbours are looked for: 25 nm on the Earth.
const BESIDE: f64 = 4e-15;
const DEPTH_MAX: u8 = LEVEL_MAX / 2 - PAGE_BITS;

/// Answers that wait for their pages. For flight models and frames there is [`Ground`]: this one
/// blocks while pages are made.
pub struct Surveyor {
    sources: Arc<Sources>,
    ground: Ground,
    recent: LruCache<PageKey, ()>,
}

impl Surveyor {
    /// A surveyor that keeps at most `pages_max` pages, 64 at least: some 65 KiB each.
    pub fn new(sources: Arc<Sources>, pages_max: usize) -> Self {
        let ground = Ground::new(*sources.body(), sources.sea());
        Self::over(sources, ground, pages_max)
    }

    /// A surveyor of the ground itself, beneath the water.
    pub(crate) fn beneath_water(sources: Arc<Sources>, pages_max: usize) -> Self {
        let ground = Ground::new(*sources.body(), false);
        Self::over(sources, ground, pages_max)
    }

    fn over(sources: Arc<Sources>, ground: Ground, pages_max: usize) -> Self {
        let most = NonZeroUsize::new(pages_max.max(PAGES_LEAST)).expect("64 at least");
        Self { sources, ground, recent: LruCache::new(most) }
    }

    /// What the pages are made from.
    pub fn sources(&self) -> &Arc<Sources> {
        &self.sources
    }

    /// The ground at a place. [`Query::BestResident`] is the level of [`Sources::best`] here:
    /// that of the finest data, or where there is none the procedural planet's at about 1 m.
    ///
    /// # Errors
    /// A page that the answer needs cannot be made; [`Self::coarser`] may have something.
    pub fn height(&mut self, at: Geodetic, query: Query) -> Result<Answer, SourceError> {
        if matches!(self.ground.height(at, query), Answer::Refused) {
            return Ok(Answer::Refused);
        }
        match query {
            Query::Exact(level) => self.exact(at, level),
            Query::BestResident => {
                let query = self.sources.best(Place::of(at.normal()))?;
                self.height(at, query)
            }
            Query::Within(_) => self.within(at, query),
        }
    }

    /// The finest that can be had where [`Self::height`] failed: coarser than asked for, or
    /// nothing.
    pub fn coarser(&mut self, at: Geodetic, query: Query) -> Answer {
        let deepest = if let Query::Exact(level) = query { depth_of(level) } else { DEPTH_MAX };
        for depth in (0..=deepest.min(DEPTH_MAX)).rev() {
            if let Ok(Answer::Ok(height)) = self.exact(at, level_of(depth)) {
                return Answer::Coarser(height);
            }
        }
        Answer::NotReady
    }

    fn exact(&mut self, at: Geodetic, level: u8) -> Result<Answer, SourceError> {
        let (depth, query) = (depth_of(level), Query::Exact(level));
        let normal = at.normal();
        self.load(normal, depth)?;
        let answer = self.ground.height(at, query);
        if matches!(answer, Answer::Ok(_)) {
            return Ok(answer);
        }
        // The ground rounds normals in its own way: at a border it may look into the next page.
        for corner in 0..8_u8 {
            let side = |axis: u8| if corner >> axis & 1 == 1 { BESIDE } else { -BESIDE };
            self.load(normal + DVec3::new(side(0), side(1), side(2)), depth)?;
        }
        Ok(self.ground.height(at, query))
    }

    fn within(&mut self, at: Geodetic, query: Query) -> Result<Answer, SourceError> {
        let mut answer = Answer::NotReady;
        for depth in 0..=DEPTH_MAX {
            self.exact(at, level_of(depth))?;
            answer = self.ground.height(at, query);
            if matches!(answer, Answer::Ok(_)) {
                break;
            }
        }
        Ok(answer)
    }

    fn load(&mut self, normal: DVec3, depth: u8) -> Result<(), SourceError> {
        let key = Place::of(normal).page(depth);
        if self.recent.get(&key).is_some() {
            return Ok(());
        }
        self.ground.insert(self.sources.page(key)?);
        if let Some((old, ())) = self.recent.push(key, ()) {
            self.ground.remove(old);
        }
        Ok(())
    }
}

/// Depth of the pages that serve a level.
fn depth_of(level: u8) -> u8 {
    level.div_ceil(2).saturating_sub(PAGE_BITS)
}

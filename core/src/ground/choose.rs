//! Which page and which level answer a query at a place.
//!
//! In:    a place, a query, a way to find pages.
//! Out:   [`Choice`].
//! Keeps: in [`Recent`], the page of each depth that was found last.
//! Not here: the surface (`surface`).

use super::answer::Query;
use super::map::PageMap;
use super::place::{DEPTH_END, LEVEL_BOUNDED, LEVEL_MAX, Place, depth_of, level_of};
use super::resident::{BLOCK_BITS, Errors, Resident};
use crate::datasource::PageKey;

/// What answers.
#[derive(Clone, Copy)]
pub struct Choice<'a> {
    /// The page.
    pub page: &'a Resident,
    /// One of its levels.
    pub level: u8,
    /// Not what was asked for.
    pub coarser: bool,
}

/// Whether a query can have an answer.
pub fn is_sound(query: Query) -> bool {
    match query {
        Query::Exact(level) => level <= LEVEL_MAX,
        Query::BestResident => true,
        Query::Within(bound) => bound.0 >= 0.0,
    }
}

/// What answers `query` at `place`; `None` where nothing is resident.
#[inline]
pub fn choose<'a>(
    place: Place,
    query: Query,
    find: &mut impl FnMut(PageKey) -> Option<&'a Resident>,
) -> Option<Choice<'a>> {
    match query {
        Query::Exact(level) => {
            let depth = depth_of(level);
            if let Some(page) = find(place.page(depth)) {
                return Some(Choice { page, level, coarser: false });
            }
            let page = finest(place, depth, find)?;
            Some(Choice { page, level: level_of(page.page.key.depth()), coarser: true })
        }
        Query::BestResident => {
            let page = finest(place, DEPTH_END + 1, find)?;
            Some(Choice { page, level: level_of(page.page.key.depth()), coarser: false })
        }
        Query::Within(bound) => within(place, bound.0, find),
    }
}

/// The deepest resident page around `place` that is less deep than `end`. Pages are resident with
/// their parents, so that the depth can be found by bisection.
fn finest<'a>(
    place: Place,
    end: u8,
    find: &mut impl FnMut(PageKey) -> Option<&'a Resident>,
) -> Option<&'a Resident> {
    let (mut low, mut high) = (0, end);
    let mut best = None;
    while low < high {
        let depth = u8::midpoint(low, high);
        match find(place.page(depth)) {
            Some(page) => (best, low) = (Some(page), depth + 1),
            None => high = depth,
        }
    }
    best
}

fn within<'a>(
    place: Place,
    bound_m: f64,
    find: &mut impl FnMut(PageKey) -> Option<&'a Resident>,
) -> Option<Choice<'a>> {
    let mut last = None;
    for depth in 0..=DEPTH_END {
        let Some(page) = find(place.page(depth)) else { break };
        let level = level_of(depth);
        let errors = errors_at(page, place);
        for level in [level - 1, level] {
            debug_assert!(level >= LEVEL_BOUNDED);
            if errors.of_level(level) <= bound_m {
                return Some(Choice { page, level, coarser: false });
            }
        }
        last = Some(Choice { page, level, coarser: true });
    }
    last
}

fn errors_at(page: &Resident, place: Place) -> Errors {
    let (x, y) = place.square(page.page.key.depth() + BLOCK_BITS);
    let mask = (1 << BLOCK_BITS) - 1;
    page.errors((x & mask) as usize, (y & mask) as usize)
}

/// Finds pages; remembers the last of each depth.
pub struct Recent<'a> {
    map: &'a PageMap,
    seen: [Option<&'a Resident>; DEPTH_END as usize + 1],
}

impl<'a> Recent<'a> {
    /// Remembers nothing yet.
    pub fn new(map: &'a PageMap) -> Self {
        Self { map, seen: [None; DEPTH_END as usize + 1] }
    }

    /// The page of this key.
    #[inline]
    pub fn find(&mut self, key: PageKey) -> Option<&'a Resident> {
        let seen = &mut self.seen[usize::from(key.depth())];
        if let Some(page) = *seen
            && page.page.key == key
        {
            return Some(page);
        }
        let found = self.map.find(key);
        if found.is_some() {
            *seen = found;
        }
        found
    }
}

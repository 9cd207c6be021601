//! Stages `prioritise` and `refine`: every queued priority anew, then splits and merges until the
//! tolerance is met, the budget is full and the queues agree, or the counts are spent.
//!
//! In:    sights, resident pages, the knobs.
//! Out:   the refined surface; wanted pages, the most urgent first; counts.
//! Keeps: a scratch list of what blocked splits want.
//! Not here: what one operation changes (`operate`).

use super::diamonds::{Diamond, DiamondId, Diamonds};
use super::operate::Surface;
use super::queues::{Queue, Queues};
use super::screen_error::{Sight, priority_px};
use crate::columns::Id;
use crate::datasource::PageKey;
use core::cmp::Ordering;

/// Diamonds in one chunk of the priority pass: some 5 µs of work.
pub const PRIORITY_GRAIN: usize = 512;

/// What `refine` keeps between frames, only to allocate nothing.
pub struct Scratch {
    wants: Vec<(f64, PageKey)>,
    chain: Vec<DiamondId>,
}

/// Counts of one `refine`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Refinement {
    /// Diamonds split, forced ones included.
    pub splits: u32,
    /// Diamonds merged.
    pub merges: u32,
    /// Splits that waited for a page.
    pub blocked: u32,
    /// Bound of the worst leaf, in pixels.
    pub error_px_bound: f64,
}

impl Scratch {
    /// Room for as many blocked splits as there can be diamonds.
    pub fn new(diamonds: u32) -> Self {
        Self { wants: Vec::with_capacity(diamonds as usize), chain: Vec::with_capacity(128) }
    }
}

/// Priorities of one chunk of the pool: diamonds `first ..` as many as `out` is long.
pub fn prioritise_chunk(
    diamonds: (&Queues, &[super::screen_error::Region]),
    sights: &[Sight],
    first: usize,
    out: &mut [f64],
) {
    let (queues, regions) = diamonds;
    for (offset, priority) in out.iter_mut().enumerate() {
        let index = first + offset;
        let id = Id::<Diamond>::new(u32::try_from(index).expect("the pool is counted in u32"));
        if queues.link[id].queue != Queue::None {
            *priority = priority_px(&regions[index], sights);
        }
    }
}

/// After the pass: every diamond to the bucket of its new priority; blocked ones may try again.
/// Returns how many priorities were computed.
pub fn settle(diamonds: &Diamonds, queues: &mut Queues) -> u32 {
    let evaluations = queues.lengths().into_iter().sum();
    while let Some(id) = queues.first_blocked() {
        queues.remove(id);
        queues.insert(id, Queue::Split, diamonds.priority_px[id]);
    }
    for id in diamonds.ids() {
        queues.rebucket(id, diamonds.priority_px[id]);
    }
    evaluations
}

/// Stage `refine`. Merges come first and have a count of their own, so splits cannot starve them.
pub fn refine(
    surface: &mut Surface<'_>,
    leaves_max: u32,
    scratch: &mut Scratch,
    wanted: &mut Vec<PageKey>,
) -> Refinement {
    let mut done = Refinement::default();
    scratch.wants.clear();
    if surface.diamonds.base.is_none() {
        match surface.pages.roots() {
            Some(roots) => surface.create_base(roots),
            None => return want_roots(surface, wanted, done),
        }
    }
    merge_needless(surface, &mut done);
    while done.splits < surface.lod.splits_max {
        if !split_first(surface, leaves_max, scratch, &mut done) {
            break;
        }
    }
    done.error_px_bound = surface.queues.worst_px(|id| surface.rank(id));
    list_wanted(surface, scratch, wanted);
    done
}

fn want_roots(surface: &Surface<'_>, wanted: &mut Vec<PageKey>, done: Refinement) -> Refinement {
    let roots = (0..4).map(PageKey::root);
    wanted.extend(roots.filter(|&key| surface.pages.find(key).is_none()));
    done
}

/// The least diamond of the merge queue that was not touched in this frame.
fn first_to_merge(surface: &Surface<'_>) -> Option<DiamondId> {
    let untouched = |id| surface.diamonds.node[id].touched != surface.frame;
    surface.queues.first_to_merge(|id| surface.rank(id), untouched)
}

/// Merges what the tolerance does not ask for: one exact threshold, no hysteresis.
fn merge_needless(surface: &mut Surface<'_>, done: &mut Refinement) {
    while done.merges < surface.lod.merges_max {
        let Some(id) = first_to_merge(surface) else { break };
        if surface.diamonds.priority_px[id] > surface.lod.tolerance.0 {
            break;
        }
        surface.merge(id);
        done.merges += 1;
    }
}

/// Splits the first of the split queue, with its ancestors; where the budget is full, merges the
/// least of the merge queue for it while that is worth less. False when nothing more can be done.
fn split_first(
    surface: &mut Surface<'_>,
    leaves_max: u32,
    scratch: &mut Scratch,
    done: &mut Refinement,
) -> bool {
    let Some(id) = surface.queues.first_to_split(|id| surface.rank(id)) else { return false };
    let rank = surface.rank(id);
    if rank.priority_px <= surface.lod.tolerance.0 {
        return false;
    }
    if let Err(lacking) = surface.plan_split(id, &mut scratch.chain) {
        scratch.wants.push((rank.priority_px, lacking));
        surface.queues.remove(id);
        surface.queues.insert(id, Queue::Blocked, rank.priority_px);
        done.blocked += 1;
        return true;
    }
    let touched = |&id: &DiamondId| surface.diamonds.node[id].touched == surface.frame;
    if scratch.chain.iter().any(touched) {
        // Merged in this frame: not split in it. It waits as if for a page.
        surface.queues.remove(id);
        surface.queues.insert(id, Queue::Blocked, rank.priority_px);
        return true;
    }
    let cost = u32::try_from(scratch.chain.len()).expect("a chain is as long as there are levels");
    if done.splits + cost > surface.lod.splits_max {
        return false;
    }
    if surface.diamonds.leaves + 2 * cost > leaves_max {
        return make_room(surface, id, done);
    }
    for &ancestor in &scratch.chain {
        surface.split(ancestor);
    }
    done.splits += cost;
    true
}

/// Merges the least diamond if it is worth less than `top`, which wants the room.
fn make_room(surface: &mut Surface<'_>, top: DiamondId, done: &mut Refinement) -> bool {
    if done.merges >= surface.lod.merges_max {
        return false;
    }
    let Some(least) = first_to_merge(surface) else { return false };
    let needed = surface.diamonds.node[top].parents.contains(&Some(least));
    let overlap = surface.rank(least).order(&surface.rank(top)) == Ordering::Less;
    if needed || !overlap {
        return false;
    }
    surface.merge(least);
    done.merges += 1;
    true
}

/// The most urgent pages, once each, no more than can be taken in.
fn list_wanted(surface: &Surface<'_>, scratch: &mut Scratch, wanted: &mut Vec<PageKey>) {
    if scratch.wants.is_empty() {
        return;
    }
    scratch.wants.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let room = surface.pages.room(surface.frame + 1).min(surface.lod.wanted_max) as usize;
    for &(_, key) in &scratch.wants {
        if wanted.len() >= room {
            break;
        }
        if !wanted.contains(&key) {
            wanted.push(key);
        }
    }
}

//! The agenda: which diamonds must be looked at in a frame, and which can wait for how much motion.
//!
//! In:    verdicts; motions of the views; moves of the two thresholds.
//! Out:   diamonds that are due; the first urgent leaf and the first urgent parent.
//! Keeps: a seat for every leaf and parent: in a wheel, among the urgent, soon or waiting.
//! Not here: what a verdict is made from (`screen_error`), what is done then (`refine`).
//!
//! Two thresholds make the verdicts. A leaf is certain while its priority is below `leaf_px`: it
//! is not split. A parent is certain while its priority is above `parent_px`: it is not merged.
//! All others are urgent: their priorities are exact in every frame. Where the tolerance decides,
//! both thresholds are the tolerance; where the budget does, they enclose the priority at which
//! splits and merges meet, and follow it.

use super::bins::Bins;
use super::diamonds::{Diamond, DiamondId, Diamonds, Role, Seat};
use super::urgent::{Rank, Seating, URGENT_BINS, Urgent};
use super::wheel::{Lasts, Motion, WHEEL_BINS, Wheels};
use crate::columns::Column;
use core::cell::RefCell;
use core::cmp::Ordering;
use glam::DVec3;

/// What verdicts are given against: the two thresholds, in pixels, and the course.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Band {
    /// A leaf below it is certain.
    pub leaf_px: f64,
    /// A parent above it is certain.
    pub parent_px: f64,
    /// Direction of the course, for verdicts that last along it; zero before the first motion.
    pub course: DVec3,
    /// How far the eye has gone on it, metres.
    pub course_m: f64,
}

/// What a rule says of a diamond.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Verdict {
    /// Its priority matters: this is it, in pixels.
    Urgent(f64),
    /// It stays as it is for so long.
    Certain(Lasts),
}

/// Where a verdict puts a diamond.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Placement {
    /// Among the urgent, with this priority in pixels.
    Urgent(f64),
    /// Into this bin.
    Bin(u32),
}

const URGENT_LEAVES: u32 = WHEEL_BINS;
const URGENT_PARENTS: u32 = URGENT_LEAVES + URGENT_BINS;
/// Due with the next motion, however small.
const SOON: u32 = URGENT_PARENTS + URGENT_BINS;
/// Urgent leaves that cannot be split in this frame: tried again in the next.
const WAITING: u32 = SOON + 1;

/// Operations for which memory is loaded together.
pub const WARM: usize = 32;

/// Takes its share of a bin that will be due after some more motions: a bin's diamonds were seated
/// over many frames and must not all be judged in one.
fn ease(bins: &mut Bins, bin: u32, motions: f64, due: &mut Vec<DiamondId>) -> bool {
    let share = f64::from(bins.count(bin)) / motions;
    share >= f64::from(EASED) && bins.drain_some(bin, EASED.max(whole(share)), due)
}

fn whole(share: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, reason = "it saturates, and a bin is no larger")]
    let whole = share as u32;
    whole
}

/// A share of a bin that is worth to be judged early.
const EASED: u32 = 64;

/// Seats, thresholds and odometers.
pub struct Agenda {
    /// Exact priorities of urgent diamonds in pixels; stale for all others.
    pub priority_px: Column<Diamond, f64>,
    band: Band,
    bins: Bins,
    wheels: Wheels,
    leaves: Urgent,
    parents: Urgent,
    due: Vec<DiamondId>,
    /// Urgent diamonds that will be operated on, the last first.
    ahead: Vec<DiamondId>,
}

macro_rules! seating {
    ($agenda:ident, $diamonds:ident) => {
        &mut Seating {
            diamonds: $diamonds,
            bins: &mut $agenda.bins,
            priority_px: &$agenda.priority_px,
        }
    };
}

impl Agenda {
    /// Nobody is seated; both thresholds are at the tolerance.
    pub fn new(capacity: u32, tolerance_px: f64) -> Self {
        Self {
            priority_px: Column::new(capacity, || 0.0),
            band: Band {
                leaf_px: tolerance_px.next_up(),
                parent_px: tolerance_px,
                course: DVec3::ZERO,
                course_m: 0.0,
            },
            bins: Bins::new(WAITING + 1, capacity),
            wheels: Wheels::new(),
            leaves: Urgent::new(URGENT_LEAVES, Ordering::Greater, capacity),
            parents: Urgent::new(URGENT_PARENTS, Ordering::Less, capacity),
            due: Vec::with_capacity(capacity as usize),
            ahead: Vec::with_capacity(capacity as usize),
        }
    }

    /// The thresholds.
    pub fn band(&self) -> Band {
        self.band
    }

    /// Where every urgent diamond will be split or merged: lists the first of one role, so that
    /// [`Self::warm_next`] can load what they touch.
    pub fn look_ahead(&mut self, diamonds: &Diamonds, role: Role, most: u32) {
        let set = if role == Role::Leaf { &self.leaves } else { &self.parents };
        self.ahead.clear();
        set.list_first((diamonds, &self.bins), most as usize, &mut self.ahead);
        self.ahead.reverse();
    }

    /// Loads what the next operations touch into the cache, all at once, so that they do not wait
    /// for memory one after the other.
    pub fn warm_next(&mut self, diamonds: &Diamonds) {
        let from = self.ahead.len().saturating_sub(WARM);
        let mut list = core::mem::take(&mut self.due);
        list.extend_from_slice(&self.ahead[from..]);
        self.ahead.truncate(from);
        let count = list.len();
        diamonds.warm(&list);
        // A split touches its parents and their kids, a merge its kids and their parents.
        for at in 0..count {
            let record = &diamonds[list[at]];
            if record.is_split() {
                list.extend(record.kids().into_iter().flatten());
            } else {
                list.extend(record.parents().into_iter().flatten());
            }
        }
        diamonds.warm(&list[count..]);
        let around = list.len();
        for at in count..around {
            let record = &diamonds[list[at]];
            if record.is_split() {
                list.extend(record.kids().into_iter().flatten());
            } else {
                list.extend(record.parents().into_iter().flatten());
            }
        }
        diamonds.warm(&list[around..]);
        list.truncate(around);
        list.drain(..count);
        list.retain(|&id| diamonds[id].seat == Seat::Bin);
        self.bins.warm(diamonds, &mut list);
        list.clear();
        self.due = list;
    }

    /// Starts a frame: what the motion may have changed becomes due; without motion, waiting
    /// leaves are urgent again as they were. `None` is a motion that may have changed anything.
    pub fn start(&mut self, diamonds: &mut Diamonds, motion: Option<Motion>) {
        debug_assert!(self.due.is_empty());
        let Self { bins, wheels, due, .. } = self;
        if motion.is_some_and(|motion| motion.is_none()) {
            self.bins.drain(WAITING, &mut self.due);
            while let Some(id) = self.due.pop() {
                self.seat(diamonds, id, Placement::Urgent(self.priority_px[id]));
            }
            return;
        }
        if let Some(motion) = motion.filter(Motion::is_countable) {
            wheels.advance(&motion);
            (self.band.course, self.band.course_m) = wheels.course();
            // Both closures need both lists, one after the other.
            let lists = RefCell::new((bins, due));
            wheels.pass(
                |bin| {
                    let (bins, due) = &mut *lists.borrow_mut();
                    bins.drain(bin, due);
                },
                |bin, motions| {
                    let (bins, due) = &mut *lists.borrow_mut();
                    ease(bins, bin, motions, due)
                },
            );
        } else {
            wheels.pass_all(|bin| bins.drain(bin, due));
        }
        self.bins.drain(SOON, &mut self.due);
        self.bins.drain(WAITING, &mut self.due);
        let Band { leaf_px, parent_px, .. } = self.band;
        self.leaves.drain(seating!(self, diamonds), leaf_px, &mut self.due);
        self.parents.drain(seating!(self, diamonds), parent_px, &mut self.due);
    }

    /// Lowers the threshold of leaves; those that may now be above it become due.
    pub fn lower_leaf_threshold(&mut self, to_px: f64) {
        self.wheels.leaf_threshold_fell(self.band.leaf_px, to_px);
        self.band.leaf_px = to_px;
        self.collect();
    }

    /// Raises the threshold of parents; those that may now be below it become due.
    pub fn raise_parent_threshold(&mut self, to_px: f64) {
        self.wheels.parent_threshold_rose(self.band.parent_px, to_px);
        self.band.parent_px = to_px;
        self.collect();
    }

    /// Moves both thresholds apart from each other's side: what was certain stays so.
    ///
    /// # Panics
    /// In debug builds, if the leaf threshold falls or the parent threshold rises.
    pub fn relax(&mut self, leaf_px: f64, parent_px: f64) {
        debug_assert!(leaf_px >= self.band.leaf_px && parent_px <= self.band.parent_px);
        self.band = Band { leaf_px, parent_px, ..self.band };
    }

    fn collect(&mut self) {
        let Self { bins, wheels, due, .. } = self;
        wheels.pass(|bin| bins.drain(bin, due), |_, _| false);
        bins.drain(SOON, due);
    }

    /// The diamonds to be judged now; give the list back to [`Self::judged`].
    pub fn take_due(&mut self) -> Vec<DiamondId> {
        core::mem::take(&mut self.due)
    }

    /// Takes the memory of the list back.
    pub fn judged(&mut self, mut due: Vec<DiamondId>) {
        due.clear();
        self.due = due;
    }

    /// Where a verdict that is given now puts a diamond.
    #[inline]
    pub fn placement(&self, verdict: &Verdict) -> Placement {
        match verdict {
            Verdict::Urgent(priority_px) => Placement::Urgent(*priority_px),
            Verdict::Certain(lasts) => Placement::Bin(self.wheels.bin_of(lasts).unwrap_or(SOON)),
        }
    }

    /// Seats a leaf or a parent that is nowhere, or was just drained from where it was.
    #[inline]
    pub fn seat(&mut self, diamonds: &mut Diamonds, id: DiamondId, placement: Placement) {
        match placement {
            Placement::Bin(bin) => {
                if self.bins.push(diamonds, bin, id) && bin < WHEEL_BINS {
                    self.wheels.filled(bin);
                }
            }
            Placement::Urgent(priority_px) => {
                self.priority_px[id] = priority_px;
                let is_leaf = diamonds[id].role() == Role::Leaf;
                let set = if is_leaf { &mut self.leaves } else { &mut self.parents };
                set.push(seating!(self, diamonds), id);
            }
        }
    }

    /// Seats a diamond that is to be judged again with the next motion, whatever it says now.
    pub fn seat_soon(&mut self, diamonds: &mut Diamonds, id: DiamondId) {
        self.bins.push(diamonds, SOON, id);
    }

    /// Moves an urgent leaf to those that are tried again in the next frame.
    pub fn wait(&mut self, diamonds: &mut Diamonds, id: DiamondId) {
        self.unseat(diamonds, id);
        self.bins.push(diamonds, WAITING, id);
    }

    /// Adds the leaves that could not be split in the last frame to a list.
    pub fn list_waiting(&self, out: &mut Vec<DiamondId>) {
        self.bins.list(WAITING, out);
    }

    /// Takes a diamond from its seat, if it has one.
    pub fn unseat(&mut self, diamonds: &mut Diamonds, id: DiamondId) {
        match diamonds[id].seat {
            Seat::Free | Seat::None => {}
            // Its entry in the heap is stale from here on.
            Seat::Front => diamonds[id].seat = Seat::None,
            Seat::Bin => {
                let bin = self.bins.remove(diamonds, id);
                if self.bins.is_empty(bin) {
                    self.emptied(bin);
                }
            }
        }
    }

    fn emptied(&mut self, bin: u32) {
        if bin < WHEEL_BINS {
            self.wheels.emptied(bin);
        } else if self.leaves.owns(bin) {
            self.leaves.emptied(bin);
        } else if self.parents.owns(bin) {
            self.parents.emptied(bin);
        }
    }

    /// The urgent leaf with the greatest priority.
    pub fn first_leaf(&mut self, diamonds: &mut Diamonds) -> Option<DiamondId> {
        self.leaves.first(seating!(self, diamonds))
    }

    /// The urgent parent with the least priority.
    pub fn first_parent(&mut self, diamonds: &mut Diamonds) -> Option<DiamondId> {
        self.parents.first(seating!(self, diamonds))
    }

    /// The standing of an urgent diamond.
    pub fn rank(&self, diamonds: &Diamonds, id: DiamondId) -> Rank {
        let record = &diamonds[id];
        let priority_px = self.priority_px[id];
        Rank { priority_px, level: record.level(), key: record.key() }
    }

    /// All diamonds whose verdict is taken to last, for checks.
    pub fn certain(&self) -> Vec<DiamondId> {
        let mut all = Vec::new();
        self.wheels.in_use().for_each(|bin| self.bins.list(bin, &mut all));
        all
    }

    /// Bytes in use besides the records: priorities, bins, lists. Two heaps of 32 bytes a diamond
    /// are reserved besides, of which only the foremost bin is touched.
    pub fn bytes(&self, diamonds: u32) -> usize {
        let per_diamond = size_of::<f64>() + 4 * size_of::<DiamondId>();
        diamonds as usize * per_diamond + self.bins.bytes()
    }

    /// Whether every seat is where the diamond says, each once, and marked as in use; for checks.
    ///
    /// # Errors
    /// The first disagreement in words.
    pub fn check(&self, diamonds: &Diamonds) -> Result<(), String> {
        let mut seated = vec![false; diamonds.used_end() as usize];
        let mut all = self.certain();
        [SOON, WAITING].into_iter().for_each(|bin| self.bins.list(bin, &mut all));
        [&self.leaves, &self.parents]
            .into_iter()
            .for_each(|set| set.list((diamonds, &self.bins), &mut all));
        for id in all {
            let record = &diamonds[id];
            let there = match record.seat {
                Seat::Bin => self.bins.holds(record.place, id),
                Seat::Front => true,
                Seat::None | Seat::Free => false,
            };
            let again = core::mem::replace(&mut seated[id.index() as usize], true);
            if !there || again || record.role() == Role::Interior {
                return Err(format!("{id:?} sits wrongly or twice: {record:?}"));
            }
        }
        match diamonds
            .ids()
            .find(|&id| (diamonds[id].role() != Role::Interior) != seated[id.index() as usize])
        {
            Some(id) => Err(format!("{id:?} should sit, or not: {:?}", diamonds[id])),
            None => Ok(()),
        }
    }
}

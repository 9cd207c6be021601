//! Refinement: what is due is judged, then splits and merges until the tolerance is met, the
//! budget is full and both sides agree, or the counts are spent.
//!
//! In:    a [`Rule`], the motion since the last frame, the knobs.
//! Out:   the refined surface; what blocked splits lack; counts.
//! Keeps: [`Mesh`]: diamonds, agenda, lists of fixed capacity.
//! Not here: where priorities come from (`screen_error`), what hangs on diamonds (`cover`).
//!
//! The mesh after a frame is the one that judging every diamond would give. Below the tolerance
//! this needs no order. In the budget it does, and there is one: by priority, level and key, so
//! that no two diamonds tie. A certain leaf is below the leaf threshold and a certain parent above
//! the parent threshold; before a choice could depend on them, the threshold is moved and those
//! that may have been passed are judged.

use super::agenda::{Agenda, Band, Placement, Verdict, WARM};
use super::diamonds::{DiamondId, Diamonds, Role, Seat};
use super::wheel::Motion;
use crate::datasource::PageKey;
use core::cmp::Ordering;

/// Verdicts computed together where there are many, so that workers can share them.
const BLOCK: usize = 4096;
/// Where there are few: their records stay in the first cache until they are seated.
const SMALL_BLOCK: usize = 256;

/// While the counts of operations end a frame and not the budget, leaves below this share of the
/// greatest priority count as certain.
const GROWTH: f64 = 0.5;

/// Records of a mesh that is in the second cache anyway.
const CACHED: u32 = 1 << 17;

/// Share of a threshold by which the thresholds enclose the priority where both sides meet: more
/// of it means more urgent diamonds, less of it more moves of the thresholds.
const MARGIN: f64 = 0.001;

/// Share by which a threshold moves beyond what is asked for: what may have been passed is judged
/// at once, so small moves make small frames. Each further move of a frame is twice as far.
const STEP: f64 = 0.0005;

/// Where priorities come from and what hangs on diamonds: the planet, or a workload.
pub trait Rule: Sync {
    /// Judges a leaf or a parent against its threshold.
    fn judge(&self, diamonds: &Diamonds, id: DiamondId, band: Band) -> Verdict;

    /// Whether the kids of `id` could be made now.
    ///
    /// # Errors
    /// The page that is lacking.
    fn kids_ready(&self, diamonds: &Diamonds, id: DiamondId) -> Result<(), PageKey>;

    /// Called after `id` was split.
    fn follow_split(&mut self, diamonds: &Diamonds, id: DiamondId);

    /// Called before `id` is merged.
    fn prepare_merge(&mut self, diamonds: &Diamonds, id: DiamondId);
}

/// What bounds one frame's refinement.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Knobs {
    /// Error on the screen that may stay, pixels.
    pub tolerance_px: f64,
    /// Most leaf triangles.
    pub leaves_max: u32,
    /// Most splits in one frame.
    pub splits_max: u32,
    /// Most merges in one frame.
    pub merges_max: u32,
    /// Leaves of this level are not split.
    pub level_max: u8,
}

/// Counts of one frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Refinement {
    /// Diamonds split, forced ones included.
    pub splits: u32,
    /// Diamonds merged.
    pub merges: u32,
    /// Diamonds judged.
    pub evaluations: u32,
    /// Splits that waited for a page.
    pub blocked: u32,
    /// No leaf is worse than this, in pixels: the tolerance where it decides.
    pub error_px_bound: f64,
}

/// The surface and its agenda.
pub struct Mesh {
    /// Every diamond with a record.
    pub diamonds: Diamonds,
    /// When to look at which.
    pub agenda: Agenda,
    /// What blocked splits of this frame lack, with their priorities.
    pub lacking: Vec<(f64, PageKey)>,
    knobs: Knobs,
    done: Refinement,
    frame: u32,
    chain: Vec<DiamondId>,
    /// Split or merged in this frame: judged at its end, since they cannot change again in it.
    late: Vec<DiamondId>,
    placements: Vec<Placement>,
    /// Worst urgent leaf that is too deep to be split.
    deepest_px: f64,
    /// Worst leaf that waits.
    waiting_px: f64,
    /// How far beyond what is asked for a threshold moves next.
    step: f64,
}

/// Spreads a pass over a column of placements: `spread(column, body)` calls `body` with the index of
/// each chunk's first element and the chunk.
pub type Spread<'a> = &'a dyn Fn(&mut [Placement], &(dyn Fn(usize, &mut [Placement]) + Sync));

impl Mesh {
    /// An empty mesh; every list is allocated here.
    pub fn new(capacity: u32, knobs: Knobs) -> Self {
        let operations = knobs.splits_max.saturating_add(knobs.merges_max).min(capacity) as usize;
        Self {
            diamonds: Diamonds::new(capacity),
            agenda: Agenda::new(capacity, knobs.tolerance_px),
            lacking: Vec::with_capacity(capacity as usize),
            knobs,
            done: Refinement::default(),
            frame: 0,
            chain: Vec::with_capacity(128),
            late: Vec::with_capacity(operations),
            placements: vec![Placement::Urgent(0.0); BLOCK.min(capacity as usize)],
            deepest_px: 0.0,
            waiting_px: 0.0,
            step: STEP,
        }
    }

    /// Creates the base over which everything follows.
    pub fn create_base(&mut self) -> [DiamondId; 4] {
        let base = self.diamonds.create_base();
        self.late.extend(base);
        base
    }

    /// First half of a frame: judges what the motion made due, `None` being all there is.
    pub fn prioritise(
        &mut self,
        judge: &(impl Fn(&Diamonds, DiamondId, Band) -> Verdict + Sync),
        motion: Option<Motion>,
        spread: Spread<'_>,
    ) -> u32 {
        self.frame = self.frame.wrapping_add(1);
        self.done = Refinement::default();
        if motion.is_none_or(|motion| !motion.is_none()) {
            self.deepest_px = 0.0;
        }
        self.agenda.start(&mut self.diamonds, motion);
        self.judge_due(judge, spread);
        self.done.evaluations
    }

    fn judge_due(
        &mut self,
        judge: &(impl Fn(&Diamonds, DiamondId, Band) -> Verdict + Sync),
        spread: Spread<'_>,
    ) {
        let due = self.agenda.take_due();
        let mut placements = core::mem::take(&mut self.placements);
        let band = self.agenda.band();
        let block = if due.len() > 2 * BLOCK { BLOCK } else { SMALL_BLOCK };
        for ids in due.chunks(block) {
            let placements = &mut placements[..ids.len()];
            let (diamonds, agenda) = (&self.diamonds, &self.agenda);
            spread(placements, &|first, chunk| {
                diamonds.warm(&ids[first..first + chunk.len()]);
                let place = |id| agenda.placement(&judge(diamonds, id, band));
                chunk.iter_mut().zip(&ids[first..]).for_each(|(to, &id)| *to = place(id));
            });
            ids.iter().zip(placements).for_each(|(&id, &mut placement)| self.seat(id, placement));
        }
        self.done.evaluations += u32::try_from(due.len()).expect("diamonds are counted in u32");
        self.placements = placements;
        self.agenda.judged(due);
    }

    #[inline]
    fn seat(&mut self, id: DiamondId, placement: Placement) {
        if let Placement::Urgent(priority_px) = placement {
            let record = &self.diamonds[id];
            if record.level() >= self.knobs.level_max && !record.is_split() {
                self.deepest_px = self.deepest_px.max(priority_px);
                self.agenda.seat_soon(&mut self.diamonds, id);
                return;
            }
        }
        self.agenda.seat(&mut self.diamonds, id, placement);
    }

    fn judge(&mut self, rule: &impl Rule, id: DiamondId) {
        let verdict = rule.judge(&self.diamonds, id, self.agenda.band());
        self.done.evaluations += 1;
        self.seat(id, self.agenda.placement(&verdict));
    }

    /// Whether every verdict that is taken to last is still what would be said now; for checks.
    ///
    /// # Errors
    /// The first that is not, in words.
    pub fn check(
        &self,
        judge: &impl Fn(&Diamonds, DiamondId, Band) -> Verdict,
    ) -> Result<(), String> {
        self.agenda.check(&self.diamonds)?;
        let band = self.agenda.band();
        let mut certain = self.agenda.certain().into_iter();
        let wrong = certain.find_map(|id| match judge(&self.diamonds, id, band) {
            Verdict::Urgent(priority_px) => Some((id, priority_px)),
            Verdict::Certain(_) => None,
        });
        wrong.map_or(Ok(()), |(id, px)| {
            Err(format!(
                "{id:?} has {px} px and passes for certain: {band:?} {:?}",
                self.diamonds[id]
            ))
        })
    }

    /// Second half of a frame. Merges come first and have a count of their own, so that splits
    /// cannot starve them, at any speed.
    pub fn refine(&mut self, rule: &mut impl Rule) -> Refinement {
        self.lacking.clear();
        self.waiting_px = 0.0;
        self.step = STEP / 2.0;
        self.judge_late(rule);
        self.merge_needless(rule);
        self.look_ahead(Role::Leaf, self.knobs.splits_max);
        while self.done.splits < self.knobs.splits_max {
            self.warm_every(self.done.splits);
            if !self.split_first(rule) {
                break;
            }
        }
        self.judge_late(rule);
        self.relax_thresholds();
        self.done.error_px_bound = self.error_px_bound();
        self.done
    }

    /// Judges what was split or merged; some of it may be gone or seated by now.
    fn judge_late(&mut self, rule: &impl Rule) {
        let mut late = core::mem::take(&mut self.late);
        for &id in &late {
            let record = &self.diamonds[id];
            if record.seat == Seat::None && record.role() != Role::Interior {
                self.judge(rule, id);
            }
        }
        late.clear();
        self.late = late;
    }

    /// Merges what the tolerance does not ask for: one exact threshold, no hysteresis.
    fn merge_needless(&mut self, rule: &mut impl Rule) {
        self.look_ahead(Role::Parent, self.knobs.merges_max);
        while self.done.merges < self.knobs.merges_max {
            let Some(id) = self.agenda.first_parent(&mut self.diamonds) else { break };
            if self.agenda.priority_px[id] > self.knobs.tolerance_px {
                break;
            }
            self.warm_every(self.done.merges);
            self.merge(rule, id);
        }
    }

    /// Whether memory is worth to be loaded ahead: where the tolerance decides, every urgent
    /// diamond is operated on, and a large mesh is in no cache.
    fn warms(&self) -> bool {
        let sure = self.agenda.band().parent_px <= self.knobs.tolerance_px;
        sure && self.diamonds.live() > CACHED
    }

    fn look_ahead(&mut self, role: Role, most: u32) {
        if self.warms() {
            self.agenda.look_ahead(&self.diamonds, role, most);
        }
    }

    fn warm_every(&mut self, operation: u32) {
        if (operation as usize).is_multiple_of(WARM) && self.warms() {
            self.agenda.warm_next(&self.diamonds);
        }
    }

    /// Splits the first of the urgent leaves, with its ancestors; where the budget is full, merges
    /// the least parent for it while that is worth less. False when nothing more can be done.
    fn split_first(&mut self, rule: &mut impl Rule) -> bool {
        let Some(id) = self.agenda.first_leaf(&mut self.diamonds) else {
            return self.look_deeper(rule, 0.0);
        };
        let priority_px = self.agenda.priority_px[id];
        if priority_px < self.agenda.band().leaf_px {
            return self.look_deeper(rule, priority_px);
        }
        match self.plan(rule, id) {
            Err(lacking) => {
                self.lacking.push((priority_px, lacking));
                self.done.blocked += 1;
                self.wait(id);
                return true;
            }
            // Merged in this frame: not split in it. It waits as if for a page.
            Ok(()) if self.chain.iter().any(|&id| self.diamonds[id].is_touched(self.frame)) => {
                self.wait(id);
                return true;
            }
            Ok(()) => {}
        }
        let cost = u32::try_from(self.chain.len()).expect("a chain is as long as there are levels");
        if self.done.splits + cost > self.knobs.splits_max {
            return false;
        }
        if self.diamonds.leaves() + 2 * cost > self.knobs.leaves_max {
            return self.make_room(rule, id);
        }
        for at in 0..self.chain.len() {
            self.split(rule, self.chain[at]);
        }
        true
    }

    fn wait(&mut self, id: DiamondId) {
        self.waiting_px = self.waiting_px.max(self.agenda.priority_px[id]);
        self.agenda.wait(&mut self.diamonds, id);
    }

    /// No known leaf is as urgent as the threshold says, `known_px` at most: certain ones below it
    /// may come first. Lowers the threshold; false if it is at the tolerance.
    fn look_deeper(&mut self, rule: &impl Rule, known_px: f64) -> bool {
        let Band { leaf_px, .. } = self.agenda.band();
        let floor_px = self.knobs.tolerance_px.next_up();
        if leaf_px <= floor_px {
            return false;
        }
        self.step = 0.5_f64.min(2.0 * self.step);
        let to_px = known_px.max(leaf_px * (1.0 - self.step)).max(floor_px);
        self.agenda.lower_leaf_threshold(to_px);
        self.judge_due(&|diamonds: &Diamonds, id, band| rule.judge(diamonds, id, band), ALONE);
        true
    }

    /// Merges the least parent if it is worth less than `top`, which wants the room.
    fn make_room(&mut self, rule: &mut impl Rule, top: DiamondId) -> bool {
        if self.done.merges >= self.knobs.merges_max {
            return false;
        }
        let rank = self.agenda.rank(&self.diamonds, top);
        let least_px = self.least_parent_px();
        let Band { parent_px, .. } = self.agenda.band();
        if least_px > parent_px && rank.priority_px > parent_px {
            // A certain parent might be the least and worth less.
            self.step = 0.5_f64.min(2.0 * self.step);
            self.agenda.raise_parent_threshold(rank.priority_px * (1.0 + self.step));
            self.judge_due(&|diamonds: &Diamonds, id, band| rule.judge(diamonds, id, band), ALONE);
            return true;
        }
        let Some(least) = self.agenda.first_parent(&mut self.diamonds) else { return false };
        let needed = self.diamonds[top].parents().contains(&Some(least));
        let overlap = self.agenda.rank(&self.diamonds, least).order(&rank) == Ordering::Less;
        if needed || !overlap {
            return false;
        }
        self.merge(rule, least);
        true
    }

    /// Priority of the least urgent parent.
    fn least_parent_px(&mut self) -> f64 {
        let least = self.agenda.first_parent(&mut self.diamonds);
        least.map_or(f64::INFINITY, |id| self.agenda.priority_px[id])
    }

    /// Where the budget binds, the thresholds enclose the priority at which both sides meet, no
    /// wider than need be; otherwise they return to the tolerance.
    fn relax_thresholds(&mut self) {
        let Band { leaf_px, parent_px, .. } = self.agenda.band();
        let tolerance_px = self.knobs.tolerance_px;
        let full = self.diamonds.leaves() + 2 > self.knobs.leaves_max;
        let first = self.agenda.first_leaf(&mut self.diamonds);
        let first_px = first.map_or(0.0, |id| self.agenda.priority_px[id]);
        if !full {
            // What is far from being split need not be known exactly while the mesh grows.
            self.agenda.relax(leaf_px.max(GROWTH * first_px), tolerance_px);
            return;
        }
        let meet_px = first_px.max(leaf_px);
        let below_px = meet_px * (1.0 - MARGIN);
        let above_px = (meet_px * (1.0 + MARGIN)).max(tolerance_px);
        self.agenda.relax(
            if leaf_px < below_px * (1.0 - MARGIN) { below_px } else { leaf_px },
            if parent_px > above_px * (1.0 + MARGIN) { above_px } else { parent_px },
        );
    }

    fn error_px_bound(&mut self) -> f64 {
        let first = self.agenda.first_leaf(&mut self.diamonds);
        let first_px = first.map_or(0.0, |id| self.agenda.priority_px[id]);
        let leaf_px = self.agenda.band().leaf_px;
        let tolerance_px = self.knobs.tolerance_px;
        let certain_px = if leaf_px > tolerance_px.next_up() { leaf_px } else { tolerance_px };
        certain_px.max(first_px).max(self.waiting_px).max(self.deepest_px)
    }

    /// The diamonds to split so that `id` is: ancestors first, `id` last, into `chain`.
    fn plan(&mut self, rule: &impl Rule, id: DiamondId) -> Result<(), PageKey> {
        self.chain.clear();
        plan(&self.diamonds, rule, id, &mut self.chain)
    }

    fn split(&mut self, rule: &mut impl Rule, id: DiamondId) {
        self.agenda.unseat(&mut self.diamonds, id);
        let parents = self.diamonds[id].parents();
        for parent in parents.into_iter().flatten() {
            self.agenda.unseat(&mut self.diamonds, parent);
        }
        self.diamonds.split(id, self.frame);
        rule.follow_split(&self.diamonds, id);
        for kid in self.diamonds[id].kids().into_iter().flatten() {
            let record = &self.diamonds[kid];
            // A kid merged in this frame cannot be split in it.
            if record.seat == Seat::None && !record.is_touched(self.frame) {
                self.judge(rule, kid);
            }
        }
        self.late.push(id);
        self.done.splits += 1;
    }

    fn merge(&mut self, rule: &mut impl Rule, id: DiamondId) {
        self.agenda.unseat(&mut self.diamonds, id);
        rule.prepare_merge(&self.diamonds, id);
        let agenda = &mut self.agenda;
        self.diamonds.merge(id, self.frame, |diamonds, kid| agenda.unseat(diamonds, kid));
        let parents = self.diamonds[id].parents();
        for parent in parents.into_iter().flatten() {
            let touched = self.diamonds[parent].is_touched(self.frame);
            if self.diamonds[parent].role() == Role::Parent && !touched {
                self.judge(rule, parent);
            }
        }
        self.late.push(id);
        self.done.merges += 1;
    }
}

/// A pass on this thread.
pub const ALONE: Spread<'static> = &|column, body| body(0, column);

fn plan(
    diamonds: &Diamonds,
    rule: &impl Rule,
    id: DiamondId,
    chain: &mut Vec<DiamondId>,
) -> Result<(), PageKey> {
    for parent in diamonds[id].parents().into_iter().flatten() {
        if !diamonds[parent].is_split() && !chain.contains(&parent) {
            plan(diamonds, rule, parent, chain)?;
        }
    }
    rule.kids_ready(diamonds, id)?;
    chain.push(id);
    Ok(())
}

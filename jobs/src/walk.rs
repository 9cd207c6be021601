//! One run of a graph: which node is ready, who runs it, when it is over.
//!
//! In:    a compiled [`Plan`], the work behind its nodes, the crew if it is free.
//! Out:   every node run or skipped once, after those before it.
//! Keeps: nothing; the plan's counters end a run as they began it.
//! Not here: closures, panics and times (`run`), sleeping and waking (`crew`).

use crate::chaos::Chaos;
use crate::crew::{Call, Crew};
use crate::plan::{Job, Kind, NONE, Node, Plan};
use crate::sync::{Shim, Word};
use crate::tickets::{Batch, ITEMS_MAX, Share};
use std::ops::Range;
use std::sync::atomic::Ordering;

/// What one worker knows during a run.
pub(crate) struct Hand {
    /// The worker; 0 is the caller.
    pub(crate) lane: usize,
    /// The end of what this worker did last, if what it does next begins then; else 0.
    pub(crate) clock_ns: u64,
    /// Since when it has found nothing to do; 0 while it has, or while nobody wants to know.
    pub(crate) idle_ns: u64,
}

impl Hand {
    pub(crate) fn new(lane: usize) -> Hand {
        Hand { lane, clock_ns: 0, idle_ns: 0 }
    }
}

/// What a walk over a plan does at its nodes.
pub(crate) trait Work: Sync {
    /// Whether nodes not yet begun are to be skipped.
    fn is_cancelled(&self) -> bool;
    /// Runs a stage, then the one that `follow` names, and so on. Returns the last one, and
    /// `false` if it failed; `follow` is not asked then.
    fn stages(
        &self,
        first: u32,
        hand: &mut Hand,
        follow: impl FnMut(u32) -> Option<u32>,
    ) -> (u32, bool);
    /// Begins a node of chunks and counts them; `None` if that failed.
    fn count(&self, node: u32, hand: &mut Hand) -> Option<usize>;
    /// Runs chunks until `claim` has no more; `false` if one failed.
    fn chunks(
        &self,
        node: u32,
        hand: &mut Hand,
        claim: &mut dyn FnMut() -> Option<Range<usize>>,
    ) -> bool;
    /// All chunks of the node are done.
    fn chunks_end(&self, node: u32, hand: &mut Hand);
    /// This worker found nothing to do.
    fn idle(&self, hand: &mut Hand);
    /// It found something again, or leaves.
    fn busy(&self, hand: &mut Hand, parked: bool);
}

/// Predecessors done but not yet counted, all of one node.
struct Owed {
    node: u32,
    times: u64,
}

/// A run under way, on the stack of its caller.
pub(crate) struct Walk<'a, W, S: Shim> {
    pub(crate) plan: &'a Plan<S>,
    pub(crate) work: &'a W,
    /// `None` while the crew serves another run.
    pub(crate) crew: Option<&'a Crew<S>>,
    /// 1 after the last node.
    done: S::Word,
    /// 1 when a node failed or was skipped.
    trouble: S::Word,
    is_chaotic: bool,
    /// Somebody slept when the run began: what stages last is measured, to know whether to wake.
    learns: bool,
}

impl<'a, W: Work, S: Shim> Walk<'a, W, S> {
    pub(crate) fn new(plan: &'a Plan<S>, work: &'a W, crew: Option<&'a Crew<S>>) -> Self {
        plan.ready.arm();
        let is_chaotic = crew.is_some_and(|crew| crew.chaos().is_some());
        let (done, trouble) = (S::Word::new(0), S::Word::new(0));
        let learns = crew.is_some_and(Crew::anyone_sleeps);
        Walk { plan, work, crew, done, trouble, is_chaotic, learns }
    }

    /// Starts the run and works as the caller until all is done.
    pub(crate) fn lead(&self) {
        if self.plan.is_empty() {
            return;
        }
        let mut hand = Hand::new(0);
        let first = self.finish(self.plan.source(), true, &mut hand);
        self.go_on(first, &mut hand);
        self.work_on(hand);
    }

    /// Works as a worker. Leaves when all is done, or when there is nothing to do for a while, so
    /// that the end of a run waits for nobody who sleeps.
    pub(crate) fn help(&self, lane: usize) {
        self.work_on(Hand::new(lane));
    }

    fn work_on(&self, mut hand: Hand) {
        let lane = hand.lane;
        loop {
            if let Some(crew) = self.crew {
                crew.look(lane);
            }
            if self.done.load(Ordering::Acquire) != 0 {
                break;
            }
            if let Some(job) = self.take(lane) {
                self.work.busy(&mut hand, false);
                hand.clock_ns = 0;
                self.perform(job, &mut hand);
                continue;
            }
            let crew = self.crew.expect("a caller alone finds something until all is done");
            if crew.join_loop(lane) {
                continue;
            }
            self.work.idle(&mut hand);
            if crew.spin(lane) {
                continue;
            }
            if lane != 0 {
                break;
            }
            self.work.busy(&mut hand, false);
            self.work.idle(&mut hand);
            crew.sleep(0);
            self.work.busy(&mut hand, true);
        }
        self.work.busy(&mut hand, false);
    }

    fn chaos(&self) -> Option<&'a Chaos> {
        if self.is_chaotic { self.crew.and_then(Crew::chaos) } else { None }
    }

    /// Finds something to do.
    fn take(&self, lane: usize) -> Option<Taken> {
        let ready = &self.plan.ready;
        if lane == 0 && self.plan.has_pinned {
            let pinned = ready.find(Job::CALLER, |number| self.seize(Job::of(number)));
            if pinned.is_some() {
                return pinned;
            }
        }
        if let Some(chaos) = self.chaos() {
            let some = |number| chaos.coin(lane).then(|| self.seize(Job::of(number))).flatten();
            let taken = ready.find(Job::ANYBODY, some);
            if taken.is_some() {
                return taken;
            }
        }
        ready.find(Job::ANYBODY, |number| self.seize(Job::of(number)))
    }

    /// Makes a job this worker's, unless it is gone.
    fn seize(&self, job: Job) -> Option<Taken> {
        let (node, batch) = match job {
            Job::Begin(_) | Job::Pinned(_) => {
                return self.plan.ready.remove(job.number()).then_some(Taken { job, batch: None });
            }
            Job::Chunks(node) => {
                let tickets = self.plan.nodes[node as usize].chunks;
                (node, self.plan.tickets[tickets as usize].enter(self.chunk_share()))
            }
            Job::Followers(node) => {
                let tickets = self.plan.nodes[node as usize].followers;
                (node, self.plan.tickets[tickets as usize].enter(self.follower_share(node)))
            }
        };
        let batch = batch?;
        if matches!(job, Job::Followers(_)) {
            self.retire_followers(node, &batch);
        }
        Some(Taken { job, batch: Some((node, batch)) })
    }

    /// Takes followers out of the set when the last one is claimed. (Chunks stay until the last one
    /// is done: whoever finishes them adds what comes next to the same word.)
    fn retire_followers(&self, node: u32, batch: &Batch) {
        if batch.last {
            self.plan.ready.remove(Job::Followers(node).number());
        }
    }

    fn perform(&self, taken: Taken, hand: &mut Hand) {
        match (taken.job, taken.batch) {
            (Job::Chunks(_), Some((node, batch))) => {
                let next = self.share_chunks(node, batch, None, hand);
                self.go_on(next, hand);
            }
            (_, Some((node, batch))) => self.share_followers(node, batch, hand),
            (Job::Begin(node) | Job::Pinned(node), None) => self.go_on(Some(node), hand),
            (Job::Chunks(_) | Job::Followers(_), None) => unreachable!("seized with a batch"),
        }
    }

    /// Runs a node, then one of those that it made ready, and so on.
    fn go_on(&self, mut next: Option<u32>, hand: &mut Hand) {
        while let Some(node) = next {
            next = self.step(node, hand);
        }
    }

    fn step(&self, node: u32, hand: &mut Hand) -> Option<u32> {
        if let Some(chaos) = self.chaos() {
            chaos.pause(hand.lane);
        }
        let kind = self.plan.nodes[node as usize].kind;
        if kind == Kind::End {
            self.end();
            return None;
        }
        if self.is_skipped(node) {
            return self.finish(node, false, hand);
        }
        match kind {
            Kind::Each => self.timed(Job::Begin(node), 1, || self.begin_chunks(node, hand)),
            Kind::Pinned if hand.lane != 0 => {
                self.offer(node);
                None
            }
            _ => {
                let stages = || self.work.stages(node, hand, |node| self.heir(node));
                let (last, passed) = self.timed(Job::Begin(node), 1, stages);
                self.finish(last, passed, hand)
            }
        }
    }

    /// Does `times` jobs of that kind, and remembers what one lasts if that is wanted.
    #[inline]
    fn timed<R>(&self, job: Job, times: usize, act: impl FnOnce() -> R) -> R {
        if !self.learns {
            return act();
        }
        let begin_ns = S::now_ns();
        let result = act();
        self.plan.learn(job, (S::now_ns() - begin_ns).div_ceil(times as u64));
        result
    }

    /// Tells the others of `offered` jobs. Sleepers are woken if these, and `next` that this worker
    /// goes on with, last a third of what a loop must: stages bring others after them.
    fn announce(&self, offered: usize, offered_ns: u64, next: Option<u32>) {
        let Some(crew) = self.crew.filter(|_| offered > 0) else { return };
        let next_ns = next.map_or(0, |node| self.plan.cost_ns(Job::Begin(node)));
        let is_long = next_ns.saturating_add(offered_ns) >= S::WORTH_NS / 3;
        if is_long || self.chaos().is_some() {
            crew.announce(offered);
        } else {
            crew.call_leader();
        }
    }

    /// Whether the node must not run.
    #[inline]
    fn is_skipped(&self, node: u32) -> bool {
        // Relaxed: who failed released the nodes that must know.
        (self.trouble.load(Ordering::Relaxed) != 0 && self.plan.absolve(node))
            || self.work.is_cancelled()
    }

    fn end(&self) {
        self.done.store(1, Ordering::Release);
        if let Some(crew) = self.crew {
            crew.announce_end();
        }
    }

    /// Puts a ready node where others find it; how long it lasts.
    fn offer(&self, node: u32) -> u64 {
        let pinned = self.plan.nodes[node as usize].kind == Kind::Pinned;
        let job = if pinned { Job::Pinned(node) } else { Job::Begin(node) };
        self.plan.ready.add(job.number());
        if let Some(crew) = self.crew.filter(|_| pinned) {
            crew.call_leader();
        }
        self.plan.cost_ns(job)
    }

    /// The stage that can follow `node` without a look at anything shared.
    #[inline]
    fn heir(&self, node: u32) -> Option<u32> {
        let heir = self.plan.nodes[node as usize].heir;
        (heir != NONE && !self.is_chaotic && !self.work.is_cancelled()).then_some(heir)
    }

    /// Releases the nodes after `node`; one that is ready is returned for this worker, the others
    /// are offered to all.
    fn finish(&self, node: u32, passed: bool, hand: &mut Hand) -> Option<u32> {
        let plan = self.plan;
        let at = &plan.nodes[node as usize];
        if !passed {
            self.trouble.store(1, Ordering::Relaxed);
            (at.lone..at.end).for_each(|index| plan.doom(plan.successor(index)));
        }
        let mut next = (at.lone < at.joint).then(|| plan.successor(at.lone));
        let mut offered = at.follower_count();
        let mut offered_ns = match offered {
            0 => 0,
            1 => self.offer(plan.successor(at.lone + 1)),
            _ => self.offer_followers(node, offered),
        };
        for index in at.joint..at.end {
            let after = plan.successor(index);
            if !plan.release(after, 1) {
                continue;
            }
            if next.is_none() {
                // Another predecessor may have ended after this worker last looked at the clock.
                hand.clock_ns = 0;
                next = Some(after);
            } else {
                offered_ns = offered_ns.saturating_add(self.offer(after));
                offered += 1;
            }
        }
        if let Some(chaos) = self.chaos()
            && let Some(node) = next
            && plan.nodes[node as usize].kind != Kind::End
            && chaos.coin(hand.lane)
        {
            self.offer(node);
            (next, offered) = (None, offered + 1);
        }
        self.announce(offered, offered_ns, next);
        next
    }

    /// Puts the followers where others find them; how long they last, one after the other.
    fn offer_followers(&self, node: u32, count: usize) -> u64 {
        let tickets = self.plan.nodes[node as usize].followers;
        self.plan.tickets[tickets as usize].offer(count);
        self.plan.ready.add(Job::Followers(node).number());
        self.plan.cost_ns(Job::Followers(node)).saturating_mul(count as u64)
    }

    /// Counts what is owed; a node that became ready is returned.
    fn pay(&self, owed: &mut Option<Owed>) -> Option<u32> {
        let Owed { node, times } = owed.take()?;
        self.plan.release(node, times).then_some(node)
    }

    /// Runs followers of `node` as long as there are any, `batch` first.
    fn share_followers(&self, node: u32, batch: Batch, hand: &mut Hand) {
        let at = self.plan.nodes[node as usize];
        let tickets = &self.plan.tickets[at.followers as usize];
        let share = self.follower_share(node);
        let mut owed = None;
        let mut next = Some(batch);
        while let Some(batch) = next {
            let items = batch.items.clone();
            self.timed(Job::Followers(node), items.len(), || match at.fan {
                true => self.run_leaves(&at, items, &mut owed, hand),
                false => items.for_each(|item| self.go_on(Some(self.follower(&at, item)), hand)),
            });
            next = tickets.claim(&batch, share);
            if let Some(batch) = &next {
                self.retire_followers(node, batch);
            }
        }
        tickets.leave();
        let ready = self.pay(&mut owed);
        hand.clock_ns = 0;
        self.go_on(ready, hand);
    }

    #[inline]
    fn follower(&self, at: &Node, item: usize) -> u32 {
        self.plan.successors[at.lone as usize + 1 + item]
    }

    /// Runs stages with tails, and counts them only when the next has another tail: the tail waits
    /// for that one anyway, so nothing is late.
    fn run_leaves(
        &self,
        at: &Node,
        mut items: Range<usize>,
        owed: &mut Option<Owed>,
        hand: &mut Hand,
    ) {
        let tail_of = |node: u32| self.plan.nodes[node as usize].tail;
        while let Some(first) = items.next().map(|item| self.follower(at, item)) {
            let tail = tail_of(first);
            self.settle(owed, tail);
            self.chaos().inspect(|chaos| chaos.pause(hand.lane));
            let mut times = 1;
            let follow = |_| {
                let next = self.follower(at, items.clone().next()?);
                let calm = self.trouble.load(Ordering::Relaxed) == 0 && !self.work.is_cancelled();
                let goes_on = calm && tail_of(next) == tail;
                items.start += usize::from(goes_on);
                times += u64::from(goes_on);
                goes_on.then_some(next)
            };
            if self.is_skipped(first) || !self.work.stages(first, hand, follow).1 {
                self.trouble.store(1, Ordering::Relaxed);
                self.plan.doom(tail);
            }
            owed.get_or_insert(Owed { node: tail, times: 0 }).times += times;
        }
    }

    /// Pays what is owed to others than `tail`.
    fn settle(&self, owed: &mut Option<Owed>, tail: u32) {
        if owed.as_ref().is_some_and(|owed| owed.node != tail)
            && let Some(ready) = self.pay(owed)
        {
            let ready_ns = self.offer(ready);
            self.announce(1, ready_ns, None);
        }
    }

    /// Begins a node of chunks and takes part in it.
    fn begin_chunks(&self, node: u32, hand: &mut Hand) -> Option<u32> {
        let count = self.work.count(node, hand);
        debug_assert!(count.is_none_or(|count| count <= ITEMS_MAX));
        match count {
            None => return self.finish(node, false, hand),
            Some(0) => {
                self.work.chunks_end(node, hand);
                return self.finish(node, true, hand);
            }
            Some(_) => {}
        }
        let count = count.unwrap_or(0);
        let tickets = self.plan.nodes[node as usize].chunks;
        let mut share = self.chunk_share();
        if self.crew.is_some_and(Crew::anyone_sleeps) {
            // The first chunk shows whether to wake them.
            share.most = 1;
        }
        let batch = self.plan.tickets[tickets as usize].open(count, share);
        let call = self.crew.filter(|_| !batch.last).map(|crew| {
            self.plan.ready.add(Job::Chunks(node).number());
            crew.announce_loop(count - 1)
        });
        self.share_chunks(node, batch, call, hand)
    }

    /// Runs chunks of `node` as long as there are any, `batch` first; whoever leaves last finishes
    /// the node and gets what that made ready. Who opened the node has a `call`.
    fn share_chunks(
        &self,
        node: u32,
        batch: Batch,
        mut call: Option<Call<'_, S>>,
        hand: &mut Hand,
    ) -> Option<u32> {
        let tickets = &self.plan.tickets[self.plan.nodes[node as usize].chunks as usize];
        let (share, chaos, lane) = (self.chunk_share(), self.chaos(), hand.lane);
        let (mut done, mut own) = (0, batch);
        let mut claim = || {
            if done > 0 {
                own = tickets.claim(&own, share)?;
                call.iter_mut().for_each(|call| call.progress(done, own.left() + 1));
            }
            let items = own.items.clone();
            done += items.len();
            Some(chaos.map_or(items.clone(), |chaos| {
                chaos.pause(lane);
                let count = tickets.count();
                count - items.end..count - items.start
            }))
        };
        if !self.work.chunks(node, hand, &mut claim) {
            self.plan.doom(node);
            self.trouble.store(1, Ordering::Relaxed);
            tickets.stop();
        }
        if !tickets.leave() {
            return None;
        }
        if self.crew.is_some() {
            self.plan.ready.remove(Job::Chunks(node).number());
        }
        let passed = self.trouble.load(Ordering::Relaxed) == 0 || !self.plan.absolve(node);
        self.work.chunks_end(node, hand);
        self.finish(node, passed, hand)
    }

    fn chunk_share(&self) -> Share {
        let helpers = self.crew.map_or(0, Crew::count) as u64;
        match helpers {
            0 => Share { parts: 1, most: u64::MAX },
            _ if self.chaos().is_some() => Share { parts: 1, most: 1 },
            _ => Share { parts: CHUNK_PARTS * (helpers + 1), most: u64::MAX },
        }
    }

    fn follower_share(&self, node: u32) -> Share {
        let helpers = self.crew.map_or(0, Crew::count) as u64;
        let fan = self.plan.nodes[node as usize].fan && self.chaos().is_none();
        Share { parts: 8 * (helpers + 1), most: if fan { FOLLOWERS_MOST } else { 1 } }
    }
}

/// Parts of the rest per thread: a claim of chunks takes half of a fair share of them. A whole
/// share would save claims (8.2 instead of 12 µs for 8 loops of 64 empty chunks, 2 threads), but
/// where the first chunks are the long ones the first claim would be the last to end.
const CHUNK_PARTS: u64 = 2;

/// Most stages that one worker claims at once; stages, unlike chunks, differ in length.
const FOLLOWERS_MOST: u64 = 64;

/// A job that is this worker's.
struct Taken {
    job: Job,
    batch: Option<(u32, Batch)>,
}

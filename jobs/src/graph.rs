//! A graph of stages: built once, run every frame.
//!
//! In:    stages with a name, closures and the stages before them; per run a context.
//! Out:   the stages' effects on the context, their times, the first panic.
//! Keeps: the edges compiled to flat arrays, the workers' scratch, the times of the last run.
//! Not here: who runs what during a run (`walk`), loops inside a stage (`team`).

use crate::cancel::{Cancel, Stopped};
use crate::frame::Frame;
use crate::log::Log;
use crate::plan::{Kind, Plan};
use crate::run::{Body, Deeds, Stage, StagePanic, in_ranges};
use crate::scratch::{Blocks, Scratch};
use crate::spans::{Span, Spans};
use crate::sync::Std;
use crate::team::{Desk, Team};
use crate::walk::Walk;
use crate::workers::Workers;
use crossbeam::utils::CachePadded;
use parking_lot::Mutex;
use std::sync::atomic::AtomicBool;

/// A stage of the graph that returned it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct StageId(u32);

/// Stages and their order, over a context `C` that they share.
///
/// Edges are the only order: two stages without a path between them may run at the same time, so
/// what they both touch in the context needs a lock, or an edge. Among stages that are ready, one
/// that was added earlier starts earlier.
pub struct Graph<C> {
    stages: Vec<Stage<C>>,
    kinds: Vec<Kind>,
    /// Pairs (before, after).
    edges: Vec<(u32, u32)>,
    /// `None` until the first run after a change.
    plan: Option<Plan<Std>>,
    blocks: Blocks,
    log: Log,
    records: bool,
    spans: Spans,
}

impl<C: Sync> Graph<C> {
    /// A graph without stages. Running it does nothing.
    pub fn new() -> Self {
        Graph {
            stages: Vec::new(),
            kinds: Vec::new(),
            edges: Vec::new(),
            plan: None,
            blocks: Blocks::default(),
            log: Log::default(),
            records: true,
            spans: Spans::default(),
        }
    }

    /// Adds a stage that runs after all stages in `after`, which makes cycles impossible.
    ///
    /// # Panics
    /// If `after` names a stage that this graph does not have yet.
    pub fn stage(
        &mut self,
        span: Span,
        after: &[StageId],
        run: impl Fn(&C, &Team<'_>) + Send + Sync + 'static,
    ) -> StageId {
        self.add(Kind::Stage, Stage { span, body: Body::Once(Box::new(run)) }, after)
    }

    /// Like [`Graph::stage`], but always on the thread that calls [`Graph::run`].
    ///
    /// # Panics
    /// If `after` names a stage that this graph does not have yet.
    pub fn pinned(
        &mut self,
        span: Span,
        after: &[StageId],
        run: impl Fn(&C, &Team<'_>) + Send + Sync + 'static,
    ) -> StageId {
        self.add(Kind::Pinned, Stage { span, body: Body::Once(Box::new(run)) }, after)
    }

    /// Adds a parallel-for as a stage of its own: `count` says how many chunks there are, `body` is
    /// called once for each, on all workers that have nothing else to do. The stage is over when
    /// the last chunk is; no worker waits for it.
    ///
    /// What a chunk is must follow from its number and the context alone. Chunks should last 2 to
    /// 50 µs; several may go to one worker at once. `count` panics, as its stage, above 2^28 - 1.
    ///
    /// # Panics
    /// If `after` names a stage that this graph does not have yet.
    pub fn each(
        &mut self,
        span: Span,
        after: &[StageId],
        count: impl Fn(&C) -> usize + Send + Sync + 'static,
        body: impl Fn(&C, usize, &mut Scratch<'_>) + Send + Sync + 'static,
    ) -> StageId {
        let body = Body::Each(Box::new(count), in_ranges(body));
        self.add(Kind::Each, Stage { span, body }, after)
    }

    fn add(&mut self, kind: Kind, stage: Stage<C>, after: &[StageId]) -> StageId {
        let id = u32::try_from(self.stages.len()).expect("fewer than 2^32 stages");
        for before in after {
            assert!(before.0 < id, "stage {} must follow stages added before it", stage.span.0);
            self.edges.push((before.0, id));
        }
        self.stages.push(stage);
        self.kinds.push(kind);
        self.plan = None;
        StageId(id)
    }

    /// Whether runs write down times; they do at first. Without, a run reads the clock
    /// only when a thread spins for want of work, or judges a loop while another sleeps.
    pub fn record_spans(&mut self, on: bool) {
        self.records = on;
    }

    /// Size of each worker's [`Scratch`]; 0 at first. The next run allocates it.
    pub fn scratch_bytes(&mut self, bytes: usize) {
        self.blocks.resize(bytes);
    }

    /// Runs every stage once, on the caller and on the workers, and returns when all are done.
    ///
    /// The first run after a change of the graph, or with more workers, allocates; others do not.
    /// If no [frame](Workers::frame) is open, the run is one. If the workers are busy with another
    /// run, the caller does this one alone.
    ///
    /// # Errors
    /// [`StagePanic`] if a stage panicked. Graph and workers stay usable; what the stage left in
    /// the context is the caller's to judge.
    pub fn run(&mut self, context: &C, workers: &Workers) -> Result<(), StagePanic> {
        match self.run_with(context, workers, None) {
            Ok(()) => Ok(()),
            Err(Stopped::Panicked(panic)) => Err(panic),
            Err(Stopped::Cancelled) => unreachable!("nothing cancels this run"),
        }
    }

    /// Like [`Graph::run`], but skips the stages that are not begun when `cancel` is set. A stage
    /// that is begun runs to its end, with all its chunks.
    ///
    /// # Errors
    /// [`Stopped`] if a stage panicked or was skipped. Graph and workers stay usable.
    pub fn run_unless(
        &mut self,
        context: &C,
        workers: &Workers,
        cancel: &Cancel,
    ) -> Result<(), Stopped> {
        self.run_with(context, workers, Some(cancel))
    }

    fn run_with(
        &mut self,
        context: &C,
        workers: &Workers,
        cancel: Option<&Cancel>,
    ) -> Result<(), Stopped> {
        let claim = workers.crew().claim_run().filter(|_| workers.count() > 0);
        let crew = claim.is_some().then_some(workers.crew());
        let lanes = crew.map_or(0, |crew| crew.count()) + 1;
        self.blocks.begin(lanes);
        if self.records {
            self.log.begin(self.stages.len(), lanes);
        }
        let plan = self.plan.get_or_insert_with(|| Plan::new(&self.kinds, &self.edges));
        // Padded: the caller writes to its stack beside them while workers read them.
        let deeds = CachePadded::new(Deeds {
            stages: &self.stages,
            context,
            desk: Desk { crew, log: self.records.then_some(&self.log), blocks: &self.blocks },
            cancel,
            cancelled: AtomicBool::new(false),
            fault: Mutex::new(None),
        });
        let walk = CachePadded::new(Walk::new(plan, &*deeds, crew));
        match claim {
            Some(claim) => {
                let _frame = Frame::of_run(workers);
                // A worker that leaves and comes back needs another ticket; these last for hours.
                claim.open(&|lane| deeds.visited_by(lane, &walk), u32::MAX, || walk.lead());
            }
            None => walk.lead(),
        }
        let Deeds { fault, cancelled, .. } = CachePadded::into_inner(deeds);
        let (fault, cancelled) = (fault.into_inner(), cancelled.into_inner());
        if self.records {
            let stages = &self.stages;
            self.log.collect_into(&mut self.spans, lanes, |stage| stages[stage].span);
        } else {
            self.spans.clear();
        }
        match fault {
            Some(panic) => Err(Stopped::Panicked(panic)),
            None if cancelled => Err(Stopped::Cancelled),
            None => Ok(()),
        }
    }

    /// The times of the last run.
    pub fn spans(&self) -> &Spans {
        &self.spans
    }
}

impl<C: Sync> Default for Graph<C> {
    fn default() -> Self {
        Graph::new()
    }
}

//! A graph of stages: built once, run every frame.
//!
//! In:    stages with a name, a closure and the stages before them; per run a context.
//! Out:   the stages' effects on the context, their times, the first panic.
//! Keeps: the edges compiled to flat arrays, and the times of the last run.
//! Not here: who runs what during a run (`run`), loops inside a stage (`team`).

use crate::run::{Plan, Run, Stage, StagePanic};
use crate::spans::{Log, Span, Spans};
use crate::team::Team;
use crate::workers::Workers;
use parking_lot::Mutex;
use std::sync::atomic::AtomicUsize;

/// A stage of the graph that returned it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct StageId(u32);

/// Stages and their order, over a context `C` that they share.
///
/// Edges are the only order: two stages without a path between them may run at the same time, so
/// what they both touch in the context needs a lock, or an edge.
pub struct Graph<C> {
    stages: Vec<Stage<C>>,
    /// Pairs (before, after).
    edges: Vec<(u32, u32)>,
    /// `None` until the first run after a change.
    plan: Option<Plan>,
    log: Log,
    spans: Spans,
}

impl<C: Sync> Graph<C> {
    /// A graph without stages. Running it does nothing.
    pub fn new() -> Self {
        let (log, spans) = (Log::default(), Spans::default());
        Graph { stages: Vec::new(), edges: Vec::new(), plan: None, log, spans }
    }

    /// Adds a stage that runs after all stages in `after`, which makes cycles impossible.
    ///
    /// # Panics
    /// If `after` names a stage that this graph does not have yet.
    pub fn stage(
        &mut self,
        span: Span,
        after: &[StageId],
        run: impl Fn(&C, &Team) + Send + Sync + 'static,
    ) -> StageId {
        let id = u32::try_from(self.stages.len()).expect("fewer than 2^32 stages");
        for before in after {
            assert!(before.0 < id, "stage {} must follow stages added before it", span.0);
            self.edges.push((before.0, id));
        }
        self.stages.push(Stage { span, run: Box::new(run) });
        self.plan = None;
        StageId(id)
    }

    /// Runs every stage once, on the caller and on the workers, and returns when all are done.
    ///
    /// The first run after a change of the graph, or with more workers, allocates; others do not.
    /// If the workers are busy with another run, the caller does this one alone.
    ///
    /// # Errors
    /// [`StagePanic`] if a stage panicked. Graph and workers stay usable; what the stage left in
    /// the context is the caller's to judge.
    pub fn run(&mut self, context: &C, workers: &Workers) -> Result<(), StagePanic> {
        let count = self.stages.len();
        let crew = workers.crew();
        self.log.begin(count, crew.count() + 1);
        let stages = u32::try_from(count).expect("fewer than 2^32 stages");
        let plan = self.plan.get_or_insert_with(|| Plan::new(stages, &self.edges));
        let claim = crew.claim_run();
        let run = Run {
            stages: &self.stages,
            plan,
            context,
            crew: claim.is_some().then_some(crew),
            log: &self.log,
            pending: AtomicUsize::new(count),
            fault: Mutex::new(None),
        };
        match claim {
            // A worker that leaves and comes back needs another ticket; these last for hours.
            Some(claim) if crew.count() > 0 => {
                claim.open(&|lane| run.work(lane), u32::MAX, || run.lead());
            }
            _ => run.lead(),
        }
        let fault = run.fault.into_inner();
        self.log.collect_into(&mut self.spans);
        fault.map_or(Ok(()), Err)
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

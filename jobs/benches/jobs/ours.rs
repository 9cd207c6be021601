//! Our own scheduler, and all that this report knows of its interface.
//!
//! In:    a shape to run once.
//! Out:   all its jobs done.
//! Keeps: the workers and one graph per shape, built once.
//! Not here: the other schedulers.

use crate::board::{Board, CHAIN, CHUNKS, STAGES, Shape, WIDE};
use crate::schedulers::Scheduler;
use crate::system::core;
use crate::workloads::Workload;
use overfly_jobs::{Frame, Graph, Scratch, Span, WorkerOptions, Workers, now_ns};

/// How it is used.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    /// Iterations back to back lie in one frame; after a sleep, or beside a hog, each opens its own.
    Framed,
    /// Every iteration opens its own frame.
    Unframed,
    /// As `Framed`, with the times of stages and tickets recorded.
    WithSpans,
}

/// overfly's jobs as a scheduler.
pub struct Ours {
    board: &'static Board,
    /// As long as the program, so that a frame can be held from one iteration to the next.
    workers: &'static Workers,
    /// Graphs of [`Shape`], in its order.
    graphs: [Graph<Board>; 5],
    manner: Manner,
    /// The frame around a turn; `None` where each iteration opens its own.
    frame: Option<Frame<'static>>,
}

impl Ours {
    /// Starts `threads` less one workers and builds the graphs.
    pub fn new(board: &'static Board, threads: usize, manner: Manner) -> Ours {
        let options = WorkerOptions {
            count: threads - 1,
            pin_to_cores: (1..threads).map(core).collect(),
            ..WorkerOptions::default()
        };
        let workers = Workers::with(options).expect("the system gives a few threads");
        let mut graphs = [fan(), pfor(), chain(), frame(), pair()];
        graphs.iter_mut().for_each(|graph| graph.record_spans(manner == Manner::WithSpans));
        Ours { board, workers: Box::leak(Box::new(workers)), graphs, manner, frame: None }
    }
}

impl Scheduler for Ours {
    fn name(&self) -> &'static str {
        match self.manner {
            Manner::Framed => "ours",
            Manner::Unframed => "ours_unframed",
            Manner::WithSpans => "ours_spans",
        }
    }

    fn takes(&self, workload: &Workload) -> bool {
        match self.manner {
            Manner::Framed => true,
            Manner::Unframed => workload.is_back_to_back(),
            Manner::WithSpans => workload.name == "frame2",
        }
    }

    fn enter(&mut self, workload: &Workload) {
        if self.manner != Manner::Unframed && workload.is_back_to_back() {
            self.frame = Some(self.workers.frame());
        }
    }

    fn leave(&mut self) {
        self.frame = None;
    }

    fn run(&mut self, shape: Shape) {
        self.graphs[shape as usize].run(self.board, self.workers).expect("the jobs do not panic");
    }

    fn run_behind(&mut self, serial: &dyn Fn(), shape: Shape) -> u64 {
        let _frame = self.workers.frame();
        serial();
        let begin_ns = now_ns();
        self.run(shape);
        now_ns() - begin_ns
    }
}

fn fan() -> Graph<Board> {
    let mut graph = Graph::new();
    let source = graph.stage(Span("fan.source"), &[], |board: &Board, _| board.mark(WIDE));
    let jobs: Vec<_> = (0..WIDE)
        .map(|job| graph.stage(Span("fan.job"), &[source], move |board, _| board.mark(job)))
        .collect();
    graph.stage(Span("fan.sink"), &jobs, |board, _| board.mark(WIDE + 1));
    graph
}

fn pfor() -> Graph<Board> {
    let mut graph = Graph::new();
    graph.each(Span("pfor"), &[], |_| WIDE, |board: &Board, chunk, _| board.mark(chunk));
    graph
}

fn chain() -> Graph<Board> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for job in 0..CHAIN {
        last = vec![graph.stage(Span("chain"), &last, move |board: &Board, _| board.link(job))];
    }
    graph
}

fn frame() -> Graph<Board> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for stage in 0..STAGES {
        let body = move |board: &Board, chunk, _: &mut Scratch| board.chunk(stage, chunk);
        last = vec![graph.each(Span("frame"), &last, |_| CHUNKS, body)];
    }
    graph
}

fn pair() -> Graph<Board> {
    let mut graph = Graph::new();
    for job in 0..2 {
        graph.stage(Span("pair"), &[], move |board: &Board, _| board.meet(job));
    }
    graph
}

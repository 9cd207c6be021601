//! Workers, a graph of stages, parallel-for and spans: the only clock of overfly.
//!
//! In:    stages (closures over one shared context) and the stages each must follow.
//! Out:   every stage run once per frame, in an order the edges allow, and its times.
//! Keeps: parked worker threads and the compiled graph between frames.
//! Not here: terrain, priorities, cancelling, async input and output.
//!
//! # One frame
//!
//! A [`Graph`] is built once and run every frame on some [`Workers`]. A stage receives the
//! context, shared, and a [`Team`], over which it splits an array into chunks:
//!
//! ```
//! use overfly_jobs::{Graph, Span, Workers};
//! use std::sync::Mutex;
//!
//! let workers = Workers::new(1)?;
//! let mut graph = Graph::<Mutex<Vec<u64>>>::new();
//! let fill = graph.stage(Span("demo.fill"), &[], |heights, team| {
//!     let mut heights = heights.lock().unwrap();
//!     team.for_each_chunk(&mut heights, 256, |first, chunk| {
//!         for (offset, height) in chunk.iter_mut().enumerate() {
//!             *height = (first + offset) as u64;
//!         }
//!     });
//! });
//! graph.stage(Span("demo.check"), &[fill], |heights, _| {
//!     assert_eq!(heights.lock().unwrap()[999], 999);
//! });
//! graph.run(&Mutex::new(vec![0; 1000]), &workers)?;
//! assert!(graph.spans().stage_ns(Span("demo.fill")).is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Promises
//!
//! - **Same split everywhere.** Chunk borders follow from the array's length and the grain, never
//!   from the worker count, so a stage that writes only its chunk gives the same bits on any machine.
//! - **The caller is worker 0** and never depends on another thread to *start* anything: with no
//!   workers, or with all of them blocked, [`Graph::run`] still finishes.
//! - **No unrelated work.** A stage that waits for its parallel-for works on that loop only, so a
//!   stage may hold a lock around a loop without running a second stage under it.
//! - **Nothing is allocated** by a run once the graph and the workers have met.
//! - **Nothing runs between frames.** Idle workers spin for at most 30 µs inside a run, then sleep.
//! - **Panics are results.** A panic ends its stage, skips the stages after it and comes back as
//!   [`StagePanic`]; the graph and the workers stay usable.
//!
//! # How it works
//!
//! Everything that another thread may join, a parallel-for or a whole run, is *posted* in a slot
//! that outlives it (`scope`). Joining is one compare-and-swap that takes a ticket; closing the slot
//! withdraws the tickets nobody took and waits for those inside. That is the only place where a
//! lifetime is erased, and with the splitting of slices the only unsafe code.
#![deny(unsafe_code)]

mod graph;
mod run;
#[expect(unsafe_code, reason = "disjoint chunks and jobs on another thread's stack")]
mod scope;
mod spans;
mod team;
mod wait;
mod workers;

pub use graph::{Graph, StageId};
pub use run::StagePanic;
pub use spans::{Span, SpanRecord, Spans, now_ns};
pub use team::Team;
pub use workers::{StartError, Workers};

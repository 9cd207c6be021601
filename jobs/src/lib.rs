//! Workers, a graph of stages, parallel-for and spans: the only clock of overfly.
//!
//! In:    stages (closures over one shared context) and the stages each must follow.
//! Out:   every stage run once per frame, in an order the edges allow, and its times.
//! Keeps: sleeping worker threads and the compiled graph between frames.
//! Not here: terrain, async input and output, work that outlives a frame.
//!
//! # One frame
//!
//! A [`Graph`] is built once and run every frame on some [`Workers`]. There are three kinds of
//! stages: called once ([`Graph::stage`]), called once per chunk ([`Graph::each`]), called once on
//! the caller's thread ([`Graph::pinned`]). All receive the context, shared; those called once also
//! a [`Team`], over which they can split an array that they hold:
//!
//! ```
//! use overfly_jobs::{Graph, Span, Workers};
//! use std::sync::Mutex;
//! use std::sync::atomic::{AtomicU64, Ordering};
//!
//! struct Terrain {
//!     heights: Mutex<Vec<u64>>,
//!     sums: Vec<AtomicU64>,
//! }
//!
//! let workers = Workers::new(1)?;
//! let mut graph = Graph::<Terrain>::new();
//! let fill = graph.stage(Span("demo.fill"), &[], |terrain, team| {
//!     let mut heights = terrain.heights.lock().unwrap();
//!     team.for_each_chunk(&mut heights, 256, |first, chunk| {
//!         for (offset, height) in chunk.iter_mut().enumerate() {
//!             *height = (first + offset) as u64;
//!         }
//!     });
//! });
//! let sums = graph.each(
//!     Span("demo.sums"),
//!     &[fill],
//!     |terrain| terrain.sums.len(),
//!     |terrain, chunk, _| terrain.sums[chunk].store(chunk as u64, Ordering::Relaxed),
//! );
//! graph.pinned(Span("demo.show"), &[sums], |terrain, _| {
//!     assert_eq!(terrain.heights.lock().unwrap()[999], 999);
//! });
//!
//! let terrain = Terrain {
//!     heights: Mutex::new(vec![0; 1000]),
//!     sums: (0..64).map(AtomicU64::new).collect(),
//! };
//! {
//!     let _frame = workers.frame(); // wakes the worker; here a host prepares its input
//!     graph.run(&terrain, &workers)?;
//! } // the worker goes to sleep
//! assert!(graph.spans().stage_ns(Span("demo.fill")).is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Promises
//!
//! - **Same split everywhere.** What a chunk is follows from the array's length and the grain, or
//!   from a count, never from the worker count: a stage that writes only its chunk gives the same
//!   bits on any machine. [`WorkerOptions::chaos`] lets a host put its own stages to the test.
//! - **The caller is worker 0** and never depends on another thread to *start* anything: with no
//!   workers, or with all of them blocked or never scheduled, [`Graph::run`] still finishes.
//! - **No unrelated work.** A run is helped with by its workers only, and a stage that waits for
//!   its own loop works on that loop only, so a stage may hold a lock around a loop without running
//!   a second stage under it.
//! - **Nothing is allocated** by a run once the graph and the workers have met.
//! - **Nothing runs between frames.** Idle workers spin inside a [`Frame`], for at most
//!   [`WorkerOptions::spin_us`] at a time, and sleep at once when it closes.
//! - **Panics are results.** A panic ends its stage, skips the stages after it and comes back as
//!   [`StagePanic`]; the graph and the workers stay usable. So do they after a [`Cancel`].
//! - **Nobody is woken for little.** Whoever is awake joins a loop at once; sleepers are woken for
//!   it when its first chunks show that the others last longer than waking takes. So a chunk must
//!   not wait for another.
//! - **Times cost next to nothing when off.** Without [`Graph::record_spans`] the clock is read
//!   only where somebody sleeps: between the claims of a loop, and around the stages of that run.
//!
//! # Whose threads
//!
//! [`Workers::none`] uses the caller alone; [`Workers::new`] and [`Workers::with`] start threads of
//! their own; [`Workers::host`] hands [`Task`]s to a host that has threads and may run them late,
//! at once or never; [`Workers::join_as_worker`] takes a thread that is lent for one frame. Results
//! are the same in all cases. Keep to fewer workers than cores: more of them only wait.
//!
//! # How it works
//!
//! A graph is compiled to flat arrays (`plan`), its counters set themselves back (no pass over the
//! graph begins a run), and a stage whose only predecessor has ended runs on at once, without a
//! look at anything shared (`walk`). What else is ready stands in a set of bits (`ready`). Chunks,
//! and stages that become ready together, are counted and not queued: workers claim ranges of them
//! with one exchange on one word, and whoever leaves last goes on with what follows (`tickets`).
//!
//! What another thread may join on this thread's stack, a loop or a whole run, is *posted* in a
//! slot that outlives it (`scope`). Joining takes a ticket; closing the slot withdraws the tickets
//! nobody took and waits for those inside. That is the only place where a lifetime is erased, and
//! with the splitting of slices the only unsafe code.
//!
//! Sleeping and waking need one word that every poster raises (`crew`). All of these protocols are
//! written for any kind of atomics (`sync`); the crate's tests run them under loom and shuttle.
#![deny(unsafe_code)]

mod arithmetic;
mod cancel;
mod chaos;
mod crew;
mod frame;
mod graph;
mod log;
mod pin;
mod plan;
#[cfg(test)]
mod proof;
mod ready;
mod run;
#[expect(unsafe_code, reason = "disjoint chunks and jobs on another thread's stack")]
mod scope;
mod scratch;
mod spans;
mod sync;
mod team;
mod tickets;
mod walk;
mod workers;

pub use arithmetic::{ArithmeticFault, check_arithmetic};
pub use cancel::{Cancel, Stopped};
pub use frame::{Frame, takes_part};
pub use graph::{Graph, StageId};
pub use pin::pin_this_thread;
pub use run::StagePanic;
pub use scratch::{Scratch, ScratchFull};
pub use spans::{Span, SpanRecord, Spans, WaitKind, WaitRecord, now_ns};
pub use team::Team;
pub use workers::{StartError, Task, WorkerOptions, Workers};

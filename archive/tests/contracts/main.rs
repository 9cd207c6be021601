//! What archives promise: tiles come as they were written, faults are named, nothing hangs.
//!
//! In:    archives written with the `pmtiles` crate or byte by byte, a small HTTP server.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: what tiles mean (`overfly_core`).

mod hosted;
mod hostile;
mod local;
mod remote;
mod server;
mod written;

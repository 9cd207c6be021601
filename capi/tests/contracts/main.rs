//! What the C border promises: whatever is handed over, a status; the same bits as the façade.
//!
//! In:    the exported functions, called from Rust as C would; the examples, compiled with cc.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: memory (`c_allocation`), what the façade promises (the root's `embedding`).

mod calls;
mod columns;
mod drawing;
mod examples;
mod flights;
mod handles;
mod header;
mod hosts;
mod junk;
mod lent;
mod overlays;
mod queries;
mod renderers;

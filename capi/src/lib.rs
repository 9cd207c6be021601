//! overfly for C and C++: `overfly.h`, `liboverfly_c`.
//!
//! In:    calls from C: handles that may be stale, pointers that may be null, any numbers.
//! Out:   status codes, sentences, numbers in memory of the host.
//! Keeps: the tables of terrains and of snapshots.
//! Not here: the terrain itself (`overfly`), which needs no `unsafe` and so is a package of its own.
//!
//! `tests/contracts/header.rs` makes `include/overfly.h` of the public modules. Memory is touched in
//! `border` and the host called in `callbacks`: there, and nowhere else, are blocks of `unsafe`.

mod border;
mod callbacks;
mod table;
mod tasks;

pub mod columns;
pub mod frame;
pub mod ground;
pub mod host;
pub mod queries;
pub mod rays;
pub mod recording;
pub mod regions;
pub mod scene;
pub mod status;
pub mod terrain;
pub mod version;

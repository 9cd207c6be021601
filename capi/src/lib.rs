//! overfly for C and C++: `overfly.h`, `liboverfly_c`.
//!
//! In:    calls from C: handles that may be stale, pointers that may be null, any numbers.
//! Out:   status codes, sentences, numbers in memory of the host.
//! Keeps: the tables of terrains, of snapshots and of renderers.
//! Not here: the terrain itself (`overfly`), which needs no `unsafe` and so is a package of its own.
//!
//! `tests/contracts/header.rs` makes `include/overfly.h` of the public modules. Memory is touched in
//! `border`, the host called in `callbacks` and its Vulkan in `vulkan`: there, and nowhere else, are
//! blocks of `unsafe`.

mod border;
mod callbacks;
mod news;
mod table;
mod tasks;
mod vulkan;

pub mod columns;
pub mod drawing;
pub mod frame;
pub mod ground;
pub mod host;
pub mod overlay;
pub mod queries;
pub mod rays;
pub mod recording;
pub mod regions;
pub mod renderer;
pub mod scene;
pub mod status;
pub mod terrain;
pub mod version;

//! The LEB workload: one square, two flights, one rule whose exact mesh is known at every frame.
//!
//! In:    a preset, a path, a speed, a frame number.
//! Out:   eyes, the rule, reference meshes, the recursion that is the yardstick, a table.
//! Keeps: nothing.
//! Not here: the engine's side (the bench, the example and the tests that include this folder).

#![allow(dead_code, reason = "the bench, the example and each test use a part of the folder")]

pub mod answers;
pub mod engine;
pub mod recursion;
pub mod stats;
pub mod workload;

//! The 42 extreme cases: planets of 1 m to 1e12 m, poles, needles, NaN, budgets of 0, and no event.
//!
//! In:    procedural and synthetic ground, poses, settings, control bits at their extremes.
//! Out:   passes or fails; "no event" is finite output, a closed surface, a kept budget and a
//!        digest that repeats.
//! Keeps: nothing.
//! Not here: scene files (`config/tests/extremes.rs`), Vulkan (`tests/contracts/extremes.rs`).

#[path = "../rig/mod.rs"]
mod rig;

mod bodies;
mod budgets;
mod gauge;
mod heights;
mod host;
mod motion;
mod numbers;
mod places;
mod synthetic;
mod world;

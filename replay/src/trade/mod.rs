//! The price of every knob: which settings to try, and what follows from what they measured.
//!
//! | module | what it holds |
//! |---|---|
//! | [`point`] | one setting of all knobs; the points of a sweep |
//! | [`clips`](mod@clips) | which frames of a flight are flown, and which of them measured |
//! | [`yields`] | what a point yielded: error, work, times; how frames become a flight |
//! | [`front`](mod@front) | points that no other beats in both error and cost |
//! | [`slope`] | straight lines through logarithms |
//! | [`advice`] | the cheapest for an error, the most accurate for a budget |
//!
//! In:    a scene, a sweep, measured points.
//! Out:   points, fronts, slopes, a choice.
//! Keeps: nothing.
//! Not here: flying, measuring and timing (the host); files (the host).
//! Source: triangles alone are not cost, so error is held against each cost (design notes).

pub mod advice;
pub mod clips;
pub mod front;
pub mod point;
pub mod slope;
pub mod yields;

pub use advice::{Goal, Search, choose};
pub use clips::{Clip, clips};
pub use front::front;
pub use overfly_config::SweepSettings;
pub use point::{Point, PointFault, default_sweep, law_points, points};
pub use slope::{Fit, fit};
pub use yields::{Yield, fold};

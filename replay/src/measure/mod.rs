//! Measured error: how far what is drawn strays from the ground, in pixels and metres.
//!
//! | module | what it holds |
//! |---|---|
//! | [`screen`], [`rays`] | the exact projection; one ray in each cell of a grid |
//! | [`plate`], [`reference`](mod@reference) | the ground itself, as fine as the picture can show |
//! | [`mesh`], [`raster`] | the drawn mesh along verticals, and along rays of the eye |
//! | [`frame`] | E1, E2, E3, E5, pops, holes of one frame |
//! | [`errors`], [`report`] | what was measured; its names, units and verdict |
//! | [`spread`] | percentiles, and where the worst was |
//!
//! In:    a terrain after each frame, pages of any depth.
//! Out:   [`FrameErrors`], [`FlightErrors`].
//! Keeps: [`Measure`]: the meshes of two frames, plates of the reference.
//! Not here: flying (the host), tables and pictures (the host).
//! Source: definitions of R. Ulrich's and Duchaineau's metrics as the design notes give them.

pub mod errors;
pub mod frame;
pub mod mesh;
pub mod plate;
pub mod raster;
pub mod rays;
pub mod reference;
pub mod report;
pub mod screen;
pub mod spread;

pub use errors::{FlightErrors, FrameErrors, Thorough};
pub use frame::{Measure, MeasureSettings};
pub use reference::MakePage;
pub use spread::{Gathered, Spread, Where};

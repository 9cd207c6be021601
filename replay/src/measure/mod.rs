//! Measured error: how far what is drawn strays from the ground, in pixels and metres.
//!
//! | module | what it holds |
//! |---|---|
//! | [`screen`], [`rays`], [`cast`] | the exact projection; one ray in each cell of a grid |
//! | [`boxes`], [`plate`], [`reference`](mod@reference), [`nearby`] | the ground itself, as fine as the picture can show |
//! | [`mesh`], [`raster`] | the drawn mesh along verticals, and along rays of the eye |
//! | [`frame`] | E1, E2, E3, E5, pops of one frame |
//! | [`holes`], [`cracks`] | cracks that are seen, and those of the mesh's structure |
//! | [`thorough`] | what is measured in few frames, from the modules below |
//! | [`outline`], [`heights`], [`pipeline`], [`depth`] | E4; H1, H2; M32, J1; Z1, Z2 |
//! | [`cross`], [`wide`] | E1 a second way; twice the digits of f64 |
//! | [`errors`], [`report`] | what was measured; its names, units and verdict |
//! | [`spread`], [`share`] | percentiles, and where the worst was; work on all threads |
//!
//! In:    a terrain after each frame, pages of any depth.
//! Out:   [`FrameErrors`], [`FlightErrors`].
//! Keeps: [`Measure`]: the meshes of two frames, plates of the reference.
//! Not here: flying (the host), tables and pictures (the host).
//! Source: definitions of R. Ulrich's and Duchaineau's metrics as the design notes give them.

pub mod boxes;
pub mod cast;
pub mod cracks;
pub mod cross;
pub mod depth;
pub mod errors;
pub mod frame;
pub mod heights;
pub mod holes;
pub mod mesh;
pub mod nearby;
pub mod outline;
pub mod pipeline;
pub mod plate;
pub mod raster;
pub mod rays;
pub mod reference;
pub mod report;
pub mod screen;
pub mod share;
pub mod spread;
pub mod thorough;
pub mod wide;

pub use errors::{FlightErrors, FrameErrors, Thorough};
pub use frame::{Measure, MeasureSettings, Taken};
pub use reference::{MakePage, PagePart};
pub use spread::{Gathered, Spread, Where};

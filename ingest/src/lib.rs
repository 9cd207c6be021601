//! Real elevation and imagery into archives.
//!
//! In:    rasters of heights in many formats; pictures of a body.
//! Out:   a PMTiles archive of octahedral tiles.
//! Keeps: nothing.
//! Not here: reading archives (`overfly_archive`), making pages from tiles (`overfly_core`).
#![forbid(unsafe_code)]

pub mod block;
pub mod build;
pub mod fault;
pub mod fit;
pub mod geoid;
pub mod imagery;
pub mod marks;
pub mod pyramid;
pub mod raster;
pub mod spool;
pub mod survey;
pub mod verify;

pub use build::{BuildOptions, Progress, Report, build};
pub use fault::IngestError;
pub use imagery::{ImageryOptions, ImageryReport, build_imagery, verify_imagery};
pub use verify::{Difference, verify};

//! Real elevation into terrain archives.
//!
//! In:    rasters of heights in many formats.
//! Out:   a PMTiles archive of octahedral tiles.
//! Keeps: nothing.
//! Not here: reading archives (`overfly_archive`), making pages from tiles (`overfly_core`).
#![forbid(unsafe_code)]

pub mod geoid;
pub mod raster;

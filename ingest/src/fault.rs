//! Why an archive could not be built.
//!
//! In:    what went wrong in rasters, geoids, files.
//! Out:   [`IngestError`], a sentence each.
//! Keeps: nothing.
//! Not here: what is wrong with one raster (`raster`).

use crate::pyramid::MakeError;
use crate::raster::RasterError;
use core::fmt;
use overfly_core::datasource::PageKey;
use overfly_core::datasource::codec::TileFault;
use std::io;
use std::path::{Path, PathBuf};

/// Why an archive could not be built.
#[derive(Debug)]
pub enum IngestError {
    /// There is nothing to ingest.
    NoInput,
    /// An input could not be read.
    Raster(RasterError),
    /// The inputs have more different resolutions than an archive has layers.
    Layers {
        /// How many.
        found: usize,
    },
    /// The geoid grid does not cover the data.
    GeoidLacks {
        /// Where.
        lat_rad: f64,
        /// Where.
        lon_rad: f64,
    },
    /// The archive, or the temporary file beside it, could not be written.
    Output {
        /// Where.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The archive's format refused.
    Archive {
        /// Where.
        path: PathBuf,
        /// What it said.
        error: pmtiles::PmtError,
    },
    /// The finished archive could not be read back.
    ReadBack(overfly_archive::ArchiveError),
    /// A tile of the finished archive is none.
    Tile {
        /// Which.
        key: PageKey,
        /// What is wrong with it.
        fault: TileFault,
    },
    /// Every pixel of a picture is transparent.
    NoColour {
        /// The picture.
        path: PathBuf,
    },
    /// The tiles of a finished archive hold other texels than it states.
    OtherContent {
        /// The archive.
        path: PathBuf,
        /// The hash that it states.
        stated: u64,
        /// The hash of what it holds.
        found: u64,
    },
    /// It was asked to stop.
    Stopped,
}

impl IngestError {
    /// Of tiles that could not be made, beside `output`.
    pub fn made(error: MakeError, output: &Path) -> Self {
        match error {
            MakeError::Raster(error) => Self::Raster(error),
            MakeError::Spool(error) => Self::Output { path: output.to_owned(), error },
            MakeError::Stopped => Self::Stopped,
        }
    }
}

impl From<RasterError> for IngestError {
    fn from(error: RasterError) -> Self {
        Self::Raster(error)
    }
}

impl fmt::Display for IngestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoInput => f.write_str("no height in the inputs, or no raster among them"),
            Self::Raster(error) => error.fmt(f),
            Self::Layers { found } => {
                write!(f, "inputs of {found} different resolutions; an archive has 16 layers")
            }
            Self::GeoidLacks { lat_rad, lon_rad } => write!(
                f,
                "the geoid grid does not cover latitude {:.4}, longitude {:.4}; \
                 leave --geoid out to use EGM96's harmonics",
                lat_rad.to_degrees(),
                lon_rad.to_degrees()
            ),
            Self::Output { path, error } => write!(f, "{}: {error}", path.display()),
            Self::Archive { path, error } => write!(f, "{}: {error}", path.display()),
            Self::ReadBack(error) => error.fmt(f),
            Self::Tile { key, fault } => write!(f, "tile {key:?}: {fault}"),
            Self::NoColour { path } => {
                write!(f, "{}: there is nothing to see: every pixel's alpha is 0", path.display())
            }
            Self::OtherContent { path, stated, found } => write!(
                f,
                "{}: its tiles have content {found:016x}, and it states {stated:016x}",
                path.display()
            ),
            Self::Stopped => f.write_str("stopped; what was there before is as it was"),
        }
    }
}

impl std::error::Error for IngestError {}

//! What can be wrong with an archive.
//!
//! In:    faults of files, servers, headers, directories, metadata, tiles.
//! Out:   [`ArchiveError`], a sentence that names the archive.
//! Keeps: nothing.
//! Not here: a tile that an archive simply does not have, which is no fault.

use pmtiles::PmtError;
use std::{fmt, io};

/// An archive, and what is wrong with it.
#[derive(Debug)]
pub struct ArchiveError {
    /// Path or address.
    pub archive: String,
    /// What is wrong.
    pub fault: ArchiveFault,
}

/// What is wrong with an archive.
#[derive(Debug)]
pub enum ArchiveFault {
    /// The file cannot be opened or is none.
    Open(io::Error),
    /// It does not begin like a PMTiles archive.
    NotPmtiles,
    /// It is a PMTiles archive of another version of that format.
    PmtilesVersion(u8),
    /// It is a sound PMTiles archive of something that is not terrain of ours.
    Foreign {
        /// What its tiles are.
        tile_type: &'static str,
    },
    /// It is ours, but holds something else than what it was opened for.
    Kind {
        /// What it holds.
        found: &'static str,
        /// What it was opened for.
        wanted: &'static str,
    },
    /// It is terrain of ours in a format that this build does not know.
    FormatVersion(u64),
    /// Its metadata has a wrong type or a value out of range.
    Metadata(String),
    /// Bytes are missing or make no sense.
    Corrupt(String),
    /// The host, which reads itself, failed.
    Host(String),
    /// The server gave no usable answer, retries included.
    Server(String),
    /// The archive is not the one that was opened.
    Changed(String),
    /// Nothing was asked: the server failed a moment ago and is left alone for a while.
    Resting(String),
    /// Nothing was asked: [`crate::Archive::close`] was called.
    Closed,
}

impl fmt::Display for ArchiveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "archive {}: {}", self.archive, self.fault)
    }
}

impl std::error::Error for ArchiveError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.fault.source()
    }
}

impl fmt::Display for ArchiveFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open(error) => write!(f, "it cannot be opened: {error}"),
            Self::NotPmtiles => write!(f, "it is not a PMTiles archive"),
            Self::PmtilesVersion(found) => {
                write!(f, "it is a PMTiles archive of version {found}, only version 3 is read")
            }
            Self::Foreign { tile_type } => write!(
                f,
                "it is a PMTiles archive of another kind: its tiles are {tile_type}, and its \
                 metadata has no \"overfly\""
            ),
            Self::Kind { found, wanted } => {
                write!(f, "it holds {found}, and is named where {wanted} is read")
            }
            Self::FormatVersion(found) => {
                write!(f, "its terrain is of format version {found}, only version 1 is read")
            }
            Self::Metadata(what) => write!(f, "its metadata is unusable: {what}"),
            Self::Corrupt(what) => write!(f, "it is damaged: {what}"),
            Self::Host(what) => write!(f, "the host cannot read it: {what}"),
            Self::Server(what) => write!(f, "the server fails: {what}"),
            Self::Changed(what) => write!(f, "it has changed since it was opened: {what}"),
            Self::Resting(last) => {
                write!(f, "the server is left alone for a while, for it failed: {last}")
            }
            Self::Closed => write!(f, "it is closed"),
        }
    }
}

impl std::error::Error for ArchiveFault {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Open(error) => Some(error),
            _ => None,
        }
    }
}

impl ArchiveFault {
    /// On its way through the `pmtiles` crate.
    pub(crate) fn wrapped(self) -> PmtError {
        PmtError::Reading(io::Error::other(self))
    }

    /// Back from the `pmtiles` crate: a fault of ours, or what the crate found.
    pub(crate) fn from_pmtiles(error: PmtError) -> Self {
        match error {
            PmtError::Reading(inner) => match inner.downcast::<Self>() {
                Ok(fault) => fault,
                Err(inner) => Self::Corrupt(format!("a part cannot be unpacked: {inner}")),
            },
            PmtError::InvalidMagicNumber => Self::NotPmtiles,
            PmtError::InvalidHeader => Self::Corrupt("its header makes no sense".into()),
            PmtError::InvalidEntry => {
                let what = "a directory makes no sense, or points outside of its section";
                Self::Corrupt(what.into())
            }
            PmtError::InvalidTileType => Self::Corrupt("its tile type is unknown".into()),
            PmtError::UnsupportedCompression(_) | PmtError::InvalidCompression => {
                Self::Corrupt("it is compressed in an unknown way".into())
            }
            PmtError::InvalidMetadataUtf8Encoding(_) => Self::Metadata("it is not UTF-8".into()),
            other => Self::Corrupt(other.to_string()),
        }
    }
}

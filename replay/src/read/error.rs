//! Why a file, or the rest of it, cannot be read, and the sentences that say so.
//!
//! In:    where reading stopped, what was expected and what was found.
//! Out:   [`ReadError`], [`Fault`].
//! Keeps: nothing.
//! Not here: reading (the module above).

use crate::format::{Kind, MAGIC, VERSION, check_byte};
use core::fmt;

/// Why a file, or the rest of it, cannot be read.
#[derive(Debug)]
pub enum ReadError {
    /// The file system refused.
    Io {
        /// Which file.
        file: String,
        /// What it said.
        source: std::io::Error,
    },
    /// Not an `.ovf` file at all.
    Foreign {
        /// Which file.
        file: String,
        /// Its first bytes, up to eight.
        found: Vec<u8>,
    },
    /// Written by a later overfly, or its version is damaged.
    Version {
        /// Which file.
        file: String,
        /// What it says; this crate reads up to [`VERSION`].
        found: u32,
    },
    /// A flight where a recording was asked for, or the other way round.
    Kind {
        /// Which file.
        file: String,
        /// What was asked for.
        expected: Kind,
        /// What it is.
        found: Kind,
    },
    /// A block is not as it was written.
    Corrupt {
        /// Which file.
        file: String,
        /// Byte at which the block begins.
        offset: u64,
        /// Whole frames before it; all of them are good.
        frame: u64,
        /// What is wrong.
        what: Fault,
    },
    /// The file ends inside a block: its writer was stopped, or its tail was lost.
    Truncated {
        /// Which file.
        file: String,
        /// Byte at which the last, incomplete block begins.
        offset: u64,
        /// Whole frames before it; all of them are good.
        frames: u64,
    },
    /// A frame was looked for that the file does not have.
    Beyond {
        /// Which file.
        file: String,
        /// Which frame.
        frame: u64,
        /// Frames there are.
        frames: u64,
    },
}

/// What is wrong with a block.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Fault {
    /// Marker, length and check byte do not agree, or the marker is not one that may come here.
    Head {
        /// The five bytes.
        found: [u8; 5],
    },
    /// The payload's checksum is another one.
    Checksum {
        /// As written.
        expected: u32,
        /// Of the bytes that are there.
        found: u32,
    },
    /// The frame's index is another one: a block is missing or was repeated.
    Index {
        /// What it should be.
        expected: u64,
        /// What it is.
        found: u64,
    },
    /// The number of frames is another one than the end block or the header says.
    Frames {
        /// What it says.
        expected: u64,
        /// Frames read.
        found: u64,
    },
    /// A field makes no sense although the checksum is right.
    Field {
        /// Its name.
        name: &'static str,
    },
    /// There are bytes after the end block.
    AfterEnd {
        /// How many.
        found: u64,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Head { found } => {
                let expected = check_byte(found[0], [found[1], found[2], found[3]]);
                let marker = found[0].escape_ascii();
                let check = found[4];
                write!(f, "block head: marker '{marker}', ")?;
                write!(f, "expected check byte {expected:#04x}, found {check:#04x}")
            }
            Self::Checksum { expected, found } => {
                write!(f, "checksum: expected {expected:#010x}, found {found:#010x}")
            }
            Self::Index { expected, found } => {
                write!(f, "frame index: expected {expected}, found {found}")
            }
            Self::Frames { expected, found } => {
                write!(f, "number of frames: expected {expected}, found {found}")
            }
            Self::Field { name } => write!(f, "{name}: makes no sense"),
            Self::AfterEnd { found } => {
                write!(f, "after the end block: expected nothing, found {found} bytes")
            }
        }
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { file, source } => write!(f, "{file}: cannot read: {source}"),
            Self::Foreign { file, found } => {
                let (expected, found) = (MAGIC.escape_ascii(), found.escape_ascii());
                write!(f, "{file}: at byte 0: expected \"{expected}\", found \"{found}\"")
            }
            Self::Version { file, found } => {
                write!(
                    f,
                    "{file}: at byte 8: expected version 1, 2 or {VERSION}, found version {found}"
                )
            }
            Self::Kind { file, expected, found } => {
                write!(f, "{file}: expected a {expected}, found a {found}")
            }
            Self::Corrupt { file, offset, frame, what } => {
                write!(f, "{file}: corrupt at byte {offset} (after {frame} whole frames): {what}")
            }
            Self::Truncated { file, offset, frames } => {
                write!(f, "{file}: ends inside the block at byte {offset}, ")?;
                write!(f, "after {frames} whole frames")
            }
            Self::Beyond { file, frame, frames } => {
                write!(f, "{file}: there is no frame {frame}, but {frames} whole frames")
            }
        }
    }
}

impl core::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

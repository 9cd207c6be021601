//! Writing a file, one whole block at a time.
//!
//! In:    a header, then poses or recorded frames.
//! Out:   an `.ovf` file that can be read at any moment.
//! Keeps: the open file and the columns of the last frame.
//! Not here: the bytes themselves (`format`, `payload`).

use crate::format::{
    END_MARK, FRAME_MARK, HEADER_MARK, Header, Kind, MAGIC, PAYLOAD_MAX, RecordedFrame, block_head,
    rate_is_usable,
};
use crate::payload::Columns;
use crate::pose::Pose;
use core::fmt;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Writes one file.
///
/// Every frame reaches the file in one write before [`Writer::frame`] returns, so what a killed
/// process leaves reads to its last whole frame. A new file is therefore written under its own
/// name. An existing one is kept until the new one is whole: the new one is written beside it as
/// `<name>.part` and renamed over it by [`Writer::finish`]; a killed process leaves the `.part`,
/// which reads just as well.
#[derive(Debug)]
pub struct Writer {
    file: File,
    /// Where the bytes go.
    written: PathBuf,
    /// Where the file belongs.
    wanted: PathBuf,
    kind: Kind,
    frames_promised: u64,
    columns: Columns,
    /// Bytes in whole blocks.
    length: u64,
    block: Vec<u8>,
    payload: Vec<u8>,
}

/// Why a file was not written.
#[derive(Debug)]
pub enum WriteError {
    /// The file system refused.
    Io {
        /// Which file.
        file: PathBuf,
        /// Bytes in whole blocks so far.
        offset: u64,
        /// What it said.
        source: io::Error,
    },
    /// The rate is not finite and above zero.
    Rate {
        /// Which file.
        file: PathBuf,
        /// What was given, in hertz.
        found_hz: f64,
    },
    /// A pose for a recording, or a recorded frame for a flight.
    Kind {
        /// Which file.
        file: PathBuf,
        /// What its header says.
        expected: Kind,
        /// What was given.
        found: Kind,
    },
    /// A block would be longer than [`PAYLOAD_MAX`].
    TooLong {
        /// Which file.
        file: PathBuf,
        /// Bytes of the payload.
        found: usize,
    },
    /// The header promised another number of frames.
    Frames {
        /// Which file.
        file: PathBuf,
        /// What the header says.
        expected: u64,
        /// Frames written.
        found: u64,
    },
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { file, offset, source } => {
                write!(f, "{}: cannot write at byte {offset}: {source}", file.display())
            }
            Self::Rate { file, found_hz } => {
                let file = file.display();
                write!(f, "{file}: rate is {found_hz} Hz, must be finite and above 0")
            }
            Self::Kind { file, expected, found } => {
                write!(f, "{}: expected a frame of a {expected}, found {found}", file.display())
            }
            Self::TooLong { file, found } => {
                let file = file.display();
                write!(f, "{file}: a block of {found} bytes, allowed are {PAYLOAD_MAX}")
            }
            Self::Frames { file, expected, found } => {
                let file = file.display();
                write!(f, "{file}: expected {expected} frames as in the header, found {found}")
            }
        }
    }
}

impl core::error::Error for WriteError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl fmt::Debug for Columns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "columns before frame {}", self.index)
    }
}

impl Writer {
    /// Begins a file and writes its header.
    ///
    /// # Errors
    /// Where the file system refuses, or the header has no usable rate or is too long; then there
    /// is no new file.
    pub fn create(path: &Path, header: &Header) -> Result<Self, WriteError> {
        if !rate_is_usable(header.rate_hz) {
            return Err(WriteError::Rate { file: path.into(), found_hz: header.rate_hz });
        }
        let (file, written) = open(path)?;
        let mut writer = Self {
            file,
            written,
            wanted: path.into(),
            kind: header.kind,
            frames_promised: header.frames,
            columns: Columns::new(header.rate_hz),
            length: 0,
            block: Vec::new(),
            payload: header.encode(),
        };
        writer.block.extend_from_slice(&MAGIC);
        writer.block.extend_from_slice(&header.kind.version().to_le_bytes());
        if let Err(error) = writer.write_block(HEADER_MARK) {
            // A file without a header is of no use, and in the way of the next one.
            let _ = fs::remove_file(&writer.written);
            return Err(error);
        }
        Ok(writer)
    }

    /// Adds a pose to a flight.
    ///
    /// # Errors
    /// Where the file is a recording or the file system refuses; the file then is as before.
    pub fn pose(&mut self, pose: &Pose) -> Result<(), WriteError> {
        self.expect(Kind::Flight)?;
        self.columns.encode_pose(pose, &mut self.payload);
        self.write_block(FRAME_MARK)?;
        self.columns.advance();
        Ok(())
    }

    /// Adds a frame to a recording.
    ///
    /// # Errors
    /// Where the file is a flight, the frame is too long (above a million arrivals) or the file
    /// system refuses; the file then is as before.
    pub fn frame(&mut self, frame: &RecordedFrame) -> Result<(), WriteError> {
        self.expect(Kind::Recording)?;
        self.columns.encode_frame(frame, &mut self.payload);
        self.write_block(FRAME_MARK)?;
        self.columns.advance();
        Ok(())
    }

    /// Frames written so far.
    pub fn frames(&self) -> u64 {
        self.columns.index
    }

    /// Marks the file complete, waits until it is on the disk, and gives it its name.
    ///
    /// # Errors
    /// Where the header promised another number of frames or the file system refuses.
    pub fn finish(mut self) -> Result<(), WriteError> {
        let (expected, found) = (self.frames_promised, self.columns.index);
        if expected != 0 && expected != found {
            return Err(WriteError::Frames { file: self.written, expected, found });
        }
        self.payload.clear();
        self.payload.extend_from_slice(&found.to_le_bytes());
        self.write_block(END_MARK)?;
        self.file.sync_all().map_err(|source| self.refused(source))?;
        if self.written != self.wanted {
            fs::rename(&self.written, &self.wanted).map_err(|source| self.refused(source))?;
        }
        Ok(())
    }

    fn expect(&mut self, found: Kind) -> Result<(), WriteError> {
        self.payload.clear();
        let (file, expected) = (&self.written, self.kind);
        if found == expected {
            return Ok(());
        }
        Err(WriteError::Kind { file: file.clone(), expected, found })
    }

    /// Writes what `block` holds already and a block with `payload`, or nothing.
    fn write_block(&mut self, marker: u8) -> Result<(), WriteError> {
        if self.payload.len() > PAYLOAD_MAX {
            self.block.clear();
            let (file, found) = (self.written.clone(), self.payload.len());
            return Err(WriteError::TooLong { file, found });
        }
        self.block.extend_from_slice(&block_head(marker, &self.payload));
        self.block.extend_from_slice(&self.payload);
        let result = self.file.write_all(&self.block);
        if let Err(source) = result {
            self.block.clear();
            // Half a block would hide all later ones; if even this fails, the reader says where.
            let _ = self.file.set_len(self.length);
            let _ = self.file.seek(SeekFrom::Start(self.length));
            return Err(self.refused(source));
        }
        self.length += self.block.len() as u64;
        self.block.clear();
        Ok(())
    }

    fn refused(&self, source: io::Error) -> WriteError {
        WriteError::Io { file: self.written.clone(), offset: self.length, source }
    }
}

/// A new file at `path`, or beside it where there is one already.
fn open(path: &Path) -> Result<(File, PathBuf), WriteError> {
    let refused = |file: &Path, source| WriteError::Io { file: file.into(), offset: 0, source };
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(file) => Ok((file, path.into())),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            let mut name = OsString::from(path);
            name.push(".part");
            let beside = PathBuf::from(name);
            let file = File::create(&beside).map_err(|source| refused(&beside, source))?;
            Ok((file, beside))
        }
        Err(error) => Err(refused(path, error)),
    }
}

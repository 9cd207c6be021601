//! Reading a file, to its end or to the first byte that cannot be right.
//!
//! In:    an `.ovf` file, whole or damaged.
//! Out:   its header and frames, bit for bit, and how it ends.
//! Keeps: the bytes, and the columns of the last frame.
//! Not here: the bytes' meaning (`format`, `payload`).

use crate::format::{
    BLOCK_HEAD, END_MARK, FRAME_MARK, HEADER_MARK, Header, Kind, MAGIC, RecordedFrame, VERSION,
    check_byte, has_flags, is_readable,
};
use crate::payload::Columns;
use crate::pose::Pose;
use crate::words::Input;
use core::fmt;
use std::path::Path;

/// Reads one file, frame by frame: an iterator that stops after the first error.
///
/// Frames before a damaged one are good, since every block has its own checksum.
pub struct Reader {
    bytes: Vec<u8>,
    file: String,
    version: u32,
    header: Header,
    columns: Columns,
    /// Where the next block begins.
    offset: usize,
    /// Nothing more to read: the end, or an error was given out.
    done: bool,
    complete: bool,
}

/// One frame of a file; which of the two is fixed by the header's kind.
#[derive(Clone, PartialEq, Debug)]
pub enum Frame {
    /// Of a flight.
    Pose(Pose),
    /// Of a recording.
    Recorded(RecordedFrame),
}

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
                    "{file}: at byte 8: expected version 1 to {VERSION}, found version {found}"
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

/// How a file ends.
#[derive(Debug)]
pub enum Ending {
    /// With its end block.
    Complete,
    /// After a whole frame, without an end block: its writer was stopped.
    Unfinished,
    /// With a block that cannot be read; the frames before it are good.
    Damaged(ReadError),
}

/// A whole recording in memory.
#[derive(Debug)]
pub struct Recording {
    /// What it says of itself.
    pub header: Header,
    /// Every frame that can be read.
    pub frames: Vec<RecordedFrame>,
    /// Whether these are all.
    pub ending: Ending,
}

impl Recording {
    /// Reads a recording as far as it goes.
    ///
    /// # Errors
    /// Where there is no readable header, or it is a flight's. Damage further on is no error:
    /// see [`Recording::ending`].
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let mut reader = Reader::open(path)?;
        reader.expect(Kind::Recording)?;
        let mut frames = Vec::new();
        let ending = reader.drain(|frame| {
            if let Frame::Recorded(frame) = frame {
                frames.push(frame);
            }
        });
        Ok(Self { header: reader.header, frames, ending })
    }
}

impl Reader {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// Where the file cannot be read, is no `.ovf` file of a known version, or has no whole header.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let file = path.display().to_string();
        match std::fs::read(path) {
            Ok(bytes) => Self::new(bytes, file),
            Err(source) => Err(ReadError::Io { file, source }),
        }
    }

    /// Reads the header of a file in memory; errors call it `name`.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ReadError> {
        Self::new(bytes.to_vec(), name.into())
    }

    fn new(bytes: Vec<u8>, file: String) -> Result<Self, ReadError> {
        let start = &bytes[..bytes.len().min(MAGIC.len())];
        if !MAGIC.starts_with(start) {
            return Err(ReadError::Foreign { found: start.to_vec(), file });
        }
        let mut reader = Self {
            bytes,
            file,
            version: VERSION,
            header: Header::flight("", 1.0),
            columns: Columns::new(1.0),
            offset: 0,
            done: false,
            complete: false,
        };
        let Some(version) = reader.bytes.get(MAGIC.len()..MAGIC.len() + 4) else {
            return Err(reader.truncated());
        };
        let found = u32::from_le_bytes(version.try_into().expect("four bytes were taken"));
        if !is_readable(found) {
            return Err(ReadError::Version { file: reader.file, found });
        }
        reader.version = found;
        reader.offset = MAGIC.len() + 4;
        let (marker, payload) = reader.block()?;
        if marker != HEADER_MARK {
            return Err(reader.corrupt(reader.head_fault()));
        }
        let header = Header::decode(&reader.bytes[payload.0..payload.1])
            .map_err(|name| reader.corrupt(Fault::Field { name }))?;
        reader.offset = payload.1;
        reader.columns = Columns::new(header.rate_hz);
        reader.header = header;
        Ok(reader)
    }

    /// What the file says of itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Frames read so far.
    pub fn frames(&self) -> u64 {
        self.columns.index
    }

    /// Whether the end block was reached. True only after the last frame was read.
    pub fn complete(&self) -> bool {
        self.complete
    }

    /// Refuses a file of the other kind.
    ///
    /// # Errors
    /// [`ReadError::Kind`].
    pub fn expect(&self, expected: Kind) -> Result<(), ReadError> {
        let found = self.header.kind;
        if found == expected {
            return Ok(());
        }
        Err(ReadError::Kind { file: self.file.clone(), expected, found })
    }

    /// Reads all that is left.
    pub(crate) fn drain(&mut self, mut take: impl FnMut(Frame)) -> Ending {
        for frame in self.by_ref() {
            match frame {
                Ok(frame) => take(frame),
                Err(error) => return Ending::Damaged(error),
            }
        }
        if self.complete { Ending::Complete } else { Ending::Unfinished }
    }

    /// The next frame; `None` at the end of the file.
    fn next_frame(&mut self) -> Result<Option<Frame>, ReadError> {
        if self.offset == self.bytes.len() {
            return Ok(None);
        }
        let (marker, (start, end)) = self.block()?;
        if marker == END_MARK {
            return self.end(start, end).map(|()| None);
        }
        if marker != FRAME_MARK {
            return Err(self.corrupt(self.head_fault()));
        }
        let mut input = Input::new(&self.bytes[start..end]);
        let found = Columns::decode_index(&mut input);
        let expected = self.columns.index;
        match found {
            None => return Err(self.corrupt(Fault::Field { name: "frame index" })),
            Some(found) if found != expected => {
                return Err(self.corrupt(Fault::Index { expected, found }));
            }
            Some(_) => {}
        }
        let frame = match self.header.kind {
            Kind::Flight => self.columns.decode_pose(&mut input).map(Frame::Pose),
            Kind::Recording => {
                self.columns.decode_frame(&mut input, has_flags(self.version)).map(Frame::Recorded)
            }
        };
        let whole = input.len() == 0;
        match frame {
            Ok(frame) if whole => {
                self.columns.advance();
                self.offset = end;
                Ok(Some(frame))
            }
            Ok(_) => Err(self.corrupt(Fault::Field { name: "end of the frame" })),
            Err(name) => Err(self.corrupt(Fault::Field { name })),
        }
    }

    /// Checks the end block.
    fn end(&mut self, start: usize, end: usize) -> Result<(), ReadError> {
        let found = self.columns.index;
        let Ok(expected) = self.bytes[start..end].try_into().map(u64::from_le_bytes) else {
            return Err(self.corrupt(Fault::Field { name: "end block" }));
        };
        let promised = self.header.frames;
        for expected in [expected, if promised == 0 { found } else { promised }] {
            if expected != found {
                return Err(self.corrupt(Fault::Frames { expected, found }));
            }
        }
        self.offset = end;
        if end != self.bytes.len() {
            let found = (self.bytes.len() - end) as u64;
            return Err(self.corrupt(Fault::AfterEnd { found }));
        }
        self.complete = true;
        Ok(())
    }

    /// Marker and payload (from, to) of the block at `offset`, which is not the end of the file.
    fn block(&self) -> Result<(u8, (usize, usize)), ReadError> {
        let start = self.offset + BLOCK_HEAD;
        let Some(&[marker, a, b, c, check, w, x, y, z]) =
            self.bytes.get(self.offset..start).and_then(|head| head.as_array::<BLOCK_HEAD>())
        else {
            return Err(self.truncated());
        };
        if check != check_byte(marker, [a, b, c]) {
            return Err(self.corrupt(self.head_fault()));
        }
        let length = usize::try_from(u32::from_le_bytes([a, b, c, 0])).expect("24 bits fit");
        let Some(payload) = self.bytes.get(start..start + length) else {
            return Err(self.truncated());
        };
        let (expected, found) = (u32::from_le_bytes([w, x, y, z]), crc32fast::hash(payload));
        if expected != found {
            return Err(self.corrupt(Fault::Checksum { expected, found }));
        }
        Ok((marker, (start, start + length)))
    }

    fn head_fault(&self) -> Fault {
        let head = &self.bytes[self.offset..self.offset + 5];
        Fault::Head { found: head.try_into().expect("five bytes were taken") }
    }

    fn corrupt(&self, what: Fault) -> ReadError {
        let (file, frame) = (self.file.clone(), self.columns.index);
        ReadError::Corrupt { file, offset: self.offset as u64, frame, what }
    }

    fn truncated(&self) -> ReadError {
        let (file, frames) = (self.file.clone(), self.columns.index);
        ReadError::Truncated { file, offset: self.offset as u64, frames }
    }
}

impl Iterator for Reader {
    type Item = Result<Frame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.done {
            return None;
        }
        let next = self.next_frame();
        self.done = !matches!(next, Ok(Some(_)));
        next.transpose()
    }
}

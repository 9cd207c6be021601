//! Reading a file, to its end or to the first byte that cannot be right.
//!
//! In:    an `.ovf` file, whole or damaged.
//! Out:   its header and frames, bit for bit, and how it ends.
//! Keeps: a window of the bytes, and the columns of the last frame.
//! Not here: the bytes' meaning (`format`, `payload`).

mod blocks;
mod bytes;
mod error;

use crate::format::{
    END_MARK, FRAME_MARK, HEADER_MARK, Header, KEY_EVERY, Kind, MAGIC, RecordedFrame, VERSION,
    is_readable,
};
use crate::payload::Columns;
use crate::pose::Pose;
use crate::words::Input;
use blocks::{Block, Broken, Place};
use bytes::Bytes;
use std::path::Path;

pub use blocks::Tail;
pub use error::{Fault, ReadError};

/// Reads one file, frame by frame: an iterator that stops after the first error.
///
/// Frames before a damaged one are good, since every block has its own checksum. The file is read
/// as frames are asked for, and as long as it was when it was opened: memory does not grow with it.
pub struct Reader {
    bytes: Bytes,
    file: String,
    version: u32,
    header: Header,
    columns: Columns,
    /// Where the first frame's block begins.
    first: u64,
    /// Where the next block begins.
    offset: u64,
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
        match Bytes::open(path) {
            Ok(bytes) => Self::new(bytes, file),
            Err(source) => Err(ReadError::Io { file, source }),
        }
    }

    /// Reads the header of a file in memory; errors call it `name`.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ReadError> {
        Self::new(Bytes::memory(bytes.to_vec()), name.into())
    }

    fn new(bytes: Bytes, file: String) -> Result<Self, ReadError> {
        let mut reader = Self {
            bytes,
            file,
            version: VERSION,
            header: Header::flight("", 1.0),
            columns: Columns::new(1.0),
            first: 0,
            offset: 0,
            done: false,
            complete: false,
        };
        let start = reader.bytes.at(0, MAGIC.len() + 4);
        let start = start.map(<[u8]>::to_vec).map_err(|error| reader.broken(error.into()))?;
        let magic = &start[..start.len().min(MAGIC.len())];
        if !MAGIC.starts_with(magic) {
            return Err(ReadError::Foreign { found: magic.to_vec(), file: reader.file });
        }
        let Some(version) = start.get(MAGIC.len()..MAGIC.len() + 4) else {
            return Err(reader.broken(Broken::Ends));
        };
        let found = u32::from_le_bytes(version.try_into().expect("four bytes were taken"));
        if !is_readable(found) {
            return Err(ReadError::Version { file: reader.file, found });
        }
        reader.version = found;
        reader.offset = start.len() as u64;
        let block = reader.block()?;
        if block.marker() != HEADER_MARK {
            return Err(reader.corrupt(Fault::Head { found: block.head }));
        }
        let decoded = reader.bytes.at(block.start, block.length).map(Header::decode);
        let header = decoded.map_err(|error| reader.broken(error.into()))?;
        let header = header.map_err(|name| reader.corrupt(Fault::Field { name }))?;
        (reader.first, reader.offset) = (block.end(), block.end());
        reader.columns = Columns::new(header.rate_hz);
        reader.header = header;
        Ok(reader)
    }

    /// What the file says of itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Index of the next frame: of a file that is read from its beginning, the frames read so far.
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

    /// How many frames there are, from the last bytes of the file alone. What is next stays next.
    ///
    /// # Errors
    /// [`ReadError::Io`].
    pub fn tail(&mut self) -> Result<Tail, ReadError> {
        blocks::tail(&mut self.bytes, self.first).map_err(|error| self.broken(error.into()))
    }

    /// Makes `frame` the next one, or the end of the file if that comes after as many frames.
    ///
    /// This reads a few windows of the file and decodes the frames since the last key frame, at
    /// most [`KEY_EVERY`] − 1 of them, however long the file is. It needs no end block. Frames
    /// behind a damaged one can be reached from the next key frame on.
    ///
    /// # Errors
    /// Where the file has fewer frames, or one on the way from the key frame is damaged.
    pub fn seek(&mut self, frame: u64) -> Result<(), ReadError> {
        let key = frame - frame % KEY_EVERY;
        if self.columns.index == frame {
            self.done = false;
            return Ok(());
        }
        if !(key..=frame).contains(&self.columns.index) {
            self.jump(key)?;
        }
        self.done = false;
        while self.columns.index < frame {
            if self.next().transpose()?.is_none() {
                return Err(self.beyond(frame));
            }
        }
        if self.columns.index != frame {
            return Err(self.beyond(frame));
        }
        self.columns.skipped();
        Ok(())
    }

    /// Makes a key frame the next one.
    fn jump(&mut self, key: u64) -> Result<(), ReadError> {
        let place = blocks::key_frame(&mut self.bytes, self.first, key);
        let place = place.map_err(|error| self.broken(error.into()))?;
        self.complete = false;
        let (offset, index) = match place {
            Place::At(offset) => (offset, key),
            Place::Lost { frames, end } | Place::Beyond { frames, end } => (end, frames),
        };
        self.offset = offset;
        self.columns.jump(index);
        if let Place::Lost { frames, .. } = place {
            let fault = Fault::Index { expected: frames, found: key };
            return Err(self.block().err().unwrap_or_else(|| self.corrupt(fault)));
        }
        Ok(())
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
        let block = self.block()?;
        match block.marker() {
            FRAME_MARK => {}
            END_MARK => return self.end(block).map(|()| None),
            _ => return Err(self.corrupt(Fault::Head { found: block.head })),
        }
        let payload = match self.bytes.at(block.start, block.length) {
            Ok(payload) => payload,
            Err(error) => return Err(self.broken(error.into())),
        };
        match decoded(payload, (self.header.kind, self.version), &mut self.columns) {
            Ok(frame) => {
                self.columns.advance();
                self.offset = block.end();
                Ok(Some(frame))
            }
            Err(fault) => Err(self.corrupt(fault)),
        }
    }

    /// Checks the end block.
    fn end(&mut self, block: Block) -> Result<(), ReadError> {
        let found = self.columns.index;
        let payload = match self.bytes.at(block.start, block.length) {
            Ok(payload) => payload.try_into().map(u64::from_le_bytes),
            Err(error) => return Err(self.broken(error.into())),
        };
        let Ok(expected) = payload else {
            return Err(self.corrupt(Fault::Field { name: "end block" }));
        };
        let promised = self.header.frames;
        for expected in [expected, if promised == 0 { found } else { promised }] {
            if expected != found {
                return Err(self.corrupt(Fault::Frames { expected, found }));
            }
        }
        self.offset = block.end();
        if self.offset != self.bytes.len() {
            let found = self.bytes.len() - self.offset;
            return Err(self.corrupt(Fault::AfterEnd { found }));
        }
        self.complete = true;
        Ok(())
    }

    /// The block at `offset`, which is not the end of the file.
    fn block(&mut self) -> Result<Block, ReadError> {
        blocks::block(&mut self.bytes, self.offset).map_err(|broken| self.broken(broken))
    }

    fn broken(&self, broken: Broken) -> ReadError {
        let (file, offset, frames) = (self.file.clone(), self.offset, self.columns.index);
        match broken {
            Broken::Io(source) => ReadError::Io { file, source },
            Broken::Ends => ReadError::Truncated { file, offset, frames },
            Broken::Fault(what) => ReadError::Corrupt { file, offset, frame: frames, what },
        }
    }

    fn corrupt(&self, what: Fault) -> ReadError {
        self.broken(Broken::Fault(what))
    }

    fn beyond(&self, frame: u64) -> ReadError {
        ReadError::Beyond { file: self.file.clone(), frame, frames: self.columns.index }
    }
}

/// A frame's payload, which holds nothing else.
fn decoded(
    payload: &[u8],
    (kind, version): (Kind, u32),
    columns: &mut Columns,
) -> Result<Frame, Fault> {
    let mut input = Input::new(payload);
    let expected = columns.index;
    match Columns::decode_index(&mut input) {
        None => return Err(Fault::Field { name: "frame index" }),
        Some(found) if found != expected => return Err(Fault::Index { expected, found }),
        Some(_) => {}
    }
    let frame = match kind {
        Kind::Flight => columns.decode_pose(&mut input).map(Frame::Pose),
        Kind::Recording => columns.decode_frame(&mut input, version).map(Frame::Recorded),
    };
    let frame = frame.map_err(|name| Fault::Field { name })?;
    if input.len() != 0 {
        return Err(Fault::Field { name: "end of the frame" });
    }
    Ok(frame)
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

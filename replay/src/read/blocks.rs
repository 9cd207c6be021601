//! Blocks of a file, one by one, and those that can be found without the ones before them.
//!
//! In:    the bytes of a file.
//! Out:   whole blocks, or why there is none; the block of a key frame; how many frames there are.
//! Keeps: nothing.
//! Not here: what blocks hold (`format`, `payload`).
//!
//! There is no index that a kill could leave unwritten, since none is needed. A block tells that it
//! is one by its check byte and checksum, wherever the reader lands; a frame's block begins with
//! the frame's index. So a key frame is found by halving the file.

use super::bytes::{Bytes, WINDOW};
use super::error::Fault;
use crate::format::{BLOCK_HEAD, END_MARK, FRAME_MARK, check_byte};
use crate::words::Input;
use core::ops::Range;
use std::io;

/// So few bytes are walked through block by block and not halved any more.
const NEAR: u64 = WINDOW as u64;
/// No frame takes fewer: a head, an index and seven words, or more counts and fewer words.
const FRAME_MIN: u64 = BLOCK_HEAD as u64 + 8;
/// The end block.
const END: usize = BLOCK_HEAD + 8;
/// A count takes no more bytes.
const COUNT_MAX: usize = 10;

/// A whole block with the right checksum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Block {
    /// Marker, length and check byte.
    pub(crate) head: [u8; 5],
    /// Where its payload begins.
    pub(crate) start: u64,
    /// Bytes of its payload.
    pub(crate) length: usize,
}

/// Why there is no block.
#[derive(Debug)]
pub(crate) enum Broken {
    /// The file system refused.
    Io(io::Error),
    /// The file ends before the block does.
    Ends,
    /// It is damaged.
    Fault(Fault),
}

impl From<io::Error> for Broken {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl Block {
    pub(crate) fn marker(&self) -> u8 {
        self.head[0]
    }

    /// Where the next block begins.
    pub(crate) fn end(&self) -> u64 {
        self.start + self.length as u64
    }
}

/// The block at `offset`. Its length counts for nothing before the file is known to be as long.
pub(crate) fn block(bytes: &mut Bytes, offset: u64) -> Result<Block, Broken> {
    let Some(&[marker, a, b, c, check, w, x, y, z]) =
        bytes.at(offset, BLOCK_HEAD)?.as_array::<BLOCK_HEAD>()
    else {
        return Err(Broken::Ends);
    };
    let head = [marker, a, b, c, check];
    if check != check_byte(marker, [a, b, c]) {
        return Err(Broken::Fault(Fault::Head { found: head }));
    }
    let length = usize::try_from(u32::from_le_bytes([a, b, c, 0])).expect("24 bits fit");
    let start = offset + BLOCK_HEAD as u64;
    if bytes.len() - start < length as u64 {
        return Err(Broken::Ends);
    }
    let payload = bytes.at(start, length)?;
    if payload.len() < length {
        return Err(Broken::Ends);
    }
    let (expected, found) = (u32::from_le_bytes([w, x, y, z]), crc32fast::hash(payload));
    if expected != found {
        return Err(Broken::Fault(Fault::Checksum { expected, found }));
    }
    Ok(Block { head, start, length })
}

/// A frame's block that was found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Found {
    /// Where it begins.
    pub(crate) offset: u64,
    /// Where the next block begins.
    pub(crate) end: u64,
    /// The frame's.
    pub(crate) index: u64,
}

/// The first whole block of a frame from `least` on that begins in `range`, wherever that begins.
fn find(bytes: &mut Bytes, range: Range<u64>, least: u64) -> io::Result<Option<Found>> {
    let mut at = range.start;
    while at < range.end {
        let seen = bytes.at(at, BLOCK_HEAD + COUNT_MAX)?;
        if looks_like_a_frame(seen, least..at / FRAME_MIN)
            && let Some(found) = frame_at(bytes, at)?
        {
            return Ok(Some(found));
        }
        at += 1;
    }
    Ok(None)
}

/// Whether a frame with an index in `indices` may begin so. What does not is not read further: one
/// in 65 000 places is a block's head by chance, and its length may be anything.
fn looks_like_a_frame(seen: &[u8], indices: Range<u64>) -> bool {
    let [marker, a, b, c, check, _, _, _, _, rest @ ..] = seen else { return false };
    *marker == FRAME_MARK
        && *check == check_byte(*marker, [*a, *b, *c])
        && Input::new(rest).count().is_some_and(|index| indices.contains(&index))
}

fn frame_at(bytes: &mut Bytes, offset: u64) -> io::Result<Option<Found>> {
    let block = match block(bytes, offset) {
        Ok(block) => block,
        Err(Broken::Io(error)) => return Err(error),
        Err(Broken::Ends | Broken::Fault(_)) => return Ok(None),
    };
    let payload = bytes.at(block.start, block.length.min(COUNT_MAX))?;
    let index = Input::new(payload).count();
    Ok(index.map(|index| Found { offset, end: block.end(), index }))
}

/// Where a key frame is, or what is there instead.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Place {
    /// Its block begins here.
    At(u64),
    /// Its block is not here, where damage or a later frame begins, after so many frames.
    Lost { frames: u64, end: u64 },
    /// The file has no later frame; the last whole one has so many before and with it, and its
    /// block ends here.
    Beyond { frames: u64, end: u64 },
}

/// Looks for a key frame in a file whose frames begin at `first`.
pub(crate) fn key_frame(bytes: &mut Bytes, first: u64, key: u64) -> io::Result<Place> {
    let (mut low, mut high, mut least) = (first, bytes.len(), 0);
    while high - low > NEAR {
        let middle = low + (high - low) / 2;
        match find(bytes, middle..high, least)? {
            Some(found) if found.index <= key => (low, least) = (found.offset, found.index),
            _ => high = middle,
        }
    }
    let (mut frames, mut at) = (0, low);
    while let Some(found) = find(bytes, at..bytes.len(), 0)? {
        match found.index {
            index if index == key => return Ok(Place::At(found.offset)),
            index if index > key => return Ok(Place::Lost { frames, end: at }),
            index => (frames, at) = (index + 1, found.end),
        }
    }
    Ok(Place::Beyond { frames, end: at })
}

/// What the end of a file tells without the rest of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tail {
    /// Frames up to the last whole one. Fewer can be read in order where one before it is damaged.
    pub frames: u64,
    /// The last whole frame is followed by the end block, and that by nothing.
    pub complete: bool,
}

/// Looks at the end of a file whose frames begin at `first`.
pub(crate) fn tail(bytes: &mut Bytes, first: u64) -> io::Result<Tail> {
    let mut reach = NEAR;
    loop {
        let mut at = bytes.len().saturating_sub(reach).max(first);
        let is_all = at == first;
        let mut last = None;
        while let Some(found) = find(bytes, at..bytes.len(), 0)? {
            (last, at) = (Some(found.index), found.end);
        }
        if is_all || last.is_some() {
            let frames = last.map_or(0, |last| last + 1);
            let end = [&[END_MARK][..], &frames.to_le_bytes()].concat();
            let complete = at + END as u64 == bytes.len()
                && block(bytes, at).is_ok_and(|block| {
                    let payload = bytes.at(block.start, block.length).unwrap_or_default();
                    block.marker() == end[0] && payload == &end[1..]
                });
            return Ok(Tail { frames, complete });
        }
        reach = reach.saturating_mul(8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Header;
    use crate::read::{Frame, Reader};
    use crate::{Pose, Writer};
    use overfly_core::geodesy::Geodetic;
    use overfly_core::units::Radians;

    const FRAMES: u64 = 40_000;

    fn pose(index: u64) -> Pose {
        let t = index as f64;
        Pose {
            time_s: t / 60.0,
            at: Geodetic { lat_rad: 0.8 + t * 1e-7, lon_rad: t.sqrt(), height_m: t * 0.37 },
            heading: Radians(t * 0.01),
            pitch: Radians(0.1),
            roll: Radians(-t),
        }
    }

    #[test]
    fn a_frame_of_a_long_file_costs_a_few_windows_and_no_memory() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.ovf");
        let mut writer = Writer::create(&path, &Header::flight("long", 60.0)).unwrap();
        (0..FRAMES).for_each(|index| writer.pose(&pose(index)).unwrap());
        drop(writer);
        let mut reader = Reader::open(&path).unwrap();
        assert_eq!(reader.tail().unwrap(), Tail { frames: FRAMES, complete: false });
        let windows = |bytes: u64| bytes.div_ceil(WINDOW as u64);
        let (length, tail) = (reader.bytes.len(), reader.bytes.read);
        assert!(windows(length) > 16 && windows(tail) <= 3, "{tail} of {length} bytes");
        // What halving looks at, then what is walked through and decoded.
        let most = u64::from(windows(length).ilog2()) + 5;
        for index in (0..100).map(|i| i * 7919 % FRAMES).chain([0, 255, 256, 39_935, 39_999]) {
            let before = reader.bytes.read;
            reader.seek(index).unwrap();
            let Some(Ok(Frame::Pose(found))) = reader.next() else { panic!("no frame {index}") };
            assert_eq!(found, pose(index));
            let read = windows(reader.bytes.read - before);
            assert!(read <= most, "frame {index} took {read} windows, of {most}");
        }
        reader.seek(0).unwrap();
        let before = reader.bytes.read;
        assert_eq!(reader.by_ref().map(Result::unwrap).count() as u64, FRAMES);
        assert!(reader.bytes.held() <= 2 * WINDOW, "{} bytes in memory", reader.bytes.held());
        assert!(reader.bytes.read - before < length + length / 64, "hardly a byte twice");
    }
}

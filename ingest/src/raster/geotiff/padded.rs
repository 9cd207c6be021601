//! LZW tiles with their padding, at a raster's right edge.
//!
//! In:    a packed tile and the tags that say how numbers are stored.
//! Out:   the whole tile's numbers, padding included.
//! Keeps: nothing.
//! Not here: any other tile; the decoder reads those by itself.
//!
//! The decoder cuts padding off row by row, and its LZW reader then stops before the end of
//! sound data: <https://github.com/image-rs/image-tiff/issues/395>. A file in memory whose
//! only strip is the tile has no padding to cut off. Goes when a release has the fix.

use std::io::{Cursor, Read};
use tiff::TiffResult;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::ByteOrder;

/// How a file stores its numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coding {
    pub order: ByteOrder,
    pub bits: u32,
    /// TIFF's SampleFormat.
    pub format: u32,
    pub predictor: u32,
}

/// Where the tile begins: after the header and a directory of eleven tags.
const DATA_AT: u32 = 8 + 2 + 11 * 12 + 4;

/// Decodes a tile of `size`.
pub(super) fn decode(
    coding: Coding,
    size: [u32; 2],
    packed: &mut impl Read,
    packed_bytes: u64,
) -> TiffResult<DecodingResult> {
    let [width, height] = size;
    let count = u32::try_from(packed_bytes)?;
    let tags = [
        (256, width),
        (257, height),
        (258, coding.bits),
        (259, 5),
        (262, 1),
        (273, DATA_AT),
        (277, 1),
        (278, height),
        (279, count),
        (317, coding.predictor),
        (339, coding.format),
    ];
    let mut file = Vec::with_capacity(usize::try_from(packed_bytes)? + 256);
    let short = |number: u16| match coding.order {
        ByteOrder::LittleEndian => number.to_le_bytes(),
        ByteOrder::BigEndian => number.to_be_bytes(),
    };
    let long = |number: u32| match coding.order {
        ByteOrder::LittleEndian => number.to_le_bytes(),
        ByteOrder::BigEndian => number.to_be_bytes(),
    };
    file.extend(match coding.order {
        ByteOrder::LittleEndian => b"II",
        ByteOrder::BigEndian => b"MM",
    });
    file.extend(short(42));
    file.extend(long(8));
    file.extend(short(11));
    for (tag, value) in tags {
        file.extend(short(tag));
        // Every value is one 32-bit number.
        file.extend(short(4));
        file.extend(long(1));
        file.extend(long(value));
    }
    file.extend(long(0));
    packed.take(packed_bytes).read_to_end(&mut file)?;
    Decoder::new(Cursor::new(file))?.read_chunk(0)
}

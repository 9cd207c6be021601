//! A look at a TIFF's first directory before the decoder sees it.
//!
//! In:    the file.
//! Out:   refusals of what would make the decoder allocate by a header's word alone.
//! Keeps: nothing.
//! Not here: what the tags mean (`georef`, and the `tiff` crate).
//! Source: TIFF 6.0, section 2; BigTIFF as libtiff has it.

use super::super::RasterError;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Most strips or tiles. The decoder holds 48 bytes for each while it opens the file.
const CHUNKS_MAX: u64 = 1 << 21;

/// Most values of any other tag.
const VALUES_MAX: u64 = 1 << 18;

/// Most tags.
const TAGS_MAX: u64 = 4096;

/// Widths, heights and tile edges beyond this make products that no integer holds.
const EDGE_MAX: u64 = 1 << 31;

const IMAGE_WIDTH: u16 = 256;
const IMAGE_LENGTH: u16 = 257;
const STRIP_OFFSETS: u16 = 273;
const SAMPLES_PER_PIXEL: u16 = 277;
const STRIP_BYTE_COUNTS: u16 = 279;
const TILE_WIDTH: u16 = 322;
const TILE_LENGTH: u16 = 323;
const TILE_OFFSETS: u16 = 324;
const TILE_BYTE_COUNTS: u16 = 325;

/// What a file is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bands {
    /// One band of heights.
    Heights,
    /// Grey or red, green and blue, with alpha or without.
    Colours,
}

/// Byte order and widths of a TIFF's numbers.
struct Layout {
    big_endian: bool,
    big_tiff: bool,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The value itself, where it fits.
    field: [u8; 8],
}

/// Reads the first directory's entries (not their values) and refuses what cannot be so.
pub(super) fn check(
    name: &Path,
    file: &mut (impl Read + Seek),
    file_bytes: u64,
    bands: Bands,
) -> Result<(), RasterError> {
    let io = |error| RasterError::io(name, error);
    let mut start = [0; 16];
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    file.read_exact(&mut start[..8]).map_err(io)?;
    let layout = layout_of(name, &start)?;
    let at = if layout.big_tiff {
        file.read_exact(&mut start[8..]).map_err(io)?;
        layout.number(&start[8..16])
    } else {
        layout.number(&start[4..8])
    };
    file.seek(SeekFrom::Start(at)).map_err(io)?;
    let mut count = [0; 8];
    let count = &mut count[..if layout.big_tiff { 8 } else { 2 }];
    file.read_exact(count).map_err(io)?;
    let tags = layout.number(count);
    if tags > TAGS_MAX {
        return Err(RasterError::broken(name, format!("a directory of {tags} tags")));
    }
    let mut edges = Edges::default();
    for _ in 0..tags {
        let entry = layout.entry(file).map_err(io)?;
        entry_fits(name, &entry, file_bytes)?;
        edges.note(&layout, &entry);
    }
    edges.check(name, bands)
}

fn layout_of(name: &Path, start: &[u8]) -> Result<Layout, RasterError> {
    let big_endian = match &start[..2] {
        b"II" => false,
        b"MM" => true,
        _ => return Err(RasterError::broken(name, "not a TIFF: it begins with neither II nor MM")),
    };
    let layout = Layout { big_endian, big_tiff: false };
    match layout.number(&start[2..4]) {
        42 => Ok(layout),
        43 => Ok(Layout { big_tiff: true, ..layout }),
        version => Err(RasterError::broken(name, format!("not a TIFF: its version is {version}"))),
    }
}

fn entry_fits(name: &Path, entry: &Entry, file_bytes: u64) -> Result<(), RasterError> {
    let most = match entry.tag {
        STRIP_OFFSETS | STRIP_BYTE_COUNTS | TILE_OFFSETS | TILE_BYTE_COUNTS => CHUNKS_MAX,
        _ => VALUES_MAX,
    };
    let bytes = entry.count.saturating_mul(value_bytes(entry.kind));
    if entry.count > most || bytes > file_bytes {
        let found = format!(
            "tag {} declares {} values; the file has {file_bytes} bytes and {most} are read",
            entry.tag, entry.count
        );
        return Err(RasterError::broken(name, found));
    }
    Ok(())
}

/// Bytes of one value of a field type; unknown types, which the decoder skips, count as one.
fn value_bytes(kind: u16) -> u64 {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}

/// The sizes that are multiplied with each other.
#[derive(Default)]
struct Edges {
    of: [u64; 4],
    bands: u64,
}

impl Edges {
    fn note(&mut self, layout: &Layout, entry: &Entry) {
        let value =
            layout.number(&entry.field[..usize::try_from(value_bytes(entry.kind)).unwrap_or(8)]);
        match entry.tag {
            IMAGE_WIDTH => self.of[0] = value,
            IMAGE_LENGTH => self.of[1] = value,
            TILE_WIDTH => self.of[2] = value,
            TILE_LENGTH => self.of[3] = value,
            SAMPLES_PER_PIXEL => self.bands = value,
            _ => {}
        }
    }

    fn check(&self, name: &Path, bands: Bands) -> Result<(), RasterError> {
        let [width, height, tile_width, tile_height] = self.of;
        if self.of.iter().any(|&edge| edge > EDGE_MAX) {
            let found = format!("{width} × {height} in tiles of {tile_width} × {tile_height}");
            return Err(RasterError::broken(name, format!("its size is {found}")));
        }
        let (most, advice) = match bands {
            Bands::Heights => {
                (1, "one band of heights is read: gdal_translate -b 1 in.tif out.tif")
            }
            Bands::Colours => {
                (4, "1 to 4 bands are read: gdal_translate -b 1 -b 2 -b 3 in.tif out.tif")
            }
        };
        if self.bands > most {
            let found = format!("{} bands", self.bands);
            return Err(RasterError::unsupported(name, found, advice));
        }
        let tiles = |edge: u64, tile: u64| if tile == 0 { 1 } else { edge.div_ceil(tile) };
        if tiles(width, tile_width) * tiles(height, tile_height) > CHUNKS_MAX {
            let found = format!("more than {CHUNKS_MAX} tiles");
            return Err(RasterError::broken(name, found));
        }
        Ok(())
    }
}

impl Layout {
    fn number(&self, bytes: &[u8]) -> u64 {
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        if self.big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) }
    }

    fn entry(&self, file: &mut impl Read) -> std::io::Result<Entry> {
        let mut bytes = [0; 20];
        let width = if self.big_tiff { 8 } else { 4 };
        let bytes = &mut bytes[..4 + 2 * width];
        file.read_exact(bytes)?;
        let mut field = [0; 8];
        field[..width].copy_from_slice(&bytes[4 + width..]);
        let short = |at: usize| {
            u16::try_from(self.number(&bytes[at..at + 2])).expect("two bytes are 16 bits")
        };
        let count = self.number(&bytes[4..4 + width]);
        Ok(Entry { tag: short(0), kind: short(2), count, field })
    }
}

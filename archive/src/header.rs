//! Where an archive's parts lie: checked before the `pmtiles` crate follows any offset.
//!
//! In:    the first bytes of an archive, its size where known.
//! Out:   [`Sections`], disjoint and within the archive.
//! Keeps: nothing.
//! Not here: directories and tiles, which the crate finds its way through.
//! Source: the PMTiles version 3 specification, section 3.

use crate::fault::ArchiveFault;
use bytes::Bytes;
use pmtiles::{Compression, Header, TileType};
use std::ops::Range;

/// Header and root directory lie within so many bytes from the start.
pub(crate) const OPENING_BYTES: usize = 16_384;
const HEADER_BYTES: usize = 127;
const MAGIC: &[u8] = b"PMTiles";

/// The parts of an archive, as ranges of bytes.
#[derive(Debug)]
pub(crate) struct Sections {
    pub(crate) root: Range<u64>,
    pub(crate) metadata: Range<u64>,
    pub(crate) leaves: Range<u64>,
    pub(crate) tiles: Range<u64>,
    /// Of directories and metadata.
    pub(crate) internal: Compression,
    pub(crate) tile_compression: Compression,
    pub(crate) tile_type: TileType,
}

/// The sections of an archive that begins with `opening`.
pub(crate) fn sections(opening: &Bytes, size: Option<u64>) -> Result<Sections, ArchiveFault> {
    if !opening.starts_with(MAGIC) {
        return Err(ArchiveFault::NotPmtiles);
    }
    if opening.len() < HEADER_BYTES {
        return Err(ArchiveFault::Corrupt("it ends within its header".into()));
    }
    if opening[MAGIC.len()] != 3 {
        return Err(ArchiveFault::PmtilesVersion(opening[MAGIC.len()]));
    }
    let header = Header::try_from_bytes(opening.slice(..HEADER_BYTES))
        .map_err(ArchiveFault::from_pmtiles)?;
    let sections = Sections {
        root: range(opening, 8, "root directory")?,
        metadata: range(opening, 24, "metadata")?,
        leaves: range(opening, 40, "leaf directories")?,
        tiles: range(opening, 56, "tiles")?,
        internal: header.internal_compression(),
        tile_compression: header.tile_compression,
        tile_type: header.tile_type,
    };
    sections.checked(size)
}

/// The section whose offset and length stand at byte `at` of the header.
fn range(opening: &Bytes, at: usize, name: &str) -> Result<Range<u64>, ArchiveFault> {
    let number =
        |at: usize| u64::from_le_bytes(opening[at..at + 8].try_into().expect("a slice of 8 bytes"));
    let (offset, length) = (number(at), number(at + 8));
    match offset.checked_add(length) {
        Some(end) => Ok(offset..end),
        None => Err(ArchiveFault::Corrupt(format!("its {name} end beyond any file"))),
    }
}

impl Sections {
    fn checked(self, size: Option<u64>) -> Result<Self, ArchiveFault> {
        let named = [
            (&self.root, "root directory"),
            (&self.metadata, "metadata"),
            (&self.leaves, "leaf directories"),
            (&self.tiles, "tiles"),
        ];
        for (range, name) in named {
            if range.end > size.unwrap_or(u64::MAX) && !range.is_empty() {
                let (end, size) = (range.end, size.unwrap_or(u64::MAX));
                let what = format!("it is {size} bytes long, but its {name} end at byte {end}");
                return Err(ArchiveFault::Corrupt(what));
            }
        }
        if self.root.is_empty() || self.root.end > OPENING_BYTES as u64 {
            let what = format!("its root directory is not within its first {OPENING_BYTES} bytes");
            return Err(ArchiveFault::Corrupt(what));
        }
        let mut used: Vec<_> = named.into_iter().filter(|(range, _)| !range.is_empty()).collect();
        used.sort_by_key(|(range, _)| range.start);
        let overlap = used.windows(2).find(|pair| pair[0].0.end > pair[1].0.start);
        if self.root.start < HEADER_BYTES as u64 || overlap.is_some() {
            return Err(ArchiveFault::Corrupt("its sections overlap".into()));
        }
        Ok(self)
    }
}

/// What tiles are, for people.
pub(crate) fn tile_name(tile_type: TileType) -> &'static str {
    match tile_type {
        TileType::Mvt => "Mapbox vector tiles",
        TileType::Png => "PNG pictures",
        TileType::Jpeg => "JPEG pictures",
        TileType::Webp => "WebP pictures",
        TileType::Avif => "AVIF pictures",
        TileType::Mlt => "MapLibre vector tiles",
        TileType::Unknown => "of no stated type",
    }
}

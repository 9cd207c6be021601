//! Archives to read: proper ones from the crate's writer, odd ones put together by hand.
//!
//! In:    tiles, metadata, compression; or sections as bytes.
//! Out:   the bytes of an archive.
//! Keeps: nothing.
//! Not here: what is expected of reading them.

use overfly_archive::{Archive, ArchiveError, ArchiveFacts, Datum, LayerFacts, Location};
use overfly_archive::{OpenOptions, metadata};
use overfly_core::datasource::PageKey;
use overfly_core::digest::mix;
use overfly_core::geodesy::Ellipsoid;
use pmtiles::{Compression, PmTilesWriter, TileCoord, TileType};
use serde_json::Value;
use std::io::{Cursor, Write};
use std::path::PathBuf;

/// Facts of an archive of `depth_max` levels.
pub fn facts(depth_max: u8) -> ArchiveFacts {
    ArchiveFacts {
        version: 1,
        body_name: "earth".into(),
        body: Ellipsoid::WGS84,
        datum: Datum::Egm96,
        height_range_m: [-100.0, 4000.0],
        content: mix(u64::from(depth_max)),
        layers: vec![LayerFacts {
            depth: depth_max,
            quantum_m: 0.1,
            spacing_m: 90.0,
            blend_m: 300.0,
            sources: vec!["made up".into()],
        }],
    }
}

/// Every page down to `depth_max`.
pub fn keys(depth_max: u8) -> Vec<PageKey> {
    let mut keys: Vec<PageKey> = (0..4).map(PageKey::root).collect();
    let mut at = 0;
    while keys[at].depth() < depth_max {
        let key = keys[at];
        keys.extend((0..4).map(|index| key.child(index)));
        at += 1;
    }
    keys
}

/// The payload of a page: a few bytes that only it has, of its own length.
pub fn payload(key: PageKey) -> Vec<u8> {
    let bits = key.bits().to_le_bytes();
    bits.into_iter().cycle().take(8 + (mix(key.bits()) % 9) as usize).collect()
}

/// An archive of every page down to `depth_max`, tiles compressed as said.
pub fn archive(depth_max: u8, internal: Compression, tiles: Compression) -> Vec<u8> {
    let metadata = metadata::to_json(&facts(depth_max), Value::Null);
    archive_of(&keys(depth_max), &metadata, TileType::Unknown, (internal, tiles))
}

/// An archive of some pages.
pub fn archive_of(
    keys: &[PageKey],
    metadata: &str,
    tile_type: TileType,
    (internal, tiles): (Compression, Compression),
) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let writer = PmTilesWriter::new(tile_type)
        .internal_compression(internal)
        .tile_compression(tiles)
        .metadata(metadata);
    let mut writer = writer.create(&mut file).unwrap();
    for &key in keys {
        let (z, x, y) = key.zxy();
        writer.add_tile(TileCoord::new(z, x, y).unwrap(), &payload(key)).unwrap();
    }
    writer.finalize().unwrap();
    file.into_inner()
}

/// Sections of an archive that no sane writer would make.
pub struct Parts {
    pub root: Vec<u8>,
    pub metadata: Vec<u8>,
    pub leaves: Vec<u8>,
    pub tiles: Vec<u8>,
    /// As the header numbers them: 1 none, 2 gzip, 4 zstd.
    pub internal: u8,
    pub tile_compression: u8,
}

impl Parts {
    /// An uncompressed archive with this root directory.
    pub fn with_root(root: Vec<u8>) -> Self {
        Self {
            root,
            metadata: metadata::to_json(&facts(3), Value::Null).into_bytes(),
            leaves: Vec::new(),
            tiles: vec![7; 100],
            internal: 1,
            tile_compression: 1,
        }
    }

    /// Its bytes: header, root, metadata, leaves, tiles.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = b"PMTiles\x03".to_vec();
        let mut offset = 127_u64;
        for part in [&self.root, &self.metadata, &self.leaves, &self.tiles] {
            bytes.extend(offset.to_le_bytes());
            bytes.extend((part.len() as u64).to_le_bytes());
            offset += part.len() as u64;
        }
        bytes.resize(96, 0);
        bytes.extend([1, self.internal, self.tile_compression, 0]);
        bytes.resize(127, 0);
        for part in [&self.root, &self.metadata, &self.leaves, &self.tiles] {
            bytes.extend(part);
        }
        bytes
    }
}

/// One entry of a directory: tile id, run length (0 for a leaf), length, offset.
pub type Entry = (u64, u64, u64, u64);

/// A directory as PMTiles has it: column by column, ids as steps, offsets plus one.
pub fn directory(entries: &[Entry]) -> Vec<u8> {
    let mut bytes = Vec::new();
    varint(&mut bytes, entries.len() as u64);
    let mut before = 0;
    for entry in entries {
        varint(&mut bytes, entry.0 - before);
        before = entry.0;
    }
    entries.iter().for_each(|entry| varint(&mut bytes, entry.1));
    entries.iter().for_each(|entry| varint(&mut bytes, entry.2));
    entries.iter().for_each(|entry| varint(&mut bytes, entry.3 + 1));
    bytes
}

fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(u8::try_from(value & 0x7F).unwrap() | 0x80);
        value >>= 7;
    }
    bytes.push(u8::try_from(value).unwrap());
}

/// Gzip of many zeros: a thousandth of them.
pub fn gzip_of_zeros(count: usize) -> Vec<u8> {
    let encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let mut encoder = encoder;
    encoder.write_all(&vec![0; count]).unwrap();
    encoder.finish().unwrap()
}

/// A file with these bytes in a folder of its own.
pub fn file(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.pmtiles");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// Opens bytes as a file.
pub fn open(bytes: &[u8]) -> Result<Archive, ArchiveError> {
    let (_folder, path) = file(bytes);
    Archive::open(&Location::File(path), &OpenOptions::default())
}

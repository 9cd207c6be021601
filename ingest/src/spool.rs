//! Tiles in the making, on disk: however large the input, memory stays small.
//!
//! In:    one record a layer and tile.
//! Out:   records, or only their statistics, by layer and key.
//! Keeps: an unnamed file, which vanishes with the process; where each record lies.
//! Not here: what records mean (`pyramid`).

use bytemuck::{Pod, Zeroable, bytes_of, bytes_of_mut, cast_slice_mut};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::page::SAMPLES;
use overfly_core::datasource::tile::MARK_SIDE;
use parking_lot::RwLock;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Blocks of cells along one side of a tile, each as wide as the way between two marks.
pub const BLOCKS: usize = MARK_SIDE - 1;
/// Marks of a tile.
pub const MARKS: usize = MARK_SIDE * MARK_SIDE;

/// What is known of one block of a tile's cells and everything finer in it. Metres.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Stat {
    /// Error of the odd and the even level whose finest samples are the tile's.
    pub error_m: [f32; 2],
    /// Greatest distance of a cell's centre from the diagonal of the next coarser grid.
    pub centre_m: f32,
    /// Greatest step between neighbouring samples of the last level.
    pub slope_m: f32,
    /// Least and greatest height; the least above the greatest where there is none.
    pub range_m: [f32; 2],
    /// 1 where all samples have full weight.
    pub full: u32,
    /// Greatest roughness at its corners.
    pub roughest: u32,
}

/// One layer of one tile.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Record {
    /// What is known of its blocks.
    pub stats: [[Stat; BLOCKS]; BLOCKS],
    /// Heights in quanta.
    pub quanta: [[i32; SAMPLES]; 1],
    /// Weights.
    pub weights: [[u8; SAMPLES]; 1],
    /// 1 where a void was filled.
    pub filled: [[u8; SAMPLES]; 1],
    /// Roughness at the marks.
    pub roughness: [[u8; MARKS]; 1],
    /// Keeps the size a whole number of words.
    pub unused: [u8; 1],
}

/// The records.
pub struct Spool {
    file: File,
    places: RwLock<BTreeMap<(u8, PageKey), u64>>,
}

impl Stat {
    /// Of a block without any sample.
    pub const NONE: Self = Self {
        error_m: [0.0; 2],
        centre_m: 0.0,
        slope_m: 0.0,
        range_m: [f32::MAX, f32::MIN],
        full: 0,
        roughest: 0,
    };
}

impl Spool {
    /// An empty spool in a folder.
    ///
    /// # Errors
    /// If no file can be made there.
    pub fn new(folder: &Path) -> io::Result<Self> {
        Ok(Self { file: tempfile::tempfile_in(folder)?, places: RwLock::default() })
    }

    /// Takes a record in.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn put(&self, layer: u8, key: PageKey, record: &Record) -> io::Result<()> {
        let place = {
            let mut places = self.places.write();
            let place = places.len() as u64;
            places.insert((layer, key), place);
            place
        };
        self.file.write_all_at(bytes_of(record), place * size_of::<Record>() as u64)
    }

    /// A record, if there is one.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn get(&self, layer: u8, key: PageKey) -> io::Result<Option<Box<Record>>> {
        let Some(place) = self.place(layer, key) else { return Ok(None) };
        let mut record = bytemuck::zeroed_box::<Record>();
        self.file.read_exact_at(bytes_of_mut(&mut *record), place)?;
        Ok(Some(record))
    }

    /// The statistics of a record.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn stats(&self, layer: u8, key: PageKey) -> io::Result<Option<[[Stat; BLOCKS]; BLOCKS]>> {
        let Some(place) = self.place(layer, key) else { return Ok(None) };
        let mut stats = [[Stat::NONE; BLOCKS]; BLOCKS];
        self.file.read_exact_at(cast_slice_mut(&mut stats), place)?;
        Ok(Some(stats))
    }

    /// Keys of a layer's records at one depth, in order.
    pub fn keys(&self, layer: u8, depth: u8) -> Vec<PageKey> {
        let places = self.places.read();
        let first = PageKey::new(0, depth, 0, 0);
        let keys = places.range((layer, first)..).map(|(&key, _)| key);
        keys.take_while(|(l, key)| *l == layer && key.depth() == depth)
            .map(|(_, key)| key)
            .collect()
    }

    fn place(&self, layer: u8, key: PageKey) -> Option<u64> {
        let place = *self.places.read().get(&(layer, key))?;
        Some(place * size_of::<Record>() as u64)
    }
}

const _: () = assert!(size_of::<Record>() < 28_000, "a tile takes no more of the disk");

//! Damaged files: an error or heights, never a panic, a hang or a mountain of memory.
//!
//! In:    sound small files of every format; a fixed seed; OVERFLY_FUZZ_CASES for more cases.
//! Out:   pass or fail.
//! Keeps: one temporary folder.
//! Not here: what each error says (the formats' tests).

use crate::other_formats::{hgt_bytes, png_bytes, zip_bytes};
use crate::tiff_file::{Number, Packing, TiffFile};
use overfly_ingest::raster::{ChunkStore, OpenOptions, TileEncoding, open};
use std::path::Path;

/// Cases when nothing else is asked for; ten times as many take some minutes.
const CASES: u64 = 2500;

/// Most memory that this whole test program may ever have held, in KiB. The design's own bound:
/// a chunk is checked against 128 MiB and against its packed size before it is decoded, tables
/// against the file's size before they are read, and the chunk store holds 8 MiB here. Tests
/// that run beside this one add theirs.
const RESIDENT_KIB_MAX: u64 = 300 * 1024;

/// A generator of fixed seed (PCG's multiplier, upper bits).
struct Dice(u64);

impl Dice {
    fn roll(&mut self, below: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % below.max(1)
    }
}

/// A sound file: its path below the folder, what to open, its bytes, and its share of the cases.
struct Seed {
    file: &'static str,
    open: &'static str,
    bytes: Vec<u8>,
    share: usize,
}

fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    let mut add = |file, open, bytes, share| seeds.push(Seed { file, open, bytes, share });
    for tiff in tiffs() {
        add("a.tif", "a.tif", tiff.bytes(), 8);
    }
    add("N49E011.hgt", "N49E011.hgt", hgt_bytes(), 1);
    let flat = vec![7; 2 * 1201 * 1201];
    add("N49E011.hgt.zip", "N49E011.hgt.zip", zip_bytes("N49E011.hgt", &flat), 12);
    let gray: Vec<u8> = (0..2 * 64 * 32).map(|at: u32| (at * 31 % 256) as u8).collect();
    let sixteen = png::BitDepth::Sixteen;
    let gray = png_bytes([64, 32], png::ColorType::Grayscale, sixteen, &gray);
    add("g.png", "g.png", gray, 12);
    let rgb: Vec<u8> = (0..3 * 256 * 256).map(|at: u32| (at / 977 % 256) as u8).collect();
    let rgb = png_bytes([256; 2], png::ColorType::Rgb, png::BitDepth::Eight, &rgb);
    add("t/3/4/5.png", "t", rgb, 12);
    seeds
}

fn tiffs() -> Vec<TiffFile> {
    let values: Vec<f64> = (0..40 * 30).map(|at| f64::from(at * 53 % 9000)).collect();
    let base = TiffFile { nodata: Some("-9999".to_owned()), ..TiffFile::new([40, 30], values) };
    let strips = |packing, predictor| TiffFile { packing, predictor, ..base.clone() };
    let tiles = |packing, big_tiff: bool, number, predictor| TiffFile {
        tile: Some([16, 16]),
        big_endian: !big_tiff,
        ..TiffFile { packing, big_tiff, number, predictor, ..base.clone() }
    };
    vec![
        strips(Packing::Plain, 1),
        strips(Packing::Lzw, 2),
        strips(Packing::Deflate, 2),
        strips(Packing::Packbits, 1),
        tiles(Packing::Deflate, false, Number::F32, 3),
        tiles(Packing::Lzw, true, Number::F64, 1),
        tiles(Packing::Plain, true, Number::U16, 1),
    ]
}

/// One way of damaging a file.
fn damage(bytes: &mut Vec<u8>, dice: &mut Dice) {
    // Half of all damage goes to the first and last kilobyte, where headers and tables are.
    let place = |dice: &mut Dice, bytes: &[u8]| match dice.roll(4) {
        0 => dice.roll(bytes.len().min(1024)),
        1 => bytes.len() - 1 - dice.roll(bytes.len().min(1024)),
        _ => dice.roll(bytes.len()),
    };
    let way = dice.roll(6);
    if way == 0 {
        let end = place(dice, bytes);
        bytes.truncate(end);
        return;
    }
    for _ in 0..=dice.roll(4) {
        let at = place(dice, bytes);
        match way {
            1 | 2 => bytes[at] ^= 1 << dice.roll(8),
            3 => bytes[at] = dice.roll(256) as u8,
            4 => {
                let wide = [1, 2, 4, 8][dice.roll(4)].min(bytes.len() - at);
                let fill = [0, 0xff, 0x7f, 0x80][dice.roll(4)];
                bytes[at..at + wide].fill(fill);
            }
            _ => {
                let (from, count) = (place(dice, bytes), dice.roll(40));
                let count = count.min(bytes.len() - at).min(bytes.len() - from);
                bytes.copy_within(from..from + count, at);
            }
        }
    }
}

/// Opens and reads what can be read. Whether a window of it could be.
fn read(path: &Path) -> bool {
    let options = OpenOptions {
        encoding: Some(TileEncoding::Terrarium),
        extent_deg: Some([-10.0, -10.0, 10.0, 10.0]),
        store: ChunkStore::new(8 << 20),
        ..OpenOptions::default()
    };
    let Ok(rasters) = open(path, &options) else { return false };
    let mut out = Vec::new();
    let mut sound = true;
    for raster in &rasters {
        let [columns, rows] = [raster.grid.columns, raster.grid.rows].map(i64::from);
        for (x0, y0) in [(0, 0), (columns - 50, rows - 50), (columns / 2, rows / 2)] {
            sound &= raster.window(x0, y0, 64, 64, &mut out).is_ok();
        }
        let place = raster.grid.place(0.5, 0.6).unwrap();
        assert!(place.iter().all(|part| part.is_finite()), "{place:?}");
    }
    sound
}

/// The most that this process ever held in memory, in KiB, where the system tells.
fn resident_kib_max() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn damaged_files_give_errors_or_heights() {
    let cases = std::env::var("OVERFLY_FUZZ_CASES").ok().and_then(|text| text.parse().ok());
    let cases = cases.unwrap_or(CASES);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("t/3/4")).unwrap();
    let seeds = seeds();
    let mut deck = Vec::new();
    for seed in &seeds {
        std::fs::write(folder.path().join(seed.file), &seed.bytes).unwrap();
        assert!(read(&folder.path().join(seed.open)), "{} is sound as written", seed.file);
        deck.extend(std::iter::repeat_n(seed, seed.share));
    }
    let mut dice = Dice(20_261_122);
    let mut refused = 0;
    for _ in 0..cases {
        let seed = deck[dice.roll(deck.len())];
        let mut bytes = seed.bytes.clone();
        damage(&mut bytes, &mut dice);
        std::fs::write(folder.path().join(seed.file), &bytes).unwrap();
        refused += u64::from(!read(&folder.path().join(seed.open)));
    }
    assert!(refused > cases / 4, "only {refused} of {cases} were noticed");
    assert!(refused < cases, "no damage is harmless");
    if let Some(kib) = resident_kib_max() {
        assert!(kib < RESIDENT_KIB_MAX, "{kib} KiB were resident");
    }
}

#[test]
fn truncation_anywhere_is_noticed_or_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    for tiff in tiffs() {
        let bytes = tiff.bytes();
        for end in (0..bytes.len()).step_by(61) {
            std::fs::write(&path, &bytes[..end]).unwrap();
            // The directory lies at the end: without it nothing can be opened.
            assert!(!read(&path), "{end} of {} bytes were read as a whole file", bytes.len());
        }
    }
}

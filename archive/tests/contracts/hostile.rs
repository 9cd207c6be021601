//! Archives that are cut, flipped, foreign or made to do harm.
//!
//! In:    broken archives; `OVERFLY_FUZZ_CASES` for more than 2500 random ones.
//! Out:   an error that says what is wrong, or a tile; never a panic, a hang or a large allocation.
//! Keeps: nothing.
//! Not here: faults of servers (`remote`).

use crate::written::{
    Entry, Parts, archive, archive_of, directory, facts, file, gzip_of_zeros, keys, open,
};
use overfly_archive::{Archive, ArchiveFault, Location, OpenOptions, metadata};
use overfly_core::datasource::PageKey;
use overfly_core::digest::mix;
use pmtiles::{Compression, TileType};
use serde_json::Value;

/// Tile ids of zoom 1, where the root pages are.
const FIRST: u64 = 1;

fn fault_of(bytes: &[u8]) -> String {
    open(bytes).unwrap_err().to_string()
}

/// What reading the first page of an archive says.
fn tile_fault(parts: &Parts) -> String {
    let archive = open(&parts.bytes()).unwrap();
    let errors: Vec<_> = (0..4).filter_map(|q| archive.tile(PageKey::root(q)).err()).collect();
    errors.first().expect("one of the root pages is at fault").to_string()
}

#[test]
fn what_is_not_ours_is_told_by_what_it_is() {
    let png = archive_of(
        &keys(1),
        r#"{"name": "roads"}"#,
        TileType::Png,
        (Compression::Gzip, Compression::None),
    );
    assert!(matches!(
        open(&png).unwrap_err().fault,
        ArchiveFault::Foreign { tile_type: "PNG pictures" }
    ));
    let newer = metadata::to_json(&facts(3), Value::Null).replace("\"version\":1", "\"version\":2");
    let none = (Compression::None, Compression::None);
    let newer = archive_of(&keys(1), &newer, TileType::Unknown, none);
    assert!(matches!(open(&newer).unwrap_err().fault, ArchiveFault::FormatVersion(2)));
    let mut older = archive(1, Compression::Gzip, Compression::None);
    older[7] = 2;
    assert!(matches!(open(&older).unwrap_err().fault, ArchiveFault::PmtilesVersion(2)));
    for other in [&b""[..], b"P", b"II*\0 a picture", &[0; 20_000]] {
        assert!(matches!(open(other).unwrap_err().fault, ArchiveFault::NotPmtiles));
    }
}

#[test]
fn every_truncation_is_named() {
    let whole = archive(2, Compression::Gzip, Compression::None);
    assert!(open(&whole).is_ok());
    for length in [8, 126, 127, 200, 16_383, 16_384, 16_500, whole.len() - 1] {
        let fault = open(&whole[..length]).unwrap_err().fault;
        assert!(matches!(fault, ArchiveFault::Corrupt(_)), "{length}: {fault}");
    }
}

#[test]
fn headers_that_point_anywhere_are_refused() {
    let whole = archive(2, Compression::Gzip, Compression::None);
    let patched = |at: usize, value: u64| {
        let mut bytes = whole.clone();
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        fault_of(&bytes)
    };
    for at in [8, 24, 40, 56] {
        assert!(patched(at + 8, u64::MAX).contains("end"), "length at {at}");
        assert!(patched(at + 8, 1 << 40).contains("end at byte"), "length at {at}");
    }
    assert!(patched(8, 3).contains("overlap"));
    assert!(patched(8, 1 << 60).contains("root directory end"));
    assert!(patched(16, 0).contains("root directory is not within"));
    assert!(patched(56, 20).contains("overlap"));
    for (at, value) in [(97, 9), (98, 9), (99, 9), (97, 0), (97, 3), (98, 3), (98, 0)] {
        let mut bytes = whole.clone();
        bytes[at] = value;
        assert!(fault_of(&bytes).contains("damaged"), "byte {at}");
    }
}

#[test]
fn directories_that_make_no_sense_are_refused() {
    let truncated = vec![5, 1, 1];
    let absurd_count = vec![0xFF, 0xFF, 0xFF, 0xFF, 0x7F];
    let overlong = vec![0xFF; 12];
    for root in [truncated, absurd_count, overlong] {
        assert!(fault_of(&Parts::with_root(root).bytes()).contains("directory makes no sense"));
    }
}

#[test]
fn entries_beyond_their_section_are_refused() {
    let cases: [Entry; 3] =
        [(FIRST, 4, 101, 0), (FIRST, 4, 1, 100), (FIRST, 4, u64::from(u32::MAX), 0)];
    for entry in cases {
        let fault = tile_fault(&Parts::with_root(directory(&[entry])));
        assert!(fault.contains("outside of its section"), "{entry:?}: {fault}");
    }
}

#[test]
fn a_leaf_directory_within_itself_is_refused() {
    let itself = directory(&[(0, 0, 9, 0)]);
    let leaf = Parts {
        leaves: directory(&[(0, 0, itself.len() as u64, 0)]),
        ..Parts::with_root(directory(&[(0, 0, itself.len() as u64, 0)]))
    };
    assert!(tile_fault(&leaf).contains("directory makes no sense"));
}

#[test]
fn what_unpacks_to_far_more_is_refused_wherever_it_lies() {
    let bomb = gzip_of_zeros(64 << 20);
    let small = zstd::encode_all(&vec![0; 64 << 20][..], 3).unwrap();
    let sound = Parts { internal: 4, ..Parts::with_root(Vec::new()) };
    let packed = |bytes: &[u8]| zstd::encode_all(bytes, 3).unwrap();
    let root = Parts { root: small.clone(), metadata: packed(&sound.metadata), ..sound };
    assert!(fault_of(&root.bytes()).contains("root directory: it unpacks to more than"));

    let metadata = Parts { root: packed(&directory(&[])), metadata: small.clone(), ..root };
    assert!(fault_of(&metadata.bytes()).contains("it unpacks to more than"));

    let gzip = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        std::io::Write::write_all(&mut encoder, bytes).unwrap();
        encoder.finish().unwrap()
    };
    let leaf = Parts::with_root(gzip(&directory(&[(0, 0, bomb.len() as u64, 0)])));
    let leaf = Parts { metadata: gzip(&leaf.metadata), leaves: bomb.clone(), internal: 2, ..leaf };
    assert!(tile_fault(&leaf).contains("leaf directory"));
    assert!(tile_fault(&leaf).contains("it unpacks to more than"));

    for (tiles, tile_compression) in [(bomb, 2), (small, 4), (vec![0; (1 << 20) + 1], 1)] {
        let root = directory(&[(FIRST, 4, tiles.len() as u64, 0)]);
        let tile = Parts { tiles, tile_compression, ..Parts::with_root(root) };
        let fault = tile_fault(&tile);
        assert!(fault.contains("unpacks to more than") || fault.contains("beyond"), "{fault}");
    }
}

#[test]
fn a_zstd_frame_that_wants_a_huge_window_is_refused() {
    // Magic, no flags, a window of 2^31 bytes, then an empty last block.
    let frame = vec![0x28, 0xB5, 0x2F, 0xFD, 0x00, 0xA8, 0x01, 0x00, 0x00];
    let root = directory(&[(FIRST, 4, frame.len() as u64, 0)]);
    let tile = Parts { tiles: frame, tile_compression: 4, ..Parts::with_root(root) };
    assert!(tile_fault(&tile).contains("cannot be unpacked"));
}

/// A stream of numbers that depends on the seed alone.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = mix(self.0);
        usize::try_from(self.0 % bound as u64).unwrap()
    }
}

/// Cuts or flips; the header and the directories at either end get their share.
fn broken(mut bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
    if dice.below(4) == 0 {
        bytes.truncate(dice.below(bytes.len()));
        return bytes;
    }
    let size = bytes.len();
    let regions = [(0, 127), (127, 300), (16_384, 400), (size - size / 8, size / 8), (0, size)];
    for _ in 0..=dice.below(4) {
        let (start, length) = regions[dice.below(regions.len())];
        let at = (start + dice.below(length)).min(size - 1);
        bytes[at] ^= 1 << dice.below(8);
    }
    bytes
}

#[test]
fn broken_archives_give_an_error_or_a_tile() {
    let cases: Option<usize> =
        std::env::var("OVERFLY_FUZZ_CASES").ok().and_then(|it| it.parse().ok());
    let cases = cases.unwrap_or_default().max(2500);
    let none = Compression::None;
    let whole = [
        archive(2, none, none),
        archive(2, Compression::Gzip, Compression::Zstd),
        archive(2, Compression::Zstd, Compression::Gzip),
        archive(6, none, none),
    ];
    let some: Vec<PageKey> = keys(6).into_iter().step_by(1999).collect();
    let (_folder, path) = file(&[]);
    let mut dice = Dice(2029);
    let (mut refused, mut tiles, mut faults) = (0, 0, 0);
    for case in 0..cases {
        // Another file each time: a mapped one must not be written to.
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, broken(whole[case % whole.len()].clone(), &mut dice)).unwrap();
        let archive = match Archive::open(&Location::File(path.clone()), &OpenOptions::default()) {
            Ok(archive) => archive,
            Err(error) => {
                assert!(error.to_string().contains("test.pmtiles: "), "{error}");
                refused += 1;
                continue;
            }
        };
        for &key in &some {
            match archive.tile(key) {
                Ok(tile) => tiles += usize::from(tile.is_some()),
                Err(_) => faults += 1,
            }
        }
    }
    // All three kinds of outcome came up, or the cases show little.
    assert!(refused > 100 && tiles > 100 && faults > 10, "{refused} {tiles} {faults}");
}

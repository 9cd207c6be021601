//! What recordings survive: every bit flipped, every length, kills, forged sizes; and any frame of
//! them is reached, whatever happened to the others.
//!
//! In:    recordings of frames that all differ, whole and damaged.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: the layout and round trips (`format`), full disks (`tests/contracts/recordings.rs`).

use glam::{DQuat, DVec3};
use overfly_core::camera::View;
use overfly_core::datasource::PageKey;
use overfly_core::digest::FrameDigest;
use overfly_core::geodesy::Ecef;
use overfly_core::units::Radians;
use overfly_replay::format::KEY_EVERY;
use overfly_replay::{
    Fault, Frame, Header, Kind, ReadError, Reader, RecordedFrame, Recording, Tail, Writer,
};
use std::fs;
use std::path::Path;

fn header() -> Header {
    Header {
        kind: Kind::Recording,
        settings: vec![("lod.level_max".into(), "40".into())],
        scene_text: "Scene(body: Moon)".into(),
        ..Header::flight("flown", 60.0)
    }
}

fn frame(index: u64) -> RecordedFrame {
    let t = index as f64;
    let chain = |salt: u64| (index + salt).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let view = View {
        eye: Ecef(DVec3::new(6.4e6 + t.sqrt(), t * 0.3, -t)),
        orientation: DQuat::from_rotation_z(t * 0.001),
        field_of_view: Radians(1.0),
        size_px: [640, 480],
        near_m: 0.125,
    };
    let key = PageKey::root(0).child(usize::from(index % 2 == 1));
    RecordedFrame {
        time_s: t / 60.0,
        views: vec![view],
        arrived: if index.is_multiple_of(5) { vec![PageKey::root(1), key] } else { vec![] },
        hold_lod: index.is_multiple_of(7),
        scene: None,
        digest: FrameDigest {
            pages: chain(1),
            mesh: chain(2),
            vertices: chain(3),
            draws: chain(4),
        },
    }
}

/// A recording of `frames` frames, with its end block or as a kill leaves it.
fn recorded(frames: u64, finished: bool) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flown.ovf");
    write(&path, frames, finished);
    fs::read(path).unwrap()
}

fn write(path: &Path, frames: u64, finished: bool) {
    let mut writer = Writer::create(path, &header()).unwrap();
    (0..frames).for_each(|index| writer.frame(&frame(index)).unwrap());
    if finished {
        writer.finish().unwrap();
    }
}

/// Where frames begin, and where the last one ends.
fn starts(bytes: &[u8]) -> Vec<usize> {
    let next = |at: usize| {
        let length = u32::from_le_bytes([bytes[at + 1], bytes[at + 2], bytes[at + 3], 0]);
        at + 9 + length as usize
    };
    let blocks = core::iter::successors(Some(next(12)), |&at| {
        (bytes.get(at) == Some(&b'F')).then(|| next(at))
    });
    blocks.collect()
}

fn next(reader: &mut Reader) -> Option<Result<RecordedFrame, ReadError>> {
    reader.next().map(|next| {
        next.map(|frame| match frame {
            Frame::Recorded(frame) => frame,
            Frame::Pose(pose) => panic!("{pose:?} in a recording"),
        })
    })
}

/// Frame `index`, reached without those before it.
fn at(reader: &mut Reader, index: u64) -> Result<RecordedFrame, ReadError> {
    reader.seek(index)?;
    assert_eq!(reader.frames(), index);
    next(reader).expect("it was not the end when it was looked for")
}

/// Frames in order, all of them as they were written, and the error that ends them.
fn good_frames(bytes: &[u8]) -> (u64, Option<ReadError>) {
    let mut reader = match Reader::from_bytes(bytes, "flown.ovf") {
        Ok(reader) => reader,
        Err(error) => return (0, Some(error)),
    };
    let mut count = 0;
    while let Some(found) = next(&mut reader) {
        match found {
            Ok(found) => assert_eq!(found, frame(count)),
            Err(error) => return (count, Some(error)),
        }
        count += 1;
    }
    (count, None)
}

#[test]
fn every_frame_is_reached_from_any_other_with_and_without_an_end() {
    let frames = 5 * KEY_EVERY + 20;
    for finished in [true, false] {
        let bytes = recorded(frames, finished);
        let mut reader = Reader::from_bytes(&bytes, "flown.ovf").unwrap();
        assert_eq!(reader.tail().unwrap(), Tail { frames, complete: finished });
        for index in (0..frames).map(|i| i * 611 % frames) {
            assert_eq!(at(&mut reader, index).unwrap(), frame(index));
        }
        reader.seek(frames).unwrap();
        assert!(reader.next().is_none());
        assert_eq!(reader.complete(), finished);
        let text = reader.seek(frames + 1).unwrap_err().to_string();
        assert_eq!(text, "flown.ovf: there is no frame 1301, but 1300 whole frames");
        assert!(matches!(reader.seek(u64::MAX), Err(ReadError::Beyond { frames: 1300, .. })));
        assert_eq!(at(&mut reader, 3).unwrap(), frame(3));
    }
    let bytes = recorded(2 * KEY_EVERY, true);
    let mut reader = Reader::from_bytes(&bytes, "flown.ovf").unwrap();
    reader.seek(2 * KEY_EVERY).unwrap();
    assert!(reader.next().is_none() && reader.complete(), "the end comes where a key would");
}

#[test]
fn no_flipped_bit_goes_unseen_in_order_or_out_of_order() {
    let whole = recorded(12, true);
    let starts = starts(&whole);
    for position in 0..whole.len() {
        // The frame whose block was hit: those before it are good, the others refer to it.
        let hit = starts.iter().rposition(|&start| start <= position);
        for bit in 0..8 {
            let mut bytes = whole.clone();
            bytes[position] ^= 1 << bit;
            let (good, error) = good_frames(&bytes);
            let error = error.unwrap_or_else(|| panic!("byte {position}, bit {bit}"));
            assert_eq!(good, hit.unwrap_or(0) as u64, "byte {position}, bit {bit}: {error}");
            if let ReadError::Corrupt { offset, frame, .. } = &error {
                let block = hit.map_or(12, |hit| starts[hit]);
                assert_eq!((*offset, *frame), (block as u64, good), "byte {position}: {error}");
            }
            let Ok(mut reader) = Reader::from_bytes(&bytes, "flown.ovf") else { continue };
            assert!(reader.tail().unwrap().frames <= 12);
            for index in [11, 5, 0] {
                let found = at(&mut reader, index).ok();
                assert_eq!(found, (index < good).then(|| frame(index)), "byte {position}");
            }
        }
    }
}

#[test]
fn a_file_cut_off_at_any_length_has_the_frames_that_are_whole() {
    let whole = recorded(12, true);
    let starts = starts(&whole);
    for length in 0..whole.len() {
        let bytes = &whole[..length];
        let (good, error) = good_frames(bytes);
        let frames = starts.iter().rposition(|&start| start <= length).unwrap_or(0) as u64;
        assert_eq!(good, frames, "{length} bytes");
        assert!(matches!(error, None | Some(ReadError::Truncated { .. })), "{length} bytes");
        assert_eq!(error.is_none(), starts.contains(&length), "{length} bytes");
        let Ok(mut reader) = Reader::from_bytes(bytes, "flown.ovf") else { continue };
        assert_eq!(reader.tail().unwrap(), Tail { frames, complete: false }, "{length} bytes");
        if let Some(last) = frames.checked_sub(1) {
            assert_eq!(at(&mut reader, last).unwrap(), frame(last), "{length} bytes");
        }
        assert!(reader.seek(frames + 1).is_err(), "{length} bytes");
    }
}

/// The file is longer than what is walked through block by block, so that it is halved.
#[test]
fn damage_costs_frames_up_to_the_next_key_frame_and_no_others() {
    let frames = 12 * KEY_EVERY;
    let whole = recorded(frames, true);
    let starts = starts(&whole);
    assert!(whole.len() > 1 << 17, "{} bytes", whole.len());
    for i in 0..120 {
        let position = starts[0] + i * 104_729 % (whole.len() - starts[0]);
        let mut bytes = whole.clone();
        bytes[position] ^= 1 << (i % 8);
        let hit = starts.iter().rposition(|&start| start <= position).unwrap() as u64;
        let mut reader = Reader::from_bytes(&bytes, "flown.ovf").unwrap();
        let borders = (0..12).flat_map(|key| [0, 1, 255].map(|index| key * KEY_EVERY + index));
        for index in borders.chain([hit.saturating_sub(1), hit, hit + 1]) {
            if index >= frames {
                continue;
            }
            let found = at(&mut reader, index);
            let is_lost = index >= hit && index / KEY_EVERY == hit / KEY_EVERY;
            assert_eq!(found.is_err(), is_lost, "byte {position}, frame {index}: {found:?}");
            match found {
                Ok(found) => assert_eq!(found, frame(index)),
                Err(ReadError::Corrupt { offset, .. }) => {
                    assert_eq!(offset, starts[usize::try_from(hit).unwrap()] as u64);
                }
                Err(error) => panic!("byte {position}, frame {index}: {error}"),
            }
        }
    }
}

#[test]
fn missing_and_repeated_stretches_are_seen_from_wherever_one_comes() {
    let frames = 4 * KEY_EVERY;
    let whole = recorded(frames, true);
    let starts = starts(&whole);
    let (from, to) = (starts[500], starts[530]);
    let missing = [&whole[..from], &whole[to..]].concat();
    let repeated = [&whole[..to], &whole[from..]].concat();
    for (bytes, last) in [(missing, 499), (repeated, 529)] {
        let (good, error) = good_frames(&bytes);
        assert_eq!(good, last + 1);
        let is_index = |what: &Fault| matches!(what, Fault::Index { .. });
        assert!(matches!(error, Some(ReadError::Corrupt { what, .. }) if is_index(&what)));
        let mut reader = Reader::from_bytes(&bytes, "flown.ovf").unwrap();
        for index in [last, 1023, 0, 255, 256, 768] {
            assert_eq!(at(&mut reader, index).unwrap(), frame(index));
        }
    }
    let keyless = [&whole[..starts[500]], &whole[starts[530]..]].concat();
    let mut reader = Reader::from_bytes(&keyless, "flown.ovf").unwrap();
    let text = reader.seek(512).unwrap_err().to_string();
    let expected = format!("corrupt at byte {from} (after 500 whole frames): frame index");
    assert!(text.contains(&expected), "{text}");
}

/// A block as the writer makes it.
fn block(marker: u8, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).unwrap().to_le_bytes();
    let check = 0xA5 ^ marker ^ length[0] ^ length[1] ^ length[2];
    let head = [&[marker], &length[..3], &[check][..]].concat();
    [&head[..], &crc32fast::hash(payload).to_le_bytes(), payload].concat()
}

/// Sums and checks are right, and the sizes inside are lies: none makes the reader reserve.
#[test]
fn forged_sizes_are_refused() {
    let whole = recorded(1, false);
    let start = starts(&whole)[0];
    const ENDLESS: [u8; 10] = [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1];
    let read = |bytes: &[u8]| good_frames(bytes).1.unwrap();
    let mut longest = whole[..start].to_vec();
    longest.extend([b'F', 0xFF, 0xFF, 0xFF, 0xA5 ^ b'F' ^ 0xFF]);
    longest.extend([0; 40]);
    assert!(matches!(read(&longest), ReadError::Truncated { frames: 0, .. }));
    let views = [&whole[..start], &block(b'F', &[&[0], &ENDLESS[..]].concat())].concat();
    let name = "count of views";
    assert!(
        matches!(read(&views), ReadError::Corrupt { what, .. } if what == Fault::Field { name })
    );
    // Index 0, no view, five words as expected, then keys without end.
    let arrivals = block(b'F', &[&[0; 7], &ENDLESS[..], &[0; 30]].concat());
    let arrivals = [&whole[..start], &arrivals].concat();
    let name = "arrivals";
    assert!(
        matches!(read(&arrivals), ReadError::Corrupt { what, .. } if what == Fault::Field { name })
    );
    let title = [&[1], &ENDLESS[..], b"title"].concat();
    let named = [&whole[..12], &block(b'H', &title)].concat();
    let name = "name";
    assert!(
        matches!(read(&named), ReadError::Corrupt { what, .. } if what == Fault::Field { name })
    );
    let index = [&whole[..start], &block(b'F', &[&ENDLESS[..], &whole[start + 10..]].concat())];
    let mut reader = Reader::from_bytes(&index.concat(), "flown.ovf").unwrap();
    assert_eq!(reader.tail().unwrap().frames, 0, "no file of this length has such a frame");
}

#[test]
fn a_file_that_shrinks_while_it_is_read_ends_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flown.ovf");
    write(&path, 2000, true);
    let mut reader = Reader::open(&path).unwrap();
    assert_eq!(at(&mut reader, 0).unwrap(), frame(0));
    fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(100_000).unwrap();
    let error = reader.find_map(Result::err).unwrap();
    assert!(matches!(error, ReadError::Truncated { frames: 100.., .. }), "{error}");
    write(&path.with_extension("new"), 30, true);
    assert_eq!(Recording::open(&path.with_extension("new")).unwrap().frames.len(), 30);
}

#[test]
fn a_reader_sees_the_file_as_long_as_it_was_when_it_was_opened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flown.ovf");
    let mut writer = Writer::create(&path, &header()).unwrap();
    (0..300).for_each(|index| writer.frame(&frame(index)).unwrap());
    let mut reader = Reader::open(&path).unwrap();
    (300..600).for_each(|index| writer.frame(&frame(index)).unwrap());
    assert_eq!(reader.tail().unwrap().frames, 300);
    assert_eq!(at(&mut reader, 299).unwrap(), frame(299));
    assert!(reader.next().is_none() && !reader.complete());
    assert_eq!(Reader::open(&path).unwrap().tail().unwrap().frames, 600);
}

//! What the file format promises: exact round trips, named damage, a stable layout.
//!
//! In:    random and tiny recordings, whole, cut off and damaged.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: what the bundled flights look like (`flights`).

use glam::{DQuat, DVec3};
use overfly_core::camera::View;
use overfly_core::datasource::PageKey;
use overfly_core::datasource::procedural::Style;
use overfly_core::digest::FrameDigest;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::settings::{
    DepthFormat, DepthOrder, DepthSettings, LensSettings, LodSettings, MemorySettings,
    SceneSettings, SourceSettings, VertexPrecision,
};
use overfly_core::units::{Pixels, Radians};
use overfly_replay::{
    Difference, Ending, Fault, Flight, Frame, Header, Kind, Pose, ReadError, Reader, RecordedFrame,
    Recording, WriteError, Writer,
};
use proptest::prelude::*;
use std::fs;
use std::path::Path;

/// Bytes before the first frame of the tiny recording.
const TINY_HEADER: usize = 12 + 9 + 77;

fn scene() -> SceneSettings {
    SceneSettings {
        body: Ellipsoid::WGS84,
        sources: vec![SourceSettings::Procedural {
            seed: 1,
            style: Style::Earthlike,
            relief: 1.0,
            finest_m: 0.2,
            detail: 1.0,
        }],
        lod: LodSettings {
            tolerance: Pixels(1.0),
            triangles_max: 1 << 20,
            patch_depth: 6,
            splits_max: 100,
            merges_max: 100,
            level_max: 40,
            wanted_max: 64,
            morph_s: 0.0,
        },
        views: vec![LensSettings {
            name: "front".into(),
            field_of_view: Radians(1.0),
            yaw: Radians(0.0),
            pitch: Radians(0.0),
            near_m: 0.1,
        }],
        depth: DepthSettings {
            format: DepthFormat::D32F,
            order: DepthOrder::Reversed,
            splits_m: vec![1000.0],
        },
        vertices: VertexPrecision::TwoFloat,
        imagery: Vec::new(),
        memory: MemorySettings { pages_bytes: 1 << 28 },
        sea: true,
        sun: None,
    }
}

/// A header that does not change when core's settings do.
fn tiny_header() -> Header {
    Header {
        settings_digest: 0x0123_4567_89AB_CDEF,
        settings: vec![("lod.level_max".into(), "40".into()), ("body.f".into(), "0.0".into())],
        kind: Kind::Recording,
        scene_text: "Scene(body: Moon)".into(),
        ..Header::flight("tiny", 60.0)
    }
}

fn tiny_frames() -> Vec<RecordedFrame> {
    let view = |x: f64| View {
        eye: Ecef(DVec3::new(6_378_137.0 + x, -0.0, 1.5)),
        orientation: DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5),
        field_of_view: Radians(1.0),
        size_px: [640, 480],
        near_m: 0.125,
    };
    let digest = FrameDigest { pages: 0x1111, mesh: 0x2222_0000, vertices: u64::MAX, draws: 4 };
    let first = RecordedFrame {
        time_s: 0.0,
        views: vec![view(0.0)],
        arrived: vec![PageKey::root(0), PageKey::root(3), PageKey::root(3).child(2)],
        hold_lod: false,
        scene: None,
        digest,
    };
    let second = RecordedFrame {
        time_s: 1.0 / 60.0,
        views: vec![view(0.25), view(100.0)],
        arrived: vec![],
        hold_lod: true,
        scene: None,
        digest: FrameDigest { draws: 5, ..digest },
    };
    let third = RecordedFrame { time_s: 0.04, views: vec![], ..RecordedFrame::default() };
    vec![first, second, third]
}

fn write_recording(path: &Path, header: &Header, frames: &[RecordedFrame]) -> Writer {
    let mut writer = Writer::create(path, header).unwrap();
    for frame in frames {
        writer.frame(frame).unwrap();
    }
    writer
}

fn tiny_bytes() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiny.ovf");
    write_recording(&path, &tiny_header(), &tiny_frames()).finish().unwrap();
    fs::read(path).unwrap()
}

/// Frames and the error after them.
fn read_all(bytes: &[u8]) -> (Vec<RecordedFrame>, bool, Option<ReadError>) {
    let mut reader = match Reader::from_bytes(bytes, "tiny.ovf") {
        Ok(reader) => reader,
        Err(error) => return (vec![], false, Some(error)),
    };
    let mut frames = Vec::new();
    while let Some(frame) = reader.next() {
        match frame {
            Ok(Frame::Recorded(frame)) => frames.push(frame),
            Ok(Frame::Pose(pose)) => panic!("{pose:?} in a recording"),
            Err(error) => {
                assert!(reader.next().is_none(), "nothing follows an error");
                return (frames, reader.complete(), Some(error));
            }
        }
    }
    let complete = reader.complete();
    (frames, complete, None)
}

/// The offsets at which blocks begin, and the end of the file.
fn blocks(bytes: &[u8]) -> Vec<usize> {
    let mut offsets = vec![12];
    while *offsets.last().unwrap() < bytes.len() {
        let at = *offsets.last().unwrap();
        let length = u32::from_le_bytes([bytes[at + 1], bytes[at + 2], bytes[at + 3], 0]);
        offsets.push(at + 9 + length as usize);
    }
    offsets
}

/// All numbers of a frame as bits, so that −0.0 is not 0.0 and NaN is itself.
fn bits(frame: &RecordedFrame) -> Vec<u64> {
    let mut bits = vec![frame.time_s.to_bits()];
    bits.push(u64::from(frame.hold_lod));
    bits.extend(frame.digest.parts());
    for view in &frame.views {
        bits.extend(view.eye.0.to_array().map(f64::to_bits));
        bits.extend(view.orientation.to_array().map(f64::to_bits));
        bits.extend([view.field_of_view.0, view.near_m].map(f64::to_bits));
        bits.extend(view.size_px.map(u64::from));
    }
    bits.extend(frame.arrived.iter().map(|key| key.bits()));
    bits
}

fn any_f64() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        -1e7..1e7,
        Just(-0.0),
        Just(0.0),
        Just(f64::MIN_POSITIVE / 8.0),
        Just(f64::NEG_INFINITY),
    ]
}

fn any_view() -> impl Strategy<Value = View> {
    (proptest::array::uniform9(any_f64()), any::<[u32; 2]>()).prop_map(|(v, size_px)| View {
        eye: Ecef(DVec3::new(v[0], v[1], v[2])),
        orientation: DQuat::from_xyzw(v[3], v[4], v[5], v[6]),
        field_of_view: Radians(v[7]),
        size_px,
        near_m: v[8],
    })
}

fn any_key() -> impl Strategy<Value = PageKey> {
    (0_u8..4, 0_u8..=23, any::<u32>(), any::<u32>()).prop_map(|(quadrant, depth, x, y)| {
        let inside = (1_u32 << depth) - 1;
        PageKey::new(quadrant, depth, x & inside, y & inside)
    })
}

fn any_frame() -> impl Strategy<Value = RecordedFrame> {
    let views = proptest::collection::vec(any_view(), 0..4);
    let arrived = proptest::collection::vec(any_key(), 0..20);
    let fed = (any_f64(), views, arrived, any::<bool>());
    (fed, any::<[u64; 4]>()).prop_map(|((time_s, views, arrived, hold_lod), parts)| {
        let [pages, mesh, vertices, draws] = parts;
        let digest = FrameDigest { pages, mesh, vertices, draws };
        RecordedFrame { time_s, views, arrived, hold_lod, scene: None, digest }
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(64)
    })]

    #[test]
    fn every_recording_comes_back_bit_for_bit(
        frames in proptest::collection::vec(any_frame(), 0..12),
        name in ".{0,20}",
        rate_hz in 0.001..1e6,
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("any.ovf");
        let promised = frames.len() as u64;
        let header = Header { frames: promised, ..Header::recording(&name, rate_hz, &scene()) };
        write_recording(&path, &header, &frames).finish().unwrap();
        let recording = Recording::open(&path).unwrap();
        prop_assert_eq!(recording.header, header);
        prop_assert!(matches!(recording.ending, Ending::Complete));
        prop_assert_eq!(recording.frames.len(), frames.len());
        for (read, written) in recording.frames.iter().zip(&frames) {
            prop_assert_eq!(bits(read), bits(written));
            prop_assert_eq!(read.views.len(), written.views.len());
        }
    }

    #[test]
    fn arbitrary_bytes_after_a_header_never_panic(
        tail in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        let mut bytes = tiny_bytes();
        bytes.truncate(TINY_HEADER);
        bytes.extend(tail);
        let (frames, complete, _) = read_all(&bytes);
        prop_assert!(frames.is_empty() && !complete);
    }
}

/// Six hundred frames that move a little each: beyond two key frames.
#[test]
fn a_long_flight_comes_back_across_key_frames() {
    let pose = |i: u32| {
        let t = f64::from(i);
        Pose {
            time_s: t / 60.0,
            at: Geodetic { lat_rad: 0.8 + t * 1e-7, lon_rad: -2.1 - t * 1e-8, height_m: -0.0 * t },
            heading: Radians(t * 0.01),
            pitch: Radians(0.1),
            roll: Radians(-t),
        }
    };
    let poses: Vec<Pose> = (0..600).map(pose).collect();
    let flight = Flight { name: "long".into(), rate_hz: 60.0, poses, raised_m: 0.0 };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.ovf");
    flight.write(&path).unwrap();
    let (read, ending) = Flight::read(&path).unwrap();
    assert_eq!(read, flight);
    assert!(matches!(ending, Ending::Complete));
    assert!(read.poses[599].at.height_m.is_sign_negative());
}

#[test]
fn a_flipped_byte_anywhere_is_found_and_the_frames_before_it_are_good() {
    let whole = tiny_bytes();
    let (frames, starts) = (tiny_frames(), blocks(&whole));
    assert_eq!(starts[1], TINY_HEADER);
    for position in 0..whole.len() {
        for flip in [0x01, 0x80, 0xFF] {
            let mut bytes = whole.clone();
            bytes[position] ^= flip;
            let (read, complete, error) = read_all(&bytes);
            assert!(!complete, "byte {position}");
            let block = starts.iter().rposition(|&start| start <= position);
            match (block, error) {
                (None, Some(ReadError::Foreign { .. })) => assert!(position < 8),
                (None, Some(ReadError::Version { .. })) => assert!((8..12).contains(&position)),
                (Some(block), Some(ReadError::Corrupt { offset, frame, .. })) => {
                    assert_eq!(offset, starts[block] as u64, "byte {position}");
                    assert_eq!(read, frames[..block.saturating_sub(1)], "byte {position}");
                    assert_eq!(frame, read.len() as u64);
                }
                (_, error) => panic!("byte {position} ^ {flip:#x}: {error:?}"),
            }
        }
    }
}

#[test]
fn a_file_cut_off_anywhere_reads_to_its_last_whole_frame() {
    let whole = tiny_bytes();
    let (frames, starts) = (tiny_frames(), blocks(&whole));
    for length in 0..whole.len() {
        let (read, complete, error) = read_all(&whole[..length]);
        assert!(!complete);
        let block = starts.iter().rposition(|&start| start <= length).unwrap_or(0);
        assert_eq!(read, frames[..block.saturating_sub(1)], "{length} bytes");
        match error {
            None => assert!(starts[1..].contains(&length), "{length} bytes"),
            Some(ReadError::Truncated { offset, frames, .. }) => {
                assert_eq!(frames, read.len() as u64);
                let expected = if length < 12 { 0 } else { starts[block] };
                assert_eq!(offset, expected as u64, "{length} bytes");
            }
            Some(error) => panic!("{length} bytes: {error}"),
        }
    }
}

#[test]
fn a_recording_whose_writer_was_dropped_is_readable_under_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.ovf");
    let header = Header::recording("killed", 60.0, &scene());
    let writer = write_recording(&path, &header, &tiny_frames()[..2]);
    assert_eq!(writer.frames(), 2);
    let recording = Recording::open(&path).unwrap();
    assert_eq!((recording.header, recording.frames), (header, tiny_frames()[..2].to_vec()));
    assert!(matches!(recording.ending, Ending::Unfinished));
    drop(writer);
    assert!(matches!(Recording::open(&path).unwrap().ending, Ending::Unfinished));
}

#[test]
fn an_existing_file_stays_until_the_new_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("twice.ovf");
    let beside = folder.path().join("twice.ovf.part");
    write_recording(&path, &tiny_header(), &tiny_frames()).finish().unwrap();
    let writer = write_recording(&path, &tiny_header(), &tiny_frames()[..1]);
    assert_eq!(Recording::open(&path).unwrap().frames.len(), 3);
    assert_eq!(Recording::open(&beside).unwrap().frames.len(), 1);
    writer.finish().unwrap();
    assert_eq!(Recording::open(&path).unwrap().frames.len(), 1);
    assert!(!beside.exists());
}

#[test]
fn a_recording_names_the_settings_in_which_a_scene_differs() {
    let header = Header::recording("scene", 60.0, &scene());
    assert_eq!(header.differs_from(&scene()), []);
    let mut other = scene();
    other.lod.level_max = 30;
    other.views.push(other.views[0].clone());
    other.sources.clear();
    let found = header.differs_from(&other);
    assert_eq!(found.len(), 3);
    let by_path = |path: &str| found.iter().find(|d: &&Difference| d.path == path).unwrap();
    assert_eq!(by_path("lod.level_max").to_string(), "lod.level_max: recorded with 40, now 30");
    assert!(by_path("sources[0]").to_string().ends_with(", now nothing"));
    assert!(by_path("views[1]").to_string().starts_with("views[1]: recorded with nothing, now "));
    assert_eq!(Header::flight("any", 60.0).differs_from(&other), []);
}

#[test]
fn errors_say_file_offset_expected_and_found() {
    let whole = tiny_bytes();
    let text = |bytes: &[u8]| read_all(bytes).2.unwrap().to_string();
    let mut bytes = whole.clone();
    bytes[8] = 9;
    assert_eq!(text(&bytes), "tiny.ovf: at byte 8: expected version 1, 2 or 4, found version 9");
    assert_eq!(
        text(b"RIFF\x01\0\0\0WAVE"),
        "tiny.ovf: at byte 0: expected \"OVERFLY\\x00\", found \"RIFF\\x01\\x00\\x00\\x00\""
    );
    let cut = &whole[..TINY_HEADER + 20];
    assert_eq!(
        text(cut),
        format!("tiny.ovf: ends inside the block at byte {TINY_HEADER}, after 0 whole frames")
    );
    let mut bytes = whole.clone();
    bytes[TINY_HEADER + 12] ^= 1;
    let message = text(&bytes);
    let start =
        format!("tiny.ovf: corrupt at byte {TINY_HEADER} (after 0 whole frames): checksum: ");
    assert!(message.starts_with(&start), "{message}");
    let mut bytes = whole.clone();
    bytes.push(7);
    assert!(text(&bytes).ends_with("after the end block: expected nothing, found 1 bytes"));
    let missing = Reader::open(Path::new("no such file.ovf")).err().unwrap().to_string();
    assert!(missing.starts_with("no such file.ovf: cannot read: "), "{missing}");
}

#[test]
fn a_missing_block_and_a_wrong_number_of_frames_are_found() {
    let whole = tiny_bytes();
    let starts = blocks(&whole);
    let without = |block: usize| [&whole[..starts[block]], &whole[starts[block + 1]..]].concat();
    let fault = |bytes: &[u8]| match read_all(bytes).2 {
        Some(ReadError::Corrupt { what, .. }) => what,
        other => panic!("{other:?}"),
    };
    assert_eq!(fault(&without(2)), Fault::Index { expected: 1, found: 2 });
    assert_eq!(fault(&without(3)), Fault::Frames { expected: 3, found: 2 });
    assert!(matches!(fault(&without(0)), Fault::Head { .. }));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.ovf");
    let header = Header { frames: 4, ..tiny_header() };
    let refused = write_recording(&path, &header, &tiny_frames()).finish().unwrap_err();
    assert!(matches!(refused, WriteError::Frames { expected: 4, found: 3, .. }), "{refused}");
}

#[test]
fn kinds_and_rates_are_not_mixed_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kind.ovf");
    let mut writer = Writer::create(&path, &Header::flight("kind", 60.0)).unwrap();
    let refused = writer.frame(&RecordedFrame::default()).unwrap_err();
    assert!(refused.to_string().ends_with("expected a frame of a flight, found recording"));
    writer.finish().unwrap();
    let refused = Recording::open(&path).unwrap_err();
    assert!(refused.to_string().ends_with("expected a recording, found a flight"));
    for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let path = folder.path().join("rate.ovf");
        let refused = Writer::create(&path, &Header::flight("rate", rate_hz)).unwrap_err();
        assert!(matches!(refused, WriteError::Rate { .. }));
        assert!(!path.exists());
    }
    let refused = Writer::create(&folder.path().join("no/folder.ovf"), &tiny_header());
    assert!(refused.unwrap_err().to_string().contains("folder.ovf: cannot write at byte 0: "));
}

fn golden(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

/// A change of these bytes makes every existing recording unreadable: raise the version with it.
#[test]
fn the_layout_of_version_4_is_as_it_always_was() {
    let mut as_version_4 = golden(include_str!("golden/tiny_2.hex"));
    as_version_4[8] = 4;
    assert_eq!(tiny_bytes(), as_version_4, "without a change of scene it is that of version 2");
}

#[test]
fn recordings_of_version_2_are_still_read() {
    let (frames, complete, error) = read_all(&golden(include_str!("golden/tiny_2.hex")));
    assert!(complete && error.is_none());
    assert_eq!(frames, tiny_frames());
}

/// Frames 3 and 300 change the scene; a reader that comes in between is told the one in force.
#[test]
fn a_change_of_the_scene_is_told_once_and_again_to_who_comes_later() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edits.ovf");
    let scene = |index| match index {
        3 => Some("Scene(body: Mars)".to_owned()),
        300 => Some("Scene(body: Moon)".to_owned()),
        _ => None,
    };
    let frame = |index: u32| RecordedFrame {
        time_s: f64::from(index) / 60.0,
        scene: scene(index),
        ..RecordedFrame::default()
    };
    let frames: Vec<_> = (0..520).map(frame).collect();
    write_recording(&path, &tiny_header(), &frames).finish().unwrap();
    let mut reader = Reader::open(&path).unwrap();
    let played = |frame: Frame| match frame {
        Frame::Recorded(frame) => frame,
        Frame::Pose(_) => panic!("a pose in a recording"),
    };
    let read: Vec<_> = reader.by_ref().map(|frame| played(frame.unwrap())).collect();
    assert_eq!(read, frames);
    for (at, told) in
        [(2, None), (5, scene(3)), (256, scene(3)), (299, scene(3)), (519, scene(300))]
    {
        reader.seek(0).unwrap();
        reader.seek(at).unwrap();
        let mut next = || played(reader.next().unwrap().unwrap());
        assert_eq!(next().scene, told, "frame {at}");
        if at < 519 {
            assert_eq!(next().scene, scene(u32::try_from(at + 1).unwrap()), "after frame {at}");
        }
    }
}

#[test]
fn recordings_of_version_1_are_still_read_and_held_nothing() {
    let (frames, complete, error) = read_all(&golden(include_str!("golden/tiny.hex")));
    assert!(complete && error.is_none());
    let before = |frame: RecordedFrame| RecordedFrame { hold_lod: false, ..frame };
    assert_eq!(frames, tiny_frames().into_iter().map(before).collect::<Vec<_>>());
}

#[test]
fn a_flight_is_written_as_version_1_and_a_recording_as_version_4() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("any.ovf");
    Writer::create(&path, &Header::flight("flight", 60.0)).unwrap().finish().unwrap();
    assert_eq!(fs::read(&path).unwrap()[8..12], [1, 0, 0, 0]);
    assert_eq!(tiny_bytes()[8..12], [4, 0, 0, 0]);
    for version in [0, 3, 5] {
        let mut bytes = tiny_bytes();
        bytes[8] = version;
        assert!(matches!(read_all(&bytes).2, Some(ReadError::Version { found, .. })
            if found == u32::from(version)));
    }
}

/// Neither version is taken for the other: the checksums are right, so the fields must tell.
#[test]
fn a_wrong_version_is_found_in_the_first_frame() {
    let fault = |bytes: &[u8]| match read_all(bytes) {
        (frames, false, Some(ReadError::Corrupt { what, .. })) if frames.is_empty() => what,
        other => panic!("{other:?}"),
    };
    let mut bytes = tiny_bytes();
    bytes[8] = 1;
    assert_eq!(fault(&bytes), Fault::Field { name: "end of the frame" });
    let mut bytes = golden(include_str!("golden/tiny.hex"));
    bytes[8] = 2;
    assert_eq!(fault(&bytes), Fault::Field { name: "flags" });
}

/// A host's window has no steady clock: it stands, jumps and goes back, and views come and go.
#[test]
fn a_session_of_a_window_is_recorded_frame_by_frame_whatever_its_clock_does() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.ovf");
    let [first, second, _] = <[RecordedFrame; 3]>::try_from(tiny_frames()).unwrap();
    let times_s = [0.0, 0.0, 0.016_683, 0.041_9, 0.041_9, 17.5, 17.501, 3.25, -1.0, 1e6];
    let session = times_s.into_iter().enumerate().map(|(i, time_s)| RecordedFrame {
        time_s,
        hold_lod: (3..6).contains(&i),
        ..if i % 2 == 0 { first.clone() } else { second.clone() }
    });
    let session: Vec<_> = session.collect();
    let mut writer = Writer::create(&path, &Header::recording("view", 60.0, &scene())).unwrap();
    for (i, frame) in session.iter().enumerate() {
        writer.frame(frame).unwrap();
        assert_eq!(Recording::open(&path).unwrap().frames, session[..=i], "readable at once");
    }
    writer.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    assert!(matches!(recording.ending, Ending::Complete));
    assert_eq!(recording.frames, session);
}

#[test]
fn a_recording_from_before_there_were_morphs_replays_in_a_scene_without_any() {
    let mut header = Header::recording("old", 60.0, &scene());
    header.settings.retain(|(path, _)| path != "lod.morph_s");
    assert_eq!(header.differs_from(&scene()), []);
    let mut morphing = scene();
    morphing.lod.morph_s = 0.25;
    let [difference] = header.differs_from(&morphing).try_into().unwrap();
    assert_eq!(difference.to_string(), "lod.morph_s: recorded with 0.0, now 0.25");
}

#[test]
fn a_recording_replays_with_another_renderer_but_not_with_other_ranges() {
    let header = Header::recording("scene", 60.0, &scene());
    let mut other = scene();
    (other.depth.format, other.depth.order) = (DepthFormat::D24, DepthOrder::Forward);
    (other.vertices, other.imagery) = (VertexPrecision::EyeF64, vec!["blue.pmtiles".into()]);
    assert_eq!(header.differs_from(&other), []);
    other.depth.splits_m = vec![30.0, 1e4];
    let [difference] = header.differs_from(&other).try_into().unwrap();
    let expected = "depth.splits_m: recorded with [1000.0], now [30.0, 10000.0]";
    assert_eq!(difference.to_string(), expected);
}

//! Recordings through the command line: the same again, refused elsewhere, readable when broken.
//!
//! In:    the built binary.
//! Out:   passes or fails.
//! Keeps: a folder for each test, thrown away.
//! Not here: the format byte by byte (`overfly_replay`'s own tests).

use super::command_line::{Outcome, overfly};
use std::path::Path;

fn record(folder: &Path, arguments: &[&str]) -> (String, String) {
    let file = folder.join("flight.ovf").display().to_string();
    let mut all = vec!["replay", "poles", "--no-render", "--record", &file];
    all.extend(arguments);
    let done = overfly(&all);
    assert_eq!(done.code, 0, "{done:?}");
    (file, done.digest())
}

#[test]
fn a_recording_replays_to_the_same_digest_for_any_workers() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--scene", "small", "--frames", "50..400", "--loader-delay-ms", "120"];
    let (file, digest) = record(folder.path(), &arguments);
    for workers in ["0", "1", "2", "4"] {
        let again = overfly(&["replay", &file, "--no-render", "--workers", workers]);
        assert_eq!(again.code, 0, "{again:?}");
        assert!(again.out.contains("same as recorded"), "{again:?}");
        assert_eq!(again.digest(), digest);
    }
    let on_time =
        overfly(&["replay", "poles", "--no-render", "--scene", "small", "--frames", "50..400"]);
    assert_ne!(on_time.digest(), digest, "a late page must show");
}

#[test]
fn a_recording_is_refused_in_another_scene_with_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = record(folder.path(), &["--scene", "small", "--frames", "0..20"]);
    let Outcome { code, err, .. } = overfly(&["replay", &file, "--no-render", "--scene", "moon"]);
    assert_eq!(code, 2, "{err}");
    for part in ["another scene", "body.a_m", "1000.0", "1737400.0"] {
        assert!(err.contains(part), "{err} lacks {part}");
    }
}

#[test]
fn a_flipped_byte_is_named_by_offset_and_the_frames_before_it_play() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = record(folder.path(), &["--scene", "small", "--frames", "0..200"]);
    let mut bytes = std::fs::read(&file).unwrap();
    let at = bytes.len() * 3 / 4;
    bytes[at] ^= 0x10;
    std::fs::write(&file, bytes).unwrap();
    let broken = overfly(&["replay", &file, "--no-render"]);
    assert_eq!(broken.code, 2, "{broken:?}");
    assert!(broken.err.contains("flight.ovf") && broken.err.contains("byte"), "{broken:?}");
    let played: u32 = broken.digest_frames();
    assert!((50..200).contains(&played), "{broken:?}");
}

#[test]
fn a_killed_recording_plays_to_its_last_whole_frame() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("killed.ovf");
    let mut child = super::command_line::command()
        .args(["replay", "rainier", "--no-render", "--scene", "small", "--record"])
        .arg(&file)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while std::fs::metadata(&file).map_or(0, |file| file.len()) < 200_000 {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let played = overfly(&["replay", &file.display().to_string(), "--no-render"]);
    let whole = played.code == 0 && played.out.contains("no end mark");
    let cut = played.code == 2 && played.err.contains("were played");
    assert!(whole || cut, "{played:?}");
    assert!(played.digest_frames() > 100, "{played:?}");
}

#[test]
fn a_recording_that_diverges_names_frame_and_stage() {
    use overfly::replay::{Header, Recording, Writer};
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = record(folder.path(), &["--scene", "small", "--frames", "0..60"]);
    let mut recording = Recording::open(Path::new(&file)).unwrap();
    let frames = recording.frames.len();
    recording.frames[frames - 10].digest.mesh ^= 1;
    let forged = folder.path().join("forged.ovf");
    let header = Header { frames: 0, ..recording.header };
    let mut writer = Writer::create(&forged, &header).unwrap();
    recording.frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    let played = overfly(&["replay", &forged.display().to_string(), "--no-render"]);
    assert_eq!(played.code, 1, "{played:?}");
    assert!(
        played.err.contains("diverged from the recording in frame 50, stage mesh"),
        "{played:?}"
    );
}

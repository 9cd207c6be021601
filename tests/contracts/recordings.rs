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

/// A flight in a file that takes little time: a bundled one looks for its ground first, and flies
/// low.
fn short_flight(folder: &Path) -> String {
    let body = overfly::config::load("small").unwrap().body;
    let mut flight = overfly::replay::flight("poles", &body, &|_| 100.0).unwrap();
    flight.poses.truncate(600);
    flight.raised(500.0);
    let path = folder.join("short.ovf");
    flight.write(&path).unwrap();
    path.display().to_string()
}

fn record_flight(flight: &str, folder: &Path) -> String {
    let file = folder.join("recorded.ovf").display().to_string();
    let small = ["--no-render", "--scene", "small", "--size", "160x90", "--record", &file];
    let done = overfly(&[&["replay", flight], &small[..]].concat());
    assert_eq!(done.code, 0, "{done:?}");
    file
}

/// A clip of a recording is what a clip of its flight is, from however far behind in the file.
#[test]
fn a_clip_of_a_recording_comes_up_at_its_first_frame_or_runs_from_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let (small, size) = (["--scene", "small"], ["--size", "160x90"]);
    let flight_file = short_flight(folder.path());
    let file = record_flight(&flight_file, folder.path());
    let clip = ["--no-render", "--frames", "300..340"];
    let flight = overfly(&[&["replay", &flight_file][..], &small, &size, &clip].concat());
    let cold = overfly(&[&["replay", &file], &clip[..]].concat());
    assert_eq!((cold.code, cold.digest_frames()), (0, 40), "{cold:?}");
    assert_eq!(cold.digest(), flight.digest());
    assert!(cold.out.contains("came up at frame 300: not held against"), "{cold:?}");
    let exact = overfly(&[&["replay", &file, "--from-start"], &clip[..]].concat());
    assert_eq!((exact.code, exact.digest_frames()), (0, 40), "{exact:?}");
    assert!(exact.out.contains("same as recorded"), "{exact:?}");
    let cut = folder.path().join("cut.ovf").display().to_string();
    let cut_out = overfly(&[&["replay", &file, "--record", &cut], &clip[..]].concat());
    assert_eq!((cut_out.code, cut_out.digest()), (0, cold.digest()), "{cut_out:?}");
    let again = overfly(&["replay", &cut, "--no-render"]);
    assert!(again.out.contains("same as recorded"), "{again:?}");
    assert_eq!(again.digest(), cold.digest());
    let refused = overfly(&["replay", &flight_file, "--frames", "0..9", "--from-start"]);
    assert!(refused.code == 2 && refused.err.contains("--from-start"), "{refused:?}");
}

#[test]
fn frames_behind_a_damaged_one_are_reached() {
    let folder = tempfile::tempdir().unwrap();
    let file = record_flight(&short_flight(folder.path()), folder.path());
    let clip = ["replay", &file, "--no-render", "--frames", "590..600"];
    let whole = overfly(&clip);
    let mut bytes = std::fs::read(&file).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 4;
    std::fs::write(&file, bytes).unwrap();
    let all = overfly(&["replay", &file, "--no-render"]);
    assert!(all.code == 2 && (100..500).contains(&all.digest_frames()), "{all:?}");
    let behind = overfly(&clip);
    assert_eq!((behind.code, behind.digest()), (0, whole.digest()), "{behind:?}");
}

#[test]
fn a_recording_is_never_written_over_what_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let fixes = (0..12).map(|s| format!("B1200{s:02}46{:02}000N00800000EA0200002000\n", s));
    let igc = format!("AXCS001\nHFDTE010620\n{}", fixes.collect::<String>());
    let (flight, map) = (path("two.igc"), path("two.igc.columns.ron"));
    std::fs::write(&flight, &igc).unwrap();
    std::fs::write(&map, "Columns(time: (column: 1), latitude: 2, longitude: 3)").unwrap();
    let numbered = format!("{flight}#1");
    let (stopped, old) = (path("x.ovf.part"), path("x.ovf"));
    let (file, _) = record(folder.path(), &["--scene", "small", "--frames", "0..9"]);
    std::fs::copy(&file, &stopped).unwrap();
    std::fs::copy(&file, &old).unwrap();
    let bytes = std::fs::read(&stopped).unwrap();
    for (read, command, option, written) in [
        (&flight, "replay", "--record", &flight),
        (&numbered, "replay", "--record", &flight),
        (&numbered, "replay", "--json", &flight),
        (&numbered, "replay", "--record", &map),
        (&numbered, "measure", "--json", &flight),
        (&numbered, "budget", "--record", &flight),
        (&numbered, "view", "--record", &flight),
        (&stopped, "replay", "--record", &old),
        (&stopped, "replay", "--record", &stopped),
    ] {
        let refused = overfly(&[command, read, option, written, "--scene", "small"]);
        assert_eq!(refused.code, 2, "{command} {read} {option} {written}: {refused:?}");
        assert!(refused.err.contains("is an input or another output"), "{refused:?}");
    }
    assert_eq!(std::fs::read_to_string(&flight).unwrap(), igc);
    assert_eq!(std::fs::read(&stopped).unwrap(), bytes);
}

/// The shell's limit on file sizes stands for a disk that is full: writes fail half way.
#[test]
fn a_full_disk_is_named_and_what_was_recorded_before_plays() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("full.ovf").display().to_string();
    let limited = |rest: &str| {
        let script = format!("trap '' XFSZ; ulimit -f 100; exec \"$0\" {rest}");
        let run = super::command_line::command();
        let shell = std::process::Command::new("sh")
            .args(["-c", &script, &run.get_program().to_string_lossy(), &file])
            .output()
            .unwrap();
        (shell.status.code(), String::from_utf8_lossy(&shell.stderr).into_owned())
    };
    let recording =
        "replay rainier --no-render --scene small --size 160x90 --frames 0..5000 --record \"$1\"";
    let plays = |file: &str| {
        let played = overfly(&["replay", file, "--no-render"]);
        assert!(played.code == 0 && played.out.contains("no end mark"), "{played:?}");
        assert!(played.out.contains("same as recorded"), "{played:?}");
        played.digest_frames()
    };
    let (code, said) = limited(recording);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("full.ovf: cannot write at byte ") && said.contains("arge"), "{said}");
    let frames = plays(&file);
    assert!(frames > 100, "{frames}");
    let bytes = std::fs::read(&file).unwrap();
    let (code, said) = limited(recording);
    assert!(code == Some(2) && said.contains("full.ovf.part: cannot write at byte "), "{said}");
    assert_eq!(std::fs::read(&file).unwrap(), bytes, "what was there stays until it is replaced");
    assert_eq!(plays(&format!("{file}.part")), frames);
}

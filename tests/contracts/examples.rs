//! Every example runs and says what it should.
//!
//! In:    the built examples.
//! Out:   passes or fails.
//! Keeps: a folder for what they write, thrown away.
//! Not here: what `own_renderer` draws (`columns`).

use super::command_line::{Outcome, overfly};
use std::path::PathBuf;
use std::process::Command;

/// Runs an example, which `cargo test` builds beside this test.
pub fn example(name: &str, arguments: &[&str]) -> Outcome {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_overfly"));
    let folder = program.parent().unwrap().join("examples");
    let program = folder.join(name).with_extension(std::env::consts::EXE_EXTENSION);
    let lacks = "is not there; a test of one target does not build it: cargo build --examples";
    assert!(program.exists(), "{} {lacks}", program.display());
    let done = Command::new(program).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Outcome { code: done.status.code().unwrap(), out: text(&done.stdout), err: text(&done.stderr) }
}

#[test]
fn headless_records_what_it_flies() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flight.ovf");
    let file = file.to_str().unwrap();
    let flown = example("headless", &["--frames", "200", "--record", file]);
    assert_eq!((flown.code, flown.err.as_str()), (0, ""), "{flown:?}");
    assert_eq!(flown.out.lines().filter(|line| line.starts_with("frame ")).count(), 4);
    assert!(flown.out.contains("recorded 200 frames"), "{flown:?}");
    let last = flown.out.lines().nth(3).unwrap();
    assert!(last.contains("m, within "), "no ground after three seconds: {flown:?}");
    let again = overfly(&["replay", file, "--no-render", "--workers", "0"]);
    assert_eq!((again.code, again.digest_frames()), (0, 200), "{again:?}");
}

#[test]
fn traffic_stands_on_the_ground_and_says_who_does_not() {
    let driven = example("traffic", &["--vehicles", "500", "--frames", "200"]);
    assert_eq!((driven.code, driven.err.as_str()), (0, ""), "{driven:?}");
    // In the first frame nothing is there; then everybody stands; then some have left town.
    let lines: Vec<_> = driven.out.lines().collect();
    assert!(lines[0].contains("  500 not ready"), "{driven:?}");
    assert!(driven.out.contains("  500 placed,     0 on coarser"), "{driven:?}");
    let last = lines.iter().rfind(|line| line.starts_with("frame ")).unwrap();
    assert!(last.contains("    0 not ready") && !last.contains("  500 placed"), "{driven:?}");
    assert_eq!(lines.iter().filter(|line| line.len() == 64).count(), 24, "a map");
}

#[test]
fn two_views_are_drawn_from_one_frame() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.png");
    let drawn = example("two_views", &["--out", file.to_str().unwrap()]);
    assert_eq!((drawn.code, drawn.err.as_str()), (0, ""), "{drawn:?}");
    assert!(drawn.out.contains("ahead: 640x360") && drawn.out.contains("mirror: 240x80"));
    let picture = image::open(&file).unwrap().to_rgb8();
    let colours: std::collections::BTreeSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
    assert!(colours.len() > 100, "{} colours", colours.len());
}

#[test]
fn examples_name_what_they_refuse() {
    for (name, arguments, part) in [
        ("headless", vec!["--scene", "mars"], "mars"),
        ("headless", vec!["--frames", "0"], "--frames"),
        ("headless", vec!["--height", "nan", "--frames", "1"], "eye is NaN"),
        ("own_renderer", vec!["--at", "91,0,10"], "latitudes from -90 to 90"),
        ("own_renderer", vec!["--at", "9,10"], "not 3 finite numbers"),
        ("own_renderer", vec!["--size", "0,5"], "each from 1 to 8192"),
        (
            "own_renderer",
            vec!["--scene", "small", "--size", "8,8", "--out", "/no/where.png"],
            "/no/where.png",
        ),
        ("traffic", vec!["--vehicles", "0"], "--vehicles"),
        ("two_views", vec!["--scene", "no.ron"], "no.ron"),
    ] {
        let Outcome { code, err, .. } = example(name, &arguments);
        assert_eq!(code, 2, "{name} {arguments:?}: {err}");
        assert!(err.contains(part), "{name} {arguments:?}: {err}");
    }
}

//! The command line: codes, help, errors that name the value and the allowed range.
//!
//! In:    the built binary.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: recordings, pictures.

use std::process::Command;

/// What a run printed and how it ended.
#[derive(Debug)]
pub struct Outcome {
    pub code: i32,
    pub out: String,
    pub err: String,
}

pub fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_overfly"))
}

pub fn overfly(arguments: &[&str]) -> Outcome {
    let done = command().args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Outcome { code: done.status.code().unwrap(), out: text(&done.stdout), err: text(&done.stderr) }
}

impl Outcome {
    fn digest_line(&self) -> Vec<&str> {
        let line = self.out.lines().find(|line| line.starts_with("digest "));
        line.unwrap_or_else(|| panic!("no digest: {self:?}")).split(' ').collect()
    }

    pub fn digest(&self) -> String {
        self.digest_line()[1].to_owned()
    }

    pub fn digest_frames(&self) -> u32 {
        self.digest_line()[3].parse().unwrap()
    }
}

#[test]
fn help_teaches() {
    let help = overfly(&["--help"]);
    assert_eq!(help.code, 0);
    for word in ["replay", "check", "doctor", "Exit codes", "--stills 8"] {
        assert!(help.out.contains(word), "{help:?}");
    }
    let replay = overfly(&["replay", "--help"]);
    for flag in ["--scene", "--workers", "--frames", "--size", "--no-render", "--stills"] {
        assert!(replay.out.contains(flag), "{replay:?}");
    }
}

#[test]
fn bad_arguments_name_the_value_and_what_is_allowed() {
    for (arguments, part) in [
        (vec!["replay", "nowhere"], "rainier, descent, poles"),
        (vec!["replay", "rainier", "--frames", "5..5"], "A below B"),
        (vec!["replay", "rainier", "--no-render", "--frames", "0..99999"], "0..36001"),
        (vec!["replay", "rainier", "--size", "0x9"], "1 to 8192"),
        (vec!["replay", "rainier", "--workers", "65"], "0..=64"),
        (vec!["replay", "rainier", "--scene", "mars"], "mars"),
        (vec!["replay", "rainier", "--stills", "3", "--no-render"], "cannot be used with"),
        (vec!["check", "no/such/scene.ron"], "no/such/scene.ron"),
    ] {
        let Outcome { code, err, .. } = overfly(&arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        assert!(err.contains(part), "{arguments:?}: {err}");
    }
}

#[test]
fn check_reports_every_fault_of_a_scene_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.ron");
    let text = "Scene(\n    body: Wgs84,\n    lod: (patch_depth: 3, tolerence_px: 1.0),\n    \
                memory: (pages_mib: \"many\"),\n)\n";
    std::fs::write(&file, text).unwrap();
    let Outcome { code, err, .. } = overfly(&["check", &file.display().to_string()]);
    assert_eq!(code, 2);
    for part in
        ["scene.ron:3:24", "lod.patch_depth", "0, 2, 4, 6", "tolerance_px", "memory.pages_mib"]
    {
        assert!(err.contains(part), "{err} lacks {part}");
    }
    assert_eq!(overfly(&["check", "earth"]).code, 0);
}

#[test]
fn outputs_are_checked_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("scene.ron"), "Scene(body: Sphere(radius_m: 1000.0))").unwrap();
    let replay = ["replay", "poles", "--no-render", "--frames", "0..3", "--scene"];
    let (scene, same, link) = (path("scene.ron"), path("same"), path("link"));
    std::os::unix::fs::symlink(path("nothing"), &link).unwrap();
    for (outputs, why) in [
        (vec!["--record", scene.as_str()], "is an input or another output"),
        (vec!["--record", &same, "--json", &same], "is an input or another output"),
        (vec!["--json", "/dev/null"], "is not a regular file"),
        (vec!["--json", "/"], "is not a regular file"),
        (vec!["--json", &link], "is a link to nothing"),
        (vec!["--out", &scene], "is not a folder"),
    ] {
        let arguments = [&replay[..], &[&scene], &outputs].concat();
        let Outcome { code, err, .. } = overfly(&arguments);
        assert_eq!(code, 2, "{outputs:?}: {err}");
        assert!(err.contains(why), "{outputs:?}: {err}");
    }
    assert!(std::fs::read_to_string(&scene).unwrap().starts_with("Scene("));
    let nested = path("made/for/it.json");
    let done = overfly(&[&replay[..], &[&scene, "--json", &nested]].concat());
    assert_eq!(done.code, 0, "{done:?}");
    assert!(std::fs::read_to_string(&nested).unwrap().contains("overfly-replay-1"));
}

#[test]
fn a_reader_that_goes_away_does_not_stop_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.ovf").display().to_string();
    let mut child = command()
        .args(["replay", "poles", "--scene", "small", "--no-render", "--frames", "0..40"])
        .args(["--record", &file])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let again = overfly(&["replay", &file, "--no-render"]);
    assert_eq!((again.code, again.digest_frames()), (0, 40), "{again:?}");
}

#[test]
fn json_holds_a_column_for_every_stage_and_count() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.json");
    let path = file.display().to_string();
    let done = overfly(&[
        "replay",
        "poles",
        "--scene",
        "small",
        "--frames",
        "10..40",
        "--no-render",
        "--json",
        &path,
    ]);
    assert_eq!(done.code, 0, "{done:?}");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(json["format"], "overfly-replay-1");
    assert_eq!(json["frames"], 30);
    assert_eq!(json["digest"], done.digest());
    for (table, names) in [
        ("stages_ms", vec!["frame", "lod.refine", "mesh.build", "mesh.place"]),
        ("counts", vec!["triangles", "splits", "merges", "pages", "error_px_bound"]),
    ] {
        for name in names {
            assert_eq!(json[table][name].as_array().unwrap().len(), 30, "{table} {name}");
        }
    }
}

#[test]
fn ctrl_c_ends_a_replay_with_its_summary() {
    use std::io::{BufRead, BufReader, Read};
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.ovf");
    let mut child = command()
        .args(["replay", "rainier", "--no-render", "--record"])
        .arg(&file)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    out.read_line(&mut line).unwrap();
    while std::fs::metadata(&file).map_or(0, |file| file.len()) < 100_000 {
        std::thread::yield_now();
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
    assert!(rest.contains("digest ") && rest.contains("recorded "), "{rest}");
}

//! The window: opens, flies, records, resizes, closes; what was recorded replays.
//!
//! In:    the built binary; an X server, or Xvfb to start one.
//! Out:   passes, fails, or says what is missing.
//! Keeps: the X server of a test, ended with it.
//! Not here: what keys and frames do (`src/viewer`).

use super::command_line::{Outcome, command, overfly};
use overfly::render_vk::{devices, layers};
use std::fmt::Write;
use std::io::Read;
use std::process::{Child, Command, Stdio};

/// An X server to open windows on.
struct Screen {
    display: String,
    server: Option<Child>,
}

impl Screen {
    /// The one that there is, else one of its own; `None` where there is neither.
    fn open(test: &str) -> Option<Self> {
        if let Some(display) = std::env::var("DISPLAY").ok().filter(|name| !name.is_empty()) {
            return Some(Self { display, server: None });
        }
        // The server picks a free number and says which.
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            println!("{test} skipped: no Xvfb");
            return None;
        };
        let mut out = server.stdout.take().expect("it is piped");
        let (mut number, mut byte) = (String::new(), [0]);
        while out.read(&mut byte).is_ok_and(|read| read == 1) && byte[0] != b'\n' {
            number.push(char::from(byte[0]));
        }
        let display = format!(":{number}");
        Some(Self { display, server: Some(server) })
    }

    /// Runs `overfly view` on it.
    fn view(&self, arguments: &[&str]) -> Outcome {
        let mut command = command();
        command.arg("view").args(arguments).args(["--workers", "1"]);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        let done = command.output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (out, err) = (text(&done.stdout), text(&done.stderr));
        Outcome { code: done.status.code().unwrap_or(-1), out, err }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if let Some(server) = &mut self.server {
            // A server that is gone already is what is wanted.
            let _ = server.kill();
            let _ = server.wait();
        }
    }
}

/// Whether there is a device; says so where there is none.
fn device(test: &str) -> bool {
    let found = devices().is_ok_and(|devices| !devices.is_empty());
    let required = std::env::var("OVERFLY_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(found || !required, "OVERFLY_REQUIRE_GPU=1 and no Vulkan device");
    if !found {
        println!("{test} skipped: no Vulkan device");
    }
    found
}

/// `--validate` where the layer is installed.
fn validation() -> Option<&'static str> {
    let layers = layers().unwrap_or_default();
    let found = layers.iter().any(|layer| layer.contains("VK_LAYER_KHRONOS_validation"));
    found.then_some("--validate")
}

#[test]
fn a_window_flies_records_resizes_and_closes_and_the_recording_replays() {
    let test = "a_window_flies_records_resizes_and_closes_and_the_recording_replays";
    let Some(screen) = Screen::open(test) else { return };
    if !device(test) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (file, pictures) = (path("flown.ovf"), path("pictures"));
    let mut script = "frames 5; key W 5; key E 3; drag 40 -20; wheel 2; key G; key F1; ".to_owned();
    for digit in 1..=8 {
        write!(script, "key {digit} 1; ").unwrap();
    }
    script += "key 1; key F1; key P; ";
    for turn in 0..25 {
        let (a, b) = (96 + 4 * turn, 80 + 3 * turn);
        write!(script, "resize {a}x{b}; resize {b}x{a}; ").unwrap();
    }
    script += "key S 2; key F; key [; frames 2; quit";
    let mut arguments = vec!["--scene", "small", "--size", "320x240", "--script", &script];
    arguments.extend(["--record", &file, "--out", &pictures]);
    arguments.extend(validation());
    let flown = screen.view(&arguments);
    assert_eq!(flown.code, 0, "{flown:?}");
    assert!(flown.out.contains("50 resizes"), "{flown:?}");
    assert!(flown.out.contains("recorded "), "{flown:?}");
    if validation().is_some() {
        assert!(flown.out.contains("validation messages: 0"), "{flown:?}");
    }
    let picture = image::open(path("pictures/view-0001.png")).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (320, 240));
    let first = picture.get_pixel(0, 0);
    assert!(picture.pixels().any(|pixel| pixel != first), "it shows nothing");
    let sidecar = std::fs::read_to_string(path("pictures/view-0001.ron")).unwrap();
    assert!(sidecar.contains("scene: \"small\""), "{sidecar}");
    let ron = path("pictures/view-0001.ron");
    let back = screen.view(&["--sidecar", &ron, "--frames", "2", "--script", "frames 1"]);
    assert_eq!(back.code, 0, "{back:?}");
    let again = overfly(&["replay", &file, "--no-render"]);
    assert_eq!(again.code, 0, "{again:?}");
    assert!(again.out.contains("same as recorded"), "{again:?}");
    assert!(again.digest_frames() > 60, "{again:?}");
}

#[test]
fn a_flight_is_sought_through_and_another_tolerance_draws_on() {
    let test = "a_flight_is_sought_through_and_another_tolerance_draws_on";
    let Some(screen) = Screen::open(test) else { return };
    if !device(test) {
        return;
    }
    let script = "frames 3; key Right; key End; key Home; key , ; key .; key B; key N; frames 2; \
                  key [; frames 3; key F; key D 2; key R; frames 2; quit";
    let mut arguments = vec!["poles", "--scene", "small", "--size", "160x120", "--script", script];
    arguments.extend(validation());
    let flown = screen.view(&arguments);
    assert_eq!(flown.code, 0, "{flown:?}");
    assert!(flown.out.contains(" frames, 0 resizes"), "{flown:?}");
}

#[test]
fn without_a_window_system_it_says_what_helps() {
    let done = command()
        .args(["view", "--scene", "small", "--frames", "1"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&done.stderr);
    if cfg!(target_os = "linux") {
        assert_eq!(done.status.code(), Some(1), "{err}");
        assert!(err.contains("no window can be opened") && err.contains("overfly still"), "{err}");
    }
}

#[test]
fn bad_places_and_scripts_are_named_before_anything_opens() {
    for (arguments, part) in [
        (vec!["view", "--at", "95,0,0"], "LAT,LON,ALT"),
        (vec!["view", "--look", "0,0"], "--at"),
        (vec!["view", "--view", "pretty"], "wireframe"),
        (vec!["view", "--script", "frames 1; jump"], "`jump` is none of"),
        (vec!["view", "nowhere"], "rainier, descent, poles"),
    ] {
        let Outcome { code, err, .. } = overfly(&arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        assert!(err.contains(part), "{arguments:?}: {err}");
    }
}

//! `overfly serve`: the program itself, over real sockets on loopback.
//!
//! In:    the built binary, an independent host, the small planet.
//! Out:   passes or fails.
//! Keeps: a folder for each test, thrown away.
//! Not here: the protocols themselves (`link/tests`).

use super::command_line::{Outcome, command, overfly};
use host::{Host, packets};
use overfly::core::geodesy::{Ellipsoid, Geodetic};
use overfly::core::ground::Query;
use overfly::replay::Recording;
use overfly::{Overfly, config};
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::net::UdpSocket;
use std::process::{Child, ChildStdout, Stdio};
use std::time::Duration;

#[path = "../../link/tests/host/mod.rs"]
mod host;

/// A server at work, and where it listens.
struct Served {
    child: Child,
    out: BufReader<ChildStdout>,
    address: String,
}

impl Served {
    fn start(arguments: &[&str]) -> Self {
        let all = [&["serve", "--scene", "small", "--size", "320x240"], arguments].concat();
        let mut child =
            command().args(all).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let address = line.trim().rsplit(' ').next().unwrap().to_owned();
        assert!(address.starts_with("127.0.0.1:"), "{line:?}");
        Self { child, out, address }
    }

    fn end(mut self) -> Outcome {
        let (mut out, mut err) = (String::new(), String::new());
        self.out.read_to_string(&mut out).unwrap();
        self.child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
        Outcome { code: self.child.wait().unwrap().code().unwrap(), out, err }
    }
}

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    socket
}

/// The next datagram; signals, such as those of other tests' children, interrupt the wait.
fn receive(socket: &UdpSocket, buffer: &mut [u8]) -> usize {
    loop {
        match socket.recv(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            received => return received.unwrap(),
        }
    }
}

/// A count of the table at the end.
fn count(done: &Outcome, name: &str) -> u64 {
    let line = done.out.lines().find(|line| line.starts_with(&format!("{name}  ")));
    line.map_or(0, |line| line.rsplit(' ').next().unwrap().parse().unwrap())
}

#[test]
fn a_host_on_loopback_flies_asks_and_is_answered_by_the_ground_itself() {
    let folder = tempfile::tempdir().unwrap();
    let flown = folder.path().join("flown.ovf").display().to_string();
    let served =
        Served::start(&["--cigi", "0", "--frames", "400", "--rate", "100", "--record", &flown]);
    let socket = socket();
    let [lat, lon, altitude_m] = [12.5, -40.25, 300.0];
    let mut buffer = [0; 65_536];
    let mut found = None;
    for frame in 0..300 {
        let mut host = Host::new(frame % 2 == 0, frame, (1, 0));
        host.entity((0, 0, 1), [lat, lon, altitude_m], [45.0, -20.0, 0.0]);
        host.hat_hot((77, 2, 0), Some(0), [0.0; 3]);
        host.vector((78, true, 0), (Some(0), [0.0; 3]), [0.0, -70.0, 0.0, 1e4]);
        host.packet(99, 8);
        socket.send_to(&host.bytes, &served.address).unwrap();
        socket.send_to(b"noise", &served.address).unwrap();
        let length = receive(&socket, &mut buffer);
        let all = packets(&buffer[..length]);
        assert_eq!(all[0].id(), 101, "every message begins with Start Of Frame");
        let heights = all.iter().find(|p| p.id() == 103 && p.u8(4) & 1 == 1);
        let line = all.iter().find(|p| p.id() == 105 && p.u8(4) & 1 == 1);
        if let (Some(heights), Some(line)) = (heights, line) {
            assert_eq!((heights.u16(2), line.u16(2)), (77, 78));
            found = Some([heights.f64(8), heights.f64(16), line.f64(8), line.f64(40 - 8)]);
            if frame > 150 {
                break;
            }
        }
    }
    let [above_m, of_m, range_m, met_m] = found.expect("asking made the ground come");
    let scene = config::load("small").unwrap();
    let overfly_here = Overfly::new(&scene, 0).unwrap();
    let level = overfly_here.sources().procedural_level();
    let at = Geodetic::from_degrees(lat, lon, altitude_m);
    let height = overfly_here.surveyor(200).height(at, Query::Exact(level)).unwrap();
    let height_m = height.ok().unwrap().height_m;
    assert!((above_m - (altitude_m - height_m)).abs() < 1e-6, "{above_m} {height_m}");
    assert!((of_m - height_m).abs() < 1e-6);
    // The nose is 20° below the horizon, the line 70° below the nose: it goes straight down.
    assert!((range_m - above_m).abs() < 0.5 && (met_m - of_m).abs() < 0.5, "{range_m} {met_m}");
    let done = served.end();
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{done:?}");
    assert_eq!(count(&done, "frames"), 400);
    let [messages, unknown, short] =
        ["messages", "passed over: unknown", "dropped: short"].map(|name| count(&done, name));
    assert!(messages > 100 && messages == unknown && messages.abs_diff(short) < 2, "{done:?}");
    let replayed = overfly(&["replay", &flown, "--no-render"]);
    assert_eq!(replayed.code, 0, "the session replays to its digests: {replayed:?}");
}

#[test]
fn flightgears_packets_are_the_views_of_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let flown = folder.path().join("flown.ovf");
    let name = flown.display().to_string();
    let served = Served::start(&[
        "--fgfs-native-fdm",
        "0",
        "--frames",
        "60",
        "--rate",
        "60",
        "--record",
        &name,
    ]);
    let socket = socket();
    let at = Geodetic::from_degrees(20.0, 30.0, 150.0);
    let mut packet = vec![0; 408];
    packet[..4].copy_from_slice(&24_u32.to_be_bytes());
    for (index, number) in [at.lon_rad, at.lat_rad, at.height_m].into_iter().enumerate() {
        packet[8 + 8 * index..16 + 8 * index].copy_from_slice(&number.to_be_bytes());
    }
    socket.send_to(&packet, &served.address).unwrap();
    socket.send_to(&packet[1..], &served.address).unwrap();
    let done = served.end();
    assert_eq!(done.code, 0, "{done:?}");
    assert_eq!(count(&done, "native FDM packets"), 1);
    assert_eq!(count(&done, "native FDM packets dropped"), 1);
    assert!(done.err.contains("allowed are 24 and 25"), "{done:?}");
    let recording = Recording::open(&flown).unwrap();
    let seen = recording.frames.iter().rev().find_map(|frame| frame.views.first());
    let eye = Ellipsoid { a_m: 1000.0, f: 0.0 }.ecef_from_geodetic(at);
    assert!((seen.expect("a view").eye.0 - eye.0).length() < 1e-9);
}

#[test]
fn bad_arguments_of_serve_name_the_value_and_what_is_allowed() {
    for (arguments, part) in [
        (vec![], "--cigi"),
        (vec!["--cigi", "70000"], "65535"),
        (vec!["--cigi", "0", "--rate", "0"], "from 1 to 1000"),
        (vec!["--cigi", "0", "--database", "0"], "1..=127"),
        (vec!["--cigi", "0", "--datagram", "99999"], "from 256 to 65507"),
        (vec!["--cigi", "0", "--level", "57"], "0..=56"),
        (vec!["--cigi", "0", "--reply-to", "nowhere"], "HOST:PORT"),
        (vec!["--fgfs-native-fdm", "0", "--reply-to", "127.0.0.1:9"], "--cigi"),
        (vec!["--cigi", "0", "--bind", "here"], "--bind"),
        (vec!["--cigi", "0", "--scene", "nowhere.ron"], "nowhere.ron"),
    ] {
        let done = overfly(&[&["serve"], &arguments[..]].concat());
        assert!(done.code == 2 && done.err.contains(part), "{arguments:?}: {done:?}");
    }
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let done = overfly(&["serve", "--scene", "small", "--cigi", &port]);
    assert!(done.code == 2 && done.err.contains("cannot listen on"), "{done:?}");
    let help = overfly(&["serve", "--help"]);
    for word in ["--reply-to", "HAT/HOT", "docs/serving.md", "overfly serve --cigi 8004"] {
        assert!(help.out.contains(word), "{help:?}");
    }
}

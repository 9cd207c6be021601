//! Scenes over archives: data that cannot be had makes the ground coarser, and nothing else.
//!
//! In:    an archive of hills, whole, damaged, foreign, or on a server that dies.
//! Out:   passes or fails.
//! Keeps: a folder for each test, thrown away.
//! Not here: reading archives (`overfly_archive`), heights of the ground (`grounds`).

use super::command_line::{Outcome, command, overfly};
use super::flights::Tour;
use super::hills::Hills;
use super::server::{Server, Stall};
use overfly::archive::OpenOptions;
use overfly::core::datasource::PageKey;
use overfly::core::datasource::page::Origin;
use overfly::{Host, OpenError, Overfly, config};
use std::io::{BufRead, BufReader, Read};
use std::time::Duration;

fn open_error(scene: &str) -> String {
    let opened = Overfly::new(&config::load(scene).unwrap(), 0);
    let error = opened.err().expect("it must not open");
    assert!(matches!(error, OpenError::Source(_)));
    error.to_string()
}

#[test]
fn pages_of_a_scene_are_made_from_its_archive() {
    let hills = Hills::new();
    let mut tour = Tour::new("poles", &hills.scene_name(), 1);
    tour.settle(0);
    tour.overfly.terrain().audit().unwrap();
    let pages = tour.overfly.terrain().pages();
    let measured = |page: &overfly::core::datasource::Page| {
        page.survey.as_ref().unwrap().origin.contains(&Origin::Measured)
    };
    let (mut with, mut without) = (0, 0);
    for page in pages.page.as_slice().iter().flatten() {
        if measured(page) { with += 1 } else { without += 1 }
    }
    assert!(with > 0 && without > 0, "{with} pages with data, {without} without");
    assert_eq!(tour.loader.faults().count(), 0);
}

#[test]
fn archives_that_are_missing_or_of_another_body_are_refused_by_name() {
    let hills = Hills::new();
    let text = std::fs::read_to_string(hills.scene()).unwrap();
    std::fs::write(hills.scene(), text.replace("1000.0", "1000.1")).unwrap();
    let error = open_error(&hills.scene_name());
    for part in ["hills.pmtiles", "small", "1000.0", "1000.1"] {
        assert!(error.contains(part), "{error} lacks {part}");
    }
    std::fs::remove_file(hills.archive()).unwrap();
    let error = open_error(&hills.scene_name());
    assert!(error.contains("hills.pmtiles") && error.contains("cannot be opened"), "{error}");
    let Outcome { code, err, .. } = overfly(&["check", &hills.scene_name()]);
    assert!(code == 2 && err.contains("hills.pmtiles"), "{err}");
}

#[test]
fn check_lists_what_an_archive_says_about_itself() {
    let hills = Hills::with(|_| false, 0x0123_4567_89AB_CDEF);
    let Outcome { code, out, .. } = overfly(&["check", &hills.scene_name()]);
    assert_eq!(code, 0);
    for part in ["hills.pmtiles", "small", "the ellipsoid", "0123456789abcdef", "layer of level 16"]
    {
        assert!(out.contains(part), "{out} lacks {part}");
    }
}

#[test]
fn a_damaged_tile_leaves_the_ground_coarser_there_and_is_named() {
    // Of the pages that the LOD wants where all is sound, one is damaged.
    let mut sound = Tour::new("poles", &Hills::new().scene_name(), 0);
    sound.settle(0);
    let deeper = |tour: &Tour| -> Vec<PageKey> {
        let pages = tour.overfly.terrain().pages();
        let keys = pages.page.as_slice().iter().flatten().map(|page| page.key);
        keys.filter(|key| key.quadrant() == 0 && key.depth() == 1).collect()
    };
    let bad = deeper(&sound)[0];
    let hills = Hills::with(|key| key == bad, 1);
    let mut tour = Tour::new("poles", &hills.scene_name(), 0);
    for _ in 0..40 {
        tour.frame(0, false);
    }
    tour.overfly.terrain().audit().unwrap();
    assert!(!deeper(&tour).contains(&bad), "a page without its data");
    let (coarse, fine) = (&tour.output.counts, &sound.output.counts);
    assert!(coarse.leaves >= 8 && coarse.blocked > 0, "the parent is drawn: {coarse:?}");
    assert!(coarse.error_px_bound > fine.error_px_bound, "and it says so");
    let (key, error) = tour.loader.faults().find(|(key, _)| *key == bad).expect("it failed");
    assert!(tour.loader.rests(key), "it is asked for again later");
    let error = error.to_string();
    assert!(error.contains("hills.pmtiles") && error.contains("check sum"), "{error}");
    assert!(tour.output.wanted.contains(&key), "the LOD still wants it");
}

#[test]
fn a_replay_over_damaged_tiles_says_so_once_and_goes_on() {
    let hills = Hills::with(|key| key.depth() > 0, 1);
    let name = hills.scene_name();
    let done = overfly(&["replay", "poles", "--no-render", "--frames", "0..200", "--scene", &name]);
    assert_eq!((done.code, done.digest_frames()), (0, 200), "{done:?}");
    assert_eq!(done.err.matches("hills.pmtiles").count(), 1, "{done:?}");
    assert!(done.err.contains("coarser"), "{done:?}");
}

#[test]
fn a_dead_server_leaves_the_ground_coarser_until_it_lives_again() {
    let hills = Hills::new();
    let server = Server::new(std::fs::read(hills.archive()).unwrap());
    hills.write_scene(&server.url());
    let options = OpenOptions {
        retries: 0,
        read_timeout: Duration::from_millis(500),
        cool_down: Duration::from_millis(100),
        ..OpenOptions::default()
    };
    let scene = config::load(&hills.scene_name()).unwrap();
    let overfly = Overfly::new(&scene, Host { patience: options, ..Host::default() }).unwrap();
    let mut tour = Tour::over(overfly, scene, "poles");
    tour.frame(0, false);
    tour.frame(0, false);
    let resident = tour.output.counts.pages;
    assert!(resident >= 4, "the roots came");
    server.change(|it| (it.failing, it.status) = (u32::MAX, 503));
    (0..10).for_each(|_| tour.frame(0, false));
    let faults: Vec<_> = tour.loader.faults().map(|(_, error)| error.to_string()).collect();
    assert!(faults.iter().any(|fault| fault.contains("503")), "{faults:?}");
    assert!(tour.overfly.sources().archives()[0].health().failures > 0);
    server.change(|it| it.failing = 0);
    while tour.loader.faults().count() > 0 {
        std::thread::sleep(Duration::from_millis(20));
        tour.frame(0, false);
    }
    tour.settle(0);
    assert!(tour.output.counts.pages > resident);
    let mut sound = Tour::new("poles", &hills_of_file(&hills), 0);
    sound.settle(0);
    assert_eq!(sound.output.digest.mesh, tour.output.digest.mesh, "the same ground in the end");
}

/// The scene over the file again.
fn hills_of_file(hills: &Hills) -> String {
    hills.write_scene("hills.pmtiles");
    hills.scene_name()
}

#[test]
fn a_replay_finishes_although_the_server_dies_under_way() {
    let hills = Hills::new();
    // A flight in a file asks nothing of the ground before its first frame.
    let flight = hills.folder().join("poles.ovf");
    Tour::new("poles", "small", 0).flight.write(&flight).unwrap();
    let server = Server::new(std::fs::read(hills.archive()).unwrap());
    hills.write_scene(&server.url());
    // Slow enough that it dies while the first page is on its way.
    server.change(|it| it.stall = Some(Stall::Header));
    let mut child = command()
        .arg("replay")
        .arg(&flight)
        .args(["--no-render", "--frames", "0..400", "--workers", "0", "--scene"])
        .arg(hills.scene())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut text = String::new();
    out.read_line(&mut text).unwrap();
    assert!(text.contains("poles over"), "{text}");
    server.change(|it| (it.failing, it.stall) = (u32::MAX, None));
    out.read_to_string(&mut text).unwrap();
    let done = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{text}{err}");
    assert!(text.contains("of 400 frames") && err.contains(&server.url()), "{text}{err}");
}

#[test]
fn a_recording_over_an_archive_replays_and_is_refused_over_other_data() {
    let hills = Hills::with(|_| false, 0xAAAA);
    let file = hills.folder().join("run.ovf").display().to_string();
    let name = hills.scene_name();
    let done = overfly(&[
        "replay",
        "poles",
        "--no-render",
        "--frames",
        "0..120",
        "--scene",
        &name,
        "--record",
        &file,
        "--loader-delay-ms",
        "40",
    ]);
    assert_eq!(done.code, 0, "{done:?}");
    for workers in ["0", "2"] {
        let again =
            overfly(&["replay", &file, "--no-render", "--scene", &name, "--workers", workers]);
        assert_eq!((again.code, again.digest()), (0, done.digest()), "{again:?}");
    }
    let elsewhere = overfly(&["replay", &file, "--no-render"]);
    assert!(elsewhere.code == 2 && elsewhere.err.contains("--scene FILE"), "{elsewhere:?}");
    let other = Hills::with(|_| false, 0xBBBB);
    let refused = overfly(&["replay", &file, "--no-render", "--scene", &other.scene_name()]);
    assert_eq!(refused.code, 2, "{refused:?}");
    for part in ["over other data", "sources[0].content", "000000000000aaaa", "000000000000bbbb"] {
        assert!(refused.err.contains(part), "{refused:?}");
    }
    let header = overfly::replay::Recording::open(std::path::Path::new(&file)).unwrap().header;
    assert!(header.settings.iter().any(|(path, _)| path == "sources[0].content"));
}

#[test]
fn flights_keep_above_an_archives_ground() {
    let hills = Hills::new();
    let scene = config::load(&hills.scene_name()).unwrap();
    let overfly = Overfly::new(&scene, 0).unwrap();
    let flight = overfly.flight("rainier").unwrap();
    let ground_m = |at| overfly.ground_height_m(at).unwrap();
    let clearance_m = flight.clearance_m(60, &ground_m);
    let least_m = 300.0 * scene.body.a_m / 6_378_137.0;
    assert!(clearance_m >= least_m * 0.999, "{clearance_m} of {least_m}");
    let nameless = overfly.flight("nowhere").unwrap_err().to_string();
    assert!(nameless.contains("nowhere") && nameless.contains("rainier"), "{nameless}");
}

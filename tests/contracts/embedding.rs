//! overfly inside another program: its threads, its scene edits, its recording.
//!
//! In:    the façade, as a host uses it.
//! Out:   passes or fails.
//! Keeps: files in a folder that is thrown away.
//! Not here: the C border (`capi`), the examples, archives (`archives`).

use super::command_line::overfly as program;
use overfly::core::digest::FrameDigest;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::{SceneSettings, SourceSettings, SunSettings};
use overfly::replay::{RecordedFrame, Recording, view_of};
use overfly::{Host, HostThreads, Overfly, Pages, Workers, config};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

const WAITED: Pages = Pages::Waited { threads: 1 };

fn host(workers: Workers) -> Host {
    Host { workers, pages: WAITED, ..Host::default() }
}

/// Flies `frames` frames of `poles`; `edit` may put a scene into any of them.
fn fly(
    overfly: &mut Overfly,
    frames: usize,
    mut edit: impl FnMut(usize, &mut FrameInput),
) -> Vec<FrameDigest> {
    let scene = overfly.scene().clone();
    let flight = overfly.flight("poles").unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    let mut frame = |index: usize| {
        let pose = &flight.poses[index];
        input.time_s = pose.time_s;
        input.views.clear();
        input.views.push(view_of(pose, &scene.views[0], [320, 240], &scene.body));
        edit(index, &mut input);
        overfly.frame(&mut input, &mut output).unwrap();
        output.digest
    };
    (0..frames).map(&mut frame).collect()
}

fn flown(host: impl Into<Host>, frames: usize) -> Vec<FrameDigest> {
    let scene = config::load("small").unwrap();
    fly(&mut Overfly::new(&scene, host).unwrap(), frames, |_, _| {})
}

#[test]
fn frames_are_the_same_bits_whoever_helps() {
    let alone = flown(host(Workers::Caller), 40);
    assert_ne!(alone[0], alone[39], "the flight moves");
    assert_eq!(flown(host(Workers::Own(2)), 40), alone, "threads of our own");
    let spawned = HostThreads::Spawned {
        tasks: 3,
        enqueue: Box::new(|task| {
            rayon::spawn(move || task.run());
            0
        }),
        finish: Box::new(|_| {}),
    };
    assert_eq!(flown(host(Workers::Host(spawned)), 40), alone, "tasks in a pool of the host");
    let late =
        HostThreads::Spawned { tasks: 2, enqueue: Box::new(|_| 0), finish: Box::new(|_| {}) };
    assert_eq!(flown(host(Workers::Host(late)), 40), alone, "tasks that are never run");
}

/// What a thread of a host does while it has nothing else to do.
fn lend(crew: Arc<overfly::jobs::Workers>, stops: &AtomicBool, helped: &AtomicU64) {
    while !stops.load(Ordering::Relaxed) {
        helped.fetch_add(u64::from(crew.join_as_worker()), Ordering::Relaxed);
        std::thread::yield_now();
    }
}

#[test]
fn threads_of_the_host_work_when_they_have_time_and_leave_when_they_like() {
    let alone = flown(host(Workers::Caller), 40);
    let scene = config::load("small").unwrap();
    let lent = Workers::Host(HostThreads::Lent { most: 2 });
    let mut overfly = Overfly::new(&scene, host(lent)).unwrap();
    let (stops, helped) = (AtomicBool::new(false), AtomicU64::new(0));
    let digests = std::thread::scope(|scope| {
        for _ in 0..3 {
            let crew = overfly.crew();
            let (stops, helped) = (&stops, &helped);
            scope.spawn(move || lend(crew, stops, helped));
        }
        // Frames go on until somebody has helped, so that the test cannot pass without it.
        let mut digests = fly(&mut overfly, 40, |_, _| {});
        while helped.load(Ordering::Relaxed) == 0 {
            fly(&mut overfly, 1, |_, _| {});
        }
        stops.store(true, Ordering::Relaxed);
        digests.truncate(40);
        digests
    });
    assert_eq!(digests, alone);
}

#[test]
fn a_frame_inside_a_pool_of_the_host_and_many_instances_do_not_disturb_each_other() {
    let alone = flown(host(Workers::Caller), 20);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let runs = pool.install(|| {
        use rayon::prelude::*;
        (0..6_usize)
            .into_par_iter()
            .map(|i| flown(host(Workers::Own(i % 3)), 20))
            .collect::<Vec<_>>()
    });
    assert!(runs.iter().all(|digests| *digests == alone));
}

#[test]
fn a_scene_that_goes_away_leaves_the_hosts_threads_alone() {
    let scene = config::load("small").unwrap();
    let tasks = Arc::new(parking_lot::Mutex::new(Vec::new()));
    for _ in 0..3 {
        let kept = tasks.clone();
        let spawned = HostThreads::Spawned {
            tasks: 2,
            enqueue: Box::new(move |task| {
                kept.lock().push(task);
                0
            }),
            finish: Box::new(|_| {}),
        };
        let mut overfly = Overfly::new(&scene, host(Workers::Host(spawned))).unwrap();
        fly(&mut overfly, 2, |_, _| {});
        let crew = overfly.crew();
        drop(overfly);
        assert!(!crew.join_as_worker(), "no frame is open any more");
    }
    let late: Vec<_> = tasks.lock().drain(..).collect();
    assert!(!late.is_empty(), "frames gave tasks out");
    late.into_iter().for_each(overfly::jobs::Task::run);
}

/// Sun, sea and seed change on the way.
fn edits(scene: &SceneSettings, index: usize) -> Option<SceneSettings> {
    let other = |change: fn(&mut SceneSettings)| {
        let mut scene = scene.clone();
        change(&mut scene);
        Some(scene)
    };
    let evening = Some(SunSettings::Clock { start_unix_s: 1.7e9, runs: true });
    match index {
        5 => Some(SceneSettings { sun: evening, ..scene.clone() }),
        10 => Some(SceneSettings { sea: !scene.sea, ..scene.clone() }),
        20 => other(|scene| match &mut scene.sources[0] {
            SourceSettings::Procedural { seed, .. } => *seed += 1,
            SourceSettings::Archive { .. } => panic!("`small` has no archive"),
        }),
        30 => Some(scene.clone()),
        _ => None,
    }
}

#[test]
fn edits_of_the_scene_are_part_of_a_recording_and_replay() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edited.ovf");
    let scene = config::load("small").unwrap();
    let run = |path: Option<&std::path::Path>, workers| {
        let mut overfly = Overfly::new(&scene, host(workers)).unwrap();
        if let Some(path) = path {
            overfly.record(path, "edited", 60.0).unwrap();
        }
        let digests = fly(&mut overfly, 45, |index, input| {
            input.scene = edits(&scene, index).map(Box::new);
        });
        assert_eq!(overfly.scene(), &scene, "frame 30 goes back to it");
        assert_eq!(overfly.sources().sea(), scene.sea, "so do those who wait for pages");
        if path.is_some() {
            assert_eq!(overfly.finish_recording().unwrap(), 45);
        }
        digests
    };
    let digests = run(Some(&path), Workers::Caller);
    assert_eq!(run(None, Workers::Own(1)), digests);
    let unedited = flown(host(Workers::Caller), 45);
    let same: Vec<_> = (0..45).filter(|&i| unedited[i] == digests[i]).collect();
    assert_eq!(same, (0..10).collect::<Vec<_>>(), "the sun changes no bit; what follows does");
    let frames = Recording::open(&path).unwrap().frames;
    let changed: Vec<_> = (0..45).filter(|&i| frames[i].scene.is_some()).collect();
    assert_eq!(changed, [5, 10, 20, 30]);
    assert!(frames.iter().map(|frame: &RecordedFrame| frame.digest).eq(digests));

    let played = program(&["replay", path.to_str().unwrap(), "--no-render", "--workers", "1"]);
    assert!(played.code == 0, "{}", played.err);
    let again = folder.path().join("again.ovf");
    let again_text = again.to_str().unwrap();
    let name = path.to_str().unwrap();
    let played = program(&["replay", name, "--no-render", "--record", again_text]);
    assert!(played.code == 0, "{}", played.err);
    assert_eq!(Recording::open(&again).unwrap().frames, frames);
    let late = program(&["replay", name, "--no-render", "--frames", "25..28"]);
    assert_eq!(late.code, 0, "{}", late.err);
    let measured = program(&["measure", name]);
    assert_eq!(measured.code, 2);
    assert!(measured.err.contains("the ground becomes another in frame 10"), "{}", measured.err);
}

#[test]
fn an_edit_that_cannot_be_is_refused_and_changes_nothing() {
    let scene = config::load("small").unwrap();
    let mut overfly = Overfly::new(&scene, host(Workers::Caller)).unwrap();
    fly(&mut overfly, 3, |_, _| {});
    let mut input = FrameInput::default();
    let mut refused = |scene: SceneSettings| {
        input.scene = Some(Box::new(scene));
        overfly.frame(&mut input, &mut FrameOutput::default()).unwrap_err().to_string()
    };
    let lod = overfly::core::settings::LodSettings { splits_max: 7, ..scene.lod };
    assert!(refused(SceneSettings { lod, ..scene.clone() }).contains("lod cannot change"));
    let sources = vec![SourceSettings::Archive { location: "nowhere.pmtiles".into() }];
    assert!(refused(SceneSettings { sources, ..scene.clone() }).contains("nowhere.pmtiles"));
    let mut input = FrameInput { time_s: f64::NAN, ..FrameInput::default() };
    input.scene = edits(&scene, 10).map(Box::new);
    let refused = overfly.frame(&mut input, &mut FrameOutput::default()).unwrap_err().to_string();
    assert!(refused.contains("time is NaN s"), "{refused}");
    assert_eq!(overfly.scene(), &scene);
    let late = overfly.record("late.ovf".as_ref(), "late", 60.0).unwrap_err().to_string();
    assert!(late.contains("3 frames were run"), "{late}");
    assert!(overfly.finish_recording().unwrap_err().to_string().contains("no recording"));
}

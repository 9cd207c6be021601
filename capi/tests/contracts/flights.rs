//! A flight through the C border is the flight of the façade, bit for bit.
//!
//! In:    the flight of `examples/c/flight.c`, edits of its scene.
//! Out:   test results.
//! Keeps: recordings in a folder that is thrown away.
//! Not here: who helps with a frame (`hosts`).

use super::calls::*;
use overfly::config;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::{SceneSettings, SunSettings};
use overfly::replay::Recording;
use overfly_c::columns::{ovf_terrain_eye, ovf_terrain_scene_text};
use overfly_c::frame::*;
use overfly_c::recording::*;
use overfly_c::scene::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ffi::{CStr, CString};
use std::ptr::null_mut;

#[test]
fn frames_are_those_of_the_facade() {
    let terrain = open_small(Some(&waiting()));
    assert_eq!(flown(terrain, 60), numbers_in_rust(60));
    let mut again = sized::<ovf_frame>();
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_terrain_last_frame(terrain, &raw mut again) });
    assert_eq!((again.frame, again.digest_parts), (59, flown_in_rust(60)[59].parts()));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn an_eye_in_ecef_with_a_quaternion_sees_the_same_as_one_in_angles() {
    let scene = config::load("small").unwrap();
    let terrain = open_small(Some(&waiting()));
    let mut digests = Vec::new();
    for frame in 0..20 {
        let view = look_in_rust(frame, &scene);
        let view = ovf_view {
            eye: OVF_EYE_ECEF,
            attitude: OVF_ATTITUDE_QUATERNION,
            eye_ecef_m: view.eye.0.to_array(),
            camera_to_ecef_xyzw: view.orientation.to_array(),
            // What is not named is not read.
            eye_lat_rad: f64::NAN,
            yaw_rad: f64::NAN,
            ..look(frame)
        };
        let time_s = frame as f64 / 60.0;
        let input = ovf_frame_input { view_count: 1, views: &raw const view, time_s, ..sized() };
        let mut out = sized::<ovf_frame>();
        // SAFETY: all pointers are of values that outlive the call.
        must(unsafe { ovf_terrain_frame(terrain, &raw const input, &raw mut out) });
        digests.push(out.digest);
    }
    assert_eq!(digests, numbers_in_rust(20));
    must(ovf_terrain_destroy(terrain));
}

/// The text of a terrain's scene.
fn scene_text(terrain: ovf_terrain) -> CString {
    let mut count = 0;
    // SAFETY: a null buffer asks for the count, which is written to a value that outlives the call.
    must(unsafe { ovf_terrain_scene_text(terrain, null_mut(), 0, &raw mut count) });
    let mut text = vec![1; usize::try_from(count).unwrap()];
    // SAFETY: the buffer is as long as it says.
    must(unsafe { ovf_terrain_scene_text(terrain, text.as_mut_ptr(), count, &raw mut count) });
    // SAFETY: it was filled with a text and the NUL at its end.
    unsafe { CStr::from_ptr(text.as_ptr()) }.to_owned()
}

/// Edits of the flight by frame, in C's way and in the façade's.
fn edits(scene: &SceneSettings, other: &ovf_scene) -> Vec<(usize, ovf_edit, SceneSettings)> {
    let mut wet = scene.clone();
    let sun =
        ovf_edit { changes: OVF_EDIT_SUN, sun: OVF_SUN_CLOCK, sun_start_unix_s: 1.7e9, ..sized() };
    wet.sun = Some(SunSettings::Clock { start_unix_s: 1.7e9, runs: true });
    let first = wet.clone();
    wet.sea = false;
    let sea = ovf_edit { changes: OVF_EDIT_SEA, ..sized() };
    let whole = ovf_edit { changes: OVF_EDIT_SCENE, scene: other, ..sized() };
    vec![(4, sun, first), (8, sea, wet), (16, whole, scene.clone())]
}

#[test]
fn edits_of_the_scene_do_what_the_facades_do_and_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edited.ovf");
    let terrain = open_small(Some(&waiting()));
    let c_path = CString::new(path.to_str().unwrap()).unwrap();
    // SAFETY: both texts outlive the call.
    must(unsafe { ovf_terrain_record(terrain, c_path.as_ptr(), c"edited".as_ptr(), 60.0) });
    let text = scene_text(terrain);
    let other = ovf_scene { text: text.as_ptr(), ..sized() };
    let edits = edits(&config::load("small").unwrap(), &other);

    let (mut overfly, mut out) = (opened_in_rust(), FrameOutput::default());
    for frame in 0..24 {
        let edit = edits.iter().find(|edit| edit.0 == frame);
        let found = fly(terrain, frame, edit.map(|edit| &edit.1));
        let mut input = FrameInput {
            time_s: frame as f64 / 60.0,
            views: vec![look_in_rust(frame, overfly.scene())],
            scene: edit.map(|edit| Box::new(edit.2.clone())),
            ..FrameInput::default()
        };
        overfly.frame(&mut input, &mut out).unwrap();
        assert_eq!(found.digest, out.digest.all(), "frame {frame}");
        let mut eye = sized();
        // SAFETY: the pointer is of a value that outlives the call.
        must(unsafe { ovf_terrain_eye(terrain, 0, &raw mut eye) });
        let view = out.views[0].camera;
        assert_eq!((eye.eye_ecef_m, eye.has_sun), (view.eye.0.to_array(), 1));
    }
    let mut frames = 0;
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_terrain_finish_recording(terrain, &raw mut frames) });
    assert_eq!(frames, 24);
    // SAFETY: as above.
    let twice = unsafe { ovf_terrain_finish_recording(terrain, &raw mut frames) };
    assert_eq!((twice, last_error().as_str()), (OVF_RECORDING, "no recording is open"));
    must(ovf_terrain_destroy(terrain));
    let recorded = Recording::open(&path).unwrap().frames;
    let changed: Vec<_> = (0..24).filter(|&i| recorded[i].scene.is_some()).collect();
    assert_eq!(changed, [4, 8, 16]);
    assert_eq!(recorded[23].digest, out.digest);
}

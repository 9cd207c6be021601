//! Calling the C border from Rust, as C would, and the façade beside it.
//!
//! In:    what a test wants to fly.
//! Out:   structs filled in, statuses, sentences, digests.
//! Keeps: nothing.
//! Not here: what is tested.

use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::digest::FrameDigest;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, config};
use overfly_c::columns::*;
use overfly_c::drawing::*;
use overfly_c::frame::*;
use overfly_c::ground::*;
use overfly_c::host::*;
use overfly_c::overlay::*;
use overfly_c::queries::*;
use overfly_c::rays::*;
use overfly_c::regions::*;
use overfly_c::renderer::*;
use overfly_c::scene::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ffi::{CStr, CString};
use std::ptr::null;

/// Structs of the border and their sizes here.
pub const SIZES: [(&str, usize); 34] = [
    ("ovf_scene", size_of::<ovf_scene>()),
    ("ovf_edit", size_of::<ovf_edit>()),
    ("ovf_host", size_of::<ovf_host>()),
    ("ovf_terrain", size_of::<ovf_terrain>()),
    ("ovf_view", size_of::<ovf_view>()),
    ("ovf_frame_input", size_of::<ovf_frame_input>()),
    ("ovf_frame", size_of::<ovf_frame>()),
    ("ovf_limits", size_of::<ovf_limits>()),
    ("ovf_vertex", size_of::<ovf_vertex>()),
    ("ovf_morph", size_of::<ovf_morph>()),
    ("ovf_range", size_of::<ovf_range>()),
    ("ovf_patch_columns", size_of::<ovf_patch_columns>()),
    ("ovf_eye", size_of::<ovf_eye>()),
    ("ovf_renderer", size_of::<ovf_renderer>()),
    ("ovf_device", size_of::<ovf_device>()),
    ("ovf_target", size_of::<ovf_target>()),
    ("ovf_renderer_settings", size_of::<ovf_renderer_settings>()),
    ("ovf_device_memory", size_of::<ovf_device_memory>()),
    ("ovf_overlay", size_of::<ovf_overlay>()),
    ("ovf_overlay_shape", size_of::<ovf_overlay_shape>()),
    ("ovf_overlay_segment", size_of::<ovf_overlay_segment>()),
    ("ovf_host_frame", size_of::<ovf_host_frame>()),
    ("ovf_picture", size_of::<ovf_picture>()),
    ("ovf_draw_report", size_of::<ovf_draw_report>()),
    ("ovf_ground", size_of::<ovf_ground>()),
    ("ovf_query", size_of::<ovf_query>()),
    ("ovf_places", size_of::<ovf_places>()),
    ("ovf_height", size_of::<ovf_height>()),
    ("ovf_height_columns", size_of::<ovf_height_columns>()),
    ("ovf_contact", size_of::<ovf_contact>()),
    ("ovf_hit", size_of::<ovf_hit>()),
    ("ovf_sight", size_of::<ovf_sight>()),
    ("ovf_region", size_of::<ovf_region>()),
    ("ovf_readiness", size_of::<ovf_readiness>()),
];

/// A struct of the border with nothing but its size.
pub fn sized<T: bytemuck::Zeroable>() -> T {
    let mut value = T::zeroed();
    let size = u32::try_from(size_of::<T>()).unwrap();
    // SAFETY: every struct that this is used for is `repr(C)` and begins with its size, a `u32`.
    unsafe { (&raw mut value).cast::<u32>().write(size) };
    value
}

/// What `ovf_last_error` says.
pub fn last_error() -> String {
    // SAFETY: it is never null, ends with a NUL, and this thread calls nothing meanwhile.
    unsafe { CStr::from_ptr(ovf_last_error()) }.to_str().unwrap().to_owned()
}

/// Asserts that a call succeeded.
#[track_caller]
pub fn must(status: ovf_status) {
    assert_eq!(status, OVF_OK, "{}", last_error());
}

/// Opens the scene of a text.
pub fn open_text(text: &str, host: Option<&ovf_host>) -> Result<ovf_terrain, ovf_status> {
    let text = CString::new(text).unwrap();
    open(&ovf_scene { text: text.as_ptr(), ..sized() }, host)
}

/// Opens `small`.
pub fn open_small(host: Option<&ovf_host>) -> ovf_terrain {
    let scene = ovf_scene { preset: c"small".as_ptr(), ..sized() };
    open(&scene, host).unwrap_or_else(|_| panic!("{}", last_error()))
}

/// Opens a scene.
pub fn open(scene: &ovf_scene, host: Option<&ovf_host>) -> Result<ovf_terrain, ovf_status> {
    let mut terrain = ovf_terrain { bits: 0 };
    let host = host.map_or(null(), std::ptr::from_ref);
    // SAFETY: all pointers are of values that outlive the call.
    match unsafe { ovf_terrain_new_v1(scene, host, &raw mut terrain) } {
        OVF_OK => Ok(terrain),
        status => Err(status),
    }
}

/// A host whose frames wait for pages: the same on every machine.
pub fn waiting() -> ovf_host {
    ovf_host { pages: OVF_PAGES_WAITED, ..sized() }
}

/// What `examples/c/flight.c` looks at in a frame.
pub fn look(frame: usize) -> ovf_view {
    let frame = frame as f64;
    ovf_view {
        eye: OVF_EYE_GEODETIC,
        attitude: OVF_ATTITUDE_ANGLES,
        width_px: 640,
        height_px: 360,
        eye_lat_rad: 0.25,
        eye_lon_rad: 0.3 + 0.001 * frame,
        eye_height_m: 600.0 - frame,
        yaw_rad: 1.5,
        pitch_rad: -0.4,
        field_of_view_rad: 1.0,
        near_m: 0.5,
        ..sized()
    }
}

/// Flies one frame of that flight, with an edit or without.
pub fn fly(terrain: ovf_terrain, frame: usize, edit: Option<&ovf_edit>) -> ovf_frame {
    let view = look(frame);
    let input = ovf_frame_input {
        view_count: 1,
        views: &raw const view,
        time_s: frame as f64 / 60.0,
        edit: edit.map_or(null(), std::ptr::from_ref),
        ..sized()
    };
    let mut out = sized::<ovf_frame>();
    // SAFETY: all pointers are of values that outlive the call.
    must(unsafe { ovf_terrain_frame(terrain, &raw const input, &raw mut out) });
    out
}

/// Flies many; the digests.
pub fn flown(terrain: ovf_terrain, frames: usize) -> Vec<u64> {
    (0..frames).map(|frame| fly(terrain, frame, None).digest).collect()
}

/// The same view, as the façade takes it.
pub fn look_in_rust(frame: usize, scene: &SceneSettings) -> View {
    let frame = frame as f64;
    let (lat_rad, lon_rad, height_m) = (0.25, 0.3 + 0.001 * frame, 600.0 - frame);
    let at = Geodetic { lat_rad, lon_rad, height_m };
    View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, Radians(1.5), Radians(-0.4), Radians(0.0)),
        field_of_view: Radians(1.0),
        size_px: [640, 360],
        near_m: 0.5,
    }
}

/// `small` in the façade.
pub fn opened_in_rust() -> Overfly {
    let host = Host { pages: Pages::Waited { threads: 1 }, ..Host::default() };
    Overfly::new(&config::load("small").unwrap(), host).unwrap()
}

/// Flies one frame of the flight with the façade.
pub fn fly_in_rust(overfly: &mut Overfly, frame: usize, out: &mut FrameOutput) {
    let view = look_in_rust(frame, overfly.scene());
    let time_s = frame as f64 / 60.0;
    let mut input = FrameInput { time_s, views: vec![view], ..FrameInput::default() };
    overfly.frame(&mut input, out).unwrap();
}

/// The digests of the flight, by the façade.
pub fn flown_in_rust(frames: usize) -> Vec<FrameDigest> {
    let (mut overfly, mut out) = (opened_in_rust(), FrameOutput::default());
    let mut digest = |frame| {
        fly_in_rust(&mut overfly, frame, &mut out);
        out.digest
    };
    (0..frames).map(&mut digest).collect()
}

/// The same as numbers.
pub fn numbers_in_rust(frames: usize) -> Vec<u64> {
    flown_in_rust(frames).iter().map(FrameDigest::all).collect()
}

/// A snapshot of a terrain's ground.
pub fn ground_of(terrain: ovf_terrain) -> ovf_ground {
    let mut ground = ovf_ground { bits: 0 };
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_terrain_ground(terrain, &raw mut ground) });
    ground
}

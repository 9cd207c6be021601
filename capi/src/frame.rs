//! Frames: what C says goes into one, and the numbers that it ends in.
//!
//! In:    time, views, edits of the scene.
//! Out:   [`ovf_frame`]: counts, bound, digest.
//! Keeps: nothing.
//! Not here: columns (`columns`), drawing.

use crate::border::{Caller, answer};
use crate::scene::{edited, flag, ovf_edit};
use crate::status::{Fault, ovf_status};
use crate::terrain::{State, ovf_terrain, with, with_made};
use bytemuck::Zeroable;
use glam::{DQuat, DVec3};
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::FrameOutput;
use overfly::core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly::core::units::Radians;
use std::f64::consts::FRAC_PI_2;

/// `ovf_view.eye`: where the eye is, is in `eye_ecef_m`.
pub const OVF_EYE_ECEF: u32 = 0;
/// `ovf_view.eye`: it is in `eye_lat_rad`, `eye_lon_rad` and `eye_height_m`.
pub const OVF_EYE_GEODETIC: u32 = 1;

/// `ovf_view.attitude`: where it looks is in `camera_to_ecef_xyzw`.
pub const OVF_ATTITUDE_QUATERNION: u32 = 0;
/// `ovf_view.attitude`: it is in `yaw_rad`, `pitch_rad` and `roll_rad`.
pub const OVF_ATTITUDE_ANGLES: u32 = 1;

/// Most views of one frame.
const VIEWS_MAX: u32 = 64;

/// One view of a frame. What the eye's and the attitude's kind do not name is not read.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_view {
    /// `sizeof(ovf_view)`.
    pub struct_size: u32,
    /// `OVF_EYE_…`.
    pub eye: u32,
    /// `OVF_ATTITUDE_…`.
    pub attitude: u32,
    /// Width of the picture in pixels, at least 1.
    pub width_px: u32,
    /// Height of the picture in pixels, at least 1.
    pub height_px: u32,
    /// 0.
    pub reserved: u32,
    /// Body-fixed coordinates of the eye.
    pub eye_ecef_m: [f64; 3],
    /// Turns camera axes (x right, y up, z backward) into body-fixed ones; of any length but 0.
    pub camera_to_ecef_xyzw: [f64; 4],
    /// Geodetic latitude, within ±π/2.
    pub eye_lat_rad: f64,
    /// Longitude, east positive.
    pub eye_lon_rad: f64,
    /// Height above the ellipsoid, not above sea level.
    pub eye_height_m: f64,
    /// Heading of the camera, clockwise from north.
    pub yaw_rad: f64,
    /// Up from the horizon.
    pub pitch_rad: f64,
    /// Right wing down.
    pub roll_rad: f64,
    /// Vertical field of view, 1e-6 to π, π excluded.
    pub field_of_view_rad: f64,
    /// Nothing nearer is drawn; at least 1e-6.
    pub near_m: f64,
}

/// What goes into a frame.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_frame_input {
    /// `sizeof(ovf_frame_input)`.
    pub struct_size: u32,
    /// How many views there are, 0 to 64.
    pub view_count: u32,
    /// The views, the most important first. All say the same `struct_size`.
    pub views: *const ovf_view,
    /// Time of the flight.
    pub time_s: f64,
    /// 1: the mesh stays as it is, and only what is drawn follows the views.
    pub hold_lod: u32,
    /// 0.
    pub reserved: u32,
    /// What becomes another with this frame; null for nothing.
    pub edit: *const ovf_edit,
}

/// What a frame ended in. Counts repeat exactly; the digest is that of overfly's other borders.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_frame {
    /// `sizeof(ovf_frame)`, set by the host.
    pub struct_size: u32,
    /// What morphing vertices count from, in milliseconds modulo 2^32.
    pub time_ms: u32,
    /// Frames run before this one, since the terrain began (anew).
    pub frame: u64,
    /// One number for the whole state.
    pub digest: u64,
    /// The state's parts: pages, mesh, vertices, draws.
    pub digest_parts: [u64; 4],
    /// Bound on the error on the screen, in pixels.
    pub error_px_bound: f64,
    /// Leaf triangles of the mesh.
    pub leaves: u32,
    /// Triangles of all patches.
    pub triangles: u32,
    /// Splits done.
    pub splits: u32,
    /// Merges done.
    pub merges: u32,
    /// Splits that waited for a page.
    pub blocked: u32,
    /// Resident pages.
    pub pages: u32,
    /// Pages that came in.
    pub admitted: u32,
    /// Pages that went.
    pub evicted: u32,
    /// Pages that came and were not taken.
    pub refused: u32,
    /// Pages that are wanted: what `ovf_terrain_wanted` lists.
    pub wanted: u32,
    /// Patches whose vertices are new: what `ovf_terrain_built` lists.
    pub built: u32,
    /// Patches drawn, summed over views and depth ranges.
    pub drawn: u32,
}

/// Runs a frame. `frame` may be null. What is refused leaves the terrain as it was, but
/// `OVF_RECORDING`: the frame was run and is not in the recording.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_frame(
    terrain: ovf_terrain,
    input: *const ovf_frame_input,
    frame: *mut ovf_frame,
) -> ovf_status {
    answer!(|caller: &Caller| {
        if !frame.is_null() {
            caller.check_out("frame", frame)?;
        }
        let input = caller.sized("input", input)?;
        let value = with_made(terrain, |state| {
            take_in(caller, &input, state)?;
            let outcome = state.overfly.frame(&mut state.input, &mut state.output);
            state.input.scene = None;
            state.note_news();
            outcome?;
            state.time_s = input.time_s;
            Ok(numbers(&state.output))
        })?;
        if frame.is_null() { Ok(()) } else { caller.put("frame", frame, value) }
    })
}

/// The numbers of the last frame again; all 0 before the first.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_last_frame(
    terrain: ovf_terrain,
    frame: *mut ovf_frame,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("frame", frame)?;
        let value = with(terrain, |state| Ok(numbers(&state.output)))?;
        caller.put("frame", frame, value)
    })
}

/// Fills the frame's input.
fn take_in(caller: &Caller, input: &ovf_frame_input, state: &mut State) -> Result<(), Fault> {
    let hold_lod = flag("input: hold_lod", input.hold_lod)?;
    if input.view_count > VIEWS_MAX {
        let sentence =
            format!("input: view_count is {}, allowed is 0 to {VIEWS_MAX}", input.view_count);
        return Err(Fault::invalid(sentence));
    }
    if !input.time_s.is_finite() {
        let sentence = format!("input: time_s is {}, allowed is any finite number", input.time_s);
        return Err(Fault::invalid(sentence));
    }
    let scene = edited(caller, input.edit, state.overfly.scene())?;
    let body = scene.as_ref().unwrap_or(state.overfly.scene()).body;
    state.input.views.clear();
    for index in 0..input.view_count as usize {
        let view = caller.sized_at("views", input.views, index)?;
        state.input.views.push(view_of(&view, &body)?);
    }
    state.input.scene = scene.map(Box::new);
    (state.input.time_s, state.input.hold_lod) = (input.time_s, hold_lod);
    Ok(())
}

fn view_of(view: &ovf_view, body: &Ellipsoid) -> Result<View, Fault> {
    let (eye, at) = match view.eye {
        OVF_EYE_ECEF => {
            let eye = Ecef(DVec3::from_array(view.eye_ecef_m));
            (eye, body.geodetic_from_ecef(eye))
        }
        OVF_EYE_GEODETIC => {
            let (lat_rad, lon_rad) = (view.eye_lat_rad, view.eye_lon_rad);
            let at = geodetic("view: eye", [lat_rad, lon_rad, view.eye_height_m])?;
            (body.ecef_from_geodetic(at), at)
        }
        eye => return Err(Fault::invalid(format!("view: eye is {eye}, allowed is 0 or 1"))),
    };
    let orientation = match view.attitude {
        OVF_ATTITUDE_QUATERNION => DQuat::from_array(view.camera_to_ecef_xyzw),
        OVF_ATTITUDE_ANGLES => {
            let [yaw, pitch, roll] = [view.yaw_rad, view.pitch_rad, view.roll_rad].map(Radians);
            orientation_from_attitude(at, yaw, pitch, roll)
        }
        attitude => {
            let sentence = format!("view: attitude is {attitude}, allowed is 0 or 1");
            return Err(Fault::invalid(sentence));
        }
    };
    let size_px = [view.width_px, view.height_px];
    let field_of_view = Radians(view.field_of_view_rad);
    Ok(View { eye, orientation, field_of_view, size_px, near_m: view.near_m })
}

/// A position of latitude and longitude in radians and height in metres.
pub fn geodetic(name: &str, [lat_rad, lon_rad, height_m]: [f64; 3]) -> Result<Geodetic, Fault> {
    let fault = |what: &str, found: f64, allowed: &str| {
        Fault::invalid(format!("{name}: {what} is {found}, allowed is {allowed}"))
    };
    if lat_rad.is_nan() || lat_rad.abs() > FRAC_PI_2 {
        return Err(fault("latitude", lat_rad, "-π/2 to π/2"));
    }
    for (what, found) in [("longitude", lon_rad), ("height", height_m)] {
        if !found.is_finite() {
            return Err(fault(what, found, "any finite number"));
        }
    }
    Ok(Geodetic { lat_rad, lon_rad, height_m })
}

fn numbers(output: &FrameOutput) -> ovf_frame {
    let counts = &output.counts;
    ovf_frame {
        struct_size: 0,
        time_ms: output.time_ms,
        frame: output.frame,
        digest: output.digest.all(),
        digest_parts: output.digest.parts(),
        error_px_bound: counts.error_px_bound,
        leaves: counts.leaves,
        triangles: counts.triangles,
        splits: counts.splits,
        merges: counts.merges,
        blocked: counts.blocked,
        pages: counts.pages,
        admitted: counts.admitted,
        evicted: counts.evicted,
        refused: counts.refused,
        wanted: counts.wanted,
        built: counts.built,
        drawn: counts.drawn,
    }
}

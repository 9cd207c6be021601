//! Recordings of what a host flies.
//!
//! In:    a path, a name, a rate.
//! Out:   an `.ovf` file that `overfly replay` plays to the same digests.
//! Keeps: nothing; the open file is the terrain's.
//! Not here: the file's format (`overfly_replay`).

use crate::border::{Caller, answer};
use crate::status::{Fault, ovf_status};
use crate::terrain::{ovf_terrain, with};
use std::ffi::c_char;
use std::path::Path;

/// Records every frame from now on, edits included. To be asked for before the first frame; `name`
/// and `rate_hz` are what a replay shows.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_record(
    terrain: ovf_terrain,
    path: *const c_char,
    name: *const c_char,
    rate_hz: f64,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let (path, name) = (caller.text("path", path)?, caller.text("name", name)?);
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            let sentence = format!("rate_hz is {rate_hz}, allowed is above 0, and finite");
            return Err(Fault::invalid(sentence));
        }
        with(terrain, |state| Ok(state.overfly.record(Path::new(path), name, rate_hz)?))
    })
}

/// Completes the recording; `*frames` is how many it has. Without this it reads to its last frame.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_finish_recording(
    terrain: ovf_terrain,
    frames: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("frames", frames)?;
        let count = with(terrain, |state| Ok(state.overfly.finish_recording()?))?;
        caller.put_plain("frames", frames, count)
    })
}

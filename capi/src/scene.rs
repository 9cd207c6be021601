//! Scenes and their edits, as C gives them.
//!
//! In:    the name of a preset, a path, or a text; what shall be another.
//! Out:   settings for the façade.
//! Keeps: nothing.
//! Not here: what may change while a terrain runs (`overfly`), the text's format (`config`).

use crate::border::Caller;
use crate::status::{Fault, OVF_SCENE};
use bytemuck::Zeroable;
use glam::DVec3;
use overfly::config::{self, PRESETS};
use overfly::core::settings::{SceneSettings, SunSettings};
use std::ffi::c_char;

/// Where a scene comes from: exactly one of the three is not null.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_scene {
    /// `sizeof(ovf_scene)`.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Name of a scene that comes with overfly: "earth", "moon" or "small".
    pub preset: *const c_char,
    /// Path of a scene file. Relative paths in it lead on from its folder.
    pub path: *const c_char,
    /// Text of a scene file. Relative paths in it lead on from the current directory.
    pub text: *const c_char,
}

/// `ovf_edit.changes`: all of the scene is another. It may differ in sources, sea, sun and views.
pub const OVF_EDIT_SCENE: u32 = 1;
/// `ovf_edit.changes`: the sun is another, or there is none any more.
pub const OVF_EDIT_SUN: u32 = 2;
/// `ovf_edit.changes`: water comes or goes. The terrain begins anew.
pub const OVF_EDIT_SEA: u32 = 4;

/// `ovf_edit.sun`: there is none; the ground is lit evenly.
pub const OVF_SUN_NONE: u32 = 0;
/// `ovf_edit.sun`: it stands in `sun_direction_ecef`.
pub const OVF_SUN_FIXED: u32 = 1;
/// `ovf_edit.sun`: it stands where it does at `sun_start_unix_s`.
pub const OVF_SUN_CLOCK_STOPPED: u32 = 2;
/// `ovf_edit.sun`: as that, and goes on with the time of the frames.
pub const OVF_SUN_CLOCK: u32 = 3;

/// What becomes another with a frame. Edits are part of what is recorded.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_edit {
    /// `sizeof(ovf_edit)`.
    pub struct_size: u32,
    /// Sum of `OVF_EDIT_…`; what is not named stays as it is.
    pub changes: u32,
    /// The scene; read with `OVF_EDIT_SCENE` only. Sun and sea are changed after that.
    pub scene: *const ovf_scene,
    /// `OVF_SUN_…`; read with `OVF_EDIT_SUN` only, as what follows.
    pub sun: u32,
    /// 1: water covers the ground below sea level; 0: it does not. Read with `OVF_EDIT_SEA` only.
    pub sea: u32,
    /// Body-fixed direction towards the sun, of any length but 0.
    pub sun_direction_ecef: [f64; 3],
    /// UTC at the frames' time 0, in seconds since 1970 without leap seconds.
    pub sun_start_unix_s: f64,
    /// 0.
    pub reserved: u64,
}

/// The settings of a scene.
pub fn settings(caller: &Caller, scene: *const ovf_scene) -> Result<SceneSettings, Fault> {
    let scene = caller.sized("scene", scene)?;
    let preset = caller.text_if("preset", scene.preset)?;
    let path = caller.text_if("path", scene.path)?;
    let text = caller.text_if("text", scene.text)?;
    match (preset, path, text) {
        (Some(name), None, None) if PRESETS.contains(&name) => load(name),
        (Some(name), None, None) => Err(Fault::new(
            OVF_SCENE,
            format!("`{name}` is no preset, allowed are {}", PRESETS.join(", ")),
        )),
        // A file of a preset's name would be taken for that.
        (None, Some(path), None) if PRESETS.contains(&path) => load(&format!("./{path}")),
        (None, Some(path), None) => load(path),
        (None, None, Some(text)) => {
            config::read(text, "text").map_err(|faults| Fault::of(OVF_SCENE, &faults))
        }
        _ => {
            let given = [preset, path, text].iter().flatten().count();
            let sentence = format!("{given} of preset, path and text are given, allowed is one");
            Err(Fault::invalid(sentence))
        }
    }
}

fn load(name: &str) -> Result<SceneSettings, Fault> {
    config::load(name).map_err(|error| Fault::of(OVF_SCENE, &error))
}

/// The scene that an edit makes of the one there is; `None` where C gave no edit.
pub fn edited(
    caller: &Caller,
    edit: *const ovf_edit,
    now: &SceneSettings,
) -> Result<Option<SceneSettings>, Fault> {
    if edit.is_null() {
        return Ok(None);
    }
    let edit = caller.sized("edit", edit)?;
    let known = OVF_EDIT_SCENE | OVF_EDIT_SUN | OVF_EDIT_SEA;
    if edit.changes & !known != 0 {
        let sentence = format!("edit: changes is {:#x}, allowed is 0 to {known:#x}", edit.changes);
        return Err(Fault::invalid(sentence));
    }
    let has = |change: u32| edit.changes & change != 0;
    let mut scene = if has(OVF_EDIT_SCENE) { settings(caller, edit.scene)? } else { now.clone() };
    if has(OVF_EDIT_SUN) {
        scene.sun = sun(&edit)?;
    }
    if has(OVF_EDIT_SEA) {
        scene.sea = flag("edit: sea", edit.sea)?;
    }
    Ok(Some(scene))
}

fn sun(edit: &ovf_edit) -> Result<Option<SunSettings>, Fault> {
    let clock = |runs| {
        let start_unix_s = edit.sun_start_unix_s;
        if !start_unix_s.is_finite() {
            let sentence =
                format!("edit: sun_start_unix_s is {start_unix_s}, allowed is any finite number");
            return Err(Fault::invalid(sentence));
        }
        Ok(Some(SunSettings::Clock { start_unix_s, runs }))
    };
    match edit.sun {
        OVF_SUN_NONE => Ok(None),
        OVF_SUN_FIXED => {
            let found = DVec3::from_array(edit.sun_direction_ecef);
            let direction = found.try_normalize().ok_or_else(|| {
                let sentence =
                    format!("edit: sun_direction_ecef is {found}, allowed is any finite direction");
                Fault::invalid(sentence)
            })?;
            Ok(Some(SunSettings::Fixed { direction }))
        }
        OVF_SUN_CLOCK_STOPPED => clock(false),
        OVF_SUN_CLOCK => clock(true),
        sun => Err(Fault::invalid(format!("edit: sun is {sun}, allowed is 0 to {OVF_SUN_CLOCK}"))),
    }
}

/// A number that is yes or no.
pub fn flag(name: &str, value: u32) -> Result<bool, Fault> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Fault::invalid(format!("{name} is {value}, allowed is 0 or 1"))),
    }
}

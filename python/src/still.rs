//! `overfly.still`: one picture from one place, settled.
//!
//! In:    a view, a scene, what to show.
//! Out:   an array of pixels.
//! Keeps: nothing.
//! Not here: drawing (`overfly_render_vk`).

use crate::arrays::{array, checked};
use crate::player::{scene_of, threads};
use crate::raised::{OverflyError, failed, interrupted, refused, sentence};
use crate::view::View;
use numpy::PyArrayDyn;
use overfly::core::camera;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::mesh::drape::FADE_MS;
use overfly::core::settings::SceneSettings;
use overfly::render_vk::{Renderer, RendererSettings, Show};
use overfly::{Host, Overfly, Pages, Workers};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Most frames until the terrain has come up.
const FRAMES_MAX: usize = 4000;
/// Imagery that is new has faded in after this.
const FADE_S: f64 = FADE_MS as f64 / 1e3;

/// Draws a picture of a view once its terrain has come up: uint8, height x width x RGBA, top first.
///
/// With `agl` the view's height is above the ground instead of the ellipsoid. `show` is shaded,
/// wireframe, level, error, residency, normals or range; `time_s` is where the sun of a running
/// clock has come to. Needs a Vulkan device, Mesa's software one at least, and raises OverflyError
/// where there is none.
#[pyfunction]
#[pyo3(signature = (view, *, scene=PathBuf::from("earth"), agl=false, show="shaded", time_s=0.0),
       text_signature = "(view, *, scene='earth', agl=False, show='shaded', time_s=0.0)")]
#[expect(clippy::too_many_arguments, reason = "keywords of Python, with defaults")]
pub fn still(
    py: Python<'_>,
    view: PyRef<'_, View>,
    scene: PathBuf,
    agl: bool,
    show: &str,
    time_s: f64,
) -> PyResult<Py<PyArrayDyn<u8>>> {
    checked(("time_s", [0.0, 1e9]), time_s)?;
    let shown = Show::from_name(show).filter(|show| *show != Show::Culled).ok_or_else(|| {
        let names = Show::ALL.iter().filter(|show| **show != Show::Culled).map(|show| show.name());
        refused(format!("show is `{show}`, allowed are {}", names.collect::<Vec<_>>().join(", ")))
    })?;
    let scene = scene_of(&scene)?;
    let view: &View = &view;
    let pixels = py.detach(|| draw(&scene, (view, agl), (shown, time_s)))?;
    let (width, height) = view.size_px;
    array(py, pixels, &[height as usize, width as usize, 4])
}

fn draw(
    scene: &SceneSettings,
    (view, agl): (&View, bool),
    (show, time_s): (Show, f64),
) -> PyResult<Vec<u8>> {
    let host = Host {
        workers: Workers::Own(threads()),
        pages: Pages::Waited { threads: threads() },
        ..Host::default()
    };
    let mut overfly = Overfly::new(scene, host).map_err(|error| failed(&error))?;
    let limits = overfly.terrain().limits();
    let settings = RendererSettings::of(scene, limits, view.size_px.into());
    let renderer = Renderer::new(&settings);
    let no_device = |error| OverflyError::new_err(format!("no picture: {}", sentence(&error)));
    overfly.set_renderer(renderer.map_err(no_device)?);
    let view = placed(&overfly, view, agl)?;
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    for _ in 0..FRAMES_MAX {
        interrupted()?;
        (input.time_s, input.views) = (time_s, vec![view]);
        overfly.frame(&mut input, &mut output).map_err(|error| failed(&error))?;
        let c = &output.counts;
        if c.leaves > 0 && c.splits + c.merges + c.wanted == 0 {
            break;
        }
    }
    // All vertices at their own places.
    input.time_s = time_s + scene.lod.morph_s.max(FADE_S) + 0.01;
    input.hold_lod = true;
    overfly.looks_mut().show = show;
    overfly.frame_drawn(&mut input, &mut output, 0).map_err(|error| failed(&error))?;
    let pixels = overfly.with_renderer(Renderer::read_pixels).expect("it was set above");
    pixels.map_err(|error| failed(&error))
}

/// The view with an eye that is not below the ground.
fn placed(overfly: &Overfly, view: &View, agl: bool) -> PyResult<camera::View> {
    let (at, scene) = (view.at(), overfly.scene());
    let ground_m = overfly.ground_height_m(at).map_err(|error| failed(&error))?;
    let surface_m = if scene.sea { ground_m.max(0.0) } else { ground_m };
    let height_m = if agl { surface_m + at.height_m } else { at.height_m };
    if height_m <= surface_m {
        return Err(refused(format!(
            "height_m is {height_m:.1}, allowed is above the ground, which is {surface_m:.1} m \
             there; agl=True counts from the ground"
        )));
    }
    Ok(view.seen_from(Geodetic { height_m, ..at }, &scene.body))
}

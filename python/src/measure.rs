//! `overfly.measure`: how far what is drawn strays from the ground, over a flight.
//!
//! In:    a flight or recording, a scene, a range of frames.
//! Out:   the dict that `overfly measure --json` writes.
//! Keeps: nothing.
//! Not here: the metrics (`overfly_replay::measure`), the loop's frames (`player`).

use crate::arrays::checked;
use crate::player::{Player, Wish, threads};
use crate::raised::refused;
use overfly::core::datasource::{Page, PageKey};
use overfly::replay::measure::{FlightErrors, Measure, MeasureSettings, PagePart, Spread};
use overfly::sources::Sources;
use pyo3::prelude::*;
use serde_json::{Map, Value, json};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// So many frames are measured at most where `every` says nothing.
const FRAMES: usize = 600;

/// Measures a flight: in each measured frame rays meet the ground itself and the drawn mesh.
///
/// Returns a dict as `overfly measure --json` writes it: `vector` has the metrics by name,
/// `columns` one list for each of them, `faults` what must not be (empty where all bounds held).
/// Every `every`-th frame is measured, by default so that no more than 600 are; `rays` is their
/// least number in a frame, `size_px` the picture whose pixels errors are counted in. The other
/// keywords are those of `replay`.
///
/// >>> import overfly
/// >>> found = overfly.measure("poles", frames=(60, 62), scene="small", rays=2000,
/// ...                         size_px=(320, 240))
/// >>> found["faults"], found["vector"]["e1_max_px"] <= 1.0
/// ([], True)
#[pyfunction]
#[pyo3(signature = (flight, *, frames=None, scene=None, every=None, rays=100_000,
                    size_px=(1280, 720), workers=None, cell_px=1.0),
       text_signature = "(flight, *, frames=None, scene=None, every=None, rays=100000, \
                         size_px=(1280, 720), workers=None, cell_px=1.0)")]
#[expect(clippy::too_many_arguments, reason = "keywords of Python, with defaults")]
pub fn measure<'py>(
    py: Python<'py>,
    flight: PathBuf,
    frames: Option<(usize, usize)>,
    scene: Option<PathBuf>,
    every: Option<usize>,
    rays: u32,
    size_px: (u32, u32),
    workers: Option<usize>,
    cell_px: f64,
) -> PyResult<Bound<'py, PyAny>> {
    checked(("rays", [1.0, 16e6]), rays.into())?;
    checked(("cell_px", [0.05, 64.0]), cell_px)?;
    if every == Some(0) {
        return Err(refused("every is 0, allowed is 1 or more"));
    }
    let wish = Wish { flight, scene, workers, size_px };
    let asked = MeasureSettings { rays, cell_px, ..MeasureSettings::default() };
    let text = py.detach(|| {
        let mut player = Player::open(&wish)?;
        let frames = player.chosen(frames)?;
        let every = every.unwrap_or_else(|| frames.len().div_ceil(FRAMES).max(1));
        // Where few frames are measured, more of them are measured thoroughly: some 20 at least.
        let thorough_every = (frames.len() / every / 20).clamp(1, 30) as u64;
        let cross_every = 3 * thorough_every;
        let settings =
            MeasureSettings { threads: threads() + 1, thorough_every, cross_every, ..asked };
        let errors = fly(&mut player, (&frames, every), settings)?;
        Ok::<_, PyErr>(text(&player, (&frames, every), (&settings, &errors)))
    })?;
    py.import("json")?.call_method1("loads", (text,))
}

fn page_of(sources: &Sources, key: PageKey, part: PagePart) -> Option<Arc<Page>> {
    let page = match part {
        PagePart::Heights => sources.bare_page(key),
        PagePart::Whole => sources.page(key),
    };
    page.ok()
}

fn fly(
    player: &mut Player,
    (frames, every): (&Range<usize>, usize),
    settings: MeasureSettings,
) -> PyResult<FlightErrors> {
    let mut measure = Measure::new(player.overfly.terrain(), settings);
    let mut errors = FlightErrors::default();
    let sources = player.overfly.sources().clone();
    let make = |key, part| page_of(&sources, key, part);
    if frames.start > 0 {
        player.forget_states();
    }
    player.lead_in(frames.start)?;
    for index in frames.clone() {
        player.frame(index)?;
        let (terrain, output) = (player.overfly.terrain(), &player.output);
        let left = (index - frames.start) % every;
        if left == 0 && !output.views.is_empty() {
            measure.frame((terrain, output), index as u64, &make, &mut errors);
        } else if left + 1 == every {
            measure.take(terrain, output);
        } else {
            measure.cut();
        }
    }
    player.overfly.close();
    Ok(errors)
}

/// The JSON of `overfly measure`.
fn text(
    player: &Player,
    (frames, every): (&Range<usize>, usize),
    (settings, errors): (&MeasureSettings, &FlightErrors),
) -> String {
    let vector: Map<String, Value> =
        errors.vector().into_iter().map(|(name, value)| (name.into(), json!(value))).collect();
    let rows = errors.rows();
    let worst = rows.iter().filter(|row| row.spread.count > 0).map(|row| {
        let Spread { count, max, at, .. } = row.spread;
        json!({
            "metric": row.metric, "what": row.what, "unit": row.unit,
            "count": count, "max": max, "frame": at.frame,
            "lat_deg": at.lat_deg, "lon_deg": at.lon_deg, "pixel": at.pixel,
        })
    });
    let scene = player.overfly.scene();
    let listing: Map<String, Value> =
        scene.listing().into_iter().map(|(path, value)| (path, json!(value))).collect();
    let mut columns: Map<String, Value> = Map::new();
    for (name, value) in errors.frames.iter().flat_map(|frame| frame.columns()) {
        let column = columns.entry(name).or_insert_with(|| json!([]));
        column.as_array_mut().expect("made as one").push(json!(value));
    }
    let object = json!({
        "format": "overfly-measure-1",
        "flight": player.name,
        "scene": player.scene_name,
        "settings": listing,
        "settings_digest": format!("{:016x}", scene.digest()),
        "frames": [frames.start, frames.end],
        "every": every,
        "rays": settings.rays,
        "seed": settings.seed,
        "cell_px": settings.cell_px,
        "size_px": player.size_px,
        "interrupted": false,
        "faults": errors.faults(),
        "vector": vector,
        "worst": worst.collect::<Vec<_>>(),
        "columns": columns,
    });
    object.to_string()
}

//! The JSON of a measured flight.
//!
//! In:    facts, errors.
//! Out:   one JSON object, format `overfly-measure-1`.
//! Keeps: nothing.
//! Not here: names and units (`overfly::replay::measure::report`), writing the file.

use super::Facts;
use overfly::replay::measure::{FlightErrors, Spread};
use serde_json::{Map, Value, json};

/// The object as text; what was not measured is `null`.
pub fn text(facts: &Facts, errors: &FlightErrors) -> String {
    let vector: Map<String, Value> =
        errors.vector().into_iter().map(|(name, value)| (name.into(), json!(value))).collect();
    let worst: Vec<Value> = errors
        .rows()
        .iter()
        .filter(|row| row.spread.count > 0)
        .map(|row| {
            let Spread { count, max, at, .. } = row.spread;
            json!({
                "metric": row.metric, "what": row.what, "unit": row.unit,
                "count": count, "max": max, "frame": at.frame,
                "lat_deg": at.lat_deg, "lon_deg": at.lon_deg, "pixel": at.pixel,
            })
        })
        .collect();
    let settings: Map<String, Value> =
        facts.scene.listing().into_iter().map(|(path, value)| (path, json!(value))).collect();
    let object = json!({
        "format": "overfly-measure-1",
        "flight": facts.flight,
        "scene": facts.scene_name,
        "settings": settings,
        "settings_digest": format!("{:016x}", facts.scene.digest()),
        "frames": [facts.frames.start, facts.frames.end],
        "every": facts.every,
        "rays": facts.settings.rays,
        "seed": facts.settings.seed,
        "cell_px": facts.settings.cell_px,
        "size_px": facts.size_px,
        "interrupted": facts.interrupted,
        "faults": errors.faults(),
        "vector": vector,
        "worst": worst,
        "columns": columns(errors),
    });
    object.to_string()
}

/// One column a name, one value a measured frame.
fn columns(errors: &FlightErrors) -> Map<String, Value> {
    let mut columns = Map::new();
    for frame in &errors.frames {
        for (name, value) in frame.columns() {
            let column = columns.entry(name).or_insert_with(|| json!([]));
            column.as_array_mut().expect("made as one").push(json!(value));
        }
    }
    columns
}

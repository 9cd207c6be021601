//! The JSON of a replay: every frame's counts and stage times, as columns.
//!
//! In:    columns and the run's facts.
//! Out:   one JSON object, format `overfly-replay-1`.
//! Keeps: nothing.
//! Not here: writing the file.

use super::columns::{Column, Columns};
use serde_json::{Map, Value, json};

/// Facts of a run beside its columns.
pub struct Facts<'a> {
    /// Name of the flight or recording.
    pub flight: &'a str,
    /// Preset or path of the scene.
    pub scene: &'a str,
    /// Digest of the settings.
    pub settings_digest: u64,
    /// Worker threads beside the caller.
    pub workers: usize,
    /// First frame of the columns.
    pub first_frame: usize,
    /// Digest of the whole run.
    pub digest: u64,
    /// First frame and stage that left the recording.
    pub diverged: Option<(usize, &'static str)>,
}

/// The object as text. 64-bit digests are strings of 16 hexadecimal digits.
pub fn text(facts: &Facts<'_>, columns: &Columns) -> String {
    let table = |columns: &[Column]| -> Map<String, Value> {
        columns.iter().map(|column| (column.name.to_owned(), json!(column.values()))).collect()
    };
    let object = json!({
        "format": "overfly-replay-1",
        "flight": facts.flight,
        "scene": facts.scene,
        "settings_digest": format!("{:016x}", facts.settings_digest),
        "workers": facts.workers,
        "first_frame": facts.first_frame,
        "frames": columns.frames(),
        "digest": format!("{:016x}", facts.digest),
        "diverged": facts.diverged.map(|(frame, stage)| json!({"frame": frame, "stage": stage})),
        "stages_ms": table(&columns.stages_ms),
        "waited_ms": columns.waited_ms.values(),
        "counts": table(&columns.counts),
    });
    object.to_string()
}

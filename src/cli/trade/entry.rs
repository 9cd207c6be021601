//! A point with all that it yielded.
//!
//! In:    clips and passes of a point.
//! Out:   [`Entry`]: metrics of the flight, sums of work, times.
//! Keeps: nothing.
//! Not here: tables and plots (`tables`, `html`).

use super::fly::{FRAME, Pass, Shot, Told};
use overfly::core::mesh::patches::{PatchMorph, PatchVertex};
use overfly::core::settings::VertexPrecision;
use overfly::replay::Summary;
use overfly::replay::trade::{Point, Yield, fold};

/// A point with all that it yielded.
pub struct Entry {
    pub point: Point,
    /// What tells it from the scene as it is.
    pub name: String,
    /// The metric vector of the flight.
    pub metrics: Vec<(String, f64)>,
    /// Counts: sum and p99 over all flown frames.
    pub counts: Vec<(String, [f64; 2])>,
    /// Digests of all clips.
    pub digest: String,
    /// Bytes of new vertices, of all flown frames.
    pub uploaded_bytes: f64,
    /// Bytes that the processor writes a frame for `EyeF64`; 0 for `TwoFloat`.
    pub eye_bytes: f64,
    /// Frames flown.
    pub frames: usize,
    /// Median and p99 of each stage, the whole frame first: each the median of all passes'.
    pub stages_ms: Vec<(String, [f64; 2])>,
    pub found: Yield,
}

impl Entry {
    /// The point's clips and passes, summed up. Without passes it has no times.
    pub fn of(base: &Point, point: &Point, shots: &[Shot], passes: &[Pass]) -> Self {
        let metrics = metrics(shots);
        let columns = columns(shots);
        let of = |name: &str| columns.iter().find(|(known, _)| known == name);
        let column = |name: &str| of(name).map_or(&[][..], |(_, column)| column);
        let sum = |name: &str| column(name).iter().sum::<f64>();
        let frames = column("triangles").len();
        let morphs = if point.scene.lod.morph_s > 0.0 { size_of::<PatchMorph>() } else { 0 };
        let patch = f64::from(shots.first().map_or(0, |shot| shot.patch_vertices));
        let eye = point.scene.vertices == VertexPrecision::EyeF64;
        let stages_ms = stages_ms(passes);
        let whole = stages_ms.iter().find(|(name, _)| name == FRAME);
        let value = |name: &str| {
            metrics.iter().find(|(known, _)| known == name).map_or(f64::NAN, |(_, value)| *value)
        };
        let last = |name: &str| -> Vec<f64> {
            let of_shot = |shot: &Shot| {
                let (_, column) = shot.counts.iter().find(|(known, _)| known == name)?;
                column.last().copied().flatten()
            };
            shots.iter().map(|shot| of_shot(shot).unwrap_or(f64::INFINITY)).collect()
        };
        let (triangles, bounds) = (last("triangles"), last("error_px_bound"));
        let found = Yield {
            error_px: value("e1_p999_px"),
            rms_px: value("e1_rms_px"),
            bound_px: bounds.iter().copied().fold(0.0, f64::max),
            tolerance_px: point.scene.lod.tolerance.0,
            triangles_max: f64::from(point.scene.lod.triangles_max),
            triangles_span: [
                triangles.iter().copied().fold(f64::INFINITY, f64::min),
                triangles.iter().copied().fold(0.0, f64::max),
            ],
            triangles: sum("triangles") / frames as f64,
            cpu_ms: whole.map_or([f64::NAN; 2], |(_, times)| *times),
        };
        Self {
            name: point.name(base),
            point: point.clone(),
            digest: shots.iter().map(|shot| shot.digest.as_str()).collect::<Vec<_>>().join(" "),
            uploaded_bytes: sum("built") * patch * (size_of::<PatchVertex>() + morphs) as f64,
            eye_bytes: if eye {
                sum("drawn") / frames as f64 * patch * size_of::<[f32; 3]>() as f64
            } else {
                0.0
            },
            counts: columns.iter().map(|(name, column)| (name.clone(), summed(column))).collect(),
            frames,
            stages_ms,
            metrics,
            found,
        }
    }
}

fn metrics(shots: &[Shot]) -> Vec<(String, f64)> {
    let names = shots.first().map_or(&[][..], |shot| &shot.metrics);
    let of = |at: usize| -> Vec<f64> {
        let value = |shot: &Shot| shot.metrics.get(at).and_then(|(_, value)| *value);
        shots.iter().map(|shot| value(shot).unwrap_or(f64::NAN)).collect()
    };
    let numbered = names.iter().enumerate();
    numbered.map(|(at, (name, _))| (name.clone(), fold(name, &of(at)))).collect()
}

/// The counts of all frames of all clips.
fn columns(shots: &[Shot]) -> Vec<(String, Vec<f64>)> {
    let names = shots.first().map_or(&[][..], |shot| &shot.counts);
    let all = |at: usize| -> Vec<f64> {
        let told = |value: &Told| value.unwrap_or(f64::INFINITY);
        shots.iter().flat_map(|shot| shot.counts[at].1.iter().map(told)).collect()
    };
    names.iter().enumerate().map(|(at, (name, _))| (name.clone(), all(at))).collect()
}

fn summed(column: &[f64]) -> [f64; 2] {
    Summary::of_numbers(column).map_or([f64::NAN; 2], |s| [column.iter().sum(), s.p99])
}

fn stages_ms(passes: &[Pass]) -> Vec<(String, [f64; 2])> {
    let names = passes.first().map_or(&[][..], |pass| &pass.stages_ms);
    let of = |at: usize| {
        let summaries: Vec<_> =
            passes.iter().filter_map(|pass| Summary::of_numbers(&pass.stages_ms[at].1)).collect();
        let median = |of: fn(&Summary<f64>) -> f64| {
            let each: Vec<f64> = summaries.iter().map(of).collect();
            Summary::of_numbers(&each).map_or(f64::NAN, |s| s.p50)
        };
        [median(|s| s.p50), median(|s| s.p99)]
    };
    names.iter().enumerate().map(|(at, (name, _))| (name.clone(), of(at))).collect()
}

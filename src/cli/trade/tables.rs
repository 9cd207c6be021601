//! A trade as CSV and JSON.
//!
//! In:    entries, laws, the plan.
//! Out:   one row a point; one JSON object, format `overfly-trade-1`.
//! Keeps: nothing.
//! Not here: the report for people (`html`).
//!
//! In JSON everything that depends on clocks is under `times`; all else is the same in every run.

use super::entry::Entry;
use super::fly::FRAME;
use super::laws::Law;
use super::plan::{Plan, Ways};
use crate::cli::Failure;
use overfly::config;
use overfly::replay::trade::{Point, Yield, front};
use serde_json::{Map, Value, json};

/// What `format` says.
pub const FORMAT: &str = "overfly-trade-1";

/// Whether each point is on the front of error against triangles, and of error against CPU time.
pub fn fronts(entries: &[Entry]) -> [Vec<bool>; 2] {
    let of = |cost: fn(&Yield) -> f64| {
        let points: Vec<[f64; 2]> =
            entries.iter().map(|e| [cost(&e.found), e.found.error_px]).collect();
        front(&points)
    };
    [of(|y| y.triangles), of(|y| y.cpu_ms[0])]
}

/// What keeps the mesh from being finer, in every measured frame.
pub fn decides(found: &Yield) -> &'static str {
    match (found.tolerance_decides(), found.budget_decides()) {
        (true, _) => "tolerance",
        (_, true) => "triangles",
        _ => "mixed",
    }
}

/// A bound for people: those of pages that have not come yet are beyond all screens.
pub fn pixels(px: f64) -> String {
    if px >= 1e4 { format!("{px:.1e}") } else { format!("{px:.2}") }
}

/// One row a point. Columns that depend on clocks end in `_ms` or in `cpu_front`.
pub fn csv(entries: &[Entry]) -> Result<String, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let [by_triangles, by_cpu] = fronts(entries);
    for (at, entry) in entries.iter().enumerate() {
        let mut row: Vec<(String, String)> = vec![("point".into(), entry.name.clone())];
        let mut add = |name: String, value: String| row.push((name, value));
        for (name, value) in entry.point.knobs() {
            add(name.into(), value);
        }
        for (name, value) in numbers(entry) {
            add(name.into(), value.to_string());
        }
        for (name, value) in &entry.metrics {
            add(format!("metric_{name}"), value.to_string());
        }
        for (name, [sum, p99]) in &entry.counts {
            add(format!("{name}_sum"), sum.to_string());
            add(format!("{name}_p99"), p99.to_string());
        }
        add("digest".into(), entry.digest.clone());
        add("triangle_front".into(), by_triangles[at].to_string());
        for (name, [p50, p99]) in &entry.stages_ms {
            add(format!("{name}_p50_ms"), p50.to_string());
            add(format!("{name}_p99_ms"), p99.to_string());
        }
        add("cpu_front".into(), by_cpu[at].to_string());
        if at == 0 {
            writer.write_record(row.iter().map(|(name, _)| name))?;
        }
        writer.write_record(row.iter().map(|(_, value)| value))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// What is compared, without times.
fn numbers(entry: &Entry) -> [(&'static str, f64); 9] {
    let y = &entry.found;
    [
        ("error_px", y.error_px),
        ("rms_px", y.rms_px),
        ("bound_px", y.bound_px),
        ("triangles", y.triangles),
        ("triangles_least", y.triangles_span[0]),
        ("triangles_most", y.triangles_span[1]),
        ("uploaded_bytes", entry.uploaded_bytes),
        ("eye_bytes_a_frame", entry.eye_bytes),
        ("frames", entry.frames as f64),
    ]
}

/// The whole trade.
pub fn json(
    (plan, base): (&Plan, &Point),
    entries: &[Entry],
    laws: &[Law],
) -> Result<String, Failure> {
    let [by_triangles, by_cpu] = fronts(entries);
    let point = |(at, entry): (usize, &Entry)| -> Result<Value, Failure> {
        let told = |pairs: &[(String, f64)]| -> Map<String, Value> {
            pairs.iter().map(|(name, value)| (name.clone(), json!(value))).collect()
        };
        let pairs = |columns: &[(String, [f64; 2])], names: [&str; 2]| -> Map<String, Value> {
            let pair = |[a, b]: [f64; 2]| json!({names[0]: a, names[1]: b});
            columns.iter().map(|(name, values)| (name.clone(), pair(*values))).collect()
        };
        let y = numbers(entry).into_iter();
        let yields: Map<String, Value> =
            y.map(|(name, value)| (name.to_owned(), json!(value))).collect();
        Ok(json!({
            "name": entry.name,
            "knobs": knobs(&entry.point),
            "scene": config::write(&entry.point.scene)?,
            "yield": yields,
            "metrics": told(&entry.metrics),
            "counts": pairs(&entry.counts, ["sum", "p99"]),
            "digest": entry.digest,
            "on_triangle_front": by_triangles[at],
            "times": {
                "stages_ms": pairs(&entry.stages_ms, ["p50", "p99"]),
                "on_cpu_front": by_cpu[at],
            },
        }))
    };
    let points: Result<Vec<Value>, Failure> = entries.iter().enumerate().map(point).collect();
    let object = json!({
        "format": FORMAT,
        "ways": plan.ways,
        "clips": plan.clips,
        "rate_hz": plan.rate_hz,
        "base": { "scene": config::write(&base.scene)?, "knobs": knobs(base) },
        "laws": laws.iter().map(law).collect::<Vec<_>>(),
        "points": points?,
    });
    Ok(serde_json::to_string_pretty(&object)?)
}

fn knobs(point: &Point) -> Map<String, Value> {
    point.knobs().into_iter().map(|(name, value)| (name.to_owned(), json!(value))).collect()
}

fn law(law: &Law) -> Value {
    let found = law.found.map(
        |f| json!({"slope": f.slope, "factor": f.factor, "residual": f.residual, "range": f.range}),
    );
    json!({
        "name": law.name,
        "expected": law.expected,
        "points": law.points,
        "found": found,
        "holds": law.holds(),
    })
}

/// A point, what it yielded, and the digest of its frames.
pub type Known = (Point, Yield, String);
/// A trade as a file tells of it: how it was flown, the scene's own point, all points.
pub type Told = (Ways, Point, Vec<Known>);

/// Reads what [`json`] wrote.
pub fn read(text: &str, file: &str) -> Result<Told, Failure> {
    let wrong = |what: &str| format!("{file}: {what}; `overfly trade` writes it anew");
    let object: Value = serde_json::from_str(text).map_err(|error| wrong(&error.to_string()))?;
    if object["format"] != FORMAT {
        return Err(wrong(&format!("format is {}, allowed is {FORMAT}", object["format"])).into());
    }
    let ways = serde_json::from_value(object["ways"].clone())
        .map_err(|error| wrong(&error.to_string()))?;
    let point = |value: &Value| -> Option<Point> {
        let scene = config::read(value["scene"].as_str()?, file).ok()?;
        let knob = |name: &str| value["knobs"][name].as_str();
        let loader_delay_ms = knob("loader_delay_ms")?.parse().ok()?;
        Some(Point { scene, loader_delay_ms, workers: knob("workers")?.parse().ok()? })
    };
    let base = point(&object["base"]).ok_or_else(|| wrong("`base` is no point"))?;
    let mut points = Vec::new();
    for value in object["points"].as_array().map_or(&[][..], Vec::as_slice) {
        let point = point(value).ok_or_else(|| wrong("one of `points` is no point"))?;
        let found = found(value, &point);
        points.push((point, found, value["digest"].as_str().unwrap_or_default().to_owned()));
    }
    Ok((ways, base, points))
}

fn found(value: &Value, point: &Point) -> Yield {
    let number = |name: &str| value["yield"][name].as_f64().unwrap_or(f64::NAN);
    let frame = &value["times"]["stages_ms"][FRAME];
    Yield {
        error_px: number("error_px"),
        rms_px: number("rms_px"),
        bound_px: number("bound_px"),
        tolerance_px: point.scene.lod.tolerance.0,
        triangles_max: f64::from(point.scene.lod.triangles_max),
        triangles_span: [number("triangles_least"), number("triangles_most")],
        triangles: number("triangles"),
        cpu_ms: ["p50", "p99"].map(|name| frame[name].as_f64().unwrap_or(f64::NAN)),
    }
}

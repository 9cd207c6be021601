//! The JSON form of what an archive says about itself.
//!
//! In:    [`Facts`]; or the metadata of a PMTiles archive.
//! Out:   metadata with the key "overfly"; or facts, every range checked.
//! Keeps: nothing.
//! Not here: reading it from an archive (`lib`), what facts are used for (`overfly_core`).

mod imagery;

pub use imagery::imagery_to_json;

use crate::fault::ArchiveFault;
use overfly_core::datasource::facts::{
    ArchiveFacts, Datum, FORMAT_VERSION, ImageryFacts, LAYERS_MAX, LayerFacts,
};
use overfly_core::datasource::key::DEPTH_MAX;
use overfly_core::geodesy::Ellipsoid;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// The key of the facts within a PMTiles archive's metadata.
const KEY: &str = "overfly";
/// The key of facts for people beside them, one for each source; not read back.
const SOURCES_KEY: &str = "overfly_sources";

/// What an archive holds, as it says itself.
#[derive(Clone, PartialEq, Debug)]
pub enum Facts {
    /// Heights.
    Elevation(ArchiveFacts),
    /// Colours.
    Imagery(ImageryFacts),
}

/// Archives that do not say are of elevation: the first ones did not.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Default)]
#[serde(rename_all = "lowercase")]
enum RawKind {
    #[default]
    Elevation,
    Imagery,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFacts {
    #[serde(default)]
    kind: RawKind,
    version: u32,
    body: RawBody,
    datum: RawDatum,
    height_range_m: [f64; 2],
    /// 16 hexadecimal digits: JSON's numbers are not exact beyond 2^53.
    content: String,
    layers: Vec<RawLayer>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBody {
    name: String,
    a_m: f64,
    f: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawDatum {
    Egm96,
    Ellipsoid,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLayer {
    depth: u8,
    quantum_m: f64,
    spacing_m: f64,
    blend_m: f64,
    sources: Vec<String>,
}

/// The metadata of an archive, as JSON text. `sources` is kept beside the facts, for people.
///
/// # Panics
/// If the facts are out of range: nobody could read the archive.
pub fn to_json(facts: &ArchiveFacts, sources: Value) -> String {
    if let Err(what) = check(facts) {
        panic!("facts that no reader would accept: {what}");
    }
    let layer = |layer: &LayerFacts| RawLayer {
        depth: layer.depth,
        quantum_m: layer.quantum_m,
        spacing_m: layer.spacing_m,
        blend_m: layer.blend_m,
        sources: layer.sources.clone(),
    };
    let raw = RawFacts {
        kind: RawKind::Elevation,
        version: facts.version,
        body: RawBody { name: facts.body_name.clone(), a_m: facts.body.a_m, f: facts.body.f },
        datum: match facts.datum {
            Datum::Egm96 => RawDatum::Egm96,
            Datum::Ellipsoid => RawDatum::Ellipsoid,
        },
        height_range_m: facts.height_range_m,
        content: format!("{:016x}", facts.content),
        layers: facts.layers.iter().map(layer).collect(),
    };
    json!({ KEY: raw, SOURCES_KEY: sources }).to_string()
}

/// The facts within an archive's metadata; `None` where there are none of ours.
///
/// # Errors
/// No JSON, another kind or format version, a wrong type, a value out of range.
pub fn from_json(text: &str) -> Result<Option<Facts>, ArchiveFault> {
    let metadata = |error: serde_json::Error| ArchiveFault::Metadata(error.to_string());
    let mut all: Value = serde_json::from_str(text).map_err(metadata)?;
    let Some(ours) = all.get_mut(KEY) else { return Ok(None) };
    // Both kinds count their versions from 1 and have come no further.
    match ours.get("version").and_then(Value::as_u64) {
        None => return Err(ArchiveFault::Metadata("its version is not a whole number".into())),
        Some(version) if version == u64::from(FORMAT_VERSION) => {}
        Some(version) => return Err(ArchiveFault::FormatVersion(version)),
    }
    match ours.get("kind").map_or(Ok(RawKind::default()), RawKind::deserialize) {
        Ok(RawKind::Elevation) => elevation(ours.take()).map(|facts| Some(Facts::Elevation(facts))),
        Ok(RawKind::Imagery) => {
            imagery::from_value(ours.take()).map(|facts| Some(Facts::Imagery(facts)))
        }
        Err(_) => {
            let what = format!("kind is {}, neither \"elevation\" nor \"imagery\"", ours["kind"]);
            Err(ArchiveFault::Metadata(what))
        }
    }
}

fn elevation(ours: Value) -> Result<ArchiveFacts, ArchiveFault> {
    let raw: RawFacts = serde_json::from_value(ours)
        .map_err(|error: serde_json::Error| ArchiveFault::Metadata(error.to_string()))?;
    let facts = resolved(raw).map_err(ArchiveFault::Metadata)?;
    check(&facts).map_err(ArchiveFault::Metadata)?;
    Ok(facts)
}

/// A hash as it is written.
fn content_of(text: &str) -> Result<u64, String> {
    let digits = text.len() == 16 && text.bytes().all(|c| c.is_ascii_hexdigit());
    let content = u64::from_str_radix(text, 16).ok().filter(|_| digits);
    content.ok_or_else(|| "content is not 16 hexadecimal digits".into())
}

fn resolved(raw: RawFacts) -> Result<ArchiveFacts, String> {
    let layer = |raw: RawLayer| LayerFacts {
        depth: raw.depth,
        quantum_m: raw.quantum_m,
        spacing_m: raw.spacing_m,
        blend_m: raw.blend_m,
        sources: raw.sources,
    };
    Ok(ArchiveFacts {
        version: raw.version,
        body_name: raw.body.name,
        body: Ellipsoid { a_m: raw.body.a_m, f: raw.body.f },
        datum: match raw.datum {
            RawDatum::Egm96 => Datum::Egm96,
            RawDatum::Ellipsoid => Datum::Ellipsoid,
        },
        height_range_m: raw.height_range_m,
        content: content_of(&raw.content)?,
        layers: raw.layers.into_iter().map(layer).collect(),
    })
}

/// Every range; the greatest body is the greatest of a scene.
fn check(facts: &ArchiveFacts) -> Result<(), String> {
    if facts.version != FORMAT_VERSION {
        return Err(format!("version is {}, not {FORMAT_VERSION}", facts.version));
    }
    named(&facts.body_name, &facts.body)?;
    let [low_m, high_m] = facts.height_range_m;
    within("height_range_m[0]", low_m, [-1e7, 1e7])?;
    within("height_range_m[1]", high_m, [low_m, 1e7])?;
    if !(1..=LAYERS_MAX).contains(&facts.layers.len()) {
        return Err(format!("{} layers, not 1 to {LAYERS_MAX}", facts.layers.len()));
    }
    if !facts.layers.is_sorted_by_key(|layer| layer.depth) {
        return Err("layers are not sorted by depth".into());
    }
    facts.layers.iter().enumerate().try_for_each(|(i, layer)| check_layer(i, layer))
}

fn named(body_name: &str, body: &Ellipsoid) -> Result<(), String> {
    if body_name.is_empty() || body_name.len() > 64 {
        return Err("body.name is not 1 to 64 bytes long".into());
    }
    within("body.a_m", body.a_m, [500.0, 1e9])?;
    within("body.f", body.f, [-0.5, 0.5])
}

fn check_layer(i: usize, layer: &LayerFacts) -> Result<(), String> {
    if layer.depth > DEPTH_MAX {
        return Err(format!("layers[{i}].depth is {}, beyond {DEPTH_MAX}", layer.depth));
    }
    within(&format!("layers[{i}].quantum_m"), layer.quantum_m, [1e-4, 100.0])?;
    within(&format!("layers[{i}].spacing_m"), layer.spacing_m, [1e-3, 1e7])?;
    within(&format!("layers[{i}].blend_m"), layer.blend_m, [0.0, 1e7])
}

fn within(name: &str, value: f64, [least, most]: [f64; 2]) -> Result<(), String> {
    // Written so that what is not a number is not within.
    if value >= least && value <= most {
        return Ok(());
    }
    Err(format!("{name} is {value}, not {least} to {most}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts() -> ArchiveFacts {
        let layer = |depth, spacing_m| LayerFacts {
            depth,
            quantum_m: 0.25,
            spacing_m,
            blend_m: 3.0 * spacing_m,
            sources: vec![format!("grid {depth}")],
        };
        ArchiveFacts {
            version: FORMAT_VERSION,
            body_name: "earth".into(),
            body: Ellipsoid::WGS84,
            datum: Datum::Egm96,
            height_range_m: [-120.5, 8849.1],
            content: 0x00FE_DCBA_9876_5432,
            layers: vec![layer(6, 1855.0), layer(12, 30.9)],
        }
    }

    #[test]
    fn facts_come_back_as_they_were_written() {
        let text = to_json(&facts(), json!([{ "file": "a.tif", "licence": "CC0" }]));
        assert_eq!(from_json(&text).unwrap(), Some(Facts::Elevation(facts())));
        let untold = text.replace("\"kind\":\"elevation\",", "");
        assert_ne!(untold, text);
        assert_eq!(from_json(&untold).unwrap(), Some(Facts::Elevation(facts())));
        assert!(text.contains("00fedcba98765432") && text.contains("CC0"));
    }

    #[test]
    fn metadata_of_others_is_told_from_broken_metadata() {
        assert_eq!(from_json("{\"name\": \"roads\"}").unwrap(), None);
        assert_eq!(from_json("[1, 2]").unwrap(), None);
        assert!(matches!(from_json("{"), Err(ArchiveFault::Metadata(_))));
        assert!(matches!(from_json("{\"overfly\": 3}"), Err(ArchiveFault::Metadata(_))));
        let deep = "[".repeat(100_000);
        assert!(matches!(from_json(&deep), Err(ArchiveFault::Metadata(_))));
    }

    #[test]
    fn unknown_versions_are_refused_by_number() {
        let newer = r#"{"overfly": {"version": 7, "whatever": true}}"#;
        let fault = from_json(newer).unwrap_err();
        assert!(matches!(fault, ArchiveFault::FormatVersion(7)));
        assert!(fault.to_string().contains('7'));
    }

    #[test]
    fn every_value_out_of_range_is_refused_by_name() {
        let cases: [(&str, Value, &str); 15] = [
            ("/body/a_m", json!(499.0), "body.a_m"),
            ("/body/f", json!(0.6), "body.f"),
            ("/body/name", json!(""), "body.name"),
            ("/datum", json!("navd88"), "navd88"),
            ("/height_range_m", json!([5.0, 4.0]), "height_range_m[1]"),
            ("/height_range_m/0", json!(-1e8), "height_range_m[0]"),
            ("/content", json!("12"), "content"),
            ("/content", json!("+0fedcba98765432"), "content"),
            ("/layers", json!([]), "0 layers"),
            ("/layers/0/depth", json!(24), "sorted"),
            ("/layers/1/depth", json!(24), "layers[1].depth"),
            ("/layers/0/quantum_m", json!(1e-5), "layers[0].quantum_m"),
            ("/layers/1/spacing_m", json!(0.0), "layers[1].spacing_m"),
            ("/layers/1/blend_m", json!(-1.0), "layers[1].blend_m"),
            ("/layers/1/sources", json!("one"), "sequence"),
        ];
        let sound: Value = serde_json::from_str(&to_json(&facts(), Value::Null)).unwrap();
        for (path, value, named) in cases {
            let mut broken = sound.clone();
            *broken.pointer_mut(&format!("/overfly{path}")).unwrap() = value;
            let fault = from_json(&broken.to_string()).unwrap_err().to_string();
            assert!(fault.contains(named), "{path}: {fault}");
        }
        let mut layers = facts();
        layers.layers = vec![layers.layers[0].clone(); LAYERS_MAX + 1];
        assert!(check(&layers).unwrap_err().contains("17 layers"));
    }
}

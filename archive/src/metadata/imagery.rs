//! The JSON form of what an archive of imagery says about itself.
//!
//! In:    [`ImageryFacts`]; or the value of the key "overfly" in a PMTiles archive's metadata.
//! Out:   metadata; or facts, every range checked.
//! Keeps: nothing.
//! Not here: elevation, and telling the two kinds apart (the parent).

use super::{ArchiveFault, KEY, RawBody, RawKind, SOURCES_KEY, content_of, named, within};
use overfly_core::datasource::colour::COLOUR_DEPTH_MAX;
use overfly_core::datasource::facts::{IMAGERY_VERSION, ImageryFacts};
use overfly_core::geodesy::Ellipsoid;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Longest attribution and longest name of a source, in bytes.
const TEXT_BYTES_MAX: usize = 1024;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawImagery {
    kind: RawKind,
    version: u32,
    body: RawBody,
    depth: u8,
    spacing_m: f64,
    attribution: String,
    source: String,
    /// 16 hexadecimal digits.
    content: String,
}

/// The metadata of an archive of imagery, as JSON text. `source` is kept beside, for people.
///
/// # Panics
/// If the facts are out of range: nobody could read the archive.
pub fn imagery_to_json(facts: &ImageryFacts, source: Value) -> String {
    if let Err(what) = check(facts) {
        panic!("facts that no reader would accept: {what}");
    }
    let raw = RawImagery {
        kind: RawKind::Imagery,
        version: facts.version,
        body: RawBody { name: facts.body_name.clone(), a_m: facts.body.a_m, f: facts.body.f },
        depth: facts.depth,
        spacing_m: facts.spacing_m,
        attribution: facts.attribution.clone(),
        source: facts.source.clone(),
        content: format!("{:016x}", facts.content),
    };
    // Maps show what stands under this key of their own accord.
    json!({ KEY: raw, SOURCES_KEY: [source], "attribution": facts.attribution }).to_string()
}

pub(super) fn from_value(ours: Value) -> Result<ImageryFacts, ArchiveFault> {
    let raw: RawImagery = serde_json::from_value(ours)
        .map_err(|error: serde_json::Error| ArchiveFault::Metadata(error.to_string()))?;
    let facts = ImageryFacts {
        version: raw.version,
        content: content_of(&raw.content).map_err(ArchiveFault::Metadata)?,
        body_name: raw.body.name,
        body: Ellipsoid { a_m: raw.body.a_m, f: raw.body.f },
        depth: raw.depth,
        spacing_m: raw.spacing_m,
        attribution: raw.attribution,
        source: raw.source,
    };
    check(&facts).map_err(ArchiveFault::Metadata)?;
    Ok(facts)
}

fn check(facts: &ImageryFacts) -> Result<(), String> {
    if facts.version != IMAGERY_VERSION {
        return Err(format!("version is {}, not {IMAGERY_VERSION}", facts.version));
    }
    named(&facts.body_name, &facts.body)?;
    if facts.depth > COLOUR_DEPTH_MAX {
        return Err(format!("depth is {}, beyond {COLOUR_DEPTH_MAX}", facts.depth));
    }
    within("spacing_m", facts.spacing_m, [1e-3, 1e7])?;
    for (name, text) in [("attribution", &facts.attribution), ("source", &facts.source)] {
        if text.len() > TEXT_BYTES_MAX {
            return Err(format!("{name} is {} bytes long, beyond {TEXT_BYTES_MAX}", text.len()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Facts, from_json};
    use super::*;

    fn facts() -> ImageryFacts {
        ImageryFacts {
            version: IMAGERY_VERSION,
            body_name: "Earth".into(),
            body: Ellipsoid::WGS84,
            depth: 4,
            spacing_m: 9783.9,
            attribution: "somebody, CC BY 4.0".into(),
            source: "world.png".into(),
            content: 0x0123_4567_89AB_CDEF,
        }
    }

    #[test]
    fn facts_of_imagery_come_back_as_they_were_written() {
        let text = imagery_to_json(&facts(), json!({ "pixels": [4096, 2048] }));
        assert_eq!(from_json(&text).unwrap(), Some(Facts::Imagery(facts())));
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["attribution"], "somebody, CC BY 4.0");
        assert_eq!(value["overfly"]["kind"], "imagery");
    }

    #[test]
    fn every_value_of_imagery_out_of_range_is_refused_by_name() {
        let long = "x".repeat(TEXT_BYTES_MAX + 1);
        let cases: [(&str, Value, &str); 8] = [
            ("kind", json!("roads"), "kind is \"roads\", neither \"elevation\" nor \"imagery\""),
            ("kind", json!("elevation"), "unknown field `attribution`"),
            ("depth", json!(23), "depth is 23, beyond 22"),
            ("spacing_m", json!(0.0), "spacing_m is 0, not 0.001 to 10000000"),
            ("attribution", json!(long), "attribution is 1025 bytes"),
            ("source", json!(long), "source is 1025 bytes"),
            ("content", json!("abc"), "content"),
            ("body", json!({ "name": "", "a_m": 1e6, "f": 0.0 }), "body.name"),
        ];
        let sound: Value = serde_json::from_str(&imagery_to_json(&facts(), Value::Null)).unwrap();
        for (field, value, wanted) in cases {
            let mut broken = sound.clone();
            broken["overfly"][field] = value;
            let fault = from_json(&broken.to_string()).unwrap_err().to_string();
            assert!(fault.contains(wanted), "{field}: {fault}");
        }
        let mut newer = sound;
        newer["overfly"]["version"] = json!(2);
        let fault = from_json(&newer.to_string()).unwrap_err();
        assert!(matches!(fault, ArchiveFault::FormatVersion(2)), "{fault}");
    }
}

//! A scene file from settings, so that what a program chose can be read, kept and run again.
//!
//! In:    [`SceneSettings`].
//! Out:   RON that [`read`](crate::read) reads back to equal settings, or why no text does.
//! Keeps: nothing.
//! Not here: what the settings mean (`scene`, and the presets' comments).

use crate::fault::SceneFaults;
use crate::utc::utc_text;
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::{Ellipsoid, Geodetic, trig};
use overfly_core::settings::{LensSettings, SceneSettings, SourceSettings, SunSettings};
use overfly_core::units::Radians;
use std::fmt::{self, Display, Formatter, Write};

/// Why settings cannot be written as a scene file.
#[derive(Clone, PartialEq, Debug)]
pub enum WriteFault {
    /// A scene file may not hold them: what it would say is out of range.
    Refused(SceneFaults),
    /// A scene file has no words for one of them; the name of the setting.
    Unwritable(&'static str),
}

impl Display for WriteFault {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Self::Refused(faults) => faults.fmt(f),
            Self::Unwritable(field) => {
                write!(f, "{field} has a value that no scene file can give back exactly")
            }
        }
    }
}

impl std::error::Error for WriteFault {}

/// The scene file of these settings, every one spelt out. Reading it gives equal settings: that is
/// tried before it is handed out. Paths of archives stay as they are.
///
/// # Errors
/// A setting outside its range, or between two values that a file can express.
pub fn write(settings: &SceneSettings) -> Result<String, WriteFault> {
    let text = text_of(settings).expect("a text takes whatever is written to it");
    let back = crate::read(&text, "scene.ron").map_err(WriteFault::Refused)?;
    match difference(settings, &back) {
        None => Ok(text),
        Some(field) => Err(WriteFault::Unwritable(field)),
    }
}

fn difference(a: &SceneSettings, b: &SceneSettings) -> Option<&'static str> {
    let parts = [
        ("body", a.body == b.body),
        ("sources", a.sources == b.sources),
        ("imagery", a.imagery == b.imagery),
        ("sun", a.sun == b.sun),
        ("lod", a.lod == b.lod),
        ("views", a.views == b.views),
        ("depth", a.depth == b.depth),
        ("memory", a.memory == b.memory),
        ("the scene", a == b),
    ];
    parts.into_iter().find(|(_, same)| !same).map(|(name, _)| name)
}

fn text_of(s: &SceneSettings) -> Result<String, fmt::Error> {
    let mut out = String::from("Scene(\n");
    writeln!(out, "    body: {},", body(&s.body))?;
    writeln!(out, "    sources: [{}],", listed(&s.sources, source))?;
    writeln!(out, "    imagery: [{}],", listed(&s.imagery, |location| quoted(location)))?;
    writeln!(out, "    sea: {},", s.sea)?;
    writeln!(out, "    sun: {},", sun(s.sun.as_ref()))?;
    let lod = &s.lod;
    writeln!(out, "    lod: (")?;
    writeln!(out, "        tolerance_px: {:?},", lod.tolerance.0)?;
    writeln!(out, "        triangles_max: {},", lod.triangles_max)?;
    writeln!(out, "        patch_depth: {},", lod.patch_depth)?;
    writeln!(out, "        splits_max: {},", lod.splits_max)?;
    writeln!(out, "        merges_max: {},", lod.merges_max)?;
    writeln!(out, "        level_max: {},", lod.level_max)?;
    writeln!(out, "        wanted_max: {},", lod.wanted_max)?;
    writeln!(out, "        morph_s: {:?},", lod.morph_s)?;
    writeln!(out, "    ),")?;
    writeln!(out, "    views: [{}],", listed(&s.views, view))?;
    writeln!(out, "    vertices: {:?},", s.vertices)?;
    writeln!(out, "    depth: (")?;
    writeln!(out, "        format: {:?},", s.depth.format)?;
    writeln!(out, "        order: {:?},", s.depth.order)?;
    writeln!(out, "        ranges: {:?},", s.depth.splits_m)?;
    writeln!(out, "    ),")?;
    writeln!(out, "    memory: (pages_mib: {}),", s.memory.pages_bytes >> 20)?;
    out.push_str(")\n");
    Ok(out)
}

fn listed<T>(items: &[T], text: impl Fn(&T) -> String) -> String {
    items.iter().map(text).collect::<Vec<_>>().join(", ")
}

/// As the named bodies are known, their names; a sphere by its radius.
fn body(body: &Ellipsoid) -> String {
    for (name, known) in
        [("Wgs84", Ellipsoid::WGS84), ("Moon", Ellipsoid::MOON), ("Mars", Ellipsoid::MARS)]
    {
        if *body == known {
            return name.into();
        }
    }
    if body.f == 0.0 {
        return format!("Sphere(radius_m: {:?})", body.a_m);
    }
    format!("Ellipsoid(a_m: {:?}, f: {:?})", body.a_m, body.f)
}

fn source(source: &SourceSettings) -> String {
    match source {
        SourceSettings::Archive { location } => format!("Archive({})", quoted(location)),
        SourceSettings::Procedural { seed, style, relief, finest_m, detail } => {
            let style = match style {
                Style::Earthlike => "Earthlike",
                Style::Cratered => "Cratered",
            };
            format!(
                "Procedural(seed: {seed}, style: {style}, relief: {relief:?}, \
                 finest_m: {finest_m:?}, detail: {detail:?})"
            )
        }
    }
}

fn view(lens: &LensSettings) -> String {
    let degrees = |angle: Radians| {
        let same = |degrees: f64| Radians::from_degrees(degrees) == angle;
        short(angle.to_degrees(), same)
    };
    format!(
        "(name: {}, field_of_view_deg: {:?}, yaw_deg: {:?}, pitch_deg: {:?}, near_m: {:?})",
        quoted(&lens.name),
        degrees(lens.field_of_view),
        degrees(lens.yaw),
        degrees(lens.pitch),
        lens.near_m
    )
}

fn sun(sun: Option<&SunSettings>) -> String {
    match *match sun {
        None => return "None".into(),
        Some(sun) => sun,
    } {
        SunSettings::Fixed { direction } => {
            let lat = trig::atan2(direction.z, direction.truncate().length()).to_degrees();
            let lon = trig::atan2(direction.y, direction.x).to_degrees();
            let stands = |lat, lon| Geodetic::from_degrees(lat, lon, 0.0).normal() == direction;
            // Both were decimals once, so few digits of both give the same direction, perhaps after
            // a whole turn.
            let turns = [lon, lon - 360.0, lon + 360.0].into_iter();
            let tried = turns.flat_map(|lon| (0..16).map(move |digits| (lon, digits)));
            let mut tried = tried.map(|(lon, digits)| [lat, lon].map(|deg| rounded(deg, digits)));
            let [lat, lon] = tried.find(|&[lat, lon]| stands(lat, lon)).unwrap_or([lat, lon]);
            format!("Some((latitude_deg: {lat:?}, longitude_deg: {lon:?}))")
        }
        SunSettings::Clock { start_unix_s, runs } => {
            format!("Some(Clock(utc: \"{}\", runs: {runs}))", utc_text(start_unix_s))
        }
    }
}

/// The number of fewest decimals, or else the nearest, that is the `same` when it is read.
fn short(value: f64, same: impl Fn(f64) -> bool) -> f64 {
    let decimals = (0..16).map(|digits| rounded(value, digits));
    let nearby = [value, value.next_up(), value.next_down()];
    decimals.chain(nearby).find(|&tried| same(tried)).unwrap_or(value)
}

fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.digits$}").parse().expect("digits of a number are one")
}

/// A text with what would end it escaped.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Preset, read};

    fn comes_back(text: &str) {
        let settings = read(text, "a.ron").unwrap();
        let written = write(&settings).unwrap();
        assert_eq!(read(&written, "b.ron").unwrap(), settings, "{written}");
        assert_eq!(write(&read(&written, "b.ron").unwrap()).unwrap(), written);
    }

    #[test]
    fn presets_come_back_as_they_were() {
        Preset::ALL.into_iter().for_each(|preset| comes_back(preset.text()));
    }

    #[test]
    fn every_kind_of_setting_comes_back() {
        comes_back(
            "Scene(body: Ellipsoid(a_m: 1234567.875, f: 0.0033528106647474805), sources: [
                Archive(\"a b/\\\"c\\\\d.pmtiles\"), Archive(\"https://h/p.pmtiles\"),
                Procedural(seed: 18446744073709551615, relief: 0.1, finest_m: 0.3, detail: 0.0)],
             imagery: [\"blue.pmtiles\"], sea: true,
             sun: Some(Clock(utc: \"2026-06-21T12:00:00Z\", runs: false)),
             lod: (tolerance_px: 0.3, triangles_max: 16000000, patch_depth: 8, level_max: 41,
                   morph_s: 1e-3),
             views: [(name: \"a\", field_of_view_deg: 59.3, yaw_deg: -33.3, pitch_deg: 0.1),
                     (name: \"b-2\", field_of_view_deg: 0.01, near_m: 1e-3)],
             vertices: EyeF64, depth: (format: D24, order: Forward, ranges: Auto),
             memory: (pages_mib: 65536))",
        );
        comes_back("Scene(body: Mars, sources: [Archive(\"m.pmtiles\")], depth: (ranges: 3))");
        for lon in ["-359.9", "0.1", "12.3456789", "180.0", "-77.7"] {
            let sun = format!("Some((latitude_deg: 33.3, longitude_deg: {lon}))");
            comes_back(&format!("Scene(body: Wgs84, sun: {sun})"));
        }
    }

    #[test]
    fn what_no_scene_may_be_is_refused_with_field_and_range() {
        let mut settings = read(Preset::Earth.text(), "a.ron").unwrap();
        settings.lod.triangles_max = 64;
        let text = write(&settings).unwrap_err().to_string();
        assert!(text.contains("lod.triangles_max: is 64, allowed is 128 to"), "{text}");
        settings.lod.triangles_max = 1000;
        settings.memory.pages_bytes += 1;
        assert_eq!(write(&settings).unwrap_err(), WriteFault::Unwritable("memory"));
    }
}

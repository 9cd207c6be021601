//! The `sun` of a scene file: a fixed place, or a clock.
//!
//! In:    the tree of `sun`.
//! Out:   [`SunSettings`].
//! Keeps: nothing.
//! Not here: times as texts (`utc`), where the sun stands then (`overfly_core::sun`).

use crate::fields::{Group, Reader, Shape};
use crate::node::{Kind, Node};
use crate::utc::{YEAR_MAX, YEAR_MIN, utc_seconds};
use overfly_core::geodesy::Geodetic;
use overfly_core::settings::SunSettings;

const SUN: Shape = Shape { name: "Sun", fields: &["latitude_deg", "longitude_deg"] };
const CLOCK: Shape = Shape { name: "Clock", fields: &["utc", "runs"] };
const EXPECTED: &str = "None, Some((latitude_deg: …, longitude_deg: …)) or Some(Clock(utc: …))";

/// Outer `None`: a fault. Inner `None`: no sun.
pub(crate) fn sun<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<Option<SunSettings>> {
    let Some(node) = scene.get("sun") else { return Some(None) };
    let inner = match &node.kind {
        Kind::Word(name) if name == "None" => return Some(None),
        Kind::Tuple(Some(name), items) if name == "Some" && items.len() == 1 => &items[0],
        _ => {
            reader.wrong_type(node, "sun", EXPECTED);
            return None;
        }
    };
    let clock = matches!(&inner.kind, Kind::Word(name) | Kind::Struct(Some(name), _)
        | Kind::Tuple(Some(name), _) if name == CLOCK.name);
    if clock { running(reader, inner) } else { fixed(reader, inner) }.map(Some)
}

fn fixed<'t>(reader: &mut Reader<'t>, node: &'t Node) -> Option<SunSettings> {
    let sun = reader.group(node, "sun", &SUN)?;
    let latitude_deg = reader.required_number(&sun, "latitude_deg", -90.0..=90.0);
    let longitude_deg = reader.required_number(&sun, "longitude_deg", -360.0..=360.0);
    let below = Geodetic::from_degrees(latitude_deg?, longitude_deg?, 0.0);
    Some(SunSettings::Fixed { direction: below.normal() })
}

fn running<'t>(reader: &mut Reader<'t>, node: &'t Node) -> Option<SunSettings> {
    let clock = reader.group(node, "sun", &CLOCK)?;
    let start_unix_s = utc(reader, &clock);
    let runs = reader.switch(&clock, "runs", true);
    Some(SunSettings::Clock { start_unix_s: start_unix_s?, runs: runs? })
}

fn utc(reader: &mut Reader, clock: &Group) -> Option<f64> {
    let Some(node) = clock.get("utc") else {
        reader.missing(clock, "utc", "a time like \"2026-06-21T12:00:00Z\"");
        return None;
    };
    let path = clock.path_of("utc");
    let Kind::Text(text) = &node.kind else {
        reader.wrong_type(node, &path, "a text like \"2026-06-21T12:00:00Z\"");
        return None;
    };
    let unix_s = utc_seconds(text);
    if unix_s.is_none() {
        let allowed =
            format!("a time like \"2026-06-21T12:00:00Z\", of the years {YEAR_MIN} to {YEAR_MAX}");
        reader.out_of_range(node, &path, allowed);
    }
    unix_s
}

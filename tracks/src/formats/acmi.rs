//! Tacview's ACMI 2.x, as text.
//!
//! In:    the text of a file.
//! Out:   a fix each time that an object is given a place; each object is a recording.
//! Keeps: nothing.
//! Not here: unpacking (`format`), events, everything of an object but its place and name.
//! Source: Raia Software, "Technical Reference, ACMI flight recordings 2.2".
//!
//! By hand: the crate `tacview` 0.2 does not compile with today's `zip`, and gives no columns.

use crate::clock::{self, SECOND_NS};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, Fix, Said, Sink};
use std::collections::BTreeMap;

/// Most seconds of a frame: a year.
const FRAME_S: f64 = 31_536_000.0;

/// What is known of an object: places are written only as far as they change, names and types once,
/// with the first place or before.
struct Object {
    /// Its recording, from its first place on.
    track: Option<u32>,
    /// What it is, and who flies it: a mission has many of one kind.
    name: Option<String>,
    pilot: Option<String>,
    /// Whether its type says that it is no aircraft.
    is_aside: bool,
    /// Longitude, latitude (with the reference's added), metres, roll, pitch, yaw.
    place: [f64; 6],
}

impl Default for Object {
    fn default() -> Self {
        Self { track: None, name: None, pilot: None, is_aside: false, place: [f64::NAN; 6] }
    }
}

#[derive(Default)]
struct Scene<'a> {
    /// By number; some writers make up words instead.
    objects: BTreeMap<(u64, &'a str), Object>,
    /// UTC of frame 0.
    start_ns: i64,
    /// The frame, since the start.
    frame_ns: i64,
    reference_deg: [f64; 2],
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let mut scene = Scene::default();
    sink.fixes.said = Said::Declared(Datum::Msl, "Tacview's files are by definition".into());
    let version = sink.text.lines().find_map(|line| line.trim().strip_prefix("FileVersion="));
    if let Some(version) = version.filter(|version| version.starts_with("1.")) {
        let at = sink.text.offset(version);
        let wrong =
            Wrong::new(at, "FileVersion", version, "2.0 to 2.2; Tacview saves older ones anew");
        return Err(TrackError::Fault(sink.text.fault(wrong)));
    }
    // A backslash at the end of a line goes on with the value: such lines hold no place.
    let mut continues = false;
    for line in sink.text.lines() {
        let within = continues;
        continues = line.ends_with('\\');
        if within {
            continue;
        }
        match record(sink, &mut scene, line) {
            Ok(Some(fix)) => sink.push(fix)?,
            Ok(None) => {}
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

fn record<'a>(
    sink: &mut Sink<'_>,
    scene: &mut Scene<'a>,
    line: &'a str,
) -> Result<Option<Fix>, Wrong> {
    let at = sink.text.offset(line);
    if let Some(seconds) = line.strip_prefix('#') {
        let value = sink.number("frame", seconds, -FRAME_S..=FRAME_S)?;
        #[expect(clippy::cast_possible_truncation, reason = "at most 4e16, by the range above")]
        let ns = (value * SECOND_NS as f64).round() as i64;
        scene.frame_ns = ns;
        return Ok(None);
    }
    if let Some(id) = line.strip_prefix('-') {
        let number = u64::from_str_radix(id.trim(), 16).ok();
        scene.objects.remove(&number.map_or((0, id), |number| (number, "")));
        return Ok(None);
    }
    let mut parts = properties(line);
    let Some(id) = parts.next() else { return Ok(None) };
    let number = u64::from_str_radix(id.trim(), 16).ok();
    if number.is_none() && !line.contains(",T=") {
        let is_header =
            line.is_empty() || line.starts_with("FileType") || line.starts_with("FileV");
        let is_comment = is_header || line.starts_with("//");
        let wrong = || Wrong::new(at, "object", id, "a hexadecimal number");
        return if is_comment { Ok(None) } else { Err(wrong()) };
    }
    let id = number.map_or((0, id), |number| (number, ""));
    if id == (0, "") {
        let mut pairs = parts.filter_map(|part| part.split_once('='));
        return pairs.try_for_each(|(key, value)| global(sink, scene, key, value)).map(|()| None);
    }
    let object = scene.objects.entry(id).or_default();
    let mut place = None;
    for part in parts {
        match part.split_once('=') {
            Some(("T", value)) => place = Some(value),
            Some(("Name", value)) => object.name = Some(value.replace("\\,", ",")),
            Some(("CallSign" | "Pilot", value)) if object.pilot.is_none() => {
                object.pilot = Some(value.replace("\\,", ","));
            }
            Some(("Type", value)) => object.is_aside = !value.starts_with("Air"),
            _ => {}
        }
    }
    let Some(place) = place else { return Ok(None) };
    let track = *object.track.get_or_insert_with(|| {
        let track = u32::try_from(sink.fixes.names.len()).unwrap_or(u32::MAX);
        let names = [&object.name, &object.pilot].into_iter().flatten();
        let names: Vec<&str> = names.map(String::as_str).filter(|name| !name.is_empty()).collect();
        let bare = if id.1.is_empty() { format!("{:x}", id.0) } else { id.1.to_owned() };
        sink.fixes.names.push(if names.is_empty() { bare } else { names.join(", ") });
        track
    });
    if object.is_aside {
        sink.fixes.asides.insert(track);
    }
    object.place = placed(sink, scene.reference_deg, object.place, place)?;
    let [lon, lat, height, roll, pitch, yaw] = object.place;
    let mut fix = Fix::new(track, scene.start_ns + scene.frame_ns, at);
    if !(lon.is_finite() && lat.is_finite()) {
        sink.fixes.without_position += 1;
        return Ok(None);
    }
    (fix.lon_deg, fix.lat_deg, fix.height_m) = (lon, lat, height);
    fix.attitude_deg = [yaw, pitch, roll];
    Ok(Some(fix))
}

fn global(sink: &Sink<'_>, scene: &mut Scene<'_>, key: &str, value: &str) -> Result<(), Wrong> {
    match key {
        "ReferenceTime" => {
            let at = sink.text.offset(value);
            let wrong = || Wrong::new(at, key, value, "a time, as 2024-07-15T09:00:00Z");
            scene.start_ns = clock::iso(value).ok_or_else(wrong)?.ns;
        }
        "ReferenceLongitude" => {
            scene.reference_deg[0] = sink.number(key, value, -360.0..=360.0)?;
        }
        "ReferenceLatitude" => scene.reference_deg[1] = sink.number(key, value, -180.0..=180.0)?,
        _ => {}
    }
    Ok(())
}

/// The place with the parts of it that a `T=` has.
fn placed(
    sink: &mut Sink<'_>,
    reference_deg: [f64; 2],
    mut place: [f64; 6],
    text: &str,
) -> Result<[f64; 6], Wrong> {
    let parts: Vec<&str> = text.split('|').collect();
    let columns: &[usize] = match parts.len() {
        3 | 5 => &[0, 1, 2],
        6 | 9 => &[0, 1, 2, 3, 4, 5],
        count => {
            let found = format!("{count} parts");
            return Err(Wrong::new(sink.text.offset(text), "T", &found, "3, 5, 6 or 9 parts"));
        }
    };
    for &column in columns {
        let part = parts[column].trim();
        let at = sink.text.offset(part);
        if part.is_empty() {
            continue;
        }
        let value = match column {
            0 => sink.lon_offset(part, at)? + reference_deg[0],
            1 => {
                let sum = sink.lat_offset(part, at)? + reference_deg[1];
                if sum.abs() > 90.0 {
                    return Err(Wrong::new(at, "latitude", part, "-90 to 90 with the reference's"));
                }
                sum
            }
            2 => sink.height_at(part, at)?,
            _ => sink.angle_at(["roll", "pitch", "yaw"][column - 3], part, at)?,
        };
        place[column] = value;
    }
    Ok(place)
}

/// The parts between commas that no backslash stands before.
fn properties(line: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(line);
    core::iter::from_fn(move || {
        let text = rest?;
        let is_end = |(at, byte): &(usize, u8)| {
            *byte == b',' && !(*at > 0 && text.as_bytes()[at - 1] == b'\\')
        };
        let end = text.bytes().enumerate().find(is_end).map(|(at, _)| at);
        rest = end.map(|end| &text[end + 1..]);
        Some(&text[..end.unwrap_or(text.len())])
    })
}

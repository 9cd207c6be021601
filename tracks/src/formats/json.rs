//! ADS-B as JSON: records, lines of records, columns as pandas writes them, OpenSky's tracks and
//! states, readsb's traces and snapshots.
//!
//! In:    the text of a file.
//! Out:   a fix for each record with a position; each aircraft is a recording.
//! Keeps: nothing.
//! Not here: tables (`table`).
//!
//! serde_json says where text is no JSON; where a value stands that is wrong in itself is known
//! because values are kept as parts of the text until they are needed.

use super::table::time_of;
use crate::clock::Clock;
use crate::columns::TimeUnit;
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, FOOT_M, Fix, Said, Sink};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

/// What is where in OpenSky's arrays; the others are not needed.
const STATES: [&str; 14] = [
    "icao24",
    "callsign",
    "origin_country",
    "time_position",
    "last_contact",
    "longitude",
    "latitude",
    "baro_altitude",
    "on_ground",
    "velocity",
    "true_track",
    "vertical_rate",
    "sensors",
    "geo_altitude",
];

type Record<'j> = BTreeMap<String, &'j RawValue>;

/// What one aircraft's records share.
#[derive(Default)]
struct Aircraft {
    track: u32,
    clock: Clock,
}

#[derive(Default)]
struct State {
    aircraft: BTreeMap<String, Aircraft>,
    /// Whether any height was geometric.
    geometric: bool,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let text = sink.text.all;
    sink.fixes.said = Said::Habit(Datum::Pressure, "transponders send that".into());
    let mut state = State::default();
    let mut values = serde_json::Deserializer::from_str(text).into_iter::<&RawValue>();
    // One value, or a record a line.
    while let Some(value) = values.next() {
        match value {
            Ok(value) => whole(sink, &mut state, value)?,
            Err(error) => {
                let at = values.byte_offset().min(text.len());
                let wrong = broken(sink, at, &error);
                if sink.fixes.track.len() < 10 {
                    return Err(TrackError::Fault(sink.text.fault(wrong)));
                }
                sink.bad(wrong);
                break;
            }
        }
    }
    if state.geometric {
        let why = "geometric altitudes of transponders are";
        sink.fixes.said = Said::Habit(Datum::Ellipsoid, why.into());
    }
    Ok(())
}

/// serde_json counts lines and columns from what it was given: a text or a part of it.
fn broken(sink: &Sink<'_>, from: usize, error: &serde_json::Error) -> Wrong {
    let rest = sink.text.all.get(from..).unwrap_or("");
    let lines = sink.text.all.lines();
    let before: usize = lines.take(error.line().saturating_sub(1)).map(|line| line.len() + 1).sum();
    let at = (before + error.column().saturating_sub(1)).max(from);
    let found = sink.text.all.get(at..).unwrap_or(rest);
    let found = found.lines().next().unwrap_or("").to_owned();
    let why = error.to_string();
    let why = why.split(" at line ").next().unwrap_or("").to_owned();
    Wrong::new(at, "JSON", &found, format!("well-formed JSON ({why})"))
}

/// A value of the file: a list of records, or one record that may hold a list.
fn whole(sink: &mut Sink<'_>, state: &mut State, value: &RawValue) -> Result<(), TrackError> {
    if let Ok(records) = serde_json::from_str::<Vec<&RawValue>>(value.get()) {
        for record in records {
            match serde_json::from_str::<Record<'_>>(record.get()) {
                Ok(record) => one(sink, state, &record)?,
                Err(_) => {
                    let at = sink.text.offset(record.get());
                    sink.bad(Wrong::new(at, "record", record.get(), "a JSON object"));
                }
            }
        }
        return Ok(());
    }
    let Ok(record) = serde_json::from_str::<Record<'_>>(value.get()) else {
        let at = sink.text.offset(value.get());
        let wrong = Wrong::new(at, "JSON", value.get(), "a list of records, or a record");
        return Err(TrackError::Fault(sink.text.fault(wrong)));
    };
    for (list, is_trace) in [("path", false), ("trace", true)] {
        if let Some(rows) = record.get(list) {
            return rows_of(sink, state, (&record, rows, is_trace));
        }
    }
    for list in ["aircraft", "ac", "states", "trail"] {
        if let Some(rows) = record.get(list) {
            return snapshot(sink, state, (&record, rows));
        }
    }
    let is_columns = record.get("latitude").or(record.get("lat"));
    if is_columns.is_some_and(|column| column.get().starts_with('{')) {
        return columns(sink, state, &record);
    }
    one(sink, state, &record)
}

/// All aircraft at one time: readsb's and tar1090's records, which may name how many seconds ago a
/// place was seen, or OpenSky's arrays. Or Flightradar24's trail of one, whose records have times.
fn snapshot(
    sink: &mut Sink<'_>,
    state: &mut State,
    (record, rows): (&Record<'_>, &RawValue),
) -> Result<(), TrackError> {
    let now = record.get("now").or(record.get("time")).copied();
    for row in serde_json::from_str::<Vec<&RawValue>>(rows.get()).unwrap_or_default() {
        let array = serde_json::from_str::<Vec<&RawValue>>(row.get());
        let named = match array {
            Ok(parts) => {
                let names = STATES.iter().zip(parts);
                names.map(|(name, part)| ((*name).to_owned(), part)).collect()
            }
            Err(_) => serde_json::from_str::<Record<'_>>(row.get()).unwrap_or_default(),
        };
        let mut named: Record<'_> =
            named.into_iter().filter(|(_, value)| value.get() != "null").collect();
        if let Some(now) = now {
            named.entry("now".into()).or_insert(now);
        }
        one(sink, state, &named)?;
    }
    Ok(())
}

/// Objects of columns by row, as pandas writes a table without being told otherwise.
fn columns(sink: &mut Sink<'_>, state: &mut State, record: &Record<'_>) -> Result<(), TrackError> {
    let mut rows: BTreeMap<(usize, String), Record<'_>> = BTreeMap::new();
    for (name, column) in record {
        for (row, value) in serde_json::from_str::<Record<'_>>(column.get()).unwrap_or_default() {
            // Rows are numbered mostly: 10 comes after 9.
            rows.entry((row.len(), row)).or_default().insert(name.clone(), value);
        }
    }
    rows.values().try_for_each(|record| one(sink, state, record))
}

/// Adds what a record gave.
fn add(sink: &mut Sink<'_>, found: Result<Option<Fix>, Wrong>) -> Result<(), TrackError> {
    match found {
        Ok(Some(fix)) => sink.push(fix)?,
        Ok(None) => sink.fixes.without_position += 1,
        Err(wrong) => sink.bad(wrong),
    }
    Ok(())
}

fn text_of(value: &RawValue) -> Option<&str> {
    let text = value.get();
    let is_none = matches!(text, "null" | "\"NaT\"" | "NaN");
    (!is_none).then(|| text.trim_matches('"'))
}

fn aircraft<'s>(sink: &mut Sink<'_>, state: &'s mut State, id: &str) -> &'s mut Aircraft {
    state.aircraft.entry(id.to_owned()).or_insert_with(|| {
        sink.fixes.names.push(id.to_owned());
        let track = u32::try_from(sink.fixes.names.len() - 1).unwrap_or(u32::MAX);
        Aircraft { track, clock: Clock::default() }
    })
}

fn one(sink: &mut Sink<'_>, state: &mut State, record: &Record<'_>) -> Result<(), TrackError> {
    let found = fix_of(sink, state, record);
    add(sink, found)
}

fn fix_of(
    sink: &mut Sink<'_>,
    state: &mut State,
    record: &Record<'_>,
) -> Result<Option<Fix>, Wrong> {
    let get = |names: &[&str]| {
        names.iter().find_map(|name| record.get(*name)).and_then(|value| text_of(value))
    };
    let (lat, lon) = (get(&["latitude", "lat"]), get(&["longitude", "lon", "lng"]));
    let (Some(lat), Some(lon)) = (lat, lon) else { return Ok(None) };
    let measured = get(&["time_position", "lastposupdate", "last_position"]);
    let Some(time) = measured.or(get(&["timestamp", "time", "ts", "now"])) else {
        return Err(Wrong::new(sink.text.offset(lat), "time", "nothing", "timestamp or time"));
    };
    let id = get(&["icao24", "hex", "icao", "flight_id"]).unwrap_or("");
    let aircraft = aircraft(sink, state, id);
    let at = sink.text.offset(time);
    let mut time_ns = time_of(time, at, TimeUnit::Auto, &mut aircraft.clock)?;
    if let Some(ago) = get(&["seen_pos"]) {
        #[expect(clippy::cast_possible_truncation, reason = "at most 1e15, by the range given")]
        let ago_ns = (sink.number("seen_pos", ago, 0.0..=1e6)? * 1e9).round() as i64;
        time_ns = time_ns.saturating_sub(ago_ns);
    }
    let mut fix = Fix::new(aircraft.track, time_ns, at);
    fix.lat_deg = sink.lat(lat)?;
    fix.lon_deg = sink.lon(lon)?;
    // OpenSky's names are in metres, those of others in feet.
    let is_metres = record.contains_key("baroaltitude") || record.contains_key("baro_altitude");
    let unit_m = if is_metres { 1.0 } else { FOOT_M };
    (sink.height_unit_m, sink.pressure_unit_m) = (unit_m, unit_m);
    let pressure = get(&["baroaltitude", "baro_altitude", "altitude", "alt_baro", "alt"]);
    if let Some(text) = pressure.filter(|text| *text != "ground") {
        fix.pressure_m = sink.pressure_at(text, sink.text.offset(text))?;
    }
    if let Some(text) = get(&["geoaltitude", "geo_altitude", "alt_geom"]) {
        fix.height_m = sink.height(text)?;
        state.geometric = true;
    }
    Ok(Some(fix))
}

/// Rows of arrays: OpenSky's `[time, lat, lon, metres, track, on ground]`, readsb's `[seconds since
/// timestamp, lat, lon, feet, speed, track, flags, climb, details, source, geometric feet, …]`.
fn rows_of(
    sink: &mut Sink<'_>,
    state: &mut State,
    (record, rows, is_trace): (&Record<'_>, &RawValue, bool),
) -> Result<(), TrackError> {
    let unit_m = if is_trace { FOOT_M } else { 1.0 };
    (sink.height_unit_m, sink.pressure_unit_m) = (unit_m, unit_m);
    let id = record.get("icao24").or(record.get("icao")).and_then(|value| text_of(value));
    let track = aircraft(sink, state, id.unwrap_or("")).track;
    let start = record.get("timestamp").and_then(|value| text_of(value)).filter(|_| is_trace);
    let start_ns = match start {
        None => 0,
        Some(text) => {
            let at = sink.text.offset(text);
            match time_of(text, at, TimeUnit::Auto, &mut Clock::default()) {
                Ok(ns) => ns,
                Err(wrong) => return Err(TrackError::Fault(sink.text.fault(wrong))),
            }
        }
    };
    let Ok(rows) = serde_json::from_str::<Vec<&RawValue>>(rows.get()) else {
        let wrong = Wrong::new(sink.text.offset(rows.get()), "rows", rows.get(), "a list");
        return Err(TrackError::Fault(sink.text.fault(wrong)));
    };
    for row in rows {
        let found = row_of(sink, row, (start_ns, is_trace), &mut state.geometric);
        add(sink, found.map(|fix| fix.map(|fix| Fix { track, ..fix })))?;
    }
    Ok(())
}

fn row_of(
    sink: &mut Sink<'_>,
    row: &RawValue,
    (start_ns, is_trace): (i64, bool),
    geometric: &mut bool,
) -> Result<Option<Fix>, Wrong> {
    let at = sink.text.offset(row.get());
    let parts: Vec<&RawValue> = serde_json::from_str(row.get()).unwrap_or_default();
    if parts.len() < 4 {
        return Err(Wrong::new(
            at,
            "row",
            row.get(),
            "a list of time, latitude, longitude, height",
        ));
    }
    let part = |i: usize| parts.get(i).and_then(|part| text_of(part));
    let (Some(time), Some(lat), Some(lon)) = (part(0), part(1), part(2)) else { return Ok(None) };
    let unit = if is_trace { TimeUnit::Seconds } else { TimeUnit::Auto };
    let ns = time_of(time, sink.text.offset(time), unit, &mut Clock::default())?;
    let mut fix = Fix::new(0, start_ns.saturating_add(ns), at);
    fix.lat_deg = sink.lat(lat)?;
    fix.lon_deg = sink.lon(lon)?;
    if let Some(text) = part(3).filter(|text| *text != "ground") {
        fix.pressure_m = sink.pressure_at(text, sink.text.offset(text))?;
    }
    if let Some(text) = part(10).filter(|_| is_trace) {
        fix.height_m = sink.height(text)?;
        *geometric = true;
    }
    Ok(Some(fix))
}

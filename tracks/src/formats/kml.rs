//! KML: `gx:Track` with or without angles, and placemarks with a time and a point.
//!
//! In:    the text of a file.
//! Out:   a fix for each time with a place; each track is a recording, all placemarks are one.
//! Keeps: nothing.
//! Not here: lines without times, models, pictures; unpacking KMZ (`format`).
//! Source: OGC KML 2.3, and Google's KML reference for `gx:Track`.

use super::xml::{Step, walk};
use crate::clock::{self, Clock};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, Fix, Said, Sink};

type Piece = (String, usize);

/// A `gx:Track` or a placemark while it is open: its arrays may come in turn or one by one.
#[derive(Default)]
struct Open {
    times: Vec<Piece>,
    places: Vec<Piece>,
    angles: Vec<Piece>,
    is_point: bool,
}

#[derive(Default)]
struct State {
    track: Option<Open>,
    placemark: Option<Open>,
    /// The recording that placemarks make together.
    points: Option<u32>,
    name: String,
    modes: Vec<String>,
    timeless: usize,
    clock: Clock,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let mut state = State::default();
    walk(sink, |sink, step, _| {
        match step {
            Step::Begin("Track", _) => state.track = Some(Open::default()),
            Step::Begin("Placemark", _) => {
                state.placemark = Some(Open::default());
                state.name.clear();
            }
            Step::Begin("Point", _) => {
                if let Some(open) = &mut state.placemark {
                    open.is_point = true;
                }
            }
            Step::Begin(..) => {}
            Step::End("Track", ..) => {
                let Some(open) = state.track.take() else { return Ok(()) };
                let track = begin(sink, &state.name);
                state.clock = Clock::default();
                add(sink, &mut state.clock, track, &open)?;
            }
            Step::End("Placemark", ..) => {
                let Some(open) = state.placemark.take().filter(|open| open.is_point) else {
                    return Ok(());
                };
                if open.times.is_empty() {
                    state.timeless += 1;
                    return Ok(());
                }
                let track = *state.points.get_or_insert_with(|| begin(sink, ""));
                add(sink, &mut state.clock, track, &open)?;
            }
            Step::End(name, text, at) => piece(&mut state, name, text, at),
        }
        Ok(())
    })?;
    if sink.fixes.track.is_empty() && sink.fixes.fault_count == 0 && state.timeless > 0 {
        let why = format!("none of its {} lines and points has a time", state.timeless);
        return Err(TrackError::Empty { format: sink.fixes.format, why });
    }
    sink.fixes.said = said(&state.modes);
    Ok(())
}

fn begin(sink: &mut Sink<'_>, name: &str) -> u32 {
    sink.fixes.names.push(name.to_owned());
    u32::try_from(sink.fixes.names.len() - 1).unwrap_or(u32::MAX)
}

fn piece(state: &mut State, name: &str, text: &str, at: usize) {
    let value = (text.to_owned(), at);
    let open = state.track.as_mut().or(state.placemark.as_mut());
    match (name, open) {
        ("altitudeMode", _) => state.modes.push(text.to_owned()),
        ("name", Some(_)) => text.clone_into(&mut state.name),
        ("when", Some(open)) => open.times.push(value),
        ("coord", Some(open)) => open.places.push(value),
        ("angles", Some(open)) => open.angles.push(value),
        ("coordinates", Some(open)) if open.is_point => open.places.push(value),
        ("coordinates", _) => state.timeless += 1,
        _ => {}
    }
}

/// Altitudes count from the sea where the mode is absolute.
fn said(modes: &[String]) -> Said {
    match modes.iter().find(|mode| mode.as_str() != "absolute") {
        None if modes.is_empty() => {
            Said::Habit(Datum::Msl, "it has no altitudeMode, and most writers mean that".into())
        }
        None => Said::Declared(Datum::Msl, "altitudeMode says absolute".into()),
        Some(mode) => Said::Unknown(format!("altitudeMode says {mode}, which is above no datum")),
    }
}

fn add(sink: &mut Sink<'_>, clock: &mut Clock, track: u32, open: &Open) -> Result<(), TrackError> {
    let Open { times, places, angles, .. } = open;
    if times.len() != places.len() {
        let last = times.last().or(places.last()).map_or(0, |piece| piece.1);
        let found = format!("{} times, {} places", times.len(), places.len());
        sink.bad(Wrong::new(last, "gx:Track", &found, "as many of both"));
    }
    for (i, (time, place)) in times.iter().zip(places).enumerate() {
        if place.0.is_empty() {
            sink.fixes.without_position += 1;
            continue;
        }
        match fix(sink, clock, (time, place), angles.get(i)) {
            Ok(fix) => sink.push(Fix { track, ..fix })?,
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

fn fix(
    sink: &mut Sink<'_>,
    clock: &mut Clock,
    (time, place): (&Piece, &Piece),
    angles: Option<&Piece>,
) -> Result<Fix, Wrong> {
    let wrong = || Wrong::new(time.1, "when", &time.0, "a time, as 2024-07-15T09:00:00Z");
    let time_ns = clock.whole(clock::iso(&time.0).ok_or_else(wrong)?);
    let mut found = Fix::new(0, time_ns, place.1);
    let parts = pieces(place);
    let [lon, lat] =
        [parts.first(), parts.get(1)].map(|part| part.copied().unwrap_or(("", place.1)));
    found.lon_deg = sink.lon_at(lon.0, lon.1)?;
    found.lat_deg = sink.lat_at(lat.0, lat.1)?;
    if let Some((height, at)) = parts.get(2) {
        found.height_m = sink.height_at(height, *at)?;
    }
    if let Some(angles) = angles.filter(|angles| !angles.0.is_empty()) {
        let parts = pieces(angles);
        for (i, field) in ["heading", "tilt", "roll"].into_iter().enumerate() {
            let (text, at) = parts.get(i).copied().unwrap_or(("", angles.1));
            found.attitude_deg[i] = sink.angle_at(field, text, at)?;
        }
    }
    Ok(found)
}

/// The numbers between blanks or commas, with their offsets.
fn pieces((text, at): &Piece) -> Vec<(&str, usize)> {
    let parts = text.split([' ', ',', '\t', '\n', '\r']).filter(|part| !part.is_empty());
    parts.map(|part| (part, at + (part.as_ptr() as usize - text.as_ptr() as usize))).collect()
}

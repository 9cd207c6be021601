//! KML: `gx:Track` with or without angles, placemarks with a time and a point, `GpsDump`'s lines.
//!
//! In:    the text of a file.
//! Out:   a fix for each time with a place; each track is a recording, all placemarks are one.
//! Keeps: nothing.
//! Not here: lines without times, models, pictures; unpacking KMZ (`unpack`).
//! Source: OGC KML 2.3, Google's KML reference for `gx:Track`; the FAI's competition software FS for
//! `SecondsFromTimeOfFirstPoint` beside a line.

use super::xml::{Step, walk};
use crate::clock::{self, Clock, SECOND_NS};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, Fix, Said, Sink, number_at};

/// Names of arrays that hold heading, pitch and roll, as `ForeFlight` and others write them.
const ARRAYS: [&[&str]; 3] = [&["heading", "course"], &["pitch"], &["bank", "roll"]];

type Piece = (String, usize);

/// A `gx:Track` or a placemark while it is open: its arrays may come in turn or one by one.
#[derive(Default)]
struct Open {
    times: Vec<Piece>,
    places: Vec<Piece>,
    angles: Vec<Piece>,
    /// Headings, pitches and rolls that stand apart; and which of them is being read.
    arrays: [Vec<Piece>; 3],
    array: Option<usize>,
    /// Begin of a time span, which counts where there is no time.
    begin: Option<Piece>,
    /// The altitude mode of what is read, not of lines or views beside it.
    mode: Option<String>,
    line_mode: Option<String>,
    is_point: bool,
    /// Within a line or an area.
    is_line: bool,
    /// A line with its times in seconds after the first: `GpsDump`.
    first: Option<Piece>,
    seconds: Option<Piece>,
    line: Option<Piece>,
}

#[derive(Default)]
struct State {
    track: Option<Open>,
    placemark: Option<Open>,
    /// The recording that placemarks make together.
    points: Option<u32>,
    name: String,
    /// Altitude modes of what gave fixes.
    modes: Vec<String>,
    /// Views that are open: they have times and altitude modes, but of eyes.
    views: usize,
    timeless: usize,
    clock: Clock,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let mut state = State::default();
    walk(sink, |sink, step, _| {
        match step {
            Step::Begin(name, attributes) => begin(&mut state, name, attributes),
            Step::End("LookAt" | "Camera", ..) => state.views = state.views.saturating_sub(1),
            Step::End("Track", ..) => {
                let Some(mut open) = state.track.take() else { return Ok(()) };
                let track = named(sink, &state.name);
                state.clock = Clock::default();
                if open.mode.is_none() {
                    // That of a `gx:MultiTrack` holds for all in it.
                    open.mode = state.placemark.as_ref().and_then(|around| around.mode.clone());
                }
                add(sink, &mut state, track, &open)?;
            }
            Step::End("Placemark", ..) => {
                let Some(open) = state.placemark.take() else { return Ok(()) };
                placemark(sink, &mut state, open)?;
            }
            Step::End(name, text, at) if state.views == 0 => piece(&mut state, name, text, at),
            Step::End(..) => {}
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

fn begin(state: &mut State, name: &str, attributes: &[(String, String)]) {
    let value = |wanted: &str| {
        let found = attributes.iter().find(|(key, _)| key == wanted);
        found.map(|(_, value)| value.clone())
    };
    let open = state.track.as_mut().or(state.placemark.as_mut());
    match (name, open) {
        ("Track", _) => state.track = Some(Open::default()),
        ("Placemark", _) => {
            state.placemark = Some(Open::default());
            state.name.clear();
        }
        ("LookAt" | "Camera", _) => state.views += 1,
        ("Point", Some(open)) => open.is_point = true,
        ("LineString" | "LinearRing" | "Polygon" | "Model", Some(open)) => open.is_line = true,
        ("SimpleArrayData", Some(open)) => {
            let title = value("name").unwrap_or_default().to_ascii_lowercase();
            open.array = ARRAYS.iter().position(|names| names.contains(&title.as_str()));
        }
        ("FsInfo", Some(open)) => open.first = value("time_of_first_point").map(|time| (time, 0)),
        _ => {}
    }
}

fn named(sink: &mut Sink<'_>, name: &str) -> u32 {
    sink.fixes.names.push(name.to_owned());
    u32::try_from(sink.fixes.names.len() - 1).unwrap_or(u32::MAX)
}

fn piece(state: &mut State, name: &str, text: &str, at: usize) {
    let value = (text.to_owned(), at);
    let Some(open) = state.track.as_mut().or(state.placemark.as_mut()) else { return };
    match name {
        "altitudeMode" if !open.is_line || open.seconds.is_some() => {
            open.mode = Some(text.to_owned());
        }
        "altitudeMode" => open.line_mode = Some(text.to_owned()),
        "name" => text.clone_into(&mut state.name),
        "when" => open.times.push(value),
        "begin" => open.begin = Some(value),
        "coord" => open.places.push(value),
        "angles" => open.angles.push(value),
        "value" => open.arrays.iter_mut().enumerate().for_each(|(i, array)| {
            if open.array == Some(i) {
                array.push(value.clone());
            }
        }),
        "SimpleArrayData" => open.array = None,
        "SecondsFromTimeOfFirstPoint" => open.seconds = Some(value),
        "coordinates" if open.is_line => open.line = Some(value),
        "coordinates" if open.is_point => open.places.push(value),
        "LineString" | "LinearRing" | "Polygon" | "Model" => open.is_line = false,
        _ => {}
    }
}

/// What a placemark holds beside tracks: a point with a time, or a line with many.
fn placemark(sink: &mut Sink<'_>, state: &mut State, mut open: Open) -> Result<(), TrackError> {
    if let (Some(_), Some(seconds), Some(line)) = (&open.first, &open.seconds, &open.line) {
        open.times = words_of(seconds);
        open.places = words_of(line);
        let track = named(sink, &state.name);
        return add(sink, state, track, &open);
    }
    let line = open.line.as_ref().map(words_of).unwrap_or_default();
    if let (Some(begin), [first, _], false) = (&open.begin, line.as_slice(), open.is_point) {
        // A track in pieces, each with a span of time: it begins where the last one ended.
        let (times, places) = (vec![begin.clone()], vec![first.clone()]);
        let piece = Open { times, places, mode: open.line_mode, ..Open::default() };
        let track = *state.points.get_or_insert_with(|| named(sink, ""));
        return add(sink, state, track, &piece);
    }
    state.timeless += usize::from(open.line.is_some());
    if !open.is_point {
        return Ok(());
    }
    if open.times.is_empty() {
        open.times.extend(open.begin.take());
    }
    if open.times.is_empty() {
        state.timeless += 1;
        return Ok(());
    }
    let track = *state.points.get_or_insert_with(|| named(sink, ""));
    add(sink, state, track, &open)
}

/// The words of a text, with their offsets.
fn words_of((text, at): &Piece) -> Vec<Piece> {
    let offset = |word: &str| at + (word.as_ptr() as usize - text.as_ptr() as usize);
    text.split_ascii_whitespace().map(|word| (word.to_owned(), offset(word))).collect()
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

fn add(sink: &mut Sink<'_>, state: &mut State, track: u32, open: &Open) -> Result<(), TrackError> {
    let Open { times, places, .. } = open;
    if let Some(mode) = open.mode.as_ref().filter(|mode| !state.modes.contains(mode)) {
        state.modes.push(mode.clone());
    }
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
        let found = time_of(&mut state.clock, time, open.first.as_ref())
            .and_then(|time_ns| placed(sink, time_ns, place))
            .and_then(|fix| turned(sink, fix, open, i));
        match found {
            Ok(fix) => sink.push(Fix { track, ..fix })?,
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

/// A time, or so many seconds after the first.
fn time_of(clock: &mut Clock, time: &Piece, first: Option<&Piece>) -> Result<i64, Wrong> {
    let (whole, after_s) = match first {
        Some(first) => (first, number_at("seconds", &time.0, time.1, 0.0..=1e7)?),
        None => (time, 0.0),
    };
    let wrong = || Wrong::new(whole.1, "when", &whole.0, "a time, as 2024-07-15T09:00:00Z");
    let mut stamp = clock::iso(&whole.0).ok_or_else(wrong)?;
    #[expect(clippy::cast_possible_truncation, reason = "at most 1e16, by the range above")]
    let after_ns = (after_s * SECOND_NS as f64).round() as i64;
    stamp.ns += after_ns;
    Ok(clock.whole(stamp))
}

fn placed(sink: &mut Sink<'_>, time_ns: i64, place: &Piece) -> Result<Fix, Wrong> {
    let mut found = Fix::new(0, time_ns, place.1);
    let parts = pieces(place);
    let [lon, lat] =
        [parts.first(), parts.get(1)].map(|part| part.copied().unwrap_or(("", place.1)));
    found.lon_deg = sink.lon_at(lon.0, lon.1)?;
    found.lat_deg = sink.lat_at(lat.0, lat.1)?;
    if let Some((height, at)) = parts.get(2) {
        found.height_m = sink.height_at(height, *at)?;
    }
    Ok(found)
}

/// The fix with its angles, from `gx:angles` or from three arrays that are as long as the track.
fn turned(sink: &mut Sink<'_>, mut fix: Fix, open: &Open, i: usize) -> Result<Fix, Wrong> {
    const FIELDS: [&str; 3] = ["heading", "pitch", "roll"];
    let is_apart = open.angles.is_empty()
        && open
            .arrays
            .iter()
            .all(|array| array.len() == open.places.len() && !array[i].0.is_empty());
    if let Some(angles) = open.angles.get(i).filter(|angles| !angles.0.is_empty()) {
        let parts = pieces(angles);
        for (c, field) in FIELDS.into_iter().enumerate() {
            let (text, at) = parts.get(c).copied().unwrap_or(("", angles.1));
            fix.attitude_deg[c] = sink.angle_at(field, text, at)?;
        }
    } else if is_apart {
        for (c, field) in FIELDS.into_iter().enumerate() {
            let (text, at) = &open.arrays[c][i];
            fix.attitude_deg[c] = sink.angle_at(field, text, *at)?;
        }
    }
    Ok(fix)
}

/// The numbers between blanks or commas, with their offsets.
fn pieces((text, at): &Piece) -> Vec<(&str, usize)> {
    let parts = text.split([' ', ',', '\t', '\n', '\r']).filter(|part| !part.is_empty());
    parts.map(|part| (part, at + (part.as_ptr() as usize - text.as_ptr() as usize))).collect()
}

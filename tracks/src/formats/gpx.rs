//! GPX 1.0 and 1.1: tracks, or routes where there are none.
//!
//! In:    the text of a file.
//! Out:   a fix for each point with a time; each track is a recording.
//! Keeps: nothing.
//! Not here: waypoints, extensions of makers.
//! Source: the GPX 1.1 schema, topografix.com.

use super::xml::{Step, walk};
use crate::clock::{self, Clock};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, Fix, Said, Sink};

/// A point while its element is open: texts with their offsets.
#[derive(Default)]
struct Point {
    at: usize,
    lat: Option<String>,
    lon: Option<String>,
    height: Option<(String, usize)>,
    time: Option<(String, usize)>,
    undulation: Option<(String, usize)>,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let mut open: Option<Point> = None;
    let mut clock = Clock::default();
    let (mut timeless, mut undulations, mut waypoints) = (0_usize, 0_usize, 0_usize);
    walk(sink, |sink, step, at| {
        match step {
            Step::Begin("trk" | "rte", _) => {
                sink.fixes.names.push(String::new());
                clock = Clock::default();
            }
            Step::Begin("trkpt" | "rtept", attributes) => {
                let value = |name: &str| {
                    let found = attributes.iter().find(|(key, _)| key == name);
                    found.map(|(_, value)| value.clone())
                };
                open = Some(Point { at, lat: value("lat"), lon: value("lon"), ..Point::default() });
            }
            Step::End("name", text, _) if open.is_none() => {
                if let Some(name) = sink.fixes.names.last_mut().filter(|name| name.is_empty()) {
                    text.clone_into(name);
                }
            }
            Step::End("trkpt" | "rtept", ..) => {
                let Some(point) = open.take() else { return Ok(()) };
                if point.time.is_none() {
                    timeless += 1;
                    return Ok(());
                }
                undulations += usize::from(point.undulation.is_some());
                match fix(sink, &point, &mut clock) {
                    Ok(fix) => sink.push(fix)?,
                    Err(wrong) => sink.bad(wrong),
                }
            }
            Step::End(name, text, text_at) => {
                let Some(point) = &mut open else { return Ok(()) };
                let value = Some((text.to_owned(), text_at));
                match name {
                    "ele" => point.height = value,
                    "time" => point.time = value,
                    "geoidheight" => point.undulation = value,
                    _ => {}
                }
            }
            Step::Begin("wpt", _) => waypoints += 1,
            Step::Begin(..) => {}
        }
        Ok(())
    })?;
    if sink.fixes.track.is_empty() && sink.fixes.fault_count + timeless == 0 && waypoints > 0 {
        let why = format!("no track or route in it, and its {waypoints} waypoints are none");
        return Err(TrackError::Empty { format: sink.fixes.format, why });
    }
    if sink.fixes.track.is_empty() && sink.fixes.fault_count == 0 && timeless > 0 {
        let why = format!("none of its {timeless} points has a time");
        return Err(TrackError::Empty { format: sink.fixes.format, why });
    }
    sink.fixes.without_position = timeless;
    sink.fixes.said = if undulations > 0 {
        Said::Declared(Datum::Msl, "its geoidheights say so".into())
    } else {
        Said::Habit(Datum::Msl, "GPX does not say, and most receivers give that".into())
    };
    Ok(())
}

fn fix(sink: &mut Sink<'_>, point: &Point, clock: &mut Clock) -> Result<Fix, Wrong> {
    let at = point.at;
    let (time, time_at) = point.time.as_ref().map_or(("", at), |(text, at)| (text, *at));
    let wrong = || Wrong::new(time_at, "time", time, "a time, as 2024-07-15T09:00:00Z");
    let time_ns = clock.whole(clock::iso(time).ok_or_else(wrong)?);
    let track = u32::try_from(sink.fixes.names.len().saturating_sub(1)).unwrap_or(u32::MAX);
    let mut found = Fix::new(track, time_ns, at);
    found.lat_deg = sink.lat_at(point.lat.as_deref().unwrap_or(""), at)?;
    found.lon_deg = sink.lon_at(point.lon.as_deref().unwrap_or(""), at)?;
    if let Some((text, at)) = &point.height {
        found.height_m = sink.height_at(text, *at)?;
    }
    if let Some((text, at)) = &point.undulation {
        let allowed = -120.0..=100.0;
        found.undulation_m = crate::fixes::number_at("geoidheight", text, *at, allowed)?;
    }
    Ok(found)
}

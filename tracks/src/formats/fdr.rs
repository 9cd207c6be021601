//! X-Plane's flight data recorder files, versions 1 to 4.
//!
//! In:    the text of a file.
//! Out:   a fix with attitude for each row of data.
//! Keeps: nothing.
//! Not here: instruments; weather (`PRES` is no setting of the altitudes, which are true ones);
//! `CALI`, which lifts X-Plane's replay to its scenery.
//! Source: Laminar Research, "Creating FDR files", x-plane.com, for the kinds of lines and versions 1
//! and 2; the examples for versions 3 and 4 that come with X-Plane 12, whose order of fields public
//! tests of the Python package `xpwebapi` and public converters agree about.
//!
//! By hand: no crate reads it. There are three kinds of rows:
//!
//! | version | row |
//! |---|---|
//! | 1, 2 | `DATA, seconds, temperature, longitude, latitude, feet, radio altitude, aileron, elevator, rudder, pitch, roll, heading` and some 65 more |
//! | 3 | `DATA, seconds, longitude, latitude, feet, heading, pitch, roll`, then what `DREF` lines say |
//! | 4 | `time, longitude, latitude, feet, heading, pitch, roll`, then what `DREF` lines say |
//!
//! Where a version 3 says nothing of `DREF`s and has rows as long as those of versions 1 and 2, it is
//! one of these by another name.

use crate::clock::{self, Clock, DAY_NS, SECOND_NS};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, FOOT_M, Fix, Said, Sink};

/// Fields of longitude, latitude, feet, heading, pitch and roll.
const NEW: [usize; 6] = [1, 2, 3, 4, 5, 6];
const DATA: [usize; 6] = [2, 3, 4, 5, 6, 7];
const OLD: [usize; 6] = [3, 4, 5, 12, 10, 11];
/// Rows of versions 1 and 2 have more fields than this; those of version 3 have seven, and one for
/// each `DREF`.
const OLD_FIELDS: usize = 40;

/// What a row's time counts from.
#[derive(Default)]
struct Start {
    day: i64,
    tod_ns: i64,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let (mut clock, mut start) = (Clock::default(), Start::default());
    sink.height_unit_m = FOOT_M;
    let why = "X-Plane's files are by definition";
    sink.fixes.said = Said::Declared(Datum::Msl, why.into());
    let version = sink.text.lines().filter(|line| !line.trim().is_empty()).nth(1).unwrap_or("");
    let is_new = version.trim_start().starts_with(['3', '4']);
    let mut has_drefs = false;
    for line in sink.text.lines() {
        // Comments may follow what counts.
        let line = line.split("//").next().unwrap_or("");
        let fields: Vec<&str> = line.split(',').collect();
        let kind = fields[0].trim();
        has_drefs |= kind == "DREF";
        let done = match kind {
            "DATE" => date(sink, &fields).map(|day| {
                start.day = day;
                clock.set_day(day);
                None
            }),
            "TIME" => time(sink, fields.get(1).copied().unwrap_or("")).map(|stamp| {
                start.tod_ns = stamp.ns;
                None
            }),
            "DATA" => {
                let is_old = !is_new || (!has_drefs && fields.len() > OLD_FIELDS);
                let columns = if is_old { OLD } else { DATA };
                seconds(sink, &fields, &start)
                    .and_then(|time_ns| fix(sink, &fields, columns, time_ns).map(Some))
            }
            _ if kind.starts_with(|c: char| c.is_ascii_digit()) && fields.len() > 1 => {
                time(sink, fields[0])
                    .and_then(|stamp| fix(sink, &fields, NEW, clock.of_day(stamp)).map(Some))
            }
            _ => continue,
        };
        if sink.fixes.remark.is_none() && !matches!(kind, "DATE" | "TIME") && is_new {
            let line = sink.text.line(sink.text.offset(fields[0]));
            let what = "headings are magnetic by X-Plane's definition, and are taken as true ones";
            sink.fixes.remark = Some((what.into(), line));
        }
        match done {
            Ok(found) => found.map_or(Ok(()), |fix| sink.push(fix))?,
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

/// `MM/DD/YYYY` or `MM/DD/YY`.
fn date(sink: &Sink<'_>, fields: &[&str]) -> Result<i64, Wrong> {
    let text = fields.get(1).copied().unwrap_or("").trim();
    let mut parts = text.splitn(3, '/').map(clock::digits);
    let mut part = || parts.next().flatten();
    let day = match (part(), part(), part()) {
        (Some(month), Some(day), Some(year)) => clock::days(clock::full_year(year), month, day),
        _ => None,
    };
    day.ok_or_else(|| Wrong::new(sink.text.offset(text), "DATE", text, "MM/DD/YYYY"))
}

fn time(sink: &Sink<'_>, text: &str) -> Result<clock::Stamp, Wrong> {
    let text = text.trim();
    let wrong = || Wrong::new(sink.text.offset(text), "time", text, "HH:MM:SS.ss");
    clock::colons(text).ok_or_else(wrong)
}

fn seconds(sink: &Sink<'_>, fields: &[&str], start: &Start) -> Result<i64, Wrong> {
    let text = fields.get(1).copied().unwrap_or(fields[0]);
    let value = sink.number("seconds", text, 0.0..=1e7)?;
    #[expect(clippy::cast_possible_truncation, reason = "at most 1e16, by the range above")]
    let ns = (value * SECOND_NS as f64).round() as i64;
    Ok(start.day * DAY_NS + start.tod_ns + ns)
}

fn fix(sink: &mut Sink<'_>, fields: &[&str], at: [usize; 6], time_ns: i64) -> Result<Fix, Wrong> {
    let start = sink.text.offset(fields[0]);
    let most = at.into_iter().fold(0, usize::max);
    if fields.len() <= most {
        let found = format!("{} fields", fields.len());
        return Err(Wrong::new(start, "row", &found, format!("{} fields at least", most + 1)));
    }
    let [lon, lat, feet, heading, pitch, roll] = at.map(|at| fields[at].trim());
    let mut found = Fix::new(0, time_ns, start);
    found.lon_deg = sink.lon(lon)?;
    found.lat_deg = sink.lat(lat)?;
    found.height_m = sink.height(feet)?;
    for (angle, (field, text)) in
        found.attitude_deg.iter_mut().zip([("heading", heading), ("pitch", pitch), ("roll", roll)])
    {
        *angle = sink.angle_at(field, text, sink.text.offset(text))?;
    }
    Ok(found)
}

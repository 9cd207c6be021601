//! IGC: what gliders' flight recorders write.
//!
//! In:    the text of a file.
//! Out:   a fix for each B record with a position.
//! Keeps: nothing.
//! Not here: signatures, tasks, events.
//! Source: FAI, Technical Specification for IGC-Approved GNSS Flight Recorders, appendix A.
//!
//! By hand rather than with the crate `igc`: that gives no column of a fault, holds altitudes in 16
//! bits, and leaves the LAD, LOD and TDS extensions to its caller.

use crate::clock::{self, Clock, SECOND_NS, Stamp};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, Fix, Said, Sink, number_at};

/// Extensions of a B record that make its fix finer, as byte ranges.
#[derive(Default)]
struct Extensions {
    lat: Option<(usize, usize)>,
    lon: Option<(usize, usize)>,
    second: Option<(usize, usize)>,
}

/// What the header says of altitudes.
#[derive(Default)]
struct Header {
    maker: String,
    /// What follows `HFALG…:`.
    gnss: Option<String>,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let (mut clock, mut extensions) = (Clock::default(), Extensions::default());
    let mut header = Header::default();
    sink.position_unit_deg = 1.0 / 60.0;
    sink.fixes.zero_is_none = true;
    for line in sink.text.lines() {
        let line = line.trim_start();
        match line.as_bytes().first() {
            Some(b'B') => match fix(sink, line, &extensions, &mut clock) {
                Ok(Some(found)) => sink.push(found)?,
                Ok(None) => sink.fixes.without_position += 1,
                Err(wrong) => sink.bad(wrong),
            },
            Some(b'H') => {
                if let Err(wrong) = header_line(sink, line, &mut header, &mut clock) {
                    sink.bad(wrong);
                }
            }
            Some(b'I') => extensions = extensions_of(line),
            Some(b'A') if header.maker.is_empty() => {
                header.maker = line.get(1..4).unwrap_or("").to_ascii_uppercase();
            }
            _ => {}
        }
    }
    sink.fixes.said = said(&header);
    Ok(())
}

/// Heights by the header; without one, approved recorders keep to the specification, and the makers
/// that begin with X are not approved: mostly programs that write what their receiver says.
fn said(header: &Header) -> Said {
    let value = header.gnss.as_deref().unwrap_or("");
    let declared = |datum| Said::Declared(datum, format!("HFALG says {value}"));
    match value.to_ascii_uppercase() {
        upper if upper.contains("ELL") => declared(Datum::Ellipsoid),
        upper if upper.contains("GEO") || upper.contains("MSL") => declared(Datum::Msl),
        upper if upper.contains("NIL") => Said::Unknown("HFALG says that there are none".into()),
        _ => {
            let lacks =
                if value.is_empty() { "it has no HFALG line" } else { "HFALG says nothing" };
            if header.maker.is_empty() || header.maker.starts_with('X') {
                let why = format!("{lacks} and it has no approved maker, and receivers give that");
                return Said::Habit(Datum::Msl, why);
            }
            Said::Habit(
                Datum::Ellipsoid,
                format!("{lacks}, and IGC asks that of approved recorders"),
            )
        }
    }
}

fn header_line(
    sink: &Sink<'_>,
    line: &str,
    header: &mut Header,
    clock: &mut Clock,
) -> Result<(), Wrong> {
    let Some(kind) = line.get(2..5) else { return Ok(()) };
    let rest = &line[5..];
    match kind {
        "DTE" => {
            let begin = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
            let text = rest[begin..].split(',').next().unwrap_or("").trim_end();
            // Some write points or dashes between, or four figures of the year.
            let figures: String = text.chars().filter(|c| !matches!(c, '-' | '.' | '/')).collect();
            let part = |range| figures.get(range).and_then(clock::digits);
            let end = if figures.len() == 8 { 8 } else { 6 };
            let day = match (part(4..end), part(2..4), part(0..2)) {
                (Some(year), Some(month), Some(day)) => {
                    clock::days(clock::full_year(year), month, day)
                }
                _ => None,
            };
            let at = sink.text.offset(text);
            clock.set_day(day.ok_or_else(|| Wrong::new(at, "date", text, "a date, DDMMYY"))?);
        }
        "ALG" => {
            let value = rest.split_once(':').map_or(rest, |(_, value)| value).trim();
            header.gnss = Some(value.to_owned());
        }
        _ => {}
    }
    Ok(())
}

/// `I` and a count, then first and last byte, from 1, and a name of three letters for each.
fn extensions_of(line: &str) -> Extensions {
    let mut found = Extensions::default();
    let mut rest = line.get(3..).unwrap_or("");
    while let Some(part) = rest.get(..7) {
        let from = part.get(0..2).and_then(clock::digits).and_then(|n| usize::try_from(n).ok());
        let to = part.get(2..4).and_then(clock::digits).and_then(|n| usize::try_from(n).ok());
        if let (Some(from @ 36..), Some(to)) = (from, to) {
            let range = Some((from - 1, to));
            match part.get(4..7) {
                Some("LAD") => found.lat = range,
                Some("LOD") => found.lon = range,
                Some("TDS") => found.second = range,
                _ => {}
            }
        }
        rest = rest.get(7..).unwrap_or("");
    }
    found
}

/// The fix of a B record; `None` where the receiver had no position.
fn fix(
    sink: &mut Sink<'_>,
    line: &str,
    extensions: &Extensions,
    clock: &mut Clock,
) -> Result<Option<Fix>, Wrong> {
    let start = sink.text.offset(line);
    let wrong = |at, field: &str, found: &str, expected: &str| {
        Wrong::new(start + at, field, found, expected)
    };
    let part = |from: usize, to: usize| {
        let lacks = || wrong(0, "B record", line, "35 characters at least");
        line.get(from..to).ok_or_else(lacks)
    };
    let extra = |range: Option<(usize, usize)>| {
        let (from, to) = range?;
        line.get(from..to).filter(|text| clock::digits(text).is_some())
    };
    let stamp = clock::compact(part(1, 7)?)
        .ok_or_else(|| wrong(1, "time", &line[1..7], "HHMMSS from 000000 to 235960"))?;
    let lat = angle(part(7, 14)?, extra(extensions.lat));
    let lat = lat.ok_or_else(|| wrong(7, "latitude", &line[7..14], "DDMMmmm"))?;
    let north = sign(part(14, 15)?, ["N", "S"]);
    let north = north.ok_or_else(|| wrong(14, "hemisphere", &line[14..15], "N or S"))?;
    let lon = angle(part(15, 23)?, extra(extensions.lon));
    let lon = lon.ok_or_else(|| wrong(15, "longitude", &line[15..23], "DDDMMmmm"))?;
    let east = sign(part(23, 24)?, ["E", "W"]);
    let east = east.ok_or_else(|| wrong(23, "hemisphere", &line[23..24], "E or W"))?;
    let is_flat = match part(24, 25)? {
        "A" | "3" => false,
        "V" | "2" => true,
        other => return Err(wrong(24, "validity", other, "A or V")),
    };
    let [pressure, gnss] = [part(25, 30)?, part(30, 35)?];
    let mut found = Fix::new(0, time(clock, stamp, extra(extensions.second)), start);
    found.pressure_m = sink.pressure_at(pressure, start + 25)?;
    let height_m = sink.height_at(gnss, start + 30)?;
    found.height_m = if is_flat && height_m == 0.0 { f64::NAN } else { height_m };
    if is_flat && lat.1 == 0.0 && lon.1 == 0.0 {
        return Ok(None);
    }
    let within = |field, at, value: f64, most: f64, text: &str| {
        if value <= most {
            Ok(())
        } else {
            number_at(field, text, start + at, 0.0..=most).map(|_| ())
        }
    };
    within("latitude", 7, lat.1, 90.0, &format!("{}", lat.1))?;
    within("longitude", 15, lon.1, 180.0, &format!("{}", lon.1))?;
    sink.note_position(&lat.0, &lon.0);
    (found.lat_deg, found.lon_deg) = (north * lat.1, east * lon.1);
    Ok(Some(found))
}

/// The figures of degrees and minutes with a point where minutes begin their fraction, and degrees.
fn angle(text: &str, extra: Option<&str>) -> Option<(String, f64)> {
    clock::digits(text)?;
    let (whole, fraction) = text.split_at(text.len() - 3);
    let (degrees, minutes) = whole.split_at(whole.len() - 2);
    let minutes = format!("{minutes}.{fraction}{}", extra.unwrap_or(""));
    let value: f64 = minutes.parse().ok()?;
    let degrees: f64 = degrees.parse().ok()?;
    (value < 60.0).then_some((minutes, degrees + value / 60.0))
}

fn sign(text: &str, [plus, minus]: [&str; 2]) -> Option<f64> {
    match text {
        _ if text == plus => Some(1.0),
        _ if text == minus => Some(-1.0),
        _ => None,
    }
}

fn time(clock: &mut Clock, stamp: Stamp, fraction: Option<&str>) -> i64 {
    let parts = fraction.and_then(clock::digits).zip(fraction).map(|(value, text)| {
        let scale = text.bytes().fold(1, |scale, _| scale * 10);
        value * SECOND_NS / scale
    });
    clock.of_day(Stamp { ns: stamp.ns + parts.unwrap_or(0), ..stamp })
}

//! NMEA 0183: what GPS receivers say.
//!
//! In:    the text of a log.
//! Out:   a fix for each GGA or GNS sentence with a position, or of RMC where there are none; dates
//! from RMC and ZDA; pressure altitudes from Garmin's PGRMZ, which `FLARM` writes, too.
//! Keeps: nothing.
//! Not here: satellites, speeds, other devices on the bus.
//! Source: NMEA 0183 4.11, sentences GGA, GNS, RMC, ZDA; Garmin Proprietary NMEA 0183, PGRMZ.
//!
//! By hand rather than with the crate `nmea`: that gives no column of a fault, and merges sentences
//! before one can see which of them has the date.

use crate::clock::{self, Clock, Stamp};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, FOOT_M, Fix, Said, Sink};

/// A fix that may still wait for its date.
struct Waiting {
    fix: Fix,
    stamp: Stamp,
    day: Option<i64>,
}

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    let mut waiting: Vec<Waiting> = Vec::new();
    let kinds = || sink.text.lines().filter_map(|line| line.split_once('$')?.1.get(2..6));
    let has_heights = kinds().any(|kind| matches!(kind, "GGA," | "GNS,"));
    // Time of day and day of the last sentence with a date.
    let mut dated: Option<(i64, i64)> = None;
    sink.position_unit_deg = 1.0 / 60.0;
    sink.pressure_unit_m = FOOT_M;
    sink.fixes.said = Said::Declared(Datum::Msl, "GGA sentences are by definition".into());
    for line in sink.text.lines() {
        let Some(begin) = line.find('$') else { continue };
        let line = &line[begin..];
        let fields: Vec<&str> = line.split('*').next().unwrap_or("").split(',').collect();
        let Some(kind) = fields[0].get(3..6) else { continue };
        if !matches!(kind, "GGA" | "GNS" | "RMC" | "ZDA") && fields[0] != "$PGRMZ" {
            continue;
        }
        sink.records += 1;
        let done = check(sink, line).and_then(|()| match kind {
            "RMZ" => pressure(sink, &fields, waiting.last_mut()).map(|()| None),
            "RMC" if !has_heights => {
                let found = fix(sink, &fields, kind)?;
                waiting.extend(found);
                date(sink, &fields, (9, None))
            }
            "RMC" => date(sink, &fields, (9, None)),
            "ZDA" => date(sink, &fields, (2, Some(4))),
            _ => fix(sink, &fields, kind).map(|fix| {
                let none = fix.is_none();
                sink.fixes.without_position += usize::from(none);
                waiting.extend(fix);
                None
            }),
        });
        match done {
            Ok(None) => {}
            Ok(Some((tod, day))) => {
                dated = Some((tod, day));
                // The fix of the same moment may have come first.
                if let Some(last) = waiting.last_mut().filter(|last| last.stamp.ns == tod) {
                    last.day = Some(day);
                }
            }
            Err(wrong) => sink.bad(wrong),
        }
        if let (Some(last), Some((tod, day))) = (waiting.last_mut(), dated)
            && last.stamp.ns == tod
        {
            last.day = Some(day);
        }
    }
    settle(sink, waiting)
}

/// Gives every fix its time: days go on from the last that is known, and backwards from the first.
fn settle(sink: &mut Sink<'_>, waiting: Vec<Waiting>) -> Result<(), TrackError> {
    let mut clock = Clock::default();
    if let Some(at) = waiting.iter().position(|fix| fix.day.is_some()) {
        let passed = waiting[..=at].windows(2);
        let midnights =
            passed.filter(|pair| pair[1].stamp.ns < pair[0].stamp.ns - clock::DAY_NS / 2);
        let midnights = i64::try_from(midnights.count()).unwrap_or(0);
        clock.set_day(waiting[at].day.unwrap_or(0) - midnights);
    }
    for Waiting { mut fix, stamp, day } in waiting {
        if let Some(day) = day.filter(|&day| day > clock.day) {
            clock.set_day(day);
        }
        fix.time_ns = clock.of_day(stamp);
        sink.push(fix)?;
    }
    Ok(())
}

/// Compares the check sum, where there is one.
fn check(sink: &Sink<'_>, line: &str) -> Result<(), Wrong> {
    let Some((body, sum)) = line[1..].split_once('*') else { return Ok(()) };
    let found = sum.get(..2).and_then(|sum| u8::from_str_radix(sum, 16).ok());
    let expected = body.bytes().fold(0, |sum, byte| sum ^ byte);
    if found == Some(expected) {
        return Ok(());
    }
    Err(Wrong::new(sink.text.offset(sum), "check sum", sum.trim(), format!("{expected:02X}")))
}

fn time_of(sink: &Sink<'_>, fields: &[&str]) -> Result<Option<Stamp>, Wrong> {
    let text = fields.get(1).copied().unwrap_or("");
    if text.is_empty() {
        return Ok(None);
    }
    let wrong = || Wrong::new(sink.text.offset(text), "time", text, "hhmmss or hhmmss.ss");
    clock::compact(text).map(Some).ok_or_else(wrong)
}

/// Time of day and day of RMC (`ddmmyy` in one field) or ZDA (day, month, year in three).
fn date(
    sink: &Sink<'_>,
    fields: &[&str],
    (at, year_at): (usize, Option<usize>),
) -> Result<Option<(i64, i64)>, Wrong> {
    let Some(stamp) = time_of(sink, fields)? else { return Ok(None) };
    let field = |at: usize| fields.get(at).copied().unwrap_or("").trim();
    let text = field(at);
    if text.is_empty() {
        return Ok(None);
    }
    let [day, month, year] = match year_at {
        Some(year) => [Some(text), Some(field(at + 1)), Some(field(year))],
        None => [text.get(0..2), text.get(2..4), text.get(4..)],
    }
    .map(|part| part.and_then(clock::digits));
    let found = match (year, month, day) {
        (Some(year), Some(month), Some(day)) => clock::days(clock::full_year(year), month, day),
        _ => None,
    };
    let wrong = || Wrong::new(sink.text.offset(text), "date", text, "a date, ddmmyy");
    Ok(Some((stamp.ns, found.ok_or_else(wrong)?)))
}

/// The pressure altitude of the last fix: feet, though a field says `f`.
fn pressure(sink: &mut Sink<'_>, fields: &[&str], last: Option<&mut Waiting>) -> Result<(), Wrong> {
    let text = fields.get(1).copied().unwrap_or("").trim();
    if let Some(last) = last.filter(|_| !text.is_empty()) {
        last.fix.pressure_m = sink.pressure_at(text, sink.text.offset(text))?;
    }
    Ok(())
}

/// The fix of GGA or GNS, whose positions and heights are in the same fields but for one; or of RMC,
/// which has no heights and one field more before the position.
fn fix(sink: &mut Sink<'_>, fields: &[&str], kind: &str) -> Result<Option<Waiting>, Wrong> {
    let field = |at: usize| fields.get(at).copied().unwrap_or("").trim();
    let (is_fixed, first) = match kind {
        "GGA" => (field(6) != "0", 2),
        "RMC" => (field(2) == "A", 3),
        _ => (field(6).bytes().any(|mode| mode != b'N'), 2),
    };
    let [lat, north, lon, east] = [0, 1, 2, 3].map(|i| field(first + i));
    let Some(stamp) = time_of(sink, fields)? else { return Ok(None) };
    if !is_fixed || lat.is_empty() || lon.is_empty() {
        return Ok(None);
    }
    let mut found = Fix::new(0, 0, sink.text.offset(fields[0]));
    found.lat_deg = angle(sink, "latitude", [lat, north], ("N", "S", 90.0))?;
    found.lon_deg = angle(sink, "longitude", [lon, east], ("E", "W", 180.0))?;
    sink.note_position(minutes(lat), minutes(lon));
    let undulation = match kind {
        "RMC" => "",
        "GGA" => field(11),
        _ => field(10),
    };
    if kind != "RMC" && !field(9).is_empty() {
        found.height_m = sink.height(field(9))?;
    }
    if !undulation.is_empty() {
        found.undulation_m = sink.number("geoid separation", undulation, -120.0..=100.0)?;
    }
    Ok(Some(Waiting { fix: found, stamp, day: None }))
}

/// The minutes of `DDMM.mmm`.
fn minutes(text: &str) -> &str {
    let point = text.find('.').unwrap_or(text.len());
    text.get(point.saturating_sub(2)..).unwrap_or("")
}

fn angle(
    sink: &Sink<'_>,
    field: &str,
    [text, side]: [&str; 2],
    (plus, minus, most): (&str, &str, f64),
) -> Result<f64, Wrong> {
    let at = sink.text.offset(text);
    let wrong = || Wrong::new(at, field, text, "degrees and minutes, as 4639.60000");
    let minutes = minutes(text);
    let degrees = text.strip_suffix(minutes).unwrap_or("");
    let degrees = sink.number(field, degrees, 0.0..=most).map_err(|_| wrong())?;
    let minutes = sink.number(field, minutes, 0.0..=59.999_999_999).map_err(|_| wrong())?;
    let value = degrees + minutes / 60.0;
    if value > most {
        return Err(wrong());
    }
    match side {
        _ if side == plus => Ok(value),
        _ if side == minus => Ok(-value),
        _ => {
            let expected = format!("{plus} or {minus}");
            Err(Wrong::new(sink.text.offset(side), "hemisphere", side, expected))
        }
    }
}

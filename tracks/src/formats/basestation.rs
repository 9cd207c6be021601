//! BaseStation, also called SBS-1: ADS-B as lines, which dump1090 and its kin write on port 30003.
//!
//! In:    the text of a log.
//! Out:   a fix for each message with a position; each aircraft is a recording.
//! Keeps: nothing.
//! Not here: messages without positions, but for call signs.
//! Source: "Socket data and BST files", homepage of the BaseStation users' group, woodair.net.
//!
//! Fields are `MSG, type, session, aircraft, hex, flight, date and time when made, date and time when
//! logged, call sign, feet, knots, track, latitude, longitude, climb, squawk, …`. Times are those of
//! the receiver's clock, UTC or not.

use crate::clock::{self, Clock};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{Datum, FOOT_M, Fix, Said, Sink};
use std::collections::BTreeMap;

const HEX: usize = 4;
/// Date and time, when made and when logged.
const TIMES: [usize; 2] = [6, 8];
const CALL_SIGN: usize = 10;
const FEET: usize = 11;
const LATITUDE: usize = 14;
const LONGITUDE: usize = 15;

pub(crate) fn read(sink: &mut Sink<'_>) -> Result<(), TrackError> {
    sink.pressure_unit_m = FOOT_M;
    sink.fixes.said = Said::Habit(Datum::Pressure, "transponders send that".into());
    let mut aircraft: BTreeMap<&str, (u32, Clock)> = BTreeMap::new();
    for line in sink.text.lines() {
        let Some(begin) = line.find("MSG,") else { continue };
        let fields: Vec<&str> = line[begin..].split(',').map(str::trim).collect();
        let field = |at: usize| fields.get(at).copied().unwrap_or("");
        let (track, clock) = aircraft.entry(field(HEX)).or_insert_with(|| {
            sink.fixes.names.push(field(HEX).to_owned());
            let track = u32::try_from(sink.fixes.names.len() - 1).unwrap_or(u32::MAX);
            (track, Clock::default())
        });
        let name = usize::try_from(*track).ok().and_then(|track| sink.fixes.names.get_mut(track));
        if let Some(name) = name.filter(|name| *name == field(HEX))
            && !field(CALL_SIGN).is_empty()
        {
            *name = format!("{} {}", field(HEX), field(CALL_SIGN));
        }
        if field(LATITUDE).is_empty() || field(LONGITUDE).is_empty() {
            continue;
        }
        match fix(sink, &fields, clock) {
            Ok(fix) => sink.push(Fix { track: *track, ..fix })?,
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

fn fix(sink: &mut Sink<'_>, fields: &[&str], clock: &mut Clock) -> Result<Fix, Wrong> {
    let filled = |at: &&usize| !fields[**at].is_empty() && !fields[**at + 1].is_empty();
    let time = TIMES.iter().find(filled).copied().unwrap_or(TIMES[0]);
    let (date, tod) = (fields[time], fields[time + 1]);
    let at = sink.text.offset(date);
    let wrong =
        || Wrong::new(at, "time", &format!("{date},{tod}"), "a time, as 2024/07/15,09:00:00.000");
    let stamp = clock::iso(&format!("{date} {tod}")).ok_or_else(wrong)?;
    let mut found = Fix::new(0, clock.whole(stamp), sink.text.offset(fields[0]));
    found.lat_deg = sink.lat(fields[LATITUDE])?;
    found.lon_deg = sink.lon(fields[LONGITUDE])?;
    let feet = fields[FEET];
    if !feet.is_empty() {
        found.pressure_m = sink.pressure_at(feet, sink.text.offset(feet))?;
    }
    Ok(found)
}

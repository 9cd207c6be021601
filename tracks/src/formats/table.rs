//! Tables: FlightGear's generic protocol, ADS-B, overfly's own, and whatever a column map describes.
//!
//! In:    the text of a file, a column map or none.
//! Out:   a fix for each row with a position; each aircraft is a recording.
//! Keeps: nothing.
//! Not here: which column is what (`columns`).
//!
//! Rows are split by the crate `csv`; where in a line a field stands is found here, since the crate
//! says where rows begin only.

use crate::clock::{self, Clock, SECOND_NS};
use crate::columns::{AngleUnit, ColumnMap, HeightColumn, Key, LengthUnit, TimeUnit, known};
use crate::fault::{TrackError, Wrong};
use crate::fixes::{DEGREE_RAD, Datum, FOOT_M, Fix, Said, Sink, number_at};
use crate::format::Format;
use csv::{Reader, ReaderBuilder, StringRecord};
use std::collections::BTreeMap;

/// Rows that are looked at for titles.
const TITLE_ROWS: usize = 10;

/// Numbers of the columns, from 0.
struct Places {
    time: usize,
    date: Option<usize>,
    zone: Option<usize>,
    measured: Option<usize>,
    lat: usize,
    lon: usize,
    height: usize,
    /// Whether `height` holds pressure altitudes.
    is_pressure: bool,
    pressure: Option<usize>,
    attitude: Option<[usize; 3]>,
    variation: Option<usize>,
    id: Option<usize>,
}

pub(crate) fn read(sink: &mut Sink<'_>, map: Option<&ColumnMap>) -> Result<(), TrackError> {
    let layout = match map {
        Some(map) => Layout::mapped(sink, map),
        None => Layout::known(sink)?,
    };
    let Layout { map, format, titles, from } = layout;
    let mut reader = reader_of(&sink.text.all[from..], map.separator);
    sink.fixes.format = format;
    let places = places(&map, &titles)?;
    set_units(sink, &map);
    sink.fixes.said = said(&map.altitude, format);
    let mut tracks = BTreeMap::new();
    let mut clocks = Vec::new();
    let mut record = StringRecord::new();
    // What is text already is UTF-8, and rows may have any length: this cannot fail.
    while reader.read_record(&mut record).unwrap_or(false) {
        let at = usize::try_from(record.position().map_or(0, csv::Position::byte)).unwrap_or(0);
        if record.iter().all(|field| field.trim().is_empty()) {
            continue;
        }
        if map.separator == ';' {
            record = with_points(&record);
        }
        // The crate counts a row from the end of the one before, of two bytes the second.
        let at = from + at;
        let ends = sink.text.all[at..].bytes().take_while(|byte| matches!(byte, b'\r' | b'\n'));
        let at = at + ends.count();
        let row = Row { record: &record, at, separator: byte_of(map.separator) };
        let id = places.id.and_then(|id| record.get(id)).unwrap_or("").trim();
        let track = *tracks.entry(id.to_owned()).or_insert_with(|| {
            sink.fixes.names.push(id.to_owned());
            clocks.push(Clock::default());
            clocks.len() - 1
        });
        match fix(sink, &row, (&places, map.time.unit), &mut clocks[track]) {
            Ok(Some(fix)) => {
                sink.push(Fix { track: u32::try_from(track).unwrap_or(u32::MAX), ..fix })?;
            }
            Ok(None) => sink.fixes.without_position += 1,
            Err(wrong) => sink.bad(wrong),
        }
    }
    Ok(())
}

/// The record with points for commas in numbers: half of Europe writes them so, and then separates
/// fields by semicolons.
fn with_points(record: &StringRecord) -> StringRecord {
    let is_number = |text: &str| {
        let figures = text.trim().trim_start_matches('-').bytes();
        figures.clone().filter(|&byte| byte == b',').count() == 1
            && figures.clone().all(|byte| byte == b',' || byte.is_ascii_digit())
    };
    let field = |text: &str| if is_number(text) { text.replace(',', ".") } else { text.to_owned() };
    record.iter().map(field).collect()
}

/// What is in which column, and where the rows begin.
struct Layout {
    map: ColumnMap,
    format: Format,
    titles: Vec<String>,
    from: usize,
}

impl Layout {
    fn mapped(sink: &Sink<'_>, map: &ColumnMap) -> Self {
        let all = sink.text.all;
        let (titles, from) =
            if map.titles { titles_of(all, map.separator) } else { (Vec::new(), 0) };
        Self { map: map.clone(), format: Format::MappedCsv, titles, from }
    }

    /// The first row whose titles are known: `ForeFlight` and Garmin write others before.
    fn known(sink: &Sink<'_>) -> Result<Self, TrackError> {
        let all = sink.text.all;
        let mut first = None;
        for line in sink.text.lines().filter(|line| !line.trim().is_empty()).take(TITLE_ROWS) {
            let at = sink.text.offset(line);
            let separator = separator_of(line);
            let (titles, rest) = titles_of(&all[at..], separator);
            match known(&titles, separator) {
                Ok((map, format)) => return Ok(Self { map, format, titles, from: at + rest }),
                Err(expected) => {
                    first.get_or_insert_with(|| Wrong::new(at, "title", line.trim(), expected));
                }
            }
        }
        let wrong = first.unwrap_or_else(|| Wrong::new(0, "title", "", "titles of columns"));
        Err(TrackError::Fault(sink.text.fault(wrong)))
    }
}

/// The titles of a text's first row, and where the next row begins.
fn titles_of(text: &str, separator: char) -> (Vec<String>, usize) {
    let mut reader = reader_of(text, separator);
    let mut record = StringRecord::new();
    let _ = reader.read_record(&mut record);
    let titles = record.iter().map(|title| title.trim().to_ascii_lowercase()).collect();
    let end = usize::try_from(reader.position().byte()).unwrap_or(0).min(text.len());
    let ends = text[end..].bytes().take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
    (titles, end + ends)
}

fn reader_of(text: &str, separator: char) -> Reader<&[u8]> {
    let mut builder = ReaderBuilder::new();
    builder.delimiter(byte_of(separator)).has_headers(false).flexible(true);
    builder.from_reader(text.as_bytes())
}

fn byte_of(separator: char) -> u8 {
    u8::try_from(separator).unwrap_or(b',')
}

fn separator_of(line: &str) -> char {
    let count = |c: char| line.matches(c).count();
    if count(';') > count(',') {
        ';'
    } else if count('\t') > count(',') {
        '\t'
    } else {
        ','
    }
}

fn places(map: &ColumnMap, titles: &[String]) -> Result<Places, TrackError> {
    let place = |key: &Key| match key {
        Key::Number(0) => Err(TrackError::Columns { why: "columns count from 1".into() }),
        Key::Number(number) => Ok(number - 1),
        Key::Title(title) => {
            let wanted = title.trim().to_ascii_lowercase();
            let lacks = || TrackError::Columns {
                why: format!("no column is titled \"{title}\"; there are {}", titles.join(", ")),
            };
            titles.iter().position(|title| *title == wanted).ok_or_else(lacks)
        }
    };
    let some = |key: &Option<Key>| key.as_ref().map(place).transpose();
    let angles = (some(&map.heading)?, some(&map.pitch)?, some(&map.roll)?);
    let attitude = match angles {
        (Some(heading), Some(pitch), Some(roll)) => Some([heading, pitch, roll]),
        _ => None,
    };
    Ok(Places {
        time: place(&map.time.column)?,
        date: some(&map.time.date)?,
        zone: some(&map.time.zone)?,
        measured: some(&map.time.measured)?,
        lat: place(&map.latitude)?,
        lon: place(&map.longitude)?,
        height: place(&map.altitude.column)?,
        is_pressure: map.altitude.datum.map(Datum::from) == Some(Datum::Pressure),
        pressure: map.pressure.as_ref().map(|column| place(&column.column)).transpose()?,
        attitude,
        variation: some(&map.variation)?,
        id: some(&map.id)?,
    })
}

fn set_units(sink: &mut Sink<'_>, map: &ColumnMap) {
    let metres = |unit| match unit {
        LengthUnit::Metres => 1.0,
        LengthUnit::Feet => FOOT_M,
    };
    let degrees = match map.angles {
        AngleUnit::Degrees => 1.0,
        AngleUnit::Radians => 1.0 / DEGREE_RAD,
    };
    sink.height_unit_m = metres(map.altitude.unit);
    let pressure = map.pressure.as_ref().unwrap_or(&map.altitude);
    sink.pressure_unit_m = metres(pressure.unit);
    (sink.position_unit_deg, sink.angle_unit_deg) = (degrees, degrees);
}

fn said(column: &HeightColumn, format: Format) -> Said {
    let title = match &column.column {
        Key::Title(title) => title.clone(),
        Key::Number(number) => format!("number {number}"),
    };
    match (column.datum.map(Datum::from), format) {
        (Some(datum), Format::FlightGear) => {
            Said::Habit(datum, "FlightGear's own altitude is".into())
        }
        (Some(datum), Format::AdsbCsv) => {
            let why = format!("transponders send that, and here it is the column {title}");
            Said::Habit(datum, why)
        }
        (Some(datum), Format::Csv) if title == "altitude" => {
            Said::Habit(datum, "ForeFlight's own altitude is".into())
        }
        (Some(datum), Format::MappedCsv) => Said::Declared(datum, "the column map says".into()),
        (Some(datum), _) => Said::Declared(datum, format!("the title {title} says")),
        (None, _) => Said::Unknown(format!("nothing says what the column {title} is above")),
    }
}

/// A row with where it is.
struct Row<'r> {
    record: &'r StringRecord,
    at: usize,
    separator: u8,
}

impl Row<'_> {
    /// A field and where it begins, for messages.
    fn field(&self, sink: &Sink<'_>, number: usize, name: &str) -> Result<(&str, usize), Wrong> {
        match self.record.get(number) {
            Some(text) => Ok((text.trim(), self.offset(sink.text.all.as_bytes(), number))),
            None => {
                let found = format!("{} fields", self.record.len());
                let expected = format!("{} at least, for {name}", number + 1);
                Err(Wrong::new(self.at, "row", &found, expected))
            }
        }
    }

    /// Where field `number` begins: after as many separators that are not within quotes.
    fn offset(&self, all: &[u8], number: usize) -> usize {
        let (mut left, mut quoted) = (number, false);
        for (i, &byte) in all.iter().enumerate().skip(self.at) {
            if left == 0 {
                return i;
            }
            quoted ^= byte == b'"';
            left -= usize::from(byte == self.separator && !quoted);
        }
        all.len()
    }
}

fn fix(
    sink: &mut Sink<'_>,
    row: &Row<'_>,
    (places, unit): (&Places, TimeUnit),
    clock: &mut Clock,
) -> Result<Option<Fix>, Wrong> {
    let (mut lat, lat_at) = row.field(sink, places.lat, "latitude")?;
    let (mut lon, mut lon_at) = row.field(sink, places.lon, "longitude")?;
    if places.lat == places.lon {
        (lat, lon) = lat.split_once(',').unwrap_or((lat, ""));
        lon_at += lat.len() + 1;
    }
    if none(lat) || none(lon) {
        return Ok(None);
    }
    let mut found = Fix::new(0, row_time(sink, row, (places, unit), clock)?, row.at);
    found.lat_deg = sink.lat_at(lat, lat_at)?;
    found.lon_deg = sink.lon_at(lon, lon_at)?;
    let (height, at) = row.field(sink, places.height, "height")?;
    match (none(height), places.is_pressure) {
        (true, _) => {}
        (_, true) => found.pressure_m = sink.pressure_at(height, at)?,
        (_, false) => found.height_m = sink.height_at(height, at)?,
    }
    if let Some(pressure) = places.pressure {
        let (text, at) = row.field(sink, pressure, "pressure altitude")?;
        if !none(text) {
            found.pressure_m = sink.pressure_at(text, at)?;
        }
    }
    if let Some(attitude) = places.attitude {
        for (i, name) in ["heading", "pitch", "roll"].into_iter().enumerate() {
            let (text, at) = row.field(sink, attitude[i], name)?;
            if !none(text) {
                found.attitude_deg[i] = sink.angle_at(name, text, at)?;
            }
        }
        if let Some(variation) = places.variation {
            let (text, at) = row.field(sink, variation, "variation")?;
            let unit = sink.angle_unit_deg;
            found.attitude_deg[0] += match none(text) {
                true => f64::NAN,
                false => number_at("variation", text, at, -180.0 / unit..=180.0 / unit)? * unit,
            };
        }
    }
    Ok(Some(found))
}

/// Whether a field says that there is nothing.
fn none(text: &str) -> bool {
    text.is_empty() || ["nan", "nat", "null", "none"].iter().any(|no| text.eq_ignore_ascii_case(no))
}

/// When the place of a row was measured, else when the row was written.
fn row_time(
    sink: &Sink<'_>,
    row: &Row<'_>,
    (places, unit): (&Places, TimeUnit),
    clock: &mut Clock,
) -> Result<i64, Wrong> {
    if let Some(measured) = places.measured {
        let (text, at) = row.field(sink, measured, "time of the place")?;
        if !none(text) {
            return time_of(text, at, unit, clock);
        }
    }
    let (time, at) = row.field(sink, places.time, "time")?;
    let Some(date) = places.date else { return time_of(time, at, unit, clock) };
    let (date, _) = row.field(sink, date, "date")?;
    let zone = match places.zone {
        Some(zone) => row.field(sink, zone, "zone")?.0,
        None => "",
    };
    time_of(&format!("{date}T{time}{zone}"), at, TimeUnit::Auto, clock)
}

/// A time in any of the ways that tables write it.
pub(crate) fn time_of(
    text: &str,
    at: usize,
    unit: TimeUnit,
    clock: &mut Clock,
) -> Result<i64, Wrong> {
    let wrong = |expected: &str| Wrong::new(at, "time", text, expected);
    match unit {
        TimeUnit::Auto
            if text.get(1..).unwrap_or("").contains(['-', '/']) && text.contains(':') =>
        {
            let stamp = clock::iso(text);
            Ok(clock.whole(stamp.ok_or_else(|| wrong("a time, as 2024-07-15T09:00:00Z"))?))
        }
        TimeUnit::Auto if text.contains(':') => time_of(text, at, TimeUnit::TimeOfDay, clock),
        TimeUnit::TimeOfDay => {
            Ok(clock.of_day(clock::colons(text).ok_or_else(|| wrong("HH:MM:SS"))?))
        }
        TimeUnit::Auto => {
            let value = number_at("time", text, at, -4e18..=4e18)?;
            let per_second = match value.abs() {
                size if size >= 1e17 => 1e9,
                size if size >= 1e14 => 1e6,
                size if size >= 1e11 => 1e3,
                _ => 1.0,
            };
            ns_of(text, at, per_second)
        }
        TimeUnit::Seconds => ns_of(text, at, 1.0),
        TimeUnit::Milliseconds => ns_of(text, at, 1e3),
    }
}

/// A number of parts of a second in nanoseconds; the year must be one of a recording.
fn ns_of(text: &str, at: usize, per_second: f64) -> Result<i64, Wrong> {
    // 1900 to 2200.
    let (least, most) = (-2.3e9 * per_second, 7.3e9 * per_second);
    let value = number_at("time", text, at, least..=most)?;
    let whole = value.floor();
    let unit_ns = SECOND_NS as f64 / per_second;
    #[expect(clippy::cast_possible_truncation, reason = "below 7.3e18, by the range above")]
    let ns = [whole * unit_ns, (value - whole) * unit_ns].map(|part| part.round() as i64);
    Ok(ns[0] + ns[1])
}

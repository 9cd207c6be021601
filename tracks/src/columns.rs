//! Which column of a table is what: known tables, and column maps in RON.
//!
//! In:    a RON text; or the titles of a table.
//! Out:   a [`ColumnMap`].
//! Keeps: nothing.
//! Not here: reading rows (`formats::table`).

use crate::fault::TrackError;
use crate::fixes::Datum;
use crate::format::Format;
use serde::Deserialize;

/// A column by its title, or by its number from 1.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(untagged)]
pub enum Key {
    /// The number of the column, from 1.
    Number(usize),
    /// Its title; upper and lower case are the same.
    Title(String),
}

/// How times are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
pub enum TimeUnit {
    /// A date and time where it looks like one; else a number since 1970, in seconds or, by its
    /// size, milli-, micro- or nanoseconds.
    #[default]
    Auto,
    /// Seconds since 1970, or since the start.
    Seconds,
    /// Milliseconds since 1970, or since the start.
    Milliseconds,
    /// `HH:MM:SS`, of a day that nobody knows.
    TimeOfDay,
}

/// Units of lengths.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
pub enum LengthUnit {
    /// Metres.
    #[default]
    Metres,
    /// Feet of 0.3048 m.
    Feet,
}

/// Units of angles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
pub enum AngleUnit {
    /// Degrees.
    #[default]
    Degrees,
    /// Radians.
    Radians,
}

/// What altitudes are above, as maps spell it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub enum RawDatum {
    /// Mean sea level.
    Msl,
    /// The ellipsoid.
    Ellipsoid,
    /// 1013.25 hPa.
    Pressure,
}

impl From<RawDatum> for Datum {
    fn from(raw: RawDatum) -> Self {
        match raw {
            RawDatum::Msl => Self::Msl,
            RawDatum::Ellipsoid => Self::Ellipsoid,
            RawDatum::Pressure => Self::Pressure,
        }
    }
}

/// A column of times.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeColumn {
    /// Which column.
    pub column: Key,
    /// How they are written.
    #[serde(default)]
    pub unit: TimeUnit,
    /// The column of dates, where they stand apart: `YYYY-MM-DD`.
    #[serde(default)]
    pub date: Option<Key>,
    /// The column of zones, where they stand apart: `+02:00`, ahead of UTC.
    #[serde(default)]
    pub zone: Option<Key>,
    /// The column of when the place was measured, where that is not when the row was written.
    #[serde(default)]
    pub measured: Option<Key>,
}

/// A column of heights.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightColumn {
    /// Which column.
    pub column: Key,
    /// Its unit.
    #[serde(default)]
    pub unit: LengthUnit,
    /// What heights are above; without it `--altitude` must say.
    #[serde(default)]
    pub datum: Option<RawDatum>,
}

/// Which column of a table is what.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(rename = "Columns", deny_unknown_fields)]
pub struct ColumnMap {
    /// Between fields.
    #[serde(default = "comma")]
    pub separator: char,
    /// Whether the first line has titles. FlightGear's generic protocol writes none.
    #[serde(default = "yes")]
    pub titles: bool,
    /// Times.
    pub time: TimeColumn,
    /// Latitudes; where the column is that of longitudes, too, it holds both with a comma between.
    pub latitude: Key,
    /// Longitudes.
    pub longitude: Key,
    /// Heights.
    pub altitude: HeightColumn,
    /// Pressure altitudes beside them.
    #[serde(default)]
    pub pressure: Option<HeightColumn>,
    /// Headings; used where pitch and roll are there, too.
    #[serde(default)]
    pub heading: Option<Key>,
    /// What is added to headings to make them true: the variation, east positive.
    #[serde(default)]
    pub variation: Option<Key>,
    /// Pitches, nose up.
    #[serde(default)]
    pub pitch: Option<Key>,
    /// Rolls, right wing down.
    #[serde(default)]
    pub roll: Option<Key>,
    /// What tells several aircraft apart.
    #[serde(default)]
    pub id: Option<Key>,
    /// Unit of all angles, latitude and longitude included.
    #[serde(default)]
    pub angles: AngleUnit,
}

fn comma() -> char {
    ','
}

fn yes() -> bool {
    true
}

impl ColumnMap {
    /// A map from RON.
    ///
    /// # Errors
    /// Where it is none, with line and column.
    pub fn from_ron(text: &str) -> Result<Self, TrackError> {
        let map: Self = ron::from_str(text).map_err(|error| TrackError::Columns {
            why: format!(
                "line {}, column {}: {}",
                error.span.start.line, error.span.start.col, error.code
            ),
        })?;
        if !map.separator.is_ascii() || matches!(map.separator, '"' | '\n' | '\r') {
            let why = format!("separator is {:?}, expected one ASCII character", map.separator);
            return Err(TrackError::Columns { why });
        }
        Ok(map)
    }
}

/// What is known of titles: the role, the spellings in order of preference.
const TIMES: [&str; 15] = [
    "utc",
    "time_utc",
    "timestamp",
    "elapsed-sec",
    "elapsed_s",
    "time_s",
    "time-sec",
    "time",
    "datetime",
    "date_time",
    "/sim/time/elapsed-sec",
    "time (s)",
    "utc time",
    "time (utc)",
    "lcl time",
];
const LATS: [&str; 7] = [
    "lat_deg",
    "latitude-deg",
    "latitude_deg",
    "latitude",
    "lat",
    "/position/latitude-deg",
    "latitude (deg)",
];
const LONS: [&str; 8] = [
    "lon_deg",
    "longitude-deg",
    "longitude_deg",
    "longitude",
    "lon",
    "lng",
    "/position/longitude-deg",
    "longitude (deg)",
];
const IDS: [&str; 4] = ["icao24", "hex", "flight_id", "id"];
const HEADINGS: [&str; 4] = ["heading_deg", "heading-deg", "yaw_deg", "/orientation/heading-deg"];
const PITCHES: [&str; 3] = ["pitch_deg", "pitch-deg", "/orientation/pitch-deg"];
const ROLLS: [&str; 3] = ["roll_deg", "roll-deg", "/orientation/roll-deg"];

/// When a place was measured; OpenSky's states and the traffic library repeat it until the next.
const MEASURED: [&str; 2] = ["lastposupdate", "last_position"];

type Height = (&'static str, LengthUnit, Option<RawDatum>, Format);

use LengthUnit::{Feet, Metres};
use RawDatum::{Ellipsoid, Msl};

/// Heights by title, and which kind of table has such. ADS-B's are apart.
const HEIGHTS: [Height; 18] = [
    ("alt_msl_m", Metres, Some(Msl), Format::Csv),
    ("altitude_msl_m", Metres, Some(Msl), Format::Csv),
    ("alt_ellipsoid_m", Metres, Some(Ellipsoid), Format::Csv),
    ("height_ellipsoid_m", Metres, Some(Ellipsoid), Format::Csv),
    ("alt_msl_ft", Feet, Some(Msl), Format::Csv),
    ("altitude-ft", Feet, Some(Msl), Format::FlightGear),
    ("/position/altitude-ft", Feet, Some(Msl), Format::FlightGear),
    ("altitude-m", Metres, Some(Msl), Format::FlightGear),
    ("altitude_m", Metres, None, Format::Csv),
    ("altitude_ft", Feet, None, Format::Csv),
    ("alt_m", Metres, None, Format::Csv),
    ("alt_ft", Feet, None, Format::Csv),
    ("height_m", Metres, None, Format::Csv),
    // Garmin's G1000 and what imitates it.
    ("altmsl", Feet, Some(Msl), Format::Csv),
    ("altitude_feet", Feet, None, Format::Csv),
    ("altitude_meters", Metres, None, Format::Csv),
    ("altitude (ft)", Feet, None, Format::Csv),
    ("altitude (m)", Metres, None, Format::Csv),
];

/// The map of a table with these titles, and which kind it is; else which title is missing.
pub(crate) fn known(titles: &[String], separator: char) -> Result<(ColumnMap, Format), String> {
    let find = |names: &[&str]| {
        let mut found = names.iter().filter(|name| titles.iter().any(|title| title == *name));
        found.next().map(|name| Key::Title((*name).to_owned()))
    };
    let needed = |what: &str, names: &[&str]| {
        find(names).ok_or_else(|| {
            let some = names[..4.min(names.len())].join(", ");
            format!("a column of {what}, such as {some}; or a column map")
        })
    };
    let time = TimeColumn {
        column: needed("times", &TIMES)?,
        unit: TimeUnit::Auto,
        date: find(&["lcl date"]),
        zone: find(&["utcofst"]),
        measured: find(&MEASURED),
    };
    // Flightradar24 writes both in one column, between quotes.
    let (latitude, longitude) = match find(&["position"]).filter(|_| find(&LATS).is_none()) {
        Some(both) => (both.clone(), both),
        None => (needed("latitudes", &LATS)?, needed("longitudes", &LONS)?),
    };
    let (altitude, pressure, format) = heights(titles).ok_or_else(|| {
        "a column of heights, such as alt_msl_m, altitude-ft, alt_ellipsoid_m; or a column map"
            .to_owned()
    })?;
    let is_adsb = format == Format::AdsbCsv;
    let is_foreflight = has_foreflight(titles);
    // Garmin's headings are magnetic, with the variation beside them.
    let variation = find(&["magvar"]).filter(|_| find(&["hdg"]).is_some());
    let is_garmin = variation.is_some();
    let attitude = |names: &[&str], [theirs, garmins]: [&str; 2]| match () {
        () if is_adsb => None,
        () if is_foreflight => find(&[theirs]),
        () if is_garmin => find(&[garmins]),
        () => find(names),
    };
    let map = ColumnMap {
        separator,
        titles: true,
        time,
        latitude,
        longitude,
        altitude,
        pressure,
        heading: attitude(&HEADINGS, ["course", "hdg"]),
        variation,
        pitch: attitude(&PITCHES, ["pitch", "pitch"]),
        roll: attitude(&ROLLS, ["bank", "roll"]),
        id: find(&IDS),
        angles: AngleUnit::Degrees,
    };
    Ok((map, format))
}

/// `ForeFlight`'s tracks: feet above sea level; courses over ground stand for headings.
fn has_foreflight(titles: &[String]) -> bool {
    let has = |name: &&str| titles.iter().any(|title| title == name);
    ["timestamp", "altitude", "course", "bank", "pitch"].iter().all(has)
}

/// Columns of heights and of pressure altitudes. OpenSky writes metres, the traffic library feet.
fn heights(titles: &[String]) -> Option<(HeightColumn, Option<HeightColumn>, Format)> {
    let has = |name: &str| titles.iter().any(|title| title == name);
    let column =
        |name: &str, unit, datum| HeightColumn { column: Key::Title(name.to_owned()), unit, datum };
    if let Some((name, unit, datum, format)) = HEIGHTS.into_iter().find(|(name, ..)| has(name)) {
        return Some((column(name, unit, datum), None, format));
    }
    if has_foreflight(titles) {
        return Some((column("altitude", Feet, Some(Msl)), None, Format::Csv));
    }
    let (pressure, unit) = match () {
        () if has("baroaltitude") => ("baroaltitude", Metres),
        () if has("baro_altitude") => ("baro_altitude", Metres),
        () if has("altitude") && (has("icao24") || has("callsign")) => ("altitude", Feet),
        () if has("alt_baro") => ("alt_baro", Feet),
        () if has("altitude") => {
            return Some((column("altitude", Metres, None), None, Format::Csv));
        }
        () => return None,
    };
    let pressure = column(pressure, unit, Some(RawDatum::Pressure));
    let geometric = ["geoaltitude", "geo_altitude", "alt_geom"].into_iter().find(|name| has(name));
    Some(match geometric {
        Some(name) => (column(name, unit, Some(Ellipsoid)), Some(pressure), Format::AdsbCsv),
        None => (pressure, None, Format::AdsbCsv),
    })
}

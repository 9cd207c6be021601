//! What was recorded, as columns; every format becomes this.
//!
//! In:    fixes, one by one, with the place in the text that each is from.
//! Out:   [`Fixes`]; or the fault that made too much of the file useless.
//! Keeps: nothing.
//! Not here: reading formats (`formats`), what is wrong with the order of fixes (`clean`).

use crate::fault::{Fault, TrackError, Wrong};
use crate::format::Format;
use crate::grain::Grain;
use crate::text::Text;
use core::ops::RangeInclusive;
use std::collections::BTreeSet;

/// Most fixes of a file: a month at 10 Hz.
const FIXES_MAX: usize = 30_000_000;
/// Faults that are kept word for word.
const FAULTS_KEPT: usize = 5;
pub(crate) const FOOT_M: f64 = 0.3048;
pub(crate) const DEGREE_RAD: f64 = core::f64::consts::PI / 180.0;
const LAT_DEG: RangeInclusive<f64> = -90.0..=90.0;
const LON_DEG: RangeInclusive<f64> = -180.0..=360.0;
/// From the deepest sea to beyond geostationary orbit, in metres.
const HEIGHT_M: RangeInclusive<f64> = -12_000.0..=100_000_000.0;
const ANGLE_DEG: RangeInclusive<f64> = -720.0..=720.0;

/// What a height is above.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Datum {
    /// Mean sea level: the geoid.
    Msl,
    /// The ellipsoid WGS 84.
    Ellipsoid,
    /// The pressure level of 1013.25 hPa.
    Pressure,
}

impl Datum {
    /// In words that end "heights are …".
    pub fn words(self) -> &'static str {
        match self {
            Self::Msl => "above sea level",
            Self::Ellipsoid => "above the ellipsoid",
            Self::Pressure => "pressure altitudes",
        }
    }
}

/// How a file's heights are known to be above something.
#[derive(Clone, PartialEq, Debug)]
pub enum Said {
    /// The file or its format says so; the words say where.
    Declared(Datum, String),
    /// Files of this kind mostly mean this; the words say why.
    Habit(Datum, String),
    /// Nothing is known; the words say why.
    Unknown(String),
}

/// Smallest steps in which a file writes its numbers; 0 where they are as good as exact.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Steps {
    /// Of latitudes, in radians.
    pub lat_rad: f64,
    /// Of longitudes, in radians.
    pub lon_rad: f64,
    /// Of heights, in metres.
    pub height_m: f64,
    /// Of pressure altitudes, in metres.
    pub pressure_m: f64,
    /// Of headings, pitches and rolls, in radians.
    pub attitude_rad: f64,
}

/// All fixes of a file, as columns of one length, in the order of the file.
#[derive(Clone, PartialEq, Debug)]
pub struct Fixes {
    /// The format of the file.
    pub format: Format,
    /// Which of several recordings in the file: counts from 0.
    pub track: Vec<u32>,
    /// What each recording is called; empty where nothing says.
    pub names: Vec<String>,
    /// Recordings that the file says are of no aircraft, but of ships, vehicles, weapons.
    pub asides: BTreeSet<u32>,
    /// UTC since 1970 in nanoseconds, leap seconds of the recording included; where no date is
    /// known, since the midnight before or the start.
    pub time_ns: Vec<i64>,
    /// Latitude in radians.
    pub lat_rad: Vec<f64>,
    /// Longitude in radians.
    pub lon_rad: Vec<f64>,
    /// Height in metres above what `said` says; NaN where there is none.
    pub height_m: Vec<f64>,
    /// Pressure altitude in metres; NaN where there is none.
    pub pressure_m: Vec<f64>,
    /// Height of the geoid above the ellipsoid in metres, as the file has it; NaN where it does not.
    pub undulation_m: Vec<f64>,
    /// Heading, pitch and roll in radians; NaN where there are none.
    pub attitude_rad: Vec<[f64; 3]>,
    /// Line of the text, from 1.
    pub line: Vec<u32>,
    /// What `height_m` is above.
    pub said: Said,
    /// Whether a height of exactly 0 among others means that there is none.
    pub zero_is_none: bool,
    /// Steps of the columns.
    pub steps: Steps,
    /// Records without position: not a fault.
    pub without_position: usize,
    /// What one should know of it besides; and the line that it is about.
    pub remark: Option<(String, u32)>,
    /// The first few faults; their records are left out.
    pub faults: Vec<Fault>,
    /// How many faults there are.
    pub fault_count: usize,
}

/// A fix in the units of most formats. NaN where a value is missing.
#[derive(Clone, Copy)]
pub(crate) struct Fix {
    pub track: u32,
    pub time_ns: i64,
    pub lat_deg: f64,
    pub lon_deg: f64,
    pub height_m: f64,
    pub pressure_m: f64,
    pub undulation_m: f64,
    pub attitude_deg: [f64; 3],
    /// Offset of its record in the text.
    pub at: usize,
}

impl Fix {
    /// A fix with a place in time and the text, and nothing else.
    pub fn new(track: u32, time_ns: i64, at: usize) -> Self {
        let none = f64::NAN;
        Self {
            track,
            time_ns,
            lat_deg: none,
            lon_deg: none,
            height_m: none,
            pressure_m: none,
            undulation_m: none,
            attitude_deg: [none; 3],
            at,
        }
    }
}

/// Where parsers put what they find.
pub(crate) struct Sink<'a> {
    pub text: &'a Text<'a>,
    pub fixes: Fixes,
    /// Records seen, sound or not.
    pub records: usize,
    wrong: Vec<Wrong>,
    lat: Grain,
    lon: Grain,
    height: Grain,
    pressure: Grain,
    attitude: Grain,
    /// Degrees a unit of the figures that positions are written in: 1/60 for minutes.
    pub position_unit_deg: f64,
    /// Metres a unit that heights and pressure altitudes are written in.
    pub height_unit_m: f64,
    pub pressure_unit_m: f64,
    pub angle_unit_deg: f64,
}

impl<'a> Sink<'a> {
    pub fn new(format: Format, text: &'a Text<'a>) -> Self {
        let fixes = Fixes {
            format,
            track: Vec::new(),
            names: Vec::new(),
            asides: BTreeSet::new(),
            time_ns: Vec::new(),
            lat_rad: Vec::new(),
            lon_rad: Vec::new(),
            height_m: Vec::new(),
            pressure_m: Vec::new(),
            undulation_m: Vec::new(),
            attitude_rad: Vec::new(),
            line: Vec::new(),
            said: Said::Unknown("nothing says what heights are above".into()),
            zero_is_none: false,
            remark: None,
            steps: Steps::default(),
            without_position: 0,
            faults: Vec::new(),
            fault_count: 0,
        };
        Self {
            text,
            fixes,
            records: 0,
            wrong: Vec::new(),
            lat: Grain::default(),
            lon: Grain::default(),
            height: Grain::default(),
            pressure: Grain::default(),
            attitude: Grain::default(),
            position_unit_deg: 1.0,
            height_unit_m: 1.0,
            pressure_unit_m: 1.0,
            angle_unit_deg: 1.0,
        }
    }

    /// Leaves a record out because of a fault.
    pub fn bad(&mut self, wrong: Wrong) {
        self.fixes.fault_count += 1;
        if self.wrong.len() < FAULTS_KEPT {
            self.wrong.push(wrong);
        }
    }

    /// A number that is part of the text.
    pub fn number(
        &self,
        field: &str,
        part: &str,
        allowed: RangeInclusive<f64>,
    ) -> Result<f64, Wrong> {
        number_at(field, part, self.text.offset(part), allowed)
    }

    pub fn lat(&mut self, part: &str) -> Result<f64, Wrong> {
        self.lat_at(part, self.text.offset(part))
    }

    pub fn lon(&mut self, part: &str) -> Result<f64, Wrong> {
        self.lon_at(part, self.text.offset(part))
    }

    /// A height in metres.
    pub fn height(&mut self, part: &str) -> Result<f64, Wrong> {
        self.height_at(part, self.text.offset(part))
    }

    /// As [`Self::lat`], of text that is not a part of the whole, such as XML without references.
    pub fn lat_at(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let unit = self.position_unit_deg;
        let value = in_unit("latitude", part, at, (LAT_DEG, unit))?;
        self.lat.note(part);
        Ok(value)
    }

    pub fn lon_at(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let unit = self.position_unit_deg;
        let value = in_unit("longitude", part, at, (LON_DEG, unit))?;
        self.lon.note(part);
        Ok(value)
    }

    /// A latitude that a reference's is added to.
    pub fn lat_offset(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let value = number_at("latitude", part, at, -270.0..=270.0)?;
        self.lat.note(part);
        Ok(value)
    }

    /// A longitude that a reference's is added to.
    pub fn lon_offset(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let value = number_at("longitude", part, at, -720.0..=720.0)?;
        self.lon.note(part);
        Ok(value)
    }

    pub fn height_at(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let value = in_unit("height", part, at, (HEIGHT_M, self.height_unit_m))?;
        self.height.note(part);
        Ok(value)
    }

    pub fn pressure_at(&mut self, part: &str, at: usize) -> Result<f64, Wrong> {
        let value = in_unit("pressure altitude", part, at, (HEIGHT_M, self.pressure_unit_m))?;
        self.pressure.note(part);
        Ok(value)
    }

    /// An angle of the attitude in degrees.
    pub fn angle_at(&mut self, field: &str, part: &str, at: usize) -> Result<f64, Wrong> {
        let value = in_unit(field, part, at, (ANGLE_DEG, self.angle_unit_deg))?;
        self.attitude.note(part);
        Ok(value)
    }

    /// Takes the figures of `DDMM.mmm` or alike into account, whose degrees are read elsewhere.
    pub fn note_position(&mut self, lat: &str, lon: &str) {
        self.lat.note(lat);
        self.lon.note(lon);
    }

    /// Adds a fix.
    pub fn push(&mut self, fix: Fix) -> Result<(), TrackError> {
        let f = &mut self.fixes;
        if f.track.len() >= FIXES_MAX {
            return Err(TrackError::Empty {
                format: f.format,
                why: format!("more than {FIXES_MAX} fixes, which is what is allowed"),
            });
        }
        f.track.push(fix.track);
        f.time_ns.push(fix.time_ns);
        f.lat_rad.push(fix.lat_deg * DEGREE_RAD);
        f.lon_rad.push(fix.lon_deg * DEGREE_RAD);
        f.height_m.push(fix.height_m);
        f.pressure_m.push(fix.pressure_m);
        f.undulation_m.push(fix.undulation_m);
        let is_whole = fix.attitude_deg.iter().all(|angle| angle.is_finite());
        let none = [f64::NAN; 3];
        f.attitude_rad.push(if is_whole { fix.attitude_deg.map(|a| a * DEGREE_RAD) } else { none });
        f.line.push(self.text.line(fix.at));
        Ok(())
    }

    /// The fixes, if there are any and at most a tenth of the records have faults.
    pub fn finish(mut self) -> Result<Fixes, TrackError> {
        let text = self.text;
        self.fixes.faults = self.wrong.into_iter().map(|wrong| text.fault(wrong)).collect();
        let (faults, format) = (self.fixes.fault_count, self.fixes.format);
        let records = self.records.max(self.fixes.track.len() + faults);
        if let Some(first) = self.fixes.faults.first().cloned() {
            if records == 1 {
                return Err(TrackError::Fault(first));
            }
            if faults * 10 > records {
                return Err(TrackError::TooManyFaults { first, faults, records });
            }
        }
        if self.fixes.track.is_empty() {
            let why = match self.fixes.without_position {
                0 => "no fix in it".into(),
                count => format!("no fix in it: {count} records have no position"),
            };
            return Err(TrackError::Empty { format, why });
        }
        let radians = self.position_unit_deg * DEGREE_RAD;
        self.fixes.steps = Steps {
            lat_rad: self.lat.step() * radians,
            lon_rad: self.lon.step() * radians,
            height_m: height_step(&self.height, self.height_unit_m),
            pressure_m: height_step(&self.pressure, self.pressure_unit_m),
            attitude_rad: self.attitude.step() * self.angle_unit_deg * DEGREE_RAD,
        };
        Ok(self.fixes)
    }
}

fn height_step(grain: &Grain, unit_m: f64) -> f64 {
    let step = if unit_m == FOOT_M { grain.step_of_feet() } else { grain.step() };
    step * unit_m
}

/// A finite number within a range.
pub(crate) fn number_at(
    field: &str,
    part: &str,
    at: usize,
    allowed: RangeInclusive<f64>,
) -> Result<f64, Wrong> {
    let value: Option<f64> = part.trim().parse().ok();
    let value = value.filter(|value| value.is_finite());
    let range = || format!("{} to {}", allowed.start().ceil(), allowed.end().floor());
    match value {
        Some(value) if allowed.contains(&value) => Ok(value),
        Some(_) => Err(Wrong::new(at, field, part.trim(), range())),
        None => Err(Wrong::new(at, field, part.trim(), format!("a number, {}", range()))),
    }
}

/// A number in some unit; the range is that of the value in the basic one.
fn in_unit(
    field: &str,
    part: &str,
    at: usize,
    (allowed, unit): (RangeInclusive<f64>, f64),
) -> Result<f64, Wrong> {
    let range = allowed.start() / unit..=allowed.end() / unit;
    Ok(number_at(field, part, at, range)? * unit)
}

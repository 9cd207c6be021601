//! Everything that a run counted and took: raw frames as columns, nothing left out.
//!
//! In:    filled by the host that flies, or read from a file.
//! Out:   [`RunRecord`]: columns by name, places, facts; the names themselves.
//! Keeps: nothing.
//! Not here: flying, clocks, files (the host), what is made of the columns (`statistic`, `judge`).

use overfly_core::digest::FrameDigest;
use overfly_core::frame::{FrameCounts, STAGES};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// What [`RunRecord::format`] says; another number is another meaning.
pub const FORMAT: &str = "overfly-budget-run-1";
/// Name of the whole frame among the times.
pub const FRAME: &str = "frame";
/// Counters beside those of [`FrameCounts`]: depth ranges drawn, bytes of new vertices, pages on
/// their way to the terrain, bytes of the pages that arrived, and heap calls of the threads that run
/// the frame.
pub const MORE_COUNTERS: [&str; 5] =
    ["draws", "uploaded_bytes", "queue_depth", "decoded_bytes", "allocations"];
/// Columns of the sampled frames: measured error, promised bound, the one over the other.
pub const ERRORS: [&str; 4] = ["e1_max_px", "e1_rms_px", "bound_px", "e5"];
/// Column of the frames whose instructions were counted.
pub const INSTRUCTIONS: &str = "instructions";
/// Names of the digests, in pipeline order.
pub const DIGESTS: [&str; 4] = ["digest.pages", "digest.mesh", "digest.vertices", "digest.draws"];
const _: () = assert!(DIGESTS.len() == FrameDigest::STAGES.len());

/// Names of all counters, in a fixed order.
pub fn counters() -> Vec<&'static str> {
    let counted = FrameCounts::default().columns().map(|(name, _)| name);
    counted.into_iter().chain(MORE_COUNTERS).collect()
}

/// Names of all times: the whole frame, then its stages.
pub fn times() -> Vec<&'static str> {
    [FRAME].into_iter().chain(STAGES.iter().map(|span| span.0)).collect()
}

/// One run of a flight, or several of the same.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunRecord {
    /// [`FORMAT`].
    pub format: String,
    /// What was flown, by whom and on what.
    pub facts: Facts,
    /// What went before the first frame of the columns, for each run.
    pub cold_starts: Vec<ColdStart>,
    /// Flight time of each frame in seconds.
    pub time_s: Vec<f64>,
    /// Latitude of the first eye in degrees.
    pub lat_deg: Vec<f64>,
    /// Longitude of the first eye in degrees.
    pub lon_deg: Vec<f64>,
    /// Height of the first eye above the ellipsoid in metres.
    pub height_m: Vec<f64>,
    /// Counts of each frame by name: the same in every run.
    pub counters: BTreeMap<String, Vec<f64>>,
    /// Digests of each frame by name, as 16 hexadecimal digits in files.
    #[serde(with = "hexadecimal")]
    pub digests: BTreeMap<String, Vec<u64>>,
    /// Nanoseconds of each frame by name, for each run. Empty where nothing was timed.
    pub times_ns: Vec<BTreeMap<String, Vec<u64>>>,
    /// Errors of a few frames. Its columns are empty where none was measured.
    pub errors: Sampled,
    /// Instructions of a few frames, done by their caller alone. Empty where none were counted.
    #[serde(default, skip_serializing_if = "Sampled::is_empty")]
    pub instructions: Sampled,
    /// Height of the ground beneath the eye above the ellipsoid in metres, of a few frames.
    pub ground: Sampled,
    /// The first count of a later run that differed from the first run's.
    pub odd: Option<Odd>,
}

/// What was flown, by whom and on what. Where nothing was timed profile, platform, processor, cores
/// and workers are empty or 0: counts do not depend on them, so the record is the same anywhere.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Facts {
    /// Name and version of the program.
    pub program: String,
    /// Build profile: `debug` with assertions, `release` without.
    pub profile: String,
    /// Operating system and processor family.
    pub platform: String,
    /// The processor as the system calls it; empty where it does not say.
    pub processor: String,
    /// Cores that the run might use.
    pub cores: u32,
    /// Worker threads beside the caller.
    pub workers: u32,
    /// Name of the flight.
    pub flight: String,
    /// Preset or path of the scene.
    pub scene: String,
    /// Digest of the settings, 16 hexadecimal digits.
    pub settings_digest: String,
    /// Width and height that errors are counted in.
    pub size_px: [u32; 2],
    /// By how much pages arrive later than in the next frame, milliseconds of the flight.
    pub loader_delay_ms: u32,
    /// Frames a second of the flight.
    pub rate_hz: f64,
    /// Frame of the flight that the columns begin with.
    pub first_frame: u32,
    /// The run was ended before its last frame; what there is, is whole.
    pub interrupted: bool,
}

/// What went before the first frame of the columns: the terrain comes up while time stands still.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColdStart {
    /// Frames.
    pub frames: u32,
    /// Nanoseconds of all of them together; 0 where nothing was timed.
    pub total_ns: u64,
    /// The longest.
    pub max_ns: u64,
}

/// Columns of a few frames.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampled {
    /// Which frames, counted from the first of the columns.
    pub frames: Vec<u32>,
    /// Their values by name.
    pub columns: BTreeMap<String, Vec<f64>>,
}

impl Sampled {
    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }
}

/// A count that was not the same in two runs of one flight.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Odd {
    /// Which run, from 1 for the second one.
    pub run: u32,
    /// Frame, counted from the first of the columns.
    pub frame: u32,
    /// Counter or digest.
    pub name: String,
}

/// Why a record cannot be used.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum RecordFault {
    /// It is of another format.
    Format {
        /// What it says.
        found: String,
    },
    /// A column is shorter or longer than the flight.
    Length {
        /// Which.
        column: String,
        /// Its values.
        found: usize,
        /// Frames of the record.
        frames: usize,
    },
}

impl fmt::Display for RecordFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format { found } => write!(f, "its format is {found}, expected is {FORMAT}"),
            Self::Length { column, found, frames } => {
                write!(f, "its column {column} has {found} values for {frames} frames")
            }
        }
    }
}

impl std::error::Error for RecordFault {}

/// JSON has no infinity and no NaN: the largest number stands for both.
pub fn told(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::MAX }
}

impl RunRecord {
    /// A record without frames.
    pub fn new(facts: Facts) -> Self {
        let empty = |name: &&str| ((*name).to_owned(), Vec::new());
        Self {
            format: FORMAT.into(),
            facts,
            cold_starts: Vec::new(),
            time_s: Vec::new(),
            lat_deg: Vec::new(),
            lon_deg: Vec::new(),
            height_m: Vec::new(),
            counters: counters().iter().map(empty).collect(),
            digests: DIGESTS.iter().map(|name| ((*name).to_owned(), Vec::new())).collect(),
            times_ns: Vec::new(),
            errors: Sampled::default(),
            instructions: Sampled::default(),
            ground: Sampled::default(),
            odd: None,
        }
    }

    /// Frames of the columns.
    pub fn frames(&self) -> usize {
        self.time_s.len()
    }

    /// The record, if its columns fit together.
    ///
    /// # Errors
    /// It is of another format, or a column has another length.
    pub fn checked(self) -> Result<Self, RecordFault> {
        if self.format != FORMAT {
            return Err(RecordFault::Format { found: self.format });
        }
        let frames = self.frames();
        let places = [("lat_deg", &self.lat_deg), ("lon_deg", &self.lon_deg)];
        let mut lengths: Vec<(String, usize)> =
            places.map(|(name, column)| (name.to_owned(), column.len())).into();
        lengths.push(("height_m".into(), self.height_m.len()));
        lengths.extend(self.counters.iter().map(|(name, column)| (name.clone(), column.len())));
        lengths.extend(self.digests.iter().map(|(name, column)| (name.clone(), column.len())));
        for run in &self.times_ns {
            lengths.extend(run.iter().map(|(name, column)| (name.clone(), column.len())));
        }
        if let Some((column, found)) = lengths.into_iter().find(|(_, length)| *length != frames) {
            return Err(RecordFault::Length { column, found, frames });
        }
        for sampled in [&self.errors, &self.instructions, &self.ground] {
            let frames = sampled.frames.len();
            let odd = sampled.columns.iter().find(|(_, column)| column.len() != frames);
            if let Some((column, values)) = odd {
                let (column, found) = (column.clone(), values.len());
                return Err(RecordFault::Length { column, found, frames });
            }
        }
        Ok(self)
    }

    /// Where the eye was in a frame of the columns, in words: frame of the flight, latitude,
    /// longitude, height, time.
    pub fn place(&self, frame: usize) -> String {
        let of = |column: &[f64]| column.get(frame).copied().unwrap_or(f64::NAN);
        format!(
            "frame {} at {:.6}, {:.6}, {:.0} m, {:.3} s",
            self.facts.first_frame as usize + frame,
            of(&self.lat_deg),
            of(&self.lon_deg),
            of(&self.height_m),
            of(&self.time_s)
        )
    }

    /// The columns of few frames that hold a name; none where it is counted in every frame.
    pub fn sampled(&self, of: &str) -> Option<&Sampled> {
        match of {
            INSTRUCTIONS => Some(&self.instructions),
            _ if ERRORS.contains(&of) => Some(&self.errors),
            _ => None,
        }
    }

    /// Times of a name in milliseconds, one column for each run.
    pub fn times_ms(&self, name: &str) -> Vec<Vec<f64>> {
        let of = |run: &BTreeMap<String, Vec<u64>>| {
            let column = run.get(name)?;
            Some(column.iter().map(|&ns| ns as f64 / 1e6).collect())
        };
        self.times_ns.iter().filter_map(of).collect()
    }
}

/// 64-bit digests as 16 hexadecimal digits: JSON's numbers do not hold them.
mod hexadecimal {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
    use std::collections::BTreeMap;

    type Columns<T> = BTreeMap<String, Vec<T>>;

    pub(super) fn serialize<S: Serializer>(all: &Columns<u64>, to: S) -> Result<S::Ok, S::Error> {
        let text = |column: &Vec<u64>| column.iter().map(|x| format!("{x:016x}")).collect();
        let texts: Columns<String> =
            all.iter().map(|(name, column)| (name.clone(), text(column))).collect();
        texts.serialize(to)
    }

    pub(super) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Columns<u64>, D::Error> {
        let texts = Columns::<String>::deserialize(from)?;
        let number = |text: &String| {
            u64::from_str_radix(text, 16)
                .map_err(|_| D::Error::custom(format!("`{text}` is not a digest")))
        };
        let column = |(name, texts): (String, Vec<String>)| {
            Ok((name, texts.iter().map(number).collect::<Result<_, _>>()?))
        };
        texts.into_iter().map(column).collect()
    }
}

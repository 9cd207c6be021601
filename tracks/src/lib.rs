//! Recorded flights of other programs: read, cleaned, put above the ellipsoid, made smooth.
//!
//! | module | what it holds |
//! |---|---|
//! | `unpack` | from bytes to text: out of archives, out of UTF-16 |
//! | [`format`](mod@format) | which format a text is in |
//! | `formats` | IGC, GPX, KML, X-Plane, Tacview, NMEA, ADS-B, tables: from text to columns |
//! | [`columns`] | which column of a table is what |
//! | [`fixes`] | the columns that all formats become |
//! | [`clean`] | times that go forwards, places that can be flown between; notes on the rest |
//! | [`datum`] | what altitudes are above |
//! | [`curve`] | a pose at any time |
//! | [`envelope`] | smooth bounds: the floor under heights, the lift over ground |
//! | [`fault`] | what is wrong, and where |
//!
//! In:    bytes of a file, its name, what its user says of it, the geoid.
//! Out:   [`Import`]: flights as curves, what was assumed, what was left out.
//! Keeps: nothing.
//! Not here: files, terrain, the file format `.ovf` (`overfly_replay`).
#![forbid(unsafe_code)]

mod attitude;
pub mod clean;
mod clock;
pub mod columns;
pub mod curve;
pub mod datum;
pub mod envelope;
pub mod fault;
pub mod fixes;
pub mod format;
mod formats;
mod grain;
mod spline;
mod text;
mod unpack;

pub use clean::Note;
pub use columns::ColumnMap;
pub use curve::Curve;
pub use datum::{Altitude, Undulation};
pub use fault::{Fault, TrackError};
pub use fixes::{Datum, Fixes};
pub use format::Format;

use curve::RowHeights;
use fixes::Sink;
use text::Text;

/// What a user may say of a file.
#[derive(Clone, PartialEq, Debug)]
pub struct Options {
    /// What its altitudes are above.
    pub altitude: Altitude,
    /// Longest time without a fix that is flown through, in seconds. `None`: ten usual intervals,
    /// between one minute and ten.
    pub gap_s: Option<f64>,
    /// What is in which column of a table; `None` where its titles say.
    pub columns: Option<ColumnMap>,
    /// Largest file, packed or unpacked, in bytes.
    pub bytes_max: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { altitude: Altitude::Auto, gap_s: None, columns: None, bytes_max: 512 << 20 }
    }
}

/// What a file holds.
#[derive(Clone, PartialEq, Debug)]
pub struct Import {
    /// Its format.
    pub format: Format,
    /// Its flights, in the order of the file; at least one.
    pub flights: Vec<Curve>,
    /// What its altitudes were taken for, and why: one line.
    pub assumed: String,
    /// What was left out or cut.
    pub notes: Vec<Note>,
    /// The first few records that could not be used.
    pub faults: Vec<Fault>,
    /// How many such records there are.
    pub fault_count: usize,
    /// Records without a position, or without a time.
    pub without_position: usize,
}

impl Import {
    /// The longest flight in time, of an aircraft if there is one; of those that are as long the
    /// first; its number from 0.
    pub fn longest(&self) -> usize {
        let rank = |flight: &Curve| (!flight.is_aside, flight.duration_s());
        let mut best = 0;
        for (i, flight) in self.flights.iter().enumerate() {
            if rank(flight) > rank(&self.flights[best]) {
                best = i;
            }
        }
        best
    }
}

/// Reads the columns of a file. `file` is its name, whose ending decides where the text does not.
///
/// # Errors
/// A file in no known format, too large, or with faults in more than a tenth of its records.
pub fn read(bytes: &[u8], file: &str, options: &Options) -> Result<Fixes, TrackError> {
    let whole = unpack::text_of(bytes, options.bytes_max)?;
    let text = Text::new(&whole);
    let format = match &options.columns {
        Some(_) => Some(Format::MappedCsv),
        None => Format::of(text.all, file),
    };
    let Some(format) = format else {
        let begins = text.all.trim_start().chars().take(30).filter(|c| !c.is_control()).collect();
        return Err(TrackError::Unknown { begins });
    };
    let mut sink = Sink::new(format, &text);
    match format {
        Format::Igc => formats::igc::read(&mut sink),
        Format::Gpx => formats::gpx::read(&mut sink),
        Format::Kml => formats::kml::read(&mut sink),
        Format::Fdr => formats::fdr::read(&mut sink),
        Format::Acmi => formats::acmi::read(&mut sink),
        Format::Nmea => formats::nmea::read(&mut sink),
        Format::BaseStation => formats::basestation::read(&mut sink),
        Format::AdsbJson => formats::json::read(&mut sink),
        Format::FlightGear | Format::AdsbCsv | Format::Csv | Format::MappedCsv => {
            formats::table::read(&mut sink, options.columns.as_ref())
        }
    }?;
    sink.finish()
}

/// Reads a file and makes flights of it.
///
/// # Errors
/// As [`read`]; altitudes that nobody can know the meaning of; no two fixes in a row.
pub fn import(
    bytes: &[u8],
    file: &str,
    options: &Options,
    undulation_m: Undulation<'_>,
) -> Result<Import, TrackError> {
    let mut fixes = read(bytes, file, options)?;
    if let Format::Acmi | Format::AdsbCsv | Format::AdsbJson | Format::BaseStation = fixes.format {
        // Tacview's frames may be out of order, and so are places by way of several receivers;
        // Flightradar24 and databases begin with the last.
        sort_by_time(&mut fixes);
    }
    let heights = datum::resolve(&fixes, options.altitude, undulation_m)?;
    let (stretches, mut notes) = clean::clean(&fixes, options.gap_s);
    if let Some((what, line)) = fixes.remark.take() {
        notes.insert(0, Note { what, count: 0, line });
    }
    let mut flights = Vec::new();
    let (mut spikes, mut bare) = (0, 0);
    for rows in &stretches {
        let start_ns = fixes.time_ns[rows[0]];
        let times_s: Vec<f64> =
            rows.iter().map(|&row| (fixes.time_ns[row] - start_ns) as f64 / 1e9).collect();
        let mut height_m: Vec<f64> = rows.iter().map(|&row| heights.height_m[row]).collect();
        spikes += datum::forget_spikes(&times_s, &mut height_m);
        let missing = datum::fill(&times_s, &mut height_m);
        if missing == rows.len() {
            bare += 1;
            continue;
        }
        let row_heights = RowHeights { height_m, step_m: heights.step_m, missing };
        flights.push(Curve::through(&fixes, rows, row_heights));
    }
    let line = fixes.line.first().copied().unwrap_or(1);
    for (count, what) in [
        (spikes, "with a height that nothing climbs to so fast; on a line between its neighbours"),
        (bare, "or more in a row left out, all without a height"),
    ] {
        if count > 0 {
            notes.push(Note { what: what.into(), count, line });
        }
    }
    if flights.is_empty() {
        let why = match notes.first() {
            Some(note) => format!("no two fixes that can be flown between; {note}"),
            None => "no two fixes that can be flown between".into(),
        };
        return Err(TrackError::Empty { format: fixes.format, why });
    }
    Ok(Import {
        format: fixes.format,
        flights,
        assumed: heights.assumed,
        notes,
        faults: fixes.faults,
        fault_count: fixes.fault_count,
        without_position: fixes.without_position,
    })
}

fn sort_by_time(fixes: &mut Fixes) {
    let mut order: Vec<usize> = (0..fixes.time_ns.len()).collect();
    order.sort_by_key(|&row| (fixes.time_ns[row], row));
    fn sorted<T: Copy>(column: &mut Vec<T>, order: &[usize]) {
        *column = order.iter().map(|&row| column[row]).collect();
    }
    sorted(&mut fixes.track, &order);
    sorted(&mut fixes.time_ns, &order);
    sorted(&mut fixes.lat_rad, &order);
    sorted(&mut fixes.lon_rad, &order);
    sorted(&mut fixes.height_m, &order);
    sorted(&mut fixes.pressure_m, &order);
    sorted(&mut fixes.undulation_m, &order);
    sorted(&mut fixes.attitude_rad, &order);
    sorted(&mut fixes.line, &order);
}

//! Flights from the CSV files of a flight simulator, resampled to a steady rate.
//!
//! In:    columns utc, `lat_deg`, `lon_deg`, `alt_msl_m`, `heading_deg`, `pitch_deg`, `roll_deg`.
//! Out:   a [`Flight`] through every row, smooth in between, on a binary grid.
//! Keeps: nothing.
//! Not here: other formats; the geoid.
//! Source: de Boor 1978, A Practical Guide to Splines, chapter IV (natural cubic spline).
//!
//! Altitudes above mean sea level are taken as heights above the ellipsoid: the procedural planet,
//! over which these flights are flown, has no geoid.

use crate::flight::Flight;
use crate::pose::Pose;
use core::f64::consts::{PI, TAU};
use core::fmt;
use overfly_core::geodesy::Geodetic;
use overfly_core::units::Radians;

/// Latitudes and longitudes are multiples of this: 0.05 mm and 0.1 mm on the Earth's equator.
pub const GRID_RAD: [f64; 2] = [1.0 / (1_u64 << 37) as f64, 1.0 / (1_u64 << 36) as f64];
/// Heights are multiples of this: a quarter of a millimetre.
pub const GRID_M: f64 = 1.0 / 4096.0;
/// Headings, pitches and rolls are multiples of this: a tenth of an arc second.
pub const GRID_ATTITUDE_RAD: f64 = 1.0 / (1_u64 << 21) as f64;

const COLUMNS: [&str; 7] =
    ["utc", "lat_deg", "lon_deg", "alt_msl_m", "heading_deg", "pitch_deg", "roll_deg"];

/// Why a CSV file is no flight.
#[derive(Debug)]
pub enum ImportError {
    /// It is not CSV.
    Csv {
        /// What the reader said, with the line.
        source: csv::Error,
    },
    /// A column is missing.
    Column {
        /// Its name.
        name: &'static str,
    },
    /// A field is no finite number or no time.
    Value {
        /// Row, from 1, without the headings.
        row: usize,
        /// Name of the column.
        column: &'static str,
        /// What was found.
        found: String,
    },
    /// A time is not after the one before.
    Order {
        /// Row, from 1, without the headings.
        row: usize,
    },
    /// Fewer than two rows.
    TooShort {
        /// How many.
        rows: usize,
    },
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Csv { source } => write!(f, "not a table: {source}"),
            Self::Column { name } => write!(f, "column {name} is missing"),
            Self::Value { row, column, found } => {
                write!(f, "row {row}, column {column}: expected a value, found \"{found}\"")
            }
            Self::Order { row } => {
                write!(f, "row {row}: its time is not after that of the row before")
            }
            Self::TooShort { rows } => write!(f, "expected at least 2 rows, found {rows}"),
        }
    }
}

impl core::error::Error for ImportError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Csv { source } => Some(source),
            _ => None,
        }
    }
}

/// The rows of a CSV file as poses; times count from the first row, angles do not wrap.
///
/// # Errors
/// The first row or column that cannot be used.
pub fn rows_from_csv(text: &[u8]) -> Result<Vec<Pose>, ImportError> {
    let refused = |source| ImportError::Csv { source };
    let mut reader = csv::Reader::from_reader(text);
    let headings = reader.headers().map_err(refused)?.clone();
    let mut columns = [0; COLUMNS.len()];
    for (column, name) in columns.iter_mut().zip(COLUMNS) {
        let found = headings.iter().position(|heading| heading == name);
        *column = found.ok_or(ImportError::Column { name })?;
    }
    let mut poses: Vec<Pose> = Vec::new();
    let mut start_s = 0.0;
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(refused)?;
        let field = |c: usize| record.get(columns[c]).unwrap_or("");
        let mut pose = pose_of_row(field).map_err(|c| ImportError::Value {
            row: i + 1,
            column: COLUMNS[c],
            found: field(c).into(),
        })?;
        if i == 0 {
            start_s = pose.time_s;
        }
        pose.time_s -= start_s;
        if let Some(before) = poses.last() {
            // Within a day, a clock that runs backwards has passed midnight.
            if pose.time_s < before.time_s - 43_200.0 {
                pose.time_s += 86_400.0;
            }
            if pose.time_s <= before.time_s {
                return Err(ImportError::Order { row: i + 1 });
            }
            pose.at.lon_rad = unwrapped(pose.at.lon_rad, before.at.lon_rad);
            pose.heading.0 = unwrapped(pose.heading.0, before.heading.0);
            pose.roll.0 = unwrapped(pose.roll.0, before.roll.0);
        }
        poses.push(pose);
    }
    Ok(poses)
}

/// The flight through the rows of a CSV file, `rate_hz` frames a second, from the first row on.
///
/// Natural cubic splines through all seven columns: position and attitude are twice continuously
/// differentiable but for the rounding to the grid ([`GRID_RAD`], [`GRID_M`],
/// [`GRID_ATTITUDE_RAD`]), without which the file would be three times as large.
///
/// # Errors
/// As [`rows_from_csv`], and where there are fewer than two rows.
pub fn flight_from_csv(text: &[u8], name: &str, rate_hz: f64) -> Result<Flight, ImportError> {
    let rows = rows_from_csv(text)?;
    if rows.len() < 2 {
        return Err(ImportError::TooShort { rows: rows.len() });
    }
    let splines = [
        Spline::new(&rows, |row| row.at.lat_rad),
        Spline::new(&rows, |row| row.at.lon_rad),
        Spline::new(&rows, |row| row.at.height_m),
        Spline::new(&rows, |row| row.heading.0),
        Spline::new(&rows, |row| row.pitch.0),
        Spline::new(&rows, |row| row.roll.0),
    ];
    let end_s = rows[rows.len() - 1].time_s;
    // Times of rows are rounded: the last row counts even if it lies a rounding before the frame.
    let times = (0_u32..).map(|i| f64::from(i) / rate_hz).take_while(|&t| t <= end_s + 1e-6);
    let mut poses = Vec::new();
    let mut segment = 0;
    for time_s in times {
        while segment + 2 < rows.len() && rows[segment + 1].time_s <= time_s {
            segment += 1;
        }
        let [lat, lon, height_m, heading, pitch, roll] =
            splines.each_ref().map(|spline| spline.at(&rows, segment, time_s));
        let angle = |rad: f64| Radians(on_grid(rad, GRID_ATTITUDE_RAD));
        let [lat_rad, lon_rad] = [on_grid(lat, GRID_RAD[0]), on_grid(wrapped(lon), GRID_RAD[1])];
        poses.push(Pose {
            time_s,
            at: Geodetic { lat_rad, lon_rad, height_m: on_grid(height_m, GRID_M) },
            heading: angle(heading - TAU * (heading / TAU).floor()),
            pitch: angle(pitch),
            roll: angle(wrapped(roll)),
        });
    }
    Ok(Flight { name: name.into(), rate_hz, poses, raised_m: 0.0 })
}

/// A row's pose, with the seconds of its day as time; the column that makes no sense otherwise.
fn pose_of_row<'a>(field: impl Fn(usize) -> &'a str) -> Result<Pose, usize> {
    let number = |c: usize| field(c).trim().parse().ok().filter(|x: &f64| x.is_finite()).ok_or(c);
    let angle = |c: usize| number(c).map(Radians::from_degrees);
    Ok(Pose {
        time_s: seconds_of_day(field(0)).ok_or(0_usize)?,
        at: Geodetic { lat_rad: angle(1)?.0, lon_rad: angle(2)?.0, height_m: number(3)? },
        heading: angle(4)?,
        pitch: angle(5)?,
        roll: angle(6)?,
    })
}

/// Seconds since midnight of a time like `2024-07-15T09:00:00.100Z`.
fn seconds_of_day(utc: &str) -> Option<f64> {
    let (_, clock) = utc.trim().strip_suffix('Z')?.split_once('T')?;
    let mut parts = clock.split(':').map(|part| part.parse::<f64>().ok());
    let [hours, minutes, seconds] = [parts.next()??, parts.next()??, parts.next()??];
    Some(hours * 3600.0 + minutes * 60.0 + seconds).filter(|s| s.is_finite())
}

/// The same angle, at most half a turn from `before`.
fn unwrapped(angle_rad: f64, before_rad: f64) -> f64 {
    angle_rad - TAU * ((angle_rad - before_rad) / TAU).round()
}

/// The same angle within ±π.
fn wrapped(angle_rad: f64) -> f64 {
    if angle_rad.abs() <= PI { angle_rad } else { unwrapped(angle_rad, 0.0) }
}

fn on_grid(value: f64, grid: f64) -> f64 {
    (value / grid).round() * grid
}

/// A natural cubic spline through one column of the rows.
struct Spline {
    values: Vec<f64>,
    /// Second derivatives at the rows.
    curvatures: Vec<f64>,
}

impl Spline {
    fn new(rows: &[Pose], column: impl Fn(&Pose) -> f64) -> Self {
        let n = rows.len();
        let values: Vec<f64> = rows.iter().map(column).collect();
        let step = |i: usize| rows[i + 1].time_s - rows[i].time_s;
        let slope = |i: usize| (values[i + 1] - values[i]) / step(i);
        // Elimination in the tridiagonal system; its diagonal dominates, so no pivots are needed.
        let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
        for i in 1..n - 1 {
            let (before, after) = (step(i - 1), step(i));
            let pivot = 2.0 * (before + after) - before * upper[i - 1];
            upper[i] = after / pivot;
            right[i] = (6.0 * (slope(i) - slope(i - 1)) - before * right[i - 1]) / pivot;
        }
        let mut curvatures = vec![0.0; n];
        for i in (1..n - 1).rev() {
            curvatures[i] = right[i] - upper[i] * curvatures[i + 1];
        }
        Self { values, curvatures }
    }

    /// The value at `time_s` between row `i` and the next.
    fn at(&self, rows: &[Pose], i: usize, time_s: f64) -> f64 {
        let step_s = rows[i + 1].time_s - rows[i].time_s;
        let b = (time_s - rows[i].time_s) / step_s;
        let a = 1.0 - b;
        let bend = (a * a * a - a) * self.curvatures[i] + (b * b * b - b) * self.curvatures[i + 1];
        a * self.values[i] + b * self.values[i + 1] + bend * step_s * step_s / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::trig;

    const HEAD: &str = "utc,lat_deg,lon_deg,alt_msl_m,heading_deg,pitch_deg,roll_deg\n";

    fn flight_of(rows: &str) -> Result<Flight, ImportError> {
        flight_from_csv(format!("{HEAD}{rows}").as_bytes(), "test", 10.0)
    }

    #[test]
    fn midnight_north_and_the_antimeridian_are_crossed_the_short_way() {
        let flight = flight_of(
            "2024-07-15T23:59:59.500Z,10,179.9,100,359,1,0\n\
             2024-07-16T00:00:00.500Z,10,-179.9,110,1,1,0\n",
        )
        .unwrap();
        assert_eq!(flight.poses.len(), 11);
        let middle = &flight.poses[5];
        assert!((middle.at.lon_rad.abs() - PI).abs() < 1e-9);
        assert!(middle.heading.0 < 1e-6 || middle.heading.0 > TAU - 1e-6);
        assert!((middle.at.height_m - 105.0).abs() < 1e-3);
        assert!((flight.poses[10].at.lon_rad + Radians::from_degrees(179.9).0).abs() < 1e-9);
    }

    #[test]
    fn a_cubic_with_straight_ends_is_followed_between_rows() {
        // The natural spline of few rows of a sine is within a thousandth of it.
        let rows: String = (0..=20)
            .map(|i| {
                let height = trig::sin(f64::from(i) * PI / 20.0);
                format!("2024-07-15T00:00:{:02}.0Z,0,0,{height},0,0,0\n", i)
            })
            .collect();
        for pose in flight_of(&rows).unwrap().poses {
            let expected = trig::sin(pose.time_s * PI / 20.0);
            assert!((pose.at.height_m - expected).abs() < 1e-3, "{pose:?}");
        }
    }

    #[test]
    fn what_is_no_flight_is_refused_by_name() {
        let message = |rows: &str| flight_of(rows).unwrap_err().to_string();
        let row = "2024-07-15T00:00:00Z,0,0,0,0,0,0\n";
        assert_eq!(message(row), "expected at least 2 rows, found 1");
        assert_eq!(
            message(&format!("{row}{row}")),
            "row 2: its time is not after that of the row before"
        );
        assert_eq!(
            message("2024-07-15T00:00:00Z,0,0,high,0,0,0\n"),
            "row 1, column alt_msl_m: expected a value, found \"high\""
        );
        assert_eq!(
            message("noon,0,0,0,0,0,0\n"),
            "row 1, column utc: expected a value, found \"noon\""
        );
        let error = flight_from_csv(b"utc,lat_deg\n", "test", 10.0).unwrap_err();
        assert_eq!(error.to_string(), "column lon_deg is missing");
    }
}

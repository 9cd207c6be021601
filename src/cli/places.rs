//! Places that a command asks about: from arguments, or from a CSV file.
//!
//! In:    `LAT,LON` texts; a CSV file with latitudes, longitudes and perhaps names.
//! Out:   places in order; errors that name file, line, field, value and range.
//! Keeps: the open file.
//! Not here: what is asked about them (`probe`).

use super::Failure;
use csv::{Reader, ReaderBuilder, StringRecord, Trim};
use overfly::core::geodesy::Geodetic;
use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};

const LATITUDES: [&str; 3] = ["lat", "latitude", "lat_deg"];
const LONGITUDES: [&str; 4] = ["lon", "lng", "longitude", "lon_deg"];
const NAMES: [&str; 2] = ["id", "name"];

const LATITUDE: (&str, [f64; 2]) = ("latitude", [-90.0, 90.0]);
const LONGITUDE: (&str, [f64; 2]) = ("longitude", [-180.0, 360.0]);

/// One place, as it was given.
#[derive(Clone, PartialEq, Debug)]
pub struct Spot {
    /// Its id or name; empty where there is none.
    pub name: Option<String>,
    /// Degrees.
    pub lat_deg: f64,
    /// Degrees.
    pub lon_deg: f64,
}

impl Spot {
    /// On the ellipsoid.
    pub fn place(&self) -> Geodetic {
        Geodetic::from_degrees(self.lat_deg, self.lon_deg, 0.0)
    }
}

/// The arguments of a program, places in the south marked by a space in front: so that they are not
/// taken for options.
pub fn guarded(arguments: impl Iterator<Item = OsString>) -> impl Iterator<Item = OsString> {
    arguments.map(|argument| match argument.to_str() {
        Some(text) if is_southern(text) => format!(" {text}").into(),
        _ => argument,
    })
}

fn is_southern(text: &str) -> bool {
    let digits = text.strip_prefix('-').and_then(|rest| rest.split_once(','));
    digits.is_some_and(|(lat, _)| lat.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// A place from an argument, `LAT,LON` in degrees.
pub fn parse(text: &str) -> Result<Spot, String> {
    let text = text.trim();
    let split = text.split_once(',').filter(|(_, lon)| !lon.contains(','));
    let (lat, lon) = split.ok_or_else(|| format!("`{text}` is not LAT,LON in degrees"))?;
    Ok(Spot {
        name: None,
        lat_deg: degrees(LATITUDE, lat.trim())?,
        lon_deg: degrees(LONGITUDE, lon.trim())?,
    })
}

fn degrees((field, [least, most]): (&str, [f64; 2]), text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (least..=most).contains(value));
    value.ok_or_else(|| format!("{field} `{text}` is not a number from {least} to {most}"))
}

/// The places of a CSV file, one after the other.
pub struct Table {
    path: PathBuf,
    reader: Reader<File>,
    record: StringRecord,
    /// The first line is a place already.
    pending: bool,
    columns: Columns,
}

/// Which columns hold what.
struct Columns {
    lat: usize,
    lon: usize,
    name: Option<(usize, String)>,
}

impl Table {
    /// Opens a file and looks at its first line: names of columns, or a place already.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let file = File::open(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .from_reader(file);
        let columns = Columns { lat: 0, lon: 1, name: None };
        let record = StringRecord::new();
        let mut table = Self { path: path.to_owned(), reader, record, pending: false, columns };
        if !table.read()? {
            return Err(format!("{}: there is nothing in it", path.display()).into());
        }
        let is_number = |at: usize| table.record.get(at).is_some_and(|t| t.parse::<f64>().is_ok());
        table.pending = is_number(0) || is_number(1);
        if !table.pending {
            table.columns = Columns::named(&table.record);
        }
        Ok(table)
    }

    /// How the column with names is called, if there is one.
    pub fn name_column(&self) -> Option<&str> {
        self.columns.name.as_ref().map(|(_, title)| title.as_str())
    }

    /// How many bytes were read.
    pub fn bytes_read(&self) -> u64 {
        self.reader.position().byte()
    }

    fn read(&mut self) -> Result<bool, Failure> {
        let read = self.reader.read_record(&mut self.record);
        Ok(read.map_err(|error| format!("{}: {error}", self.path.display()))?)
    }

    fn spot(&self) -> Result<Spot, String> {
        let column = |at: usize, of: (&str, [f64; 2])| match self.record.get(at) {
            Some(text) => degrees(of, text),
            None => Err(format!("{} is missing: there is no column {}", of.0, at + 1)),
        };
        let Columns { lat, lon, name } = &self.columns;
        let name = name.as_ref().map(|(at, _)| self.record.get(*at).unwrap_or("").to_owned());
        let (lat_deg, lon_deg) = (column(*lat, LATITUDE)?, column(*lon, LONGITUDE)?);
        Ok(Spot { name, lat_deg, lon_deg })
    }
}

impl Columns {
    /// By their titles; without known ones the first two.
    fn named(titles: &StringRecord) -> Self {
        let find = |known: &[&str]| {
            titles.iter().position(|title| known.contains(&title.to_ascii_lowercase().as_str()))
        };
        let name = find(&NAMES).map(|at| (at, titles[at].to_owned()));
        let (lat, lon) = find(&LATITUDES).zip(find(&LONGITUDES)).unwrap_or((0, 1));
        Self { lat, lon, name }
    }
}

impl Iterator for Table {
    type Item = Result<Spot, Failure>;

    fn next(&mut self) -> Option<Self::Item> {
        if !std::mem::take(&mut self.pending) {
            match self.read() {
                Ok(true) => {}
                Ok(false) => return None,
                Err(error) => return Some(Err(error)),
            }
        }
        let line = self.record.position().map_or(0, csv::Position::line);
        let spot = self.spot();
        Some(spot.map_err(|what| format!("{}:{line}: {what}", self.path.display()).into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<Vec<Spot>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("places.csv");
        std::fs::write(&path, text).unwrap();
        let table = Table::open(&path).map_err(|error| error.to_string())?;
        table.map(|spot| spot.map_err(|error| error.to_string())).collect()
    }

    #[test]
    fn columns_are_found_by_their_titles_or_are_the_first_two() {
        let spot = |name: Option<&str>| Spot {
            name: name.map(str::to_owned),
            lat_deg: -33.5,
            lon_deg: 18.25,
        };
        for text in ["-33.5,18.25\n", "y,x\n-33.5,18.25\n", "\u{feff}-33.5, 18.25, more\n"] {
            assert_eq!(table(text), Ok(vec![spot(None)]), "{text}");
        }
        let titled = "Name,utc,Longitude,LAT\nCape,12:00,18.25,-33.5\n\"a, b\",,18.25,-33.5\n";
        assert_eq!(table(titled), Ok(vec![spot(Some("Cape")), spot(Some("a, b"))]));
    }

    #[test]
    fn faults_name_file_line_field_value_and_range() {
        for (text, parts) in [
            ("lat,lon\n1,2\n97.3,11\n", vec!["places.csv:3", "latitude `97.3`", "-90 to 90"]),
            ("1,2\n3,x\n", vec!["places.csv:2", "longitude `x`", "-180 to 360"]),
            ("lat,lon\nnan,0\n", vec!["latitude `nan`"]),
            ("1\n", vec!["places.csv:1", "longitude is missing", "column 2"]),
            ("", vec!["places.csv", "nothing in it"]),
        ] {
            let error = table(text).unwrap_err();
            assert!(parts.iter().all(|part| error.contains(part)), "{text}: {error}");
        }
    }

    #[test]
    fn arguments_are_two_numbers_and_may_be_negative() {
        let given = ["overfly", "probe", "--at", "-33.5, -70", "-v", "-1"].map(OsString::from);
        let guarded: Vec<_> = guarded(given.into_iter()).collect();
        assert_eq!(guarded, ["overfly", "probe", "--at", " -33.5, -70", "-v", "-1"]);
        let spot = parse(guarded[3].to_str().unwrap()).unwrap();
        assert_eq!((spot.lat_deg, spot.lon_deg), (-33.5, -70.0));
        for (text, part) in [
            ("1;2", "LAT,LON"),
            ("1,2,3", "LAT,LON"),
            ("91,0", "latitude `91` is not a number from -90 to 90"),
            ("0,inf", "longitude `inf`"),
        ] {
            assert!(parse(text).unwrap_err().contains(part), "{text}");
        }
    }
}

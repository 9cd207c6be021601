//! Answers about places, written as CSV or JSON.
//!
//! In:    places and the ground there, one after the other.
//! Out:   a table on the screen, or a file that is there whole or not at all.
//! Keeps: the open output.
//! Not here: how answers are found (`probe`).

use super::Failure;
use super::places::Spot;
use overfly::core::datasource::page::Origin;
use overfly::core::geodesy::trig::{atan2, hypot};
use overfly::core::ground::{Answer, Height};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Forms of output.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub enum Format {
    /// One line a place, with a line of titles.
    Csv,
    /// One object with an array of places.
    Json,
}

/// Titles after the name of the place, in both forms.
const TITLES: [&str; 15] = [
    "lat_deg",
    "lon_deg",
    "height_m",
    "height_above_sea_m",
    "sea_level_m",
    "normal_x",
    "normal_y",
    "normal_z",
    "slope_deg",
    "aspect_deg",
    "level",
    "bound_m",
    "status",
    "origin",
    "water",
];

/// Below this slope there is no direction downhill, in degrees.
const FLAT_DEG: f64 = 1e-6;

/// Where answers go.
pub struct Answers {
    format: Format,
    name_column: Option<String>,
    sink: BufWriter<Box<dyn Write>>,
    /// The file that is written, and the one that it becomes.
    places: Option<(PathBuf, PathBuf)>,
    any: bool,
}

impl Answers {
    /// Begins a table on the screen, or in `file`.
    pub fn create(
        format: Format,
        name_column: Option<&str>,
        file: Option<&Path>,
    ) -> Result<Self, Failure> {
        let places = file.map(|path| {
            let mut beside = path.as_os_str().to_owned();
            beside.push(".part");
            (PathBuf::from(beside), path.to_owned())
        });
        let sink: Box<dyn Write> = match &places {
            None => Box::new(Screen),
            Some((beside, _)) => {
                let made = File::create(beside);
                Box::new(made.map_err(|error| format!("{}: {error}", beside.display()))?)
            }
        };
        let name_column = name_column.map(str::to_owned);
        let mut answers =
            Self { format, name_column, sink: BufWriter::new(sink), places, any: false };
        answers.head()?;
        Ok(answers)
    }

    fn head(&mut self) -> Result<(), Failure> {
        match self.format {
            Format::Csv => {
                let titles = self.name_column.as_deref().into_iter().chain(TITLES);
                csv_line(&mut self.sink, titles)?;
            }
            Format::Json => self.sink.write_all(b"{\"format\":\"overfly-probe-1\",\"places\":[")?,
        }
        Ok(())
    }

    /// The next place.
    pub fn add(&mut self, spot: &Spot, answer: Answer) -> Result<(), Failure> {
        let row = row(spot, answer);
        match self.format {
            Format::Csv => {
                let cells: Vec<String> = row.iter().zip(DIGITS).map(cell).collect();
                let name = self.name_column.as_ref().map(|_| spot.name.as_deref().unwrap_or(""));
                csv_line(&mut self.sink, name.into_iter().chain(cells.iter().map(String::as_str)))?;
            }
            Format::Json => {
                let named = self.name_column.iter().map(|title| (title.clone(), json!(spot.name)));
                let rest = TITLES.iter().map(|title| (*title).to_owned()).zip(row);
                let object: serde_json::Map<String, Value> = named.chain(rest).collect();
                let comma = if self.any { ",\n" } else { "\n" };
                write!(self.sink, "{comma}{}", Value::Object(object))?;
            }
        }
        self.any = true;
        Ok(())
    }

    /// Ends the table; a file takes its name.
    pub fn finish(mut self) -> Result<(), Failure> {
        if self.format == Format::Json {
            self.sink.write_all(b"\n]}\n")?;
        }
        self.sink.flush()?;
        if let Some((beside, path)) = self.places.take() {
            std::fs::rename(&beside, &path)
                .map_err(|error| format!("{}: {error}", path.display()))?;
        }
        Ok(())
    }
}

/// The screen. A reader that went away, as in `overfly … | head`, is no reason to fail.
struct Screen;

impl Write for Screen {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match io::stdout().write(bytes) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(bytes.len()),
            other => other,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match io::stdout().flush() {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}

impl Drop for Answers {
    fn drop(&mut self) {
        if let Some((beside, _)) = &self.places {
            // What is half written helps nobody; that it cannot be removed changes nothing.
            let _ = std::fs::remove_file(beside);
        }
    }
}

fn csv_line<'a>(
    sink: &mut impl Write,
    cells: impl Iterator<Item = &'a str>,
) -> Result<(), Failure> {
    let mut line = csv::WriterBuilder::new().buffer_capacity(512).from_writer(sink);
    line.write_record(cells)?;
    line.flush()?;
    Ok(())
}

/// Decimals of each number in CSV.
const DIGITS: [usize; 15] = [9, 9, 4, 4, 4, 7, 7, 7, 3, 1, 0, 3, 0, 0, 0];

fn cell((value, digits): (&Value, usize)) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Number(number) if digits > 0 => {
            format!("{:.digits$}", number.as_f64().expect("numbers here are f64"))
        }
        other => other.to_string(),
    }
}

/// Values under [`TITLES`].
fn row(spot: &Spot, answer: Answer) -> [Value; 15] {
    let status = match answer {
        Answer::Ok(_) => "ok",
        Answer::Coarser(_) => "coarser",
        Answer::NotReady => "not ready",
        Answer::Refused => "refused",
    };
    let none = || Value::Null;
    let [lat_deg, lon_deg] = [spot.lat_deg, spot.lon_deg].map(Value::from);
    let Some(found) = answer.found() else {
        let status = json!(status);
        let mut row: [Value; 15] = std::array::from_fn(|_| none());
        (row[0], row[1], row[12]) = (lat_deg, lon_deg, status);
        return row;
    };
    let Height { height_m, sea_level_m, normal, level, bound_m, origin, water } = found;
    let (slope_deg, aspect_deg) = slope(spot, &found);
    let origin = match origin {
        Origin::Procedural => "procedural",
        Origin::Measured => "measured",
        Origin::Filled => "filled",
    };
    [
        lat_deg,
        lon_deg,
        json!(height_m),
        json!(height_m - sea_level_m),
        json!(sea_level_m),
        json!(normal.x),
        json!(normal.y),
        json!(normal.z),
        json!(slope_deg),
        json!(aspect_deg),
        json!(level),
        json!(bound_m),
        json!(status),
        json!(origin),
        json!(water),
    ]
}

/// Steepness against the horizontal, and the direction downhill, clockwise from north.
fn slope(spot: &Spot, ground: &Height) -> (f64, Option<f64>) {
    let local = spot.place().enu_axes().transpose() * ground.normal;
    let slope_deg = atan2(hypot(local.x, local.y), local.z).to_degrees();
    let aspect_deg = atan2(local.x, local.y).to_degrees();
    let aspect_deg = if aspect_deg < 0.0 { aspect_deg + 360.0 } else { aspect_deg };
    (slope_deg, (slope_deg >= FLAT_DEG).then_some(aspect_deg))
}

//! `overfly import`: a flight recorded by another program, as poses at a steady rate.
//!
//! In:    a file in any of the formats of `overfly_tracks`, or a name with `#2` behind it.
//! Out:   an `.ovf` file for each of its flights; or a flight in memory, for other commands.
//! Keeps: which files it has spoken of.
//! Not here: formats, cleaning, smoothing (`overfly_tracks`), the `.ovf` format (`overfly_replay`).

use super::{Failure, INTERRUPTED, place_of};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::archive::OpenOptions;
use overfly::config;
use overfly::core::geodesy::Geodetic;
use overfly::core::ground::{Answer, Query};
use overfly::ingest::geoid::Geoid;
use overfly::replay::{Header, Writer};
use overfly::sources::Sources;
use overfly::surveyor::Surveyor;
use overfly_tracks::{Altitude, ColumnMap, Curve, Datum, Import, Options};
use parking_lot::Mutex;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Poses a second where nobody says.
const RATE_HZ: f64 = 60.0;
/// Notes and faults of each kind that are shown.
const SHOWN: usize = 10;
/// From so many poses on there is a progress bar.
const MANY: u64 = 50_000;
/// Most poses of a flight that is flown without being imported: 48 hours.
const POSES_MAX: u64 = 48 * 3600 * 60;
/// How often the ground is looked at for `--lift`, and over how long a lift is spread; seconds.
const LIFT_S: [f64; 2] = [0.25, 4.0];
/// Pages that the ground for `--lift` keeps: 64 MiB.
const PAGES: usize = 1024;

/// Shown under `import --help`.
const TEACHES: &str = "\
Formats, known by what is in the file: IGC, GPX, KML and KMZ (gx:Track, or placemarks with times),
X-Plane .fdr (versions 1 to 4), Tacview .acmi (text or zipped), NMEA, FlightGear's generic CSV,
ADS-B as CSV, JSON or BaseStation's lines (traffic library, OpenSky, readsb, Flightradar24), tables
of ForeFlight and Garmin, and overfly's own CSV; gzipped, zipped or not. Any other table needs a
column map, FILE.columns.ron or --columns; docs/import.md has examples.

What altitudes are above is what the file declares, else the habit of its format, else --altitude
must say; one line says what was assumed. Time that goes back, fixes of one time, jumps and gaps are
reported with their lines; gaps and jumps cut a file into flights. Attitudes come from the file, or
are those of a coordinated turn.

Other commands take such files directly: `overfly replay flight.igc`. They fly the longest flight in
it, or the second with `flight.igc#2`.

Examples:
  overfly import flight.igc
  overfly import flight.igc --list
  overfly import flight.igc --flight 2 --altitude msl --output second.ovf
  overfly import log.csv --columns log.ron --rate 120
  overfly import taxi.fdr --lift 1.5 --scene alps.ron";

/// What `import` takes.
#[derive(clap::Args)]
#[command(after_help = TEACHES)]
pub struct Arguments {
    /// The recorded flight.
    file: PathBuf,
    /// Poses a second, 0.1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = RATE_HZ, value_parser = parse_rate)]
    rate: f64,
    /// What the file's altitudes are above.
    #[arg(long, value_enum, default_value = "auto")]
    altitude: AltitudeName,
    /// The file to write; of several flights x-1.ovf, x-2.ovf and so on. [default: the file's name
    /// with .ovf, in this folder]
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Only this flight of the file, from 1.
    #[arg(long, value_name = "N")]
    flight: Option<usize>,
    /// Longest time without a fix that is flown through, 1 to 3600 seconds. [default: ten usual
    /// intervals, 60 to 600]
    #[arg(long, value_name = "SECONDS", value_parser = parse_gap)]
    gap: Option<f64>,
    /// What is in which column of a table, in RON. [default: FILE.columns.ron, if it is there]
    #[arg(long, value_name = "MAP")]
    columns: Option<PathBuf>,
    /// Raises the flight where it comes nearer than this to the ground of --scene, as to the height
    /// of the eye above its wheels; -100 to 10000 metres.
    #[arg(long, value_name = "METRES", value_parser = parse_lift, allow_hyphen_values = true)]
    lift: Option<f64>,
    /// The scene of --lift: a file or a preset (earth, moon, small).
    #[arg(long, default_value = "earth", requires = "lift")]
    scene: String,
    /// Only shows what is in the file.
    #[arg(long, conflicts_with_all = ["output", "lift"])]
    list: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum AltitudeName {
    /// What the file declares, else the habit of its format.
    Auto,
    /// Mean sea level, by the geoid EGM96.
    Msl,
    /// The ellipsoid WGS 84.
    Ellipsoid,
    /// 1013.25 hPa, taken as sea level.
    Pressure,
}

impl AltitudeName {
    fn altitude(self) -> Altitude {
        match self {
            Self::Auto => Altitude::Auto,
            Self::Msl => Altitude::Above(Datum::Msl),
            Self::Ellipsoid => Altitude::Above(Datum::Ellipsoid),
            Self::Pressure => Altitude::Above(Datum::Pressure),
        }
    }
}

fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    let value = value.filter(|value| (least..=most).contains(value));
    value.ok_or_else(|| format!("`{text}` is not a number from {least} to {most}"))
}

fn parse_rate(text: &str) -> Result<f64, String> {
    within(text, 0.1, 1000.0)
}

fn parse_gap(text: &str) -> Result<f64, String> {
    within(text, 1.0, 3600.0)
}

fn parse_lift(text: &str) -> Result<f64, String> {
    within(text, -100.0, 10_000.0)
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let options = Options {
        altitude: arguments.altitude.altitude(),
        gap_s: arguments.gap,
        columns: columns(&arguments.file, arguments.columns.as_deref())?,
        ..Options::default()
    };
    let mut import = open(&arguments.file, &options)?;
    let count = import.flights.len();
    let chosen = match arguments.flight {
        None => 0..count,
        Some(number) if (1..=count).contains(&number) => number - 1..number,
        Some(number) => {
            let file = arguments.file.display();
            return Err(format!("--flight {number}: {file} holds the flights 1 to {count}").into());
        }
    };
    list(&import);
    if arguments.list {
        return Ok(ExitCode::SUCCESS);
    }
    let name = arguments.file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let name = name.unwrap_or_else(|| "flight".into());
    let output = arguments.output.clone().unwrap_or_else(|| format!("{name}.ovf").into());
    let mut taken: Vec<PathBuf> = fs::canonicalize(&arguments.file).into_iter().collect();
    taken.extend(arguments.columns.as_ref().and_then(|path| fs::canonicalize(path).ok()));
    let places = chosen.clone().map(|index| {
        let several = chosen.len() > 1;
        place_of(&if several { numbered(&output, index + 1) } else { output.clone() }, &mut taken)
    });
    let places = places.collect::<Result<Vec<_>, _>>()?;
    let mut ground = arguments.lift.map(|_| Floor::open(&arguments.scene)).transpose()?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    for (index, place) in chosen.zip(&places) {
        let curve = &mut import.flights[index];
        if let (Some(clearance_m), Some(ground)) = (arguments.lift, &mut ground) {
            ground.lift(curve, clearance_m)?;
        }
        let title = if count > 1 { format!("{name}-{}", index + 1) } else { name.clone() };
        if !write(curve, (&title, arguments.rate), place, &stop)? {
            eprintln!("overfly: interrupted; what was whole before is as it was");
            return Ok(ExitCode::from(INTERRUPTED));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// `x.ovf` as `x-2.ovf`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map(|ending| format!(".{}", ending.to_string_lossy()));
    path.with_file_name(format!("{stem}-{number}{}", ending.unwrap_or_default()))
}

/// The column map that was asked for, else the one beside the file.
fn columns(file: &Path, asked: Option<&Path>) -> Result<Option<ColumnMap>, Failure> {
    let beside = columns_of(file);
    let Some(path) = asked.or_else(|| beside.is_file().then_some(beside.as_path())) else {
        return Ok(None);
    };
    let named = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let text = fs::read_to_string(path).map_err(|error| named(&error))?;
    Ok(Some(ColumnMap::from_ron(&text).map_err(|error| named(&error))?))
}

/// Reads a file and says, once for each, what was assumed and left out.
fn open(file: &Path, options: &Options) -> Result<Import, Failure> {
    static SPOKEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
    let size = fs::metadata(file).map_err(|error| failed(&error))?.len();
    if size > options.bytes_max as u64 {
        let limit = options.bytes_max;
        return Err(failed(&format!("it has {size} bytes, allowed are {limit}")).into());
    }
    let bytes = fs::read(file).map_err(|error| failed(&error))?;
    let geoid = Geoid::egm96();
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let undulation = |lat_rad, lon_rad| geoid.undulation_m(lat_rad, lon_rad);
    let import = overfly_tracks::import(&bytes, &name, options, &undulation)
        .map_err(|error| failed(&error))?;
    let mut spoken = SPOKEN.lock();
    if !spoken.iter().any(|path| path == file) {
        spoken.push(file.to_path_buf());
        tell(file, &import);
    }
    Ok(import)
}

fn tell(file: &Path, import: &Import) {
    let file = file.display();
    eprintln!("overfly: {file}: {}, {}", import.format.name(), import.assumed);
    if import.fault_count > 0 {
        let count = import.fault_count;
        eprintln!("overfly: {file}: {count} records could not be used:");
        import.faults.iter().for_each(|fault| eprintln!("  {fault}"));
    }
    if import.without_position > 0 {
        let count = import.without_position;
        eprintln!("overfly: {file}: {count} records without position or time are left out");
    }
    for note in import.notes.iter().take(SHOWN) {
        eprintln!("overfly: {file}: {note}");
    }
    if import.notes.len() > SHOWN {
        eprintln!("overfly: {file}: and {} more such cuts", import.notes.len() - SHOWN);
    }
}

/// One line for each flight.
fn list(import: &Import) {
    say!(
        "{:>6} {:>20} {:>10} {:>8} {:>15}  attitude",
        "flight",
        "begins, UTC",
        "seconds",
        "fixes",
        "lines"
    );
    for (i, flight) in import.flights.iter().enumerate() {
        let [first, last] = flight.lines;
        let attitude = if flight.estimated { "estimated" } else { "recorded" };
        let name =
            if flight.name.is_empty() { String::new() } else { format!(", {}", flight.name) };
        say!(
            "{:>6} {:>20} {:>10.1} {:>8} {:>15}  {attitude}{name}",
            i + 1,
            begins(flight.start_ns),
            flight.duration_s(),
            flight.fixes,
            format!("{first}..{last}")
        );
    }
}

/// A time in UTC; of a day that nobody knows the time of day alone.
fn begins(ns: i64) -> String {
    let seconds = ns.div_euclid(1_000_000_000);
    let (days, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    let clock = format!("{:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60);
    if days < 2 {
        return clock;
    }
    // The inverse of counting days, after H. Hinnant: years that begin in March.
    let shifted = days + 719_468;
    let (era, of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let of_cycle = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * of_cycle + of_cycle / 4 - of_cycle / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = of_cycle + era * 400 + i64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {clock}")
}

/// Writes a flight beside its place and renames it there. False where it was stopped.
fn write(
    curve: &Curve,
    (name, rate_hz): (&str, f64),
    place: &Path,
    stop: &AtomicBool,
) -> Result<bool, Failure> {
    let frames = curve.count(rate_hz);
    let mut beside = place.as_os_str().to_owned();
    beside.push(".part");
    let beside = PathBuf::from(beside);
    // One that an earlier run left is of no use to anybody; if it stays, the writer says so.
    let _ = fs::remove_file(&beside);
    let mut writer = Writer::create(&beside, &Header { frames, ..Header::flight(name, rate_hz) })?;
    let bar = if frames > MANY { ProgressBar::new(frames) } else { ProgressBar::hidden() };
    bar.set_style(ProgressStyle::with_template("writing {bar:32} {pos}/{len}  {eta} left")?);
    let mut done = || {
        for (index, pose) in curve.poses(rate_hz).enumerate() {
            if index % 1024 == 0 {
                bar.set_position(index as u64);
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            writer.pose(&pose)?;
        }
        Ok(true)
    };
    let written: Result<bool, Failure> = done();
    bar.finish_and_clear();
    let written = written.and_then(|whole| {
        if whole {
            writer.finish()?;
            fs::rename(&beside, place).map_err(|error| format!("{}: {error}", place.display()))?;
        }
        Ok(whole)
    });
    if !matches!(written, Ok(true)) {
        let _ = fs::remove_file(&beside);
    } else {
        say!("wrote {}: {frames} poses at {rate_hz} Hz", place.display());
    }
    written
}

/// The ground that flights are kept above.
struct Floor {
    surveyor: Surveyor,
}

impl Floor {
    fn open(scene: &str) -> Result<Self, Failure> {
        let scene = config::load(scene)?;
        let sources = Sources::open(&scene, &OpenOptions::default())?;
        Ok(Self { surveyor: Surveyor::new(Arc::new(sources), PAGES) })
    }

    fn lift(&mut self, curve: &mut Curve, clearance_m: f64) -> Result<(), Failure> {
        let mut fault = None;
        let mut ground = |at: Geodetic| match self.surveyor.height(at, Query::BestResident) {
            Ok(Answer::Ok(height) | Answer::Coarser(height)) => height.height_m,
            Ok(_) => f64::NAN,
            Err(error) => {
                fault.get_or_insert(error);
                f64::NAN
            }
        };
        let most_m = curve.lift_over(clearance_m, LIFT_S, &mut ground);
        if let Some(error) = fault {
            return Err(format!("the ground of --scene: {error}").into());
        }
        say!("raised by {most_m:.1} m at most to stay {clearance_m} m above the ground");
        Ok(())
    }
}

/// The file in which the columns of a table may be described.
pub fn columns_of(file: &Path) -> PathBuf {
    let mut beside = file.as_os_str().to_owned();
    beside.push(".columns.ron");
    beside.into()
}

/// The file that a name means, and the number of a flight in it, from 1: `flight.igc#2`.
pub fn split(name: &str) -> (&Path, Option<usize>) {
    let whole = Path::new(name);
    let parts = name.rsplit_once('#').filter(|_| !whole.exists());
    match parts.and_then(|(file, number)| Some((file, number.parse().ok()?))) {
        Some((file, number)) => (Path::new(file), Some(number)),
        None => (whole, None),
    }
}

/// A flight of another program's file.
pub struct Foreign {
    /// The file's name, and the flight's number where there are several.
    pub name: String,
    /// Poses a second.
    pub rate_hz: f64,
    /// Where the aircraft is at any time.
    pub curve: Curve,
}

/// A flight of a file, for commands that fly it: the one with that number, else the longest.
pub fn flight(name: &str) -> Result<Foreign, Failure> {
    let (file, number) = split(name);
    let columns = columns(file, None)?;
    let mut import = open(file, &Options { columns, ..Options::default() }).map_err(|error| {
        format!("{error}; `overfly import --help` says what can be read, and how")
    })?;
    let count = import.flights.len();
    let index = match number {
        None => import.longest(),
        Some(number) if (1..=count).contains(&number) => number - 1,
        Some(number) => {
            let file = file.display();
            return Err(
                format!("{name}: {file} holds the flights 1 to {count}, not {number}").into()
            );
        }
    };
    let curve = import.flights.swap_remove(index);
    let poses = curve.count(RATE_HZ);
    if poses > POSES_MAX {
        let hours = curve.duration_s() / 3600.0;
        let most = POSES_MAX as f64 / RATE_HZ / 3600.0;
        return Err(format!(
            "{name}: lasts {hours:.0} hours, flown directly are {most:.0} at most; import it first, \
             with a lower --rate"
        )
        .into());
    }
    if count > 1 && number.is_none() {
        let (file, seconds) = (file.display(), curve.duration_s());
        eprintln!(
            "overfly: {file}: flight {} of {count} is flown, the longest ({seconds:.0} s); others \
             by {file}#N",
            index + 1
        );
    }
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let name = if count > 1 { format!("{stem}-{}", index + 1) } else { stem.into_owned() };
    Ok(Foreign { name, rate_hz: RATE_HZ, curve })
}

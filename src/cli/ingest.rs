//! `overfly ingest`: real elevation, or imagery, into an archive.
//!
//! In:    rasters of heights, or a picture; options.
//! Out:   a PMTiles archive, a table; an exit code.
//! Keeps: nothing.
//! Not here: what is done with the rasters (`overfly_ingest`).

use super::{Failure, INTERRUPTED};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::archive::Datum;
use overfly::core::geodesy::Ellipsoid;
use overfly::ingest::raster::{OpenOptions, Projection, TileEncoding};
use overfly::ingest::{
    BuildOptions, Difference, ImageryOptions, ImageryReport, IngestError, Progress, Report, build,
    build_imagery, verify, verify_imagery,
};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Shown under `ingest --help`.
const EXAMPLES: &str = "\
Examples:
  overfly ingest N49E011.hgt.zip N50E011.hgt.zip --output bavaria.pmtiles --verify
  overfly ingest etopo.tif rainier.tif --geoid egm96_15.gtx --output earth.pmtiles
  overfly ingest 'tiles/{z}/{x}/{y}.png' --encoding terrarium --output alps.pmtiles
  overfly ingest mola.tif --body mars --output mars.pmtiles
  overfly ingest world.png --extent=-180,-90,180,90 --scale 0.25 --offset -2000 --output world.pmtiles
  overfly ingest --imagery world.tif --attribution \"NASA\" --output world-colour.pmtiles

Then name it in a scene: sources: [Archive(\"bavaria.pmtiles\"), Procedural(seed: 2029)], and
imagery: [\"world-colour.pmtiles\"].";

/// What says how to read or to make heights, and nothing to a picture.
const OF_HEIGHTS: [&str; 10] = [
    "datum", "geoid", "blend", "level", "density", "encoding", "extent", "scale", "offset",
    "nodata",
];

/// What `ingest` takes.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// GeoTIFF (EPSG:4326, 3857), SRTM .hgt or .hgt.zip, 16-bit equirectangular .png, a folder of
    /// these, or a folder or template of {z}/{x}/{y}.png tiles. Finer inputs lie over coarser ones.
    #[arg(required_unless_present = "imagery", value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// A picture of the body instead: PNG or TIFF of 8 bits a channel, grey, RGB or RGBA. The whole
    /// body, equirectangular and twice as wide as high, unless a TIFF (EPSG:4326, 3857), --bounds or
    /// --projection say otherwise.
    #[arg(long, value_name = "PICTURE", conflicts_with_all = OF_HEIGHTS)]
    imagery: Option<PathBuf>,
    /// Edges of the picture in degrees.
    #[arg(long, value_name = "W,S,E,N", value_parser = parse_extent, allow_hyphen_values = true,
          requires = "imagery")]
    bounds: Option<[f64; 4]>,
    /// How the picture is projected. [default: equirectangular]
    #[arg(long, value_enum, requires = "imagery")]
    projection: Option<ProjectionName>,
    /// Whom to thank for the picture, wherever it is shown.
    #[arg(long, value_name = "TEXT", requires = "imagery", default_value = "")]
    attribution: String,
    /// The archive to write; an old one is replaced once the new one is whole.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// What the heights are above. [default: egm96 on the Earth, ellipsoid elsewhere]
    #[arg(long, value_enum)]
    datum: Option<DatumName>,
    /// Geoid undulations as a GTX grid, instead of EGM96's own harmonics.
    #[arg(long, value_name = "FILE")]
    geoid: Option<PathBuf>,
    /// earth, moon, mars (the sphere of 3396 km that its elevation models use), or A_M,F: equatorial
    /// radius in metres and flattening.
    #[arg(long, default_value = "earth", value_parser = parse_body)]
    body: (String, Ellipsoid),
    /// Width in metres over which inputs are blended into each other and into what lies beneath.
    /// [default: 8 postings]
    #[arg(long, value_name = "METRES", value_parser = parse_positive)]
    blend: Option<f64>,
    /// Deepest lattice level to make, 12 to 58. [default: what the postings ask for]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(12..=58))]
    level: Option<u8>,
    /// Lattice points a posting at least, 0.5 to 16: more cost bytes and keep the ground between
    /// postings nearer to straight lines. [default: 1.25]
    #[arg(long, value_name = "POINTS", value_parser = parse_density)]
    density: Option<f64>,
    /// How PNG tiles hold heights.
    #[arg(long, value_enum)]
    encoding: Option<EncodingName>,
    /// Extent in degrees of a plain PNG.
    #[arg(long, value_name = "W,S,E,N", value_parser = parse_extent, allow_hyphen_values = true)]
    extent: Option<[f64; 4]>,
    /// Metres a unit of a plain PNG.
    #[arg(long, value_name = "METRES", default_value_t = 1.0, allow_hyphen_values = true)]
    scale: f64,
    /// Height of unit 0 of a plain PNG in metres.
    #[arg(long, value_name = "METRES", default_value_t = 0.0, allow_hyphen_values = true)]
    offset: f64,
    /// A height that means no height, besides those that the files declare.
    #[arg(long, value_name = "HEIGHT", allow_hyphen_values = true)]
    nodata: Option<f64>,
    /// Reads the archive back and compares it with every posting.
    #[arg(long)]
    verify: bool,
    /// Threads. [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=64))]
    threads: Option<u8>,
}

#[derive(Clone, Copy, ValueEnum)]
enum DatumName {
    /// Mean sea level, by the geoid EGM96.
    Egm96,
    /// The body's ellipsoid.
    Ellipsoid,
}

#[derive(Clone, Copy, ValueEnum)]
enum EncodingName {
    /// R·256 + G + B/256 − 32768.
    Terrarium,
    /// −10000 + (R·65536 + G·256 + B)/10, as Mapbox has it.
    TerrainRgb,
}

#[derive(Clone, Copy, ValueEnum)]
enum ProjectionName {
    /// Degrees of longitude and latitude.
    Equirectangular,
    /// Web Mercator, EPSG:3857.
    Mercator,
}

fn parse_body(text: &str) -> Result<(String, Ellipsoid), String> {
    match text {
        "earth" => return Ok(("Earth".into(), Ellipsoid::WGS84)),
        "moon" => return Ok(("Moon".into(), Ellipsoid::MOON)),
        "mars" => return Ok(("Mars".into(), Ellipsoid { a_m: 3_396_000.0, f: 0.0 })),
        _ => {}
    }
    let wrong =
        || format!("`{text}` is not earth, moon, mars or A_M,F with A_M 500..1e9 and F -0.5..0.5");
    let (a_m, f) = text.split_once(',').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    let (a_m, f) = (number(a_m)?, number(f)?);
    if (500.0..=1e9).contains(&a_m) && (-0.5..=0.5).contains(&f) {
        Ok((format!("body of {a_m} m"), Ellipsoid { a_m, f }))
    } else {
        Err(wrong())
    }
}

fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1e6 => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0 and up to 1e6")),
    }
}

fn parse_density(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.5..=16.0).contains(&value) => Ok(value),
        _ => Err(format!("`{text}` is not a number from 0.5 to 16")),
    }
}

fn parse_extent(text: &str) -> Result<[f64; 4], String> {
    let wrong = || format!("`{text}` is not W,S,E,N in degrees with W below E and S below N");
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse())
        .collect::<Result<_, _>>()
        .map_err(|_| wrong())?;
    let [west, south, east, north] = numbers[..] else { return Err(wrong()) };
    let fits =
        west < east && south < north && east - west <= 360.0 && south >= -90.0 && north <= 90.0;
    if fits && west >= -540.0 { Ok([west, south, east, north]) } else { Err(wrong()) }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    if let Some(picture) = &arguments.imagery {
        refuse_heights(arguments, picture)?;
    }
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let inputs = arguments.inputs.iter().chain(&arguments.imagery);
    let mut taken: Vec<PathBuf> =
        inputs.filter_map(|path| std::fs::canonicalize(path).ok()).collect();
    let output = super::place_of(&arguments.output, &mut taken)?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template(
        "{msg:<10} {bar:32} {pos}/{len}  {per_sec}  {eta} left",
    )?);
    let made = match &arguments.imagery {
        Some(picture) => imagery(arguments, picture, output, (&stop, &bar)),
        None => elevation(arguments, output, (&stop, &bar)),
    };
    bar.finish_and_clear();
    match made {
        Err(IngestError::Stopped) => Ok(stopped()),
        made => Ok(made.map(|()| ExitCode::SUCCESS)?),
    }
}

/// A picture and heights are two archives.
fn refuse_heights(arguments: &Arguments, picture: &Path) -> Result<(), Failure> {
    if let Some(first) = arguments.inputs.first() {
        return Err(format!(
            "--imagery {} and the elevation {}: an archive holds one or the other; run ingest \
             twice, once for each",
            picture.display(),
            first.display()
        )
        .into());
    }
    Ok(())
}

fn show(bar: &ProgressBar, progress: Progress) {
    let (words, done, total) = match progress {
        Progress::Looking(done, total) => ("looking", done, total),
        Progress::Making(done, total) => ("making", done, total),
        Progress::Writing(done, total) => ("writing", done, total),
        Progress::Comparing(done, total) => ("comparing", done, total),
    };
    if bar.message() != words {
        bar.reset();
        bar.set_message(words);
    }
    bar.set_length(total);
    bar.set_position(done);
}

fn elevation(
    arguments: &Arguments,
    output: PathBuf,
    (stop, bar): (&AtomicBool, &ProgressBar),
) -> Result<(), IngestError> {
    let options = BuildOptions { output, ..options(arguments) };
    let report = build(&options, stop, &|progress| show(bar, progress))?;
    bar.suspend(|| tell(&options, &report));
    if arguments.verify {
        let differences = verify(&options, stop, &|progress| show(bar, progress))?;
        bar.suspend(|| tell_differences(&differences));
    }
    Ok(())
}

fn imagery(
    arguments: &Arguments,
    picture: &Path,
    output: PathBuf,
    (stop, bar): (&AtomicBool, &ProgressBar),
) -> Result<(), IngestError> {
    let options = ImageryOptions {
        input: picture.to_path_buf(),
        projection: arguments.projection.map(|name| match name {
            ProjectionName::Equirectangular => Projection::PlateCarree,
            ProjectionName::Mercator => Projection::WebMercator,
        }),
        bounds_deg: arguments.bounds,
        attribution: arguments.attribution.clone(),
        output,
        body: arguments.body.clone(),
    };
    let report = build_imagery(&options, stop, &|progress| show(bar, progress))?;
    bar.suspend(|| tell_imagery(&options, &report));
    if arguments.verify {
        let tiles = verify_imagery(&options, stop, &|progress| show(bar, progress))?;
        bar.suspend(|| say!("{tiles} tiles read back, all as they were written"));
    }
    Ok(())
}

fn tell_imagery(options: &ImageryOptions, report: &ImageryReport) {
    let ImageryReport { facts, kind, size: [columns, rows], .. } = report;
    say!("{}, imagery", facts.body_name);
    say!("{}: {kind} of {columns} × {rows} pixels, {} bytes", facts.source, report.bytes_in);
    say!("pixels {:.1} m apart, tiles of depth 0 to {}", facts.spacing_m, facts.depth);
    if !facts.attribution.is_empty() {
        say!("by {}", facts.attribution);
    }
    say!("content {:016x}", facts.content);
    say!("{}: {} tiles, {} bytes", options.output.display(), report.tiles, report.bytes);
}

fn stopped() -> ExitCode {
    eprintln!("overfly: interrupted; what was there before is as it was");
    ExitCode::from(INTERRUPTED)
}

fn options(arguments: &Arguments) -> BuildOptions {
    let is_earth = arguments.body.0 == "Earth";
    let datum = match arguments.datum {
        Some(DatumName::Egm96) => Datum::Egm96,
        Some(DatumName::Ellipsoid) => Datum::Ellipsoid,
        None if is_earth => Datum::Egm96,
        None => Datum::Ellipsoid,
    };
    BuildOptions {
        inputs: arguments.inputs.clone(),
        open: OpenOptions {
            encoding: arguments.encoding.map(|name| match name {
                EncodingName::Terrarium => TileEncoding::Terrarium,
                EncodingName::TerrainRgb => TileEncoding::TerrainRgb,
            }),
            extent_deg: arguments.extent,
            metres_per_unit: arguments.scale,
            offset_m: arguments.offset,
            nodata: arguments.nodata,
            ..OpenOptions::default()
        },
        output: arguments.output.clone(),
        body: arguments.body.clone(),
        datum,
        geoid: arguments.geoid.clone(),
        blend_m: arguments.blend,
        level_max: arguments.level,
        density: arguments.density,
    }
}

fn tell(options: &BuildOptions, report: &Report) {
    let facts = &report.facts;
    let datum = match facts.datum {
        Datum::Egm96 => "EGM96",
        Datum::Ellipsoid => "the ellipsoid",
    };
    say!("{}, heights above {datum}", facts.body_name);
    say!("{:>5} {:>10} {:>10} {:>9}  sources", "level", "spacing, m", "quantum, m", "blend, m");
    for layer in &facts.layers {
        say!(
            "{:>5} {:>10.1} {:>10.3} {:>9.1}  {}",
            2 * (layer.depth + 6),
            layer.spacing_m,
            layer.quantum_m,
            layer.blend_m,
            layer.sources.join(", ")
        );
    }
    let [postings, voids] = report.postings;
    say!("{postings} postings, {voids} of them void, {} bytes", report.bytes_in);
    say!("{}: {} tiles, {} bytes", options.output.display(), report.tiles, report.bytes);
}

fn tell_differences(differences: &[Difference]) {
    say!(
        "{:>5} {:>10} {:>10} {:>8} {:>8} {:>8}  difference to every posting that is seen",
        "level",
        "compared",
        "hidden",
        "rms, m",
        "99 %, m",
        "max, m"
    );
    for d in differences {
        say!(
            "{:>5} {:>10} {:>10} {:>8.3} {:>8.2} {:>8.2}  {}",
            d.level,
            d.compared,
            d.hidden,
            d.rms_m,
            d.p99_m,
            d.max_m,
            d.name.display()
        );
    }
}

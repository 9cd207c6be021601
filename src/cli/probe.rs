//! `overfly probe`: the ground at places, from a scene's data, as exactly as it is known.
//!
//! In:    a scene, places from arguments or a CSV file, a level.
//! Out:   a line a place: heights, normal, level, bound, status; CSV or JSON.
//! Keeps: nothing.
//! Not here: reading places (`places`), writing answers (`answers`), heights (the library).

use super::answers::{Answers, Format};
use super::places::{Spot, Table, parse};
use super::{Failure, place_of};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::archive::{Archive, Facts, LayerFacts, Location, OpenOptions};
use overfly::config;
use overfly::core::ground::{Answer, LEVEL_MAX, Place, Query};
use overfly::core::units::Metres;
use overfly::sources::{SourceError, Sources, level_of};
use overfly::surveyor::Surveyor;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::thread::ScopedJoinHandle;

/// Places that are looked at together: sorted by where they lie, answered by all cores.
const BATCH: usize = 65_536;
/// From so many places on there is a progress bar.
const MANY: usize = 10_000;
/// Pages that all threads together keep: 256 MiB.
const PAGES: usize = 4096;

const EXAMPLES: &str = "\
Each line has: latitude, longitude, height above the ellipsoid, height above sea level (EGM96 where
the data is over EGM96, else the ellipsoid), sea level above the ellipsoid, normal (body-fixed x, y,
z), slope, aspect (downhill, clockwise from north), lattice level, bound on the height's error
against anything finer, status (ok, coarser: data could not be read), origin of the nearest sample
(measured, filled, procedural), and whether the surface is water.

Examples:
  overfly probe --at 46.8523,-121.7603
  overfly probe --scene alps.ron --at 45.8326,6.8652 -33.96,18.40
  overfly probe --scene alps.ron --csv huts.csv --output heights.csv
  overfly probe --scene alps.ron --csv huts.csv --level within:5 --format json
  overfly probe --scene alps.ron --at 45.8326,6.8652 --level exact:30
  overfly probe --archive world-colour.pmtiles";

/// What `probe` takes.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// A scene file or a preset (earth, moon, small).
    #[arg(long, default_value = "earth")]
    scene: String,
    /// Places in degrees, south and west negative.
    #[arg(long, value_name = "LAT,LON", value_parser = parse, num_args = 1..,
          required_unless_present_any = ["csv", "archive"], conflicts_with = "csv")]
    at: Vec<Spot>,
    /// Shows what an archive, a file or an address, says about itself: its kind first.
    #[arg(long, value_name = "ARCHIVE", conflicts_with_all = ["at", "csv", "scene", "output"])]
    archive: Option<String>,
    /// Places from a file: columns lat (latitude, lat_deg) and lon (lng, longitude, lon_deg) by
    /// their titles, else the first two. A column id or name is kept.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Which surface. `best`: that of the finest data at each place, which for a layer of pages of
    /// depth d is level 2·(6 + d); where there is no data, the planet at about 1 m. `exact:N`:
    /// that of lattice level N, 0 to 56. `within:M`: the coarsest that is known to be within M
    /// metres of everything finer.
    #[arg(long, default_value = "best", value_name = "best|exact:N|within:M",
          value_parser = parse_level)]
    level: Query,
    /// Form of the output.
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// Writes to a file instead of the screen.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
}

fn parse_level(text: &str) -> Result<Query, String> {
    let wrong = || format!("`{text}` is not best, exact:N (0 to {LEVEL_MAX}) or within:M (metres)");
    match text.split_once(':') {
        None if text == "best" => Ok(Query::BestResident),
        Some(("exact", level)) => {
            let level = level.parse().ok().filter(|level| *level <= LEVEL_MAX);
            level.map(Query::Exact).ok_or_else(wrong)
        }
        Some(("within", metres)) => {
            let metres: Option<f64> = metres.parse().ok();
            let metres = metres.filter(|m| *m >= 0.0 && m.is_finite());
            metres.map(|metres| Query::Within(Metres(metres))).ok_or_else(wrong)
        }
        _ => Err(wrong()),
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    if let Some(name) = &arguments.archive {
        return describe(name);
    }
    let inputs = [Some(Path::new(&arguments.scene)), arguments.csv.as_deref()];
    let mut taken: Vec<PathBuf> =
        inputs.into_iter().flatten().filter_map(|path| path.canonicalize().ok()).collect();
    let output = arguments.output.as_deref().map(|path| place_of(path, &mut taken)).transpose()?;
    let scene = config::load(&arguments.scene)?;
    let table = arguments.csv.as_deref().map(Table::open).transpose()?;
    let sources = Arc::new(Sources::open(&scene, &OpenOptions::default())?);
    let name_column = table.as_ref().and_then(Table::name_column);
    let answers = Answers::create(arguments.format, name_column, output.as_deref())?;
    let mut probe = Probe::new(&sources, arguments.level, answers);
    match table {
        Some(table) => probe.table(table, arguments.csv.as_deref())?,
        None => probe.batch(&arguments.at)?,
    }
    probe.answers.finish()?;
    probe.named.values().for_each(|what| eprintln!("overfly: {what}"));
    Ok(ExitCode::SUCCESS)
}

/// What an archive says about itself.
fn describe(name: &str) -> Result<ExitCode, Failure> {
    let archive = Archive::open_any(&Location::parse(name), &OpenOptions::default())?;
    let row = |what: &str, text: &str| say!("{what:<12} {text}");
    match archive.facts() {
        Facts::Elevation(facts) => {
            let layer = |layer: &LayerFacts| level_of(layer.depth).to_string();
            let sources = facts.layers.iter().flat_map(|layer| layer.sources.iter().cloned());
            row("kind", "elevation");
            row("body", &facts.body_name);
            row("levels", &facts.layers.iter().map(layer).collect::<Vec<_>>().join(", "));
            row("sources", &sources.collect::<Vec<_>>().join(", "));
            row("content", &format!("{:016x}", facts.content));
        }
        Facts::Imagery(facts) => {
            row("kind", "imagery");
            row("body", &facts.body_name);
            row("depths", &format!("0 to {}", facts.depth));
            row("pixels", &format!("{:.1} m apart", facts.spacing_m));
            row("source", &facts.source);
            row("attribution", &facts.attribution);
            row("content", &format!("{:016x}", facts.content));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A probe under way.
struct Probe {
    query: Query,
    answers: Answers,
    surveyors: Vec<Surveyor>,
    /// What is wrong with archives, by name: said once, at the end.
    named: BTreeMap<String, String>,
}

impl Probe {
    fn new(sources: &Arc<Sources>, query: Query, answers: Answers) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let surveyor = |_| Surveyor::new(sources.clone(), PAGES / threads);
        let surveyors = (0..threads).map(surveyor).collect();
        Self { query, answers, surveyors, named: BTreeMap::new() }
    }

    fn table(&mut self, mut table: Table, path: Option<&Path>) -> Result<(), Failure> {
        let bytes = path.and_then(|path| path.metadata().ok()).map_or(0, |about| about.len());
        let style = "{bar:40} {percent} % {msg} places, {eta} left";
        let style = ProgressStyle::with_template(style).expect("a fixed template");
        let bar = ProgressBar::hidden().with_style(style);
        bar.set_length(bytes);
        let mut done = 0;
        loop {
            // The first batch is small, so that few places need no bar and many have one soon.
            let size = if done == 0 { MANY } else { BATCH };
            let batch = table.by_ref().take(size).collect::<Result<Vec<_>, _>>()?;
            if batch.is_empty() {
                break;
            }
            self.batch(&batch)?;
            if done == MANY {
                bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
            }
            done += batch.len();
            bar.set_message(done.to_string());
            bar.set_position(table.bytes_read());
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// Answers are written in the order of the places, whoever found them.
    fn batch(&mut self, spots: &[Spot]) -> Result<(), Failure> {
        let mut order: Vec<(u64, usize)> = spots.iter().map(near).zip(0..).collect();
        order.sort_unstable();
        let share = order.len().div_ceil(self.surveyors.len()).max(1);
        let query = self.query;
        let answer = |share: &[(u64, usize)], surveyor: &mut Surveyor| -> Vec<Found> {
            share.iter().map(|&(_, at)| ask(surveyor, &spots[at], query)).collect()
        };
        let answer = &answer;
        let found: Vec<Vec<Found>> = std::thread::scope(|scope| {
            let shares = order.chunks(share).zip(&mut self.surveyors);
            let threads: Vec<_> = shares
                .map(|(part, surveyor)| scope.spawn(move || answer(part, surveyor)))
                .collect();
            let join =
                |thread: ScopedJoinHandle<'_, _>| thread.join().expect("answering does not panic");
            threads.into_iter().map(join).collect()
        });
        let mut answers = vec![Answer::NotReady; spots.len()];
        for (found, &(_, at)) in found.into_iter().flatten().zip(&order) {
            answers[at] = found.answer;
            found.error.into_iter().for_each(|error| self.name(&error));
        }
        spots.iter().zip(answers).try_for_each(|(spot, answer)| self.answers.add(spot, answer))
    }

    fn name(&mut self, error: &SourceError) {
        let archive = error.archive().unwrap_or("the planet").to_owned();
        let what = || format!("{error}; answers there are marked: coarser, or not ready");
        self.named.entry(archive).or_insert_with(what);
    }
}

/// What is known of one place, and why no more.
struct Found {
    answer: Answer,
    error: Option<SourceError>,
}

fn ask(surveyor: &mut Surveyor, spot: &Spot, query: Query) -> Found {
    let at = spot.place();
    match surveyor.height(at, query) {
        Ok(answer) => Found { answer, error: None },
        Err(error) => Found { answer: surveyor.coarser(at, query), error: Some(error) },
    }
}

/// Places of one page have one number; neighbouring pages mostly follow each other.
fn near(spot: &Spot) -> u64 {
    const DEPTH: u8 = 20;
    let key = Place::of(spot.place().normal()).page(DEPTH);
    let spread =
        |along: u32| (0..DEPTH).fold(0, |sum, i| sum | u64::from(along >> i & 1) << (2 * i));
    u64::from(key.quadrant()) << (2 * DEPTH) | spread(key.x()) | spread(key.y()) << 1
}

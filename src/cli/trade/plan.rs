//! What a trade flies and how: the same for all its points.
//!
//! In:    a flight, a scene, the options.
//! Out:   [`Plan`]; the key of everything that is kept of a point.
//! Keeps: nothing.
//! Not here: the knobs (`overfly::replay::trade`), flying (`fly`).

use crate::cli::Failure;
use crate::cli::flown::{Flown, Manner};
use crate::cli::import;
use crate::cli::replay::{default_workers, parse_frames, parse_size};
use crate::cli::source::recording_header;
use overfly::config;
use overfly::core::digest::Chain;
use overfly::core::settings::{SceneSettings, SourceSettings, is_address};
use overfly::replay::BUNDLED;
use overfly::replay::trade::{Clip, Point, clips};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;

/// How a flight is flown, as arguments.
#[derive(clap::Args, Clone)]
pub struct Flying {
    /// A scene file or a preset (earth, moon, small).
    #[arg(long, default_value = "earth")]
    pub scene: String,
    /// Only these frames, the end excluded.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    pub frames: Option<Range<usize>>,
    /// One frame of so many is measured, each at the end of a clip.
    #[arg(long, value_name = "N", default_value_t = 6000, value_parser = positive)]
    pub every: usize,
    /// Frames of a clip; the terrain comes up before each, and what lies between is not flown.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = positive)]
    pub clip: usize,
    /// Rays of a measured frame, at least.
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    pub rays: u32,
    /// Size of the picture whose pixels errors are counted in.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Cells of the reference ground look no larger than this, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0, value_parser = cell)]
    pub cell_px: f64,
    /// Timing passes of each point, 1 to 99, in shuffled order between the points.
    #[arg(long, value_name = "N", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(1..=99))]
    pub repeats: u32,
    /// Folder for results; finished points are kept in its folder `points`. [default: out/FLIGHT]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

fn positive(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..) => Ok(count),
        _ => Err(format!("`{text}` is not a whole number from 1")),
    }
}

fn cell(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(px) if (0.1..=100.0).contains(&px) => Ok(px),
        _ => Err(format!("`{text}` is not a number from 0.1 to 100")),
    }
}

/// What is the same for all points, as files keep it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Ways {
    /// Name of the flight or path of its file.
    pub flight: String,
    /// Preset or path of the scene.
    pub scene: String,
    pub frames: Range<usize>,
    pub every: usize,
    pub clip: usize,
    pub rays: u32,
    pub size_px: [u32; 2],
    pub cell_px: f64,
    pub repeats: u32,
}

/// What is flown.
pub struct Plan {
    pub ways: Ways,
    pub clips: Vec<Clip>,
    /// Frames a second.
    pub rate_hz: f64,
    /// Of this program, the flight and what lies in the scene's archives.
    origin: u64,
}

impl Plan {
    /// The plan of a flight, and the scene's own point.
    pub fn of(flight: &str, flying: &Flying) -> Result<(Self, Point), Failure> {
        let scene = standing(config::load(&flying.scene)?)?;
        let workers = u8::try_from(default_workers())?;
        let base = Point { scene, loader_delay_ms: 0, workers };
        let ways = Ways {
            flight: flight.to_owned(),
            scene: flying.scene.clone(),
            frames: flying.frames.clone().unwrap_or(0..usize::MAX),
            every: flying.every,
            clip: flying.clip,
            rays: flying.rays,
            size_px: flying.size,
            cell_px: flying.cell_px,
            repeats: flying.repeats,
        };
        Ok((Self::over(ways, &base, flying.frames.is_some())?, base))
    }

    /// The plan that a file tells of.
    pub fn again(ways: Ways, base: &Point) -> Result<Self, Failure> {
        Self::over(ways, base, true)
    }

    fn over(mut ways: Ways, base: &Point, asked: bool) -> Result<Self, Failure> {
        let name = &ways.flight;
        if recording_header(name)?.is_some() {
            let what = "its meshes are of one scene; a trade needs a flight, poses alone";
            return Err(format!("{name} is a recording: {what}").into());
        }
        let flown = Flown::open(name, &base.scene, manner(&ways, base))?;
        let count = flown.source.frames();
        if asked && ways.frames.end > count {
            let Range { start, end } = ways.frames;
            return Err(
                format!("--frames {start}..{end}: {name} has {count} frames, 0..{count}").into()
            );
        }
        ways.frames.end = ways.frames.end.min(count);
        if ways.frames.is_empty() {
            return Err(format!("{name} holds no frame").into());
        }
        let mut origin = program()?;
        origin.add(flown.source.frames() as u64);
        let contents = format!("{:?}", flown.overfly.sources().contents());
        add_bytes(&mut origin, contents.as_bytes());
        if !BUNDLED.contains(&name.as_str()) {
            add_bytes(&mut origin, &std::fs::read(import::split(name).0)?);
        }
        Ok(Self {
            clips: clips(&ways.frames, ways.every, ways.clip, 0.0),
            rate_hz: flown.source.rate_hz(),
            origin: origin.0,
            ways,
        })
    }

    /// The same flight by clips that lie between these.
    pub fn between(&self) -> Self {
        let Ways { frames, every, clip, .. } = &self.ways;
        Self {
            clips: clips(frames, *every, *clip, 0.5),
            ways: self.ways.clone(),
            rate_hz: self.rate_hz,
            origin: self.origin,
        }
    }

    /// How a point is flown.
    pub fn manner(&self, point: &Point) -> Manner {
        manner(&self.ways, point)
    }

    /// Key of what was measured over a clip; workers change nothing of it.
    pub fn clip_key(&self, point: &Point, clip: &Clip) -> Result<u64, Failure> {
        let Ways { flight, rays, size_px, cell_px, .. } = &self.ways;
        let how = format!("clip {flight} {clip:?} {rays} {size_px:?} {cell_px:?}");
        self.key(point, &how)
    }

    /// Key of one timing pass.
    pub fn pass_key(&self, point: &Point, round: u32) -> Result<u64, Failure> {
        let Ways { flight, size_px, .. } = &self.ways;
        let (clips, workers) = (&self.clips, point.workers);
        self.key(point, &format!("pass {flight} {clips:?} {size_px:?} {workers} {round}"))
    }

    fn key(&self, point: &Point, how: &str) -> Result<u64, Failure> {
        let mut chain = Chain(self.origin);
        add_bytes(&mut chain, how.as_bytes());
        add_bytes(&mut chain, config::write(&point.scene)?.as_bytes());
        chain.add(u64::from(point.loader_delay_ms));
        Ok(chain.0)
    }
}

fn manner(ways: &Ways, point: &Point) -> Manner {
    Manner {
        workers: usize::from(point.workers),
        size_px: ways.size_px,
        delay_s: f64::from(point.loader_delay_ms) / 1e3,
    }
}

/// A scene whose archives are found from any folder.
fn standing(mut scene: SceneSettings) -> Result<SceneSettings, Failure> {
    let locations = scene.sources.iter_mut().filter_map(|source| match source {
        SourceSettings::Archive { location } => Some(location),
        SourceSettings::Procedural { .. } => None,
    });
    for location in locations.chain(&mut scene.imagery).filter(|at| !is_address(at)) {
        let path = std::path::absolute(&*location)?;
        *location = path.into_os_string().into_string().map_err(|_| "a path is not UTF-8")?;
    }
    Ok(scene)
}

/// The program itself: another build may measure other numbers.
fn program() -> Result<Chain, Failure> {
    let mut chain = Chain::default();
    add_bytes(&mut chain, &std::fs::read(std::env::current_exe()?)?);
    Ok(chain)
}

fn add_bytes(chain: &mut Chain, bytes: &[u8]) {
    for word in bytes.chunks(8) {
        let mut full = [0; 8];
        full[..word.len()].copy_from_slice(word);
        chain.add(u64::from_le_bytes(full));
    }
    chain.add(bytes.len() as u64);
}

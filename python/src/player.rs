//! A flight or a recording played frame by frame over a scene of its own.
//!
//! In:    the name of a bundled flight or an `.ovf` file, a scene, workers.
//! Out:   the terrain after each frame, and the frame's output.
//! Keeps: [`Player`]: the running scene, all poses or all recorded frames.
//! Not here: what is made of the frames (`replay`, `measure`).

use crate::raised::{OverflyError, failed, interrupted, refused, sentence};
use overfly::core::digest::FrameDigest;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::jobs::now_ns;
use overfly::loader::Loader;
use overfly::replay::{
    BUNDLED, Difference, Ending, Flight, Kind, Pose, Reader, RecordedFrame, Recording,
    first_difference, view_of,
};
use overfly::{Overfly, config};
use pyo3::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Most frames in which the terrain comes up.
const LEAD_IN_MAX: usize = 2000;

/// As many threads as there are cores but the caller's, 1 at least.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, |cores| cores.get() - 1).clamp(1, 64)
}

/// A scene from a preset's name, a path, or a text.
pub fn scene_of(scene: &Path) -> PyResult<SceneSettings> {
    let Some(scene) = scene.to_str() else {
        return Err(refused(format!("scene {} is not UTF-8", scene.display())));
    };
    if scene.contains('(') && scene.contains('\n') || scene.trim_start().starts_with("Scene(") {
        return config::read(scene, "scene").map_err(|faults| refused(faults.to_string()));
    }
    config::load(scene).map_err(|error| refused(sentence(&error)))
}

/// What is played, and how.
pub struct Wish {
    /// A bundled flight or an `.ovf` file.
    pub flight: PathBuf,
    /// Empty: a recording brings its own, else the Earth.
    pub scene: Option<PathBuf>,
    /// Threads beside the caller; empty: one for each other core.
    pub workers: Option<usize>,
    /// Of the pictures that errors are counted in; a recording brings its own.
    pub size_px: (u32, u32),
}

/// Where frames come from.
enum Kept {
    Poses(Vec<Pose>),
    Frames(Vec<RecordedFrame>),
}

/// A flight or recording under way.
pub struct Player {
    /// The scene.
    pub overfly: Overfly,
    /// How the scene is called.
    pub scene_name: String,
    /// Of the last frame.
    pub output: FrameOutput,
    /// How the flight is called.
    pub name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Size of the picture.
    pub size_px: [u32; 2],
    /// What of a file cannot be read; the frames before it are played.
    pub damage: Option<String>,
    /// Frames of a recording at whose beginning time stands still: the terrain comes up.
    lead_in: usize,
    /// Pages arrive as recorded, and frames are held against recorded states.
    is_followed: bool,
    kept: Kept,
    input: FrameInput,
    loader: Loader,
}

/// How long a frame took, and waiting for its pages before it.
pub struct Took {
    /// The frame.
    pub frame_ns: u64,
    /// The pages.
    pub waited_ns: u64,
}

impl Player {
    /// Opens a flight over its scene.
    pub fn open(wish: &Wish) -> PyResult<Self> {
        let name = wish.flight.to_string_lossy();
        let is_bundled = BUNDLED.contains(&&*name);
        if !is_bundled && !wish.flight.is_file() {
            let bundled = BUNDLED.join(", ");
            let what = format!("`{name}` is neither a file nor a bundled flight ({bundled})");
            return Err(refused(what));
        }
        let reader = if is_bundled { None } else { Some(Reader::open(&wish.flight)) };
        let header = reader.transpose().map_err(|error| failed(&error))?;
        let header = header.map(|reader| reader.header().clone());
        let recorded = header.as_ref().filter(|header| header.kind == Kind::Recording);
        let (scene_name, scene) = match (&wish.scene, recorded) {
            (Some(scene), _) => (scene.display().to_string(), scene_of(scene)?),
            (None, Some(header)) if !header.scene_text.is_empty() => {
                let title = format!("the scene in {name}");
                let scene = config::read(&header.scene_text, &title);
                (title, scene.map_err(|faults| refused(faults.to_string()))?)
            }
            (None, _) => ("earth".into(), scene_of(Path::new("earth"))?),
        };
        let workers = wish.workers.unwrap_or_else(threads);
        if workers > 64 {
            return Err(refused(format!("workers is {workers}, allowed is 0 to 64")));
        }
        let overfly = Overfly::new(&scene, workers).map_err(|error| failed(&error))?;
        if let Some(header) = recorded {
            refuse("with another scene", &name, &header.differs_from(&scene))?;
            let contents = overfly.sources().contents();
            refuse("over other data", &name, &header.differs_from_contents(&contents))?;
        }
        let loader = overfly.loader(threads()).map_err(|error| failed(&error))?;
        let mut player = Self {
            overfly,
            scene_name,
            output: FrameOutput::default(),
            name: name.into_owned(),
            rate_hz: 60.0,
            size_px: wish.size_px.into(),
            damage: None,
            lead_in: 0,
            is_followed: false,
            kept: Kept::Poses(Vec::new()),
            input: FrameInput::default(),
            loader,
        };
        match (is_bundled, recorded.is_some()) {
            (_, true) => player.keep_recording(&wish.flight)?,
            (true, _) => {
                let flight = player.overfly.flight(&player.name).map_err(|error| failed(&error))?;
                player.keep_flight(flight);
            }
            _ => {
                let (flight, ending) =
                    Flight::read(&wish.flight).map_err(|error| failed(&error))?;
                player.keep_flight(flight);
                player.note(&ending);
            }
        }
        Ok(player)
    }

    fn keep_flight(&mut self, flight: Flight) {
        (self.name, self.rate_hz) = (flight.name, flight.rate_hz);
        self.kept = Kept::Poses(flight.poses);
    }

    fn note(&mut self, ending: &Ending) {
        if let Ending::Damaged(error) = ending {
            self.damage = Some(sentence(error));
        }
    }

    fn keep_recording(&mut self, path: &Path) -> PyResult<()> {
        let Recording { header, frames, ending } =
            Recording::open(path).map_err(|error| failed(&error))?;
        (self.name, self.rate_hz, self.is_followed) = (header.name, header.rate_hz, true);
        self.note(&ending);
        if let Some(first) = frames.first() {
            self.size_px = first.views.first().map_or(self.size_px, |view| view.size_px);
            let still = frames.iter().take_while(|frame| frame.time_s == first.time_s).count();
            // A single frame stands by itself: it takes two for time to stand still.
            self.lead_in = if still > 1 { still } else { 0 };
        }
        self.kept = Kept::Frames(frames);
        Ok(())
    }

    /// Frames that can be played, those of a recording's lead-in not counted.
    pub fn frames(&self) -> usize {
        let all = match &self.kept {
            Kept::Poses(poses) => poses.len(),
            Kept::Frames(frames) => frames.len(),
        };
        all - self.lead_in
    }

    /// The frames that were asked for, which there must be.
    pub fn chosen(&self, frames: Option<(usize, usize)>) -> PyResult<Range<usize>> {
        let all = self.frames();
        let (first, end) = frames.unwrap_or((0, all));
        if first < end && end <= all {
            return Ok(first..end);
        }
        let name = &self.name;
        Err(refused(format!("frames is ({first}, {end}), but {name} has the frames (0, {all})")))
    }

    /// Whether frames are held against recorded states.
    pub fn is_followed(&self) -> bool {
        self.is_followed
    }

    /// From now on a recording is flown as a flight of its views.
    pub fn forget_states(&mut self) {
        self.is_followed = false;
    }

    /// Holds the clock before frame `first` until the terrain has come up: a recording's own frames
    /// before its time moves, else the first pose until nothing changes.
    pub fn lead_in(&mut self, first: usize) -> PyResult<()> {
        if self.is_followed {
            return (0..self.lead_in).try_for_each(|played| self.run(played, false).map(|_| ()));
        }
        for _ in 0..LEAD_IN_MAX {
            self.run(first + self.lead_in, true)?;
            let c = &self.output.counts;
            if c.leaves > 0 && c.splits + c.merges + c.wanted == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Runs one frame.
    pub fn frame(&mut self, index: usize) -> PyResult<Took> {
        self.run(index + self.lead_in, false)
    }

    /// The stage in which the last frame, which was this one, differs from the recording.
    pub fn difference(&self, index: usize, now: &FrameDigest) -> Option<&'static str> {
        match &self.kept {
            Kept::Frames(frames) if self.is_followed => {
                first_difference(&frames[index + self.lead_in].digest, now)
            }
            _ => None,
        }
    }

    /// Time of the last frame's input in seconds.
    pub fn time_s(&self) -> f64 {
        self.input.time_s
    }

    fn run(&mut self, played: usize, held: bool) -> PyResult<Took> {
        interrupted()?;
        self.fill(played)?;
        if held {
            // The lead-in's clock stands one frame before the first.
            self.input.time_s -= 1.0 / self.rate_hz;
            self.input.hold_lod = false;
        }
        let begin_ns = now_ns();
        let arriving = match &self.kept {
            Kept::Frames(frames) if self.is_followed => frames[played].arrived.clone(),
            _ => self.output.wanted.clone(),
        };
        self.loader.fetch(&arriving, &mut self.input.arrived);
        let changes = self.input.scene.is_some();
        let ready_ns = now_ns();
        let ran = self.overfly.frame(&mut self.input, &mut self.output);
        let end_ns = now_ns();
        ran.map_err(|error| failed(&error))?;
        if changes {
            self.loader = self.overfly.loader(threads()).map_err(|error| failed(&error))?;
        }
        Ok(Took { frame_ns: end_ns - ready_ns, waited_ns: ready_ns - begin_ns })
    }

    fn fill(&mut self, played: usize) -> PyResult<()> {
        let input = &mut self.input;
        input.views.clear();
        match &self.kept {
            Kept::Poses(poses) => {
                let (pose, scene) = (&poses[played], self.overfly.scene());
                (input.time_s, input.hold_lod) = (pose.time_s, false);
                let view = |lens| view_of(pose, lens, self.size_px, &scene.body);
                input.views.extend(scene.views.iter().map(view));
            }
            Kept::Frames(frames) => {
                let frame = &frames[played];
                (input.time_s, input.hold_lod) = (frame.time_s, frame.hold_lod);
                input.views.extend_from_slice(&frame.views);
                if let Some(text) = &frame.scene {
                    let scene = config::read(text, "the changed scene");
                    let scene =
                        scene.map_err(|faults| OverflyError::new_err(faults.to_string()))?;
                    input.scene = Some(Box::new(scene));
                }
            }
        }
        Ok(())
    }
}

/// Refuses a recording that differs from what is at hand.
fn refuse(how: &str, name: &str, differences: &[Difference]) -> PyResult<()> {
    if differences.is_empty() {
        return Ok(());
    }
    let list: String = differences.iter().map(|difference| format!("\n  {difference}")).collect();
    let what = format!("{name} was recorded {how}, so it cannot be replayed:{list}");
    Err(OverflyError::new_err(what))
}

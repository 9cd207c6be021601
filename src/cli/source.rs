//! What a replay plays: a flight, whose frames are computed, or a recording, whose frames are held
//! against what was recorded.
//!
//! In:    a bundled flight's name, an `.ovf` file, or a flight recorded by another program.
//! Out:   [`Source`], frame by frame.
//! Keeps: all poses or recorded frames in memory.
//! Not here: the file format (`overfly::replay`).

use super::{Failure, import};
use overfly::Overfly;
use overfly::core::datasource::PageKey;
use overfly::core::digest::FrameDigest;
use overfly::core::frame::FrameInput;
use overfly::core::settings::SceneSettings;
use overfly::replay::format::MAGIC;
use overfly::replay::{
    self, BUNDLED, Difference, Ending, Flight, Header, Kind, Reader, RecordedFrame, Recording,
    view_of,
};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What is played.
pub enum Source {
    /// Poses; pages arrive as the loader has them.
    Flight(Flight, Ending),
    /// Views, arrivals and digests.
    Recording(Recording),
}

/// Whether `name` is a file with recorded frames; its header then.
pub fn recording_header(name: &str) -> Result<Option<Header>, Failure> {
    if BUNDLED.contains(&name) {
        return Ok(None);
    }
    let (path, _) = import::split(name);
    if !path.exists() {
        let bundled = BUNDLED.join(", ");
        return Err(format!("`{name}` is neither a file nor a bundled flight ({bundled})").into());
    }
    if is_foreign(path) {
        return Ok(None);
    }
    let reader = Reader::open(path)?;
    Ok((reader.header().kind == Kind::Recording).then(|| reader.header().clone()))
}

/// Whether a file is none of overfly's own: it begins otherwise and is not called so.
fn is_foreign(path: &Path) -> bool {
    let mut begins = [0; MAGIC.len()];
    let own_name = path.extension().is_some_and(|ending| ending == "ovf");
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut begins));
    !own_name && path.is_file() && (read.is_err() || begins != MAGIC)
}

/// A flight in a file, overfly's own or another program's, with how the file ends.
pub fn flight_of(name: &str) -> Result<(Flight, Ending), Failure> {
    if is_foreign(import::split(name).0) {
        return Ok((import::flight(name)?, Ending::Complete));
    }
    Ok(Flight::read(Path::new(name))?)
}

/// Refuses a recording that differs from what is at hand.
fn refuse(how: &str, name: &str, differences: &[Difference]) -> Result<(), Failure> {
    if differences.is_empty() {
        return Ok(());
    }
    let list: String = differences.iter().map(|d| format!("\n  {d}")).collect();
    Err(format!("{name} was recorded {how}, so it cannot be replayed:{list}").into())
}

impl Source {
    /// Opens a flight or a recording.
    pub fn open(name: &str, scene: &SceneSettings, overfly: &Overfly) -> Result<Self, Failure> {
        if BUNDLED.contains(&name) {
            return Ok(Self::Flight(overfly.flight(name)?, Ending::Complete));
        }
        match recording_header(name)? {
            None => {
                let (flight, ending) = flight_of(name)?;
                Ok(Self::Flight(flight, ending))
            }
            Some(header) => {
                let contents = overfly.sources().contents();
                refuse("with another scene", name, &header.differs_from(scene))?;
                refuse("over other data", name, &header.differs_from_contents(&contents))?;
                Ok(Self::Recording(Recording::open(Path::new(name))?))
            }
        }
    }

    /// Shown in tables and file names.
    pub fn name(&self) -> &str {
        match self {
            Self::Flight(flight, _) => &flight.name,
            Self::Recording(recording) => &recording.header.name,
        }
    }

    /// Frames a second.
    pub fn rate_hz(&self) -> f64 {
        match self {
            Self::Flight(flight, _) => flight.rate_hz,
            Self::Recording(recording) => recording.header.rate_hz,
        }
    }

    /// Frames that can be played; those of a recording's lead-in are not counted.
    pub fn frames(&self) -> usize {
        match self {
            Self::Flight(flight, _) => flight.poses.len(),
            Self::Recording(recording) => recording.frames.len() - self.lead_in(),
        }
    }

    /// Frames of a recording in which time stands still at its beginning: the terrain comes up.
    pub fn lead_in(&self) -> usize {
        let Self::Recording(recording) = self else { return 0 };
        let Some(first) = recording.frames.first() else { return 0 };
        let still = |frame: &&RecordedFrame| frame.time_s == first.time_s;
        // A single frame stands by itself: it takes two for time to stand still.
        match recording.frames.iter().take_while(still).count() {
            1 => 0,
            frames => frames,
        }
    }

    /// How the file ends.
    pub fn ending(&self) -> &Ending {
        match self {
            Self::Flight(_, ending) => ending,
            Self::Recording(recording) => &recording.ending,
        }
    }

    /// Size of the recorded pictures; flights have none.
    pub fn size_px(&self) -> Option<[u32; 2]> {
        match self {
            Self::Flight(..) => None,
            Self::Recording(recording) => Some(recording.frames.first()?.views.first()?.size_px),
        }
    }

    /// Fills what frame `index` starts from but its pages; a flight's views are the scene's.
    pub fn fill(
        &self,
        index: usize,
        scene: &SceneSettings,
        size_px: [u32; 2],
        input: &mut FrameInput,
    ) {
        input.views.clear();
        match self {
            Self::Flight(flight, _) => {
                let pose = &flight.poses[index];
                (input.time_s, input.hold_lod) = (pose.time_s, false);
                let lenses = scene.views.iter();
                input.views.extend(lenses.map(|lens| view_of(pose, lens, size_px, &scene.body)));
            }
            Self::Recording(recording) => {
                let frame = &recording.frames[index];
                (input.time_s, input.hold_lod) = (frame.time_s, frame.hold_lod);
                input.views.extend_from_slice(&frame.views);
            }
        }
    }

    /// The pages that arrived in frame `index`, if that was recorded.
    pub fn arrived(&self, index: usize) -> Option<&[PageKey]> {
        match self {
            Self::Flight(..) => None,
            Self::Recording(recording) => Some(&recording.frames[index].arrived),
        }
    }

    /// The stage in which frame `index` differs from the recording, if it does.
    pub fn difference(&self, index: usize, now: &FrameDigest) -> Option<&'static str> {
        match self {
            Self::Flight(..) => None,
            Self::Recording(recording) => {
                replay::first_difference(&recording.frames[index].digest, now)
            }
        }
    }
}

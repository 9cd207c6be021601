//! What a replay plays: a flight, whose frames are computed, or a recording, whose frames are held
//! against what was recorded.
//!
//! In:    a bundled flight's name, an `.ovf` file, or a flight recorded by another program.
//! Out:   [`Source`], frame by frame.
//! Keeps: one frame of a file, whatever its length; all poses of a bundled flight.
//! Not here: the file format (`overfly::replay`).

use super::{Failure, import};
use overfly::Overfly;
use overfly::config;
use overfly::core::datasource::PageKey;
use overfly::core::digest::FrameDigest;
use overfly::core::frame::FrameInput;
use overfly::core::settings::SceneSettings;
use overfly::replay::format::MAGIC;
use overfly::replay::{
    self, BUNDLED, Difference, Ending, Flight, Frame, Header, Kind, Pose, Reader, RecordedFrame,
    view_of,
};
use overfly_tracks::Curve;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What is played.
pub struct Source {
    name: String,
    rate_hz: f64,
    raised_m: f64,
    kept: Kept,
    /// Of a recording.
    header: Option<Header>,
    /// Frames behind the lead-in.
    frames: usize,
    lead_in: usize,
    /// Of a recording whose first frame has a view.
    size_px: Option<[u32; 2]>,
    /// A recording whose views alone count.
    is_cold: bool,
    /// The file has its end mark, or is none of overfly's own.
    is_whole: bool,
    /// The frame that was loaded last.
    current: Option<(usize, Frame)>,
    /// How it ends, once that was met.
    ending: Option<Ending>,
}

/// Where frames come from. Only a bundled flight is in memory.
enum Kept {
    Poses(Vec<Pose>),
    Curve(Box<Curve>),
    File(Box<Reader>),
}

/// Whether `name` is a file with recorded frames; its header then.
pub fn recording_header(name: &str) -> Result<Option<Header>, Failure> {
    if BUNDLED.contains(&name) {
        return Ok(None);
    }
    let path = file_of(name)?;
    if is_foreign(path) {
        return Ok(None);
    }
    let reader = Reader::open(path)?;
    Ok((reader.header().kind == Kind::Recording).then(|| reader.header().clone()))
}

/// The file of a flight that is not bundled.
fn file_of(name: &str) -> Result<&Path, Failure> {
    let (path, _) = import::split(name);
    if path.exists() {
        return Ok(path);
    }
    let bundled = BUNDLED.join(", ");
    Err(format!("`{name}` is neither a file nor a bundled flight ({bundled})").into())
}

/// Whether a file is none of overfly's own: it begins otherwise and is not called so.
fn is_foreign(path: &Path) -> bool {
    let mut begins = [0; MAGIC.len()];
    let own_name = path.extension().is_some_and(|ending| ending == "ovf");
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut begins));
    !own_name && path.is_file() && (read.is_err() || begins != MAGIC)
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
    /// Opens a flight or a recording, which must be of this scene and these data.
    pub fn open(name: &str, scene: &SceneSettings, overfly: &Overfly) -> Result<Self, Failure> {
        let source = Self::open_any(name, overfly)?;
        if let Some(header) = &source.header {
            let contents = overfly.sources().contents();
            refuse("with another scene", name, &header.differs_from(scene))?;
            refuse("over other data", name, &header.differs_from_contents(&contents))?;
        }
        Ok(source)
    }

    /// Opens a flight or a recording of any scene.
    pub fn open_any(name: &str, overfly: &Overfly) -> Result<Self, Failure> {
        if BUNDLED.contains(&name) {
            let Flight { name, rate_hz, poses, raised_m } = overfly.flight(name)?;
            let source = Self::new((name, rate_hz), poses.len(), Kept::Poses(poses));
            return Ok(Self { raised_m, ..source });
        }
        let path = file_of(name)?;
        if is_foreign(path) {
            let import::Foreign { name, rate_hz, curve } = import::flight(name)?;
            let frames = usize::try_from(curve.count(rate_hz))?;
            return Ok(Self::new((name, rate_hz), frames, Kept::Curve(Box::new(curve))));
        }
        let mut reader = Reader::open(path)?;
        let (header, tail) = (reader.header().clone(), reader.tail()?);
        let (title, rate_hz) = (header.name.clone(), header.rate_hz);
        let kept = Kept::File(Box::new(reader));
        let mut source = Self::new((title, rate_hz), usize::try_from(tail.frames)?, kept);
        source.is_whole = tail.complete;
        if header.kind == Kind::Recording {
            source.header = Some(header);
            source.find_lead_in();
        }
        Ok(source)
    }

    fn new((name, rate_hz): (String, f64), frames: usize, kept: Kept) -> Self {
        Self {
            name,
            rate_hz,
            raised_m: 0.0,
            kept,
            header: None,
            frames,
            lead_in: 0,
            size_px: None,
            is_cold: false,
            is_whole: true,
            current: None,
            ending: None,
        }
    }

    /// Counts the frames in which time stands still at the beginning, and finds the size.
    fn find_lead_in(&mut self) {
        let mut still = 0;
        let mut first_s = None;
        while self.load(still)
            && let Some(frame) = self.recorded()
        {
            let (time_s, view) = (frame.time_s, frame.views.first());
            if still == 0 {
                (self.size_px, first_s) = (view.map(|view| view.size_px), Some(time_s));
            } else if first_s != Some(time_s) {
                break;
            }
            still += 1;
        }
        // A single frame stands by itself: it takes two for time to stand still.
        self.lead_in = if still > 1 { still } else { 0 };
        let readable = if self.ending.is_some() { still } else { self.frames };
        self.frames = readable.saturating_sub(self.lead_in);
    }

    /// Shown in tables and file names.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Frames a second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// By how much a flight was raised to stay clear of the ground; metres.
    pub fn raised_m(&self) -> f64 {
        self.raised_m
    }

    /// A recording's header.
    pub fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// Frames that can be played; those of a recording's lead-in are not counted. Where a file is
    /// damaged before its last frame, fewer are readable in order.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Frames of a recording in which time stands still at its beginning: the terrain comes up.
    pub fn lead_in(&self) -> usize {
        self.lead_in
    }

    /// Whether the file has its end mark.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// How the file ends; none before its end or a damaged frame was met.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// Why a frame that there should be could not be loaded.
    pub fn fault(&mut self) -> Failure {
        match self.ending.take() {
            Some(Ending::Damaged(error)) => error.into(),
            _ => format!("{} ends earlier than it did when it was opened", self.name).into(),
        }
    }

    /// Size of the recorded pictures; flights have none.
    pub fn size_px(&self) -> Option<[u32; 2]> {
        self.size_px
    }

    /// Whether it is a recording, and not a flight.
    pub fn is_recording(&self) -> bool {
        self.header.is_some()
    }

    /// Whether pages arrive as recorded, and frames are held against recorded states.
    pub fn is_followed(&self) -> bool {
        self.is_recording() && !self.is_cold
    }

    /// From now on a recording is flown as a flight of its views, wherever it is begun.
    pub fn forget_states(&mut self) {
        self.is_cold = true;
    }

    /// Makes frame `played`, counted with the lead-in, the current one. False where it cannot be
    /// read; the ending then says why. Any frame is as near as its key frame.
    pub fn load(&mut self, played: usize) -> bool {
        if self.current.as_ref().is_some_and(|(current, _)| *current == played) {
            return true;
        }
        let frame = match &mut self.kept {
            Kept::Poses(poses) => Ok(poses.get(played).copied().map(Frame::Pose)),
            Kept::Curve(curve) => {
                let pose = || Frame::Pose(curve.frame(played as u64, self.rate_hz));
                Ok((played < self.frames).then(pose))
            }
            Kept::File(reader) => {
                reader.seek(played as u64).and_then(|()| reader.next().transpose())
            }
        };
        let unfinished = matches!(&self.kept, Kept::File(reader) if !reader.complete());
        self.ending = match frame {
            Ok(Some(frame)) => {
                self.current = Some((played, frame));
                return true;
            }
            Ok(None) if unfinished => Some(Ending::Unfinished),
            Ok(None) => Some(Ending::Complete),
            Err(error) => Some(Ending::Damaged(error)),
        };
        false
    }

    fn recorded(&self) -> Option<&RecordedFrame> {
        match &self.current {
            Some((_, Frame::Recorded(frame))) => Some(frame),
            _ => None,
        }
    }

    /// Fills what the current frame starts from but its pages; a flight's views are the scene's.
    ///
    /// # Errors
    /// The recording changes to a scene that cannot be read.
    pub fn fill(
        &self,
        scene: &SceneSettings,
        size_px: [u32; 2],
        input: &mut FrameInput,
    ) -> Result<(), Failure> {
        input.views.clear();
        match &self.current {
            Some((_, Frame::Pose(pose))) => {
                (input.time_s, input.hold_lod) = (pose.time_s, false);
                let lenses = scene.views.iter();
                input.views.extend(lenses.map(|lens| view_of(pose, lens, size_px, &scene.body)));
            }
            Some((_, Frame::Recorded(frame))) => {
                (input.time_s, input.hold_lod) = (frame.time_s, frame.hold_lod);
                input.views.extend_from_slice(&frame.views);
                let read = |text| config::read(text, &format!("{}: changed scene", self.name));
                input.scene = frame.scene.as_deref().map(read).transpose()?.map(Box::new);
            }
            None => {}
        }
        Ok(())
    }

    /// The pages that arrived in the current frame, if that was recorded and counts.
    pub fn arrived(&self) -> Option<&[PageKey]> {
        let frame = self.recorded().filter(|_| self.is_followed())?;
        Some(&frame.arrived)
    }

    /// The stage in which the current frame differs from the recording, if it does.
    pub fn difference(&self, now: &FrameDigest) -> Option<&'static str> {
        let frame = self.recorded().filter(|_| self.is_followed())?;
        replay::first_difference(&frame.digest, now)
    }
}

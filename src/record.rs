//! The recording of a scene that a host runs: what went into each frame, and its digest.
//!
//! In:    a path; what goes into a frame before it runs, what it ended in after.
//! Out:   an `.ovf` file that replays bit for bit.
//! Keeps: [`Recorder`]: the open file, the frame that runs.
//! Not here: the file's format (`overfly_replay`), the loop of a replay (`cli`).

use crate::config::WriteFault;
use crate::core::digest::FrameDigest;
use crate::core::frame::FrameInput;
use crate::core::settings::SceneSettings;
use crate::replay::{Header, RecordedFrame, WriteError, Writer};
use std::fmt;
use std::path::Path;

/// Why a recording cannot be begun or goes no further. The terrain is not touched by that.
#[derive(Debug)]
pub enum RecordError {
    /// The settings have no text, and so a recording cannot bring its scene.
    Scene(WriteFault),
    /// The file system refused.
    Write(WriteError),
    /// Frames were run already: the recording would begin in a state that no replay can have.
    Late {
        /// How many.
        frames: u64,
    },
    /// There is none to finish.
    None,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(fault) => write!(f, "the scene cannot be recorded: {fault}"),
            Self::Write(error) => error.fmt(f),
            Self::Late { frames } => write!(
                f,
                "{frames} frames were run before the recording was asked for, allowed are 0: a \
                 replay begins with an empty terrain"
            ),
            Self::None => f.write_str("no recording is open"),
        }
    }
}

impl std::error::Error for RecordError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Scene(fault) => Some(fault),
            Self::Write(error) => Some(error),
            Self::Late { .. } | Self::None => None,
        }
    }
}

/// An open recording.
pub(crate) struct Recorder {
    writer: Writer,
    frame: RecordedFrame,
}

impl Recorder {
    /// Begins a file for a scene over archives with these contents.
    pub fn create(
        path: &Path,
        (name, rate_hz): (&str, f64),
        (scene, contents): (&SceneSettings, &[u64]),
    ) -> Result<Self, RecordError> {
        let mut header = Header::recording(name, rate_hz, scene).over_contents(contents);
        header.scene_text = crate::config::write(scene).map_err(RecordError::Scene)?;
        let writer = Writer::create(path, &header).map_err(RecordError::Write)?;
        Ok(Self { writer, frame: RecordedFrame::default() })
    }

    /// Notes what goes into the frame that runs next.
    pub fn note(&mut self, input: &FrameInput) {
        let frame = &mut self.frame;
        (frame.time_s, frame.hold_lod) = (input.time_s, input.hold_lod);
        frame.views.clone_from(&input.views);
        frame.arrived.clear();
        frame.arrived.extend(input.arrived.iter().map(|page| page.key));
    }

    /// The frame that runs next changes to this scene.
    pub fn note_scene(&mut self, scene: &SceneSettings) -> Result<(), RecordError> {
        self.frame.scene = Some(crate::config::write(scene).map_err(RecordError::Scene)?);
        Ok(())
    }

    /// Writes the frame that was noted.
    pub fn write(&mut self, digest: FrameDigest) -> Result<(), RecordError> {
        self.frame.digest = digest;
        let written = self.writer.frame(&self.frame).map_err(RecordError::Write);
        self.frame.scene = None;
        written
    }

    /// Frames written so far.
    pub fn frames(&self) -> u64 {
        self.writer.frames()
    }

    /// Marks the file complete.
    pub fn finish(self) -> Result<u64, RecordError> {
        let frames = self.frames();
        self.writer.finish().map_err(RecordError::Write)?;
        Ok(frames)
    }
}

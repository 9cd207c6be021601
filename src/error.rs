//! Why a scene cannot be opened, a frame failed, a flight is not to be had.
//!
//! In:    faults of archives, workers, views, stages, Vulkan.
//! Out:   one small enum for each operation of the façade.
//! Keeps: nothing.
//! Not here: faults of pages (`sources`) and of requests (`requests`).

use crate::core::camera::ViewFault;
use crate::drawing::DrawError;
use crate::jobs::{StagePanic, StartError};
use crate::record::RecordError;
use crate::replay::BUNDLED;
use crate::sources::SourceError;
use std::fmt;
use std::io;

/// Why a scene cannot be opened.
#[derive(Debug)]
pub enum OpenError {
    /// An archive cannot be used.
    Source(SourceError),
    /// The workers cannot be started.
    Workers(StartError),
    /// The system refused a thread of the loader.
    Loader(io::Error),
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source(error) => error.fmt(f),
            Self::Workers(error) => error.fmt(f),
            Self::Loader(_) => f.write_str("a thread that loads pages could not be started"),
        }
    }
}

impl std::error::Error for OpenError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Source(error) => error.source(),
            Self::Workers(error) => error.source(),
            Self::Loader(error) => Some(error),
        }
    }
}

/// Why a running scene cannot become another.
#[derive(Debug)]
pub enum ChangeError {
    /// A setting that stays as long as the scene runs.
    Fixed {
        /// Which.
        setting: &'static str,
    },
    /// An archive cannot be used.
    Source(SourceError),
    /// The system refused a thread of the loader.
    Loader(io::Error),
    /// The change cannot be recorded.
    Record(RecordError),
}

impl fmt::Display for ChangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed { setting } => write!(
                f,
                "scene: {setting} cannot change while the scene runs, allowed are sources, sea, \
                 sun and views: open another one"
            ),
            Self::Source(error) => error.fmt(f),
            Self::Loader(_) => f.write_str("a thread that loads pages could not be started"),
            Self::Record(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ChangeError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Fixed { .. } => None,
            Self::Source(error) => Some(error),
            Self::Loader(error) => Some(error),
            Self::Record(error) => Some(error),
        }
    }
}

/// Why there is no such flight over a scene.
#[derive(Debug)]
pub enum FlightError {
    /// No flight of this name comes with overfly.
    Unknown(String),
    /// The ground beneath it cannot be read, and so the flight not be kept above it.
    Ground(SourceError),
}

impl fmt::Display for FlightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(name) => {
                write!(f, "`{name}` is none of the bundled flights ({})", BUNDLED.join(", "))
            }
            Self::Ground(error) => write!(f, "the ground beneath the flight: {error}"),
        }
    }
}

impl std::error::Error for FlightError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Unknown(_) => None,
            Self::Ground(error) => Some(error),
        }
    }
}

/// Why a frame failed.
#[derive(Debug)]
pub enum FrameError {
    /// A view cannot be used; the state is as it was.
    View(ViewFault),
    /// A stage panicked: a bug of ours.
    Stage(StagePanic),
    /// Vulkan failed; the terrain is not touched by that.
    Draw(DrawError),
    /// The scene cannot become another; the state is as it was.
    Scene(ChangeError),
    /// The frame was run, but could not be recorded.
    Record(RecordError),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View(fault) => fault.fmt(f),
            Self::Stage(panic) => panic.fmt(f),
            Self::Draw(error) => error.fmt(f),
            Self::Scene(error) => error.fmt(f),
            Self::Record(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FrameError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::View(fault) => Some(fault),
            Self::Stage(panic) => Some(panic),
            Self::Draw(error) => Some(error),
            Self::Scene(error) => Some(error),
            Self::Record(error) => Some(error),
        }
    }
}

//! Why a scene cannot be opened, a frame failed, a flight is not to be had.
//!
//! In:    faults of archives, workers, views, stages, Vulkan.
//! Out:   one small enum for each operation of the façade.
//! Keeps: nothing.
//! Not here: faults of pages (`sources`) and of requests (`requests`).

use crate::core::camera::ViewFault;
use crate::jobs::{StagePanic, StartError};
use crate::render_vk::DrawError;
use crate::replay::BUNDLED;
use crate::sources::SourceError;
use std::fmt;

/// Why a scene cannot be opened.
#[derive(Debug)]
pub enum OpenError {
    /// An archive cannot be used.
    Source(SourceError),
    /// The workers cannot be started.
    Workers(StartError),
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source(error) => error.fmt(f),
            Self::Workers(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for OpenError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Source(error) => error.source(),
            Self::Workers(error) => error.source(),
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
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View(fault) => fault.fmt(f),
            Self::Stage(panic) => panic.fmt(f),
            Self::Draw(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FrameError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::View(fault) => Some(fault),
            Self::Stage(panic) => Some(panic),
            Self::Draw(error) => Some(error),
        }
    }
}

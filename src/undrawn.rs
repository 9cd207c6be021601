//! What stands for a renderer where there is none: a build without the feature `vulkan`.
//!
//! In:    what `drawing` takes.
//! Out:   nothing.
//! Keeps: nothing.
//! Not here: drawing by a host of its own, which takes `columns`.

use crate::core::frame::Terrain;
use crate::jobs::StageId;
use std::fmt;

/// Why a picture was not drawn: there is no such reason, since there is no picture.
#[derive(Debug)]
pub enum DrawError {}

impl fmt::Display for DrawError {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {}
    }
}

impl std::error::Error for DrawError {}

pub(crate) struct Drawing;

impl Drawing {
    pub(crate) fn after(_placed: StageId) -> Self {
        Self
    }

    pub(crate) fn note_scene(&mut self, _world: &hecs::World, _time_s: f64) {}

    pub(crate) fn begin_anew(&mut self, _terrain: &Terrain) {}
}

//! stub
use glam::DVec3;
use super::bounds::Bounds;
use super::{ProceduralSettings, Sample};
pub(super) struct Cratered;
impl Cratered {
    pub(super) fn new(_: &ProceduralSettings) -> (Cratered, Bounds) { todo!() }
    pub(super) fn sample(&self, _: DVec3) -> Sample { todo!() }
}

//! Resolved settings of a scene: complete, SI, no serde, no defaults.
//!
//! In:    built by `overfly_config` from RON, or by a host as a literal.
//! Out:   [`SceneSettings`] and its listing, which recordings keep and compare.
//! Keeps: nothing.
//! Not here: files, defaults, ranges (`overfly_config`); capacities (`limits`).

use crate::datasource::procedural::{ProceduralSettings, Style};
use crate::digest::{Chain, mix};
use crate::geodesy::Ellipsoid;
use crate::units::{Pixels, Radians};
use glam::DVec3;

/// Everything that a scene is made of.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneSettings {
    /// Shape of the body.
    pub body: Ellipsoid,
    /// Where heights come from, finest first. One procedural source, for now.
    pub sources: Vec<SourceSettings>,
    /// Level of detail.
    pub lod: LodSettings,
    /// The views of each frame, relative to the recorded pose. At least one.
    pub views: Vec<LensSettings>,
    /// Depth ranges of the renderer.
    pub depth: DepthSettings,
    /// Memory limits.
    pub memory: MemorySettings,
    /// Water covers the ground below height 0.
    pub sea: bool,
    /// The sun; without one the ground is lit evenly.
    pub sun: Option<SunSettings>,
}

/// One source of heights.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SourceSettings {
    /// The procedural planet: no files.
    Procedural {
        /// Which planet of all.
        seed: u64,
        /// What kind of ground.
        style: Style,
        /// Scale of all heights; 1 is Earth-like.
        relief: f64,
        /// Shortest wavelength of the ground in metres.
        finest_m: f64,
    },
}

/// The knobs of the level of detail.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LodSettings {
    /// No diamond is split whose error bound on the screen is this small or smaller.
    pub tolerance: Pixels,
    /// Never more triangles than this in the mesh; at least 8·2^`patch_depth`.
    pub triangles_max: u32,
    /// A leaf is drawn as 2^k triangles; 0, 2, 4, 6 or 8.
    pub patch_depth: u8,
    /// Most diamond splits in one frame, forced ones included.
    pub splits_max: u32,
    /// Most diamond merges in one frame: a count of its own, so that splits cannot starve merges.
    pub merges_max: u32,
    /// Deepest level of a leaf, at most 56 − `patch_depth`.
    pub level_max: u8,
    /// Longest list of wanted pages in one frame.
    pub wanted_max: u32,
}

/// One view of the scene, relative to the pose of a flight.
#[derive(Clone, PartialEq, Debug)]
pub struct LensSettings {
    /// Shown in tables and file names.
    pub name: String,
    /// Vertical field of view.
    pub field_of_view: Radians,
    /// Turned to the right of the nose.
    pub yaw: Radians,
    /// Turned up from the nose.
    pub pitch: Radians,
    /// Nothing nearer is drawn; metres.
    pub near_m: f64,
}

/// How the renderer cuts the view in depth.
#[derive(Clone, PartialEq, Debug)]
pub struct DepthSettings {
    /// Borders between the ranges in metres, rising; n borders make n + 1 ranges.
    pub splits_m: Vec<f64>,
}

/// Memory limits.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MemorySettings {
    /// Bytes of all resident pages together.
    pub pages_bytes: u64,
}

/// The sun, where it stands for the whole flight.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SunSettings {
    /// Body-fixed unit vector towards the sun.
    pub direction: DVec3,
}

impl SourceSettings {
    /// What the procedural planet of this source is made from, on `body`.
    pub fn procedural(&self, body: &Ellipsoid) -> ProceduralSettings {
        let Self::Procedural { seed, style, relief, finest_m } = *self;
        let radius_m = (2.0 * body.a_m + body.b_m()) / 3.0;
        ProceduralSettings { seed, radius_m, style, relief, finest_m }
    }
}

impl SceneSettings {
    /// Every setting that can change a frame's bits, as (path, value), in a fixed order.
    pub fn listing(&self) -> Vec<(String, String)> {
        let mut list = vec![
            ("body.a_m".into(), format!("{:?}", self.body.a_m)),
            ("body.f".into(), format!("{:?}", self.body.f)),
        ];
        for (i, source) in self.sources.iter().enumerate() {
            list.push((format!("sources[{i}]"), format!("{source:?}")));
        }
        let lod = &self.lod;
        for (name, value) in [
            ("tolerance_px", format!("{:?}", lod.tolerance.0)),
            ("triangles_max", lod.triangles_max.to_string()),
            ("patch_depth", lod.patch_depth.to_string()),
            ("splits_max", lod.splits_max.to_string()),
            ("merges_max", lod.merges_max.to_string()),
            ("level_max", lod.level_max.to_string()),
            ("wanted_max", lod.wanted_max.to_string()),
        ] {
            list.push((format!("lod.{name}"), value));
        }
        for (i, view) in self.views.iter().enumerate() {
            list.push((format!("views[{i}]"), format!("{view:?}")));
        }
        list.push(("sea".into(), self.sea.to_string()));
        list.push(("depth.splits_m".into(), format!("{:?}", self.depth.splits_m)));
        list.push(("memory.pages_bytes".into(), self.memory.pages_bytes.to_string()));
        list
    }

    /// One number for the whole listing.
    pub fn digest(&self) -> u64 {
        let mut chain = Chain::default();
        for (path, value) in self.listing() {
            for byte in path.bytes().chain([b'=']).chain(value.bytes()).chain([b'\n']) {
                chain.add(mix(u64::from(byte)));
            }
        }
        chain.0
    }
}

//! Every capacity, derived from the settings, with the reasoning.
//!
//! In:    [`SceneSettings`].
//! Out:   [`Limits`]: what the pools are made with, once.
//! Keeps: nothing.
//! Not here: the settings' own ranges (`overfly_config` checks those).

use crate::datasource::Page;
use crate::datasource::colour::{COLOUR_TEXELS, ColourTile};
use crate::datasource::page::Survey;
use crate::settings::SceneSettings;

/// The base octahedron's triangles.
pub const BASE_LEAVES: u32 = 8;
/// The base octahedron's diamonds: one a quadrant.
pub const BASE_DIAMONDS: u32 = 4;

/// Capacities of all pools.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Most leaf triangles: each split adds exactly two.
    pub leaves: u32,
    /// Most diamond records. An unsplit record has at least one leaf triangle of its own, and a
    /// mesh of n leaves has (n − 8)/2 split diamonds; one operation may hold four more.
    pub diamonds: u32,
    /// Most resident pages.
    pub pages: u32,
    /// Most patches built in one frame: a split makes eight, a merge two.
    pub built: u32,
}

impl Limits {
    /// The capacities that these settings need.
    ///
    /// # Panics
    /// If the settings are outside their documented ranges.
    pub fn of(settings: &SceneSettings) -> Self {
        let lod = &settings.lod;
        assert!(lod.patch_depth <= 8 && lod.patch_depth.is_multiple_of(2), "patch depth");
        assert!(lod.triangles_max >> lod.patch_depth >= BASE_LEAVES, "triangle budget");
        let splits = ((lod.triangles_max >> lod.patch_depth) - BASE_LEAVES) / 2;
        let leaves = BASE_LEAVES + 2 * splits;
        let survey = if settings.archives().next().is_some() { size_of::<Survey>() } else { 0 };
        let texels = size_of::<ColourTile>() + COLOUR_TEXELS * size_of::<[u8; 4]>();
        let colour = if settings.imagery.is_empty() { 0 } else { texels };
        let pages = settings.memory.pages_bytes / (size_of::<Page>() + survey + colour) as u64;
        let built = 8_u64 * u64::from(lod.splits_max) + 2 * u64::from(lod.merges_max) + 8;
        Self {
            leaves,
            diamonds: leaves + splits + BASE_DIAMONDS + 4,
            pages: u32::try_from(pages).unwrap_or(u32::MAX).clamp(BASE_DIAMONDS, 1 << 24),
            built: u32::try_from(built.min(u64::from(leaves))).expect("at most the leaves"),
        }
    }
}

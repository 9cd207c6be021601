//! Every capacity, derived from the settings, with the reasoning.
//!
//! In:    [`SceneSettings`].
//! Out:   [`Limits`]: what the pools are made with, once; or [`SettingsFault`].
//! Keeps: nothing.
//! Not here: names, units and ranges of scene files (`overfly_config`).

use crate::datasource::Page;
use crate::datasource::colour::{COLOUR_TEXELS, ColourTile};
use crate::datasource::page::Survey;
use crate::lattice::LEVEL_END;
use crate::mesh::bounds::RANGES_MAX;
use crate::settings::SceneSettings;
use core::fmt;

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

/// A setting outside its range.
#[derive(Clone, PartialEq, Debug)]
pub struct SettingsFault {
    /// Which setting.
    pub field: &'static str,
    /// What was given.
    pub found: String,
    /// What may be given.
    pub allowed: String,
}

impl fmt::Display for SettingsFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { field, found, allowed } = self;
        write!(f, "{field} is {found}, allowed is {allowed}")
    }
}

impl core::error::Error for SettingsFault {}

/// Equatorial radii in metres that were tried: outside nothing is known.
const RADIUS_M: [f64; 2] = [1.0, 1e12];
/// Flattenings that were tried.
const FLATTENING: [f64; 2] = [-1.0, 0.99];
/// Most triangles: what a mesh is tested with, and 2.3 GB of vertices.
const TRIANGLES_MAX: u32 = 16_000_000;
/// A path of the lattice has so many levels, those inside a patch included.
const LEVELS: u8 = LEVEL_END - 1;
/// Most resident pages: 106 GiB. A greater budget is cut to it, since a pool's columns are
/// allocated whole.
const PAGES_MAX: u32 = 1 << 21;

fn within<T: PartialOrd + fmt::Debug>(
    field: &'static str,
    found: T,
    [least, most]: [T; 2],
) -> Result<(), SettingsFault> {
    if found >= least && found <= most {
        return Ok(());
    }
    let (found, allowed) = (format!("{found:?}"), format!("{least:?} to {most:?}"));
    Err(SettingsFault { field, found, allowed })
}

/// Whether every setting that the pools and stages rely on is in its range: for hosts that give
/// settings as a literal. `overfly_config` checks more, and closer.
///
/// # Errors
/// The first that is not.
pub fn check(settings: &SceneSettings) -> Result<(), SettingsFault> {
    let SceneSettings { body, lod, depth, .. } = settings;
    within("body.a_m", body.a_m, RADIUS_M)?;
    within("body.f", body.f, FLATTENING)?;
    within("lod.tolerance_px", lod.tolerance.0, [0.0, f64::INFINITY])?;
    within("lod.morph_s", lod.morph_s, [0.0, f64::MAX])?;
    if !(lod.patch_depth <= 8 && lod.patch_depth.is_multiple_of(2)) {
        let (found, allowed) = (lod.patch_depth.to_string(), "0, 2, 4, 6 or 8".into());
        return Err(SettingsFault { field: "lod.patch_depth", found, allowed });
    }
    let least = BASE_LEAVES << lod.patch_depth;
    within("lod.triangles_max", lod.triangles_max, [least, TRIANGLES_MAX])?;
    within("lod.level_max", lod.level_max, [0, LEVELS - lod.patch_depth])?;
    check_borders(&depth.splits_m)
}

fn check_borders(splits_m: &[f64]) -> Result<(), SettingsFault> {
    let rising = splits_m.windows(2).all(|pair| pair[0] < pair[1]);
    let finite = splits_m.iter().all(|&split_m| split_m > 0.0 && split_m.is_finite());
    if rising && finite && splits_m.len() < RANGES_MAX {
        return Ok(());
    }
    let allowed = format!("at most {} finite distances above 0, rising", RANGES_MAX - 1);
    Err(SettingsFault { field: "depth.splits_m", found: format!("{splits_m:?}"), allowed })
}

/// Whether ground this deep leaves a body: lines from its centre must meet its surface.
///
/// # Errors
/// It does not, or a height is not finite.
pub fn check_surface(settings: &SceneSettings, range_m: [f64; 2]) -> Result<(), SettingsFault> {
    let deepest_m = -DEEPEST * settings.body.curvature_radii_m()[0];
    within("least height of the sources in metres", range_m[0], [deepest_m, f64::MAX])?;
    within("greatest height of the sources in metres", range_m[1], [range_m[0], f64::MAX])
}

/// No ground lies deeper than this share of the body's least radius of curvature.
pub const DEEPEST: f64 = 0.999;

impl Limits {
    /// The capacities that these settings need.
    ///
    /// # Errors
    /// The settings are outside their ranges; nothing was allocated.
    pub fn checked(settings: &SceneSettings) -> Result<Self, SettingsFault> {
        check(settings)?;
        let lod = &settings.lod;
        let splits = ((lod.triangles_max >> lod.patch_depth) - BASE_LEAVES) / 2;
        let leaves = BASE_LEAVES + 2 * splits;
        let survey = if settings.archives().next().is_some() { size_of::<Survey>() } else { 0 };
        let texels = size_of::<ColourTile>() + COLOUR_TEXELS * size_of::<[u8; 4]>();
        let colour = if settings.imagery.is_empty() { 0 } else { texels };
        let pages = settings.memory.pages_bytes / (size_of::<Page>() + survey + colour) as u64;
        let built = 8_u64 * u64::from(lod.splits_max) + 2 * u64::from(lod.merges_max) + 8;
        Ok(Self {
            leaves,
            diamonds: leaves + splits + BASE_DIAMONDS + 4,
            pages: u32::try_from(pages).unwrap_or(u32::MAX).clamp(BASE_DIAMONDS, PAGES_MAX),
            built: u32::try_from(built.min(u64::from(leaves))).expect("at most the leaves"),
        })
    }

    /// The capacities that these settings need.
    ///
    /// # Panics
    /// If the settings are outside their ranges, with the value and the range.
    pub fn of(settings: &SceneSettings) -> Self {
        Self::checked(settings).unwrap_or_else(|fault| panic!("settings: {fault}"))
    }
}

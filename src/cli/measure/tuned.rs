//! Knobs of a scene, given as options instead of in its file.
//!
//! In:    options, a scene.
//! Out:   the scene with them; what no scene may have, by option, value and allowed range.
//! Keeps: nothing.
//! Not here: the ranges (`overfly::config`): a scene file with these knobs is read, so that they
//!        are the same there and here.

use crate::cli::Failure;
use overfly::config;
use overfly::core::settings::SceneSettings;
use std::fmt::Write;

/// Options that change a scene.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct Tuned {
    /// Error on the screen that may stay in pixels, instead of the scene's.
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    tolerance_px: Option<f64>,
    /// Most triangles, instead of the scene's.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    triangles_max: Option<i64>,
    /// A leaf is drawn as 2^K triangles; 0, 2, 4, 6 or 8, instead of the scene's.
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    patch_depth: Option<i64>,
    /// How long a new vertex takes to its own place in seconds, instead of the scene's; 0: at once.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    morph_s: Option<f64>,
}

/// Options, and the settings that they stand for.
const NAMES: [(&str, &str); 4] = [
    ("lod.tolerance_px", "--tolerance-px"),
    ("lod.triangles_max", "--triangles-max"),
    ("lod.patch_depth", "--patch-depth"),
    ("lod.morph_s", "--morph-s"),
];

impl Tuned {
    /// Changes a scene.
    ///
    /// # Errors
    /// Every option whose value no scene may have, one a line.
    pub fn apply(&self, scene: &mut SceneSettings) -> Result<(), Failure> {
        let lod = &scene.lod;
        let depth = self.patch_depth.unwrap_or(lod.patch_depth.into());
        let triangles = self.triangles_max.unwrap_or(lod.triangles_max.into());
        let tolerance_px = self.tolerance_px.unwrap_or(lod.tolerance.0);
        let morph_s = self.morph_s.unwrap_or(lod.morph_s);
        let text = format!(
            "Scene(body: Sphere(radius_m: 1000.0), sources: [Procedural(seed: 1)], lod: \
             (tolerance_px: {tolerance_px:?}, triangles_max: {triangles}, patch_depth: {depth}, \
             morph_s: {morph_s:?}))"
        );
        let read = config::read(&text, "options").map_err(|faults| words(&faults))?;
        let level_max = lod.level_max.min(read.lod.level_max);
        let (splits_max, merges_max, wanted_max) = (lod.splits_max, lod.merges_max, lod.wanted_max);
        scene.lod = read.lod;
        scene.lod.level_max = level_max;
        (scene.lod.splits_max, scene.lod.merges_max) = (splits_max, merges_max);
        scene.lod.wanted_max = wanted_max;
        Ok(())
    }
}

/// Faults by the names of the options.
fn words(faults: &config::SceneFaults) -> String {
    let mut text = String::new();
    for fault in &faults.faults {
        let option = NAMES.iter().find(|(path, _)| *path == fault.path);
        let name = option.map_or(fault.path.as_str(), |(_, option)| option);
        let line_end = if text.is_empty() { "" } else { "\n" };
        write!(text, "{line_end}{name}: {}", fault.what).expect("text grows");
    }
    text
}

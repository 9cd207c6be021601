//! `overfly check`: a scene file, resolved or with all its faults.
//!
//! In:    a path or a preset's name.
//! Out:   every setting in SI, the capacities that follow, what archives say about themselves; or
//!        the faults with line and column.
//! Keeps: nothing.
//! Not here: the checks themselves (`overfly_config`).

use super::Failure;
use overfly::archive::{Archive, Datum, LayerFacts, OpenOptions};
use overfly::config;
use overfly::core::datasource::Page;
use overfly::core::datasource::page::Survey;
use overfly::core::limits::Limits;
use overfly::core::settings::{SceneSettings, SunSettings};
use overfly::sources::{Sources, level_of};
use std::process::ExitCode;

/// What `check` takes.
#[derive(clap::Args)]
pub struct Arguments {
    /// A scene file, or the name of a preset: earth, moon, small.
    scene: String,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let scene = config::load(&arguments.scene)?;
    for (path, value) in scene.listing() {
        say!("{path:<22} {value}");
    }
    for (path, value) in drawing_only(&scene) {
        say!("{path:<22} {value} (drawing only: recordings do not compare it)");
    }
    let limits = Limits::of(&scene);
    let survey = if scene.archives().next().is_some() { size_of::<Survey>() } else { 0 };
    let pages_mib = u64::from(limits.pages) * (size_of::<Page>() + survey) as u64 / (1 << 20);
    say!("\nleaf triangles at most {}", limits.leaves);
    say!("diamond records        {}", limits.diamonds);
    say!("resident pages         {} ({pages_mib} MiB)", limits.pages);
    say!("patches built a frame  {}", limits.built);
    say!("settings digest        {:016x}", scene.digest());
    let sources = Sources::open(&scene, &OpenOptions::default())?;
    sources.archives().iter().for_each(list);
    Ok(ExitCode::SUCCESS)
}

/// The settings that the listing leaves out.
fn drawing_only(scene: &SceneSettings) -> [(&'static str, String); 5] {
    let sun = match scene.sun {
        None => "none".into(),
        Some(SunSettings::Fixed { direction }) => format!("{:?}", direction.to_array()),
        Some(SunSettings::Clock { start_unix_s, runs }) => {
            let from = if runs { "from" } else { "always as at" };
            format!("{from} {}", config::utc_text(start_unix_s))
        }
    };
    [
        ("depth.format", format!("{:?}", scene.depth.format)),
        ("depth.order", format!("{:?}", scene.depth.order)),
        ("vertices", format!("{:?}", scene.vertices)),
        ("imagery", format!("{:?}", scene.imagery)),
        ("sun", sun),
    ]
}

/// What an archive says about itself.
fn list(archive: &Archive) {
    let facts = archive.facts();
    let [low_m, high_m] = facts.height_range_m;
    let datum = match facts.datum {
        Datum::Egm96 => "EGM96",
        Datum::Ellipsoid => "the ellipsoid",
    };
    say!("\narchive {}", archive.name());
    say!("  body                 {}, heights over {datum}", facts.body_name);
    say!("  above the ellipsoid  {low_m:.1} m to {high_m:.1} m");
    say!("  content              {:016x}", facts.content);
    for layer in &facts.layers {
        let level = level_of(layer.depth);
        let LayerFacts { spacing_m, quantum_m, blend_m, sources, .. } = layer;
        say!(
            "  layer of level {level:<2}    postings {spacing_m:.1} m apart, in steps of \
             {quantum_m} m, blended over {blend_m:.0} m: {}",
            sources.join(", ")
        );
    }
}

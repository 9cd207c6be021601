//! `overfly check`: a scene file, resolved or with all its faults.
//!
//! In:    a path or a preset's name.
//! Out:   every setting in SI, the capacities that follow; or the faults with line and column.
//! Keeps: nothing.
//! Not here: the checks themselves (`overfly_config`).

use super::Failure;
use overfly::config;
use overfly::core::datasource::Page;
use overfly::core::limits::Limits;
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
    let sun = scene.sun.map_or("none".into(), |sun| format!("{:?}", sun.direction.to_array()));
    say!("{:<22} {sun} (drawing only: recordings do not compare it)", "sun");
    let limits = Limits::of(&scene);
    let pages_mib = u64::from(limits.pages) * size_of::<Page>() as u64 / (1 << 20);
    say!("\nleaf triangles at most {}", limits.leaves);
    say!("diamond records        {}", limits.diamonds);
    say!("resident pages         {} ({pages_mib} MiB)", limits.pages);
    say!("patches built a frame  {}", limits.built);
    say!("settings digest        {:016x}", scene.digest());
    Ok(ExitCode::SUCCESS)
}

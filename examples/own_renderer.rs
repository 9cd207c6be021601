//! A host that draws with a renderer of its own: the columns of a frame, and nothing of Vulkan.
//!
//! In:    a scene, a place and a direction, the size of the picture.
//! Out:   a PNG; counts of what was drawn.
//! Keeps: nothing.
//! Not here: columns to triangles (`software/mod.rs`), triangles to pixels (`software/raster.rs`).
//!
//! ```text
//! cargo run --release --example own_renderer -- --at 46.85,-121.76,2500 --look 90,-8
//! ```
//!
//! The scene's sun lights the ground as overfly's own renderer has it; before and behind the ground
//! there is no air, and where no ground is the picture is black.

mod software;

use clap::Parser;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::FrameOutput;
use overfly::core::geodesy::Geodetic;
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};
use software::Painter;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

/// Draws one picture of a terrain on the processor
#[derive(Parser)]
struct Arguments {
    /// A scene file or a preset: earth, moon or small
    #[arg(long, default_value = "earth")]
    scene: String,
    /// Degrees, degrees, metres above the ground
    #[arg(long, value_name = "LAT,LON,HEIGHT", default_value = "46.85,-121.76,2500",
          allow_hyphen_values = true, value_parser = numbers::<3>)]
    at: [f64; 3],
    /// Degrees clockwise from north, degrees above the horizon
    #[arg(long, value_name = "HEADING,PITCH", default_value = "90,-8",
          allow_hyphen_values = true, value_parser = numbers::<2>)]
    look: [f64; 2],
    /// Width and height in pixels, 1 to 8192
    #[arg(long, value_name = "W,H", default_value = "640,360", value_parser = size)]
    size: [u32; 2],
    /// The PNG to write
    #[arg(long, value_name = "FILE", default_value = "own_renderer.png")]
    out: PathBuf,
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let found: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let found = found.filter(|all| all.iter().all(|number: &f64| number.is_finite()));
    found
        .and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("`{text}` is not {N} finite numbers with commas between them"))
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let found: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let found = found.filter(|all| all.iter().all(|n| (1..=8192).contains(n)));
    found
        .and_then(|all| all.try_into().ok())
        .ok_or_else(|| format!("`{text}` is not W,H, each from 1 to 8192"))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("own_renderer: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut scene = config::load(&arguments.scene)?;
    scene.lod.morph_s = 0.0; // a picture of a moment: nothing moves
    let host = Host {
        workers: Workers::Own(1),
        pages: Pages::Waited { threads: 1 }, // so that the picture is the same on every machine
        ..Host::default()
    };
    let mut overfly = Overfly::new(&scene, host)?;
    let view = view_of(arguments, &overfly)?;
    let mut painter = Painter::new(&overfly);
    let mut output = FrameOutput::default();
    painter.settle(&mut overfly, &[view], &mut output)?;
    let canvas = painter.draw(&overfly, &output, 0)?;
    canvas.write(&arguments.out)?;
    let counts = &output.counts;
    println!(
        "wrote {}: {} patches drawn, {} pages, error bound {:.2} px, {} of {} pixels show ground",
        arguments.out.display(),
        counts.drawn,
        counts.pages,
        counts.error_px_bound,
        canvas.nearness.iter().filter(|nearness| **nearness > 0.0).count(),
        canvas.nearness.len(),
    );
    Ok(())
}

/// The view from a height above the ground, which is water where there is some.
fn view_of(arguments: &Arguments, overfly: &Overfly) -> Result<View, Box<dyn Error>> {
    let [lat_deg, lon_deg, above_m] = arguments.at;
    if lat_deg.abs() > 90.0 || above_m <= 0.0 {
        return Err("--at: allowed are latitudes from -90 to 90 and heights above 0".into());
    }
    let scene = overfly.scene();
    let below = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
    let ground_m = overfly.ground_height_m(below)?;
    let surface_m = if scene.sea { ground_m.max(0.0) } else { ground_m };
    let at = Geodetic { height_m: surface_m + above_m, ..below };
    let [heading, pitch] = arguments.look.map(Radians::from_degrees);
    let lens = &scene.views[0];
    Ok(View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, heading, pitch, Radians(0.0)),
        field_of_view: lens.field_of_view,
        size_px: arguments.size,
        near_m: lens.near_m,
    })
}

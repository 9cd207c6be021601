//! Two views in one frame: ahead, and back through a mirror above the windscreen.
//!
//! In:    a scene.
//! Out:   a PNG with the mirror in the picture; what each view drew.
//! Keeps: nothing.
//! Not here: columns to triangles (`software/mod.rs`), triangles to pixels (`software/raster.rs`).
//!
//! ```text
//! cargo run --release --example two_views -- --scene earth --out two_views.png
//! ```
//!
//! Both views share one terrain: it is refined for the stricter of them wherever both look, and a
//! patch that both show is kept once. What costs twice is only choosing and drawing the draws.

mod software;

use clap::Parser;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::FrameOutput;
use overfly::core::geodesy::Geodetic;
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};
use software::{Painter, raster::Canvas};
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

const AHEAD_PX: [u32; 2] = [640, 360];
const MIRROR_PX: [u32; 2] = [240, 80];
/// Gap above the mirror, and the width of its frame.
const TOP_PX: usize = 8;
const FRAME_PX: usize = 3;
const ABOVE_GROUND_M: f64 = 300.0;

/// Draws a view ahead and a mirror of what lies behind
#[derive(Parser)]
struct Arguments {
    /// A scene file or a preset: earth, moon or small
    #[arg(long, default_value = "earth")]
    scene: String,
    /// The PNG to write
    #[arg(long, value_name = "FILE", default_value = "two_views.png")]
    out: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("two_views: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut scene = config::load(&arguments.scene)?;
    scene.lod.morph_s = 0.0; // a picture of a moment: nothing moves
    let host =
        Host { workers: Workers::Own(1), pages: Pages::Waited { threads: 1 }, ..Host::default() };
    let mut overfly = Overfly::new(&scene, host)?;
    let below = Geodetic::from_degrees(46.85, -121.76, 0.0);
    let ground_m = overfly.ground_height_m(below)?;
    let surface_m = if scene.sea { ground_m.max(0.0) } else { ground_m };
    let at = Geodetic { height_m: surface_m + ABOVE_GROUND_M, ..below };
    let look = |heading_deg: f64, (field_deg, size_px): (f64, [u32; 2])| View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(
            at,
            Radians::from_degrees(heading_deg),
            Radians::from_degrees(-6.0),
            Radians(0.0),
        ),
        field_of_view: Radians::from_degrees(field_deg),
        size_px,
        near_m: scene.views[0].near_m,
    };
    // The most important view first: it goes first where the budget of triangles is short.
    let views = [look(90.0, (60.0, AHEAD_PX)), look(270.0, (30.0, MIRROR_PX))];

    let mut painter = Painter::new(&overfly);
    let mut output = FrameOutput::default();
    painter.settle(&mut overfly, &views, &mut output)?;
    let mut picture = painter.draw(&overfly, &output, 0)?;
    let mirror = painter.draw(&overfly, &output, 1)?;
    hang(&mut picture, &mirror);
    picture.write(&arguments.out)?;
    for (name, view) in ["ahead", "mirror"].into_iter().zip(&output.views) {
        let drawn: usize = view.ranges.iter().map(|range| range.patches.len()).sum();
        let [width, height] = view.camera.size_px;
        println!("{name}: {width}x{height}, {drawn} patches in {} ranges", view.ranges.len());
    }
    println!("wrote {}: {} patches kept for both", arguments.out.display(), output.counts.leaves);
    Ok(())
}

/// Puts a mirror into a picture: its left is the right of what lies behind.
fn hang(picture: &mut Canvas, mirror: &Canvas) {
    let ([width, _], [across, down]) = (picture.size_px, mirror.size_px);
    let left = (width - across) / 2;
    for y in 0..down + 2 * FRAME_PX {
        for x in 0..across + 2 * FRAME_PX {
            let inside = (x.wrapping_sub(FRAME_PX), y.wrapping_sub(FRAME_PX));
            let pixel = (TOP_PX + y) * width + left - FRAME_PX + x;
            picture.light[pixel] = match inside {
                (x, y) if x < across && y < down => mirror.light[y * across + across - 1 - x],
                _ => [0.02; 3],
            };
        }
    }
}

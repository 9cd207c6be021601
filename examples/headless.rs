//! The smallest host: a pose goes in every frame, counts and a digest come out. No Vulkan.
//!
//! In:    a scene, how many frames, where to record.
//! Out:   a line for each second of flight; a recording that replays to the same digests.
//! Keeps: nothing.
//! Not here: drawing (`own_renderer`, `own_vulkan`), entities on the ground (`traffic`).
//!
//! ```text
//! cargo run --release --example headless -- --frames 600 --record flight.ovf
//! overfly replay flight.ovf --no-render
//! ```

use clap::Parser;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::ground::{Answer, Query};
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

const RATE_HZ: u32 = 60;
/// Degrees of longitude a second: the small planet is round in two minutes.
const TURN_DEG_S: f64 = 3.0;

/// Flies around a planet without drawing it
#[derive(Parser)]
struct Arguments {
    /// A scene file or a preset: earth, moon or small
    #[arg(long, default_value = "small")]
    scene: String,
    /// Frames to run, 60 a second of flight
    #[arg(long, value_name = "N", default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Height of the flight above the ellipsoid
    #[arg(long, value_name = "M", default_value_t = 300.0)]
    height: f64,
    /// Records all that goes in
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("headless: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = config::load(&arguments.scene)?;
    let host = Host {
        workers: Workers::Own(1), // helps with frames, sleeps between them
        pages: Pages::AsReady { threads: 1 }, // makes pages beside the frames; none ever waits
        ..Host::default()
    };
    let mut overfly = Overfly::new(&scene, host)?;
    if let Some(path) = &arguments.record {
        overfly.record(path, "headless", f64::from(RATE_HZ))?;
    }
    // Both are used again and again, so that a frame allocates nothing.
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    for frame in 0..arguments.frames {
        // Stands for the simulator's own clock.
        std::thread::sleep(Duration::from_secs(1) / RATE_HZ);
        input.time_s = f64::from(frame) / f64::from(RATE_HZ);
        let lon_deg = (TURN_DEG_S * input.time_s + 180.0) % 360.0 - 180.0;
        let at = Geodetic::from_degrees(20.0, lon_deg, arguments.height);
        let eastward = orientation_from_attitude(
            at,
            Radians::from_degrees(90.0),
            Radians::from_degrees(-15.0),
            Radians(0.0),
        );
        input.views.clear();
        input.views.push(View {
            eye: scene.body.ecef_from_geodetic(at),
            orientation: eastward,
            field_of_view: scene.views[0].field_of_view,
            size_px: [1280, 720],
            near_m: scene.views[0].near_m,
        });
        overfly.frame(&mut input, &mut output)?;
        if frame % RATE_HZ == RATE_HZ - 1 || frame + 1 == arguments.frames {
            say(&mut overfly, at, &output);
        }
    }
    for (key, fault) in overfly.faults() {
        eprintln!("headless: {fault} (a page of depth {})", key.depth());
    }
    if let Some(path) = &arguments.record {
        let frames = overfly.finish_recording()?;
        println!("recorded {frames} frames to {}", path.display());
    }
    Ok(())
}

/// One line of what a frame did. Heights come from a snapshot, which any thread may keep and ask.
fn say(overfly: &mut Overfly, at: Geodetic, output: &FrameOutput) {
    let below = match overfly.ground().height(at, Query::BestResident) {
        Answer::Ok(ground) | Answer::Coarser(ground) => {
            format!("{:8.2} m, within {:.2} m", ground.height_m, ground.bound_m)
        }
        Answer::NotReady => "not here yet".to_owned(),
        Answer::Refused => "no such place".to_owned(),
    };
    let counts = &output.counts;
    println!(
        "frame {:5}: {:6} triangles, {:3} pages, {:6.2} px, ground {below}, digest {:016x}",
        output.frame, counts.triangles, counts.pages, counts.error_px_bound, output.digest.vertices,
    );
}

//! Latency of gear contacts: ten aircraft of twelve wheels at 120 Hz, four threads, while frames run.
//!
//! In:    seconds and scene on the command line.
//! Out:   a table: p50, p99 and greatest of one contact, in nanoseconds.
//! Keeps: nothing.
//! Not here: throughput and other questions (`core/benches/ground.rs`), bits (`tests/ground_queries`).

use clap::Parser;
use glam::DVec3;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Ellipsoid, Enu, Geodetic};
use overfly::core::ground::{Ground, Query, Region};
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::jobs::now_ns;
use overfly::{Host, Overfly, Pages, Workers, config};
use parking_lot::Mutex;
use std::error::Error;
use std::hint::black_box;
use std::time::Duration;

const THREADS: u32 = 4;
const AIRCRAFT: u32 = 10;
const CONTACTS: u32 = 12;
const RATE_HZ: u32 = 120;
const FRAME_RATE_HZ: u32 = 60;
const LEVEL: u8 = 44;
const RADIUS_M: f64 = 400.0;

const AFTER_HELP: &str = "\
Each thread has its aircraft: in a step it takes the newest snapshot, asks for every wheel's contact
and sleeps until the next step. `frames` draws nothing; its camera flies a circle above the aircraft.
`clock` is what two readings of the clock take, which every contact's time includes.

Examples:
  cargo bench --bench contacts
  cargo bench --bench contacts -- --seconds 60 --still";

/// Latency of gear contacts from four threads while frames run
#[derive(Parser)]
#[command(name = "contacts", after_help = AFTER_HELP)]
struct Args {
    /// How long is measured
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// A scene file or a preset
    #[arg(long, default_value = "earth")]
    scene: String,
    /// No frames run meanwhile, to compare with
    #[arg(long)]
    still: bool,
    /// Cargo says so.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let scene = config::load(&args.scene)?;
    let host =
        Host { workers: Workers::Own(1), pages: Pages::AsReady { threads: 1 }, ..Host::default() };
    let mut overfly = Overfly::new(&scene, host)?;
    let centre = Geodetic::from_degrees(46.85, -121.76, 0.0);
    let region = Region { centre, radius_m: RADIUS_M };
    let _ticket = overfly.request(region, LEVEL)?;
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    while overfly.readiness(region, LEVEL)?.missing > 0 {
        overfly.frame(&mut input, &mut output)?;
        std::thread::sleep(Duration::from_millis(1));
    }
    let newest = Mutex::new(overfly.ground());
    let steps = args.seconds * RATE_HZ;
    let mut frames = 0;
    let times_ns = std::thread::scope(|scope| {
        let threads = (0..THREADS).map(|thread| {
            let (newest, body) = (&newest, scene.body);
            scope.spawn(move || fly(newest, &body, (thread, steps)))
        });
        let threads: Vec<_> = threads.collect();
        let ended = || threads.iter().all(std::thread::ScopedJoinHandle::is_finished);
        while !ended() {
            std::thread::sleep(Duration::from_secs(1) / FRAME_RATE_HZ);
            if !args.still {
                input.time_s = f64::from(frames) / f64::from(FRAME_RATE_HZ);
                input.views.clear();
                input.views.push(camera(&scene, input.time_s));
                overfly.frame(&mut input, &mut output)?;
                *newest.lock() = overfly.ground();
                frames += 1;
            }
        }
        let joined = threads.into_iter().map(|thread| thread.join().expect("it does not panic"));
        Ok::<_, Box<dyn Error>>(joined.flatten().collect::<Vec<_>>())
    })?;
    report(times_ns, frames);
    Ok(())
}

/// Time of each contact of one thread's aircraft.
fn fly(newest: &Mutex<Ground>, body: &Ellipsoid, (thread, steps): (u32, u32)) -> Vec<u32> {
    let aircraft = (thread..AIRCRAFT).step_by(THREADS as usize);
    let mut times_ns = Vec::with_capacity((steps * AIRCRAFT * CONTACTS / THREADS * 2) as usize);
    for step in 0..steps {
        let ground = newest.lock().clone();
        for (aircraft, contact) in
            aircraft.clone().flat_map(|aircraft| (0..CONTACTS).map(move |wheel| (aircraft, wheel)))
        {
            let wheel = wheel(body, aircraft, step, contact);
            let begin_ns = now_ns();
            let answer = black_box(&ground).agl(black_box(wheel), Query::Exact(LEVEL));
            black_box(answer);
            times_ns.push(u32::try_from(now_ns() - begin_ns).unwrap_or(u32::MAX));
        }
        std::thread::sleep(Duration::from_secs(1) / RATE_HZ);
    }
    times_ns
}

/// Aircraft roll outwards on a star at 30 m/s and begin anew at its middle.
fn wheel(body: &Ellipsoid, aircraft: u32, step: u32, contact: u32) -> Ecef {
    let centre = Geodetic::from_degrees(46.85, -121.76, 2500.0);
    let along_m = (30.0 * f64::from(step) / f64::from(RATE_HZ)) % (0.8 * RADIUS_M);
    let away = heading(f64::from(aircraft) * 36.0) * along_m;
    Enu(away + heading(f64::from(contact) * 30.0) * 5.0).to_ecef(centre, body)
}

fn heading(degrees: f64) -> DVec3 {
    Geodetic::from_degrees(0.0, degrees, 0.0).normal()
}

fn camera(scene: &SceneSettings, time_s: f64) -> View {
    let lon_deg = -121.76 + 0.02 * time_s;
    let at = Geodetic::from_degrees(46.85, lon_deg, 4000.0);
    let (east, down) = (Radians::from_degrees(90.0), Radians::from_degrees(-20.0));
    View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, east, down, Radians(0.0)),
        field_of_view: Radians(1.0),
        size_px: [1280, 720],
        near_m: 1.0,
    }
}

fn report(mut times_ns: Vec<u32>, frames: u32) {
    times_ns.sort_unstable();
    let at = |share: f64| {
        #[expect(clippy::cast_possible_truncation, reason = "a share of the length")]
        let index = (share * (times_ns.len() - 1) as f64) as usize;
        times_ns[index]
    };
    let mut clock_ns: Vec<u64> = (0..10_001)
        .map(|_| {
            let begin_ns = now_ns();
            now_ns() - begin_ns
        })
        .collect();
    clock_ns.sort_unstable();
    println!("contacts      frames   p50 ns   p99 ns   p99.9 ns   max ns   clock ns");
    println!(
        "{:8}    {frames:8} {:8} {:8}   {:8} {:8} {:10}",
        times_ns.len(),
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        clock_ns[clock_ns.len() / 2]
    );
}

//! A thousand vehicles, entities of the host's own world, that stand on the ground in every frame.
//!
//! In:    a scene, how many vehicles, how many frames.
//! Out:   how many were placed and how well is known on what; a map of where they are.
//! Keeps: nothing.
//! Not here: drawing them (`own_vulkan` and `cockpit` draw what a host has beside the ground).
//!
//! ```text
//! cargo run --release --example traffic -- --scene earth --vehicles 1000
//! ```
//!
//! The town's ground is requested in full detail and stays, whatever the camera looks at. Whoever
//! drives out of it stands on what the camera's detail happens to have: `Coarser`, and said so.

use clap::Parser;
use glam::{DMat3, DQuat, DVec3};
use hecs::World;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Ellipsoid, Enu, Geodetic};
use overfly::core::ground::{Answer, Ground, Height, LEVEL_MAX, Query, Region};
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};
use std::error::Error;
use std::process::ExitCode;

const RATE_HZ: f64 = 60.0;
/// How far from the town's middle its ground is requested, and how far vehicles begin.
const TOWN_M: f64 = 60.0;
const START_M: f64 = 50.0;
/// Samples of the ground that vehicles stand on are no farther apart.
const SPACING_M: f64 = 1.0;
/// The map: characters across and down over twice this distance.
const MAP_M: f64 = 100.0;
const MAP: [usize; 2] = [64, 24];

/// Drives vehicles over the ground
#[derive(Parser)]
struct Arguments {
    /// A scene file or a preset: earth, moon or small
    #[arg(long, default_value = "small")]
    scene: String,
    /// How many vehicles
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    vehicles: u32,
    /// Frames to run
    #[arg(long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
}

/// Where a vehicle is and goes.
struct Route {
    at: Geodetic,
    heading_rad: f64,
    speed_m_s: f64,
}

/// How a vehicle stands: what a host draws it with. Its axes: x right, y ahead, z up.
struct Stance {
    place: Ecef,
    orientation: DQuat,
    height_m: f64,
}

/// What became of all vehicles in a frame.
#[derive(Default)]
struct Placed {
    exact: u32,
    coarser: u32,
    not_ready: u32,
    steepest_rad: f64,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("traffic: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = config::load(&arguments.scene)?;
    let host = Host {
        workers: Workers::Caller,
        pages: Pages::Waited { threads: 1 }, // as ready for a simulator, waited for in an example
        ..Host::default()
    };
    let mut overfly = Overfly::new(&scene, host)?;
    let town = Geodetic::from_degrees(-40.0, -60.0, 0.0);
    let level = level_of(&scene.body, SPACING_M);
    let ticket = overfly.request(Region { centre: town, radius_m: TOWN_M }, level)?;
    let mut world = World::new();
    world.spawn_batch((0..arguments.vehicles).map(|index| (vehicle(index, town, &scene.body),)));

    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    for frame in 0..arguments.frames {
        input.time_s = f64::from(frame) / RATE_HZ;
        input.views.clear();
        input.views.push(camera(town, &scene.body, scene.views[0].near_m));
        overfly.frame(&mut input, &mut output)?;
        // A snapshot of this moment. Systems on other threads may have clones of it.
        let ground = overfly.ground();
        let placed = place_all(&mut world, &ground, Query::Exact(level));
        if frame % 30 == 0 || frame + 1 == arguments.frames {
            say(frame, &placed);
        }
    }
    print!("{}", map(&world, town, &scene.body));
    overfly.release(ticket);
    Ok(())
}

/// The coarsest even level whose samples are no farther apart than this: level 2n cuts a quarter of
/// the equator into 2ⁿ.
fn level_of(body: &Ellipsoid, spacing_m: f64) -> u8 {
    let quarter_m = body.a_m * std::f64::consts::FRAC_PI_2;
    let halvings = (0..LEVEL_MAX / 2).find(|n| quarter_m / f64::from(1_u32 << n) <= spacing_m);
    2 * halvings.unwrap_or(LEVEL_MAX / 2)
}

/// A system of the host: everybody drives on and is put on the ground.
fn place_all(world: &mut World, ground: &Ground, query: Query) -> Placed {
    let mut placed = Placed::default();
    let mut stances = Vec::new();
    for (entity, route) in world.query_mut::<(hecs::Entity, &mut Route)>() {
        drive(route, ground.body());
        let found = match ground.height(route.at, query) {
            Answer::Ok(found) => {
                placed.exact += 1;
                found
            }
            Answer::Coarser(found) => {
                placed.coarser += 1;
                found
            }
            // It stays as it stood: nobody is put at a height that nobody knows.
            Answer::NotReady | Answer::Refused => {
                placed.not_ready += 1;
                continue;
            }
        };
        let tilt_rad = found.normal.angle_between(route.at.normal());
        placed.steepest_rad = placed.steepest_rad.max(tilt_rad);
        stances.push((entity, stand(route, &found, ground.body())));
    }
    for (entity, stance) in stances {
        world.insert_one(entity, stance).expect("it was there a moment ago");
    }
    placed
}

/// On the ground, upright on its slope, nose along the heading.
fn stand(route: &Route, found: &Height, body: &Ellipsoid) -> Stance {
    let up = found.normal;
    let axes = route.at.enu_axes();
    let ahead = axes * heading(route.heading_rad);
    let right = ahead.cross(up).normalize();
    Stance {
        place: body.ecef_from_geodetic(Geodetic { height_m: found.height_m, ..route.at }),
        orientation: DQuat::from_mat3(&DMat3::from_cols(right, up.cross(right), up)),
        height_m: found.height_m,
    }
}

fn drive(route: &mut Route, body: &Ellipsoid) {
    let step = heading(route.heading_rad) * (route.speed_m_s / RATE_HZ);
    let there = body.geodetic_from_ecef(Enu(step).to_ecef(route.at, body));
    route.at = Geodetic { height_m: 0.0, ..there };
}

/// East, north, up of a heading clockwise from north.
fn heading(heading_rad: f64) -> DVec3 {
    use overfly::core::geodesy::trig::{cos, sin};
    DVec3::new(sin(heading_rad), cos(heading_rad), 0.0)
}

/// Vehicles begin on a spiral and drive off in all directions.
fn vehicle(index: u32, town: Geodetic, body: &Ellipsoid) -> Route {
    let turn_rad = f64::from(index) * 2.4;
    let away = heading(turn_rad) * (START_M * (f64::from(index % 97) / 97.0));
    let at = body.geodetic_from_ecef(Enu(away).to_ecef(town, body));
    Route {
        at: Geodetic { height_m: 0.0, ..at },
        heading_rad: turn_rad * 7.0,
        speed_m_s: 4.0 + f64::from(index % 16),
    }
}

/// A helicopter above the town, looking down.
fn camera(town: Geodetic, body: &Ellipsoid, near_m: f64) -> View {
    let at = Geodetic { height_m: 3000.0, ..town };
    let down = Radians::from_degrees(-90.0);
    View {
        eye: body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, Radians(0.0), down, Radians(0.0)),
        field_of_view: Radians::from_degrees(60.0),
        size_px: [1280, 720],
        near_m,
    }
}

fn say(frame: u32, placed: &Placed) {
    let Placed { exact, coarser, not_ready, steepest_rad } = placed;
    println!(
        "frame {frame:4}: {exact:5} placed, {coarser:5} on coarser ground, {not_ready:5} not \
         ready, steepest {:4.1} degrees",
        steepest_rad.to_degrees()
    );
}

/// North is up: `.` nobody, then 1 to 9 vehicles; `#` is more.
fn map(world: &World, town: Geodetic, body: &Ellipsoid) -> String {
    let mut counts = [[0_usize; MAP[0]]; MAP[1]];
    let (mut lowest_m, mut highest_m) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut leaning_rad = 0.0;
    for stance in world.query::<&Stance>().iter() {
        let at = Enu::from_ecef(stance.place, town, body).0;
        let cell = |metres: f64, cells: usize| {
            let at = (metres / MAP_M + 1.0) / 2.0 * cells as f64;
            #[expect(clippy::cast_possible_truncation, reason = "checked by the filter")]
            (0.0..cells as f64).contains(&at).then_some(at as usize)
        };
        if let (Some(x), Some(y)) = (cell(at.x, MAP[0]), cell(-at.y, MAP[1])) {
            counts[y][x] += 1;
        }
        lowest_m = lowest_m.min(stance.height_m);
        highest_m = highest_m.max(stance.height_m);
        leaning_rad += (stance.orientation * DVec3::Z).angle_between(town.normal());
    }
    let standing = world.query::<&Stance>().iter().count().max(1);
    let sign = |count: &usize| match *count {
        0 => '.',
        1..=9 => char::from_digit(u32::try_from(*count).unwrap_or(9), 10).unwrap_or('9'),
        _ => '#',
    };
    let rows = counts.iter().map(|row| row.iter().map(sign).chain(['\n']).collect::<String>());
    let mean_deg = (leaning_rad / standing as f64).to_degrees();
    // A sum with 0 is never -0.
    let [lowest_m, highest_m] = [lowest_m, highest_m].map(|m: f64| (m * 10.0).round() / 10.0 + 0.0);
    rows.chain([format!(
        "from {lowest_m:.1} m to {highest_m:.1} m, leaning {mean_deg:.1} degrees on average\n"
    )])
    .collect()
}

//! An aircraft on its wheels stands still whatever the camera sees.
//!
//! In:    the preset `earth`, a mass on three springs, a camera from orbit down to 2 m.
//! Out:   accelerations of the aircraft, step by step.
//! Keeps: nothing.
//! Not here: a whole flight model (the JSBSim examples), heights themselves (`core/tests/ground.rs`).

use glam::DVec3;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Enu, Geodetic};
use overfly::core::ground::{Ground, Query, Region};
use overfly::core::units::Radians;
use overfly::{Host, Overfly, Pages, Workers, config};

const PLACE: (f64, f64) = (46.8523, -121.7603);
/// Samples at most 0.6 m apart.
const LEVEL: u8 = 48;
const STEP_S: f64 = 1.0 / 120.0;
/// Camera and steps: 20 s.
const FRAMES: u32 = 600;
const STEPS_A_FRAME: u32 = 4;
/// Springs have come to rest after so many seconds.
const SETTLED_S: f64 = 5.0;

const GRAVITY_M_S2: f64 = 9.81;
const MASS_KG: f64 = 1000.0;
/// Of a light aircraft: a wheel carries a third of the weight at 0.1 m, and is damped to half.
const SPRING_N_M: f64 = MASS_KG * GRAVITY_M_S2 / 3.0 / 0.1;
const DAMPER_N_S_M: f64 = 3000.0;
const INERTIA_KG_M2: f64 = 1500.0;
/// Ahead and to the right of the centre of mass, metres.
const WHEELS_M: [[f64; 2]; 3] = [[1.2, 0.0], [-0.6, 1.3], [-0.6, -1.3]];

/// Height of the centre of mass above the ellipsoid, nose up and right wing down; and their rates.
#[derive(Clone, Copy)]
struct Aircraft {
    height_m: f64,
    tilt_rad: [f64; 2],
    rise_m_s: f64,
    turn_rad_s: [f64; 2],
}

impl Aircraft {
    /// One step; the vertical acceleration that is felt, in g.
    fn step(&mut self, ground: &Ground, query: Query) -> f64 {
        let place = Geodetic::from_degrees(PLACE.0, PLACE.1, self.height_m);
        let (mut lift_n, mut torque_n_m) = (0.0, [0.0; 2]);
        for [ahead_m, right_m] in WHEELS_M {
            let below_m = ahead_m * self.tilt_rad[0] - right_m * self.tilt_rad[1] - 1.0;
            let wheel = Enu(DVec3::new(right_m, ahead_m, below_m)).to_ecef(place, ground.body());
            // Nothing is known: as in the air.
            let Some(contact) = ground.agl(Ecef(wheel.0), query).found() else { continue };
            let squeezed_m = (-contact.agl_m).max(0.0);
            let sinks_m_s =
                right_m * self.turn_rad_s[1] - ahead_m * self.turn_rad_s[0] - self.rise_m_s;
            let damping_n = if squeezed_m > 0.0 { DAMPER_N_S_M * sinks_m_s } else { 0.0 };
            let force_n = (SPRING_N_M * squeezed_m + damping_n).max(0.0);
            lift_n += force_n;
            torque_n_m[0] += ahead_m * force_n;
            torque_n_m[1] -= right_m * force_n;
        }
        self.rise_m_s += (lift_n / MASS_KG - GRAVITY_M_S2) * STEP_S;
        self.height_m += self.rise_m_s * STEP_S;
        for ((tilt_rad, turn_rad_s), torque_n_m) in
            self.tilt_rad.iter_mut().zip(&mut self.turn_rad_s).zip(torque_n_m)
        {
            *turn_rad_s += torque_n_m / INERTIA_KG_M2 * STEP_S;
            *tilt_rad += *turn_rad_s * STEP_S;
        }
        lift_n / MASS_KG / GRAVITY_M_S2
    }
}

/// The camera in one frame: from 400 km down to 2 m, up again, and down from another side.
fn camera(overfly: &Overfly, frame: u32, ground_m: f64) -> View {
    let scene = overfly.scene();
    let leg = 3.0 * f64::from(frame) / f64::from(FRAMES - 1);
    let up = [1.0 - leg, leg - 1.0, 3.0 - leg][usize::from(leg > 1.0) + usize::from(leg > 2.0)];
    // In equal ratios.
    let above_m = 2.0 * overfly::core::geodesy::trig::exp(12.2 * up);
    let aside_m = above_m.min(1e5) * (leg - 1.5);
    let parked = Geodetic::from_degrees(PLACE.0, PLACE.1, ground_m);
    let eye = Enu(DVec3::new(aside_m, 0.0, above_m)).to_ecef(parked, &scene.body);
    let at = scene.body.geodetic_from_ecef(eye);
    let heading = Radians::from_degrees(2.0 * f64::from(frame));
    let pitch = Radians::from_degrees(-10.0 - 70.0 * up);
    View {
        eye,
        orientation: orientation_from_attitude(at, heading, pitch, Radians(0.0)),
        field_of_view: Radians(1.0),
        size_px: [640, 360],
        near_m: 0.1,
    }
}

/// What an aircraft felt, in g, and what the terrain did meanwhile.
struct Stand {
    felt_g: Vec<f64>,
    height_m: f64,
    pages_came: u32,
    pages_went: u32,
}

/// Parks an aircraft; with a requested region its ground is there before the camera comes.
fn park(pages: Pages, query: Query, requested: bool) -> Stand {
    let mut scene = config::load("earth").unwrap();
    scene.lod.triangles_max = 60_000;
    // So few that those of one descent push out those of the other.
    scene.memory.pages_bytes = 6 << 20;
    let host = Host { workers: Workers::Caller, pages, ..Host::default() };
    let mut overfly = Overfly::new(&scene, host).unwrap();
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    let centre = Geodetic::from_degrees(PLACE.0, PLACE.1, 0.0);
    let ground_m = overfly.ground_height_m(centre).unwrap();
    let region = Region { centre, radius_m: 5.0 };
    if requested {
        let _ticket = overfly.request(region, LEVEL).unwrap();
        while overfly.readiness(region, LEVEL).unwrap().missing > 0 {
            overfly.frame(&mut input, &mut output).unwrap();
            std::thread::yield_now();
        }
    }
    let mut aircraft = Aircraft {
        height_m: ground_m + 1.5,
        tilt_rad: [0.0; 2],
        rise_m_s: 0.0,
        turn_rad_s: [0.0; 2],
    };
    let mut stand = Stand { felt_g: Vec::new(), height_m: 0.0, pages_came: 0, pages_went: 0 };
    for frame in 0..FRAMES {
        input.time_s = f64::from(frame * STEPS_A_FRAME) * STEP_S;
        input.views.clear();
        input.views.push(camera(&overfly, frame, ground_m));
        overfly.frame(&mut input, &mut output).unwrap();
        stand.pages_came += output.counts.admitted;
        stand.pages_went += output.counts.evicted;
        let ground = overfly.ground();
        let steps = (0..STEPS_A_FRAME).map(|_| aircraft.step(&ground, query));
        stand.felt_g.extend(steps);
    }
    stand.height_m = aircraft.height_m;
    stand
}

/// The farthest from 1 g after the springs have come to rest.
fn worst_g(stand: &Stand) -> f64 {
    let times_s = (1..).map(|step| f64::from(step) * STEP_S);
    let settled = stand.felt_g.iter().zip(times_s).filter(|(_, time_s)| *time_s > SETTLED_S);
    settled.map(|(felt_g, _)| (felt_g - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn a_parked_aircraft_feels_1_g_while_detail_and_pages_come_and_go() {
    let stand = park(Pages::Waited { threads: 1 }, Query::Exact(LEVEL), true);
    let Stand { pages_came, pages_went, height_m, .. } = stand;
    let worst = worst_g(&stand);
    println!("{worst:.1e} g off 1 g; {pages_came} pages came, {pages_went} went; at {height_m} m");
    assert!(pages_came > 100 && pages_went > 50, "{pages_came} pages came, {pages_went} went");
    assert!(worst <= 0.05, "{worst} g");

    // Pages come when they like, and the aircraft does not notice.
    let again = park(Pages::AsReady { threads: 2 }, Query::Exact(LEVEL), true);
    let bits = |stand: &Stand| stand.felt_g.iter().map(|g| g.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&again), bits(&stand));
    assert_eq!(again.height_m.to_bits(), height_m.to_bits());
}

#[test]
fn an_aircraft_that_stands_on_whatever_is_resident_is_thrown_about() {
    let stand = park(Pages::Waited { threads: 1 }, Query::BestResident, false);
    let worst = worst_g(&stand);
    println!("{worst:.1} g off 1 g on the best that is resident");
    assert!(worst > 0.5, "{worst} g: the camera's detail does not reach the wheels");
}

//! A session as a host leads it: modes, database, frames, periods, entities and views.
//!
//! In:    messages of an independent host, in both byte orders.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: whether answers are right (`answers`), bad input (`fuzz`).

mod host;

use glam::DVec3;
use host::*;
use overfly_core::camera::{View, orientation_from_attitude};
use overfly_core::digest::mix;
use overfly_core::geodesy::trig::tan;
use overfly_core::geodesy::{Ellipsoid, Geodetic, narrow};
use overfly_core::ground::Query;
use overfly_core::units::Radians;
use overfly_link::cigi::{
    ENTITIES_MAX, FrameFacts, GROUPS_MAX, Mode, ONCE_MAX, Question, Reply, STANDING_MAX, Server,
    Setup, World,
};
use overfly_link::fgfs;

const OPERATE: (u8, i8) = (1, 0);

/// A frame over ground that nobody knows.
fn frame(server: &mut Server) -> Vec<u8> {
    let mut out = Vec::new();
    without_ground(|world| server.frame(world, SETTLED, &mut out));
    out
}

fn views(server: &Server, world: &World<'_>, size_px: [u32; 2]) -> Vec<View> {
    let mut views = Vec::new();
    server.views(world, size_px, &mut views);
    views
}

fn degrees(lat: f64, lon: f64, height_m: f64) -> Geodetic {
    let at = Geodetic::from_degrees(lat, lon, 0.0);
    Geodetic { height_m: height_m + sea_level_m(at.lat_rad, at.lon_rad), ..at }
}

fn attitude(at: Geodetic, [yaw, pitch, roll]: [f64; 3]) -> glam::DQuat {
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(Radians::from_degrees);
    orientation_from_attitude(at, yaw, pitch, roll)
}

fn assert_view(view: &View, eye: DVec3, orientation: glam::DQuat) {
    assert!((view.eye.0 - eye).length() < 1e-6, "{:?} is not {eye:?}", view.eye);
    assert!(view.orientation.dot(orientation).abs() > 1.0 - 1e-12, "{view:?} {orientation}");
}

#[test]
fn start_of_frame_says_versions_frames_time_and_mode_in_the_hosts_byte_order() {
    for big in [false, true] {
        let mut server = server();
        for (index, mode) in [(0, 0), (1, 1), (2, 2), (3, 0)] {
            let stamp = 0xDEAD_0000 + index;
            assert!(server.receive(&Host::new(big, stamp, (mode, 0)).bytes));
            let out = frame(&mut server);
            let [sof] = packets(&out)[..] else { panic!("only Start Of Frame") };
            assert_eq!((sof.big, sof.bytes.len()), (big, 24));
            assert_eq!(sof.u8(4), 0, "status");
            assert_eq!(sof.u8(5), 0x34 | mode, "3.3, timestamp valid, WGS 84, mode");
            assert_eq!([sof.u32(8), sof.u32(12), sof.u32(16)], [index, SETTLED.ticks, stamp]);
        }
    }
    let mut silent = server();
    assert_eq!(packets(&frame(&mut silent)).len(), 1, "before any host has spoken");
}

#[test]
fn a_database_is_loaded_in_the_steps_that_the_standard_has() {
    let mut server = server();
    let mut out = Vec::new();
    let mut step = |mode: u8, asked: i8, settled: bool| {
        server.receive(&Host::new(false, 0, (mode, asked)).bytes);
        let facts = FrameFacts { ticks: 0, settled };
        without_ground(|world| server.frame(world, facts, &mut out));
        i8::from_ne_bytes([out[3]])
    };
    assert_eq!(step(0, 5, true), 5, "the number does not count in standby");
    assert_eq!(step(1, 0, true), 5);
    assert_eq!(step(1, 5, true), -5, "it comes");
    assert_eq!(step(1, 5, true), -5, "until the host has heard");
    assert_eq!(step(1, 0, false), -5, "and everything is there");
    assert_eq!(step(1, 0, true), 5);
    assert_eq!(step(1, 9, true), -128, "there is no such database");
    assert_eq!(step(1, 0, true), 5, "the scene is still there");
    let lenses = vec![overfly_link::cigi::Lens {
        field_of_view_rad: 1.0,
        yaw_rad: 0.0,
        pitch_rad: 0.0,
        near_m: 0.1,
    }];
    let mut global = Server::new(Setup { lenses, database: None, message_bytes: 4096 });
    global.receive(&Host::new(false, 0, (1, 7)).bytes);
    assert_eq!(frame(&mut global)[3], 0, "nothing need be loaded");
}

#[test]
fn requests_are_answered_once_or_every_nth_frame_until_they_are_ended() {
    let mut server = server();
    let ask = |server: &mut Server, id: u16, period: u8| {
        let mut host = Host::new(true, 0x30 + u32::from(id), OPERATE);
        host.hat_hot((id, 0, period), None, [10.0, 20.0, 0.0]);
        host.vector((id, true, period), (None, [10.0, 20.0, 50.0]), [0.0, -90.0, 0.0, 100.0]);
        server.receive(&host.bytes);
    };
    let ids = |server: &mut Server| -> Vec<(u8, u16)> {
        packets(&frame(server))[1..].iter().map(|p| (p.id(), p.u16(2))).collect()
    };
    ask(&mut server, 1, 0);
    assert_eq!(ids(&mut server), [(102, 1), (105, 1)], "once");
    assert_eq!(ids(&mut server), []);
    ask(&mut server, 2, 3);
    let answered: Vec<usize> = (0..7).map(|_| ids(&mut server).len()).collect();
    assert_eq!(answered, [2, 0, 0, 2, 0, 0, 2], "every third frame");
    ask(&mut server, 2, 1);
    assert_eq!((0..4).map(|_| ids(&mut server).len()).sum::<usize>(), 8, "replaced by each frame");
    assert_eq!(server.held().standing, 2);
    server.receive(&Host::new(true, 0xABCD_EF57, OPERATE).bytes);
    let out = frame(&mut server);
    assert!(packets(&out)[1..].iter().all(|p| p.u8(4) >> 4 == 7), "stamped by the last message");
    ask(&mut server, 2, 0);
    assert_eq!(ids(&mut server).len(), 2, "the last answers");
    assert_eq!((ids(&mut server).len(), server.held().standing), (0, 0));
}

#[test]
fn what_stands_in_an_entitys_axes_ends_with_the_entity_and_its_children_go_with_it() {
    let mut server = server();
    let mut host = Host::new(false, 1, OPERATE);
    host.entity((1, 0, 1), [10.0, 20.0, 900.0], [0.0; 3]);
    host.entity((2, 1, 5), [5.0, 0.0, 0.0], [0.0; 3]);
    host.entity((3, 2, 5), [5.0, 0.0, 0.0], [0.0; 3]);
    host.entity((4, 0, 1), [11.0, 20.0, 900.0], [0.0; 3]);
    host.hat_hot((7, 0, 1), Some(3), [0.0; 3]);
    host.hat_hot((8, 0, 1), Some(4), [0.0; 3]);
    host.hat_hot((9, 0, 1), None, [0.0; 3]);
    server.receive(&host.bytes);
    assert_eq!((server.held().entities, server.held().standing), (4, 3));
    let mut host = Host::new(false, 2, OPERATE);
    host.entity((1, 0, 2), [f64::NAN; 3], [f32::NAN; 3]);
    server.receive(&host.bytes);
    assert_eq!((server.held().entities, server.held().standing), (1, 2));
    let mut host = Host::new(false, 3, OPERATE);
    host.entity((4, 4, 5), [0.0; 3], [0.0; 3]);
    host.entity((5, 6, 5), [0.0; 3], [0.0; 3]);
    host.clamped(77, 0.0, [0.0; 2]);
    server.receive(&host.bytes);
    assert_eq!(server.counters().no_entity, 3, "its own parent, none at all, not there");
    server.receive(&Host::new(false, 4, (0, 0)).bytes);
    let held = server.held();
    assert_eq!((held.entities, held.standing, held.views), (0, 0, 1), "reset forgets it all");
    let mut host = Host::new(false, 5, (0, 0));
    host.hat_hot((9, 0, 1), None, [0.0; 3]);
    server.receive(&host.bytes);
    assert_eq!((server.counters().standby, server.mode()), (1, Mode::Standby));
    assert_eq!(packets(&frame(&mut server)).len(), 1, "in standby there is only Start Of Frame");
}

#[test]
fn views_ride_on_entities_and_groups_with_offsets_turns_and_lenses() {
    let (at, ypr) = ([46.8, -121.7, 2500.0], [80.0, 5.0, -12.0]);
    let place = degrees(at[0], at[1], at[2]);
    let mut server = server();
    assert_eq!(without_ground(|world| views(&server, world, [640, 480])), [], "no ownship yet");
    let mut host = Host::new(true, 1, OPERATE);
    host.entity((0, 0, 1), at, ypr.map(narrow));
    server.receive(&host.bytes);
    let eye = Ellipsoid::WGS84.ecef_from_geodetic(place).0;
    let nose = attitude(place, ypr);
    without_ground(|world| {
        let [view] = views(&server, world, [640, 480])[..] else { panic!("one view") };
        assert_view(&view, eye, nose);
        assert_eq!((view.field_of_view.0, view.near_m, view.size_px), (1.0, 0.1, [640, 480]));
    });
    // 3 m ahead, 1 m to the right, 2 m up; then looking 90° to the right.
    let mut host = Host::new(true, 2, OPERATE);
    host.view_control((0, 0), 0, 0b11_1111, [3.0, 1.0, -2.0, 0.0, 0.0, 90.0]);
    server.receive(&host.bytes);
    let [forward, right, up] = [nose * -DVec3::Z, nose * DVec3::X, nose * DVec3::Y];
    without_ground(|world| {
        let view = views(&server, world, [640, 480])[0];
        let moved = eye + 3.0 * forward + right + 2.0 * up;
        assert!((view.eye.0 - moved).length() < 1e-6);
        assert!((view.orientation * -DVec3::Z - right).length() < 1e-12, "it looks to the right");
        assert!((view.orientation * DVec3::Y - up).length() < 1e-12);
    });
    // A second view in a group that is turned back and rides on a child of the ownship.
    let mut host = Host::new(false, 3, OPERATE);
    host.entity((9, 0, 5), [0.0, 0.0, -10.0], [0.0; 3]);
    host.view_definition((4, 2), 0b11_1101, [0.5, 9.0, -20.0, 30.0, 10.0, -15.0]);
    host.view_control((0, 2), 9, 0b10_0000, [9.0, 9.0, 9.0, 9.0, 9.0, 180.0]);
    server.receive(&host.bytes);
    without_ground(|world| {
        let all = views(&server, world, [200, 100]);
        assert_eq!(all.len(), 2);
        assert!((all[1].eye.0 - (eye + 10.0 * up)).length() < 1e-6);
        assert!((all[1].orientation * -DVec3::Z + forward).length() < 1e-12, "it looks back");
        assert_eq!(all[1].near_m, 0.5);
        // 30° to the right are the most: in a picture twice as wide as high, tan 30° / 2.
        let wanted = tan(Radians::from_degrees(30.0).0);
        let half = tan(all[1].field_of_view.0 / 2.0);
        assert!((2.0 * half - wanted).abs() < 1e-6);
        assert!(all.iter().all(|view| view.check().is_ok()));
    });
    let mut host = Host::new(false, 4, OPERATE);
    (10..30).for_each(|view| host.view_definition((view, 0), 0, [0.0; 6]));
    server.receive(&host.bytes);
    assert_eq!((server.held().views, server.counters().views_full), (8, 14));
}

#[test]
fn clamped_entities_stand_on_the_ground_and_lie_on_its_slope() {
    let ground = small_ground();
    let mut server = server();
    let mut host = Host::new(false, 1, OPERATE);
    let [lat, lon] = [31.0, 44.0];
    host.entity((1, 0, 1 | 1 << 5), [lat, lon, 1.5], [30.0, 0.0, 0.0]);
    host.entity((2, 0, 1 | 2 << 5), [0.0, 0.0, 2.0], [0.0; 3]);
    host.clamped(2, 30.0, [lat, lon]);
    host.view_control((0, 0), 1, 0, [0.0; 6]);
    host.view_control((1, 0), 2, 0, [0.0; 6]);
    server.receive(&host.bytes);
    let at = Geodetic::from_degrees(lat, lon, 0.0);
    let there = ground.height(at, Query::Exact(LEVEL)).ok().unwrap();
    let lift = |above_m: f64| {
        let height_m = there.height_m + above_m;
        ground.body().ecef_from_geodetic(Geodetic { height_m, ..at }).0
    };
    with_world(&ground, |world| {
        let all = views(&server, world, [64, 64]);
        assert_view(&all[0], lift(1.5), attitude(at, [30.0, 0.0, 0.0]));
        assert!((all[1].eye.0 - lift(2.0)).length() < 1e-6);
        let up = all[1].orientation * DVec3::Y;
        assert!((up - there.normal).length() < 1e-9, "it lies on the slope");
        let ahead = at.enu_axes().transpose() * (all[1].orientation * -DVec3::Z);
        assert!(ahead.y > 0.0 && ahead.x > 0.0, "and still heads north-east: {ahead}");
    });
    // Where nobody knows the ground, the eye waits at sea level and requests are not answered.
    let mut host = Host::new(false, 2, OPERATE);
    host.hat_hot((1, 0, 0), Some(1), [0.0; 3]);
    server.receive(&host.bytes);
    let known = |question: &Question| match question {
        Question::Height(_) => Reply::Unknown,
        _ => Reply::Clear,
    };
    let world = World { body: *ground.body(), sea_level_m: &sea_level_m, ask: &known };
    assert_eq!(views(&server, &world, [64, 64]).len(), 2);
    let mut out = Vec::new();
    server.frame(&world, SETTLED, &mut out);
    assert_eq!(packets(&out)[1].u8(4) & 1, 0, "not valid");
}

#[test]
fn ground_that_is_not_there_yet_is_not_valid_and_never_a_number() {
    let mut server = server();
    let mut host = Host::new(true, 1, OPERATE);
    let at = [10.0, 20.0, 100.0];
    (0..3).for_each(|kind| host.hat_hot((u16::from(kind), kind, 0), None, at));
    for extended in [false, true] {
        host.segment((3, extended, 0), (None, at), (None, [10.1, 20.0, 100.0]));
        host.vector((4, extended, 0), (None, at), [0.0, -90.0, 0.0, 1e4]);
    }
    host.hat_hot((9, 2, 0), Some(333), [0.0; 3]);
    server.receive(&host.bytes);
    let out = frame(&mut server);
    let answers = &packets(&out)[1..];
    assert_eq!(answers.len(), 8);
    for answer in answers {
        assert_eq!(answer.u8(4) & 15 & !2, 0, "no flag but the kind of height");
        assert!(answer.bytes[6..].iter().all(|&byte| byte == 0), "no number: {:?}", answer.bytes);
    }
    assert_eq!(server.counters().invalid, 8);
}

#[test]
fn an_earth_model_is_taken_only_if_it_is_the_scenes() {
    let mut server = server();
    let mut model = |custom: bool, a_m: f64, f: f64| {
        let mut host = Host::new(false, 1, OPERATE);
        host.earth(custom, a_m, f);
        server.receive(&host.bytes);
        let out = frame(&mut server);
        (out[5] >> 3 & 1, server.counters().earth_models)
    };
    assert_eq!(model(true, 6_378_137.0, 1.0 / 298.257_223_563), (1, 0), "host-defined");
    assert_eq!(model(true, 6_371_000.0, 0.0), (0, 1), "refused: WGS 84 is said");
    assert_eq!(model(false, f64::NAN, f64::NAN), (0, 1));
}

#[test]
fn responses_that_do_not_fit_wait_and_none_is_forgotten() {
    let lenses = vec![overfly_link::cigi::Lens {
        field_of_view_rad: 1.0,
        yaw_rad: 0.0,
        pitch_rad: 0.0,
        near_m: 0.1,
    }];
    let mut server = Server::new(Setup { lenses, database: None, message_bytes: 256 });
    let mut host = Host::new(false, 1, OPERATE);
    (0..40).for_each(|id| host.hat_hot((id, 2, 0), None, [0.0; 3]));
    (40..60).for_each(|id| host.hat_hot((id, 0, 2), None, [0.0; 3]));
    server.receive(&host.bytes);
    let mut seen = Vec::new();
    for _ in 0..40 {
        let out = frame(&mut server);
        assert!(out.len() <= 256);
        seen.extend(packets(&out)[1..].iter().map(|packet| packet.u16(2)));
    }
    assert!((0..40).all(|id| seen.iter().filter(|&&seen| seen == id).count() == 1));
    let counts: Vec<usize> =
        (40..60).map(|id| seen.iter().filter(|&&seen| seen == id).count()).collect();
    assert!(counts.iter().all(|&count| count >= 10), "each has its turn: {counts:?}");
    assert!(server.counters().delayed > 0);
}

#[test]
fn every_cap_is_held_and_counted() {
    let mut server = server();
    for block in 0..40_u16 {
        let mut host = Host::new(false, block.into(), (1, 0));
        for index in 0..250 {
            let id = block * 250 + index;
            host.entity((id, 0, 1), [0.0; 3], [0.0; 3]);
            host.hat_hot((id, 0, 9), None, [0.0; 3]);
            host.hat_hot((id + 20_000, 0, 0), None, [0.0; 3]);
        }
        (1..=200).for_each(|group| host.view_control((0, group), 0, 0, [0.0; 6]));
        server.receive(&host.bytes);
    }
    let (held, counters) = (server.held(), server.counters());
    let all = [held.entities, held.groups, held.standing, held.once];
    assert_eq!(all, [ENTITIES_MAX, GROUPS_MAX, STANDING_MAX, ONCE_MAX]);
    assert_eq!(counters.entities_full, 10_000 - ENTITIES_MAX as u64);
    assert_eq!(counters.requests_full, 20_000 - (STANDING_MAX + ONCE_MAX) as u64);
    assert_eq!(counters.views_full, 40 * (200 - GROUPS_MAX as u64));
    // A chain of entities may be so long and no longer, and closes nowhere.
    server.receive(&Host::new(false, 0, (0, 0)).bytes);
    let mut host = Host::new(false, 0, (1, 0));
    host.entity((0, 0, 1), [10.0, 20.0, 30.0], [0.0; 3]);
    (1..100).for_each(|id| host.entity((id, id - 1, 5), [1.0, 0.0, 0.0], [0.0; 3]));
    host.entity((1, 5, 5), [1.0, 0.0, 0.0], [0.0; 3]);
    host.view_control((0, 0), 16, 0, [0.0; 6]);
    server.receive(&host.bytes);
    assert_eq!(server.held().entities, 17);
    assert_eq!(server.counters().no_entity, 99 - 16 + 1);
    let mut views = Vec::new();
    without_ground(|world| server.views(world, [9, 9], &mut views));
    assert_eq!(views.len(), 1, "the last of the chain has a pose");
}

/// A packet as FlightGear 2020 (version 24) or the later (25) sends it: only what is read differs
/// from zero.
fn native_fdm(version: u32, size: usize, three: [f64; 3], phi_theta_psi: [f32; 3]) -> Vec<u8> {
    let mut bytes = vec![0; size];
    bytes[..4].copy_from_slice(&version.to_be_bytes());
    for (index, number) in three.into_iter().enumerate() {
        bytes[8 + 8 * index..16 + 8 * index].copy_from_slice(&number.to_be_bytes());
    }
    for (index, angle) in phi_theta_psi.into_iter().enumerate() {
        bytes[36 + 4 * index..40 + 4 * index].copy_from_slice(&angle.to_be_bytes());
    }
    bytes
}

#[test]
fn flightgears_packets_drive_the_ownship() {
    let place = degrees(37.6, -122.4, 1234.5);
    let (lon, lat) = (place.lon_rad, place.lat_rad);
    let mut server = server();
    for (version, size) in [(24, 408), (25, 552)] {
        let packet = native_fdm(version, size, [lon, lat, 1234.5], [0.1, -0.2, 2.5]);
        server.drive(&fgfs::decode(&packet).unwrap());
        let eye = Ellipsoid::WGS84.ecef_from_geodetic(place).0;
        let [yaw, pitch, roll] = [2.5_f32, -0.2, 0.1].map(|angle| Radians(f64::from(angle)));
        let orientation = orientation_from_attitude(place, yaw, pitch, roll);
        without_ground(|world| assert_view(&views(&server, world, [9, 9])[0], eye, orientation));
    }
    assert_eq!(server.mode(), Mode::Standby, "no CIGI host is needed");
}

#[test]
fn what_is_no_pose_of_flightgear_is_refused_with_its_reason() {
    let good = |version, size| native_fdm(version, size, [1.0, 0.5, 100.0], [0.0; 3]);
    let reason = |bytes: &[u8]| fgfs::decode(bytes).unwrap_err().to_string();
    assert_eq!(reason(&[]), "0 bytes, too few for a version");
    assert_eq!(reason(&good(23, 408)), "version is 23, allowed are 24 and 25");
    assert_eq!(reason(&good(24, 407)), "407 bytes, a packet of its version has 408");
    assert_eq!(reason(&good(25, 408)), "408 bytes, a packet of its version has 552");
    let bad = native_fdm(24, 408, [1.0, 1.6, 0.0], [0.0; 3]);
    assert_eq!(reason(&bad), "latitude is 1.6, out of its range");
    let bad = native_fdm(24, 408, [f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert_eq!(reason(&bad), "longitude is NaN, out of its range");
    let bad = native_fdm(24, 408, [0.0; 3], [0.0, 0.0, f32::INFINITY]);
    assert_eq!(reason(&bad), "heading is inf, out of its range");
    for length in 0..600 {
        let bytes: Vec<u8> = (0..length).map(|i| mix(i * 7919 + length).to_le_bytes()[0]).collect();
        assert!(fgfs::decode(&bytes).is_err());
    }
}

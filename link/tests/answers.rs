//! Ten thousand random requests: the answers are those of the ground itself.
//!
//! In:    a small planet, an independent host.
//! Out:   passes or fails; how many of each kind.
//! Keeps: nothing.
//! Not here: periods, modes, bad input (`session`, `fuzz`).

mod host;

use glam::DVec3;
use host::*;
use overfly_core::camera::orientation_from_attitude;
use overfly_core::digest::mix;
use overfly_core::geodesy::trig::{acos, cos, sin};
use overfly_core::geodesy::{Ecef, Geodetic, narrow};
use overfly_core::ground::{Ground, Height, Hit, Query, Refraction, Sight};
use overfly_core::units::Radians;
use overfly_link::cigi::{MATERIAL_GROUND, MATERIAL_WATER};

const QUERY: Query = Query::Exact(LEVEL);
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Requests in one message.
const EACH: u16 = 250;
const MESSAGES: u32 = 40;

/// An entity as the host has it.
struct Craft {
    at: [f64; 3],
    ypr: [f32; 3],
}

/// What a request should bring.
enum Expected {
    Heights { kind: u8, place: Geodetic },
    Segment { extended: bool, from: Ecef, to: Ecef },
    Vector { extended: bool, from: Ecef, direction: DVec3, min_m: f64, max_m: f64 },
}

fn geodetic([lat_deg, lon_deg, altitude_m]: [f64; 3]) -> Geodetic {
    let place = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
    Geodetic { height_m: altitude_m + sea_level_m(place.lat_rad, place.lon_rad), ..place }
}

impl Craft {
    fn random(seed: u64) -> Self {
        let angle = |i: u64, scale: f64| narrow(scale * (unit(seed ^ i << 40) - 0.5));
        Self {
            at: place(seed ^ 0xC0, 150.0),
            ypr: [angle(1, 700.0), angle(2, 170.0), angle(3, 340.0)],
        }
    }

    /// Forward, right and down, by way of the camera of an aircraft's nose.
    fn axes(&self) -> [DVec3; 3] {
        let [yaw, pitch, roll] = self.ypr.map(|angle| Radians::from_degrees(f64::from(angle)));
        let camera = orientation_from_attitude(geodetic(self.at), yaw, pitch, roll);
        [camera * -DVec3::Z, camera * DVec3::X, camera * -DVec3::Y]
    }

    fn along(&self, [x, y, z]: [f64; 3]) -> DVec3 {
        let [forward, right, down] = self.axes();
        forward * x + right * y + down * z
    }
}

/// A place within some height of the sea.
fn place(seed: u64, above_m: f64) -> [f64; 3] {
    let lat_deg = 180.0 * unit(seed ^ 0x11) - 90.0;
    let lon_deg = 360.0 * unit(seed ^ 0x22) - 180.0;
    [lat_deg, lon_deg, above_m * (unit(seed ^ 0x33) - 0.2)]
}

struct Rig {
    ground: Ground,
    crafts: Vec<Craft>,
}

impl Rig {
    /// A point on the body, or in the axes of a craft, and where it is.
    fn spot(&self, seed: u64, above_m: f64) -> (Option<u16>, [f64; 3], Ecef) {
        let body = self.ground.body();
        if unit(seed ^ 0x77) < 0.6 {
            let at = place(seed, above_m);
            return (None, at, body.ecef_from_geodetic(geodetic(at)));
        }
        let craft = usize::from(below(seed ^ 0x88, 40));
        let offset = [4, 5, 6].map(|i| 120.0 * (unit(seed ^ i << 32) - 0.5));
        let craft_at = body.ecef_from_geodetic(geodetic(self.crafts[craft].at));
        let point = Ecef(craft_at.0 + self.crafts[craft].along(offset));
        (Some(u16::try_from(craft).unwrap() + 1), offset, point)
    }

    fn ask(&self, host: &mut Host, id: u16, seed: u64) -> Expected {
        let extended = unit(seed ^ 0x99) < 0.5;
        let (source, at, from) = self.spot(seed, 150.0);
        let body = self.ground.body();
        match below(seed ^ 0xBEEF, 5) {
            kind @ 0..=2 => {
                host.hat_hot((id, kind, 0), source, at);
                let place = source.map_or_else(|| geodetic(at), |_| body.geodetic_from_ecef(from));
                Expected::Heights { kind, place }
            }
            3 => {
                let (destination, there, to) = self.spot(seed ^ 0xABCD, 400.0);
                host.segment((id, extended, 0), (source, at), (destination, there));
                Expected::Segment { extended, from, to }
            }
            _ => {
                let azimuth = narrow(720.0 * (unit(seed ^ 0xA1) - 0.5));
                let elevation = narrow(178.0 * (unit(seed ^ 0xA2) - 0.5));
                let min = if unit(seed ^ 0xA3) < 0.3 { 60.0 * unit(seed ^ 0xA4) } else { 0.0 };
                let max = 2000.0 * unit(seed ^ 0xA5);
                let four = [azimuth, elevation, narrow(min), narrow(max)];
                host.vector((id, extended, 0), (source, at), four);
                let [azimuth, elevation, min_m, max_m] = four.map(f64::from);
                let (azimuth, elevation) = (azimuth * DEGREE, elevation * DEGREE);
                let ahead = cos(elevation) * cos(azimuth);
                let aside = cos(elevation) * sin(azimuth);
                let above = sin(elevation);
                let direction = match source {
                    None => geodetic(at).enu_axes() * DVec3::new(aside, ahead, above),
                    Some(craft) => {
                        self.crafts[usize::from(craft) - 1].along([ahead, aside, -above])
                    }
                };
                Expected::Vector { extended, from, direction, min_m, max_m }
            }
        }
    }

    fn check(&self, packet: &Packet<'_>, expected: &Expected, stamp: u8) -> &'static str {
        assert_eq!(packet.u8(4) >> 4, stamp, "the last host frame's least four bits");
        match *expected {
            Expected::Heights { kind, place } => self.check_heights(packet, kind, place),
            Expected::Segment { extended, from, to } => {
                self.check_segment(packet, extended, [from, to])
            }
            Expected::Vector { extended, from, direction, min_m, max_m } => {
                let hit = self.ground.ray(from, direction, max_m, QUERY);
                let hit = hit.ok().expect("everything is resident");
                let Some(hit) = hit.filter(|hit| hit.distance_m >= min_m) else {
                    self.check_line(packet, extended, (false, false, false), 0.0);
                    return hit.map_or("vectors that miss", |_| "vectors that hit too near");
                };
                self.check_line(packet, extended, (true, false, extended), hit.distance_m);
                self.check_hit(packet, extended, &hit);
                "vectors that hit"
            }
        }
    }

    fn check_segment(
        &self,
        packet: &Packet<'_>,
        extended: bool,
        [from, to]: [Ecef; 2],
    ) -> &'static str {
        let sight = self.ground.line_of_sight(from, to, Refraction::None, QUERY);
        match sight.ok().expect("everything is resident") {
            Sight::Clear { .. } => {
                let far_m = if extended { (to.0 - from.0).length() } else { 0.0 };
                self.check_line(packet, extended, (false, true, false), far_m);
                if extended {
                    self.check_point(packet, to, 0, None);
                }
                "segments that are clear"
            }
            Sight::Blocked(hit) => {
                self.check_line(packet, extended, (true, false, false), hit.distance_m);
                self.check_hit(packet, extended, &hit);
                "segments that are blocked"
            }
        }
    }

    fn check_heights(&self, packet: &Packet<'_>, kind: u8, place: Geodetic) -> &'static str {
        let Height { height_m, normal, water, .. } =
            self.ground.height(place, QUERY).ok().expect("everything is resident");
        let above_m = place.height_m - height_m;
        let of_m = height_m - sea_level_m(place.lat_rad, place.lon_rad);
        assert_eq!(packet.u8(4) & 1, 1, "valid");
        if kind < 2 {
            assert_eq!((packet.id(), packet.u8(1), packet.u8(4) >> 1 & 1), (102, 16, kind));
            near(packet.f64(8), if kind == 0 { above_m } else { of_m }, 1e-6);
            return if kind == 0 { "HAT" } else { "HOT" };
        }
        assert_eq!((packet.id(), packet.u8(1)), (103, 40));
        near(packet.f64(8), above_m, 1e-6);
        near(packet.f64(16), of_m, 1e-6);
        assert_eq!(packet.u32(24), material(water));
        check_normal([packet.f32(28), packet.f32(32)], place, normal);
        "extended HAT and HOT"
    }

    fn check_line(
        &self,
        packet: &Packet<'_>,
        extended: bool,
        (valid, visible, range_valid): (bool, bool, bool),
        range_m: f64,
    ) {
        let bits = packet.u8(4);
        let found = if extended {
            assert_eq!((packet.id(), packet.u8(1)), (105, 56));
            (bits & 1 != 0, bits & 8 != 0, bits & 4 != 0)
        } else {
            assert_eq!((packet.id(), packet.u8(1)), (104, 16));
            (bits & 1 != 0, bits & 4 != 0, range_valid)
        };
        assert_eq!(found, (valid, visible, range_valid));
        assert_eq!(bits & 2, 0, "it is never an entity");
        assert_eq!(packet.u8(5), 1, "one response");
        near(packet.f64(8), range_m, 1e-6);
    }

    fn check_hit(&self, packet: &Packet<'_>, extended: bool, hit: &Hit) {
        if extended {
            let place = self.ground.body().geodetic_from_ecef(hit.point);
            let water = self.ground.height(place, QUERY).ok().unwrap().water;
            self.check_point(packet, hit.point, material(water), Some(hit.normal));
        }
    }

    fn check_point(&self, packet: &Packet<'_>, point: Ecef, material: u32, normal: Option<DVec3>) {
        let place = geodetic([packet.f64(16), packet.f64(24), packet.f64(32)]);
        let told = self.ground.body().ecef_from_geodetic(place);
        assert!((told.0 - point.0).length() < 1e-6, "{told:?} {point:?}");
        assert_eq!(packet.u32(44), material);
        assert_eq!(packet.u8(43), if material == 0 { 0 } else { 255 }, "alpha");
        if let Some(normal) = normal {
            check_normal([packet.f32(48), packet.f32(52)], place, normal);
        }
    }
}

/// A number below `end` that looks random.
fn below(seed: u64, end: u8) -> u8 {
    let number = mix(seed) % u64::from(end);
    number.try_into().expect("below a byte")
}

fn material(water: bool) -> u32 {
    if water { MATERIAL_WATER } else { MATERIAL_GROUND }
}

fn near(found: f64, wanted: f64, within: f64) {
    assert!((found - wanted).abs() <= within, "{found} instead of {wanted}");
}

/// The normal by its azimuth from north over east and its elevation, both in degrees.
fn check_normal([azimuth, elevation]: [f32; 2], place: Geodetic, normal: DVec3) {
    let (azimuth, elevation) = (f64::from(azimuth) * DEGREE, f64::from(elevation) * DEGREE);
    let enu =
        DVec3::new(cos(elevation) * sin(azimuth), cos(elevation) * cos(azimuth), sin(elevation));
    let told = place.enu_axes() * enu;
    let apart_rad = acos(told.dot(normal).clamp(-1.0, 1.0));
    assert!(apart_rad < 1e-6, "{apart_rad} rad between {told} and {normal}");
}

#[test]
fn ten_thousand_random_requests_have_the_answers_of_the_ground_itself() {
    let crafts = (0..40).map(|i| Craft::random(0x5EED ^ i << 20)).collect();
    let rig = Rig { ground: small_ground(), crafts };
    let mut server = server();
    let mut out = Vec::new();
    let mut tally = std::collections::BTreeMap::<&str, u32>::new();
    for message in 0..MESSAGES {
        let frame = 0xFFFF_FFF0_u32.wrapping_add(7 * message);
        let mut host = Host::new(message % 3 == 0, frame, (1, 0));
        for (index, craft) in (1..).zip(&rig.crafts) {
            host.entity((index, 0, 1), craft.at, craft.ypr);
        }
        let ask = |id| rig.ask(&mut host, id, u64::from(message) << 32 | u64::from(id));
        let expected: Vec<Expected> = (0..EACH).map(ask).collect();
        assert!(server.receive(&host.bytes));
        with_world(&rig.ground, |world| server.frame(world, SETTLED, &mut out));
        let packets = packets(&out);
        assert_eq!(packets[0].big, host.big, "answers are in the host's byte order");
        assert_eq!(packets[0].u32(16), frame, "Start Of Frame has the last host frame");
        assert_eq!(packets.len(), usize::from(EACH) + 1);
        let [stamp, ..] = frame.to_le_bytes();
        for (id, (packet, expected)) in (0..).zip(packets[1..].iter().zip(&expected)) {
            assert_eq!(packet.u16(2), id, "in the order of the requests");
            *tally.entry(rig.check(packet, expected, stamp & 15)).or_default() += 1;
        }
    }
    println!("{tally:?}");
    assert_eq!(tally.values().sum::<u32>(), 10_000);
    assert_eq!(tally.len(), 8, "{tally:?}");
    assert!(tally.values().all(|&count| count >= 100), "{tally:?}");
    let counters = server.counters();
    assert_eq!(counters.responses, 10_000);
    let told = counters.columns();
    let dropped = told.iter().filter(|(name, _)| name.starts_with("dropped"));
    assert_eq!(dropped.map(|(_, count)| count).sum::<u64>(), 0, "{told:?}");
}

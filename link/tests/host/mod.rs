//! A CIGI host of its own: writes and reads packets by the field tables, and by nothing else.
//!
//! In:    numbers in the units of the packets: degrees, metres.
//! Out:   messages to a server; its responses as plain numbers; a ground to compare with.
//! Keeps: the message under way.
//! Not here: what is asserted.
//! Source: the tables of `docs/serving.md`, byte by byte.
#![allow(dead_code, missing_docs, reason = "each test binary uses its part of the host")]

use overfly_core::datasource::generate::Generator;
use overfly_core::digest::mix;
use overfly_core::geodesy::trig::{cos, sin};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::ground::{Ground, Region};
use overfly_link::cigi::{FrameFacts, Lens, Question, Reply, Server, Setup, World, ask};

/// Level at which the small planet is asked: samples 6 m apart.
pub const LEVEL: u8 = 16;
/// Nothing is on its way.
pub const SETTLED: FrameFacts = FrameFacts { ticks: 4711, settled: true };

/// A message from a host.
#[derive(Clone)]
pub struct Host {
    pub big: bool,
    pub bytes: Vec<u8>,
}

impl Host {
    /// Begins a message with IG Control: mode 1 is Operate.
    pub fn new(big: bool, frame: u32, (mode, database): (u8, i8)) -> Self {
        let mut host = Self { big, bytes: Vec::new() };
        host.packet(1, 24);
        host.bytes[2] = 3;
        host.put(3, &database.to_be_bytes());
        host.bytes[4] = 0x30 | mode;
        host.put(6, &0x8000_u16.to_be_bytes());
        host.put(8, &frame.to_be_bytes());
        host
    }

    /// Appends an empty packet; the fields that follow are put into it.
    pub fn packet(&mut self, id: u8, size: u8) {
        self.bytes.extend(vec![0; usize::from(size)]);
        let begin = self.bytes.len() - usize::from(size);
        (self.bytes[begin], self.bytes[begin + 1]) = (id, size);
    }

    /// Puts a field of the last packet, whose size the packet says itself.
    fn put_in(&mut self, size: usize, at: usize, field: &[u8]) -> &mut Self {
        let begin = self.bytes.len() - size + at;
        for (index, &byte) in field.iter().enumerate() {
            let place = if self.big { index } else { field.len() - 1 - index };
            self.bytes[begin + place] = byte;
        }
        self
    }

    fn put(&mut self, at: usize, field: &[u8]) {
        self.put_in(24, at, field);
    }

    /// Entity Control at a place: latitude, longitude, altitude; yaw, pitch, roll. `bits` are byte
    /// 4: state in 0 and 1, attached in 2, clamp in 5 and 6.
    pub fn entity(&mut self, (id, parent, bits): (u16, u16, u8), at: [f64; 3], ypr: [f32; 3]) {
        self.packet(2, 48);
        self.put_in(48, 2, &id.to_be_bytes()).put_in(48, 4, &[bits]);
        self.put_in(48, 10, &parent.to_be_bytes());
        let [yaw, pitch, roll] = ypr;
        for (index, angle) in [roll, pitch, yaw].into_iter().enumerate() {
            self.put_in(48, 12 + 4 * index, &angle.to_be_bytes());
        }
        for (index, number) in at.into_iter().enumerate() {
            self.put_in(48, 24 + 8 * index, &number.to_be_bytes());
        }
    }

    /// View Control of a view (group 0) or a group: offsets x, y, z, then roll, pitch, yaw; all
    /// that `mask` has bits for.
    pub fn view_control(&mut self, (view, group): (u16, u8), entity: u16, mask: u8, six: [f32; 6]) {
        self.packet(16, 32);
        self.put_in(32, 2, &view.to_be_bytes()).put_in(32, 4, &[group]).put_in(32, 5, &[mask]);
        self.put_in(32, 6, &entity.to_be_bytes());
        for (index, number) in six.into_iter().enumerate() {
            self.put_in(32, 8 + 4 * index, &number.to_be_bytes());
        }
    }

    /// View Definition: near, far, left, right, top, bottom; all that `mask` has bits for.
    pub fn view_definition(&mut self, (view, group): (u16, u8), mask: u8, six: [f32; 6]) {
        self.packet(21, 32);
        self.put_in(32, 2, &view.to_be_bytes()).put_in(32, 4, &[group]).put_in(32, 5, &[mask]);
        for (index, number) in six.into_iter().enumerate() {
            self.put_in(32, 8 + 4 * index, &number.to_be_bytes());
        }
    }

    /// Conformal Clamped Entity Control: yaw, latitude, longitude.
    pub fn clamped(&mut self, id: u16, yaw: f32, [lat, lon]: [f64; 2]) {
        self.packet(3, 24);
        self.put_in(24, 2, &id.to_be_bytes()).put_in(24, 4, &yaw.to_be_bytes());
        self.put_in(24, 8, &lat.to_be_bytes()).put_in(24, 16, &lon.to_be_bytes());
    }

    /// Earth Reference Model Definition.
    pub fn earth(&mut self, custom: bool, a_m: f64, f: f64) {
        self.packet(19, 24);
        self.put_in(24, 2, &[u8::from(custom)]);
        self.put_in(24, 8, &a_m.to_be_bytes()).put_in(24, 16, &f.to_be_bytes());
    }

    /// HAT/HOT Request: kind 0 HAT, 1 HOT, 2 extended; in an entity's axes if there is one.
    pub fn hat_hot(
        &mut self,
        (id, kind, period): (u16, u8, u8),
        entity: Option<u16>,
        at: [f64; 3],
    ) {
        self.packet(24, 32);
        let bits = kind | u8::from(entity.is_some()) << 2;
        self.put_in(32, 2, &id.to_be_bytes()).put_in(32, 4, &[bits]).put_in(32, 5, &[period]);
        self.put_in(32, 6, &entity.unwrap_or(0).to_be_bytes());
        for (index, number) in at.into_iter().enumerate() {
            self.put_in(32, 8 + 8 * index, &number.to_be_bytes());
        }
    }

    /// LOS Segment Request; each end on the body or in an entity's axes.
    pub fn segment(
        &mut self,
        (id, extended, period): (u16, bool, u8),
        (source, from): (Option<u16>, [f64; 3]),
        (destination, to): (Option<u16>, [f64; 3]),
    ) {
        self.packet(25, 64);
        let named = destination.is_some() && destination != source;
        let bits = u8::from(extended)
            | u8::from(source.is_some()) << 1
            | u8::from(destination.is_some()) << 2
            | u8::from(named) << 4;
        self.put_in(64, 2, &id.to_be_bytes()).put_in(64, 4, &[bits]);
        self.put_in(64, 6, &source.unwrap_or(0).to_be_bytes());
        for (index, number) in from.into_iter().chain(to).enumerate() {
            self.put_in(64, 8 + 8 * index, &number.to_be_bytes());
        }
        self.put_in(64, 60, &[period]).put_in(64, 62, &destination.unwrap_or(0).to_be_bytes());
    }

    /// LOS Vector Request: azimuth, elevation, least range, most range.
    pub fn vector(
        &mut self,
        (id, extended, period): (u16, bool, u8),
        (source, from): (Option<u16>, [f64; 3]),
        four: [f32; 4],
    ) {
        self.packet(26, 56);
        let bits = u8::from(extended) | u8::from(source.is_some()) << 1;
        self.put_in(56, 2, &id.to_be_bytes()).put_in(56, 4, &[bits]);
        self.put_in(56, 6, &source.unwrap_or(0).to_be_bytes());
        for (index, number) in four.into_iter().enumerate() {
            self.put_in(56, 8 + 4 * index, &number.to_be_bytes());
        }
        for (index, number) in from.into_iter().enumerate() {
            self.put_in(56, 24 + 8 * index, &number.to_be_bytes());
        }
        self.put_in(56, 52, &[period]);
    }
}

/// One packet from the server.
#[derive(Clone, Copy)]
pub struct Packet<'b> {
    pub bytes: &'b [u8],
    pub big: bool,
}

impl Packet<'_> {
    pub fn id(&self) -> u8 {
        self.bytes[0]
    }

    fn field<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field: [u8; N] = self.bytes[at..at + N].try_into().unwrap();
        if !self.big {
            field.reverse();
        }
        field
    }

    pub fn u8(&self, at: usize) -> u8 {
        self.bytes[at]
    }

    pub fn u16(&self, at: usize) -> u16 {
        u16::from_be_bytes(self.field(at))
    }

    pub fn u32(&self, at: usize) -> u32 {
        u32::from_be_bytes(self.field(at))
    }

    pub fn f32(&self, at: usize) -> f32 {
        f32::from_be_bytes(self.field(at))
    }

    pub fn f64(&self, at: usize) -> f64 {
        f64::from_be_bytes(self.field(at))
    }
}

/// The packets of a message from the server: Start Of Frame, then the others.
pub fn packets(message: &[u8]) -> Vec<Packet<'_>> {
    let big = match message[6..8] {
        [0x80, 0] => true,
        [0, 0x80] => false,
        _ => panic!("no byte-swap number: {:?}", &message[..8]),
    };
    assert_eq!(message[..3], [101, 24, 3], "a message begins with Start Of Frame");
    let (mut found, mut rest) = (Vec::new(), message);
    while !rest.is_empty() {
        let (bytes, after) = rest.split_at(usize::from(rest[1]));
        found.push(Packet { bytes, big });
        rest = after;
    }
    found
}

/// A number in [0, 1) that looks random.
pub fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

/// All of a planet of 1 km radius with a sea, at [`LEVEL`] and coarser.
pub fn small_ground() -> Ground {
    let scene = overfly_config::load("small").unwrap();
    let generator = Generator::new(&scene);
    let mut ground = Ground::new(scene.body, scene.sea);
    let all = Region { centre: Geodetic::from_degrees(0.0, 0.0, 0.0), radius_m: 3200.0 };
    for key in ground.pages_of(all, LEVEL, 10_000).unwrap() {
        ground.insert(generator.page(key));
    }
    ground
}

/// A geoid of tests: some metres high, and smooth.
pub fn sea_level_m(lat_rad: f64, lon_rad: f64) -> f64 {
    7.0 * sin(2.0 * lat_rad) + 3.0 * cos(lon_rad) - 1.0
}

/// A server with one view, whose scene has the number 5.
pub fn server() -> Server {
    let lens = Lens { field_of_view_rad: 1.0, yaw_rad: 0.0, pitch_rad: 0.0, near_m: 0.1 };
    Server::new(Setup { lenses: vec![lens], database: Some(5), message_bytes: 65_507 })
}

/// Asks `ground` at [`LEVEL`], over the geoid of tests.
pub fn with_world<R>(ground: &Ground, run: impl FnOnce(&World<'_>) -> R) -> R {
    let ask = |question: &Question| ask(ground, LEVEL, question).reply;
    run(&World { body: *ground.body(), sea_level_m: &sea_level_m, ask: &ask })
}

/// A body whose ground nobody knows.
pub fn without_ground<R>(run: impl FnOnce(&World<'_>) -> R) -> R {
    let body = Ellipsoid::WGS84;
    run(&World { body, sea_level_m: &sea_level_m, ask: &|_: &Question| Reply::Unknown })
}

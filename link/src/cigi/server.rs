//! The image generator's side of a session: what a host said, and what it is told.
//!
//! In:    datagrams; each frame what the ground says, and the time.
//! Out:   views; a message with Start Of Frame and the responses that are due.
//! Keeps: mode, frame numbers, the database's state, entities, views, requests, counts.
//! Not here: sockets, clocks, the ground.
//! Source: CIGI ICD 3.3, 2.1, 4.1.1 and 4.2.1; see [`crate::cigi`].

use super::MESSAGE_BYTES;
use super::count::{Counters, Held};
use super::decode::Message;
use super::encode::{self, Head, Heights, Line, LinePoint, StartOfFrame};
use super::entities::{Entities, Refused};
use super::packet::*;
use super::pose::{azimuth_elevation_deg, direction, ned};
use super::question::{MATERIAL_GROUND, MATERIAL_WATER, Met, Question, Reply, World};
use super::requests::{Request, Requests};
use super::views::{Lens, Views};
use crate::fgfs::NativeFdm;
use crate::wire::ByteOrder;
use glam::DVec3;
use overfly_core::camera::View;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};

/// What the database number is when a host asks for one that is not there.
const NO_DATABASE: i8 = -128;
/// Ellipsoids closer than this are the same: 1 mm, and what that is to the Earth.
const SAME_M: f64 = 1e-3;
const SAME_FLATTENING: f64 = 1.6e-10;

/// What a server begins with.
#[derive(Clone, PartialEq, Debug)]
pub struct Setup {
    /// The views that there are before the host defines any; at least one.
    pub lenses: Vec<Lens>,
    /// The number of the scene, 1 to 127; `None` says that the host need not load anything.
    pub database: Option<i8>,
    /// Most bytes of a message to the host, within [`MESSAGE_BYTES`].
    pub message_bytes: usize,
}

/// What a frame is besides what the host said.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameFacts {
    /// Time in ticks of 10 µs, from any origin, modulo 2³².
    pub ticks: u32,
    /// Nothing that the scene needs is still on its way.
    pub settled: bool,
}

/// What the host knows of the database.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Database {
    /// It need not know of one.
    Global,
    Loaded,
    /// It asked for it; whether it has been told that it comes.
    Loading {
        told: bool,
    },
    /// It asked for another; whether it has been told that there is none.
    Missing {
        told: bool,
    },
}

/// One session.
pub struct Server {
    setup: Setup,
    order: ByteOrder,
    mode: Mode,
    host_frame: u32,
    /// Frames so far.
    frame: u64,
    database: Database,
    /// The database number of the last IG Control.
    asked_database: i8,
    custom_earth: bool,
    /// The host's earth model, until the body is at hand to be compared.
    earth: Option<Option<Ellipsoid>>,
    entities: Entities,
    views: Views,
    requests: Requests,
    counters: Counters,
}

impl Server {
    /// In Reset/Standby, and nobody has said anything.
    pub fn new(mut setup: Setup) -> Self {
        let [least, most] = MESSAGE_BYTES;
        setup.message_bytes = setup.message_bytes.clamp(least, most);
        let database = setup.database.map_or(Database::Global, |_| Database::Loaded);
        Self {
            views: Views::new(setup.lenses.clone()),
            setup,
            order: ByteOrder::default(),
            mode: Mode::Standby,
            host_frame: 0,
            frame: 0,
            database,
            asked_database: 0,
            custom_earth: false,
            earth: None,
            entities: Entities::default(),
            requests: Requests::default(),
            counters: Counters::default(),
        }
    }

    /// What happened so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How much is held.
    pub fn held(&self) -> Held {
        Held {
            entities: self.entities.len(),
            views: self.views.len(),
            groups: self.views.groups(),
            standing: self.requests.standing(),
            once: self.requests.once(),
        }
    }

    /// What the host wants.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Takes a datagram in. True where it is a message, whatever its packets are.
    pub fn receive(&mut self, datagram: &[u8]) -> bool {
        self.counters.datagrams += 1;
        let message = match Message::open(datagram) {
            Ok(message) => message,
            Err(fault) => {
                self.counters.fault(fault);
                return false;
            }
        };
        self.counters.messages += 1;
        self.order = message.order;
        self.control(&message.control);
        for packet in message {
            match packet {
                Err(fault) => self.counters.fault(fault),
                Ok(_) if self.mode == Mode::Standby => self.counters.standby += 1,
                Ok(packet) => self.apply(&packet),
            }
        }
        true
    }

    /// Lets another program fly the ownship, entity 0, whatever the mode.
    pub fn drive(&mut self, ownship: &NativeFdm) {
        let NativeFdm { lat_rad, lon_rad, altitude_m, .. } = *ownship;
        let attitude = Attitude {
            yaw_rad: ownship.heading_rad,
            pitch_rad: ownship.pitch_rad,
            roll_rad: ownship.roll_rad,
        };
        let placed = Placed::Top(MslPlace { lat_rad, lon_rad, altitude_m });
        let (state, clamp) = (EntityState::Active, Clamp::None);
        let control = EntityControl { entity: 0, state, clamp, placed, attitude };
        self.apply(&HostPacket::Entity(control));
    }

    /// The views of this frame, by number; none while their entities are not there.
    pub fn views(&self, world: &World<'_>, size_px: [u32; 2], out: &mut Vec<View>) {
        self.views.list(&self.entities, world, size_px, out);
    }

    /// One frame: replaces `out` by the message to the host. Responses that do not fit wait for
    /// the next, the longest waiting first.
    pub fn frame(&mut self, world: &World<'_>, facts: FrameFacts, out: &mut Vec<u8>) {
        self.compare_earth(&world.body);
        out.clear();
        #[expect(clippy::cast_possible_truncation, reason = "frames are numbered modulo 2^32")]
        let ig_frame = self.frame as u32;
        let sof = StartOfFrame {
            database: self.database_number(facts.settled),
            mode: self.mode as u8,
            host_earth_model: self.custom_earth,
            ig_frame,
            timestamp_ticks: facts.ticks,
            last_host_frame: self.host_frame,
        };
        encode::start_of_frame(out, self.order, &sof);
        let answer = Answer { world, entities: &self.entities, order: self.order };
        let (host_frame, message_bytes) = (self.host_frame, self.setup.message_bytes);
        let counters = &mut self.counters;
        let waiting = self.requests.serve(self.frame, |request| {
            let fits = out.len() + request.response_bytes() <= message_bytes;
            if fits {
                counters.responses += 1;
                counters.invalid += u64::from(!answer.write(request, host_frame, out));
            }
            fits
        });
        counters.delayed += waiting as u64;
        counters.frames += 1;
        self.frame += 1;
    }

    fn control(&mut self, control: &IgControl) {
        self.host_frame = control.host_frame;
        if control.mode == Mode::Standby && self.mode != Mode::Standby {
            self.entities.clear();
            self.views.reset();
            self.requests.clear();
            self.custom_earth = false;
            self.earth = None;
        }
        self.mode = control.mode;
        self.asked_database = if self.mode == Mode::Standby { 0 } else { control.database };
        if self.database == Database::Global || self.asked_database == 0 {
            return;
        }
        let here = self.setup.database == Some(self.asked_database);
        self.database = match (here, self.database) {
            (true, Database::Loading { told }) => Database::Loading { told },
            (true, _) => Database::Loading { told: false },
            (false, Database::Missing { told }) => Database::Missing { told },
            (false, _) => Database::Missing { told: false },
        };
    }

    /// What Start Of Frame says of the database. The host hears of every step at least once, and
    /// acknowledges it by a 0.
    fn database_number(&mut self, settled: bool) -> i8 {
        let number = self.setup.database.unwrap_or(0);
        let heard = self.asked_database == 0;
        match self.database {
            Database::Global => 0,
            Database::Loaded => number,
            Database::Loading { told: true } if heard && settled => {
                self.database = Database::Loaded;
                number
            }
            Database::Loading { .. } => {
                self.database = Database::Loading { told: true };
                -number
            }
            Database::Missing { told: true } if heard => {
                self.database = Database::Loaded;
                number
            }
            Database::Missing { .. } => {
                self.database = Database::Missing { told: true };
                NO_DATABASE
            }
        }
    }

    fn compare_earth(&mut self, body: &Ellipsoid) {
        let Some(custom) = self.earth.take() else { return };
        let near = |custom: Ellipsoid| {
            let flattening = (custom.f - body.f).abs() <= SAME_FLATTENING;
            (custom.a_m - body.a_m).abs() <= SAME_M && flattening
        };
        self.custom_earth = custom.is_some_and(near);
        self.counters.earth_models += u64::from(custom.is_some() && !self.custom_earth);
    }

    fn apply(&mut self, packet: &HostPacket) {
        self.counters.packets += 1;
        let done = match packet {
            HostPacket::Entity(control) if control.state == EntityState::Destroyed => {
                self.destroy(control.entity);
                Ok(())
            }
            HostPacket::Entity(control) => self.entities.control(control),
            HostPacket::Clamped(moved) => self.entities.clamped(moved),
            HostPacket::ViewControl(control) => return self.note_view(|v| v.control(control)),
            HostPacket::ViewDefinition(definition) => {
                return self.note_view(|views| views.define(definition));
            }
            HostPacket::EarthModel(model) => {
                self.earth = Some(model.custom);
                Ok(())
            }
            HostPacket::HatHot(request) => return self.add(Request::HatHot(*request)),
            HostPacket::Segment(request) => return self.add(Request::Segment(*request)),
            HostPacket::Vector(request) => return self.add(Request::Vector(*request)),
        };
        match done {
            Ok(()) => {}
            Err(Refused::Missing) => self.counters.no_entity += 1,
            Err(Refused::Full) => self.counters.entities_full += 1,
        }
    }

    fn note_view(&mut self, change: impl FnOnce(&mut Views) -> Result<(), Refused>) {
        self.counters.views_full += u64::from(change(&mut self.views).is_err());
    }

    fn add(&mut self, request: Request) {
        self.counters.requests_full += u64::from(!self.requests.add(request, self.frame));
    }

    fn destroy(&mut self, id: u16) {
        self.entities.destroy(id);
        let entities = &self.entities;
        self.requests.end_of(&|entity| !entities.contains(entity));
    }
}

/// What answering needs.
struct Answer<'a> {
    world: &'a World<'a>,
    entities: &'a Entities,
    order: ByteOrder,
}

impl Answer<'_> {
    /// Writes a response; false where its Valid is 0.
    fn write(&self, request: &Request, host_frame: u32, out: &mut Vec<u8>) -> bool {
        let (id, extended, line) = match request {
            Request::HatHot(request) => return self.heights(request, host_frame, out),
            Request::Segment(request) => (request.id, request.extended, self.segment(request)),
            Request::Vector(request) => (request.id, request.extended, self.vector(request)),
        };
        let (line, head) = (line.unwrap_or_default(), Head { id, host_frame });
        let write = if extended { encode::line_extended } else { encode::line };
        write(out, self.order, head, &line);
        line.valid
    }

    /// A point above the ellipsoid; empty where its entity is nowhere.
    fn place(&self, spot: &Spot) -> Option<Geodetic> {
        match *spot {
            Spot::Geodetic(place) => Some(self.world.geodetic(place)),
            Spot::Body { .. } => Some(self.world.body.geodetic_from_ecef(self.point(spot)?)),
        }
    }

    fn point(&self, spot: &Spot) -> Option<Ecef> {
        match *spot {
            Spot::Geodetic(place) => {
                Some(self.world.body.ecef_from_geodetic(self.world.geodetic(place)))
            }
            Spot::Body { entity, offset_m } => {
                let pose = self.entities.pose(entity, self.world);
                pose.filter(|pose| pose.certain).map(|pose| pose.point(offset_m))
            }
        }
    }

    fn heights(&self, request: &HatHot, host_frame: u32, out: &mut Vec<u8>) -> bool {
        let found = self.place(&request.at).and_then(|at| {
            let surface = self.world.surface(at)?;
            Some(Heights {
                above_terrain_m: at.height_m - surface.height_m,
                of_terrain_m: self.world.altitude_m(at, surface.height_m),
                material: material(surface.water),
                normal_deg: azimuth_elevation_deg(at, surface.normal),
            })
        });
        let head = Head { id: request.id, host_frame };
        let above = found.map(|found| found.above_terrain_m);
        let of = found.map(|found| found.of_terrain_m);
        match request.kind {
            HatHotKind::AboveTerrain => encode::hat_hot(out, self.order, head, (false, above)),
            HatHotKind::OfTerrain => encode::hat_hot(out, self.order, head, (true, of)),
            HatHotKind::Extended => encode::hat_hot_extended(out, self.order, head, found),
        }
        found.is_some()
    }

    fn segment(&self, request: &Segment) -> Option<Line> {
        let (from, to) = (self.point(&request.from)?, self.point(&request.to)?);
        let line = match (self.world.ask)(&Question::Segment { from, to }) {
            Reply::Unknown | Reply::Height(_) => Line::default(),
            Reply::Met(met) => self.met(&met, false),
            Reply::Clear => Line {
                visible: true,
                range_m: if request.extended { (to.0 - from.0).length() } else { 0.0 },
                point: Some(self.line_point(to, None)),
                ..Line::default()
            },
        };
        Some(line)
    }

    fn vector(&self, request: &Vector) -> Option<Line> {
        let from = self.point(&request.from)?;
        let axes = match request.from {
            Spot::Geodetic(_) => ned(self.place(&request.from)?),
            Spot::Body { entity, .. } => self.entities.pose(entity, self.world)?.axes,
        };
        let direction = axes * direction(request.azimuth_rad, request.elevation_rad);
        let ray = Question::Ray { from, direction, max_m: request.max_m };
        match (self.world.ask)(&ray) {
            // What is met before the least range hides whatever lies behind it.
            Reply::Met(met) if met.distance_m >= request.min_m => Some(self.met(&met, true)),
            _ => None,
        }
    }

    fn met(&self, met: &Met, range_valid: bool) -> Line {
        let mut point = self.line_point(met.point, Some((met.normal, met.water)));
        point.range_valid = range_valid;
        Line { valid: true, visible: false, range_m: met.distance_m, point: Some(point) }
    }

    fn line_point(&self, point: Ecef, surface: Option<(DVec3, bool)>) -> LinePoint {
        let at = self.world.body.geodetic_from_ecef(point);
        let degree = 180.0 / core::f64::consts::PI;
        LinePoint {
            range_valid: false,
            lat_deg: at.lat_rad * degree,
            lon_deg: at.lon_rad * degree,
            altitude_m: self.world.altitude_m(at, at.height_m),
            material: surface.map_or(0, |(_, water)| material(water)),
            normal_deg: surface.map_or([0.0; 2], |(normal, _)| azimuth_elevation_deg(at, normal)),
        }
    }
}

fn material(water: bool) -> u32 {
    if water { MATERIAL_WATER } else { MATERIAL_GROUND }
}

//! What hosts say, packet by packet, in radians and metres.
//!
//! In:    nothing; these are the types.
//! Out:   [`HostPacket`].
//! Keeps: nothing.
//! Not here: where the fields lie (`decode`), what is done with them (`server`).

use glam::DVec3;
use overfly_core::geodesy::Ellipsoid;

/// One packet that this side acts upon.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum HostPacket {
    /// Entity Control, 2.
    Entity(EntityControl),
    /// Conformal Clamped Entity Control, 3.
    Clamped(ClampedEntity),
    /// View Control, 16.
    ViewControl(ViewControl),
    /// Earth Reference Model Definition, 19.
    EarthModel(EarthModel),
    /// View Definition, 21.
    ViewDefinition(ViewDefinition),
    /// HAT/HOT Request, 24.
    HatHot(HatHot),
    /// Line of Sight Segment Request, 25.
    Segment(Segment),
    /// Line of Sight Vector Request, 26.
    Vector(Vector),
}

/// What the image generator is to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Mode {
    /// Reset/Standby: forgets everything and listens to IG Control alone.
    #[default]
    Standby = 0,
    /// Operate.
    Operate = 1,
    /// Debug: as Operate here.
    Debug = 2,
}

/// IG Control, 1: the first packet of every message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct IgControl {
    /// The database to load; 0 is none.
    pub database: i8,
    /// What to do.
    pub mode: Mode,
    /// The host's number of this frame.
    pub host_frame: u32,
    /// Ticks of 10 µs, if the host says so.
    pub timestamp_ticks: Option<u32>,
    /// The last frame that the host had from here.
    pub last_ig_frame: u32,
}

/// A place with its altitude above sea level.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MslPlace {
    /// Geodetic latitude in radians.
    pub lat_rad: f64,
    /// Longitude in radians, east positive.
    pub lon_rad: f64,
    /// Metres above sea level.
    pub altitude_m: f64,
}

/// A point of a request.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Spot {
    /// On the body.
    Geodetic(MslPlace),
    /// In an entity's axes: x forward, y right, z down.
    Body {
        /// Which entity.
        entity: u16,
        /// From its reference point, in metres.
        offset_m: DVec3,
    },
}

/// Turns about z, then y, then x, in radians: heading, nose up, right wing down.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Attitude {
    /// About z, down: clockwise from above.
    pub yaw_rad: f64,
    /// About y, right.
    pub pitch_rad: f64,
    /// About x, forward.
    pub roll_rad: f64,
}

/// What becomes of an entity.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EntityState {
    /// It is there, and nothing is drawn of it.
    Standby,
    /// It is there.
    Active,
    /// It goes, and its children with it.
    Destroyed,
}

/// How an entity keeps to the ground or the water.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Clamp {
    /// Not at all.
    None,
    /// Its altitude counts from the surface.
    Altitude,
    /// And its attitude from the slope.
    Conformal,
}

/// Where an entity is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Placed {
    /// On the body; the altitude is an offset from the surface where it is clamped.
    Top(MslPlace),
    /// Attached to another.
    Child {
        /// To which.
        parent: u16,
        /// In its axes, in metres.
        offset_m: DVec3,
    },
}

/// Entity Control, 2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EntityControl {
    /// Which; 0 is the ownship.
    pub entity: u16,
    /// What becomes of it.
    pub state: EntityState,
    /// How it keeps to the ground; `None` for children.
    pub clamp: Clamp,
    /// Where it is.
    pub placed: Placed,
    /// How it lies.
    pub attitude: Attitude,
}

/// Conformal Clamped Entity Control, 3: moves an entity and leaves the rest of it as it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClampedEntity {
    /// Which.
    pub entity: u16,
    /// Heading in radians.
    pub yaw_rad: f64,
    /// Geodetic latitude in radians.
    pub lat_rad: f64,
    /// Longitude in radians.
    pub lon_rad: f64,
}

/// What a View Control is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ViewTarget {
    /// One view.
    View(u16),
    /// All views of a group, 1 to 255.
    Group(u8),
}

/// View Control, 16. What is empty stays as it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ViewControl {
    /// Which view or group.
    pub target: ViewTarget,
    /// The entity that it rides on.
    pub entity: u16,
    /// Along the entity's x, y and z, in metres.
    pub offset_m: [Option<f64>; 3],
    /// Roll, pitch and yaw in radians.
    pub turn_rad: [Option<f64>; 3],
}

/// View Definition, 21. What is empty stays as it was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ViewDefinition {
    /// Which view.
    pub view: u16,
    /// Its group; 0 is none.
    pub group: u8,
    /// Nothing nearer is drawn, in metres.
    pub near_m: Option<f64>,
    /// Half-angles to the left, right, top and bottom in radians.
    pub half_rad: [Option<f64>; 4],
}

/// Earth Reference Model Definition, 19.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EarthModel {
    /// The host's own ellipsoid; empty where it wants WGS 84.
    pub custom: Option<Ellipsoid>,
}

/// Which height is asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum HatHotKind {
    /// Height of the point above the terrain.
    AboveTerrain,
    /// Height of the terrain above sea level.
    OfTerrain,
    /// Both, the material and the normal.
    Extended,
}

/// HAT/HOT Request, 24.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HatHot {
    /// The host's name for it.
    pub id: u16,
    /// Which height.
    pub kind: HatHotKind,
    /// Where.
    pub at: Spot,
    /// Answered every so many frames; 0 is once.
    pub period: u8,
}

/// Line of Sight Segment Request, 25.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment {
    /// The host's name for it.
    pub id: u16,
    /// Asks for the extended response.
    pub extended: bool,
    /// From here.
    pub from: Spot,
    /// To there.
    pub to: Spot,
    /// Answered every so many frames; 0 is once.
    pub period: u8,
}

/// Line of Sight Vector Request, 26.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Vector {
    /// The host's name for it.
    pub id: u16,
    /// Asks for the extended response.
    pub extended: bool,
    /// From here.
    pub from: Spot,
    /// Clockwise from north, or from the entity's x, in radians.
    pub azimuth_rad: f64,
    /// Above the horizontal, or above the entity's x-y plane, in radians.
    pub elevation_rad: f64,
    /// What is met nearer does not count, in metres.
    pub min_m: f64,
    /// What is met farther does not count, in metres.
    pub max_m: f64,
    /// Answered every so many frames; 0 is once.
    pub period: u8,
}

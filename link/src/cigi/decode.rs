//! From bytes to packets: byte order, sizes, ranges.
//!
//! In:    a datagram.
//! Out:   [`Message`]: its IG Control, and its other packets one by one, or why one is none.
//! Keeps: nothing.
//! Not here: what is done with them (`server`).
//! Source: CIGI ICD 3.3, 4.1; see [`crate::cigi`].
//!
//! A message is packets end to end, each with its identifier and its size in bytes first. The
//! first is IG Control, whose bytes 6 and 7 hold 8000h in the sender's order. A packet that this
//! side does not know is passed over by its size.

use super::packet::*;
use crate::wire::{ByteOrder, Fields};
use glam::DVec3;
use overfly_core::geodesy::Ellipsoid;

const CONTROL: u8 = 1;
/// Identifiers that CIGI 3.3 gives to hosts.
const DEFINED: core::ops::RangeInclusive<u8> = 1..=35;
/// No packet is shorter: sizes are multiples of 8 bytes.
const LEAST_BYTES: usize = 8;
/// Farther off nothing is, in metres.
const FAR_M: f64 = 1e9;
const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// Why a datagram or a packet was dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// The datagram cannot hold an IG Control.
    Short,
    /// Its first packet is not IG Control.
    First,
    /// It is not of CIGI 3.2 or 3.3.
    Version,
    /// Its byte-swap number is not 8000h in either order.
    Magic,
    /// A packet has not the size of its kind; it is passed over by the size that it says.
    Size,
    /// A packet is said to be longer than what is left, or shorter than any; the rest is dropped.
    Truncated,
    /// A number that is used is NaN or infinite.
    NotFinite,
    /// A number that is used is out of its range.
    OutOfRange,
    /// A second IG Control.
    Repeated,
    /// A packet of CIGI that is not served here.
    Ignored,
    /// A packet that CIGI does not define for hosts.
    Unknown,
}

/// A datagram whose IG Control is sound.
#[derive(Clone, Copy)]
pub struct Message<'b> {
    /// Its first packet.
    pub control: IgControl,
    /// The host's byte order.
    pub order: ByteOrder,
    /// The packets after the first.
    rest: &'b [u8],
}

impl<'b> Message<'b> {
    /// Looks at a datagram.
    ///
    /// # Errors
    /// It does not begin with an IG Control of this version.
    pub fn open(datagram: &'b [u8]) -> Result<Self, Fault> {
        if datagram.len() < 24 {
            return Err(Fault::Short);
        }
        if datagram[0] != CONTROL {
            return Err(Fault::First);
        }
        if datagram[2] != 3 || !matches!(datagram[4] >> 4, 2 | 3) {
            return Err(Fault::Version);
        }
        if datagram[1] != 24 {
            return Err(Fault::Size);
        }
        let order = match datagram[6..8] {
            [0x80, 0] => ByteOrder::Big,
            [0, 0x80] => ByteOrder::Little,
            _ => return Err(Fault::Magic),
        };
        let fields = Fields::new(&datagram[..24], order);
        let bits = fields.u8(4);
        let mode = match bits & 3 {
            0 => Mode::Standby,
            1 => Mode::Operate,
            2 => Mode::Debug,
            _ => return Err(Fault::OutOfRange),
        };
        let control = IgControl {
            database: fields.i8(3),
            mode,
            host_frame: fields.u32(8),
            timestamp_ticks: (bits & 4 != 0).then(|| fields.u32(12)),
            last_ig_frame: fields.u32(16),
        };
        Ok(Self { control, order, rest: &datagram[24..] })
    }
}

impl Iterator for Message<'_> {
    type Item = Result<HostPacket, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let size = self.rest.get(1).map_or(0, |&size| usize::from(size));
        if size < LEAST_BYTES || size > self.rest.len() {
            self.rest = &[];
            return Some(Err(Fault::Truncated));
        }
        let (bytes, rest) = self.rest.split_at(size);
        self.rest = rest;
        Some(read(bytes, self.order))
    }
}

/// Reads the fields of one kind of packet, whose size was checked.
type Read = fn(&Fields<'_>) -> Result<HostPacket, Fault>;

/// One packet; its bytes are as many as it says.
fn read(bytes: &[u8], order: ByteOrder) -> Result<HostPacket, Fault> {
    let fields = Fields::new(bytes, order);
    let (wanted, read): (usize, Read) = match bytes[0] {
        CONTROL => return Err(Fault::Repeated),
        2 => (48, entity_control),
        3 => (24, clamped_entity),
        16 => (32, view_control),
        19 => (24, earth_model),
        21 => (32, view_definition),
        24 => (32, hat_hot),
        25 => (64, segment),
        26 => (56, vector),
        id if DEFINED.contains(&id) => return Err(Fault::Ignored),
        _ => return Err(Fault::Unknown),
    };
    if bytes.len() == wanted { read(&fields) } else { Err(Fault::Size) }
}

fn within(found: f64, [least, most]: [f64; 2]) -> Result<f64, Fault> {
    match found {
        found if !found.is_finite() => Err(Fault::NotFinite),
        found if found < least || found > most => Err(Fault::OutOfRange),
        found => Ok(found),
    }
}

/// An angle in degrees, as radians. Whoever counts beyond a full turn may.
fn angle(found: f32, most_deg: f64) -> Result<f64, Fault> {
    Ok(within(f64::from(found), [-most_deg, most_deg])? * DEGREE)
}

fn latitude(found: f64) -> Result<f64, Fault> {
    Ok(within(found, [-90.0, 90.0])? * DEGREE)
}

fn longitude(found: f64) -> Result<f64, Fault> {
    Ok(within(found, [-360.0, 360.0])? * DEGREE)
}

fn distance(found: f64) -> Result<f64, Fault> {
    within(found, [-FAR_M, FAR_M])
}

fn place(fields: &Fields<'_>, at: usize) -> Result<MslPlace, Fault> {
    Ok(MslPlace {
        lat_rad: latitude(fields.f64(at))?,
        lon_rad: longitude(fields.f64(at + 8))?,
        altitude_m: distance(fields.f64(at + 16))?,
    })
}

fn offset(fields: &Fields<'_>, at: usize) -> Result<DVec3, Fault> {
    let along = |axis: usize| distance(fields.f64(at + 8 * axis));
    Ok(DVec3::new(along(0)?, along(1)?, along(2)?))
}

/// Three doubles: a place, or an offset from an entity.
fn spot(fields: &Fields<'_>, at: usize, entity: Option<u16>) -> Result<Spot, Fault> {
    match entity {
        None => place(fields, at).map(Spot::Geodetic),
        Some(entity) => Ok(Spot::Body { entity, offset_m: offset(fields, at)? }),
    }
}

/// Roll, pitch and yaw in three floats.
fn attitude(fields: &Fields<'_>, at: usize) -> Result<Attitude, Fault> {
    Ok(Attitude {
        roll_rad: angle(fields.f32(at), 720.0)?,
        pitch_rad: angle(fields.f32(at + 4), 720.0)?,
        yaw_rad: angle(fields.f32(at + 8), 720.0)?,
    })
}

fn entity_control(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(4);
    let state = match bits & 3 {
        0 => EntityState::Standby,
        1 => EntityState::Active,
        2 => EntityState::Destroyed,
        _ => return Err(Fault::OutOfRange),
    };
    let attached = bits & 4 != 0;
    let clamp = match bits >> 5 & 3 {
        _ if attached => Clamp::None,
        0 => Clamp::None,
        1 => Clamp::Altitude,
        2 => Clamp::Conformal,
        _ => return Err(Fault::OutOfRange),
    };
    let entity = fields.u16(2);
    if state == EntityState::Destroyed {
        // Of one that goes no other number counts.
        let nowhere = MslPlace { lat_rad: 0.0, lon_rad: 0.0, altitude_m: 0.0 };
        let (placed, attitude) = (Placed::Top(nowhere), Attitude::default());
        let gone = EntityControl { entity, state, clamp: Clamp::None, placed, attitude };
        return Ok(HostPacket::Entity(gone));
    }
    let placed = if attached {
        Placed::Child { parent: fields.u16(10), offset_m: offset(fields, 24)? }
    } else {
        Placed::Top(place(fields, 24)?)
    };
    let attitude = attitude(fields, 12)?;
    Ok(HostPacket::Entity(EntityControl { entity, state, clamp, placed, attitude }))
}

fn clamped_entity(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    Ok(HostPacket::Clamped(ClampedEntity {
        entity: fields.u16(2),
        yaw_rad: angle(fields.f32(4), 720.0)?,
        lat_rad: latitude(fields.f64(8))?,
        lon_rad: longitude(fields.f64(16))?,
    }))
}

fn view_control(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(5);
    let target = match fields.u8(4) {
        0 => ViewTarget::View(fields.u16(2)),
        group => ViewTarget::Group(group),
    };
    let given = |bit: usize| (bits >> bit & 1 != 0).then(|| fields.f32(8 + 4 * bit));
    let mut offset_m = [None; 3];
    let mut turn_rad = [None; 3];
    for axis in 0..3 {
        offset_m[axis] = given(axis).map(f64::from).map(distance).transpose()?;
        turn_rad[axis] = given(3 + axis).map(|found| angle(found, 720.0)).transpose()?;
    }
    let entity = fields.u16(6);
    Ok(HostPacket::ViewControl(ViewControl { target, entity, offset_m, turn_rad }))
}

fn earth_model(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let custom = if fields.u8(2) & 1 == 0 {
        None
    } else {
        let a_m = within(fields.f64(8), [1.0, FAR_M])?;
        Some(Ellipsoid { a_m, f: within(fields.f64(16), [-0.5, 0.5])? })
    };
    Ok(HostPacket::EarthModel(EarthModel { custom }))
}

fn view_definition(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(5);
    let given = |bit: usize| (bits >> bit & 1 != 0).then(|| fields.f32(8 + 4 * bit));
    let near = given(0).map(|found| within(f64::from(found), [1e-3, 1e6]));
    let mut half_rad = [None; 4];
    for (side, half) in half_rad.iter_mut().enumerate() {
        *half = given(2 + side).map(|found| angle(found, 89.5)).transpose()?;
    }
    Ok(HostPacket::ViewDefinition(ViewDefinition {
        view: fields.u16(2),
        group: fields.u8(4),
        near_m: near.transpose()?,
        half_rad,
    }))
}

fn hat_hot(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(4);
    let kind = match bits & 3 {
        0 => HatHotKind::AboveTerrain,
        1 => HatHotKind::OfTerrain,
        2 => HatHotKind::Extended,
        _ => return Err(Fault::OutOfRange),
    };
    let entity = (bits & 4 != 0).then(|| fields.u16(6));
    let at = if kind == HatHotKind::OfTerrain && entity.is_none() {
        // The altitude counts for nothing then, and may be anything.
        let (lat_rad, lon_rad) = (latitude(fields.f64(8))?, longitude(fields.f64(16))?);
        Spot::Geodetic(MslPlace { lat_rad, lon_rad, altitude_m: 0.0 })
    } else {
        spot(fields, 8, entity)?
    };
    Ok(HostPacket::HatHot(HatHot { id: fields.u16(2), kind, at, period: fields.u8(5) }))
}

fn segment(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(4);
    let source = fields.u16(6);
    let destination = if bits & 16 != 0 { fields.u16(62) } else { source };
    Ok(HostPacket::Segment(Segment {
        id: fields.u16(2),
        extended: bits & 1 != 0,
        from: spot(fields, 8, (bits & 2 != 0).then_some(source))?,
        to: spot(fields, 32, (bits & 4 != 0).then_some(destination))?,
        period: fields.u8(60),
    }))
}

fn vector(fields: &Fields<'_>) -> Result<HostPacket, Fault> {
    let bits = fields.u8(4);
    let entity = (bits & 2 != 0).then(|| fields.u16(6));
    let range = |at| within(f64::from(fields.f32(at)), [0.0, f64::MAX]);
    Ok(HostPacket::Vector(Vector {
        id: fields.u16(2),
        extended: bits & 1 != 0,
        from: spot(fields, 24, entity)?,
        azimuth_rad: angle(fields.f32(8), 720.0)?,
        elevation_rad: angle(fields.f32(12), 90.0)?,
        min_m: range(16)?,
        max_m: range(20)?,
        period: fields.u8(52),
    }))
}

//! From answers to bytes: Start Of Frame and the responses.
//!
//! In:    numbers in degrees and metres, as the packets have them.
//! Out:   packets at the end of a buffer.
//! Keeps: nothing.
//! Not here: where the numbers come from (`server`).
//! Source: CIGI ICD 3.3, 4.2.1 to 4.2.5; see [`crate::cigi`].

use crate::wire::{ByteOrder, Draft};
use overfly_core::geodesy::narrow;

/// Bytes of the packets, and their identifiers.
pub const START_OF_FRAME: [u8; 2] = [101, 24];
pub const HAT_HOT: [u8; 2] = [102, 16];
pub const HAT_HOT_EXTENDED: [u8; 2] = [103, 40];
pub const LINE: [u8; 2] = [104, 16];
pub const LINE_EXTENDED: [u8; 2] = [105, 56];

/// Start Of Frame, 101.
pub struct StartOfFrame {
    pub database: i8,
    /// 0 Reset/Standby, 1 Operate, 2 Debug.
    pub mode: u8,
    pub host_earth_model: bool,
    pub ig_frame: u32,
    pub timestamp_ticks: u32,
    pub last_host_frame: u32,
}

pub fn start_of_frame(out: &mut Vec<u8>, order: ByteOrder, sof: &StartOfFrame) {
    let mut packet = Draft::new(out, order, START_OF_FRAME);
    packet.u8(2, 3);
    packet.i8(3, sof.database);
    // Byte 4, the status code, stays 0: normal operation. The timestamp is valid.
    let minor = 3 << 4;
    packet.u8(5, minor | u8::from(sof.host_earth_model) << 3 | 1 << 2 | sof.mode);
    packet.u16(6, 0x8000);
    packet.u32(8, sof.ig_frame);
    packet.u32(12, sof.timestamp_ticks);
    packet.u32(16, sof.last_host_frame);
}

/// What every response begins with.
#[derive(Clone, Copy)]
pub struct Head {
    pub id: u16,
    /// The last host frame; its least significant four bits are sent.
    pub host_frame: u32,
}

impl Head {
    /// The stamp in the upper half of a byte of flags.
    fn stamped(self, flags: u8) -> u8 {
        let [least, ..] = self.host_frame.to_le_bytes();
        least << 4 | flags
    }
}

/// HAT/HOT Response, 102: height above terrain, or of it; empty where nobody knows.
pub fn hat_hot(
    out: &mut Vec<u8>,
    order: ByteOrder,
    head: Head,
    (of_terrain, height_m): (bool, Option<f64>),
) {
    let mut packet = Draft::new(out, order, HAT_HOT);
    packet.u16(2, head.id);
    packet.u8(4, head.stamped(u8::from(height_m.is_some()) | u8::from(of_terrain) << 1));
    packet.f64(8, height_m.unwrap_or(0.0));
}

/// What HAT/HOT Extended Response says.
#[derive(Clone, Copy)]
pub struct Heights {
    pub above_terrain_m: f64,
    pub of_terrain_m: f64,
    pub material: u32,
    /// Azimuth and elevation in degrees.
    pub normal_deg: [f64; 2],
}

/// HAT/HOT Extended Response, 103.
pub fn hat_hot_extended(out: &mut Vec<u8>, order: ByteOrder, head: Head, heights: Option<Heights>) {
    let mut packet = Draft::new(out, order, HAT_HOT_EXTENDED);
    packet.u16(2, head.id);
    packet.u8(4, head.stamped(u8::from(heights.is_some())));
    let Some(heights) = heights else { return };
    packet.f64(8, heights.above_terrain_m);
    packet.f64(16, heights.of_terrain_m);
    packet.u32(24, heights.material);
    packet.f32(28, narrow(heights.normal_deg[0]));
    packet.f32(32, narrow(heights.normal_deg[1]));
}

/// What both line of sight responses say.
#[derive(Clone, Copy, Default)]
pub struct Line {
    /// Something is met where it counts.
    pub valid: bool,
    /// A segment's far end is seen.
    pub visible: bool,
    pub range_m: f64,
    /// The extended response's own; empty where there is no point.
    pub point: Option<LinePoint>,
}

/// The point of Line of Sight Extended Response.
#[derive(Clone, Copy)]
pub struct LinePoint {
    /// The range answers a vector, for segments it is not marked as valid.
    pub range_valid: bool,
    pub lat_deg: f64,
    pub lon_deg: f64,
    /// Above sea level.
    pub altitude_m: f64,
    /// 0 where nothing is met.
    pub material: u32,
    /// Azimuth and elevation in degrees.
    pub normal_deg: [f64; 2],
}

/// Line of Sight Response, 104.
pub fn line(out: &mut Vec<u8>, order: ByteOrder, head: Head, line: &Line) {
    let mut packet = Draft::new(out, order, LINE);
    packet.u16(2, head.id);
    packet.u8(4, head.stamped(u8::from(line.valid) | u8::from(line.visible) << 2));
    packet.u8(5, 1);
    packet.f64(8, line.range_m);
}

/// Line of Sight Extended Response, 105.
pub fn line_extended(out: &mut Vec<u8>, order: ByteOrder, head: Head, line: &Line) {
    let mut packet = Draft::new(out, order, LINE_EXTENDED);
    let range_valid = line.point.is_some_and(|point| point.range_valid);
    let flags = u8::from(line.valid) | u8::from(range_valid) << 2 | u8::from(line.visible) << 3;
    packet.u16(2, head.id);
    packet.u8(4, head.stamped(flags));
    packet.u8(5, 1);
    packet.f64(8, line.range_m);
    let Some(point) = line.point else { return };
    packet.f64(16, point.lat_deg);
    packet.f64(24, point.lon_deg);
    packet.f64(32, point.altitude_m);
    // Red, green and blue are not known; ground and water are opaque.
    packet.u8(43, if point.material == 0 { 0 } else { 255 });
    packet.u32(44, point.material);
    packet.f32(48, narrow(point.normal_deg[0]));
    packet.f32(52, narrow(point.normal_deg[1]));
}

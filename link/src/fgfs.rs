//! FlightGear's native FDM packets: where an aircraft is and how it lies.
//!
//! In:    datagrams of `--native-fdm=socket,out,…` and of flight models that speak it.
//! Out:   [`NativeFdm`]: position, attitude; why a datagram is none.
//! Keeps: nothing.
//! Not here: what is made of them (`cigi::Server::drive`).
//! Source: the structure `FGNetFDM` of FlightGear's `src/Network/net_fdm.hxx` (public domain),
//! versions 24 and 25, and its conversion to network order in `native_fdm.cxx`.
//!
//! Both versions begin alike, in network byte order, without gaps:
//!
//! | bytes | type | field |
//! |---|---|---|
//! | 0 | u32 | version, 24 or 25 |
//! | 4 | u32 | padding |
//! | 8, 16, 24 | f64 | longitude and latitude in radians, altitude above sea level in metres |
//! | 32 | f32 | height above ground in metres: not used |
//! | 36, 40, 44 | f32 | roll, pitch, true heading in radians |
//!
//! What follows is engines, tanks, wheels, controls: 408 bytes in all for version 24, and 552 for
//! version 25, which says 144 bytes more of tanks.

use crate::wire::{ByteOrder, Fields};
use core::f64::consts::{FRAC_PI_2, TAU};
use core::fmt;

/// Versions, and how many bytes their packets have.
pub const VERSIONS: [(u32, usize); 2] = [(24, 408), (25, 552)];
/// No aircraft is farther from sea level than this, in metres.
const ALTITUDE_MAX_M: f64 = 1e9;

/// What a packet says of an aircraft's pose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NativeFdm {
    /// Geodetic latitude in radians, within ±π/2.
    pub lat_rad: f64,
    /// Longitude in radians, east positive.
    pub lon_rad: f64,
    /// Altitude above sea level in metres.
    pub altitude_m: f64,
    /// Right wing down, in radians.
    pub roll_rad: f64,
    /// Nose up, in radians.
    pub pitch_rad: f64,
    /// Clockwise from true north, in radians.
    pub heading_rad: f64,
}

/// Why a datagram is no pose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum NativeFdmFault {
    /// It is too short to hold a version.
    Short {
        /// Its bytes.
        found: usize,
    },
    /// Its version is not one of [`VERSIONS`].
    Version {
        /// What it says.
        found: u32,
    },
    /// It does not have its version's size.
    Size {
        /// Its bytes.
        found: usize,
        /// Those of its version.
        wanted: usize,
    },
    /// A number is not finite or not within its range.
    Range {
        /// Which field.
        field: &'static str,
        /// What it is.
        found: f64,
    },
}

impl fmt::Display for NativeFdmFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { found } => write!(f, "{found} bytes, too few for a version"),
            Self::Version { found } => write!(f, "version is {found}, allowed are 24 and 25"),
            Self::Size { found, wanted } => {
                write!(f, "{found} bytes, a packet of its version has {wanted}")
            }
            Self::Range { field, found } => write!(f, "{field} is {found}, out of its range"),
        }
    }
}

impl core::error::Error for NativeFdmFault {}

/// Reads a packet.
///
/// # Errors
/// It is none, or says what no aircraft does.
pub fn decode(datagram: &[u8]) -> Result<NativeFdm, NativeFdmFault> {
    if datagram.len() < 4 {
        return Err(NativeFdmFault::Short { found: datagram.len() });
    }
    let fields = Fields::new(datagram, ByteOrder::Big);
    let found = fields.u32(0);
    let known = VERSIONS.iter().find(|(version, _)| *version == found);
    let &(_, wanted) = known.ok_or(NativeFdmFault::Version { found })?;
    if datagram.len() != wanted {
        return Err(NativeFdmFault::Size { found: datagram.len(), wanted });
    }
    let within = |field, found: f64, most: f64| {
        let fits = found.abs() <= most;
        if fits { Ok(found) } else { Err(NativeFdmFault::Range { field, found }) }
    };
    let angle = |field, at| within(field, f64::from(fields.f32(at)), 2.0 * TAU);
    Ok(NativeFdm {
        lon_rad: within("longitude", fields.f64(8), TAU)?,
        lat_rad: within("latitude", fields.f64(16), FRAC_PI_2)?,
        altitude_m: within("altitude", fields.f64(24), ALTITUDE_MAX_M)?,
        roll_rad: angle("roll", 36)?,
        pitch_rad: angle("pitch", 40)?,
        heading_rad: angle("heading", 44)?,
    })
}

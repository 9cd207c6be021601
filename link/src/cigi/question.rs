//! What the ground is asked, and what it says.
//!
//! In:    heights, segments, rays; a snapshot of the ground and a level.
//! Out:   [`Reply`]; whether it is as exact as was asked for.
//! Keeps: nothing.
//! Not here: the ground (`overfly_core::ground`), packets (`encode`).

use super::packet::MslPlace;
use glam::DVec3;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::ground::{Answer, Ground, Hit, Query, Refraction, Sight};

/// Material code of ground in extended responses.
pub const MATERIAL_GROUND: u32 = 1;
/// Material code of water.
pub const MATERIAL_WATER: u32 = 2;

/// What is asked. Heights are above the ellipsoid, points and directions body-fixed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Question {
    /// The surface at a place, whose own height does not count.
    Height(Geodetic),
    /// What lies between two points.
    Segment {
        /// From here.
        from: Ecef,
        /// To there.
        to: Ecef,
    },
    /// What a ray meets first.
    Ray {
        /// From here.
        from: Ecef,
        /// A unit vector.
        direction: DVec3,
        /// No farther than this, in metres.
        max_m: f64,
    },
}

/// The surface at a place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Surface {
    /// Metres above the ellipsoid.
    pub height_m: f64,
    /// Outward unit normal, body-fixed.
    pub normal: DVec3,
    /// It is water.
    pub water: bool,
}

/// Where a line met the surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Met {
    /// From the line's origin, in metres.
    pub distance_m: f64,
    /// The point.
    pub point: Ecef,
    /// Outward unit normal, body-fixed.
    pub normal: DVec3,
    /// It is water.
    pub water: bool,
}

/// What the ground says.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Reply {
    /// Nobody knows, or not yet.
    Unknown,
    /// To a height.
    Height(Surface),
    /// To a segment or a ray: nothing is in the way.
    Clear,
    /// To a segment or a ray: this is.
    Met(Met),
}

/// A reply, and whether asking for more pages could change it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Asked {
    /// The reply.
    pub reply: Reply,
    /// Everything that it needs of the level was there.
    pub exact: bool,
}

/// The body that a server serves, and how it learns of its ground.
#[derive(Clone, Copy)]
pub struct World<'w> {
    /// Its shape: that of all latitudes and longitudes.
    pub body: Ellipsoid,
    /// Height of sea level above the ellipsoid in metres, at a latitude and a longitude in
    /// radians: what altitudes count from.
    pub sea_level_m: &'w dyn Fn(f64, f64) -> f64,
    /// Answers questions at once; what it does not know, it says.
    pub ask: &'w dyn Fn(&Question) -> Reply,
}

impl World<'_> {
    /// The same place with its height above the ellipsoid.
    pub(super) fn geodetic(&self, at: MslPlace) -> Geodetic {
        let MslPlace { lat_rad, lon_rad, altitude_m } = at;
        let height_m = altitude_m + (self.sea_level_m)(lat_rad, lon_rad);
        Geodetic { lat_rad, lon_rad, height_m }
    }

    /// A height of this place as an altitude above sea level.
    pub(super) fn altitude_m(&self, at: Geodetic, height_m: f64) -> f64 {
        height_m - (self.sea_level_m)(at.lat_rad, at.lon_rad)
    }

    /// The surface there, if somebody knows.
    pub(super) fn surface(&self, at: Geodetic) -> Option<Surface> {
        match (self.ask)(&Question::Height(at)) {
            Reply::Height(surface) => Some(surface),
            Reply::Unknown | Reply::Clear | Reply::Met(_) => None,
        }
    }
}

/// Asks a snapshot. Heights are of exactly this lattice level, or unknown: so that they never
/// depend on what is drawn. Lines take the finest that is there where the level is not.
pub fn ask(ground: &Ground, level: u8, question: &Question) -> Asked {
    let query = Query::Exact(level);
    match *question {
        Question::Height(at) => {
            let found = ground.height(at, query).ok().map(|h| {
                Reply::Height(Surface { height_m: h.height_m, normal: h.normal, water: h.water })
            });
            Asked { reply: found.unwrap_or(Reply::Unknown), exact: found.is_some() }
        }
        Question::Segment { from, to } => {
            let sight = ground.line_of_sight(from, to, Refraction::None, query);
            asked(sight, |sight| match sight {
                Sight::Clear { .. } => Reply::Clear,
                Sight::Blocked(hit) => Reply::Met(met(ground, query, hit)),
            })
        }
        Question::Ray { from, direction, max_m } => {
            let hit = ground.ray(from, direction, max_m, query);
            asked(hit, |hit| hit.map_or(Reply::Clear, |hit| Reply::Met(met(ground, query, hit))))
        }
    }
}

fn asked<T>(answer: Answer<T>, reply: impl FnOnce(T) -> Reply) -> Asked {
    // What has no answer anywhere is none that pages could change.
    let exact = matches!(answer, Answer::Ok(_) | Answer::Refused);
    Asked { reply: answer.found().map_or(Reply::Unknown, reply), exact }
}

fn met(ground: &Ground, query: Query, hit: Hit) -> Met {
    let there = ground.height(ground.body().geodetic_from_ecef(hit.point), query).found();
    Met {
        distance_m: hit.distance_m,
        point: hit.point,
        normal: hit.normal,
        water: there.is_some_and(|there| there.water),
    }
}

//! Questions and answers: what may be asked of the ground, and how sure it says that it is.
//!
//! In:    nothing; these are the types.
//! Out:   [`Query`], [`Answer`] and what answers hold.
//! Keeps: nothing.
//! Not here: how answers are found.

use crate::datasource::page::Origin;
use crate::geodesy::Ecef;
use crate::units::Metres;
use glam::DVec3;

/// Which surface is asked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Query {
    /// That of one lattice level, 0 to [`LEVEL_MAX`](super::LEVEL_MAX): the triangles of the mesh
    /// where it is fully refined to this level. The answer depends on the place and on the page
    /// that serves the level there, on nothing else.
    Exact(u8),
    /// That of the finest resident page, at its even level. It changes as pages come and go.
    BestResident,
    /// That of the coarsest level of 11 and more (the coarser ones have no bounds of their own)
    /// whose bound there is this small. It does not change when finer pages come or go.
    Within(Metres),
}

/// How a question was answered.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Answer<T = Height> {
    /// As asked.
    Ok(T),
    /// Not what was asked: from the finest level that is resident.
    Coarser(T),
    /// No page of that place is resident: there is no number.
    NotReady,
    /// The question has no answer anywhere: not finite, latitude beyond ±π/2, level beyond
    /// [`LEVEL_MAX`](super::LEVEL_MAX), no direction, negative length.
    Refused,
}

impl<T> Answer<T> {
    /// What was found, as asked or coarser.
    pub fn found(self) -> Option<T> {
        match self {
            Self::Ok(found) | Self::Coarser(found) => Some(found),
            Self::NotReady | Self::Refused => None,
        }
    }

    /// What was found, if it is as asked.
    pub fn ok(self) -> Option<T> {
        if let Self::Ok(found) = self { Some(found) } else { None }
    }

    /// The same answer, speaking of something else.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Answer<U> {
        match self {
            Self::Ok(found) => Answer::Ok(change(found)),
            Self::Coarser(found) => Answer::Coarser(change(found)),
            Self::NotReady => Answer::NotReady,
            Self::Refused => Answer::Refused,
        }
    }

    pub(super) fn of(found: T, coarser: bool) -> Self {
        if coarser { Self::Coarser(found) } else { Self::Ok(found) }
    }
}

/// The ground at one place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Height {
    /// Height of the surface above the ellipsoid in metres; water where there is a sea.
    pub height_m: f64,
    /// Height of sea level above the ellipsoid in metres, linear in the triangle.
    pub sea_level_m: f64,
    /// Unit normal of the triangle, outward, body-fixed.
    pub normal: DVec3,
    /// Lattice level of the triangle.
    pub level: u8,
    /// No finer level, and not the ground itself, is farther than this from `height_m`, in metres.
    pub bound_m: f64,
    /// Where the sample nearest to the place comes from.
    pub origin: Origin,
    /// The surface is water: there is a sea and the ground lies below its level.
    pub water: bool,
}

/// The ground on the vertical of a body-fixed point, as flight models ask for it. It never moves:
/// its velocity is 0.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Contact {
    /// Height of the point above the surface along the vertical; negative under ground. Metres.
    pub agl_m: f64,
    /// Where the vertical meets the surface.
    pub contact: Ecef,
    /// The ground there; its normal is that of the contact.
    pub ground: Height,
}

/// Where a ray first met the ground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// Distance from the origin along the ray in metres; 0 for an origin under ground.
    pub distance_m: f64,
    /// The place.
    pub point: Ecef,
    /// Unit normal of the triangle, outward, body-fixed.
    pub normal: DVec3,
    /// Lattice level of the triangle.
    pub level: u8,
}

/// How the air bends a line of sight.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Refraction {
    /// A straight line.
    None,
    /// The 4/3-earth rule of radio: the line rises above its chord by d₁·d₂/(8·R), where d₁ and
    /// d₂ are the distances to its ends and R is the body's mean radius, (2a + b)/3.
    FourThirds,
}

/// What lies between two points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Sight {
    /// Nothing.
    Clear {
        /// Least height of the line above the surface, its ends included, in metres.
        clearance_m: f64,
    },
    /// Ground.
    Blocked(
        /// The first of it, seen from the first point.
        Hit,
    ),
}

/// Bounds on the ground over a region.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MinMax {
    /// Neither the ground nor the surface of the finest resident level or a finer one lies lower
    /// than this above the ellipsoid. Metres.
    pub low_m: f64,
    /// Nor higher than this.
    pub high_m: f64,
    /// Level of the coarsest pages that had to answer.
    pub level: u8,
}

/// How much of a region is resident at some level.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Readiness {
    /// Share of the needed pages that are resident, 0 to 1.
    pub fraction: f64,
    /// The coarsest level that some place of the region has to do with, at most the level asked
    /// for; empty where a place has none.
    pub worst_level: Option<u8>,
    /// Needed pages that are not resident.
    pub missing: u32,
}

//! Rays and lines of sight.
//!
//! In:    snapshots, body-fixed points and directions, which surface is meant.
//! Out:   where the ground is met, or how far it stays below.
//! Keeps: nothing.
//! Not here: heights (`queries`).

use crate::border::{Caller, answer};
use crate::ground::{lend, ovf_ground, point};
use crate::queries::{coded, ovf_query, query_of};
use crate::status::{Fault, ovf_status};
use bytemuck::Zeroable;
use glam::DVec3;
use overfly::core::ground::{Hit, Refraction, Sight};

/// `refraction`: a straight line.
pub const OVF_REFRACTION_NONE: u32 = 0;
/// `refraction`: as radio, by the 4/3-earth rule.
pub const OVF_REFRACTION_FOUR_THIRDS: u32 = 1;

/// Where a ray first meets the ground.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_hit {
    /// `sizeof(ovf_hit)`, set by the host.
    pub struct_size: u32,
    /// `OVF_ANSWER_…`.
    pub answer: u32,
    /// 1: it meets it; 0: it does not, and the numbers are NaN.
    pub hit: u32,
    /// Level of the triangle.
    pub level: u32,
    /// Way along the ray; 0 for an origin under ground.
    pub distance_m: f64,
    /// The place.
    pub point_ecef_m: [f64; 3],
    /// Normal there, outward, of length 1.
    pub normal_ecef: [f64; 3],
}

/// What lies between two points.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_sight {
    /// `sizeof(ovf_sight)`, set by the host.
    pub struct_size: u32,
    /// `OVF_ANSWER_…`.
    pub answer: u32,
    /// 1: ground.
    pub blocked: u32,
    /// Level of the first triangle of it.
    pub level: u32,
    /// Least height of the line above the surface; NaN where it is blocked.
    pub clearance_m: f64,
    /// Way from the first point to the first ground; NaN where it is not blocked, as what follows.
    pub distance_m: f64,
    /// The place.
    pub point_ecef_m: [f64; 3],
    /// Normal there, outward, of length 1.
    pub normal_ecef: [f64; 3],
}

/// Where a ray first meets the ground. `origin_ecef_m` and `direction_ecef` are three numbers each;
/// the direction has any length but 0; `max_m` may be infinite.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_ray(
    ground: ovf_ground,
    origin_ecef_m: *const f64,
    direction_ecef: *const f64,
    max_m: f64,
    query: *const ovf_query,
    hit: *mut ovf_hit,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("hit", hit)?;
        let origin = point("origin_ecef_m", caller.triple("origin_ecef_m", origin_ecef_m)?)?;
        let direction = DVec3::from_array(caller.triple("direction_ecef", direction_ecef)?);
        if !(direction.length() > 0.0 && direction.length().is_finite()) {
            let sentence =
                format!("direction_ecef is {direction}, allowed is any finite direction");
            return Err(Fault::invalid(sentence));
        }
        if max_m.is_nan() || max_m < 0.0 {
            return Err(Fault::invalid(format!("max_m is {max_m}, allowed is 0 or more")));
        }
        let query = query_of(caller, query)?;
        let (answer, found) = coded(lend(ground)?.ray(origin, direction, max_m, query));
        let met = Met::of(found.flatten());
        let value = ovf_hit {
            struct_size: 0,
            answer,
            hit: met.met,
            level: met.level,
            distance_m: met.distance_m,
            point_ecef_m: met.point,
            normal_ecef: met.normal,
        };
        caller.put("hit", hit, value)
    })
}

/// Whether anything lies between two body-fixed points of three numbers each, and how much there is
/// to spare.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_line_of_sight(
    ground: ovf_ground,
    from_ecef_m: *const f64,
    to_ecef_m: *const f64,
    refraction: u32,
    query: *const ovf_query,
    sight: *mut ovf_sight,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("sight", sight)?;
        let from = point("from_ecef_m", caller.triple("from_ecef_m", from_ecef_m)?)?;
        let to = point("to_ecef_m", caller.triple("to_ecef_m", to_ecef_m)?)?;
        let refraction = match refraction {
            OVF_REFRACTION_NONE => Refraction::None,
            OVF_REFRACTION_FOUR_THIRDS => Refraction::FourThirds,
            _ => {
                let sentence = format!("refraction is {refraction}, allowed is 0 or 1");
                return Err(Fault::invalid(sentence));
            }
        };
        let query = query_of(caller, query)?;
        let (answer, found) = coded(lend(ground)?.line_of_sight(from, to, refraction, query));
        let (clearance_m, hit) = match found {
            Some(Sight::Clear { clearance_m }) => (clearance_m, None),
            Some(Sight::Blocked(hit)) => (f64::NAN, Some(hit)),
            None => (f64::NAN, None),
        };
        let met = Met::of(hit);
        let value = ovf_sight {
            struct_size: 0,
            answer,
            blocked: met.met,
            level: met.level,
            clearance_m,
            distance_m: met.distance_m,
            point_ecef_m: met.point,
            normal_ecef: met.normal,
        };
        caller.put("sight", sight, value)
    })
}

/// A hit, or NaN where there is none.
struct Met {
    met: u32,
    level: u32,
    distance_m: f64,
    point: [f64; 3],
    normal: [f64; 3],
}

impl Met {
    fn of(hit: Option<Hit>) -> Self {
        let Some(hit) = hit else {
            let none = [f64::NAN; 3];
            return Self { met: 0, level: 0, distance_m: f64::NAN, point: none, normal: none };
        };
        Self {
            met: 1,
            level: u32::from(hit.level),
            distance_m: hit.distance_m,
            point: hit.point.0.to_array(),
            normal: hit.normal.to_array(),
        }
    }
}

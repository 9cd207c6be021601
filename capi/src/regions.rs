//! Regions of ground: what is there, what shall be there, how high it is.
//!
//! In:    discs on the ellipsoid, levels.
//! Out:   tickets, readiness, bounds.
//! Keeps: nothing; tickets are the terrain's.
//! Not here: heights of places (`queries`).

use crate::border::{Caller, answer};
use crate::frame::geodetic;
use crate::ground::{lend, ovf_ground};
use crate::queries::{coded, level_fault};
use crate::status::{Fault, OVF_FULL, OVF_INVALID, OVF_STALE, ovf_status};
use crate::terrain::{ovf_terrain, with};
use bytemuck::Zeroable;
use overfly::core::ground::{LEVEL_MAX, Readiness, Region, RegionFault};

/// All places within a radius along the ellipsoid.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_region {
    /// `sizeof(ovf_region)`.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Geodetic latitude of the middle, within ±π/2.
    pub centre_lat_rad: f64,
    /// Its longitude, east positive.
    pub centre_lon_rad: f64,
    /// 0 or more.
    pub radius_m: f64,
}

/// How much of what a level needs in a region is there.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_readiness {
    /// `sizeof(ovf_readiness)`, set by the host.
    pub struct_size: u32,
    /// Pages that are not there.
    pub missing: u32,
    /// Share that is there, 0 to 1.
    pub fraction: f64,
    /// 1: `worst_level` is one; 0: somewhere there is nothing at all.
    pub has_level: u32,
    /// The coarsest level that some place has to do with.
    pub worst_level: u32,
}

/// Bounds on the ground of a region.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_min_max {
    /// `sizeof(ovf_min_max)`, set by the host.
    pub struct_size: u32,
    /// `OVF_ANSWER_…`.
    pub answer: u32,
    /// The ground is nowhere lower above the ellipsoid.
    pub low_m: f64,
    /// Nor higher.
    pub high_m: f64,
    /// Level of the coarsest pages that had to answer.
    pub level: u32,
    /// 0.
    pub reserved: u32,
}

/// Has the pages loaded that heights of a level need in a region, as before a jump. They are part
/// of later snapshots as they come, and stay until `ovf_terrain_release` gives `*ticket` back.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_request(
    terrain: ovf_terrain,
    region: *const ovf_region,
    level: u32,
    ticket: *mut u64,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("ticket", ticket)?;
        let (region, level) = (region_of(caller, region)?, level_of(level)?);
        let number = with(terrain, |state| {
            let held = state.overfly.request(region, level)?;
            state.ticket_serial += 1;
            state.tickets.insert(state.ticket_serial, held);
            Ok(state.ticket_serial)
        })?;
        caller.put_plain("ticket", ticket, number)
    })
}

/// Gives a requested region back. Where the scene's sources have become others since, there is no
/// ticket any more, and this says so.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_terrain_release(terrain: ovf_terrain, ticket: u64) -> ovf_status {
    answer!(|_: &Caller| with(terrain, |state| {
        let Some(held) = state.tickets.remove(&ticket) else {
            let sentence =
                format!("the ticket {ticket} is not there: it was released, or never was");
            return Err(Fault::new(OVF_STALE, sentence));
        };
        state.overfly.release(held);
        Ok(())
    }))
}

/// How much of what a level needs in a region is there now.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_readiness(
    terrain: ovf_terrain,
    region: *const ovf_region,
    level: u32,
    readiness: *mut ovf_readiness,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("readiness", readiness)?;
        let (region, level) = (region_of(caller, region)?, level_of(level)?);
        let found = with(terrain, |state| {
            state.overfly.readiness(region, level).map_err(|fault| region_fault(&fault))
        })?;
        caller.put("readiness", readiness, readiness_of(&found))
    })
}

/// The same of a snapshot.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_readiness(
    ground: ovf_ground,
    region: *const ovf_region,
    level: u32,
    readiness: *mut ovf_readiness,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("readiness", readiness)?;
        let (region, level) = (region_of(caller, region)?, level_of(level)?);
        let found = lend(ground)?.readiness(region, level);
        let found = found.map_err(|fault| region_fault(&fault))?;
        caller.put("readiness", readiness, readiness_of(&found))
    })
}

/// Bounds on the ground of a region, from the finest pages that are there: for minimum altitudes.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_min_max(
    ground: ovf_ground,
    region: *const ovf_region,
    min_max: *mut ovf_min_max,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("min_max", min_max)?;
        let region = region_of(caller, region)?;
        let (answer, found) = coded(lend(ground)?.min_max(region));
        let value = ovf_min_max {
            struct_size: 0,
            answer,
            low_m: found.map_or(f64::NAN, |it| it.low_m),
            high_m: found.map_or(f64::NAN, |it| it.high_m),
            level: found.map_or(0, |it| u32::from(it.level)),
            reserved: 0,
        };
        caller.put("min_max", min_max, value)
    })
}

fn region_of(caller: &Caller, region: *const ovf_region) -> Result<Region, Fault> {
    let region = caller.sized("region", region)?;
    let centre = geodetic("region: centre", [region.centre_lat_rad, region.centre_lon_rad, 0.0])?;
    let radius_m = region.radius_m;
    if !(radius_m >= 0.0 && radius_m.is_finite()) {
        let sentence = format!("region: radius_m is {radius_m}, allowed is 0 or more, and finite");
        return Err(Fault::invalid(sentence));
    }
    Ok(Region { centre, radius_m })
}

fn level_of(level: u32) -> Result<u8, Fault> {
    let found = u8::try_from(level).ok().filter(|&level| level <= LEVEL_MAX);
    found.ok_or_else(|| level_fault(level))
}

fn region_fault(fault: &RegionFault) -> Fault {
    let status = match fault {
        RegionFault::Refused => OVF_INVALID,
        RegionFault::TooLarge { .. } => OVF_FULL,
    };
    Fault::of(status, fault)
}

fn readiness_of(found: &Readiness) -> ovf_readiness {
    ovf_readiness {
        struct_size: 0,
        missing: found.missing,
        fraction: found.fraction,
        has_level: u32::from(found.worst_level.is_some()),
        worst_level: found.worst_level.map_or(0, u32::from),
    }
}

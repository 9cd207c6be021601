//! Snapshots of the ground as C holds them, for any thread.
//!
//! In:    a terrain between two frames.
//! Out:   handles of snapshots; positions from one way of writing them to the other.
//! Keeps: the table of all snapshots of the process.
//! Not here: what is asked of them (`queries`, `rays`, `regions`).

use crate::border::{Caller, answer};
use crate::frame::geodetic;
use crate::status::{Fault, ovf_status};
use crate::table::{Lent, Table};
use crate::terrain::{ovf_terrain, with};
use glam::DVec3;
use overfly::core::geodesy::Ecef;
use overfly::core::ground::Ground;

/// Most snapshots that are open at once.
const GROUNDS_MAX: usize = 4096;

static GROUNDS: Table<Ground, GROUNDS_MAX> = Table::new(2, "ground");

/// A snapshot of the ground: it never changes, and answers any thread without a lock and, from a
/// thread's second call on, without memory. It outlives its terrain. A number, as `ovf_terrain` is.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ovf_ground {
    /// Not for the host.
    pub bits: u64,
}

/// The snapshot of a handle, for one call.
pub fn lend(ground: ovf_ground) -> Result<Lent<Ground>, Fault> {
    GROUNDS.lend(ground.bits)
}

/// The ground of all pages that are there now. Some 20 µs for each page that came since the last
/// call, the first call for all of them. Take a new one after frames, and destroy the old one.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_ground(
    terrain: ovf_terrain,
    ground: *mut ovf_ground,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("ground", ground)?;
        let bits = GROUNDS.insert(with(terrain, |state| Ok(state.overfly.ground()))?)?;
        caller.put_plain("ground", ground, ovf_ground { bits })
    })
}

/// Gives a snapshot back. Calls that use it in other threads end undisturbed.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_ground_destroy(ground: ovf_ground) -> ovf_status {
    answer!(|_: &Caller| GROUNDS.remove(ground.bits))
}

/// From body-fixed coordinates to latitude, longitude and height above the ellipsoid. The three
/// places to write to are one number each.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_to_geodetic(
    ground: ovf_ground,
    point_ecef_m: *const f64,
    lat_rad: *mut f64,
    lon_rad: *mut f64,
    height_m: *mut f64,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let point = point("point_ecef_m", caller.triple("point_ecef_m", point_ecef_m)?)?;
        let places = [("lat_rad", lat_rad), ("lon_rad", lon_rad), ("height_m", height_m)];
        places.iter().try_for_each(|&(name, place)| caller.check_plain(name, place))?;
        let at = lend(ground)?.body().geodetic_from_ecef(point);
        let found = [at.lat_rad, at.lon_rad, at.height_m];
        places
            .iter()
            .zip(found)
            .try_for_each(|(&(name, place), value)| caller.put_plain(name, place, value))
    })
}

/// From latitude, longitude and height above the ellipsoid to body-fixed coordinates: three numbers.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_to_ecef(
    ground: ovf_ground,
    lat_rad: f64,
    lon_rad: f64,
    height_m: f64,
    point_ecef_m: *mut f64,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let out = caller.array_out("point_ecef_m", point_ecef_m, 3)?;
        let at = geodetic("place", [lat_rad, lon_rad, height_m])?;
        let point = lend(ground)?.body().ecef_from_geodetic(at);
        point.0.to_array().into_iter().enumerate().for_each(|(i, c)| out.put(i, c));
        Ok(())
    })
}

/// A body-fixed point.
pub fn point(name: &str, [x, y, z]: [f64; 3]) -> Result<Ecef, Fault> {
    let point = DVec3::new(x, y, z);
    if point.is_finite() {
        return Ok(Ecef(point));
    }
    Err(Fault::invalid(format!("{name} is {point}, allowed is any finite point")))
}

//! Heights and contacts: the ground on the vertical of a place, one by one or many at once.
//!
//! In:    snapshots, places, which surface is meant.
//! Out:   heights with how sure they are, into structs and columns of the host.
//! Keeps: nothing: places are worked off in blocks on the stack.
//! Not here: rays (`rays`), regions (`regions`).

use crate::border::{Caller, In, Out, answer};
use crate::frame::geodetic;
use crate::ground::{lend, ovf_ground, point};
use crate::status::{Fault, ovf_status};
use bytemuck::Zeroable;
use overfly::core::geodesy::Geodetic;
use overfly::core::ground::{Answer, Contact, Height, LEVEL_MAX, Query};
use overfly::core::units::Metres;

/// `ovf_query.kind`: the surface of one level. It depends on the scene, the place and the level
/// alone, whatever else is there: what wheels stand on.
pub const OVF_QUERY_EXACT: u32 = 0;
/// `ovf_query.kind`: the finest that is there. It changes as pages come and go.
pub const OVF_QUERY_BEST_RESIDENT: u32 = 1;
/// `ovf_query.kind`: that of the coarsest level whose error bound there is at most `bound_max_m`.
pub const OVF_QUERY_WITHIN: u32 = 2;

/// An answer: as asked.
pub const OVF_ANSWER_OK: u32 = 1;
/// An answer: from the finest level that is there, coarser than asked.
pub const OVF_ANSWER_COARSER: u32 = 2;
/// An answer: nothing is there yet. All numbers are NaN.
pub const OVF_ANSWER_NOT_READY: u32 = 3;
/// An answer: the place is none (NaN, infinite, beyond a pole). All numbers are NaN.
pub const OVF_ANSWER_REFUSED: u32 = 4;

/// `origin`: the procedural planet, or nothing where a scene has none.
pub const OVF_ORIGIN_PROCEDURAL: u32 = 0;
/// `origin`: real elevation.
pub const OVF_ORIGIN_MEASURED: u32 = 1;
/// `origin`: a void of real elevation, filled.
pub const OVF_ORIGIN_FILLED: u32 = 2;

/// Which surface is asked.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_query {
    /// `sizeof(ovf_query)`.
    pub struct_size: u32,
    /// `OVF_QUERY_…`.
    pub kind: u32,
    /// Level, 0 to 56: triangles of two levels more have sides half as long. Read with
    /// `OVF_QUERY_EXACT` only.
    pub level: u32,
    /// 0.
    pub reserved: u32,
    /// 0 or more; read with `OVF_QUERY_WITHIN` only.
    pub bound_max_m: f64,
}

/// Places: one of the two pairs is not null.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_places {
    /// `sizeof(ovf_places)`.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Geodetic latitudes, within ±π/2.
    pub lat_rad: *const f64,
    /// Longitudes, east positive.
    pub lon_rad: *const f64,
    /// Geodetic latitudes, within ±90.
    pub lat_deg: *const f64,
    /// Longitudes, east positive.
    pub lon_deg: *const f64,
}

/// The ground at one place.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_height {
    /// `sizeof(ovf_height)`, set by the host.
    pub struct_size: u32,
    /// `OVF_ANSWER_…`.
    pub answer: u32,
    /// Height of the surface above the ellipsoid; water where there is a sea.
    pub height_m: f64,
    /// Height of sea level above the ellipsoid: heights above the sea are the difference.
    pub sea_level_m: f64,
    /// Normal of the surface, body-fixed, outward, of length 1.
    pub normal_ecef: [f64; 3],
    /// No finer level, and not the ground itself, is farther than this from `height_m`.
    pub bound_m: f64,
    /// Level that answered.
    pub level: u32,
    /// `OVF_ORIGIN_…`.
    pub origin: u32,
    /// 1: the surface is water.
    pub water: u32,
    /// 0.
    pub reserved: u32,
}

/// Columns of heights, each with room for all places; null where the host does not want one.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_height_columns {
    /// `sizeof(ovf_height_columns)`.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// `OVF_ANSWER_…`.
    pub answer: *mut u8,
    /// As in `ovf_height`.
    pub height_m: *mut f64,
    /// As in `ovf_height`.
    pub sea_level_m: *mut f64,
    /// As in `ovf_height`, three numbers each.
    pub normal_ecef: *mut f64,
    /// As in `ovf_height`.
    pub bound_m: *mut f64,
    /// As in `ovf_height`.
    pub level: *mut u8,
    /// As in `ovf_height`.
    pub origin: *mut u8,
    /// As in `ovf_height`.
    pub water: *mut u8,
}

/// The ground on the vertical of a point, as flight models ask for it. It does not move.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_contact {
    /// `sizeof(ovf_contact)`, set by the host.
    pub struct_size: u32,
    /// `OVF_ANSWER_…`.
    pub answer: u32,
    /// Height of the point above the surface along the vertical; negative under ground.
    pub agl_m: f64,
    /// Where the vertical meets the surface.
    pub contact_ecef_m: [f64; 3],
    /// Normal of the surface there, outward, of length 1.
    pub normal_ecef: [f64; 3],
    /// Height of the surface above the ellipsoid.
    pub height_m: f64,
    /// Height of sea level above the ellipsoid.
    pub sea_level_m: f64,
    /// No finer level, and not the ground itself, is farther than this from `height_m`.
    pub bound_m: f64,
    /// Level that answered.
    pub level: u32,
    /// `OVF_ORIGIN_…`.
    pub origin: u32,
    /// 1: the surface is water.
    pub water: u32,
    /// 0.
    pub reserved: u32,
}

/// The ground at one place. The same bits as `ovf_ground_heights` gives.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_height(
    ground: ovf_ground,
    lat_rad: f64,
    lon_rad: f64,
    query: *const ovf_query,
    height: *mut ovf_height,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("height", height)?;
        let at = geodetic("place", [lat_rad, lon_rad, 0.0])?;
        let query = query_of(caller, query)?;
        caller.put("height", height, height_of(lend(ground)?.height(at, query)))
    })
}

/// The ground at many places. A place that is none is answered so, and the others are not disturbed.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_heights(
    ground: ovf_ground,
    places: *const ovf_places,
    count: u64,
    query: *const ovf_query,
    columns: *const ovf_height_columns,
) -> ovf_status {
    answer!(|caller: &Caller| {
        let places = Places::of(caller, caller.sized("places", places)?, count)?;
        let columns = Columns::of(caller, &caller.sized("columns", columns)?, count)?;
        let query = query_of(caller, query)?;
        let ground = lend(ground)?;
        let mut at = [Geodetic { lat_rad: 0.0, lon_rad: 0.0, height_m: 0.0 }; BLOCK];
        let mut answers = [Answer::NotReady; BLOCK];
        for first in (0..places.count()).step_by(BLOCK) {
            let used = (places.count() - first).min(BLOCK);
            at[..used].iter_mut().enumerate().for_each(|(i, at)| *at = places.get(first + i));
            ground.heights(&at[..used], query, &mut answers[..used]);
            answers[..used].iter().enumerate().for_each(|(i, &it)| columns.put(first + i, it));
        }
        Ok(())
    })
}

/// Places of one block: 3 KiB of answers on the stack.
const BLOCK: usize = 32;

/// The ground on the vertical of a body-fixed point of three numbers: JSBSim's `GetAGLevel` in SI.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_ground_contact(
    ground: ovf_ground,
    point_ecef_m: *const f64,
    query: *const ovf_query,
    contact: *mut ovf_contact,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("contact", contact)?;
        let point = point("point_ecef_m", caller.triple("point_ecef_m", point_ecef_m)?)?;
        let query = query_of(caller, query)?;
        caller.put("contact", contact, contact_of(lend(ground)?.agl(point, query)))
    })
}

/// Which surface is meant.
pub fn query_of(caller: &Caller, query: *const ovf_query) -> Result<Query, Fault> {
    let query = caller.sized("query", query)?;
    match query.kind {
        OVF_QUERY_EXACT => {
            let level = u8::try_from(query.level).ok().filter(|&level| level <= LEVEL_MAX);
            level.map(Query::Exact).ok_or_else(|| level_fault(query.level))
        }
        OVF_QUERY_BEST_RESIDENT => Ok(Query::BestResident),
        OVF_QUERY_WITHIN if query.bound_max_m >= 0.0 => {
            Ok(Query::Within(Metres(query.bound_max_m)))
        }
        OVF_QUERY_WITHIN => {
            let found = query.bound_max_m;
            Err(Fault::invalid(format!("query: bound_max_m is {found}, allowed is 0 or more")))
        }
        kind => Err(Fault::invalid(format!(
            "query: kind is {kind}, allowed is 0 to {OVF_QUERY_WITHIN}"
        ))),
    }
}

/// A level that is none.
pub fn level_fault(level: u32) -> Fault {
    Fault::invalid(format!("level is {level}, allowed is 0 to {LEVEL_MAX}"))
}

/// An answer's code, and what was found.
pub fn coded<T>(answer: Answer<T>) -> (u32, Option<T>) {
    let code = match answer {
        Answer::Ok(_) => OVF_ANSWER_OK,
        Answer::Coarser(_) => OVF_ANSWER_COARSER,
        Answer::NotReady => OVF_ANSWER_NOT_READY,
        Answer::Refused => OVF_ANSWER_REFUSED,
    };
    (code, answer.found())
}

fn height_of(answer: Answer) -> ovf_height {
    let (answer, found) = coded(answer);
    let nan = f64::NAN;
    ovf_height {
        struct_size: 0,
        answer,
        height_m: found.map_or(nan, |it| it.height_m),
        sea_level_m: found.map_or(nan, |it| it.sea_level_m),
        normal_ecef: found.map_or([nan; 3], |it| it.normal.to_array()),
        bound_m: found.map_or(nan, |it| it.bound_m),
        level: found.map_or(0, |it| u32::from(it.level)),
        origin: found.map_or(0, |it| it.origin as u32),
        water: found.map_or(0, |it| u32::from(it.water)),
        reserved: 0,
    }
}

fn contact_of(answer: Answer<Contact>) -> ovf_contact {
    let (agl_m, contact) =
        answer.found().map_or((f64::NAN, [f64::NAN; 3]), |it| (it.agl_m, it.contact.0.to_array()));
    let ground = height_of(answer.map(|it| it.ground));
    ovf_contact {
        struct_size: 0,
        answer: ground.answer,
        agl_m,
        contact_ecef_m: contact,
        normal_ecef: ground.normal_ecef,
        height_m: ground.height_m,
        sea_level_m: ground.sea_level_m,
        bound_m: ground.bound_m,
        level: ground.level,
        origin: ground.origin,
        water: ground.water,
        reserved: 0,
    }
}

/// Places of a batch.
struct Places<'a> {
    lat: In<'a, f64>,
    lon: In<'a, f64>,
    in_degrees: bool,
}

impl<'a> Places<'a> {
    fn of(caller: &'a Caller, places: ovf_places, count: u64) -> Result<Self, Fault> {
        let ovf_places { lat_rad, lon_rad, lat_deg, lon_deg, .. } = places;
        let (in_radians, in_degrees) =
            (!lat_rad.is_null() || !lon_rad.is_null(), !lat_deg.is_null() || !lon_deg.is_null());
        if in_radians && in_degrees {
            let sentence = "places: both radians and degrees are given, allowed is one of them";
            return Err(Fault::invalid(sentence));
        }
        let [lat, lon] = if in_degrees {
            [("places: lat_deg", lat_deg), ("places: lon_deg", lon_deg)]
        } else {
            [("places: lat_rad", lat_rad), ("places: lon_rad", lon_rad)]
        };
        let lat = caller.array(lat.0, lat.1, count)?;
        Ok(Self { lat, lon: caller.array(lon.0, lon.1, count)?, in_degrees })
    }

    fn count(&self) -> usize {
        self.lat.count()
    }

    fn get(&self, index: usize) -> Geodetic {
        let (lat, lon) = (self.lat.get(index), self.lon.get(index));
        if self.in_degrees {
            Geodetic::from_degrees(lat, lon, 0.0)
        } else {
            Geodetic { lat_rad: lat, lon_rad: lon, height_m: 0.0 }
        }
    }
}

/// Where a batch's heights go.
struct Columns<'a> {
    answer: Out<'a, u8>,
    height_m: Out<'a, f64>,
    sea_level_m: Out<'a, f64>,
    normal_ecef: Out<'a, f64>,
    bound_m: Out<'a, f64>,
    level: Out<'a, u8>,
    origin: Out<'a, u8>,
    water: Out<'a, u8>,
}

impl<'a> Columns<'a> {
    fn of(caller: &'a Caller, to: &ovf_height_columns, count: u64) -> Result<Self, Fault> {
        let thrice = count.saturating_mul(3);
        Ok(Self {
            answer: caller.column("columns: answer", to.answer, count)?,
            height_m: caller.column("columns: height_m", to.height_m, count)?,
            sea_level_m: caller.column("columns: sea_level_m", to.sea_level_m, count)?,
            normal_ecef: caller.column("columns: normal_ecef", to.normal_ecef, thrice)?,
            bound_m: caller.column("columns: bound_m", to.bound_m, count)?,
            level: caller.column("columns: level", to.level, count)?,
            origin: caller.column("columns: origin", to.origin, count)?,
            water: caller.column("columns: water", to.water, count)?,
        })
    }

    fn put(&self, at: usize, answer: Answer<Height>) {
        let it = height_of(answer);
        let byte = |value: u32| u8::try_from(value).expect("codes and levels are below 64");
        self.answer.put(at, byte(it.answer));
        self.height_m.put(at, it.height_m);
        self.sea_level_m.put(at, it.sea_level_m);
        for (axis, part) in it.normal_ecef.into_iter().enumerate() {
            self.normal_ecef.put(3 * at + axis, part);
        }
        self.bound_m.put(at, it.bound_m);
        self.level.put(at, byte(it.level));
        self.origin.put(at, byte(it.origin));
        self.water.put(at, byte(it.water));
    }
}

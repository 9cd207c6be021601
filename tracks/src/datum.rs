//! Heights above the ellipsoid, from whatever a file's altitudes are above.
//!
//! In:    fixes, what the user says of altitudes, the geoid.
//! Out:   a height for each fix that has one; a sentence about what was assumed.
//! Keeps: nothing.
//! Not here: the geoid itself, which comes from the caller.
//!
//! What the file declares counts, else the habit of its format, else the user is asked. Pressure
//! altitudes are taken as heights above sea level: that is right in a standard atmosphere, and some
//! 8 m off for each hPa that the day's pressure differs from 1013.25.

use crate::fault::TrackError;
use crate::fixes::{Datum, Fixes, Said};
use std::collections::BTreeMap;

/// A height is a spike where it is farther than this from those around, and faster than that.
const SPIKE_M: f64 = 100.0;
const SPIKE_MPS: f64 = 150.0;

/// What altitudes are above, as the user says it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Altitude {
    /// What the file declares, else the habit of its format.
    #[default]
    Auto,
    /// The altitudes are above this, whatever the file says. With [`Datum::Pressure`] the pressure
    /// altitudes are taken where the file has both.
    Above(Datum),
}

/// Heights and how they came about.
pub(crate) struct Heights {
    /// Above the ellipsoid in metres; NaN where a fix has none.
    pub height_m: Vec<f64>,
    /// The step that the file writes them in, in metres.
    pub step_m: f64,
    /// One line: what was assumed.
    pub assumed: String,
}

/// Height of the geoid above the ellipsoid in metres at a latitude and a longitude in radians.
pub type Undulation<'u> = &'u dyn Fn(f64, f64) -> f64;

/// Heights above the ellipsoid.
pub(crate) fn resolve(
    fixes: &Fixes,
    altitude: Altitude,
    undulation_m: Undulation<'_>,
) -> Result<Heights, TrackError> {
    let (datum, why) = choose(fixes, altitude)?;
    let is_pressure = datum == Datum::Pressure && has_any(&fixes.pressure_m, fixes.zero_is_none);
    let column = if is_pressure { &fixes.pressure_m } else { &fixes.height_m };
    let steps = &fixes.steps;
    let step_m = if is_pressure { steps.pressure_m } else { steps.height_m };
    let mut own = 0_usize;
    // Receivers without a geoid of their own say 0 throughout.
    let knows = fixes.undulation_m.iter().any(|own_m| own_m.is_finite() && *own_m != 0.0);
    let height = |(i, &height_m): (usize, &f64)| {
        let is_none = height_m.is_nan() || (fixes.zero_is_none && height_m == 0.0);
        if is_none && !near_zero(column, i) {
            return f64::NAN;
        }
        let from_file = fixes.undulation_m[i];
        match datum {
            Datum::Ellipsoid => height_m,
            _ if datum == Datum::Msl && from_file.is_finite() && knows => {
                own += 1;
                height_m + from_file
            }
            _ => height_m + undulation_m(fixes.lat_rad[i], fixes.lon_rad[i]),
        }
    };
    let mut height_m: Vec<f64> = column.iter().enumerate().map(height).collect();
    let moved = if is_pressure { 0 } else { fill_by_pressure(fixes, &mut height_m) };
    let geoid = match datum {
        Datum::Ellipsoid => "",
        Datum::Msl if own > 0 => ", by the geoid that the file has",
        Datum::Msl => ", by the geoid EGM96",
        Datum::Pressure => ", taken as heights above sea level of a standard atmosphere",
    };
    let mut assumed = format!("altitudes are {}{geoid}: {why}", datum.words());
    if moved > 0 {
        let by = "pressure altitudes stand for, moved by what they are off around";
        assumed += &format!("; for {moved} that lack {by}");
    }
    Ok(Heights { height_m, step_m, assumed })
}

/// Fills heights that are missing with pressure altitudes, moved by how far these are off in the rows
/// before and after: that changes slowly, which heights do not. Returns how many.
fn fill_by_pressure(fixes: &Fixes, height_m: &mut [f64]) -> usize {
    let is_none =
        |pressure_m: f64| pressure_m.is_nan() || (fixes.zero_is_none && pressure_m == 0.0);
    let mut tracks: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (row, &track) in fixes.track.iter().enumerate() {
        if !is_none(fixes.pressure_m[row]) {
            tracks.entry(track).or_default().push(row);
        }
    }
    let mut moved = 0;
    for rows in tracks.values() {
        let start_ns = fixes.time_ns[rows[0]];
        let seconds = |&row: &usize| (fixes.time_ns[row] - start_ns) as f64 / 1e9;
        let times_s: Vec<f64> = rows.iter().map(seconds).collect();
        let mut off_m: Vec<f64> =
            rows.iter().map(|&row| height_m[row] - fixes.pressure_m[row]).collect();
        // Times that go back would make a line of it run wild.
        if off_m.iter().all(|off| off.is_nan()) || times_s.windows(2).any(|t| t[1] <= t[0]) {
            continue;
        }
        fill(&times_s, &mut off_m);
        for (&row, off) in rows.iter().zip(off_m) {
            if height_m[row].is_nan() {
                height_m[row] = fixes.pressure_m[row] + off;
                moved += 1;
            }
        }
    }
    moved
}

/// Whether a height of 0 may be one: those around it are near the sea, too.
fn near_zero(column: &[f64], i: usize) -> bool {
    let around = &column[i.saturating_sub(3)..(i + 4).min(column.len())];
    let is_near = |height: &f64| height.abs() < 100.0;
    column[i] == 0.0 && around.iter().filter(|height| **height != 0.0).all(is_near)
}

/// Whether a column has heights; all zeros are none where zero means so.
fn has_any(column: &[f64], zero_is_none: bool) -> bool {
    column.iter().any(|height| height.is_finite() && !(zero_is_none && *height == 0.0))
}

fn choose(fixes: &Fixes, altitude: Altitude) -> Result<(Datum, String), TrackError> {
    let format = fixes.format;
    let main = has_any(&fixes.height_m, fixes.zero_is_none);
    let pressure = has_any(&fixes.pressure_m, fixes.zero_is_none);
    if !main && !pressure {
        // At sea, or on a treadmill: zeros are what there is.
        if fixes.height_m.contains(&0.0) && altitude != Altitude::Auto {
            let Altitude::Above(datum) = altitude else { unreachable!("it is not Auto") };
            return Ok((datum, "--altitude says so".into()));
        }
        return Err(TrackError::Empty { format, why: "no fix in it has an altitude".into() });
    }
    let only_pressure = |why: &str| Ok((Datum::Pressure, why.to_owned()));
    match altitude {
        Altitude::Above(Datum::Pressure) => only_pressure("--altitude says so"),
        Altitude::Above(datum) if main => Ok((datum, "--altitude says so".into())),
        Altitude::Above(datum) => {
            let words = datum.words();
            let why = format!("it has pressure altitudes only, and none {words}");
            Err(TrackError::Empty { format, why })
        }
        Altitude::Auto if !main => match &fixes.said {
            Said::Habit(Datum::Pressure, why) | Said::Declared(Datum::Pressure, why) => {
                only_pressure(why)
            }
            _ => only_pressure("it has no others"),
        },
        Altitude::Auto => match &fixes.said {
            Said::Declared(datum, why) => Ok((*datum, why.clone())),
            Said::Habit(datum, why) => Ok((*datum, format!("assumed, as {why}"))),
            Said::Unknown(why) => Err(TrackError::Datum { format, why: why.clone() }),
        },
    }
}

/// Forgets heights that nothing climbs to and back from so fast. Returns how many.
pub(crate) fn forget_spikes(times_s: &[f64], heights_m: &mut [f64]) -> usize {
    let mut spikes = 0;
    let mut last: Option<usize> = None;
    for i in 0..heights_m.len() {
        if !heights_m[i].is_finite() {
            continue;
        }
        let next = (i + 1..heights_m.len()).find(|&next| heights_m[next].is_finite());
        let is_far = |other: usize| {
            let wait_s = (times_s[i] - times_s[other]).abs();
            (heights_m[i] - heights_m[other]).abs() > SPIKE_M + SPIKE_MPS * wait_s
        };
        let is_spike = match (last, next) {
            (Some(last), Some(next)) => {
                let rise_m = (heights_m[next] - heights_m[last]).abs();
                let wait_s = times_s[next] - times_s[last];
                is_far(last) && is_far(next) && rise_m <= SPIKE_M + SPIKE_MPS * wait_s
            }
            _ => false,
        };
        if is_spike {
            heights_m[i] = f64::NAN;
            spikes += 1;
        } else {
            last = Some(i);
        }
    }
    spikes
}

/// Fills what is missing between heights on a line in time, and at the ends with the nearest.
/// Returns how many were missing; all of them where there is no height at all.
pub(crate) fn fill(times_s: &[f64], heights_m: &mut [f64]) -> usize {
    let known: Vec<usize> = (0..heights_m.len()).filter(|&i| heights_m[i].is_finite()).collect();
    let missing = heights_m.len() - known.len();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else { return missing };
    let (before, after) = (heights_m[first], heights_m[last]);
    heights_m[..first].fill(before);
    heights_m[last..].fill(after);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for i in a + 1..b {
            let t = (times_s[i] - times_s[a]) / (times_s[b] - times_s[a]);
            heights_m[i] = heights_m[a] + (heights_m[b] - heights_m[a]) * t;
        }
    }
    missing
}

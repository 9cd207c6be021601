//! Where the sun stands overhead: at a fixed place, or as the time of day has it.
//!
//! In:    [`SunSettings`], the time of the flight.
//! Out:   the body-fixed direction towards the sun, within [`ERROR_DEG`] of the true one.
//! Keeps: nothing.
//! Not here: light and colour (`render_vk`), the text of a time (`overfly_config`).
//! Source: The Astronomical Almanac, section C, low-precision formulas for the Sun's coordinates.

use crate::geodesy::trig;
use crate::settings::SunSettings;
use glam::DVec3;

/// Bound of the error of [`direction_at_utc`] from 1850 to 2149, in degrees. 0.0135 is what it
/// differs at most from an ephemeris, 0.004 what the Earth's turn may differ from UTC; the sun's
/// disc measures half a degree.
pub const ERROR_DEG: f64 = 0.02;

/// 2000-01-01T12:00:00Z in seconds since 1970-01-01T00:00:00Z: where the formulas begin.
const J2000_UNIX_S: f64 = 946_728_000.0;
const DAY_S: f64 = 86_400.0;

impl SunSettings {
    /// Body-fixed unit vector towards the sun at a time of the flight in seconds. A time that is
    /// no number counts as the flight's beginning.
    pub fn direction_at(&self, time_s: f64) -> DVec3 {
        match *self {
            Self::Fixed { direction } => direction,
            Self::Clock { start_unix_s, runs } => {
                let gone_s = if runs && time_s.is_finite() { time_s } else { 0.0 };
                direction_at_utc(start_unix_s + gone_s)
            }
        }
    }
}

/// Body-fixed unit vector from the Earth towards the sun, `unix_s` seconds of UTC after
/// 1970-01-01T00:00:00Z, without leap seconds. Where it meets the ellipsoid's normal the sun is
/// overhead: no parallax, no refraction.
pub fn direction_at_utc(unix_s: f64) -> DVec3 {
    let days = (unix_s - J2000_UNIX_S) / DAY_S;
    // Seen from the Earth: mean longitude and anomaly, longitude along the ecliptic, its tilt.
    let mean_deg = turned_deg(280.460, 0.985_647_4, days);
    let anomaly_rad = turned_deg(357.528, 0.985_600_3, days).to_radians();
    let centre_deg = 1.915 * trig::sin(anomaly_rad) + 0.020 * trig::sin(2.0 * anomaly_rad);
    let along_rad = (mean_deg + centre_deg).to_radians();
    let tilt_rad = (23.439 - 4e-7 * days).to_radians();
    let (x, y) = (trig::cos(along_rad), trig::sin(along_rad));
    let (y, z) = (trig::cos(tilt_rad) * y, trig::sin(tilt_rad) * y);
    // From the stars to the turning Earth: mean sidereal time at Greenwich.
    let turn_rad = turned_deg(280.460_618_37, 360.985_647_366_29, days).to_radians();
    let (cos, sin) = (trig::cos(turn_rad), trig::sin(turn_rad));
    DVec3::new(cos * x + sin * y, cos * y - sin * x, z).normalize()
}

/// An angle that grows evenly from where it was at J2000, less its whole turns.
fn turned_deg(start_deg: f64, deg_per_day: f64, days: f64) -> f64 {
    (start_deg + deg_per_day * days) % 360.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesy::Geodetic;

    fn angle_deg(a: DVec3, b: DVec3) -> f64 {
        // The arc cosine would lose small angles.
        (2.0 * trig::atan2((a - b).length(), (a + b).length())).to_degrees()
    }

    /// (UTC, latitude and longitude beneath the sun) of an ephemeris: VSOP87 with aberration and
    /// nutation, as `PyEphem` 4.2.1 has it. The first four are the equinoxes and solstices of 2026,
    /// the next two the extremes of the equation of time (−14.2 and +16.4 minutes).
    const KNOWN: [(f64, f64, f64); 10] = [
        (1_774_017_960.0, 0.0001, -39.6493),
        (1_782_030_240.0, 23.4379, 54.4461),
        (1_790_121_900.0, 0.0, 176.8868),
        (1_797_886_200.0, -23.4374, -132.9381),
        (1_770_811_200.0, -13.9272, 3.5438),
        (1_793_707_200.0, -15.1510, -4.1117),
        (1_782_043_200.0, 23.4379, 0.4543),
        (946_728_000.0, -23.0324, 0.8214),
        (-615_232_800.0, 22.9333, 91.0330),
        (2_519_587_800.0, -15.4019, -146.6112),
    ];

    #[test]
    fn the_sun_is_within_its_error_of_an_ephemeris() {
        for (unix_s, lat_deg, lon_deg) in KNOWN {
            let known = Geodetic::from_degrees(lat_deg, lon_deg, 0.0).normal();
            let found = direction_at_utc(unix_s);
            let error_deg = angle_deg(found, known);
            assert!(error_deg < ERROR_DEG, "{unix_s}: {error_deg}");
            assert!((found.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn it_rises_in_the_east_six_hours_before_noon_at_an_equinox() {
        // 2026-03-20: the equation of time is −7.5 minutes, so noon at Greenwich is at 12:07:30.
        let noon_unix_s = 1_774_008_450.0;
        let here = Geodetic::from_degrees(47.0, 0.0, 0.0);
        let sunrise = direction_at_utc(noon_unix_s - 6.0 * 3600.0);
        assert!(sunrise.dot(here.normal()).abs() < 0.003, "on the horizon, to within 0.2°");
        assert!(angle_deg(sunrise, DVec3::Y) < 0.2, "due east");
        let noon = direction_at_utc(noon_unix_s);
        assert!(
            (angle_deg(noon, here.normal()) - 47.0).abs() < 0.6,
            "as high as the latitude says"
        );
        assert!(direction_at_utc(noon_unix_s + 6.0 * 3600.0).y < -0.999, "sets in the west");
    }

    #[test]
    fn a_running_clock_goes_on_with_the_flight_and_a_stopped_one_does_not() {
        let (start_unix_s, hour_s) = (KNOWN[1].0, 3600.0);
        let clock = SunSettings::Clock { start_unix_s, runs: true };
        assert_eq!(clock.direction_at(0.0), direction_at_utc(start_unix_s));
        assert_eq!(clock.direction_at(hour_s), direction_at_utc(start_unix_s + hour_s));
        // Along the tropic: 15° of longitude are 15° times the cosine of the latitude.
        let moved_deg = angle_deg(clock.direction_at(0.0), clock.direction_at(hour_s));
        assert!((moved_deg - 13.75).abs() < 0.1, "{moved_deg}");
        assert_eq!(clock.direction_at(f64::NAN), clock.direction_at(0.0));
        let stopped = SunSettings::Clock { start_unix_s, runs: false };
        assert_eq!(stopped.direction_at(hour_s), clock.direction_at(0.0));
        let fixed = SunSettings::Fixed { direction: DVec3::Z };
        assert_eq!(fixed.direction_at(hour_s), DVec3::Z);
    }
}

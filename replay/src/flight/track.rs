//! Smooth tracks over a body, as unit normals.
//!
//! In:    points, azimuths, times.
//! Out:   positions and headings; progress that starts and stops gently.
//! Keeps: nothing.
//! Not here: which track (`descent`, `poles`).

use core::f64::consts::TAU;
use glam::DVec3;
use overfly_core::geodesy::Geodetic;
use overfly_core::geodesy::trig::{atan2, cos, hypot, sin};

/// The geodetic position with this unit normal.
pub(super) fn geodetic(normal: DVec3, height_m: f64) -> Geodetic {
    let across = hypot(normal.x, normal.y);
    Geodetic { lat_rad: atan2(normal.z, across), lon_rad: atan2(normal.y, normal.x), height_m }
}

/// The compass heading in [0, 2π) of a body-fixed direction at `at`.
///
/// Next to a pole the heading turns as fast as the meridians do, in just such a way that the
/// direction in body-fixed axes, and so the picture, does not.
pub(super) fn heading(at: Geodetic, direction: DVec3) -> f64 {
    let axes = at.enu_axes();
    let angle = atan2(direction.dot(axes.x_axis), direction.dot(axes.y_axis));
    if angle < 0.0 { angle + TAU } else { angle }
}

/// The normal `angle_rad` away from `normal` along the great circle that leaves at `azimuth_rad`.
pub(super) fn away(normal: DVec3, azimuth_rad: f64, angle_rad: f64) -> DVec3 {
    let axes = geodetic(normal, 0.0).enu_axes();
    let along = axes.x_axis * sin(azimuth_rad) + axes.y_axis * cos(azimuth_rad);
    normal * cos(angle_rad) + along * sin(angle_rad)
}

/// From 0 at u = 0 to 1 at u = 1, with no slope at either end; constant outside.
pub(super) fn smooth_step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

/// A speed that rises smoothly from 0 to 1, stays, falls smoothly to 0 and stays there.
pub(super) struct Ramp {
    /// Seconds of rising.
    pub(super) up_s: f64,
    /// Seconds of falling.
    pub(super) down_s: f64,
    /// When it is 0 again, in seconds; at least the two together.
    pub(super) end_s: f64,
}

impl Ramp {
    /// The speed: once continuously differentiable.
    pub(super) fn speed(&self, time_s: f64) -> f64 {
        smooth_step(time_s / self.up_s) * smooth_step((self.end_s - time_s) / self.down_s)
    }

    /// The way since time 0 in seconds at full speed: twice continuously differentiable.
    pub(super) fn way_s(&self, time_s: f64) -> f64 {
        // The integral of the smooth step from 0 to u.
        let eased = |u: f64| u * u * u * (1.0 - u / 2.0);
        if time_s < self.up_s {
            self.up_s * eased((time_s / self.up_s).max(0.0))
        } else if time_s <= self.end_s - self.down_s {
            time_s - self.up_s / 2.0
        } else {
            let left = ((self.end_s - time_s) / self.down_s).max(0.0);
            self.total_s() - self.down_s * eased(left)
        }
    }

    /// The whole way.
    pub(super) fn total_s(&self) -> f64 {
        self.end_s - (self.up_s + self.down_s) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_the_integral_of_the_speed() {
        let ramp = Ramp { up_s: 3.0, down_s: 5.0, end_s: 20.0 };
        let (mut way, steps) = (0.0, 200_000);
        for i in 0..steps {
            let middle_s = (f64::from(i) + 0.5) * 25.0 / f64::from(steps);
            way += ramp.speed(middle_s) * 25.0 / f64::from(steps);
            let end_s = f64::from(i + 1) * 25.0 / f64::from(steps);
            assert!((ramp.way_s(end_s) - way).abs() < 1e-8, "at {end_s} s");
        }
        assert!((way - ramp.total_s()).abs() < 1e-8);
    }

    #[test]
    fn going_away_north_and_east_is_as_on_a_map() {
        let start = Geodetic { lat_rad: 0.5, lon_rad: 1.0, height_m: 0.0 };
        let north = geodetic(away(start.normal(), 0.0, 0.1), 7.0);
        assert!((north.lat_rad - 0.6).abs() < 1e-15 && (north.lon_rad - 1.0).abs() < 1e-15);
        assert_eq!(north.height_m, 7.0);
        let east = geodetic(away(start.normal(), TAU / 4.0, 1e-6), 0.0);
        assert!(east.lon_rad > 1.0 && (east.lat_rad - 0.5).abs() < 1e-11);
        let west = away(start.normal(), -TAU / 4.0, 0.1) - start.normal();
        assert!((heading(start, west) - 0.75 * TAU).abs() < 1e-12);
    }
}

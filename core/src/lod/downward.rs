//! Ground below the eye: how large the picture can show an error of it, wherever it is.
//!
//! In:    a camera; how much lower ground lies at least, how far its normals are from the eye's.
//! Out:   its lens distance (`screen_error`), and by how much that is beyond a reach.
//! Keeps: nothing; [`Downward`] is made once a frame for each view.
//! Not here: where a region is; errors.
//!
//! A leaf may be as large as it is far, and then its nearest corner lies below the picture. What the
//! picture shows of it is farther off: at p on a screen at unit depth, with n = (n⊥, n_f) the eye's
//! normal in axes of the camera, a point at depth z is z·L(p) lower than the eye at most, where
//! L(p) = −(n⊥·p + n_f): height above a convex body is a convex function, and n is its gradient
//! at the eye. So ground that is b lower has 1/z ≤ L(p)/b. A vertical error of a metre moves it by
//! |n⊥ − n_f·p|/z over the screen; normals a chord δ away from the eye's change that by δ·√(1 + p²)/z at
//! most. With G = max L·|n⊥ − n_f·p| over the picture, where L is above 0, C the cosine of the picture's
//! corner and W = max L/C the lens distance is at least b/(G + δW).
//!
//! Certainty. A change of n by ν changes L and |n⊥ − n_f·p| by ν/C, so G by 2ν/C² and W by ν/C²; a metre
//! of way changes n by one over the radius of curvature, and δ by as much. A rotation that changes the
//! planes' normals by φ is one by √2·φ/C at most. A share of p changes G by twice that share over C².

use super::margin::{Margin, greater};
use crate::camera::Camera;
use glam::{DVec2, DVec3};

/// The picture is looked at in squares, this many a side: in each the greatest L counts with the
/// greatest |n⊥ − n_f·p|.
const SQUARES: usize = 8;

/// Verdicts last for no greater turn or drift than this: products of changes stay small.
const TURN_MAX: f64 = 0.1;

/// What one view shows of ground below its eye.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Downward {
    /// G: lens distance is the way down over this, where all normals are the eye's.
    steepness: f64,
    /// W: by how much more, for each unit of chord between normals.
    leaning: f64,
    /// 1/C.
    corner_secant: f64,
    /// By how much the eye's normal turns for each metre of way, at most.
    turn_per_m: f64,
}

impl Downward {
    /// Of a camera that is at least `deepest_m` from where normals meet, as long as verdicts last.
    pub fn new(camera: &Camera, deepest_m: f64) -> Self {
        let along = |axis: DVec3| camera.normal.dot(axis);
        let (across, ahead) =
            (DVec2::new(along(camera.right), along(camera.up)), along(camera.forward));
        let [half_x, half_y] = camera.half_tangents;
        // L and the squared |n⊥ − n_f·p| at the corners of a row of squares.
        let corners_of = |row: usize| {
            let share = |index: usize| 2.0 * index as f64 / SQUARES as f64 - 1.0;
            core::array::from_fn(|column| {
                let p = DVec2::new(half_x * share(column), half_y * share(row));
                [-(across.dot(p) + ahead), (across - ahead * p).length_squared()]
            })
        };
        let (mut steepest2, mut lowest) = (0.0, 0.0);
        let mut above: [[f64; 2]; SQUARES + 1] = corners_of(0);
        for row in 1..=SQUARES {
            let below: [[f64; 2]; SQUARES + 1] = corners_of(row);
            for column in 0..SQUARES {
                let corners = [above[column], above[column + 1], below[column], below[column + 1]];
                // Both are convex, so neither is greater within a square than at its corners.
                let [lower, moved2] =
                    [0, 1].map(|of| corners.map(|c| c[of]).into_iter().fold(0.0, greater));
                steepest2 = greater(steepest2, lower * lower * moved2);
                lowest = greater(lowest, lower);
            }
            above = below;
        }
        let corner_secant = camera.corner_factor.sqrt();
        // Rounding of L, where the horizon is at the picture's edge.
        let rounding = 1e-12 * camera.corner_factor;
        Self {
            steepness: steepest2.sqrt() + rounding,
            leaning: lowest * corner_secant + rounding,
            corner_secant,
            turn_per_m: 1.0 / deepest_m,
        }
    }

    /// Not more than the lens distance of ground that is `lower_m` lower than the eye, with normals
    /// within `chord` of the eye's.
    pub fn lens_distance_m(&self, lower_m: f64, chord: f64) -> f64 {
        lower_m / (self.steepness + chord * self.leaning)
    }

    /// By how much that is beyond `reach_m`, in metres of way down.
    pub fn margin(&self, lower_m: f64, chord: f64, reach_m: f64) -> Margin {
        let shown = self.steepness + chord * self.leaning;
        let secant2 = self.corner_secant * self.corner_secant;
        let per_turn = (2.0 + chord) * secant2;
        let turned = 1.5 * self.corner_secant * per_turn;
        let margin = Margin {
            slack_m: lower_m - reach_m * shown,
            per_m: 1.0 + reach_m * self.turn_per_m * (per_turn + secant2),
            per_radian_m: reach_m * (turned + shown),
        };
        let most_m = TURN_MAX * margin.per_radian_m;
        let slack_m = margin.slack_m.clamp(-most_m, most_m);
        Margin { slack_m, ..margin }.rounded(greater(lower_m.abs(), reach_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{View, orientation_from_attitude};
    use crate::digest::mix;
    use crate::geodesy::{Ecef, Ellipsoid, Geodetic};
    use crate::units::Radians;

    fn unit(seed: u64) -> f64 {
        (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Something between 1 and 2^(octaves + 1), mostly amid them.
    fn spread(seed: u64, octaves: u64) -> f64 {
        let octave = (0..octaves).filter(|at| unit(seed ^ at << 40) < 0.5).count();
        f64::from(1_u32 << octave) * (1.0 + unit(seed))
    }

    /// A camera somewhere, at some attitude, with some lens.
    fn camera(seed: u64) -> Camera {
        let random = |at: u64| unit(seed * 16 + at);
        let at = Geodetic::from_degrees(
            180.0 * random(0) - 90.0,
            360.0 * random(1) - 180.0,
            spread(seed * 16 + 2, 30),
        );
        let angle =
            |share: f64, most_deg: f64| Radians::from_degrees(most_deg * (2.0 * share - 1.0));
        let [heading, pitch, roll] =
            [angle(random(3), 180.0), angle(random(4), 90.0), angle(random(5), 60.0)];
        let view = View {
            eye: Ellipsoid::WGS84.ecef_from_geodetic(at),
            orientation: orientation_from_attitude(at, heading, pitch, roll),
            field_of_view: Radians::from_degrees(1.0 + 119.0 * random(6)),
            size_px: [1280, 720],
            near_m: 0.1,
        };
        Camera::new(&view, &Ellipsoid::WGS84)
    }

    #[test]
    fn no_ground_in_the_picture_shows_more_than_the_lens_distance_says() {
        let body = Ellipsoid::WGS84;
        let (mut seen, mut tightest) = (0, 0.0_f64);
        let rays = (0..4_000).flat_map(|seed| (0..8).map(move |ray| (seed, ray)));
        for (seed, ray) in rays {
            let camera = camera(seed);
            let downward = Downward::new(&camera, 6e6);
            let share = |axis: u64| 2.0 * unit(seed << 8 | ray << 1 | axis) - 1.0;
            let p = DVec2::new(share(0), share(1)) * DVec2::from(camera.half_tangents);
            let z = spread(seed << 9 | ray, 30);
            let way = (camera.forward + camera.right * p.x + camera.up * p.y) * z;
            let ground = body.geodetic_from_ecef(Ecef(camera.eye.0 + way));
            let lower_m = camera.height_m - ground.height_m;
            // How far a metre upward moves the place on a screen at unit depth.
            let normal = ground.normal();
            let across = DVec2::new(normal.dot(camera.right), normal.dot(camera.up));
            let shown = (across - normal.dot(camera.forward) * p).length() / z;
            if lower_m > 0.0 {
                let chord = (normal - camera.normal).length();
                let lens_m = downward.lens_distance_m(lower_m, chord);
                assert!(shown * lens_m < 1.0 + 1e-9, "{seed} {ray}: {}", shown * lens_m);
                tightest = tightest.max(shown * lens_m);
                seen += 1;
            }
        }
        assert!(seen > 5_000 && tightest > 0.9, "{seen}, {tightest}");
    }

    #[test]
    fn a_camera_that_looks_up_sees_nothing_below_itself() {
        let at = Geodetic::from_degrees(10.0, 20.0, 1000.0);
        let up =
            orientation_from_attitude(at, Radians(0.0), Radians::from_degrees(80.0), Radians(0.0));
        let view = View {
            eye: Ellipsoid::WGS84.ecef_from_geodetic(at),
            orientation: up,
            field_of_view: Radians::from_degrees(10.0),
            size_px: [720, 720],
            near_m: 0.1,
        };
        let downward = Downward::new(&Camera::new(&view, &Ellipsoid::WGS84), 6e6);
        assert!(downward.lens_distance_m(1.0, 0.0) > 1e9);
    }
}

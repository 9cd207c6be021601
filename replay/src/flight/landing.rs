//! Where a descent comes down.
//!
//! In:    the body and its ground.
//! Out:   the place and the side from which it is approached.
//! Keeps: nothing.
//! Not here: the way there (`descent`).

use super::track::{away, geodetic};
use core::f64::consts::TAU;
use glam::DVec3;
use overfly_core::geodesy::trig::{cos, sin};
use overfly_core::geodesy::{Ellipsoid, Geodetic};

/// Places looked at, evenly spread around the middle of the search.
const PLACES: u32 = 2000;
/// Points on each ring about a place, and sides from which it can be approached.
const SIDES: u32 = 12;
/// Steps in which the ground of a roll is looked at.
const ROLL_POINTS: u32 = 16;
/// Metres of relief that a metre of roughness of the roll outweighs.
const ROUGH: f64 = 300.0;
/// Latitude and longitude of the middle of the search: where the presets' sun stands low and
/// gives relief.
const MIDDLE_DEG: [f64; 2] = [42.0, -122.0];
/// The search covers normals within this of the middle's, as 1 − cosine: 20° around it.
const CAP: f64 = 0.06;
/// The golden angle, in radians.
const GOLDEN: f64 = 2.399_963_229_728_653;

/// Where a descent comes down.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Landing {
    /// Normal at the centre of the spiral, just beyond the end.
    pub(super) centre: DVec3,
    /// Side from which it is approached: azimuth from the centre to the approaching aircraft.
    pub(super) azimuth_rad: f64,
}

/// The ground, by normals; lengths shrink with the body.
struct Ground<'a> {
    height_m: &'a dyn Fn(Geodetic) -> f64,
    radius_m: f64,
    /// 1 on the Earth and larger bodies.
    scale: f64,
}

/// How good a place is: compared part by part.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Merit {
    /// 3: land of the right height by a coast; 2: of the right height; 1: land; 0: none of it.
    rank: u8,
    /// Metres of relief around, less [`ROUGH`] times the roughness of the best roll.
    relief_m: f64,
}

/// The best of [`PLACES`] fixed places: land between 100 m and 1500 m, with ground below 0 within
/// 30 km if possible, then the one with the most relief around it and the flattest way to roll.
/// Lengths shrink with bodies smaller than the Earth. Among equals, the first.
pub(super) fn choose(body: &Ellipsoid, ground_height_m: &dyn Fn(Geodetic) -> f64) -> Landing {
    let scale = (body.a_m / Ellipsoid::WGS84.a_m).min(1.0);
    let ground = Ground { height_m: ground_height_m, radius_m: body.a_m, scale };
    let mut best = place(0);
    let mut most = ground.less_rough(ground.merit(best), best);
    for i in 1..PLACES {
        let centre = place(i);
        let at_most = ground.merit(centre);
        // Rolls are looked at only where they can decide.
        if at_most <= most {
            continue;
        }
        let merit = ground.less_rough(at_most, centre);
        if merit > most {
            (best, most) = (centre, merit);
        }
    }
    Landing { centre: best, azimuth_rad: ground.approach(best) }
}

fn place(i: u32) -> DVec3 {
    let axes = Geodetic::from_degrees(MIDDLE_DEG[0], MIDDLE_DEG[1], 0.0).enu_axes();
    let up = 1.0 - CAP * (2.0 * f64::from(i) + 1.0) / (2.0 * f64::from(PLACES));
    let across = (1.0 - up * up).sqrt();
    let turn_rad = GOLDEN * f64::from(i);
    axes * DVec3::new(across * cos(turn_rad), across * sin(turn_rad), up)
}

fn azimuth(side: u32) -> f64 {
    TAU * f64::from(side) / f64::from(SIDES)
}

impl Ground<'_> {
    fn at(&self, normal: DVec3) -> f64 {
        (self.height_m)(geodetic(normal, 0.0))
    }

    /// The ground `distance_m` (on the Earth) away from `centre`.
    fn around(&self, centre: DVec3, side: u32, distance_m: f64) -> f64 {
        self.at(away(centre, azimuth(side), distance_m * self.scale / self.radius_m))
    }

    /// How far the ground of the roll strays from level, in metres: 300 m are looked at, which
    /// shrink for tiny bodies only.
    fn roughness(&self, centre: DVec3, side: u32) -> f64 {
        let step = (300.0 / self.radius_m).min(0.06) / f64::from(ROLL_POINTS);
        let height = |i: u32| self.at(away(centre, azimuth(side), step * f64::from(i)));
        let (mut low_m, mut high_m) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..=ROLL_POINTS {
            let height_m = height(i);
            (low_m, high_m) = (low_m.min(height_m), high_m.max(height_m));
        }
        high_m - low_m
    }

    /// The merit of a place but for its roughness.
    fn merit(&self, centre: DVec3) -> Merit {
        let here_m = self.at(centre);
        let right = (100.0 * self.scale..1500.0 * self.scale).contains(&here_m);
        if !right {
            return Merit { rank: u8::from(here_m > 0.0), relief_m: 0.0 };
        }
        let (mut lowest_m, mut highest_m) = (here_m, here_m);
        for side in 0..SIDES {
            for distance_m in [8_000.0, 16_000.0, 28_000.0] {
                let ring_m = self.around(centre, side, distance_m);
                lowest_m = lowest_m.min(ring_m);
                highest_m = highest_m.max(ring_m);
            }
        }
        let rank = 2 + u8::from(lowest_m < 0.0);
        Merit { rank, relief_m: highest_m - lowest_m.max(0.0) }
    }

    fn less_rough(&self, merit: Merit, centre: DVec3) -> Merit {
        if merit.rank < 2 {
            return merit;
        }
        let least_m =
            (0..SIDES).map(|side| self.roughness(centre, side)).fold(f64::INFINITY, f64::min);
        Merit { relief_m: merit.relief_m - ROUGH * least_m, ..merit }
    }

    /// The side with the lowest ground, where a rough roll counts most.
    fn approach(&self, centre: DVec3) -> f64 {
        let cost_m = |side: u32| {
            let way_m: f64 = [1_000.0, 3_000.0, 10_000.0, 25_000.0]
                .map(|distance_m| self.around(centre, side, distance_m).max(0.0))
                .iter()
                .sum();
            way_m + ROUGH * self.roughness(centre, side)
        };
        let (mut best, mut least_m) = (0, cost_m(0));
        for side in 1..SIDES {
            let cost_m = cost_m(side);
            if cost_m < least_m {
                (best, least_m) = (side, cost_m);
            }
        }
        azimuth(best)
    }
}

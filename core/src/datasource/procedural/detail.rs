//! Fine ground below real elevation: octaves that fade in where the data's samples end.
//!
//! In:    where real samples end, how rough they are, unit surface normals.
//! Out:   heights to add, and bounds on what was added.
//! Keeps: the octaves.
//! Not here: real elevation (`tile`), where its samples are (`compose`).

use super::ProceduralSettings;
use super::noise::{Lattice, Lattices, PEAK, mix};
use glam::DVec3;

/// Octaves below real elevation, from longest to shortest, four evaluated together.
pub struct Detail {
    radius_m: f64,
    strength: f64,
    fours: Vec<Four>,
}

struct Four {
    lattices: Lattices<4>,
    wavelengths_m: [f64; 4],
}

/// No detail is longer: coarser data than this has its own ground made between the samples.
const LONGEST_M: f64 = 60_000.0;
const RATIO: f64 = 2.5;
/// Amplitude per wavelength of smooth ground, and what full roughness adds.
const SMOOTH: f64 = 0.003;
const ROUGH: f64 = 0.030;
/// The bounds of one octave per amplitude; as in `bounds`, where they are argued.
const CURVATURE: f64 = 5.0;
const RESIDUAL_CAP: f64 = 1.2;
const SLOPE: f64 = 4.0;
const VARIATION_CAP: f64 = 2.0;
/// Greatest slope of the fading per step, and greatest residual per squared step.
const FADE_SLOPE: f64 = 4.4;
const FADE_CURVATURE: f64 = 10.0;

impl Detail {
    /// The detail of a planet; `strength` 0 has none.
    pub fn new(settings: &ProceduralSettings, strength: f64) -> Self {
        let mut seed = settings.seed ^ 0x4445_5441_494C;
        let mut next = || {
            seed = mix(seed.wrapping_add(0x9E37_79B9_7F4A_7C15));
            seed
        };
        let mut wavelength_m = LONGEST_M.min(settings.radius_m);
        let mut fours = Vec::new();
        while wavelength_m >= settings.finest_m && strength > 0.0 {
            let wavelengths_m =
                [1.0, RATIO, RATIO * RATIO, RATIO * RATIO * RATIO].map(|part| wavelength_m / part);
            let lattices =
                Lattices::new(wavelengths_m.map(|length_m| Lattice::new(length_m, next())));
            fours.push(Four { lattices, wavelengths_m });
            wavelength_m /= RATIO * RATIO * RATIO * RATIO;
        }
        Self { radius_m: settings.radius_m, strength, fours }
    }

    /// Height to add in the direction `n`, between samples `step_m` apart, where the ground is
    /// rough from 0 to 1. `between` is the place in the cell of samples; at samples nothing is
    /// added, so real heights stay what they are.
    pub fn height_m(&self, n: DVec3, step_m: f64, roughness: f64, between: [f64; 2]) -> f64 {
        let fade = fade_of(between);
        if fade <= 0.0 || self.strength <= 0.0 {
            return 0.0;
        }
        let at_m = n * self.radius_m;
        let mut height_m = 0.0;
        for four in self.fours.iter().filter(|four| four.wavelengths_m[3] <= step_m) {
            let values = four.lattices.fine_values(at_m);
            let waves = four.wavelengths_m.into_iter().zip(values);
            for (wavelength_m, value) in waves.filter(|(length_m, _)| *length_m <= step_m) {
                height_m += self.amplitude_m(wavelength_m, roughness) * value;
            }
        }
        height_m * fade
    }

    /// Bound on how far a triangle with edges of `edge_m` strays from the detail over it.
    pub fn residual_m(&self, edge_m: f64, step_m: f64, roughness: f64) -> f64 {
        let steps = edge_m / step_m;
        let fade = (FADE_CURVATURE * steps * steps).min(1.0);
        let fade_change = (FADE_SLOPE * steps).min(1.0);
        self.sum(step_m, roughness, |wavelength_m| {
            let edges = edge_m / wavelength_m;
            let own = (CURVATURE * edges * edges).min(RESIDUAL_CAP);
            own + fade_change * (SLOPE * edges).min(VARIATION_CAP) + PEAK * fade
        })
        .min(self.most_m(step_m, roughness))
    }

    /// Bound on the difference of the detail at two places at most `distance_m` apart.
    pub fn variation_m(&self, distance_m: f64, step_m: f64, roughness: f64) -> f64 {
        let fade_change = (FADE_SLOPE * distance_m / step_m).min(1.0);
        self.sum(step_m, roughness, |wavelength_m| {
            (SLOPE * distance_m / wavelength_m).min(VARIATION_CAP) + PEAK * fade_change
        })
        .min(self.most_m(step_m, roughness))
    }

    /// The greatest difference that detail can make at all.
    pub fn most_m(&self, step_m: f64, roughness: f64) -> f64 {
        self.sum(step_m, roughness, |_| 2.0 * PEAK)
    }

    fn sum(&self, step_m: f64, roughness: f64, share: impl Fn(f64) -> f64) -> f64 {
        let lengths = self.fours.iter().flat_map(|four| four.wavelengths_m);
        let shorter = lengths.filter(|length_m| *length_m <= step_m);
        shorter.map(|length_m| self.amplitude_m(length_m, roughness) * share(length_m)).sum()
    }

    fn amplitude_m(&self, wavelength_m: f64, roughness: f64) -> f64 {
        self.strength * (SMOOTH + ROUGH * roughness) * wavelength_m
    }
}

/// 0 with all its slopes at the four samples of a cell, 1 along the middle of it.
fn fade_of(between: [f64; 2]) -> f64 {
    let [u, v] = between.map(|f| {
        let bulge = f * (1.0 - f);
        1.0 - 16.0 * bulge * bulge
    });
    1.0 - u * v
}

#[cfg(test)]
mod tests {
    use super::super::Style;
    use super::*;

    fn detail() -> Detail {
        let settings = ProceduralSettings {
            seed: 7,
            radius_m: 6_371_000.0,
            style: Style::Earthlike,
            relief: 1.0,
            finest_m: 0.15,
        };
        Detail::new(&settings, 1.0)
    }

    fn unit(seed: u64) -> f64 {
        (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn samples_keep_their_heights_and_the_ground_between_them_moves() {
        let (detail, n) = (detail(), DVec3::new(0.36, 0.48, 0.8));
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            assert_eq!(detail.height_m(n, 60.0, 0.7, corner), 0.0);
        }
        assert!(detail.height_m(n, 60.0, 0.7, [0.5, 0.3]).abs() > 1e-3);
    }

    #[test]
    fn detail_stays_within_its_bounds() {
        let detail = detail();
        let (step_m, roughness) = (60.0, 0.8);
        for seed in 0..4000_u64 {
            let random = |i: u64| unit(seed * 16 + i);
            let n = DVec3::new(random(0) - 0.5, random(1) - 0.5, random(2) - 0.5).normalize();
            let far_m = step_m * 0.5 * random(3);
            let away = DVec3::new(random(4) - 0.5, random(5) - 0.5, random(6) - 0.5);
            let side = (away - n * n.dot(away)).normalize() * (far_m / detail.radius_m);
            let place = [0.25 + 0.25 * random(7), 0.25];
            let moved = [place[0] + far_m / step_m, place[1]];
            let middle = [place[0] + far_m / step_m / 2.0, place[1]];
            let at = |n: DVec3, at| detail.height_m(n.normalize(), step_m, roughness, at);
            let (a, b, c) = (at(n, place), at(n + side, moved), at(n + side / 2.0, middle));
            assert!((a - b).abs() <= detail.variation_m(far_m, step_m, roughness), "{far_m}");
            let strayed = (c - (a + b) / 2.0).abs();
            assert!(strayed <= detail.residual_m(far_m, step_m, roughness), "{far_m}: {strayed}");
        }
    }
}

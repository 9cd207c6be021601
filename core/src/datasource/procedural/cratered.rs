//! The cratered planet: highlands, maria, craters of every size, no air and no sea.
//!
//! In:    the settings once, then unit surface normals.
//! Out:   samples, and the terms of the planet's bounds.
//! Keeps: lattices and size classes.
//! Not here: the shape of one crater (`craters`).

use glam::DVec3;

use super::bounds::{Bounds, Growth, SMOOTH, Term};
use super::craters::{Craters, Dent};
use super::noise::{Lattice, PEAK, mix, ramp};
use super::{Layers, ProceduralSettings, Sample, byte};

/// The cratered planet.
pub(super) struct Cratered {
    radius_m: f64,
    /// Factor on heights that belong to the body as a whole; 1 on a body of the Moon's size.
    vertical: f64,
    relief: f64,
    swell: [Lattice; 2],
    maria: [Lattice; 2],
    octaves: Vec<Octave>,
    /// Deepest and highest that all craters together may go.
    craters_m: [f64; 2],
}

/// One wavelength of ground, and the craters of that size where it is long enough for any.
struct Octave {
    ground: Lattice,
    wavelength_m: f64,
    amplitude_m: f64,
    craters: Option<Craters>,
    /// Share of the craters' depth that is left on the smoothest ground.
    in_maria: f64,
}

const MOON_RADIUS_M: f64 = 1_737_400.0;
/// Ruggedness in the middle of a mare.
const MARE: f64 = 0.15;
/// Cells of the smallest craters, in metres.
const SMALLEST_CELL_M: f64 = 4.0;
/// Calibrated: wavelengths of swell, maria and craters as octaves, steepest change of ruggedness.
const SWELL_KM: f64 = 1500.0;
const MARE_KM: f64 = 300.0;
const CRATER: f64 = 0.33;
const CRATER_DEPTH: f64 = 0.4;
const RUGGEDNESS_SLOPE_PER_KM: f64 = 0.08;
const SWELL_M: f64 = 1800.0;
const MARE_DEPTH_M: f64 = 1900.0;

impl Cratered {
    pub(super) fn new(settings: &ProceduralSettings) -> (Cratered, Bounds) {
        let size = settings.radius_m / MOON_RADIUS_M;
        let half = size.sqrt();
        let eighth = half.sqrt().sqrt();
        let mut seed = settings.seed ^ 0x4C55_4E41;
        let mut next = || {
            seed = mix(seed.wrapping_add(0x9E37_79B9_7F4A_7C15));
            seed
        };
        let mut octaves = Vec::new();
        let mut wavelength_m = 6.0e5 * size;
        while wavelength_m >= settings.finest_m {
            octaves.push(octave(wavelength_m, settings.relief, [next(), next()]));
            wavelength_m *= 0.4;
        }
        // Never reached in practice: it only keeps the stated range of heights honest and tight.
        let depths_m = octaves.iter().filter_map(|o| o.craters.as_ref()).map(Craters::deepest_m);
        let depths_m = settings.relief * depths_m.sum::<f64>();
        let craters_m = [-0.6 * depths_m, 0.3 * depths_m];
        let lattice = |wavelength_m: f64, seed| Lattice::new(wavelength_m * size, seed);
        let body = Cratered {
            radius_m: settings.radius_m,
            vertical: settings.relief * half * eighth,
            relief: settings.relief,
            swell: [lattice(3.6e6, next()), lattice(1.5e6, next())],
            maria: [lattice(2.2e6, next()), lattice(5.0e5, next())],
            octaves,
            craters_m,
        };
        let bounds = body.bounds(size);
        (body, bounds)
    }

    pub(super) fn sample(&self, n: DVec3) -> Sample {
        let at_m = n * self.radius_m;
        let swell = 0.6 * self.swell[0].value(at_m) + 0.4 * self.swell[1].value(at_m);
        let pool = self.maria[0].value(at_m) + 0.22 * self.maria[1].value(at_m) - 0.6 * swell;
        let mare = ramp(0.24, 0.36, pool);
        let ruggedness = 1.0 - (1.0 - MARE) * mare;
        let mut height_m = self.vertical * (SWELL_M * swell - MARE_DEPTH_M * mare);
        let mut dents_m = 0.0;
        let mut fresh = 0.0;
        let mut shore = 0.0;
        for (i, octave) in self.octaves.iter().enumerate() {
            let value = octave.ground.value(at_m);
            shore += if (1..5).contains(&i) { 0.03 * value } else { 0.0 };
            height_m += octave.amplitude_m * ruggedness * value;
            let Some(craters) = &octave.craters else { continue };
            let Dent { height_m: dent_m, fresh: bright } = craters.at(at_m, n, value);
            let left = octave.in_maria + (1.0 - octave.in_maria) * (1.0 - mare);
            dents_m += self.relief * left * dent_m;
            fresh += bright * left;
        }
        height_m += dents_m.clamp(self.craters_m[0], self.craters_m[1]);
        let dark = ramp(0.28, 0.32, pool + shore);
        let layers = Layers {
            roughness: byte(ruggedness),
            rock: byte(0.35 * (1.0 - dark) + 0.55 * fresh),
            moisture: byte(dark),
            temperature: byte((60.0 - 70.0 * n.z * n.z) / 80.0),
        };
        Sample { height_m, layers, ruggedness }
    }

    fn bounds(&self, size: f64) -> Bounds {
        let octave = |wavelength_m, fixed_m, rugged_m| Term {
            wavelength_m,
            fixed_m,
            rugged_m,
            growth: Growth::Even,
            curvature: SMOOTH,
        };
        let km = 1000.0 * size;
        let mut terms = vec![
            octave(SWELL_KM * km, SWELL_M * self.vertical, 0.0),
            octave(MARE_KM * km, MARE_DEPTH_M * self.vertical, 0.0),
        ];
        let swell_m = PEAK * SWELL_M * self.vertical;
        let mut low_m = self.craters_m[0] - swell_m - MARE_DEPTH_M * self.vertical;
        let mut high_m = self.craters_m[1] + swell_m;
        for o in &self.octaves {
            terms.push(octave(o.wavelength_m, 0.0, o.amplitude_m));
            high_m += PEAK * o.amplitude_m;
            low_m -= PEAK * o.amplitude_m;
            let Some(craters) = &o.craters else { continue };
            let depth_m = self.relief * craters.deepest_m();
            // Ruggedness falls to MARE where the craters' share falls to `in_maria`.
            let rugged_m = depth_m * (1.0 - o.in_maria) / (1.0 - MARE);
            let [fixed_m, rugged_m] = [depth_m - rugged_m, rugged_m].map(|m| m * CRATER_DEPTH);
            terms.push(octave(CRATER * o.wavelength_m, fixed_m, rugged_m));
        }
        Bounds {
            height_range_m: [low_m, high_m],
            ruggedness_slope_per_m: RUGGEDNESS_SLOPE_PER_KM / km,
            terms,
        }
    }
}

fn octave(wavelength_m: f64, relief: f64, seeds: [u64; 2]) -> Octave {
    let large = ramp(5.0e3, 5.0e4, wavelength_m);
    let cratered = wavelength_m >= SMALLEST_CELL_M;
    Octave {
        ground: Lattice::new(wavelength_m, seeds[0]),
        wavelength_m,
        amplitude_m: relief * wavelength_m * (0.022 - 0.017 * large),
        craters: cratered.then(|| Craters::new(wavelength_m, seeds[1])),
        in_maria: 0.8 - 0.72 * large,
    }
}

//! The cratered planet: highlands, maria, craters of every size, no air and no sea.
//!
//! In:    the settings once, then unit surface normals.
//! Out:   samples, and the terms of the planet's bounds.
//! Keeps: lattices and size classes.
//! Not here: the shape of one crater (`craters`).

use glam::DVec3;

use super::bounds::{Bounds, Growth, SMOOTH, Term};
use super::craters::{Craters, Dent};
use super::lanes::BLOCK;
use super::noise::{Lattice, PEAK, mix, ramp};
use super::{Layers, ProceduralSettings, Sample, byte};

mod block;

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

/// The longest waves at one point.
#[derive(Clone, Copy)]
struct Plain {
    height_m: f64,
    /// Above the level of maria where it is large.
    pool: f64,
    /// 0 in highlands, 1 in maria.
    mare: f64,
    ruggedness: f64,
}

/// Octaves and craters at one point while they are being piled up.
#[derive(Clone, Copy)]
struct Pile {
    height_m: f64,
    dents_m: f64,
    fresh: f64,
    /// What the octaves bend the shores of maria by.
    shore: f64,
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
        let swell = [0, 1].map(|k: usize| self.swell[k].value(at_m));
        let maria = [0, 1].map(|k: usize| self.maria[k].value(at_m));
        let plain = self.plain(swell, maria);
        let mut pile = Pile::on(&plain);
        for (i, octave) in self.octaves.iter().enumerate() {
            let value = octave.ground.value(at_m);
            pile.raise(octave, i, plain.ruggedness, value);
            let Some(craters) = &octave.craters else { continue };
            pile.dent(octave, self.relief, plain.mare, &craters.at(at_m, n, value));
        }
        self.finished(n, &plain, &pile)
    }

    /// [`Cratered::sample`] of many points, bit for bit.
    pub(super) fn samples(&self, normals: &[DVec3], out: &mut [Sample]) {
        for (normals, out) in normals.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            block::fill(self, normals, out);
        }
    }

    /// The ground before octaves and craters, by the noise of swell and maria.
    #[inline(always)]
    fn plain(&self, swell: [f64; 2], maria: [f64; 2]) -> Plain {
        let swell = 0.6 * swell[0] + 0.4 * swell[1];
        let pool = maria[0] + 0.22 * maria[1] - 0.6 * swell;
        let mare = ramp(0.24, 0.36, pool);
        let ruggedness = 1.0 - (1.0 - MARE) * mare;
        let height_m = self.vertical * (SWELL_M * swell - MARE_DEPTH_M * mare);
        Plain { height_m, pool, mare, ruggedness }
    }

    #[inline(always)]
    fn finished(&self, n: DVec3, plain: &Plain, pile: &Pile) -> Sample {
        let height_m = pile.height_m + pile.dents_m.clamp(self.craters_m[0], self.craters_m[1]);
        let dark = ramp(0.28, 0.32, plain.pool + pile.shore);
        let layers = Layers {
            roughness: byte(plain.ruggedness),
            rock: byte(0.35 * (1.0 - dark) + 0.55 * pile.fresh),
            moisture: byte(dark),
            temperature: byte((60.0 - 70.0 * n.z * n.z) / 80.0),
        };
        Sample { height_m, layers, ruggedness: plain.ruggedness }
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

impl Pile {
    #[inline(always)]
    fn on(plain: &Plain) -> Pile {
        Pile { height_m: plain.height_m, dents_m: 0.0, fresh: 0.0, shore: 0.0 }
    }

    /// Adds the `i`-th octave's ground.
    #[inline(always)]
    fn raise(&mut self, octave: &Octave, i: usize, ruggedness: f64, value: f64) {
        self.shore += if (1..5).contains(&i) { 0.03 * value } else { 0.0 };
        self.height_m += octave.amplitude_m * ruggedness * value;
    }

    /// Adds an octave's craters.
    #[inline(always)]
    fn dent(&mut self, octave: &Octave, relief: f64, mare: f64, dent: &Dent) {
        let left = octave.in_maria + (1.0 - octave.in_maria) * (1.0 - mare);
        self.dents_m += relief * left * dent.height_m;
        self.fresh += dent.fresh * left;
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

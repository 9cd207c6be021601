//! A procedural planet: height and hidden layers as a pure function of a direction.
//!
//! In:    [`ProceduralSettings`], then unit surface normals.
//! Out:   [`Sample`]s, and bounds on how far the surface strays between them.
//! Keeps: the octaves of one planet, fixed by [`Planet::new`].
//! Not here: pages, lattices and colours; this module knows no grid.

use glam::DVec3;

#[cfg(test)]
mod batch_tests;
mod bounds;
mod cratered;
mod craters;
pub mod detail;
mod earthlike;
mod lanes;
mod noise;
mod outline;
#[cfg(test)]
mod tests;

use bounds::Bounds;
use cratered::Cratered;
use earthlike::Earthlike;

/// What makes one planet. Equal settings make equal bits on every machine.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProceduralSettings {
    /// Picks one of 2^64 planets.
    pub seed: u64,
    /// Mean radius in metres, 500 or more; it turns wavelengths into lattice frequencies.
    pub radius_m: f64,
    /// Which kind of planet.
    pub style: Style,
    /// Factor on all heights: 1 looks like the Earth or the Moon, 0 is a smooth ball.
    pub relief: f64,
    /// Shortest wavelength in metres, usually 0.1 to 0.2.
    pub finest_m: f64,
}

/// Kinds of planet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Style {
    /// Continents and seas, mountain belts, climate. Sea level is height 0.
    Earthlike,
    /// Airless like the Moon: craters of every size, dark smooth maria; heights may be negative.
    Cratered,
}

/// The planet at one point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample {
    /// Height above the reference surface in metres; below 0 is sea floor on Earth-like planets.
    pub height_m: f64,
    /// What steers colours and finer detail.
    pub layers: Layers,
    /// Amplitude factor of the fine detail here, 0..1; changes by at most
    /// [`Planet::ruggedness_slope_per_m`].
    pub ruggedness: f64,
}

/// Hidden layers, each 0..255.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Layers {
    /// Fine detail's strength: 0 smooth sediment, 255 crags.
    pub roughness: u8,
    /// Bare rock: 0 soil or, on cratered planets, dark mare; 255 rock or bright young ejecta.
    pub rock: u8,
    /// Moisture: 0 desert, 255 rain forest. On cratered planets 255 marks a mare.
    pub moisture: u8,
    /// Temperature at that height: 0 is -40 °C, 255 is +40 °C.
    pub temperature: u8,
}

/// One planet: immutable, shared freely between threads.
pub struct Planet {
    body: Body,
    bounds: Bounds,
}

enum Body {
    Earthlike(Box<Earthlike>),
    Cratered(Box<Cratered>),
}

impl Planet {
    /// Fixes every octave of the planet. Takes some milliseconds.
    ///
    /// Panics when the radius is below 500 m or the finest wavelength is not above 0.
    pub fn new(settings: &ProceduralSettings) -> Planet {
        assert!(settings.radius_m >= 500.0, "a planet is at least 500 m in radius");
        assert!(settings.finest_m > 0.0, "the finest wavelength is above 0 m");
        match settings.style {
            Style::Earthlike => {
                let (body, bounds) = Earthlike::new(settings);
                Planet { body: Body::Earthlike(Box::new(body)), bounds }
            }
            Style::Cratered => {
                let (body, bounds) = Cratered::new(settings);
                Planet { body: Body::Cratered(Box::new(body)), bounds }
            }
        }
    }

    /// The planet in the direction of `n`, a unit surface normal; `n.z` points north.
    pub fn sample(&self, n: DVec3) -> Sample {
        match &self.body {
            Body::Earthlike(body) => body.sample(n),
            Body::Cratered(body) => body.sample(n),
        }
    }

    /// [`Planet::sample`] of each of many directions, to the bit: faster than one by one, the more
    /// so the more alike they are.
    ///
    /// # Panics
    /// If there are more or fewer samples than normals.
    pub fn samples(&self, normals: &[DVec3], out: &mut [Sample]) {
        assert_eq!(normals.len(), out.len(), "a sample for every normal");
        match &self.body {
            Body::Earthlike(body) => body.samples(normals, out),
            Body::Cratered(body) => body.samples(normals, out),
        }
    }

    /// Lowest and highest height anywhere, in metres.
    pub fn height_range_m(&self) -> [f64; 2] {
        self.bounds.height_range_m
    }

    /// Bound in metres on how far the surface strays from the plane over any triangle of its
    /// points with edges of at most `edge_m`, where no point is more rugged than
    /// `ruggedness_max`. Grows with both. See `bounds` for how it was found.
    pub fn residual_m(&self, edge_m: f64, ruggedness_max: f64) -> f64 {
        self.bounds.residual_m(edge_m, ruggedness_max)
    }

    /// Bound in metres on the height difference of two points at most `distance_m` apart, where
    /// no point is more rugged than `ruggedness_max`. Grows with both.
    pub fn variation_m(&self, distance_m: f64, ruggedness_max: f64) -> f64 {
        self.bounds.variation_m(distance_m, ruggedness_max)
    }

    /// Largest change of [`Sample::ruggedness`] per metre.
    pub fn ruggedness_slope_per_m(&self) -> f64 {
        self.bounds.ruggedness_slope_per_m
    }
}

/// A layer's byte for a value of 0..1.
#[inline(always)]
fn byte(value: f64) -> u8 {
    // Adding 1.5 * 2^52 leaves the rounded integer in the lowest bits.
    ((value.clamp(0.0, 1.0) * 255.0 + noise::ROUND).to_bits() & 0xFF) as u8
}

//! How far a planet strays between samples: one term per octave, capped both ways.
//!
//! In:    each octave's wavelength and amplitude, the fixed part and the part that follows
//!        ruggedness.
//! Out:   bounds on interpolation residual and on height differences.
//! Keeps: the terms and the height range of one planet.
//! Not here: the octaves themselves (`earthlike`, `cratered`).

/// What one octave adds: `fixed_m + rugged_m * ruggedness` is its largest amplitude.
#[derive(Clone, Copy)]
pub(super) struct Term {
    pub wavelength_m: f64,
    pub fixed_m: f64,
    pub rugged_m: f64,
}

/// Everything known beforehand about one planet's surface.
pub(super) struct Bounds {
    pub height_range_m: [f64; 2],
    pub ruggedness_slope_per_m: f64,
    pub terms: Vec<Term>,
}

/// Residual of an octave per amplitude: at most `RESIDUAL_CAP`, and `CURVATURE` (edge/wavelength)².
const RESIDUAL_CAP: f64 = 1.2;
const CURVATURE: f64 = 5.0;
/// Difference of an octave per amplitude: at most 2, and `SLOPE` distance/wavelength.
const VARIATION_CAP: f64 = 2.0;
const SLOPE: f64 = 4.0;

impl Bounds {
    pub(super) fn residual_m(&self, edge_m: f64, ruggedness_max: f64) -> f64 {
        self.sum(ruggedness_max, |term| {
            let edges = edge_m / term.wavelength_m;
            (CURVATURE * edges * edges).min(RESIDUAL_CAP)
        })
    }

    pub(super) fn variation_m(&self, distance_m: f64, ruggedness_max: f64) -> f64 {
        self.sum(ruggedness_max, |term| (SLOPE * distance_m / term.wavelength_m).min(VARIATION_CAP))
    }

    fn sum(&self, ruggedness_max: f64, share: impl Fn(&Term) -> f64) -> f64 {
        let ruggedness = ruggedness_max.clamp(0.0, 1.0);
        self.terms.iter().map(|t| (t.fixed_m + t.rugged_m * ruggedness) * share(t)).sum()
    }
}

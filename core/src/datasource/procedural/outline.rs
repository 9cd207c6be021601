//! The outline of an Earth-like planet: where land, sea and mountain belts are.
//!
//! In:    a point in metres and its unit normal.
//! Out:   a smooth [`Shape`]: base height, mountain mask, ruggedness.
//! Keeps: the lattices of the longest waves and the level of the sea among them.
//! Not here: anything shorter than 500 km on a planet of the Earth's size (`earthlike`).

use glam::DVec3;

use super::lanes::{BLOCK, Chosen, Column, Vectors, ZEROS, lanes, narrow_values, values};
use super::noise::{Cell, Lattice, Lattices, mix, ramp, unit};

/// The longest waves at one point.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Height before mountains and coast detail, metres on a planet of the Earth's size.
    pub base_m: f64,
    /// 0 in plains and seas, 1 in the middle of a great range.
    pub mountain: f64,
    /// 0..1 and never below `mountain`.
    pub ruggedness: f64,
}

/// The shapes of a block of points.
pub(super) struct Shapes {
    pub base_m: Column,
    pub mountain: Column,
    pub ruggedness: Column,
}

/// Noise that makes a shape.
struct Waves {
    continents: f64,
    wiggle: f64,
    breaks: f64,
    young: f64,
}

impl Shapes {
    #[inline(always)]
    pub(super) fn at(&self, i: usize) -> Shape {
        Shape { base_m: self.base_m[i], mountain: self.mountain[i], ruggedness: self.ruggedness[i] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, shape: Shape) {
        self.base_m[i] = shape.base_m;
        self.mountain[i] = shape.mountain;
        self.ruggedness[i] = shape.ruggedness;
    }
}

/// Continents, basins and belts.
pub(super) struct Outline {
    warps: [(Lattice, f64); 2],
    /// The continents' octaves, then the belts.
    lands: Lattices<6>,
    /// What bends belts, what breaks them, and uplands.
    marks: Lattices<3>,
    /// Continent noise at the coast, and how much of it one unit of [`Outline::inland`] is.
    coast: f64,
    spread: f64,
}

/// Share of the planet under water, in thousandths.
const SEA_PER_MILLE: usize = 655;

impl Outline {
    /// Lowest base height anywhere and where there are mountains, and the highest; metres on a
    /// planet of the Earth's size.
    pub(super) const RANGE_M: [f64; 3] = [-4300.0, -150.0, 1290.0];

    pub(super) fn new(radius_m: f64, size: f64, seed: u64) -> Outline {
        let mut state = seed;
        let mut lattice = |wavelength_km: f64| {
            state = mix(state.wrapping_add(0x9E37_79B9_7F4A_7C15));
            Lattice::new(wavelength_km * 1000.0 * size, state)
        };
        let square = 1e12 * size * size;
        let mut outline = Outline {
            warps: [
                (lattice(6000.0), 0.055 * 36.0 * square),
                (lattice(1900.0), 0.035 * 3.6 * square),
            ],
            lands: Lattices::new(
                [9500.0, 4700.0, 2300.0, 1150.0, 5200.0, 3300.0].map(&mut lattice),
            ),
            marks: Lattices::new([1300.0, 2400.0, 1500.0].map(&mut lattice)),
            coast: 0.0,
            spread: 1.0,
        };
        let mut values: Vec<f64> = (0..4096u64).map(|i| outline.probe(radius_m, i)).collect();
        values.sort_by(f64::total_cmp);
        let rank = |per_mille: usize| values[per_mille * values.len() / 1000];
        outline.spread = rank(950) - rank(50);
        outline.coast = rank(SEA_PER_MILLE);
        outline
    }

    pub(super) fn at(&self, at_m: DVec3, n: DVec3) -> Shape {
        let warped_m = self.warped(at_m, n);
        let lands = self.lands.cells(warped_m);
        let [wiggle, breaks, uplands] = self.marks.cells(at_m);
        let waves = Waves {
            continents: continent(&lands),
            wiggle: wiggle.value(),
            breaks: breaks.value(),
            young: lands[4].value(),
        };
        self.shape(&waves, || lands[5].value(), || uplands.narrow_value())
    }

    /// [`Outline::at`] of a block of points.
    #[inline(always)]
    pub(super) fn shapes(&self, at_m: &Vectors, n: &Vectors, count: usize) -> Shapes {
        let warped_m = self.warped_all(at_m, n, count);
        let mut continents = ZEROS;
        for (k, weight) in CONTINENTS.into_iter().enumerate() {
            let values = values((&self.lands, k), &warped_m, count);
            for i in lanes(count) {
                continents[i] += weight * values[i];
            }
        }
        let wiggle = values((&self.marks, 0), at_m, count);
        let breaks = values((&self.marks, 1), at_m, count);
        let young = values((&self.lands, 4), &warped_m, count);
        let (mut is_land, mut has_old) = ([false; BLOCK], [false; BLOCK]);
        for i in lanes(count) {
            let land = land(self.inland(continents[i]));
            is_land[i] = land > 0.0;
            has_old[i] = old_share(land, breaks[i]) > 0.0;
        }
        let (mut old, mut uplands) = (ZEROS, ZEROS);
        let chosen = Chosen::of(count, &has_old);
        let picked_m = chosen.pick_vectors(&warped_m);
        chosen.put(&values((&self.lands, 5), &picked_m, chosen.count()), &mut old);
        let chosen = Chosen::of(count, &is_land);
        let picked_m = chosen.pick_vectors(at_m);
        chosen.put(&narrow_values((&self.marks, 2), &picked_m, chosen.count()), &mut uplands);
        let mut shapes = Shapes { base_m: ZEROS, mountain: ZEROS, ruggedness: ZEROS };
        for i in lanes(count) {
            let (old, uplands) = (old[i], uplands[i]);
            let waves = Waves {
                continents: continents[i],
                wiggle: wiggle[i],
                breaks: breaks[i],
                young: young[i],
            };
            shapes.set(i, self.shape(&waves, || old, || uplands));
        }
        shapes
    }

    /// The shape that these waves make; `old` and `uplands` are looked at only where they matter.
    #[inline(always)]
    fn shape(
        &self,
        waves: &Waves,
        old: impl FnOnce() -> f64,
        uplands: impl FnOnce() -> f64,
    ) -> Shape {
        let inland = self.inland(waves.continents);
        let (wiggle, breaks) = (0.16 * waves.wiggle, waves.breaks);
        let land = land(inland);
        // What would be multiplied by zero is left out: most of the planet lies under water.
        let share = 0.35 + 0.65 * ramp(-0.35, 0.15, breaks);
        let young = share * belt(waves.young + wiggle, 0.12 + 0.06 * breaks);
        let share = old_share(land, breaks);
        let old = if share > 0.0 { share * belt(old() + wiggle, 0.09) } else { 0.0 };
        let belts = 1.0 - (1.0 - young) * (1.0 - 0.5 * old);
        let mountain = belts * land;
        let upland = if land > 0.0 { ramp(0.0, 0.6, uplands()) } else { 0.0 };
        let plain = 0.03 + land * (0.03 + 0.16 * upland);
        let rise = young * (1.0 - land);
        let ruggedness = plain + (1.0 - plain) * mountain + 0.12 * rise;
        let base_m = -4300.0
            + 3940.0 * ramp(-0.24, -0.03, inland)
            + 1400.0 * ramp(-0.30, 0.60, inland)
            + 250.0 * land * upland
            + 1600.0 * rise * ramp(-0.08, -0.25, inland);
        Shape { base_m, mountain, ruggedness }
    }

    /// How far inside the land a point is, in units that are alike on all planets.
    #[inline(always)]
    fn inland(&self, continents: f64) -> f64 {
        (continents - self.coast) / self.spread
    }

    /// Swirls along the surface bend coasts and belts out of the roundness of plain noise.
    fn warped(&self, at_m: DVec3, n: DVec3) -> DVec3 {
        let mut warped_m = at_m;
        for (lattice, reach_m2) in &self.warps {
            let (_, gradient) = lattice.value_and_gradient(warped_m);
            warped_m += swirl(n, gradient) * *reach_m2;
        }
        warped_m
    }

    #[inline(always)]
    fn warped_all(&self, at_m: &Vectors, n: &Vectors, count: usize) -> Vectors {
        let mut warped_m = *at_m;
        for (lattice, reach_m2) in &self.warps {
            for i in lanes(count) {
                let cell = lattice.cell(warped_m.at(i));
                let (_, slope) = cell.value_and_gradient_in(&cell.simplex());
                let swirl = swirl(n.at(i), lattice.per_metre(slope));
                warped_m.set(i, warped_m.at(i) + swirl * *reach_m2);
            }
        }
        warped_m
    }

    /// Continent noise at one of many random points, to find the level that floods its share.
    fn probe(&self, radius_m: f64, index: u64) -> f64 {
        let mut state = mix(index.wrapping_mul(0xD134_2543_DE82_EF95));
        loop {
            let mut next = || {
                state = mix(state.wrapping_add(0x9E37_79B9_7F4A_7C15));
                unit(state) * 2.0 - 1.0
            };
            let v = DVec3::new(next(), next(), next());
            if (0.01..=1.0).contains(&v.length_squared()) {
                let n = v.normalize();
                return continent(&self.lands.cells(self.warped(n * radius_m, n)));
            }
        }
    }
}

/// Weights of the continents' octaves.
const CONTINENTS: [f64; 4] = [1.0, 0.62, 0.34, 0.17];

#[inline(always)]
fn continent(lands: &[Cell; 6]) -> f64 {
    let mut sum = 0.0;
    for i in 0..4 {
        sum += CONTINENTS[i] * lands[i].value();
    }
    sum
}

#[inline(always)]
fn swirl(n: DVec3, gradient: DVec3) -> DVec3 {
    n.cross(gradient) + gradient * 0.5
}

/// 0 in the sea, 1 on land.
#[inline(always)]
fn land(inland: f64) -> f64 {
    ramp(-0.03, 0.10, inland)
}

/// How much of the old belts is left.
#[inline(always)]
fn old_share(land: f64, breaks: f64) -> f64 {
    if land > 0.0 { ramp(0.25, -0.35, breaks) } else { 0.0 }
}

/// A belt follows a zero of noise: 1 on it, 0 from `width` on, level at both.
#[inline(always)]
fn belt(noise: f64, width: f64) -> f64 {
    let off = noise / width;
    let inside = 1.0 - off * off;
    if inside > 0.0 { inside * inside } else { 0.0 }
}

//! The Earth-like planet: continents, mountain belts, eroded ridges, fine detail, climate.
//!
//! In:    the settings once, then unit surface normals.
//! Out:   samples, and the terms of the planet's bounds.
//! Keeps: lattices and amplitudes of every octave.
//! Not here: the noise itself (`noise`), continents and belts (`outline`).

use glam::DVec3;

use super::bounds::{Bounds, Growth, SHARP, SMOOTH, TURNING, Term, UNERODED, early};
use super::lanes::BLOCK;
use super::noise::{Lattice, Lattices, PEAK, mix, ramp, round};
use super::outline::{Outline, Shape};
use super::{Layers, ProceduralSettings, Sample, byte};

mod block;

/// The Earth-like planet.
pub(super) struct Earthlike {
    radius_m: f64,
    /// Factor on heights that belong to the body as a whole; 1 on a planet of the Earth's size.
    vertical: f64,
    outline: Outline,
    ridges: Vec<Ridge>,
    gullies: Vec<Octave>,
    ridge_lattices: Lattices<6>,
    details: Vec<Details>,
    /// Weather, and moisture in wide and in narrow waves.
    climate: Lattices<3>,
    /// Inverses of [`FADE_DEPTH_M`] and [`BEACH_M`] on this planet.
    per_depth: f64,
    per_beach: f64,
    /// Slope at which gullies run straight downhill.
    slope_scale: f64,
}

/// An octave that makes coasts everywhere and ridges in mountains.
struct Ridge {
    lattice: Lattice,
    wavelength_m: f64,
    coast_m: f64,
    ridge_m: f64,
}

struct Octave {
    lattice: Lattice,
    wavelength_m: f64,
    amplitude_m: f64,
}

/// Four octaves of detail, evaluated together.
struct Details {
    lattices: Lattices<4>,
    octaves: [Detail; 4],
    /// All are longer than [`LONG_M`].
    long: bool,
}

#[derive(Clone, Copy)]
struct Detail {
    lattice: Lattice,
    wavelength_m: f64,
    /// Amplitude on the smoothest ground, and what full ruggedness adds.
    fixed_m: f64,
    rugged_m: f64,
    /// Knolls stand where this octave's noise is high, so high per squared noise.
    knoll_m: f64,
    /// Depth of the stream beds along the zeros of the octave before; see [`PER_BED`].
    bed_m: f64,
}

/// The ground at one point while it is being made.
#[derive(Clone, Copy)]
struct Ground {
    height_m: f64,
    /// Squared slope of what is longer than details.
    steep: f64,
    shape: Shape,
}

/// Coasts and ridges at one point while they are being made.
#[derive(Clone, Copy)]
struct Range {
    height_m: f64,
    slope: DVec3,
    /// How much of the next octave's ridges is left.
    crest: f64,
}

/// Direction across gullies, and their share of their amplitude.
struct Steering {
    side: DVec3,
    strength: f64,
}

/// Fine detail at one point while it is being made.
#[derive(Clone, Copy)]
struct Fine {
    height_m: f64,
    /// Share of the rugged part of the next octave.
    local: f64,
    /// Sum of the noise so far, the last octave's most.
    swell: f64,
    last: f64,
}

/// What short details depend on besides their noise.
#[derive(Clone, Copy)]
struct Mood {
    lively: f64,
    rugged: f64,
    streams: f64,
}

const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// Largest amplitude of a ridge octave per wavelength; it tames bodies much smaller than the Earth.
const STEEPEST: f64 = 0.10;
/// Rounding of ridge crests, in units of noise.
const CREST: f64 = 0.06;
/// The same for the slope that steers gullies, which must not turn within a gully's width.
const STEERING_CREST: f64 = 0.20;
/// Details longer than this are the same under water and on beaches.
const LONG_M: f64 = 400.0;
/// Depth at which shorter details begin to fade, to be gone at twice of it.
const FADE_DEPTH_M: f64 = 50.0;
/// Base heights below which the sea floor has no waves shorter than 100 km, and above which it has
/// all; on a planet of the Earth's size.
const ABYSS_M: [f64; 2] = [-4250.0, -3850.0];
/// Coast octaves that the abyss has.
const ABYSSAL: usize = 2;
/// Height from which ground is no beach, on a planet of the Earth's size.
const BEACH_M: f64 = 12.0;
/// Noise at the foot of a knoll.
const KNOLL_FOOT: f64 = 0.05;
/// Inverse of the noise at the upper edge of a stream's bank, which is where the noise of one
/// octave and this share of the next pass it.
const PER_BED: f64 = 8.0;
const MEANDER: f64 = 0.15;
/// Calibrated like the constants of `bounds`: wavelengths of the outline as single octaves, a
/// factor on gullies because they turn with the slope, and twice the steepest change of ruggedness
/// seen at 200 000 pairs of points.
const OUTLINE_KM: f64 = 400.0;
const BELT_KM: f64 = 300.0;
const GULLY: f64 = 1.8;
/// Knolls as amplitude of their octave, beds as an octave of so much of the wavelength.
const KNOLL: f64 = 0.5;
const BED: f64 = 0.4;
const RUGGEDNESS_SLOPE_PER_KM: f64 = 0.045;
const UPLIFT_M: f64 = 700.0;

impl Earthlike {
    pub(super) fn new(settings: &ProceduralSettings) -> (Earthlike, Bounds) {
        let size = settings.radius_m / EARTH_RADIUS_M;
        let half = size.sqrt();
        let (quarter, eighth) = (half.sqrt(), half.sqrt().sqrt());
        // Smaller bodies are relatively rougher: 40 m of relief on a radius of 1 km.
        let vertical = settings.relief * half * eighth.sqrt();
        let finer = half * quarter * eighth;
        let mut seed = settings.seed;
        let mut next = || {
            seed = mix(seed.wrapping_add(0x9E37_79B9_7F4A_7C15));
            seed
        };
        let outline = Outline::new(settings.radius_m, size, next());
        let ridges = ridge_octaves(300_000.0 * finer, vertical, &mut next);
        let gully_start = ridges[ridges.len() - 1].wavelength_m * 0.8;
        let gullies = gully_octaves(gully_start, 250.0 * half, settings.relief, &mut next);
        let details = detail_octaves(gully_start, settings, &mut next);
        let ridge_lattices = Lattices::new([0, 1, 2, 3, 4, 5].map(|i: usize| ridges[i].lattice));
        let moisture = [Lattice::new(3.0e6 * size, next()), Lattice::new(5.0e5 * finer, next())];
        let weather = Lattice::new(2.5e6 * size, next());
        let climate = Lattices::new([weather, moisture[0], moisture[1]]);
        let body = Earthlike {
            radius_m: settings.radius_m,
            vertical,
            outline,
            ridges,
            ridge_lattices,
            gullies,
            details,
            climate,
            per_depth: 1.0 / (FADE_DEPTH_M * settings.relief.max(1e-3)),
            per_beach: 1.0 / (BEACH_M * vertical.max(1e-6)),
            slope_scale: 0.10 * settings.relief.max(1e-3),
        };
        let bounds = body.bounds(size);
        (body, bounds)
    }

    pub(super) fn sample(&self, n: DVec3) -> Sample {
        let at_m = n * self.radius_m;
        let shape = self.outline.at(at_m, n);
        let (ridges_m, slope) = self.ridged(at_m, &shape);
        let (gullies_m, slope) = self.gullied(at_m, n, (along(n, slope), shape.ruggedness));
        let height_m = self.base_m(&shape) + ridges_m + gullies_m;
        let ground = Ground { height_m, steep: slope.length_squared(), shape };
        let (height_m, grain) = self.detailed(at_m, &ground);
        let climate = self.climate.narrow_values(at_m);
        let layers = self.layers(n, &Ground { height_m, ..ground }, grain, climate);
        Sample { height_m, layers, ruggedness: shape.ruggedness }
    }

    /// [`Earthlike::sample`] of many points, bit for bit.
    pub(super) fn samples(&self, normals: &[DVec3], out: &mut [Sample]) {
        for (normals, out) in normals.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            block::fill(self, normals, out);
        }
    }

    #[inline(always)]
    fn base_m(&self, shape: &Shape) -> f64 {
        self.vertical * (shape.base_m + UPLIFT_M * shape.mountain)
    }

    /// Height and slope of coasts and mountain ridges.
    fn ridged(&self, at_m: DVec3, shape: &Shape) -> (f64, DVec3) {
        if is_quiet(shape) {
            return (self.coasts_m(at_m, shape.base_m), DVec3::ZERO);
        }
        let cells = self.ridge_lattices.cells(at_m);
        let mut range = Range::FOOT;
        for (octave, cell) in self.ridges.iter().zip(&cells) {
            range = octave.ridge(&range, shape.mountain, cell.value_and_gradient());
        }
        (range.height_m, range.slope * steering(shape.ruggedness))
    }

    /// Height of the same octaves where there are no ridges. The deep sea floor lacks short ones.
    fn coasts_m(&self, at_m: DVec3, base_m: f64) -> f64 {
        let cells = self.ridge_lattices.cells(at_m);
        let share = above_abyss(base_m);
        let count = if share > 0.0 { self.ridges.len() } else { ABYSSAL };
        let mut coast_m = 0.0;
        for (i, (octave, cell)) in self.ridges.iter().zip(&cells).take(count).enumerate() {
            let share = if i < ABYSSAL { 1.0 } else { share };
            coast_m += share * octave.coast_m * cell.narrow_value();
        }
        coast_m
    }

    /// Height of the gullies, and the slope with them.
    fn gullied(&self, at_m: DVec3, n: DVec3, (slope, ruggedness): (DVec3, f64)) -> (f64, DVec3) {
        let eroded = ruggedness - UNERODED;
        let (mut height_m, mut slope) = (0.0, slope);
        // Plains and sea floor have no gullies, which saves a seventh of their time.
        let gullies = if eroded > 0.0 { &self.gullies[..] } else { &[] };
        for octave in gullies {
            let steering = self.steering(n, slope);
            let (value, change) = octave.lattice.stripes(at_m, steering.side);
            let amplitude_m = octave.amplitude_m * eroded * steering.strength;
            height_m += amplitude_m * value;
            slope += change * amplitude_m;
        }
        (height_m, slope)
    }

    /// Where gullies on a slope run.
    #[inline(always)]
    fn steering(&self, n: DVec3, slope: DVec3) -> Steering {
        let side = n.cross(slope);
        let steep = side.length_squared();
        let inverse = 1.0 / (steep + self.slope_scale * self.slope_scale).sqrt();
        Steering { side: side * inverse, strength: steep * inverse * inverse }
    }

    /// The height with all fine detail, and the noise of the shortest wave that matters here.
    fn detailed(&self, at_m: DVec3, ground: &Ground) -> (f64, f64) {
        let share = above_abyss(ground.shape.base_m);
        let mut fine = Fine::on(ground);
        if share <= 0.0 {
            return (fine.height_m, fine.last);
        }
        let (long, short) = self.long_and_short();
        for four in long {
            let values = four.lattices.fine_values(at_m);
            for (octave, value) in four.octaves.iter().zip(values) {
                fine = octave.roll(&fine, (share, ground.shape.ruggedness), value);
            }
        }
        if self.deep(fine.height_m) >= 1.0 {
            return (fine.height_m, fine.last);
        }
        let mood = self.mood(&fine, share, ground.shape.ruggedness);
        for four in short {
            let values = four.lattices.fine_values(at_m);
            for (octave, value) in four.octaves.iter().zip(values) {
                fine = octave.roughen(&fine, &mood, value);
            }
        }
        (fine.height_m, fine.last)
    }

    #[inline(always)]
    fn long_and_short(&self) -> (&[Details], &[Details]) {
        let count = self.details.iter().take_while(|four| four.long).count();
        self.details.split_at(count)
    }

    /// How far under water a height is: 0 where short details begin to fade, 1 where they end.
    #[inline(always)]
    fn deep(&self, height_m: f64) -> f64 {
        if height_m < 0.0 { height_m.abs() * self.per_depth - 1.0 } else { 0.0 }
    }

    /// What short details depend on besides their noise.
    #[inline(always)]
    fn mood(&self, fine: &Fine, share: f64, ruggedness: f64) -> Mood {
        let seen = share * (1.0 - ramp(0.0, 1.0, self.deep(fine.height_m)));
        // Some plains are flat and some are hummocky; beaches and the water's edge are smooth.
        let dry = ramp(0.1, 1.0, fine.height_m.abs() * self.per_beach);
        Mood {
            lively: seen * (0.12 + 0.88 * dry) * (0.3 + 0.7 * ramp(-0.35, 0.4, fine.swell)),
            rugged: seen * early(ruggedness),
            // Streams run on gentle ground above the sea; mountains have gullies.
            streams: ramp(0.1, 1.0, fine.height_m * self.per_beach) * (1.0 - early(ruggedness)),
        }
    }

    #[inline(always)]
    fn layers(&self, n: DVec3, ground: &Ground, grain: f64, climate: [f64; 3]) -> Layers {
        let Shape { mountain, ruggedness, .. } = ground.shape;
        let height_m = ground.height_m;
        let steep = ground.steep / (ground.steep + 0.16);
        // Steps of moisture and temperature would draw contour lines; grain breaks them up.
        let grain = grain * 1000.0;
        let dither = (grain - round(grain)) / 255.0;
        let above_m = height_m.max(0.0) / self.vertical.max(1e-9);
        let [weather, wide, narrow] = climate;
        // Sine of latitude squared: warm to 30 degrees, steep in the westerlies, cold caps.
        let north = n.z * n.z;
        let polar = north * north * north * north;
        let celsius = 30.0 - 36.0 * north - 18.0 * polar + 6.0 * weather - 0.0065 * above_m;
        let wet = wide + 0.4 * narrow;
        let tropics = 1.0 - ramp(0.0, 0.12, north);
        let deserts = ramp(0.05, 0.18, north) * (1.0 - ramp(0.25, 0.45, north));
        let moist = 0.55 + 0.30 * tropics - 0.38 * deserts + 0.55 * wet + 0.15 * mountain
            - ramp(100.0, 1200.0, above_m) * 0.15;
        let rock = 0.9 * steep + ramp(1800.0, 4200.0, above_m) * 0.45 + 0.1 * ruggedness;
        Layers {
            roughness: byte(ruggedness),
            rock: byte(rock),
            moisture: byte(moist + dither),
            temperature: byte((celsius + 40.0) / 80.0 + dither),
        }
    }

    fn bounds(&self, size: f64) -> Bounds {
        let km = 1000.0 * size;
        let base = Term {
            wavelength_m: OUTLINE_KM * km,
            fixed_m: 5300.0 * self.vertical,
            rugged_m: 0.0,
            growth: Growth::Mountain,
            curvature: SMOOTH,
        };
        let fixed = |wavelength_m, fixed_m| Term { wavelength_m, fixed_m, ..base };
        let grown = |wavelength_m, rugged_m| Term { wavelength_m, fixed_m: 0.0, rugged_m, ..base };
        let mut terms = vec![base, grown(BELT_KM * km, UPLIFT_M * self.vertical)];
        for o in &self.ridges {
            terms.push(fixed(o.wavelength_m, o.coast_m));
            terms.push(Term { curvature: SHARP, ..grown(o.wavelength_m, o.ridge_m) });
        }
        for o in &self.gullies {
            let term = grown(o.wavelength_m, GULLY * o.amplitude_m);
            terms.push(Term { curvature: TURNING, growth: Growth::Eroded, ..term });
        }
        for (four, o) in self.details.iter().flat_map(|f| f.octaves.iter().map(move |o| (f, o))) {
            let growth = if four.long { Growth::Even } else { Growth::Early };
            let term = grown(o.wavelength_m, o.rugged_m);
            terms.push(Term { fixed_m: o.fixed_m + KNOLL * o.knoll_m, growth, ..term });
            if o.bed_m > 0.0 {
                terms.push(fixed(BED * o.wavelength_m, 0.5 * o.bed_m));
            }
        }
        Bounds {
            height_range_m: self.height_range_m(),
            ruggedness_slope_per_m: RUGGEDNESS_SLOPE_PER_KM / km,
            terms,
        }
    }

    fn octaves(&self) -> impl Iterator<Item = &Detail> {
        self.details.iter().flat_map(|four| &four.octaves)
    }

    /// Every octave at its extreme at once. A ridge octave below its mean flattens those after it
    /// to 0.45 of themselves, hence the share of the valleys.
    fn height_range_m(&self) -> [f64; 2] {
        let coasts_m: f64 = self.ridges.iter().map(|o| PEAK * o.coast_m).sum();
        let crests_m: f64 = self.ridges.iter().map(|o| o.ridge_m.max(o.coast_m)).sum();
        let first_m = self.ridges[0].ridge_m;
        let valleys_m = first_m + 0.45 * (crests_m - first_m);
        let gullies_m: f64 = self.gullies.iter().map(|o| o.amplitude_m).sum();
        let details_m = |r: f64| self.octaves().map(|o| o.highest_m(r)).sum::<f64>();
        let beds_m: f64 = self.octaves().map(|o| o.bed_m).sum();
        let [abyss_m, shore_m, inland_m] = Outline::RANGE_M.map(|m| m * self.vertical);
        let sea_m = abyss_m - coasts_m - 0.2 * gullies_m - details_m(0.2) - beds_m;
        let valley_m = shore_m - coasts_m - valleys_m - gullies_m - details_m(1.0) - beds_m;
        let peak_m = inland_m + UPLIFT_M * self.vertical + crests_m + gullies_m + details_m(1.0);
        [sea_m.min(valley_m), peak_m]
    }
}

/// Whether there is neither ridge nor gully.
#[inline(always)]
fn is_quiet(shape: &Shape) -> bool {
    shape.mountain <= 0.0 && shape.ruggedness <= UNERODED
}

/// The part of a slope along the surface.
#[inline(always)]
fn along(n: DVec3, slope: DVec3) -> DVec3 {
    slope - n * n.dot(slope)
}

/// How much of the ridges' slope steers gullies.
#[inline(always)]
fn steering(ruggedness: f64) -> f64 {
    ramp(UNERODED, UNERODED + 0.03, ruggedness)
}

/// 0 on the deep sea floor, 1 from its foot on.
#[inline(always)]
fn above_abyss(base_m: f64) -> f64 {
    ramp(ABYSS_M[0], ABYSS_M[1], base_m)
}

impl Range {
    const FOOT: Range = Range { height_m: 0.0, slope: DVec3::ZERO, crest: 1.0 };
}

impl Ridge {
    /// Adds this octave, of which noise and gradient are given.
    #[inline(always)]
    fn ridge(&self, range: &Range, mountain: f64, (value, gradient): (f64, DVec3)) -> Range {
        let rounded = (value * value + CREST * CREST).sqrt();
        let ridge = 1.0 - 2.0 * rounded;
        let amplitude_m = self.ridge_m * mountain * range.crest;
        let broad = (value * value + STEERING_CREST * STEERING_CREST).sqrt();
        let per_value_m = self.coast_m - 2.0 * amplitude_m * value / broad;
        Range {
            height_m: range.height_m + (self.coast_m * value + amplitude_m * ridge),
            slope: range.slope + self.lattice.per_metre(gradient * per_value_m),
            crest: (0.45 + 0.55 * ridge).clamp(0.0, 1.0) * (0.3 + 0.7 * range.crest),
        }
    }
}

impl Fine {
    #[inline(always)]
    fn on(ground: &Ground) -> Fine {
        let local = 0.35 + 0.65 * ground.steep / (ground.steep + 0.06);
        Fine { height_m: ground.height_m, local, swell: 0.0, last: 0.0 }
    }

    #[inline(always)]
    fn next_local(&self, value: f64) -> f64 {
        (self.local * (1.0 + 0.5 * value)).clamp(0.25, 1.0)
    }
}

fn ridge_octaves(longest_m: f64, vertical: f64, next: &mut impl FnMut() -> u64) -> Vec<Ridge> {
    let ridge_m = [400.0, 900.0, 1600.0, 1500.0, 950.0, 420.0];
    let coast_m = [260.0, 160.0, 95.0, 58.0, 34.0, 20.0];
    let mut wavelength_m = longest_m;
    let mut octaves = Vec::new();
    for (ridge_m, coast_m) in ridge_m.into_iter().zip(coast_m) {
        octaves.push(Ridge {
            lattice: Lattice::new(wavelength_m, next()),
            wavelength_m,
            coast_m: (coast_m * vertical).min(0.04 * wavelength_m),
            ridge_m: (ridge_m * vertical).min(STEEPEST * wavelength_m),
        });
        wavelength_m *= 0.5;
    }
    octaves
}

fn gully_octaves(
    longest_m: f64,
    shortest_m: f64,
    relief: f64,
    next: &mut impl FnMut() -> u64,
) -> Vec<Octave> {
    let mut wavelength_m = longest_m;
    let mut octaves = Vec::new();
    while wavelength_m >= shortest_m {
        let lattice = Lattice::new(wavelength_m, next());
        octaves.push(Octave { lattice, wavelength_m, amplitude_m: 0.050 * relief * wavelength_m });
        wavelength_m *= 0.47;
    }
    octaves
}

fn detail_octaves(
    longest_m: f64,
    settings: &ProceduralSettings,
    next: &mut impl FnMut() -> u64,
) -> Vec<Details> {
    let mut wavelength_m = longest_m;
    let mut fours = Vec::new();
    while wavelength_m >= settings.finest_m {
        let octaves = [1.0, 2.5, 6.25, 15.625].map(|part| {
            let octave_m = wavelength_m / part;
            // What is finer than wanted fills up the four with nothing.
            let relief = if octave_m >= settings.finest_m { settings.relief } else { 0.0 };
            Detail::new(octave_m, relief, next())
        });
        let lattices = Lattices::new(octaves.map(|o| o.lattice));
        let long = octaves[3].wavelength_m > LONG_M;
        fours.push(Details { lattices, octaves, long });
        wavelength_m /= 39.0625;
    }
    fours
}

impl Detail {
    fn new(wavelength_m: f64, relief: f64, seed: u64) -> Detail {
        // Slopes are gentlest in kilometres, where gullies rule, and in decimetres.
        let long = wavelength_m / (wavelength_m + 2000.0);
        let short = 0.3 / (wavelength_m + 0.3);
        // Plains roll gently; at arm's length even they have stones and tufts.
        let hilly = 1.0 - ramp(250.0, 2500.0, wavelength_m);
        let stony = 1.0 - ramp(1.0, 8.0, wavelength_m);
        let plain = 0.0018 + 0.0105 * hilly + 0.007 * stony;
        let per_m = 0.035 * (1.0 - 0.75 * long) * (1.0 - 0.5 * short);
        let scale = relief * wavelength_m;
        let between = |low: f64, high: f64| (low..high).contains(&wavelength_m);
        Detail {
            lattice: Lattice::new(wavelength_m, seed),
            wavelength_m,
            fixed_m: plain * scale,
            rugged_m: per_m * scale,
            knoll_m: if between(40.0, LONG_M) { 0.08 * scale } else { 0.0 },
            bed_m: if between(60.0, LONG_M) { 0.010 * scale } else { 0.0 },
        }
    }

    /// Adds this octave, a long one, of which the noise is given.
    #[inline(always)]
    fn roll(&self, fine: &Fine, (share, ruggedness): (f64, f64), value: f64) -> Fine {
        let amplitude_m = self.fixed_m + self.rugged_m * ruggedness * fine.local;
        Fine {
            height_m: fine.height_m + share * amplitude_m * value,
            local: fine.next_local(value),
            swell: 0.6 * fine.swell + value,
            last: value,
        }
    }

    /// Adds this octave, a short one, of which the noise is given.
    #[inline(always)]
    fn roughen(&self, fine: &Fine, mood: &Mood, value: f64) -> Fine {
        let amplitude_m = self.fixed_m * mood.lively + self.rugged_m * mood.rugged * fine.local;
        let knoll = (value - KNOLL_FOOT).max(0.0);
        let bed = (fine.last + MEANDER * value) * PER_BED;
        let bank = (1.0 - bed * bed).max(0.0);
        let added_m = amplitude_m * value + self.knoll_m * mood.lively * (knoll * knoll)
            - self.bed_m * mood.streams * (bank * bank);
        Fine {
            height_m: fine.height_m + added_m,
            local: fine.next_local(value),
            swell: fine.swell,
            last: value,
        }
    }

    /// The most this octave adds at a ruggedness, beds left aside.
    fn highest_m(&self, ruggedness: f64) -> f64 {
        PEAK * (self.fixed_m + self.rugged_m * early(ruggedness)) + PEAK * PEAK * self.knoll_m
    }
}

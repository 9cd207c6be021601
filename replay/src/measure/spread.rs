//! How a measured quantity is spread, and where it is greatest.
//!
//! In:    values of frames, with where each was seen.
//! Out:   rms, p50, p95, p99, p99.9, max and its place; of a frame, and of a whole flight.
//! Keeps: a histogram of the flight: 1/32 of an octave a bin.
//! Not here: what is measured.

/// Where a value was seen.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Where {
    /// Frame of the flight.
    pub frame: u64,
    /// Geodetic latitude, degrees.
    pub lat_deg: f64,
    /// Longitude, degrees.
    pub lon_deg: f64,
    /// Pixel from the left and from the top.
    pub pixel: [f64; 2],
}

/// A spread in numbers.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Spread {
    /// How many values.
    pub count: u64,
    /// Root of the mean square.
    pub rms: f64,
    /// Median.
    pub p50: f64,
    /// Exceeded by 5 % of the values.
    pub p95: f64,
    /// Exceeded by 1 %.
    pub p99: f64,
    /// Exceeded by one in a thousand.
    pub p999: f64,
    /// The greatest value.
    pub max: f64,
    /// Where that was seen.
    pub at: Where,
}

/// Bins an octave.
const BINS: usize = 32;
/// Values from 2⁻⁶⁰ to 2⁶⁰; smaller ones share the lowest bin, greater ones the highest.
const OCTAVES: i32 = 60;

/// Values of a whole flight. Percentiles are upper ends of bins: at most 1/32 of an octave, 2.2 %,
/// too large, never too small; max and rms are exact.
#[derive(Clone, PartialEq, Debug)]
pub struct Gathered {
    bins: Vec<u64>,
    /// Upper ends of an octave's bins, from 1 to 2.
    ends: Vec<f64>,
    count: u64,
    squares: f64,
    max: f64,
    at: Where,
}

impl Default for Gathered {
    fn default() -> Self {
        let bins = vec![0; 2 * OCTAVES.unsigned_abs() as usize * BINS + 1];
        let ends = (0..=BINS).map(|bin| libm::exp2(bin as f64 / BINS as f64)).collect();
        Self { bins, ends, count: 0, squares: 0.0, max: 0.0, at: Where::default() }
    }
}

impl Spread {
    /// Of the values of one frame, exact by nearest rank; reorders them. `at` tells where the
    /// value of an index was seen, before reordering. Values are not negative and not NaN.
    pub fn of(values: &mut [f64], at: impl FnOnce(usize) -> Where) -> Self {
        let greatest = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
        let Some(greatest) = greatest else { return Self::default() };
        let at = at(greatest);
        let rms = (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
        let count = values.len();
        let mut sorted = 0;
        let mut rank = |permille: usize| {
            let rank = (count * permille).div_ceil(1000).max(1) - 1;
            // What is before the last rank is less: each one is looked for in what is left.
            if rank >= sorted {
                values[sorted..].select_nth_unstable_by(rank - sorted, f64::total_cmp);
                sorted = rank + 1;
            }
            values[rank]
        };
        Self {
            count: count as u64,
            rms,
            p50: rank(500),
            p95: rank(950),
            p99: rank(990),
            p999: rank(999),
            max: rank(1000),
            at,
        }
    }
}

impl Spread {
    /// Of values that others are spread over: count, rms, max and its place are exact, percentiles
    /// are NaN. With no value in it everything is NaN but the count.
    pub fn merged<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut all = Self { max: f64::NAN, ..Self::default() };
        let mut squares = 0.0;
        for part in parts.filter(|part| part.count > 0) {
            all.count += part.count;
            squares += part.rms * part.rms * part.count as f64;
            if all.max.is_nan() || part.max > all.max {
                (all.max, all.at) = (part.max, part.at);
            }
        }
        let nan = f64::NAN;
        let rms = (squares / all.count as f64).sqrt();
        Self { rms, p50: nan, p95: nan, p99: nan, p999: nan, ..all }
    }
}

impl Gathered {
    /// Adds the values of a frame and its spread.
    pub fn add(&mut self, values: &[f64], spread: &Spread) {
        for &value in values {
            self.bins[bin_of(value, &self.ends)] += 1;
            self.squares += value * value;
        }
        self.count += values.len() as u64;
        if spread.max > self.max || self.count == values.len() as u64 {
            (self.max, self.at) = (spread.max, spread.at);
        }
    }

    /// The spread of all of it.
    pub fn spread(&self) -> Spread {
        if self.count == 0 {
            return Spread::merged(std::iter::empty());
        }
        let rank = |permille: u64| {
            let rank = (self.count * permille).div_ceil(1000).max(1);
            let mut passed = 0;
            let bin = self.bins.iter().position(|&count| {
                passed += count;
                passed >= rank
            });
            bin.map_or(self.max, upper_end).min(self.max)
        };
        Spread {
            count: self.count,
            rms: (self.squares / self.count as f64).sqrt(),
            p50: rank(500),
            p95: rank(950),
            p99: rank(990),
            p999: rank(999),
            max: self.max,
            at: self.at,
        }
    }
}

/// The bin of a value, given the ends of an octave's bins.
fn bin_of(value: f64, ends: &[f64]) -> usize {
    if value <= 0.0 {
        return 0;
    }
    let bits = value.to_bits();
    let octave = i64::try_from(bits >> 52).expect("eleven bits") - 1023 + i64::from(OCTAVES);
    let within = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    let bin = ends.partition_point(|&end| end < within);
    let last = 2 * i64::from(OCTAVES) * BINS as i64;
    let bin = octave.saturating_mul(BINS as i64) + bin as i64;
    usize::try_from(bin.clamp(0, last)).expect("clamped")
}

fn upper_end(bin: usize) -> f64 {
    if bin == 0 { 0.0 } else { libm::exp2(bin as f64 / BINS as f64 - f64::from(OCTAVES)) }
}

//! Percentiles of a column, exact: each is one of its values, never a value in between; and of
//! values that come one by one without end, in bounded memory.
//!
//! In:    times or counts, in any order.
//! Out:   [`Summary`], for tables and JSON.
//! Keeps: [`Tally`].
//! Not here: measuring (`overfly_jobs::spans`), printing (the host).

use std::collections::BTreeMap;

/// Percentiles by nearest rank: the p-th is the smallest value that at least p % do not exceed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Summary<T> {
    /// The lower median.
    pub p50: T,
    /// Exceeded by at most 5 % of the values.
    pub p95: T,
    /// Exceeded by at most 1 % of the values.
    pub p99: T,
    /// The largest.
    pub max: T,
    /// The arithmetic mean, summed in the order of the column.
    pub mean: f64,
}

impl Summary<f64> {
    /// Of a column of numbers; `None` where it is empty. NaN counts as larger than all others.
    pub fn of_numbers(column: &[f64]) -> Option<Self> {
        let mut sorted = column.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        Self::of_sorted(&sorted, column.iter().sum())
    }
}

impl Summary<u64> {
    /// Of a column of counts; `None` where it is empty.
    pub fn of_counts(column: &[u64]) -> Option<Self> {
        let mut sorted = column.to_vec();
        sorted.sort_unstable();
        Self::of_sorted(&sorted, column.iter().map(|&count| count as f64).sum())
    }
}

impl<T: Copy> Summary<T> {
    fn of_sorted(sorted: &[T], sum: f64) -> Option<Self> {
        let max = *sorted.last()?;
        // The rank is ceil(n·p / 100), from 1.
        let at = |percent: usize| sorted[(sorted.len() * percent).div_ceil(100) - 1];
        Some(Self { p50: at(50), p95: at(95), p99: at(99), max, mean: sum / sorted.len() as f64 })
    }
}

/// Values that are not all kept: their percentiles are exact up to [`Tally::EXACT`] of them. Of more
/// they are those of values rounded towards zero by at most one part in 1024, so that whole numbers
/// up to 2048 stay what they are. Maximum and mean are always exact.
#[derive(Clone, PartialEq, Debug)]
pub struct Tally {
    /// All values as long as they are few, then none.
    exact: Vec<f64>,
    /// How many values have these leading bits, in the order of the values.
    coarse: BTreeMap<u64, usize>,
    count: usize,
    sum: f64,
    max: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Self { exact: vec![], coarse: BTreeMap::new(), count: 0, sum: -0.0, max: f64::MIN }
    }
}

impl Tally {
    /// So many values are kept as they are: 18 minutes at 60 Hz.
    pub const EXACT: usize = 1 << 16;
    /// Bits of the mantissa that are dropped beyond: 10 of 52 stay.
    const DROPPED: u32 = 42;
    const SIGN: u64 = 1 << 63;

    /// The next value. NaN counts as larger than all others.
    pub fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.max = if value.total_cmp(&self.max).is_gt() { value } else { self.max };
        if self.coarse.is_empty() && self.exact.len() < Self::EXACT {
            self.exact.push(value);
            return;
        }
        for value in core::mem::take(&mut self.exact).into_iter().chain([value]) {
            *self.coarse.entry(Self::key(value)).or_default() += 1;
        }
    }

    /// Of all values so far; `None` without any.
    pub fn summary(&self) -> Option<Summary<f64>> {
        if self.coarse.is_empty() {
            return Summary::of_numbers(&self.exact);
        }
        let [p50, p95, p99] = [50, 95, 99].map(|percent| self.percentile(percent));
        Some(Summary { p50, p95, p99, max: self.max, mean: self.sum / self.count as f64 })
    }

    /// The sum of all values, in the order in which they came.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// The first rounded value that at least `percent` % do not exceed.
    fn percentile(&self, percent: usize) -> f64 {
        let mut left = (self.count * percent).div_ceil(100);
        let reached = self.coarse.iter().find(|(_, count)| {
            left = left.saturating_sub(**count);
            left == 0
        });
        reached.map_or(self.max, |(&key, _)| Self::value(key))
    }

    /// Leading bits of a value, ordered as values are: those of negative ones turned around.
    fn key(value: f64) -> u64 {
        let bits = value.to_bits() & (u64::MAX << Self::DROPPED);
        let ordered = if bits & Self::SIGN == 0 { bits | Self::SIGN } else { !bits };
        ordered >> Self::DROPPED
    }

    /// The value nearest to zero that has these leading bits.
    fn value(key: u64) -> f64 {
        let ordered = key << Self::DROPPED;
        let bits = if ordered & Self::SIGN == 0 { !ordered } else { ordered & !Self::SIGN };
        f64::from_bits(bits & (u64::MAX << Self::DROPPED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_of_the_column_by_nearest_rank() {
        let column: Vec<u64> = (1..=200).rev().collect();
        let summary = Summary::of_counts(&column).unwrap();
        assert_eq!((summary.p50, summary.p95, summary.p99, summary.max), (100, 190, 198, 200));
        assert_eq!(summary.mean, 100.5);
    }

    #[test]
    fn a_single_value_is_all_of_its_percentiles_and_an_empty_column_has_none() {
        let one = Summary::of_numbers(&[2.5]).unwrap();
        assert_eq!(one, Summary { p50: 2.5, p95: 2.5, p99: 2.5, max: 2.5, mean: 2.5 });
        assert_eq!(Summary::of_numbers(&[]), None);
        assert_eq!(Summary::of_counts(&[]), None);
    }

    #[test]
    fn the_definition_holds_for_every_length() {
        for n in 1..=300_u64 {
            let column: Vec<u64> = (0..n).map(|i| i * 7919 % n).collect();
            let summary = Summary::of_counts(&column).unwrap();
            for (percent, value) in [(50, summary.p50), (95, summary.p95), (99, summary.p99)] {
                let not_above = |limit: u64| column.iter().filter(|&&v| v <= limit).count() as u64;
                assert!(not_above(value) * 100 >= n * percent);
                assert!(value == 0 || not_above(value - 1) * 100 < n * percent);
            }
        }
    }

    #[test]
    fn a_tally_is_exact_while_it_is_short_and_within_a_thousandth_beyond() {
        let value = |i: usize| ((i * 7919) % 100_003) as f64 * 0.37 - 3000.0;
        for count in [1, 2, 1000, Tally::EXACT, Tally::EXACT + 1, 200_000] {
            let column: Vec<f64> = (0..count).map(value).collect();
            let mut tally = Tally::default();
            column.iter().for_each(|&value| tally.add(value));
            let (exact, found) = (Summary::of_numbers(&column).unwrap(), tally.summary().unwrap());
            assert_eq!((found.max, found.mean), (exact.max, exact.mean), "{count}");
            assert_eq!(tally.sum(), column.iter().sum::<f64>());
            if count <= Tally::EXACT {
                assert_eq!(found, exact);
            }
            let pairs = [(found.p50, exact.p50), (found.p95, exact.p95), (found.p99, exact.p99)];
            for (found, exact) in pairs {
                let lost = exact.abs() - found.abs();
                assert!((0.0..=exact.abs() / 1024.0).contains(&lost), "{found} of {exact}");
            }
        }
        assert_eq!(Tally::default().summary(), None);
    }

    #[test]
    fn a_long_tally_keeps_whole_numbers_and_the_order_of_the_rest() {
        let mut tally = Tally::default();
        let numbers = [-2.0, -0.0, 0.0, 1.0, 3.0, 100.0, 2047.0];
        (0..100_000).for_each(|i| tally.add(numbers[i % 7]));
        let summary = tally.summary().unwrap();
        assert_eq!((summary.p50, summary.p95, summary.max), (1.0, 2047.0, 2047.0));
        assert!(tally.exact.capacity() == 0 && tally.coarse.len() == 7);
        (0..150_000).for_each(|_| tally.add(f64::NAN));
        assert!(tally.summary().unwrap().p95.is_nan() && tally.summary().unwrap().max.is_nan());
    }
}

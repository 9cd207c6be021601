//! Percentiles of a column, exact: each is one of its values, never a value in between.
//!
//! In:    a column of times or counts, in any order.
//! Out:   [`Summary`], for tables and JSON.
//! Keeps: nothing.
//! Not here: measuring (`overfly_jobs::spans`), printing (the host).

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
}

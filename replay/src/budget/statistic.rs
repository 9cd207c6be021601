//! One number of a column, and the frame that is the worst of it.
//!
//! In:    a column of counts or times, a statistic, from where on a frame counts.
//! Out:   [`Taken`].
//! Keeps: nothing.
//! Not here: which statistics there are (`overfly_config`), limits (`judge`).

use overfly_config::Statistic;

/// What was taken of a column.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Taken {
    /// The number, in the column's unit, as a share, in frames, or in frames a minute.
    pub value: f64,
    /// The frame to look at: the largest, the first of the longest run.
    pub worst: usize,
}

/// Takes a statistic of a column; nothing is trimmed. `None` where the column is empty, and for
/// [`Statistic::Changed`], which takes two.
///
/// - In: `over` for the statistics that need it, in the column's unit; frames a second.
/// - Out: percentiles by nearest rank, so that each is a value of the column. A hitch is a frame
///   above `over`.
pub fn take(statistic: Statistic, over: f64, column: &[f64], rate_hz: f64) -> Option<Taken> {
    let worst = worst(column)?;
    let above = || column.iter().filter(|&&value| value > over).count() as f64;
    let frames = column.len() as f64;
    let (value, worst) = match statistic {
        Statistic::Sum => (column.iter().sum(), worst),
        Statistic::Mean => (column.iter().sum::<f64>() / frames, worst),
        Statistic::Max => (column[worst], worst),
        Statistic::Percentile(tenths) => (percentile(column, tenths), worst),
        Statistic::ShareOver => (above() / frames, worst),
        Statistic::HitchesPerMinute => (above() * 60.0 * rate_hz / frames, worst),
        Statistic::LongestRunOver => {
            let (first, count) = longest_run(column, over);
            (count as f64, if count > 0 { first } else { worst })
        }
        Statistic::Changed => return None,
    };
    Some(Taken { value, worst })
}

/// The first frame of the largest value. NaN counts as larger than all others.
pub fn worst(column: &[f64]) -> Option<usize> {
    let numbered = column.iter().enumerate();
    numbered.max_by(|(i, a), (j, b)| a.total_cmp(b).then(j.cmp(i))).map(|(index, _)| index)
}

/// The smallest value that at least so many tenths of a percent do not exceed.
fn percentile(column: &[f64], tenths: u32) -> f64 {
    let mut sorted = column.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let rank = (sorted.len() * tenths as usize).div_ceil(1000);
    sorted[rank.max(1) - 1]
}

/// First frame and number of the longest run above `over`.
fn longest_run(column: &[f64], over: f64) -> (usize, usize) {
    let (mut best, mut first) = ((0, 0), 0);
    for (index, &value) in column.iter().enumerate() {
        if value <= over {
            first = index + 1;
        } else if index + 1 - first > best.1 {
            best = (first, index + 1 - first);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(statistic: Statistic, over: f64, column: &[f64]) -> (f64, usize) {
        let taken = take(statistic, over, column, 60.0).unwrap();
        (taken.value, taken.worst)
    }

    #[test]
    fn every_statistic_of_a_known_column() {
        let column: Vec<f64> = (1..=1000).map(f64::from).collect();
        assert_eq!(of(Statistic::Sum, 0.0, &column), (500_500.0, 999));
        assert_eq!(of(Statistic::Mean, 0.0, &column).0, 500.5);
        assert_eq!(of(Statistic::Percentile(500), 0.0, &column).0, 500.0);
        assert_eq!(of(Statistic::Percentile(990), 0.0, &column).0, 990.0);
        assert_eq!(of(Statistic::Percentile(999), 0.0, &column).0, 999.0);
        assert_eq!(of(Statistic::Max, 0.0, &column).0, 1000.0);
        assert_eq!(of(Statistic::ShareOver, 900.0, &column).0, 0.1);
        // 100 frames of 1000 at 60 Hz: 100 in 16.67 s.
        assert_eq!(of(Statistic::HitchesPerMinute, 900.0, &column).0, 360.0);
        assert_eq!(take(Statistic::Changed, 0.0, &column, 60.0), None);
        assert_eq!(take(Statistic::Max, 0.0, &[], 60.0), None);
    }

    #[test]
    fn a_single_hitch_is_never_trimmed() {
        let mut column = vec![2.0; 10_000];
        column[7] = 68.0;
        assert_eq!(of(Statistic::Max, 0.0, &column), (68.0, 7));
        assert_eq!(of(Statistic::ShareOver, 16.6, &column).0, 1e-4);
        assert_eq!(of(Statistic::LongestRunOver, 16.6, &column), (1.0, 7));
        assert_eq!(of(Statistic::Percentile(999), 0.0, &column).0, 2.0);
    }

    #[test]
    fn the_longest_run_is_the_first_of_its_length() {
        let column = [1.0, 5.0, 5.0, 1.0, 5.0, 5.0, 5.0, 1.0, 5.0, 5.0, 5.0];
        assert_eq!(of(Statistic::LongestRunOver, 4.0, &column), (3.0, 4));
        assert_eq!(of(Statistic::LongestRunOver, 9.0, &column).0, 0.0);
        assert_eq!(worst(&[1.0, 3.0, 3.0]), Some(1));
        assert_eq!(worst(&[1.0, f64::NAN, 3.0]), Some(1));
    }
}

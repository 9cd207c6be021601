//! How much slower, as an interval, and what that says.
//!
//! In:    an estimate and its spread; the smallest effect that is of interest.
//! Out:   [`Interval`], [`Relation`].
//! Keeps: nothing.
//! Not here: estimates and their spread (`pairs`).

use std::fmt;

/// By which share the second is slower than the first, with the bounds of what it may be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// The estimate: 0.03 is three percent slower, -0.03 three percent faster.
    pub estimate: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

/// How two programs relate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Relation {
    /// The interval lies above the smallest effect of interest.
    Slower,
    /// The interval lies within it.
    Same,
    /// The interval lies below it.
    Faster,
    /// None of these: more runs may tell.
    Inconclusive,
    /// So short a part of the frame that its times are those of the clock.
    TooShort,
}

impl Interval {
    /// Half of its width: what these runs can resolve.
    pub fn resolves(&self) -> f64 {
        (self.high - self.low) / 2.0
    }

    /// What it says, given the smallest effect of interest as a share.
    pub fn relation(&self, effect: f64) -> Relation {
        match self {
            Self { low, .. } if *low > effect => Relation::Slower,
            Self { high, .. } if *high < -effect => Relation::Faster,
            Self { low, high, .. } if *low >= -effect && *high <= effect => Relation::Same,
            _ => Relation::Inconclusive,
        }
    }
}

impl Relation {
    /// In one word, as reports have it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Slower => "SLOWER",
            Self::Same => "SAME",
            Self::Faster => "FASTER",
            Self::Inconclusive => "INCONCLUSIVE",
            Self::TooShort => "too short",
        }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [estimate, low, high] = [self.estimate, self.low, self.high].map(|x| x * 100.0);
        write!(f, "{estimate:+.2} % ({low:+.2} to {high:+.2} %)")
    }
}

/// Student's t that a share of 0.995 lies below, by degrees of freedom from 1.
const T_995: [f64; 30] = [
    63.657, 9.925, 5.841, 4.604, 4.032, 3.707, 3.499, 3.355, 3.250, 3.169, 3.106, 3.055, 3.012,
    2.977, 2.947, 2.921, 2.898, 2.878, 2.861, 2.845, 2.831, 2.819, 2.807, 2.797, 2.787, 2.779,
    2.771, 2.763, 2.756, 2.750,
];

/// Half the width of a 99 % interval in standard errors, for estimates from `runs` runs; infinite
/// below two of them. At 32 runs and more it is rounded up to that of 31.
pub fn t_995(runs: usize) -> f64 {
    match runs {
        0 | 1 => f64::INFINITY,
        runs => T_995[(runs - 2).min(T_995.len() - 1)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_means_that_the_whole_interval_is_of_no_interest() {
        let of = |low, high| Interval { estimate: (low + high) / 2.0, low, high }.relation(0.03);
        assert_eq!(of(-0.01, 0.02), Relation::Same);
        assert_eq!(of(-0.03, 0.03), Relation::Same);
        assert_eq!(of(-0.01, 0.04), Relation::Inconclusive);
        assert_eq!(of(0.01, 0.10), Relation::Inconclusive);
        assert_eq!(of(0.04, 0.10), Relation::Slower);
        assert_eq!(of(-0.10, -0.04), Relation::Faster);
        assert_eq!(of(f64::NEG_INFINITY, f64::INFINITY), Relation::Inconclusive);
        assert_eq!(of(f64::NAN, f64::NAN), Relation::Inconclusive);
    }

    #[test]
    fn few_runs_make_wide_intervals() {
        assert_eq!(t_995(1), f64::INFINITY);
        assert_eq!((t_995(2), t_995(6), t_995(31), t_995(400)), (63.657, 4.032, 2.75, 2.75));
    }
}

//! A smooth curve below, or above, all of its values: what a flight may not sink through.
//!
//! In:    times and values.
//! Out:   a twice continuously differentiable bound; a smooth maximum with it.
//! Keeps: the bound's control values.
//! Not here: which values (`curve`, and whoever lifts a flight).
//! Source: de Boor 1978, A Practical Guide to Splines, chapters IX and XI: a cubic B-spline is a mean
//!         of four neighbouring control values, so it stays within what they span.

/// A bound over time. Times are the caller's.
#[derive(Clone, PartialEq, Debug)]
pub struct Envelope {
    controls: Vec<f64>,
}

impl Envelope {
    /// A curve that is nowhere above the smaller of the two values around, and nowhere below the
    /// least of those `reach` (2 at least) to either side.
    pub fn below(values: &[f64], reach: usize) -> Self {
        Self::of(values, reach.max(2), f64::min)
    }

    /// A curve that is nowhere below the larger of the two values around.
    pub fn above(values: &[f64], reach: usize) -> Self {
        Self::of(values, reach.max(2), f64::max)
    }

    fn of(values: &[f64], reach: usize, pick: fn(f64, f64) -> f64) -> Self {
        let around = |i: usize| {
            let from = i.saturating_sub(reach);
            let range = &values[from..(i + reach + 1).min(values.len())];
            range.iter().fold(values[i], |best, &value| pick(best, value))
        };
        Self { controls: (0..values.len()).map(around).collect() }
    }

    /// The bound at `time_s`, which lies between times `i` and the next. `times_s` are those of the
    /// values.
    pub fn at(&self, times_s: &[f64], i: usize, time_s: f64) -> f64 {
        let n = times_s.len();
        if n < 2 {
            return self.controls[0];
        }
        // Two times before and three after, those outside as far apart as the first and last two.
        let first_s = times_s[1] - times_s[0];
        let last_s = times_s[n - 1] - times_s[n - 2];
        let knot = |k: usize| match (i + k).checked_sub(2) {
            None => times_s[0] - first_s * if i + k == 0 { 2.0 } else { 1.0 },
            Some(at) if at < n => times_s[at],
            Some(at) => times_s[n - 1] + last_s * (at + 1 - n) as f64,
        };
        let control = |k: usize| self.controls[(i + k).saturating_sub(1).min(n - 1)];
        let mut d: [f64; 4] = core::array::from_fn(control);
        for round in 1..4 {
            for k in (round..4).rev() {
                let (from, to) = (knot(k - 1), knot(k + 3 - round));
                let t = (time_s - from) / (to - from);
                d[k] = (1.0 - t) * d[k - 1] + t * d[k];
            }
        }
        d[3]
    }
}

/// `value`, but no less than `floor`: equal to `value` from `floor + soft` on, to `floor` below
/// `floor − soft`, and twice continuously differentiable in between.
pub(crate) fn held_above(value: f64, floor: f64, soft: f64) -> f64 {
    let above = value - floor;
    if above >= soft {
        return value;
    }
    let s = ((above + soft) / (2.0 * soft)).max(0.0);
    floor + 2.0 * soft * (s * s * s - s * s * s * s / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_keep_to_their_side_whatever_the_times() {
        let times = [0.0, 1.0, 1.5, 4.0, 5.0, 5.2, 9.0, 10.0];
        let values = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0];
        let (below, above) = (Envelope::below(&values, 2), Envelope::above(&values, 2));
        for k in 0..=1000 {
            let t = f64::from(k) * 0.01;
            let i = crate::spline::interval(&times, t);
            let (least, most) = (values[i].min(values[i + 1]), values[i].max(values[i + 1]));
            assert!(below.at(&times, i, t) <= least + 1e-12, "at {t}");
            assert!(above.at(&times, i, t) >= most - 1e-12, "at {t}");
            assert!(below.at(&times, i, t) >= 1.0 - 1e-12 && above.at(&times, i, t) <= 9.0 + 1e-12);
        }
        assert_eq!(Envelope::below(&[7.0], 2).at(&[0.0], 0, 0.0), 7.0);
    }

    #[test]
    fn a_bound_has_no_corner_where_intervals_meet() {
        let times = [0.0, 1.0, 1.5, 4.0, 5.0, 5.2, 9.0, 10.0];
        let bound = Envelope::below(&[3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0], 2);
        for i in 0..6 {
            let meet = times[i + 1];
            let slope = |i: usize, t: f64| {
                (bound.at(&times, i, t + 1e-4) - bound.at(&times, i, t - 1e-4)) / 2e-4
            };
            assert!((bound.at(&times, i, meet) - bound.at(&times, i + 1, meet)).abs() < 1e-12);
            assert!((slope(i, meet) - slope(i + 1, meet)).abs() < 1e-6, "at {meet}");
        }
    }

    #[test]
    fn what_is_held_above_a_floor_is_smooth_and_untouched_higher_up() {
        assert_eq!(held_above(10.0, 5.0, 0.5), 10.0);
        assert_eq!(held_above(5.5, 5.0, 0.5), 5.5);
        assert_eq!(held_above(-90.0, 5.0, 0.5), 5.0);
        let mut before = held_above(4.0, 5.0, 0.5);
        for k in 1..=2000 {
            let now = held_above(4.0 + f64::from(k) * 1e-3, 5.0, 0.5);
            assert!(now >= before && now - before <= 1e-3 + 1e-12 && now >= 5.0);
            before = now;
        }
    }
}

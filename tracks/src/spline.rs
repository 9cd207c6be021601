//! Natural cubic splines through several columns at once, and the smoothest one within tolerances.
//!
//! In:    times; a value of N columns at each; how far each value may be moved.
//! Out:   a twice continuously differentiable curve.
//! Keeps: values and second derivatives at the times.
//! Not here: what the columns are (`curve`).
//! Source: Reinsch 1967, Smoothing by spline functions; Boyd et al. 2011, Distributed optimization
//!         via the alternating direction method of multipliers, section 5.
//!
//! A number written in steps may be anything within half a step. A curve through the numbers
//! themselves wobbles from step to step. This one has the least squared second derivative among
//! those that keep within the half steps: splitting into a smoothing spline, which is a band matrix
//! factored once a pass, and moving values into their boxes, which is exact. The last values are in
//! their boxes, whatever the passes left.

/// A curve of N columns. Times are the caller's.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Spline<const N: usize> {
    values: Vec<[f64; N]>,
    /// Second derivatives at the times.
    bends: Vec<[f64; N]>,
}

/// How many intervals the smoothing of each pass reaches, from far to near; and steps in each.
const REACHES: [f64; 6] = [48.0, 24.0, 12.0, 6.0, 3.0, 1.5];
const STEPS: usize = 14;

impl<const N: usize> Spline<N> {
    /// The natural spline through the values. `times_s` must rise; at least one.
    pub fn through(times_s: &[f64], values: Vec<[f64; N]>) -> Self {
        let bends = Band::new(times_s, 0.0).bends(times_s, &values);
        Self { values, bends }
    }

    /// The smoothest curve whose value at each time `within(i, value)` leaves as it is; `within`
    /// gives the nearest allowed value.
    pub fn within(
        times_s: &[f64],
        values: Vec<[f64; N]>,
        within: &dyn Fn(usize, [f64; N]) -> [f64; N],
    ) -> Self {
        let n = values.len();
        if n < 3 {
            return Self::through(times_s, values);
        }
        let step_s = median_step(times_s);
        // Smooth values, values in their boxes, and what the two have differed by so far.
        let (mut smooth, mut boxed) = (values.clone(), values);
        let mut dual = vec![[0.0; N]; n];
        let mut weight_before = None;
        for reach in REACHES {
            let weight = step_s * step_s * step_s * reach * reach * reach * reach;
            let band = Band::new(times_s, weight);
            // The dual counts in units of the pass before.
            let scale = weight_before.map_or(1.0, |before: f64| weight / before);
            dual.iter_mut().flatten().for_each(|d| *d *= scale);
            weight_before = Some(weight);
            for _ in 0..STEPS {
                smooth.clone_from(&boxed);
                smooth.iter_mut().zip(&dual).for_each(|(value, d)| *value = minus(*value, *d));
                band.smooth(times_s, &mut smooth);
                (0..n).for_each(|i| boxed[i] = within(i, plus(smooth[i], dual[i])));
                (0..n).for_each(|i| dual[i] = minus(plus(smooth[i], dual[i]), boxed[i]));
            }
        }
        let values = smooth.iter().enumerate().map(|(i, &value)| within(i, value)).collect();
        Self::through(times_s, values)
    }

    /// Value at `time_s`, which lies between times `i` and the next.
    pub fn at(&self, times_s: &[f64], i: usize, time_s: f64) -> [f64; N] {
        if self.values.len() < 2 {
            return self.values[0];
        }
        let step_s = times_s[i + 1] - times_s[i];
        let b = (time_s - times_s[i]) / step_s;
        let a = 1.0 - b;
        let (bend_a, bend_b) =
            ((a * a * a - a) * step_s * step_s / 6.0, (b * b * b - b) * step_s * step_s / 6.0);
        core::array::from_fn(|c| {
            a * self.values[i][c]
                + b * self.values[i + 1][c]
                + bend_a * self.bends[i][c]
                + bend_b * self.bends[i + 1][c]
        })
    }

    /// The values that the curve goes through.
    pub fn values(&self) -> &[[f64; N]] {
        &self.values
    }
}

/// The interval that holds `time_s`: the first or last for times outside.
pub(crate) fn interval(times_s: &[f64], time_s: f64) -> usize {
    let after = times_s.partition_point(|&t| t <= time_s);
    after.saturating_sub(1).min(times_s.len().saturating_sub(2))
}

fn plus<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    core::array::from_fn(|c| a[c] + b[c])
}

fn minus<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    core::array::from_fn(|c| a[c] - b[c])
}

fn median_step(times_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// R + w·QᵀQ of Reinsch's paper as L·D·Lᵀ: symmetric, positive, two diagonals beside the main one.
struct Band {
    weight: f64,
    d: Vec<f64>,
    l1: Vec<f64>,
    l2: Vec<f64>,
}

impl Band {
    fn new(times_s: &[f64], weight: f64) -> Self {
        let m = times_s.len().saturating_sub(2);
        let h = |i: usize| times_s[i + 1] - times_s[i];
        // Row i of Qᵀ: second differences around time i + 1.
        let q = |i: usize| [1.0 / h(i), -1.0 / h(i) - 1.0 / h(i + 1), 1.0 / h(i + 1)];
        let (mut d, mut l1, mut l2) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        for i in 0..m {
            let [a, b, c] = q(i);
            d[i] = (h(i) + h(i + 1)) / 3.0 + weight * (a * a + b * b + c * c);
            if i == 0 {
                continue;
            }
            let [_, before_b, before_c] = q(i - 1);
            let mut side = h(i) / 6.0 + weight * (before_b * a + before_c * b);
            if i > 1 {
                let far = weight * q(i - 2)[2] * a;
                l2[i] = far / d[i - 2];
                side -= far * l1[i - 1];
                d[i] -= l2[i] * far;
            }
            l1[i] = side / d[i - 1];
            d[i] -= l1[i] * side;
        }
        Self { weight, d, l1, l2 }
    }

    /// Second derivatives at all times of the smoothing spline of `values`; 0 at both ends.
    fn bends<const N: usize>(&self, times_s: &[f64], values: &[[f64; N]]) -> Vec<[f64; N]> {
        // Bend i + 1 belongs to row i. Two rows of zeros follow, so that the last rows need no care.
        let mut bends = vec![[0.0; N]; values.len().max(2) + 2];
        let m = self.d.len();
        let rise = |i: usize| {
            let step_s = times_s[i + 1] - times_s[i];
            minus(values[i + 1], values[i]).map(|rise| rise / step_s)
        };
        for i in 0..m {
            let (after, before) = (rise(i + 1), rise(i));
            // The first two rows have no second one before: their factor is zero.
            let (near, far) = (bends[i], bends[i.saturating_sub(1)]);
            bends[i + 1] = core::array::from_fn(|c| {
                after[c] - before[c] - self.l1[i] * near[c] - self.l2[i] * far[c]
            });
        }
        for i in (0..m).rev() {
            let l1 = self.l1.get(i + 1).copied().unwrap_or(0.0);
            let l2 = self.l2.get(i + 2).copied().unwrap_or(0.0);
            let (row, near, far) = (bends[i + 1], bends[i + 2], bends[i + 3]);
            bends[i + 1] =
                core::array::from_fn(|c| row[c] / self.d[i] - l1 * near[c] - l2 * far[c]);
        }
        bends.truncate(values.len());
        bends
    }

    /// Replaces values by those of their smoothing spline.
    fn smooth<const N: usize>(&self, times_s: &[f64], values: &mut [[f64; N]]) {
        let bends = self.bends(times_s, values);
        let slope = |i: usize| {
            let step_s = times_s[i + 1] - times_s[i];
            minus(bends[i + 1], bends[i]).map(|rise| rise / step_s)
        };
        let mut before = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            let after = if i + 1 < bends.len() { slope(i) } else { [0.0; N] };
            let moved = minus(after, before).map(|turn| self.weight * turn);
            *value = minus(*value, moved);
            before = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::trig::sin;

    fn seconds(count: u32) -> Vec<f64> {
        (0..count).map(f64::from).collect()
    }

    #[test]
    fn a_spline_goes_through_its_values_and_follows_a_sine() {
        let times: Vec<f64> =
            (0..60).map(|i| f64::from(i) * 0.1 + 0.03 * f64::from(i % 2)).collect();
        let spline = Spline::through(&times, times.iter().map(|&t| [sin(t), 2.0 * t]).collect());
        for k in 100..500 {
            let t = f64::from(k) * 0.01;
            let [s, line] = spline.at(&times, interval(&times, t), t);
            assert!((s - sin(t)).abs() < 1e-5 && (line - 2.0 * t).abs() < 1e-12, "at {t}");
        }
    }

    #[test]
    fn steps_of_a_metre_are_smoothed_and_no_value_leaves_its_half_step() {
        let times = seconds(400);
        let truth = |t: f64| 300.0 + 40.0 * sin(t / 60.0) + 0.13 * t;
        let read: Vec<[f64; 1]> = times.iter().map(|&t| [truth(t).round()]).collect();
        let within = |i: usize, [v]: [f64; 1]| [v.clamp(read[i][0] - 0.5, read[i][0] + 0.5)];
        let spline = Spline::within(&times, read.clone(), &within);
        let bends = |s: &Spline<1>| {
            let sum: f64 = s.bends.iter().map(|[b]| b * b).sum();
            (sum / s.bends.len() as f64).sqrt()
        };
        let rough = bends(&Spline::through(&times, read.clone()));
        assert!(bends(&spline) < rough / 30.0, "{} of {rough}", bends(&spline));
        let mut squares = 0.0;
        for (i, &t) in times.iter().enumerate() {
            let [value] = spline.values()[i];
            assert!((value - read[i][0]).abs() <= 0.5);
            squares += (value - truth(t)) * (value - truth(t));
        }
        let rms = (squares / times.len() as f64).sqrt();
        assert!(rms < 0.2, "rms {rms} m");
    }

    #[test]
    fn values_that_may_not_move_are_met() {
        let times = seconds(50);
        let read: Vec<[f64; 1]> = times.iter().map(|&t| [sin(t)]).collect();
        let spline = Spline::within(&times, read.clone(), &|i, _| read[i]);
        assert_eq!(spline.values(), read);
        let two = Spline::within(&[0.0, 2.0], vec![[1.0], [3.0]], &|_, v| v);
        assert_eq!(two.at(&[0.0, 2.0], 0, 1.0), [2.0]);
    }
}

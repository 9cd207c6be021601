//! Power laws: straight lines through logarithms.
//!
//! In:    pairs of positive numbers.
//! Out:   [`Fit`]: exponent, factor, how well it fits and to how many.
//! Keeps: nothing.
//! Not here: which points belong to a law (the host).

/// y = factor · x^slope, by least squares of the logarithms.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fit {
    /// Exponent.
    pub slope: f64,
    /// y where x is 1.
    pub factor: f64,
    /// Root of the mean square of ln y − ln fit: 0.1 is some 10 %.
    pub residual: f64,
    /// Pairs that were fitted.
    pub points: usize,
    /// Least and greatest x.
    pub range: [f64; 2],
}

impl Fit {
    /// The law's value.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * libm::pow(x, self.slope)
    }
}

/// The law through pairs; those that are not finite and positive are left out. `None` with fewer
/// than three, or where they span less than a factor of two.
pub fn fit(pairs: &[[f64; 2]]) -> Option<Fit> {
    let usable = |pair: &&[f64; 2]| pair.iter().all(|x| x.is_finite() && *x > 0.0);
    let pairs: Vec<[f64; 2]> = pairs.iter().filter(usable).copied().collect();
    let logs: Vec<[f64; 2]> = pairs.iter().map(|pair| pair.map(libm::log)).collect();
    let range = pairs
        .iter()
        .fold([f64::INFINITY, 0.0_f64], |[least, most], [x, _]| [least.min(*x), most.max(*x)]);
    if pairs.len() < 3 || range[1] < 2.0 * range[0] {
        return None;
    }
    let n = logs.len() as f64;
    let mean = [0, 1].map(|i| logs.iter().map(|log| log[i]).sum::<f64>() / n);
    let sum = |of: &dyn Fn([f64; 2]) -> f64| {
        logs.iter().map(|log| of([log[0] - mean[0], log[1] - mean[1]])).sum::<f64>()
    };
    let slope = sum(&|[x, y]| x * y) / sum(&|[x, _]| x * x);
    let squares = sum(&|[x, y]| (y - slope * x) * (y - slope * x));
    let factor = libm::exp(mean[1] - slope * mean[0]);
    Some(Fit { slope, factor, residual: (squares / n).sqrt(), points: pairs.len(), range })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_is_found_again() {
        let xs = [5e3, 1e4, 5e4, 2e5];
        let exact = fit(&xs.map(|x| [x, 300.0 * libm::pow(x, -0.7)])).unwrap();
        assert!((exact.slope + 0.7).abs() < 1e-12 && (exact.factor - 300.0).abs() < 1e-8);
        assert!(exact.residual < 1e-12 && exact.points == 4 && exact.range == [5e3, 2e5]);
        assert!((exact.at(1e4) - 300.0 * libm::pow(1e4, -0.7)).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_a_number_is_left_out_and_too_little_has_no_law() {
        let pairs = [[1.0, 1.0], [0.0, 5.0], [4.0, f64::NAN], [2.0, 2.0], [8.0, 8.0]];
        let law = fit(&pairs).unwrap();
        assert!(law.points == 3 && (law.slope - 1.0).abs() < 1e-12);
        assert_eq!(fit(&pairs[..4]), None, "two points");
        assert_eq!(fit(&[[1.0, 1.0], [1.1, 2.0], [1.2, 3.0]]), None, "they span too little");
    }
}

//! What a point yielded, in the few numbers that are compared.
//!
//! In:    the metric vectors of measured frames, counts and times of flown ones.
//! Out:   [`Yield`]; one value for a flight out of one a frame.
//! Keeps: nothing.
//! Not here: the metrics (`measure`), clocks (the host).

/// What a point yielded over a flight.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Yield {
    /// E1 that one ray in a thousand exceeds, of the worst measured frame; pixels.
    pub error_px: f64,
    /// Root of the mean square of E1; pixels.
    pub rms_px: f64,
    /// The greatest bound of a measured frame, pixels.
    pub bound_px: f64,
    /// The scene's tolerance, pixels.
    pub tolerance_px: f64,
    /// Most triangles that the scene allows.
    pub triangles_max: f64,
    /// Fewest and most triangles of a measured frame.
    pub triangles_span: [f64; 2],
    /// Triangles, the mean of all flown frames.
    pub triangles: f64,
    /// CPU time of a frame, median and p99; milliseconds. NaN while it is not timed.
    pub cpu_ms: [f64; 2],
}

/// A bound this much above the tolerance still meets it: vertices on their way, splits of the
/// frame that waited for the next.
const MET: f64 = 1.05;
/// A mesh with this share of all triangles that it may have is full: splits come in groups.
const FULL: f64 = 0.95;

impl Yield {
    /// The tolerance decides how fine the mesh is: no measured frame had all triangles that it
    /// may. (Pages that are not there yet, and the deepest level, can end refinement before.)
    pub fn tolerance_decides(&self) -> bool {
        self.triangles_span[1] < FULL * self.triangles_max
    }

    /// The number of triangles decides: every measured frame had as many as it may.
    pub fn budget_decides(&self) -> bool {
        self.triangles_span[0] >= FULL * self.triangles_max
    }

    /// The bound of every measured frame was within the tolerance.
    pub fn meets_tolerance(&self) -> bool {
        self.bound_px <= MET * self.tolerance_px
    }

    /// What a scene can promise: the measured error; and where the tolerance decides and is met,
    /// the bound, which then holds wherever the flight goes.
    pub fn promise_px(&self) -> f64 {
        if self.tolerance_decides() && self.meets_tolerance() {
            self.error_px.max(self.bound_px)
        } else {
            self.error_px
        }
    }
}

/// One value for the flight of a metric that has one each measured frame. What is called `rms` is
/// the root of the mean square, `p50`, `median`, `tightness` and `mean` the mean, all else the
/// greatest: so that `p999` is that of the worst frame. NaN, what a frame has none of, is left
/// out; without any frame it is NaN.
pub fn fold(name: &str, values: &[f64]) -> f64 {
    let told: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    if told.is_empty() {
        return f64::NAN;
    }
    let mean = |of: fn(f64) -> f64| told.iter().map(|&x| of(x)).sum::<f64>() / told.len() as f64;
    let has = |word: &str| name.split(['_', '.']).any(|part| part == word);
    if has("rms") {
        return mean(|x| x * x).sqrt();
    }
    if ["p50", "median", "mean", "tightness"].into_iter().any(has) {
        return mean(|x| x);
    }
    told.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_become_a_flight_by_the_name_of_the_metric() {
        assert_eq!(fold("e1_px.rms", &[3.0, 4.0]), 12.5_f64.sqrt());
        assert_eq!(fold("e1_p50", &[1.0, 3.0, f64::NAN]), 2.0);
        assert_eq!(fold("e1_p999", &[1.0, 3.0, 2.0]), 3.0);
        assert_eq!(fold("holes", &[0.0, 0.0]), 0.0);
        assert!(fold("holes", &[]).is_nan());
    }

    #[test]
    fn a_promise_counts_the_bound_only_where_the_tolerance_decides() {
        let free = Yield {
            error_px: 0.4,
            rms_px: 0.1,
            bound_px: 2.0,
            tolerance_px: 2.0,
            triangles_max: 1e5,
            triangles_span: [2e4, 3e4],
            triangles: 2.5e4,
            cpu_ms: [f64::NAN; 2],
        };
        assert!(free.tolerance_decides() && !free.budget_decides());
        assert_eq!(free.promise_px(), 2.0);
        let full = Yield { bound_px: 9.0, triangles_span: [9.6e4, 1e5], ..free };
        assert!(!full.tolerance_decides() && full.budget_decides());
        assert_eq!(full.promise_px(), 0.4);
        let late = Yield { bound_px: 9.0, ..free };
        assert!(late.tolerance_decides() && !late.meets_tolerance());
        assert_eq!(late.promise_px(), 0.4, "a bound that was not met is no promise");
    }
}

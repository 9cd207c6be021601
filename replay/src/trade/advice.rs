//! Advice: the cheapest point for a stated error, the most accurate for a stated budget; and where
//! to look on when no point will do.
//!
//! In:    a goal, what points yielded.
//! Out:   which point; the next limits to try.
//! Keeps: [`Search`]: how far it went.
//! Not here: flying what is tried (the host).

use super::yields::Yield;

/// What a scene shall keep.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Goal {
    /// E1 p99.9 of the worst measured frame, and the bound where the tolerance decides; pixels.
    ErrorPx(f64),
    /// CPU time of a frame, p99; milliseconds.
    BudgetMs(f64),
}

impl Goal {
    /// Share of an error that is kept free: frames that were not measured differ a little.
    pub const ERROR_MARGIN: f64 = 0.05;
    /// Share of a budget that is kept free: machines are not always equally fast.
    pub const BUDGET_MARGIN: f64 = 0.15;

    /// What a point may have at most, the margin kept free.
    pub fn aim(&self) -> f64 {
        match self {
            Self::ErrorPx(px) => px * (1.0 - Self::ERROR_MARGIN),
            Self::BudgetMs(ms) => ms * (1.0 - Self::BUDGET_MARGIN),
        }
    }

    /// What of a point the goal is about.
    pub fn of(&self, found: &Yield) -> f64 {
        match self {
            Self::ErrorPx(_) => found.promise_px(),
            Self::BudgetMs(_) => found.cpu_ms[1],
        }
    }

    /// Whether a point meets it, margin included.
    pub fn meets(&self, found: &Yield) -> bool {
        self.of(found) <= self.aim()
    }

    /// Whether a point keeps what was stated, the margin being used up or not.
    pub fn keeps(&self, found: &Yield) -> bool {
        match self {
            Self::ErrorPx(px) => self.of(found) <= *px,
            Self::BudgetMs(ms) => self.of(found) <= *ms,
        }
    }

    /// What is least among points that meet the goal; the triangles decide where it is the same.
    fn price(&self, found: &Yield) -> f64 {
        match self {
            Self::ErrorPx(_) => found.cpu_ms[1],
            Self::BudgetMs(_) => found.error_px,
        }
    }

    /// The greatest price that is as good as the least one: times are only so well known.
    fn as_good_as(&self, least: f64) -> f64 {
        match self {
            Self::ErrorPx(_) => least * 1.1 + 0.01,
            Self::BudgetMs(_) => least,
        }
    }
}

/// The best point that meets the goal; `Err` with the one that comes nearest where none does, and
/// nothing where nothing is known of any.
pub fn choose(goal: Goal, found: &[Yield]) -> Result<usize, Option<usize>> {
    let known = (0..found.len()).filter(|&i| goal.of(&found[i]).is_finite());
    let by = |key: &dyn Fn(&Yield) -> [f64; 2], a: usize, b: usize| {
        let (a, b) = (key(&found[a]), key(&found[b]));
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
    };
    let meeting: Vec<usize> = known.clone().filter(|&i| goal.meets(&found[i])).collect();
    // What was not timed costs nothing that is known: its price is no number.
    let prices = meeting.iter().map(|&i| goal.price(&found[i]));
    let most = goal.as_good_as(prices.fold(f64::INFINITY, f64::min));
    let fewest = |y: &Yield| [y.triangles, goal.price(y)];
    let good =
        meeting.iter().copied().filter(|&i| most.is_infinite() || goal.price(&found[i]) <= most);
    let best = good.min_by(|&a, &b| by(&fewest, a, b));
    best.ok_or_else(|| known.min_by(|&a, &b| by(&|y| [goal.of(y), y.triangles], a, b)))
}

/// A search for the number of triangles that meets a goal: in steps of √2 away from one that misses
/// it, some steps at a time, since the ground that points are measured against takes longer to make
/// than they take to fly. It is over with the first that meets the goal, or without one.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    from: f64,
    /// Above 1 where more triangles are better, below where fewer are.
    ratio: f64,
    taken: u32,
}

/// Steps that are tried together.
const TOGETHER: u32 = 4;
/// Steps that are tried at most: 16 times the triangles, or a sixteenth.
const STEPS: u32 = 8;

impl Search {
    /// From a number of triangles that misses the goal.
    pub fn from(goal: Goal, triangles_max: u32) -> Self {
        let root = core::f64::consts::SQRT_2;
        let ratio = if matches!(goal, Goal::ErrorPx(_)) { root } else { 1.0 / root };
        Self { from: f64::from(triangles_max), ratio, taken: 0 }
    }

    /// The next to try, all within `range`; none when the search is over.
    pub fn next(&mut self, range: [u32; 2]) -> Vec<u32> {
        if self.taken >= STEPS {
            return Vec::new();
        }
        let steps = self.taken + 1..=self.taken + TOGETHER;
        self.taken += TOGETHER;
        let tried = steps.map(|step| self.from * libm::pow(self.ratio, f64::from(step)));
        let inside = tried.filter(|tried| (range[0].into()..=range[1].into()).contains(tried));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        let whole = inside.map(|tried| tried.round() as u32);
        whole.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(error_px: f64, triangles: f64, ms: f64) -> Yield {
        Yield {
            error_px,
            rms_px: error_px / 4.0,
            bound_px: 4.0 * error_px,
            tolerance_px: 1e-2,
            triangles_max: triangles,
            triangles_span: [triangles; 2],
            triangles,
            cpu_ms: [ms, 2.0 * ms],
        }
    }

    #[test]
    fn the_cheapest_for_an_error_and_the_most_accurate_for_a_budget() {
        let found = [point(2.0, 1e4, 0.2), point(0.9, 5e4, 0.5), point(0.5, 1e5, 0.8)];
        assert_eq!(choose(Goal::ErrorPx(1.0), &found), Ok(1));
        assert_eq!(choose(Goal::ErrorPx(0.94), &found), Ok(2), "the margin is kept free");
        assert_eq!(choose(Goal::ErrorPx(0.1), &found), Err(Some(2)));
        assert_eq!(choose(Goal::BudgetMs(1.2), &found), Ok(1));
        assert_eq!(choose(Goal::BudgetMs(0.1), &found), Err(Some(0)));
        assert_eq!(choose(Goal::ErrorPx(1.0), &[]), Err(None));
    }

    #[test]
    fn equal_times_are_decided_by_triangles_and_what_is_not_timed_has_no_budget() {
        let mut found = [point(0.9, 5e4, 0.5), point(0.8, 4e4, 0.5)];
        assert_eq!(choose(Goal::ErrorPx(1.0), &found), Ok(1));
        found[0].cpu_ms = [f64::NAN; 2];
        assert_eq!(choose(Goal::BudgetMs(9.0), &found), Ok(1));
    }

    #[test]
    fn of_times_that_cannot_be_told_apart_the_fewest_triangles_are_the_cheapest() {
        let found = [point(0.3, 4e5, 0.50), point(0.6, 1e5, 0.52), point(0.9, 5e4, 0.60)];
        assert_eq!(choose(Goal::ErrorPx(1.0), &found), Ok(1));
        assert_eq!(choose(Goal::ErrorPx(0.5), &found), Ok(0));
        let untimed = found.map(|y| Yield { cpu_ms: [f64::NAN; 2], ..y });
        assert_eq!(choose(Goal::ErrorPx(1.0), &untimed), Ok(2));
    }

    #[test]
    fn a_search_goes_on_in_steps_and_ends() {
        let (goal, range) = (Goal::ErrorPx(1.0), [128, 16_000_000]);
        let mut more = Search::from(goal, 100_000);
        assert_eq!(more.next(range), [141_421, 200_000, 282_843, 400_000]);
        assert_eq!(more.next(range).last(), Some(&1_600_000));
        assert_eq!(more.next(range), [0; 0]);
        let mut fewer = Search::from(Goal::BudgetMs(1.0), 300);
        assert_eq!(fewer.next(range), [212, 150]);
        assert_eq!(Search::from(goal, 16_000_000).next(range), [0; 0]);
    }
}

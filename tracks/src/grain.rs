//! The steps that a column's numbers come in: their last figure, or the 25 ft of transponders.
//!
//! In:    numbers as they are written.
//! Out:   the step between them.
//! Keeps: the most decimals seen, and what all differences are multiples of.
//! Not here: what is made of steps (`spline`).
//!
//! Only of altitudes in feet is more than the last figure believed, and only 25 and 100: that a
//! made-up flight goes on by round numbers does not mean that nothing in between can be written.

/// More decimals than any instrument has: such numbers count as exact.
const DECIMALS_MAX: usize = 12;
/// With fewer changes than this, common factors of the numbers are chance.
const CHANGES_LEAST: u32 = 16;

/// What is known of a column's step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grain {
    decimals: usize,
    /// The first number, times ten to the power of `decimals`.
    first: Option<i64>,
    /// Greatest common divisor of all differences to the first.
    divisor: i64,
    last: Option<i64>,
    changes: u32,
    /// A number had an exponent or too many figures.
    exact: bool,
}

impl Grain {
    /// Takes a number into account.
    pub fn note(&mut self, text: &str) {
        if self.exact {
            return;
        }
        let known = self.scaled(text.trim()).and_then(|value| self.add(value));
        self.exact = known.is_none();
    }

    /// The number times ten to the power of the decimals, which grow if need be.
    fn scaled(&mut self, text: &str) -> Option<i64> {
        let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
        let more = fraction.len().saturating_sub(self.decimals);
        if fraction.len() > DECIMALS_MAX {
            return None;
        }
        let grow = ten_to(more);
        self.decimals += more;
        self.divisor = self.divisor.checked_mul(grow)?;
        for value in [&mut self.first, &mut self.last].into_iter().flatten() {
            *value = value.checked_mul(grow)?;
        }
        let is_negative = whole.starts_with('-');
        let whole: i64 = if matches!(whole, "" | "-" | "+") { 0 } else { whole.parse().ok()? };
        let part: i64 = if fraction.is_empty() { 0 } else { fraction.parse().ok()? };
        let part = part.checked_mul(ten_to(self.decimals - fraction.len()))?;
        let part = if is_negative { -part } else { part };
        whole.checked_mul(ten_to(self.decimals))?.checked_add(part)
    }

    fn add(&mut self, value: i64) -> Option<()> {
        let first = *self.first.get_or_insert(value);
        if self.last.replace(value) != Some(value) {
            self.changes = self.changes.saturating_add(1);
        }
        let (mut a, mut b) = (self.divisor, value.checked_sub(first)?.checked_abs()?);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        self.divisor = a;
        Some(())
    }

    /// The step, in the column's unit; 0 where the numbers are as good as exact.
    pub fn step(&self) -> f64 {
        if self.exact || self.first.is_none() { 0.0 } else { 1.0 / ten_to(self.decimals) as f64 }
    }

    /// The step of altitudes in feet: 25 or 100 where all are multiples of that apart.
    pub fn step_of_feet(&self) -> f64 {
        let whole: i64 = self.divisor / ten_to(self.decimals);
        let is_whole = self.divisor % ten_to(self.decimals) == 0;
        let is_known = !self.exact && self.changes >= CHANGES_LEAST && is_whole && whole > 0;
        match [100_u8, 25].into_iter().find(|&step| is_known && whole % i64::from(step) == 0) {
            Some(step) => f64::from(step),
            None => self.step(),
        }
    }
}

fn ten_to(power: usize) -> i64 {
    (0..power).fold(1, |value, _| value * 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grain_of(numbers: impl IntoIterator<Item = String>) -> Grain {
        let mut grain = Grain::default();
        numbers.into_iter().for_each(|number| grain.note(&number));
        grain
    }

    #[test]
    fn altitudes_in_feet_step_by_25_or_100_where_all_do() {
        let feet = |numbers: [i32; 3], end: &str| {
            grain_of((0..40).map(|i| format!("{}{end}", numbers[i % 3] + 100))).step_of_feet()
        };
        assert_eq!(feet([9525, 9500, 9575], ""), 25.0);
        assert_eq!(feet([9525, 9500, 9575], ".0"), 25.0);
        assert_eq!(feet([9500, 9900, 9600], ""), 100.0);
        assert_eq!(feet([9525, 9500, 9574], ""), 1.0);
        assert_eq!(feet([9525, 9500, 9575], ".5"), 25.0);
        assert_eq!(feet([9500, 9500, 9500], ""), 1.0);
    }

    #[test]
    fn other_numbers_step_by_their_last_figure() {
        assert_eq!(grain_of((0..5).map(|i| (9500 + 100 * i).to_string())).step_of_feet(), 1.0);
        assert_eq!(grain_of((0..40).map(|i| (9500 + 100 * i).to_string())).step(), 1.0);
        assert_eq!(grain_of((0..40).map(|i| format!("-0.{i:03}"))).step(), 0.001);
        assert_eq!(grain_of([]).step(), 0.0);
        assert_eq!(grain_of(["7.25".into(), "7.25".into()]).step(), 0.01);
    }

    #[test]
    fn numbers_with_exponents_or_endless_figures_are_exact() {
        let step = |numbers: &[&str]| {
            let grain = grain_of(numbers.iter().map(|&number| number.to_owned()));
            assert_eq!(grain.step(), grain.step_of_feet());
            grain.step()
        };
        assert_eq!(step(&["1e3", "2"]), 0.0);
        assert_eq!(step(&["0.1234567890123456"]), 0.0);
        assert_eq!(step(&["99999999999999999999"]), 0.0);
        assert_eq!(step(&["9.5", "999999999999999999.5", "0.00001"]), 0.0);
    }
}

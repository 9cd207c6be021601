//! In which frames two columns differ, and by how much.
//!
//! In:    the same column of two runs.
//! Out:   [`Change`], or nothing where they are equal to the last bit.
//! Keeps: nothing.
//! Not here: what a change means (`judge`, `diff`).

use super::record::RunRecord;

/// How a column changed from one run to another.
#[derive(Clone, PartialEq, Debug)]
pub struct Change {
    /// Its name.
    pub name: String,
    /// Frames that differ.
    pub frames: usize,
    /// The first of them.
    pub first: usize,
    /// The one that differs most, the first of those; of digests the first one.
    pub most: usize,
    /// Values there, before and after; NaN of digests.
    pub values: [f64; 2],
    /// Sums over all frames, before and after; NaN of digests.
    pub sums: [f64; 2],
}

impl Change {
    /// Of a column of counts; columns of other lengths are compared as far as both go.
    pub fn of_counts(name: &str, [before, after]: [&[f64]; 2]) -> Option<Self> {
        let pairs = || before.iter().zip(after);
        let differs = |(a, b): &(&f64, &f64)| a.to_bits() != b.to_bits();
        let first = pairs().position(|pair| differs(&pair))?;
        let far = |(a, b): (&f64, &f64)| (a - b).abs();
        let numbered = pairs().map(far).enumerate();
        let (most, _) = numbered.max_by(|(i, a), (j, b)| a.total_cmp(b).then(j.cmp(i)))?;
        Some(Self {
            name: name.to_owned(),
            frames: pairs().filter(differs).count(),
            first,
            most,
            values: [before[most], after[most]],
            sums: [before.iter().sum(), after.iter().sum()],
        })
    }

    /// Of a column of digests.
    pub fn of_digests(name: &str, [before, after]: [&[u64]; 2]) -> Option<Self> {
        let differs = |(a, b): &(&u64, &u64)| a != b;
        let first = before.iter().zip(after).position(|pair| differs(&pair))?;
        Some(Self {
            name: name.to_owned(),
            frames: before.iter().zip(after).filter(differs).count(),
            first,
            most: first,
            values: [f64::NAN; 2],
            sums: [f64::NAN; 2],
        })
    }

    /// The change in words; `record` says where the frames are.
    pub fn sentence(&self, record: &RunRecord, frames: usize) -> String {
        let Self { name, frames: changed, first, most, .. } = self;
        let first = record.place(*first);
        if self.values[0].is_nan() {
            return format!("{name} differs in {changed} of {frames} frames, first in {first}");
        }
        let [before, after] = self.values.map(number);
        let [sum_before, sum_after] = self.sums.map(number);
        format!(
            "{name} differs in {changed} of {frames} frames: sum {sum_before} is now \
             {sum_after}{}; first in {first}; most in {}: {before} is now {after}",
            percent(self.sums),
            record.place(*most)
        )
    }
}

/// By how much a number grew, in brackets; nothing where that cannot be said.
fn percent([before, after]: [f64; 2]) -> String {
    if before == 0.0 || !(after / before).is_finite() {
        return String::new();
    }
    format!(" ({:+.1} %)", (after / before - 1.0) * 100.0)
}

/// A number for people: whole ones without decimals, huge ones short.
pub fn number(value: f64) -> String {
    match value {
        x if x == f64::MAX => "beyond all numbers".into(),
        x if x.abs() >= 1e12 => format!("{x:.3e}"),
        x if x == x.trunc() => format!("{x:.0}"),
        x if x.abs() >= 0.01 => format!("{x:.3}"),
        x => format!("{x:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_columns_have_no_change_and_others_name_the_first_and_the_most() {
        let before = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(Change::of_counts("x", [&before, &before]), None);
        let change = Change::of_counts("x", [&before, &[1.0, 2.5, 9.0, 4.0]]).unwrap();
        assert_eq!((change.frames, change.first, change.most), (2, 1, 2));
        assert_eq!((change.values, change.sums), ([3.0, 9.0], [10.0, 16.5]));
        let last = Change::of_counts("x", [&[0.1], &[0.1 + f64::EPSILON / 8.0]]).unwrap();
        assert_eq!(last.frames, 1, "a last digit counts");
        assert_eq!(Change::of_digests("d", [&[1, 2], &[1, 2]]), None);
        assert_eq!(Change::of_digests("d", [&[1, 2, 3], &[1, 7, 8]]).unwrap().first, 1);
    }

    #[test]
    fn numbers_are_short() {
        let words = [0.0, 12.0, 1.5, 0.001_234, 1e15, f64::MAX].map(number);
        assert_eq!(words, ["0", "12", "1.500", "1.234e-3", "1.000e15", "beyond all numbers"]);
    }
}

//! By how much, and for how long, something stays on one side of a border.
//!
//! In:    a distance from the border, what a metre of way and a radian of a turn take of it.
//! Out:   [`Margin`], and those of several borders together.
//! Keeps: nothing.
//! Not here: the borders (`screen_error`), odometers (`wheel`).

/// By how much something is on one side of a border, and how fast it may lose that.
#[derive(Clone, Copy)]
pub struct Margin {
    /// Not on that side below 0. Metres.
    pub slack_m: f64,
    /// What is lost for each metre that the eye moves.
    pub per_m: f64,
    /// What is lost for each radian of a turn, or for a change of the threshold by all of itself.
    pub per_radian_m: f64,
}

impl Margin {
    /// Less the rounding of lengths like this one.
    pub fn rounded(self, length_m: f64) -> Self {
        let rounding_m = 1e-9 * (length_m + self.per_radian_m) + 1e-6;
        Self { slack_m: self.slack_m - rounding_m.copysign(self.slack_m), ..self }
    }

    /// The same, and no longer than while what is this far away stays about as far.
    pub fn within(self, far_m: f64) -> Self {
        let most_m = 0.1 * far_m * self.per_m;
        Self { slack_m: self.slack_m.clamp(-most_m, most_m), ..self }.rounded(far_m)
    }

    /// The other side of the same border.
    pub fn turned(self) -> Self {
        Self { slack_m: -self.slack_m, ..self }
    }

    /// How far the eye may move.
    pub fn path_m(self) -> f64 {
        self.slack_m / self.per_m
    }

    /// While both last.
    pub fn and(self, other: Self) -> Self {
        let path_m = least(self.path_m(), other.path_m());
        let scale = |one: Self| one.per_radian_m / one.per_m;
        Self { slack_m: path_m, per_m: 1.0, per_radian_m: greater(scale(self), scale(other)) }
    }

    /// While the one that is good for the longer way lasts.
    pub fn or(self, other: Self) -> Self {
        if other.path_m() > self.path_m() { other } else { self }
    }
}

/// The lesser of two numbers, in one instruction.
pub fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers, in one instruction.
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

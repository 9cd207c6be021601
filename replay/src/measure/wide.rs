//! Twice the digits of f64: what f64 results are held against.
//!
//! In:    f64.
//! Out:   sums of two f64, some 31 digits.
//! Keeps: nothing.
//! Not here: anything that has to be quick.
//! Source: Dekker 1971; Hida, Li and Bailey 2001, "Algorithms for quad-double precision".

use core::ops::{Add, Div, Mul, Sub};
use glam::DVec3;

/// A number as the unevaluated sum of two f64.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Wide(f64, f64);

impl Wide {
    /// Exactly this number.
    pub fn of(x: f64) -> Self {
        Self(x, 0.0)
    }

    /// The nearest f64.
    pub fn narrow(self) -> f64 {
        self.0 + self.1
    }

    /// The sum of two f64, exactly.
    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let bb = sum - a;
        Self(sum, (a - (sum - bb)) + (b - bb))
    }

    /// The product of two f64, exactly.
    fn product(a: f64, b: f64) -> Self {
        let split = |x: f64| {
            let t = 134_217_729.0 * x;
            let high = t - (t - x);
            (high, x - high)
        };
        let ((ah, al), (bh, bl)) = (split(a), split(b));
        let product = a * b;
        Self(product, ((ah * bh - product) + ah * bl + al * bh) + al * bl)
    }

    /// Square root of a positive number.
    pub fn sqrt(self) -> Self {
        let near = Self::of(self.0.sqrt());
        // One step of Newton's doubles the digits.
        near + (self - near * near) / (near + near)
    }
}

impl Add for Wide {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let Self(high, low) = Self::sum(self.0, other.0);
        Self::sum(high, low + (self.1 + other.1))
    }
}

impl Sub for Wide {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self(-other.0, -other.1)
    }
}

impl Mul for Wide {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let Self(high, low) = Self::product(self.0, other.0);
        Self::sum(high, low + (self.0 * other.1 + self.1 * other.0))
    }
}

impl Div for Wide {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let left = self - other * Self::of(first);
        let second = left.0 / other.0;
        let left = left - other * Self::of(second);
        Self::sum(first, second) + Self::of(left.0 / other.0)
    }
}

/// A vector of such numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Wide3(pub [Wide; 3]);

impl Wide3 {
    /// Exactly this vector.
    pub fn of(v: DVec3) -> Self {
        Self(v.to_array().map(Wide::of))
    }

    /// Sum.
    pub fn plus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i: usize| self.0[i] + other.0[i]))
    }

    /// Difference.
    pub fn minus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i: usize| self.0[i] - other.0[i]))
    }

    /// As many times as long.
    pub fn times(self, scale: Wide) -> Self {
        Self(self.0.map(|c| c * scale))
    }

    /// Dot product.
    pub fn dot(self, other: Self) -> Wide {
        let [x, y, z] = [0, 1, 2].map(|i: usize| self.0[i] * other.0[i]);
        x + y + z
    }

    /// Cross product.
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([b * f - c * e, c * d - a * f, a * e - b * d])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_and_roots_have_thirty_digits() {
        let three = Wide::of(3.0);
        let off = Wide::of(1.0) / three * three - Wide::of(1.0);
        assert!(off.narrow().abs() < 1e-30, "{off:?}");
        let root = three.sqrt();
        let off = root * root - three;
        assert!(off.narrow().abs() < 1e-30, "{off:?}");
        assert_ne!(root.1, 0.0);
    }
}

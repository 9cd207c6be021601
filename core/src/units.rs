//! Units at the borders: a bare f64 inside a kernel carries its unit in its name instead.
//!
//! In:    numbers whose unit the caller knows.
//! Out:   [`Metres`], [`Radians`], [`Pixels`], [`Seconds`].
//! Keeps: nothing.
//! Not here: feet, knots and degrees beyond the one conversion for files and screens.

/// A length in metres.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Metres(pub f64);

/// An angle in radians.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Radians(pub f64);

/// A length on the screen in pixels.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Pixels(pub f64);

/// A time in seconds.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Seconds(pub f64);

impl Radians {
    /// From degrees, as files and people write angles.
    pub fn from_degrees(degrees: f64) -> Self {
        Self(degrees * (core::f64::consts::PI / 180.0))
    }

    /// In degrees, for screens and files.
    pub fn to_degrees(self) -> f64 {
        self.0 * (180.0 / core::f64::consts::PI)
    }
}

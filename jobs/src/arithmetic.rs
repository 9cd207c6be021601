//! Whether this thread computes as IEEE 754 has it: round to nearest, denormals kept.
//!
//! In:    the control bits of the processor, as a host left them.
//! Out:   nothing, or [`ArithmeticFault`]: what would make other bits than on other threads.
//! Keeps: nothing.
//! Not here: putting it right: control bits belong to the host.
//!
//! It is found by computing, on operands that the compiler cannot know: a dozen operations.

use std::error::Error;
use std::fmt;
use std::hint::black_box;

/// How a thread's arithmetic differs from IEEE 754's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ArithmeticFault {
    /// Denormal operands count as zero: DAZ is set.
    DenormalsRead,
    /// Denormal results become zero: FTZ is set.
    DenormalsMade,
    /// Results are rounded up.
    RoundsUp,
    /// Results are rounded down.
    RoundsDown,
    /// Results are rounded towards zero.
    RoundsToZero,
}

impl ArithmeticFault {
    /// The fault as a sentence, with what is allowed.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::DenormalsRead => {
                "this thread reads denormal numbers as zero (DAZ), allowed is IEEE 754 with denormals"
            }
            Self::DenormalsMade => {
                "this thread flushes denormal results to zero (FTZ), allowed is IEEE 754 with \
                 denormals"
            }
            Self::RoundsUp => "this thread rounds upward, allowed is rounding to nearest",
            Self::RoundsDown => "this thread rounds downward, allowed is rounding to nearest",
            Self::RoundsToZero => "this thread rounds toward zero, allowed is rounding to nearest",
        }
    }
}

impl fmt::Display for ArithmeticFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.sentence())
    }
}

impl Error for ArithmeticFault {}

/// Checks the arithmetic of the calling thread.
///
/// # Errors
/// The first fault found.
pub fn check_arithmetic() -> Result<(), ArithmeticFault> {
    // Bits are compared, since comparing numbers reads denormals, too.
    let made = black_box(f64::MIN_POSITIVE) * black_box(0.5);
    let read = black_box(f64::from_bits(1)) * black_box(1e300);
    let single = black_box(f32::MIN_POSITIVE) * black_box(0.5);
    if read.to_bits() == 0 {
        return Err(ArithmeticFault::DenormalsRead);
    }
    if made.to_bits() == 0 || single.to_bits() == 0 {
        return Err(ArithmeticFault::DenormalsMade);
    }
    let (one, most, least) =
        (black_box(1.0), black_box(0.75 * f64::EPSILON), black_box(f64::EPSILON / 8.0));
    let (up, down) = (one + least != 1.0, -one - least != -1.0);
    match (up, down, one + most == 1.0) {
        (true, ..) => Err(ArithmeticFault::RoundsUp),
        (_, true, _) => Err(ArithmeticFault::RoundsDown),
        (.., true) => Err(ArithmeticFault::RoundsToZero),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_of_rust_compute_as_ieee_754_has_it() {
        assert_eq!(check_arithmetic(), Ok(()));
    }
}

//! Sine and cosine of an angle at once, for batches of places.
//!
//! In:    an angle in radians, of any size.
//! Out:   both, within 1.2 ulp; the same bits on every target.
//! Keeps: nothing.
//! Not here: other functions (`geodesy::trig`).
//! Source: FDLIBM's kernels and its reduction by parts of π/2 (Sun Microsystems, 1993).

use crate::geodesy::trig;
use core::f64::consts::FRAC_2_PI;

/// Beyond this the parts of π/2 are not enough, and the slow functions answer.
const FAST_MAX_RAD: f64 = 1e5;
/// Added and taken away again it rounds to the next integer.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// π/2 in three parts; the first two have 33 bits, so that small multiples of them are exact.
const PARTS: [f64; 3] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine.
#[inline]
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    if angle_rad.abs() > FAST_MAX_RAD {
        return (trig::sin(angle_rad), trig::cos(angle_rad));
    }
    let shifted = angle_rad * FRAC_2_PI + ROUND;
    let (turns, quadrant) = (shifted - ROUND, shifted.to_bits() & 3);
    let first = angle_rad - turns * PARTS[0];
    let second = turns * PARTS[1];
    let rest = first - second;
    let last = turns * PARTS[2] - ((first - rest) - second);
    let (x, tail) = (rest - last, (rest - (rest - last)) - last);
    let (sine, cosine) = (sine(x, tail), cosine(x, tail));
    match quadrant {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Of x + tail, |x| up to π/4.
#[inline]
fn sine(x: f64, tail: f64) -> f64 {
    let [a, b, c, d, e, f] = SINE;
    let (z, w) = (x * x, x * x * (x * x));
    let higher = b + z * (c + z * d) + z * w * (e + z * f);
    let v = z * x;
    x - ((z * (0.5 * tail - v * higher) - tail) - v * a)
}

/// Of x + tail, |x| up to π/4.
#[inline]
fn cosine(x: f64, tail: f64) -> f64 {
    let [a, b, c, d, e, f] = COSINE;
    let (z, w) = (x * x, x * x * (x * x));
    let higher = z * (a + z * (b + z * c)) + w * w * (d + z * (e + z * f));
    let half = 0.5 * z;
    let rest = 1.0 - half;
    rest + (((1.0 - rest) - half) + (z * higher - x * tail))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::digest::mix;

    #[test]
    fn sine_and_cosine_are_within_an_ulp_of_the_slow_ones() {
        let ulp = |x: f64| x.abs().next_up() - x.abs();
        let mut worst = 0.0_f64;
        for i in 0..200_000_u64 {
            let unit = (mix(i) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
            let angle_rad = unit * [4.0, 20.0, 1e3, 2e5][(i % 4) as usize];
            let (sine, cosine) = sin_cos(angle_rad);
            for (fast, slow) in [(sine, trig::sin(angle_rad)), (cosine, trig::cos(angle_rad))] {
                worst = worst.max((fast - slow).abs() / ulp(slow));
            }
        }
        assert!(worst <= 1.0, "{worst} ulp");
        for quarter in -8..=8 {
            let angle_rad = f64::from(quarter) * core::f64::consts::FRAC_PI_2;
            let (sine, cosine) = sin_cos(angle_rad);
            assert!((sine - trig::sin(angle_rad)).abs() < 1e-30);
            assert!((cosine - trig::cos(angle_rad)).abs() < 1e-30);
        }
        assert_eq!(sin_cos(1e15), (trig::sin(1e15), trig::cos(1e15)));
    }
}

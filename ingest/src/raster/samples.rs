//! Decoded pieces of a raster, in the file's own number type, and their way to heights.
//!
//! In:    numbers as the file holds them.
//! Out:   heights in metres, NaN where void.
//! Keeps: nothing.
//! Not here: which piece a posting is in (`window`), how pieces are decoded (each format).

use overfly_core::geodesy::narrow;

/// Heights beyond this are no heights on any body: void.
const HEIGHT_M_MAX: f64 = 1.0e6;

/// The numbers of one chunk, row by row. Kept in the file's type: a cache of i16 holds twice
/// the postings that one of f32 would.
#[derive(Debug)]
pub(crate) enum Samples {
    /// Nothing but voids.
    Void,
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// From a file's number to metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transfer {
    /// Metres for one unit.
    pub scale: f64,
    /// Metres at zero.
    pub offset_m: f64,
    /// Numbers (before scale and offset) that mean void; NaN where there is none.
    pub voids: [f64; 2],
}

impl Transfer {
    /// Numbers are metres.
    pub fn metres(voids: [Option<f64>; 2]) -> Self {
        Self { scale: 1.0, offset_m: 0.0, voids: voids.map(|void| void.unwrap_or(f64::NAN)) }
    }

    fn height(&self, number: f64) -> f32 {
        let height_m = number * self.scale + self.offset_m;
        let void = number == self.voids[0] || number == self.voids[1];
        let plausible = height_m.abs() <= HEIGHT_M_MAX;
        if plausible && !void { narrow(height_m) } else { f32::NAN }
    }
}

impl Samples {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Void => 0,
            Self::U8(of) => of.len(),
            Self::I8(of) => of.len(),
            Self::U16(of) => 2 * of.len(),
            Self::I16(of) => 2 * of.len(),
            Self::U32(of) => 4 * of.len(),
            Self::I32(of) => 4 * of.len(),
            Self::F32(of) => 4 * of.len(),
            Self::F64(of) => 8 * of.len(),
        }
    }

    /// Writes the heights of `out.len()` postings from the `start`th on.
    pub fn heights(&self, start: usize, transfer: &Transfer, out: &mut [f32]) {
        match self {
            Self::Void => out.fill(f32::NAN),
            Self::U8(of) => convert(of, start, out, |number| transfer.height(number.into())),
            Self::I8(of) => convert(of, start, out, |number| transfer.height(number.into())),
            Self::U16(of) => convert(of, start, out, |number| transfer.height(number.into())),
            // The smallest i16 is the void of SRTM; files that do not declare it mean it too.
            Self::I16(of) => convert(of, start, out, |number| match number {
                i16::MIN => f32::NAN,
                _ => transfer.height(number.into()),
            }),
            Self::U32(of) => convert(of, start, out, |number| transfer.height(number.into())),
            Self::I32(of) => convert(of, start, out, |number| transfer.height(number.into())),
            Self::F32(of) => {
                // Declared as decimal text, meant as f32: −3.4028235e38 has many spellings.
                let transfer = Transfer { voids: transfer.voids.map(nearest_f32), ..*transfer };
                convert(of, start, out, |number| transfer.height(number.into()));
            }
            Self::F64(of) => convert(of, start, out, |number| transfer.height(number)),
        }
    }
}

fn convert<T: Copy>(of: &[T], start: usize, out: &mut [f32], height: impl Fn(T) -> f32) {
    let of = of.get(start..).unwrap_or(&[]);
    for (index, to) in out.iter_mut().enumerate() {
        *to = of.get(index).map_or(f32::NAN, |&number| height(number));
    }
}

/// The f32 nearest to a void number, as f64; numbers beyond f32's range become its largest.
fn nearest_f32(void: f64) -> f64 {
    let most = f64::from(f32::MAX);
    if void.is_finite() { f64::from(narrow(void.clamp(-most, most))) } else { void }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heights(samples: &Samples, transfer: &Transfer) -> Vec<f32> {
        let mut out = vec![0.0; 4];
        samples.heights(0, transfer, &mut out);
        out
    }

    #[test]
    fn voids_infinities_and_the_implausible_are_nan() {
        let samples = Samples::F32(vec![1.5, -3.402_823_5e38, f32::INFINITY, 2.0e6]);
        let out = heights(&samples, &Transfer::metres([None, None]));
        assert_eq!(out[0], 1.5);
        assert!(out[1..].iter().all(|height| height.is_nan()), "{out:?}");
    }

    #[test]
    fn a_declared_void_of_f32_is_compared_as_f32() {
        let samples = Samples::F32(vec![0.1, 0.2, 0.3, 9.0]);
        let out = heights(&samples, &Transfer::metres([Some(0.1), None]));
        assert!(out[0].is_nan() && out[1] == 0.2, "{out:?}");
    }

    #[test]
    fn the_smallest_i16_is_void_declared_or_not_and_short_pieces_end_in_voids() {
        let samples = Samples::I16(vec![i16::MIN, -9999, 7]);
        let out = heights(&samples, &Transfer::metres([Some(-9999.0), None]));
        assert!(out[0].is_nan() && out[1].is_nan() && out[2] == 7.0 && out[3].is_nan());
    }

    #[test]
    fn scale_and_offset_come_after_the_void_test() {
        let samples = Samples::U16(vec![0, 1, 65535, 100]);
        let transfer = Transfer { scale: 0.5, offset_m: -10.0, voids: [0.0, f64::NAN] };
        let out = heights(&samples, &transfer);
        assert!(out[0].is_nan());
        assert_eq!(&out[1..], &[-9.5, 32757.5, 40.0]);
    }
}

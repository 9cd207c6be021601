//! An adaptive binary range coder, and whole numbers through it.
//!
//! In:    numbers one by one with the context they are expected in; or bytes.
//! Out:   bytes; or the same numbers.
//! Keeps: the probabilities of one stream.
//! Not here: which contexts there are (`tile`).
//! Source: G. N. N. Martin 1979 (range coding), with the carry handling that LZMA made usual.

/// Probabilities have 16 bits, and stay this far from certainty.
const CERTAIN: u32 = 48;
/// Below this the range is widened by a byte.
const LEAST_RANGE: u32 = 1 << 24;
/// A context has learnt when it has seen so many bits; from then on it forgets as it learns.
const LEARNT: u8 = 40;
/// Magnitudes from here on are written as a bit length and plain bits.
const UNARY_END: usize = 14;

/// What one context expects of its next bit.
#[derive(Clone, Copy)]
pub struct Bit {
    /// Probability of a 0, in 1/65536.
    zero: u16,
    seen: u8,
}

/// What one context expects of its next number.
#[derive(Clone, Copy)]
pub struct Number {
    zero: Bit,
    negative: Bit,
    more: [Bit; UNARY_END],
    length: [Bit; 32],
}

impl Bit {
    /// Nothing is known.
    pub const NEW: Self = Self { zero: 1 << 15, seen: 0 };

    fn bound(self, range: u32) -> u32 {
        (range >> 16) * u32::from(self.zero)
    }

    /// Early bits weigh more: so a stream of a few hundred numbers learns quickly.
    fn learn(&mut self, bit: bool) {
        let share = 2 + u32::from(self.seen);
        let zero = u32::from(self.zero);
        let zero = if bit { zero - zero / share } else { zero + (65_536 - zero) / share };
        let zero = zero.clamp(CERTAIN, 65_536 - CERTAIN);
        self.zero = u16::try_from(zero).expect("clamped to 16 bits");
        self.seen = (self.seen + 1).min(LEARNT);
    }
}

impl Number {
    /// Nothing is known.
    pub const NEW: Self = Self {
        zero: Bit::NEW,
        negative: Bit::NEW,
        more: [Bit::NEW; UNARY_END],
        length: [Bit::NEW; 32],
    };
}

/// Writes a stream.
pub struct Encoder {
    bytes: Vec<u8>,
    low: u64,
    range: u32,
    /// The last byte, not yet written because a carry may reach it, and the 0xFF after it.
    held: u8,
    full: u64,
    is_first: bool,
}

impl Encoder {
    /// An empty stream, to be appended to `bytes`.
    pub fn new(bytes: Vec<u8>) -> Self {
        Self { bytes, low: 0, range: u32::MAX, held: 0, full: 0, is_first: true }
    }

    /// Writes one bit.
    pub fn bit(&mut self, context: &mut Bit, bit: bool) {
        let bound = context.bound(self.range);
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        context.learn(bit);
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.shift();
        }
    }

    /// Writes one number.
    pub fn number(&mut self, context: &mut Number, value: i32) {
        self.bit(&mut context.zero, value != 0);
        if value == 0 {
            return;
        }
        self.bit(&mut context.negative, value < 0);
        let rest = value.unsigned_abs() - 1;
        for (more, at) in context.more.iter_mut().zip(0..) {
            self.bit(more, rest > at);
            if rest <= at {
                return;
            }
        }
        // What is left is written from its highest bit on, its length first.
        let left = rest - u32::try_from(UNARY_END).expect("small") + 1;
        let length = left.ilog2();
        for (at, bit) in (0..).zip(&mut context.length) {
            self.bit(bit, length > at);
            if length <= at {
                break;
            }
        }
        for at in (0..length).rev() {
            self.bit(&mut Bit::NEW.clone(), left >> at & 1 == 1);
        }
    }

    /// Ends the stream: any number of the last range will do, so one that ends in zeros is taken,
    /// which need not be written.
    pub fn finish(mut self) -> Vec<u8> {
        let end = self.low + u64::from(self.range);
        let rounded = |bits: u32| (self.low + (1 << bits) - 1) >> bits << bits;
        if let Some(low) = [24, 16, 8].map(rounded).into_iter().find(|&low| low < end) {
            self.low = low;
        }
        for _ in 0..5 {
            self.shift();
        }
        for _ in 0..4 {
            if self.bytes.last() == Some(&0) {
                self.bytes.pop();
            }
        }
        self.bytes
    }

    fn shift(&mut self) {
        let carry = self.low >> 32 != 0;
        let top = (self.low >> 24 & 0xFF) as u8;
        if carry || top != 0xFF {
            if !self.is_first {
                self.bytes.push(self.held.wrapping_add(u8::from(carry)));
            }
            self.is_first = false;
            let full = if carry { 0 } else { 0xFF };
            self.bytes.extend((0..self.full).map(|_| full));
            (self.full, self.held) = (0, top);
        } else {
            self.full += 1;
        }
        self.low = (self.low & 0x00FF_FFFF) << 8;
    }
}

/// Reads a stream. Bytes beyond its end read as 0; [`Self::is_exhausted`] tells.
pub struct Decoder<'a> {
    bytes: &'a [u8],
    at: usize,
    range: u32,
    code: u32,
}

impl<'a> Decoder<'a> {
    /// Starts to read.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes, at: 0, range: u32::MAX, code: 0 };
        for _ in 0..4 {
            decoder.pull();
        }
        decoder
    }

    /// Whether more was read than the stream holds: it was cut or damaged.
    pub fn is_exhausted(&self) -> bool {
        self.at > self.bytes.len() + 4
    }

    /// Reads one bit.
    pub fn bit(&mut self, context: &mut Bit) -> bool {
        let bound = context.bound(self.range);
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        context.learn(bit);
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.pull();
        }
        bit
    }

    /// Reads one number.
    pub fn number(&mut self, context: &mut Number) -> i32 {
        if !self.bit(&mut context.zero) {
            return 0;
        }
        let negative = self.bit(&mut context.negative);
        let rest = self.magnitude(context).min(i32::MAX.unsigned_abs() - 1).cast_signed();
        if negative { -1 - rest } else { 1 + rest }
    }

    fn magnitude(&mut self, context: &mut Number) -> u32 {
        for (more, at) in context.more.iter_mut().zip(0..) {
            if !self.bit(more) {
                return at;
            }
        }
        let mut length = 0;
        for bit in &mut context.length[..31] {
            if !self.bit(bit) {
                break;
            }
            length += 1;
        }
        let mut left = 1_u32;
        for _ in 0..length {
            left = left << 1 | u32::from(self.bit(&mut Bit::NEW.clone()));
        }
        (left - 1).saturating_add(u32::try_from(UNARY_END).expect("small"))
    }

    fn pull(&mut self) {
        let byte = self.bytes.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        self.code = self.code << 8 | u32::from(byte);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::digest::mix;

    fn numbers() -> Vec<i32> {
        let mut numbers = vec![0, 1, -1, 15, -15, 16, 17, 1000, -70_000, i32::MAX, -i32::MAX];
        // Mostly small, as residuals are.
        numbers.extend((0..20_000).map(|i| {
            let random = mix(i);
            let size = (random >> 8 & 7) as u32;
            (random >> 32 & ((1 << size) - 1)) as i32 - (1 << size >> 1)
        }));
        numbers
    }

    #[test]
    fn numbers_come_back_as_they_went_in() {
        let numbers = numbers();
        let mut contexts = [Number::NEW; 3];
        let mut encoder = Encoder::new(Vec::new());
        for (i, &number) in numbers.iter().enumerate() {
            encoder.number(&mut contexts[i % 3], number);
        }
        let bytes = encoder.finish();
        let mut contexts = [Number::NEW; 3];
        let mut decoder = Decoder::new(&bytes);
        for (i, &number) in numbers.iter().enumerate() {
            assert_eq!(decoder.number(&mut contexts[i % 3]), number, "number {i}");
        }
        assert!(!decoder.is_exhausted());
    }

    #[test]
    fn long_runs_cost_next_to_nothing_and_carries_travel() {
        let mut context = Number::NEW;
        let mut encoder = Encoder::new(Vec::new());
        (0..10_000).for_each(|_| encoder.number(&mut context, 0));
        assert!(encoder.finish().len() < 30);
        // All ones at a context that expects zeros pushes `low` to its upper end.
        let mut encoder = Encoder::new(Vec::new());
        for i in 0..5000 {
            encoder.bit(&mut Bit { zero: 65_000, seen: LEARNT }, i % 7 != 0);
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        for i in 0..5000 {
            assert_eq!(decoder.bit(&mut Bit { zero: 65_000, seen: LEARNT }), i % 7 != 0);
        }
    }

    #[test]
    fn a_cut_stream_ends_and_says_so() {
        let mut context = Number::NEW;
        let mut encoder = Encoder::new(Vec::new());
        numbers().iter().for_each(|&number| encoder.number(&mut context, number));
        let bytes = encoder.finish();
        let mut context = Number::NEW;
        let mut decoder = Decoder::new(&bytes[..bytes.len() / 2]);
        numbers().iter().for_each(|_| {
            decoder.number(&mut context);
        });
        assert!(decoder.is_exhausted());
    }
}

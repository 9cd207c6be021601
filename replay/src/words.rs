//! Bytes of the format: variable-length counts, and 64-bit words without their zero bytes.
//!
//! In:    counts, strings, words and the words that they are expected to resemble.
//! Out:   bytes, and the same back.
//! Keeps: nothing.
//! Not here: which words a frame has (`payload`).
//! Source: Pelkonen et al. 2015, Gorilla, section 4.1.2; here by bytes instead of bits.

/// Appends a count, seven bits a byte, the lowest first.
pub(crate) fn put_count(out: &mut Vec<u8>, mut count: u64) {
    while count >= 0x80 {
        out.push((count & 0x7F) as u8 | 0x80);
        count >>= 7;
    }
    out.push((count & 0x7F) as u8);
}

/// Appends a string: its length in bytes as a count, then UTF-8.
pub(crate) fn put_text(out: &mut Vec<u8>, text: &str) {
    put_count(out, text.len() as u64);
    out.extend_from_slice(text.as_bytes());
}

/// Appends what distinguishes `word` from `reference`.
///
/// One byte says how many low bytes of the exclusive-or are zero (high nibble) and how many bytes
/// follow (low nibble); 0 stands for equal words.
pub(crate) fn put_word(out: &mut Vec<u8>, word: u64, reference: u64) {
    let difference = word ^ reference;
    if difference == 0 {
        out.push(0);
        return;
    }
    let first = difference.trailing_zeros() / 8;
    let after = 8 - difference.leading_zeros() / 8;
    let [control, ..] = (first << 4 | (after - first)).to_le_bytes();
    out.push(control);
    out.extend((first..after).map(|i| (difference >> (8 * i) & 0xFF) as u8));
}

/// Bytes still to be read. Every method answers `None` where they end early or make no sense.
pub(crate) struct Input<'a> {
    rest: &'a [u8],
}

impl<'a> Input<'a> {
    /// All of `bytes`.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// How many bytes are left.
    pub(crate) fn len(&self) -> usize {
        self.rest.len()
    }

    /// The next `length` bytes.
    pub(crate) fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    /// The next byte.
    pub(crate) fn byte(&mut self) -> Option<u8> {
        self.bytes(1).map(|bytes| bytes[0])
    }

    /// Eight bytes as they are.
    pub(crate) fn u64(&mut self) -> Option<u64> {
        let bytes = self.bytes(8)?.try_into().expect("eight bytes were taken");
        Some(u64::from_le_bytes(bytes))
    }

    /// What [`put_count`] wrote.
    pub(crate) fn count(&mut self) -> Option<u64> {
        let mut count = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let part = u64::from(byte & 0x7F);
            if part << shift >> shift != part {
                return None;
            }
            count |= part << shift;
            if byte < 0x80 {
                return Some(count);
            }
        }
        None
    }

    /// What [`put_text`] wrote.
    pub(crate) fn text(&mut self) -> Option<String> {
        let length = usize::try_from(self.count()?).ok()?;
        String::from_utf8(self.bytes(length)?.to_vec()).ok()
    }

    /// What [`put_word`] wrote with the same reference.
    pub(crate) fn word(&mut self, reference: u64) -> Option<u64> {
        let control = self.byte()?;
        let (first, length) = (usize::from(control >> 4), usize::from(control & 0xF));
        if first + length > 8 || (length == 0 && first != 0) {
            return None;
        }
        let mut bytes = [0; 8];
        bytes[first..first + length].copy_from_slice(self.bytes(length)?);
        Some(u64::from_le_bytes(bytes) ^ reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_words_come_back() {
        let values = [0, 1, 127, 128, 16_383, 16_384, 1 << 56, (1 << 63) - 1, 1 << 63, u64::MAX];
        let mut out = Vec::new();
        for &value in &values {
            put_count(&mut out, value);
            put_word(&mut out, value, 0x0123_4567_89AB_CDEF);
        }
        let mut input = Input::new(&out);
        for &value in &values {
            assert_eq!(input.count(), Some(value));
            assert_eq!(input.word(0x0123_4567_89AB_CDEF), Some(value));
        }
        assert_eq!(input.len(), 0);
        assert_eq!(input.byte(), None);
    }

    #[test]
    fn a_word_takes_its_middle_bytes_only() {
        let mut out = Vec::new();
        put_word(&mut out, 0x0000_1200_3400_0000, 0);
        assert_eq!(out, [0x33, 0x34, 0x00, 0x12]);
        out.clear();
        put_word(&mut out, 7, 7);
        assert_eq!(out, [0]);
    }

    #[test]
    fn nonsense_is_no_number() {
        assert_eq!(Input::new(&[0xFF; 10]).count(), None);
        assert_eq!(Input::new(&[0x80]).count(), None);
        assert_eq!(Input::new(&[0x09, 0, 0, 0, 0, 0, 0, 0, 0, 0]).word(0), None);
        assert_eq!(Input::new(&[0x10, 0]).word(0), None);
        assert_eq!(Input::new(&[2, 0xC3, 0x28]).text(), None);
    }
}

//! A text and its places: every part knows its line and column.
//!
//! In:    a text with any kind of line ends.
//! Out:   its lines; line and column of any part of it.
//! Keeps: where lines begin.
//! Not here: what the parts mean (`formats`).

use crate::fault::{Fault, Wrong};

/// A text with an index of its lines. Ends are LF, CR LF, or CR alone, as old X-Plane files have.
pub(crate) struct Text<'a> {
    pub all: &'a str,
    /// Offsets of the first byte of each line.
    starts: Vec<usize>,
}

impl<'a> Text<'a> {
    pub fn new(all: &'a str) -> Self {
        let bytes = all.as_bytes();
        let ends = |i: &usize| {
            bytes[*i] == b'\n' || (bytes[*i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'))
        };
        let mut starts = vec![0];
        starts.extend((0..bytes.len()).filter(ends).map(|i| i + 1));
        Self { all, starts }
    }

    /// All lines without their ends, empty ones too.
    pub fn lines(&self) -> impl Iterator<Item = &'a str> + '_ {
        let ends = self.starts.iter().skip(1).copied().chain([self.all.len()]);
        let lines = self.starts.iter().zip(ends);
        lines.map(|(&start, end)| self.all[start..end].trim_end_matches(['\r', '\n']))
    }

    /// Where `part`, a slice of this text, begins. The end for other slices.
    pub fn offset(&self, part: &str) -> usize {
        let offset = (part.as_ptr() as usize).wrapping_sub(self.all.as_ptr() as usize);
        offset.min(self.all.len())
    }

    /// The line of an offset, from 1.
    pub fn line(&self, offset: usize) -> u32 {
        let line = self.starts.partition_point(|&start| start <= offset);
        u32::try_from(line).unwrap_or(u32::MAX)
    }

    /// A fault with its line and column.
    pub fn fault(&self, wrong: Wrong) -> Fault {
        let at = wrong.at.min(self.all.len());
        let line = self.line(at);
        let start = self.starts[self.starts.partition_point(|&start| start <= at) - 1];
        let before = self.all.as_bytes()[start..at].iter();
        // Bytes that go on with a character are none of their own.
        let characters = before.filter(|&&byte| byte & 0xC0 != 0x80).count();
        let column = u32::try_from(characters + 1).unwrap_or(u32::MAX);
        let Wrong { field, found, expected, .. } = wrong;
        Fault { line, column, field, found, expected }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways_and_parts_know_their_place() {
        let text = Text::new("one\r\ntwo\rthrée x\n\nfive");
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines, ["one", "two", "thrée x", "", "five"]);
        let part = &lines[2][7..];
        assert_eq!(part, "x");
        let fault = text.fault(Wrong::new(text.offset(part), "field", part, "y"));
        assert_eq!((fault.line, fault.column), (3, 7));
        assert_eq!(text.line(text.all.len()), 5);
        assert_eq!(Text::new("").lines().count(), 1);
    }
}

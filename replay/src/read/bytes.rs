//! The bytes of a file through a window: what is looked at, never all of them.
//!
//! In:    a file, or bytes in memory.
//! Out:   slices of it.
//! Keeps: one window, at least [`WINDOW`] bytes and at most the longest slice asked for.
//! Not here: what the bytes mean (`blocks`).

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes read at once.
pub(crate) const WINDOW: usize = 1 << 16;

/// A file as long as it was when it was opened: what a writer adds meanwhile is not seen.
#[derive(Debug)]
pub(crate) struct Bytes {
    /// None where all of it is in the window.
    file: Option<File>,
    length: u64,
    /// Offset of the window's first byte.
    begin: u64,
    window: Vec<u8>,
    /// Bytes that came from the file so far.
    #[cfg(test)]
    pub(crate) read: u64,
}

impl Bytes {
    /// Opens a file; what is no regular file is read to its end.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let about = std::fs::metadata(path)?;
        if !about.is_file() {
            return Ok(Self::memory(std::fs::read(path)?));
        }
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file: Some(file), length, ..Self::memory(Vec::new()) })
    }

    /// Bytes at hand.
    pub(crate) fn memory(window: Vec<u8>) -> Self {
        Self {
            file: None,
            length: window.len() as u64,
            begin: 0,
            window,
            #[cfg(test)]
            read: 0,
        }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> u64 {
        self.length
    }

    /// Bytes of memory.
    #[cfg(test)]
    pub(crate) fn held(&self) -> usize {
        self.window.capacity()
    }

    /// `count` bytes from `offset` on, fewer where they end before.
    pub(crate) fn at(&mut self, offset: u64, count: usize) -> io::Result<&[u8]> {
        let count = count.min(within(self.length.saturating_sub(offset)));
        let inside =
            offset >= self.begin && offset + count as u64 <= self.begin + self.window.len() as u64;
        if !inside {
            self.load(offset, count)?;
        }
        let from = within(offset.saturating_sub(self.begin)).min(self.window.len());
        let to = (from + count).min(self.window.len());
        Ok(&self.window[from..to])
    }

    /// Moves the window to `offset`; it then has `count` bytes, or what is there.
    fn load(&mut self, offset: u64, count: usize) -> io::Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let count = count.max(WINDOW).min(within(self.length - offset));
        self.window.resize(count, 0);
        self.begin = offset;
        file.seek(SeekFrom::Start(offset))?;
        let mut have = 0;
        while have < count {
            match file.read(&mut self.window[have..]) {
                // Somebody made the file shorter meanwhile: it ends here.
                Ok(0) => {
                    self.length = offset + have as u64;
                    break;
                }
                Ok(more) => have += more,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    self.window.clear();
                    return Err(error);
                }
            }
        }
        self.window.truncate(have);
        #[cfg(test)]
        {
            self.read += have as u64;
        }
        Ok(())
    }
}

/// A length in memory; what does not fit is longer than any memory.
fn within(length: u64) -> usize {
    usize::try_from(length).unwrap_or(usize::MAX)
}

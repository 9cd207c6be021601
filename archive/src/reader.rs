//! Archives that a host reads itself: from packages, consoles' files, its own network.
//!
//! In:    the host's function; offset and length.
//! Out:   the bytes, or why there are none.
//! Keeps: the function, an archive's name, whether it was closed.
//! Not here: what may be asked for (`source`), files and servers of ours.

use crate::fault::ArchiveFault;
use bytes::Bytes;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Fills a buffer from an offset of the archive of that name; how many bytes it has put there,
/// fewer only at the archive's end.
type Read = dyn Fn(&str, u64, &mut [u8]) -> Result<usize, String> + Send + Sync;

/// A host's way of reading archives. It is called from loader threads, several at once, and may
/// block; what it returns is not trusted.
#[derive(Clone)]
pub struct Reader(Arc<Read>);

impl Reader {
    /// Reads with a function of (path or address as the scene has it, offset, buffer).
    pub fn new(
        read: impl Fn(&str, u64, &mut [u8]) -> Result<usize, String> + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(read))
    }
}

impl PartialEq for Reader {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Debug for Reader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Reader")
    }
}

/// One archive that the host reads.
pub(crate) struct HostFile {
    name: String,
    reader: Reader,
    closed: AtomicBool,
}

impl HostFile {
    pub(crate) fn new(name: &str, reader: &Reader) -> Self {
        Self { name: name.to_owned(), reader: reader.clone(), closed: AtomicBool::new(false) }
    }

    /// Up to `length` bytes, fewer only at the archive's end.
    pub(crate) fn read(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        if self.closed.load(Ordering::Relaxed) {
            return Err(ArchiveFault::Closed);
        }
        let mut bytes = vec![0; length];
        let found = (self.reader.0)(&self.name, offset, &mut bytes).map_err(ArchiveFault::Host)?;
        if found > length {
            let what = format!("it says that it read {found} bytes where {length} were asked for");
            return Err(ArchiveFault::Host(what));
        }
        bytes.truncate(found);
        Ok(bytes.into())
    }

    /// The host is asked no more.
    pub(crate) fn close(&self) {
        self.closed.store(true, Ordering::Relaxed);
    }
}

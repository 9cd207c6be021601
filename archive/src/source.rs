//! The bytes of an archive for the `pmtiles` crate: guarded reads of a file or a server.
//!
//! In:    offset and length, from the header and from directories that may be hostile.
//! Out:   bytes, never more than asked for, none of which unpack to more than allowed.
//! Keeps: the first bytes, the sections, the mapped file or the server.
//! Not here: finding a tile's entry (the crate).

use crate::fault::ArchiveFault;
use crate::header::{OPENING_BYTES, Sections, sections};
use crate::reader::HostFile;
use crate::server::Server;
use crate::unpack;
use bytes::Bytes;
use pmtiles::{AsyncBackend, BackendResponse, MmapBackend, PmtError, PmtResult};
use std::fs::File;
use std::io;
use std::path::Path;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::SystemTime;

/// A directory may unpack to so many bytes, which make at most six times as many in memory.
pub(crate) const DIRECTORY_BYTES_MAX: usize = 8 << 20;
/// The metadata may unpack to so many bytes.
pub(crate) const METADATA_BYTES_MAX: usize = 8 << 20;
/// A tile may be and may unpack to so many bytes. Pages need a fiftieth.
pub(crate) const TILE_BYTES_MAX: usize = 1 << 20;

/// Where the bytes come from.
pub(crate) enum Place {
    /// A file, mapped into memory.
    File(MappedFile),
    /// Wherever the host has it.
    Host(HostFile),
    /// A server.
    Server(Box<Server>),
}

/// A mapped file, and how to notice that somebody writes to it.
pub(crate) struct MappedFile {
    map: MmapBackend,
    file: File,
    state: FileState,
}

type FileState = (u64, Option<SystemTime>);

impl Place {
    /// A regular file, mapped.
    pub(crate) fn file(path: &Path) -> Result<Self, ArchiveFault> {
        let file = File::open(path).map_err(ArchiveFault::Open)?;
        if !file.metadata().map_err(ArchiveFault::Open)?.is_file() {
            return Err(ArchiveFault::Open(io::Error::other("it is not a regular file")));
        }
        let state = state_of(&file)?;
        if state.0 == 0 {
            return Err(ArchiveFault::NotPmtiles);
        }
        let map = mapped(path)?;
        Ok(Self::File(MappedFile { map, file, state }))
    }

    /// The archive's size in bytes, where known.
    pub(crate) fn size(&self) -> Option<u64> {
        match self {
            Self::File(mapped) => Some(mapped.state.0),
            Self::Host(_) => None,
            Self::Server(server) => server.size(),
        }
    }

    /// Up to `length` bytes, fewer only at the archive's end.
    pub(crate) fn read(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        match self {
            Self::File(mapped) => mapped.read(offset, length),
            Self::Host(host) => host.read(offset, length),
            Self::Server(server) => server.read(offset, length),
        }
    }
}

impl MappedFile {
    /// The crate reads within the mapping; a file that somebody has cut since then is noticed
    /// first, for reading beyond its new end would end the process.
    fn read(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        if state_of(&self.file)? != self.state {
            return Err(ArchiveFault::Changed("somebody has written to the file".into()));
        }
        let read = at_once(self.map.read(offset, length));
        read.map(|read| read.bytes).map_err(ArchiveFault::from_pmtiles)
    }
}

fn state_of(file: &File) -> Result<FileState, ArchiveFault> {
    let about = file.metadata().map_err(ArchiveFault::Open)?;
    Ok((about.len(), about.modified().ok()))
}

/// The crate opens files with tokio, which needs its runtime for that. It gets one on a thread of
/// its own, for as long as this takes: a host may have a runtime itself, and those do not nest.
fn mapped(path: &Path) -> Result<MmapBackend, ArchiveFault> {
    let open = || {
        let runtime = tokio::runtime::Builder::new_current_thread().build()?;
        runtime.block_on(MmapBackend::try_from(path)).map_err(|error| match error {
            PmtError::Reading(error) => error,
            other => io::Error::other(other.to_string()),
        })
    };
    let opened = std::thread::scope(|scope| {
        let thread =
            std::thread::Builder::new().name("archive".into()).spawn_scoped(scope, open)?;
        thread.join().unwrap_or_else(|_| Err(io::Error::other("opening it panicked")))
    });
    opened.map_err(ArchiveFault::Open)
}

/// Runs a future that never waits for anything: ours block instead, the crate's compute.
pub(crate) fn at_once<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
        std::thread::yield_now();
    }
}

/// What the crate reads from.
pub(crate) struct Source {
    place: Arc<Place>,
    opening: Bytes,
    sections: Arc<Sections>,
}

impl Source {
    /// Reads the first bytes, and checks what the header says and the root directory becomes.
    pub(crate) fn new(place: Arc<Place>) -> Result<Self, ArchiveFault> {
        let opening = place.read(0, OPENING_BYTES)?;
        let sections = sections(&opening, place.size())?;
        let root = |at: u64| usize::try_from(at).expect("within the first bytes");
        let root = root(sections.root.start)..root(sections.root.end);
        let Some(root) = opening.get(root) else {
            return Err(ArchiveFault::Corrupt("it ends within its root directory".into()));
        };
        unpack::check(root, sections.internal, DIRECTORY_BYTES_MAX)
            .map_err(|what| ArchiveFault::Corrupt(format!("root directory: {what}")))?;
        Ok(Self { place, opening, sections: Arc::new(sections) })
    }

    pub(crate) fn sections(&self) -> &Arc<Sections> {
        &self.sections
    }

    /// Exactly so many bytes of one section, fit for the crate.
    fn part(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        let end = offset.saturating_add(length as u64);
        let within = |section: &std::ops::Range<u64>| section.start <= offset && end <= section.end;
        let (name, packed_max, unpacked_max) = match &self.sections {
            it if within(&it.tiles) => ("tile", TILE_BYTES_MAX, None),
            it if within(&it.leaves) => {
                ("leaf directory", DIRECTORY_BYTES_MAX, Some(DIRECTORY_BYTES_MAX))
            }
            it if within(&it.metadata) => {
                ("metadata", METADATA_BYTES_MAX, Some(METADATA_BYTES_MAX))
            }
            _ => return Err(ArchiveFault::Corrupt("an entry crosses a section's border".into())),
        };
        let corrupt = |what: String| ArchiveFault::Corrupt(format!("{name} at {offset}: {what}"));
        if length > packed_max {
            return Err(corrupt(format!("it is {length} bytes long, beyond {packed_max}")));
        }
        let bytes = self.place.read(offset, length)?;
        if bytes.len() != length {
            return Err(corrupt("the archive ends within it".into()));
        }
        if let Some(unpacked_max) = unpacked_max {
            unpack::check(&bytes, self.sections.internal, unpacked_max).map_err(corrupt)?;
        }
        Ok(bytes)
    }
}

impl AsyncBackend for Source {
    async fn read_exact(&self, offset: u64, length: usize) -> PmtResult<BackendResponse> {
        let part = self.part(offset, length).map_err(ArchiveFault::wrapped)?;
        Ok(BackendResponse::new(part))
    }

    /// Only what the crate begins with, which is here already.
    async fn read(&self, offset: u64, length: usize) -> PmtResult<BackendResponse> {
        let end = length.min(self.opening.len());
        if offset != 0 {
            let what = ArchiveFault::Corrupt("a read without a known end".into());
            return Err(what.wrapped());
        }
        Ok(BackendResponse::new(self.opening.slice(..end)))
    }
}

//! Archives of terrain: tiles of the octahedral square in a PMTiles file, on disk or on a server.
//!
//! In:    a path or an http(s) address.
//! Out:   facts from the metadata, the bytes of single tiles, colours of imagery.
//! Keeps: the mapped file or the connections, directories that were read, failures.
//! Not here: what a height's bytes mean (`overfly_core::datasource`), writing (`overfly_ingest`).
#![forbid(unsafe_code)]

mod breaker;
pub mod colour;
mod directories;
mod fault;
mod header;
pub mod metadata;
mod reader;
mod server;
mod source;
mod unpack;

pub use fault::{ArchiveError, ArchiveFault};
pub use metadata::Facts;
pub use overfly_core::datasource::facts::{ArchiveFacts, Datum, ImageryFacts, LayerFacts};
pub use reader::Reader;

use directories::Directories;
use header::{Sections, tile_name};
use overfly_core::datasource::{ColourTile, PageKey};
use overfly_core::settings::is_address;
use overfly_jobs::now_ns;
use parking_lot::Mutex;
use pmtiles::{AsyncPmTilesReader, Compression, PmtError, TileCoord};
use reader::HostFile;
use server::Server;
use source::{Place, Source, TILE_BYTES_MAX, at_once};
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Where an archive is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Location {
    /// A file.
    File(PathBuf),
    /// An address on a server, `http://…` or `https://…`.
    Http(String),
}

impl Location {
    /// An address if it begins like one, else a path: as scene files do.
    pub fn parse(text: &str) -> Self {
        if is_address(text) { Self::Http(text.to_owned()) } else { Self::File(PathBuf::from(text)) }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Http(url) => url.fmt(f),
        }
    }
}

/// Who reads, and how patient to be with a server. Files need none of it.
#[derive(Clone, PartialEq, Debug)]
pub struct OpenOptions {
    /// Longest wait for a name, and for a connection.
    pub connect_timeout: Duration,
    /// Longest wait for the next bytes.
    pub read_timeout: Duration,
    /// So many tries follow the first one.
    pub retries: u32,
    /// Wait before the first retry; it doubles with each.
    pub backoff: Duration,
    /// So many reads in a row that failed, retries included, and the server is left alone; at
    /// least 1.
    pub failures_max: u32,
    /// For how long it is left alone.
    pub cool_down: Duration,
    /// Reads all archives, whatever their locations look like; `None`: we do.
    pub reader: Option<Reader>,
}

impl Default for OpenOptions {
    /// 5 s to connect, 10 s for bytes, 3 retries from 200 ms on, 10 s of rest after 1 failure.
    fn default() -> Self {
        Self {
            connect_timeout: Duration::from_secs(5),
            read_timeout: Duration::from_secs(10),
            retries: 3,
            backoff: Duration::from_millis(200),
            failures_max: 1,
            cool_down: Duration::from_secs(10),
            reader: None,
        }
    }
}

/// How an archive has fared since it was opened.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Health {
    /// Tiles that were asked for and could not be had.
    pub failures: u64,
    /// Tiles that were not even asked for, since the server had just failed.
    pub refused: u64,
    /// What the last failure was.
    pub last_error: Option<String>,
    /// The server is being left alone.
    pub resting: bool,
}

/// An open archive, to be shared by loader threads.
///
/// A file is mapped: whoever replaces it must rename a new one over it. One that is written to in
/// place is noticed before a read, but one that is cut in the very middle of a read ends the
/// process.
///
/// `F` is what it says about itself, and so what it holds: heights unless it says otherwise.
pub struct Archive<F = ArchiveFacts> {
    name: String,
    reader: AsyncPmTilesReader<Source, Directories>,
    place: Arc<Place>,
    sections: Arc<Sections>,
    facts: F,
    health: Mutex<Health>,
}

/// An archive of imagery.
pub type Imagery = Archive<ImageryFacts>;

impl<F: fmt::Debug> fmt::Debug for Archive<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Archive").field("name", &self.name).field("facts", &self.facts).finish()
    }
}

impl Archive {
    /// Opens an archive of heights and reads its metadata. Blocks, for a server up to its
    /// time-outs.
    ///
    /// # Errors
    /// It cannot be reached, is damaged, of another kind or of an unknown version.
    pub fn open(location: &Location, options: &OpenOptions) -> Result<Self, ArchiveError> {
        Self::open_as(location, options, |facts| match facts {
            Facts::Elevation(facts) => Ok(facts),
            Facts::Imagery(_) => Err(ArchiveFault::Kind { found: "imagery", wanted: "elevation" }),
        })
    }
}

impl Imagery {
    /// Opens an archive of imagery and reads its metadata. Blocks, for a server up to its
    /// time-outs.
    ///
    /// # Errors
    /// It cannot be reached, is damaged, of another kind or of an unknown version.
    pub fn open_imagery(location: &Location, options: &OpenOptions) -> Result<Self, ArchiveError> {
        Self::open_as(location, options, |facts| match facts {
            Facts::Imagery(facts) => Ok(facts),
            Facts::Elevation(_) => {
                Err(ArchiveFault::Kind { found: "elevation", wanted: "imagery" })
            }
        })
    }

    /// The colours of a page's cell; `None` where the archive has none. Blocks as [`Self::tile`].
    ///
    /// # Errors
    /// The tile cannot be had, or is damaged.
    pub fn colour(&self, key: PageKey) -> Result<Option<ColourTile>, ArchiveError> {
        let decoded = |bytes: Vec<u8>| {
            let rgba = colour::decode(&bytes).map_err(|what| {
                let (z, x, y) = key.zxy();
                ArchiveFault::Corrupt(format!("tile {z}/{x}/{y}: {what}"))
            })?;
            Ok(ColourTile::new(key, rgba))
        };
        self.noted(self.fetch(key).and_then(|bytes| bytes.map(decoded).transpose()))
    }
}

impl Archive<Facts> {
    /// Opens an archive of whatever kind, to show what it says about itself.
    ///
    /// # Errors
    /// It cannot be reached, is damaged, not ours or of an unknown version.
    pub fn open_any(location: &Location, options: &OpenOptions) -> Result<Self, ArchiveError> {
        Self::open_as(location, options, Ok)
    }
}

impl<F> Archive<F> {
    fn open_as(
        location: &Location,
        options: &OpenOptions,
        kind: impl Fn(Facts) -> Result<F, ArchiveFault>,
    ) -> Result<Self, ArchiveError> {
        let name = location.to_string();
        let opened = match (&options.reader, location) {
            (Some(reader), _) => Ok(Place::Host(HostFile::new(&name, reader))),
            (None, Location::File(path)) => Place::file(path),
            (None, Location::Http(url)) => Ok(Place::Server(Box::new(Server::new(url, options)))),
        };
        opened
            .and_then(|place| Self::read(name.clone(), Arc::new(place), kind))
            .map_err(|fault| ArchiveError { archive: name, fault })
    }

    fn read(
        name: String,
        place: Arc<Place>,
        kind: impl Fn(Facts) -> Result<F, ArchiveFault>,
    ) -> Result<Self, ArchiveFault> {
        let source = Source::new(place.clone())?;
        let sections = source.sections().clone();
        let opening = AsyncPmTilesReader::try_from_cached_source(source, Directories::default());
        let reader = at_once(opening).map_err(ArchiveFault::from_pmtiles)?;
        let foreign = || ArchiveFault::Foreign { tile_type: tile_name(sections.tile_type) };
        let metadata = at_once(reader.get_metadata()).map_err(|error| match error {
            PmtError::InvalidMetadata => foreign(),
            other => ArchiveFault::from_pmtiles(other),
        })?;
        let facts = kind(metadata::from_json(&metadata)?.ok_or_else(foreign)?)?;
        if matches!(sections.tile_compression, Compression::Unknown | Compression::Brotli) {
            let how = sections.tile_compression;
            let what = format!("its tiles are compressed as {how:?}; gzip and zstd are read");
            return Err(ArchiveFault::Corrupt(what));
        }
        Ok(Self { name, reader, place, sections, facts, health: Mutex::default() })
    }

    /// Path or address, as it was opened.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the archive says about itself, every range checked.
    pub fn facts(&self) -> &F {
        &self.facts
    }

    /// The bytes of a page's tile, unpacked: at most 1 MiB. `None` where the archive has none.
    /// Blocks; a server that failed a moment ago is not asked again but refused at once.
    ///
    /// # Errors
    /// The tile cannot be had, or is damaged.
    pub fn tile(&self, key: PageKey) -> Result<Option<Vec<u8>>, ArchiveError> {
        self.noted(self.fetch(key))
    }

    fn noted<T>(&self, outcome: Result<T, ArchiveFault>) -> Result<T, ArchiveError> {
        outcome.map_err(|fault| {
            self.note(&fault);
            ArchiveError { archive: self.name.clone(), fault }
        })
    }

    fn fetch(&self, key: PageKey) -> Result<Option<Vec<u8>>, ArchiveFault> {
        let (z, x, y) = key.zxy();
        let tile = TileCoord::new(z, x, y).expect("a page is a tile of zoom 1 to 24");
        let packed = at_once(self.reader.get_tile(tile)).map_err(ArchiveFault::from_pmtiles)?;
        let Some(packed) = packed else { return Ok(None) };
        unpack::unpack(&packed, self.sections.tile_compression, TILE_BYTES_MAX)
            .map(Some)
            .map_err(|what| ArchiveFault::Corrupt(format!("tile {z}/{x}/{y}: {what}")))
    }

    fn note(&self, fault: &ArchiveFault) {
        let mut health = self.health.lock();
        if matches!(fault, ArchiveFault::Resting(_) | ArchiveFault::Closed) {
            health.refused += 1;
        } else {
            health.failures += 1;
            health.last_error = Some(fault.to_string());
        }
    }

    /// How it has fared so far. Cheap; never blocks on the server.
    pub fn health(&self) -> Health {
        let resting = match self.place.as_ref() {
            Place::File(_) | Place::Host(_) => false,
            Place::Server(server) => server.breaker.is_resting(now_ns()),
        };
        Health { resting, ..self.health.lock().clone() }
    }

    /// Gives up: whoever waits to retry fails within 20 ms, a request under way when it ends or
    /// times out, and later ones at once. For a host that wants to end while a server is silent.
    pub fn close(&self) {
        match self.place.as_ref() {
            Place::File(_) => {}
            Place::Host(host) => host.close(),
            Place::Server(server) => server.breaker.close(),
        }
    }
}

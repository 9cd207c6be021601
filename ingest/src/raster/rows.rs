//! Rasters of 16-bit numbers in rows, highest byte first: read by position.
//!
//! In:    a plain file, or a stream that is written to the scratch file when first needed.
//! Out:   chunks of whole rows.
//! Keeps: where the stream's rows lie in the scratch file.
//! Not here: what the file is and where it lies on the body (`hgt`, `flat_png`).

use super::samples::Samples;
use super::store::ChunkStore;
use super::{ChunkGrid, Grid, Raster, RasterError};
use super::{flat_png, hgt};
use parking_lot::Mutex;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Size that a chunk of rows should have.
const CHUNK_BYTES: u32 = 512 << 10;

/// Rows of 16-bit numbers.
#[derive(Debug)]
pub(crate) struct RowSource {
    backing: Backing,
    signed: bool,
}

#[derive(Debug)]
enum Backing {
    /// The file itself. Opened for every chunk: a world of .hgt files has more files than a
    /// process may hold open.
    Plain,
    /// A compressed file, written out row by row when first needed.
    Stream { of: Stream, state: Mutex<State> },
}

/// What can only be read from beginning to end.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stream {
    Zip,
    Png,
}

#[derive(Debug)]
enum State {
    Unread,
    /// Where the rows begin in the scratch file.
    At(u64),
    /// What was wrong, so that it is not tried again for every window.
    Failed(String),
}

/// Chunks of whole rows for a raster of 16-bit numbers.
pub(crate) fn chunk_grid(grid: &Grid) -> ChunkGrid {
    let height = (CHUNK_BYTES / 2 / grid.columns).clamp(1, grid.rows);
    ChunkGrid { width: grid.columns, height, number_bytes: 2, flipped: false, padded: false }
}

impl RowSource {
    /// A file of signed numbers and nothing else.
    pub fn plain() -> Self {
        Self { backing: Backing::Plain, signed: true }
    }

    /// A file that streams.
    pub fn stream(of: Stream) -> Self {
        let signed = matches!(of, Stream::Zip);
        Self { backing: Backing::Stream { of, state: Mutex::new(State::Unread) }, signed }
    }

    /// Reads one chunk.
    pub fn decode(
        &self,
        of: &Raster,
        chunk: u64,
        extent: [u32; 2],
    ) -> Result<Samples, RasterError> {
        let [width, height] = extent.map(u64::from);
        let at = 2 * width * chunk * u64::from(of.chunks.height);
        let count = usize::try_from(2 * width * height).expect("chunks are small by design");
        let mut bytes = vec![0; count];
        match &self.backing {
            Backing::Plain => read_plain(&of.name, at, &mut bytes)?,
            Backing::Stream { of: stream, state } => {
                let start = written(*stream, state, of)?;
                let read = of.store.read_scratch(start + at, &mut bytes);
                read.map_err(|error| RasterError::io(&of.name, error))?;
            }
        }
        let pairs = bytes.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        Ok(if self.signed {
            Samples::I16(pairs.map(i16::from_be_bytes).collect())
        } else {
            Samples::U16(pairs.map(u16::from_be_bytes).collect())
        })
    }
}

fn read_plain(name: &Path, at: u64, bytes: &mut [u8]) -> Result<(), RasterError> {
    let read = || {
        let mut file = File::open(name)?;
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(bytes)
    };
    let mut read = read;
    read().map_err(|error| RasterError::io(name, error))
}

/// Where the stream's rows begin; writes them when nobody has. Others who need this raster wait.
fn written(stream: Stream, state: &Mutex<State>, of: &Raster) -> Result<u64, RasterError> {
    let mut state = state.lock();
    match &*state {
        State::At(start) => return Ok(*start),
        State::Failed(found) => return Err(RasterError::broken(&of.name, found.clone())),
        State::Unread => {}
    }
    let bytes = 2 * u64::from(of.grid.columns) * u64::from(of.grid.rows);
    let io = |error| RasterError::io(&of.name, error);
    let start = of.store.reserve_scratch(bytes).map_err(io)?;
    let mut to = ScratchWriter { store: &of.store, at: start, end: start + bytes };
    let read = match stream {
        Stream::Zip => hgt::unzip(&of.name, &mut to),
        Stream::Png => flat_png::decode(&of.name, &mut to),
    };
    *state = match &read {
        Ok(()) => State::At(start),
        Err(RasterError::Broken { found, .. }) => State::Failed(found.clone()),
        Err(error) => State::Failed(error.to_string()),
    };
    read.map(|()| start)
}

/// Appends to a range of the scratch file.
pub(crate) struct ScratchWriter<'a> {
    store: &'a ChunkStore,
    at: u64,
    end: u64,
}

impl ScratchWriter<'_> {
    /// Bytes still to come.
    pub fn missing(&self) -> u64 {
        self.end - self.at
    }

    /// Appends; more than the range holds is an error of the format's reader.
    pub fn write(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let count = u64::try_from(bytes.len()).expect("usize has at most 64 bits");
        assert!(count <= self.missing(), "format readers stop at the size they declared");
        self.store.write_scratch(self.at, bytes)?;
        self.at += count;
        Ok(())
    }
}

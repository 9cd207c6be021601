//! Every elevation input as one type: a grid of postings, read window by window.
//!
//! In:    GeoTIFF, SRTM .hgt and .hgt.zip, PNG tile pyramids, 16-bit PNG.
//! Out:   heights in metres as the file gives them, NaN where void.
//! Keeps: decoded chunks within one budget (`ChunkStore`).
//! Not here: vertical datums (`geoid`), interpolation, other projections (the caller).

mod error;
mod flat_png;
pub(crate) mod geotiff;
mod grid;
mod hgt;
mod rows;
mod samples;
mod store;
mod tiles;
mod window;

pub use error::RasterError;
pub use grid::{Grid, MERCATOR_RADIUS_M, Projection};
pub use store::{CACHE_BYTES, ChunkStore};
pub use tiles::TileEncoding;
pub use window::WINDOW_POSTINGS_MAX;

use samples::{Samples, Transfer};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Elevation files in one folder beyond this are refused: every one costs memory.
const FILES_MAX: usize = 1 << 16;

/// One raster of heights. Windows of it may be read from several threads at once.
#[derive(Debug)]
pub struct Raster {
    /// The file or folder, as messages name it.
    pub name: PathBuf,
    /// Where the postings lie.
    pub grid: Grid,
    /// What it is, for people: "GeoTIFF int16", "SRTM .hgt", …
    pub kind: &'static str,
    /// The number that means void by the file's own word. The smallest int16, NaN and heights
    /// beyond ±1000 km are voids in any case.
    pub declared_nodata: Option<f64>,
    /// Size of the file as it lies on disk; of a tile pyramid, of its deepest zoom.
    pub bytes_on_disk: u64,
    chunks: ChunkGrid,
    transfer: Transfer,
    source: Source,
    store: Arc<ChunkStore>,
    /// This raster's number in the store.
    number: u64,
}

/// What the caller knows and the files do not say.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// How PNG tiles hold heights. `None`: found out where the first tile leaves no doubt.
    pub encoding: Option<TileEncoding>,
    /// West, south, east and north edge of a 16-bit PNG, in degrees.
    pub extent_deg: Option<[f64; 4]>,
    /// Height of one unit of a 16-bit PNG.
    pub metres_per_unit: f64,
    /// Height of zero in a 16-bit PNG.
    pub offset_m: f64,
    /// One more number that means void, in any format but PNG tiles.
    pub nodata: Option<f64>,
    /// Where decoded chunks live. Clones share it; open all inputs with clones of one value.
    pub store: Arc<ChunkStore>,
}

impl Default for OpenOptions {
    /// Nothing known, and a store of its own of [`CACHE_BYTES`].
    fn default() -> Self {
        Self {
            encoding: None,
            extent_deg: None,
            metres_per_unit: 1.0,
            offset_m: 0.0,
            nodata: None,
            store: ChunkStore::new(CACHE_BYTES),
        }
    }
}

/// How a raster is cut into the pieces that are decoded at once. Pieces at the right and lower
/// edge are cut off there.
#[derive(Clone, Copy, Debug)]
struct ChunkGrid {
    width: u32,
    height: u32,
    /// Bytes of one number in [`Samples`].
    number_bytes: u32,
    /// Whether the file's rows run north, so that its row 0 is the grid's last.
    flipped: bool,
    /// Whether rows of chunks at the right edge keep their whole width.
    padded: bool,
}

/// Where chunks come from.
#[derive(Debug)]
enum Source {
    Tiff(geotiff::TiffSource),
    Rows(rows::RowSource),
    Tiles(tiles::TileSource),
}

/// What a format's opener finds out; [`assemble`] makes the raster of it.
struct Found {
    grid: Grid,
    kind: &'static str,
    declared_nodata: Option<f64>,
    bytes_on_disk: u64,
    chunks: ChunkGrid,
    transfer: Transfer,
    source: Source,
}

/// Opens a file, a folder of `.hgt`, `.hgt.zip`, `.tif` and 16-bit `.png` files (one raster
/// each, in the order of their names), a folder of `z/x/y.png` tiles, or a template such as
/// `tiles/{z}/{x}/{y}.png` (one raster: the deepest zoom).
///
/// Only headers are read; contents that do not match them show in [`Raster::window`].
pub fn open(path: &Path, options: &OpenOptions) -> Result<Vec<Raster>, RasterError> {
    if tiles::is_template(path) {
        return Ok(vec![assemble(path, options, tiles::open(path, options)?)]);
    }
    if !path.is_dir() {
        return Ok(vec![open_file(path, options)?]);
    }
    let files = elevation_files(path)?;
    if files.is_empty() {
        let template = path.join("{z}").join("{x}").join("{y}.png");
        return Ok(vec![assemble(path, options, tiles::open(&template, options)?)]);
    }
    files.iter().map(|file| open_file(file, options)).collect()
}

fn open_file(path: &Path, options: &OpenOptions) -> Result<Raster, RasterError> {
    let found = match Format::of(path) {
        Some(Format::Tiff) => geotiff::open(path, options)?,
        Some(Format::Hgt) => hgt::open(path, options)?,
        Some(Format::HgtZip) => hgt::open_zip(path, options)?,
        Some(Format::Png) => flat_png::open(path, options)?,
        None => return Err(unknown_format(path)),
    };
    Ok(assemble(path, options, found))
}

fn assemble(path: &Path, options: &OpenOptions, found: Found) -> Raster {
    let Found { grid, kind, declared_nodata, bytes_on_disk, chunks, transfer, source } = found;
    let store = options.store.clone();
    let number = store.register();
    let name = path.to_path_buf();
    Raster {
        name,
        grid,
        kind,
        declared_nodata,
        bytes_on_disk,
        chunks,
        transfer,
        source,
        store,
        number,
    }
}

impl Drop for Raster {
    fn drop(&mut self) {
        self.store.forget(self.number);
        if let Source::Tiff(source) = &self.source {
            self.store.drop_decoders(source.open_decoders());
        }
    }
}

impl ChunkGrid {
    /// Chunks side by side.
    fn across(&self, grid: &Grid) -> u64 {
        u64::from(grid.columns.div_ceil(self.width))
    }

    /// Width and height of a chunk, cut off at the raster's edge.
    fn extent(&self, grid: &Grid, chunk: u64) -> [u32; 2] {
        let cut = |whole: u32, at: u64, total: u32| {
            let left = u64::from(total).saturating_sub(at * u64::from(whole));
            whole.min(u32::try_from(left).unwrap_or(whole))
        };
        let across = self.across(grid);
        let height = cut(self.height, chunk / across, grid.rows);
        let width = cut(self.width, chunk % across, grid.columns);
        [if self.padded { self.width } else { width }, height]
    }
}

impl Source {
    /// Decodes one chunk. Slow; called outside of any lock that readers of other chunks need.
    fn decode(&self, of: &Raster, chunk: u64) -> Result<Samples, RasterError> {
        let extent = of.chunks.extent(&of.grid, chunk);
        match self {
            Self::Tiff(source) => source.decode(of, chunk, extent),
            Self::Rows(source) => source.decode(of, chunk, extent),
            Self::Tiles(source) => source.decode(chunk),
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Tiff,
    Hgt,
    HgtZip,
    Png,
}

impl Format {
    /// By the name's ending, in any case of letters.
    fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ends = |ending: &str| name.ends_with(ending);
        if ends(".tif") || ends(".tiff") || ends(".gtiff") {
            Some(Self::Tiff)
        } else if ends(".hgt") {
            Some(Self::Hgt)
        } else if ends(".hgt.zip") {
            Some(Self::HgtZip)
        } else if ends(".png") {
            Some(Self::Png)
        } else {
            None
        }
    }
}

fn unknown_format(path: &Path) -> RasterError {
    if let Err(error) = fs::metadata(path) {
        return RasterError::io(path, error);
    }
    RasterError::unsupported(
        path,
        "the name's ending says no elevation format",
        "read are .tif, .hgt, .hgt.zip, 16-bit .png and folders of {z}/{x}/{y}.png tiles; \
         anything else: gdal_translate in out.tif",
    )
}

/// The elevation files right in a folder, sorted by name.
fn elevation_files(folder: &Path) -> Result<Vec<PathBuf>, RasterError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(|error| RasterError::io(folder, error))? {
        let path = entry.map_err(|error| RasterError::io(folder, error))?.path();
        if Format::of(&path).is_some() && path.is_file() {
            files.push(path);
        }
        if files.len() > FILES_MAX {
            let found = format!("more than {FILES_MAX} elevation files in one folder");
            return Err(RasterError::unsupported(
                folder,
                found,
                "merge them: gdalbuildvrt, gdalwarp",
            ));
        }
    }
    files.sort();
    Ok(files)
}

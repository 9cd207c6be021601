//! From one picture to an archive of imagery: filtered, cut into tiles, written beside and renamed.
//!
//! In:    [`ImageryOptions`].
//! Out:   a PMTiles archive of PNG tiles; an [`ImageryReport`].
//! Keeps: nothing.
//! Not here: heights (`build`), laying several archives over each other (the scene).

mod mips;
mod picture;
mod place;
mod texels;
mod tiff_rows;

use crate::build::{Progress, add, coord};
use crate::fault::IngestError;
use crate::raster::{Grid, Projection};
use mips::Making;
use overfly_archive::metadata::imagery_to_json;
use overfly_archive::{Imagery, Location, OpenOptions, colour};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::colour::content_of;
use overfly_core::datasource::facts::{IMAGERY_VERSION, ImageryFacts};
use overfly_core::digest::Chain;
use overfly_core::geodesy::Ellipsoid;
use picture::{Ended, Picture};
use pmtiles::{Compression, PmTilesWriter, TileId, TileType};
use rayon::prelude::*;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use texels::Canvas;

/// Tiles made at once, between two looks at whether to stop.
const BATCH: usize = 64;
/// Rows between two words of progress.
const ROWS: u32 = 64;

/// What to build.
pub struct ImageryOptions {
    /// A PNG or TIFF of 8 bits a channel.
    pub input: PathBuf,
    /// How it is projected, if it does not say so itself; without a word plate carrée.
    pub projection: Option<Projection>,
    /// West, south, east and north edge in degrees, if it does not say so itself; without them the
    /// whole body, or the whole Mercator square.
    pub bounds_deg: Option<[f64; 4]>,
    /// Whom to thank.
    pub attribution: String,
    /// Where the archive shall lie.
    pub output: PathBuf,
    /// The body's name and shape.
    pub body: (String, Ellipsoid),
}

/// What was built.
#[derive(Clone, Debug)]
pub struct ImageryReport {
    /// The archive's facts.
    pub facts: ImageryFacts,
    /// What the picture is, for people.
    pub kind: &'static str,
    /// Its columns and rows.
    pub size: [u32; 2],
    /// Bytes of the picture.
    pub bytes_in: u64,
    /// Tiles of the archive.
    pub tiles: u64,
    /// Its bytes.
    pub bytes: u64,
}

/// Builds an archive of imagery.
///
/// # Errors
/// If the picture cannot be read or the archive not be written; nothing is left but what was there.
pub fn build_imagery(
    options: &ImageryOptions,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<ImageryReport, IngestError> {
    let picture = Picture::open(&options.input)?;
    let grid = place::grid_of(&picture, options.projection, options.bounds_deg)?;
    let depth = place::depth_of(&grid);
    let folder = match options.output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let output = |error| IngestError::Output { path: options.output.clone(), error };
    let making = Making::new(folder, picture.size).map_err(output)?;
    let mips = read(&picture, making, stop, progress).map_err(|ended| match ended {
        Ended::Raster(error) => IngestError::Raster(error),
        Ended::Spool(error) => output(error),
        Ended::Stopped => IngestError::Stopped,
    })?;
    let desk = Desk { options, picture: &picture, grid, depth };
    let part = tempfile::Builder::new()
        .prefix(".overfly-")
        .suffix(".part")
        .tempfile_in(folder)
        .map_err(output)?;
    let canvas = Canvas::new(mips, grid, depth);
    let (facts, tiles) = desk.write(part.as_file(), &canvas, stop, progress)?;
    part.as_file().sync_all().map_err(output)?;
    let bytes = part.as_file().metadata().map_err(output)?.len();
    part.persist(&options.output).map_err(|error| output(error.error))?;
    let (kind, size, bytes_in) = (picture.kind, picture.size, picture.bytes_on_disk);
    Ok(ImageryReport { facts, kind, size, bytes_in, tiles, bytes })
}

/// Reads a whole picture and its halves.
fn read(
    picture: &Picture,
    mut making: Making,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<mips::Mips, Ended> {
    let mut done = 0;
    picture.rows(&mut |row| {
        if stop.load(Ordering::Relaxed) {
            return Err(Ended::Stopped);
        }
        making.push(row).map_err(Ended::Spool)?;
        done += 1;
        if done % ROWS == 0 || done == picture.size[1] {
            progress(Progress::Looking(done.into(), picture.size[1].into()));
        }
        Ok(())
    })?;
    Ok(making.finish())
}

/// Keys in the order of the archive.
fn sorted_keys(grid: &Grid, depth: u8) -> Vec<PageKey> {
    let mut keys = place::keys(grid, depth);
    keys.sort_by_cached_key(|&key| TileId::from(coord(key)));
    keys
}

/// A tile's key, bytes and hash, where it shows something.
fn made(canvas: &Canvas, key: PageKey) -> std::io::Result<Option<(PageKey, Vec<u8>, u64)>> {
    let rgba = canvas.tile(key)?;
    Ok(rgba.map(|rgba| (key, colour::encode(&rgba), content_of(&rgba))))
}

/// What tiles are written from.
struct Desk<'a> {
    options: &'a ImageryOptions,
    picture: &'a Picture,
    grid: Grid,
    depth: u8,
}

impl Desk<'_> {
    fn write(
        &self,
        file: &File,
        canvas: &Canvas,
        stop: &AtomicBool,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<(ImageryFacts, u64), IngestError> {
        let path = &self.options.output;
        let refused = |error| IngestError::Archive { path: path.clone(), error };
        let writer = PmTilesWriter::new(TileType::Png).tile_compression(Compression::None);
        let mut writer = writer.create(file).map_err(refused)?;
        let keys = sorted_keys(&self.grid, self.depth);
        let (mut content, mut tiles, mut done) = (Chain::default(), 0, 0);
        for batch in keys.chunks(BATCH) {
            if stop.load(Ordering::Relaxed) {
                return Err(IngestError::Stopped);
            }
            let made = batch.par_iter().map(|&key| made(canvas, key));
            let made: std::io::Result<Vec<_>> = made.collect();
            let made = made.map_err(|error| IngestError::Output { path: path.clone(), error })?;
            for (key, bytes, hash) in made.into_iter().flatten() {
                add(&mut writer, key, &bytes).map_err(refused)?;
                content.add(key.bits());
                content.add(hash);
                tiles += 1;
            }
            done += batch.len() as u64;
            progress(Progress::Writing(done, keys.len() as u64));
        }
        if tiles == 0 {
            return Err(IngestError::NoColour { path: self.picture.name.clone() });
        }
        let facts = self.facts(content.0);
        writer.set_zoom_range(1, self.depth + 1);
        writer.set_metadata(imagery_to_json(&facts, self.of_source()));
        writer.finalize().map_err(refused)?;
        Ok((facts, tiles))
    }

    fn facts(&self, content: u64) -> ImageryFacts {
        let (body_name, body) = self.options.body.clone();
        let [east, north] = self.grid.spacing_m(body.a_m);
        let name = self.picture.name.file_name();
        ImageryFacts {
            version: IMAGERY_VERSION,
            body_name,
            body,
            depth: self.depth,
            spacing_m: (east * north).sqrt(),
            attribution: self.options.attribution.clone(),
            source: name.map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            content,
        }
    }

    /// Facts for people.
    fn of_source(&self) -> serde_json::Value {
        let projection = match self.grid.projection {
            Projection::PlateCarree => "equirectangular",
            Projection::WebMercator => "mercator",
        };
        serde_json::json!({
            "file": self.picture.name.file_name().map(|name| name.to_string_lossy()),
            "kind": self.picture.kind,
            "pixels": self.picture.size,
            "projection": projection,
            "origin": self.grid.origin,
            "step": self.grid.step,
        })
    }
}

/// Reads every tile of a finished archive back and compares its texels with the archive's hash.
///
/// # Errors
/// A tile cannot be read, or the texels are others.
pub fn verify_imagery(
    options: &ImageryOptions,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<u64, IngestError> {
    let location = Location::File(options.output.clone());
    let archive =
        Imagery::open_imagery(&location, &OpenOptions::default()).map_err(IngestError::ReadBack)?;
    let picture = Picture::open(&options.input)?;
    let grid = place::grid_of(&picture, options.projection, options.bounds_deg)?;
    let keys = sorted_keys(&grid, archive.facts().depth);
    let (mut content, mut tiles) = (Chain::default(), 0);
    for (&key, done) in keys.iter().zip(1..) {
        if stop.load(Ordering::Relaxed) {
            return Err(IngestError::Stopped);
        }
        if let Some(tile) = archive.colour(key).map_err(IngestError::ReadBack)? {
            content.add(key.bits());
            content.add(tile.content);
            tiles += 1;
        }
        progress(Progress::Comparing(done, keys.len() as u64));
    }
    let stated = archive.facts().content;
    if content.0 == stated {
        return Ok(tiles);
    }
    Err(IngestError::OtherContent { path: options.output.clone(), stated, found: content.0 })
}

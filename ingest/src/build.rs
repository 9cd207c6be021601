//! From rasters to an archive: layers planned, tiles made, the file written beside and renamed.
//!
//! In:    [`BuildOptions`].
//! Out:   a PMTiles archive; a [`Report`].
//! Keeps: nothing.
//! Not here: each step (`pyramid`, `marks`, `geoid`), reading the archive back (`verify`).

use crate::block::{Layer, Sheet, lon_lat_of};
use crate::fault::IngestError;
use crate::geoid::{Geoid, NodeSpacing};
use crate::marks::{marks, ring};
use crate::pyramid::Making;
use crate::raster::{OpenOptions, Raster, open};
use crate::spool::{MARKS, Record, Spool};
use crate::survey::Survey;
use glam::IVec3;
use overfly_archive::metadata::to_json;
use overfly_core::datasource::codec::encode;
use overfly_core::datasource::facts::{
    ArchiveFacts, Datum, FORMAT_VERSION, LAYERS_MAX, LayerFacts,
};
use overfly_core::datasource::key::{DEPTH_MAX, PAGE_BITS};
use overfly_core::datasource::page::SAMPLES;
use overfly_core::datasource::tile::{
    FULL, LayerTile, Mark, SEA_LEVEL_UNIT_M, Tile, sea_level_grid, sea_level_side,
};
use overfly_core::datasource::{PAGE_SIDE, PageKey};
use overfly_core::digest::Chain;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::lattice::{RADIUS, fold, normal_of};
use pmtiles::{Compression, PmTilesStreamWriter, PmTilesWriter, TileCoord, TileId, TileType};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A grid has so many points a posting at least, in the middle of its raster: then the triangles
/// between them can meet every posting.
const POINTS_A_POSTING: f64 = 1.25;
/// Width of a blend in postings, unless another is asked for.
const BLEND_POSTINGS: f64 = 8.0;
const BLEND_LEAST_M: f64 = 1e-3;
/// Quanta of heights in whole metres and of others, and per metre of spacing at least.
const QUANTUM_M: [f64; 2] = [1.0, 0.1];
const QUANTUM_A_METRE: f64 = 3e-4;
const QUANTUM_MOST_M: f64 = 100.0;
/// Postings of whole metres are met to this.
const SLACK_M: f64 = 0.25;
/// From this spacing on the geoid's own nodes may lie a degree apart.
const COARSE_M: f64 = 10_000.0;
/// Tiles encoded at once.
const BATCH: usize = 512;

/// What to build.
pub struct BuildOptions {
    /// Files, folders or templates of tiles.
    pub inputs: Vec<PathBuf>,
    /// How to open them.
    pub open: OpenOptions,
    /// Where the archive shall lie.
    pub output: PathBuf,
    /// The body's name and shape.
    pub body: (String, Ellipsoid),
    /// What the inputs' heights are above.
    pub datum: Datum,
    /// A GTX grid of the geoid; without one EGM96's harmonics.
    pub geoid: Option<PathBuf>,
    /// Width of blends in metres; without one 8 postings.
    pub blend_m: Option<f64>,
    /// Deepest lattice level; without one what the postings ask for.
    pub level_max: Option<u8>,
    /// Lattice points a posting at least; without a number 1.25. More cost bytes, and keep the
    /// ground between postings nearer to straight lines.
    pub density: Option<f64>,
}

/// How far a build has come.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Progress {
    /// Looking at a raster: how many of how many.
    Looking(u64, u64),
    /// Making tiles.
    Making(u64, u64),
    /// Writing tiles.
    Writing(u64, u64),
    /// Comparing the archive with its sources.
    Comparing(u64, u64),
}

/// What was built.
#[derive(Clone, Debug)]
pub struct Report {
    /// The archive's facts.
    pub facts: ArchiveFacts,
    /// Its tiles.
    pub tiles: u64,
    /// Its bytes.
    pub bytes: u64,
    /// Bytes of the inputs.
    pub bytes_in: u64,
    /// Postings of the inputs, and how many of them are void.
    pub postings: [u64; 2],
}

/// An input and what it holds.
pub struct Source {
    /// The raster.
    pub raster: Raster,
    /// What it holds.
    pub survey: Survey,
    /// Distance of its postings in metres, east and north.
    pub spacing_m: [f64; 2],
    /// Depth of the tiles that its postings ask for.
    pub depth: u8,
}

/// One layer in the making.
pub struct Plan {
    /// Depth of its last level.
    pub facts: LayerFacts,
    /// Its sources, finest first.
    pub sources: Vec<usize>,
    /// Postings are met to this.
    pub slack_m: f64,
}

/// Builds an archive.
///
/// # Errors
/// If an input cannot be read or the archive not be written; nothing is left but what was there.
pub fn build(
    options: &BuildOptions,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Report, IngestError> {
    let sources = sources(options, stop, progress)?;
    let plans = plans(options, &sources)?;
    let folder = match options.output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let output = |error| IngestError::Output { path: options.output.clone(), error };
    let spool = Spool::new(folder).map_err(output)?;
    let makings: Vec<_> =
        (0..).zip(&plans).map(|(i, plan)| making(options, &sources, i, plan)).collect();
    make(&makings, &spool, stop, progress)
        .map_err(|error| IngestError::made(error, &options.output))?;
    let geoids = geoids(options)?;
    let desk = Desk { options, plans: &plans, spool: &spool, geoids, stop };
    let part = tempfile::Builder::new()
        .prefix(".overfly-")
        .suffix(".part")
        .tempfile_in(folder)
        .map_err(output)?;
    let (facts, tiles) = desk.write(part.as_file(), &sources, stop, progress)?;
    part.as_file().sync_all().map_err(output)?;
    let bytes = part.as_file().metadata().map_err(output)?.len();
    part.persist(&options.output).map_err(|error| output(error.error))?;
    Ok(Report {
        facts,
        tiles,
        bytes,
        bytes_in: sources.iter().map(|source| source.raster.bytes_on_disk).sum(),
        postings: sources.iter().fold([0; 2], |[all, voids], source| {
            let grid = &source.raster.grid;
            let postings = u64::from(grid.columns) * u64::from(grid.rows);
            [all + postings, voids + source.survey.voids]
        }),
    })
}

/// Opens and looks at every input.
///
/// # Errors
/// If one cannot be read, or there is none.
pub fn sources(
    options: &BuildOptions,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Source>, IngestError> {
    let mut rasters = Vec::new();
    for input in &options.inputs {
        rasters.extend(open(input, &options.open)?);
    }
    if rasters.is_empty() {
        return Err(IngestError::NoInput);
    }
    let radius_m = options.body.1.a_m;
    let total = rasters.len() as u64;
    let mut sources = Vec::new();
    for (raster, done) in rasters.into_iter().zip(1..) {
        let survey = Survey::of(&raster, stop)?.ok_or(IngestError::Stopped)?;
        let spacing_m = raster.grid.spacing_m(radius_m);
        let depth = depth_of(&raster, spacing_m, options);
        sources.push(Source { raster, survey, spacing_m, depth });
        progress(Progress::Looking(done, total));
    }
    Ok(sources)
}

/// The depth whose samples are dense enough for the raster's postings.
fn depth_of(raster: &Raster, spacing_m: [f64; 2], options: &BuildOptions) -> u8 {
    let (body, level_max) = (&options.body.1, options.level_max);
    let points = options.density.unwrap_or(POINTS_A_POSTING);
    let grid = &raster.grid;
    let middle = grid.lon_lat(0.5 * f64::from(grid.columns - 1), 0.5 * f64::from(grid.rows - 1));
    let normal =
        overfly_core::geodesy::Geodetic { lat_rad: middle[1], lon_rad: middle[0], height_m: 0.0 }
            .normal();
    let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
    // A unit of the square is so much of the unit sphere; on the mean over all of it for rasters
    // that go round.
    let share = if grid.wraps { core::f64::consts::PI } else { sum * sum * sum };
    let posting_m2 = spacing_m[0] * spacing_m[1];
    let most =
        level_max.map_or(DEPTH_MAX, |level| (level / 2).saturating_sub(PAGE_BITS).min(DEPTH_MAX));
    let enough = |depth: &u8| {
        let step = 1.0 / f64::from(1_u32 << (depth + PAGE_BITS));
        share * (body.a_m * step) * (body.a_m * step) * points <= posting_m2
    };
    (0..most).find(enough).unwrap_or(most)
}

/// The layers, by rising depth.
///
/// # Errors
/// If there are too many.
pub fn plans(options: &BuildOptions, sources: &[Source]) -> Result<Vec<Plan>, IngestError> {
    let mut by_depth: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
    for (index, source) in sources.iter().enumerate() {
        by_depth.entry(source.depth).or_default().push(index);
    }
    if by_depth.len() > LAYERS_MAX {
        return Err(IngestError::Layers { found: by_depth.len() });
    }
    let plan = |(depth, mut own): (u8, Vec<usize>)| {
        let spacing =
            |index: &usize| sources[*index].spacing_m[1].max(sources[*index].spacing_m[0]);
        own.sort_by(|a, b| spacing(a).total_cmp(&spacing(b)));
        let spacing_m = spacing(&own[0]);
        let whole = own.iter().all(|&index| sources[index].survey.whole_metres);
        let name = |index: &usize| {
            let name = sources[*index].raster.name.file_name();
            name.map_or_else(String::new, |name| name.to_string_lossy().into_owned())
        };
        Plan {
            facts: LayerFacts {
                depth,
                quantum_m: QUANTUM_M[usize::from(!whole)]
                    .max(spacing_m * QUANTUM_A_METRE)
                    .min(QUANTUM_MOST_M),
                spacing_m,
                blend_m: options.blend_m.unwrap_or(BLEND_POSTINGS * spacing_m).max(BLEND_LEAST_M),
                sources: own.iter().map(name).collect(),
            },
            slack_m: if whole { SLACK_M } else { 0.0 },
            sources: own,
        }
    };
    Ok(by_depth.into_iter().map(plan).collect())
}

/// A layer over its sources.
pub fn layer<'a>(plan: &Plan, sources: &'a [Source]) -> Layer<'a> {
    let sheet = |&index: &usize| Sheet {
        raster: &sources[index].raster,
        survey: &sources[index].survey,
        spacing_m: sources[index].spacing_m,
    };
    Layer {
        sheets: plan.sources.iter().map(sheet).collect(),
        blend_m: plan.facts.blend_m,
        grid: plan.facts.depth + PAGE_BITS,
    }
}

fn making<'a>(options: &BuildOptions, sources: &'a [Source], index: u8, plan: &Plan) -> Making<'a> {
    let layer = layer(plan, sources);
    let radius_m = options.body.1.a_m;
    Making {
        index,
        depth: plan.facts.depth,
        quantum_m: plan.facts.quantum_m,
        slack_m: plan.slack_m,
        step_m: 2.0 * radius_m / f64::from(1_u32 << layer.grid),
        radius_m,
        layer,
    }
}

fn make(
    makings: &[Making<'_>],
    spool: &Spool,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(), crate::pyramid::MakeError> {
    let keys: Vec<_> = makings.iter().map(Making::last_keys).collect();
    let total: usize = keys.iter().map(Vec::len).sum();
    let made = std::sync::atomic::AtomicU64::new(0);
    for (making, keys) in makings.iter().zip(&keys) {
        making.last_level(keys, spool, stop, &|count| {
            let made = made.fetch_add(count, Ordering::Relaxed) + count;
            progress(Progress::Making(made, total as u64));
        })?;
        for depth in (0..making.depth).rev() {
            making.coarser(depth, spool, stop)?;
        }
    }
    Ok(())
}

/// The geoid for fine and for coarse layers.
fn geoids(options: &BuildOptions) -> Result<Option<[Geoid; 2]>, IngestError> {
    if options.datum == Datum::Ellipsoid {
        return Ok(None);
    }
    if let Some(path) = &options.geoid {
        return Ok(Some([Geoid::from_gtx(path)?, Geoid::from_gtx(path)?]));
    }
    let spaced = |spacing| Geoid::egm96_spaced(spacing);
    Ok(Some([spaced(NodeSpacing::Arcmin15), spaced(NodeSpacing::Degree1)]))
}

/// What tiles are written from.
struct Desk<'a> {
    options: &'a BuildOptions,
    plans: &'a [Plan],
    spool: &'a Spool,
    /// For fine layers, and for coarse ones.
    geoids: Option<[Geoid; 2]>,
    stop: &'a AtomicBool,
}

impl Desk<'_> {
    fn write(
        &self,
        file: &File,
        sources: &[Source],
        stop: &AtomicBool,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<(ArchiveFacts, u64), IngestError> {
        let refused = |error| IngestError::Archive { path: self.options.output.clone(), error };
        let mut facts = self.facts();
        let keys = self.keys();
        if keys.is_empty() {
            return Err(IngestError::NoInput);
        }
        let writer = PmTilesWriter::new(TileType::Unknown).tile_compression(Compression::None);
        let mut writer = writer.create(file).map_err(refused)?;
        let (mut content, mut range_m) = (Chain::default(), [f64::MAX, f64::MIN]);
        let mut done = 0;
        for batch in keys.chunks(BATCH) {
            if stop.load(Ordering::Relaxed) {
                return Err(IngestError::Stopped);
            }
            let tiles: Result<Vec<_>, IngestError> = batch
                .par_iter()
                .map(|(_, key, layers)| {
                    let (tile, range_m) = self.tile(*key, layers)?;
                    let parent = self.parent(*key)?;
                    Ok((encode(&tile, parent.as_ref(), &facts), range_m))
                })
                .collect();
            for ((_, key, _), (bytes, tile_m)) in batch.iter().zip(tiles?) {
                add(&mut writer, *key, &bytes).map_err(refused)?;
                content.add(key.bits());
                digest(&mut content, &bytes);
                range_m = [range_m[0].min(tile_m[0]), range_m[1].max(tile_m[1])];
            }
            done += batch.len() as u64;
            progress(Progress::Writing(done, keys.len() as u64));
        }
        (facts.content, facts.height_range_m) = (content.0, range_m);
        let depth = self.plans.iter().map(|plan| plan.facts.depth).max().unwrap_or(0);
        writer.set_zoom_range(1, depth + 1);
        writer.set_metadata(to_json(&facts, self.of_sources(sources)));
        writer.finalize().map_err(refused)?;
        Ok((facts, keys.len() as u64))
    }

    fn facts(&self) -> ArchiveFacts {
        let (body_name, body) = self.options.body.clone();
        ArchiveFacts {
            version: FORMAT_VERSION,
            body_name,
            body,
            datum: self.options.datum,
            height_range_m: [0.0; 2],
            content: 0,
            layers: self.plans.iter().map(|plan| plan.facts.clone()).collect(),
        }
    }

    fn of_sources(&self, sources: &[Source]) -> serde_json::Value {
        let of = |source: &Source| {
            let grid = &source.raster.grid;
            serde_json::json!({
                "file": source.raster.name.file_name().map(|name| name.to_string_lossy()),
                "kind": source.raster.kind,
                "postings": [grid.columns, grid.rows],
                "spacing_m": source.spacing_m,
                "range_m": source.survey.range_m,
                "voids": source.survey.voids,
                "level": 2 * (source.depth + PAGE_BITS),
            })
        };
        sources.iter().map(of).collect()
    }

    /// All tiles in the order of the archive, each with its layers and whether they hold data.
    fn keys(&self) -> Vec<(TileId, PageKey, Vec<u8>)> {
        let mut all: BTreeMap<PageKey, Vec<u8>> = BTreeMap::new();
        for (layer, plan) in (0..).zip(self.plans) {
            for depth in 0..=plan.facts.depth {
                let keys = self.spool.keys(layer, depth);
                let beside = ring(&keys);
                keys.into_iter()
                    .chain(beside)
                    .for_each(|key| all.entry(key).or_default().push(layer));
            }
        }
        let with_id = |(key, layers): (PageKey, Vec<u8>)| (TileId::from(coord(key)), key, layers);
        let mut keys: Vec<_> = all.into_iter().map(with_id).collect();
        keys.sort_by_key(|(id, ..)| *id);
        keys
    }

    /// A tile, and the range of its surface above the ellipsoid in metres.
    fn tile(&self, key: PageKey, layers: &[u8]) -> Result<(Tile, [f64; 2]), IngestError> {
        let mut tile = Tile { key, layers: Vec::new() };
        let mut range_m = [f64::MAX, f64::MIN];
        for &layer in layers {
            let failed = |error| IngestError::Output { path: self.options.output.clone(), error };
            let record = self.spool.get(layer, key).map_err(failed)?;
            let record = record.unwrap_or_else(bytemuck::zeroed_box::<Record>);
            let plan = &self.plans[usize::from(layer)].facts;
            let height_m = |i: usize, j: usize| {
                f64::from(record.quanta[0][j * PAGE_SIDE + i]) * plan.quantum_m
            };
            let roughness: &[u8; MARKS] = &record.roughness[0];
            let sea_level = self.sea_level(key, plan, &record)?;
            let [low, high] = [sea_level.iter().min(), sea_level.iter().max()]
                .map(|level| f64::from(level.copied().unwrap_or(0)) * SEA_LEVEL_UNIT_M);
            for at in (0..SAMPLES).filter(|&at| record.weights[0][at] > 0) {
                let own_m = f64::from(record.quanta[0][at]) * plan.quantum_m;
                range_m = [range_m[0].min(own_m + low), range_m[1].max(own_m + high)];
            }
            let marks = marks(self.spool, layer, key, roughness, height_m).map_err(failed)?;
            let full = record.weights[0].iter().all(|&weight| weight == FULL);
            let whole = record.filled[0].iter().all(|&filled| filled == 0);
            tile.layers.push(LayerTile {
                layer,
                quanta: Box::new(record.quanta[0]),
                weights: (!full).then(|| Box::new(record.weights[0])),
                filled: (!whole).then(|| Box::new(record.filled[0].map(|filled| filled == 1))),
                sea_level,
                marks,
            });
        }
        Ok((tile, range_m))
    }

    /// What a tile's coding takes from the tile above it: samples and weights.
    fn parent(&self, key: PageKey) -> Result<Option<Tile>, IngestError> {
        let Some(above) = key.parent() else { return Ok(None) };
        let mut parent = Tile { key: above, layers: Vec::new() };
        for (layer, plan) in (0..).zip(self.plans) {
            if key.depth() > plan.facts.depth {
                continue;
            }
            let failed = |error| IngestError::Output { path: self.options.output.clone(), error };
            let Some(record) = self.spool.get(layer, above).map_err(failed)? else { continue };
            parent.layers.push(LayerTile {
                layer,
                quanta: Box::new(record.quanta[0]),
                weights: Some(Box::new(record.weights[0])),
                filled: Some(Box::new(record.filled[0].map(|filled| filled == 1))),
                sea_level: Vec::new(),
                marks: Box::new([Mark::default(); MARKS]),
            });
        }
        Ok(Some(parent))
    }

    /// Sea level where the layer is seen; elsewhere whatever costs least.
    fn sea_level(
        &self,
        key: PageKey,
        layer: &LayerFacts,
        record: &Record,
    ) -> Result<Vec<i32>, IngestError> {
        let Some([fine, coarse]) = &self.geoids else { return Ok(Vec::new()) };
        let geoid = if layer.spacing_m < COARSE_M { fine } else { coarse };
        let grid = sea_level_grid(layer.depth);
        if record.weights[0].iter().all(|&weight| weight == 0) {
            return Ok(Vec::new());
        }
        let side = sea_level_side(key.depth(), grid);
        let cell = (key.side() >> (side - 1).ilog2()).max(RADIUS >> grid);
        let (u0, v0) = key.origin();
        let (u0, v0) = (u0 / cell * cell, v0 / cell * cell);
        let mut levels: Vec<Option<i32>> = vec![None; side * side];
        let samples = (PAGE_SIDE - 1) / (side - 1);
        let along = |at: usize| i32::try_from(at).expect("at most 65") * cell;
        let corners = (0..SAMPLES).filter(|&at| record.weights[0][at] > 0).flat_map(|at| {
            let [i, j] = [at % PAGE_SIDE, at / PAGE_SIDE].map(|at| (at / samples).min(side - 2));
            [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
        });
        for (i, j) in corners {
            let level = &mut levels[j * side + i];
            if level.is_some() {
                continue;
            }
            // Harmonics take a millisecond each, so a stop is heard here too.
            if self.stop.load(Ordering::Relaxed) {
                return Err(IngestError::Stopped);
            }
            let point = fold(key.quadrant(), u0 + along(i), v0 + along(j));
            *level = Some(level_at(geoid, point)?);
        }
        let mut before = levels.iter().flatten().next().copied().unwrap_or(0);
        let mut known = |level: Option<i32>| {
            before = level.unwrap_or(before);
            before
        };
        Ok(levels.into_iter().map(&mut known).collect())
    }
}

/// Sea level at a lattice point, in its unit.
fn level_at(geoid: &Geoid, point: IVec3) -> Result<i32, IngestError> {
    let [lon_rad, lat_rad] = lon_lat_of(normal_of(point));
    let level_m = geoid.undulation_m(lat_rad, lon_rad);
    if level_m.is_nan() {
        return Err(IngestError::GeoidLacks { lat_rad, lon_rad });
    }
    #[expect(clippy::cast_possible_truncation, reason = "undulations are below 120 m")]
    let level = (level_m / SEA_LEVEL_UNIT_M).round() as i32;
    Ok(level)
}

/// Adds bytes, eight at a time.
fn digest(content: &mut Chain, bytes: &[u8]) {
    for part in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..part.len()].copy_from_slice(part);
        content.add(u64::from_le_bytes(word));
    }
}

pub(crate) fn coord(key: PageKey) -> TileCoord {
    let (z, x, y) = key.zxy();
    TileCoord::new(z, x, y).expect("a page is a tile")
}

pub(crate) fn add(
    writer: &mut PmTilesStreamWriter<&File>,
    key: PageKey,
    bytes: &[u8],
) -> pmtiles::PmtResult<()> {
    writer.add_tile(coord(key), bytes)
}

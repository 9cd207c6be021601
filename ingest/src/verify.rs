//! An archive held against its sources, posting by posting.
//!
//! In:    a finished archive, read back; the options that it was built with.
//! Out:   the difference of its surface to every posting that is seen: rms, 99 %, greatest.
//! Keeps: nothing.
//! Not here: building (`build`).
//!
//! The surface at a posting is that of the archive's own level there: linear over the triangle of
//! the even lattice level that its layer ends with, found anew from latitude and longitude.

use crate::build::{BuildOptions, Plan, Progress, Source, layer, plans, sources};
use crate::fault::IngestError;
use lru::LruCache;
use overfly_archive::{Archive, Location, OpenOptions};
use overfly_core::datasource::codec::decode;
use overfly_core::datasource::key::PAGE_BITS;
use overfly_core::datasource::tile::{FULL, LayerTile, Tile};
use overfly_core::datasource::{PAGE_SIDE, PageKey};
use overfly_core::geodesy::Geodetic;
use parking_lot::Mutex;
use rayon::prelude::*;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Differences are counted in bins of this width.
const BIN_M: f64 = 0.01;
const BINS: usize = 100_000;
/// Postings along a side of what is looked at at once.
const PART: u32 = 256;
/// Decoded tiles kept.
const TILES: usize = 1024;

/// How one source differs from the archive.
#[derive(Clone, Debug)]
pub struct Difference {
    /// The source.
    pub name: PathBuf,
    /// Lattice level of the surface that was compared.
    pub level: u8,
    /// Postings compared.
    pub compared: u64,
    /// Valid postings that something finer or more important hides.
    pub hidden: u64,
    /// Root of the mean square. Metres.
    pub rms_m: f64,
    /// 99 of 100 are below. Metres, to 1 cm.
    pub p99_m: f64,
    /// The greatest. Metres.
    pub max_m: f64,
}

/// Sums of one part.
struct Sums {
    squares: f64,
    max_m: f64,
    compared: u64,
    hidden: u64,
    bins: Vec<u64>,
}

type Planes = LruCache<(PageKey, u8), Option<Arc<LayerTile>>>;

struct Reader<'a> {
    archive: &'a Archive,
    tiles: Mutex<LruCache<PageKey, Option<Arc<Tile>>>>,
    planes: Mutex<Planes>,
}

/// An archive, and what it was built from.
struct Comparison<'a> {
    reader: Reader<'a>,
    sources: &'a [Source],
    plans: &'a [Plan],
}

/// Compares an archive with what it was built from.
///
/// # Errors
/// If the archive or a source cannot be read.
pub fn verify(
    options: &BuildOptions,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Difference>, IngestError> {
    let location = Location::File(options.output.clone());
    let archive =
        Archive::open(&location, &OpenOptions::default()).map_err(IngestError::ReadBack)?;
    let sources = sources(options, stop, &|_| {})?;
    let plans = plans(options, &sources)?;
    let size = NonZeroUsize::new(TILES).expect("more than none");
    let reader = Reader {
        archive: &archive,
        tiles: Mutex::new(LruCache::new(size)),
        planes: Mutex::new(LruCache::new(size)),
    };
    let comparison = Comparison { reader, sources: &sources, plans: &plans };
    let total = sources.iter().map(|source| parts(source).len() as u64).sum();
    let done = AtomicU64::new(0);
    let compare = |plan: usize, source: usize, first: [u32; 2]| {
        if stop.load(Ordering::Relaxed) {
            return Err(IngestError::Stopped);
        }
        let sums = comparison.part(plan, source, first)?;
        progress(Progress::Comparing(done.fetch_add(1, Ordering::Relaxed) + 1, total));
        Ok(sums)
    };
    let mut differences = Vec::new();
    for (index, plan) in plans.iter().enumerate() {
        for &source in &plan.sources {
            let parts = parts(&sources[source]);
            let sums = parts.par_iter().map(|&first| compare(index, source, first));
            let sums: Result<Vec<_>, IngestError> = sums.collect();
            differences.push(difference(&sources[source], plan, sums?));
        }
    }
    Ok(differences)
}

/// First column and row of all parts of a source, row by row.
fn parts(source: &Source) -> Vec<[u32; 2]> {
    let grid = &source.raster.grid;
    let starts = |end: u32| (0..end.div_ceil(PART)).map(|part| part * PART);
    starts(grid.rows).flat_map(|y| starts(grid.columns).map(move |x| [x, y])).collect()
}

fn difference(source: &Source, plan: &Plan, parts: Vec<Sums>) -> Difference {
    let mut whole = Sums::none();
    for part in parts {
        whole.squares += part.squares;
        whole.max_m = whole.max_m.max(part.max_m);
        whole.compared += part.compared;
        whole.hidden += part.hidden;
        whole.bins.iter_mut().zip(part.bins).for_each(|(bin, more)| *bin += more);
    }
    let mut left = whole.compared / 100;
    let last = whole.bins.iter().rposition(|&count| {
        let is_last = count > left;
        left = left.saturating_sub(count);
        is_last
    });
    Difference {
        name: source.raster.name.clone(),
        level: 2 * (plan.facts.depth + PAGE_BITS),
        compared: whole.compared,
        hidden: whole.hidden,
        rms_m: (whole.squares / (whole.compared.max(1)) as f64).sqrt(),
        p99_m: last.map_or(0.0, |bin| (bin + 1) as f64 * BIN_M),
        max_m: whole.max_m,
    }
}

impl Comparison<'_> {
    /// Compares one part of a source with the layer of one plan.
    fn part(&self, plan: usize, source: usize, first: [u32; 2]) -> Result<Sums, IngestError> {
        let raster = &self.sources[source].raster;
        let grid = &raster.grid;
        let width = PART.min(grid.columns - first[0]) as usize;
        let height = PART.min(grid.rows - first[1]) as usize;
        let mut heights_m = Vec::new();
        raster.window(first[0].into(), first[1].into(), width, height, &mut heights_m)?;
        let layers: Vec<_> =
            self.plans[plan..].iter().map(|plan| layer(plan, self.sources)).collect();
        let own = self.plans[plan].sources.iter().position(|&index| index == source);
        let own = own.expect("a plan's own source");
        let mut sums = Sums::none();
        for (at, height_m) in heights_m.iter().enumerate().filter(|(_, height)| !height.is_nan()) {
            let column = f64::from(first[0]) + (at % width) as f64;
            let row = f64::from(first[1]) + (at / width) as f64;
            let at = grid.lon_lat(column, row);
            let covered = layers[1..].iter().any(|finer| finer.is_seen(at));
            if covered || !layers[0].shows(own, at) {
                sums.hidden += 1;
                continue;
            }
            match self.reader.surface_m(&self.plans[plan], plan, at)? {
                Some(surface_m) => sums.add((surface_m - f64::from(*height_m)).abs()),
                None => sums.hidden += 1,
            }
        }
        Ok(sums)
    }
}

impl Sums {
    fn none() -> Self {
        Self { squares: 0.0, max_m: 0.0, compared: 0, hidden: 0, bins: vec![0; BINS] }
    }

    fn add(&mut self, off_m: f64) {
        self.compared += 1;
        self.squares += off_m * off_m;
        self.max_m = self.max_m.max(off_m);
        #[expect(clippy::cast_possible_truncation, reason = "capped to the last bin")]
        #[expect(clippy::cast_sign_loss, reason = "never negative")]
        let bin = ((off_m / BIN_M) as usize).min(BINS - 1);
        self.bins[bin] += 1;
    }
}

impl Reader<'_> {
    /// Height of a layer's last level above the datum; `None` where it has less than full weight.
    fn surface_m(
        &self,
        plan: &Plan,
        layer: usize,
        [lon_rad, lat_rad]: [f64; 2],
    ) -> Result<Option<f64>, IngestError> {
        let n = Geodetic { lat_rad, lon_rad, height_m: 0.0 }.normal();
        let depth = plan.facts.depth;
        let across = f64::from(1_u32 << depth) * (PAGE_SIDE - 1) as f64;
        let sum = n.x.abs() + n.y.abs() + n.z.abs();
        let [x, y] = [n.x.abs() / sum * across, n.y.abs() / sum * across];
        let [u, v] = if n.z >= 0.0 { [x, y] } else { [across - y, across - x] };
        let quadrant = match (n.x >= 0.0, n.y >= 0.0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        let side = PAGE_SIDE - 1;
        #[expect(clippy::cast_possible_truncation, reason = "within the quadrant")]
        #[expect(clippy::cast_sign_loss, reason = "never negative")]
        let cell = |at: f64| (at as usize).min((side << depth) - 1);
        let (i, j) = (cell(u), cell(v));
        let tile_at = |at: usize| u32::try_from(at / side).expect("below 2^23");
        let key = PageKey::new(quadrant, depth, tile_at(i), tile_at(j));
        let Some(tile) = self.plane(key, u8::try_from(layer).expect("16 layers"))? else {
            return Ok(None);
        };
        let (a, b) = (u - i as f64, v - j as f64);
        let at = |di: usize, dj: usize| {
            let at = (j % side + dj) * PAGE_SIDE + i % side + di;
            (tile.weight(at) == FULL).then(|| f64::from(tile.quanta[at]) * plan.facts.quantum_m)
        };
        let corners = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        let (Some(p), Some(q), Some(r), Some(s)) = corners else { return Ok(None) };
        // The diagonal joins the corner with both indices odd and the one with both even.
        let height_m = if i % 2 == j % 2 {
            if a >= b { p + (q - p) * a + (s - q) * b } else { p + (r - p) * b + (s - r) * a }
        } else if a + b <= 1.0 {
            p + (q - p) * a + (r - p) * b
        } else {
            s + (r - s) * (1.0 - a) + (q - s) * (1.0 - b)
        };
        Ok(Some(height_m))
    }

    fn plane(&self, key: PageKey, layer: u8) -> Result<Option<Arc<LayerTile>>, IngestError> {
        if let Some(plane) = self.planes.lock().get(&(key, layer)) {
            return Ok(plane.clone());
        }
        let tile = self.tile(key)?;
        let own = |plane: &&LayerTile| plane.layer == layer;
        let plane = tile.and_then(|tile| tile.layers.iter().find(own).cloned().map(Arc::new));
        self.planes.lock().put((key, layer), plane.clone());
        Ok(plane)
    }

    /// A tile, decoded over its parent.
    fn tile(&self, key: PageKey) -> Result<Option<Arc<Tile>>, IngestError> {
        if let Some(tile) = self.tiles.lock().get(&key) {
            return Ok(tile.clone());
        }
        let bytes = self.archive.tile(key).map_err(IngestError::ReadBack)?;
        let tile = match bytes {
            None => None,
            Some(bytes) => {
                let parent = key.parent().map(|parent| self.tile(parent)).transpose()?.flatten();
                let tile = decode(&bytes, key, parent.as_deref(), self.archive.facts());
                Some(Arc::new(tile.map_err(|fault| IngestError::Tile { key, fault })?))
            }
        };
        self.tiles.lock().put(key, tile.clone());
        Ok(tile)
    }
}

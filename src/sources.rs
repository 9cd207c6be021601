//! Where a scene's pages come from: its open archives, their tiles and imagery, the generator.
//!
//! In:    the settings of a scene; page keys.
//! Out:   pages, with colour or without; which level the data has at a place; why there is no page.
//! Keeps: open archives, decoded tiles of bounded size, shared by all threads.
//! Not here: threads (`loader`), reading archives (`overfly_archive`), heights (`overfly_core`).

use crate::archive::{Archive, ArchiveError, Imagery, Location, OpenOptions};
use crate::core::datasource::codec::{TileFault, decode};
use crate::core::datasource::colour::lay_over;
use crate::core::datasource::compose::{Need, cell_of};
use crate::core::datasource::generate::Generator;
use crate::core::datasource::key::{DEPTH_MAX, PAGE_BITS};
use crate::core::datasource::page::SAMPLES;
use crate::core::datasource::tile::{FULL, LayerTile, Tile};
use crate::core::datasource::{ColourTile, Page, PageKey};
use crate::core::geodesy::{Ellipsoid, Geodetic};
use crate::core::ground::{Place, Query};
use crate::core::lattice::RADIUS;
use crate::core::settings::SceneSettings;
use glam::IVec3;
use lru::LruCache;
use parking_lot::Mutex;
use std::fmt;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Decoded tiles are kept up to this size together.
const TILES_BYTES_MAX: usize = 64 << 20;

/// Tiles of imagery are kept so many, 65 KiB each: those that finer tiles of other archives lie
/// over.
const COLOURS_MAX: NonZeroUsize = NonZeroUsize::new(128).expect("more than none");

/// Bodies whose radii and flattening differ by no more than this share are the same.
const BODY_TOLERANCE: f64 = 1e-9;

/// Everything that the pages of one scene are made from.
pub struct Sources {
    generator: Generator,
    archives: Vec<Archive>,
    /// The topmost first.
    imagery: Vec<Imagery>,
    tiles: Mutex<Tiles>,
    colours: Mutex<Colours>,
    body: Ellipsoid,
    sea: bool,
}

/// Tiles of imagery, and that there is none, by archive and key: the ones used last.
type Colours = LruCache<(usize, PageKey), Option<Arc<ColourTile>>>;

/// Decoded tiles, and that there is none: the ones used last.
struct Tiles {
    recent: LruCache<(usize, PageKey), Option<Arc<Tile>>>,
    bytes: usize,
}

/// Why a source cannot be used, or a page cannot be made.
#[derive(Debug)]
pub enum SourceError {
    /// An archive cannot be opened, or a tile cannot be had.
    Archive(ArchiveError),
    /// An archive is of another body than the scene.
    Body {
        /// Path or address.
        archive: String,
        /// The archive's body, as it calls it.
        found_name: String,
        /// The archive's body.
        found: Ellipsoid,
        /// The scene's.
        wanted: Ellipsoid,
    },
    /// A tile arrived and is none.
    Tile {
        /// Path or address.
        archive: String,
        /// Which tile.
        key: PageKey,
        /// What is wrong with it.
        fault: TileFault,
    },
    /// Making the page panicked: a bug of ours.
    Panic {
        /// Which page.
        key: PageKey,
        /// What the panic said.
        message: String,
    },
}

impl SourceError {
    /// Path or address of the archive that is to blame, if one is.
    pub fn archive(&self) -> Option<&str> {
        match self {
            Self::Archive(ArchiveError { archive, .. })
            | Self::Body { archive, .. }
            | Self::Tile { archive, .. } => Some(archive),
            Self::Panic { .. } => None,
        }
    }
}

impl fmt::Display for SourceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Archive(error) => error.fmt(f),
            Self::Body { archive, found_name, found, wanted } => write!(
                f,
                "archive {archive}: it is of the body {found_name} (a = {:?} m, f = {:?}), but the \
                 scene's body has a = {:?} m, f = {:?}",
                found.a_m, found.f, wanted.a_m, wanted.f
            ),
            Self::Tile { archive, key, fault } => {
                let (z, x, y) = key.zxy();
                write!(f, "archive {archive}: tile {z}/{x}/{y}: {fault}")
            }
            Self::Panic { key, message } => write!(f, "page {key:?} cannot be made: {message}"),
        }
    }
}

impl std::error::Error for SourceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Archive(error) => error.source(),
            Self::Tile { fault, .. } => Some(fault),
            Self::Body { .. } | Self::Panic { .. } => None,
        }
    }
}

impl Sources {
    /// Opens the archives of a scene; `options` are for those on servers. Blocks.
    ///
    /// # Errors
    /// An archive that cannot be opened, or is of another body than the scene.
    pub fn open(settings: &SceneSettings, options: &OpenOptions) -> Result<Self, SourceError> {
        let body = settings.body;
        let archives: Vec<_> =
            settings.archives().map(|name| open(name, &body, options)).collect::<Result<_, _>>()?;
        let imagery = settings.imagery.iter().map(|name| open_imagery(name, &body, options));
        let imagery = imagery.collect::<Result<_, _>>()?;
        let facts = archives.iter().map(|archive| archive.facts().clone()).collect();
        Ok(Self {
            generator: Generator::with_archives(settings, facts),
            archives,
            imagery,
            tiles: Mutex::new(Tiles { recent: LruCache::unbounded(), bytes: 0 }),
            colours: Mutex::new(LruCache::new(COLOURS_MAX)),
            body,
            sea: settings.sea,
        })
    }

    /// The generator that turns tiles into pages.
    pub fn generator(&self) -> &Generator {
        &self.generator
    }

    /// The open archives, in the scene's order: names, facts and how they have fared.
    pub fn archives(&self) -> &[Archive] {
        &self.archives
    }

    /// The open archives of imagery, in the scene's order.
    pub fn imagery(&self) -> &[Imagery] {
        &self.imagery
    }

    /// The scene's body.
    pub fn body(&self) -> &Ellipsoid {
        &self.body
    }

    /// Whether water covers the ground below sea level.
    pub fn sea(&self) -> bool {
        self.sea
    }

    /// Hashes of what the archives hold, in the scene's order: those of elevation, then those of
    /// imagery.
    pub fn contents(&self) -> Vec<u64> {
        let elevation = self.archives.iter().map(|archive| archive.facts().content);
        elevation.chain(self.imagery.iter().map(|archive| archive.facts().content)).collect()
    }

    /// Makes a page, without colour. Blocks while tiles are read.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn page(&self, key: PageKey) -> Result<Arc<Page>, SourceError> {
        self.page_with(key, None)
    }

    /// Makes a page without normals and bounds, for who reads heights alone: see
    /// [`Generator::bare_page_from`]. Blocks while tiles are read.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn bare_page(&self, key: PageKey) -> Result<Arc<Page>, SourceError> {
        Ok(self.generator.bare_page_from(key, &self.tiles(key)?))
    }

    /// Makes a page with its colour. Where imagery cannot be had the page comes without any, for
    /// the ground must not wait for it, and why comes with it. Blocks while tiles are read.
    ///
    /// # Errors
    /// A tile of elevation cannot be had or is damaged.
    pub fn coloured_page(
        &self,
        key: PageKey,
    ) -> Result<(Arc<Page>, Option<SourceError>), SourceError> {
        let (colour, fault) = match self.colour(key) {
            Ok(colour) => (colour, None),
            Err(error) => (None, Some(error)),
        };
        Ok((self.page_with(key, colour)?, fault))
    }

    /// The imagery of a page's cell, all archives over each other: the first that shows anything at
    /// a texel hides the others there. `None` where no archive has a tile of exactly this cell.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn colour(&self, key: PageKey) -> Result<Option<Arc<ColourTile>>, SourceError> {
        let deepest = |archive: &Imagery| archive.facts().depth;
        if self.imagery.iter().all(|archive| deepest(archive) < key.depth()) {
            return Ok(None);
        }
        let mut exact = false;
        let mut all: Option<Arc<ColourTile>> = None;
        for (index, archive) in self.imagery.iter().enumerate() {
            let reached = deepest(archive) >= key.depth();
            let tile = if reached {
                archive.colour(key).map_err(SourceError::Archive)?.map(Arc::new)
            } else {
                self.coarser_colour(index, key)?
            };
            let Some(tile) = tile else { continue };
            exact |= reached;
            all = Some(all.map_or_else(|| tile.clone(), |upper| laid_over(&upper, &tile)));
            if all.iter().all(|all| all.rgba.iter().all(|texel| texel[3] == u8::MAX)) {
                break;
            }
        }
        Ok(all.filter(|_| exact))
    }

    /// What an archive whose last tiles are coarser shows in a cell.
    fn coarser_colour(
        &self,
        index: usize,
        key: PageKey,
    ) -> Result<Option<Arc<ColourTile>>, SourceError> {
        let archive = &self.imagery[index];
        let above = key.ancestor(archive.facts().depth);
        let known = self.colours.lock().get(&(index, above)).cloned();
        let tile = match known {
            Some(tile) => tile,
            None => {
                let tile = archive.colour(above).map_err(SourceError::Archive)?.map(Arc::new);
                self.colours.lock().put((index, above), tile.clone());
                tile
            }
        };
        let within = |tile: Arc<ColourTile>| {
            let texels = tile.texels_of(key);
            let shows = texels.iter().any(|texel| texel[3] > 0);
            shows.then(|| Arc::new(ColourTile::new(key, texels)))
        };
        Ok(tile.and_then(within))
    }

    fn page_with(
        &self,
        key: PageKey,
        colour: Option<Arc<ColourTile>>,
    ) -> Result<Arc<Page>, SourceError> {
        Ok(self.generator.page_with(key, &self.tiles(key)?, colour))
    }

    /// The tiles that a page is made from.
    fn tiles(&self, key: PageKey) -> Result<Vec<Option<Arc<Tile>>>, SourceError> {
        let needs = self.generator.needs(key);
        needs.into_iter().map(|Need { archive, key }| self.tile(archive, key)).collect()
    }

    /// Height of the ground itself above the ellipsoid, at the lattice point next to a place.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn ground_m(&self, at: Geodetic) -> Result<f64, SourceError> {
        let normal = at.normal();
        let whole = f64::from(RADIUS);
        let [x, y, z] = normal.to_array();
        let scale = whole / (x.abs() + y.abs() + z.abs());
        // Even coordinates, as all vertices have; the third follows from the other two.
        #[expect(clippy::cast_possible_truncation, reason = "within the octahedron")]
        let even = |part: f64| (part * scale / 2.0).round() as i32 * 2;
        let (x, y) = (even(x), even(y));
        let rest = (RADIUS - x.abs() - y.abs()).max(0);
        let x = if x.abs() + y.abs() > RADIUS { x.signum() * (RADIUS - y.abs()) } else { x };
        let point = IVec3::new(x, y, if z < 0.0 { -rest } else { rest });
        let key = cell_of(point, DEPTH_MAX);
        Ok(self.generator.ground_m(key, point, &self.tiles(key)?))
    }

    /// Level of the finest data that is seen at a place; `None` where no archive has any.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn data_level(&self, place: Place) -> Result<Option<u8>, SourceError> {
        let mut finest = None;
        let layers = self.archives.iter().enumerate().flat_map(|(archive, open)| {
            let layers = open.facts().layers.iter().enumerate().rev();
            layers.map(move |(index, layer)| (archive, index, layer.depth))
        });
        for (archive, index, depth) in layers {
            let [least, most] = self.weights((archive, index), place, depth)?;
            finest = if most > 0 { finest.max(Some(level_of(depth))) } else { finest };
            if least == FULL {
                break;
            }
        }
        Ok(finest)
    }

    /// Least and greatest weight of a layer at the corners of the last triangle around a place.
    fn weights(
        &self,
        (archive, index): (usize, usize),
        place: Place,
        depth: u8,
    ) -> Result<[u8; 2], SourceError> {
        let key = place.page(depth);
        let tile = self.tile(archive, key)?;
        let of_layer = |layer: &&LayerTile| usize::from(layer.layer) == index;
        let Some(layer) = tile.as_ref().and_then(|tile| tile.layers.iter().find(of_layer)) else {
            return Ok([0, 0]);
        };
        let (cell, corners, _) = place.triangle(level_of(depth));
        let [a, b, c] = corners.map(|corner| layer.weight(cell.sample(key, corner)));
        Ok([a.min(b).min(c), a.max(b).max(c)])
    }

    /// The level at which samples of the procedural planet are about 1 m apart.
    pub fn procedural_level(&self) -> u8 {
        let side_m = core::f64::consts::FRAC_PI_2 * self.body.a_m;
        let mut level = level_of(0);
        while level < crate::core::ground::LEVEL_MAX
            && side_m / f64::from(1_u32 << (level / 2)) > core::f64::consts::SQRT_2
        {
            level += 2;
        }
        level
    }

    /// What asks for the best there is at a place: the finest data, or the procedural planet.
    ///
    /// # Errors
    /// A tile cannot be had or is damaged.
    pub fn best(&self, place: Place) -> Result<Query, SourceError> {
        let level = self.data_level(place)?;
        Ok(Query::Exact(level.unwrap_or_else(|| self.procedural_level())))
    }

    /// From now on archives on servers give no tile: whoever waits for one gives up. For a host
    /// that wants to end while a server is silent.
    pub fn close(&self) {
        self.archives.iter().for_each(Archive::close);
        self.imagery.iter().for_each(Imagery::close);
    }

    fn tile(&self, archive: usize, key: PageKey) -> Result<Option<Arc<Tile>>, SourceError> {
        if let Some(known) = self.tiles.lock().recent.get(&(archive, key)) {
            return Ok(known.clone());
        }
        // Outside the lock: two threads may read the same tile, and none waits for another's.
        let open = &self.archives[archive];
        let bytes = open.tile(key).map_err(SourceError::Archive)?;
        let tile = match bytes {
            None => None,
            Some(bytes) => {
                // What the parent holds already is not in the bytes.
                let parent = key.parent().map(|parent| self.tile(archive, parent)).transpose()?;
                let tile = decode(&bytes, key, parent.flatten().as_deref(), open.facts());
                let damaged = |fault| {
                    let archive = open.name().to_owned();
                    SourceError::Tile { archive, key, fault }
                };
                Some(Arc::new(tile.map_err(damaged)?))
            }
        };
        self.tiles.lock().put((archive, key), tile.clone());
        Ok(tile)
    }
}

impl Tiles {
    fn put(&mut self, key: (usize, PageKey), tile: Option<Arc<Tile>>) {
        self.bytes += bytes_of(tile.as_deref());
        if let Some(old) = self.recent.put(key, tile) {
            self.bytes -= bytes_of(old.as_deref());
        }
        while self.bytes > TILES_BYTES_MAX
            && let Some((_, old)) = self.recent.pop_lru()
        {
            self.bytes -= bytes_of(old.as_deref());
        }
    }
}

/// The lattice level of data whose last pages have this depth: the finest that these serve.
pub fn level_of(depth: u8) -> u8 {
    2 * (PAGE_BITS + depth)
}

/// Bytes that a decoded tile takes, or the note that there is none.
fn bytes_of(tile: Option<&Tile>) -> usize {
    const NOTE: usize = 128;
    let layer = |layer: &LayerTile| {
        let planes = 4 + usize::from(layer.weights.is_some()) + usize::from(layer.filled.is_some());
        size_of::<LayerTile>()
            + planes * SAMPLES
            + size_of_val(&*layer.marks)
            + size_of_val(&layer.sea_level[..])
    };
    NOTE + tile.map_or(0, |tile| tile.layers.iter().map(layer).sum())
}

fn laid_over(upper: &ColourTile, lower: &ColourTile) -> Arc<ColourTile> {
    let mut rgba = upper.rgba.clone();
    lay_over(&mut rgba, &lower.rgba);
    Arc::new(ColourTile::new(upper.key, rgba))
}

fn open(name: &str, wanted: &Ellipsoid, options: &OpenOptions) -> Result<Archive, SourceError> {
    let archive = Archive::open(&Location::parse(name), options).map_err(SourceError::Archive)?;
    let facts = archive.facts();
    check_body(name, (&facts.body_name, facts.body), wanted)?;
    Ok(archive)
}

fn open_imagery(
    name: &str,
    wanted: &Ellipsoid,
    options: &OpenOptions,
) -> Result<Imagery, SourceError> {
    let archive = Imagery::open_imagery(&Location::parse(name), options);
    let archive = archive.map_err(SourceError::Archive)?;
    let facts = archive.facts();
    check_body(name, (&facts.body_name, facts.body), wanted)?;
    Ok(archive)
}

fn check_body(
    name: &str,
    (found_name, found): (&str, Ellipsoid),
    wanted: &Ellipsoid,
) -> Result<(), SourceError> {
    let like = |a: f64, b: f64| (a - b).abs() <= BODY_TOLERANCE * a.abs().max(b.abs());
    if like(found.a_m, wanted.a_m) && like(found.f, wanted.f) {
        return Ok(());
    }
    let (archive, found_name) = (name.to_owned(), found_name.to_owned());
    Err(SourceError::Body { archive, found_name, found, wanted: *wanted })
}

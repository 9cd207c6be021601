//! A host for tests: builds archives, makes a scene's pages from them, one by one.
//!
//! In:    what to build, which scene.
//! Out:   pages, grounds, places.
//! Keeps: open archives, decoded tiles, pages.
//! Not here: what is asserted.

use glam::{DVec3, IVec3};
use overfly_archive::{Archive, Location, OpenOptions};
use overfly_core::datasource::codec::decode;
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::procedural::Style;
use overfly_core::datasource::tile::Tile;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::digest::mix;
use overfly_core::geodesy::trig::{atan2, hypot};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::ground::{Ground, Place};
use overfly_core::lattice::{fold, normal_of};
use overfly_core::settings::{
    DepthFormat, DepthOrder, DepthSettings, LodSettings, MemorySettings, SceneSettings,
    SourceSettings, VertexPrecision,
};
use overfly_core::units::Pixels;
use overfly_ingest::{BuildOptions, Difference, IngestError, Report};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Pages kept at most.
const PAGES: usize = 1500;

/// Builds, with nobody to stop it.
pub fn build(options: &BuildOptions) -> Result<Report, IngestError> {
    overfly_ingest::build(options, &AtomicBool::new(false), &|_| {})
}

/// Compares with the sources.
pub fn verify(options: &BuildOptions) -> Vec<Difference> {
    overfly_ingest::verify(options, &AtomicBool::new(false), &|_| {}).unwrap()
}

/// A number in [0, 1) that looks random.
pub fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Which scene.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Depth of patches.
    pub patch_depth: u8,
    /// Whether there is water.
    pub sea: bool,
    /// Strength of the detail; `None`: no procedural source at all.
    pub detail: Option<f64>,
    /// The body.
    pub body: Ellipsoid,
}

/// The Earth with a sea, a planet beneath and detail below.
pub const EARTH: Scene =
    Scene { patch_depth: 4, sea: true, detail: Some(1.0), body: Ellipsoid::WGS84 };

impl Scene {
    fn settings(&self, archives: usize) -> SceneSettings {
        let archive = |at: usize| SourceSettings::Archive { location: format!("{at}.pmtiles") };
        let mut sources: Vec<_> = (0..archives).map(archive).collect();
        sources.extend(self.detail.map(|detail| SourceSettings::Procedural {
            seed: 1,
            style: if self.sea { Style::Earthlike } else { Style::Cratered },
            relief: 1.0,
            finest_m: 0.2,
            detail,
        }));
        SceneSettings {
            body: self.body,
            sources,
            lod: LodSettings {
                tolerance: Pixels(2.0),
                triangles_max: 100_000,
                patch_depth: self.patch_depth,
                splits_max: 400,
                merges_max: 400,
                level_max: 48,
                wanted_max: 64,
                morph_s: 0.0,
            },
            views: vec![],
            depth: DepthSettings {
                format: DepthFormat::D32F,
                order: DepthOrder::Reversed,
                splits_m: vec![30.0, 1e4],
            },
            vertices: VertexPrecision::TwoFloat,
            imagery: Vec::new(),
            memory: MemorySettings { pages_bytes: 64 << 20 },
            sea: self.sea,
            sun: None,
        }
    }
}

/// Tiles by archive and key; none where the archive has none.
type Tiles = BTreeMap<(usize, PageKey), Option<Arc<Tile>>>;

/// Archives under a scene.
pub struct Atlas {
    /// Which scene.
    pub scene: Scene,
    archives: Vec<Archive>,
    generator: Generator,
    tiles: RefCell<Tiles>,
    pages: RefCell<BTreeMap<PageKey, Arc<Page>>>,
}

impl Atlas {
    /// Opens archives, the topmost first.
    pub fn open(paths: &[&Path], scene: Scene) -> Self {
        let open = |path: &&Path| {
            Archive::open(&Location::File(path.to_path_buf()), &OpenOptions::default()).unwrap()
        };
        let archives: Vec<_> = paths.iter().map(open).collect();
        let facts = archives.iter().map(|archive| archive.facts().clone()).collect();
        let generator = Generator::with_archives(&scene.settings(archives.len()), facts);
        Self { scene, archives, generator, tiles: RefCell::default(), pages: RefCell::default() }
    }

    /// Depth of the last level of the finest layer.
    pub fn depth(&self) -> u8 {
        let layers = self.generator.archives().iter().flat_map(|facts| &facts.layers);
        layers.map(|layer| layer.depth).max().unwrap()
    }

    /// A tile, decoded over its parent.
    pub fn tile(&self, archive: usize, key: PageKey) -> Option<Arc<Tile>> {
        if let Some(tile) = self.tiles.borrow().get(&(archive, key)) {
            return tile.clone();
        }
        let tile = self.archives[archive].tile(key).unwrap().map(|bytes| {
            let parent = key.parent().and_then(|parent| self.tile(archive, parent));
            let facts = self.archives[archive].facts();
            Arc::new(decode(&bytes, key, parent.as_deref(), facts).unwrap())
        });
        self.tiles.borrow_mut().insert((archive, key), tile.clone());
        tile
    }

    /// A page.
    pub fn page(&self, key: PageKey) -> Arc<Page> {
        if let Some(page) = self.pages.borrow().get(&key) {
            return page.clone();
        }
        let needs = self.generator.needs(key);
        let tiles: Vec<_> = needs.iter().map(|need| self.tile(need.archive, need.key)).collect();
        let page = self.generator.page_from(key, &tiles);
        let bare = self.generator.bare_page_from(key, &tiles);
        let last = page.heights_m.len() - 1;
        for at in [0, last / 3, last / 2, last] {
            let surface = |page: &Page| [page.surface_m(at, false), page.sea_level_m(at)];
            assert_eq!(surface(&bare), surface(&page), "sample {at} of {key:?}");
        }
        let mut pages = self.pages.borrow_mut();
        if pages.len() >= PAGES {
            pages.clear();
        }
        pages.insert(key, page.clone());
        page
    }

    /// A ground without pages.
    pub fn bare(&self) -> Ground {
        Ground::new(self.scene.body, self.scene.sea)
    }

    /// The ground with all pages around a place, down to some depth.
    pub fn ground(&self, at: Geodetic, depth: u8) -> Ground {
        let mut ground = self.bare();
        let place = Place::of(at.normal());
        (0..=depth).for_each(|depth| drop(ground.insert(self.page(place.page(depth)))));
        ground
    }

    /// The quantum of a layer of the topmost archive.
    pub fn quantum_m(&self, layer: usize) -> f64 {
        self.generator.archives()[0].layers[layer].quantum_m
    }
}

/// The even level that pages of a depth serve.
pub fn even(depth: u8) -> u8 {
    2 * (depth + 6)
}

/// A place in degrees.
pub fn at(lat_deg: f64, lon_deg: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, 0.0)
}

/// The place of a normal.
pub fn place_of(normal: DVec3) -> Geodetic {
    let lat_rad = atan2(normal.z, hypot(normal.x, normal.y));
    Geodetic { lat_rad, lon_rad: atan2(normal.y, normal.x), height_m: 0.0 }
}

/// The lattice point at shares of a page's side.
pub fn point_in(key: PageKey, [a, b]: [f64; 2]) -> IVec3 {
    let (u0, v0) = key.origin();
    let along = |share: f64| (f64::from(key.side()) * share) as i32;
    fold(key.quadrant(), u0 + along(a), v0 + along(b))
}

/// The place of a lattice point.
pub fn place_at(point: IVec3) -> Geodetic {
    place_of(normal_of(point))
}

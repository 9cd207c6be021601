//! A small archive of made-up hills: what tests of archives fly over.
//!
//! In:    which tiles to damage, the hash of the content.
//! Out:   an archive and a scene over it, in a folder of their own.
//! Keeps: the folder, thrown away.
//! Not here: real elevation (`rainier_agl`).

use overfly::archive::{ArchiveFacts, Datum, LayerFacts, metadata};
use overfly::core::datasource::codec::encode;
use overfly::core::datasource::page::SAMPLES;
use overfly::core::datasource::tile::{
    LayerTile, MARK_SIDE, Mark, Tile, bound_of, sea_level_grid, sea_level_side,
};
use overfly::core::datasource::{PAGE_SIDE, PageKey};
use overfly::core::geodesy::Ellipsoid;
use overfly::core::lattice::{RADIUS, unfold};
use pmtiles::{Compression, PmTilesWriter, TileCoord, TileType};
use serde_json::Value;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Depth of the last pages with data: samples 6 m apart on a planet of 1 km radius.
pub const DEPTH: u8 = 2;
/// The first quadrant has data: longitudes 0° to 90°.
const QUADRANT: u8 = 0;
const QUANTUM_M: f64 = 0.1;

/// A folder with `hills.pmtiles` and `scene.ron`.
pub struct Hills {
    folder: tempfile::TempDir,
}

impl Hills {
    /// Whole and sound.
    pub fn new() -> Self {
        Self::with(|_| false, 1)
    }

    /// With damaged tiles, and a content of its own.
    pub fn with(damaged: impl Fn(PageKey) -> bool, content: u64) -> Self {
        let hills = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::write(hills.archive(), archive(damaged, content)).unwrap();
        hills.write_scene("hills.pmtiles");
        hills
    }

    /// A scene over the archive at another location.
    pub fn write_scene(&self, location: &str) {
        let text = format!(
            "Scene(body: Sphere(radius_m: 1000.0), sea: true, memory: (pages_mib: 64),\n\
             sources: [Archive({location:?}), Procedural(seed: 1)],\n\
             depth: (ranges: [10.0, 300.0]))\n"
        );
        std::fs::write(self.scene(), text).unwrap();
    }

    pub fn archive(&self) -> PathBuf {
        self.folder.path().join("hills.pmtiles")
    }

    pub fn scene(&self) -> PathBuf {
        self.folder.path().join("scene.ron")
    }

    pub fn scene_name(&self) -> String {
        self.scene().display().to_string()
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// Pages with data, roots first.
pub fn keys() -> Vec<PageKey> {
    let mut keys = vec![PageKey::root(QUADRANT)];
    let mut at = 0;
    while keys[at].depth() < DEPTH {
        let key = keys[at];
        keys.extend((0..4).map(|index| key.child(index)));
        at += 1;
    }
    keys
}

fn facts(content: u64) -> ArchiveFacts {
    ArchiveFacts {
        version: 1,
        body_name: "small".into(),
        body: Ellipsoid { a_m: 1000.0, f: 0.0 },
        datum: Datum::Ellipsoid,
        height_range_m: [-13.0, 13.0],
        content,
        layers: vec![LayerFacts {
            depth: DEPTH,
            quantum_m: QUANTUM_M,
            spacing_m: 6.0,
            blend_m: 100.0,
            sources: vec!["hills".into()],
        }],
    }
}

fn archive(damaged: impl Fn(PageKey) -> bool, content: u64) -> Vec<u8> {
    let facts = facts(content);
    let mut file = Cursor::new(Vec::new());
    let writer = PmTilesWriter::new(TileType::Unknown)
        .internal_compression(Compression::Gzip)
        .tile_compression(Compression::None)
        .metadata(metadata::to_json(&facts, Value::Null));
    let mut writer = writer.create(&mut file).unwrap();
    for key in keys() {
        let (z, x, y) = key.zxy();
        let parent = key.parent().map(tile);
        let mut bytes = encode(&tile(key), parent.as_ref(), &facts);
        if damaged(key) {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 0x20;
        }
        writer.add_tile(TileCoord::new(z, x, y).unwrap(), &bytes).unwrap();
    }
    writer.finalize().unwrap();
    file.into_inner()
}

/// Height of the hills at a place of the first quadrant, in quanta: four periods each way.
pub fn quanta(u: i32, v: i32) -> i32 {
    let wave = |along: i32| ((along >> 20) % 256 - 128).abs() - 64;
    wave(u) + wave(v)
}

/// Full weight but near the quadrant's border.
fn weight(u: i32, v: i32) -> u8 {
    let inside = u.min(v).min(RADIUS - u).min(RADIUS - v);
    u8::try_from((i64::from(inside) * 16 * 255 / i64::from(RADIUS)).min(255)).unwrap()
}

fn tile(key: PageKey) -> Tile {
    let mut layer = LayerTile {
        layer: 0,
        quanta: Box::new([0; SAMPLES]),
        weights: Some(Box::new([0; SAMPLES])),
        filled: None,
        sea_level: vec![0; sea_level_side(key.depth(), sea_level_grid(DEPTH)).pow(2)],
        // Far from tight, but they hold everywhere.
        marks: Box::new(
            [Mark {
                error_odd: bound_of(3.0),
                error_even: bound_of(3.0),
                variation: bound_of(26.0),
                slope: bound_of(1.0),
                roughness: 4,
                roughest: 4,
                edge: true,
                range: [-2, 2],
            }; MARK_SIDE * MARK_SIDE],
        ),
    };
    let weights = layer.weights.as_mut().unwrap();
    for (i, j) in (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j))) {
        let (u, v) = unfold(QUADRANT, key.sample(i, j));
        let at = j * PAGE_SIDE + i;
        (layer.quanta[at], weights[at]) = (quanta(u, v), weight(u, v));
    }
    Tile { key, layers: vec![layer] }
}

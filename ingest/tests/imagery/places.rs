//! Pictures of a part of a body, and what files say of where they lie.
//!
//! In:    bounds, georeferenced TIFFs, kinds of PNG.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: whole bodies (`globe`).

use crate::pictures::{Atlas, Drawing, Georeference, mercator_options, options, write_png};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::colour::{COLOUR_SIDE, COLOUR_TEXELS, texel_point};
use overfly_core::lattice::normal_of;
use overfly_ingest::block::lon_lat_of;
use overfly_ingest::raster::MERCATOR_RADIUS_M;
use overfly_ingest::{ImageryOptions, verify_imagery};
use png::{BitDepth, ColorType};
use std::sync::atomic::AtomicBool;

/// West, south, east and north edge of the picture of a part.
const BOUNDS: [f64; 4] = [178.0, 40.0, 182.0, 42.0];

fn part() -> Drawing {
    Drawing::new([400, 200], |x, y| [(x / 2) as u8, y as u8, ((x + y) % 256) as u8, 255])
}

/// Every tile of an archive.
fn tiles(atlas: &Atlas) -> Vec<PageKey> {
    let mut found = Vec::new();
    let mut open: Vec<PageKey> = (0..4).map(PageKey::root).collect();
    while let Some(key) = open.pop() {
        if atlas.tile(key).is_some() {
            found.push(key);
        }
        // Where a picture is small its coarsest tiles may show nothing of it.
        let is_coarse = key.depth() < 4 || found.last() == Some(&key);
        if is_coarse && key.depth() < atlas.archive.facts().depth {
            open.extend((0..4).map(|index| key.child(index)));
        }
    }
    found
}

#[test]
fn a_part_has_tiles_where_it_lies_and_alpha_0_outside_across_the_antimeridian_too() {
    let folder = tempfile::tempdir().unwrap();
    let picture = part().write_png(&folder.path().join("part.png"));
    let output = folder.path().join("part.pmtiles");
    let atlas =
        Atlas::build(&ImageryOptions { bounds_deg: Some(BOUNDS), ..options(&picture, &output) });
    let found = tiles(&atlas);
    assert_eq!(found.len() as u64, atlas.report.tiles);
    let depth = atlas.archive.facts().depth;
    let finest: Vec<_> = found.iter().filter(|key| key.depth() == depth).collect();
    assert!(finest.len() > 4 && finest.len() < 200, "{}", finest.len());
    let (mut inside, mut outside) = (0, 0);
    for key in finest {
        let tile = atlas.tile(*key).unwrap();
        for at in 0..COLOUR_TEXELS {
            let point = texel_point(*key, at % COLOUR_SIDE, at / COLOUR_SIDE);
            let [lon, lat] = lon_lat_of(normal_of(point)).map(f64::to_degrees);
            let lon = lon.rem_euclid(360.0);
            let within = (178.0..=182.0).contains(&lon) && (40.0..=42.0).contains(&lat);
            assert_eq!(tile.rgba[at][3], if within { 255 } else { 0 }, "{lon} {lat}");
            let texel = tile.rgba[at].map(f64::from);
            if within {
                // 100 pixels a degree: red rises by one in two columns, green in each row.
                let red = ((lon - 178.0) * 100.0 - 0.5).clamp(0.0, 399.0) / 2.0;
                let green = ((42.0 - lat) * 100.0 - 0.5).clamp(0.0, 199.0);
                assert!((texel[0] - red).abs() <= 2.0 && (texel[1] - green).abs() <= 2.0);
                inside += 1;
            } else {
                assert_eq!(tile.rgba[at], [0; 4]);
                outside += 1;
            }
        }
    }
    assert!(inside > 50_000 && outside > 10_000, "{inside} {outside}");
}

#[test]
fn a_georeferenced_tiff_is_the_same_as_a_png_with_bounds_whichever_way_its_rows_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let png = part().write_png(&at("part.png"));
    let bounds_deg = Some(BOUNDS);
    let content = |options: &ImageryOptions| Atlas::build(options).archive.facts().content;
    let wanted = content(&ImageryOptions { bounds_deg, ..options(&png, &at("png.pmtiles")) });
    let georeference =
        Georeference { code: Some(4326), corner: [178.0, 42.0], step: [0.01, -0.01] };
    let tiff = part().write_tiff(&at("part.tif"), &georeference);
    assert_eq!(content(&options(&tiff, &at("tiff.pmtiles"))), wanted);
    let mut turned = part();
    let rows: Vec<_> = turned.pixels.chunks(400).rev().flatten().copied().collect();
    turned.pixels = rows;
    let georeference = Georeference { code: Some(4326), corner: [178.0, 40.0], step: [0.01, 0.01] };
    let tiff = turned.write_tiff(&at("turned.tif"), &georeference);
    assert_eq!(content(&options(&tiff, &at("turned.pmtiles"))), wanted);
}

#[test]
fn mercator_is_told_by_the_caller_or_by_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let drawing = Drawing::mercator(256);
    let png = drawing.write_png(&at("square.png"));
    let told = Atlas::build(&mercator_options(&png, &at("png.pmtiles")));
    let edge = std::f64::consts::PI * MERCATOR_RADIUS_M;
    let step = 2.0 * edge / 256.0;
    let georeference =
        Georeference { code: Some(3857), corner: [-edge, edge], step: [step, -step] };
    let tiff = drawing.write_tiff(&at("square.tif"), &georeference);
    let own = Atlas::build(&options(&tiff, &at("tiff.pmtiles")));
    assert_eq!(own.archive.facts().content, told.archive.facts().content);
    assert_eq!(own.archive.facts().depth, told.archive.facts().depth);
    // The same square by its bounds in degrees.
    let lat = 85.051_128_779_806_6;
    let bounded = ImageryOptions {
        bounds_deg: Some([-180.0, -lat, 180.0, lat]),
        ..mercator_options(&png, &at("bounded.pmtiles"))
    };
    assert_eq!(Atlas::build(&bounded).report.tiles, told.report.tiles);
}

#[test]
fn grey_and_palette_and_alpha_are_read_and_facts_say_what_was_built() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let pixels = 64 * 32;
    let cases: [(&str, ColorType, BitDepth, _, [u8; 4]); 5] = [
        ("grey", ColorType::Grayscale, BitDepth::Eight, vec![77; pixels], [77, 77, 77, 255]),
        ("bits", ColorType::Grayscale, BitDepth::One, vec![255; pixels / 8], [255; 4]),
        ("soft", ColorType::GrayscaleAlpha, BitDepth::Eight, vec![90; 2 * pixels], [90; 4]),
        ("clear", ColorType::Rgba, BitDepth::Eight, vec![51; 4 * pixels], [51; 4]),
        ("map", ColorType::Indexed, BitDepth::Eight, vec![1; pixels], [200, 100, 50, 255]),
    ];
    for (name, color, depth, data, wanted) in cases {
        let path = at(&format!("{name}.png"));
        write_png(&path, [64, 32], (color, depth), &data);
        let attribution = "somebody".to_owned();
        let built = ImageryOptions { attribution, ..options(&path, &at("a.pmtiles")) };
        let atlas = Atlas::build(&built);
        let tile = atlas.tile(PageKey::root(1)).unwrap();
        for texel in &*tile.rgba {
            let close = texel.iter().zip(wanted).all(|(&a, b)| a.abs_diff(b) <= 1);
            assert!(close, "{name}: {texel:?}");
        }
        let facts = atlas.archive.facts();
        assert_eq!(
            (facts.attribution.as_str(), &facts.source),
            ("somebody", &format!("{name}.png"))
        );
        assert_eq!(facts.body_name, "Earth");
        assert!((facts.spacing_m - 626_172.0).abs() < 1.0, "{}", facts.spacing_m);
        let tiles = verify_imagery(&built, &AtomicBool::new(false), &|_| {}).unwrap();
        assert_eq!(tiles, atlas.report.tiles);
    }
}

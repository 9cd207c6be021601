//! SRTM tiles, PNG tiles and 16-bit PNG: what is written comes back.
//!
//! In:    files written here.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: damaged files (`fuzz`).

use crate::{all, opened, refusal};
use overfly_ingest::raster::{OpenOptions, Projection, TileEncoding, open};
use std::f64::consts::PI;
use std::fs;
use std::io::Write;
use std::path::Path;

/// An SRTM3 tile whose postings tell their place.
pub fn hgt_bytes() -> Vec<u8> {
    let height = |at: i32| (at % 1201 - at / 1201) as i16;
    let mut bytes: Vec<u8> = (0..1201 * 1201).flat_map(|at| height(at).to_be_bytes()).collect();
    bytes[2 * 5..2 * 5 + 2].copy_from_slice(&i16::MIN.to_be_bytes());
    bytes
}

/// The same in a zip, with another file before it.
pub fn zip_bytes(name: &str, contents: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    zip.start_file("readme.txt", options).unwrap();
    zip.write_all(b"not heights").unwrap();
    zip.start_file(name, options).unwrap();
    zip.write_all(contents).unwrap();
    zip.finish().unwrap().into_inner()
}

/// A PNG of these bytes.
pub fn png_bytes(
    size: [u32; 2],
    color: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn srtm_tiles_come_back_plain_and_zipped() {
    let bytes = hgt_bytes();
    let zipped = zip_bytes("N49E011.hgt", &bytes);
    let files = [("N49E011.hgt", bytes), ("n49e011.SRTMGL3.hgt.zip", zipped)];
    for (name, bytes) in &files {
        let (_folder, raster) = opened(name, bytes, &OpenOptions::default());
        assert_eq!(raster.grid.origin, [11.0, 50.0]);
        assert_eq!((raster.grid.columns, raster.grid.rows, raster.grid.wraps), (1201, 1201, false));
        let heights = all(&raster);
        assert!(heights[5].is_nan());
        for at in [0, 1200, 1201 * 600 + 17, 1201 * 1201 - 1] {
            assert_eq!(heights[at], (at as i32 % 1201 - at as i32 / 1201) as f32, "{name} {at}");
        }
        let [lon, lat] = raster.grid.lon_lat(1200.0, 1200.0);
        assert!((lon.to_degrees() - 12.0).abs() < 1e-12 && (lat.to_degrees() - 49.0).abs() < 1e-12);
    }
}

#[test]
fn wrong_sizes_names_and_zips_are_refused() {
    let options = OpenOptions::default();
    let message = refusal("N49E011.hgt", &[0; 1000], &options);
    assert!(message.contains("1000 bytes") && message.contains("1201"), "{message}");
    let message = refusal("tile.hgt", &hgt_bytes(), &options);
    assert!(message.contains("N49E011.hgt"), "{message}");
    let message = refusal("N49E011.hgt.zip", &zip_bytes("N49E011.txt", b"x"), &options);
    assert!(message.contains("no .hgt file among its 2 entries"), "{message}");
    let message = refusal("N49E011.hgt.zip", &zip_bytes("N49E011.hgt", &[0; 4_000_000]), &options);
    assert!(message.contains("4000000 bytes"), "{message}");
    assert!(refusal("heights.xyz", b"1 2 3", &options).contains("gdal_translate"));
}

#[test]
fn a_folder_of_files_gives_one_raster_each_in_the_order_of_names() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["S01W001.hgt", "N00E000.hgt", "notes.txt"] {
        fs::write(folder.path().join(name), hgt_bytes()).unwrap();
    }
    let rasters = open(folder.path(), &OpenOptions::default()).unwrap();
    let origins: Vec<[f64; 2]> = rasters.iter().map(|raster| raster.grid.origin).collect();
    assert_eq!(origins, [[0.0, 1.0], [-1.0, 0.0]]);
    let empty = tempfile::tempdir().unwrap();
    let message = open(empty.path(), &OpenOptions::default()).map(drop).unwrap_err().to_string();
    assert!(message.contains("no tiles and no elevation files"), "{message}");
}

#[test]
fn a_16_bit_png_comes_back_with_scale_offset_and_extent() {
    let data: Vec<u8> = (0..64_u16 * 32).flat_map(|at| (at * 31).to_be_bytes()).collect();
    let gray = png::ColorType::Grayscale;
    let bytes = png_bytes([64, 32], gray, png::BitDepth::Sixteen, &data);
    let options = OpenOptions {
        extent_deg: Some([-180.0, -90.0, 180.0, 90.0]),
        metres_per_unit: 0.5,
        offset_m: -1000.0,
        nodata: Some(31.0),
        ..OpenOptions::default()
    };
    let (_folder, raster) = opened("moon.png", &bytes, &options);
    assert!(raster.grid.wraps);
    assert_eq!(raster.grid.origin, [-177.1875, 87.1875]);
    let heights = all(&raster);
    assert!(heights[1].is_nan());
    assert_eq!((heights[0], heights[2]), (-1000.0, -969.0));
    assert_eq!(heights[64 * 32 - 1], f32::from(2047_u16.wrapping_mul(31)) * 0.5 - 1000.0);
    let message = refusal("moon.png", &bytes, &OpenOptions::default());
    assert!(message.contains("--extent WEST,SOUTH,EAST,NORTH"), "{message}");
    let coarse = png_bytes([2, 2], gray, png::BitDepth::Eight, &[0; 4]);
    assert!(refusal("moon.png", &coarse, &options).contains("8 bits are too coarse"));
    let wrong = OpenOptions { extent_deg: Some([10.0, 0.0, 5.0, 9.0]), ..options };
    assert!(refusal("moon.png", &bytes, &wrong).contains("west < east"));
}

fn colour(encoding: TileEncoding, height_m: f64) -> [u8; 3] {
    let number = match encoding {
        TileEncoding::Terrarium => ((height_m + 32768.0) * 256.0) as u32,
        TileEncoding::TerrainRgb => ((height_m + 10000.0) * 10.0) as u32,
    };
    let [_, red, green, blue] = number.to_be_bytes();
    [red, green, blue]
}

/// A tile whose heights tell its number and their row.
fn write_tile(root: &Path, [zoom, x, y]: [u32; 3], edge: u32, encoding: TileEncoding) {
    let height = |at: u32| f64::from(x * 100 + y * 10) + f64::from(at / edge);
    let mut data: Vec<u8> = (0..edge * edge)
        .flat_map(|at| [&colour(encoding, height(at))[..], &[255]].concat())
        .collect();
    data[3] = 0;
    let bytes = png_bytes([edge; 2], png::ColorType::Rgba, png::BitDepth::Eight, &data);
    let folder = root.join(format!("{zoom}/{x}"));
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(format!("{y}.png")), bytes).unwrap();
}

#[test]
fn tiles_come_back_from_the_deepest_zoom_with_missing_ones_void() {
    for (encoding, edge) in [(TileEncoding::Terrarium, 256), (TileEncoding::TerrainRgb, 512)] {
        let folder = tempfile::tempdir().unwrap();
        for tile in [[2, 1, 1], [4, 8, 5], [4, 9, 6]] {
            write_tile(folder.path(), tile, edge, encoding);
        }
        // Without a word about the encoding: the colours leave no doubt.
        let raster = open(folder.path(), &OpenOptions::default()).unwrap().pop().unwrap();
        assert_eq!(raster.grid.projection, Projection::WebMercator);
        assert_eq!([raster.grid.columns, raster.grid.rows], [2 * edge; 2]);
        let heights = all(&raster);
        let side = 2 * edge as usize;
        assert!(heights[0].is_nan(), "alpha 0 is void");
        assert_eq!(heights[1], 850.0);
        assert_eq!(heights[7 * side + 9], 857.0);
        assert_eq!(heights[side * side - 1], 960.0 + edge as f32 - 1.0);
        assert!(heights[side - 1].is_nan() && heights[side * (side - 1)].is_nan());
        // Tile (8, 5) of zoom 4 begins at 0 E; half a pixel in is the first posting.
        let step = 2.0 * PI / 16.0 / f64::from(edge);
        let [lon, _] = raster.grid.lon_lat(0.0, 0.0);
        assert!((lon - 0.5 * step).abs() < 1e-12, "{lon}");
        let template = folder.path().join("{z}").join("{x}").join("{y}.png");
        let same = open(&template, &OpenOptions::default()).unwrap().pop().unwrap();
        assert_eq!(same.grid, raster.grid);
    }
}

#[test]
fn tiles_round_the_world_wrap() {
    let folder = tempfile::tempdir().unwrap();
    for (x, y) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        write_tile(folder.path(), [1, x, y], 256, TileEncoding::Terrarium);
    }
    let raster = open(folder.path(), &OpenOptions::default()).unwrap().pop().unwrap();
    assert!(raster.grid.wraps);
    let mut out = Vec::new();
    raster.window(-1, 3, 2, 1, &mut out).unwrap();
    assert_eq!(out, [103.0, 3.0]);
}

#[test]
fn colours_that_may_mean_either_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("0/0")).unwrap();
    let data: Vec<u8> = (0..256 * 256 * 3).map(|at: u32| (at * 7 % 251) as u8).collect();
    let bytes = png_bytes([256; 2], png::ColorType::Rgb, png::BitDepth::Eight, &data);
    fs::write(folder.path().join("0/0/0.png"), bytes).unwrap();
    let message = open(folder.path(), &OpenOptions::default()).map(drop).unwrap_err().to_string();
    assert!(message.contains("--encoding terrarium"), "{message}");
    let options =
        OpenOptions { encoding: Some(TileEncoding::TerrainRgb), ..OpenOptions::default() };
    let raster = open(folder.path(), &options).unwrap().pop().unwrap();
    let wanted = TileEncoding::TerrainRgb.height_m([0, 7, 14]) as f32;
    assert_eq!(all(&raster)[0], wanted);
}

#[test]
fn a_tile_that_a_packer_made_grey_means_the_same() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("0/0")).unwrap();
    let gray = png::ColorType::Grayscale;
    let bytes = png_bytes([256; 2], gray, png::BitDepth::Eight, &[128; 256 * 256]);
    fs::write(folder.path().join("0/0/0.png"), bytes).unwrap();
    let options = OpenOptions { encoding: Some(TileEncoding::Terrarium), ..OpenOptions::default() };
    let raster = open(folder.path(), &options).unwrap().pop().unwrap();
    assert_eq!(all(&raster)[77], 128.5);
}

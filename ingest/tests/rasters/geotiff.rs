//! GeoTIFF: what is written comes back, whatever the layout.
//!
//! In:    files from `tiff_file` and from the `tiff` crate's own encoder.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: damaged files (`fuzz`).

use crate::tiff_file::{Number, Packing, TiffFile};
use crate::{all, opened, refusal};
use overfly_ingest::raster::{OpenOptions, Projection};

const SIZE: [u32; 2] = [37, 29];

/// Heights that differ from each other, negative ones among them where the type allows.
fn values(number: Number) -> Vec<f64> {
    let count = (SIZE[0] * SIZE[1]) as i32;
    let of = |at: i32| match number {
        Number::U8 => f64::from(at * 7 % 256),
        Number::I8 => f64::from(at * 7 % 256 - 128),
        Number::U16 | Number::U32 => f64::from(at * 53 % 9000),
        Number::I16 | Number::I32 => f64::from(at * 53 % 9000 - 430),
        Number::F32 | Number::F64 => f64::from(at * 53 % 9000 - 430) + 0.25,
    };
    (0..count).map(of).collect()
}

fn check(file: &TiffFile) {
    let (_folder, raster) = opened("a.tif", &file.bytes(), &OpenOptions::default());
    let wanted: Vec<f32> = file.values.iter().map(|&value| value as f32).collect();
    assert_eq!(all(&raster), wanted, "{:?}", TiffFile { values: Vec::new(), ..file.clone() });
}

/// Every layout of one type, packed and predicted in one way. How many there were.
fn check_layouts(number: Number, packing: Packing, predictor: u16) -> usize {
    let mut cases = 0;
    for tile in [None, Some([16, 16]), Some([64, 32])] {
        for (big_endian, big_tiff) in [(false, false), (true, false), (false, true)] {
            let file = TiffFile { number, packing, ..TiffFile::new(SIZE, values(number)) };
            check(&TiffFile { predictor, tile, big_endian, big_tiff, ..file });
            cases += 1;
        }
    }
    cases
}

#[test]
fn every_type_packing_predictor_layout_and_byte_order_comes_back() {
    use Number::{F32, F64, I8, I16, I32, U8, U16, U32};
    let mut cases = 0;
    for number in [U8, I8, U16, I16, U32, I32, F32, F64] {
        let difference = if matches!(number, F32 | F64) { 3 } else { 2 };
        for packing in [Packing::Plain, Packing::Lzw, Packing::Deflate, Packing::Packbits] {
            cases += check_layouts(number, packing, 1);
            cases += check_layouts(number, packing, difference);
        }
    }
    assert_eq!(cases, 8 * 4 * 2 * 3 * 3);
}

#[test]
fn what_another_encoder_writes_comes_back() {
    use tiff::encoder::{Compression, TiffEncoder, colortype::Gray16, colortype::GrayI16};
    use tiff::tags::Tag;
    let heights: Vec<i16> = values(Number::I16).iter().map(|&value| value as i16).collect();
    for compression in [Compression::Uncompressed, Compression::Lzw, Compression::Packbits] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
        let mut encoder = encoder;
        let mut image = encoder.new_image::<GrayI16>(SIZE[0], SIZE[1]).unwrap();
        image.rows_per_strip(5).unwrap();
        let tags = image.encoder();
        tags.write_tag(Tag::ModelPixelScaleTag, &[0.5, 0.5, 0.0][..]).unwrap();
        tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 7.0, 45.0, 0.0][..]).unwrap();
        let keys: [u16; 12] = [1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326];
        tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
        image.write_data(&heights).unwrap();
        let (_folder, raster) = opened("b.tif", bytes.get_ref(), &OpenOptions::default());
        let wanted: Vec<f32> = heights.iter().map(|&height| height.into()).collect();
        assert_eq!(all(&raster), wanted);
        assert_eq!(raster.kind, "GeoTIFF int16");
    }
    let mut bytes = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<Gray16>(2, 2, &[1, 2, 3, 4]).unwrap();
    let message = refusal("c.tif", bytes.get_ref(), &OpenOptions::default());
    assert!(message.contains("no georeferencing") && message.contains("-a_ullr"), "{message}");
}

/// What a window must have at its `at`th place, given the whole raster.
fn wanted_at(whole: &[f32], [x0, y0]: [i64; 2], at: usize) -> f32 {
    let at = i64::try_from(at).unwrap();
    let [x, y] = [x0.saturating_add(at % 19), y0.saturating_add(at / 19)];
    let inside = (0..37).contains(&x) && (0..29).contains(&y);
    if inside { whole[(y * 37 + x) as usize] } else { f32::NAN }
}

#[test]
fn windows_of_any_place_agree_with_the_whole_and_are_void_outside() {
    let places = [[-5, -5], [0, 0], [15, 15], [30, 20], [36, 28], [37, 0], [i64::MIN, 0]];
    for tile in [None, Some([16, 16])] {
        let file = TiffFile { tile, ..TiffFile::new(SIZE, values(Number::I16)) };
        let (_folder, raster) = opened("a.tif", &file.bytes(), &OpenOptions::default());
        let whole = all(&raster);
        let mut out = Vec::new();
        for place in places.into_iter().chain([[0, i64::MAX], [i64::MAX, i64::MIN]]) {
            raster.window(place[0], place[1], 19, 17, &mut out).unwrap();
            let wanted = (0..19 * 17).map(|at| wanted_at(&whole, place, at).to_bits());
            assert!(out.iter().map(|height| height.to_bits()).eq(wanted), "{tile:?} {place:?}");
        }
        raster.window(0, 0, 0, 9, &mut out).unwrap();
        assert!(out.is_empty());
        assert!(raster.window(0, 0, usize::MAX, 2, &mut out).is_err());
        assert!(raster.window(0, 0, 1 << 20, 1 << 20, &mut out).is_err());
    }
}

#[test]
fn a_grid_round_the_world_goes_on_at_its_edges() {
    let mut file = TiffFile::new([36, 18], (0..36 * 18).map(f64::from).collect());
    file.scale = vec![10.0, 10.0, 0.0];
    file.tie = vec![0.0, 0.0, 0.0, -180.0, 90.0, 0.0];
    file.tile = Some([16, 16]);
    let (_folder, raster) = opened("world.tif", &file.bytes(), &OpenOptions::default());
    assert!(raster.grid.wraps);
    assert_eq!(raster.grid.origin, [-175.0, 85.0]);
    let mut out = Vec::new();
    raster.window(-40, 3, 100, 2, &mut out).unwrap();
    for (at, height) in out.iter().enumerate() {
        let (x, y) = ((at as i64 % 100 - 40).rem_euclid(36), 3 + at as i64 / 100);
        assert_eq!(*height, (y * 36 + x) as f32);
    }
    // Half a posting west of the antimeridian and half a posting east of it are neighbours.
    let west = raster.grid.place(179.9_f64.to_radians(), 0.0).unwrap()[0];
    let east = raster.grid.place(-179.9_f64.to_radians(), 0.0).unwrap()[0];
    assert!((west - 35.49).abs() < 1e-9 && (east + 0.49).abs() < 1e-9, "{west} {east}");
}

#[test]
fn areas_points_and_transformations_say_where_postings_lie() {
    let mut file = TiffFile::new([10, 10], vec![1.0; 100]);
    let origin = |file: &TiffFile| {
        let (_folder, raster) = opened("a.tif", &file.bytes(), &OpenOptions::default());
        raster.grid.origin
    };
    assert_eq!(origin(&file), [10.05, 49.95]);
    file.keys[1] = [1025, 2];
    assert_eq!(origin(&file), [10.0, 50.0]);
    let matrix =
        [0.1, 0.0, 0.0, 20.0, 0.0, -0.1, 0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let file =
        TiffFile { scale: Vec::new(), tie: Vec::new(), transformation: matrix.to_vec(), ..file };
    assert_eq!(origin(&file), [20.0, 60.0]);
}

#[test]
fn rows_that_run_north_come_out_running_south() {
    for tile in [None, Some([16, 16])] {
        let mut file = TiffFile { tile, ..TiffFile::new(SIZE, values(Number::I16)) };
        file.keys[1] = [1025, 2];
        file.scale[1] = -file.scale[1];
        let (_folder, raster) = opened("north.tif", &file.bytes(), &OpenOptions::default());
        assert!(raster.grid.step[1] < 0.0);
        assert!((raster.grid.origin[1] - (50.0 + 28.0 / 29.0)).abs() < 1e-12);
        let turned = |at: usize| file.values[(28 - at / 37) * 37 + at % 37] as f32;
        let wanted: Vec<f32> = (0..file.values.len()).map(turned).collect();
        assert_eq!(all(&raster), wanted);
        let mut out = Vec::new();
        raster.window(3, 11, 9, 8, &mut out).unwrap();
        for (at, height) in out.iter().enumerate() {
            assert_eq!(*height, wanted[(11 + at / 9) * 37 + 3 + at % 9]);
        }
    }
}

#[test]
fn mercator_metres_are_read_and_other_systems_are_refused() {
    let mut file = TiffFile::new([10, 10], vec![1.0; 100]);
    file.keys = vec![[1024, 1], [1025, 1], [3072, 3857]];
    file.scale = vec![100.0, 100.0, 0.0];
    file.tie = vec![0.0, 0.0, 0.0, 1_000_000.0, 6_000_000.0, 0.0];
    let (_folder, raster) = opened("m.tif", &file.bytes(), &OpenOptions::default());
    assert_eq!(raster.grid.projection, Projection::WebMercator);
    assert_eq!(raster.grid.origin, [1_000_050.0, 5_999_950.0]);
    file.keys[2] = [3072, 32633];
    let message = refusal("utm.tif", &file.bytes(), &OpenOptions::default());
    let line = "EPSG:32633 is not supported; convert it first: \
                gdalwarp -t_srs EPSG:4326 -r bilinear utm.tif utm_4326.tif";
    assert!(message.ends_with(line), "{message}");
}

#[test]
fn voids_are_what_the_file_and_the_caller_declare() {
    let values = vec![-9999.0, 0.0, 7.0, -32768.0, 12.5, 1.0, 2.0, 3.0, 4.0];
    let mut file = TiffFile::new([3, 3], values);
    file.number = Number::F64;
    file.nodata = Some("-9999".to_owned());
    let options = OpenOptions { nodata: Some(7.0), ..OpenOptions::default() };
    let (_folder, raster) = opened("a.tif", &file.bytes(), &options);
    assert_eq!(raster.declared_nodata, Some(-9999.0));
    let void: Vec<bool> = all(&raster).iter().map(|height| height.is_nan()).collect();
    assert_eq!(void[..5], [true, false, true, false, false]);
    file.nodata = Some("none".to_owned());
    assert!(refusal("a.tif", &file.bytes(), &options).contains("no number"));
}

#[test]
fn gdal_scale_offset_and_sparse_chunks_are_heeded() {
    let mut file = TiffFile::new([4, 6], (0..24).map(f64::from).collect());
    let item = |name: &str, role: &str, value: &str| {
        format!("<Item name=\"{name}\" sample=\"0\" role=\"{role}\">{value}</Item>")
    };
    let items = item("SCALE", "scale", "0.1") + &item("OFFSET", "offset", "-100");
    file.metadata = Some(format!("<GDALMetadata>{items}</GDALMetadata>"));
    file.sparse = vec![1];
    let (_folder, raster) = opened("a.tif", &file.bytes(), &OpenOptions::default());
    let heights = all(&raster);
    assert_eq!(heights[10], -99.0);
    assert!(heights[12..].iter().all(|height| height.is_nan()));
}

#[test]
fn bands_and_huge_chunks_are_refused_with_what_helps() {
    let mut file = TiffFile::new([4, 4], vec![0.0; 16]);
    file.bands = 3;
    let message = refusal("rgb.tif", &file.bytes(), &OpenOptions::default());
    assert!(message.contains("3 bands") && message.contains("gdal_translate -b 1"), "{message}");
    let mut file = TiffFile::new([4, 4], vec![0.0; 16]);
    file.tile = Some([1 << 14, 1 << 14]);
    file.sparse = vec![0];
    let message = refusal("huge.tif", &file.bytes(), &OpenOptions::default());
    assert!(message.contains("gdal_translate -co TILED=YES"), "{message}");
}

#[test]
fn threads_read_the_same_through_a_store_too_small_for_one_row_of_chunks() {
    use overfly_ingest::raster::ChunkStore;
    let mut file = TiffFile::new(SIZE, values(Number::I16));
    file.tile = Some([16, 16]);
    file.packing = Packing::Deflate;
    let options = OpenOptions { store: ChunkStore::new(1500), ..OpenOptions::default() };
    let (_folder, raster) = opened("a.tif", &file.bytes(), &options);
    let whole = all(&raster);
    let walk = &|thread: i64| {
        let mut out = Vec::new();
        for round in 0..200 {
            let (x, y) = ((round * 7 + thread * 5) % 30, (round * 11 + thread) % 22);
            raster.window(x, y, 7, 7, &mut out).unwrap();
            let last = whole[((y + 6) * 37 + x + 6) as usize];
            assert_eq!((out[0], out[48]), (whole[(y * 37 + x) as usize], last));
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..6).map(|thread| scope.spawn(move || walk(thread))).collect();
        threads.into_iter().for_each(|thread| thread.join().unwrap());
    });
    assert!(options.store.bytes() <= 1500, "{}", options.store.bytes());
    drop(raster);
    assert_eq!(options.store.bytes(), 0);
}

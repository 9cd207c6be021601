//! Pictures of a whole body: colours at places, means, seams.
//!
//! In:    smooth, speckled and striped pictures.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: pictures of a part (`places`), bad ones (`faults`).

use crate::pictures::{Atlas, Drawing, mercator_options, options, place, smooth};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::colour::{COLOUR_SIDE, COLOUR_TEXELS, texel_point};
use overfly_core::digest::mix;
use overfly_core::lattice::RADIUS;
use std::collections::BTreeMap;

const PLACES: u64 = 10_000;

fn world(width: u32) -> Atlas {
    let folder = tempfile::tempdir().unwrap();
    let picture = Drawing::world(width).write_png(&folder.path().join("world.png"));
    Atlas::build(&options(&picture, &folder.path().join("world.pmtiles")))
}

fn off(found: [f64; 4], wanted: [f64; 3]) -> f64 {
    (0..3).map(|part| (found[part] - wanted[part]).abs()).fold(0.0, f64::max)
}

#[test]
fn at_ten_thousand_places_the_finest_colour_is_that_of_the_body() {
    // Sizes that halve evenly and that do not.
    for width in [1024, 1000, 998] {
        let atlas = world(width);
        assert_eq!(atlas.archive.facts().depth, 2);
        let mut worst = 0.0_f64;
        for [lon, lat] in (0..PLACES).map(place) {
            let found = atlas.at(lon, lat).expect("the whole body is covered");
            assert!(found[3] > 254.99);
            worst = worst.max(off(found, smooth(lon, lat)));
        }
        println!("{width} columns: {worst:.2} of 255 off at worst");
        assert!(worst <= 2.0, "{width}: {worst}");
    }
}

#[test]
fn every_depth_of_a_smooth_picture_has_the_colours_of_the_body() {
    let atlas = world(2048);
    assert_eq!(atlas.report.tiles, 4 + 16 + 64 + 256);
    for quadrant in 0..4 {
        let mut key = PageKey::root(quadrant);
        loop {
            let tile = atlas.tile(key).unwrap();
            for at in (0..COLOUR_TEXELS).step_by(37) {
                let point = texel_point(key, at % COLOUR_SIDE, at / COLOUR_SIDE);
                let normal = overfly_core::lattice::normal_of(point);
                let [lon, lat] = overfly_ingest::block::lon_lat_of(normal);
                let found = off(tile.rgba[at].map(f64::from), smooth(lon, lat));
                assert!(found <= 2.0, "{key:?} {point}: {found}");
            }
            if key.depth() == atlas.archive.facts().depth {
                break;
            }
            key = key.child(usize::from(quadrant));
        }
    }
}

#[test]
fn mercator_and_equirectangular_pictures_agree_up_to_80_degrees() {
    let folder = tempfile::tempdir().unwrap();
    let square = Drawing::mercator(1024).write_png(&folder.path().join("square.png"));
    let mercator = Atlas::build(&mercator_options(&square, &folder.path().join("m.pmtiles")));
    let equirectangular = world(1024);
    let (mut worst, mut compared) = (0.0_f64, 0);
    for [lon, lat] in (0..PLACES).map(place) {
        let (a, b) = (mercator.at(lon, lat), equirectangular.at(lon, lat).unwrap());
        if lat.abs().to_degrees() > 80.0 {
            continue;
        }
        let a = a.expect("the square reaches to 85 degrees");
        worst = worst.max(off(a, [b[0], b[1], b[2]]));
        assert!(a[3] > 254.99);
        compared += 1;
    }
    println!("{worst:.2} of 255 apart at worst, at {compared} places");
    assert!(worst <= 3.0 && compared > 9_500, "{worst} at {compared} places");
    // There is nothing at the poles of the square.
    let pole = mercator.tile(PageKey::new(0, 2, 0, 0)).unwrap();
    assert_eq!(pole.rgba[0], [0; 4]);
}

/// Border texels of all tiles by depth and lattice point; fails where two tiles differ.
fn shared_texels(atlas: &Atlas) -> BTreeMap<(u8, [i32; 3]), (u32, [u8; 4])> {
    let mut known = BTreeMap::new();
    let mut open: Vec<PageKey> = (0..4).map(PageKey::root).collect();
    let last = COLOUR_SIDE - 1;
    while let Some(key) = open.pop() {
        let tile = atlas.tile(key).unwrap();
        let border = (0..COLOUR_TEXELS)
            .map(|at| [at % COLOUR_SIDE, at / COLOUR_SIDE])
            .filter(|at| at.iter().any(|&along| along == 0 || along == last));
        for [i, j] in border {
            let texel = tile.rgba[j * COLOUR_SIDE + i];
            let place = (key.depth(), texel_point(key, i, j).to_array());
            let (tiles, first) = known.entry(place).or_insert((0, texel));
            *tiles += 1;
            assert_eq!(*first, texel, "{key:?} texel {i}, {j}");
        }
        if key.depth() < atlas.archive.facts().depth {
            open.extend((0..4).map(|index| key.child(index)));
        }
    }
    known
}

#[test]
fn neighbours_share_their_borders_to_the_bit_across_quadrants_and_poles_and_the_antimeridian() {
    let folder = tempfile::tempdir().unwrap();
    let speckled = Drawing::new([720, 360], |x, y| {
        let [red, green, blue, alpha, ..] = mix(u64::from(y) << 32 | u64::from(x)).to_le_bytes();
        [red, green, blue, if alpha < 40 { 0 } else { 255 }]
    });
    let picture = speckled.write_png(&folder.path().join("speckled.png"));
    let atlas = Atlas::build(&options(&picture, &folder.path().join("a.pmtiles")));
    let depth = atlas.archive.facts().depth;
    let known = shared_texels(&atlas);
    for depth in 0..=depth {
        let tiles = |point: [i32; 3]| known[&(depth, point)].0;
        assert_eq!([tiles([0, 0, RADIUS]), tiles([0, 0, -RADIUS])], [4, 4], "poles");
        // A quarter of the way up the antimeridian, where two quadrants meet; and on the equator.
        let half = RADIUS / 2;
        assert_eq!(tiles([-half, 0, half]), if depth == 0 { 2 } else { 4 });
        assert!(tiles([-RADIUS, 0, 0]) >= 2);
        let lonely = known.iter().filter(|((d, _), (tiles, _))| *d == depth && *tiles < 2);
        assert_eq!(lonely.count(), 0, "every border texel has a neighbour's twin");
    }
}

#[test]
fn at_the_poles_all_longitudes_meet_in_one_colour() {
    let folder = tempfile::tempdir().unwrap();
    // Black in the west, white in the east: half of the light is byte 188.
    let halves = Drawing::new([256, 128], |x, _| if x < 128 { [0, 0, 0, 255] } else { [255; 4] });
    let picture = halves.write_png(&folder.path().join("halves.png"));
    let atlas = Atlas::build(&options(&picture, &folder.path().join("a.pmtiles")));
    for depth in 0..=atlas.archive.facts().depth {
        let last = (1 << depth) - 1;
        for quadrant in 0..4 {
            let north = atlas.tile(PageKey::new(quadrant, depth, 0, 0)).unwrap();
            let south = atlas.tile(PageKey::new(quadrant, depth, last, last)).unwrap();
            assert_eq!(north.rgba[0], [188, 188, 188, 255], "{depth} {quadrant}");
            assert_eq!(south.rgba[COLOUR_TEXELS - 1], [188, 188, 188, 255], "{depth} {quadrant}");
        }
    }
}

#[test]
fn coarse_tiles_have_the_mean_of_the_light() {
    let folder = tempfile::tempdir().unwrap();
    let squares =
        Drawing::new([2048, 1024], |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
    let picture = squares.write_png(&folder.path().join("squares.png"));
    let atlas = Atlas::build(&options(&picture, &folder.path().join("a.pmtiles")));
    for key in (0..4).map(PageKey::root) {
        let tile = atlas.tile(key).unwrap();
        let plain =
            tile.rgba.iter().all(|rgba| rgba[..3].iter().all(|&c| (187..=189).contains(&c)));
        assert!(plain, "{key:?}");
    }
}

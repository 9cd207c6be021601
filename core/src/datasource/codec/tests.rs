//! Tiles through bytes and back, damaged bytes, and foreign ones.
//!
//! In:    tiles of made-up hills, and bytes that look random.
//! Out:   none.
//! Keeps: nothing.
//! Not here: the coder's own tests (`coder`), archives (`overfly_archive`).

use super::*;
use crate::datasource::facts::{Datum, FORMAT_VERSION, LayerFacts};
use crate::digest::mix;
use crate::geodesy::Ellipsoid;

fn facts() -> ArchiveFacts {
    let layer = |depth| LayerFacts {
        depth,
        quantum_m: 1.0,
        spacing_m: 90.0,
        blend_m: 700.0,
        sources: Vec::new(),
    };
    ArchiveFacts {
        version: FORMAT_VERSION,
        body_name: "Earth".into(),
        body: Ellipsoid::WGS84,
        datum: Datum::Egm96,
        height_range_m: [-500.0, 9000.0],
        content: 0,
        layers: vec![layer(4), layer(12)],
    }
}

fn small(number: usize) -> i32 {
    i32::try_from(number).unwrap()
}

/// A tile of hills whose numbers look random below `noise`.
fn tile(key: PageKey, noise: u64) -> Tile {
    let height = |at: usize| {
        let (i, j) = (small(at % PAGE_SIDE), small(at / PAGE_SIDE));
        i * i / 3 - j * j / 5 + i32::try_from(mix(at as u64) % noise).unwrap()
    };
    let weight = |at: usize| u8::try_from((at / PAGE_SIDE * 4).min(255)).unwrap();
    let layer = |layer: u8, seed: u64| {
        let side = sea_level_side(key.depth(), sea_level_grid([4, 12][usize::from(layer)]));
        let mark = |at: usize| Mark {
            error_odd: u8::try_from(at % 7).unwrap(),
            variation: 90 + (mix(at as u64 + seed) % 9) as u8,
            edge: at.is_multiple_of(5),
            range: if at.is_multiple_of(5) { [i16::try_from(at).unwrap() - 40, 3] } else { [0; 2] },
            ..Mark::default()
        };
        LayerTile {
            layer,
            quanta: Box::new(core::array::from_fn(height)),
            weights: (seed % 2 == 1).then(|| Box::new(core::array::from_fn(weight))),
            filled: (seed > 1).then(|| Box::new(core::array::from_fn(|at| at % 65 > 40))),
            sea_level: (0..side * side).map(|at| 1500 + small(at % 65)).collect(),
            marks: Box::new(core::array::from_fn(mark)),
        }
    };
    let layers = if key.depth() <= 4 { vec![layer(0, 0), layer(1, 3)] } else { vec![layer(1, 1)] };
    Tile { key, layers }
}

#[test]
fn tiles_come_back_but_for_samples_without_weight() {
    for (key, noise) in [(PageKey::new(0, 4, 3, 9), 5), (PageKey::new(3, 12, 77, 4000), 3000)] {
        let tile = tile(key, noise);
        let bytes = encode(&tile, None, &facts());
        let mut back = decode(&bytes, key, None, &facts()).unwrap();
        for (layer, original) in back.layers.iter_mut().zip(&tile.layers) {
            for at in (0..SAMPLES).filter(|&at| original.weight(at) == 0) {
                assert_eq!(layer.quanta[at], 0);
                layer.quanta[at] = original.quanta[at];
            }
        }
        assert_eq!(back, tile);
        // Decoded once more, what has no weight is the same too.
        let again = decode(&encode(&back, None, &facts()), key, None, &facts()).unwrap();
        assert_eq!(decode(&bytes, key, None, &facts()).unwrap(), again);
    }
}

#[test]
fn a_tile_takes_every_second_sample_from_its_parent() {
    let (parent, child) = (tile(PageKey::new(0, 6, 10, 11), 50), PageKey::new(0, 7, 21, 22));
    let mut fine = tile(child, 50);
    let (above, below) = (&parent.layers[0], &mut fine.layers[0]);
    let known = Known::of(Some(&parent), child, 1).unwrap();
    let places: Vec<_> = (0..SAMPLES).filter_map(|at| Some((at, known.place(at)?))).collect();
    for (at, place) in places {
        below.quanta[at] = above.quanta[place];
        below.weights.as_mut().unwrap()[at] = above.weight(place);
    }
    for at in 0..SAMPLES {
        if below.weight(at) == 0 {
            below.quanta[at] = 0;
        }
    }
    let bytes = encode(&parent, None, &facts());
    let parent = decode(&bytes, parent.key, None, &facts()).unwrap();
    let bytes = encode(&fine, Some(&parent), &facts());
    assert_eq!(decode(&bytes, child, Some(&parent), &facts()), Ok(fine.clone()));
    assert!(bytes.len() < encode(&fine, None, &facts()).len() * 9 / 10);
}

#[test]
fn smooth_ground_takes_less_than_a_bit_a_sample() {
    let key = PageKey::new(1, 12, 5, 6);
    let mut tile = tile(key, 1);
    tile.layers[0].weights = None;
    let bytes = encode(&tile, None, &facts()).len();
    assert!(bytes < SAMPLES / 8, "{bytes}");
}

#[test]
fn damaged_bytes_are_told_apart_from_foreign_ones() {
    let key = PageKey::new(3, 12, 77, 4000);
    let bytes = encode(&tile(key, 9), None, &facts());
    assert_eq!(decode(&[], key, None, &facts()), Err(TileFault::Short { found: 0 }));
    assert_eq!(decode(&bytes[..40], key, None, &facts()), Err(TileFault::Damaged));
    assert_eq!(decode(&bytes, PageKey::root(0), None, &facts()), Err(TileFault::Damaged));
    let mut other = bytes.clone();
    other[0] = 7;
    assert_eq!(decode(&other, key, None, &facts()), Err(TileFault::Version { found: 7 }));
    for at in 1..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (at % 8);
        assert_eq!(decode(&flipped, key, None, &facts()), Err(TileFault::Damaged), "byte {at}");
    }
}

#[test]
fn whatever_the_bytes_decoding_ends() {
    let key = PageKey::new(3, 4, 7, 4);
    for seed in 0..300_u64 {
        let length = 3 + mix(seed) % 3000;
        let mut bytes: Vec<u8> =
            (0..length).map(|at| mix(seed << 20 | at).to_le_bytes()[0]).collect();
        bytes[0] = VERSION;
        let sum = check_sum(key, &bytes);
        bytes.extend(sum.to_le_bytes());
        if let Ok(tile) = decode(&bytes, key, None, &facts()) {
            assert!(tile.layers.iter().all(|layer| layer.sea_level.len() <= SAMPLES));
        }
    }
}

//! Samples of many points at once against those of each.
//!
//! In:    planets of both styles and of every size, points scattered and close together.
//! Out:   failures with the point whose bits differ.
//! Keeps: nothing.
//! Not here: whether the samples are right (`tests`).

use glam::DVec3;

use super::lanes::BLOCK;
use super::tests::{Dice, planet};
use super::{Layers, Planet, ProceduralSettings, Sample, Style};

const EMPTY: Sample = Sample {
    height_m: f64::NAN,
    layers: Layers { roughness: 1, rock: 2, moisture: 3, temperature: 4 },
    ruggedness: f64::NAN,
};

fn bits(sample: &Sample) -> (u64, u64, Layers) {
    (sample.height_m.to_bits(), sample.ruggedness.to_bits(), sample.layers)
}

/// Asks in batches of so many, whole blocks and parts of blocks.
fn check(planet: &Planet, normals: &[DVec3], batch: usize) {
    for normals in normals.chunks(batch) {
        let mut samples = vec![EMPTY; normals.len()];
        planet.samples(normals, &mut samples);
        for (&n, sample) in normals.iter().zip(&samples) {
            assert_eq!(bits(sample), bits(&planet.sample(n)), "{n}: {sample:?}");
        }
    }
}

/// Points around a centre, as far apart as a page's at some depth.
fn patch(centre: DVec3, wide: f64, dice: &mut Dice) -> Vec<DVec3> {
    let east = centre.cross(dice.direction()).normalize();
    let north = centre.cross(east);
    let at = |i: u32, j: u32| {
        let [x, y] = [i, j].map(|k| (f64::from(k) / 16.0 - 0.5) * wide);
        (centre + east * x + north * y).normalize()
    };
    (0..17).flat_map(|j| (0..17).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect()
}

/// The roughest, the highest, the deepest of some points, and the one nearest the shore.
fn places(planet: &Planet, dice: &mut Dice) -> [DVec3; 4] {
    let points: Vec<_> = (0..300).map(|_| dice.direction()).collect();
    let samples = points.iter().map(|&n| planet.sample(n)).collect::<Vec<_>>();
    let most = |rank: &dyn Fn(&Sample) -> f64| {
        let of = |i: &usize| rank(&samples[*i]);
        (0..points.len()).max_by(|a, b| of(a).total_cmp(&of(b))).map(|i| points[i]).unwrap()
    };
    [
        most(&|s| s.ruggedness),
        most(&|s| s.height_m),
        most(&|s| -s.height_m),
        most(&|s| -s.height_m.abs()),
    ]
}

#[test]
fn scattered_points_have_the_bits_they_have_alone() {
    let mut dice = Dice(21);
    let mut count = 0;
    for (style, radius_m, seed) in [
        (Style::Earthlike, 6_371_000.0, 1),
        (Style::Earthlike, 1_000.0, 2),
        (Style::Earthlike, 6_371_000.0, 3),
        (Style::Cratered, 1_737_400.0, 1),
    ] {
        let planet = planet(style, radius_m, seed);
        let points: Vec<_> = (0..20_000).map(|_| dice.direction()).collect();
        check(&planet, &points, 1000);
        count += points.len();
    }
    assert_eq!(count, 80_000);
}

#[test]
fn summits_depths_and_shores_have_the_bits_they_have_alone() {
    let mut dice = Dice(22);
    let mut count = 0;
    for (radius_m, seed) in [(6_371_000.0, 1), (1_000.0, 2), (1e9, 4), (500.0, 5)] {
        let planet = planet(Style::Earthlike, radius_m, seed);
        for place in places(&planet, &mut dice) {
            for wide in [0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6] {
                let points = patch(place, wide, &mut dice);
                check(&planet, &points, points.len());
                count += points.len();
            }
        }
    }
    assert_eq!(count, 4 * 4 * 6 * 289);
}

#[test]
fn odd_bodies_poles_and_axes_have_the_bits_they_have_alone() {
    let mut dice = Dice(23);
    let mut axes: Vec<_> = (0..27)
        .map(|i| DVec3::from_array([1, 3, 9].map(|part| f64::from(i / part % 3 - 1))))
        .filter(|v| *v != DVec3::ZERO)
        .map(DVec3::normalize)
        .collect();
    axes.extend(axes.clone().iter().map(|&n| DVec3::new(-0.0 * n.x, n.y, -0.0)));
    axes.extend(patch(DVec3::Z, 1e-5, &mut dice));
    axes.extend((0..1000).map(|_| dice.direction()));
    for style in [Style::Earthlike, Style::Cratered] {
        for radius_m in [500.0, 6_371_000.0, 1e9] {
            for (relief, finest_m) in
                [(0.0, 0.15), (1.0, 0.15), (1.0, 90.0), (3.0, 1.0), (1e-9, 1e5)]
            {
                let settings = ProceduralSettings { seed: 6, radius_m, style, relief, finest_m };
                check(&Planet::new(&settings), &axes, axes.len());
            }
        }
    }
}

#[test]
fn batches_of_every_size_have_the_same_bits() {
    let mut dice = Dice(24);
    let planet = planet(Style::Earthlike, 6_371_000.0, 1);
    for count in 0..2 * BLOCK + 9 {
        let points: Vec<_> = (0..count).map(|_| dice.direction()).collect();
        check(&planet, &points, count.max(1));
    }
}

#[test]
#[should_panic(expected = "a sample for every normal")]
fn fewer_samples_than_normals_are_refused() {
    planet(Style::Earthlike, 1_000.0, 2).samples(&[DVec3::Z; 2], &mut [EMPTY]);
}

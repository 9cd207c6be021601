//! What every procedural planet promises: the same bits, no seams, and bounds that hold.
//!
//! In:    planets of both styles, Earth, Moon and 1 km sized.
//! Out:   failures with the point and the two numbers that disagree.
//! Keeps: nothing.
//! Not here: beauty; look at the pictures of the `relief` example.

use glam::DVec3;

use super::noise::{Lattice, Lattices, PEAK, mix, unit};
use super::{Planet, ProceduralSettings, Sample, Style};

const EARTH_M: f64 = 6_371_000.0;
const MOON_M: f64 = 1_737_400.0;
const SMALL_M: f64 = 1000.0;
/// Edges in parts of the radius; from 100 km to 0.2 m on the Earth, and the whole body.
const SCALES: [f64; 10] = [0.3, 0.05, 1.6e-2, 3e-3, 6e-4, 1e-4, 1e-5, 1e-6, 2e-7, 3e-8];

pub(super) struct Dice(pub u64);

impl Dice {
    fn unit(&mut self) -> f64 {
        self.0 = mix(self.0.wrapping_add(0x9E37_79B9_7F4A_7C15));
        unit(self.0)
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - DVec3::ONE;
            if (0.01..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

pub(super) fn planet(style: Style, radius_m: f64, seed: u64) -> Planet {
    Planet::new(&ProceduralSettings { seed, radius_m, style, relief: 1.0, finest_m: 0.15 })
}

fn all() -> [(Planet, f64); 4] {
    [
        (planet(Style::Earthlike, EARTH_M, 1), EARTH_M),
        (planet(Style::Cratered, MOON_M, 1), MOON_M),
        (planet(Style::Earthlike, SMALL_M, 2), SMALL_M),
        (planet(Style::Cratered, SMALL_M, 2), SMALL_M),
    ]
}

fn fold(hash: u64, sample: &Sample) -> u64 {
    let layers = sample.layers;
    let bytes = [layers.roughness, layers.rock, layers.moisture, layers.temperature];
    let bytes = u64::from(u32::from_le_bytes(bytes));
    let height = (sample.height_m + 0.0).to_bits();
    [height, sample.ruggedness.to_bits(), bytes].iter().fold(hash, |h, bits| mix(h ^ bits))
}

#[test]
fn a_thousand_samples_have_the_same_bits_as_ever() {
    let golden = all().map(|(planet, _)| {
        let mut dice = Dice(11);
        (0..1000).fold(0, |hash, _| fold(hash, &planet.sample(dice.direction())))
    });
    assert_eq!(golden, GOLDEN, "{golden:#018X?}");
}

/// A change here moves every mountain: mint it only together with the reason in the commit.
const GOLDEN: [u64; 4] =
    [0xA249FCA3F88640A9, 0x32D128DC0B3FB785, 0x480982BA9112B3B6, 0xBDA652747B080C5E];

#[test]
fn noise_stays_within_its_peak_and_has_no_bias() {
    let mut dice = Dice(3);
    let lattice = Lattice::new(1.0, 9);
    let (mut sum, mut most) = (0.0, 0.0_f64);
    for _ in 0..100_000 {
        let value = lattice.value(dice.direction() * (1000.0 * dice.unit()));
        sum += value;
        most = most.max(value.abs());
    }
    assert!((0.67..=PEAK).contains(&most), "{most}");
    assert!((sum / 100_000.0).abs() < 0.01, "{sum}");
}

#[test]
fn narrow_noise_differs_little_from_exact_and_fine_noise_is_as_lively() {
    let mut dice = Dice(13);
    let lattice = Lattice::new(1.0, 9);
    let cells = |at| Lattices::new([lattice, Lattice::new(2.0, 5)]).cells(at);
    let (mut exact, mut fine, mut both) = (0.0, 0.0, 0.0);
    for _ in 0..50_000 {
        let at = dice.direction() * (1000.0 * dice.unit());
        let [cell, _] = cells(at);
        let value = lattice.value(at);
        assert_eq!(value, cell.value(), "{at}");
        assert!((value - cell.narrow_value()).abs() < 1e-6, "{at}");
        let other = cell.fine_value();
        assert!(other.abs() <= PEAK, "{at}: {other}");
        (exact, fine, both) = (exact + value * value, fine + other * other, both + value * other);
    }
    assert!((0.97..1.03).contains(&(fine / exact)), "{fine} {exact}");
    assert!(both.abs() < 0.03 * exact, "{both} {exact}");
}

#[test]
fn the_gradient_is_the_slope_of_the_noise() {
    let mut dice = Dice(4);
    let lattice = Lattice::new(10.0, 9);
    for _ in 0..1000 {
        let (at, along) = (dice.direction() * 500.0, dice.direction());
        let (value, gradient) = lattice.value_and_gradient(at);
        assert!((value - lattice.value(at)).abs() < 1e-12);
        let ahead = lattice.value(at + along * 1e-4);
        let behind = lattice.value(at - along * 1e-4);
        let slope = (ahead - behind) / 2e-4;
        assert!((slope - gradient.dot(along)).abs() < 1e-5, "{slope} {gradient}");
    }
}

#[test]
fn heights_stay_in_the_stated_range_and_use_much_of_it() {
    for (planet, radius_m) in all() {
        let [low_m, high_m] = planet.height_range_m();
        let mut dice = Dice(5);
        let (mut lowest_m, mut highest_m) = (f64::MAX, f64::MIN);
        for _ in 0..30_000 {
            let sample = planet.sample(dice.direction());
            assert!((0.0..=1.0).contains(&sample.ruggedness), "{sample:?}");
            lowest_m = lowest_m.min(sample.height_m);
            highest_m = highest_m.max(sample.height_m);
        }
        assert!(low_m <= lowest_m && highest_m <= high_m, "{lowest_m} {highest_m}");
        assert!(highest_m - lowest_m > 0.25 * (high_m - low_m), "{low_m}..{high_m}");
        assert!(high_m - low_m < 0.2 * radius_m, "{low_m}..{high_m}");
    }
}

#[test]
fn about_a_third_of_any_earthlike_planet_is_land() {
    for seed in 0..8 {
        for radius_m in [EARTH_M, SMALL_M] {
            let planet = planet(Style::Earthlike, radius_m, seed);
            let mut dice = Dice(6);
            let land = (0..2000).filter(|_| planet.sample(dice.direction()).height_m > 0.0).count();
            assert!((500..900).contains(&land), "seed {seed} radius {radius_m}: {land} of 2000");
        }
    }
}

#[test]
fn the_moon_has_maria_and_mostly_highlands() {
    let planet = planet(Style::Cratered, MOON_M, 1);
    let mut dice = Dice(7);
    let maria = (0..5000).filter(|_| planet.sample(dice.direction()).layers.moisture > 128).count();
    assert!((250..2000).contains(&maria), "{maria} of 5000");
}

#[test]
fn poles_axes_and_diagonals_are_as_good_as_any_point() {
    for (planet, _) in all() {
        let [low_m, high_m] = planet.height_range_m();
        for i in 0..27 {
            let part = |divisor: i32| f64::from(i / divisor % 3 - 1);
            let v = DVec3::new(part(1), part(3), part(9));
            if v == DVec3::ZERO {
                continue;
            }
            let sample = planet.sample(v.normalize());
            assert!((low_m..=high_m).contains(&sample.height_m), "{v} {sample:?}");
        }
    }
}

#[test]
fn the_surface_has_no_steps() {
    for (planet, radius_m) in all() {
        let mut dice = Dice(8);
        for _ in 0..20_000 {
            let n = dice.direction();
            let near = (n + dice.direction() * 1e-12).normalize();
            let apart_m = (planet.sample(n).height_m - planet.sample(near).height_m).abs();
            // Slopes stay below 10, so a picoradian changes a height by less than this; narrow
            // noise has steps of 1e-6 of its amplitude.
            assert!(apart_m < 1e-11 * radius_m + 5e-6, "{n}: {apart_m}");
        }
    }
}

#[test]
fn ruggedness_changes_no_faster_than_stated() {
    for (planet, radius_m) in all() {
        let mut dice = Dice(9);
        let slope_per_m = planet.ruggedness_slope_per_m();
        for i in 0..20_000 {
            let n = dice.direction();
            let step = [1e-5, 1e-3, 1e-2][i % 3];
            let near = (n + dice.direction() * step).normalize();
            let apart = (planet.sample(n).ruggedness - planet.sample(near).ruggedness).abs();
            let distance_m = (n - near).length() * radius_m;
            assert!(apart <= slope_per_m * distance_m, "{n}: {apart} in {distance_m} m");
        }
    }
}

/// Half of the points anywhere, half where the ground is rugged.
fn corner(planet: &Planet, dice: &mut Dice) -> DVec3 {
    let mut n = dice.direction();
    if dice.unit() < 0.5 {
        for _ in 0..10 {
            let other = dice.direction();
            if planet.sample(other).ruggedness > planet.sample(n).ruggedness {
                n = other;
            }
        }
    }
    n
}

#[test]
fn residual_and_variation_bounds_hold_on_random_triangles() {
    for (planet, radius_m) in all() {
        let mut dice = Dice(10);
        for scale in SCALES {
            if scale * radius_m < 0.1 {
                continue;
            }
            for _ in 0..250 {
                check_triangle(&planet, radius_m, scale, &mut dice);
            }
        }
    }
}

fn check_triangle(planet: &Planet, radius_m: f64, scale: f64, dice: &mut Dice) {
    let a = corner(planet, dice);
    let east = a.cross(dice.direction()).normalize();
    let north = a.cross(east);
    // Slightly under an equilateral triangle, since pushing it out to the ball lengthens edges.
    let b = (a + east * (0.99 * scale)).normalize();
    let c = (a + east * (0.495 * scale) + north * (0.85 * scale)).normalize();
    let [sa, sb, sc] = [a, b, c].map(|n| planet.sample(n));
    let mut ruggedness_max = sa.ruggedness.max(sb.ruggedness).max(sc.ruggedness);
    let (mut residual_m, mut variation_m) = (0.0_f64, (sa.height_m - sb.height_m).abs());
    for _ in 0..8 {
        let (x, y) = (dice.unit(), dice.unit());
        let (x, y) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
        let z = 1.0 - x - y;
        let inside = planet.sample((a * x + b * y + c * z).normalize());
        let flat_m = sa.height_m * x + sb.height_m * y + sc.height_m * z;
        residual_m = residual_m.max((inside.height_m - flat_m).abs());
        variation_m = variation_m.max((inside.height_m - sa.height_m).abs());
        ruggedness_max = ruggedness_max.max(inside.ruggedness);
    }
    let edge_m = scale * radius_m;
    let bound_m = planet.residual_m(edge_m, ruggedness_max);
    assert!(residual_m <= bound_m, "{a} edge {edge_m}: {residual_m} > {bound_m}");
    let bound_m = planet.variation_m(edge_m, ruggedness_max);
    assert!(variation_m <= bound_m, "{a} edge {edge_m}: {variation_m} > {bound_m}");
}

#[test]
fn bounds_grow_with_distance_and_ruggedness() {
    for (planet, _) in all() {
        let mut last = [[0.0; 2]; 2];
        for i in 0..60 {
            let distance_m = 0.01 * (1.0 + f64::from(i * i * i * i));
            let at = |r| [planet.residual_m(distance_m, r), planet.variation_m(distance_m, r)];
            let now = [at(0.1), at(0.9)];
            for k in 0..2 {
                assert!(now[0][k] >= last[0][k] && now[1][k] >= last[1][k]);
                assert!(now[1][k] >= now[0][k]);
            }
            last = now;
        }
    }
}

#[test]
fn no_relief_is_a_smooth_ball() {
    for style in [Style::Earthlike, Style::Cratered] {
        let settings =
            ProceduralSettings { seed: 1, radius_m: MOON_M, style, relief: 0.0, finest_m: 0.15 };
        let planet = Planet::new(&settings);
        let mut dice = Dice(12);
        for _ in 0..100 {
            assert_eq!(planet.sample(dice.direction()).height_m.abs(), 0.0);
        }
    }
}

//! Heights, contacts, rays and sights over resident pages, timed.
//!
//! In:    pages of the procedural Earth along a flight; copies of them, up to 10⁴.
//! Out:   criterion's report.
//! Keeps: nothing.
//! Not here: whether the answers are right (`tests/ground.rs`).

#[path = "../tests/rig/mod.rs"]
mod rig;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use glam::DVec3;
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::ground::{Answer, Ground, Query, Refraction, Region};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

const EARTH: Ellipsoid = Ellipsoid::WGS84;
/// Samples 38 m apart: SRTM's spacing. Its pages have depth 12 and are 2.4 km wide.
const LEVEL: u8 = 36;
const QUERY: Query = Query::Exact(LEVEL);
/// Length of the flight eastward whose pages are real.
const TRACK_M: f64 = 60_000.0;

fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

/// The place `east_m` along the track and `north_m` beside it.
fn on_track(east_m: f64, north_m: f64) -> Geodetic {
    let start = Geodetic::from_degrees(46.8, -121.8, 0.0);
    let away = start.enu_axes() * DVec3::new(east_m, north_m, 0.0);
    let there = EARTH.geodetic_from_ecef(Ecef(EARTH.ecef_from_geodetic(start).0 + away));
    Geodetic { height_m: 0.0, ..there }
}

/// The ground within 2 km of the track.
fn track() -> Ground {
    let generator = Generator::new(&rig::scene(4, 30_000));
    let mut ground = Ground::new(EARTH, true);
    for step in 0..=30 {
        let region =
            Region { centre: on_track(f64::from(step) * TRACK_M / 30.0, 0.0), radius_m: 2e3 };
        for key in ground.pages_of(region, LEVEL, 10_000).expect("a small region") {
            if !ground.contains(key) {
                ground.insert(generator.page(key));
            }
        }
    }
    println!("{} pages along the track", ground.pages());
    ground
}

/// A ground of `count` pages around the track's start: one page's content under many names. The
/// radius within which all are there.
fn wide(count: u32) -> (Ground, f64) {
    let generator = Generator::new(&rig::scene(4, 30_000));
    let content = generator.page(PageKey::new(0, 12, 5, 7));
    let mut ground = Ground::new(EARTH, true);
    let centre = on_track(0.0, 0.0);
    let keys_of = |radius_m: f64| {
        let region = Region { centre, radius_m };
        Ground::new(EARTH, true).pages_of(region, LEVEL, count)
    };
    let mut radius_m = 1_000.0;
    while keys_of(radius_m * 1.02).is_ok() {
        radius_m *= 1.02;
    }
    for key in keys_of(radius_m).expect("few pages") {
        ground.insert(Arc::new(Page { key, ..(*content).clone() }));
    }
    (ground, radius_m)
}

fn place_within(radius_m: f64, seed: u64) -> Geodetic {
    let turn = Geodetic::from_degrees(0.0, 360.0 * unit(seed ^ 1), 0.0).normal();
    let away_m = radius_m * unit(seed ^ 2).sqrt();
    on_track(away_m * turn.x, away_m * turn.y)
}

fn places_on_track(count: u64) -> Vec<Geodetic> {
    (0..count).map(|i| on_track(10_000.0 + 30.0 * i as f64, 0.0)).collect()
}

fn places_scattered(count: u64) -> Vec<Geodetic> {
    let across = |i: u64| 3_000.0 * (unit(i ^ 1) - 0.5);
    (0..count).map(|i| on_track(TRACK_M * unit(i), across(i))).collect()
}

fn single(criterion: &mut Criterion, ground: &Ground) {
    let places = places_scattered(1024);
    let mut turn = 0;
    let mut next = move || {
        turn = (turn + 1) % places.len();
        places[turn]
    };
    let points = places_scattered(1024).into_iter().map(|place| {
        let height_m = 100.0 + ground.height(place, QUERY).ok().expect("resident").height_m;
        EARTH.ecef_from_geodetic(Geodetic { height_m, ..place })
    });
    let points: Vec<_> = points.collect();
    let mut at = 0;
    criterion.bench_function("height", |b| b.iter(|| ground.height(black_box(next()), QUERY)));
    criterion.bench_function("agl", |b| {
        b.iter(|| {
            at = (at + 1) % points.len();
            ground.agl(black_box(points[at]), QUERY)
        });
    });
}

fn batches(criterion: &mut Criterion, ground: &Ground) {
    let mut group = criterion.benchmark_group("heights of 1024");
    group.throughput(Throughput::Elements(1024));
    let mut answers = vec![Answer::NotReady; 1024];
    for (name, places) in [("track", places_on_track(1024)), ("scattered", places_scattered(1024))]
    {
        for (asked, query) in [("exact", QUERY), ("best resident", Query::BestResident)] {
            group.bench_function(BenchmarkId::new(name, asked), |b| {
                b.iter(|| ground.heights(black_box(&places), query, &mut answers));
            });
        }
    }
    group.finish();
}

fn growth(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("heights of 1024 scattered over pages");
    group.throughput(Throughput::Elements(1024));
    let mut answers = vec![Answer::NotReady; 1024];
    for count in [100, 1_000, 10_000] {
        let (ground, radius_m) = wide(count);
        let places: Vec<_> = (0..1024).map(|i| place_within(radius_m, i)).collect();
        group.bench_function(BenchmarkId::from_parameter(ground.pages()), |b| {
            b.iter(|| ground.heights(black_box(&places), QUERY, &mut answers));
        });
        assert!(answers.iter().all(|answer| matches!(answer, Answer::Ok(_))));
        group.bench_function(BenchmarkId::new("one by one", ground.pages()), |b| {
            b.iter(|| places.iter().filter(|&&at| ground.height(at, QUERY).ok().is_some()).count());
        });
    }
    group.finish();
}

/// Rays along the track: origins this high above the ground, pitched within this range.
fn rays(ground: &Ground, agl_m: [f64; 2], pitch: [f64; 2]) -> Vec<(Ecef, DVec3)> {
    let between = |[low, high]: [f64; 2], seed: u64| low + (high - low) * unit(seed);
    (0..256)
        .map(|i| {
            let place = on_track(1_000.0 + 8_000.0 * unit(i), 0.0);
            let ground_m = ground.height(place, QUERY).ok().expect("resident").height_m;
            let height_m = ground_m + between(agl_m, i ^ 3);
            let from = Geodetic { height_m, ..place };
            let local = DVec3::new(1.0, 0.02 * (unit(i ^ 5) - 0.5), between(pitch, i ^ 4));
            (EARTH.ecef_from_geodetic(from), from.enu_axes() * local)
        })
        .collect()
}

fn lines(criterion: &mut Criterion, ground: &Ground) {
    let mut group = criterion.benchmark_group("ray to 50 km");
    for (name, agl_m, pitch) in [
        ("from 1 to 5 km, downward", [1e3, 5e3], [-0.2, -0.05]),
        ("from 50 to 500 m, near level", [50.0, 500.0], [-0.05, 0.02]),
        ("from 5 km, near level", [4e3, 5e3], [-0.03, 0.0]),
        ("from 20 m, upward", [10.0, 30.0], [0.1, 0.3]),
    ] {
        let rays = rays(ground, agl_m, pitch);
        let hits: Vec<_> = rays
            .iter()
            .filter_map(|&(from, along)| ground.ray(from, along, 5e4, QUERY).found().flatten())
            .collect();
        let mean_km = hits.iter().map(|hit| hit.distance_m).sum::<f64>() / 1e3 / hits.len() as f64;
        println!("{name}: {} of {} hit, at {mean_km:.1} km in the mean", hits.len(), rays.len());
        let mut at = 0;
        group.bench_function(name, |b| {
            b.iter_batched(
                || {
                    at = (at + 1) % rays.len();
                    rays[at]
                },
                |(from, along)| ground.ray(from, along, 5e4, QUERY),
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
    let ends = [5_000.0, 55_000.0].map(|east_m| {
        let place = on_track(east_m, 0.0);
        let ground_m = ground.height(place, QUERY).ok().expect("resident").height_m;
        EARTH.ecef_from_geodetic(Geodetic { height_m: ground_m + 2_000.0, ..place })
    });
    criterion.bench_function("line of sight over 50 km", |b| {
        let sight =
            || ground.line_of_sight(ends[0], black_box(ends[1]), Refraction::FourThirds, QUERY);
        b.iter(sight);
    });
}

fn upkeep(criterion: &mut Criterion, ground: &Ground) {
    let region = Region { centre: on_track(20_000.0, 0.0), radius_m: 500.0 };
    let key = ground.pages_of(region, LEVEL, 1_000).expect("few pages").pop().expect("some");
    let mut changed = ground.clone();
    let page = changed.remove(key).expect("resident");
    criterion.bench_function("snapshot", |b| b.iter(|| ground.clone()));
    criterion.bench_function("insert", |b| b.iter(|| changed.insert(Arc::clone(&page))));
    criterion.bench_function("min and max over 500 m", |b| b.iter(|| ground.min_max(region)));
    let small = Region { radius_m: 60.0, ..region };
    let mut patch = ground.collision_patch(small, LEVEL, 10_000).expect("resident");
    let triangles = patch.triangles.len();
    criterion.bench_function(&format!("patch of {triangles} triangles"), |b| {
        b.iter(|| ground.fill_patch(small, LEVEL, 10_000, &mut patch));
    });
}

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1_200))
        .sample_size(50)
        .configure_from_args();
    let ground = track();
    single(&mut criterion, &ground);
    batches(&mut criterion, &ground);
    lines(&mut criterion, &ground);
    upkeep(&mut criterion, &ground);
    growth(&mut criterion);
    criterion.final_summary();
}

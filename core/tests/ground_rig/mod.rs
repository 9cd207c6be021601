//! Ground for tests: pages of the procedural Earth around chosen places, with or without a survey.
//!
//! In:    seeds, regions, levels.
//! Out:   grounds, pages, random places.
//! Keeps: nothing.
//! Not here: what is asserted.
#![allow(dead_code, missing_docs, reason = "each test binary uses its part of the rig")]

#[path = "../rig/mod.rs"]
mod rig;

use glam::DVec3;
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::page::{Origin, SAMPLES, Survey};
use overfly_core::datasource::{PAGE_SIDE, Page, PageKey};
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ellipsoid, Geodetic, narrow};
use overfly_core::ground::{Ground, Region};
use overfly_core::lattice::normal_of;
pub use rig::*;
use std::sync::Arc;

pub const EARTH: Ellipsoid = Ellipsoid::WGS84;

/// A number in [0, 1) that looks random.
pub fn unit(seed: u64) -> f64 {
    (mix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

pub fn generator() -> Generator {
    Generator::new(&scene(4, 30_000))
}

pub fn at(lat_deg: f64, lon_deg: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, 0.0)
}

pub fn disc(centre: Geodetic, radius_m: f64) -> Region {
    Region { centre, radius_m }
}

/// The point this far east and north of `from`, roughly.
pub fn beside(from: Geodetic, east_m: f64, north_m: f64) -> Geodetic {
    let away = from.enu_axes() * DVec3::new(east_m, north_m, 0.0);
    let point = EARTH.ecef_from_geodetic(from).0 + away;
    let there = EARTH.geodetic_from_ecef(overfly_core::geodesy::Ecef(point));
    Geodetic { height_m: from.height_m, ..there }
}

/// A random place of a disc.
pub fn place_in(region: Region, seed: u64) -> Geodetic {
    let radius_m = region.radius_m * unit(seed ^ 0xA1).sqrt();
    let turn = Geodetic::from_degrees(0.0, 360.0 * unit(seed ^ 0xB2), 0.0).normal();
    beside(region.centre, radius_m * turn.x, radius_m * turn.y)
}

/// High and rugged ground: the most rugged of some thousand places above 1000 m.
pub fn mountain(generator: &Generator) -> Geodetic {
    let places = (0..4000_u64).map(|i| at(140.0 * unit(i) - 70.0, 360.0 * unit(!i) - 180.0));
    let rated = places.map(|place| (generator.planet().unwrap().sample(place.normal()), place));
    let high = rated.filter(|(sample, _)| sample.height_m > 1000.0);
    high.max_by(|a, b| a.0.ruggedness.total_cmp(&b.0.ruggedness)).expect("there are mountains").1
}

/// A shore: of neighbours along a meridian, the first that lie on both sides of sea level.
pub fn shore(generator: &Generator) -> Geodetic {
    let wet = |i: i32| {
        generator.planet().unwrap().sample(at(f64::from(i) * 0.01, 20.0).normal()).height_m < 0.0
    };
    let first = (-6000..6000).find(|&i| wet(i) != wet(i + 1)).expect("there are shores");
    at(f64::from(first) * 0.01 + 0.005, 20.0)
}

/// The pages of a region at a level, parents first.
pub fn pages_of(generator: &Generator, region: Region, level: u8) -> Vec<Arc<Page>> {
    let keys = Ground::new(EARTH, true).pages_of(region, level, 10_000).expect("a small region");
    keys.into_iter().map(|key| generator.page(key)).collect()
}

/// The geoid of tests: tens of metres high, and smooth.
pub fn sea_level_m(normal: DVec3) -> f32 {
    narrow(30.0 + 40.0 * normal.x * normal.y - 25.0 * normal.z * normal.z)
}

/// The same page with a survey: sea level, and origins in stripes.
pub fn surveyed(page: &Page) -> Arc<Page> {
    let mut survey = Survey {
        sea_level_m: [0.0; SAMPLES],
        // No two places of the geoid below are farther apart.
        sea_level_variation_m: 65.0,
        origin: [Origin::Measured; SAMPLES],
    };
    for at in 0..SAMPLES {
        let point = page.key.sample(at % PAGE_SIDE, at / PAGE_SIDE);
        survey.sea_level_m[at] = sea_level_m(normal_of(point));
        if point.x >> page.key.step().trailing_zeros() & 1 == 1 {
            survey.origin[at] = Origin::Filled;
        }
    }
    Arc::new(Page { survey: Some(Box::new(survey)), ..page.clone() })
}

pub fn ground_of(pages: &[Arc<Page>], sea: bool) -> Ground {
    let mut ground = Ground::new(EARTH, sea);
    for page in pages {
        ground.insert(Arc::clone(page));
    }
    ground
}

/// All pages of a rig's terrain.
pub fn resident_pages(rig: &Rig) -> Vec<Arc<Page>> {
    let pages = rig.terrain.pages();
    let mut open: Vec<_> = pages.roots().expect("the roots have arrived").to_vec();
    let mut all = Vec::new();
    while let Some(id) = open.pop() {
        all.push(Arc::clone(pages.page[id].as_ref().expect("resident")));
        open.extend(pages.children[id].into_iter().flatten());
    }
    all
}

pub fn remove(ground: &mut Ground, key: PageKey) {
    ground.remove(key).expect("it was resident");
}

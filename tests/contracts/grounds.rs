//! The ground of a running scene: what is resident, what was requested, what a surveyor loads.
//!
//! In:    an archive of hills, the small planet.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: heights themselves (`core/tests/ground.rs`).

use super::flights::Tour;
use super::hills::{DEPTH, Hills};
use overfly::core::datasource::page::Origin;
use overfly::core::geodesy::Geodetic;
use overfly::core::ground::{Answer, Place, Query, Region, RegionFault};
use overfly::core::units::Metres;
use overfly::sources::level_of;
use overfly::{RequestError, Ticket};

/// Evenly spread places, poles and borders of pages among them.
fn places(count: u32) -> Vec<Geodetic> {
    let spread = (0..count).map(|i| {
        let up = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        Geodetic::from_degrees(up * 90.0, (f64::from(i) * 137.508) % 360.0 - 180.0, 0.0)
    });
    let corners = [(90.0, 0.0), (-90.0, 0.0), (0.0, 0.0), (0.0, 180.0), (45.0, 45.0), (0.0, -90.0)];
    spread.chain(corners.map(|(lat, lon)| Geodetic::from_degrees(lat, lon, 0.0))).collect()
}

fn same_pages(tour: &mut Tour) {
    let ground = tour.overfly.ground();
    let pages = tour.overfly.terrain().pages();
    let resident = pages.page.as_slice().iter().flatten();
    assert!(resident.clone().all(|page| ground.contains(page.key)));
    assert_eq!(ground.pages(), resident.count());
}

#[test]
fn the_ground_has_the_lods_pages_whenever_it_is_asked_for() {
    let mut tour = Tour::new("descent", "small", 0);
    let before = tour.overfly.ground();
    for index in (0..9000).step_by(150) {
        tour.frame(index, false);
        if index % 900 == 0 {
            same_pages(&mut tour);
        }
    }
    same_pages(&mut tour);
    assert_eq!(before.pages(), 0, "a snapshot never changes");
    let at = tour.flight.poses[9000].at;
    let height = tour.overfly.ground().height(at, Query::BestResident).ok().unwrap();
    let truth_m = tour.overfly.ground_height_m(at).unwrap().max(0.0);
    assert!((height.height_m - truth_m).abs() <= height.bound_m, "{height:?} {truth_m}");
}

fn wait_for(tour: &mut Tour, region: Region, level: u8) {
    for _ in 0..100_000 {
        tour.frame(0, false);
        if tour.overfly.readiness(region, level).unwrap().missing == 0 {
            return;
        }
        std::thread::yield_now();
    }
    panic!("the region never came: {:?}", tour.overfly.faults().next());
}

#[test]
fn a_requested_region_comes_in_later_frames_and_stays_until_released() {
    let hills = Hills::new();
    let mut tour = Tour::new("poles", &hills.scene_name(), 0);
    tour.settle(0);
    let region = Region { centre: Geodetic::from_degrees(-50.0, 40.0, 0.0), radius_m: 30.0 };
    let level = level_of(DEPTH + 2);
    let lod_alone = tour.overfly.ground();
    assert!(tour.overfly.readiness(region, level).unwrap().missing > 0);
    let first: Ticket = tour.overfly.request(region, level).unwrap();
    let second: Ticket = tour.overfly.request(region, level).unwrap();
    wait_for(&mut tour, region, level);
    let ground = tour.overfly.ground();
    assert!(matches!(ground.height(region.centre, Query::Exact(level)), Answer::Ok(_)));
    tour.overfly.release(first);
    assert_eq!(tour.overfly.ground().pages(), ground.pages(), "the other ticket holds them");
    tour.overfly.release(second);
    assert_eq!(tour.overfly.ground().pages(), lod_alone.pages());
    assert!(matches!(ground.height(region.centre, Query::Exact(level)), Answer::Ok(_)), "kept");
}

#[test]
fn requests_that_are_too_large_are_refused_with_the_limit() {
    let mut tour = Tour::new("poles", "small", 0);
    let pages_max = tour.overfly.terrain().limits().pages;
    let all = Region { centre: Geodetic::from_degrees(0.0, 0.0, 0.0), radius_m: 4000.0 };
    let refused = tour.overfly.request(all, 30).unwrap_err();
    assert!(matches!(refused, RequestError::Region(RegionFault::TooLarge { pages_max: max })
            if max == pages_max));
    // All of the planet fits once, but not twice over at another level.
    let level = (12..30).rev().step_by(2).find(|&level| {
        let ticket = tour.overfly.request(all, level);
        ticket.map(|ticket| tour.overfly.release(ticket)).is_ok()
    });
    let level = level.unwrap();
    let held = tour.overfly.request(all, level).unwrap();
    // The largest region of the next pages that would fit, were it alone.
    let full = (1..200).rev().find_map(|i| {
        let region = Region { radius_m: 20.0 * f64::from(i), ..all };
        match tour.overfly.request(region, level + 2) {
            Err(RequestError::Region(_)) => None,
            other => Some(other.map(drop)),
        }
    });
    let full = full.expect("some region fits").expect_err("there is no room beside the first");
    let RequestError::Full { held: pages, more, .. } = full else { panic!("{full}") };
    assert!(more <= pages_max && pages + more > pages_max, "{full}");
    assert!(full.to_string().contains(&pages_max.to_string()), "{full}");
    tour.overfly.release(held);
    assert_eq!(tour.overfly.ground().pages(), 0);
}

#[test]
fn a_surveyor_answers_everywhere_with_the_same_bits_in_any_order() {
    let hills = Hills::new();
    let tour = Tour::new("poles", &hills.scene_name(), 0);
    let places = places(40);
    let queries = [Query::BestResident, Query::Exact(19), Query::Within(Metres(20.0))];
    let answers = |places: &mut dyn Iterator<Item = &Geodetic>, pages_max| -> Vec<_> {
        let mut surveyor = tour.overfly.surveyor(pages_max);
        let all = |at: &Geodetic| queries.map(|query| surveyor.height(*at, query).unwrap());
        places.map(all).collect()
    };
    let forward = answers(&mut places.iter(), 1000);
    let mut backward = answers(&mut places.iter().rev(), 0);
    backward.reverse();
    assert_eq!(forward, backward);
    for (at, answers) in places.iter().zip(&forward) {
        assert!(answers.iter().all(|answer| matches!(answer, Answer::Ok(_))), "{at:?} {answers:?}");
    }
}

#[test]
fn a_surveyors_best_is_the_datas_level_or_the_planets() {
    let hills = Hills::new();
    let tour = Tour::new("poles", &hills.scene_name(), 0);
    let mut surveyor = tour.overfly.surveyor(0);
    let mut best = |lat_deg, lon_deg| {
        let at = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
        surveyor.height(at, Query::BestResident).unwrap().ok().unwrap()
    };
    let inside = best(20.0, 45.0);
    assert_eq!((inside.level, inside.origin), (level_of(DEPTH), Origin::Measured));
    let outside = best(20.0, -45.0);
    // 1571 m of quadrant in 2^11 parts are 77 cm.
    assert_eq!((outside.level, outside.origin), (22, Origin::Procedural));
    let at = Geodetic::from_degrees(20.0, -45.0, 0.0);
    let truth_m = tour.overfly.ground_height_m(at).unwrap().max(0.0);
    assert!((outside.height_m - truth_m).abs() <= outside.bound_m);
    assert_eq!(tour.overfly.sources().data_level(Place::of(at.normal())).unwrap(), None);
}

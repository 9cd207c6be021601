//! Heights, contacts, rays and sights through the C border are the façade's, from any thread.
//!
//! In:    the flight of `examples/c/flight.c`, places around it.
//! Out:   test results.
//! Keeps: nothing.
//! Not here: how heights are found (`overfly_core::ground`).

use super::calls::*;
use overfly::core::frame::FrameOutput;
use overfly::core::geodesy::{Ecef, Geodetic};
use overfly::core::ground::{Answer, Ground, Query, Refraction, Sight};
use overfly::core::units::Metres;
use overfly_c::ground::*;
use overfly_c::queries::*;
use overfly_c::rays::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

const PLACES: usize = 200;

/// Places all over the planet, and two that are none.
fn places() -> (Vec<f64>, Vec<f64>) {
    let mut lat: Vec<f64> = (0..PLACES).map(|i| -1.5 + 0.015 * i as f64).collect();
    let mut lon: Vec<f64> = (0..PLACES).map(|i| 0.37 * i as f64 - 30.0).collect();
    (lat[7], lon[11]) = (f64::NAN, f64::INFINITY);
    (lat, lon)
}

fn queries() -> [(ovf_query, Query); 3] {
    let query = |kind, level, bound_max_m| ovf_query { kind, level, bound_max_m, ..sized() };
    [
        (query(OVF_QUERY_EXACT, 13, 0.0), Query::Exact(13)),
        (query(OVF_QUERY_BEST_RESIDENT, 0, 0.0), Query::BestResident),
        (query(OVF_QUERY_WITHIN, 0, 3.0), Query::Within(Metres(3.0))),
    ]
}

/// Heights of all columns as bits: height, sea level, normals, bound; then codes and levels.
fn asked(ground: ovf_ground, query: &ovf_query) -> (ovf_status, Vec<u64>, Vec<[u8; 4]>) {
    let (lat, lon) = places();
    let at = ovf_places { lat_rad: lat.as_ptr(), lon_rad: lon.as_ptr(), ..sized() };
    let mut numbers = vec![0.0; 6 * PLACES];
    let mut bytes = vec![0_u8; 4 * PLACES];
    let (wide, narrow) = (numbers.as_mut_ptr(), bytes.as_mut_ptr());
    let columns = ovf_height_columns {
        height_m: wide,
        sea_level_m: wide.wrapping_add(PLACES),
        normal_ecef: wide.wrapping_add(2 * PLACES),
        bound_m: wide.wrapping_add(5 * PLACES),
        answer: narrow,
        level: narrow.wrapping_add(PLACES),
        origin: narrow.wrapping_add(2 * PLACES),
        water: narrow.wrapping_add(3 * PLACES),
        ..sized()
    };
    // SAFETY: every column has its own part of the arrays, as long as there are places.
    let status = unsafe {
        ovf_ground_heights(ground, &raw const at, PLACES as u64, query, &raw const columns)
    };
    let codes = (0..PLACES).map(|i| [0, 1, 2, 3].map(|column| bytes[column * PLACES + i]));
    let codes = codes.collect();
    (status, numbers.into_iter().map(f64::to_bits).collect(), codes)
}

/// The same of a ground of the façade.
fn expected(ground: &Ground, query: Query) -> (Vec<u64>, Vec<[u8; 4]>) {
    let (lat, lon) = places();
    let mut numbers = vec![f64::NAN; 6 * PLACES];
    let mut codes = vec![[0_u8; 4]; PLACES];
    for i in 0..PLACES {
        let at = Geodetic { lat_rad: lat[i], lon_rad: lon[i], height_m: 0.0 };
        let answer = ground.height(at, query);
        codes[i][0] = match answer {
            Answer::Ok(_) => 1,
            Answer::Coarser(_) => 2,
            Answer::NotReady => 3,
            Answer::Refused => 4,
        };
        let Some(found) = answer.found() else { continue };
        codes[i][1..].copy_from_slice(&[found.level, found.origin as u8, u8::from(found.water)]);
        numbers[i] = found.height_m;
        numbers[PLACES + i] = found.sea_level_m;
        numbers[2 * PLACES + 3 * i..][..3].copy_from_slice(&found.normal.to_array());
        numbers[5 * PLACES + i] = found.bound_m;
    }
    (numbers.into_iter().map(f64::to_bits).collect(), codes)
}

fn ground_in_rust(frames: usize) -> Ground {
    let (mut overfly, mut out) = (opened_in_rust(), FrameOutput::default());
    (0..frames).for_each(|frame| fly_in_rust(&mut overfly, frame, &mut out));
    overfly.ground()
}

#[test]
fn heights_are_the_facades_in_batches_and_alone() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 20);
    let (ground, in_rust) = (ground_of(terrain), ground_in_rust(20));
    for (query, in_rust_query) in queries() {
        let (status, numbers, codes) = asked(ground, &query);
        let wanted = expected(&in_rust, in_rust_query);
        assert_eq!((status, &numbers, &codes), (OVF_OK, &wanted.0, &wanted.1));
        assert!(codes[7][0] == 4 && codes[11][0] == 4 && codes[0][0] <= 2);
        let (lat, lon) = places();
        for i in (0..PLACES).filter(|i| ![7, 11].contains(i)) {
            let mut height = sized::<ovf_height>();
            // SAFETY: all pointers are of values that outlive the call.
            must(unsafe {
                ovf_ground_height(ground, lat[i], lon[i], &raw const query, &raw mut height)
            });
            assert_eq!(height.height_m.to_bits(), numbers[i]);
            assert_eq!(height.answer, u32::from(codes[i][0]));
        }
    }
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn degrees_are_radians_written_otherwise() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 3);
    let ground = ground_of(terrain);
    let (lat_deg, lon_deg) = (12.5, -170.25);
    let query = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let mut batch = f64::NAN;
    let at = ovf_places { lat_deg: &raw const lat_deg, lon_deg: &raw const lon_deg, ..sized() };
    let columns = ovf_height_columns { height_m: &raw mut batch, ..sized() };
    // SAFETY: all pointers are of values that outlive the calls.
    must(unsafe {
        ovf_ground_heights(ground, &raw const at, 1, &raw const query, &raw const columns)
    });
    let rad = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
    let mut one = sized::<ovf_height>();
    // SAFETY: as above.
    must(unsafe {
        ovf_ground_height(ground, rad.lat_rad, rad.lon_rad, &raw const query, &raw mut one)
    });
    assert_eq!(batch.to_bits(), one.height_m.to_bits());
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn four_threads_get_the_same_bits_while_frames_run() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 10);
    let ground = ground_of(terrain);
    let alone = queries().map(|(query, _)| asked(ground, &query));
    let (stops, rounds) = (AtomicBool::new(false), AtomicU64::new(0));
    let ask = || {
        while !stops.load(Ordering::Relaxed) {
            let again = queries().map(|(query, _)| asked(ground, &query));
            assert!(again == alone);
            rounds.fetch_add(1, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        (0..4).for_each(|_| drop(scope.spawn(ask)));
        let mut frame = 10;
        while frame < 60 || rounds.load(Ordering::Relaxed) < 40 {
            fly(terrain, frame, None);
            must(ovf_ground_destroy(ground_of(terrain)));
            frame += 1;
        }
        stops.store(true, Ordering::Relaxed);
    });
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn contacts_rays_and_sights_are_the_facades() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 20);
    let (ground, in_rust) = (ground_of(terrain), ground_in_rust(20));
    let query = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let q = &raw const query;
    let body = *in_rust.body();
    for (lat_rad, height_m) in [(0.25, 300.0), (-0.9, -200.0), (1.4, 50.0)] {
        let at = Geodetic { lat_rad, lon_rad: 0.3, height_m };
        let point = body.ecef_from_geodetic(at);
        let mut ecef = [0.0; 3];
        let p = ecef.as_mut_ptr();
        // SAFETY: all pointers are of values that outlive the calls; so below.
        must(unsafe { ovf_ground_to_ecef(ground, lat_rad, 0.3, height_m, p) });
        assert_eq!(ecef, point.0.to_array());
        let [mut lat, mut lon, mut up] = [0.0; 3];
        // SAFETY: as above.
        must(unsafe { ovf_ground_to_geodetic(ground, p, &raw mut lat, &raw mut lon, &raw mut up) });
        let back = body.geodetic_from_ecef(point);
        assert_eq!([lat, lon, up], [back.lat_rad, back.lon_rad, back.height_m]);

        let mut contact = sized::<ovf_contact>();
        // SAFETY: as above.
        must(unsafe { ovf_ground_contact(ground, p, q, &raw mut contact) });
        let found = in_rust.agl(point, Query::BestResident).ok().unwrap();
        assert_eq!(contact.answer, OVF_ANSWER_OK);
        assert_eq!(contact.agl_m.to_bits(), found.agl_m.to_bits());
        assert_eq!(contact.contact_ecef_m, found.contact.0.to_array());
        assert_eq!(contact.normal_ecef, found.ground.normal.to_array());
        assert_eq!(contact.agl_m < 0.0, height_m < contact.height_m);

        let (down, mut hit) = (-point.0, sized::<ovf_hit>());
        let direction = down.to_array();
        // SAFETY: as above.
        must(unsafe {
            ovf_ground_ray(ground, p, direction.as_ptr(), f64::INFINITY, q, &raw mut hit)
        });
        let met = in_rust.ray(point, down, f64::INFINITY, Query::BestResident).found();
        let met = met.flatten().unwrap();
        assert_eq!((hit.hit, hit.distance_m), (1, met.distance_m));
        assert_eq!(hit.point_ecef_m, met.point.0.to_array());

        let far = [-1000.0, 0.0, 900.0];
        let mut sight = sized::<ovf_sight>();
        // SAFETY: as above.
        must(unsafe { ovf_ground_line_of_sight(ground, p, far.as_ptr(), 1, q, &raw mut sight) });
        let seen = in_rust.line_of_sight(
            point,
            Ecef(glam::DVec3::from_array(far)),
            Refraction::FourThirds,
            Query::BestResident,
        );
        match seen.found().unwrap() {
            Sight::Clear { clearance_m } => {
                assert_eq!((sight.blocked, sight.clearance_m), (0, clearance_m));
                assert!(sight.distance_m.is_nan());
            }
            Sight::Blocked(met) => {
                assert_eq!((sight.blocked, sight.distance_m), (1, met.distance_m));
                assert!(sight.clearance_m.is_nan());
            }
        }
    }
    let (up, mut hit) = ([2000.0, 0.0, 0.0], sized::<ovf_hit>());
    // SAFETY: as above.
    must(unsafe { ovf_ground_ray(ground, up.as_ptr(), up.as_ptr(), 1e9, q, &raw mut hit) });
    assert_eq!((hit.hit, hit.distance_m.is_nan()), (0, true));
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

#[test]
fn before_any_page_is_there_no_number_is_given() {
    let terrain = open_small(Some(&waiting()));
    let ground = ground_of(terrain);
    let (_, numbers, codes) = asked(ground, &queries()[1].0);
    assert!(codes.iter().all(|code| [3, 4].contains(&code[0])));
    assert!(numbers.iter().all(|bits| f64::from_bits(*bits).is_nan()));
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
}

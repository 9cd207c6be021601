//! Questions to a snapshot allocate nothing, but for a thread's very first.
//!
//! In:    a terrain that has flown, a counting allocator.
//! Out:   passes or fails.
//! Keeps: a count of allocations.
//! Not here: taking and giving back snapshots, which allocate.

#[path = "contracts/calls.rs"]
#[expect(dead_code, reason = "the other tests use the rest")]
mod calls;
#[path = "../../tests/counting.rs"]
mod counting;

use calls::*;
use counting::allocations;
use overfly_c::ground::*;
use overfly_c::queries::*;
use overfly_c::rays::*;
use overfly_c::status::*;
use overfly_c::terrain::ovf_terrain_destroy;

const PLACES: usize = 1000;

fn ask(ground: ovf_ground, lat_rad: &[f64], height_m: &mut [f64]) {
    let at = ovf_places { lat_rad: lat_rad.as_ptr(), lon_rad: lat_rad.as_ptr(), ..sized() };
    let columns = ovf_height_columns { height_m: height_m.as_mut_ptr(), ..sized() };
    let query = ovf_query { kind: OVF_QUERY_BEST_RESIDENT, ..sized() };
    let count = lat_rad.len() as u64;
    let point = [1100.0, 200.0, 50.0];
    let (mut contact, mut hit) = (sized(), sized());
    // SAFETY: all arrays are as long as they are said to be, and all structs outlive the calls.
    unsafe {
        let q = &raw const query;
        must(ovf_ground_heights(ground, &raw const at, count, q, &raw const columns));
        must(ovf_ground_contact(ground, point.as_ptr(), q, &raw mut contact));
        must(ovf_ground_ray(ground, point.as_ptr(), point.as_ptr(), 9.0, q, &raw mut hit));
    }
}

// One test in this binary: the count is of the whole process.
#[test]
fn a_thread_allocates_nothing_from_its_second_question_on() {
    let terrain = open_small(Some(&waiting()));
    flown(terrain, 10);
    let ground = ground_of(terrain);
    let lat_rad: Vec<f64> = (0..PLACES).map(|i| -1.5 + 0.003 * i as f64).collect();
    let mut height_m = vec![0.0; PLACES];
    ask(ground, &lat_rad, &mut height_m);
    let before = allocations();
    for _ in 0..20 {
        ask(ground, &lat_rad, &mut height_m);
    }
    assert_eq!(allocations() - before, 0);
    assert!(height_m.iter().all(|height| height.is_finite()));
    must(ovf_ground_destroy(ground));
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_ground_destroy(ground), OVF_STALE);
}

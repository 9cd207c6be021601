//! Questions to the ground allocate nothing.
//!
//! In:    procedural pages around a mountain, a counting allocator.
//! Out:   passes or fails.
//! Keeps: a count of allocations.
//! Not here: lists of pages and collision patches, which allocate and say so.

#[path = "../../tests/counting.rs"]
mod counting;
mod ground_rig;

use counting::allocations;
use glam::DVec3;
use ground_rig::*;
use overfly_core::geodesy::{Ecef, Geodetic};
use overfly_core::ground::{Answer, CollisionPatch, Ground, Query, Refraction, Region};
use overfly_core::units::Metres;

/// One of each question; how many had an answer.
fn ask(ground: &Ground, region: Region, seed: u64, patch: &mut CollisionPatch) -> u32 {
    let (from, to) = (place_in(region, seed), place_in(region, !seed));
    let eye = |place| EARTH.ecef_from_geodetic(Geodetic { height_m: 9e3, ..place });
    let (a, b) = (eye(from), eye(to));
    let mut answers = [Answer::NotReady; 2];
    let mut answered = 0;
    for query in
        [Query::Exact(26), Query::Exact(50), Query::BestResident, Query::Within(Metres(90.0))]
    {
        ground.heights(&[from, to], query, &mut answers);
        let down = DVec3::new(unit(seed), unit(seed ^ 1), -1.0);
        let ray = ground.ray(a, from.enu_axes() * down, f64::INFINITY, query);
        let sight = ground.line_of_sight(a, b, Refraction::FourThirds, query);
        let contact = ground.agl(Ecef(a.0 * 0.999), query);
        answered += u32::from(ground.height(from, query) == answers[0])
            + u32::from(ray.found().flatten().is_some())
            + u32::from(sight.found().is_some())
            + u32::from(contact.found().is_some());
    }
    answered += u32::from(ground.min_max(region).ok().is_some());
    answered += u32::from(ground.readiness(region, 30).is_ok());
    answered + u32::from(ground.fill_patch(region, 26, 10_000, patch).is_ok())
}

#[test]
fn no_question_allocates() {
    let generator = generator();
    let region = disc(mountain(&generator), 3_000.0);
    let ground = ground_of(&pages_of(&generator, region, 26), true);
    let mut patch = CollisionPatch::new();
    assert_eq!(ask(&ground, region, 0, &mut patch), 19);
    let before = allocations();
    let answered: u32 = (1..200).map(|seed| ask(&ground, region, seed, &mut patch)).sum();
    let allocations = allocations() - before;
    assert_eq!((answered, allocations), (199 * 19, 0));
}

//! H1 and H2: heights that are asked for against the ground itself, and against the drawn mesh.
//!
//! In:    the drawn mesh, pages, the places that a frame looks at and flies over.
//! Out:   spreads of differences in metres.
//! Keeps: nothing.
//! Not here: the queries (`overfly_core::ground`).
//!
//! H1 computes a height of the ground anew, in twice the digits of f64 and with its own search for
//! the triangle, from nothing but a page's samples. H2 asks for the ground at the deepest level
//! that the mesh may ever have.

use super::frame::Measure;
use super::mesh::MeshThen;
use super::reference::PagePart;
use super::spread::{Spread, Where};
use super::thorough::{Shot, spread_of};
use super::wide::{Wide, Wide3};
use glam::{DVec2, DVec3, IVec3};
use overfly_core::datasource::{Page, PageKey};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::ground::{Ground, LEVEL_MAX, Place, Query};
use overfly_core::lattice::{RADIUS, fold};
use std::sync::Arc;

/// Places at which H1 is measured.
const PLACES: usize = 32;
/// Gear: under the eye and around it, metres east and north.
const GEAR_M: [DVec2; 4] =
    [DVec2::new(0.0, 0.0), DVec2::new(0.0, 3.0), DVec2::new(-2.5, -1.5), DVec2::new(2.5, -1.5)];
/// Farther points, by distance: up to 50 m, up to 500 m.
const RINGS_M: [[f64; 8]; 2] = [
    [6.0, 12.0, 18.0, 24.0, 30.0, 36.0, 43.0, 50.0],
    [60.0, 120.0, 180.0, 240.0, 300.0, 370.0, 430.0, 500.0],
];

/// H1: `Query::Exact` at places that the frame sees, at the levels that are drawn there and the
/// next ones.
pub(super) fn queries(measure: &Measure, shot: &Shot<'_>) -> Spread {
    let seen: Vec<DVec3> =
        measure.found.iter().filter(|f| f.ground_m > 0.0).map(|f| f.normal).collect();
    let stride = seen.len().div_ceil(PLACES).max(1);
    let depth = measure.now.drawn.patch_depth;
    let mut found = Vec::new();
    for (index, &normal) in seen.iter().step_by(stride).enumerate() {
        let Some(leaf) = measure.now.find(normal, 30) else { continue };
        let drawn = measure.now.leaf(&leaf).level + depth;
        let level = (drawn + u8::from(index % 2 == 1)).clamp(LEVEL_LEAST, LEVEL_MAX);
        if let Some(error_m) = query_error_m(measure, shot, (normal, level)) {
            found.push((error_m, place(measure, shot, normal)));
        }
    }
    spread_of(&found)
}

/// Pages have all samples of this level and deeper ones.
const LEVEL_LEAST: u8 = 12;

/// How far a query's answer is from the height computed anew.
fn query_error_m(measure: &Measure, shot: &Shot<'_>, (normal, level): (DVec3, u8)) -> Option<f64> {
    let scene = shot.terrain.settings();
    let key = Place::of(normal).triangle(level).0.page();
    let page = measure.page(shot, (key, PagePart::Heights))?;
    answer_error_m((&scene.body, scene.sea), [&page, &page], normal, level)
}

/// How far `Query::Exact` over the first page is from the height that the second one has, metres.
pub fn answer_error_m(
    (body, sea): (&Ellipsoid, bool),
    [asked, truth]: [&Arc<Page>; 2],
    normal: DVec3,
    level: u8,
) -> Option<f64> {
    let at = at_normal(normal);
    let mut ground = Ground::new(*body, sea);
    ground.insert(asked.clone());
    let answer = ground.height(at, Query::Exact(level)).ok()?;
    let exact_m = exact_height_m((truth, sea), body, at.normal(), level)?;
    Some((answer.height_m - exact_m).abs())
}

fn at_normal(normal: DVec3) -> Geodetic {
    let across = libm::hypot(normal.x, normal.y);
    Geodetic {
        lat_rad: libm::atan2(normal.z, across),
        lon_rad: libm::atan2(normal.y, normal.x),
        height_m: 0.0,
    }
}

/// The height at which a vertical meets the plane of the triangle around it, in twice the digits.
/// `None` where the triangle is not the page's.
pub fn exact_height_m(
    (page, sea): (&Page, bool),
    body: &Ellipsoid,
    normal: DVec3,
    level: u8,
) -> Option<f64> {
    let corners = triangle_around(page.key.quadrant(), normal, level);
    let side = page.key.side();
    let (u0, v0) = page.key.origin();
    let within =
        |(u, v): (i32, i32)| (u0..=u0 + side).contains(&u) && (v0..=v0 + side).contains(&v);
    if !corners.into_iter().all(within) {
        return None;
    }
    let [a, b, c] = corners.map(|(u, v)| {
        let point = fold(page.key.quadrant(), u, v);
        let surface_m = surface_m(page, sea, point);
        let direction = Wide3::of(point.as_dvec3());
        let length = direction.dot(direction).sqrt();
        foot(body, direction).plus(direction.times(surface_m / length))
    });
    let up = Wide3::of(normal);
    let up = up.times(Wide::of(1.0) / up.dot(up).sqrt());
    let plane = b.minus(a).cross(c.minus(a));
    let rise = a.minus(foot(body, up)).dot(plane);
    Some((rise / up.dot(plane)).narrow())
}

/// The drawn surface at a sample, from the page's own columns.
fn surface_m(page: &Page, sea: bool, point: IVec3) -> Wide {
    let at = page.sample_index(point);
    let ground_m = f64::from(page.heights_m[at]);
    let drawn_m = if sea && ground_m < 0.0 { 0.0 } else { ground_m };
    let level_m = page.survey.as_ref().map_or(0.0, |survey| f64::from(survey.sea_level_m[at]));
    Wide::of(drawn_m) + Wide::of(level_m)
}

/// The point of the ellipsoid whose normal has this direction, of any length.
fn foot(body: &Ellipsoid, direction: Wide3) -> Wide3 {
    let (a, b) = (Wide::of(body.a_m), Wide::of(body.b_m()));
    let [x, y, z] = direction.0;
    let scaled = Wide3([a * a * x, a * a * y, b * b * z]);
    scaled.times(Wide::of(1.0) / direction.dot(scaled).sqrt())
}

/// Corners of a level's triangle around a normal, on the unfolded square.
fn triangle_around(quadrant: u8, normal: DVec3, level: u8) -> [(i32, i32); 3] {
    debug_assert!(quadrant < 4);
    let [x, y, z] = normal.to_array();
    let scale = f64::from(RADIUS) / (x.abs() + y.abs() + z.abs());
    let (x, y) = (x.abs() * scale, y.abs() * scale);
    let radius = f64::from(RADIUS);
    let (u, v) = if z >= 0.0 { (x, y) } else { (radius - y, radius - x) };
    let side = RADIUS >> (level / 2);
    #[expect(clippy::cast_possible_truncation, reason = "on the square")]
    let cell = |along: f64| ((along / f64::from(side)).floor() as i32).min(RADIUS / side - 1);
    let (i, j) = (cell(u), cell(v));
    let (du, dv) = (u / f64::from(side) - f64::from(i), v / f64::from(side) - f64::from(j));
    let half = side / 2;
    let at = |a: i32, b: i32| (i * side + a * half, j * side + b * half);
    if level % 2 == 1 {
        // Four triangles around the cell's middle.
        let flat = (du - 0.5).abs() > (dv - 0.5).abs();
        let (first, second) = match (flat, du > 0.5, dv > 0.5) {
            (true, true, _) => (at(2, 0), at(2, 2)),
            (true, false, _) => (at(0, 0), at(0, 2)),
            (false, _, true) => (at(0, 2), at(2, 2)),
            (false, _, false) => (at(0, 0), at(2, 0)),
        };
        return [at(1, 1), first, second];
    }
    // The diagonal joins corners whose indices are both even or both odd.
    match ((i + j) % 2 == 0, du > dv, du + dv > 1.0) {
        (true, true, _) => [at(0, 0), at(2, 0), at(2, 2)],
        (true, false, _) => [at(0, 0), at(0, 2), at(2, 2)],
        (false, _, true) => [at(2, 2), at(2, 0), at(0, 2)],
        (false, _, false) => [at(0, 0), at(2, 0), at(0, 2)],
    }
}

fn place(measure: &Measure, shot: &Shot<'_>, normal: DVec3) -> Where {
    let surface = measure.body.surface_from_normal(normal);
    let pixel = shot.screen.pixel(surface).filter(|_| shot.screen.shows(surface));
    measure.place_of(normal, pixel.unwrap_or_default(), shot.frame)
}

/// H2: the ground less the mesh under the gear, within 50 m and within 500 m of the eye's foot;
/// and by how much the mesh moved under the gear and within 50 m since the frame before.
pub(super) fn mesh(measure: &Measure, shot: &Shot<'_>) -> [Spread; 4] {
    let up = shot.output.views[0].camera.normal;
    let truth = Truth::new(shot);
    let [gear, near, far] = [GEAR_M.to_vec(), ring(&RINGS_M[0]), ring(&RINGS_M[1])]
        .map(|offsets| beside(&measure.body, up, &offsets));
    let below = |normals: &[DVec3]| {
        let keys: Vec<PageKey> = normals.iter().map(|&normal| truth.page(normal)).collect();
        let pages = measure.pages(shot, (&keys, PagePart::Heights));
        let found = normals.iter().zip(pages).filter_map(|(&normal, page)| {
            let drawn = measure.now.find(normal, 40)?;
            let error_m = truth.height_m(shot, normal, page?)? - drawn.height_m;
            Some((error_m.abs(), place(measure, shot, normal)))
        });
        spread_of(&found.collect::<Vec<_>>())
    };
    let moved = |then: &MeshThen| {
        let found = gear.iter().chain(&near).filter_map(|&normal| {
            let (now, then) = (measure.now.find(normal, 40)?, then.find(normal, 40)?);
            Some(((now.height_m - then.height_m).abs(), place(measure, shot, normal)))
        });
        spread_of(&found.collect::<Vec<_>>())
    };
    let step = if measure.has_before() { moved(&measure.before) } else { Spread::default() };
    [below(&gear), below(&near), below(&far), step]
}

/// Places around, one for each distance, each in another direction.
fn ring(distances_m: &[f64]) -> Vec<DVec2> {
    let turn = |i: usize| 2.399_963_229_728_653 * i as f64;
    let places = distances_m.iter().enumerate();
    places.map(|(i, &m)| DVec2::new(libm::sin(turn(i)), libm::cos(turn(i))) * m).collect()
}

/// Normals some metres east and north of another.
fn beside(body: &Ellipsoid, up: DVec3, offsets_m: &[DVec2]) -> Vec<DVec3> {
    let aside = if up.z.abs() < 0.99 { DVec3::Z } else { DVec3::X };
    let east = aside.cross(up).normalize();
    let north = up.cross(east);
    let [radius_m, _] = body.curvature_radii_m();
    let turned = |m: &DVec2| (up * radius_m + east * m.x + north * m.y).normalize();
    offsets_m.iter().map(turned).collect()
}

/// The ground at the deepest level that the mesh may have.
struct Truth {
    level: u8,
}

impl Truth {
    fn new(shot: &Shot<'_>) -> Self {
        let lod = &shot.terrain.settings().lod;
        Self { level: (lod.level_max + lod.patch_depth).clamp(LEVEL_LEAST, LEVEL_MAX) }
    }

    fn page(&self, normal: DVec3) -> PageKey {
        Place::of(normal).triangle(self.level).0.page()
    }

    fn height_m(&self, shot: &Shot<'_>, normal: DVec3, page: Arc<Page>) -> Option<f64> {
        let scene = shot.terrain.settings();
        let mut ground = Ground::new(scene.body, scene.sea);
        ground.insert(page);
        let answer = ground.height(at_normal(normal), Query::Exact(self.level));
        answer.ok().map(|height| height.height_m)
    }
}

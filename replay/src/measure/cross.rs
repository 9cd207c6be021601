//! E1 by a second way: a part of the picture, over the ground as its own queries walk it.
//!
//! In:    a frame that was measured, pages.
//! Out:   [`Cross`].
//! Keeps: nothing.
//! Not here: the first way (`reference`, `plate`), with which this shares pages and nothing else.
//!
//! Pages are chosen anew, by spheres instead of boxes, as fine as the first way's or finer; then
//! `Ground::ray` walks them cell by cell. Where both ways have the same pages the results agree
//! to rounding; where this one has finer pages, by what the coarser ones leave out. Only what is
//! farther than anything that the first way met in the part stays coarse: it is still met if what
//! should hide it is not there.

use super::cast::pyramid;
use super::errors::Cross;
use super::frame::Measure;
use super::reference::PagePart;
use super::thorough::{Shot, spread_of};
use glam::{DVec2, DVec3};
use overfly_core::datasource::key::{PAGE_BITS, PAGE_SIDE};
use overfly_core::datasource::{Page, PageKey};
use overfly_core::digest::mix;
use overfly_core::geodesy::Ecef;
use overfly_core::ground::{Ground, LEVEL_MAX, Query};
use overfly_core::lattice::normal_of;

/// The part of the picture is this share of its width and height.
const PART: f64 = 1.0 / 24.0;
/// No more pages than this: farther ones stay coarse.
const PAGES_MAX: usize = 1500;

/// Casts the rays of some part of the picture, another one in each frame.
pub(super) fn measure(measure: &Measure, shot: &Shot<'_>) -> Cross {
    let (low, high) = part(measure, shot);
    let farthest_m = farthest_m(measure, shot, [low, high]);
    let ground = gather(measure, shot, (&pyramid(&shot.screen, low, high), farthest_m));
    let (mut cross, mut found) = (Cross::default(), Vec::new());
    for (at, pixel) in rays_within(shot, [low, high]) {
        let first = &measure.found[at];
        let second = second_px(measure, shot, (&ground, pixel));
        cross.rays += 1;
        match second {
            Some(second) if first.e1_px >= 0.0 => {
                let place = measure.place_of(first.normal, pixel, shot.frame);
                found.push(((second - first.e1_px).abs(), place));
            }
            Some(_) => cross.differ += 1,
            None => cross.differ += u64::from(first.e1_px >= 0.0),
        }
    }
    cross.px = spread_of(&found);
    cross
}

/// The rays of a part of the picture, and their pixels.
fn rays_within(
    shot: &Shot<'_>,
    [low, high]: [DVec2; 2],
) -> impl Iterator<Item = (usize, DVec2)> + use<> {
    let grid = shot.grid;
    let all = (0..grid.rows).flat_map(move |row| (0..grid.columns).map(move |c| (c, row)));
    let all = all.map(move |(column, row)| grid.pixel(column, row)).enumerate();
    all.filter(move |(_, pixel)| pixel.cmpge(low).all() && pixel.cmple(high).all())
}

/// Distance of the farthest ground that the first way met in a part of the picture; infinite where
/// a ray met none.
fn farthest_m(measure: &Measure, shot: &Shot<'_>, part: [DVec2; 2]) -> f64 {
    let away_m = |(at, pixel): (usize, DVec2)| {
        let depth_m = measure.found[at].ground_m;
        let seen = (depth_m > 0.0).then(|| depth_m * shot.screen.tangents(pixel).length());
        seen.unwrap_or(f64::INFINITY)
    };
    rays_within(shot, part).map(away_m).fold(0.0, f64::max)
}

/// A part of the picture, in the half of it that shows more ground.
fn part(measure: &Measure, shot: &Shot<'_>) -> (DVec2, DVec2) {
    let size = DVec2::from_array(shot.screen.size_px);
    let seen: Vec<usize> =
        (0..measure.found.len()).filter(|&at| measure.found[at].ground_m > 0.0).collect();
    let bits = mix(shot.frame) >> 1;
    let middle = if seen.is_empty() {
        size * 0.5
    } else {
        let at = usize::try_from(bits % seen.len() as u64).expect("an index");
        let at = u32::try_from(seen[at]).expect("a stratum");
        shot.grid.pixel(at % shot.grid.columns, at / shot.grid.columns)
    };
    let half = size * (0.5 * PART);
    let middle = middle.clamp(half, size - half);
    (middle - half, middle + half)
}

/// E1 of one ray over the second ground.
fn second_px(measure: &Measure, shot: &Shot<'_>, (ground, pixel): (&Ground, DVec2)) -> Option<f64> {
    let screen = &shot.screen;
    let direction = screen.to_body(screen.tangents(pixel));
    let hit =
        ground.ray(Ecef(screen.eye), direction, f64::INFINITY, Query::BestResident).found()??;
    let at = measure.body.geodetic_from_ecef(hit.point);
    let normal = at.normal();
    let drawn = measure.now.find(normal, 30)?;
    let mesh = measure.body.surface_from_normal(normal) + normal * drawn.height_m;
    Some((screen.pixel(mesh)? - screen.pixel(hit.point.0)?).length())
}

/// The pages of a part of the picture, and all above them.
fn gather(measure: &Measure, shot: &Shot<'_>, part: (&[DVec3; 4], f64)) -> Ground {
    let scene = shot.terrain.settings();
    let mut ground = Ground::new(scene.body, scene.sea);
    let mut wave: Vec<PageKey> = (0..4).map(PageKey::root).collect();
    while !wave.is_empty() && ground.pages() < PAGES_MAX {
        let mut next = Vec::new();
        for page in measure.pages(shot, (&wave, PagePart::Whole)).into_iter().flatten() {
            if is_coarse(measure, shot, &page, part) {
                next.extend((0..4).map(|child| page.key.child(child)));
            }
            ground.insert(page);
        }
        wave = next;
    }
    ground
}

/// Whether a page that this part may show has cells that look larger than a cell may.
fn is_coarse(
    measure: &Measure,
    shot: &Shot<'_>,
    page: &Page,
    (planes, farthest_m): (&[DVec3; 4], f64),
) -> bool {
    if page.key.depth() >= LEVEL_MAX / 2 - PAGE_BITS {
        return false;
    }
    let sea = shot.terrain.settings().sea;
    let place = |i: usize, j: usize| {
        let normal = normal_of(page.key.sample(i, j));
        let surface_m = page.surface_m(j * PAGE_SIDE + i, sea);
        measure.body.surface_from_normal(normal) + normal * surface_m
    };
    let last = PAGE_SIDE - 1;
    let corner = place(0, 0);
    let cell_m = place(last, 0).distance(corner).max(place(0, last).distance(corner)) / last as f64;
    let errors = page.bounds.iter().map(|bound| bound.error_odd_m.max(bound.error_even_m));
    let error_m = f64::from(errors.fold(0.0, f32::max));
    let centre = place(last / 2, last / 2);
    let all = (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j)));
    let radius_m = all.map(|(i, j)| place(i, j).distance(centre)).fold(0.0, f64::max) + error_m;
    let away = centre - shot.screen.eye;
    let seen = planes.iter().all(|plane| plane.dot(away) >= -radius_m);
    let nearest_m = (away.length() - radius_m).max(shot.screen.near_m);
    let cell_px = cell_m * shot.screen.scale_px / nearest_m;
    let seen = seen && nearest_m <= farthest_m;
    seen && cell_px > measure.settings.cell_px && !is_hidden(measure, shot, (centre, radius_m))
}

/// Whether a sphere lies wholly behind the body's inner sphere.
fn is_hidden(measure: &Measure, shot: &Shot<'_>, (centre, radius_m): (DVec3, f64)) -> bool {
    let eye = shot.screen.eye;
    // Ground may lie below the ellipsoid: a lower sphere hides less, but certainly.
    let inner_m = 0.99 * measure.body.a_m.min(measure.body.b_m());
    let height2 = eye.length_squared() - inner_m * inner_m;
    if height2 <= 0.0 {
        return false;
    }
    let reach_m = height2.sqrt();
    let top_m = centre.length() + radius_m;
    let beyond_m = (top_m * top_m - inner_m * inner_m).max(0.0).sqrt();
    (centre - eye).length() - radius_m > reach_m + beyond_m
}

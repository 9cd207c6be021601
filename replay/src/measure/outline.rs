//! E4: the outline of the mesh against the sky, and that of the ground, by picture column.
//!
//! In:    the drawn mesh, the reference ground, the projection.
//! Out:   the spread of their difference in pixels along the columns.
//! Keeps: nothing.
//! Not here: what lies below the outline (`frame`, `holes`).
//!
//! Columns run from the sky down, whichever way the camera is rolled. The mesh's outline is exact:
//! the highest point of its edges in the column. The ground's is found by rays: every few pixels
//! from the sky down to the first that meets it, then by bisection to a thousandth of a pixel.

use super::cast::Caster;
use super::frame::Measure;
use super::reference::Hit;
use super::screen::Screen;
use super::spread::{Spread, Where};
use super::thorough::{Shot, spread_of};
use glam::{DVec2, DVec3};
use overfly_core::inspect::DrawnMesh;
use overfly_core::mesh::topology::indices;

/// Columns that are looked at, evenly spread over the picture.
const COLUMNS: u32 = 256;
/// Distance of the rays that look for the ground.
const SCAN_PX: f64 = 8.0;
/// How well its outline is found.
const FINE_PX: f64 = 1e-3;

/// E4, and the columns in which only one of both has an outline.
pub(super) fn measure(measure: &Measure, shot: &Shot<'_>) -> (Spread, u64) {
    let up = shot.output.views[0].camera.normal;
    let screen = upright(&shot.screen, up);
    let tops = mesh_tops(&measure.now.drawn, &screen);
    let caster = Caster { reference: &measure.reference, screen: &screen, make: shot.make };
    let (mut found, mut lost) = (Vec::new(), 0);
    for (column, top) in (0_u32..).zip(tops) {
        let x = column_px(&screen, column);
        let height = screen.size_px[1];
        match ground_top(&caster, x) {
            Top::At(y, hit) if top.is_finite() => {
                let pixel = shot.screen.pixel(hit.place).unwrap_or_default();
                let place: Where = measure.place_of(hit.normal, pixel, shot.frame);
                found.push(((top - y).abs(), place));
            }
            Top::At(..) => lost += 1,
            Top::Nowhere => lost += u64::from(top < height - BORDER_PX),
            Top::Outside => {}
        }
    }
    (spread_of(&found), lost)
}

/// An outline so near to the picture's lower border may lie below it.
const BORDER_PX: f64 = 2.0;

/// The picture turned so that the sky is at its top.
fn upright(screen: &Screen, up: DVec3) -> Screen {
    let quarters = [0, 1, 2, 3_u8];
    let lift = |quarters: u8| screen.turned(quarters).axes[1].dot(up);
    let best = quarters.into_iter().max_by(|&a, &b| lift(a).total_cmp(&lift(b)));
    screen.turned(best.unwrap_or(0))
}

fn column_px(screen: &Screen, column: u32) -> f64 {
    (f64::from(column) + 0.5) * screen.size_px[0] / f64::from(COLUMNS)
}

/// The ground's outline in one column.
enum Top {
    /// It begins above the picture.
    Outside,
    /// There is no ground in the column.
    Nowhere,
    /// How far from the top, and what is there.
    At(f64, Hit),
}

fn ground_top(caster: &Caster<'_>, x: f64) -> Top {
    let height = caster.screen.size_px[1];
    let mut nearby = caster.within(DVec2::new(x - 0.5, 0.0), DVec2::new(x + 0.5, height));
    let mut meet = |y: f64| caster.meet(&mut nearby, DVec2::new(x, y));
    if meet(0.0).is_some() {
        return Top::Outside;
    }
    let (mut sky, mut ground) = (0.0, 0.0);
    let mut hit = None;
    while hit.is_none() {
        if ground >= height {
            return Top::Nowhere;
        }
        sky = ground;
        ground = (ground + SCAN_PX).min(height);
        hit = meet(ground);
    }
    while ground - sky > FINE_PX {
        let middle = f64::midpoint(sky, ground);
        match meet(middle) {
            Some(found) => (ground, hit) = (middle, Some(found)),
            None => sky = middle,
        }
    }
    hit.map_or(Top::Nowhere, |hit| Top::At(ground, hit))
}

/// The mesh's outline in all columns; infinite where there is none.
fn mesh_tops(mesh: &DrawnMesh, screen: &Screen) -> Vec<f64> {
    let mut tops = vec![f64::INFINITY; COLUMNS as usize];
    let pattern = indices(mesh.patch_depth);
    let three = pattern.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
    let mut sides: Vec<[u32; 2]> = three
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    sides.sort_unstable();
    sides.dedup();
    let mut view = vec![DVec3::ZERO; mesh.vertices_per_patch()];
    for leaf in 0..mesh.leaves.len() {
        let places = mesh.places_of(leaf);
        view.iter_mut().zip(places).for_each(|(view, &place)| *view = screen.view(place));
        for side in &sides {
            let [a, b] = side.map(|at| view[at as usize]);
            raise(&mut tops, screen, [a, b]);
        }
    }
    tops
}

/// Raises the outline by one edge in camera axes.
fn raise(tops: &mut [f64], screen: &Screen, [a, b]: [DVec3; 2]) {
    let Some([a, b]) = before([a, b], screen.near_m) else { return };
    let [pa, pb] = [a, b].map(|point| screen.pixel_of(point));
    let (left, right) = (pa.x.min(pb.x), pa.x.max(pb.x));
    let [width, _] = screen.size_px;
    if right < 0.0 || left > width {
        return;
    }
    let per_px = f64::from(COLUMNS) / width;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let column = |x: f64| (x * per_px - 0.5).clamp(0.0, f64::from(COLUMNS)) as u32;
    for at in column(left)..=column(right).min(COLUMNS - 1) {
        let x = column_px(screen, at);
        if x < left || x > right {
            continue;
        }
        // An edge is straight on the screen as well.
        let along = if right > left { (x - pa.x) / (pb.x - pa.x) } else { 0.0 };
        let y = pa.y + (pb.y - pa.y) * along;
        let top = &mut tops[at as usize];
        *top = top.min(y);
    }
}

/// The part of an edge that is not nearer than `near_m`.
fn before([a, b]: [DVec3; 2], near_m: f64) -> Option<[DVec3; 2]> {
    let cut = |inside: DVec3, outside: DVec3| {
        let share = (inside.z - near_m) / (inside.z - outside.z);
        inside + (outside - inside) * share
    };
    match (a.z >= near_m, b.z >= near_m) {
        (true, true) => Some([a, b]),
        (true, false) => Some([a, cut(a, b)]),
        (false, true) => Some([cut(b, a), b]),
        (false, false) => None,
    }
}

//! The costly metrics, measured in few frames: E4, C1–C3, H1, H2, M32, J1, Z1, Z2, cross-check.
//!
//! In:    a frame that was just measured.
//! Out:   [`Thorough`].
//! Keeps: nothing.
//! Not here: each metric itself (`outline`, `cracks`, `heights`, `pipeline`, `depth`, `cross`).

use super::errors::{Cross, Thorough};
use super::frame::Measure;
use super::rays::Grid;
use super::reference::MakePage;
use super::screen::Screen;
use super::share::share;
use super::spread::{Spread, Where};
use super::{cracks, cross, depth, heights, outline, pipeline};
use overfly_core::frame::{FrameOutput, Terrain};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The frame that is measured.
pub struct Shot<'a> {
    /// The terrain after it.
    pub terrain: &'a Terrain,
    /// Its output.
    pub output: &'a FrameOutput,
    /// The projection of its first view.
    pub screen: Screen,
    /// The rays of that view.
    pub grid: Grid,
    /// Makes pages.
    pub make: MakePage<'a>,
    /// Frame of the flight.
    pub frame: u64,
}

/// Measures what is due: the costly metrics, and among them the cross-check.
pub(super) fn measure(measure: &Measure, shot: &Shot<'_>, due: [bool; 2]) -> Option<Thorough> {
    let [thorough, cross] = due;
    if !thorough {
        return None;
    }
    let all = Mutex::new(Thorough::default());
    let of_pages = || {
        let found = if cross { cross::measure(measure, shot) } else { Cross::default() };
        let h1_m = heights::queries(measure, shot);
        let [gear_m, near_m, far_m, step_m] = heights::mesh(measure, shot);
        let mut all = lock(&all);
        (all.cross, all.h1_m) = (found, h1_m);
        (all.h2_gear_m, all.h2_near_m) = (gear_m, near_m);
        (all.h2_far_m, all.h2_step_m) = (far_m, step_m);
    };
    let of_outline = || {
        let (e4_px, lost) = outline::measure(measure, shot);
        let mut all = lock(&all);
        (all.e4_px, all.e4_lost) = (e4_px, lost);
    };
    let of_structure = || {
        let cracks = cracks::Cracks::of(&measure.now.drawn);
        let mut all = lock(&all);
        (all.c1_edges, all.c2_junctions) = (cracks.edges, cracks.junctions);
    };
    let of_points = || {
        let apart = cracks::points_apart(&mut cracks::uploaded(shot.terrain, shot.output));
        lock(&all).c3_points = apart;
    };
    let of_arithmetic = || {
        let drawn = pipeline::drawn(measure, shot);
        let [bytes_px, whole_px] = pipeline::arithmetic(measure, shot, &drawn);
        let (j1_px, step_px) = pipeline::jitter(measure, shot, &drawn);
        let mut all = lock(&all);
        (all.m32_px, all.f32_px) = (bytes_px, whole_px);
        (all.j1_px, all.j1_step_px) = (j1_px, step_px);
    };
    let of_depths = || {
        let depths = depth::measure(measure, shot);
        lock(&all).depths = depths;
    };
    // Making pages takes about as long as all the rest, so it begins first.
    let parts: [&(dyn Fn() + Sync); 6] =
        [&of_pages, &of_outline, &of_structure, &of_arithmetic, &of_points, &of_depths];
    share(parts.len(), measure.settings.threads, |at| parts[at]());
    Some(all.into_inner().unwrap_or_else(PoisonError::into_inner))
}

fn lock(all: &Mutex<Thorough>) -> MutexGuard<'_, Thorough> {
    all.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The spread of values, and where the greatest of them was seen; only that one is asked for.
pub(super) fn spread_at(values: &[f64], at: impl FnOnce(usize) -> Where) -> Spread {
    Spread::of(&mut values.to_vec(), at)
}

/// The spread of values that were each seen somewhere.
pub(super) fn spread_of(found: &[(f64, Where)]) -> Spread {
    let mut values: Vec<f64> = found.iter().map(|(value, _)| *value).collect();
    Spread::of(&mut values, |at| found[at].1)
}

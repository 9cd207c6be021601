//! The costly metrics, measured in few frames: E4, C1–C3, H1, H2, M32, J1, Z1, Z2, cross-check.
//!
//! In:    a frame that was just measured.
//! Out:   [`Thorough`].
//! Keeps: nothing.
//! Not here: each metric itself (`outline`, `cracks`, `heights`, `pipeline`, `depth`, `cross`).

use super::errors::Thorough;
use super::frame::Measure;
use super::rays::Grid;
use super::reference::MakePage;
use super::screen::Screen;
use super::spread::{Spread, Where};
use super::{cracks, cross, depth, heights, outline, pipeline};
use overfly_core::frame::{FrameOutput, Terrain};

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
    let mut all = Thorough::default();
    let of_pages = |all: &mut Thorough| {
        if cross {
            all.cross = cross::measure(measure, shot);
        }
        all.h1_m = heights::queries(measure, shot);
        [all.h2_gear_m, all.h2_near_m, all.h2_far_m, all.h2_step_m] = heights::mesh(measure, shot);
    };
    let of_mesh = |all: &mut Thorough| {
        (all.e4_px, all.e4_lost) = outline::measure(measure, shot);
        let cracks = cracks::Cracks::of(&measure.now.drawn);
        (all.c1_edges, all.c2_junctions) = (cracks.edges, cracks.junctions);
        all.c3_points = cracks::points_apart(&mut cracks::uploaded(shot.terrain, shot.output));
        [all.m32_px, all.f32_px] = pipeline::arithmetic(measure, shot);
        (all.j1_px, all.j1_step_px) = pipeline::jitter(measure, shot);
        all.depths = depth::measure(measure, shot);
    };
    // Making pages takes about as long as all the rest.
    if measure.settings.threads > 1 {
        let mut pages = Thorough::default();
        std::thread::scope(|scope| {
            scope.spawn(|| of_pages(&mut pages));
            of_mesh(&mut all);
        });
        let Thorough { cross, h1_m, h2_gear_m, h2_near_m, h2_far_m, h2_step_m, .. } = pages;
        all = Thorough { cross, h1_m, h2_gear_m, h2_near_m, h2_far_m, h2_step_m, ..all };
    } else {
        of_pages(&mut all);
        of_mesh(&mut all);
    }
    Some(all)
}

/// The spread of values that were each seen somewhere.
pub(super) fn spread_of(found: &[(f64, Where)]) -> Spread {
    let mut values: Vec<f64> = found.iter().map(|(value, _)| *value).collect();
    Spread::of(&mut values, |at| found[at].1)
}

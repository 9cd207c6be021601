//! Laws that a sweep should show, as fitted to its points.
//!
//! In:    the points of a sweep.
//! Out:   [`Law`]s: what is expected, what was found, of how many points.
//! Keeps: nothing.
//! Not here: the fit itself (`overfly::replay::trade::slope`).
//! Source: slopes of error against triangles in P. Lindstrom's and own measurements, as the design
//! notes list them: -0.67 to -0.78 for a mesh of this kind.

use super::entry::Entry;
use overfly::replay::trade::{Fit, Point, fit};

/// One law.
pub struct Law {
    /// What it relates.
    pub name: String,
    /// It is the one of the scene's own patches that plots show.
    pub is_own_error: bool,
    /// The expected slope, from and to.
    pub expected: [f64; 2],
    /// What was found; `None` with too few points.
    pub found: Option<Fit>,
    /// Points that it may be fitted to.
    pub points: usize,
}

/// Error falls as triangles to this power, from and to.
const ERROR_SLOPE: [f64; 2] = [-0.8, -0.6];
/// So triangles fall as tolerance to one over it.
const TOLERANCE_SLOPE: [f64; 2] = [-1.667, -1.25];

impl Law {
    /// Whether what was found is what is expected.
    pub fn holds(&self) -> Option<bool> {
        let [from, to] = self.expected;
        self.found.map(|found| (from..=to).contains(&found.slope))
    }

    /// The law in a line of text.
    pub fn sentence(&self) -> String {
        let (name, [from, to], points) = (&self.name, self.expected, self.points);
        match self.found {
            Some(Fit { slope, residual, range: [least, most], .. }) => {
                let verdict = if self.holds() == Some(true) { "as expected" } else { "unexpected" };
                format!(
                    "law: {name}, slope {slope:.3} of {points} points, x {least:.0} to {most:.0}, \
                     residual {:.1} %: {verdict} ({from} to {to})",
                    100.0 * residual
                )
            }
            None => {
                format!(
                    "law: {name}, {points} points are too few or too near; expected {from} to {to}"
                )
            }
        }
    }
}

/// The laws of a sweep, for the scene's own patch depth and each other one of which three points
/// or more can tell. Of points with the same digest one counts: they are the same frames.
pub fn laws(base: &Point, entries: &[Entry]) -> Vec<Law> {
    let once = |at: usize| entries[..at].iter().all(|other| other.digest != entries[at].digest);
    let distinct: Vec<&Entry> =
        (0..entries.len()).filter(|&at| once(at)).map(|at| &entries[at]).collect();
    let own = base.scene.lod.patch_depth;
    let depths = [own].into_iter().chain([0, 2, 4, 6, 8].into_iter().filter(|&k| k != own));
    let depths: Vec<u8> = depths.collect();
    let mut laws = Vec::new();
    for (what, pairs_of, expected) in [
        ("E1 rms against triangles", errors as PairsOf, ERROR_SLOPE),
        ("triangles against tolerance, where it decides", tolerances, TOLERANCE_SLOPE),
    ] {
        let each = depths.iter().map(|&depth| (depth, pairs_of(base, &distinct, depth)));
        let told = each.filter(|(depth, pairs)| *depth == own || pairs.len() >= 3);
        laws.extend(told.map(|(depth, pairs)| Law {
            name: format!("{what}, patch_depth {depth}"),
            is_own_error: depth == own && expected == ERROR_SLOPE,
            expected,
            found: fit(&pairs),
            points: pairs.len(),
        }));
    }
    laws
}

type PairsOf = fn(&Point, &[&Entry], u8) -> Vec<[f64; 2]>;

/// Points that differ from the scene in its limits and patch depth alone.
fn of_depth<'a>(
    base: &Point,
    entries: &[&'a Entry],
    patch_depth: u8,
) -> impl Iterator<Item = &'a Entry> {
    let limits = ["tolerance_px", "triangles_max", "patch_depth"];
    let belongs = move |entry: &&&Entry| {
        let turned = entry.point.turned_from(base);
        entry.point.scene.lod.patch_depth == patch_depth
            && turned.iter().all(|(name, _)| limits.contains(name))
    };
    entries.iter().filter(belongs).copied()
}

/// A mesh of fewer leaves is spent on closing around the planet, whatever the laws say: 1250, or 5000
/// triangles at patch depth 2, less the one that would not fit any more.
const LEAVES_LEAST: f64 = 1249.0;

fn leaves(triangles: f64, patch_depth: u8) -> f64 {
    triangles / f64::from(1_u32 << patch_depth)
}

/// Triangles and error to 200 000 triangles.
fn errors(base: &Point, entries: &[&Entry], patch_depth: u8) -> Vec<[f64; 2]> {
    let found = of_depth(base, entries, patch_depth).map(|entry| entry.found);
    let decided = found.filter(|y| y.budget_decides() || y.tolerance_decides());
    let in_range = decided
        .filter(|y| leaves(y.triangles, patch_depth) >= LEAVES_LEAST && y.triangles <= 200_000.0);
    in_range.map(|y| [y.triangles, y.rms_px]).collect()
}

fn tolerances(base: &Point, entries: &[&Entry], patch_depth: u8) -> Vec<[f64; 2]> {
    let found = of_depth(base, entries, patch_depth).map(|entry| entry.found);
    let free =
        found.filter(|y| y.tolerance_decides() && leaves(y.triangles, patch_depth) >= LEAVES_LEAST);
    free.map(|y| [y.tolerance_px, y.triangles]).collect()
}

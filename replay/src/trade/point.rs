//! Points of a sweep: one setting of all knobs each.
//!
//! In:    the scene that is traded, the values of each knob.
//! Out:   [`Point`]s, the scene's own first; none twice.
//! Keeps: nothing.
//! Not here: the sweep file (`overfly_config`), flying a point (the host).

use overfly_config::{SweepSettings, WriteFault, write};
use overfly_core::settings::{SceneSettings, VertexPrecision};
use overfly_core::units::Pixels;
use std::fmt;

/// More points than this are a mistake: at a minute each they would take a week.
const POINTS_MAX: usize = 10_000;
/// A path of the lattice has so many levels, those inside a patch included.
const LEVELS: u8 = 56;

/// One setting of all knobs.
#[derive(Clone, PartialEq, Debug)]
pub struct Point {
    /// The scene with its knobs turned.
    pub scene: SceneSettings,
    /// How much later than in the next frame pages arrive, milliseconds of the flight.
    pub loader_delay_ms: u32,
    /// Worker threads beside the main one.
    pub workers: u8,
}

/// Why a sweep has no points.
#[derive(Clone, PartialEq, Debug)]
pub enum PointFault {
    /// Two values do not go together, or one is out of range.
    Scene {
        /// What was turned.
        point: String,
        /// What is wrong with it.
        fault: WriteFault,
    },
    /// The product of all values.
    TooMany {
        /// Points asked for.
        found: usize,
    },
}

impl fmt::Display for PointFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene { point, fault } => write!(f, "the point with {point}: {fault}"),
            Self::TooMany { found } => {
                write!(f, "the sweep has {found} points, allowed are 1 to {POINTS_MAX}")
            }
        }
    }
}

impl std::error::Error for PointFault {}

/// One value of one knob.
#[derive(Clone, Debug)]
enum Turn {
    Tolerance(f64),
    Triangles(u32),
    PatchDepth(u8),
    Splits(u32),
    Vertices(VertexPrecision),
    DepthRanges(Vec<f64>),
    Morph(f64),
    Pages(u32),
    Delay(u32),
    Workers(u8),
}

impl Point {
    /// This point with one knob turned. `level_max` gives way to deeper patches.
    fn turned(mut self, turn: &Turn) -> Self {
        let lod = &mut self.scene.lod;
        match turn {
            Turn::Tolerance(px) => lod.tolerance = Pixels(*px),
            Turn::Triangles(most) => lod.triangles_max = *most,
            Turn::PatchDepth(depth) => {
                lod.patch_depth = *depth;
                lod.level_max = lod.level_max.min(LEVELS - depth);
            }
            Turn::Splits(most) => lod.splits_max = *most,
            Turn::Vertices(precision) => self.scene.vertices = *precision,
            Turn::DepthRanges(splits_m) => self.scene.depth.splits_m.clone_from(splits_m),
            Turn::Morph(seconds) => lod.morph_s = *seconds,
            Turn::Pages(mib) => self.scene.memory.pages_bytes = u64::from(*mib) << 20,
            Turn::Delay(ms) => self.loader_delay_ms = *ms,
            Turn::Workers(workers) => self.workers = *workers,
        }
        self
    }

    /// Every knob by name, as a sweep file has it.
    pub fn knobs(&self) -> [(&'static str, String); 10] {
        let lod = &self.scene.lod;
        [
            ("tolerance_px", format!("{:?}", lod.tolerance.0)),
            ("triangles_max", lod.triangles_max.to_string()),
            ("patch_depth", lod.patch_depth.to_string()),
            ("splits_max", lod.splits_max.to_string()),
            ("vertices", format!("{:?}", self.scene.vertices)),
            ("depth_ranges", format!("{:?}", self.scene.depth.splits_m)),
            ("morph_s", format!("{:?}", lod.morph_s)),
            ("pages_mib", (self.scene.memory.pages_bytes >> 20).to_string()),
            ("loader_delay_ms", self.loader_delay_ms.to_string()),
            ("workers", self.workers.to_string()),
        ]
    }

    /// The knobs that differ from another point's.
    pub fn turned_from(&self, base: &Self) -> Vec<(&'static str, String)> {
        let both = self.knobs().into_iter().zip(base.knobs());
        both.filter(|(own, other)| own.1 != other.1).map(|(own, _)| own).collect()
    }

    /// What tells it from another point, in words.
    pub fn name(&self, base: &Self) -> String {
        let turned = self.turned_from(base);
        if turned.is_empty() {
            return "the scene as it is".into();
        }
        turned.iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>().join(", ")
    }

    /// This point with other limits of the mesh, for whoever searches on.
    pub fn with_limits(&self, tolerance_px: f64, triangles_max: u32) -> Self {
        let turned = self.clone().turned(&Turn::Tolerance(tolerance_px));
        turned.turned(&Turn::Triangles(triangles_max))
    }

    /// Why no scene file may hold it, if so.
    ///
    /// # Errors
    /// A setting outside its range, or two that do not go together.
    pub fn check(&self, base: &Self) -> Result<(), PointFault> {
        let named = |fault| PointFault::Scene { point: self.name(base), fault };
        write(&self.scene).map(|_| ()).map_err(named)
    }
}

/// What is tried where no file says otherwise: each knob around usual values.
pub fn default_sweep() -> SweepSettings {
    SweepSettings {
        tolerance_px: vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0],
        triangles_max: vec![5000, 10_000, 20_000, 50_000, 100_000, 200_000, 400_000],
        patch_depth: vec![2, 4, 6],
        splits_max: vec![64, 512, 4096],
        vertices: vec![VertexPrecision::TwoFloat, VertexPrecision::EyeF64],
        depth_ranges: vec![vec![], vec![30.0, 1e4]],
        morph_s: vec![0.0, 0.25],
        pages_mib: vec![4, 16, 256],
        loader_delay_ms: vec![0, 200],
        workers: vec![0, 1],
        grid: false,
    }
}

/// Points by which the laws of error, triangles and tolerance are seen down to few triangles:
/// leaves that are drawn as four. One that is drawn as sixteen takes them from where they are
/// needed: below some 1000 leaves a planet is not refined down to the ground.
pub fn law_points(base: &Point) -> Vec<Point> {
    let small = base.clone().turned(&Turn::PatchDepth(2));
    let sizes = [5000, 10_000, 20_000, 50_000, 100_000, 200_000].map(Turn::Triangles);
    let tolerances = [4.0, 8.0, 16.0, 32.0].map(Turn::Tolerance);
    let points = sizes.iter().chain(&tolerances).map(|turn| small.clone().turned(turn));
    let finest = small.clone().turned(&Turn::Tolerance(2.0)).turned(&Turn::Triangles(400_000));
    points.chain([finest]).filter(|point| point.check(base).is_ok()).collect()
}

/// The points of a sweep, the base first: one knob at a time around it, or every value with every
/// other. Points that are equal are one. With `lenient`, values that do not go with the base are
/// left out, as for the default sweep of an unusual scene.
///
/// # Errors
/// Without `lenient`, a point that no scene can be; or too many points.
pub fn points(
    base: &Point,
    sweep: &SweepSettings,
    lenient: bool,
) -> Result<Vec<Point>, PointFault> {
    let axes = axes(sweep);
    let found = if sweep.grid {
        axes.iter().map(|axis| axis.len().max(1)).fold(1, usize::saturating_mul)
    } else {
        1 + axes.iter().map(Vec::len).sum::<usize>()
    };
    if found > POINTS_MAX {
        return Err(PointFault::TooMany { found });
    }
    let mut points = vec![base.clone()];
    if sweep.grid {
        for axis in axes.iter().filter(|axis| !axis.is_empty()) {
            let turn = |point: Point| axis.iter().map(move |turn| point.clone().turned(turn));
            points = points.into_iter().flat_map(turn).collect();
        }
    } else {
        points.extend(axes.iter().flatten().map(|turn| base.clone().turned(turn)));
    }
    let mut kept: Vec<Point> = Vec::new();
    for point in points {
        match point.check(base) {
            Ok(()) if kept.contains(&point) => {}
            Ok(()) => kept.push(point),
            Err(_) if lenient && !kept.is_empty() => {}
            Err(fault) => return Err(fault),
        }
    }
    Ok(kept)
}

fn axes(sweep: &SweepSettings) -> [Vec<Turn>; 10] {
    fn each<T: Clone>(values: &[T], turn: fn(T) -> Turn) -> Vec<Turn> {
        values.iter().cloned().map(turn).collect()
    }
    [
        each(&sweep.tolerance_px, Turn::Tolerance),
        each(&sweep.triangles_max, Turn::Triangles),
        each(&sweep.patch_depth, Turn::PatchDepth),
        each(&sweep.splits_max, Turn::Splits),
        each(&sweep.vertices, Turn::Vertices),
        each(&sweep.depth_ranges, Turn::DepthRanges),
        each(&sweep.morph_s, Turn::Morph),
        each(&sweep.pages_mib, Turn::Pages),
        each(&sweep.loader_delay_ms, Turn::Delay),
        each(&sweep.workers, Turn::Workers),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_config::{Preset, read};

    fn base() -> Point {
        let scene = read(Preset::Small.text(), "small.ron").unwrap();
        Point { scene, loader_delay_ms: 0, workers: 1 }
    }

    #[test]
    fn a_star_turns_one_knob_at_a_time_and_no_point_comes_twice() {
        let base = base();
        let points = points(&base, &default_sweep(), false).unwrap();
        assert_eq!(points[0], base);
        assert!(points[1..].iter().all(|point| point.turned_from(&base).len() == 1));
        for (i, point) in points.iter().enumerate() {
            assert!(!points[..i].contains(point));
        }
        assert_eq!(points[0].name(&base), "the scene as it is");
        assert_eq!(points[1].name(&base), "tolerance_px 2.0");
    }

    #[test]
    fn laws_are_seen_by_small_leaves() {
        let points = law_points(&base());
        assert_eq!(points.len(), 11);
        assert!(points.iter().all(|point| point.scene.lod.patch_depth == 2));
    }

    #[test]
    fn a_grid_has_every_value_with_every_other() {
        let sweep = SweepSettings {
            tolerance_px: vec![1.0, 2.0],
            triangles_max: vec![5000, 10_000, 20_000],
            workers: vec![0, 1],
            grid: true,
            ..SweepSettings::default()
        };
        assert_eq!(points(&base(), &sweep, false).unwrap().len(), 12);
        let many = SweepSettings {
            tolerance_px: vec![1.0; 64],
            triangles_max: vec![5000; 64],
            splits_max: vec![1; 64],
            ..sweep
        };
        let fault = points(&base(), &many, false).unwrap_err().to_string();
        assert_eq!(fault, "the sweep has 524288 points, allowed are 1 to 10000");
    }

    #[test]
    fn what_does_not_go_together_is_named_or_left_out() {
        let sweep = SweepSettings {
            triangles_max: vec![1000, 100],
            patch_depth: vec![8],
            ..SweepSettings::default()
        };
        let fault = points(&base(), &sweep, false).unwrap_err().to_string();
        assert!(fault.starts_with("the point with triangles_max 100: "), "{fault}");
        assert!(fault.contains("lod.triangles_max: is 100, allowed is 128 to"), "{fault}");
        let kept = points(&base(), &sweep, true).unwrap();
        assert_eq!(kept.len(), 3);
        assert_eq!(kept[2].scene.lod.level_max, 48, "it gives way to deep patches");
    }
}

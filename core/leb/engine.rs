//! The engine on the LEB workload: the planet's own split and merge over another rule.
//!
//! In:    a preset, eyes.
//! Out:   the mesh, its leaves, deepest leaf and digest.
//! Keeps: [`Engine`]: a mesh and the eye that it was last refined for.
//! Not here: the reference (`recursion`), times (the bench).
//!
//! The workload's square is quadrant 0 of the octahedron, unfolded: its two root triangles are the
//! base diamond's. Diamonds of the other quadrants have priority 0; those that conformity splits
//! there are not counted.

use super::recursion::Tally;
use super::workload::Preset;
use glam::DVec3;
use overfly_core::datasource::PageKey;
use overfly_core::digest::mix;
use overfly_core::lattice::{RADIUS, unfold};
use overfly_core::lod::agenda::{Band, Verdict};
use overfly_core::lod::diamonds::Shape;
use overfly_core::lod::refine::{ALONE, Knobs, Mesh, Refinement, Rule, Spread};
use overfly_core::lod::wheel::{ASIDE, Family, Lasts, Motion};
use overfly_core::lod::{DiamondId, Diamonds};
use overfly_jobs::{Graph, Span, StartError, Team, Workers};
use parking_lot::Mutex;

/// Priority at which a split is wanted: edge² over T²·distance².
const TOLERANCE: f64 = 1.0;

/// The workload's rule for one eye.
struct LebRule {
    threshold_squared: f64,
    eye: [f64; 3],
    /// Distance at which a diamond of each level is on the threshold.
    reach: [f64; 64],
}

impl LebRule {
    fn new(threshold_squared: f64) -> Self {
        let edge_squared = |level: usize| 2.0 / (1_u64 << level) as f64;
        let reach = |level: usize| (edge_squared(level) / threshold_squared).sqrt();
        Self { threshold_squared, eye: [0.0; 3], reach: core::array::from_fn(reach) }
    }

    fn judge(&self, diamonds: &Diamonds, id: DiamondId, band: Band) -> Verdict {
        let record = &diamonds[id];
        let (centre, level) = (record.centre(), usize::from(record.level()));
        if centre.x < 0 || centre.y < 0 {
            let is_split = record.is_split();
            return if is_split { Verdict::Urgent(0.0) } else { Verdict::Certain(Lasts::FOREVER) };
        }
        let (u, v) = unfold(0, centre);
        const UNIT: f64 = 1.0 / RADIUS as f64;
        let [eye_x, eye_y, h] = self.eye;
        let (dx, dy) = (f64::from(u) * UNIT - eye_x, f64::from(v) * UNIT - eye_y);
        let distance_squared = (dx * dx + dy * dy) + h * h;
        let edge_squared = f64::from_bits((1024 - level as u64) << 52);
        let wanted = edge_squared > self.threshold_squared * distance_squared;
        if wanted != record.is_split() {
            return Verdict::Urgent(edge_squared / (self.threshold_squared * distance_squared));
        }
        let ahead = band.course.dot(DVec3::new(dx, dy, -h));
        let (distance, reach) = (distance_squared.sqrt(), self.reach[level]);
        let lasts = if wanted { stays } else { comes };
        Verdict::Certain(lasts([distance, reach, ahead], band.course_m))
    }
}

/// How long a point at `distance` stays within `reach`, `ahead` of it along the course.
///
/// The distance along a line is convex, so on the way to where the line leaves the reach it is
/// below its chord: at least `(reach − distance)·(1 − gone/length)` are left for going aside.
fn stays([distance, reach, ahead]: [f64; 3], course_m: f64) -> Lasts {
    let slack = reach - distance;
    let leaves = ahead + (ahead * ahead + slack * (reach + distance)).sqrt();
    let length = if leaves < ASIDE * slack { leaves } else { ASIDE * slack };
    longer(Family::Needed, (slack, length), (reach, course_m))
}

/// How long a point at `distance` stays beyond `reach`, `ahead` of it along the course.
///
/// Whoever has gone `a` along and `s` aside, `a + ASIDE·s < length`, must still be beyond: the
/// distance along the line must not fall below `reach + (length − a)/ASIDE`. The distance is a
/// hyperbola over `a`, so it is enough to look where its slope is −1/ASIDE, or where it ends.
fn comes([distance, reach, ahead]: [f64; 3], course_m: f64) -> Lasts {
    /// √(1 − 1/ASIDE²), less its rounding.
    const COSINE: f64 = 0.999_877_92;
    let slack = distance - reach;
    let square = ahead * ahead - slack * (distance + reach);
    let length = if ahead * ASIDE <= distance {
        // The slope is less from the start.
        ASIDE * slack
    } else if square > 0.0 && square * (ASIDE * ASIDE) > reach * reach {
        // The line enters the reach before its slope has become so small.
        ahead - square.sqrt()
    } else {
        let passes_at = (distance * distance - ahead * ahead).sqrt();
        ahead + ASIDE * (passes_at * COSINE - reach)
    };
    longer(Family::Far, (slack, length), (distance, course_m))
}

/// Along the course or whatever the path, whichever lasts longer. A course is trusted for as long
/// as it has been held.
fn longer(family: Family, (slack, length): (f64, f64), (scale_m, course_m): (f64, f64)) -> Lasts {
    let rounding = 1e-12 * scale_m;
    if length > 1.25 * slack && slack < course_m {
        let length_m = length - rounding;
        Lasts { family: Family::Straight, scale_m: length_m, slack_m: length_m }
    } else {
        Lasts { family, scale_m, slack_m: slack - rounding }
    }
}

impl Rule for LebRule {
    fn judge(&self, diamonds: &Diamonds, id: DiamondId, band: Band) -> Verdict {
        self.judge(diamonds, id, band)
    }

    fn kids_ready(&self, _: &Diamonds, _: DiamondId) -> Result<(), PageKey> {
        Ok(())
    }

    fn follow_split(&mut self, _: &Diamonds, _: DiamondId) {}

    fn prepare_merge(&mut self, _: &Diamonds, _: DiamondId) {}
}

/// A mesh that follows the eye.
pub struct Engine {
    /// The mesh.
    pub mesh: Mesh,
    rule: LebRule,
    before: Option<[f64; 3]>,
    /// Whether every diamond is judged in every frame.
    pub judges_all: bool,
}

impl Engine {
    /// The base mesh, with room for a preset's flights.
    pub fn new(preset: Preset) -> Self {
        Self::capped(preset, u32::MAX)
    }

    /// The same, with so many splits and as many merges in one frame at most.
    pub fn capped(preset: Preset, operations_max: u32) -> Self {
        let leaves = u32::try_from(preset.cruise_start().0).expect("at most 16 million");
        let knobs = Knobs {
            tolerance_px: TOLERANCE,
            leaves_max: u32::MAX,
            splits_max: operations_max,
            merges_max: operations_max,
            level_max: u8::MAX,
        };
        // A diamond has two leaves but on the border, where it has one.
        let mut mesh = Mesh::new(leaves + leaves / 4, knobs);
        mesh.create_base();
        let rule = LebRule::new(preset.threshold_squared());
        Self { mesh, rule, before: None, judges_all: false }
    }

    /// One frame on this thread: the mesh is the workload's for this eye when it returns.
    pub fn frame(&mut self, eye: [f64; 3]) -> Refinement {
        self.frame_spread(eye, ALONE)
    }

    /// The same, with what is due judged wherever `spread` takes it.
    pub fn frame_spread(&mut self, eye: [f64; 3], spread: Spread<'_>) -> Refinement {
        let motion = self.before.filter(|_| !self.judges_all).map(|was| {
            let [dx, dy, dz] = [0, 1, 2].map(|axis| eye[axis] - was[axis]);
            let step_m = DVec3::new(dx, dy, dz);
            Motion { path_m: step_m.length(), step_m, ..Motion::default() }
        });
        (self.before, self.rule.eye) = (Some(eye), eye);
        let rule = &self.rule;
        let judge = |diamonds: &Diamonds, id, band| rule.judge(diamonds, id, band);
        self.mesh.prioritise(&judge, motion, spread);
        self.mesh.refine(&mut self.rule)
    }

    /// Leaves and deepest leaf of the square.
    pub fn tally(&self) -> Tally {
        self.digest().0
    }

    /// The same, and the digest of the workload's description.
    pub fn digest(&self) -> (Tally, u64) {
        let diamonds = &self.mesh.diamonds;
        let (mut tally, mut sum) = (Tally { leaves: 0, deepest: 0 }, 0_u64);
        for id in diamonds.ids().filter(|&id| !diamonds[id].is_split()) {
            let shape = diamonds.shape(id);
            let sides = (0..2).filter(|&side| diamonds[id].has_side(side));
            for key in sides.filter_map(|side| key_of(&shape, side)) {
                tally.leaves += 1;
                tally.deepest = tally.deepest.max(u32::from(shape.level) + 1);
                sum = sum.wrapping_add(mix(key));
            }
        }
        (tally, sum)
    }

    /// Bytes in use: records, priorities, seats.
    pub fn bytes(&self) -> usize {
        let diamonds = &self.mesh.diamonds;
        let records = diamonds.used_end();
        records as usize * 64 + self.mesh.agenda.bytes(records)
    }
}

/// The workload's key of a triangle; `None` if it is not in the square.
fn key_of(shape: &Shape, side: usize) -> Option<u64> {
    let triangle = shape.triangle(side);
    if triangle.iter().any(|corner| corner.x < 0 || corner.y < 0) {
        return None;
    }
    let unfolded = triangle.map(|corner| unfold(0, corner));
    let [x, y] = unfolded.iter().fold([0_u64; 2], |[x, y], (u, v)| {
        [x + u64::from(u.unsigned_abs()), y + u64::from(v.unsigned_abs())]
    });
    // The lattice is 2³⁰ a side; the key counts in 2⁻²⁴.
    Some((u64::from(shape.level) + 1) << 58 ^ x >> 6 << 29 ^ y >> 6)
}

/// An engine whose verdicts are shared among workers.
pub struct Shared {
    engine: Mutex<(Engine, [f64; 3], Refinement)>,
    graph: Graph<Mutex<(Engine, [f64; 3], Refinement)>>,
    workers: Workers,
}

impl Shared {
    /// An engine and as many threads beside the caller.
    ///
    /// # Errors
    /// The system refused a thread, or more than 64 were asked for.
    pub fn new(preset: Preset, threads: usize) -> Result<Self, StartError> {
        let mut graph = Graph::new();
        graph.stage(
            Span("leb"),
            &[],
            |shared: &Mutex<(Engine, [f64; 3], Refinement)>, team: &Team<'_>| {
                let (engine, eye, done) = &mut *shared.lock();
                let spread: Spread<'_> = &|column, body| team.for_each_chunk(column, 256, body);
                *done = engine.frame_spread(*eye, spread);
            },
        );
        let engine = Mutex::new((Engine::new(preset), [0.0; 3], Refinement::default()));
        Ok(Self { engine, graph, workers: Workers::new(threads)? })
    }

    /// One frame.
    pub fn frame(&mut self, eye: [f64; 3]) -> Refinement {
        self.engine.get_mut().1 = eye;
        self.graph.run(&self.engine, &self.workers).expect("no stage of the workload panics");
        self.engine.get_mut().2
    }

    /// The engine, between frames.
    pub fn engine(&mut self) -> &mut Engine {
        &mut self.engine.get_mut().0
    }
}

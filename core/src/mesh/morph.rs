//! Where new vertices begin: on the surface that their diamond's split refined.
//!
//! In:    split times of the diamonds, pages, places of a patch's vertices.
//! Out:   [`PatchMorph`]s: a function of the lattice point, the split times and the pages alone.
//! Keeps: which vertex of a patch halves which edge.
//! Not here: a patch's own vertices (`build`), split times (`lod::cover`), the frame's clock.
//!
//! The split of a diamond of level l adds the vertices of lattice level l + k + 1 inside its quad:
//! each halves an edge (a, b) of the small triangles drawn before, begins where the middle of that
//! edge was drawn when it was born, and goes straight to its own place. The split that bore it is
//! one of those that made the leaf's ancestors: 1, 2, … k steps up for the vertices that halving
//! the leaf makes, the finest first, and farther up for its corners. Where a and b were on their
//! way themselves, that counts too, and they are of elder splits; so all is worked out from the
//! eldest split that matters down to the youngest. Splits along a leaf's ancestors are no younger
//! than those below them: the walk up ends at the first that was over when the next began.
//!
//! Merges do not morph: the coarser patch appears at once. A diamond split again is born again.

use super::build::{Ground, place_of};
use super::patches::{PatchMorph, PatchVertex};
use super::topology::{segments, vertex_index};
use crate::columns::Id;
use crate::datasource::Page;
use crate::datasource::generate::encode;
use crate::geodesy::frames::narrow;
use crate::lattice::LEVEL_END;
use crate::lod::DiamondId;
use glam::{DVec3, IVec3};

/// Longest morph: twelve days, far below the 2^32 ms after which times repeat.
const LONGEST_MS: f64 = (1_u32 << 30) as f64;

/// A vertex whose way is longer than this many of the edge that it halves does not go it: where a
/// dozen levels come in as many frames, the surface that they refine is nowhere near the ground.
const LEAP: f64 = 1.0;

/// A morph of this many seconds in milliseconds; 0 if and only if the scene does not morph.
pub fn duration_ms(morph_s: f64) -> u32 {
    if morph_s > 0.0 {
        #[expect(clippy::cast_possible_truncation, reason = "clamped to 31 bits")]
        let ms = (morph_s * 1e3).round().clamp(1.0, LONGEST_MS) as u32;
        return ms;
    }
    0
}

impl PatchMorph {
    /// A vertex of an empty slot.
    pub const EMPTY: Self =
        Self { from_m: [0.0; 3], normal_oct: [0; 2], layers: [0; 4], born_ms: 0 };

    /// What is left of the vertex's way at a time: 1 when it is born, falling in a straight line,
    /// exactly 0 from `morph_ms` later on and before its birth, as after a seek.
    ///
    /// This is the one definition: `1 − f32(age) / f32(morph_ms)` in f32, and a vertex is drawn
    /// at its own place plus this times [`PatchMorph::from_m`]. `now_ms` is a frame's
    /// [`time_ms`](crate::frame::FrameOutput::time_ms), `morph_ms` is [`duration_ms`].
    pub fn left(&self, now_ms: u32, morph_ms: u32) -> f32 {
        left_of(now_ms, self.born_ms, morph_ms)
    }

    /// A vertex that is where it belongs, whatever the time says.
    fn arrived(vertex: &PatchVertex) -> Self {
        Self { normal_oct: vertex.normal_oct, layers: vertex.layers, ..Self::EMPTY }
    }
}

fn left_of(now_ms: u32, born_ms: u32, morph_ms: u32) -> f32 {
    let age_ms = now_ms.wrapping_sub(born_ms);
    if age_ms >= morph_ms {
        return 0.0;
    }
    1.0 - narrow(f64::from(age_ms)) / narrow(f64::from(morph_ms))
}

/// One vertex of a patch that is born in the middle of an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Halving {
    /// 0 for what the last halving makes, and counted down to it: ordered from coarse to fine.
    after: core::cmp::Reverse<usize>,
    vertex: u32,
    ends: [u32; 2],
}

/// How a scene morphs.
pub struct Morphing {
    /// How long a vertex is on its way, in milliseconds; never 0.
    pub duration_ms: u32,
    patch_depth: u8,
    halvings: Vec<Halving>,
}

impl Morphing {
    /// The morphing of a scene; `None` where `morph_s` is 0.
    pub fn new(morph_s: f64, patch_depth: u8) -> Option<Self> {
        let duration_ms = duration_ms(morph_s);
        let n = segments(patch_depth);
        let mut halvings = Vec::new();
        halve([(0, 0), (n, 0), (n, n)], patch_depth, &mut halvings);
        halvings.sort_unstable();
        halvings.dedup();
        (duration_ms > 0).then_some(Self { duration_ms, patch_depth, halvings })
    }
}

/// The vertices that halving a triangle of (row, column)s some times makes, as `topology` does.
fn halve([apex, start, end]: [(u32, u32); 3], times: u8, list: &mut Vec<Halving>) {
    let Some(after) = times.checked_sub(1) else { return };
    let middle = (u32::midpoint(start.0, end.0), u32::midpoint(start.1, end.1));
    let index = |(row, column)| vertex_index(row, column);
    let (a, b) = (index(start), index(end));
    list.push(Halving {
        after: core::cmp::Reverse(usize::from(after)),
        vertex: index(middle),
        ends: [a.min(b), a.max(b)],
    });
    halve([middle, apex, start], after, list);
    halve([middle, end, apex], after, list);
}

/// Morphing at one time.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// How the scene morphs.
    pub morphing: &'a Morphing,
    /// Now, on the frame's clock.
    pub now_ms: u32,
}

/// One split that made an ancestor of a leaf.
#[derive(Clone, Copy)]
struct Step {
    diamond: DiamondId,
    /// The side of it in which the leaf lies: one of the triangles that the split cut.
    side: usize,
    /// The page that this triangle was drawn from.
    page: Id<Page>,
    born_ms: u32,
}

/// How a vertex is drawn over time.
#[derive(Clone, Copy)]
struct Way {
    /// Its own place, body-fixed metres.
    place: DVec3,
    /// Where it begins; meaningless once it rests.
    morph: PatchMorph,
    /// It has no way left at any time that matters.
    rests: bool,
}

impl Way {
    fn resting(place: DVec3) -> Self {
        Self { place, morph: PatchMorph::EMPTY, rests: true }
    }
}

/// Scratch of one patch.
pub struct Ways {
    steps: Vec<Step>,
    ways: Vec<Way>,
}

impl Ways {
    /// Room for a patch of so many vertices.
    pub fn new(vertices_per_patch: u32) -> Self {
        Self {
            steps: Vec::with_capacity(usize::from(LEVEL_END)),
            ways: Vec::with_capacity(vertices_per_patch as usize),
        }
    }
}

/// The leaf triangle whose vertices are asked for, and their own data in the patch's order.
#[derive(Clone, Copy)]
pub struct Built<'a> {
    /// Its diamond.
    pub diamond: DiamondId,
    /// Its side of that.
    pub side: usize,
    /// Apex and hypotenuse.
    pub corners: [IVec3; 3],
    /// Lattice points.
    pub points: &'a [IVec3],
    /// Body-fixed places.
    pub places: &'a [DVec3],
    /// Everything else.
    pub vertices: &'a [PatchVertex],
}

/// Writes where the vertices of one patch begin.
pub fn write(
    ground: &Ground<'_>,
    moment: Moment<'_>,
    built: &Built<'_>,
    scratch: &mut Ways,
    morphs: &mut [PatchMorph],
) {
    let Ways { steps, ways } = scratch;
    let morph_ms = moment.morphing.duration_ms;
    let runs = walk_up(ground, moment, (built.diamond, built.side), steps);
    if !runs {
        let arrived = built.vertices.iter().map(PatchMorph::arrived);
        morphs.iter_mut().zip(arrived).for_each(|(to, morph)| *to = morph);
        return;
    }
    ways.clear();
    ways.extend(built.places.iter().map(|&place| Way::resting(place)));
    let origin = Origin { ground, steps, morph_ms };
    let depth = usize::from(moment.morphing.patch_depth);
    if steps.len() > depth {
        let n = segments(moment.morphing.patch_depth);
        let at = [0, vertex_index(n, 0), vertex_index(n, n)];
        let corners = origin.corners(built.corners, depth);
        at.into_iter().zip(corners).for_each(|(at, way)| ways[at as usize] = way);
    }
    for halving in &moment.morphing.halvings {
        if let Some(step) = steps.get(halving.after.0) {
            let ends = halving.ends.map(|end| (built.points[end as usize], ways[end as usize]));
            let way = &mut ways[halving.vertex as usize];
            *way = origin.between(ends, step, way.place);
        }
    }
    for ((to, way), vertex) in morphs.iter_mut().zip(ways).zip(built.vertices) {
        let runs = !way.rests && moment.now_ms.wrapping_sub(way.morph.born_ms) < morph_ms;
        *to = if runs { way.morph } else { PatchMorph::arrived(vertex) };
    }
}

/// The splits that made the ancestors of a leaf and itself, the youngest first, as far as they
/// matter; whether any still runs.
fn walk_up(
    ground: &Ground<'_>,
    moment: Moment<'_>,
    (mut id, mut side): (DiamondId, usize),
    steps: &mut Vec<Step>,
) -> bool {
    steps.clear();
    // What was over when a younger one began moves nothing that is seen now, and so do its elders.
    let mut until_ms = moment.now_ms;
    while let Some(diamond) = ground.diamonds[id].parents()[side] {
        let born_ms = ground.cover.split_ms[diamond];
        if until_ms.wrapping_sub(born_ms) >= moment.morphing.duration_ms {
            break;
        }
        side = ground.diamonds[id].slot(side) / 2;
        let page = ground.cover.pages[diamond][side].expect("a split diamond has both sides");
        steps.push(Step { diamond, side, page, born_ms });
        (id, until_ms) = (diamond, born_ms);
    }
    !steps.is_empty()
}

/// What beginnings are worked out from.
struct Origin<'a> {
    ground: &'a Ground<'a>,
    steps: &'a [Step],
    morph_ms: u32,
}

/// How a vertex was drawn at some time.
struct Drawn {
    place: DVec3,
    normal: DVec3,
    layers: [f64; 4],
}

impl Origin<'_> {
    /// The ways of a leaf's corners, each the middle of the hypotenuse of an ancestor: from the
    /// eldest triangle that matters down to the leaf, each adds one.
    fn corners(&self, leaf: [IVec3; 3], patch_depth: usize) -> [Way; 3] {
        let mut known: [Option<(IVec3, Way)>; 4] = [None; 4];
        let find = |known: &[Option<(IVec3, Way)>; 4], point| {
            known.iter().flatten().find(|(at, _)| *at == point).map(|(_, way)| *way)
        };
        for (up, step) in self.steps[..self.steps.len() - patch_depth].iter().enumerate().rev() {
            let page = self.ground.pages.get(step.page);
            let place = |point| place_of(self.ground, page, point);
            let shape = self.ground.diamonds.shape(step.diamond);
            let [apex, start, end] = shape.triangle(step.side).map(|point| {
                (point, find(&known, point).unwrap_or_else(|| Way::resting(place(point))))
            });
            let centre = shape.centre();
            let way = self.between([start, end], &self.steps[patch_depth + up], place(centre));
            known = [Some((centre, way)), Some(apex), Some(start), Some(end)];
        }
        leaf.map(|point| find(&known, point).expect("a kid has the corners of its parent"))
    }

    /// The way of a vertex between two others, born by `step`.
    fn between(&self, ends: [(IVec3, Way); 2], step: &Step, place: DVec3) -> Way {
        let page = self.ground.pages.get(step.page);
        let [a, b] = ends.map(|(point, way)| self.drawn((point, &way), page, step.born_ms));
        let from = (a.place + b.place) * 0.5 - place;
        if from.length_squared() > LEAP * LEAP * (a.place - b.place).length_squared() {
            return Way::resting(place);
        }
        let sum = a.normal + b.normal;
        let layers = [0, 1, 2, 3].map(|i| level_of(f64::midpoint(a.layers[i], b.layers[i])));
        let morph = PatchMorph {
            from_m: from.to_array().map(narrow),
            normal_oct: encode(sum / sum.length()),
            layers,
            born_ms: step.born_ms,
        };
        Way { place, morph, rests: false }
    }

    /// A vertex as a triangle of `page` drew it at some time.
    fn drawn(&self, (point, way): (IVec3, &Way), page: &Page, time_ms: u32) -> Drawn {
        let at = page.sample_index(point);
        let own = (decode(page.normals[at]), page.layers[at].map(f64::from));
        let left = if way.rests { 0.0 } else { way.morph.left(time_ms, self.morph_ms) };
        if left == 0.0 {
            return Drawn { place: way.place, normal: own.0, layers: own.1 };
        }
        let left = f64::from(left);
        let offset = DVec3::from_array(way.morph.from_m.map(f64::from));
        let normal = own.0 * (1.0 - left) + decode(way.morph.normal_oct) * left;
        let mix = |own: f64, start: u8| own * (1.0 - left) + f64::from(start) * left;
        Drawn {
            place: way.place + offset * left,
            normal: normal / normal.length(),
            layers: [0, 1, 2, 3].map(|i| mix(own.1[i], way.morph.layers[i])),
        }
    }
}

fn level_of(x: f64) -> u8 {
    #[expect(clippy::cast_possible_truncation, reason = "a mean of bytes, rounded")]
    let level = x.round() as u8;
    level
}

/// The unit normal that two numbers of a vertex encode: the inverse of [`encode`], which is within
/// 4e-5 rad of what it was given.
pub fn decode(oct: [i16; 2]) -> DVec3 {
    let [x, y] = oct.map(|c| f64::from(c) / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    let sign = |c: f64| if c < 0.0 { -1.0 } else { 1.0 };
    let normal = if z >= 0.0 {
        DVec3::new(x, y, z)
    } else {
        DVec3::new((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y), z)
    };
    normal / normal.length()
}

//! The yardstick: the whole mesh of a frame anew, top-down from the two roots, keeping nothing.
//!
//! In:    the [`Rule`]: a threshold and an eye.
//! Out:   leaves and deepest leaf ([`count`]), their digest ([`digest`]), vertices ([`vertices`]).
//! Keeps: nothing.
//! Not here: what changed since the last frame, which is all an incremental engine has to find.

use overfly_core::geodesy::frames::narrow;

/// A point of the unit square, or the way between two.
type Point = [f64; 2];

/// The vertices of one leaf relative to the eye, in sides of the square: 36 bytes.
pub type LeafVertices = [[f32; 3]; 3];

/// The roots, each as a first base end, apex and second base end.
const ROOTS: [[Point; 3]; 2] =
    [[[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]];

/// The squared base of a root.
const ROOT_EDGE_SQUARED: f64 = 2.0;

/// Deepest leaf that the numbers bear: down to it every vertex is a multiple of 2⁻²³.
pub const DEPTH_MAX: u32 = 46;

/// Waiting halves, at most one a level.
const STACK: usize = DEPTH_MAX as usize;

/// The refinement rule of one frame: a threshold squared and an eye.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    threshold_squared: f64,
    eye: [f64; 3],
    height_squared: f64,
}

impl Rule {
    /// The rule of a [threshold](super::workload::Preset::threshold_squared) and an
    /// [eye](super::workload::Flight::eye).
    ///
    /// # Panics
    /// If the eye is so low that leaves below [`DEPTH_MAX`] might be wanted.
    pub fn new(threshold_squared: f64, eye: [f64; 3]) -> Self {
        let height_squared = eye[2] * eye[2];
        let finest_edge_squared = 4.0 / (1_u64 << DEPTH_MAX) as f64;
        assert!(threshold_squared * height_squared >= finest_edge_squared, "leaves are too deep");
        Self { threshold_squared, eye, height_squared }
    }

    /// Whether the diamond around this base is split: its middle and its squared length, both
    /// exact, so that this is the decision of the rule as written, to the bit.
    #[inline]
    pub fn wants(&self, middle: [f64; 2], edge_squared: f64) -> bool {
        let dx = middle[0] - self.eye[0];
        let dy = middle[1] - self.eye[1];
        edge_squared > self.threshold_squared * ((dx * dx + dy * dy) + self.height_squared)
    }
}

/// What a mesh amounts to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// Leaf triangles.
    pub leaves: u64,
    /// Depth of the deepest one; a root has 1.
    pub deepest: u32,
}

/// A triangle as its base sees it. The ends of the base are at the middle plus and minus `end`.
/// Halves need no more than sums and halvings of these, all exact.
#[derive(Clone, Copy, Debug, Default)]
struct Triangle {
    middle: Point,
    /// From the middle of the base to its first end.
    end: Point,
    /// From the middle of the base to the apex.
    apex: Point,
}

impl Triangle {
    /// The triangle of a first base end, an apex and a second base end.
    fn new([first, apex, second]: [Point; 3]) -> Self {
        let middle = [0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])];
        Self { middle, end: minus(first, middle), apex: minus(apex, middle) }
    }

    /// The halves at the first and at the second end of the base.
    #[inline]
    fn halves(&self) -> [Self; 2] {
        let Self { middle, end, apex } = *self;
        let p = [0.5 * (end[0] + apex[0]), 0.5 * (end[1] + apex[1])];
        let q = [0.5 * (end[0] - apex[0]), 0.5 * (end[1] - apex[1])];
        let first = Self { middle: plus(middle, p), end: q, apex: [-p[0], -p[1]] };
        [first, Self { middle: minus(middle, q), end: p, apex: q }]
    }

    /// First base end, apex, second base end.
    #[inline]
    fn vertices(&self) -> [Point; 3] {
        let Self { middle, end, apex } = *self;
        [plus(middle, end), plus(middle, apex), minus(middle, end)]
    }
}

#[inline]
fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline]
fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// Leaves and deepest leaf of the frame's mesh.
pub fn count(rule: &Rule) -> Tally {
    refine(rule, |_, _| {})
}

/// The same, and the sum over all leaves that names the mesh whatever their order.
pub fn digest(rule: &Rule) -> (Tally, u64) {
    let mut sum = 0_u64;
    let tally = refine(rule, |leaf, depth| sum = sum.wrapping_add(mix(key(leaf, depth))));
    (tally, sum)
}

/// The same as [`count`], and the vertices of every leaf at the front of `out`.
///
/// # Panics
/// If `out` is shorter than the leaves are many.
pub fn vertices(rule: &Rule, out: &mut [LeafVertices]) -> Tally {
    let [x, y, height] = rule.eye;
    let down = narrow(-height);
    let mut at = 0;
    refine(rule, |leaf, _| {
        out[at] = leaf.vertices().map(|v| [narrow(v[0] - x), narrow(v[1] - y), down]);
        at += 1;
    })
}

/// Calls `leaf` with every leaf of the frame's mesh and its depth.
///
/// The stack is explicit and holds second halves only: the walk goes on with the first, which
/// stays in registers. Both halves are tested before either is entered, so that leaves are
/// never walked to. This takes two thirds of the time of the recursion as it is written down.
#[inline]
fn refine(rule: &Rule, mut leaf: impl FnMut(&Triangle, u32)) -> Tally {
    let mut tally = Tally::default();
    for root in ROOTS.map(Triangle::new) {
        if rule.wants(root.middle, ROOT_EDGE_SQUARED) {
            refine_root(rule, root, &mut tally, &mut leaf);
        } else {
            tally.leaves += 1;
            tally.deepest = tally.deepest.max(1);
            leaf(&root, 1);
        }
    }
    tally
}

/// The part of [`refine`] below a root that is split.
#[inline]
fn refine_root(
    rule: &Rule,
    root: Triangle,
    tally: &mut Tally,
    leaf: &mut impl FnMut(&Triangle, u32),
) {
    let mut waiting = [(Triangle::default(), 0.0, 0); STACK];
    let mut top = 0;
    let (mut triangle, mut edge_squared, mut depth) = (root, ROOT_EDGE_SQUARED, 1);
    let (mut leaves, mut deepest) = (1, 1);
    loop {
        let [first, second] = triangle.halves();
        edge_squared *= 0.5;
        depth += 1;
        // Whatever its halves do, a split makes one leaf more.
        leaves += 1;
        deepest = deepest.max(depth);
        let splits_first = rule.wants(first.middle, edge_squared);
        let splits_second = rule.wants(second.middle, edge_squared);
        match (splits_first, splits_second) {
            (true, true) => {
                waiting[top] = (second, edge_squared, depth);
                top += 1;
                triangle = first;
            }
            (true, false) => {
                leaf(&second, depth);
                triangle = first;
            }
            (false, true) => {
                leaf(&first, depth);
                triangle = second;
            }
            (false, false) => {
                leaf(&first, depth);
                leaf(&second, depth);
                if top == 0 {
                    break;
                }
                top -= 1;
                (triangle, edge_squared, depth) = waiting[top];
            }
        }
    }
    tally.leaves += leaves;
    tally.deepest = tally.deepest.max(deepest);
}

/// The leaf's key: its depth, and the sum of its vertices in 2⁻²⁴ of the side.
#[inline]
fn key(leaf: &Triangle, depth: u32) -> u64 {
    let [sx, sy] = [0, 1].map(|i| grid(3.0 * leaf.middle[i] + leaf.apex[i]));
    (u64::from(depth) << 58) ^ (sx << 29) ^ sy
}

/// A sum of coordinates as the integer it is in 2⁻²⁴ of the side: added to 2⁵², it is what the
/// fraction bits hold.
#[inline]
fn grid(sum: f64) -> u64 {
    const UNIT_ONE: f64 = (1_u64 << 52) as f64;
    (sum * f64::from(1_u32 << 24) + UNIT_ONE).to_bits() & ((1 << 52) - 1)
}

/// The finaliser of SplitMix64. Its own copy: a yardstick leans on nothing that it measures.
#[inline]
fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

//! Splitting and merging one diamond: exact inverses, on topology, pages and patches at once.
//!
//! In:    a diamond that `refine` chose; resident pages.
//! Out:   changed diamonds, patches taken and given back, pages held and released.
//! Keeps: nothing of its own; [`Surface`] borrows all that an operation touches.
//! Not here: which diamond to choose (`refine`).

use super::diamonds::{DiamondId, Diamonds, Shape};
use super::queues::{Queue, Queues, Rank};
use super::reach::{cap_of, page_depth, page_is_finest};
use super::screen_error::{Horizon, Region, Sight, priority_px};
use crate::columns::Id;
use crate::datasource::pages::Pages;
use crate::datasource::{Page, PageKey};
use crate::geodesy::Ellipsoid;
use crate::lattice::{RADIUS, normal_of, signs, unfold};
use crate::mesh::patches::{Leaf, Patches};
use crate::settings::LodSettings;
use glam::IVec3;

/// All that a split or merge reads or changes.
pub struct Surface<'a> {
    /// The diamonds.
    pub diamonds: &'a mut Diamonds,
    /// Their queues.
    pub queues: &'a mut Queues,
    /// The resident pages.
    pub pages: &'a mut Pages,
    /// The patch arena.
    pub patches: &'a mut Patches,
    /// This frame's views.
    pub sights: &'a [Sight],
    /// The body's shape.
    pub body: &'a Ellipsoid,
    /// What the body contributes to bounds.
    pub horizon: Horizon,
    /// The knobs.
    pub lod: &'a LodSettings,
    /// This frame's number.
    pub frame: u64,
}

impl Surface<'_> {
    /// The standing of a diamond in its queue.
    pub fn rank(&self, id: DiamondId) -> Rank {
        let node = &self.diamonds.node[id];
        let priority_px = self.diamonds.priority_px[id];
        Rank { priority_px, level: node.shape.level, key: node.key }
    }

    /// Creates the base octahedron over the four root pages.
    pub fn create_base(&mut self, roots: [Id<Page>; 4]) {
        let quadrants = [0_u8, 1, 2, 3];
        let base = quadrants.map(|quadrant| {
            let id = self.diamonds.take(base_shape(quadrant));
            let root = roots[usize::from(quadrant)];
            self.diamonds.node[id].pages = [Some(root); 2];
            self.pages.hold(root);
            self.pages.hold(root);
            self.diamonds.region[id] = self.region_of(id);
            id
        });
        self.diamonds.base = Some(base);
        for id in base {
            self.add_leaf(id, 0);
            self.add_leaf(id, 1);
            self.enqueue(id, self.queue_of_leaf(id));
        }
    }

    fn queue_of_leaf(&self, id: DiamondId) -> Queue {
        let deepest = self.diamonds.node[id].shape.level >= self.lod.level_max;
        if deepest { Queue::Deepest } else { Queue::Split }
    }

    /// Why `id` cannot be split now: the page that it or an ancestor to be forced waits for.
    /// Otherwise `chain` holds the diamonds to split, ancestors first, `id` last.
    pub fn plan_split(&self, id: DiamondId, chain: &mut Vec<DiamondId>) -> Result<(), PageKey> {
        chain.clear();
        self.plan(id, chain)
    }

    fn plan(&self, id: DiamondId, chain: &mut Vec<DiamondId>) -> Result<(), PageKey> {
        for parent in self.diamonds.node[id].parents.into_iter().flatten() {
            if !self.diamonds.node[parent].split && !chain.contains(&parent) {
                self.plan(parent, chain)?;
            }
        }
        self.page_of_kids(id, 0)?;
        self.page_of_kids(id, 1)?;
        chain.push(id);
        Ok(())
    }

    /// The page that serves triangle `side` of `id`, or will once that parent is split.
    fn page_of(&self, id: DiamondId, side: usize) -> Result<Id<Page>, PageKey> {
        let node = &self.diamonds.node[id];
        if let Some(page) = node.pages[side] {
            return Ok(page);
        }
        let parent = node.parents[side].expect("base diamonds have both sides");
        self.page_of_kids(parent, usize::from(node.slots[side] / 2))
    }

    /// The page that serves the kids' triangles on one side of `id`, or the key that is lacking.
    fn page_of_kids(&self, id: DiamondId, side: usize) -> Result<Id<Page>, PageKey> {
        let node = &self.diamonds.node[id];
        let page = self.page_of(id, side)?;
        let key = self.pages.get(page).key;
        if page_depth(node.shape.level + 1, self.lod.patch_depth) == key.depth() {
            return Ok(page);
        }
        let child = child_around(key, node.shape.triangle(side));
        self.pages.children[page][child].ok_or_else(|| key.child(child))
    }

    /// Splits a diamond whose parents are split and whose kids' pages are resident.
    pub fn split(&mut self, id: DiamondId) {
        self.queues.remove(id);
        for side in 0..2 {
            self.remove_leaf(id, side);
            let page = self.page_of_kids(id, side).expect("the plan found every page");
            for edge in [2 * side, 2 * side + 1] {
                self.attach_kid(id, edge, page);
            }
        }
        let node = &mut self.diamonds.node[id];
        node.split = true;
        node.touched = self.frame;
        for parent in node.parents.into_iter().flatten() {
            self.diamonds.node[parent].split_kids += 1;
            self.queues.remove(parent);
        }
        self.queues.insert(id, Queue::Merge, self.diamonds.priority_px[id]);
    }

    /// Merges a split diamond without split kids: the exact inverse of [`Self::split`].
    pub fn merge(&mut self, id: DiamondId) {
        self.queues.remove(id);
        for edge in 0..4 {
            self.detach_kid(id, edge);
        }
        let node = &mut self.diamonds.node[id];
        debug_assert!(node.split && node.split_kids == 0);
        node.split = false;
        node.touched = self.frame;
        let parents = node.parents;
        self.add_leaf(id, 0);
        self.add_leaf(id, 1);
        self.queues.insert(id, Queue::Split, self.diamonds.priority_px[id]);
        for parent in parents.into_iter().flatten() {
            self.diamonds.node[parent].split_kids -= 1;
            if self.diamonds.node[parent].split_kids == 0 {
                self.enqueue(parent, Queue::Merge);
            }
        }
    }

    /// Gives kid `edge` of `id` its triangle on this side, and a record if it has none.
    fn attach_kid(&mut self, id: DiamondId, edge: usize, page: Id<Page>) {
        let (kid, is_new) = match self.diamonds.node[id].kids[edge] {
            Some(kid) => (kid, false),
            None => (self.create_kid(id, edge), true),
        };
        let side = usize::from(self.diamonds.node[kid].parents[1] == Some(id));
        self.diamonds.node[kid].pages[side] = Some(page);
        self.pages.hold(page);
        if is_new {
            self.diamonds.region[kid] = self.region_of(kid);
        }
        self.add_leaf(kid, side);
        if is_new {
            self.enqueue(kid, self.queue_of_leaf(kid));
        }
    }

    /// A record for kid `edge` of `id`, linked to both parents; the lesser key is parent 0.
    fn create_kid(&mut self, id: DiamondId, edge: usize) -> DiamondId {
        let (neighbour, other_edge) = self.diamonds.across(id, edge);
        let here = &self.diamonds.node[id];
        let there = &self.diamonds.node[neighbour];
        let corners = here.shape.corners();
        let (from, to) = (corners[edge], corners[(edge + 1) & 3]);
        let (mine, theirs) = (here.shape.centre(), there.shape.centre());
        let level = here.shape.level + 1;
        let slots = [edge, other_edge].map(|e| u8::try_from(e).expect("four edges"));
        let (shape, parents, slots) = if here.key < there.key {
            let shape = Shape { ends: [to, from], apexes: [mine, theirs], level };
            (shape, [Some(id), Some(neighbour)], slots)
        } else {
            let shape = Shape { ends: [from, to], apexes: [theirs, mine], level };
            (shape, [Some(neighbour), Some(id)], [slots[1], slots[0]])
        };
        let kid = self.diamonds.take(shape);
        self.diamonds.node[kid].parents = parents;
        self.diamonds.node[kid].slots = slots;
        self.diamonds.node[id].kids[edge] = Some(kid);
        self.diamonds.node[neighbour].kids[other_edge] = Some(kid);
        kid
    }

    /// Takes the triangle on this side from kid `edge`, and its record if that was the last.
    fn detach_kid(&mut self, id: DiamondId, edge: usize) {
        let kid = self.diamonds.node[id].kids[edge].expect("a split diamond has all kids");
        let side = usize::from(self.diamonds.node[kid].parents[1] == Some(id));
        self.remove_leaf(kid, side);
        let page = self.diamonds.node[kid].pages[side].take().expect("the side was there");
        self.pages.release(page, self.frame);
        if self.diamonds.node[kid].has_side(1 - side) {
            return;
        }
        self.queues.remove(kid);
        let node = &self.diamonds.node[kid];
        let links = [0, 1].map(|s| (node.parents[s].expect("kids have parents"), node.slots[s]));
        for (parent, slot) in links {
            self.diamonds.node[parent].kids[usize::from(slot)] = None;
        }
        self.diamonds.give_back(kid);
    }

    fn add_leaf(&mut self, id: DiamondId, side: usize) {
        let slot = self.patches.take(Leaf { diamond: id.index(), side: u8::from(side == 1) });
        self.diamonds.node[id].patches[side] = Some(slot);
        self.diamonds.count_leaf(id, side, true);
    }

    fn remove_leaf(&mut self, id: DiamondId, side: usize) {
        let slot = self.diamonds.node[id].patches[side].take().expect("it was a leaf");
        self.patches.give_back(slot);
        self.diamonds.count_leaf(id, side, false);
    }

    fn enqueue(&mut self, id: DiamondId, queue: Queue) {
        let priority_px = priority_px(&self.diamonds.region[id], self.sights);
        self.diamonds.priority_px[id] = priority_px;
        self.queues.insert(id, queue, priority_px);
    }

    /// The bounds of a diamond: what its page knows, within what both parents allow.
    fn region_of(&self, id: DiamondId) -> Region {
        let node = &self.diamonds.node[id];
        let (level, centre) = (node.shape.level, node.shape.centre());
        let normal = normal_of(centre);
        let Horizon { floor_m, peak_m, .. } = self.horizon;
        let (mut low_m, mut high_m) = (floor_m, peak_m);
        // Above the finest grid of the root pages nothing is known but the body's whole relief.
        let mut error_m = peak_m - floor_m + self.horizon.curvature_m[1];
        if page_is_finest(level, self.lod.patch_depth) {
            let page = node.pages[0].or(node.pages[1]).expect("a record has a side");
            let page = self.pages.get(page);
            let bound = page.bound_at(centre);
            let height_m = f64::from(page.heights_m[page.sample_index(centre)]);
            // Below a sea the interval shrinks to its surface, where the body's floor is.
            low_m = (height_m - f64::from(bound.variation_m)).max(floor_m);
            high_m = (height_m + f64::from(bound.variation_m)).max(floor_m);
            let is_even = level.is_multiple_of(2);
            error_m = f64::from(if is_even { bound.error_even_m } else { bound.error_odd_m });
        }
        for parent in node.parents.into_iter().flatten() {
            let outer = &self.diamonds.region[parent];
            low_m = low_m.max(outer.low_m).min(outer.high_m);
            high_m = high_m.min(outer.high_m).max(outer.low_m);
            error_m = error_m.min(outer.error_m);
        }
        Region {
            normal,
            surface: self.body.surface_from_normal(normal),
            cap: cap_of(level, centre),
            low_m,
            high_m,
            error_m,
            tangent_m: self.horizon.tangent_m(high_m),
        }
    }
}

/// The base diamond of a quadrant: ends east and west on the equator, apexes north and south.
pub fn base_shape(quadrant: u8) -> Shape {
    let (sx, sy) = signs(quadrant);
    let (x, y) = (IVec3::X * sx * RADIUS, IVec3::Y * sy * RADIUS);
    let ends = if sx == sy { [y, x] } else { [x, y] };
    Shape { ends, apexes: [IVec3::Z * RADIUS, IVec3::NEG_Z * RADIUS], level: 0 }
}

/// Which child of a page holds a triangle of the page that lies within one child.
fn child_around(key: PageKey, triangle: [IVec3; 3]) -> usize {
    let (u0, v0) = key.origin();
    let half = i64::from(key.side() / 2);
    let mut sum = (0_i64, 0_i64);
    for corner in triangle {
        let (u, v) = unfold(key.quadrant(), corner);
        sum = (sum.0 + i64::from(u - u0), sum.1 + i64::from(v - v0));
    }
    usize::from(sum.0 > 3 * half) + 2 * usize::from(sum.1 > 3 * half)
}

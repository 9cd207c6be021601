//! The planet as a [`Rule`]: bounds, pages and patches of every diamond, and its priorities.
//!
//! In:    sights, resident pages, diamonds that `refine` splits and merges.
//! Out:   verdicts; patches taken and given back, pages held and released.
//! Keeps: [`Cover`]: what the planet hangs on each diamond, as columns.
//! Not here: topology (`diamonds`), which diamond to choose (`refine`).

use super::agenda::{Band, Verdict};
use super::diamonds::{Diamond, DiamondId, Diamonds, leaf_key};
use super::reach::{cap_of, kids_cap_of, own_cap_of, page_depth, page_is_finest, sags_of};
use super::refine::Rule;
use super::screen_error::{Horizon, Region, Sight, judge_leaf, judge_parent, priority_px};
use crate::columns::{Column, Id};
use crate::datasource::pages::Pages;
use crate::datasource::{Page, PageKey};
use crate::digest::mix;
use crate::geodesy::Ellipsoid;
use crate::lattice::{normal_of, unfold};
use crate::mesh::patches::{Leaf, Patches};
use crate::settings::LodSettings;
use glam::IVec3;

/// What the planet hangs on each diamond; meaningless for free records.
pub struct Cover {
    /// Bounds of the diamond and all its descendants; read by every verdict.
    pub region: Column<Diamond, Region>,
    /// Page that serves each side's triangle; held while that side is there.
    pub pages: Column<Diamond, [Option<Id<Page>>; 2]>,
    /// Patch slot of each side's leaf triangle; empty unless it is a leaf.
    pub patches: Column<Diamond, [Option<u32>; 2]>,
    /// When a split diamond was split, on the frame's clock in milliseconds modulo 2^32; without
    /// any place where the scene does not morph.
    pub split_ms: Column<Diamond, u32>,
    /// Diamonds whose split still morphs, as far as is known, and when that began.
    young: Vec<(DiamondId, u32)>,
    /// The greatest error of those in pixels, in the views of the last frame.
    pub young_px: f64,
    digest: u64,
}

impl Cover {
    /// Columns for as many diamonds as there can be, in a scene that morphs or does not.
    pub fn new(capacity: u32, morphs: bool) -> Self {
        Self {
            region: Column::new(capacity, Region::default),
            pages: Column::new(capacity, || [None; 2]),
            patches: Column::new(capacity, || [None; 2]),
            split_ms: Column::new(if morphs { capacity } else { 0 }, || 0),
            young: Vec::with_capacity(if morphs { capacity as usize } else { 0 }),
            young_px: 0.0,
            digest: 0,
        }
    }

    /// Works out [`Self::young_px`] at `now_ms`: what is drawn lies between the triangles of young
    /// diamonds and finer ones. Forgets those that have arrived or merged.
    pub fn look_at_young(
        &mut self,
        diamonds: &Diamonds,
        sights: &[Sight],
        (now_ms, morph_ms): (u32, u32),
    ) {
        let Self { young, split_ms, region, .. } = self;
        young.retain(|&(id, since_ms)| {
            let is_same = diamonds[id].is_split() && split_ms[id] == since_ms;
            is_same && now_ms.wrapping_sub(since_ms) < morph_ms
        });
        let errors_px = young.iter().map(|&(id, _)| priority_px(&region[id], sights));
        self.young_px = errors_px.fold(0.0, |most, px| if px > most { px } else { most });
    }

    /// Sum of the hashes of all leaf triangles.
    pub fn digest(&self) -> u64 {
        self.digest
    }
}

/// Judges a diamond by its region.
pub fn judge(
    cover: &Cover,
    sights: &[Sight],
    (diamonds, id): (&Diamonds, DiamondId),
    band: Band,
) -> Verdict {
    let region = &cover.region[id];
    if diamonds[id].is_split() {
        judge_parent(region, sights, band.parent_px)
    } else {
        judge_leaf(region, sights, band.leaf_px)
    }
}

/// Which pages serve which triangles.
#[derive(Clone, Copy)]
pub struct Serving<'a> {
    /// What hangs on the diamonds.
    pub cover: &'a Cover,
    /// The resident pages.
    pub pages: &'a Pages,
    /// How often a leaf is halved to be drawn.
    pub patch_depth: u8,
}

impl Serving<'_> {
    /// Whether the kids of `id` could be made now, its parents being split.
    ///
    /// # Errors
    /// The page that is lacking.
    pub fn kids_ready(&self, diamonds: &Diamonds, id: DiamondId) -> Result<(), PageKey> {
        self.page_of_kids(diamonds, id, 0)?;
        self.page_of_kids(diamonds, id, 1)?;
        Ok(())
    }

    /// The page that serves triangle `side` of `id`, or will once that parent is split.
    fn page_of(
        &self,
        diamonds: &Diamonds,
        id: DiamondId,
        side: usize,
    ) -> Result<Id<Page>, PageKey> {
        if let Some(page) = self.cover.pages[id][side] {
            return Ok(page);
        }
        let record = &diamonds[id];
        let parent = record.parents()[side].expect("base diamonds have both sides");
        self.page_of_kids(diamonds, parent, record.slot(side) / 2)
    }

    /// The page that serves the kids' triangles on one side of `id`, or the key that is lacking.
    fn page_of_kids(
        &self,
        diamonds: &Diamonds,
        id: DiamondId,
        side: usize,
    ) -> Result<Id<Page>, PageKey> {
        let page = self.page_of(diamonds, id, side)?;
        let key = self.pages.get(page).key;
        if page_depth(diamonds[id].level() + 1, self.patch_depth) == key.depth() {
            return Ok(page);
        }
        let child = child_around(key, diamonds.shape(id).triangle(side));
        self.pages.children[page][child].ok_or_else(|| key.child(child))
    }
}

/// All that a split or merge over the planet reads or changes besides the diamonds.
pub struct Planet<'a> {
    /// What hangs on the diamonds.
    pub cover: &'a mut Cover,
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
    /// Whether water covers the ground below sea level.
    pub sea: bool,
    /// The knobs.
    pub lod: &'a LodSettings,
    /// This frame's number.
    pub frame: u64,
    /// Its time, which splits are noted with.
    pub now_ms: u32,
}

impl Rule for Planet<'_> {
    fn judge(&self, diamonds: &Diamonds, id: DiamondId, band: Band) -> Verdict {
        judge(self.cover, self.sights, (diamonds, id), band)
    }

    fn kids_ready(&self, diamonds: &Diamonds, id: DiamondId) -> Result<(), PageKey> {
        self.serving().kids_ready(diamonds, id)
    }

    fn follow_split(&mut self, diamonds: &Diamonds, id: DiamondId) {
        if let Some(split_ms) = self.cover.split_ms.as_mut_slice().get_mut(id.index() as usize) {
            *split_ms = self.now_ms;
            self.cover.young.push((id, self.now_ms));
        }
        for side in 0..2 {
            self.remove_leaf(diamonds, id, side);
            let page = self.serving().page_of_kids(diamonds, id, side);
            let page = page.expect("the plan found every page");
            for edge in [2 * side, 2 * side + 1] {
                let kid = diamonds[id].kids()[edge].expect("a split diamond has all kids");
                self.cover_side(diamonds, kid, (diamonds[kid].side_of(id), page));
            }
        }
    }

    fn prepare_merge(&mut self, diamonds: &Diamonds, id: DiamondId) {
        for kid in diamonds[id].kids() {
            let kid = kid.expect("a split diamond has all kids");
            let side = diamonds[kid].side_of(id);
            self.remove_leaf(diamonds, kid, side);
            let page = self.cover.pages[kid][side].take().expect("the side was there");
            self.pages.release(page, self.frame);
        }
        self.add_leaf(diamonds, id, 0);
        self.add_leaf(diamonds, id, 1);
    }
}

impl Planet<'_> {
    fn serving(&self) -> Serving<'_> {
        Serving { cover: self.cover, pages: self.pages, patch_depth: self.lod.patch_depth }
    }

    /// Covers the base octahedron with the four root pages.
    pub fn follow_base(&mut self, diamonds: &Diamonds, base: [DiamondId; 4], roots: [Id<Page>; 4]) {
        for (id, root) in base.into_iter().zip(roots) {
            self.cover.pages[id] = [Some(root); 2];
            self.pages.hold(root);
            self.pages.hold(root);
            self.cover.region[id] = self.region_of(diamonds, id);
            self.add_leaf(diamonds, id, 0);
            self.add_leaf(diamonds, id, 1);
        }
    }

    /// A kid has got a side: its page, its leaf triangle, and if it is new its bounds.
    fn cover_side(&mut self, diamonds: &Diamonds, kid: DiamondId, (side, page): (usize, Id<Page>)) {
        self.cover.pages[kid][side] = Some(page);
        self.pages.hold(page);
        if !diamonds[kid].has_side(1 - side) {
            self.cover.region[kid] = self.region_of(diamonds, kid);
        }
        self.add_leaf(diamonds, kid, side);
    }

    fn add_leaf(&mut self, diamonds: &Diamonds, id: DiamondId, side: usize) {
        let slot = self.patches.take(Leaf { diamond: id.index(), side: u8::from(side == 1) });
        self.cover.patches[id][side] = Some(slot);
        let key = leaf_key(diamonds[id].key(), side);
        self.cover.digest = self.cover.digest.wrapping_add(mix(key));
    }

    fn remove_leaf(&mut self, diamonds: &Diamonds, id: DiamondId, side: usize) {
        let slot = self.cover.patches[id][side].take().expect("it was a leaf");
        self.patches.give_back(slot);
        let key = leaf_key(diamonds[id].key(), side);
        self.cover.digest = self.cover.digest.wrapping_sub(mix(key));
    }

    /// The bounds of a diamond: what its page knows, within what both parents allow.
    fn region_of(&self, diamonds: &Diamonds, id: DiamondId) -> Region {
        let record = &diamonds[id];
        let (level, centre) = (record.level(), record.centre());
        let normal = normal_of(centre);
        let Horizon { floor_m, peak_m, .. } = self.horizon;
        let (mut low_m, mut high_m) = (floor_m, peak_m);
        // Above the finest grid of the root pages nothing is known but the body's whole relief.
        let mut error_m = peak_m - floor_m + self.horizon.curvature_m[1];
        let (mut kids_m, mut finer_m) = (error_m, error_m);
        if page_is_finest(level, self.lod.patch_depth) {
            let page =
                self.cover.pages[id].into_iter().flatten().next().expect("a record has a side");
            let page = self.pages.get(page);
            let bound = page.bound_at(centre);
            let at = page.sample_index(centre);
            let (height_m, variation_m) =
                (f64::from(page.heights_m[at]), f64::from(bound.variation_m));
            // A sea covers what lies lower.
            let drawn = |ground_m: f64| if self.sea { ground_m.max(0.0) } else { ground_m };
            let (sea_level_m, doubt_m) = (page.sea_level_m(at), page.sea_level_variation_m());
            low_m = (drawn(height_m - variation_m) + sea_level_m - doubt_m).max(floor_m);
            high_m = (drawn(height_m + variation_m) + sea_level_m + doubt_m).max(floor_m);
            let [odd_m, even_m] = [bound.error_odd_m, bound.error_even_m].map(f64::from);
            // A page serves one even and one odd level; with single triangles the even one first.
            let is_first = level.is_multiple_of(2) == (self.lod.patch_depth == 0);
            error_m = if level.is_multiple_of(2) { even_m } else { odd_m };
            let second_m = if self.lod.patch_depth == 0 { odd_m } else { even_m };
            finer_m = f64::from(bound.error_finer_m);
            kids_m = if is_first { second_m } else { finer_m };
        }
        for parent in record.parents().into_iter().flatten() {
            let outer = &self.cover.region[parent];
            low_m = low_m.max(outer.low_m).min(outer.high_m);
            high_m = high_m.min(outer.high_m).max(outer.low_m);
            error_m = error_m.min(outer.kids_m);
            kids_m = kids_m.min(outer.finer_m);
            finer_m = finer_m.min(outer.finer_m);
        }
        let (kids_cap, cap) = (kids_cap_of(level, centre), cap_of(level, centre));
        let shape = diamonds.shape(id);
        let own_cap = own_cap_of(normal, shape.corners(), kids_cap);
        // Ground and vertices lie between low and high, and chords sag.
        let caps = [own_cap, kids_cap, cap];
        let [least_m, most_m] = self.horizon.curvature_m;
        let within_m = |sag: f64| high_m - low_m + sag * most_m * most_m / least_m;
        let sags = sags_of(normal, &shape, self.lod.patch_depth, caps);
        error_m = error_m.min(within_m(sags[0]));
        kids_m = kids_m.min(within_m(sags[1]));
        finer_m = finer_m.min(within_m(sags[2]));
        // What is too deep to be made is never drawn.
        let deeper = self.lod.level_max.saturating_sub(level);
        let kids_m = if deeper > 0 { kids_m.min(error_m) } else { 0.0 };
        let finer_m = if deeper > 1 { finer_m.min(kids_m) } else { 0.0 };
        Region {
            normal,
            surface: self.body.surface_from_normal(normal),
            cap,
            own_cap,
            kids_cap,
            low_m,
            high_m,
            error_m,
            kids_m,
            finer_m,
            tangent_m: self.horizon.tangent_m(high_m),
        }
    }
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

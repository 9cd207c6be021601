//! The patch arena: one fixed-size slot of vertices for each leaf triangle.
//!
//! In:    slots taken and given back by `refine`; vertices written by `build`.
//! Out:   vertices and bounds by slot.
//! Keeps: columns of fixed capacity, a free list.
//! Not here: how a vertex is computed (`build`), the shared index pattern (`topology`).

use super::bounds::{Bounds, GROUP};
use super::drape::PatchDrape;
use crate::geodesy::TwoFloat;
use glam::DVec3;

/// One vertex as it is uploaded: 36 bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct PatchVertex {
    /// Body-fixed position; the shader subtracts the eye.
    pub position: TwoFloat,
    /// Body-fixed ground normal, octahedral encoding, ±32767 is ±1.
    pub normal_oct: [i16; 2],
    /// Hidden layers: roughness, rock, moisture, temperature; 0 to 255.
    pub layers: [u8; 4],
    /// Height of the ground above the ellipsoid in metres; below 0 under a sea, although the
    /// position is on the water.
    pub height_m: f32,
}

const _: () = assert!(size_of::<PatchVertex>() == 36);

impl PatchVertex {
    /// A vertex of an empty slot.
    pub const EMPTY: Self = Self {
        position: TwoFloat { hi: [0.0; 3], lo: [0.0; 3] },
        normal_oct: [0; 2],
        layers: [0; 4],
        height_m: 0.0,
    };
}

/// Where a vertex of a morphing scene begins: 24 bytes beside its [`PatchVertex`].
///
/// At time t it is drawn at its own place plus `from_m` times what is left of its way, which is
/// 1 when it is born and 0 from `morph_s` later on ([`PatchMorph::left`]); normals and layers are
/// mixed the same way. All is a function of the lattice point, so that neighbouring patches agree
/// at every moment. What had arrived when its patch was built has an offset of 0, its own normal
/// and layers, and 0 for its birth.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct PatchMorph {
    /// From the vertex's own place to where it begins, body-fixed axes, metres.
    pub from_m: [f32; 3],
    /// Normal there, encoded as in [`PatchVertex`].
    pub normal_oct: [i16; 2],
    /// Hidden layers there.
    pub layers: [u8; 4],
    /// Time at which it was born, in milliseconds modulo 2^32: what
    /// [`time_ms`](crate::frame::FrameOutput::time_ms) was then.
    pub born_ms: u32,
}

const _: () = assert!(size_of::<PatchMorph>() == 24);

/// Which leaf triangle a slot shows: diamond record and side.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Leaf {
    /// Record of the diamond in the pool.
    pub diamond: u32,
    /// 0 or 1: which of its two triangles.
    pub side: u8,
}

/// All patches, as columns by slot: 57 bytes a slot, its vertices (108 bytes at k = 0, 540 at
/// k = 4), and 8 bytes for each group of slots.
pub struct Patches {
    /// A leaf is 2^k triangles.
    pub patch_depth: u8,
    /// (n + 1)(n + 2)/2 with n = 2^(k/2) segments an edge.
    pub vertices_per_patch: u32,
    /// The leaf of each slot; `None` while the slot is free.
    pub leaf: Vec<Option<Leaf>>,
    /// Vertices of slot s: `s * vertices_per_patch ..` and as many on.
    pub vertices: Vec<PatchVertex>,
    /// Where these vertices begin, in the same places; empty where the scene does not morph.
    pub morphs: Vec<PatchMorph>,
    /// What lies over each slot; empty where the scene has no imagery.
    pub drapes: Vec<PatchDrape>,
    /// Bounding spheres, by group.
    pub bounds: Vec<Bounds>,
    /// How often a slot of each group was filled or given back, for who keeps what follows from it.
    pub stamps: Vec<u64>,
    /// Hash of leaf key and vertex bytes; 0 while free.
    pub content: Vec<u64>,
    /// Slots taken since vertices were last built, given back ones among them.
    pub fresh: Vec<u32>,
    is_fresh: Vec<bool>,
    free: Vec<u32>,
    used_end: u32,
    digest: u64,
}

/// What `build` knows of one patch besides its vertices.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct BuiltPatch {
    /// Centre of the bounding sphere, ECEF metres.
    pub centre: DVec3,
    /// Radius of the bounding sphere in metres.
    pub radius_m: f64,
    /// Hash of leaf key and vertices; never 0.
    pub content: u64,
}

impl Patches {
    /// An arena of `capacity` slots, all free.
    pub fn new(patch_depth: u8, capacity: u32) -> Self {
        let n = 1_u32 << (patch_depth / 2);
        let vertices_per_patch = (n + 1) * (n + 2) / 2;
        let slots = capacity as usize;
        Self {
            patch_depth,
            vertices_per_patch,
            leaf: vec![None; slots],
            vertices: vec![PatchVertex::EMPTY; slots * vertices_per_patch as usize],
            morphs: Vec::new(),
            drapes: Vec::new(),
            bounds: vec![Bounds::EMPTY; slots.div_ceil(GROUP)],
            stamps: vec![0; slots.div_ceil(GROUP)],
            content: vec![0; slots],
            fresh: Vec::with_capacity(slots),
            is_fresh: vec![false; slots],
            free: Vec::with_capacity(slots),
            used_end: 0,
            digest: 0,
        }
    }

    /// An arena whose vertices morph: with room for where they begin.
    pub fn morphing(patch_depth: u8, capacity: u32) -> Self {
        let mut patches = Self::new(patch_depth, capacity);
        patches.morphs = vec![PatchMorph::EMPTY; patches.vertices.len()];
        patches
    }

    /// Takes a free slot for `leaf`: the one given back last, else the first never used.
    pub fn take(&mut self, leaf: Leaf) -> u32 {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.used_end += 1;
            self.used_end - 1
        });
        self.leaf[slot as usize] = Some(leaf);
        if !self.is_fresh[slot as usize] {
            self.is_fresh[slot as usize] = true;
            self.fresh.push(slot);
        }
        slot
    }

    /// Hands over the slots to build, live ones only, in the order in which they were taken.
    pub fn drain_fresh(&mut self, built: &mut Vec<u32>) {
        for slot in self.fresh.drain(..) {
            self.is_fresh[slot as usize] = false;
            if self.leaf[slot as usize].is_some() {
                built.push(slot);
            }
        }
    }

    /// Gives a slot back.
    pub fn give_back(&mut self, slot: u32) {
        debug_assert!(self.leaf[slot as usize].is_some());
        self.leaf[slot as usize] = None;
        self.digest = self.digest.wrapping_sub(self.content[slot as usize]);
        self.content[slot as usize] = 0;
        let (group, at) = group_of(slot);
        self.bounds[group].clear(at);
        self.stamps[group] += 1;
        self.free.push(slot);
    }

    /// Fills a live slot.
    pub fn fill(&mut self, slot: u32, built: BuiltPatch, vertices: &[PatchVertex]) {
        let (at, n) = (slot as usize, self.vertices_per_patch as usize);
        self.vertices[at * n..][..n].copy_from_slice(vertices);
        let (group, place) = group_of(slot);
        self.bounds[group].set(place, built.centre, built.radius_m);
        self.stamps[group] += 1;
        self.digest = self.digest.wrapping_sub(self.content[at]).wrapping_add(built.content);
        self.content[at] = built.content;
    }

    /// Fills in where the vertices of a slot begin.
    pub fn fill_morphs(&mut self, slot: u32, morphs: &[PatchMorph]) {
        let n = self.vertices_per_patch as usize;
        self.morphs[slot as usize * n..][..n].copy_from_slice(morphs);
    }

    /// Sum of the hashes of all live patches.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Slots at and beyond this were never used.
    pub fn used_end(&self) -> u32 {
        self.used_end
    }

    /// Slots taken now.
    pub fn live(&self) -> u32 {
        self.used_end - u32::try_from(self.free.len()).expect("no more free slots than slots")
    }

    /// The vertices of one slot.
    pub fn vertices_of(&self, slot: u32) -> &[PatchVertex] {
        let n = self.vertices_per_patch as usize;
        &self.vertices[slot as usize * n..][..n]
    }

    /// Centre and radius of the bounding sphere of one slot; `None` while it shows nothing.
    pub fn sphere(&self, slot: u32) -> Option<(DVec3, f64)> {
        let (group, at) = group_of(slot);
        self.bounds[group].sphere(at)
    }

    /// Where the vertices of one slot begin; empty where the scene does not morph.
    pub fn morphs_of(&self, slot: u32) -> &[PatchMorph] {
        let n = self.vertices_per_patch as usize;
        self.morphs.get(slot as usize * n..).and_then(|morphs| morphs.get(..n)).unwrap_or(&[])
    }
}

/// The group of a slot, and its place in the group.
fn group_of(slot: u32) -> (usize, usize) {
    (slot as usize / GROUP, slot as usize % GROUP)
}

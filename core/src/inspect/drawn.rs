//! The mesh as it is drawn, in f64: what errors are measured on.
//!
//! In:    a terrain between two frames, the time of the last one.
//! Out:   [`DrawnMesh`]: every leaf with its vertices where this moment's morphs have them.
//! Keeps: nothing; a frame that nobody measures does none of this.
//! Not here: measuring (`overfly_replay`), the bytes that are uploaded (`mesh::patches`).

use crate::columns::Id;
use crate::frame::Terrain;
use crate::ground::triangle_id;
use crate::lattice::normal_of;
use crate::lod::screen_error::priority_px;
use crate::mesh::morph::duration_ms;
use crate::mesh::patches::PatchMorph;
use crate::mesh::topology::segments;
use glam::{DVec3, IVec3};

/// One leaf triangle that is drawn as a patch.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DrawnLeaf {
    /// Names the triangle, see [`triangle_id`].
    pub key: u64,
    /// Its patch slot.
    pub slot: u32,
    /// Lattice level of the leaf; its small triangles are of level + `patch_depth`.
    pub level: u8,
    /// Bound on the error of drawing it, and of all its descendants, in metres.
    pub error_m: f64,
    /// What the LOD takes that to look like at most in the views of the last frame, in pixels.
    pub error_px: f64,
    /// Some of its vertices are on their way.
    pub morphs: bool,
    /// Hash of its vertices, as the patch arena keeps it.
    pub content: u64,
    /// Apex and hypotenuse.
    pub corners: [IVec3; 3],
}

/// All leaves in the order of their keys, and their vertices: patch after patch in that order.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DrawnMesh {
    /// A leaf is 2^k triangles.
    pub patch_depth: u8,
    /// The leaves.
    pub leaves: Vec<DrawnLeaf>,
    /// Body-fixed places of their vertices, row by row from the apex, metres.
    pub places: Vec<DVec3>,
}

impl DrawnMesh {
    /// Vertices of one patch.
    pub fn vertices_per_patch(&self) -> usize {
        let n = segments(self.patch_depth) as usize;
        (n + 1) * (n + 2) / 2
    }

    /// The vertices of leaf `at`.
    pub fn places_of(&self, at: usize) -> &[DVec3] {
        let n = self.vertices_per_patch();
        &self.places[at * n..][..n]
    }

    /// The place of a leaf in `leaves`.
    pub fn find(&self, key: u64) -> Option<usize> {
        self.leaves.binary_search_by_key(&key, |leaf| leaf.key).ok()
    }
}

impl Terrain {
    /// Fills `drawn` with all leaves as they were drawn at `time_ms`, a frame's
    /// [`time_ms`](crate::frame::FrameOutput::time_ms). Vertices are those of the closed form in
    /// f64, not the uploaded bytes; only a morph's way is f32, as it is drawn.
    pub fn drawn(&self, time_ms: u32, drawn: &mut DrawnMesh) {
        let (lod, pages, patches) = (self.lod(), self.pages(), self.patches());
        let (diamonds, cover) = (&lod.mesh.diamonds, &lod.cover);
        let settings = self.settings();
        let morph_ms = duration_ms(settings.lod.morph_s);
        let now = (time_ms, morph_ms);
        drawn.patch_depth = patches.patch_depth;
        drawn.leaves.clear();
        let unsplit = diamonds.ids().filter(|&id| !diamonds[id].is_split());
        let sides = unsplit.flat_map(|id| [(id, 0), (id, 1)]);
        let leaves = sides.filter_map(|(id, side)| Some((id, side, cover.patches[id][side]?)));
        drawn.leaves.extend(leaves.map(|(id, side, slot)| {
            let corners = diamonds.shape(id).triangle(side);
            let morphs = patches.morphs_of(slot);
            DrawnLeaf {
                key: triangle_id(corners),
                slot,
                level: diamonds[id].level(),
                error_m: cover.region[id].error_m,
                error_px: priority_px(&cover.region[id], &lod.sights),
                morphs: morphs.iter().any(|morph| morph.left(time_ms, morph_ms) > 0.0),
                content: patches.content[slot as usize],
                corners,
            }
        }));
        drawn.leaves.sort_unstable_by_key(|leaf| leaf.key);
        drawn.places.clear();
        for leaf in &drawn.leaves {
            let held = patches.leaf[leaf.slot as usize].expect("a leaf's slot is taken");
            let page = cover.pages[Id::new(held.diamond)][usize::from(held.side)];
            let page = pages.get(page.expect("a leaf's side is there"));
            let morphs = patches.morphs_of(leaf.slot);
            let points = points_of(leaf.corners, patches.patch_depth);
            drawn.places.extend(points.enumerate().map(|(at, point)| {
                let normal = normal_of(point);
                let surface_m = page.surface_m(page.sample_index(point), settings.sea);
                let place = settings.body.surface_from_normal(normal) + normal * surface_m;
                let way = morphs.get(at).map_or(DVec3::ZERO, |morph| way_of(morph, now));
                place + way
            }));
        }
    }
}

/// What is left of a vertex's way, metres.
pub(super) fn way_of(morph: &PatchMorph, (now_ms, morph_ms): (u32, u32)) -> DVec3 {
    DVec3::from_array(morph.from_m.map(f64::from)) * f64::from(morph.left(now_ms, morph_ms))
}

/// Lattice points of a patch, row by row from the apex.
pub(super) fn points_of(
    [apex, start, end]: [IVec3; 3],
    patch_depth: u8,
) -> impl Iterator<Item = IVec3> {
    let n = segments(patch_depth).cast_signed();
    let (to_start, to_end) = ((start - apex) / n, (end - apex) / n);
    let cells = (0..=n).flat_map(|row| (0..=row).map(move |column| (row, column)));
    cells.map(move |(row, column)| apex + to_start * (row - column) + to_end * column)
}

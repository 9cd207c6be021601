//! Stage `build`: the vertices of new patches, each a pure function of its lattice point.
//!
//! In:    fresh slots, diamonds, pages.
//! Out:   vertices, bounding spheres and hashes of these slots.
//! Keeps: blocks of scratch, one a chunk, so that chunks are independent.
//! Not here: uploading (`overfly_render_vk`), the index pattern (`topology`).

use super::patches::{BuiltPatch, PatchVertex, Patches};
use super::topology::segments;
use crate::columns::Id;
use crate::datasource::Page;
use crate::datasource::pages::Pages;
use crate::digest::{Chain, mix};
use crate::geodesy::{Ecef, Ellipsoid, TwoFloat};
use crate::lattice::normal_of;
use crate::lod::cover::Cover;
use crate::lod::Diamonds;
use crate::lod::diamonds::leaf_key;
use glam::{DVec3, IVec3};

/// Patches in one block: at k = 4 some 10 µs of work.
pub const BLOCK: usize = 16;

/// Scratch of one chunk: the vertices and bounds of up to [`BLOCK`] patches.
pub struct Block {
    vertices: Vec<PatchVertex>,
    built: [BuiltPatch; BLOCK],
}

impl Block {
    /// As many blocks as `patches` can need.
    pub fn for_patches(patches: u32, vertices_per_patch: u32) -> Vec<Self> {
        let vertices = vec![PatchVertex::EMPTY; BLOCK * vertices_per_patch as usize];
        let block = || Self { vertices: vertices.clone(), built: [BuiltPatch::default(); BLOCK] };
        (0..(patches as usize).div_ceil(BLOCK)).map(|_| block()).collect()
    }
}

/// What vertices are made from.
pub struct Ground<'a> {
    /// The diamonds whose leaves are built.
    pub diamonds: &'a Diamonds,
    /// Their pages.
    pub cover: &'a Cover,
    /// The resident pages.
    pub pages: &'a Pages,
    /// The body's shape.
    pub body: &'a Ellipsoid,
    /// Whether ground below height 0 is covered by water, whose surface is drawn instead.
    pub sea: bool,
}

/// Builds the patches of one block: `slots` are at most [`BLOCK`] live slots.
pub fn build_block(ground: &Ground<'_>, patches: &Patches, slots: &[u32], block: &mut Block) {
    let per_patch = patches.vertices_per_patch as usize;
    let targets = block.vertices.chunks_exact_mut(per_patch).zip(&mut block.built);
    for (&slot, (vertices, built)) in slots.iter().zip(targets) {
        let leaf = patches.leaf[slot as usize].expect("only live slots are built");
        let (id, side) = (Id::new(leaf.diamond), usize::from(leaf.side));
        let page = ground.pages.get(ground.cover.pages[id][side].expect("a leaf's side is there"));
        let triangle = ground.diamonds.shape(id).triangle(side);
        let key = leaf_key(ground.diamonds[id].key(), side);
        *built = build_patch(ground, page, (triangle, key), (patches.patch_depth, vertices));
    }
}

/// Copies finished blocks into the arena, in the order of their slots.
pub fn store(patches: &mut Patches, slots: &[u32], blocks: &[Block]) {
    let per_patch = patches.vertices_per_patch as usize;
    for (slots, block) in slots.chunks(BLOCK).zip(blocks) {
        let done = block.vertices.chunks_exact(per_patch).zip(&block.built);
        for (&slot, (vertices, &built)) in slots.iter().zip(done) {
            patches.fill(slot, built, vertices);
        }
    }
}

fn build_patch(
    ground: &Ground<'_>,
    page: &Page,
    (triangle, key): ([IVec3; 3], u64),
    (patch_depth, vertices): (u8, &mut [PatchVertex]),
) -> BuiltPatch {
    let [apex, start, end] = triangle;
    let n = segments(patch_depth).cast_signed();
    let (to_start, to_end) = ((start - apex) / n, (end - apex) / n);
    let mut places = (0..=n).flat_map(|row| (0..=row).map(move |column| (row, column)));
    let mut chain = Chain(mix(key));
    let corners = triangle.map(|corner| position(ground, page, corner));
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let mut radius_m = 0.0_f64;
    for vertex in vertices {
        let (row, column) = places.next().expect("as many places as vertices");
        let point = apex + to_start * (row - column) + to_end * column;
        let ecef = position(ground, page, point);
        radius_m = radius_m.max((ecef - centre).length());
        *vertex = vertex_at(page, point, ecef);
        hash(vertex, &mut chain);
    }
    BuiltPatch { centre, radius_m, content: chain.0 | 1 }
}

fn position(ground: &Ground<'_>, page: &Page, point: IVec3) -> DVec3 {
    let normal = normal_of(point);
    let ground_m = f64::from(page.heights_m[page.sample_index(point)]);
    let height_m = if ground.sea && ground_m < 0.0 { 0.0 } else { ground_m };
    ground.body.surface_from_normal(normal) + normal * height_m
}

fn vertex_at(page: &Page, point: IVec3, ecef: DVec3) -> PatchVertex {
    let at = page.sample_index(point);
    PatchVertex {
        position: Ecef(ecef).two_float(),
        normal_oct: page.normals[at],
        layers: page.layers[at],
        height_m: page.heights_m[at],
    }
}

fn hash(vertex: &PatchVertex, chain: &mut Chain) {
    let pair = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
    let TwoFloat { hi, lo } = vertex.position;
    for axis in 0..3 {
        chain.add(pair(hi[axis] + 0.0, lo[axis] + 0.0));
    }
    let [a, b] = vertex.normal_oct.map(|c| u64::from(c.cast_unsigned()));
    chain.add(a << 48 | b << 32 | u64::from(u32::from_le_bytes(vertex.layers)));
}

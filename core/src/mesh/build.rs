//! Stage `build`: the vertices of new patches, each a pure function of its lattice point.
//!
//! In:    fresh slots, diamonds, pages.
//! Out:   vertices, bounding spheres and hashes of these slots.
//! Keeps: blocks of scratch, one a chunk, so that chunks are independent.
//! Not here: uploading (`overfly_render_vk`), the index pattern (`topology`).

use super::morph::{self, Built, Moment, Ways};
use super::patches::{BuiltPatch, PatchMorph, PatchVertex, Patches};
use super::topology::segments;
use crate::columns::Id;
use crate::datasource::Page;
use crate::datasource::pages::Pages;
use crate::digest::{Chain, mix};
use crate::geodesy::{Ecef, Ellipsoid, TwoFloat};
use crate::lattice::normal_of;
use crate::lod::cover::Cover;
use crate::lod::diamonds::leaf_key;
use crate::lod::{DiamondId, Diamonds};
use glam::{DVec3, IVec3};

/// Patches in one block: at k = 4 some 10 µs of work.
pub const BLOCK: usize = 16;

/// Scratch of one chunk: the vertices and bounds of up to [`BLOCK`] patches.
pub struct Block {
    vertices: Vec<PatchVertex>,
    /// Their lattice points.
    points: Vec<IVec3>,
    /// Their heights above the ellipsoid, in metres.
    surfaces_m: Vec<f64>,
    /// Body-fixed positions of one patch's vertices.
    places: Vec<DVec3>,
    /// Where the vertices begin; empty where the scene does not morph, as is what follows.
    morphs: Vec<PatchMorph>,
    ways: Option<Ways>,
    built: [BuiltPatch; BLOCK],
}

impl Block {
    /// As many blocks as `patches` can need.
    pub fn for_patches(patches: u32, vertices_per_patch: u32, morphs: bool) -> Vec<Self> {
        let vertices = vec![PatchVertex::EMPTY; BLOCK * vertices_per_patch as usize];
        let points = vec![IVec3::ZERO; vertices.len()];
        let places = vec![DVec3::ZERO; vertices_per_patch as usize];
        let block = || Self {
            vertices: vertices.clone(),
            points: points.clone(),
            surfaces_m: vec![0.0; points.len()],
            places: places.clone(),
            morphs: if morphs { vec![PatchMorph::EMPTY; vertices.len()] } else { Vec::new() },
            ways: morphs.then(|| Ways::new(vertices_per_patch)),
            built: [BuiltPatch::default(); BLOCK],
        };
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
    /// How vertices morph, if they do.
    pub moment: Option<Moment<'a>>,
}

/// A leaf triangle to build.
#[derive(Clone, Copy)]
struct Task<'a> {
    page: &'a Page,
    diamond: DiamondId,
    side: usize,
    corners: [IVec3; 3],
    key: u64,
}

/// Builds the patches of one block: `slots` are at most [`BLOCK`] live slots.
///
/// In three passes. The first two do little but read diamonds and pages all over the memory, so
/// that many reads are under way at once; the third finds everything at hand.
pub fn build_block(ground: &Ground<'_>, patches: &Patches, slots: &[u32], block: &mut Block) {
    let per_patch = patches.vertices_per_patch as usize;
    let mut tasks = [None; BLOCK];
    for (&slot, task) in slots.iter().zip(&mut tasks) {
        *task = Some(task_of(ground, patches, slot));
    }
    let tasks = || tasks.iter().flatten();
    let vertices = block.vertices.chunks_exact_mut(per_patch);
    let places = block.points.chunks_exact_mut(per_patch);
    let surfaces_m = block.surfaces_m.chunks_exact_mut(per_patch);
    for (task, (vertices, (points, surfaces_m))) in
        tasks().zip(vertices.zip(places.zip(surfaces_m)))
    {
        read_samples(task, (patches.patch_depth, ground.sea), vertices, (points, surfaces_m));
    }
    let tasks = tasks().copied().enumerate();
    tasks.for_each(|(at, task)| finish(ground, patches.patch_depth, (at, &task), block));
}

/// Third pass over patch `at` of a block: places, where they begin, bounds, hash.
fn finish(ground: &Ground<'_>, patch_depth: u8, (at, task): (usize, &Task<'_>), block: &mut Block) {
    let n = block.places.len();
    let all = at * n..(at + 1) * n;
    let (points, vertices) = (&block.points[all.clone()], &mut block.vertices[all.clone()]);
    let heights = points.iter().zip(&block.surfaces_m[all.clone()]);
    for ((vertex, (&point, &surface_m)), place) in
        vertices.iter_mut().zip(heights).zip(&mut block.places)
    {
        let normal = normal_of(point);
        *place = ground.body.surface_from_normal(normal) + normal * surface_m;
        vertex.position = Ecef(*place).two_float();
    }
    let mut morphs: &mut [PatchMorph] = &mut [];
    if let (Some(moment), Some(ways)) = (ground.moment, &mut block.ways) {
        let Task { diamond, side, corners, .. } = *task;
        let built = Built { diamond, side, corners, points, places: &block.places, vertices };
        morphs = &mut block.morphs[all];
        morph::write(ground, moment, &built, ways, morphs);
    }
    block.built[at] = bound_and_hash((task.key, patch_depth), vertices, &block.places, morphs);
}

/// The body-fixed place of a lattice point of a page: the bits that every patch gives it.
pub fn place_of(ground: &Ground<'_>, page: &Page, point: IVec3) -> DVec3 {
    let normal = normal_of(point);
    let surface_m = page.surface_m(page.sample_index(point), ground.sea);
    ground.body.surface_from_normal(normal) + normal * surface_m
}

fn task_of<'a>(ground: &Ground<'a>, patches: &Patches, slot: u32) -> Task<'a> {
    let leaf = patches.leaf[slot as usize].expect("only live slots are built");
    let (id, side) = (Id::new(leaf.diamond), usize::from(leaf.side));
    Task {
        page: ground.pages.get(ground.cover.pages[id][side].expect("a leaf's side is there")),
        diamond: id,
        side,
        corners: ground.diamonds.shape(id).triangle(side),
        key: leaf_key(ground.diamonds[id].key(), side),
    }
}

/// Lattice points of the vertices and their heights above the ellipsoid, and all of each vertex
/// but its position.
fn read_samples(
    task: &Task<'_>,
    (patch_depth, sea): (u8, bool),
    vertices: &mut [PatchVertex],
    (points, surfaces_m): (&mut [IVec3], &mut [f64]),
) {
    let [apex, start, end] = task.corners;
    let n = segments(patch_depth).cast_signed();
    let (to_start, to_end) = ((start - apex) / n, (end - apex) / n);
    let places = (0..=n).flat_map(|row| (0..=row).map(move |column| (row, column)));
    let targets = vertices.iter_mut().zip(points.iter_mut().zip(surfaces_m));
    for ((row, column), (vertex, (point, surface_m))) in places.zip(targets) {
        *point = apex + to_start * (row - column) + to_end * column;
        let at = task.page.sample_index(*point);
        vertex.normal_oct = task.page.normals[at];
        vertex.layers = task.page.layers[at];
        vertex.height_m = task.page.heights_m[at];
        *surface_m = task.page.surface_m(at, sea);
    }
}

/// Sphere and hash of a patch whose vertices lie at `places`, row by row from the apex. The sphere
/// also holds where they begin, and so all places between.
fn bound_and_hash(
    (key, patch_depth): (u64, u8),
    vertices: &[PatchVertex],
    places: &[DVec3],
    morphs: &[PatchMorph],
) -> BuiltPatch {
    let last_row = &places[places.len() - 1 - segments(patch_depth) as usize..];
    let centre = (places[0] + last_row[0] + last_row[last_row.len() - 1]) / 3.0;
    let mut radius_m = 0.0_f64;
    let mut chain = Chain(mix(key));
    for (vertex, place) in vertices.iter().zip(places) {
        radius_m = radius_m.max((*place - centre).length());
        hash(vertex, &mut chain);
    }
    for (morph, place) in morphs.iter().zip(places) {
        let from = DVec3::from_array(morph.from_m.map(f64::from));
        radius_m = radius_m.max((*place + from - centre).length());
        hash_morph(morph, &mut chain);
    }
    BuiltPatch { centre, radius_m, content: chain.0 | 1 }
}

/// Copies finished blocks into the arena, in the order of their slots.
pub fn store(patches: &mut Patches, slots: &[u32], blocks: &[Block]) {
    let per_patch = patches.vertices_per_patch as usize;
    for (slots, block) in slots.chunks(BLOCK).zip(blocks) {
        let done = block.vertices.chunks_exact(per_patch).zip(&block.built);
        for (&slot, (vertices, &built)) in slots.iter().zip(done) {
            patches.fill(slot, built, vertices);
        }
        for (&slot, morphs) in slots.iter().zip(block.morphs.chunks_exact(per_patch)) {
            patches.fill_morphs(slot, morphs);
        }
    }
}

fn hash(vertex: &PatchVertex, chain: &mut Chain) {
    let TwoFloat { hi, lo } = vertex.position;
    for axis in 0..3 {
        chain.add(pair(hi[axis] + 0.0, lo[axis] + 0.0));
    }
    chain.add(shading(vertex.normal_oct, vertex.layers));
}

fn hash_morph(morph: &PatchMorph, chain: &mut Chain) {
    let [x, y, z] = morph.from_m;
    chain.add(pair(x + 0.0, y + 0.0));
    chain.add(u64::from((z + 0.0).to_bits()) << 32 | u64::from(morph.born_ms));
    chain.add(shading(morph.normal_oct, morph.layers));
}

fn pair(a: f32, b: f32) -> u64 {
    u64::from(a.to_bits()) << 32 | u64::from(b.to_bits())
}

fn shading(normal_oct: [i16; 2], layers: [u8; 4]) -> u64 {
    let [a, b] = normal_oct.map(|c| u64::from(c.cast_unsigned()));
    a << 48 | b << 32 | u64::from(u32::from_le_bytes(layers))
}

//! Checks of the whole surface, slow and obviously right: for tests, tools and suspicion.
//!
//! In:    diamonds, agenda, cover, pages, patches.
//! Out:   the first disagreement in words.
//! Keeps: nothing.
//! Not here: anything that a frame runs.

use super::cover::Cover;
use super::diamonds::{DiamondId, Diamonds};
use super::refine::Mesh;
use crate::datasource::pages::Pages;
use crate::geodesy::TwoFloat;
use crate::lattice::{key_of, middle};
use crate::mesh::patches::Patches;
use crate::mesh::topology::{indices, segments};
use glam::IVec3;
use std::collections::BTreeMap;

fn ensure(holds: bool, what: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what()) }
}

/// Links are symmetric, seats are right, uses and leaves add up, the free list is right.
///
/// # Errors
/// The first disagreement.
pub fn consistent(
    mesh: &Mesh,
    cover: &Cover,
    pages: &Pages,
    patches: &Patches,
) -> Result<(), String> {
    let diamonds = &mesh.diamonds;
    let free = diamonds.free().count();
    let (live, end) = (diamonds.live() as usize, diamonds.used_end() as usize);
    ensure(free + live == end && diamonds.ids().count() == live, || {
        format!("{free} free and {live} live records of {end}")
    })?;
    let mut users: BTreeMap<u32, u32> = BTreeMap::new();
    let mut leaves = 0;
    for id in diamonds.ids() {
        links(diamonds, id)?;
        birth((diamonds, cover), id)?;
        for side in 0..2 {
            leaves += leaf((diamonds, cover), id, side, patches)?;
            let page = cover.pages[id][side];
            let there = diamonds[id].has_side(side);
            ensure(page.is_some() == there, || format!("{id:?} side {side} and {page:?}"))?;
            if let Some(page) = page {
                *users.entry(page.index()).or_default() += 1;
            }
        }
    }
    let counted = diamonds.leaves();
    ensure(leaves == counted, || format!("{counted} leaves, found {leaves}"))?;
    ensure(patches.live() == leaves, || format!("{} patches, {leaves} leaves", patches.live()))?;
    for (index, &count) in pages.users.as_slice().iter().enumerate() {
        let found = users.get(&u32::try_from(index).expect("u32")).copied().unwrap_or(0);
        ensure(count == found, || format!("page {index} counts {count} users, has {found}"))?;
    }
    Ok(())
}

/// Parents know their kids, kids their parents; a record exists for a split parent's sake.
fn links(diamonds: &Diamonds, id: DiamondId) -> Result<(), String> {
    let (record, shape) = (&diamonds[id], diamonds.shape(id));
    ensure(shape.centre() == record.centre(), || format!("{id:?} is not where it is"))?;
    for side in 0..2 {
        let Some(parent) = record.parents()[side] else {
            ensure(record.level() == 0, || format!("{id:?} has no parent {side}"))?;
            continue;
        };
        let over = &diamonds[parent];
        let known = over.kids()[record.slot(side)] == Some(id);
        ensure(known, || format!("{parent:?} does not know its kid {id:?}"))?;
        let agree = over.is_split() == record.has_side(side);
        ensure(agree, || format!("{id:?} side {side} and {parent:?}"))?;
        ensure(over.level() + 1 == record.level(), || format!("{id:?} skips a level"))?;
        let corners = diamonds.shape(parent).corners();
        let edge = [0, 1].map(|i| corners[(record.slot(side) + i) & 3]);
        let fits = edge.contains(&shape.ends[0]) && edge.contains(&shape.ends[1]);
        ensure(fits, || format!("{id:?} side {side} does not lie on its parent's edge"))?;
    }
    ensure(record.has_side(0) || record.has_side(1), || format!("{id:?} has no side"))?;
    let whole = record.has_side(0) && record.has_side(1);
    ensure(!record.is_split() || whole, || format!("{id:?} split alone"))?;
    let kids = record.kids();
    let split_kids = kids.iter().flatten().filter(|&&kid| diamonds[kid].is_split()).count();
    let counted = usize::from(record.split_kids());
    ensure(split_kids == counted, || format!("{id:?} miscounts split kids"))?;
    let all = kids.iter().flatten().count() == 4;
    ensure(!record.is_split() || all, || format!("{id:?} is split and lacks a kid"))
}

/// No diamond was split before its parents were: what morphing vertices rely on.
fn birth((diamonds, cover): (&Diamonds, &Cover), id: DiamondId) -> Result<(), String> {
    if cover.split_ms.as_slice().is_empty() || !diamonds[id].is_split() {
        return Ok(());
    }
    let mut parents = diamonds[id].parents().into_iter().flatten();
    let since_ms = |parent| cover.split_ms[id].wrapping_sub(cover.split_ms[parent]);
    let younger = parents.find(|&parent| since_ms(parent) > u32::MAX / 2);
    ensure(younger.is_none(), || format!("{younger:?} was split after its kid {id:?}"))
}

fn leaf(
    (diamonds, cover): (&Diamonds, &Cover),
    id: DiamondId,
    side: usize,
    patches: &Patches,
) -> Result<u32, String> {
    let is_leaf = diamonds[id].has_side(side) && !diamonds[id].is_split();
    let slot = cover.patches[id][side];
    ensure(slot.is_some() == is_leaf, || format!("{id:?} side {side}: leaf {is_leaf}, {slot:?}"))?;
    if let Some(slot) = slot {
        let owner = patches.leaf[slot as usize].map(|l| (l.diamond, usize::from(l.side)));
        ensure(owner == Some((id.index(), side)), || format!("slot {slot} is not {id:?}'s"))?;
    }
    Ok(u32::from(is_leaf))
}

/// Every small triangle of the drawn surface, as lattice points.
pub fn triangles(diamonds: &Diamonds, cover: &Cover, patches: &Patches) -> Vec<[IVec3; 3]> {
    let pattern = indices(patches.patch_depth);
    let mut all = Vec::new();
    for id in diamonds.ids() {
        let shape = diamonds.shape(id);
        for side in 0..2 {
            if cover.patches[id][side].is_some() {
                let points = lattice_points(shape.triangle(side), patches.patch_depth);
                all.extend(
                    pattern.chunks_exact(3).map(|t| [0, 1, 2].map(|i| points[t[i] as usize])),
                );
            }
        }
    }
    all
}

/// The lattice points of a patch, in the order of its vertices.
pub fn lattice_points([apex, start, end]: [IVec3; 3], patch_depth: u8) -> Vec<IVec3> {
    let n = segments(patch_depth).cast_signed();
    let (to_start, to_end) = ((start - apex) / n, (end - apex) / n);
    (0..=n)
        .flat_map(|row| (0..=row).map(move |column| (row, column)))
        .map(|(row, column)| apex + to_start * (row - column) + to_end * column)
        .collect()
}

/// The drawn surface is closed: each edge used exactly twice, in opposite directions, V − E + F =
/// 2, no vertex in the middle of another's edge, and one position for each lattice point.
///
/// # Errors
/// The first edge or vertex that breaks it.
pub fn closed(diamonds: &Diamonds, cover: &Cover, patches: &Patches) -> Result<(), String> {
    let triangles = triangles(diamonds, cover, patches);
    if triangles.is_empty() {
        return Ok(());
    }
    let mut edges = Vec::with_capacity(3 * triangles.len());
    let mut vertices = Vec::with_capacity(3 * triangles.len());
    for triangle in &triangles {
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (triangle[a], triangle[b])) {
            let (a, b) = (key_of(from), key_of(to));
            vertices.push(a);
            edges.push((a.min(b), a.max(b), a > b, key_of(middle(from, to))));
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    edges.sort_unstable();
    for pair in edges.chunks(2) {
        let (a, b, _, within) = pair[0];
        let twice = pair.len() == 2 && pair[1].0 == a && pair[1].1 == b && pair[0].2 != pair[1].2;
        ensure(twice, || format!("edge {a:x}-{b:x} is not used once in each direction"))?;
        let hit = within != a && within != b && vertices.binary_search(&within).is_ok();
        ensure(!hit, || format!("a vertex lies within edge {a:x}-{b:x}"))?;
    }
    let (v, e, f) = (vertices.len(), edges.len() / 2, triangles.len());
    ensure(v + f == e + 2, || format!("V − E + F = {v} − {e} + {f} is not 2"))?;
    one_position_each(diamonds, cover, patches)
}

fn one_position_each(diamonds: &Diamonds, cover: &Cover, patches: &Patches) -> Result<(), String> {
    let mut positions = Vec::new();
    for id in diamonds.ids() {
        let shape = diamonds.shape(id);
        for side in 0..2 {
            let Some(slot) = cover.patches[id][side] else { continue };
            let points = lattice_points(shape.triangle(side), patches.patch_depth);
            for (point, vertex) in points.into_iter().zip(patches.vertices_of(slot)) {
                let TwoFloat { hi, lo } = vertex.position;
                positions.push((key_of(point), hi.map(f32::to_bits), lo.map(f32::to_bits)));
            }
        }
    }
    positions.sort_unstable();
    positions.dedup();
    let twice = positions.windows(2).find(|pair| pair[0].0 == pair[1].0);
    ensure(twice.is_none(), || {
        format!("{:x?} is one point with two positions", twice.map(|pair| pair[0].0))
    })
}

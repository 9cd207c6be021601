//! Checks of the whole surface, slow and obviously right: for tests, tools and suspicion.
//!
//! In:    diamonds, queues, pages, patches.
//! Out:   the first disagreement in words.
//! Keeps: nothing.
//! Not here: anything that a frame runs.

use super::diamonds::{DiamondId, Diamonds, Node};
use super::queues::{Queue, Queues};
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

/// Links are symmetric, queues hold what they must, uses and leaves add up, free lists are right.
///
/// # Errors
/// The first disagreement.
pub fn consistent(
    diamonds: &Diamonds,
    queues: &Queues,
    pages: &Pages,
    patches: &Patches,
) -> Result<(), String> {
    let free = diamonds.pool.free();
    let mut is_free = vec![false; diamonds.pool.used_end() as usize];
    for id in free {
        let place = &mut is_free[id.index() as usize];
        ensure(!*place, || format!("{id:?} is twice in the free list"))?;
        *place = true;
    }
    let mut users: BTreeMap<u32, u32> = BTreeMap::new();
    let (mut leaves, mut queued) = (0, [0; 4]);
    for id in diamonds.ids() {
        let node = &diamonds.node[id];
        if is_free[id.index() as usize] {
            let empty = queues.link[id].queue == Queue::None && node.pages == [None; 2];
            ensure(empty, || format!("{id:?} is free and yet in use"))?;
            continue;
        }
        links(diamonds, id)?;
        membership(queues, id, node, &mut queued)?;
        for side in 0..2 {
            leaves += leaf(node, id, side, patches)?;
            if let Some(page) = node.pages[side] {
                *users.entry(page.index()).or_default() += 1;
            }
        }
    }
    ensure(queues.lengths() == queued, || {
        format!("queues {:?} hold {queued:?}", queues.lengths())
    })?;
    ensure(leaves == diamonds.leaves, || format!("{} leaves, found {leaves}", diamonds.leaves))?;
    ensure(patches.live() == leaves, || format!("{} patches, {leaves} leaves", patches.live()))?;
    for (index, &count) in pages.users.as_slice().iter().enumerate() {
        let found = users.get(&u32::try_from(index).expect("u32")).copied().unwrap_or(0);
        ensure(count == found, || format!("page {index} counts {count} users, has {found}"))?;
    }
    Ok(())
}

/// Parents know their kids, kids their parents; a record exists for a split parent's sake.
fn links(diamonds: &Diamonds, id: DiamondId) -> Result<(), String> {
    let node = &diamonds.node[id];
    for side in 0..2 {
        let Some(parent) = node.parents[side] else {
            ensure(node.shape.level == 0, || format!("{id:?} has no parent {side}"))?;
            continue;
        };
        let over = &diamonds.node[parent];
        let known = over.kids[usize::from(node.slots[side])] == Some(id);
        ensure(known, || format!("{parent:?} does not know its kid {id:?}"))?;
        ensure(over.split == node.has_side(side), || format!("{id:?} side {side} and {parent:?}"))?;
        let apex = over.shape.centre() == node.shape.apexes[side];
        ensure(apex, || format!("{id:?} side {side} does not end in its parent's centre"))?;
        ensure(over.shape.level + 1 == node.shape.level, || format!("{id:?} skips a level"))?;
    }
    ensure(node.has_side(0) || node.has_side(1), || format!("{id:?} has no side"))?;
    ensure(!node.split || node.has_side(0) && node.has_side(1), || format!("{id:?} split alone"))?;
    let kids = node.kids.iter().flatten();
    let split_kids = kids.clone().filter(|&&kid| diamonds.node[kid].split).count();
    ensure(split_kids == usize::from(node.split_kids), || format!("{id:?} miscounts split kids"))?;
    ensure(!node.split || kids.count() == 4, || format!("{id:?} is split and lacks a kid"))
}

fn membership(
    queues: &Queues,
    id: DiamondId,
    node: &Node,
    queued: &mut [u32; 4],
) -> Result<(), String> {
    let queue = queues.link[id].queue;
    let fits = match queue {
        Queue::Split | Queue::Blocked | Queue::Deepest => !node.split,
        Queue::Merge => node.split && node.split_kids == 0,
        Queue::None => node.split && node.split_kids > 0,
    };
    ensure(fits, || format!("{id:?} is in queue {queue:?}: {node:?}"))?;
    match queue {
        Queue::Split => queued[0] += 1,
        Queue::Merge => queued[1] += 1,
        Queue::Blocked => queued[2] += 1,
        Queue::Deepest => queued[3] += 1,
        Queue::None => {}
    }
    Ok(())
}

fn leaf(node: &Node, id: DiamondId, side: usize, patches: &Patches) -> Result<u32, String> {
    let is_leaf = node.has_side(side) && !node.split;
    let slot = node.patches[side];
    ensure(slot.is_some() == is_leaf, || format!("{id:?} side {side}: leaf {is_leaf}, {slot:?}"))?;
    if let Some(slot) = slot {
        let owner = patches.leaf[slot as usize].map(|l| (l.diamond, usize::from(l.side)));
        ensure(owner == Some((id.index(), side)), || format!("slot {slot} is not {id:?}'s"))?;
    }
    Ok(u32::from(is_leaf))
}

/// Every small triangle of the drawn surface, as lattice points.
pub fn triangles(diamonds: &Diamonds, patches: &Patches) -> Vec<[IVec3; 3]> {
    let pattern = indices(patches.patch_depth);
    let mut all = Vec::new();
    for id in diamonds.ids() {
        let node = &diamonds.node[id];
        for side in 0..2 {
            if node.patches[side].is_some() {
                let points = lattice_points(node.shape.triangle(side), patches.patch_depth);
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
pub fn closed(diamonds: &Diamonds, patches: &Patches) -> Result<(), String> {
    let triangles = triangles(diamonds, patches);
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
    one_position_each(diamonds, patches)
}

fn one_position_each(diamonds: &Diamonds, patches: &Patches) -> Result<(), String> {
    let mut positions = Vec::new();
    for id in diamonds.ids() {
        let node = &diamonds.node[id];
        for side in 0..2 {
            let Some(slot) = node.patches[side] else { continue };
            let points = lattice_points(node.shape.triangle(side), patches.patch_depth);
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

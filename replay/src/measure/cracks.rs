//! C1, C2, C3: cracks that the mesh's own structure shows, without looking at a picture.
//!
//! In:    the drawn mesh; the vertices that are drawn, by lattice point.
//! Out:   counts, all of which must be 0.
//! Keeps: nothing.
//! Not here: cracks that are seen (`holes`).
//!
//! All is counted over integer lattice points: no position is compared but for its bits.

use super::pipeline::Pipeline;
use glam::IVec3;
use overfly_core::frame::{FrameOutput, Terrain};
use overfly_core::inspect::DrawnMesh;
use overfly_core::lattice::{key_of, middle};
use overfly_core::lod::audit::lattice_points;
use overfly_core::mesh::topology::indices;

/// What is wrong with the structure of a mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cracks {
    /// C1: edges that are not used once in each direction; where there are none, by how much
    /// V − E + F is not 2.
    pub edges: u64,
    /// C2: vertices between the ends of an edge.
    pub junctions: u64,
}

/// An edge from its lower to its higher key.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u64; 2],
    falls: bool,
    points: [[i32; 3]; 2],
}

impl Edge {
    fn of([from, to]: [IVec3; 2]) -> Self {
        let (a, b) = (key_of(from), key_of(to));
        let points = if a > b { [to, from] } else { [from, to] };
        Self { ends: [a.min(b), a.max(b)], falls: a > b, points: points.map(|p| p.to_array()) }
    }
}

impl Cracks {
    /// Counts those of a whole mesh.
    pub fn of(mesh: &DrawnMesh) -> Self {
        let pattern = indices(mesh.patch_depth);
        let mut edges = Vec::with_capacity(pattern.len() * mesh.leaves.len());
        for leaf in &mesh.leaves {
            let points = lattice_points(leaf.corners, mesh.patch_depth);
            let three = pattern.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
            let sides = three.flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
            let ends = sides.map(|(from, to)| [points[from as usize], points[to as usize]]);
            edges.extend(ends.map(Edge::of));
        }
        edges.sort_unstable();
        Self::of_edges(&edges)
    }

    fn of_edges(edges: &[Edge]) -> Self {
        let mut vertices: Vec<u64> = edges.iter().flat_map(|edge| edge.ends).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let (mut found, mut count) = (Self::default(), 0_u64);
        for same in edges.chunk_by(|a, b| a.ends == b.ends) {
            count += 1;
            let whole = same.len() == 2 && same[0].falls != same[1].falls;
            found.edges += u64::from(!whole);
            found.junctions += within(same[0].points.map(Into::into), &vertices);
        }
        let (v, e, f) = (vertices.len() as u64, count, edges.len() as u64 / 3);
        if found.edges == 0 && count > 0 {
            found.edges = (v + f).abs_diff(e + 2);
        }
        found
    }
}

/// How many vertices lie within an edge at its middle, its quarters and so on.
fn within([a, b]: [IVec3; 2], vertices: &[u64]) -> u64 {
    let centre = middle(a, b);
    let key = key_of(centre);
    // The shortest edges have no lattice point between their ends.
    if key == key_of(a) || key == key_of(b) || vertices.binary_search(&key).is_err() {
        return 0;
    }
    1 + within([a, centre], vertices) + within([centre, b], vertices)
}

/// A drawn vertex: the key of its lattice point, and the bits of where it is drawn.
pub type DrawnAt = (u64, [u32; 3]);

/// Every vertex of every draw of the first view, as it is placed before the eye.
pub fn uploaded(terrain: &Terrain, output: &FrameOutput) -> Vec<DrawnAt> {
    let patches = terrain.patches();
    let lod = terrain.lod();
    let view = &output.views[0];
    let pipeline = Pipeline::new(terrain.settings(), &view.camera, output.time_ms);
    let mut all = Vec::new();
    for &slot in view.ranges.iter().flat_map(|range| &range.patches) {
        let Some(leaf) = patches.leaf[slot as usize] else { continue };
        let diamond = overfly_core::columns::Id::new(leaf.diamond);
        let corners = lod.mesh.diamonds.shape(diamond).triangle(usize::from(leaf.side));
        let points = lattice_points(corners, patches.patch_depth);
        let morphs = patches.morphs_of(slot);
        for (at, (point, vertex)) in points.into_iter().zip(patches.vertices_of(slot)).enumerate() {
            let place = pipeline.view(vertex, morphs.get(at));
            // Both zeros are one place.
            all.push((key_of(point), place.map(|x| (x + 0.0).to_bits())));
        }
    }
    all
}

/// C3: how many lattice points are drawn at more than one place. Sorts the vertices.
pub fn points_apart(vertices: &mut Vec<DrawnAt>) -> u64 {
    vertices.sort_unstable();
    vertices.dedup();
    vertices.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1).count() as u64
}

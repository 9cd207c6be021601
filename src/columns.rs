//! A frame as plain columns that any renderer can draw: no Vulkan, no types of the stages.
//!
//! In:    a frame's output, the patch arena that its draws point into.
//! Out:   [`DrawColumns`], [`VertexColumns`], the index pattern.
//! Keeps: nothing; columns belong to the host and are used again.
//! Not here: eye and projection (`overfly_core::projection`), light (`overfly_core::mesh::shade`).
//!
//! A renderer keeps room for [`Limits::leaves`](crate::core::limits::Limits) slots of
//! [`Overfly::vertices_per_patch`] vertices. In each frame it
//! 1. takes the vertices of `FrameOutput::built` ([`Overfly::vertices`]) into these slots: they are
//!    absolute, so what is not new stays as it is however the eye moves;
//! 2. asks what a view draws ([`Overfly::columns`]) and draws each row's slot with the one index
//!    pattern ([`Overfly::indices`]), far ranges first and the depth cleared between ranges; or, if
//!    its depth buffer resolves the whole view, each slot once in one range.
//!
//! Nothing here allocates once the columns have grown: draws to the most leaves of the scene,
//! vertices to the most slots that were asked for at once.

use crate::Overfly;
use crate::core::columns::Id;
use crate::core::frame::FrameOutput;
use crate::core::geodesy::{Ellipsoid, TwoFloat, narrow};
use crate::core::ground::triangle_id;
use crate::core::mesh::morph::decode;
use crate::core::mesh::shade::albedo;
use crate::core::mesh::{PatchMorph, PatchVertex, topology};
use glam::DVec3;
use std::fmt;

/// What a view draws: one row a depth range and patch, near ranges first, slots rising in each.
/// All columns have one length.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DrawColumns {
    /// Names the leaf triangle: the same key is the same triangle in any frame, view and run.
    pub key: Vec<u64>,
    /// Lattice level of the leaf, 0 to 56.
    pub level: Vec<u8>,
    /// Depth range of the view, 0 is nearest: its borders are those of `ViewDraws::ranges`.
    pub range: Vec<u8>,
    /// Slot of the patch's vertices, below `Limits::leaves`.
    pub slot: Vec<u32>,
    /// The patch without morphs is nowhere farther than this from the ground, in metres.
    pub error_m: Vec<f64>,
}

/// Vertices of some slots: slot after slot as they were asked for, in each the vertices row by row
/// from the patch's apex, as [`Overfly::indices`] counts them. All columns but the slots have one
/// length; those of a start are empty where the scene does not morph.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct VertexColumns {
    /// The slots.
    pub slot: Vec<u32>,
    /// Body-fixed position in metres, rounded to f32.
    pub hi: Vec<[f32; 3]>,
    /// What that left: the sum of both is within 2⁻⁴⁹ of each coordinate, 1.2e-8 m on the Earth,
    /// and the same bits in every patch that has the vertex.
    pub lo: Vec<[f32; 3]>,
    /// Unit normal of the ground, body-fixed, outward; within 4e-5 rad of the page's.
    pub normal: Vec<[f32; 3]>,
    /// Linear albedo, 0 to 1: see [`albedo`].
    pub albedo: Vec<[f32; 3]>,
    /// Height of the ground above the ellipsoid in metres; below 0 under a sea, although the
    /// position is on the water.
    pub height_m: Vec<f32>,
    /// From the position to where the vertex starts, in metres. It is drawn at its position plus
    /// this times what is left of its way: [`PatchMorph::left`].
    pub start_m: Vec<[f32; 3]>,
    /// Normal there; mix it with `normal` by the same share.
    pub start_normal: Vec<[f32; 3]>,
    /// Albedo there.
    pub start_albedo: Vec<[f32; 3]>,
    /// When it started, on the clock of `FrameOutput::time_ms`.
    pub start_ms: Vec<u32>,
}

/// Why there are no columns. They are left empty.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ColumnsFault {
    /// The frame has no such view.
    View {
        /// What was asked for.
        found: usize,
        /// How many views it has.
        views: usize,
    },
    /// The output is not that of the last frame: its slots may show other ground by now.
    Stale {
        /// Frames before it.
        frame: u64,
        /// Frames of this ground so far.
        frames: u64,
    },
    /// A slot shows nothing now.
    Slot {
        /// Which.
        found: u32,
        /// How many were ever used.
        slots: u32,
    },
}

impl fmt::Display for ColumnsFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View { found, views } => {
                write!(f, "view {found} is not in the frame, which has {views}")
            }
            Self::Stale { frame, frames } => write!(
                f,
                "the output is of frame {frame}, but {frames} frames of this ground were run: \
                 allowed is the last one's"
            ),
            Self::Slot { found, slots } => {
                write!(f, "slot {found} shows nothing, allowed are those in use, below {slots}")
            }
        }
    }
}

impl std::error::Error for ColumnsFault {}

impl DrawColumns {
    /// How many draws there are.
    pub fn rows(&self) -> usize {
        self.slot.len()
    }

    fn clear(&mut self) {
        self.key.clear();
        self.level.clear();
        self.range.clear();
        self.slot.clear();
        self.error_m.clear();
    }

    fn reserve(&mut self, rows: usize) {
        self.key.reserve(rows);
        self.level.reserve(rows);
        self.range.reserve(rows);
        self.slot.reserve(rows);
        self.error_m.reserve(rows);
    }
}

impl VertexColumns {
    /// How many vertices there are.
    pub fn vertices(&self) -> usize {
        self.hi.len()
    }

    fn clear(&mut self) {
        self.slot.clear();
        self.hi.clear();
        self.lo.clear();
        self.normal.clear();
        self.albedo.clear();
        self.height_m.clear();
        self.start_m.clear();
        self.start_normal.clear();
        self.start_albedo.clear();
        self.start_ms.clear();
    }

    fn push(&mut self, vertex: &PatchVertex, look: Look) {
        let TwoFloat { hi, lo } = vertex.position;
        self.hi.push(hi);
        self.lo.push(lo);
        self.normal.push(look.normal);
        self.albedo.push(look.albedo);
        self.height_m.push(vertex.height_m);
    }

    fn push_start(&mut self, morph: &PatchMorph, look: Look) {
        self.start_m.push(morph.from_m);
        self.start_normal.push(look.normal);
        self.start_albedo.push(look.albedo);
        self.start_ms.push(morph.born_ms);
    }
}

/// How a vertex looks.
struct Look {
    normal: [f32; 3],
    albedo: [f32; 3],
}

/// What the looks of a scene's vertices depend on.
struct Looker<'a> {
    body: &'a Ellipsoid,
    sea: bool,
}

impl Looker<'_> {
    fn look(&self, vertex: &PatchVertex, normal_oct: [i16; 2], layers: [u8; 4]) -> Look {
        let at = DVec3::from_array(vertex.position.hi.map(f64::from));
        let (a_m, b_m) = (self.body.a_m, self.body.b_m());
        // The gradient of the ellipsoid through the point is vertical.
        let up = (at / DVec3::new(a_m * a_m, a_m * a_m, b_m * b_m)).normalize();
        let normal = decode(normal_oct);
        let slope = narrow((1.0 - normal.dot(up)).clamp(0.0, 1.0));
        Look {
            normal: normal.to_array().map(narrow),
            albedo: albedo(layers, vertex.height_m, slope, self.sea),
        }
    }
}

impl Overfly {
    /// Fills in what a view of the last frame draws.
    ///
    /// # Errors
    /// The output is not the last frame's, or has no such view.
    pub fn columns(
        &self,
        output: &FrameOutput,
        view: usize,
        draws: &mut DrawColumns,
    ) -> Result<(), ColumnsFault> {
        draws.clear();
        let frames = self.house.terrain.output().lock().frame;
        if output.frame + 1 != frames {
            return Err(ColumnsFault::Stale { frame: output.frame, frames });
        }
        let views = output.views.len();
        let view = output.views.get(view).ok_or(ColumnsFault::View { found: view, views })?;
        let rows: usize = view.ranges.iter().map(|range| range.patches.len()).sum();
        draws.reserve(rows.max(self.house.terrain.limits().leaves as usize));
        let (lod, patches) = (self.house.terrain.lod(), self.house.terrain.patches());
        for (range, draw) in view.ranges.iter().zip(0..) {
            for &slot in &range.patches {
                let leaf = patches.leaf[slot as usize].expect("what is drawn is a leaf");
                let diamond = Id::new(leaf.diamond);
                let corners = lod.mesh.diamonds.shape(diamond).triangle(usize::from(leaf.side));
                draws.key.push(triangle_id(corners));
                draws.level.push(lod.mesh.diamonds[diamond].level());
                draws.range.push(draw);
                draws.slot.push(slot);
                draws.error_m.push(lod.cover.region[diamond].error_m);
            }
        }
        Ok(())
    }

    /// Fills in the vertices of some slots: of `FrameOutput::built` in every frame, or of all that
    /// [`Self::columns`] names where a renderer comes late.
    ///
    /// # Errors
    /// A slot shows nothing.
    pub fn vertices(
        &self,
        slots: &[u32],
        vertices: &mut VertexColumns,
    ) -> Result<(), ColumnsFault> {
        vertices.clear();
        let patches = self.house.terrain.patches();
        let is_free = |slot: u32| patches.leaf.get(slot as usize).is_none_or(Option::is_none);
        if let Some(&found) = slots.iter().find(|&&slot| is_free(slot)) {
            return Err(ColumnsFault::Slot { found, slots: patches.used_end() });
        }
        let looker = Looker { body: &self.scene.body, sea: self.scene.sea };
        vertices.slot.extend_from_slice(slots);
        for &slot in slots {
            let own = patches.vertices_of(slot);
            for vertex in own {
                let look = looker.look(vertex, vertex.normal_oct, vertex.layers);
                vertices.push(vertex, look);
            }
            for (morph, vertex) in patches.morphs_of(slot).iter().zip(own) {
                let look = looker.look(vertex, morph.normal_oct, morph.layers);
                vertices.push_start(morph, look);
            }
        }
        Ok(())
    }

    /// Vertices of each patch: (n + 1)(n + 2)/2 where n is 2^(k/2), the segments of an edge.
    pub fn vertices_per_patch(&self) -> u32 {
        self.house.terrain.patches().vertices_per_patch
    }

    /// Three vertices of a patch for each of its 2^k triangles, counter-clockwise seen from
    /// outside: the same for every patch and frame of the scene. Allocates.
    pub fn indices(&self) -> Vec<u32> {
        topology::indices(self.scene.lod.patch_depth)
    }
}

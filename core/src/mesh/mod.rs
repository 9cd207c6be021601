//! From leaf triangles to vertices and draws.
//!
//! In:    leaves of the LOD, pages, cameras.
//! Out:   the patch arena, the draws of each view and depth range.
//! Keeps: the arena: one fixed-size slot a leaf triangle.
//! Not here: which leaves exist (`lod`), Vulkan (`overfly_render_vk`).

pub mod bounds;
pub mod build;
pub mod drape;
mod lists;
pub mod morph;
pub mod patches;
pub mod place;
pub mod shade;
pub mod topology;
pub mod unrest;

pub use patches::{PatchMorph, PatchVertex, Patches};

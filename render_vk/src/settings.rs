//! What a renderer is made for.
//!
//! In:    a scene, or a host's own numbers.
//! Out:   [`RendererSettings`], checked.
//! Keeps: nothing.
//! Not here: what changes from picture to picture (`picture`).

use crate::RANGES_MAX;
use crate::error::StartError;
use crate::parts::{Asked, Lit};
use ash::vk;
use overfly_core::limits::Limits;
use overfly_core::mesh::morph::duration_ms;
use overfly_core::mesh::topology;
use overfly_core::settings::{DepthFormat, DepthOrder, SceneSettings, VertexPrecision};

/// What a renderer is made for. All memory is taken at the start.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RendererSettings {
    /// A patch is 2^k triangles; 0, 2, 4, 6 or 8, as in the scene's settings.
    pub patch_depth: u8,
    /// Slots of the patch arena; at least 1.
    pub patches_max: u32,
    /// Width and height of the pictures in pixels.
    pub size_px: [u32; 2],
    /// Most depth ranges of a view; 1 to 16.
    pub ranges_max: u32,
    /// Numbers in the depth buffer.
    pub depth_format: DepthFormat,
    /// Which way they run.
    pub depth_order: DepthOrder,
    /// How vertices get to their place before the eye.
    pub vertices: VertexPrecision,
    /// How long a vertex takes to its own place in seconds, as in the scene's settings; 0: no
    /// vertex moves, and the arena has no morphs.
    pub morph_s: f64,
    /// Whether pictures show a sea, and a sun. Programs for these are made at the start; a picture
    /// that differs makes others when it is first drawn.
    pub sea: bool,
    /// See [`Self::sea`].
    pub sun: bool,
    /// Whether imagery lies over the ground: the arena has drapes.
    pub imagery: bool,
    /// Error on the screen that may stay, for the debug view of errors.
    pub tolerance_px: f64,
    /// Keeps the depth of the nearest range for [`crate::Renderer::read_depth`].
    pub keep_depth: bool,
    /// Pictures that the device may be behind; 1 to 16, usually 2. A host's renderer takes as many
    /// for each view.
    pub frames_in_flight: u32,
    /// Whether to run under the validation layer, with synchronisation checks. Slow.
    pub validation: bool,
}

impl RendererSettings {
    /// What a scene needs; two pictures in flight, no validation.
    pub fn of(scene: &SceneSettings, limits: &Limits, size_px: [u32; 2]) -> Self {
        Self {
            patch_depth: scene.lod.patch_depth,
            patches_max: limits.leaves,
            size_px,
            ranges_max: u32::try_from(scene.depth.splits_m.len() + 1).unwrap_or(u32::MAX),
            depth_format: scene.depth.format,
            depth_order: scene.depth.order,
            vertices: scene.vertices,
            morph_s: scene.lod.morph_s,
            sea: scene.sea,
            sun: scene.sun.is_some(),
            imagery: !scene.imagery.is_empty(),
            tolerance_px: scene.lod.tolerance.0,
            keep_depth: false,
            frames_in_flight: 2,
            validation: false,
        }
    }

    /// What is made at the start.
    pub(crate) fn asked(&self) -> Asked {
        let lit = Lit { sea: self.sea, sun: self.sun };
        Asked { lit, imagery: self.imagery, ..Asked::default() }
    }

    /// Whether vertices move.
    pub(crate) fn morphs(&self) -> bool {
        self.morph_ms() > 0
    }

    /// The same in whole milliseconds, as the frame's time is counted.
    pub(crate) fn morph_ms(&self) -> u32 {
        duration_ms(self.morph_s)
    }

    /// Vertices of one patch.
    pub(crate) fn vertices_per_patch(&self) -> u32 {
        let segments = topology::segments(self.patch_depth);
        (segments + 1) * (segments + 2) / 2
    }

    /// Checks what does not depend on the device.
    pub(crate) fn check(&self) -> Result<(), StartError> {
        let depth = self.patch_depth;
        if depth > 8 || depth % 2 == 1 {
            return refused("patch_depth", depth.into(), "0, 2, 4, 6 or 8".into());
        }
        // Vertex offsets of draws are signed.
        let patches_end = i32::MAX.unsigned_abs() / self.vertices_per_patch();
        for (field, found, max) in [
            ("patches_max", self.patches_max, patches_end),
            ("ranges_max", self.ranges_max, RANGES_MAX),
            ("frames_in_flight", self.frames_in_flight, 16),
        ] {
            if found == 0 || found > max {
                return refused(field, found.into(), format!("1 to {max}"));
            }
        }
        Ok(())
    }

    /// Checks the picture's size.
    pub(crate) fn check_size(
        size_px: [u32; 2],
        limits: &vk::PhysicalDeviceLimits,
    ) -> Result<(), StartError> {
        let image = limits.max_image_dimension2_d;
        let largest = [
            image.min(limits.max_framebuffer_width).min(limits.max_viewport_dimensions[0]),
            image.min(limits.max_framebuffer_height).min(limits.max_viewport_dimensions[1]),
        ];
        for (found, max) in size_px.into_iter().zip(largest) {
            if found == 0 || found > max {
                return refused("size_px", found.into(), format!("1 to {max}"));
            }
        }
        Ok(())
    }
}

fn refused(field: &'static str, found: u64, allowed: String) -> Result<(), StartError> {
    Err(StartError::Setting { field, found, allowed })
}

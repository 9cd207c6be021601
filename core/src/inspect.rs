//! What people want to see of the mesh besides the ground: for debug views and overlays.
//!
//! In:    a terrain between two frames.
//! Out:   [`PatchInfo`] by slot; line segments.
//! Keeps: nothing; a frame that nobody inspects does none of this.
//! Not here: drawing it (`overfly_render_vk`).

/// What debug views show of one patch.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[repr(C)]
pub struct PatchInfo {
    /// Bound on its error on the screen in pixels, the worst of all views; 0 where none sees it.
    pub error_px: f32,
    /// Level of its leaf triangle.
    pub level: u8,
    /// Depth of its page.
    pub page_depth: u8,
    /// Levels by which it is coarser than the tolerance asks because a page is not there.
    pub lacking: u8,
    /// 1 where a view of the LOD may see it, else 0.
    pub seen: u8,
}

const _: () = assert!(size_of::<PatchInfo>() == 8);

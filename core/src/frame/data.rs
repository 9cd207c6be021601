//! What goes into a frame and what comes out: plain columns, nothing else crosses the border.
//!
//! In:    [`FrameInput`], filled by a host, a recording or a test.
//! Out:   [`FrameOutput`], read by a renderer, a recording and the host's loader.
//! Keeps: nothing; both are reused from frame to frame, so that a frame allocates nothing.
//! Not here: the stages (`frame`).

use crate::camera::{Camera, View};
use crate::datasource::{Page, PageKey};
use crate::digest::FrameDigest;
use crate::mesh::drape::NewTile;
use crate::settings::SceneSettings;
use std::sync::Arc;

/// What one frame starts from.
#[derive(Default)]
pub struct FrameInput {
    /// Time of the flight in seconds.
    pub time_s: f64,
    /// The views to serve, the most important first.
    pub views: Vec<View>,
    /// Pages that arrived since the last frame, in this order. The frame takes them out.
    pub arrived: Vec<Arc<Page>>,
    /// The mesh stays as it is, and no page is asked for: only the draws follow the views.
    pub hold_lod: bool,
    /// Another scene from this frame on, for who runs the terrain: the stages do not look at it.
    pub scene: Option<Box<SceneSettings>>,
}

/// What one frame ended in.
#[derive(Default)]
pub struct FrameOutput {
    /// Frames run before this one.
    pub frame: u64,
    /// What morphing vertices count from: the input's time in whole milliseconds, modulo 2^32. It
    /// always runs on, so where the input stands or goes back it is ahead of that from then on.
    pub time_ms: u32,
    /// Counts of the work done.
    pub counts: FrameCounts,
    /// Pages that the LOD lacks, the most urgent first; give them in a later frame's `arrived`.
    pub wanted: Vec<PageKey>,
    /// Pages that were evicted or refused; their memory can be used again.
    pub evicted: Vec<Arc<Page>>,
    /// Patch slots whose vertices were written in this frame: what a renderer must upload.
    pub built: Vec<u32>,
    /// Tiles of imagery that are new in their layers: what a renderer must upload.
    pub tiles: Vec<NewTile>,
    /// Draws of each view, in the order of the input's views.
    pub views: Vec<ViewDraws>,
    /// What the state is now.
    pub digest: FrameDigest,
    /// Device memory of whoever draws; zero where nobody does.
    pub device: DeviceTotals,
}

/// Device memory of a renderer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DeviceTotals {
    /// Buffers and images.
    pub allocations: u32,
    /// Bytes of all of them.
    pub bytes: u64,
}

/// The draws of one view.
pub struct ViewDraws {
    /// The camera that they were placed for.
    pub camera: Camera,
    /// From near to far; a renderer draws them far to near and clears the depth between.
    pub ranges: Vec<RangeDraws>,
}

/// The draws of one depth range of one view.
pub struct RangeDraws {
    /// Near border along the view direction in metres, overlap included.
    pub near_m: f64,
    /// Far border; infinite in the last range.
    pub far_m: f64,
    /// Patch slots whose bounds touch the range and the frustum, in order of slot.
    pub patches: Vec<u32>,
}

/// How much work a frame did. All are counts or bounds, so they repeat exactly.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FrameCounts {
    /// Leaf triangles of the mesh.
    pub leaves: u32,
    /// Small triangles: leaves × 2^`patch_depth`.
    pub triangles: u32,
    /// Diamonds with a record.
    pub diamonds: u32,
    /// Diamonds split in this frame, forced ones included.
    pub splits: u32,
    /// Diamonds merged in this frame.
    pub merges: u32,
    /// Priorities computed.
    pub evaluations: u32,
    /// Splits that waited for a page.
    pub blocked: u32,
    /// Resident pages.
    pub pages: u32,
    /// Pages admitted in this frame.
    pub admitted: u32,
    /// Pages evicted in this frame.
    pub evicted: u32,
    /// Arrived pages that were not taken: no parent, no room, or already resident.
    pub refused: u32,
    /// Length of the wanted list.
    pub wanted: u32,
    /// Patches built, and so to be uploaded.
    pub built: u32,
    /// Patches drawn, summed over views and depth ranges.
    pub drawn: u32,
    /// Bound on the error on the screen in pixels: the tolerance, or that of the worst leaf where
    /// the budget, the operation cap, the deepest level or missing pages ended the refinement, or
    /// of the worst diamond whose split still morphs.
    pub error_px_bound: f64,
}

impl FrameCounts {
    /// The counts by name, for tables and files, in a fixed order.
    pub fn columns(&self) -> [(&'static str, f64); 15] {
        let count = f64::from;
        [
            ("leaves", count(self.leaves)),
            ("triangles", count(self.triangles)),
            ("diamonds", count(self.diamonds)),
            ("splits", count(self.splits)),
            ("merges", count(self.merges)),
            ("evaluations", count(self.evaluations)),
            ("blocked", count(self.blocked)),
            ("pages", count(self.pages)),
            ("admitted", count(self.admitted)),
            ("evicted", count(self.evicted)),
            ("refused", count(self.refused)),
            ("wanted", count(self.wanted)),
            ("built", count(self.built)),
            ("drawn", count(self.drawn)),
            ("error_px_bound", self.error_px_bound),
        ]
    }
}

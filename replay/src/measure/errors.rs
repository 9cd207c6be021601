//! What was measured: the errors of one frame and of a flight.
//!
//! In:    filled by `frame` and the metrics.
//! Out:   [`FrameErrors`], [`Thorough`], [`FlightErrors`].
//! Keeps: nothing.
//! Not here: measuring, names and units of the metrics in tables and files (`report`).

use super::spread::{Gathered, Spread};

/// The errors of one frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct FrameErrors {
    /// Frame of the flight.
    pub frame: u64,
    /// Place of the eye, degrees and metres above the ellipsoid.
    pub eye: [f64; 3],
    /// Height of the eye above the mesh beneath it, metres.
    pub above_m: f64,
    /// Rays, and those that met the ground.
    pub rays: u64,
    /// E1: radial pixel error.
    pub e1_px: Spread,
    /// E2: difference of the depths of mesh and ground along a ray over the ground's.
    pub e2_share: Spread,
    /// E2: the same difference in metres.
    pub e2_m: Spread,
    /// E3: rays that meet one of ground and mesh and miss the other.
    pub e3_rays: u64,
    /// What the LOD promised.
    pub bound_px: f64,
    /// P1: pops of what is visible, since the frame before.
    pub p1_px: Spread,
    /// Rays whose pop is more than half a pixel.
    pub p1_above_half: u64,
    /// P3: turn of the shading normal since the frame before, degrees.
    pub p3_deg: Spread,
    /// Time since the frame that pops are counted from, milliseconds; 0 where there was none.
    pub gap_ms: u32,
    /// C4: rays that see through the mesh, far within the ground's outline.
    pub holes: u64,
    /// C5: single rays that see through the mesh to what lies farther.
    pub pinholes: u64,
    /// Normals of visible ground above which the mesh has no leaf at all.
    pub lost: u64,
    /// T1: triangles whose greatest depth is more than ten times their least.
    pub stretched: u64,
    /// Triangles in the picture.
    pub triangles: u64,
    /// Triangles of the whole mesh.
    pub mesh_triangles: u64,
    /// Pages of the reference that could not be made.
    pub missing_pages: u64,
    /// What is measured in few frames only.
    pub thorough: Option<Thorough>,
}

impl FrameErrors {
    /// E5: the greatest measured error over what was promised.
    pub fn e5(&self) -> f64 {
        self.e1_px.max / self.bound_px
    }

    /// Whether there was a frame to count pops from.
    pub fn has_pops(&self) -> bool {
        self.gap_ms > 0 || self.p1_px.count > 0
    }
}

/// The costly metrics of one frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Thorough {
    /// E4: difference of the outlines of ground and mesh against the sky, by picture column.
    pub e4_px: Spread,
    /// Columns in which only one of both has an outline.
    pub e4_lost: u64,
    /// C1: edges that are not used once in each direction, and by how much V − E + F is not 2.
    pub c1_edges: u64,
    /// C2: edges that have a vertex between their ends.
    pub c2_junctions: u64,
    /// C3: lattice points that are drawn at more than one place.
    pub c3_points: u64,
    /// H1: answers of the ground's queries against the same heights computed another way, metres.
    pub h1_m: Spread,
    /// H2: ground less mesh under the gear, within some metres of the eye's foot, metres.
    pub h2_gear_m: Spread,
    /// H2: the same within 50 m.
    pub h2_near_m: Spread,
    /// H2: the same within 500 m.
    pub h2_far_m: Spread,
    /// H2: change of the mesh's height within 50 m since the frame before, metres.
    pub h2_step_m: Spread,
    /// M32 − M64: pixels between the place of the uploaded bytes and the place in f64.
    pub m32_px: Spread,
    /// Pixels between where f32 arithmetic puts a vertex and where f64 does.
    pub f32_px: Spread,
    /// J1: how that difference varies while the eye moves by 0.05 px a frame.
    pub j1_px: Spread,
    /// J1: its greatest change from one such frame to the next, pixels.
    pub j1_step_px: f64,
    /// Z1 and Z2, by depth buffer.
    pub depths: [DepthOrderErrors; 3],
    /// The second way to E1.
    pub cross: Cross,
}

/// Z1 and Z2 of one kind of depth buffer.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct DepthOrderErrors {
    /// Z1: least relative distance of two surfaces that are told apart in 99.9 % of the pixels.
    pub z1_share: f64,
    /// Z2: pixels in which the order of two surfaces flips from frame to frame, per million.
    pub z2_ppm: f64,
}

/// E1 by a second way: the ground as its own queries walk it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Cross {
    /// Rays that were cast both ways.
    pub rays: u64,
    /// Of them, rays that met the ground one way only.
    pub differ: u64,
    /// Difference of both E1, pixels.
    pub px: Spread,
}

/// The errors of a flight: what was gathered from all measured frames.
#[derive(Clone, Debug, Default)]
pub struct FlightErrors {
    /// Every measured frame.
    pub frames: Vec<FrameErrors>,
    /// E1 of all rays.
    pub e1_px: Gathered,
    /// E2 of all rays.
    pub e2_share: Gathered,
    /// E2 of all rays in metres.
    pub e2_m: Gathered,
    /// P1 of all rays of frames that have pops.
    pub p1_px: Gathered,
    /// P3 of the same rays.
    pub p3_deg: Gathered,
    /// Frames before which the camera was cut: they have no pops.
    pub cuts: u64,
}

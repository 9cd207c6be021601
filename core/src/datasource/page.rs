//! One page: heights, normals, hidden layers and error bounds of a cell of the octahedral square.
//!
//! In:    filled by `generate`, on the host's loader threads.
//! Out:   samples by (i, j); bounds by lattice position.
//! Keeps: its own arrays.
//! Not here: which pages are resident (`pages`).

use super::key::{PAGE_SIDE, PageKey};

/// Samples of a page.
pub const SAMPLES: usize = PAGE_SIDE * PAGE_SIDE;
/// Bounds are kept for every fourth sample: 17 a side.
pub const BOUND_STRIDE: usize = 4;
/// Bounds along one side of a page.
pub const BOUND_SIDE: usize = (PAGE_SIDE - 1) / BOUND_STRIDE + 1;

/// What is known about the ground around one place, beyond the samples.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[repr(C)]
pub struct Bound {
    /// Bound on the distance in height between the ground and this page's triangles where these
    /// are the odd level's: longest edge 2 samples along an axis. Metres.
    pub error_odd_m: f32,
    /// The same for the even level's triangles: longest edge 1 sample diagonally.
    pub error_even_m: f32,
    /// Bound on how much the height changes over one sample step, in metres: a slope.
    pub variation_m: f32,
}

/// One page. About 52 KiB, all of it inline.
pub struct Page {
    /// Which cell.
    pub key: PageKey,
    /// Heights above the ellipsoid in metres; sample (i, j) at `j * PAGE_SIDE + i`.
    pub heights_m: [f32; SAMPLES],
    /// Body-fixed ground normals, octahedral encoding, ±32767 is ±1.
    pub normals: [[i16; 2]; SAMPLES],
    /// Roughness, rock, moisture, temperature.
    pub layers: [[u8; 4]; SAMPLES],
    /// Bounds; (i, j) at `j * BOUND_SIDE + i`.
    pub bounds: [Bound; BOUND_SIDE * BOUND_SIDE],
    /// Least and greatest sample in metres.
    pub height_range_m: [f32; 2],
    /// Hash of all of the above.
    pub content: u64,
}

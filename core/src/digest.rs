//! Digests: which state a frame ended in, as sums that do not depend on any order.
//!
//! In:    keys and column values.
//! Out:   [`FrameDigest`], one 64-bit sum a stage.
//! Keeps: nothing.
//! Not here: comparing against a recording (`overfly_replay`).

/// A 64-bit finaliser: every input bit reaches every output bit.
/// Source: Steele, Lea and Flood 2014, SplitMix64.
pub fn mix(x: u64) -> u64 {
    let z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The bits of a number as they are hashed: −0.0 counts as 0.0.
pub fn bits(x: f64) -> u64 {
    (if x == 0.0 { 0.0 } else { x }).to_bits()
}

/// A running hash of a sequence, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Chain(pub u64);

impl Chain {
    /// Adds one value to the sequence.
    pub fn add(&mut self, value: u64) {
        self.0 = mix(self.0 ^ value);
    }
}

/// What one frame ended in, stage by stage: the first that differs names the culprit.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameDigest {
    /// Resident pages: keys and contents.
    pub pages: u64,
    /// Leaf triangles of the mesh.
    pub mesh: u64,
    /// Bytes of the vertices of every live patch.
    pub vertices: u64,
    /// Which patch is drawn in which view and depth range, and the eye-relative anchors.
    pub draws: u64,
}

impl FrameDigest {
    /// The names of the parts, in the order of [`FrameDigest::parts`].
    pub const STAGES: [&'static str; 4] = ["pages", "mesh", "vertices", "draws"];

    /// The parts, in pipeline order.
    pub fn parts(&self) -> [u64; 4] {
        [self.pages, self.mesh, self.vertices, self.draws]
    }

    /// One number for the whole frame.
    pub fn all(&self) -> u64 {
        let mut chain = Chain::default();
        self.parts().into_iter().for_each(|part| chain.add(part));
        chain.0
    }
}

//! The reference meshes of the LEB workload, found by plain recursion and by libcbt with libleb.
//!
//! In:    nothing.
//! Out:   [`ANSWERS`].
//! Keeps: nothing.
//! Not here: who is asked (`recursion`, and the engine in the tests and the bench).

use super::workload::{Flight, Path, Preset, Speed};
use Path::{Cruise, Dive};
use Preset::{L1M, L50k, L200k};
use Speed::{V1, V10};

/// The mesh that is right on one frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Answer {
    /// How fine the mesh is.
    pub preset: Preset,
    /// What is flown.
    pub flight: Flight,
    /// The frame, counted from 0.
    pub frame: u32,
    /// Leaf triangles.
    pub leaves: u64,
    /// Depth of the deepest one; a root has 1.
    pub deepest: u32,
    /// The sum over all leaves.
    pub digest: u64,
}

/// One line of the table below.
const fn row(what: (Preset, Path, Speed), frame: u32, mesh: (u64, u32), digest: u64) -> Answer {
    let (preset, path, speed) = what;
    let (leaves, deepest) = mesh;
    Answer { preset, flight: Flight { path, speed }, frame, leaves, deepest, digest }
}

/// Every frame with a known answer, by preset, flight and frame.
#[rustfmt::skip]
pub const ANSWERS: [Answer; 54] = [
    row((L50k, Cruise, V1), 0, (49_806, 23), 0x3b9f_9c73_6c22_8043),
    row((L50k, Cruise, V1), 1, (49_838, 23), 0x2760_64a1_db38_9413),
    row((L50k, Cruise, V1), 100, (49_910, 23), 0x8f0f_0be6_0f00_24b2),
    row((L50k, Cruise, V1), 300, (50_055, 23), 0x5880_a79f_741b_03f9),
    row((L50k, Cruise, V1), 600, (50_240, 23), 0xf1f5_03c4_dfa6_ac96),
    row((L50k, Cruise, V1), 1199, (50_622, 23), 0x2b3d_1333_e255_d695),
    row((L50k, Cruise, V10), 0, (49_806, 23), 0x3b9f_9c73_6c22_8043),
    row((L50k, Cruise, V10), 1, (49_852, 23), 0xede0_f930_019a_1f67),
    row((L50k, Cruise, V10), 100, (50_504, 23), 0x7b6b_7625_11be_884c),
    row((L50k, Cruise, V10), 300, (51_335, 23), 0xba6e_b42b_9062_f809),
    row((L50k, Cruise, V10), 600, (51_888, 23), 0x20c1_ca43_120a_f096),
    row((L50k, Cruise, V10), 1199, (50_643, 23), 0xdd6c_deb4_450c_97b4),
    row((L50k, Dive, V10), 0, (20_315, 17), 0xe170_54bc_7739_43b0),
    row((L50k, Dive, V10), 1, (20_357, 17), 0x85f7_96fc_74dd_c705),
    row((L50k, Dive, V10), 100, (22_833, 18), 0x3e82_9f7c_8fe2_2ba7),
    row((L50k, Dive, V10), 300, (29_638, 19), 0xe8e6_ba62_08e1_e206),
    row((L50k, Dive, V10), 600, (51_888, 23), 0x20c1_ca43_120a_f096),
    row((L50k, Dive, V10), 1199, (50_643, 23), 0xdd6c_deb4_450c_97b4),
    row((L200k, Cruise, V1), 0, (199_207, 25), 0x1894_9e1f_20b3_beb0),
    row((L200k, Cruise, V1), 1, (199_269, 25), 0x0101_ecb8_1dc4_0483),
    row((L200k, Cruise, V1), 100, (199_703, 25), 0x5b13_4672_8c7d_d4b7),
    row((L200k, Cruise, V1), 300, (200_203, 25), 0x9b5b_abf1_0e32_42ba),
    row((L200k, Cruise, V1), 600, (200_971, 25), 0xc66f_239c_9c30_9bf8),
    row((L200k, Cruise, V1), 1199, (202_433, 25), 0x38e5_8958_7b22_41f3),
    row((L200k, Cruise, V10), 0, (199_207, 25), 0x1894_9e1f_20b3_beb0),
    row((L200k, Cruise, V10), 1, (199_273, 25), 0x0e7c_79a4_9a95_a10a),
    row((L200k, Cruise, V10), 100, (201_996, 25), 0x08ea_dfb2_ac68_c6a7),
    row((L200k, Cruise, V10), 300, (205_282, 25), 0x0984_7dd9_7217_9ebf),
    row((L200k, Cruise, V10), 600, (207_498, 25), 0xf745_bdbe_25a1_c1ea),
    row((L200k, Cruise, V10), 1199, (202_487, 25), 0x0320_3271_9eae_b4d2),
    row((L200k, Dive, V10), 0, (81_293, 19), 0x2bb3_1005_2b6f_d794),
    row((L200k, Dive, V10), 1, (81_399, 19), 0x93c5_1e06_f353_e13e),
    row((L200k, Dive, V10), 100, (91_263, 20), 0x0880_671e_df70_f613),
    row((L200k, Dive, V10), 300, (118_543, 21), 0x52d6_c168_877f_56c9),
    row((L200k, Dive, V10), 600, (207_498, 25), 0xf745_bdbe_25a1_c1ea),
    row((L200k, Dive, V10), 1199, (202_487, 25), 0x0320_3271_9eae_b4d2),
    row((L1M, Cruise, V1), 0, (989_961, 27), 0x751a_5bbd_1384_164d),
    row((L1M, Cruise, V1), 1, (990_037, 27), 0xcb31_3244_0dbf_4840),
    row((L1M, Cruise, V1), 100, (991_396, 27), 0x06e1_1fed_e2c9_224a),
    row((L1M, Cruise, V1), 300, (993_875, 27), 0x1282_95da_058d_2afb),
    row((L1M, Cruise, V1), 600, (997_394, 27), 0x5c00_232b_d1c4_a268),
    row((L1M, Cruise, V1), 1199, (1_004_397, 27), 0x742e_6ae5_2473_382a),
    row((L1M, Cruise, V10), 0, (989_961, 27), 0x751a_5bbd_1384_164d),
    row((L1M, Cruise, V10), 1, (990_257, 27), 0x973c_a384_2145_35f9),
    row((L1M, Cruise, V10), 100, (1_002_059, 27), 0x86d4_b56b_e4ec_71e9),
    row((L1M, Cruise, V10), 300, (1_020_602, 27), 0x6753_8c3f_3788_85e5),
    row((L1M, Cruise, V10), 600, (1_031_258, 27), 0x722b_fbd5_be76_3651),
    row((L1M, Cruise, V10), 1199, (1_007_384, 27), 0x41b7_21bd_666f_add2),
    row((L1M, Dive, V10), 0, (398_721, 21), 0x37a7_1661_51dc_0680),
    row((L1M, Dive, V10), 1, (399_119, 21), 0x9a1c_c1f1_3fed_4440),
    row((L1M, Dive, V10), 100, (460_161, 22), 0x6d83_d382_29b5_d1a2),
    row((L1M, Dive, V10), 300, (593_619, 23), 0x363c_87c4_47a3_8f12),
    row((L1M, Dive, V10), 600, (1_031_258, 27), 0x722b_fbd5_be76_3651),
    row((L1M, Dive, V10), 1199, (1_007_384, 27), 0x41b7_21bd_666f_add2),
];

//! The frame.
pub mod data;
pub use data::{FrameCounts, FrameInput, FrameOutput, RangeDraws, ViewDraws};

//! Recorded flights: one file format for poses and for whole recordings, and what reads them.
//!
//! | module | what it holds |
//! |---|---|
//! | [`pose`] | a pose of a flight, and the view that a lens makes of it |
//! | [`format`](mod@format) | the `.ovf` file: header, blocks, what a recording refuses |
//! | [`write`](mod@write), [`read`] | files, frame by frame |
//! | [`flight`](mod@flight) | flights in memory, and the three that come with overfly |
//! | [`resample`] | flights from CSV files of a flight simulator |
//! | [`measure`](mod@measure) | errors of what is drawn, in pixels and metres |
//! | [`budget`] | what frames may cost: runs, lines, verdicts, two programs in pairs |
//! | [`trade`] | the price of every knob: points, fronts, slopes, advice |
//! | [`compare`], [`stats`] | which stage differs first; percentiles of columns |
//!
//! In:    poses, frames, digests; files.
//! Out:   the same, bit for bit.
//! Keeps: nothing.
//! Not here: running a scene (the host), what a frame is (`overfly_core`).
#![forbid(unsafe_code)]

pub mod budget;
pub mod compare;
pub mod flight;
pub mod format;
pub mod measure;
mod payload;
pub mod pose;
pub mod read;
pub mod resample;
pub mod stats;
pub mod trade;
mod words;
pub mod write;

pub use compare::{RunDigest, first_difference};
pub use flight::{BUNDLED, Flight, bundled, flight};
pub use format::{Difference, Header, Kind, RecordedFrame};
pub use pose::{Pose, view_of};
pub use read::{Ending, Fault, Frame, ReadError, Reader, Recording, Tail};
pub use stats::{Summary, Tally};
pub use write::{WriteError, Writer};

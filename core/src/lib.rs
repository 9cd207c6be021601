//! The terrain itself: from a pose and arrived pages to patches, wanted pages and a digest.
//!
//! | stage | reads | writes |
//! |---|---|---|
//! | `camera` | views | [`camera::Camera`] of each view |
//! | `admit` | arrived pages | resident pages |
//! | `prioritise` | motion, diamonds that are due | verdicts, and how long they last |
//! | `refine` | agenda, pages | splits and merges: the mesh, the wanted pages |
//! | `build` | new leaves, pages | vertices of new patches |
//! | `place` | cameras, patches | draws of each view and depth range |
//!
//! In:    [`frame::FrameInput`].
//! Out:   [`frame::FrameOutput`], and the patch arena that its draws point into.
//! Keeps: the planet's state, as columns of fixed capacity.
//! Not here: Vulkan, serde, files, time.
#![forbid(unsafe_code)]

pub mod units;

pub mod geodesy;

pub mod lattice;

pub mod camera;

pub mod projection;

pub mod scene;

pub mod sun;

pub mod settings;

pub mod limits;

pub mod columns;

pub mod datasource;

pub mod lod;

pub mod mesh;

pub mod ground;

pub mod frame;

pub mod inspect;

pub mod digest;

//! Where heights come from: pages of the octahedral square, resident or wanted.
//!
//! In:    arrived pages; what the LOD asks for.
//! Out:   heights, normals, layers, bounds and colour of resident pages.
//! Keeps: the page pool.
//! Not here: files and threads (the host's loader).

pub mod codec;
pub mod coder;
pub mod colour;
pub mod compose;
pub mod facts;
pub mod generate;
pub mod key;
pub mod page;
pub mod pages;

mod probes;
pub mod procedural;
pub mod tile;

pub use colour::ColourTile;
pub use key::{PAGE_SIDE, PageKey};
pub use page::Page;

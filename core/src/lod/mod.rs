//! ROAM 2.0 on columns: which leaf triangles the surface has this frame.
//!
//! In:    sights, resident pages, the knobs.
//! Out:   splits and merges, done on the diamonds; wanted pages in the order of urgency.
//! Keeps: diamonds and queues.
//! Not here: vertices (`mesh`), loading pages (`datasource`).
//! Source: Duchaineau et al. 1997 and 2003 (ROAM, ROAM 2.0), as measured in the design.

pub mod audit;
pub mod diamonds;
pub mod operate;
pub mod queues;
pub mod reach;
pub mod refine;
pub mod screen_error;

pub use diamonds::{Diamond, DiamondId, Diamonds};

//! ROAM 2.0 on columns: which leaf triangles the surface has this frame.
//!
//! In:    sights, resident pages, the knobs.
//! Out:   splits and merges, done on the diamonds; wanted pages in the order of urgency.
//! Keeps: diamonds, what hangs on them, and the agenda: when to look at which.
//! Not here: vertices (`mesh`), loading pages (`datasource`).
//! Source: Duchaineau et al. 1997 and 2003 (ROAM, ROAM 2.0), as measured in the design.

pub mod agenda;
pub mod audit;
pub mod bins;
pub mod cover;
pub mod diamonds;
mod downward;
mod margin;
pub mod reach;
pub mod refine;
pub mod screen_error;
pub mod urgent;
pub mod want;
pub mod wheel;

pub use diamonds::{Diamond, DiamondId, Diamonds};

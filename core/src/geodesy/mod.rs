//! Where things are: the body's shape, its frames, and the only narrowing to f32.
//!
//! In:    geodetic positions, surface normals, ECEF points.
//! Out:   the same in another frame.
//! Keeps: nothing.
//! Not here: terrain heights (`datasource`), the lattice (`lattice`).

pub mod ellipsoid;
pub mod frames;
pub mod trig;

pub use ellipsoid::Ellipsoid;
pub use frames::{Ecef, Enu, EyeRel, Geodetic, TwoFloat, narrow};

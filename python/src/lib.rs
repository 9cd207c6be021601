//! The Python module `overfly`: ground heights, frames, replays, measured errors, stills.
//!
//! In:    numbers, numpy arrays, paths and keywords of a Python program.
//! Out:   numpy arrays, dicts, exceptions that say the whole sentence.
//! Keeps: what its objects keep; nothing global.
//! Not here: what a frame is (`overfly`), names and types for editors (`overfly/__init__.pyi`).
//!
//! Whatever takes long runs without the interpreter's lock, and looks for Ctrl-C on its way. Locks
//! of ours are only taken without that lock, so that neither can wait for the other.
#![forbid(unsafe_code)]

mod arrays;
mod geodesy;
mod ground;
mod measure;
mod player;
mod raised;
mod replay;
mod still;
mod terrain;
mod view;

use pyo3::prelude::*;

/// What Python imports as `overfly._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::geodesy::{ecef_from_geodetic, geodetic_from_ecef};
    #[pymodule_export]
    use crate::ground::{Contacts, Heights, Ray, Readiness};
    #[pymodule_export]
    use crate::measure::measure;
    #[pymodule_export]
    use crate::raised::OverflyError;
    #[pymodule_export]
    use crate::replay::{Replay, replay};
    #[pymodule_export]
    use crate::still::still;
    #[pymodule_export]
    use crate::terrain::{FrameResult, Terrain};
    #[pymodule_export]
    use crate::view::View;
}

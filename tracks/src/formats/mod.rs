//! The formats, each in its file: from text to columns.
//!
//! In:    a text.
//! Out:   fixes and faults in a sink.
//! Keeps: nothing.
//! Not here: which format it is (`format`), what becomes of the fixes (`clean`, `datum`).

pub(crate) mod acmi;
pub(crate) mod basestation;
pub(crate) mod fdr;
pub(crate) mod gpx;
pub(crate) mod igc;
pub(crate) mod json;
pub(crate) mod kml;
pub(crate) mod nmea;
pub(crate) mod table;
mod xml;

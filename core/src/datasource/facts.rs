//! What an archive says about itself: body, datum, layers, heights, content; or imagery.
//!
//! In:    a reader of archives, which has checked every range.
//! Out:   plain facts for sources and bounds.
//! Keeps: nothing.
//! Not here: files, servers and the JSON form (`overfly_archive`).

use crate::geodesy::Ellipsoid;

/// Everything that an archive states once, for all of its pages.
#[derive(Clone, PartialEq, Debug)]
pub struct ArchiveFacts {
    /// Version of the format of its pages and of these facts; [`FORMAT_VERSION`] is the only one.
    pub version: u32,
    /// What body the heights are of, for people.
    pub body_name: String,
    /// Shape of that body.
    pub body: Ellipsoid,
    /// What its heights are counted from.
    pub datum: Datum,
    /// Least and greatest height of the surface above the ellipsoid, over everything in the
    /// archive and with sea level included. Metres.
    pub height_range_m: [f64; 2],
    /// Hash of the archive's content: archives of equal hash give equal pages.
    pub content: u64,
    /// The layers, by rising depth; 1 to [`LAYERS_MAX`].
    pub layers: Vec<LayerFacts>,
}

/// The version of archives that this build reads and writes.
pub const FORMAT_VERSION: u32 = 1;
/// An archive has no more layers than this.
pub const LAYERS_MAX: usize = 16;

/// Everything that an archive of imagery states once, for all of its tiles.
#[derive(Clone, PartialEq, Debug)]
pub struct ImageryFacts {
    /// Version of the format of its tiles and of these facts; [`IMAGERY_VERSION`] is the only one.
    pub version: u32,
    /// What body is seen, for people.
    pub body_name: String,
    /// Shape of that body.
    pub body: Ellipsoid,
    /// Depth of its last tiles.
    pub depth: u8,
    /// Distance of the picture's pixels at its middle. Metres.
    pub spacing_m: f64,
    /// Whom to thank, wherever it is shown; may be empty.
    pub attribution: String,
    /// Name of the picture that it was made from.
    pub source: String,
    /// Hash of the archive's content: archives of equal hash give equal colours.
    pub content: u64,
}

/// The version of archives of imagery that this build reads and writes.
pub const IMAGERY_VERSION: u32 = 1;

/// What heights are counted from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Datum {
    /// The geoid EGM96: mean sea level.
    Egm96,
    /// The body's ellipsoid.
    Ellipsoid,
}

/// One resolution of an archive: sources of like spacing, down to one depth.
#[derive(Clone, PartialEq, Debug)]
pub struct LayerFacts {
    /// Depth of the pages of its last level.
    pub depth: u8,
    /// Heights are whole multiples of this. Metres.
    pub quantum_m: f64,
    /// Distance of the source's postings. Metres.
    pub spacing_m: f64,
    /// Width over which it is blended into what lies beneath. Metres.
    pub blend_m: f64,
    /// Names of what it was made from.
    pub sources: Vec<String>,
}

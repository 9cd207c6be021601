//! What one picture is made from, and what it may show.
//!
//! In:    a frame's output, filled in by the host.
//! Out:   [`Picture`], [`Show`], [`Backdrop`].
//! Keeps: nothing.
//! Not here: drawing it (`Renderer`).

use crate::overlay::Overlay;
use overfly_core::frame::data::ViewDraws;
use overfly_core::inspect::PatchInfo;
use overfly_core::mesh::Patches;
use overfly_core::scene::FrameParts;

/// What the ground is coloured by.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Show {
    /// As one would see it.
    #[default]
    Shaded,
    /// Edges of all triangles, those of patches bolder.
    Wireframe,
    /// Level of the leaf.
    Level,
    /// Bound on the error on the screen: blue up to half the tolerance, white at it, red from
    /// twice on.
    ScreenError,
    /// Depth of the page; red where a page is lacking.
    Residency,
    /// Normals: east red, north green, up blue.
    Normals,
    /// Which depth range drew it.
    DepthRange,
    /// All patches there are; red those that no view of the LOD sees.
    Culled,
}

impl Show {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Shaded,
        Self::Wireframe,
        Self::Level,
        Self::ScreenError,
        Self::Residency,
        Self::Normals,
        Self::DepthRange,
        Self::Culled,
    ];

    /// As options and files call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shaded => "shaded",
            Self::Wireframe => "wireframe",
            Self::Level => "level",
            Self::ScreenError => "error",
            Self::Residency => "residency",
            Self::Normals => "normals",
            Self::DepthRange => "range",
            Self::Culled => "culled",
        }
    }

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|show| show.name() == name)
    }

    /// Whether it needs [`Picture::infos`].
    pub const fn needs_infos(self) -> bool {
        matches!(self, Self::Level | Self::ScreenError | Self::Residency | Self::Culled)
    }
}

/// What is behind the ground.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Backdrop {
    /// The sky.
    #[default]
    Sky,
    /// One colour, linear: so that a test sees every hole.
    Colour([f32; 3]),
}

/// One picture of a view.
#[derive(Clone, Copy)]
pub struct Picture<'a> {
    /// The view's draws.
    pub view: &'a ViewDraws,
    /// The arena that they point into.
    pub patches: &'a Patches,
    /// Sun and sea.
    pub parts: &'a FrameParts,
    /// The frame's time, for morphing vertices.
    pub time_ms: u32,
    /// What the ground is coloured by.
    pub show: Show,
    /// What debug views show of each slot; those beyond its end show as zeros. May be empty where
    /// [`Show::needs_infos`] says no.
    pub infos: &'a [PatchInfo],
    /// Drawn over everything.
    pub overlay: &'a Overlay,
    /// What is behind the ground.
    pub backdrop: Backdrop,
}

/// For pictures without an overlay.
static NOTHING: Overlay = Overlay::EMPTY;

impl<'a> Picture<'a> {
    /// The view as one would see it, with nothing over it.
    pub fn of(view: &'a ViewDraws, patches: &'a Patches, parts: &'a FrameParts) -> Self {
        Self {
            view,
            patches,
            parts,
            time_ms: 0,
            show: Show::Shaded,
            infos: &[],
            overlay: &NOTHING,
            backdrop: Backdrop::Sky,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Show;

    #[test]
    fn every_view_is_found_by_its_name() {
        assert!(Show::ALL.iter().all(|&show| Show::from_name(show.name()) == Some(show)));
        assert_eq!(Show::from_name("Shaded"), None);
    }
}

//! The parts of a picture that have programs of their own, and that a build may lack.
//!
//! In:    what a picture or the settings ask for; the crate's features.
//! Out:   [`Lit`], [`check`].
//! Keeps: nothing.
//! Not here: the programs (`shaders`), their pipelines (`passes`).

use crate::error::Fault;
use overfly_core::scene::FrameParts;

/// What everything that is lit has programs for: each pair of these has its own, so that a scene
/// without a sea or a sun has no instruction for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Lit {
    /// Sea and air: only bodies with a sea have air, until scenes name their atmosphere.
    pub(crate) sea: bool,
    pub(crate) sun: bool,
}

impl Lit {
    /// How many there are.
    pub(crate) const COUNT: usize = 4;

    pub(crate) fn of(parts: &FrameParts) -> Self {
        Self { sea: parts.sea, sun: parts.sun_direction.is_some() }
    }

    /// Below [`Self::COUNT`].
    pub(crate) fn index(self) -> usize {
        usize::from(self.sea) + 2 * usize::from(self.sun)
    }
}

/// What is asked for.
#[derive(Clone, Copy, Default)]
pub(crate) struct Asked {
    pub(crate) lit: Lit,
    pub(crate) imagery: bool,
    pub(crate) sky: bool,
    pub(crate) debug: bool,
    pub(crate) overlay: bool,
}

/// Fails where something is asked for that this build was made without.
pub(crate) fn check(asked: Asked) -> Result<(), Fault> {
    let parts = [
        ("sea", cfg!(feature = "sea"), asked.lit.sea),
        ("sun", cfg!(feature = "sun"), asked.lit.sun),
        ("imagery", cfg!(feature = "imagery"), asked.imagery),
        ("sky", cfg!(feature = "sky"), asked.sky),
        ("debug", cfg!(feature = "debug"), asked.debug),
        ("overlay", cfg!(feature = "overlay"), asked.overlay),
    ];
    let lacking = parts.into_iter().find(|&(_, is_built, is_asked)| is_asked && !is_built);
    lacking.map_or(Ok(()), |(part, ..)| Err(Fault::Absent { part }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_sea_and_sun_has_an_index_of_its_own() {
        let pairs = [(false, false), (true, false), (false, true), (true, true)];
        let indices = pairs.map(|(sea, sun)| Lit { sea, sun }.index());
        assert_eq!(indices, [0, 1, 2, 3]);
        assert_eq!(indices.len(), Lit::COUNT);
    }

    #[test]
    fn what_is_not_asked_for_is_never_lacking() {
        assert!(check(Asked::default()).is_ok());
        let sea = Asked { lit: Lit { sea: true, sun: false }, ..Asked::default() };
        assert_eq!(check(sea).is_ok(), cfg!(feature = "sea"));
    }
}

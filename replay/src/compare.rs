//! Whether a replay ended in the recorded states, and which stage left them first.
//!
//! In:    digests of frames, recorded and now.
//! Out:   the name of a stage; one number for a whole run.
//! Keeps: [`RunDigest`].
//! Not here: how a digest is made (`overfly_core::digest`).

use overfly_core::digest::{Chain, FrameDigest};

/// The first stage, in pipeline order, whose digest is not the recorded one.
pub fn first_difference(recorded: &FrameDigest, now: &FrameDigest) -> Option<&'static str> {
    let differs = |(recorded, now): (u64, u64)| recorded != now;
    let stage = recorded.parts().into_iter().zip(now.parts()).position(differs)?;
    Some(FrameDigest::STAGES[stage])
}

/// The digest of a whole run: of every frame's digest, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RunDigest {
    chain: Chain,
    frames: u64,
}

impl RunDigest {
    /// Adds the next frame.
    pub fn add(&mut self, digest: &FrameDigest) {
        self.chain.add(digest.all());
        self.frames += 1;
    }

    /// Frames added so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// One number for all of them; it depends on their order and number.
    pub fn value(&self) -> u64 {
        let mut chain = self.chain;
        chain.add(self.frames);
        chain.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_stage_that_differs_is_named() {
        let recorded = FrameDigest { pages: 1, mesh: 2, vertices: 3, draws: 4 };
        assert_eq!(first_difference(&recorded, &recorded), None);
        let now = FrameDigest { mesh: 9, draws: 9, ..recorded };
        assert_eq!(first_difference(&recorded, &now), Some("mesh"));
        let now = FrameDigest { draws: 9, ..recorded };
        assert_eq!(first_difference(&recorded, &now), Some("draws"));
    }

    #[test]
    fn a_run_digest_depends_on_order_and_number_of_the_frames() {
        let of = |frames: &[u64]| {
            let mut run = RunDigest::default();
            for &pages in frames {
                run.add(&FrameDigest { pages, ..FrameDigest::default() });
            }
            assert_eq!(run.frames(), frames.len() as u64);
            run.value()
        };
        assert_eq!(of(&[1, 2]), of(&[1, 2]));
        assert_ne!(of(&[1, 2]), of(&[2, 1]));
        assert_ne!(of(&[]), of(&[0]));
        assert_ne!(of(&[0]), of(&[0, 0]));
    }
}

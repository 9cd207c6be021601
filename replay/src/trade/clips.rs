//! Which frames of a flight a trade flies: clips, each of which ends with the frame that is
//! measured.
//!
//! In:    frames of the flight, every how many of them one is measured.
//! Out:   [`Clip`]s.
//! Keeps: nothing.
//! Not here: flying them (the host).
//!
//! Before each clip the terrain comes up at its first pose; what lies between clips is not flown.
//! A whole flight is one clip an hour long: its points would take days.

use std::ops::Range;

/// Consecutive frames; the last is measured, pops being counted from the one before it.
pub type Clip = Range<usize>;

/// The clips of `frames`: of `length` frames, one every `every` frames; from another `phase`, in
/// 0..1, they lie between those. At least one, and none leaves `frames`.
pub fn clips(frames: &Range<usize>, every: usize, length: usize, phase: f64) -> Vec<Clip> {
    let every = every.max(1);
    let length = length.clamp(1, every).min(frames.len());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "phase is clamped")]
    let shift = (phase.clamp(0.0, 1.0) * every.min(frames.len() - length) as f64) as usize;
    let starts = (frames.start + shift..frames.end).step_by(every);
    starts.map(|start| start..start + length).filter(|clip| clip.end <= frames.end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_are_spread_over_the_frames_and_stay_inside() {
        assert_eq!(clips(&(0..301), 100, 10, 0.0), [0..10, 100..110, 200..210]);
        assert_eq!(clips(&(50..350), 100, 10, 0.5), [100..110, 200..210, 300..310]);
        let only = |frames, phase| clips(&frames, 100, 10, phase).pop();
        assert_eq!(only(0..5, 0.0), Some(0..5), "shorter than a clip");
        assert_eq!(only(0..40, 0.5), Some(15..25), "shorter than a step");
        assert_eq!(clips(&(0..30), 10, 99, 0.0), [0..10, 10..20, 20..30], "all frames are flown");
    }
}

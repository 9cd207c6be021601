//! Heights at lattice points, moved until the triangles between them meet the postings.
//!
//! In:    a block: first heights, postings with the triangles around them.
//! Out:   its heights, moved.
//! Keeps: nothing.
//! Not here: where first heights come from (`block`), quanta and tiles (`pyramid`).
//! Source: Gilbert 1972 (simultaneous iterative reconstruction), over-relaxed.
//!
//! The lattice has more points than there are postings, so there are many surfaces that meet them
//! all; the first heights lie between the four postings around, and what is left is
//! spread over each triangle's corners. Everything is whole numbers, whose sums do not depend on
//! their order: so two blocks that share a point move it by the same, as long as their margins are
//! wider than [`ROUNDS`] steps.

use crate::block::{Block, FINE};

/// Rounds of moving.
pub const ROUNDS: usize = 24;

/// Holds points in place that hardly any posting weighs on, in 1/65536 of a posting: they would
/// have to move far to make a difference.
const HELD: i64 = 1 << 11;

/// Moves the heights. Postings nearer than `slack_m` are met well enough: those of whole metres
/// were rounded by as much.
pub fn fit(block: &mut Block, slack_m: f64) {
    #[expect(clippy::cast_possible_truncation, reason = "a metre or so")]
    let slack = (slack_m * FINE) as i64;
    let mut shares = vec![0_i64; block.heights.len()];
    for posting in &block.postings {
        for (&corner, &share) in posting.corners.iter().zip(&posting.shares) {
            shares[corner as usize] += i64::from(share);
        }
    }
    let mut moves = vec![0_i64; block.heights.len()];
    for _ in 0..ROUNDS {
        moves.fill(0);
        for posting in &block.postings {
            let corners = || posting.corners.iter().zip(&posting.shares);
            let surface: i64 = corners()
                .map(|(&corner, &share)| block.heights[corner as usize] * i64::from(share))
                .sum();
            let left = posting.height - (surface >> 16);
            let left = left.signum() * (left.abs() - slack).max(0);
            for (&corner, &share) in corners() {
                moves[corner as usize] += left * i64::from(share);
            }
        }
        for ((height, &sum), &shares) in block.heights.iter_mut().zip(&moves).zip(&shares) {
            *height += sum / (shares + HELD) * 3 / 2;
        }
    }
}

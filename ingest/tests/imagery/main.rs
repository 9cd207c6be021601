//! What the ingest makes of pictures: archives of imagery held against what was drawn.
//!
//! In:    small pictures written here.
//! Out:   pass or fail.
//! Keeps: temporary folders while a test runs.
//! Not here: heights (`../archives`), several archives over each other (the scene).
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "test pictures are small and made of numbers chosen here"
)]

mod faults;
mod globe;
mod pictures;
mod places;

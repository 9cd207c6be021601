//! Budgets of frames: what a run counted and took, and whether that may be.
//!
//! | module | what it holds |
//! |---|---|
//! | [`record`] | everything that a run counted and took, frame by frame |
//! | [`statistic`] | one number of a column, and its worst frame |
//! | [`judge`](mod@judge) | a run against the lines of a budget and against a baseline |
//! | [`change`] | in which frames two columns differ, and by how much |
//! | [`diff`](mod@diff) | what differs between two runs: speed, work or result |
//! | [`pairs`], [`interval`] | two programs in pairs of runs: slower, the same, faster, or not known |
//! | [`init`] | a budget out of a run |
//!
//! In:    runs, budgets.
//! Out:   verdicts, sentences.
//! Keeps: nothing.
//! Not here: flying and the clock (the host), files and reports (the host).
//! Source: the statistics of paired benchmarks as the design notes give them.

pub mod change;
pub mod diff;
pub mod init;
pub mod interval;
pub mod judge;
pub mod pairs;
pub mod record;
pub mod statistic;

pub use change::Change;
pub use diff::{Difference, diff};
pub use interval::{Interval, Relation};
pub use judge::{Outcome, Status, Verdict, judge, outcome};
pub use overfly_config::{BudgetLine, BudgetNames, BudgetSettings, Severity, Statistic};
pub use pairs::{Comparison, PairCells, PairRule};
pub use record::{ColdStart, Facts, Odd, RunRecord, Sampled};
pub use statistic::{Taken, take};

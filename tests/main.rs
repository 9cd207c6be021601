//! One binary of contracts between crates, and of rules that a machine can check.
//!
//! In:    the workspace.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: private invariants (beside the code).

mod architecture;
mod contracts {
    mod command_line;
    mod flights;
    mod pictures;
    mod recordings;
}

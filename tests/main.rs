//! One binary of contracts between crates, and of rules that a machine can check.
//!
//! In:    the workspace.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: private invariants (beside the code).

mod architecture;
mod contracts {
    mod archives;
    mod budgets;
    mod columns;
    mod command_line;
    mod cracks;
    mod depths;
    mod drawn;
    mod embedding;
    mod examples;
    mod extremes;
    mod flights;
    mod grounds;
    mod hills;
    mod hosting;
    mod importing;
    mod measuring;
    mod parked;
    mod pictures;
    mod probing;
    mod rainier_agl;
    mod recordings;
    #[allow(dead_code, reason = "the archive's own tests let it misbehave in more ways")]
    #[path = "../../archive/tests/contracts/server.rs"]
    mod server;
    mod serving;
    mod sparing;
    mod trading;
    mod validation;
    mod window;
}

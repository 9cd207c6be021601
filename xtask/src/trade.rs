//! `cargo xtask trade`: what settings cost over the three flights, written into `docs/trade.md`.
//!
//! In:    the release build of `overfly`, the document.
//! Out:   `out/trade/FLIGHT`, the document with new results below its mark.
//! Keeps: finished points in `out/trade`, so that a stopped command goes on.
//! Not here: the trade itself (`overfly trade`).

use crate::steps::{Step, Stopped, run};
use std::path::Path;

const FLIGHTS: [&str; 3] = ["rainier", "descent", "poles"];
const DOCUMENT: &str = "docs/trade.md";
/// Everything below is made anew.
const MARK: &str = "<!-- Made by `cargo xtask trade`; do not edit below. -->\n";

/// Flies the trades, then writes the document.
pub fn trade(root: &Path, cargo: &str, overfly: &str) -> Result<(), Stopped> {
    let build = Step::new("build", "the release build of overfly", cargo);
    run(root, &build.with(&["build", "--release", "--locked"]))?;
    let mut results = String::new();
    for flight in FLIGHTS {
        let out = format!("out/trade/{flight}");
        let step = Step::new(flight, "what settings cost over this flight", overfly);
        run(root, &step.with(&["trade", flight, "--out", &out]))?;
        results.push('\n');
        results.push_str(&read(&root.join(&out).join("trade.md"))?);
    }
    let document = root.join(DOCUMENT);
    let text = with_results(&read(&document)?, &results)
        .ok_or_else(|| stopped(format!("{DOCUMENT} has lost its line {MARK}")))?;
    std::fs::write(&document, text).map_err(|error| stopped(format!("{DOCUMENT}: {error}")))?;
    println!("\nThe results are in {DOCUMENT}; plots are in out/trade/FLIGHT/trade.html.");
    Ok(())
}

/// The document with other results below its mark; `None` where it has none.
fn with_results(document: &str, results: &str) -> Option<String> {
    let (kept, _) = document.split_once(MARK)?;
    Some(format!("{kept}{MARK}{results}"))
}

fn read(path: &Path) -> Result<String, Stopped> {
    std::fs::read_to_string(path).map_err(|error| stopped(format!("{}: {error}", path.display())))
}

fn stopped(why: String) -> Stopped {
    Stopped { step: "document".into(), what: format!("failed: {why}"), code: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_replace_what_is_below_the_mark_and_nothing_else() {
        let document = format!("# Title\n\n{MARK}\nold\n");
        let new = with_results(&document, "\nnew\n").unwrap();
        assert_eq!(new, format!("# Title\n\n{MARK}\nnew\n"));
        assert_eq!(with_results("no mark", "x"), None);
    }
}

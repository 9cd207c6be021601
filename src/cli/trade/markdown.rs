//! A trade as a piece of a document.
//!
//! In:    entries, laws, the plan.
//! Out:   Markdown: how it was flown, laws, a table of all points.
//! Keeps: nothing.
//! Not here: the page with plots (`html`), the document around it (`docs/trade.md`).

use super::entry::Entry;
use super::laws::Law;
use super::plan::Plan;
use super::tables::{decides, fronts, pixels};
use std::fmt::Write;

const HEAD: &str = "\
| point | E1 p99.9 px | E1 rms px | bound px | decides | triangles | CPU p50 ms | CPU p99 ms | \
uploaded MB |\n|---|---:|---:|---:|---|---:|---:|---:|---:|\n";

/// The piece, headed by the flight's name.
pub fn text(plan: &Plan, entries: &[Entry], laws: &[Law]) -> String {
    let w = &plan.ways;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut out = format!(
        "## {}\n\nOver {}, {} clips of {} frames between frames {} and {} at {} Hz, {}×{} pixels, \
         {} rays a measured frame, {} timing passes, {cores} cores.\n\n",
        w.flight,
        w.scene,
        plan.clips.len(),
        plan.clips.first().map_or(0, ExactSizeIterator::len),
        w.frames.start,
        w.frames.end,
        plan.rate_hz,
        w.size_px[0],
        w.size_px[1],
        w.rays,
        w.repeats,
    );
    for law in laws {
        put(&mut out, &format!("* {}\n", law.sentence()));
    }
    put(&mut out, "\n");
    put(&mut out, HEAD);
    let [by_triangles, by_cpu] = fronts(entries);
    for (at, entry) in entries.iter().enumerate() {
        let y = &entry.found;
        let mark = if by_triangles[at] || by_cpu[at] { "**" } else { "" };
        let row = format!(
            "| {mark}{}{mark} | {:.3} | {:.3} | {} | {} | {:.0} | {:.3} | {:.3} | {:.2} |\n",
            entry.name.replace('|', "/"),
            y.error_px,
            y.rms_px,
            pixels(y.bound_px),
            decides(y),
            y.triangles,
            y.cpu_ms[0],
            y.cpu_ms[1],
            entry.uploaded_bytes / 1e6,
        );
        put(&mut out, &row);
    }
    out
}

fn put(out: &mut String, text: &str) {
    out.write_str(text).expect("a text grows");
}

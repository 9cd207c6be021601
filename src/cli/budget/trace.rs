//! A run as a Chrome trace, which Perfetto opens: a track a worker, counters beneath.
//!
//! In:    spans of some frames, the record.
//! Out:   one JSON object of trace events.
//! Keeps: nothing.
//! Not here: spans (`overfly::jobs`), which file (`reports`).

use super::fly::Flew;
use overfly::replay::budget::record::FRAME;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The first frames are always there.
const FIRST: usize = 60;
/// So many of the longest are there, too,
const LONGEST: usize = 10;
/// with so many frames before and after each.
const AROUND: usize = 10;
/// Counters that are worth a track.
const COUNTED: [&str; 5] = ["triangles", "splits", "pages", "wanted", "queue_depth"];

/// Whether each frame of the columns is in the trace.
fn chosen(frame_ms: &[f64]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..frame_ms.len()).collect();
    let longer_first = |&a: &usize, &b: &usize| frame_ms[b].total_cmp(&frame_ms[a]).then(a.cmp(&b));
    if order.len() > LONGEST {
        order.select_nth_unstable_by(LONGEST, longer_first);
        order.truncate(LONGEST);
    }
    let longest = &order;
    let near = |frame: usize| longest.iter().any(|&long| long.abs_diff(frame) <= AROUND);
    (0..frame_ms.len()).map(|frame| frame < FIRST || near(frame)).collect()
}

/// Throws away spans that no trace of this run will show, whatever comes: those of frames that are
/// not chosen so far and around which no longer one can still come.
pub fn thin(flew: &mut Flew) {
    let frame_ms = flew.record.times_ms(FRAME).pop().unwrap_or_default();
    let (chosen, frames) = (chosen(&frame_ms), frame_ms.len());
    flew.spans.retain(|span| span.frame + AROUND >= frames || chosen[span.frame]);
}

/// Microseconds, as traces count.
fn us(ns: u64) -> f64 {
    ns as f64 / 1e3
}

/// The trace. Spans of a track never overlap but one within the other.
pub fn text(flew: &Flew) -> String {
    let record = &flew.record;
    let frame_ms = record.times_ms(FRAME).pop().unwrap_or_default();
    let chosen = chosen(&frame_ms);
    let spans: Vec<_> =
        flew.spans.iter().filter(|span| chosen.get(span.frame) == Some(&true)).collect();
    let start_ns = spans.iter().map(|span| span.begin_ns).min().unwrap_or(0);
    let mut events = vec![name("process_name", 0, &record.facts.flight)];
    let mut workers: Vec<u16> = spans.iter().map(|span| span.worker).collect();
    workers.sort_unstable();
    workers.dedup();
    events.push(name("thread_name", 0, "frames"));
    for &worker in &workers {
        let words = if worker == 0 { "caller".to_owned() } else { format!("worker {worker}") };
        events.push(name("thread_name", u32::from(worker) + 1, &words));
    }
    let mut frames: BTreeMap<usize, [u64; 2]> = BTreeMap::new();
    for span in &spans {
        let [begin, end] = frames.entry(span.frame).or_insert([u64::MAX, 0]);
        (*begin, *end) = ((*begin).min(span.begin_ns), (*end).max(span.end_ns));
        events.push(json!({
            "name": span.name, "cat": "stage", "ph": "X", "pid": 1,
            "tid": u32::from(span.worker) + 1,
            "ts": us(span.begin_ns - start_ns), "dur": us(span.end_ns - span.begin_ns),
            "args": {"frame": record.facts.first_frame as usize + span.frame},
        }));
    }
    for (&frame, [begin_ns, end_ns]) in &frames {
        let at = us(begin_ns - start_ns);
        events.push(json!({
            "name": "frame", "cat": "frame", "ph": "X", "pid": 1, "tid": 0,
            "ts": at, "dur": us(end_ns - begin_ns),
            "args": {"place": record.place(frame)},
        }));
        for counter in COUNTED {
            let column = record.counters.get(counter);
            let Some(value) = column.and_then(|column| column.get(frame)) else { continue };
            events.push(json!({
                "name": counter, "ph": "C", "pid": 1, "tid": 0, "ts": at, "args": {counter: value},
            }));
        }
    }
    let shown = format!(
        "the first {FIRST} frames, and the {LONGEST} longest with {AROUND} frames around each"
    );
    json!({
        "traceEvents": events,
        "displayTimeUnit": "ms",
        "otherData": {"program": record.facts.program, "frames": shown},
    })
    .to_string()
}

/// An event that names a process or a track.
fn name(what: &str, tid: u32, words: &str) -> Value {
    json!({"name": what, "ph": "M", "pid": 1, "tid": tid, "args": {"name": words}})
}

#[cfg(test)]
mod tests {
    use super::super::fly::Traced;
    use super::*;
    use overfly::replay::budget::{Facts, RunRecord};

    #[test]
    fn thinning_on_the_way_leaves_the_spans_of_all_frames_that_are_chosen_in_the_end() {
        // Each seventh frame is longer than those before it, so that the longest change all the time.
        let ns = |frame: u64| 1_000_000 + frame * (frame % 7) * 100;
        let mut record = RunRecord::new(Facts::default());
        record.times_ns.push(BTreeMap::from([(FRAME.to_owned(), Vec::new())]));
        let mut flew = Flew { record, spans: Vec::new() };
        for frame in 0..1000 {
            let begin_ns = frame as u64 * 10_000_000;
            let span = Traced { frame, name: "camera", worker: 0, begin_ns, end_ns: begin_ns + 1 };
            flew.record.times_ns[0].get_mut(FRAME).unwrap().push(ns(frame as u64));
            flew.spans.push(span);
            if frame % 13 == 0 {
                thin(&mut flew);
            }
        }
        let frame_ms = flew.record.times_ms(FRAME).pop().unwrap();
        let kept: Vec<usize> = flew.spans.iter().map(|span| span.frame).collect();
        let chosen = chosen(&frame_ms);
        assert!((0..1000).filter(|&frame| chosen[frame]).all(|frame| kept.contains(&frame)));
        assert!(kept.len() < 250, "{} frames of 1000 are kept", kept.len());
    }

    #[test]
    fn the_first_and_the_longest_frames_are_chosen() {
        let mut frame_ms = vec![1.0; 1000];
        frame_ms[500] = 9.0;
        let chosen = chosen(&frame_ms);
        assert!(chosen[0] && chosen[59] && chosen[490] && chosen[510]);
        assert!(!chosen[300] && !chosen[489] && !chosen[511]);
    }
}

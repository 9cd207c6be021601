//! A trade as one page: plots, laws, a table of all points. No script, nothing loaded.
//!
//! In:    entries, laws, the plan.
//! Out:   HTML.
//! Keeps: nothing.
//! Not here: the plots themselves (`plot`).

use super::entry::Entry;
use super::laws::Law;
use super::plan::Plan;
use super::plot::{Dot, Plot, escaped, svg};
use super::tables::{decides, fronts, pixels};
use overfly::replay::trade::{Point, Yield};
use std::fmt::Write;

/// Styles of points: the scene itself, each knob, several knobs at once.
const GROUPS: [&str; 12] = [
    "the scene as it is",
    "tolerance_px",
    "triangles_max",
    "patch_depth",
    "splits_max",
    "vertices",
    "depth_ranges",
    "morph_s",
    "pages_mib",
    "loader_delay_ms",
    "workers",
    "several knobs",
];
const COLOURS: [&str; 12] = [
    "#d1242f", "#0969da", "#1a7f37", "#bf8700", "#8250df", "#57606a", "#9a6700", "#bf3989",
    "#0a7ea4", "#bc4c00", "#6e7781", "#24292f",
];
const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;\
color:#1f2328;background:#fff}\
h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em}\
svg{width:100%;max-width:820px;height:auto;display:block;margin:1em 0}\
svg text{font:12px system-ui,sans-serif;fill:#1f2328}svg text.title{font-weight:600;font-size:14px}\
svg text.x{text-anchor:middle}svg text.y{text-anchor:end}\
.grid{stroke:#d8dee4;stroke-width:1;fill:none}.front{fill:none;stroke:#1f2328;stroke-width:1.5}\
.law{fill:none;stroke:#d1242f;stroke-width:1.5;stroke-dasharray:6 4}\
.ring{fill:none;stroke:#1f2328;stroke-width:1.5}\
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px}\
th,td{padding:.25em .6em;border-bottom:1px solid #d8dee4;text-align:right;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}tr.front td:first-child{font-weight:600}\
.key span{display:inline-block;margin-right:1em}.key i{display:inline-block;width:.8em;height:.8em;\
border-radius:50%;margin-right:.3em}code{background:#f6f8fa;padding:.1em .3em}";

/// The page.
pub fn page((plan, base): (&Plan, &Point), entries: &[Entry], laws: &[Law]) -> String {
    let title = format!("What settings cost: {}", plan.ways.flight);
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{0}</title>\n\
         <style>{STYLE}{1}</style></head><body>\n<h1>{0}</h1>\n",
        escaped(&title),
        colours()
    );
    introduction(&mut out, plan, entries.len());
    plots(&mut out, base, entries, laws);
    put(&mut out, "<h2>Laws</h2>\n<ul>\n");
    for law in laws {
        put(&mut out, &format!("<li>{}</li>\n", escaped(&law.sentence())));
    }
    put(&mut out, "</ul>\n");
    all_points(&mut out, entries);
    details(&mut out, entries);
    not_measured(&mut out, entries);
    put(&mut out, "</body></html>\n");
    out
}

fn colours() -> String {
    let dot = |(i, colour): (usize, &&str)| format!(".g{i}{{fill:{colour};background:{colour}}}");
    COLOURS.iter().enumerate().map(dot).collect()
}

fn introduction(out: &mut String, plan: &Plan, points: usize) {
    let w = &plan.ways;
    let first = plan.clips.first().map_or(0, |clip| clip.end - 1);
    put(
        out,
        &format!(
            "<p><code>{}</code> over <code>{}</code>, frames {} to {} at {} Hz, pictures of {}×{} \
             pixels. {points} points; each was flown in {} clips of {} frames, before each of \
             which the terrain came up. The last frame of a clip was measured ({} rays; the first \
             is frame {first}); times are of {} passes of their own, points in shuffled \
             order.</p>\n\
             <p>Error is E1, the radial pixel error: of p99.9, the worst measured frame's; of rms, \
             that of all. Triangles are those of the mesh, the mean of all flown frames. CPU time \
             is that of a frame from its first stage to the last, without drawing; each figure is \
             the median of what the passes had.</p>\n",
            escaped(&w.flight),
            escaped(&w.scene),
            w.frames.start,
            w.frames.end,
            plan.rate_hz,
            w.size_px[0],
            w.size_px[1],
            plan.clips.len(),
            plan.clips.first().map_or(0, ExactSizeIterator::len),
            w.rays,
            w.repeats,
        ),
    );
}

fn plots(out: &mut String, base: &Point, entries: &[Entry], laws: &[Law]) {
    put(
        out,
        "<h2>Error against cost</h2>\n<p>Rings and the line through them: the Pareto front, \
              which no other point beats in both. Dashed: the fitted law. Rest the mouse on a \
              point to see what it is.</p>\n<p class=\"key\">",
    );
    let groups: Vec<usize> = entries.iter().map(|entry| group(base, &entry.point)).collect();
    for (i, name) in GROUPS.iter().enumerate().filter(|(i, _)| groups.contains(i)) {
        put(out, &format!("<span><i class=\"g{i}\"></i>{name}</span>"));
    }
    put(out, "</p>\n");
    let [by_triangles, by_cpu] = fronts(entries);
    let law = laws.iter().find(|law| law.is_own_error).and_then(|law| law.found);
    let dots = |x: fn(&Yield) -> f64, y: fn(&Yield) -> f64, on_front: &[bool]| -> Vec<Dot> {
        let dot = |(at, entry): (usize, &Entry)| Dot {
            at: [x(&entry.found), y(&entry.found)],
            group: groups[at],
            label: label(entry),
            on_front: on_front[at],
        };
        entries.iter().enumerate().map(dot).collect()
    };
    let none = vec![false; entries.len()];
    for (title, axes, dots, law) in [
        (
            "E1 p99.9 against triangles",
            ["triangles", "E1 p99.9, pixels"],
            dots(|y| y.triangles, |y| y.error_px, &by_triangles),
            None,
        ),
        (
            "E1 p99.9 against CPU time",
            ["median CPU time of a frame, ms", "E1 p99.9, pixels"],
            dots(|y| y.cpu_ms[0], |y| y.error_px, &by_cpu),
            None,
        ),
        (
            "E1 rms against triangles, with the law",
            ["triangles", "E1 rms, pixels"],
            dots(|y| y.triangles, |y| y.rms_px, &none),
            law,
        ),
    ] {
        put(out, &svg(&Plot { title, axes, dots, law }));
    }
}

fn group(base: &Point, point: &Point) -> usize {
    match point.turned_from(base)[..] {
        [] => 0,
        [(name, _)] => GROUPS.iter().position(|group| *group == name).unwrap_or(GROUPS.len() - 1),
        _ => GROUPS.len() - 1,
    }
}

fn label(entry: &Entry) -> String {
    let y = &entry.found;
    let [p50, p99] = y.cpu_ms;
    format!(
        "{}: E1 p99.9 {:.3} px, rms {:.3} px, bound {} px, {:.0} triangles, CPU {p50:.3} ms, p99 \
         {p99:.3} ms",
        entry.name,
        y.error_px,
        y.rms_px,
        pixels(y.bound_px),
        y.triangles
    )
}

fn all_points(out: &mut String, entries: &[Entry]) {
    put(
        out,
        "<h2>All points</h2>\n<p>Bold: on a Pareto front. <i>Decides</i>: what keeps the mesh \
              from being finer in every measured frame.</p>\n<div class=\"wide\"><table>\n<tr>\
              <th>point</th><th>E1 p99.9 px</th><th>E1 rms px</th><th>bound px</th><th>decides</th>\
              <th>triangles</th><th>CPU p50 ms</th><th>CPU p99 ms</th><th>evaluations p99</th>\
              <th>uploaded MB</th><th>EyeF64 MB a frame</th></tr>\n",
    );
    let [by_triangles, by_cpu] = fronts(entries);
    for (at, entry) in entries.iter().enumerate() {
        let y = &entry.found;
        let evaluations = entry.counts.iter().find(|(name, _)| name == "evaluations");
        let decides = decides(y);
        let class = if by_triangles[at] || by_cpu[at] { " class=\"front\"" } else { "" };
        put(
            out,
            &format!(
                "<tr{class}><td>{}</td><td>{:.3}</td><td>{:.3}</td><td>{}</td><td>{decides}</td>\
                 <td>{:.0}</td><td>{:.3}</td><td>{:.3}</td><td>{:.0}</td><td>{:.2}</td>\
                 <td>{:.2}</td></tr>\n",
                escaped(&entry.name),
                y.error_px,
                y.rms_px,
                pixels(y.bound_px),
                y.triangles,
                y.cpu_ms[0],
                y.cpu_ms[1],
                evaluations.map_or(f64::NAN, |(_, [_, p99])| *p99),
                entry.uploaded_bytes / 1e6,
                entry.eye_bytes / 1e6,
            ),
        );
    }
    put(out, "</table></div>\n");
}

/// Whole vectors, folded away: a row a metric, a column a point.
fn details(out: &mut String, entries: &[Entry]) {
    put(out, "<h2>Everything</h2>\n");
    table(out, "The metric vector", entries, |entry| {
        entry.metrics.iter().map(|(name, value)| (name.clone(), plain(*value))).collect()
    });
    table(out, "Milliseconds of each stage, median and p99", entries, |entry| {
        let cell = |[p50, p99]: [f64; 2]| format!("{p50:.3} / {p99:.3}");
        entry.stages_ms.iter().map(|(name, times)| (name.clone(), cell(*times))).collect()
    });
    table(out, "Counts, sum over all frames and p99", entries, |entry| {
        let cell = |[sum, p99]: [f64; 2]| format!("{} / {}", plain(sum), plain(p99));
        entry.counts.iter().map(|(name, counts)| (name.clone(), cell(*counts))).collect()
    });
}

fn plain(value: f64) -> String {
    match value {
        x if x.is_nan() => "–".into(),
        0.0 => "0".into(),
        x if !(1e-3..1e7).contains(&x.abs()) => format!("{x:.2e}"),
        x if x == x.round() => format!("{x:.0}"),
        x => format!("{x:.4}"),
    }
}

fn table(
    out: &mut String,
    title: &str,
    entries: &[Entry],
    rows: impl Fn(&Entry) -> Vec<(String, String)>,
) {
    put(
        out,
        &format!("<details><summary>{title}</summary><div class=\"wide\"><table>\n<tr><th></th>"),
    );
    for entry in entries {
        put(out, &format!("<th>{}</th>", escaped(&entry.name)));
    }
    put(out, "</tr>\n");
    let columns: Vec<Vec<(String, String)>> = entries.iter().map(rows).collect();
    for (row, (name, _)) in columns.first().map_or(&[][..], Vec::as_slice).iter().enumerate() {
        put(out, &format!("<tr><td>{}</td>", escaped(name)));
        for column in &columns {
            let cell = column.get(row).map_or("", |(_, cell)| cell);
            put(out, &format!("<td>{}</td>", escaped(cell)));
        }
        put(out, "</tr>\n");
    }
    put(out, "</table></div></details>\n");
}

/// What a trade without a graphics card cannot tell.
fn not_measured(out: &mut String, entries: &[Entry]) {
    put(
        out,
        "<h2>What is not measured here</h2>\n<p>Nothing was drawn. <code>vertices</code> and \
         <code>depth_ranges</code> change what a graphics card does with the same mesh: of them \
         this trade has the arithmetic metrics of the vector, computed in the card's number \
         formats, and for <code>EyeF64</code> the bytes that the processor would write in each \
         frame; not the time of writing them, nor of drawing, nor the memory of the card. More \
         depth ranges draw some patches twice: <code>drawn</code> counts that. Bytes uploaded are \
         patches built times the bytes of their vertices.</p>\n",
    );
    let same = entries.first().map_or(0, |first| {
        entries[1..].iter().filter(|entry| entry.digest == first.digest).count()
    });
    let word = if same == 1 { "point has" } else { "points have" };
    put(
        out,
        &format!(
            "<p>{same} {word} the very frames of the scene as it is (the same digests): their \
             errors are equal, and what differs in their times is noise or the knob.</p>\n"
        ),
    );
}

fn put(out: &mut String, text: &str) {
    out.write_str(text).expect("a text grows");
}

//! A run as one page: verdicts, frame times over the terrain, stages, worst frames, the map. No
//! script, nothing loaded.
//!
//! In:    verdicts, a record, comparisons.
//! Out:   HTML.
//! Keeps: nothing.
//! Not here: the charts themselves (`chart`).

use super::chart::{Along, band, events, histogram, map, profile, stack};
use super::reports::{Report, word};
use super::stills::Still;
use crate::cli::trade::plot::escaped;
use base64::prelude::{BASE64_STANDARD, Engine};
use overfly::replay::budget::change::number;
use overfly::replay::budget::record::{FRAME, times};
use overfly::replay::budget::{RunRecord, Status, Verdict};
use std::fmt::Write;

/// Rows of the table of worst frames.
const WORST: usize = 12;
/// Worst frames that are less than this many frames apart are one.
const APART: usize = 15;
const COLOURS: [&str; 8] =
    ["#0969da", "#1a7f37", "#bf8700", "#d1242f", "#8250df", "#0a7ea4", "#bf3989", "#57606a"];
const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;\
color:#1f2328;background:#fff}h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em}\
svg{width:100%;height:auto;display:block;margin:.6em 0}\
svg text{font:12px system-ui,sans-serif;fill:#1f2328}svg text.title{font-weight:600;font-size:13px}\
svg text.x{text-anchor:middle}svg text.y{text-anchor:end}\
.grid{stroke:#d8dee4;stroke-width:1;fill:none}.band{stroke:#0969da;stroke-width:1.2;fill:none}\
.tops{stroke:#0969da;stroke-width:1;fill:none;opacity:.45}.limit{stroke:#d1242f;stroke-width:1.5;stroke-dasharray:6 4}.ground{fill:#b7a98c}\
.eye{stroke:#1f2328;stroke-width:1.5;fill:none}.event{fill:#8250df}.bar{fill:#0969da}\
.worst{fill:#d1242f}.wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px}\
th,td{padding:.25em .6em;border-bottom:1px solid #d8dee4;text-align:right;vertical-align:top}\
th.l,td.l{text-align:left}td.w{text-align:left;white-space:nowrap}.FAIL{color:#d1242f;font-weight:600}.inconclusive{color:#9a6700;\
font-weight:600}.warn{color:#9a6700}.pass{color:#1a7f37}.skipped{color:#57606a}\
.key span{margin-right:1em}.key i{display:inline-block;width:.8em;height:.8em;margin-right:.3em}\
\
.stills{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:.8em;\
margin-top:1em}figure{margin:0}figure img{width:100%;display:block}\
figcaption{font-size:12px;color:#57606a}code{background:#f6f8fa;padding:.1em .3em}";

/// The page.
pub fn page(report: &Report) -> String {
    let title = format!("Budget of {}: {}", report.flight, word(report.outcome));
    let colour =
        |(i, colour): (usize, &&str)| format!(".s{i}{{fill:{colour};background:{colour}}}");
    let colours: String = COLOURS.iter().enumerate().map(colour).collect();
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{0}</title>\n\
         <style>{STYLE}{colours}</style></head><body>\n<h1>{0}</h1>\n",
        escaped(&title)
    );
    for note in report.notes {
        put(&mut out, format_args!("<p>{}</p>\n", escaped(note)));
    }
    if let Some(versus) = report.versus {
        put(&mut out, format_args!("{}", versus.html()));
    }
    verdicts(&mut out, report.verdicts);
    if let Some(flew) = report.flew.filter(|flew| flew.record.frames() > 0) {
        charts(&mut out, report, &flew.record);
        facts(&mut out, &flew.record);
    }
    out.push_str("</body></html>\n");
    out
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.write_fmt(text).expect("a text grows");
}

fn verdicts(out: &mut String, verdicts: &[Verdict]) {
    if verdicts.is_empty() {
        return;
    }
    let mut ordered: Vec<&Verdict> = verdicts.iter().collect();
    ordered.sort_by_key(|verdict| std::cmp::Reverse(verdict.status));
    let loud = ordered.iter().filter(|verdict| verdict.status > Status::Skipped).count();
    let (first, rest) = ordered.split_at(loud);
    put(out, format_args!("<h2>Lines</h2>\n"));
    if loud > 0 {
        table(out, first);
    }
    let count = rest.len();
    put(out, format_args!("<details><summary>{count} lines hold or were skipped</summary>\n"));
    table(out, rest);
    put(out, format_args!("</details>\n"));
}

fn table(out: &mut String, verdicts: &[&Verdict]) {
    put(
        out,
        format_args!(
            "<div class=\"wide\"><table><tr><th class=\"l\"></th><th class=\"l\">of</th>\
             <th class=\"l\">statistic</th><th>value</th><th>limit</th><th class=\"l\">what</th>\
             </tr>\n"
        ),
    );
    for verdict in verdicts {
        let values: Vec<String> = verdict.values.iter().map(|&value| number(value)).collect();
        let word = verdict.status.word();
        put(
            out,
            format_args!(
                "<tr><td class=\"l {word}\">{word}</td><td class=\"l\">{}</td><td class=\"l\">{}\
                 </td><td>{}</td><td>{}</td><td class=\"l\">{}</td></tr>\n",
                escaped(&verdict.of),
                escaped(&verdict.statistic),
                values.join("<br>"),
                number(verdict.limit),
                escaped(&verdict.sentence)
            ),
        );
    }
    put(out, format_args!("</table></div>\n"));
}

fn charts(out: &mut String, report: &Report, record: &RunRecord) {
    let along = Along {
        frames: record.frames(),
        first_s: record.time_s.first().copied().unwrap_or(0.0),
        last_s: record.time_s.last().copied().unwrap_or(0.0),
    };
    put(
        out,
        format_args!("<h2>Along the flight</h2>\n<p>Seconds of the flight to the right.</p>\n"),
    );
    let frame_ms = worst_of_runs(record);
    let triangles = column(record, "triangles");
    if !frame_ms.is_empty() {
        let title = "frame times, milliseconds: the slowest run of each frame, least to most";
        out.push_str(&band(title, along, &frame_ms, report.limits_ms));
    }
    if let Some(heights) = record.ground.columns.get("height_m") {
        let frames = record.ground.frames.iter().copied();
        let ground: Vec<(u32, f64)> = frames.zip(heights.iter().copied()).collect();
        out.push_str(&profile(along, &ground, &record.height_m));
    }
    let names =
        ["admitted", "evicted", "wanted", "blocked", "splits", "merges", "built", "allocations"];
    let rows: Vec<(&str, &[f64])> = names.map(|name| (name, column(record, name))).into();
    out.push_str(&events(along, &rows));
    out.push_str(&band("triangles", along, triangles, &[]));
    out.push_str(&band("bound on the error, pixels", along, column(record, "error_px_bound"), &[]));
    let stages: Vec<(String, Vec<f64>)> = times()
        .into_iter()
        .filter(|name| *name != FRAME)
        .filter_map(|name| Some((name.to_owned(), record.times_ms(name).into_iter().next()?)))
        .collect();
    let by = if frame_ms.is_empty() { triangles } else { &frame_ms };
    let worst = worst_frames(by);
    if !frame_ms.is_empty() {
        put(out, format_args!("<h2>Stages</h2>\n<p class=\"key\">"));
        for (i, (name, _)) in stages.iter().enumerate() {
            put(out, format_args!("<span><i class=\"s{i}\"></i>{}</span>", escaped(name)));
        }
        put(out, format_args!("</p>\n"));
        out.push_str(&stack(along, &stages));
        put(out, format_args!("<h2>Frame times</h2>\n"));
        out.push_str(&histogram(&frame_ms));
    }
    worst_table(out, record, (&worst, by), &stages);
    stills(out, record, report.stills);
    put(out, format_args!("<h2>Map</h2>\n"));
    let label = |frame: usize| (frame, record.place(frame));
    let marked: Vec<_> = worst.iter().map(|&frame| label(frame)).collect();
    out.push_str(&map(&record.lat_deg, &record.lon_deg, &marked));
}

fn column<'r>(record: &'r RunRecord, name: &str) -> &'r [f64] {
    record.counters.get(name).map_or(&[], Vec::as_slice)
}

/// Each frame's time in the run in which it was slowest.
fn worst_of_runs(record: &RunRecord) -> Vec<f64> {
    let runs = record.times_ms(FRAME);
    let of = |frame: usize| runs.iter().map(|run| run[frame]).fold(0.0, f64::max);
    (0..runs.first().map_or(0, Vec::len)).map(of).collect()
}

/// The worst frames of a run: the slowest, or where nothing was timed those of most triangles.
pub fn worst(record: &RunRecord) -> Vec<usize> {
    let frame_ms = worst_of_runs(record);
    worst_frames(if frame_ms.is_empty() { column(record, "triangles") } else { &frame_ms })
}

/// The largest frames, but for neighbours of larger ones.
fn worst_frames(column: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..column.len()).collect();
    order.sort_by(|&a, &b| column[b].total_cmp(&column[a]).then(a.cmp(&b)));
    let mut worst: Vec<usize> = Vec::new();
    for frame in order {
        if worst.len() == WORST {
            break;
        }
        if worst.iter().all(|&known| known.abs_diff(frame) >= APART) {
            worst.push(frame);
        }
    }
    worst
}

fn worst_table(
    out: &mut String,
    record: &RunRecord,
    (worst, by): (&[usize], &[f64]),
    stages: &[(String, Vec<f64>)],
) {
    let counted = [
        "triangles",
        "evaluations",
        "splits",
        "merges",
        "built",
        "admitted",
        "evicted",
        "allocations",
    ];
    let timed = !stages.is_empty();
    let what = if timed { "longest" } else { "with the most triangles" };
    put(
        out,
        format_args!(
            "<h2>Worst frames</h2>\n<p>Those {what}; of neighbours one. Stages are those of the \
             first run.</p>\n<div class=\"wide\"><table><tr><th class=\"l\">where</th>{}",
            if timed { "<th>ms</th>" } else { "" }
        ),
    );
    let names = stages.iter().map(|(name, _)| name.as_str()).chain(counted);
    names.for_each(|name| put(out, format_args!("<th>{}</th>", escaped(name))));
    put(out, format_args!("</tr>\n"));
    for &frame in worst {
        put(out, format_args!("<tr><td class=\"w\">{}</td>", escaped(&record.place(frame))));
        if timed {
            put(out, format_args!("<td>{}</td>", number(by[frame])));
        }
        for (_, column) in stages {
            put(out, format_args!("<td>{:.3}</td>", column[frame]));
        }
        for name in counted {
            let value = column(record, name).get(frame).copied().unwrap_or(0.0);
            put(out, format_args!("<td>{}</td>", number(value)));
        }
        put(out, format_args!("</tr>\n"));
    }
    put(out, format_args!("</table></div>\n"));
}

/// Pictures within the page.
fn stills(out: &mut String, record: &RunRecord, stills: &[Still]) {
    if stills.is_empty() {
        return;
    }
    put(out, format_args!("<div class=\"stills\">\n"));
    for still in stills {
        let place = escaped(&record.place(still.frame));
        put(
            out,
            format_args!(
                "<figure><img alt=\"{place}\" src=\"data:image/jpeg;base64,{}\">\
                 <figcaption>{place}</figcaption></figure>\n",
                BASE64_STANDARD.encode(&still.jpeg)
            ),
        );
    }
    put(out, format_args!("</div>\n"));
}

fn facts(out: &mut String, record: &RunRecord) {
    let f = &record.facts;
    // Where nothing was timed nothing is said of the machine either.
    let machine = if f.cores == 0 {
        String::new()
    } else {
        let (profile, platform) = (escaped(&f.profile), escaped(&f.platform));
        let (workers, cores, processor) = (f.workers, f.cores, escaped(&f.processor));
        format!(", {profile} build, {workers} workers, {cores} cores, {platform} {processor}")
    };
    put(
        out,
        format_args!(
            "<h2>The run</h2>\n<p>{}{machine}. Flight \
             <code>{}</code> over <code>{}</code> (settings {}), {} frames from {} at {} Hz, \
             pictures of {}×{} pixels.</p>\n<ul>\n",
            escaped(&f.program),
            escaped(&f.flight),
            escaped(&f.scene),
            escaped(&f.settings_digest),
            record.frames(),
            f.first_frame,
            f.rate_hz,
            f.size_px[0],
            f.size_px[1],
        ),
    );
    for (run, cold) in record.cold_starts.iter().enumerate() {
        let (total_ms, longest_ms) = (cold.total_ns as f64 / 1e6, cold.max_ns as f64 / 1e6);
        let took = if cold.total_ns == 0 {
            String::new()
        } else {
            format!(", {total_ms:.1} ms together, the longest {longest_ms:.3} ms")
        };
        put(
            out,
            format_args!(
                "<li>Run {}: the terrain came up in {} frames{took}; none of them is in any number \
                 above.</li>\n",
                run + 1,
                cold.frames
            ),
        );
    }
    put(out, format_args!("</ul>\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worst_frames_are_apart() {
        let mut column = vec![0.0; 100];
        column[50] = 9.0;
        column[51] = 8.0;
        column[80] = 7.0;
        let worst = worst_frames(&column);
        assert_eq!(worst[..2], [50, 80]);
        assert!(!worst.contains(&51) && worst.len() <= WORST);
    }
}

//! The table of a measured flight.
//!
//! In:    facts, errors.
//! Out:   text: spreads with where the worst was seen, then everything that is one number.
//! Keeps: nothing.
//! Not here: names and units (`overfly::replay::measure::report`).

use super::Facts;
use overfly::replay::measure::FlightErrors;
use std::fmt::Write;

/// One line on what is measured, before it begins.
pub fn head(facts: &Facts) -> String {
    let (frames, every) = (&facts.frames, facts.every);
    let lod = &facts.scene.lod;
    let measured = frames.len().div_ceil(every);
    let which = match every {
        1 => "each".to_owned(),
        every => format!("one in {every}"),
    };
    let [width, height] = facts.size_px;
    format!(
        "{} over {}, frames {}..{}: {which} measured, {measured} in all; {} rays over {width}x{height} \
         pixels; tolerance {} px, at most {} triangles",
        facts.flight,
        facts.scene_name,
        frames.start,
        frames.end,
        facts.settings.rays,
        lod.tolerance.0,
        lod.triangles_max,
    )
}

/// The table as text.
pub fn text(errors: &FlightErrors) -> String {
    let mut text = String::new();
    writeln!(
        text,
        "{:<32}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}  worst at",
        "metric", "rms", "p50", "p95", "p99", "p99.9", "max"
    )
    .expect("text grows");
    for row in errors.rows() {
        let s = row.spread;
        let name = format!("{} {}, {}", row.metric, row.what, row.unit);
        write!(text, "{name:<32}").expect("text grows");
        for value in [s.rms, s.p50, s.p95, s.p99, s.p999, s.max] {
            write!(text, "{:>10}", number(value)).expect("text grows");
        }
        if s.count > 0 {
            let [x, y] = s.at.pixel;
            let (lat, lon) = (s.at.lat_deg, s.at.lon_deg);
            write!(text, "  frame {}, {lat:.5}, {lon:.5}, pixel {x:.0}, {y:.0}", s.at.frame)
                .expect("text grows");
        }
        text.push('\n');
    }
    let shown = errors.vector();
    let value = |name: &str| shown.iter().find(|(known, _)| *known == name).map_or(0.0, |x| x.1);
    for line in LINES {
        for (at, (label, name)) in line.iter().enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            write!(text, "{comma}{label} {}", number(value(name))).expect("text grows");
        }
        text.push('\n');
    }
    text
}

/// What is one number, line by line: label and name in the metric vector.
const LINES: &[&[(&str, &str)]] = &[
    &[
        ("E5 max", "e5_max"),
        ("tightness", "tightness"),
        ("bound mean px", "bound_mean_px"),
        ("bound max px", "bound_max_px"),
    ],
    &[
        ("E3 ppm", "e3_ppm"),
        ("E4 columns with one outline only", "e4_lost_columns"),
        ("T1 stretched triangles", "t1_count"),
    ],
    &[
        ("P1 share above 0.5 px", "p1_share_above_half_px"),
        ("P1 p99.9 px/s", "p1_p999_px_per_s"),
        ("P2 median px", "p2_median_px"),
        ("cuts", "cuts_count"),
    ],
    &[
        ("cracks: C1 edges", "c1_edges"),
        ("C2 junctions", "c2_junctions"),
        ("C3 points", "c3_points"),
        ("C4 rays", "c4_rays"),
        ("C5 rays", "c5_rays"),
        ("rays without mesh", "lost_rays"),
    ],
    &[("H2 frame to frame, max m", "h2_step_max_m"), ("J1 step px", "j1_step_px")],
    &[
        ("Z1 scene", "z1_scene_share"),
        ("D32F", "z1_d32f_share"),
        ("D24 x3", "z1_d24x3_share"),
        ("Z2 ppm scene", "z2_scene_ppm"),
        ("D32F", "z2_d32f_ppm"),
        ("D24 x3", "z2_d24x3_ppm"),
    ],
    &[
        ("frames", "frames_count"),
        ("rays", "rays_count"),
        ("triangles mean", "triangles_mean"),
        ("in the picture", "triangles_seen_mean"),
        ("cross-checked rays", "cross_rays_count"),
        ("pages missing", "missing_pages_count"),
    ],
];

/// Four digits, or a dash where there is nothing.
fn number(value: f64) -> String {
    let size = value.abs();
    match value {
        value if value.is_nan() => "-".into(),
        value if value == value.trunc() && size < 1e9 => format!("{value:.0}"),
        value if (1e-3..1e5).contains(&size) => {
            let digits = if size < 1.0 {
                4
            } else if size < 100.0 {
                3
            } else {
                1
            };
            format!("{value:.digits$}")
        }
        value => format!("{value:.2e}"),
    }
}

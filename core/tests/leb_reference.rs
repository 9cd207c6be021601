//! The yardstick of the LEB workload gives the known meshes, and the rule's own at any frame.
//!
//! In:    the reference answers, flights, the rule written out.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: the engine on the same workload.

#[path = "../leb/mod.rs"]
mod leb;

use leb::answers::ANSWERS;
use leb::recursion::{Rule, Tally, count, digest, vertices};
use leb::stats::{PerFrame, Row, Summary, header};
use leb::workload::{Flight, Path, Preset, Speed};
use overfly_core::geodesy::frames::narrow;

const FLIGHTS: [Flight; 3] = [
    Flight { path: Path::Cruise, speed: Speed::V1 },
    Flight { path: Path::Cruise, speed: Speed::V10 },
    Flight { path: Path::Dive, speed: Speed::V10 },
];

fn rule(preset: Preset, flight: Flight, frame: u32) -> Rule {
    Rule::new(preset.threshold_squared(), flight.eye(frame))
}

/// Calls `leaf` with every leaf below a triangle, by the rule as the workload writes it.
fn plainly(
    rule: (f64, [f64; 3]),
    triangle: [[f64; 2]; 3],
    depth: u32,
    leaf: &mut impl FnMut([[f64; 2]; 3], u32),
) {
    let (threshold_squared, [eye_x, eye_y, h]) = rule;
    let [[x0, y0], apex, [x2, y2]] = triangle;
    let (ex, ey) = (x2 - x0, y2 - y0);
    let e2 = ex * ex + ey * ey;
    let (dx, dy) = (0.5 * (x0 + x2) - eye_x, 0.5 * (y0 + y2) - eye_y);
    let d2 = (dx * dx + dy * dy) + h * h;
    if e2 > threshold_squared * d2 {
        let middle = [(x0 + x2) / 2.0, (y0 + y2) / 2.0];
        plainly(rule, [[x0, y0], middle, apex], depth + 1, leaf);
        plainly(rule, [apex, middle, [x2, y2]], depth + 1, leaf);
    } else {
        leaf(triangle, depth);
    }
}

/// Every leaf of a frame, with its depth, by the rule as the workload writes it.
fn plain_leaves(preset: Preset, eye: [f64; 3]) -> Vec<([[f64; 2]; 3], u32)> {
    let mut leaves = Vec::new();
    for root in [[[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]] {
        let mut leaf = |triangle, depth| leaves.push((triangle, depth));
        plainly((preset.threshold_squared(), eye), root, 1, &mut leaf);
    }
    leaves
}

#[test]
fn every_known_answer_is_found() {
    for answer in ANSWERS {
        let (tally, sum) = digest(&rule(answer.preset, answer.flight, answer.frame));
        let known = Tally { leaves: answer.leaves, deepest: answer.deepest };
        assert_eq!((tally, sum), (known, answer.digest), "{answer:?}");
    }
}

#[test]
fn every_preset_starts_a_cruise_with_the_leaves_it_says() {
    for preset in Preset::ALL {
        let tally = count(&rule(preset, FLIGHTS[0], 0));
        assert_eq!((tally.leaves, tally.deepest), preset.cruise_start(), "{}", preset.name());
    }
}

#[test]
fn the_leaves_are_those_of_the_rule_as_written_at_frames_nobody_listed() {
    for (flight, frame) in FLIGHTS.into_iter().zip([977, 411, 137]) {
        let rule = rule(Preset::L200k, flight, frame);
        let plain = plain_leaves(Preset::L200k, flight.eye(frame));
        let deepest = plain.iter().map(|&(_, depth)| depth).max().unwrap();
        let tally = Tally { leaves: plain.len() as u64, deepest };
        assert_eq!(count(&rule), tally);
        assert_eq!(digest(&rule).0, tally);

        let mut written = vec![[[0.0; 3]; 3]; plain.len()];
        assert_eq!(vertices(&rule, &mut written), tally);
        assert_eq!(sorted(written), sorted(eye_relative(&plain, flight.eye(frame))));
    }
}

/// The vertices of leaves as seen from the eye.
fn eye_relative(leaves: &[([[f64; 2]; 3], u32)], eye: [f64; 3]) -> Vec<[[f32; 3]; 3]> {
    let vertex = |v: [f64; 2]| [v[0] - eye[0], v[1] - eye[1], -eye[2]].map(narrow);
    leaves.iter().map(|(triangle, _)| triangle.map(vertex)).collect()
}

/// The bits of all vertices, ordered: two meshes are one if these are.
fn sorted(leaves: Vec<[[f32; 3]; 3]>) -> Vec<[[u32; 3]; 3]> {
    let mut bits: Vec<_> = leaves.into_iter().map(|l| l.map(|v| v.map(f32::to_bits))).collect();
    bits.sort_unstable();
    bits
}

#[test]
fn the_eye_flies_as_the_workload_says() {
    for flight in FLIGHTS {
        let [x, y, h] = flight.eye(0);
        assert_eq!((x, y), (0.25, 0.375));
        assert_eq!(h, if flight.path == Path::Dive { 0.125 } else { 0.015625 });
    }
    let [x, y, h] = FLIGHTS[2].eye(600);
    assert_eq!(h, 0.015625);
    assert!((x - 0.45).abs() < 1e-15 && (y - 0.525).abs() < 1e-15, "{x} {y}");
    assert_eq!(FLIGHTS[2].eye(300)[2], 4.5 / 64.0);
    assert_eq!(FLIGHTS[2].eye(900), FLIGHTS[1].eye(900));
}

#[test]
fn words_name_presets_paths_and_speeds_or_are_answered_with_all_that_do() {
    for preset in Preset::ALL {
        assert_eq!(preset.name().parse(), Ok(preset));
    }
    assert_eq!("dive".parse(), Ok(Path::Dive));
    assert_eq!("v10".parse(), Ok(Speed::V10));
    let unknown = "2M".parse::<Preset>().unwrap_err().to_string();
    assert_eq!(unknown, "no preset is called \"2M\", allowed are 50k, 200k, 1M, 4M, 16M");
    let unknown = "climb".parse::<Path>().unwrap_err().to_string();
    assert_eq!(unknown, "no path is called \"climb\", allowed are cruise, dive");
    let unknown = "V1".parse::<Speed>().unwrap_err().to_string();
    assert_eq!(unknown, "no speed is called \"V1\", allowed are v1, v10");
}

#[test]
#[should_panic = "leaves are too deep"]
fn an_eye_on_the_ground_is_refused() {
    Rule::new(Preset::L50k.threshold_squared(), [0.5, 0.5, 0.0]);
}

#[test]
fn medians_and_percentiles_are_those_of_the_sorted_frames() {
    let mut times_ms: Vec<f64> = (1..=200).rev().map(f64::from).collect();
    assert_eq!(Summary::of(&mut times_ms), Summary { median_ms: 100.5, p99_ms: 198.0 });
    assert_eq!(Summary::of(&mut [3.0]), Summary { median_ms: 3.0, p99_ms: 3.0 });
    assert_eq!(Summary::of(&mut [9.0, 1.0, 2.0]), Summary { median_ms: 2.0, p99_ms: 9.0 });
}

#[test]
fn the_table_keeps_its_columns_from_the_smallest_to_the_largest_run() {
    let row = Row {
        preset: Preset::L16M,
        flight: FLIGHTS[1],
        leaves: 16_123_456,
        ours: Summary { median_ms: 5.0, p99_ms: 123.4567 },
        recursion: Summary { median_ms: 60.0, p99_ms: 99.0 },
        work: PerFrame { evaluations: 1_234_567.0, splits: 28_000.25, merges: 27_000.0 },
        bytes_per_leaf: 41.25,
        cold_start_ms: 2_345.0,
    };
    let line = row.to_string();
    assert_eq!(line.len(), header().len(), "{}\n{line}", header());
    assert!(line.starts_with("16M     cruise v10  16123456"), "{line}");
    assert!(line.contains(" 1/12.0 "), "{line}");
    let slower = Row { ours: Summary { median_ms: 75.0, p99_ms: 80.0 }, ..row };
    assert!(slower.to_string().contains(" 1.25 "), "{slower}");
}

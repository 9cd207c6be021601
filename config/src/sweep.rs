//! Sweep files: which values of which knobs a trade tries.
//!
//! In:    the text of a sweep file, RON.
//! Out:   [`SweepSettings`], or every fault of the file at once.
//! Keeps: nothing.
//! Not here: which points follow from it (`overfly_replay::trade`).

use crate::fault::SceneFaults;
use crate::fields::{Group, Reader, Shape, words};
use crate::node::{Kind, Node};
use crate::{FaultKind, tree};
use overfly_core::settings::VertexPrecision;
use std::fmt::Display;
use std::ops::RangeInclusive;

const SWEEP: Shape = Shape {
    name: "Sweep",
    fields: &[
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
        "grid",
    ],
};
/// More values than this of one knob are a mistake.
const VALUES_MAX: usize = 64;
const PATCH_DEPTHS: [u8; 5] = [0, 2, 4, 6, 8];

/// Values of each knob, empty where it keeps the scene's own.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SweepSettings {
    /// Error on the screen that may stay, pixels.
    pub tolerance_px: Vec<f64>,
    /// Most triangles.
    pub triangles_max: Vec<u32>,
    /// A leaf is drawn as 2^k triangles.
    pub patch_depth: Vec<u8>,
    /// Most splits in one frame.
    pub splits_max: Vec<u32>,
    /// How vertices get to their place before the eye.
    pub vertices: Vec<VertexPrecision>,
    /// Borders between depth ranges in metres; an empty list is one range.
    pub depth_ranges: Vec<Vec<f64>>,
    /// Seconds in which a new vertex moves to its place.
    pub morph_s: Vec<f64>,
    /// Memory of all resident pages, MiB.
    pub pages_mib: Vec<u32>,
    /// How much later than in the next frame pages arrive, milliseconds of the flight.
    pub loader_delay_ms: Vec<u32>,
    /// Worker threads beside the main one.
    pub workers: Vec<u8>,
    /// Every value with every other, instead of one knob at a time.
    pub grid: bool,
}

/// The settings of a sweep file's text. `file` is only for the faults to name.
///
/// # Errors
/// Every unknown or repeated field, wrong type and value out of range, all at once.
pub fn read_sweep(text: &str, file: &str) -> Result<SweepSettings, SceneFaults> {
    let (root, syntax) = tree::parse(text);
    let mut reader = Reader::new(text);
    for fault in syntax {
        reader.fault(fault.at, "", FaultKind::Syntax { what: fault.what });
    }
    let settings = root.as_ref().and_then(|root| sweep(&mut reader, root));
    let faults = reader.into_faults();
    match settings {
        Some(settings) if faults.is_empty() => Ok(settings),
        _ => Err(SceneFaults { file: file.to_owned(), faults }),
    }
}

fn sweep<'t>(reader: &mut Reader<'t>, root: &'t Node) -> Option<SweepSettings> {
    let group = &reader.group(root, "", &SWEEP)?;
    // Ranges are those of scene files; what two settings allow together is seen point by point.
    Some(SweepSettings {
        tolerance_px: numbers(reader, group, "tolerance_px", 0.01..=1e6),
        triangles_max: wholes(reader, group, "triangles_max", 8..=16_000_000),
        patch_depth: patch_depths(reader, group),
        splits_max: wholes(reader, group, "splits_max", 1..=65_536),
        vertices: precisions(reader, group),
        depth_ranges: borders(reader, group),
        morph_s: numbers(reader, group, "morph_s", 0.0..=10.0),
        pages_mib: wholes(reader, group, "pages_mib", 4..=65_536),
        loader_delay_ms: wholes(reader, group, "loader_delay_ms", 0..=60_000),
        workers: wholes(reader, group, "workers", 0..=64),
        grid: reader.switch(group, "grid", false)?,
    })
}

/// The values of one knob, each with its path.
fn values<'t, T>(
    reader: &mut Reader<'t>,
    group: &Group<'t>,
    (name, expected): (&str, &str),
    value: impl Fn(&mut Reader<'t>, &'t Node, &str) -> Option<T>,
) -> Vec<T> {
    let nodes = reader.list(group, name, expected).unwrap_or_default();
    reader.counted(group, name, nodes.len(), [1, VALUES_MAX]);
    let numbered = nodes.iter().enumerate();
    numbered.filter_map(|(i, node)| value(reader, node, &format!("{name}[{i}]"))).collect()
}

fn numbers<'t>(
    reader: &mut Reader<'t>,
    group: &Group<'t>,
    name: &str,
    range: RangeInclusive<f64>,
) -> Vec<f64> {
    let expected = format!("a list of numbers, {}", words(&range));
    values(reader, group, (name, &expected), |reader, node, path| {
        reader.number_in(node, path, range.clone())
    })
}

fn wholes<'t, T: TryFrom<i128> + PartialOrd + Display + Clone>(
    reader: &mut Reader<'t>,
    group: &Group<'t>,
    name: &str,
    range: RangeInclusive<T>,
) -> Vec<T> {
    let expected = format!("a list of whole numbers, {}", words(&range));
    values(reader, group, (name, &expected), |reader, node, path| {
        let Kind::Whole { value, .. } = node.kind else {
            reader.wrong_type(node, path, &format!("a whole number, {}", words(&range)));
            return None;
        };
        let fitting = T::try_from(value).ok().filter(|value| range.contains(value));
        if fitting.is_none() {
            reader.out_of_range(node, path, words(&range));
        }
        fitting
    })
}

fn patch_depths<'t>(reader: &mut Reader<'t>, group: &Group<'t>) -> Vec<u8> {
    let depths = wholes(reader, group, "patch_depth", 0..=8);
    let Some(Kind::List(nodes)) = group.get("patch_depth").map(|node| &node.kind) else {
        return depths;
    };
    for (i, node) in nodes.iter().enumerate() {
        let odd = matches!(node.kind, Kind::Whole { value: 1 | 3 | 5 | 7, .. });
        if odd {
            let allowed = PATCH_DEPTHS.map(|depth| depth.to_string()).join(", ");
            reader.out_of_range(node, &format!("patch_depth[{i}]"), allowed);
        }
    }
    depths
}

fn precisions<'t>(reader: &mut Reader<'t>, group: &Group<'t>) -> Vec<VertexPrecision> {
    let expected = "a list of TwoFloat and EyeF64";
    values(reader, group, ("vertices", expected), |reader, node, path| {
        let name = reader.variant(node, path, &["TwoFloat", "EyeF64"])?;
        let precision = match name {
            "TwoFloat" => VertexPrecision::TwoFloat,
            _ => VertexPrecision::EyeF64,
        };
        reader.plain(node, path, precision)
    })
}

fn borders<'t>(reader: &mut Reader<'t>, group: &Group<'t>) -> Vec<Vec<f64>> {
    let expected = "a list of lists of borders in metres, as in [[], [30.0, 10000.0]]";
    values(reader, group, ("depth_ranges", expected), |reader, node, path| {
        let Kind::List(nodes) = &node.kind else {
            reader.wrong_type(node, path, "a list of borders in metres, [] for one range");
            return None;
        };
        let numbered = nodes.iter().enumerate();
        numbered
            .map(|(i, node)| reader.number_in(node, &format!("{path}[{i}]"), 0.001..=1e9))
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_fields_may_be_left_out_and_all_may_be_given() {
        assert_eq!(read_sweep("()", "s.ron").unwrap(), SweepSettings::default());
        let text = "Sweep(tolerance_px: [1, 0.5], triangles_max: [5000], patch_depth: [0, 8],
            splits_max: [64], vertices: [TwoFloat, EyeF64], depth_ranges: [[], [30, 1e4]],
            morph_s: [0, 0.25], pages_mib: [4, 65536], loader_delay_ms: [0, 100],
            workers: [0, 64], grid: true)";
        let sweep = read_sweep(text, "s.ron").unwrap();
        assert_eq!(sweep.tolerance_px, [1.0, 0.5]);
        assert_eq!(sweep.depth_ranges, [vec![], vec![30.0, 1e4]]);
        assert_eq!(sweep.vertices, [VertexPrecision::TwoFloat, VertexPrecision::EyeF64]);
        assert!(sweep.grid && sweep.workers == [0, 64]);
    }

    #[test]
    fn faults_name_file_field_value_and_range_all_at_once() {
        let text = "Sweep(tolerance: [1], triangles_max: [7], patch_depth: [3], morph_s: 1,\n\
                    vertices: [Half], workers: [65], loader_delay_ms: [], splits_max: [0.5])";
        let faults = read_sweep(text, "my.ron").unwrap_err().to_string();
        for part in [
            "my.ron:1:7: tolerance: unknown field tolerance, did you mean tolerance_px?",
            "triangles_max[0]: is 7, allowed is 8 to 16000000",
            "patch_depth[0]: is 3, allowed is 0, 2, 4, 6, 8",
            "morph_s: is the number 1, expected is a list of numbers, 0 to 10",
            "my.ron:2:",
            "vertices[0]: unknown variant Half, known here: TwoFloat, EyeF64",
            "workers[0]: is 65, allowed is 0 to 64",
            "loader_delay_ms: is a list of 0, allowed is a list of 1 to 64",
            "splits_max[0]: is the number 0.5, expected is a whole number, 1 to 65536",
        ] {
            assert!(faults.contains(part), "{part} is not in:\n{faults}");
        }
    }
}

//! The `depth` of a scene file: numbers of the depth buffer, and where its ranges end.
//!
//! In:    the tree of `depth`, the body, the near distances of the views.
//! Out:   [`DepthSettings`] with every border as a number.
//! Keeps: nothing.
//! Not here: how ranges overlap and are drawn (`overfly_core::mesh::place`, `render_vk`).
//!
//! Borders in a constant ratio are the ones that waste least: within a range, numbers of a depth
//! buffer lie further apart in proportion to the distance over that at which the range begins.

use crate::fault::FaultKind;
use crate::fields::{Group, Reader, Shape};
use crate::node::{Kind, Node};
use crate::scene::View;
use overfly_core::geodesy::{Ellipsoid, trig};
use overfly_core::settings::{DepthFormat, DepthOrder, DepthSettings};

const DEPTH: Shape = Shape { name: "Depth", fields: &["format", "order", "ranges"] };
const FORMATS: &[(&str, DepthFormat)] = &[("D32F", DepthFormat::D32F), ("D24", DepthFormat::D24)];
const ORDERS: &[(&str, DepthOrder)] =
    &[("Reversed", DepthOrder::Reversed), ("Forward", DepthOrder::Forward)];
const RANGES: &str = "Auto, a whole number 1 to 8, or a list of borders in metres";
const RANGES_MAX: u8 = 8;

/// A body is looked at from no further than so many of its equatorial radii, as `Auto` sees it.
const FAR_RADII: f64 = 16.0;
/// A number of ranges is spent on what is nearer than this.
const FAR_M: f64 = 1e7;
/// Far over near, within a range, at which surfaces 1e-4 of their distance apart still differ in a
/// depth buffer that resolves evenly. Measured on slanted planes, D24 and forward D32F need 2e-6
/// to 1e-4 where far over near is 10 to 1000: at most 6e-5 here.
const RATIO: f64 = 300.0;

/// Where borders come from.
enum Borders<'t> {
    /// As the file lists them; the list itself.
    Listed(Vec<Option<f64>>, &'t [Node]),
    /// In a constant ratio: so many ranges; `None` as many as are needed.
    Even(Option<u8>),
}

/// The depth settings; `None` only after a fault.
pub(crate) fn depth<'t>(
    reader: &mut Reader<'t>,
    scene: &Group<'t>,
    body: Option<Ellipsoid>,
    views: &[View],
) -> Option<DepthSettings> {
    let depth = reader.part(scene, "depth", &DEPTH)?;
    let format = reader.choice(&depth, "format", FORMATS);
    let order = reader.choice(&depth, "order", ORDERS);
    let splits_m = match borders(reader, &depth)? {
        Borders::Listed(splits_m, nodes) => {
            if let Some(Some(first_m)) = splits_m.first() {
                listed_beyond_near(reader, &nodes[0], views, *first_m);
            }
            splits_m.into_iter().collect::<Option<Vec<_>>>()?
        }
        Borders::Even(count) => {
            let nears_m: Option<Vec<f64>> = views.iter().map(|view| view.near_m).collect();
            let near_m = nears_m?.into_iter().reduce(f64::min)?;
            let far_m = FAR_RADII * body?.a_m;
            let splits_m = match count {
                Some(count) => even(near_m, far_m.min(FAR_M).max(RATIO * near_m), count),
                None => even(near_m, far_m, needed(format?, order?, near_m, far_m)),
            };
            if let Some(first_m) = splits_m.first() {
                near_before_even(reader, views, *first_m);
            }
            splits_m
        }
    };
    Some(DepthSettings { format: format?, order: order?, splits_m })
}

/// What `ranges` says.
fn borders<'t>(reader: &mut Reader<'t>, depth: &Group<'t>) -> Option<Borders<'t>> {
    let Some(node) = depth.get("ranges") else { return Some(Borders::Even(None)) };
    let path = depth.path_of("ranges");
    match &node.kind {
        Kind::List(nodes) => {
            reader.counted(depth, "ranges", nodes.len(), [0, usize::from(RANGES_MAX) - 1]);
            Some(Borders::Listed(splits_m(reader, nodes), nodes))
        }
        Kind::Whole { .. } => {
            let count = reader.whole(depth, "ranges", 1..=RANGES_MAX, 1)?;
            Some(Borders::Even(Some(count)))
        }
        Kind::Word(_) | Kind::Struct(Some(_), _) | Kind::Tuple(Some(_), _) => {
            reader.variant(node, &path, &["Auto"])?;
            reader.plain(node, &path, Borders::Even(None))
        }
        _ => {
            reader.wrong_type(node, &path, RANGES);
            None
        }
    }
}

/// Ranges that keep surfaces 1e-4 of their distance apart, from near to far. Reversed floats, the
/// last range of which never ends, resolve 5e-7 at any distance: one is enough.
fn needed(format: DepthFormat, order: DepthOrder, near_m: f64, far_m: f64) -> u8 {
    if (format, order) == (DepthFormat::D32F, DepthOrder::Reversed) {
        return 1;
    }
    let ratio = far_m / near_m;
    let reach = |ranges: u8| (0..ranges).fold(1.0, |reach, _| reach * RATIO);
    (1..RANGES_MAX).find(|&ranges| reach(ranges) >= ratio).unwrap_or(RANGES_MAX)
}

/// The borders between so many ranges, each as many times as far as the one before.
fn even(near_m: f64, far_m: f64, ranges: u8) -> Vec<f64> {
    let step = trig::ln(far_m / near_m) / f64::from(ranges);
    (1..ranges).map(|i| near_m * trig::exp(step * f64::from(i))).collect()
}

fn splits_m(reader: &mut Reader, nodes: &[Node]) -> Vec<Option<f64>> {
    let mut splits_m: Vec<Option<f64>> = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        let path = format!("depth.ranges[{i}]");
        let split_m = reader.number_in(node, &path, 0.001..=1e9);
        if let (Some(split_m), Some(&before_m)) = (split_m, splits_m.iter().flatten().last())
            && split_m <= before_m
        {
            reader.out_of_range(node, &path, format!("more than {before_m}, the one before it"));
        }
        splits_m.push(split_m);
    }
    splits_m
}

/// A border in front of a near plane would leave a depth range without depth.
fn listed_beyond_near(reader: &mut Reader, first: &Node, views: &[View], first_m: f64) {
    for view in views {
        let Some(near_m) = view.near_m.filter(|near_m| *near_m >= first_m) else { continue };
        let allowed = format!("more than {near_m}, as {} is", view.group.path_of("near_m"));
        reader.out_of_range(first, "depth.ranges[0]", allowed);
    }
}

/// The same where borders follow from the nearest view: only further ones can be at fault.
fn near_before_even(reader: &mut Reader, views: &[View], first_m: f64) {
    for view in views {
        let Some(near_m) = view.near_m.filter(|near_m| *near_m >= first_m) else { continue };
        let at = view.group.get("near_m").map_or(view.group.at, |node| node.at);
        let allowed = format!("less than {first_m:.3}, where the first of depth.ranges ends");
        let what = FaultKind::OutOfRange { found: near_m.to_string(), allowed };
        reader.fault(at, view.group.path_of("near_m"), what);
    }
}

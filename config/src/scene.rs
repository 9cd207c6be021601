//! The scene format: every setting's name, range and default, and the rules between settings.
//!
//! In:    the tree of a `scene.ron`.
//! Out:   resolved [`SceneSettings`]: complete, SI.
//! Keeps: nothing.
//! Not here: RON (`tree`), the wording of faults (`fault`).

use crate::fault::FaultKind;
use crate::fields::{Group, Reader, Shape, words};
use crate::node::{Kind, Node};
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::{
    DepthFormat, DepthOrder, DepthSettings, LensSettings, LodSettings, MemorySettings,
    SceneSettings, SourceSettings, SunSettings, VertexPrecision, is_address,
};
use overfly_core::units::{Pixels, Radians};

const SCENE: Shape = Shape {
    name: "Scene",
    fields: &["body", "sources", "sea", "sun", "lod", "views", "depth", "memory"],
};
const BODIES: &[&str] = &["Wgs84", "Moon", "Mars", "Sphere", "Ellipsoid"];
const SPHERE: Shape = Shape { name: "Sphere", fields: &["radius_m"] };
const ELLIPSOID: Shape = Shape { name: "Ellipsoid", fields: &["a_m", "f"] };
const SOURCES: &[&str] = &["Archive", "Procedural"];
const PROCEDURAL: Shape =
    Shape { name: "Procedural", fields: &["seed", "style", "relief", "finest_m", "detail"] };
const STYLES: &[&str] = &["Earthlike", "Cratered"];
const SUN: Shape = Shape { name: "Sun", fields: &["latitude_deg", "longitude_deg"] };
const LOD: Shape = Shape {
    name: "Lod",
    fields: &[
        "tolerance_px",
        "triangles_max",
        "patch_depth",
        "splits_max",
        "merges_max",
        "level_max",
        "wanted_max",
    ],
};
const VIEW: Shape = Shape {
    name: "View",
    fields: &["name", "field_of_view_deg", "yaw_deg", "pitch_deg", "near_m"],
};
const DEPTH: Shape = Shape { name: "Depth", fields: &["splits_m"] };
const MEMORY: Shape = Shape { name: "Memory", fields: &["pages_mib"] };

/// The procedural planet is made for bodies of at least this radius.
const RADIUS_M_MIN: f64 = 500.0;
const RADIUS_M_MAX: f64 = 1e9;
const ARCHIVES_MAX: usize = 8;
/// No system takes longer paths, few servers longer addresses.
const LOCATION_MAX: usize = 4096;
const TRIANGLES_MAX: u32 = 16_000_000;
/// A path of the lattice has so many levels, those inside a patch included.
const LEVELS: u8 = 56;
const VIEWS_MAX: usize = 8;
const VIEW_NAME_MAX: usize = 32;
const SPLITS_MAX: usize = 7;
const SPLITS_M: [f64; 2] = [30.0, 10_000.0];

/// A view, where it was written, and what other settings must agree with.
struct View<'t> {
    group: Group<'t>,
    name: Option<String>,
    near_m: Option<f64>,
    lens: Option<LensSettings>,
}

/// The scene of a tree; `None` only after a fault.
pub(crate) fn scene<'t>(reader: &mut Reader<'t>, root: &'t Node) -> Option<SceneSettings> {
    let scene = reader.group(root, "", &SCENE)?;
    let body = body(reader, &scene);
    let sources = sources(reader, &scene);
    let sea = reader.switch(&scene, "sea", false);
    let sun = sun(reader, &scene);
    let lod = lod(reader, &scene);
    let views = views(reader, &scene);
    let depth = depth(reader, &scene, &views);
    let memory = memory(reader, &scene);
    Some(SceneSettings {
        body: body?,
        sources: sources?,
        lod: lod?,
        views: views.into_iter().map(|view| view.lens).collect::<Option<_>>()?,
        depth: depth?,
        vertices: VertexPrecision::TwoFloat,
        imagery: Vec::new(),
        memory: memory?,
        sea: sea?,
        sun: sun?,
    })
}

fn body<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<Ellipsoid> {
    let Some(node) = scene.get("body") else {
        let expected = "Wgs84, Moon, Mars, Sphere(radius_m: …) or Ellipsoid(a_m: …, f: …)";
        reader.missing(scene, "body", expected);
        return None;
    };
    let radii_m = RADIUS_M_MIN..=RADIUS_M_MAX;
    match reader.variant(node, "body", BODIES)? {
        "Wgs84" => plain(reader, node, "body", Ellipsoid::WGS84),
        "Moon" => plain(reader, node, "body", Ellipsoid::MOON),
        "Mars" => plain(reader, node, "body", Ellipsoid::MARS),
        "Sphere" => {
            let sphere = reader.group(node, "body", &SPHERE)?;
            let a_m = reader.required_number(&sphere, "radius_m", radii_m)?;
            Some(Ellipsoid { a_m, f: 0.0 })
        }
        _ => {
            let ellipsoid = reader.group(node, "body", &ELLIPSOID)?;
            let a_m = reader.required_number(&ellipsoid, "a_m", radii_m);
            // The range in which core's geodesy is tested.
            let f = reader.required_number(&ellipsoid, "f", -0.5..=0.5);
            large_enough(reader, &ellipsoid, Ellipsoid { a_m: a_m?, f: f? })
        }
    }
}

/// The mean radius of a flat body is smaller than the equatorial one.
fn large_enough(reader: &mut Reader, group: &Group, body: Ellipsoid) -> Option<Ellipsoid> {
    let mean_m = (2.0 * body.a_m + body.b_m()) / 3.0;
    if mean_m >= RADIUS_M_MIN {
        return Some(body);
    }
    let least_m = 3.0 * RADIUS_M_MIN / (3.0 - body.f);
    let allowed = format!("{least_m:.3} or more while body.f is {}", body.f);
    reader.out_of_range(group.get("a_m")?, "body.a_m", allowed);
    None
}

/// The value of a variant without fields.
fn plain<T>(reader: &mut Reader, node: &Node, path: &str, value: T) -> Option<T> {
    if let Kind::Word(_) = node.kind {
        return Some(value);
    }
    reader.wrong_type(node, path, "the name alone");
    None
}

fn sources<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<Vec<SourceSettings>> {
    let Some(nodes) = reader.list(scene, "sources", "[Archive(\"…\"), Procedural(…)]") else {
        let absent = Group::absent("sources[0]".into(), scene.at);
        return Some(vec![procedural(reader, &absent)?]);
    };
    let mut sources = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        let path = format!("sources[{i}]");
        match reader.variant(node, &path, SOURCES) {
            Some("Archive") => {
                if i == ARCHIVES_MAX {
                    reader.out_of_range(node, &path, format!("at most {ARCHIVES_MAX} archives"));
                }
                sources.push(archive(reader, node, &path));
            }
            Some(_) => {
                let group = reader.group(node, &path, &PROCEDURAL);
                sources.push(group.and_then(|group| procedural(reader, &group)));
                if i + 1 < nodes.len() {
                    reader.out_of_range(
                        node,
                        &path,
                        "a procedural source in the last place".into(),
                    );
                }
            }
            None => {}
        }
    }
    counted(reader, scene, "sources", nodes.len(), [1, ARCHIVES_MAX + 1]);
    sources.into_iter().collect()
}

/// An archive's location, as it is written.
fn archive(reader: &mut Reader, node: &Node, path: &str) -> Option<SourceSettings> {
    let text = match &node.kind {
        Kind::Tuple(_, items) if items.len() == 1 => &items[0],
        _ => {
            reader.wrong_type(node, path, "Archive(\"a path or an address\")");
            return None;
        }
    };
    let Kind::Text(location) = &text.kind else {
        reader.wrong_type(text, path, "a text, the path or the address of an archive");
        return None;
    };
    let sized = (1..=LOCATION_MAX).contains(&location.len());
    if sized && !location.contains(char::is_control) && (is_address(location) || is_path(location))
    {
        return Some(SourceSettings::Archive { location: location.clone() });
    }
    let allowed = format!(
        "a path or an address http://… or https://…, of 1 to {LOCATION_MAX} bytes, none of them \
         a control character"
    );
    reader.out_of_range(text, path, allowed);
    None
}

/// What does not begin like an address of whatever kind.
fn is_path(location: &str) -> bool {
    let word =
        |scheme: &str| !scheme.is_empty() && scheme.bytes().all(|c| c.is_ascii_alphanumeric());
    !location.split_once("://").is_some_and(|(scheme, _)| word(scheme))
}

fn procedural<'t>(reader: &mut Reader<'t>, source: &Group<'t>) -> Option<SourceSettings> {
    let seed = reader.whole(source, "seed", 0..=u64::MAX, 2029);
    let style = style(reader, source);
    let relief = reader.number(source, "relief", 0.0..=10.0, 1.0);
    let finest_m = reader.number(source, "finest_m", 0.01..=1000.0, 0.15);
    let detail = reader.number(source, "detail", 0.0..=10.0, 1.0);
    Some(SourceSettings::Procedural {
        seed: seed?,
        style: style?,
        relief: relief?,
        finest_m: finest_m?,
        detail: detail?,
    })
}

fn style<'t>(reader: &mut Reader<'t>, source: &Group<'t>) -> Option<Style> {
    let Some(node) = source.get("style") else { return Some(Style::Earthlike) };
    let path = source.path_of("style");
    let style = match reader.variant(node, &path, STYLES)? {
        "Earthlike" => Style::Earthlike,
        _ => Style::Cratered,
    };
    plain(reader, node, &path, style)
}

/// Notes a list that is too short or too long.
fn counted(
    reader: &mut Reader,
    group: &Group,
    name: &str,
    count: usize,
    [least, most]: [usize; 2],
) {
    let Some(list) = group.get(name).filter(|_| !(least..=most).contains(&count)) else { return };
    let items = if least == most { format!("{most}") } else { words(&(least..=most)) };
    let what = FaultKind::OutOfRange {
        found: format!("a list of {count}"),
        allowed: format!("a list of {items}"),
    };
    reader.fault(list.at, group.path_of(name), what);
}

/// Outer `None`: a fault. Inner `None`: no sun.
fn sun<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<Option<SunSettings>> {
    let Some(node) = scene.get("sun") else { return Some(None) };
    let inner = match &node.kind {
        Kind::Word(name) if name == "None" => return Some(None),
        Kind::Tuple(Some(name), items) if name == "Some" && items.len() == 1 => &items[0],
        _ => {
            let expected = "None or Some((latitude_deg: …, longitude_deg: …))";
            reader.wrong_type(node, "sun", expected);
            return None;
        }
    };
    let sun = reader.group(inner, "sun", &SUN)?;
    let latitude_deg = reader.required_number(&sun, "latitude_deg", -90.0..=90.0);
    let longitude_deg = reader.required_number(&sun, "longitude_deg", -360.0..=360.0);
    let below = Geodetic::from_degrees(latitude_deg?, longitude_deg?, 0.0);
    Some(Some(SunSettings { direction: below.normal() }))
}

fn lod<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<LodSettings> {
    let lod = reader.part(scene, "lod", &LOD)?;
    let tolerance = reader.number(&lod, "tolerance_px", 0.01..=1e6, 1.0).map(Pixels);
    let patch_depth = patch_depth(reader, &lod);
    let triangles_max = triangles_max(reader, &lod, patch_depth);
    let splits_max = reader.whole(&lod, "splits_max", 1..=65_536, 512);
    let merges_max = reader.whole(&lod, "merges_max", 1..=65_536, 512);
    let level_max = level_max(reader, &lod, patch_depth);
    let wanted_max = reader.whole(&lod, "wanted_max", 1..=4096, 32);
    Some(LodSettings {
        tolerance: tolerance?,
        triangles_max: triangles_max?,
        patch_depth: patch_depth?,
        splits_max: splits_max?,
        merges_max: merges_max?,
        level_max: level_max?,
        wanted_max: wanted_max?,
        morph_s: 0.0,
    })
}

fn patch_depth(reader: &mut Reader, lod: &Group) -> Option<u8> {
    let Some(node) = lod.get("patch_depth") else { return Some(4) };
    let (path, allowed) = (lod.path_of("patch_depth"), "0, 2, 4, 6 or 8");
    let Kind::Whole { value, .. } = node.kind else {
        reader.wrong_type(node, &path, &format!("a whole number, {allowed}"));
        return None;
    };
    let depth = [0, 2, 4, 6, 8].into_iter().find(|depth| i128::from(*depth) == value);
    if depth.is_none() {
        reader.out_of_range(node, &path, allowed.into());
    }
    depth
}

/// The coarsest mesh has 8 leaves, each drawn as a patch.
fn triangles_max(reader: &mut Reader, lod: &Group, patch_depth: Option<u8>) -> Option<u32> {
    let value = reader.whole(lod, "triangles_max", 8..=TRIANGLES_MAX, 100_000)?;
    let depth = patch_depth?;
    let least = 8_u32 << depth;
    if value >= least {
        return Some(value);
    }
    let allowed = format!("{least} to {TRIANGLES_MAX} while lod.patch_depth is {depth}");
    reader.out_of_range(lod.get("triangles_max")?, "lod.triangles_max", allowed);
    None
}

/// The default gives way to deep patches; a written value does not.
fn level_max(reader: &mut Reader, lod: &Group, patch_depth: Option<u8>) -> Option<u8> {
    let value = reader.whole(lod, "level_max", 0..=LEVELS, 50)?;
    let depth = patch_depth?;
    let most = LEVELS - depth;
    let Some(node) = lod.get("level_max") else { return Some(value.min(most)) };
    if value <= most {
        return Some(value);
    }
    let allowed = format!("0 to {most} while lod.patch_depth is {depth}");
    reader.out_of_range(node, "lod.level_max", allowed);
    None
}

/// Every view that is a struct at all.
fn views<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Vec<View<'t>> {
    let nodes = reader.list(scene, "views", "[(name: …, field_of_view_deg: …)]");
    let Some(nodes) = nodes else {
        return vec![view(reader, Group::absent("views[0]".into(), scene.at))];
    };
    counted(reader, scene, "views", nodes.len(), [1, VIEWS_MAX]);
    let mut views: Vec<View> = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        let Some(group) = reader.group(node, &format!("views[{i}]"), &VIEW) else { continue };
        let view = view(reader, group);
        if view.name.is_some() && views.iter().any(|other| other.name == view.name) {
            name_taken(reader, &view.group);
        }
        views.push(view);
    }
    views
}

fn name_taken(reader: &mut Reader, view: &Group) {
    let unused = "a name that no view before it has";
    match view.get("name") {
        Some(node) => reader.out_of_range(node, &view.path_of("name"), unused.into()),
        None => reader.missing(view, "name", unused),
    }
}

fn view<'t>(reader: &mut Reader<'t>, group: Group<'t>) -> View<'t> {
    let name = view_name(reader, &group);
    let near_m = reader.number(&group, "near_m", 0.001..=1e6, 0.1);
    let lens = lens(reader, &group, name.clone(), near_m);
    View { group, name, near_m, lens }
}

fn lens(
    reader: &mut Reader,
    view: &Group,
    name: Option<String>,
    near_m: Option<f64>,
) -> Option<LensSettings> {
    let field_of_view = reader.number(view, "field_of_view_deg", 0.01..=179.0, 60.0);
    let yaw = reader.number(view, "yaw_deg", -360.0..=360.0, 0.0);
    let pitch = reader.number(view, "pitch_deg", -90.0..=90.0, 0.0);
    Some(LensSettings {
        name: name?,
        field_of_view: field_of_view.map(Radians::from_degrees)?,
        yaw: yaw.map(Radians::from_degrees)?,
        pitch: pitch.map(Radians::from_degrees)?,
        near_m: near_m?,
    })
}

/// View names become parts of file names, so they keep to what every system allows.
fn view_name(reader: &mut Reader, view: &Group) -> Option<String> {
    let Some(node) = view.get("name") else { return Some("front".into()) };
    let path = view.path_of("name");
    let Kind::Text(name) = &node.kind else {
        reader.wrong_type(node, &path, "a text");
        return None;
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if (1..=VIEW_NAME_MAX).contains(&name.len()) && name.chars().all(plain) {
        return Some(name.clone());
    }
    let allowed = format!("1 to {VIEW_NAME_MAX} of A-Z, a-z, 0-9, _ and -");
    reader.out_of_range(node, &path, allowed);
    None
}

fn depth<'t>(reader: &mut Reader<'t>, scene: &Group<'t>, views: &[View]) -> Option<DepthSettings> {
    let depth = reader.part(scene, "depth", &DEPTH)?;
    let splits_m = match reader.list(&depth, "splits_m", "a list of numbers") {
        Some(nodes) => splits_m(reader, nodes),
        None => SPLITS_M.map(Some).into(),
    };
    counted(reader, &depth, "splits_m", splits_m.len(), [0, SPLITS_MAX]);
    if let Some(Some(first_m)) = splits_m.first() {
        splits_beyond_near(reader, &depth, views, *first_m);
    }
    let splits_m = splits_m.into_iter().collect::<Option<_>>()?;
    Some(DepthSettings { format: DepthFormat::D32F, order: DepthOrder::Reversed, splits_m })
}

fn splits_m(reader: &mut Reader, nodes: &[Node]) -> Vec<Option<f64>> {
    let mut splits_m: Vec<Option<f64>> = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        let path = format!("depth.splits_m[{i}]");
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

/// A split in front of a near plane would leave a depth range without depth. Whichever of the
/// two was written is at fault; the splits if both were.
fn splits_beyond_near(reader: &mut Reader, depth: &Group, views: &[View], first_m: f64) {
    for view in views {
        let Some(near_m) = view.near_m.filter(|near_m| *near_m >= first_m) else { continue };
        let near_path = view.group.path_of("near_m");
        if let Some(Node { kind: Kind::List(splits), .. }) = depth.get("splits_m") {
            let allowed = format!("more than {near_m}, as {near_path} is");
            reader.out_of_range(&splits[0], "depth.splits_m[0]", allowed);
        } else if let Some(node) = view.group.get("near_m") {
            let allowed = format!("less than {first_m}, the first of depth.splits_m by default");
            reader.out_of_range(node, &near_path, allowed);
        }
    }
}

fn memory<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<MemorySettings> {
    let memory = reader.part(scene, "memory", &MEMORY)?;
    let pages_mib = reader.whole(&memory, "pages_mib", 4..=65_536_u32, 256)?;
    Some(MemorySettings { pages_bytes: u64::from(pages_mib) << 20 })
}

//! The scene format: every setting's name, range and default, and the rules between settings.
//!
//! In:    the tree of a `scene.ron`.
//! Out:   resolved [`SceneSettings`]: complete, SI.
//! Keeps: nothing.
//! Not here: RON (`tree`), the wording of faults (`fault`).

use crate::depth::depth;
use crate::fields::{Group, Reader, Shape};
use crate::node::{Kind, Node};
use crate::sun::sun;
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::settings::{
    LensSettings, LodSettings, MemorySettings, SceneSettings, SourceSettings, VertexPrecision,
    is_address,
};
use overfly_core::units::{Pixels, Radians};

const SCENE: Shape = Shape {
    name: "Scene",
    fields: &[
        "body", "sources", "imagery", "sea", "sun", "lod", "views", "vertices", "depth", "memory",
    ],
};
const BODIES: &[&str] = &["Wgs84", "Moon", "Mars", "Sphere", "Ellipsoid"];
const SPHERE: Shape = Shape { name: "Sphere", fields: &["radius_m"] };
const ELLIPSOID: Shape = Shape { name: "Ellipsoid", fields: &["a_m", "f"] };
const SOURCES: &[&str] = &["Archive", "Procedural"];
const PROCEDURAL: Shape =
    Shape { name: "Procedural", fields: &["seed", "style", "relief", "finest_m", "detail"] };
const STYLES: &[(&str, Style)] = &[("Earthlike", Style::Earthlike), ("Cratered", Style::Cratered)];
const PRECISIONS: &[(&str, VertexPrecision)] =
    &[("TwoFloat", VertexPrecision::TwoFloat), ("EyeF64", VertexPrecision::EyeF64)];
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
        "morph_s",
    ],
};
const VIEW: Shape = Shape {
    name: "View",
    fields: &["name", "field_of_view_deg", "yaw_deg", "pitch_deg", "near_m"],
};
const MEMORY: Shape = Shape { name: "Memory", fields: &["pages_mib"] };

/// The procedural planet is made for bodies of at least this radius.
const RADIUS_M_MIN: f64 = 500.0;
const RADIUS_M_MAX: f64 = 1e9;
const ARCHIVES_MAX: usize = 8;
const IMAGERY_MAX: usize = 4;
/// No system takes longer paths, few servers longer addresses.
const LOCATION_MAX: usize = 4096;
const TRIANGLES_MAX: u32 = 16_000_000;
/// A path of the lattice has so many levels, those inside a patch included.
const LEVELS: u8 = 56;
const VIEWS_MAX: usize = 8;
const VIEW_NAME_MAX: usize = 32;

/// A view, where it was written, and what other settings must agree with.
pub(crate) struct View<'t> {
    pub group: Group<'t>,
    name: Option<String>,
    pub near_m: Option<f64>,
    lens: Option<LensSettings>,
}

/// The scene of a tree; `None` only after a fault.
pub(crate) fn scene<'t>(reader: &mut Reader<'t>, root: &'t Node) -> Option<SceneSettings> {
    let scene = reader.group(root, "", &SCENE)?;
    let body = body(reader, &scene);
    let sources = sources(reader, &scene);
    let imagery = imagery(reader, &scene);
    let sea = reader.switch(&scene, "sea", false);
    let sun = sun(reader, &scene);
    let lod = lod(reader, &scene);
    let views = views(reader, &scene);
    let vertices = reader.choice(&scene, "vertices", PRECISIONS);
    let depth = depth(reader, &scene, body, &views);
    let memory = memory(reader, &scene);
    Some(SceneSettings {
        body: body?,
        sources: sources?,
        lod: lod?,
        views: views.into_iter().map(|view| view.lens).collect::<Option<_>>()?,
        depth: depth?,
        vertices: vertices?,
        imagery: imagery?,
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
        "Wgs84" => reader.plain(node, "body", Ellipsoid::WGS84),
        "Moon" => reader.plain(node, "body", Ellipsoid::MOON),
        "Mars" => reader.plain(node, "body", Ellipsoid::MARS),
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
    reader.counted(scene, "sources", nodes.len(), [1, ARCHIVES_MAX + 1]);
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
    location(reader, text, path).map(|location| SourceSettings::Archive { location })
}

/// Archives of imagery, as they are written.
fn imagery<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<Vec<String>> {
    if scene.get("imagery").is_none() {
        return Some(Vec::new());
    }
    let nodes = reader.list(scene, "imagery", "a list of texts, [\"a path or an address\", …]")?;
    let mut locations = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        locations.push(location(reader, node, &format!("imagery[{i}]")));
    }
    reader.counted(scene, "imagery", nodes.len(), [0, IMAGERY_MAX]);
    locations.into_iter().collect()
}

/// The path or the address of an archive.
fn location(reader: &mut Reader, text: &Node, path: &str) -> Option<String> {
    let Kind::Text(location) = &text.kind else {
        reader.wrong_type(text, path, "a text, the path or the address of an archive");
        return None;
    };
    let sized = (1..=LOCATION_MAX).contains(&location.len());
    if sized && !location.contains(char::is_control) && (is_address(location) || is_path(location))
    {
        return Some(location.clone());
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
    let style = reader.choice(source, "style", STYLES);
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

fn lod<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<LodSettings> {
    let lod = reader.part(scene, "lod", &LOD)?;
    let tolerance = reader.number(&lod, "tolerance_px", 0.01..=1e6, 1.0).map(Pixels);
    let patch_depth = patch_depth(reader, &lod);
    let triangles_max = triangles_max(reader, &lod, patch_depth);
    let splits_max = reader.whole(&lod, "splits_max", 1..=65_536, 512);
    let merges_max = reader.whole(&lod, "merges_max", 1..=65_536, 512);
    let level_max = level_max(reader, &lod, patch_depth);
    let wanted_max = reader.whole(&lod, "wanted_max", 1..=4096, 32);
    let morph_s = reader.number(&lod, "morph_s", 0.0..=10.0, 0.25);
    Some(LodSettings {
        tolerance: tolerance?,
        triangles_max: triangles_max?,
        patch_depth: patch_depth?,
        splits_max: splits_max?,
        merges_max: merges_max?,
        level_max: level_max?,
        wanted_max: wanted_max?,
        morph_s: morph_s?,
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
    let value = reader.whole(lod, "triangles_max", 8..=TRIANGLES_MAX, 200_000)?;
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
    reader.counted(scene, "views", nodes.len(), [1, VIEWS_MAX]);
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

fn memory<'t>(reader: &mut Reader<'t>, scene: &Group<'t>) -> Option<MemorySettings> {
    let memory = reader.part(scene, "memory", &MEMORY)?;
    let pages_mib = reader.whole(&memory, "pages_mib", 4..=65_536_u32, 256)?;
    Some(MemorySettings { pages_bytes: u64::from(pages_mib) << 20 })
}

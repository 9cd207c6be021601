//! The spanned reader takes the same texts as the `ron` crate with serde, value for value.
//!
//! In:    the presets, hand-picked texts, and every small corruption of a scene.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: ranges and the wording of faults (`scenes`).

use overfly_config::{FaultKind, PRESETS, SceneFaults, preset, read};
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::{SceneSettings, SourceSettings};
use overfly_core::units::Radians;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
struct RawScene {
    body: RawBody,
    #[serde(default = "one_source")]
    sources: Vec<RawSource>,
    #[serde(default)]
    sea: bool,
    sun: Option<RawSun>,
    #[serde(default)]
    lod: RawLod,
    #[serde(default = "one_view")]
    views: Vec<RawView>,
    #[serde(default)]
    depth: RawDepth,
    #[serde(default)]
    memory: RawMemory,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
enum RawBody {
    Wgs84,
    Moon,
    Mars,
    Sphere { radius_m: f64 },
    Ellipsoid { a_m: f64, f: f64 },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
enum RawSource {
    Archive(String),
    Procedural {
        #[serde(default = "seed")]
        seed: i64,
        #[serde(default = "earthlike")]
        style: RawStyle,
        #[serde(default = "one_f64")]
        relief: f64,
        #[serde(default = "finest_m")]
        finest_m: f64,
        #[serde(default = "one_f64")]
        detail: f64,
    },
}

#[derive(Deserialize)]
enum RawStyle {
    Earthlike,
    Cratered,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Sun")]
struct RawSun {
    latitude_deg: f64,
    longitude_deg: f64,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Lod")]
struct RawLod {
    tolerance_px: f64,
    triangles_max: i64,
    patch_depth: i64,
    splits_max: i64,
    merges_max: i64,
    level_max: i64,
    wanted_max: i64,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "View")]
struct RawView {
    name: String,
    field_of_view_deg: f64,
    yaw_deg: f64,
    pitch_deg: f64,
    near_m: f64,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Depth")]
struct RawDepth {
    splits_m: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Memory")]
struct RawMemory {
    pages_mib: i64,
}

fn seed() -> i64 {
    2029
}

fn one_f64() -> f64 {
    1.0
}

fn finest_m() -> f64 {
    0.15
}

fn earthlike() -> RawStyle {
    RawStyle::Earthlike
}

fn one_source() -> Vec<RawSource> {
    let (seed, relief, finest_m, detail) = (seed(), one_f64(), finest_m(), one_f64());
    vec![RawSource::Procedural { seed, style: earthlike(), relief, finest_m, detail }]
}

fn one_view() -> Vec<RawView> {
    vec![RawView::default()]
}

impl Default for RawLod {
    fn default() -> Self {
        Self {
            tolerance_px: 1.0,
            triangles_max: 100_000,
            patch_depth: 4,
            splits_max: 512,
            merges_max: 512,
            level_max: 50,
            wanted_max: 32,
        }
    }
}

impl Default for RawView {
    fn default() -> Self {
        let name = "front".to_owned();
        Self { name, field_of_view_deg: 60.0, yaw_deg: 0.0, pitch_deg: 0.0, near_m: 0.1 }
    }
}

impl Default for RawDepth {
    fn default() -> Self {
        Self { splits_m: vec![30.0, 10_000.0] }
    }
}

impl Default for RawMemory {
    fn default() -> Self {
        Self { pages_mib: 256 }
    }
}

fn source_line(source: &RawSource) -> String {
    match source {
        RawSource::Archive(location) => location.clone(),
        RawSource::Procedural { seed, style, relief, finest_m, detail } => {
            let style = match style {
                RawStyle::Earthlike => Style::Earthlike,
                RawStyle::Cratered => Style::Cratered,
            };
            format!("{seed} {style:?} {relief:?} {finest_m:?} {detail:?}")
        }
    }
}

/// What `ron` read, as our settings would list it; equal lists mean equal values.
fn listing(raw: &RawScene) -> Vec<String> {
    let body = match raw.body {
        RawBody::Wgs84 => Ellipsoid::WGS84,
        RawBody::Moon => Ellipsoid::MOON,
        RawBody::Mars => Ellipsoid::MARS,
        RawBody::Sphere { radius_m } => Ellipsoid { a_m: radius_m, f: 0.0 },
        RawBody::Ellipsoid { a_m, f } => Ellipsoid { a_m, f },
    };
    let sun = raw
        .sun
        .as_ref()
        .map(|sun| Geodetic::from_degrees(sun.latitude_deg, sun.longitude_deg, 0.0).normal());
    let mut list = vec![format!("{body:?} {:?} {sun:?}", raw.sea)];
    list.extend(raw.sources.iter().map(source_line));
    let lod = &raw.lod;
    let counts = [lod.triangles_max, lod.patch_depth, lod.splits_max, lod.merges_max];
    list.push(format!("{:?} {counts:?} {} {}", lod.tolerance_px, lod.level_max, lod.wanted_max));
    for view in &raw.views {
        let angles = [view.field_of_view_deg, view.yaw_deg, view.pitch_deg];
        let angles = angles.map(|deg| Radians::from_degrees(deg).0);
        list.push(format!("{} {angles:?} {:?}", view.name, view.near_m));
    }
    list.push(format!("{:?} {}", raw.depth.splits_m, raw.memory.pages_mib << 20));
    list
}

/// The same list of what we read.
fn listing_of(scene: &SceneSettings) -> Vec<String> {
    let sun = scene.sun.map(|sun| sun.direction);
    let mut list = vec![format!("{:?} {:?} {sun:?}", scene.body, scene.sea)];
    for source in &scene.sources {
        list.push(match source {
            SourceSettings::Archive { location } => location.clone(),
            SourceSettings::Procedural { seed, style, relief, finest_m, detail } => {
                format!("{seed} {style:?} {relief:?} {finest_m:?} {detail:?}")
            }
        });
    }
    let lod = &scene.lod;
    let patch_depth = u32::from(lod.patch_depth);
    let counts = [lod.triangles_max, patch_depth, lod.splits_max, lod.merges_max];
    list.push(format!("{:?} {counts:?} {} {}", lod.tolerance.0, lod.level_max, lod.wanted_max));
    for view in &scene.views {
        let angles = [view.field_of_view.0, view.yaw.0, view.pitch.0];
        list.push(format!("{} {angles:?} {:?}", view.name, view.near_m));
    }
    list.push(format!("{:?} {}", scene.depth.splits_m, scene.memory.pages_bytes));
    list
}

/// Whether all faults are about values that `ron` cannot judge: ranges and unique names.
fn only_ranges(faults: &SceneFaults) -> bool {
    faults.faults.iter().all(|fault| match &fault.what {
        FaultKind::OutOfRange { .. } => true,
        FaultKind::Missing { .. } => fault.path.starts_with("views["),
        _ => false,
    })
}

/// Asserts that both readers say yes or both say no; tells which.
fn agree(text: &str) -> bool {
    let raw = ron::from_str::<RawScene>(text);
    match (read(text, "scene.ron"), raw) {
        (Ok(scene), Ok(raw)) => {
            assert_eq!(listing_of(&scene), listing(&raw), "in {text}");
            true
        }
        (Ok(_), Err(error)) => panic!("only ron finds {error} in\n{text}"),
        (Err(faults), Ok(_)) => {
            assert!(only_ranges(&faults), "ron takes, but we find\n{faults}\nin {text}");
            true
        }
        (Err(faults), Err(error)) => {
            assert!(!only_ranges(&faults), "ron finds {error}, we find only\n{faults}\nin {text}");
            false
        }
    }
}

/// Small, and with every construct of the format.
const SAMPLE: &str = r#"Scene(
    body: Ellipsoid(a_m: 6.4e6, f: -0.25), // the "body"
    sources: [Archive("a.b"), Procedural(seed: 0x1F, style: Cratered, finest_m: 2)],
    sea: true, /* nested /* one */ comment */
    sun: Some((latitude_deg: -10.5, longitude_deg: +60,)),
    lod: Lod(splits_max: 0b11, merges_max: 1_7),
    views: [(name: "a\u{62}\x63"), (name: r"raw")],
    depth: (splits_m: [30, 1e3]),
    memory: ( pages_mib : 64 , ),
)
"#;

#[test]
fn ron_takes_the_presets_and_reads_the_same_values() {
    for name in PRESETS {
        assert!(agree(preset(name).unwrap()), "{name}");
    }
    assert!(agree(SAMPLE) && read(SAMPLE, "sample").is_ok());
}

#[test]
fn both_take_every_way_of_writing_a_value() {
    for rest in [
        "",
        ",",
        ", sun: None",
        ", sun: Some(\n(latitude_deg: 1, longitude_deg: 2)\n)",
        ", sun: Some (Sun (latitude_deg: 1., longitude_deg: .2,),),",
        ", lod: ()",
        ", lod: (tolerance_px: 1E+0_2, splits_max: 0o17, merges_max: +5, level_max: -0)",
        ", lod: (tolerance_px: 1_000.000_1e-2_)",
        ", lod: (tolerance_px: inf, level_max: 0xfF)",
        ", lod: (tolerance_px: NaN)",
        ", lod: (tolerance_px: -inf)",
        ", depth: (splits_m: [])",
        ", depth: (splits_m: [0.5,])",
        ", depth: (splits_m: [12345678901234567890123456789012345678901234567890])",
        ", views: [(name: r##\"a\"#b\"##)]",
        ", views: [(name: \"tab\\tquote\\\"end\")]",
        ", views: [(name: \"two\nlines\")]",
        ", views: [(name: \"a\\\n    b\\\r\n c\")]",
        ", sources: [Archive ( r#\"a\"# , ), Procedural(detail: 1_0)]",
        ", sources: []",
        "// unclosed",
        "\u{200E}\u{85}\x0B ",
    ] {
        assert!(agree(&format!("Scene(body: Moon{rest}\n)")), "{rest}");
    }
    assert!(agree("(body: Moon) // no end of line"));
    assert!(agree("/**/ Scene /* between */ ( body: Sphere (radius_m: 1000) )"));
}

#[test]
fn both_refuse_what_is_broken() {
    for rest in [
        ", sea: tru",
        ", sea: true()",
        ", sea",
        ",,",
        ", sun: (latitude_deg: 1, longitude_deg: 2)",
        ", sun: Some(latitude_deg: 1, longitude_deg: 2)",
        ", sun: Some()",
        ", sun: Some((latitude_deg: 1))",
        ", lod: Lod",
        ", lod: Load()",
        ", lod: (splits_max: 1.0)",
        ", lod: (splits_max: _1)",
        ", lod: (splits_max: 0x)",
        ", lod: (splits_max: 0x_1)",
        ", lod: (splits_max: 1e3)",
        ", lod: (splits_max: 08x)",
        ", lod: (splits_max: 1 2)",
        ", lod: (tolerance_px: 0x10)",
        ", lod: (tolerance_px: 1._0)",
        ", lod: (tolerance_px: --1)",
        ", lod: (tolerance_px: 1e)",
        ", lod: (tolerance_px: .)",
        ", lod: (tolerance_px: Inf)",
        ", lod: (tolerance_px: nan)",
        ", lod: (splits_max: 5, splits_max: 5)",
        ", lod: (unknown: 5)",
        ", lod: (5)",
        ", lod: {\"splits_max\": 5}",
        ", views: [()()]",
        ", views: [(,)]",
        ", views: ()",
        ", views: [(name: front)]",
        ", views: [(name: 'f')]",
        ", views: [(name: \"\\u{110000}\")]",
        ", views: [(name: \"\\u{}\")]",
        ", views: [(name: \"\\x9\")]",
        ", views: [(name: \"unclosed)]",
        ", depth: (splits_m: [,])",
        ", depth: (splits_m: (1, 2))",
        ", sources: [Procedural]",
        ", sources: [Archive]",
        ", sources: [Archive()]",
        ", sources: [Archive(a: \"b\")]",
        ", sources: [Archive((\"b\"))]",
        ", sources: [Archive(\"a\", \"b\")]",
        ", sources: [Archive(5)]",
        ", sources: [Archive([])]",
        ", sources: [Procedural(1)]",
        ", sources: [procedural()]",
        "/ not a comment",
        "/* unclosed",
    ] {
        assert!(!agree(&format!("Scene(body: Moon{rest}\n)")), "{rest}");
    }
    for text in ["", "Scene", "Scene()", "scene(body: Moon)", "(body: Moon) x", "[body: Moon]"] {
        assert!(!agree(text), "{text}");
    }
    for body in ["Moon()", "Sphere", "Sphere()", "Sphere(1000)", "Sphere(a_m: 1000)", "\"Moon\""] {
        assert!(!agree(&format!("(body: {body})")), "{body}");
    }
}

/// Each character of the sample left out, doubled or replaced, and the end cut off there.
#[test]
fn both_judge_every_small_corruption_alike() {
    const NEW: &str = "()[]{}:,\"'\\/*#._-+ \n0x1eb_rNSé";
    let mut taken = 0;
    let mut refused = 0;
    for (at, old) in SAMPLE.char_indices() {
        let (before, after) = (&SAMPLE[..at], &SAMPLE[at + old.len_utf8()..]);
        let replaced = NEW.chars().map(|new| format!("{before}{new}{after}"));
        let inserted = NEW.chars().map(|new| format!("{before}{new}{old}{after}"));
        let others = [format!("{before}{after}"), before.to_owned()];
        for text in replaced.chain(inserted).chain(others) {
            if agree(&text) {
                taken += 1;
            } else {
                refused += 1;
            }
        }
    }
    assert!(taken > 3000 && refused > 20_000, "{taken} taken, {refused} refused");
}

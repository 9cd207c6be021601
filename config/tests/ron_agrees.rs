//! The spanned reader takes the same texts as the `ron` crate with serde, value for value.
//!
//! In:    the presets, hand-picked texts, and every small corruption of a scene.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: ranges and the wording of faults (`scenes`).

use overfly_config::{FaultKind, PRESETS, SceneFaults, preset, read, utc_text};
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::{DepthSettings, SceneSettings, SourceSettings, SunSettings};
use overfly_core::units::Radians;
use ron::value::RawValue;
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer};

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
struct RawScene {
    body: RawBody,
    #[serde(default = "one_source")]
    sources: Vec<RawSource>,
    #[serde(default)]
    imagery: Vec<String>,
    #[serde(default)]
    sea: bool,
    sun: Option<RawSun>,
    #[serde(default)]
    lod: RawLod,
    #[serde(default = "one_view")]
    views: Vec<RawView>,
    #[serde(default = "two_float")]
    vertices: RawPrecision,
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

/// What may be one of several kinds: `ron` finds its extent, then tries each on its text.
struct RawEither<A, B>(Result<A, B>);

impl<'de, A: DeserializeOwned, B: DeserializeOwned> Deserialize<'de> for RawEither<A, B> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = Box::<RawValue>::deserialize(deserializer)?;
        let first = ron::from_str(raw.get_ron()).map(|first| Self(Ok(first)));
        let second = || ron::from_str(raw.get_ron()).map(|second| Self(Err(second)));
        first.or_else(|_| second()).map_err(D::Error::custom)
    }
}

type RawSun = RawEither<RawFixed, RawClock>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Sun")]
struct RawFixed {
    latitude_deg: f64,
    longitude_deg: f64,
}

/// An enum, for its name must stand there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
enum RawClock {
    Clock {
        utc: String,
        #[serde(default = "yes")]
        runs: bool,
    },
}

#[derive(Deserialize, Debug)]
enum RawPrecision {
    TwoFloat,
    EyeF64,
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
    morph_s: f64,
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
    format: RawFormat,
    order: RawOrder,
    ranges: RawEither<Vec<f64>, RawEither<i64, RawAuto>>,
}

#[derive(Deserialize, Debug)]
enum RawFormat {
    D32F,
    D24,
}

#[derive(Deserialize, Debug)]
enum RawOrder {
    Reversed,
    Forward,
}

#[derive(Deserialize)]
enum RawAuto {
    Auto,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Memory")]
struct RawMemory {
    pages_mib: i64,
}

fn two_float() -> RawPrecision {
    RawPrecision::TwoFloat
}

fn yes() -> bool {
    true
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
            triangles_max: 200_000,
            patch_depth: 4,
            splits_max: 512,
            merges_max: 512,
            level_max: 50,
            wanted_max: 32,
            morph_s: 0.25,
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
        let ranges = RawEither(Err(RawEither(Err(RawAuto::Auto))));
        Self { format: RawFormat::D32F, order: RawOrder::Reversed, ranges }
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
    let sun = raw.sun.as_ref().map(|sun| match &sun.0 {
        Ok(RawFixed { latitude_deg, longitude_deg }) => {
            format!("{:?}", Geodetic::from_degrees(*latitude_deg, *longitude_deg, 0.0).normal())
        }
        Err(RawClock::Clock { utc, runs }) => format!("{utc} {runs}"),
    });
    let mut list = vec![format!("{body:?} {:?} {sun:?}", raw.sea)];
    list.extend(raw.sources.iter().map(source_line));
    let lod = &raw.lod;
    let counts = [lod.triangles_max, lod.patch_depth, lod.splits_max, lod.merges_max];
    list.push(format!("{:?} {counts:?} {} {}", lod.tolerance_px, lod.level_max, lod.wanted_max));
    list.push(format!("{:?} {:?} {:?}", lod.morph_s, raw.imagery, raw.vertices));
    for view in &raw.views {
        let angles = [view.field_of_view_deg, view.yaw_deg, view.pitch_deg];
        let angles = angles.map(|deg| Radians::from_degrees(deg).0);
        list.push(format!("{} {angles:?} {:?}", view.name, view.near_m));
    }
    let RawDepth { format, order, ranges } = &raw.depth;
    list.push(format!("{format:?} {order:?} {}", raw.memory.pages_mib << 20));
    // Borders that are not listed follow from other settings: what they are, `scenes` tests.
    list.extend(ranges.0.as_ref().ok().map(|borders| format!("{borders:?}")));
    list
}

/// The same list of what we read; `borders` if the file lists those of depth.
fn listing_of(scene: &SceneSettings, borders: bool) -> Vec<String> {
    let sun = scene.sun.map(|sun| match sun {
        SunSettings::Fixed { direction } => format!("{direction:?}"),
        SunSettings::Clock { start_unix_s, runs } => format!("{} {runs}", utc_text(start_unix_s)),
    });
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
    list.push(format!("{:?} {:?} {:?}", lod.morph_s, scene.imagery, scene.vertices));
    for view in &scene.views {
        let angles = [view.field_of_view.0, view.yaw.0, view.pitch.0];
        list.push(format!("{} {angles:?} {:?}", view.name, view.near_m));
    }
    let DepthSettings { format, order, splits_m } = &scene.depth;
    list.push(format!("{format:?} {order:?} {}", scene.memory.pages_bytes));
    list.extend(borders.then(|| format!("{splits_m:?}")));
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
            let borders = raw.depth.ranges.0.is_ok();
            assert_eq!(listing_of(&scene, borders), listing(&raw), "in {text}");
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
    imagery: ["a"],
    sea: true, /* nested /* one */ comment */
    sun: Some((latitude_deg: -10.5, longitude_deg: +60,)),
    lod: Lod(splits_max: 0b11, merges_max: 1_7),
    views: [(name: "a\u{62}\x63"), (name: r"raw")],
    vertices: EyeF64,
    depth: (order: Forward, ranges: [30, 1e3]),
    memory: ( pages_mib : 64 , ),
)
"#;

/// The constructs that may stand for those of the other sample.
const OTHER_SAMPLE: &str = r#"(
    body: Moon,
    imagery: [],
    sun: Some(Clock(utc: "2026-06-21T12:00:00Z", runs: false)),
    depth: Depth(format: D24, ranges: Auto),
)
"#;

#[test]
fn ron_takes_the_presets_and_reads_the_same_values() {
    for name in PRESETS {
        assert!(agree(preset(name).unwrap()), "{name}");
    }
    for sample in [SAMPLE, OTHER_SAMPLE] {
        assert!(agree(sample) && read(sample, "sample").is_ok());
    }
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
        ", lod: (morph_s: 1)",
        ", sun: Some(Clock(utc: \"2026-06-21T12:00:00Z\"))",
        ", sun: Some( Clock ( runs : false, utc: r#\"1999-12-31T23:59:59Z\"#, ) , )",
        ", sun: Some(Clock(utc: \"noon\"))",
        ", imagery: []",
        ", imagery: [\"a\", r\"b\",]",
        ", vertices: TwoFloat",
        ", depth: Depth(format: D24, order: Forward, ranges: Auto)",
        ", depth: (format: D32F, order: Reversed)",
        ", depth: (ranges: 3)",
        ", depth: (ranges: +0x3,)",
        ", depth: (ranges: -1)",
        ", depth: (ranges: /**/ Auto /**/)",
        ", depth: (ranges: [])",
        ", depth: (ranges: [0.5,])",
        ", depth: (ranges: [12345678901234567890123456789012345678901234567890])",
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

#[test]
fn both_refuse_what_does_not_say_how_to_draw() {
    for rest in [
        ", lod: (morph_s: 0x1)",
        ", depth: (splits_m: [1])",
        ", depth: (ranges: [,])",
        ", depth: (ranges: (1, 2))",
        ", depth: (ranges: 1.0)",
        ", depth: (ranges: 1e0)",
        ", depth: (ranges: auto)",
        ", depth: (ranges: Auto())",
        ", depth: (ranges: Auto(1))",
        ", depth: (ranges: \"Auto\")",
        ", depth: (ranges: Auto 1)",
        ", depth: (ranges: [1] [2])",
        ", depth: (ranges: None)",
        ", depth: (format: \"D24\")",
        ", depth: (format: D16)",
        ", depth: (order: Forward())",
        ", vertices: Float",
        ", vertices: \"EyeF64\"",
        ", imagery: \"a\"",
        ", imagery: (\"a\")",
        ", imagery: [a]",
        ", imagery: [Archive(\"a\")]",
        ", sun: Clock(utc: \"2026-06-21T12:00:00Z\")",
        ", sun: Some(Clock)",
        ", sun: Some(Clock())",
        ", sun: Some(Clock(runs: true))",
        ", sun: Some(Clock(utc: 5))",
        ", sun: Some(Clock(\"2026-06-21T12:00:00Z\"))",
        ", sun: Some((utc: \"2026-06-21T12:00:00Z\"))",
        ", sun: Some(Sun(utc: \"2026-06-21T12:00:00Z\"))",
        ", sun: Some(Clock(latitude_deg: 1, longitude_deg: 2))",
        ", sun: Some(Clock(utc: \"2026-06-21T12:00:00Z\", runs: 1))",
        ", sun: Some(Clock(utc: \"2026-06-21T12:00:00Z\"), 1)",
    ] {
        assert!(!agree(&format!("Scene(body: Moon{rest}\n)")), "{rest}");
    }
}

/// Each character of the samples left out, doubled or replaced, and the end cut off there.
#[test]
fn both_judge_every_small_corruption_alike() {
    for (sample, taken_min, refused_min) in [(SAMPLE, 3000, 20_000), (OTHER_SAMPLE, 600, 3000)] {
        let (taken, refused) = corrupted(sample);
        assert!(taken > taken_min && refused > refused_min, "{taken} taken, {refused} refused");
    }
}

/// How many corruptions of a text both take, and how many both refuse.
fn corrupted(sample: &str) -> (u32, u32) {
    const NEW: &str = "()[]{}:,\"'\\/*#._-+ \n0x1eb_rNSé";
    let (mut taken, mut refused) = (0, 0);
    for (at, old) in sample.char_indices() {
        let (before, after) = (&sample[..at], &sample[at + old.len_utf8()..]);
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
    (taken, refused)
}

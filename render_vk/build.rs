//! Compiles the shaders: WGSL to SPIR-V in which float arithmetic stays as written.
//!
//! In:    `shaders/*.wgsl`; a program is the concatenation of its files. The crate's features.
//! Out:   `$OUT_DIR/<program>.spv`, one module for all its entry points; a table in `programs.rs`.
//! Keeps: nothing.
//! Not here: pipelines (`src/passes`).

#[path = "spirv_pass.rs"]
mod spirv_pass;

use naga::back::spv::{Options, WriterFlags, ZeroInitializeWorkgroupMemoryMode};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::fmt::Write as _;
use std::{env, fs, path::PathBuf};

/// Names of files or of features.
type Names = &'static [&'static str];

/// Vertex programs of the ground: how vertices are placed × whether they move × for whom, which a
/// feature may be needed for.
const PLACES: [(&str, Names); 2] =
    [("two_float", &["two_float", "place_two_float"]), ("eye", &["place_eye"])];
const ENTRIES: [(&str, Option<&str>, Names); 6] = [
    ("", None, &["point", "vertex"]),
    ("_morph", None, &["point", "morph", "vertex_morph"]),
    ("_drape", Some("imagery"), &["point_drape", "patch", "drape_place", "vertex_drape"]),
    (
        "_morph_drape",
        Some("imagery"),
        &["point_drape", "patch", "drape_place", "morph", "vertex_morph_drape"],
    ),
    ("_debug", Some("debug"), &["point_debug", "patch", "vertex_debug"]),
    ("_morph_debug", Some("debug"), &["point_debug", "patch", "morph", "vertex_morph_debug"]),
];

/// Light: with sea and air or not × with a sun or not. What lights, what it falls on.
const LIT: [(&str, Names, [Names; 2]); 4] = [
    ("", &[], [&["light", "no_sun", "no_air"], &["regolith", "no_sea"]]),
    ("_sea", &["sea"], [&["light", "no_sun", "air"], &["land", "no_glint", "sea"]]),
    ("_sun", &["sun"], [&["light", "sun", "no_air"], &["regolith", "no_sea"]]),
    ("_sea_sun", &["sea", "sun"], [&["light", "sun", "air"], &["land", "glint", "sea"]]),
];

/// A program's name, and its files.
type Program = (String, Vec<&'static str>);

/// All programs of a build with these features.
fn programs(has: &dyn Fn(&str) -> bool) -> Vec<Program> {
    let mut programs = vec![("self_test".to_owned(), vec!["two_float", "self_test"])];
    if has("debug") {
        programs.push(("debug".to_owned(), vec!["view", "point_debug", "debug"]));
    }
    if has("overlay") {
        programs.push(("overlay".to_owned(), vec!["view", "overlay"]));
    }
    for (place, first) in PLACES {
        for (entry, _, last) in ENTRIES.iter().filter(|(_, need, _)| need.is_none_or(has)) {
            let files = [&["view", "clip"], first, last].concat();
            programs.push((format!("ground_{place}{entry}"), files));
        }
    }
    for (lit, _, [light, ground]) in LIT.iter().filter(|(_, needs, _)| needs.iter().all(|n| has(n)))
    {
        let mut terrain = |drape: &str, point: &[&'static str]| {
            let files = [&["view"], *light, &["grain"], point, *ground, &["terrain"]].concat();
            programs.push((format!("terrain{lit}{drape}"), files));
        };
        terrain("", &["point", "no_drape"]);
        if has("imagery") {
            terrain("_drape", &["point_drape", "drape"]);
        }
        if has("sky") {
            programs.push((format!("sky{lit}"), [&["view"], *light, &["sky"]].concat()));
        }
    }
    programs
}

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=spirv_pass.rs");
    println!("cargo::rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let has =
        |feature: &str| env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase())).is_some();
    let mut table = String::from("pub(super) const PROGRAMS: &[(&str, &[u8])] = &[\n");
    for (program, files) in &programs(&has) {
        let words = spirv_pass::without_contraction(&compile(program, files));
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let path = out.join(program).with_extension("spv");
        fs::write(&path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let _ = writeln!(table, "    ({program:?}, include_bytes!({:?})),", path.display());
    }
    let path = out.join("programs.rs");
    fs::write(&path, table + "];\n").unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// One program's SPIR-V, before the pass. A fault in a shader ends the build with its place.
fn compile(program: &str, files: &[&str]) -> Vec<u32> {
    let read = |name: &&str| {
        let path = format!("shaders/{name}.wgsl");
        fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
    };
    let text: String = files.iter().map(read).collect::<Vec<_>>().join("\n");
    let module = naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(&text, program)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(&text, program)));
    naga::back::spv::write_vec(&module, &info, &options(), None)
        .unwrap_or_else(|e| panic!("{program}: {e}"))
}

/// Plain Vulkan: none of the guards that a browser needs, no flipped y axis.
fn options() -> Options<'static> {
    Options {
        lang_version: (1, 3),
        flags: WriterFlags::LABEL_VARYINGS,
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Unchecked,
            buffer: BoundsCheckPolicy::Unchecked,
            image_load: BoundsCheckPolicy::Unchecked,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        zero_initialize_workgroup_memory: ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        emit_int_div_checks: false,
        ..Options::default()
    }
}

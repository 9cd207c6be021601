//! Compiles the shaders: WGSL to SPIR-V in which float arithmetic stays as written.
//!
//! In:    `shaders/*.wgsl`; a program is the concatenation of its files.
//! Out:   `$OUT_DIR/<program>.spv`, one module for all its entry points.
//! Keeps: nothing.
//! Not here: pipelines (`src/passes`).

#[path = "spirv_pass.rs"]
mod spirv_pass;

use naga::back::spv::{Options, WriterFlags, ZeroInitializeWorkgroupMemoryMode};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::{env, fs, path::PathBuf};

/// Vertex programs of the ground: how vertices are placed × whether they move × for whom.
const PLACES: [(&str, &[&str]); 2] =
    [("two_float", &["two_float", "place_two_float"]), ("eye", &["place_eye"])];
const ENTRIES: [(&str, &[&str]); 6] = [
    ("", &["point", "vertex"]),
    ("_morph", &["point", "morph", "vertex_morph"]),
    ("_drape", &["point_drape", "patch", "drape_place", "vertex_drape"]),
    ("_morph_drape", &["point_drape", "patch", "drape_place", "morph", "vertex_morph_drape"]),
    ("_debug", &["point_debug", "patch", "vertex_debug"]),
    ("_morph_debug", &["point_debug", "patch", "morph", "vertex_morph_debug"]),
];

const PROGRAMS: [(&str, &[&str]); 6] = [
    ("terrain", &["view", "air", "grain", "point", "no_drape", "terrain"]),
    ("terrain_drape", &["view", "air", "grain", "point_drape", "drape", "terrain"]),
    ("debug", &["view", "point_debug", "debug"]),
    ("sky", &["view", "air", "sky"]),
    ("overlay", &["view", "overlay"]),
    ("self_test", &["two_float", "self_test"]),
];

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=spirv_pass.rs");
    println!("cargo::rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let mut programs: Vec<(String, Vec<&str>)> =
        PROGRAMS.iter().map(|(program, files)| ((*program).to_owned(), files.to_vec())).collect();
    for (place, first) in PLACES {
        for (entry, last) in ENTRIES {
            let files = [&["view", "clip"], first, last].concat();
            programs.push((format!("ground_{place}{entry}"), files));
        }
    }
    for (program, files) in &programs {
        let words = spirv_pass::without_contraction(&compile(program, files));
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let path = out.join(program).with_extension("spv");
        fs::write(&path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
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

//! `include/overfly.h` is what cbindgen makes of the sources, and compiles alone as C and as C++.
//!
//! In:    the sources, the header, the system's compilers.
//! Out:   test results; with `OVERFLY_RENEW_HEADER=1` the header itself.
//! Keeps: nothing.
//! Not here: the examples (`examples`).

use super::examples::{compiler, folder};
use std::fs;

/// The sources that are the header, in its order.
const SOURCES: [&str; 15] = [
    "status",
    "scene",
    "host",
    "terrain",
    "frame",
    "columns",
    "renderer",
    "overlay",
    "drawing",
    "ground",
    "queries",
    "rays",
    "regions",
    "recording",
    "version",
];

const HEAD: &str = "\
/* overfly.h: the terrain backend of a flight simulator, for C11 and C++17.
 *
 * Made by cbindgen from capi/src: change it there. docs/c.md is the page to read first.
 *
 * Handles are numbers, checked at each use: one that was destroyed, twice or by another thread,
 * that is 0 or was never given out ends a call with OVF_STALE.
 *
 * Pointers. Each is null or good until the call returns, for as many elements as the function says,
 * aligned for its type, and nobody else writes there meanwhile. Texts are UTF-8 with a NUL at their
 * end. Null is answered with OVF_NULL_POINTER where it may not be. Nothing of the host's is kept
 * but the functions and `user` of ovf_host, and what ovf_device and ovf_target name of Vulkan.
 *
 * Structs that begin with struct_size want sizeof there, also where they are only written: later
 * versions append fields, and take the shorter structs of older programs. Set all of a struct to 0
 * first: 0 is what fields that you do not know yet shall be. Structs without it never change.
 *
 * Numbers carry their unit in their name. ECEF is body-fixed: x to latitude and longitude 0, z to
 * the north pole. Heights are above the ellipsoid unless a name says otherwise.
 *
 * Threads. Calls on one terrain are for one thread at a time, whichever: another one gets OVF_BUSY
 * and does not wait. So are calls on one renderer, but that ovf_renderer_record_range and
 * _record_overlay may be in several; ovf_renderer_record_uploads is a call on the terrain as well.
 * For any thread at any time are ovf_terrain_work, _run_task and _load_page, all of ovf_ground_*,
 * ovf_last_error and ovf_version.
 *
 * Vulkan is the host's: none of it is needed to build or link this, nor to run it without
 * ovf_renderer. What can be looked at is checked; for the rest the host vouches. Its handles are
 * good, belong together and stay until the renderer is destroyed, and so does the library that they
 * are of; a device has finished what was recorded when the renderer is destroyed. Command buffers
 * are of the renderer's queue family and are recorded by no other thread during a call.
 */";

fn source(name: &str) -> String {
    folder().join("src").join(name).with_extension("rs").display().to_string()
}

fn generated() -> String {
    let mut config = cbindgen::Config {
        language: cbindgen::Language::C,
        header: Some(HEAD.into()),
        include_guard: Some("OVERFLY_H".into()),
        no_includes: true,
        sys_includes: vec!["stdint.h".into()],
        cpp_compat: true,
        documentation_style: cbindgen::DocumentationStyle::Doxy,
        line_length: 100,
        ..cbindgen::Config::default()
    };
    config.function.args = cbindgen::Layout::Auto;
    let mut builder = cbindgen::Builder::new().with_config(config);
    for name in SOURCES {
        builder = builder.with_src(source(name));
    }
    let bindings = builder.generate().expect("the sources can be read");
    let mut text = Vec::new();
    bindings.write(&mut text);
    let text = String::from_utf8(text).unwrap();
    // For C the head of the file has said it.
    let lines: Vec<_> = text.lines().collect();
    let mut kept: Vec<&str> = Vec::new();
    for line in lines {
        let word = line.trim_start_matches([' ', '*']);
        if word == "# Safety" {
            kept.pop();
        } else if word != "The rules of pointers, above." {
            kept.push(line);
        }
    }
    let text = kept.join("\n") + "\n";
    let other = text.find("# Safety").map(|at| &text[at - 20..at + 60]);
    assert_eq!(other, None, "a function's safety is told in other words");
    text
}

#[test]
fn the_header_is_what_cbindgen_makes_now() {
    let (path, made) = (folder().join("include/overfly.h"), generated());
    if std::env::var_os("OVERFLY_RENEW_HEADER").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == made, "set OVERFLY_RENEW_HEADER=1 and run this test: overfly.h is outdated");
}

#[test]
fn every_exported_function_is_in_the_header_once() {
    let header = generated();
    let mut functions = 0;
    for entry in fs::read_dir(folder().join("src")).unwrap() {
        let text = fs::read_to_string(entry.unwrap().path()).unwrap();
        for line in text.lines().filter(|line| line.contains("extern \"C\" fn ovf_")) {
            let name = line.split("fn ").nth(1).unwrap().split('(').next().unwrap();
            let times = header.matches(&format!("{name}(")).count();
            assert_eq!(times, 1, "{name} is in the header so often");
            functions += 1;
        }
    }
    assert!(functions > 42, "{functions}");
}

#[test]
fn the_header_compiles_alone_as_c11_and_cpp17() {
    let out = tempfile::tempdir().unwrap();
    let includes = format!("-I{}", folder().join("include").display());
    for (language, standard, extension) in [("cc", "c11", "c"), ("c++", "c++17", "cpp")] {
        let Some(mut compiler) = compiler(language) else { continue };
        let file = out.path().join("alone").with_extension(extension);
        let twice = "#include <overfly.h>\n#include <overfly.h>\n";
        let main = "int main(void) { return ovf_version() == 0 ? OVF_STALE : OVF_OK; }\n";
        fs::write(&file, format!("{twice}{main}")).unwrap();
        let flags = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"];
        compiler.arg(format!("-std={standard}")).args(flags).arg(&includes).arg(&file);
        let done = compiler.output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
}

#[test]
fn sizes_are_what_c_sees() {
    let Some(mut compiler) = compiler("cc") else { return };
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("sizes.c");
    let sizes = super::calls::SIZES;
    let checks = sizes
        .iter()
        .map(|(name, size)| format!("_Static_assert(sizeof({name}) == {size}, \"{name}\");\n"));
    let text = format!("#include <overfly.h>\n{}", checks.collect::<String>());
    fs::write(&file, text).unwrap();
    let includes = format!("-I{}", folder().join("include").display());
    let done = compiler.args(["-std=c11", "-fsyntax-only", &includes]).arg(&file).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

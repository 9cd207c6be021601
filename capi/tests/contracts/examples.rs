//! The examples in C and C++, compiled with the system's compilers and run.
//!
//! In:    `examples/c`, the shared library that this test's build made beside it.
//! Out:   test results; what is missing on this machine is printed as skipped.
//! Keeps: nothing.
//! Not here: CMake, which CI may lack (`docs/c.md` has the lines).

use super::calls::flown_in_rust;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// This package.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A program of this machine, or a line that it is missing.
pub fn compiler(name: &str) -> Option<Command> {
    let there = Command::new(name).arg("--version").output().is_ok_and(|it| it.status.success());
    if !there {
        println!("skipped: no {name} on this machine");
    }
    there.then(|| Command::new(name))
}

/// Where the shared library lies: beside this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let beside = test.parent().unwrap();
    let name = format!("{}overfly_c{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    assert!(beside.join(&name).exists(), "{name} is not in {}", beside.display());
    beside.to_owned()
}

/// Compiles an example and links it with the library; `None` without a compiler.
fn built(language: &str, source: &str, out: &Path) -> Option<PathBuf> {
    built_with(language, source, (out, &[]))
}

/// The same, with more libraries.
pub fn built_with(
    language: &str,
    source: &str,
    (out, libraries): (&Path, &[&str]),
) -> Option<PathBuf> {
    let mut compiler = compiler(language)?;
    let standard = if language == "cc" { "-std=c11" } else { "-std=c++17" };
    let program = out.join(source).with_extension("");
    let library = library();
    compiler
        .args([standard, "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-g"])
        .arg("-ffp-contract=off")
        .arg(format!("-I{}", folder().join("include").display()))
        .arg(folder().join("../examples/c").join(source))
        .arg("-o")
        .arg(&program)
        .arg(format!("-L{}", library.display()))
        .arg(format!("-Wl,-rpath,{}", library.display()))
        .args(["-loverfly_c", "-lpthread", "-lm"])
        .args(libraries);
    let done = compiler.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    Some(program)
}

/// What a program said; it must have succeeded.
pub fn out_of(done: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&done.stdout), text(&done.stderr));
    assert!(done.status.success(), "{}\n{out}\n{err}", done.status);
    out
}

fn digest_line(frames: usize) -> String {
    format!("digest    {:016x}", flown_in_rust(frames).last().unwrap().all())
}

#[test]
fn the_flight_in_c_ends_in_the_digest_of_the_same_flight_in_rust() {
    let out = tempfile::tempdir().unwrap();
    let Some(program) = built("cc", "flight.c", out.path()) else { return };
    let said = out_of(&Command::new(&program).output().unwrap());
    assert!(said.contains("frames    300"), "{said}");
    assert!(said.contains(&digest_line(300)), "{said}\nwanted {}", digest_line(300));
    assert_eq!(Command::new(&program).arg("3").status().unwrap().code(), Some(2));
}

#[test]
fn valgrind_finds_nothing_in_the_flight_in_c() {
    let Some(mut valgrind) = compiler("valgrind") else { return };
    let out = tempfile::tempdir().unwrap();
    let Some(program) = built("cc", "flight.c", out.path()) else { return };
    valgrind.args(["--error-exitcode=9", "--leak-check=full", "--fair-sched=yes", "-q"]);
    valgrind.args(["--errors-for-leak-kinds=definite", "--show-leak-kinds=definite"]);
    let said = out_of(&valgrind.arg(&program).arg("12").output().unwrap());
    assert!(said.contains(&digest_line(12)), "{said}");
}

#[test]
fn the_contacts_in_cpp_agree_with_themselves() {
    let out = tempfile::tempdir().unwrap();
    let Some(program) = built("c++", "contacts.cpp", out.path()) else { return };
    let said = out_of(&Command::new(&program).output().unwrap());
    assert_eq!(said.lines().count(), 6, "{said}");
    assert!(said.contains("agl  -6.5000 ft"), "{said}");
}

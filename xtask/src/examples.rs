//! `cargo xtask examples`: the examples in C, C++ and Python, as those have them who installed overfly.
//!
//! In:    CMake and compilers; a Python with venv and the network; a software Vulkan; valgrind.
//! Out:   `target/examples`; what was built and run, what was skipped for want of which of these.
//! Keeps: the installed library and module, so that the next run only builds.
//! Not here: examples in Rust, which `cargo test` builds and runs; Python's (`python`).

use crate::capi::Install;
use crate::python;
use crate::set_up::Vulkan;
use crate::steps::{Step, Stopped, run, target};
use std::path::Path;
use std::process::Command;

/// What building with CMake takes.
const TOOLS: [&str; 4] = ["cmake", "make", "cc", "c++"];
/// Leaks that nothing points to any more, and reads and writes of what is not there, fail.
const VALGRIND: [&str; 6] = [
    "--quiet",
    "--error-exitcode=9",
    "--leak-check=full",
    "--show-leak-kinds=definite",
    "--errors-for-leak-kinds=definite",
    "--fair-sched=yes",
];

/// Runs those in C, then those in Python, also if the former failed.
pub fn examples(root: &Path, cargo: &str, vulkan: Vulkan) -> Result<(), Stopped> {
    let in_c = in_c(root, cargo, vulkan);
    if let Err(stopped) = &in_c {
        println!("   {stopped}");
    }
    in_c.and(python::examples(root, cargo))
}

/// Installs the library for C, builds `examples/c` against it with CMake and runs the programs.
fn in_c(root: &Path, cargo: &str, vulkan: Vulkan) -> Result<(), Stopped> {
    if let Some(tool) = TOOLS.into_iter().find(|tool| !is_there(tool)) {
        println!("skipped: examples in C, since there is no {tool}");
        return Ok(());
    }
    let folder = target(root).join("examples");
    let (prefix, built) = (folder.join("installed"), folder.join("built"));
    Install::debug(prefix.clone()).install(root, cargo)?;
    // What CMake remembers is of one checkout, and a build takes a second. It may not be there yet.
    let _ = std::fs::remove_dir_all(&built);
    let out = built.display().to_string();
    let prefix = format!("-DCMAKE_PREFIX_PATH={}", prefix.display());
    let cmake = |why| Step::new("cmake", why, "cmake");
    let configure = cmake("as docs/c.md has it").with(&["-S", "examples/c", "-B", &out, &prefix]);
    run(root, &configure)?;
    run(root, &cmake("compilers may warn of nothing").with(&["--build", &out]))?;
    let valgrind = is_there("valgrind");
    if !valgrind {
        println!("skipped: memory of the examples in C, since there is no valgrind");
    }
    for (name, words) in [("flight", &["10"][..]), ("contacts", &[])] {
        run(root, &program(&built, name, valgrind).with(words))?;
    }
    let host = built.join("own_vulkan");
    match vulkan {
        _ if !host.exists() => println!("skipped: own_vulkan, since CMake found no Vulkan"),
        // Not under valgrind, which takes 5 minutes and finds leaks of Mesa and the layer alone.
        Vulkan::Lavapipe => {
            let picture = folder.join("own_vulkan.ppm").display().to_string();
            run(root, &program(&built, "own_vulkan", false).with(&[&picture]))?;
        }
        _ => println!("skipped: own_vulkan, since no software Vulkan was found"),
    }
    Ok(())
}

fn program(built: &Path, name: &str, valgrind: bool) -> Step {
    let path = built.join(name).display().to_string();
    if valgrind {
        Step::new(name, "memory is looked after", "valgrind").with(&VALGRIND).with(&[&path])
    } else {
        Step::new(name, "it says itself whether all was well", &path)
    }
}

fn is_there(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok_and(|said| said.status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_answers_is_there_and_what_is_nowhere_is_not() {
        assert!(is_there(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".into())));
        assert!(!is_there("no-such-tool"));
    }
}

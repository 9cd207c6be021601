//! `cargo xtask python`: the Python module in an environment of its own, and what holds it.
//!
//! In:    a Python of 3.10 or later with venv; the network, for maturin and numpy.
//! Out:   `target/python`; every example of docstrings and `docs/python.md` run, bad input refused.
//! Keeps: the environment, so that the next run only builds.
//! Not here: what is checked (`python/tests/smoke.py`).

use crate::steps::{Step, Stopped, run};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the build needs, and what the module needs.
const PACKAGES: [&str; 2] = ["maturin>=1.9,<2", "numpy>=1.26"];
/// The oldest Python that the module runs on.
const ABOUT: &str = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))";

/// Installs the module and runs its checks; says why not where there is nothing to do that with.
pub fn python(root: &Path, cargo: &str) -> Result<(), Stopped> {
    let fit = Command::new("python3").args(["-c", ABOUT]).output();
    if !fit.is_ok_and(|fit| fit.status.success()) {
        println!("skipped: there is no python3 of 3.10 or later with venv");
        return Ok(());
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from);
    let target = root.join(target);
    let venv = target.join("python");
    let python = venv.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let python = python.display().to_string();
    let make = Step::new("environment", "packages of others stay as they are", "python3");
    run(root, &make.with(&["-m", "venv", &venv.display().to_string()]))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    let packages = Step::new("packages", "what the module is built with and runs on", &python);
    if let Err(stopped) = run(root, &packages.with(&pip).with(&PACKAGES)) {
        println!("skipped: {stopped}; is there a network?");
        return Ok(());
    }
    // The checks are as sharp with the debug build, which shares its crates with the tests.
    let build = Step::new("program", "the module is held against it", cargo);
    run(root, &build.with(&["build", "--quiet", "--locked", "--package", "overfly"]))?;
    let install = Step::new("install", "as `pip install .` does", &python);
    let install = install.set("MATURIN_PEP517_ARGS", "--profile dev --locked");
    let own = ["--force-reinstall", "--no-deps", "--no-build-isolation", "."];
    // maturin calls cargo, and looks for itself among the programs.
    let path = with_front(&venv.join(if cfg!(windows) { "Scripts" } else { "bin" }));
    run(root, &install.set("PATH", &path).with(&pip).with(&own))?;
    let program = target.join("debug").join(format!("overfly{}", std::env::consts::EXE_SUFFIX));
    let program = program.display().to_string();
    let checks = Step::new("checks", "examples run, bad input is refused", &python);
    let smoke = ["python/tests/smoke.py", "--page", "docs/python.md", "--program"];
    run(root, &checks.with(&smoke).with(&[&program]))
}

/// The search path with a folder before all others.
fn with_front(folder: &Path) -> String {
    let rest = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder.to_owned()).chain(std::env::split_paths(&rest));
    let path = std::env::join_paths(all).unwrap_or(rest);
    path.to_string_lossy().into_owned()
}

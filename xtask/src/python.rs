//! `cargo xtask python`: the Python module in an environment of its own, and what holds it.
//!
//! In:    a Python of 3.10 or later with venv; the network, for maturin and numpy, and for JSBSim.
//! Out:   `target/python`; every example of docstrings and `docs/python.md` run, bad input refused;
//!        `target/examples/jsbsim`, a flight.
//! Keeps: the environment, so that the next run only builds.
//! Not here: what is checked (`python/tests/smoke.py`, `examples/jsbsim_flight.py`).

use crate::steps::{Step, Stopped, run, run_heard, target};
use std::path::Path;
use std::process::Command;

/// What the build needs, and what the module needs.
const PACKAGES: [&str; 2] = ["maturin>=1.9,<2", "numpy>=1.26"];
/// What the example flies. Where there is no wheel, nobody wants to wait for its compiler.
const JSBSIM: [&str; 3] = ["--only-binary", "jsbsim", "jsbsim"];
/// The oldest Python that the module runs on.
const ABOUT: &str = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))";
const PIP: [&str; 5] = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];

/// Installs the module and runs its checks; says why not where there is nothing to do that with.
pub fn python(root: &Path, cargo: &str) -> Result<(), Stopped> {
    installed_and_checked(root, cargo).map(|_| ())
}

/// The same; then JSBSim's Cessna flies over the ground.
pub fn examples(root: &Path, cargo: &str) -> Result<(), Stopped> {
    let Some(python) = installed_and_checked(root, cargo)? else { return Ok(()) };
    if !fetched(root, ("jsbsim", "what the example flies", &python), &JSBSIM)? {
        return Ok(());
    }
    let out = target(root).join("examples/jsbsim").display().to_string();
    let flight = Step::new("flight", "flown twice to the same bytes, which replay", &python);
    let example = ["examples/jsbsim_flight.py", "--out", &out];
    run(root, &flight.with(&example).with(&["--minutes", "0.5", "--again"]))
}

/// The interpreter of the environment that the module is in; `None` where there is none.
fn installed_and_checked(root: &Path, cargo: &str) -> Result<Option<String>, Stopped> {
    let fit = Command::new("python3").args(["-c", ABOUT]).output();
    if !fit.is_ok_and(|fit| fit.status.success()) {
        println!("skipped: there is no python3 of 3.10 or later with venv");
        return Ok(None);
    }
    let target = target(root);
    let venv = target.join("python");
    let python = venv.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let python = python.display().to_string();
    let make = Step::new("environment", "packages of others stay as they are", "python3");
    run(root, &make.with(&["-m", "venv", &venv.display().to_string()]))?;
    let why = "what the module is built with and runs on";
    if !fetched(root, ("packages", why, &python), &PACKAGES)? {
        return Ok(None);
    }
    // The checks are as sharp with the debug build. Both are built at once, so that crates of others
    // have the features that maturin will ask for.
    let build = Step::new("program", "the module is held against it", cargo);
    let both = ["--package", "overfly", "--package", "overfly-python"];
    run(root, &build.with(&["build", "--quiet", "--locked"]).with(&both))?;
    let install = Step::new("install", "as `pip install .` does", &python);
    let install = install.set("MATURIN_PEP517_ARGS", "--profile dev --locked");
    let own = ["--force-reinstall", "--no-deps", "--no-build-isolation", "."];
    // maturin calls cargo, and looks for itself among the programs.
    let path = with_front(&venv.join(if cfg!(windows) { "Scripts" } else { "bin" }));
    run(root, &install.set("PATH", &path).with(&PIP).with(&own))?;
    let program = target.join("debug").join(format!("overfly{}", std::env::consts::EXE_SUFFIX));
    let program = program.display().to_string();
    let checks = Step::new("checks", "examples run, bad input is refused", &python);
    let smoke = ["python/tests/smoke.py", "--page", "docs/python.md", "--program"];
    run(root, &checks.with(&smoke).with(&[&program]))?;
    Ok(Some(python))
}

/// Installs packages of others; whether they are there now. Only where none can be had that is not
/// a failure.
fn fetched(
    root: &Path,
    (name, why, python): (&str, &str, &str),
    packages: &[&str],
) -> Result<bool, Stopped> {
    let step = Step::new(name, why, python).with(&PIP).with(packages);
    match run_heard(root, &step) {
        Ok(()) => Ok(true),
        Err((_, said)) if is_out_of_reach(&said) => {
            println!("skipped: pip cannot have {}; is there a network?", packages.join(" "));
            Ok(false)
        }
        Err((stopped, _)) => Err(stopped),
    }
}

/// Whether pip's errors are those of a network or of a package that is made for other machines.
fn is_out_of_reach(said: &str) -> bool {
    ["(from versions: none)", "ConnectionPool(", "Connection broken", "Read timed out"]
        .iter()
        .any(|words| said.contains(words))
}

/// The search path with a folder before all others.
fn with_front(folder: &Path) -> String {
    let rest = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder.to_owned()).chain(std::env::split_paths(&rest));
    let path = std::env::join_paths(all).unwrap_or(rest);
    path.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_cannot_be_reached_is_skipped() {
        let none = "ERROR: Could not find a version that satisfies the requirement numpy>=1.26 \
                    (from versions: none)\nERROR: No matching distribution found for numpy>=1.26\n";
        let lost = "WARNING: Retrying after HTTPSConnectionPool(host='pypi.org', port=443)";
        let wrong = "ERROR: Could not find a version that satisfies the requirement numpy>=99 \
                     (from versions: 1.26.4, 2.0.0)\nERROR: No matching distribution found";
        let full = "ERROR: Could not install packages due to an OSError: [Errno 28] No space left";
        assert!(is_out_of_reach(none) && is_out_of_reach(lost));
        assert!(!is_out_of_reach(wrong) && !is_out_of_reach(full) && !is_out_of_reach(""));
    }
}

//! Builds and installs the C border: header, libraries, pkg-config file.
//!
//! In:    a prefix, whether optimised.
//! Out:   `include/overfly.h`, `lib/liboverfly_c.*`, `lib/pkgconfig/overfly.pc` below it.
//! Keeps: nothing.
//! Not here: the header's making (`capi/tests/contracts/header.rs`).

use crate::steps::{Step, Stopped, run, target};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A library with ours in it and nothing else.
const PROBE: &str = "extern crate overfly_c;\n";

/// What `cargo xtask capi` was asked for.
pub struct Install {
    prefix: PathBuf,
    dev: bool,
}

impl Install {
    /// The debug build, below `prefix`.
    pub fn debug(prefix: PathBuf) -> Self {
        Self { prefix, dev: true }
    }

    /// Reads the words after `capi`.
    pub fn parse(words: &[&str]) -> Result<Self, String> {
        match *words {
            ["--prefix", prefix] => Ok(Self { prefix: prefix.into(), dev: false }),
            ["--prefix", prefix, "--dev"] => Ok(Self { prefix: prefix.into(), dev: true }),
            _ => Err("capi needs --prefix DIR, and may have --dev after it".into()),
        }
    }

    /// Builds, then copies.
    pub fn install(&self, root: &Path, cargo: &str) -> Result<(), Stopped> {
        // Beside Python's, whose crates have some features more: so both take the same builds.
        let profile: &[&str] = if self.dev { &["-p", "overfly-python"] } else { &["--release"] };
        let why = "liboverfly_c, shared and static";
        let build = Step::new("build", why, cargo).with(&["build", "-p", "overfly-capi"]);
        run(root, &build.with(profile))?;
        let built = target(root).join(if self.dev { "debug" } else { "release" });
        let system = system_libraries(&built);
        self.copy(root, &built, &system).map_err(|error| Stopped {
            step: "install".into(),
            what: format!("could not write to {}: {error}", self.prefix.display()),
            code: 1,
        })?;
        println!("\nInstalled below {}. With", self.prefix.display());
        println!("  export PKG_CONFIG_PATH={}", self.library().join("pkgconfig").display());
        println!("programs are built with `cc … $(pkg-config --cflags --libs overfly)`.");
        Ok(())
    }

    fn library(&self) -> PathBuf {
        self.prefix.join("lib")
    }

    fn copy(&self, root: &Path, built: &Path, system: &str) -> std::io::Result<()> {
        fs::create_dir_all(self.prefix.join("include"))?;
        fs::create_dir_all(self.library().join("pkgconfig"))?;
        fs::copy(root.join("capi/include/overfly.h"), self.prefix.join("include/overfly.h"))?;
        let names = ["liboverfly_c.so", "liboverfly_c.dylib", "overfly_c.dll", "overfly_c.dll.lib"];
        let names = names.into_iter().chain(["liboverfly_c.a", "overfly_c.lib"]);
        for name in names.filter(|name| built.join(name).exists()) {
            // A library that runs must not be written into: the new one takes its place.
            let part = self.library().join(format!("{name}.part"));
            fs::copy(built.join(name), &part)?;
            fs::rename(part, self.library().join(name))?;
        }
        let prefix = fs::canonicalize(&self.prefix)?;
        let text = pkg_config(&prefix.display().to_string(), system);
        fs::write(self.library().join("pkgconfig/overfly.pc"), text)
    }
}

/// The text of `overfly.pc`.
fn pkg_config(prefix: &str, system: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!(
        "prefix={prefix}\n\
         libdir=${{prefix}}/lib\n\
         includedir=${{prefix}}/include\n\
         \n\
         Name: overfly\n\
         Description: Terrain backend of a flight simulator\n\
         Version: {version}\n\
         Cflags: -I${{includedir}}\n\
         Libs: -L${{libdir}} -loverfly_c\n\
         Libs.private: {system}\n"
    )
}

/// What a program needs beside the static library, as rustc says it of a library that has ours in
/// it; nothing where it does not.
fn system_libraries(built: &Path) -> String {
    let out = built.join("overfly_c_link");
    if fs::create_dir_all(&out).is_err() || fs::write(out.join("in.rs"), PROBE).is_err() {
        return String::new();
    }
    let mut command = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into()));
    command.args(["--edition=2024", "--crate-type=staticlib", "--print=native-static-libs", "-L"]);
    command.arg(format!("dependency={}", built.join("deps").display())).arg("--extern");
    command.arg(format!("overfly_c={}", built.join("liboverfly_c.rlib").display()));
    command.arg("-o").arg(out.join("out.a")).arg(out.join("in.rs"));
    let said = command.output().map(|done| done.stderr).unwrap_or_default();
    let said = String::from_utf8_lossy(&said).into_owned();
    let line = said.lines().find_map(|line| line.split_once("native-static-libs: "));
    line.map_or(String::new(), |(_, libraries)| libraries.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prefix_is_needed_and_nothing_else_is_taken() {
        assert!(Install::parse(&["--prefix", "a"]).is_ok_and(|it| !it.dev));
        assert!(Install::parse(&["--prefix", "a", "--dev"]).is_ok_and(|it| it.dev));
        for words in [&[][..], &["--prefix"], &["a"], &["--prefix", "a", "b"]] {
            assert!(Install::parse(words).is_err());
        }
    }

    #[test]
    fn the_pkg_config_file_names_both_folders() {
        let text = pkg_config("/opt/it", "-lm");
        assert!(text.starts_with("prefix=/opt/it\nlibdir=${prefix}/lib\n"), "{text}");
        assert!(text.contains("Libs: -L${libdir} -loverfly_c\nLibs.private: -lm\n"), "{text}");
    }
}

//! Set-up, checks and results: `cargo xtask demo`, `test`, `examples`, `trade` and others.
//!
//! In:    one word on the command line.
//! Out:   what is done, why, how long it took, and an exit code.
//! Keeps: nothing; drawings go to `out/demo`.
//! Not here: the terrain; the steps run the built `overfly` and cargo.
#![forbid(unsafe_code)]

mod capi;
mod examples;
mod python;
mod set_up;
mod sparing;
mod steps;
mod trade;

use set_up::{DRAWING, VALIDATION, Vulkan, set_up};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use steps::{Step, Stopped, run, run_tests, target};

const USAGE: &str = "\
usage: cargo xtask <command>

commands:
  demo   sets up drawing, builds overfly and flies two flights; pictures go to out/demo
  test   sets up drawing with Vulkan's validation layers and runs every test
  examples
         builds and runs the examples in C, C++ and Python against what is installed for them
  sparing
         counts what a bare scene costs, in this build and in builds without what it has not
  trade  measures what settings cost over the three flights, into docs/trade.md
  capi --prefix DIR [--dev]
         builds the library for C and installs it below DIR, with header and pkg-config file
  python installs the Python module into target/python and runs its checks
  help   prints this

On Debian and Ubuntu, missing packages are installed with apt-get (through sudo if need be).
Without them, or elsewhere, everything that needs no Vulkan still runs.";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["demo"] => demo(&root()),
        ["test"] => test(&root()),
        ["examples"] => {
            examples::examples(&root(), &cargo(), set_up(&[DRAWING, VALIDATION].concat()))
        }
        ["sparing"] => sparing::sparing(&root(), &cargo(), set_up(&[DRAWING, VALIDATION].concat())),
        ["trade"] => trade::trade(&root(), &cargo(), &overfly(&root()).display().to_string()),
        ["capi", ref words @ ..] => match capi::Install::parse(words) {
            Ok(install) => install.install(&root(), &cargo()),
            Err(why) => return refuse(&why),
        },
        ["python"] => python::python(&root(), &cargo()),
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            Ok(())
        }
        [] => return refuse("a command is missing"),
        ["demo" | "test" | "examples" | "sparing" | "trade" | "python" | "help", ..] => {
            return refuse("a command takes no arguments");
        }
        [word, ..] => return refuse(&format!("there is no command {word}")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(stopped) => {
            eprintln!("xtask: {stopped}");
            ExitCode::from(stopped.code)
        }
    }
}

fn refuse(why: &str) -> ExitCode {
    eprintln!("xtask: {why}\n\n{USAGE}");
    ExitCode::from(2)
}

/// The repository. Cargo tells where this package is, also if it has been moved since the build.
fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    package.parent().expect("this package lies inside the repository").to_owned()
}

fn cargo() -> String {
    std::env::var("CARGO").unwrap_or_else(|_| "cargo".into())
}

/// Where cargo puts the release build of `overfly`.
fn overfly(root: &Path) -> PathBuf {
    let name = format!("overfly{}", std::env::consts::EXE_SUFFIX);
    target(root).join("release").join(name)
}

fn demo(root: &Path) -> Result<(), Stopped> {
    let vulkan = set_up(DRAWING);
    let build = Step::new("build", "the release build of overfly", &cargo());
    run(root, &build.with(&["build", "--release", "--locked"]))?;
    let overfly = overfly(root);
    let overfly = overfly.display().to_string();

    let doctor = Step::new("doctor", "what overfly finds on this machine", &overfly);
    let healthy = run(root, &doctor.with(&["doctor"]));
    let draws = healthy.is_ok() && vulkan != Vulkan::Absent;
    if let Err(stopped) = healthy {
        println!("   {stopped}");
    }
    if !draws {
        println!("\nThere is no usable Vulkan device: the flights run without drawing.");
    }
    for step in flights(&overfly, draws) {
        run(root, &step)?;
    }
    if draws {
        print_pictures(root);
    } else {
        println!("\nThe flights are done; nothing was drawn.");
    }
    Ok(())
}

/// The flights of the demo. Drawing comes second, so that times without it are seen, too.
fn flights(overfly: &str, draws: bool) -> Vec<Step> {
    let rainier = ["replay", "rainier", "--out", "out/demo/rainier"];
    let descent = ["replay", "descent", "--out", "out/demo/descent"];
    let stills = ["--stills", "8", "--size", "1280x720"];
    let step = |name, why| Step::new(name, why, overfly);
    let mut flights = vec![
        step("rainier", "a flight around Mount Rainier, without drawing")
            .with(&rainier)
            .with(&["--no-render"]),
    ];
    if draws {
        flights.push(step("rainier stills", "the same, drawn").with(&rainier).with(&stills));
        flights.push(
            step("descent stills", "from orbit to the ground, drawn").with(&descent).with(&stills),
        );
    } else {
        flights.push(
            step("descent", "from orbit to the ground, without drawing")
                .with(&descent)
                .with(&["--no-render"]),
        );
    }
    flights
}

fn print_pictures(root: &Path) {
    let mut pictures = Vec::new();
    for flight in ["rainier", "descent"] {
        find_pictures(&root.join("out/demo").join(flight), &mut pictures);
    }
    println!("\nStills and contact sheets:");
    for picture in pictures {
        println!("  {}", picture.display());
    }
}

/// The pictures of a folder and of those in it, sorted.
fn find_pictures(folder: &Path, pictures: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            find_pictures(&path, pictures);
        } else if path.extension().is_some_and(|extension| extension == "png") {
            pictures.push(path);
        }
    }
}

fn test(root: &Path) -> Result<(), Stopped> {
    let vulkan = set_up(&[DRAWING, VALIDATION].concat());
    let why = "every test of the workspace";
    let mut step = Step::new("test", why, &cargo());
    step = step.with(&["test", "--workspace", "--locked", "--no-fail-fast"]);
    let require = "OVERFLY_REQUIRE_GPU";
    if vulkan == Vulkan::Lavapipe {
        step = step.set(require, "1");
    }
    let required = vulkan == Vulkan::Lavapipe || std::env::var_os(require).is_some();
    let tested = run_tests(root, &step);
    let why = "the digests of the debug build, from the release build";
    let golden = Step::new("release", why, &cargo());
    let arguments =
        ["test", "--release", "--locked", "--package", "overfly-replay", "--test", "goldens"];
    let tested = tested.and(run_tests(root, &golden.with(&arguments)));
    if required {
        println!("Vulkan tests had to run: {require} was set.");
    } else {
        println!("Vulkan tests were free to skip: no software Vulkan was found.");
    }
    tested
}

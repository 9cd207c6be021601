//! `cargo xtask sparing`: what a scene has not, costs what it costs in a build without it: nothing.
//!
//! In:    `examples/sparing`, built with everything, without the parts of pictures, without Vulkan.
//! Out:   its counts, or where two builds differ.
//! Keeps: nothing but what cargo has built.
//! Not here: what is counted (`examples/sparing`).

use crate::set_up::Vulkan;
use crate::steps::{Step, Stopped, run, target};
use std::path::Path;
use std::process::Command;

/// The parts that the example knows.
const PARTS: [&str; 6] = ["sea", "sun", "imagery", "sky", "debug", "overlay"];
/// Features of the builds that are held against that of everything.
const LEAN: [(&str, &[&str]); 2] = [
    ("without parts", &["--no-default-features", "--features", "vulkan"]),
    ("without Vulkan", &["--no-default-features"]),
];
/// How lines begin that only a build with Vulkan says.
const OF_PICTURES: [&str; 2] = ["vulkan.", "picture."];

/// What a run of the example said.
struct Said {
    code: Option<i32>,
    counts: Vec<String>,
    complaint: String,
}

/// Builds and compares.
pub fn sparing(root: &Path, cargo: &str, vulkan: Vulkan) -> Result<(), Stopped> {
    // As the tests build it, so that this is no work after them.
    let build = Step::new("everything", "what the others are held against", cargo);
    run(root, &build.with(&["build", "--quiet", "--locked", "--workspace", "--examples"]))?;
    let full = counts(root, None)?;
    let draws = full.counts.iter().any(|line| line.starts_with("vulkan."));
    if vulkan == Vulkan::Lavapipe && !draws {
        return Err(stopped("there is a Vulkan, but no picture was drawn"));
    }
    for part in PARTS.into_iter().filter(|_| draws) {
        let with = example(root, Some(part))?;
        if with.code != Some(0) || with.counts == full.counts {
            return Err(stopped(&format!("a picture with {part} counts as one without")));
        }
    }
    for (name, features) in LEAN {
        let why = "a build without what the scene has not";
        let example_of = ["--package", "overfly", "--example", "sparing"];
        let build = Step::new(name, why, cargo)
            .with(&["build", "--quiet", "--locked"])
            .with(&example_of)
            .with(features);
        run(root, &build)?;
        let lean = counts(root, None)?;
        differ(&full.counts, &lean.counts).map_or(Ok(()), |what| {
            Err(stopped(&format!("the build {name} counts otherwise: {what}")))
        })?;
        println!("   {} counts are those of the build with everything", lean.counts.len());
        for part in PARTS.into_iter().filter(|_| draws) {
            let refused = example(root, Some(part))?;
            let expected = format!("without {part}");
            if refused.code != Some(2) || !refused.complaint.contains(&expected) {
                return Err(stopped(&format!(
                    "the build {name} does not say that it is {expected}"
                )));
            }
        }
    }
    full.counts.iter().for_each(|line| println!("   {line}"));
    Ok(())
}

/// Where a leaner build says something else than the full one, or less than it could.
fn differ(full: &[String], lean: &[String]) -> Option<String> {
    if let Some(line) = lean.iter().find(|line| !full.contains(line)) {
        return Some(format!("only it says `{line}`"));
    }
    let pictures = |line: &str| OF_PICTURES.iter().any(|begin| line.starts_with(begin));
    let draws = lean.iter().any(|line| pictures(line));
    let mut due = full.iter().filter(|line| draws || !pictures(line));
    let lacking = due.find(|line| !lean.contains(line));
    lacking.map(|line| format!("it does not say `{line}`"))
}

/// A run that must succeed.
fn counts(root: &Path, part: Option<&str>) -> Result<Said, Stopped> {
    let said = example(root, part)?;
    if said.code == Some(0) && !said.counts.is_empty() {
        return Ok(said);
    }
    Err(stopped(&format!("the example failed: {}", said.complaint)))
}

/// A run of what was built last.
fn example(root: &Path, part: Option<&str>) -> Result<Said, Stopped> {
    let name = format!("sparing{}", std::env::consts::EXE_SUFFIX);
    let program = target(root).join("debug/examples").join(name);
    let words = part.map_or(vec![], |part| vec!["--with", part]);
    let done = Command::new(&program).args(words).current_dir(root).output();
    let done = done.map_err(|error| stopped(&format!("{}: {error}", program.display())))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let is_count = |line: &&str| !line.starts_with("skipped");
    Ok(Said {
        code: done.status.code(),
        counts: text(&done.stdout).lines().filter(is_count).map(str::to_owned).collect(),
        complaint: text(&done.stderr),
    })
}

fn stopped(what: &str) -> Stopped {
    Stopped { step: "sparing".into(), what: format!("failed: {what}"), code: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaner_build_says_the_same_but_for_pictures_it_cannot_draw() {
        let lines = |lines: &[&str]| lines.iter().map(|&line| line.to_owned()).collect::<Vec<_>>();
        let full = lines(&["frames.jobs 6", "vulkan.calls 9", "picture.digest a"]);
        assert_eq!(differ(&full, &full), None);
        assert_eq!(differ(&full, &full[..1]), None);
        let other = differ(&full, &lines(&["frames.jobs 7"])).unwrap();
        assert_eq!(other, "only it says `frames.jobs 7`");
        let less = differ(&full, &full[..2]).unwrap();
        assert_eq!(less, "it does not say `picture.digest a`");
        assert!(differ(&full, &[]).is_some());
    }
}

//! The rules of the house that a machine can check.
//!
//! In:    the source tree.
//! Out:   passes or fails, with file and line.
//! Keeps: nothing.
//! Not here: what clippy and rustdoc check.

use std::fs;
use std::path::{Path, PathBuf};

const FOLDERS: [&str; 16] = [
    "src",
    "core",
    "jobs",
    "render_vk",
    "config",
    "replay",
    "archive",
    "ingest",
    "tracks",
    "link",
    "python",
    "capi",
    "xtask",
    "tests",
    "benches",
    "examples",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() && !entry.ends_with("target") {
            walk(&entry, found);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
}

fn sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    FOLDERS.iter().for_each(|folder| walk(&root().join(folder), &mut found));
    assert!(found.len() > 40, "the walk found only {} files", found.len());
    let name = |path: &PathBuf| path.strip_prefix(root()).unwrap().display().to_string();
    found.iter().map(|path| (name(path), fs::read_to_string(path).unwrap())).collect()
}

#[test]
fn crates_name_only_the_crates_below_them() {
    let allowed = [
        ("jobs", vec![]),
        ("core", vec!["overfly-jobs"]),
        ("config", vec!["overfly-core"]),
        ("render_vk", vec!["overfly-core", "overfly-jobs"]),
        ("replay", vec!["overfly-core", "overfly-jobs", "overfly-config"]),
        ("archive", vec!["overfly-core", "overfly-jobs"]),
        ("ingest", vec!["overfly-core", "overfly-archive"]),
        ("tracks", vec!["overfly-core", "overfly-replay"]),
        ("link", vec!["overfly-core", "overfly-config"]),
        ("python", vec![]),
        ("capi", vec![]),
        ("xtask", vec![]),
    ];
    for (folder, below) in allowed {
        let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let dependencies = manifest.split("[dependencies]").nth(1).unwrap();
        let named = dependencies.lines().filter(|line| line.starts_with("overfly-"));
        for line in named {
            let name = line.split(['.', ' ', '=']).next().unwrap();
            assert!(below.contains(&name), "{folder} may not depend on {name}");
        }
    }
}

#[test]
fn core_meets_jobs_and_hecs_each_in_one_file() {
    for (file, text) in sources() {
        if !file.starts_with("core/src") {
            continue;
        }
        let code = |line: &&str| !line.trim_start().starts_with("//");
        let text: String = text.lines().filter(code).collect::<Vec<_>>().join("\n");
        assert!(!text.contains("overfly_jobs") || file == "core/src/frame/mod.rs", "{file}");
        assert!(!text.contains("hecs") || file == "core/src/scene.rs", "{file}");
        for word in ["std::fs", "std::thread", "std::time", "ash::", "serde"] {
            assert!(!text.contains(word), "{file} names {word}");
        }
    }
}

#[test]
fn every_file_says_what_goes_in_and_out_and_stays_short() {
    for (file, text) in sources() {
        assert!(text.lines().count() <= 600, "{file} is longer than 600 lines");
        let header: String =
            text.lines().take_while(|line| line.starts_with("//!")).collect::<Vec<_>>().join("\n");
        for word in ["In:", "Out:", "Keeps:", "Not here:"] {
            assert!(header.contains(word), "{file}: its header lacks `{word}`");
        }
    }
}

#[test]
fn no_file_is_named_for_nothing() {
    for (file, _) in sources() {
        for name in ["utils", "util", "helpers", "common", "misc", "manager"] {
            assert!(!file.ends_with(&format!("/{name}.rs")), "{file}");
            assert!(!file.contains(&format!("/{name}/")), "{file}");
        }
    }
}

#[test]
fn unsafe_stands_only_where_it_may() {
    let may = [
        "jobs/src/scope.rs",
        "render_vk/src/vk/",
        "render_vk/src/record",
        // A host's own Vulkan.
        "examples/host_vulkan/",
        "examples/own_vulkan.rs",
        "examples/cockpit.rs",
        "examples/sparing/",
        "tests/contracts/hosting.rs",
        "capi/src/border.rs",
        "capi/src/callbacks.rs",
        "capi/src/vulkan.rs",
        // They call what C calls.
        "capi/tests/",
    ];
    let may = |file: &str| may.iter().any(|place| file.starts_with(place));
    let allocators = [
        "jobs/benches/jobs/heap.rs",
        "tests/counting.rs",
        // The program's own, with which `budget` counts.
        "src/heap.rs",
        "tests/ground_queries.rs",
        "tests/architecture.rs",
    ];
    for (file, text) in sources() {
        let uses = ["unsafe {", "unsafe impl", "unsafe fn"].iter().any(|word| text.contains(word));
        assert!(!uses || may(&file) || allocators.contains(&file.as_str()), "{file}");
    }
}

#[test]
fn features_switch_modules_and_never_statements() {
    for (file, text) in sources() {
        let lines: Vec<_> = text.lines().collect();
        for (number, pair) in lines.windows(2).enumerate() {
            let switch = pair[0].trim_start().starts_with("#[cfg(feature")
                || pair[0].trim_start().starts_with("#[cfg(not(feature");
            let word = pair[1].trim_start();
            let module = ["mod ", "pub mod ", "#[path"].iter().any(|m| word.starts_with(m));
            assert!(!switch || module, "{file}:{}", number + 1);
        }
    }
}

#[test]
fn architecture_names_only_paths_that_exist() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let mut checked = 0;
    for word in text.split('`').skip(1).step_by(2) {
        let is_path = word.contains('/') && !word.contains([' ', '<', '{', '*', '(', ':', '^']);
        if is_path {
            assert!(root().join(word).exists(), "ARCHITECTURE.md names {word}");
            checked += 1;
        }
    }
    assert!(checked > 20, "only {checked} paths found");
}

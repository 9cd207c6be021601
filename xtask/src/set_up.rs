//! What drawing needs from the system: found, installed where possible, named where not.
//!
//! In:    the packages that a command would like.
//! Out:   whether there is [`Vulkan`] afterwards; set-up never stops a command.
//! Keeps: nothing; apt-get changes the system.
//! Not here: Rust itself and its components (`.ci/run`).

use crate::steps::{Step, run};
use std::path::Path;
use std::process::{Command, Stdio};

/// A Debian package and what it is for.
#[derive(Clone, Copy)]
pub struct Package {
    name: &'static str,
    why: &'static str,
}

/// What drawing needs.
pub const DRAWING: &[Package] = &[
    Package { name: "libvulkan1", why: "the Vulkan loader" },
    Package { name: "mesa-vulkan-drivers", why: "Vulkan drivers, one without a GPU among them" },
    Package { name: "libx11-6", why: "windows" },
    Package { name: "libx11-xcb1", why: "windows" },
    Package { name: "libxcursor1", why: "windows" },
    Package { name: "libxi6", why: "keys and mouse of windows" },
    Package { name: "libxrandr2", why: "windows on several monitors" },
    Package { name: "libxkbcommon-x11-0", why: "keyboards of windows" },
];

/// What tests of drawing need as well.
pub const VALIDATION: &[Package] = &[
    Package { name: "vulkan-validationlayers", why: "Vulkan's own checks, for the tests" },
    Package { name: "libvulkan-dev", why: "Vulkan's headers, for the example of a host in C" },
    Package { name: "xvfb", why: "a screen that nobody sees, for the tests of the window" },
];

/// Folders in which drivers tell the Vulkan loader of themselves.
const DRIVER_FOLDERS: [&str; 3] =
    ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];

/// What the system can draw with, judged by its installed drivers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Vulkan {
    /// Mesa's software driver: there is a device on every machine.
    Lavapipe,
    /// Other drivers, which need their hardware, or a system where drivers lie elsewhere.
    Perhaps,
    /// No driver.
    Absent,
}

/// Installs what is missing, if it can, and says what it did.
pub fn set_up(packages: &[Package]) -> Vulkan {
    println!("== set-up: what drawing needs");
    if is_debian(&std::fs::read_to_string("/etc/os-release").unwrap_or_default()) {
        let missing: Vec<Package> =
            packages.iter().filter(|package| !is_installed(package.name)).copied().collect();
        if missing.is_empty() {
            println!("   every package is there");
        } else {
            install(&missing);
        }
    } else {
        println!("   this is neither Debian nor Ubuntu; if drawing fails, install:");
        print_packages(packages);
    }
    vulkan()
}

fn print_packages(packages: &[Package]) {
    for Package { name, why } in packages {
        println!("   - {name}: {why}");
    }
}

/// Whether an `os-release` file is Debian's, Ubuntu's or that of a system like them.
fn is_debian(os_release: &str) -> bool {
    let values = os_release.lines().filter_map(|line| line.split_once('='));
    let mut ids = values.filter(|(key, _)| matches!(*key, "ID" | "ID_LIKE"));
    ids.any(|(_, value)| {
        let mut names = value.trim_matches(['"', '\'']).split_whitespace();
        names.any(|name| matches!(name, "debian" | "ubuntu"))
    })
}

fn is_installed(package: &str) -> bool {
    let mut query = Command::new("dpkg-query");
    query.args(["--show", "--showformat=${db:Status-Status}", package]).stderr(Stdio::null());
    query.output().is_ok_and(|answer| answer.stdout == b"installed")
}

fn install(missing: &[Package]) {
    println!("   missing:");
    print_packages(missing);
    let Some(prefix) = as_root() else {
        println!("   they need root or sudo to install; going on without them");
        return;
    };
    let names: Vec<&str> = missing.iter().map(|package| package.name).collect();
    let update = apt_get(prefix, "package lists", "apt-get knows no packages yet, or old ones")
        .with(&["update"]);
    let install = apt_get(prefix, "packages", "what drawing needs")
        .with(&["install", "--yes", "--no-install-recommends"])
        .with(&names);
    let here = Path::new("/");
    let installed = (has_package_lists() && run(here, &install).is_ok())
        || (run(here, &update).is_ok() && run(here, &install).is_ok());
    if !installed {
        println!("   the packages could not be installed; going on without them");
    }
}

/// What to put before a command that only root may run; `None` if nothing helps.
fn as_root() -> Option<&'static [&'static str]> {
    let answers = |program: &str, argument: &str| {
        Command::new(program).arg(argument).output().ok().filter(|answer| answer.status.success())
    };
    if answers("id", "-u")?.stdout.trim_ascii() == b"0" {
        return Some(&[]);
    }
    answers("sudo", "--version").map(|_| &["sudo"][..])
}

/// Sudo drops the environment, so `env` sets the variable on the far side of it.
fn apt_get(prefix: &[&str], name: &str, why: &str) -> Step {
    let words = [prefix, &["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]].concat();
    Step::new(name, why, words[0]).with(&words[1..])
}

fn has_package_lists() -> bool {
    file_names("/var/lib/apt/lists").iter().any(|name| name.contains("_Packages"))
}

fn file_names(folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| file_name(&entry.path())).collect()
}

fn vulkan() -> Vulkan {
    let chosen = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].into_iter().find_map(std::env::var_os);
    let drivers: Vec<String> = match &chosen {
        Some(paths) => std::env::split_paths(paths).filter_map(|path| file_name(&path)).collect(),
        None => DRIVER_FOLDERS.into_iter().flat_map(file_names).collect(),
    };
    let found = judge(&drivers, cfg!(target_os = "linux"));
    println!("   Vulkan drivers: {found:?} ({})", drivers.join(", "));
    found
}

fn file_name(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

/// `complete`: there can be no drivers but these.
fn judge(drivers: &[String], complete: bool) -> Vulkan {
    if drivers.iter().any(|name| name.starts_with("lvp_icd") && name.ends_with(".json")) {
        Vulkan::Lavapipe
    } else if complete && drivers.is_empty() {
        Vulkan::Absent
    } else {
        Vulkan::Perhaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn debian_ubuntu_and_their_kin_have_apt_get() {
        assert!(is_debian("NAME=x\nID=debian\n"));
        assert!(is_debian("ID=ubuntu\nID_LIKE=debian\n"));
        assert!(is_debian("ID=linuxmint\nID_LIKE=\"ubuntu debian\"\n"));
        assert!(!is_debian("ID=fedora\nHOME_URL=\"https://debian.org/\"\n"));
        assert!(!is_debian(""));
    }

    #[test]
    fn only_the_software_driver_promises_a_device() {
        let judge = |names: &[&str], complete| {
            judge(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>(), complete)
        };
        assert_eq!(judge(&["radeon_icd.json", "lvp_icd.x86_64.json"], true), Vulkan::Lavapipe);
        assert_eq!(judge(&["nvidia_icd.json"], true), Vulkan::Perhaps);
        assert_eq!(judge(&["lvp_icd.json.bak"], true), Vulkan::Perhaps);
        assert_eq!(judge(&[], true), Vulkan::Absent);
        assert_eq!(judge(&[], false), Vulkan::Perhaps);
    }
}

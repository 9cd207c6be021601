//! Scene files of overfly: RON in, resolved settings out; presets.
//!
//! In:    the text of a `scene.ron`, the path of one, or the name of a preset.
//! Out:   [`SceneSettings`], or every fault of the file at once ([`SceneFaults`]).
//! Keeps: nothing.
//! Not here: what the settings do (`overfly_core`).
//!
//! The presets document the format: `presets/earth.ron` spells out every setting.
#![forbid(unsafe_code)]

mod budget;
mod depth;
mod fault;
mod fields;
mod node;
mod scan;
mod scene;
mod sun;
mod sweep;
mod tree;
mod utc;
mod write;

pub use budget::{BudgetLine, BudgetNames, BudgetSettings, Severity, Statistic, read_budget};
pub use fault::{Fault, FaultKind, LoadError, SceneFaults};
pub use overfly_core::settings::SceneSettings;
pub use sweep::{SweepSettings, read_sweep};
pub use utc::{utc_seconds, utc_text};
pub use write::{WriteFault, write};

use fields::Reader;
use overfly_core::settings::{SourceSettings, is_address};
use std::path::Path;

/// A scene that is compiled in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Preset {
    /// The Earth with sea and sun; every setting is spelt out.
    Earth,
    /// The Moon: craters, sun, no sea.
    Moon,
    /// A planet of 1 km radius with a sea, for tests and fast looks.
    Small,
}

/// The names of the presets.
pub const PRESETS: [&str; 3] = ["earth", "moon", "small"];

impl Preset {
    /// Every preset, in the order of [`PRESETS`].
    pub const ALL: [Self; 3] = [Self::Earth, Self::Moon, Self::Small];

    /// The preset of a name, one of [`PRESETS`].
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().zip(PRESETS).find(|(_, known)| *known == name).map(|(it, _)| it)
    }

    /// Its scene file.
    pub fn text(self) -> &'static str {
        match self {
            Self::Earth => include_str!("../presets/earth.ron"),
            Self::Moon => include_str!("../presets/moon.ron"),
            Self::Small => include_str!("../presets/small.ron"),
        }
    }
}

/// The scene file of a preset, as RON text.
pub fn preset(name: &str) -> Option<&'static str> {
    Preset::named(name).map(Preset::text)
}

/// The settings of a scene file's text. `file` is only for the faults to name. Paths of archives
/// stay as they are written: relative to the current directory.
///
/// Errors: every unknown, repeated or missing field, every wrong type and every value out of
/// range, all at once; or where the text stops being RON.
pub fn read(text: &str, file: &str) -> Result<SceneSettings, SceneFaults> {
    let (root, syntax) = tree::parse(text);
    let mut reader = Reader::new(text);
    for fault in syntax {
        reader.fault(fault.at, "", FaultKind::Syntax { what: fault.what });
    }
    let settings = root.as_ref().and_then(|root| scene::scene(&mut reader, root));
    let faults = reader.into_faults();
    match settings {
        Some(settings) if faults.is_empty() => Ok(settings),
        _ => {
            assert!(!faults.is_empty(), "settings are only missing after a fault");
            Err(SceneFaults { file: file.to_owned(), faults })
        }
    }
}

/// The settings of a preset or of a scene file.
///
/// - In: a name of [`PRESETS`], else a path; a file of such a name is reached as `./earth`.
/// - Out: relative paths of archives lead on from the scene file's folder.
/// - Errors: the file cannot be read, or has faults.
pub fn load(name_or_path: &str) -> Result<SceneSettings, LoadError> {
    if let Some(text) = preset(name_or_path) {
        return read(text, &format!("{name_or_path}.ron")).map_err(LoadError::Faults);
    }
    let text = read_file(name_or_path)
        .map_err(|source| LoadError::Read { file: name_or_path.to_owned(), source })?;
    // Some editors begin a file with a byte order mark; RON does not know it.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut settings = read(text, name_or_path).map_err(LoadError::Faults)?;
    let folder = Path::new(name_or_path).parent().unwrap_or(Path::new(""));
    let sources = settings.sources.iter_mut().filter_map(|source| match source {
        SourceSettings::Archive { location } => Some(location),
        SourceSettings::Procedural { .. } => None,
    });
    sources.chain(&mut settings.imagery).for_each(|location| lead_from(folder, location));
    Ok(settings)
}

/// A relative path leads on from the folder; an absolute one replaces it.
fn lead_from(folder: &Path, location: &mut String) {
    if !is_address(location) {
        let path = folder.join(&*location);
        *location = path.into_os_string().into_string().expect("both parts are UTF-8");
    }
}

/// A scene file's text. Devices and pipes, which may never end, are refused.
fn read_file(path: &str) -> std::io::Result<String> {
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    std::fs::read_to_string(path)
}

//! What is wrong with a scene file, said so that it can be put right.
//!
//! In:    positions, field paths and what was found there.
//! Out:   [`SceneFaults`], one line each: `scene.ron:12:5: lod.patch_depth: is 3, allowed is …`.
//! Keeps: nothing.
//! Not here: finding the faults (`fields`, `scene`).

use std::fmt::{self, Display, Formatter};
use std::io;

/// Fields as they were called in earlier versions, and now.
const FORMER: [(&str, &str); 1] = [("splits_m", "ranges")];

/// Every fault of one file, in the order of its lines. Never empty.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneFaults {
    /// The file as the caller named it.
    pub file: String,
    /// The faults, first line first.
    pub faults: Vec<Fault>,
}

/// One fault.
#[derive(Clone, PartialEq, Debug)]
pub struct Fault {
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// The setting, such as `views[1].near_m`; empty for the scene as a whole and for syntax.
    pub path: String,
    /// What is wrong.
    pub what: FaultKind,
}

/// What can be wrong with a setting.
#[derive(Clone, PartialEq, Debug)]
pub enum FaultKind {
    /// The text is not RON here.
    Syntax {
        /// What was found and what was expected, as a sentence.
        what: String,
    },
    /// No setting has this name.
    UnknownField {
        /// As written.
        name: String,
        /// The fields that this place knows.
        known: &'static [&'static str],
    },
    /// No variant has this name.
    UnknownVariant {
        /// As written.
        name: String,
        /// The variants that this place knows.
        known: Vec<&'static str>,
    },
    /// The field was given before; the first one counts.
    DuplicateField {
        /// Line of the first one, from 1.
        first_line: u32,
        /// Column of the first one, from 1.
        first_column: u32,
    },
    /// A setting without a default is not there.
    Missing {
        /// What to write.
        expected: String,
    },
    /// The value is of another kind.
    WrongType {
        /// What was written.
        found: String,
        /// What to write.
        expected: String,
    },
    /// The value is of the right kind, but no scene can have it.
    OutOfRange {
        /// As written, shortened if long.
        found: String,
        /// The allowed range, with the setting that it depends on, if any.
        allowed: String,
    },
}

/// Why a scene could not be loaded.
#[derive(Debug)]
pub enum LoadError {
    /// The file could not be read.
    Read {
        /// The file as the caller named it.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// The file was read, but is no scene.
    Faults(SceneFaults),
}

impl Display for SceneFaults {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            let line_end = if i == 0 { "" } else { "\n" };
            write!(f, "{line_end}{}:{fault}", self.file)?;
        }
        Ok(())
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "{}:{}: ", self.line, self.column)?;
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        write!(f, "{}", self.what)
    }
}

impl Display for FaultKind {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Self::Syntax { what } => write!(f, "{what}"),
            Self::UnknownField { name, known } => unknown(f, "field", name, known),
            Self::UnknownVariant { name, known } => unknown(f, "variant", name, known),
            Self::DuplicateField { first_line, first_column } => {
                write!(f, "is given twice, first at {first_line}:{first_column}")
            }
            Self::Missing { expected } => write!(f, "is missing, expected is {expected}"),
            Self::WrongType { found, expected } => {
                write!(f, "is {found}, expected is {expected}")
            }
            Self::OutOfRange { found, allowed } => write!(f, "is {found}, allowed is {allowed}"),
        }
    }
}

fn unknown(f: &mut Formatter, what: &str, name: &str, known: &[&str]) -> fmt::Result {
    write!(f, "unknown {what} {name}")?;
    if let Some((_, now)) = FORMER.iter().find(|(old, now)| *old == name && known.contains(now)) {
        write!(f, ", it is called {now} now")
    } else if let Some(near) = nearest(name, known) {
        write!(f, ", did you mean {near}?")
    } else {
        write!(f, ", known here: {}", known.join(", "))
    }
}

impl Display for LoadError {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Self::Read { file, source } => {
                write!(f, "cannot read scene {file}: {source}")?;
                if source.kind() == io::ErrorKind::NotFound {
                    write!(f, " (the presets are {})", crate::PRESETS.join(", "))?;
                }
                Ok(())
            }
            Self::Faults(faults) => write!(f, "{faults}"),
        }
    }
}

impl std::error::Error for SceneFaults {}

impl std::error::Error for LoadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Read { source, .. } => Some(source),
            // Its lines are all in the message already.
            Self::Faults(_) => None,
        }
    }
}

/// The known name that `name` was probably meant to be: the one that it is without a unit, else
/// the nearest one if at most two letters in five differ.
fn nearest<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    let name = name.to_lowercase();
    let unitless = |k: &str| name.len() > 2 && k.starts_with(&format!("{name}_"));
    if let Some(whole) = known.iter().find(|k| unitless(k)) {
        return Some(whole);
    }
    let distances = known.iter().map(|k| (distance(&name, &k.to_lowercase()), *k));
    let (letters, near) = distances.min_by_key(|(letters, _)| *letters)?;
    (letters * 5 <= near.len() * 2).then_some(near)
}

/// Levenshtein's edit distance.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let swap = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = swap.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

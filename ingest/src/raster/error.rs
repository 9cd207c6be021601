//! What can be wrong with an elevation file.
//!
//! In:    the file's name, what was found in it, what is allowed.
//! Out:   one sentence that says all three.
//! Keeps: nothing.
//! Not here: voids, which are data (NaN), not errors.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why an elevation file cannot be opened or read.
#[derive(Debug)]
pub enum RasterError {
    /// The operating system refused.
    Io {
        /// The file.
        name: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The contents contradict themselves or the format.
    Broken {
        /// The file.
        name: PathBuf,
        /// What was found, as a clause without full stop.
        found: String,
    },
    /// A sound file of a kind that is not read.
    Unsupported {
        /// The file.
        name: PathBuf,
        /// What was found.
        found: String,
        /// What is read, or the command that converts the file.
        advice: String,
    },
    /// The caller asked for more postings at once than [`super::WINDOW_POSTINGS_MAX`].
    WindowTooLarge {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
}

impl RasterError {
    pub(crate) fn io(name: &Path, source: io::Error) -> Self {
        // The system's own words for this say nothing of the file.
        if source.kind() == io::ErrorKind::UnexpectedEof {
            return Self::broken(name, "it ends too early, or what is packed in it does");
        }
        Self::Io { name: name.to_path_buf(), source }
    }

    pub(crate) fn broken(name: &Path, found: impl Into<String>) -> Self {
        Self::Broken { name: name.to_path_buf(), found: found.into() }
    }

    pub(crate) fn unsupported(
        name: &Path,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, advice) = (found.into(), advice.into());
        Self::Unsupported { name: name.to_path_buf(), found, advice }
    }
}

impl fmt::Display for RasterError {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { name, source } => write!(to, "{}: {source}", name.display()),
            Self::Broken { name, found } => write!(to, "{}: {found}", name.display()),
            Self::Unsupported { name, found, advice } => {
                write!(to, "{}: {found}; {advice}", name.display())
            }
            Self::WindowTooLarge { width, height } => write!(
                to,
                "a window of {width} × {height} postings was asked for; at most {} are read at once",
                super::WINDOW_POSTINGS_MAX
            ),
        }
    }
}

impl std::error::Error for RasterError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

//! What is wrong with a file, and where.
//!
//! In:    a field that cannot be used; or a file that cannot.
//! Out:   sentences with line, column, field, value and what is allowed.
//! Keeps: nothing.
//! Not here: names of files (who opened them knows), what is only noted (`clean`).

use crate::format::Format;
use core::fmt;

/// Longest part of a value that a message repeats, in characters.
const SHOWN: usize = 40;

/// A field of a file that cannot be used.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fault {
    /// Line, from 1.
    pub line: u32,
    /// Character in the line, from 1.
    pub column: u32,
    /// What the field is, such as `latitude`.
    pub field: String,
    /// The value found, shortened.
    pub found: String,
    /// What is allowed, such as `-90 to 90`.
    pub expected: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, column, field, found, expected } = self;
        write!(f, "line {line}, column {column}: {field} is \"{found}\", expected {expected}")
    }
}

/// The same, before its offset became line and column.
#[derive(Clone, Debug)]
pub(crate) struct Wrong {
    pub at: usize,
    pub field: String,
    pub found: String,
    pub expected: String,
}

impl Wrong {
    pub(crate) fn new(at: usize, field: &str, found: &str, expected: impl Into<String>) -> Self {
        let mut shown: String = found.chars().take(SHOWN).collect();
        if shown.len() < found.len() {
            shown.push('…');
        }
        Self { at, field: field.into(), found: shown, expected: expected.into() }
    }
}

/// Why a file gives no flight.
#[derive(Clone, PartialEq, Debug)]
pub enum TrackError {
    /// It is in none of the formats.
    Unknown {
        /// How it begins.
        begins: String,
    },
    /// A field, or the text as a whole, cannot be used.
    Fault(Fault),
    /// More than a tenth of the records have faults.
    TooManyFaults {
        /// The first of them.
        first: Fault,
        /// How many there are.
        faults: usize,
        /// Among so many records.
        records: usize,
    },
    /// The file, or what it unpacks to, is larger than allowed.
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// How large it may be.
        limit: usize,
    },
    /// A zip archive that cannot be read or holds no flight.
    Zip {
        /// Why.
        why: String,
    },
    /// A gzip file that cannot be read.
    Gzip {
        /// Why.
        why: String,
    },
    /// A column map that cannot be used.
    Columns {
        /// Why, with line and column of the map.
        why: String,
    },
    /// It holds no two fixes in a row.
    Empty {
        /// The format.
        format: Format,
        /// What there is instead, or what is missing.
        why: String,
    },
    /// Nobody can know what the altitudes are above.
    Datum {
        /// The format.
        format: Format,
        /// Why not.
        why: String,
    },
}

impl fmt::Display for TrackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { begins } => write!(
                f,
                "in none of the formats {}; it begins with \"{begins}\"",
                Format::ALL.map(Format::name).join(", ")
            ),
            Self::Fault(fault) => fault.fmt(f),
            Self::TooManyFaults { first, faults, records } => {
                write!(f, "{first}; {faults} of {records} records have such faults")
            }
            Self::TooLarge { what, limit } => {
                write!(f, "{what} is larger than {limit} bytes, which is what is allowed")
            }
            Self::Zip { why } => write!(f, "zip archive: {why}"),
            Self::Gzip { why } => write!(f, "gzip: {why}"),
            Self::Columns { why } => write!(f, "column map: {why}"),
            Self::Empty { format, why } => write!(f, "{}: {why}", format.name()),
            Self::Datum { format, why } => write!(
                f,
                "{}: {why}; say what altitudes are above with --altitude msl, ellipsoid or \
                 pressure",
                format.name()
            ),
        }
    }
}

impl core::error::Error for TrackError {}

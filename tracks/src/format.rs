//! Which format a file is in, by what it holds; and out of archives.
//!
//! In:    bytes, the file's name.
//! Out:   a [`Format`] and its text.
//! Keeps: nothing.
//! Not here: reading the formats (`formats`).

use crate::fault::TrackError;
use std::borrow::Cow;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// How much of a file is looked at to know its format, in bytes and lines.
const LOOKED_AT: usize = 64 << 10;
const LINES: usize = 200;
/// Most entries of an archive that are looked at.
const ENTRIES: usize = 1000;
/// Endings of the names of flights in archives; others are taken where these are not.
const ENDINGS: [&str; 10] =
    [".acmi", ".kml", ".gpx", ".igc", ".nmea", ".fdr", ".csv", ".json", ".txt", ".log"];

/// Formats of recorded flights.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// Gliders' flight recorders, by the FAI.
    Igc,
    /// GPS exchange format.
    Gpx,
    /// Google Earth: `gx:Track`, or placemarks with times.
    Kml,
    /// X-Plane's flight data recorder, versions 3 and 4.
    Fdr,
    /// Tacview.
    Acmi,
    /// GPS receivers' sentences.
    Nmea,
    /// FlightGear's generic protocol with its usual titles.
    FlightGear,
    /// ADS-B as a table: traffic library, OpenSky.
    AdsbCsv,
    /// ADS-B as JSON: records, OpenSky tracks, readsb traces.
    AdsbJson,
    /// overfly's own table, or one whose titles name units.
    Csv,
    /// A table that a column map describes.
    MappedCsv,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Igc,
        Self::Gpx,
        Self::Kml,
        Self::Fdr,
        Self::Acmi,
        Self::Nmea,
        Self::FlightGear,
        Self::AdsbCsv,
        Self::AdsbJson,
        Self::Csv,
        Self::MappedCsv,
    ];

    /// As messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Igc => "IGC",
            Self::Gpx => "GPX",
            Self::Kml => "KML",
            Self::Fdr => "X-Plane FDR",
            Self::Acmi => "Tacview ACMI",
            Self::Nmea => "NMEA",
            Self::FlightGear => "FlightGear CSV",
            Self::AdsbCsv => "ADS-B CSV",
            Self::AdsbJson => "ADS-B JSON",
            Self::Csv => "CSV",
            Self::MappedCsv => "CSV with a column map",
        }
    }

    /// The format of a text; tables are all [`Format::Csv`] here. `None` where it is in none.
    pub(crate) fn of(text: &str, file: &str) -> Option<Self> {
        let mut end = text.len().min(LOOKED_AT);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let head = text[..end].trim_start();
        let file = file.to_ascii_lowercase();
        if head.starts_with('<') {
            let has = |tag: &str| head.contains(tag);
            return match (has("<kml") || has("<Placemark"), has("<gpx")) {
                (true, _) => Some(Self::Kml),
                (_, true) => Some(Self::Gpx),
                _ if file.ends_with(".kml") => Some(Self::Kml),
                _ if file.ends_with(".gpx") => Some(Self::Gpx),
                _ => None,
            };
        }
        if head.starts_with(['{', '[']) {
            return Some(Self::AdsbJson);
        }
        if head.starts_with("FileType=text/acmi") {
            return Some(Self::Acmi);
        }
        Self::of_lines(head, &file)
    }

    fn of_lines(head: &str, file: &str) -> Option<Self> {
        let lines =
            || head.split(['\n', '\r']).map(str::trim).filter(|l| !l.is_empty()).take(LINES);
        let mut first_two = lines();
        let (first, second) = (first_two.next()?, first_two.next().unwrap_or(""));
        if matches!(first, "A" | "I") && second.starts_with(['2', '3', '4']) {
            return Some(Self::Fdr);
        }
        if lines().any(is_b_record) || file.ends_with(".igc") {
            return Some(Self::Igc);
        }
        if lines().any(is_sentence) || file.ends_with(".nmea") {
            return Some(Self::Nmea);
        }
        match file {
            _ if file.ends_with(".acmi") => Some(Self::Acmi),
            _ if file.ends_with(".fdr") => Some(Self::Fdr),
            _ if first.contains([',', ';', '\t']) => Some(Self::Csv),
            _ => None,
        }
    }
}

fn is_b_record(line: &str) -> bool {
    let bytes = line.as_bytes();
    let figures = |from: usize, to: usize| bytes[from..to].iter().all(u8::is_ascii_digit);
    bytes.len() >= 35 && bytes[0] == b'B' && figures(1, 14) && matches!(bytes[14], b'N' | b'S')
}

fn is_sentence(line: &str) -> bool {
    let Some((_, sentence)) = line.split_once('$') else { return false };
    let kind = sentence.as_bytes();
    kind.len() > 6 && kind[..5].iter().all(u8::is_ascii_uppercase) && kind[5] == b','
}

/// What a file holds as text: unpacked if it is a zip archive, without the mark of its byte order;
/// bytes that are no UTF-8, as in names of pilots, become replacement characters.
pub(crate) fn text_of(bytes: &[u8], bytes_max: usize) -> Result<Cow<'_, str>, TrackError> {
    if bytes.len() > bytes_max {
        return Err(TrackError::TooLarge { what: "the file", limit: bytes_max });
    }
    if !bytes.starts_with(b"PK\x03\x04") {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        return Ok(String::from_utf8_lossy(bytes));
    }
    let unpacked = unpack(bytes, bytes_max)?;
    let unpacked = unpacked.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&unpacked);
    Ok(Cow::Owned(String::from_utf8_lossy(unpacked).into_owned()))
}

/// The first entry of an archive that looks like a flight. Never more than `bytes_max` are unpacked,
/// whatever the archive says of itself.
fn unpack(bytes: &[u8], bytes_max: usize) -> Result<Vec<u8>, TrackError> {
    let failed = |error: zip::result::ZipError| TrackError::Zip { why: error.to_string() };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(failed)?;
    let mut chosen: Option<(usize, usize)> = None;
    for index in 0..archive.len().min(ENTRIES) {
        let Some(Ok(name)) = archive.name_for_index(index) else {
            continue;
        };
        let name = name.to_lowercase();
        let ending = ENDINGS.iter().position(|ending| name.ends_with(ending));
        let rank = ending.unwrap_or(ENDINGS.len());
        if !name.ends_with('/') && chosen.is_none_or(|(best, _)| rank < best) {
            chosen = Some((rank, index));
        }
    }
    let Some((_, index)) = chosen else {
        return Err(TrackError::Zip { why: "it holds no file".into() });
    };
    let entry = archive.by_index(index).map_err(failed)?;
    let mut unpacked = Vec::new();
    let most = u64::try_from(bytes_max).unwrap_or(u64::MAX).saturating_add(1);
    let read = entry.take(most).read_to_end(&mut unpacked);
    read.map_err(|error| TrackError::Zip { why: error.to_string() })?;
    if unpacked.len() > bytes_max {
        return Err(TrackError::TooLarge { what: "what the archive unpacks to", limit: bytes_max });
    }
    Ok(unpacked)
}

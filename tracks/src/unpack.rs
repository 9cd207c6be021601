//! What a file holds as text: out of zip and gzip, out of UTF-16.
//!
//! In:    bytes, and how many there may be.
//! Out:   a text.
//! Keeps: nothing.
//! Not here: which format the text is in (`format`).
//!
//! Never more than the limit is unpacked, whatever an archive says of itself. UTF-16 is told by its
//! mark, or by the zeros that ASCII has in it; all else is read as UTF-8, and bytes that are none,
//! as in names of pilots, become replacement characters.

use crate::fault::TrackError;
use flate2::read::MultiGzDecoder;
use std::borrow::Cow;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Most archives within archives, as a `.igc.gz` in a zip.
const NESTED: usize = 3;
/// Most entries of an archive that are looked at.
const ENTRIES: usize = 1000;
/// Endings of the names of flights in archives; others are taken where these are not.
const ENDINGS: [&str; 11] =
    [".acmi", ".kml", ".gpx", ".igc", ".nmea", ".fdr", ".csv", ".json", ".txt", ".log", ".gz"];

/// The text of a file.
pub(crate) fn text_of(bytes: &[u8], bytes_max: usize) -> Result<Cow<'_, str>, TrackError> {
    if bytes.len() > bytes_max {
        return Err(TrackError::TooLarge { what: "the file", limit: bytes_max });
    }
    let mut bytes = Cow::Borrowed(bytes);
    for _ in 0..NESTED {
        bytes = match () {
            () if bytes.starts_with(b"PK\x03\x04") => Cow::Owned(unzipped(&bytes, bytes_max)?),
            () if bytes.starts_with(b"\x1F\x8B") => Cow::Owned(inflated(&bytes, bytes_max)?),
            () => break,
        };
    }
    Ok(match bytes {
        Cow::Borrowed(bytes) => decoded(bytes),
        Cow::Owned(bytes) => Cow::Owned(decoded(&bytes).into_owned()),
    })
}

/// The first entry of an archive that looks like a flight.
fn unzipped(bytes: &[u8], bytes_max: usize) -> Result<Vec<u8>, TrackError> {
    let failed = |error: zip::result::ZipError| TrackError::Zip { why: error.to_string() };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(failed)?;
    let mut chosen: Option<(usize, usize)> = None;
    for index in 0..archive.len().min(ENTRIES) {
        let Some(Ok(name)) = archive.name_for_index(index) else {
            continue;
        };
        let name = name.to_lowercase();
        // What Macs put beside each file has the file's ending.
        let own = name.rsplit('/').next().unwrap_or("");
        let is_hidden = name.starts_with("__macosx/") || own.starts_with("._");
        let ending = ENDINGS.iter().position(|ending| name.ends_with(ending));
        let rank = ending.unwrap_or(ENDINGS.len()) + if is_hidden { ENTRIES } else { 0 };
        if !name.ends_with('/') && chosen.is_none_or(|(best, _)| rank < best) {
            chosen = Some((rank, index));
        }
    }
    let Some((_, index)) = chosen else {
        return Err(TrackError::Zip { why: "it holds no file".into() });
    };
    let entry = archive.by_index(index).map_err(failed)?;
    read_within(entry, bytes_max, |why| TrackError::Zip { why })
}

/// All members of a gzip file, one after the other.
fn inflated(bytes: &[u8], bytes_max: usize) -> Result<Vec<u8>, TrackError> {
    read_within(MultiGzDecoder::new(bytes), bytes_max, |why| TrackError::Gzip { why })
}

fn read_within(
    from: impl Read,
    bytes_max: usize,
    failed: impl Fn(String) -> TrackError,
) -> Result<Vec<u8>, TrackError> {
    let mut unpacked = Vec::new();
    let most = u64::try_from(bytes_max).unwrap_or(u64::MAX).saturating_add(1);
    from.take(most).read_to_end(&mut unpacked).map_err(|error| failed(error.to_string()))?;
    if unpacked.len() > bytes_max {
        return Err(TrackError::TooLarge { what: "what the archive unpacks to", limit: bytes_max });
    }
    Ok(unpacked)
}

/// Bytes as text, without the mark of their order.
fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        let text = char::decode_utf16(units);
        Cow::Owned(text.map(|found| found.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
    };
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest),
        [0xFF, 0xFE, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => wide(rest, u16::from_be_bytes),
        [1..=255, 0, 1..=255, 0, ..] => wide(bytes, u16::from_le_bytes),
        [0, 1..=255, 0, 1..=255, ..] => wide(bytes, u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes),
    }
}

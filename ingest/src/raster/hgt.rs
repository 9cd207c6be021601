//! SRTM tiles: `N49E011.hgt` and the same in a zip.
//!
//! In:    a file of 1201² or 3601² big-endian i16, row by row from the north.
//! Out:   a raster whose postings lie on whole degrees, both edges included.
//! Keeps: nothing.
//! Not here: reading rows (`rows`).

use super::rows::{self, RowSource, ScratchWriter, Stream};
use super::samples::Transfer;
use super::{Found, Grid, OpenOptions, Projection, RasterError, Source};
use std::fs::{self, File};
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// Postings along an edge, with the file's size in bytes.
const SIDES: [(u32, u64); 2] = [(1201, 2 * 1201 * 1201), (3601, 2 * 3601 * 3601)];

/// What the name must look like, and which sizes there are.
const ADVICE: &str =
    "an .hgt file has 1201 × 1201 (2884802 bytes) or 3601 × 3601 postings (25934402 bytes)";

/// A zip with more entries or a longer table than this is no elevation tile.
const ZIP_BYTES_MAX: u64 = 64 << 20;

/// Bytes copied at once from a zip.
const COPY_BYTES: usize = 256 << 10;

/// Opens an uncompressed tile.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> Result<Found, RasterError> {
    let bytes = fs::metadata(path).map_err(|error| RasterError::io(path, error))?.len();
    let side = side_of(path, bytes)?;
    found(path, options, Shape { side, bytes, source: RowSource::plain(), kind: "SRTM .hgt" })
}

/// Opens a zipped tile: its table of contents is read, its contents are not.
pub(crate) fn open_zip(path: &Path, options: &OpenOptions) -> Result<Found, RasterError> {
    let bytes = fs::metadata(path).map_err(|error| RasterError::io(path, error))?.len();
    let mut archive = read_table(path)?;
    let entry = entry_of(path, &mut archive)?;
    let side = side_of(path, entry.1)?;
    let source = RowSource::stream(Stream::Zip);
    found(path, options, Shape { side, bytes, source, kind: "SRTM .hgt.zip" })
}

struct Shape {
    side: u32,
    bytes: u64,
    source: RowSource,
    kind: &'static str,
}

fn found(path: &Path, options: &OpenOptions, shape: Shape) -> Result<Found, RasterError> {
    let [west, south] = corner_of(path)?;
    let step = 1.0 / f64::from(shape.side - 1);
    let grid =
        Grid::new(Projection::PlateCarree, [shape.side; 2], [west, south + 1.0], [step, -step]);
    Ok(Found {
        grid,
        kind: shape.kind,
        declared_nodata: Some(f64::from(i16::MIN)),
        bytes_on_disk: shape.bytes,
        chunks: rows::chunk_grid(&grid),
        transfer: Transfer::metres([Some(f64::from(i16::MIN)), options.nodata]),
        source: Source::Rows(shape.source),
    })
}

fn side_of(path: &Path, bytes: u64) -> Result<u32, RasterError> {
    let side = SIDES.iter().find(|side| side.1 == bytes).map(|side| side.0);
    side.ok_or_else(|| RasterError::unsupported(path, format!("{bytes} bytes of postings"), ADVICE))
}

/// West and south edge in degrees, by the name.
fn corner_of(path: &Path) -> Result<[f64; 2], RasterError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_uppercase();
    corner(&name).ok_or_else(|| {
        RasterError::unsupported(
            path,
            "the name does not begin with the south-west corner",
            "name it like N49E011.hgt: N or S and two digits, E or W and three digits",
        )
    })
}

fn corner(name: &str) -> Option<[f64; 2]> {
    let signed = |at: usize, digits: usize, plus: u8, minus: u8| {
        let sign = match *name.as_bytes().get(at)? {
            letter if letter == plus => 1.0,
            letter if letter == minus => -1.0,
            _ => return None,
        };
        let text = name.get(at + 1..at + 1 + digits)?;
        let all_digits = text.bytes().all(|letter| letter.is_ascii_digit());
        let degrees: f64 = text.parse().ok().filter(|_| all_digits)?;
        Some(sign * degrees)
    };
    let (south, west) = (signed(0, 2, b'N', b'S')?, signed(3, 3, b'E', b'W')?);
    let on_earth = (-90.0..90.0).contains(&south) && (-180.0..=180.0).contains(&west);
    on_earth.then_some([west, south])
}

fn read_table(path: &Path) -> Result<ZipArchive<BufReader<File>>, RasterError> {
    let file = File::open(path).map_err(|error| RasterError::io(path, error))?;
    let bytes = file.metadata().map_err(|error| RasterError::io(path, error))?.len();
    if bytes > ZIP_BYTES_MAX {
        return Err(RasterError::unsupported(path, format!("a zip of {bytes} bytes"), ADVICE));
    }
    ZipArchive::new(BufReader::new(file))
        .map_err(|error| RasterError::broken(path, format!("not a sound zip: {error}")))
}

/// Number and declared size of the one .hgt file in the zip.
fn entry_of(
    path: &Path,
    archive: &mut ZipArchive<BufReader<File>>,
) -> Result<(usize, u64), RasterError> {
    let entries = archive.len();
    for index in 0..entries {
        let entry = archive
            .by_index_raw(index)
            .map_err(|error| RasterError::broken(path, format!("entry {index}: {error}")))?;
        let name = entry
            .name()
            .map_err(|error| RasterError::broken(path, format!("entry {index}: {error}")))?;
        if name.to_ascii_lowercase().ends_with(".hgt") {
            return Ok((index, entry.size()));
        }
    }
    let found = format!("no .hgt file among its {entries} entries");
    Err(RasterError::unsupported(path, found, ADVICE))
}

/// Writes the tile's postings. Never more than the declared, legal size, whatever the stream
/// holds, so a zip bomb ends there.
pub(crate) fn unzip(path: &Path, to: &mut ScratchWriter<'_>) -> Result<(), RasterError> {
    let mut archive = read_table(path)?;
    let (index, size) = entry_of(path, &mut archive)?;
    if size != to.missing() {
        return Err(RasterError::broken(path, "the file changed while it was read"));
    }
    let broken = |found: String| RasterError::broken(path, found);
    let mut entry = archive.by_index(index).map_err(|error| broken(error.to_string()))?;
    let mut buffer = vec![0; COPY_BYTES];
    while to.missing() > 0 {
        let room = usize::try_from(to.missing()).unwrap_or(COPY_BYTES).min(COPY_BYTES);
        let count = entry
            .read(&mut buffer[..room])
            .map_err(|error| broken(format!("the zip's contents are damaged: {error}")))?;
        if count == 0 {
            return Err(broken(format!("the zip's contents end {} bytes early", to.missing())));
        }
        to.write(&buffer[..count]).map_err(|error| RasterError::io(path, error))?;
    }
    // The checksum is compared when the end is seen.
    match entry.read(&mut buffer[..1]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(broken("the zip's contents go on beyond the declared size".to_owned())),
        Err(error) => Err(broken(format!("the zip's contents are damaged: {error}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::corner;

    #[test]
    fn names_give_the_south_west_corner() {
        assert_eq!(corner("N49E011.HGT"), Some([11.0, 49.0]));
        assert_eq!(corner("S01W180.SRTMGL1.HGT.ZIP"), Some([-180.0, -1.0]));
        assert_eq!(corner("N00E000"), Some([0.0, 0.0]));
        for wrong in ["N9E011", "N90E011", "X49E011", "N49F011", "N4+E011", "N49E1", "", "N49E181"]
        {
            assert_eq!(corner(wrong), None, "{wrong}");
        }
    }
}

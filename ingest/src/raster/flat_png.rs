//! A 16-bit greyscale PNG whose place and scale the caller gives.
//!
//! In:    the file; west, south, east, north, metres per unit and offset from the options.
//! Out:   a plate carrée raster of pixel areas.
//! Keeps: nothing; its rows go to the scratch file when first needed.
//! Not here: PNG tiles with heights in colours (`tiles`).

use super::rows::{self, RowSource, ScratchWriter, Stream};
use super::samples::Transfer;
use super::{Found, Grid, OpenOptions, Projection, RasterError, Source};
use png::{BitDepth, ColorType, Decoder, Limits, Reader};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Most columns or rows.
const EDGE_MAX: u32 = 1 << 20;

/// Deflate packs at most this many bytes into one.
const EXPANSION_MAX: u64 = 1032;

/// What the PNG decoder may allocate: a few rows, and chunks beside the image.
const DECODER_BYTES: usize = 32 << 20;

/// Rows are written to the scratch file in pieces of about this size.
const PIECE_BYTES: usize = 1 << 20;

/// Opens the file: its header only.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> Result<Found, RasterError> {
    let bytes = std::fs::metadata(path).map_err(|error| RasterError::io(path, error))?.len();
    let reader = read_header(path)?;
    let (columns, rows) = (reader.info().width, reader.info().height);
    let decoded = 2 * u64::from(columns) * u64::from(rows);
    if columns > EDGE_MAX || rows > EDGE_MAX || decoded > bytes.saturating_mul(EXPANSION_MAX) {
        let found = format!("{columns} × {rows} pixels in a file of {bytes} bytes");
        return Err(RasterError::broken(path, found));
    }
    let [west, south, east, north] = extent(path, options)?;
    let step = [(east - west) / f64::from(columns), (south - north) / f64::from(rows)];
    let origin = [west + 0.5 * step[0], north + 0.5 * step[1]];
    let grid = Grid::new(Projection::PlateCarree, [columns, rows], origin, step);
    let metres = Transfer::metres([options.nodata, None]);
    Ok(Found {
        grid,
        kind: "16-bit PNG",
        declared_nodata: None,
        bytes_on_disk: bytes,
        chunks: rows::chunk_grid(&grid),
        transfer: Transfer { scale: options.metres_per_unit, offset_m: options.offset_m, ..metres },
        source: Source::Rows(RowSource::stream(Stream::Png)),
    })
}

fn extent(path: &Path, options: &OpenOptions) -> Result<[f64; 4], RasterError> {
    let advice = "give its edges in degrees, west < east and south < north: \
                  --extent WEST,SOUTH,EAST,NORTH";
    let Some(extent) = options.extent_deg else {
        let found = "a 16-bit PNG does not say where it lies";
        return Err(RasterError::unsupported(path, found, advice));
    };
    let [west, south, east, north] = extent;
    let width = 0.0 < east - west && east - west <= 360.0 && west.abs() <= 540.0;
    if width && -90.0 <= south && south < north && north <= 90.0 {
        return Ok(extent);
    }
    Err(RasterError::unsupported(path, format!("the extent {extent:?}"), advice))
}

fn read_header(path: &Path) -> Result<Reader<BufReader<File>>, RasterError> {
    let file = File::open(path).map_err(|error| RasterError::io(path, error))?;
    let limits = Limits { bytes: DECODER_BYTES };
    let mut decoder = Decoder::new_with_limits(BufReader::new(file), limits);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let wrong = |error| RasterError::broken(path, format!("the PNG is damaged: {error}"));
    let header = decoder.read_header_info().map_err(wrong)?;
    let (color, depth, interlaced) = (header.color_type, header.bit_depth, header.interlaced);
    if color != ColorType::Grayscale || depth != BitDepth::Sixteen || interlaced {
        let found = format!(
            "a PNG of {color:?}, {depth:?} bits{}",
            if interlaced { ", interlaced" } else { "" }
        );
        let advice = "16-bit greyscale, not interlaced, is read; 8 bits are too coarse for \
                      heights, and coloured tiles are opened by their folder or as \
                      {z}/{x}/{y}.png";
        return Err(RasterError::unsupported(path, found, advice));
    }
    decoder.read_info().map_err(wrong)
}

/// Writes the image's rows.
pub(crate) fn decode(path: &Path, to: &mut ScratchWriter<'_>) -> Result<(), RasterError> {
    let mut reader = read_header(path)?;
    let (columns, rows) = (reader.info().width, reader.info().height);
    let broken = |found: String| RasterError::broken(path, found);
    if 2 * u64::from(columns) * u64::from(rows) != to.missing() {
        return Err(broken("the file changed while it was read".to_owned()));
    }
    let mut piece = Vec::with_capacity(PIECE_BYTES);
    for number in 0..rows {
        let row = reader.next_row().map_err(|error| broken(format!("row {number}: {error}")))?;
        let row = row.ok_or_else(|| broken(format!("the image ends at row {number}")))?;
        piece.extend_from_slice(row.data());
        if piece.len() >= PIECE_BYTES || number + 1 == rows {
            to.write(&piece).map_err(|error| RasterError::io(path, error))?;
            piece.clear();
        }
    }
    Ok(())
}

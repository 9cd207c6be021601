//! GTX: a grid of undulations in one plain file.
//!
//! In:    lower left latitude and longitude, steps (four f64), rows, columns (two i32), then f32
//!        row by row from the south; all big-endian.
//! Out:   the grid and its undulations.
//! Keeps: nothing.
//! Not here: interpolation (`geoid`).

use super::nodes::NodeGrid;
use crate::raster::RasterError;
use std::fs;
use std::path::Path;

const HEADER_BYTES: usize = 40;

/// Largest grid. A whole Earth every minute of arc has 890 MiB; the official ones 4 to 36.
const FILE_BYTES_MAX: u64 = 128 << 20;

/// What VDatum writes where it knows nothing.
const VOID: f32 = -88.8888;

const ADVICE: &str = "a GTX grid has a header of 40 bytes and one f32 for each node";

pub(super) fn read(path: &Path) -> Result<(NodeGrid, Vec<f32>), RasterError> {
    let io = |error| RasterError::io(path, error);
    let bytes = fs::metadata(path).map_err(io)?.len();
    if bytes > FILE_BYTES_MAX {
        let found = format!("a grid of {bytes} bytes");
        return Err(RasterError::unsupported(path, found, format!("at most {FILE_BYTES_MAX}")));
    }
    let bytes = fs::read(path).map_err(io)?;
    let Some((header, nodes)) = bytes.split_at_checked(HEADER_BYTES) else {
        return Err(RasterError::broken(path, format!("{} bytes; {ADVICE}", bytes.len())));
    };
    let double = |at: usize| f64::from_be_bytes(header[at..at + 8].try_into().expect("eight"));
    let count = |at: usize| i32::from_be_bytes(header[at..at + 4].try_into().expect("four"));
    let [south, west, north_step, east_step] = [0, 8, 16, 24].map(double);
    let size = [count(36), count(32)].map(|count| u32::try_from(count).unwrap_or(0));
    let product = u64::from(size[0]) * u64::from(size[1]) * 4;
    if product == 0 || u64::try_from(nodes.len()) != Ok(product) {
        let found =
            format!("{} rows of {} nodes in {} bytes; {ADVICE}", count(32), count(36), bytes.len());
        return Err(RasterError::broken(path, found));
    }
    let sound = [north_step, east_step].iter().all(|step| (1e-6..=90.0).contains(step))
        && (-90.0..=90.0).contains(&south)
        && (-360.0..=360.0).contains(&west)
        && south + north_step * f64::from(size[1] - 1) <= 90.0 + 1e-6
        && east_step * f64::from(size[0] - 1) <= 360.0 + 1e-6;
    if !sound {
        let found =
            format!("it begins at {south}, {west} and goes on by {north_step}, {east_step}");
        return Err(RasterError::broken(path, found));
    }
    let undulation = |four: &[u8]| {
        let undulation_m = f32::from_be_bytes(four.try_into().expect("four"));
        let plausible = undulation_m.abs() < 1.0e4 && undulation_m != VOID;
        if plausible { undulation_m } else { f32::NAN }
    };
    let nodes = nodes.chunks_exact(4).map(undulation).collect();
    Ok((NodeGrid::new(size, [west, south], [east_step, north_step]), nodes))
}

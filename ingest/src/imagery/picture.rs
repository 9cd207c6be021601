//! A picture, row by row: PNG and TIFF of 8 bits a channel.
//!
//! In:    a file.
//! Out:   its size, where it says it lies; its rows from north to south as sRGB and alpha.
//! Keeps: nothing between calls; one row, or one row of strips or tiles, while it reads.
//! Not here: where pixels lie (`place`), filtering (`mips`).

use super::tiff_rows;
use crate::raster::geotiff::georef::{self, GeoTags};
use crate::raster::geotiff::{self, Bands};
use crate::raster::{Grid, RasterError};
use png::{BitDepth, ColorType, Decoder, Limits, Reader, Transformations};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// Most columns or rows.
pub const EDGE_MAX: u32 = 1 << 20;
/// Deflate packs at most this many bytes into one, and a byte may hold eight pixels.
const PIXELS_A_BYTE: u64 = 1032 * 8;
/// What the PNG decoder may allocate: a few rows, and chunks beside the image.
const DECODER_BYTES: usize = 32 << 20;

const PNG_MAGIC: [u8; 4] = *b"\x89PNG";
/// Plain and big TIFF, little-endian and big-endian.
const TIFF_MAGICS: [[u8; 4]; 4] = [*b"II*\0", *b"MM\0*", *b"II+\0", *b"MM\0+"];

/// An opened picture.
#[derive(Debug)]
pub struct Picture {
    /// The file.
    pub name: PathBuf,
    /// Columns and rows.
    pub size: [u32; 2],
    /// What it is, for people.
    pub kind: &'static str,
    /// Size of the file.
    pub bytes_on_disk: u64,
    /// Where it says it lies, and whether its rows run north.
    pub georeference: Option<(Grid, bool)>,
    format: Format,
}

#[derive(Clone, Copy, Debug)]
enum Format {
    Png,
    Tiff,
}

/// Who takes the rows: what it refuses ends the reading.
pub type Taker<'a> = dyn FnMut(&[[u8; 4]]) -> Result<(), Ended> + 'a;

/// Why reading ended before the last row.
#[derive(Debug)]
pub enum Ended {
    /// The picture cannot be read.
    Raster(RasterError),
    /// Rows could not be written where they go.
    Spool(std::io::Error),
    /// It was asked to stop.
    Stopped,
}

impl From<RasterError> for Ended {
    fn from(error: RasterError) -> Self {
        Self::Raster(error)
    }
}

impl Picture {
    /// Opens a picture: its header only.
    ///
    /// # Errors
    /// It cannot be read, or is none that is read.
    pub fn open(path: &Path) -> Result<Self, RasterError> {
        let io = |error| RasterError::io(path, error);
        let mut magic = [0; 4];
        let file = File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        let found = file.take(4).read(&mut magic).map_err(io)?;
        if magic == PNG_MAGIC {
            let reader = png_reader(path)?;
            let size = [reader.info().width, reader.info().height];
            let kind = "8-bit PNG";
            let format = Format::Png;
            let name = path.to_path_buf();
            let georeference = None;
            let picture = Self { name, size, kind, bytes_on_disk: bytes, georeference, format };
            return picture.plausible();
        }
        if TIFF_MAGICS.contains(&magic) {
            return open_tiff(path)?.plausible();
        }
        let found = format!("it begins with the bytes {:02x?}", &magic[..found]);
        let advice = "pictures are PNG (89 50 4e 47) or TIFF (II or MM): gdal_translate in out.png";
        Err(RasterError::unsupported(path, found, advice))
    }

    fn plausible(self) -> Result<Self, RasterError> {
        let [columns, rows] = self.size;
        let pixels = u64::from(columns) * u64::from(rows);
        let sound = columns > 0 && rows > 0 && columns <= EDGE_MAX && rows <= EDGE_MAX;
        if sound && pixels <= self.bytes_on_disk.saturating_mul(PIXELS_A_BYTE) {
            return Ok(self);
        }
        let bytes = self.bytes_on_disk;
        let found = format!(
            "its size is {columns} × {rows} pixels in a file of {bytes} bytes; 1 to {EDGE_MAX} a \
             side are read, and no file packs so many"
        );
        Err(RasterError::broken(&self.name, found))
    }

    /// Reads all rows, from north to south.
    ///
    /// # Errors
    /// The file is damaged, or `take` refused a row.
    pub fn rows(&self, take: &mut Taker<'_>) -> Result<(), Ended> {
        match self.format {
            Format::Png => self.png_rows(take),
            Format::Tiff => {
                let flipped = self.georeference.is_some_and(|(_, flipped)| flipped);
                tiff_rows::rows(&self.name, self.size, flipped, take)
            }
        }
    }

    fn png_rows(&self, take: &mut Taker<'_>) -> Result<(), Ended> {
        let mut reader = png_reader(&self.name)?;
        let broken = |found: String| RasterError::broken(&self.name, found);
        if [reader.info().width, reader.info().height] != self.size {
            return Err(broken("the file changed while it was read".to_owned()).into());
        }
        let (color, _) = reader.output_color_type();
        let bands = color.samples();
        let mut pixels = vec![[0; 4]; self.size[0] as usize];
        for number in 0..self.size[1] {
            let row =
                reader.next_row().map_err(|error| broken(format!("row {number}: {error}")))?;
            let row = row.ok_or_else(|| broken(format!("the image ends at row {number}")))?;
            for (pixel, bytes) in pixels.iter_mut().zip(row.data().chunks_exact(bands)) {
                *pixel = pixel_of(bytes);
            }
            take(&pixels)?;
        }
        Ok(())
    }
}

/// One to four channels as sRGB and alpha.
pub fn pixel_of(channels: &[u8]) -> [u8; 4] {
    match *channels {
        [grey] => [grey, grey, grey, 255],
        [grey, alpha] => [grey, grey, grey, alpha],
        [red, green, blue] => [red, green, blue, 255],
        [red, green, blue, alpha, ..] => [red, green, blue, alpha],
        [] => [0; 4],
    }
}

fn png_reader(path: &Path) -> Result<Reader<BufReader<File>>, RasterError> {
    let file = File::open(path).map_err(|error| RasterError::io(path, error))?;
    let limits = Limits { bytes: DECODER_BYTES };
    let mut decoder = Decoder::new_with_limits(BufReader::new(file), limits);
    decoder.set_ignore_text_chunk(true);
    // Palettes and fewer bits become 8 bits a channel.
    decoder.set_transformations(Transformations::EXPAND);
    let wrong = |error: png::DecodingError| {
        RasterError::broken(path, format!("the PNG is damaged: {error}"))
    };
    let info = decoder.read_header_info().map_err(wrong)?;
    let (color, depth, interlaced) = (info.color_type, info.bit_depth, info.interlaced);
    if depth == BitDepth::Sixteen || interlaced {
        let found = format!(
            "its bit depth is {} ({color:?}{})",
            depth as u8,
            if interlaced { ", interlaced" } else { "" }
        );
        let advice = "1 to 8 bits a channel, not interlaced, are read: \
                      magick in.png -depth 8 -interlace none out.png";
        return Err(RasterError::unsupported(path, found, advice));
    }
    let reader = decoder.read_info().map_err(wrong)?;
    debug_assert!(reader.output_color_type().0 != ColorType::Indexed, "expanded");
    Ok(reader)
}

fn open_tiff(path: &Path) -> Result<Picture, RasterError> {
    let (mut decoder, bytes_on_disk) = geotiff::open_decoder(path, Bands::Colours)?;
    let (columns, rows) = decoder.dimensions().map_err(|error| geotiff::from_tiff(path, error))?;
    let kind = tiff_rows::kind(path, &mut decoder)?;
    let tags: GeoTags = geotiff::geo_tags(path, &mut decoder)?;
    let georeference =
        (!tags.is_empty()).then(|| georef::grid(path, [columns, rows], &tags)).transpose()?;
    let (name, format) = (path.to_path_buf(), Format::Tiff);
    Ok(Picture { name, size: [columns, rows], kind, bytes_on_disk, georeference, format })
}

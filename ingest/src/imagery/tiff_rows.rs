//! The rows of a TIFF picture.
//!
//! In:    8-bit grey, RGB or RGBA in strips or tiles; none, deflate, LZW or packbits.
//! Out:   rows from north to south as sRGB and alpha.
//! Keeps: one row of strips or tiles while it reads.
//! Not here: where the picture lies (`raster::geotiff::georef`), PNG (`picture`).

use super::picture::{Ended, Taker, pixel_of};
use crate::raster::RasterError;
use crate::raster::geotiff::{
    Bands, CHUNK_BYTES_MAX, EXPANSION_MAX, FileDecoder, Packing, chunk_places, from_tiff, nodata,
    open_decoder, packing,
};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{ChunkType, DecodingResult};
use tiff::tags::Tag;

/// A row of strips or tiles may take so many bytes.
const BAND_BYTES_MAX: u64 = 512 << 20;

/// What the file is, for people.
pub fn kind(path: &Path, decoder: &mut FileDecoder) -> Result<&'static str, RasterError> {
    let wrong = |error| from_tiff(path, error);
    let color = decoder.colortype().map_err(wrong)?;
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation);
    let photometric = photometric.map_err(wrong)?.unwrap_or(1);
    let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(wrong)?;
    let signed = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(wrong)?;
    let signed = signed.is_some_and(|formats| formats.iter().any(|&format| format != 1));
    let kind = match color {
        ColorType::Gray(8) if photometric == 1 => "TIFF of grey",
        ColorType::Multiband { bit_depth: 8, num_samples: 2 } if photometric == 1 => {
            "TIFF of grey and alpha"
        }
        ColorType::RGB(8) => "TIFF of RGB",
        ColorType::RGBA(8) => "TIFF of RGBA",
        _ => "",
    };
    if kind.is_empty() || signed {
        let found = format!("its colour is {color:?}, photometric interpretation {photometric}");
        let advice = "grey, RGB and RGBA of 8 unsigned bits are read: gdal_translate -ot Byte \
                      -scale in.tif out.tif, or -expand rgb for palettes";
        return Err(RasterError::unsupported(path, found, advice));
    }
    if planar == Some(2) && !matches!(color, ColorType::Gray(_)) {
        let advice = "1 is read: gdal_translate -co INTERLEAVE=PIXEL in.tif out.tif";
        return Err(RasterError::unsupported(path, "its planar configuration is 2", advice));
    }
    Ok(kind)
}

/// How a file is cut, and where its pieces lie.
struct Layout {
    size: [u32; 2],
    /// Width and height of a strip or tile.
    chunk: [u32; 2],
    across: u32,
    bands: usize,
    places: Vec<(u64, u64)>,
    packing: Packing,
    file_bytes: u64,
    /// A number that means nothing, where all channels have it.
    void: Option<u8>,
}

/// Reads all rows; `flipped` where the file's run north.
pub fn rows(path: &Path, size: [u32; 2], flipped: bool, take: &mut Taker<'_>) -> Result<(), Ended> {
    let (mut decoder, file_bytes) = open_decoder(path, Bands::Colours)?;
    if decoder.dimensions().map_err(|error| from_tiff(path, error))? != (size[0], size[1]) {
        return Err(RasterError::broken(path, "the file changed while it was read").into());
    }
    let layout = Layout::of(path, &mut decoder, size, file_bytes)?;
    let down = size[1].div_ceil(layout.chunk[1]);
    let (width, tall) = (size[0] as usize, layout.chunk[1] as usize);
    let mut band = vec![[0; 4]; width * tall];
    for at in 0..down {
        let row = if flipped { down - 1 - at } else { at };
        let count = layout.read(path, &mut decoder, row, &mut band)?;
        for line in 0..count {
            let line = if flipped { count - 1 - line } else { line };
            take(&band[line * width..(line + 1) * width])?;
        }
    }
    Ok(())
}

impl Layout {
    fn of(
        path: &Path,
        decoder: &mut FileDecoder,
        size: [u32; 2],
        file_bytes: u64,
    ) -> Result<Self, RasterError> {
        let bands = match decoder.colortype().map_err(|error| from_tiff(path, error))? {
            ColorType::Gray(_) => 1,
            ColorType::Multiband { .. } => 2,
            ColorType::RGB(_) => 3,
            _ => 4,
        };
        let (width, height) = decoder.chunk_dimensions();
        let tiled = decoder.get_chunk_type() == ChunkType::Tile;
        let chunk = [width, if tiled { height } else { height.min(size[1]) }];
        let bytes = u64::from(width) * u64::from(chunk[1]) * bands as u64;
        let band_bytes = u64::from(size[0]) * u64::from(chunk[1]) * 4;
        if width == 0 || chunk[1] == 0 || bytes > CHUNK_BYTES_MAX || band_bytes > BAND_BYTES_MAX {
            let found = format!("a strip or tile is {width} × {} pixels", chunk[1]);
            let advice = format!(
                "at most {CHUNK_BYTES_MAX} bytes are read at once, and rows of {BAND_BYTES_MAX}: \
                 gdal_translate -co TILED=YES -co COMPRESS=DEFLATE in.tif out.tif"
            );
            return Err(RasterError::unsupported(path, found, advice));
        }
        let packing = packing(path, decoder)?;
        if tiled && packing == Packing::Lzw && !size[0].is_multiple_of(width) {
            // The decoder takes the padding's codes for damage.
            let found = format!("its LZW tiles, {width} wide, hang over its {} columns", size[0]);
            let advice = "such are read with deflate: gdal_translate -co TILED=YES \
                          -co COMPRESS=DEFLATE in.tif out.tif";
            return Err(RasterError::unsupported(path, found, advice));
        }
        let places = chunk_places(path, decoder)?;
        let void =
            nodata(path, decoder)?.and_then(|void| (0..=255).find(|&v| f64::from(v) == void));
        let across = size[0].div_ceil(width);
        Ok(Self { size, chunk, across, bands, places, packing, file_bytes, void })
    }

    /// Reads a row of strips or tiles; returns how many lines it has.
    fn read(
        &self,
        path: &Path,
        decoder: &mut FileDecoder,
        row: u32,
        band: &mut [[u8; 4]],
    ) -> Result<usize, RasterError> {
        let count = self.chunk[1].min(self.size[1] - row * self.chunk[1]) as usize;
        for column in 0..self.across {
            let first = column * self.chunk[0];
            let width = self.chunk[0].min(self.size[0] - first) as usize;
            let bytes = self.chunk(path, decoder, row * self.across + column, width * count)?;
            for line in 0..count {
                let start = line * self.size[0] as usize + first as usize;
                let to = &mut band[start..start + width];
                match &bytes {
                    None => to.fill([0; 4]),
                    Some(bytes) => self.fill(&bytes[line * width * self.bands..], to),
                }
            }
        }
        Ok(count)
    }

    fn fill(&self, from: &[u8], to: &mut [[u8; 4]]) {
        let colours = if self.bands < 3 { 1 } else { 3 };
        for (pixel, channels) in to.iter_mut().zip(from.chunks_exact(self.bands)) {
            let void = self.void.is_some_and(|v| channels[..colours].iter().all(|&c| c == v));
            *pixel = if void { [0; 4] } else { pixel_of(channels) };
        }
    }

    /// One strip or tile without its padding; `None` where the file leaves it out.
    fn chunk(
        &self,
        path: &Path,
        decoder: &mut FileDecoder,
        number: u32,
        pixels: usize,
    ) -> Result<Option<Vec<u8>>, RasterError> {
        let Some(&(at, bytes)) = self.places.get(number as usize) else {
            return Err(RasterError::broken(path, format!("chunk {number} is missing")));
        };
        if bytes == 0 {
            return Ok(None);
        }
        let wanted = pixels * self.bands;
        let plain = self.packing == Packing::Plain;
        let most = if plain { bytes } else { bytes.saturating_mul(EXPANSION_MAX) };
        if at.saturating_add(bytes) > self.file_bytes || wanted as u64 > most {
            let found = format!(
                "chunk {number} lies at byte {at} with {bytes} bytes, which cannot be: the file \
                 has {} and the chunk decodes to {wanted}",
                self.file_bytes
            );
            return Err(RasterError::broken(path, found));
        }
        match decoder.read_chunk(number).map_err(|error| from_tiff(path, error))? {
            DecodingResult::U8(bytes) if bytes.len() >= wanted => Ok(Some(bytes)),
            _ => {
                Err(RasterError::broken(path, format!("chunk {number} is not as long as it says")))
            }
        }
    }
}

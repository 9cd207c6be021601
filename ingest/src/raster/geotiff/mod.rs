//! GeoTIFF: one band of heights in strips or tiles.
//!
//! In:    int8 to int32 and uint8 to uint32, float32, float64; uncompressed, deflate, LZW,
//!        packbits; predictors 2 and 3; BigTIFF.
//! Out:   chunks of samples in the file's own type.
//! Keeps: a few open decoders, so that threads need not wait for each other.
//! Not here: where the raster lies (`georef`), hostile headers (`directory`).

mod directory;
pub(crate) mod georef;
mod padded;

pub(crate) use directory::Bands;

use super::samples::{Samples, Transfer};
use super::{ChunkGrid, Found, OpenOptions, Raster, RasterError, Source};
use georef::GeoTags;
use padded::Coding;
use parking_lot::{Mutex, MutexGuard};
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use tiff::decoder::ifd::Value;
use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, SampleFormat, Tag};
use tiff::{ColorType, TiffError, TiffResult};

/// Most bytes that one strip or tile may decode to.
pub(crate) const CHUNK_BYTES_MAX: u64 = 128 << 20;

/// Decoders of one file at the same time. (Large chunks are decoded one at a time anyway.)
const LANES: usize = 4;

/// Files with more chunks get one decoder: each holds the table of chunks.
const LANE_CHUNKS_MAX: usize = 1 << 17;

/// No compression that is read packs more than this many bytes into one (LZW, by its codes).
pub(crate) const EXPANSION_MAX: u64 = 4096;

/// GDAL's void number, as text.
const GDAL_NODATA: Tag = Tag::Unknown(42113);

/// GDAL's scale, offset and more, as XML.
const GDAL_METADATA: Tag = Tag::Unknown(42112);

/// How chunks are packed, as far as it matters here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Packing {
    Plain,
    Lzw,
    Other,
}

pub(crate) type FileDecoder = Decoder<BufReader<File>>;

/// The chunks of one TIFF file.
pub(crate) struct TiffSource {
    /// Offset and size of each chunk in the file; both 0 where the file leaves a chunk out.
    chunks: Vec<(u64, u64)>,
    packing: Packing,
    coding: Coding,
    file_bytes: u64,
    lanes: Vec<Mutex<Option<FileDecoder>>>,
    open: AtomicUsize,
}

impl std::fmt::Debug for TiffSource {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.debug_struct("TiffSource").field("chunks", &self.chunks.len()).finish()
    }
}

/// Opens a GeoTIFF's first image.
pub(super) fn open(path: &Path, options: &OpenOptions) -> Result<Found, RasterError> {
    let (mut decoder, file_bytes) = open_decoder(path, Bands::Heights)?;
    let wrong = |error| from_tiff(path, error);
    let (columns, rows) = decoder.dimensions().map_err(wrong)?;
    let number = number_kind(path, &mut decoder)?;
    let packing = packing(path, &mut decoder)?;
    let chunks = chunk_grid(path, &mut decoder, [columns, rows], number.bytes)?;
    let tags = geo_tags(path, &mut decoder)?;
    let (grid, flipped) = georef::grid(path, [columns, rows], &tags)?;
    let declared_nodata = nodata(path, &mut decoder)?;
    let (scale, offset_m) = scale(path, &mut decoder)?;
    let places = chunk_places(path, &mut decoder)?;
    let lanes = if places.len() > LANE_CHUNKS_MAX { 1 } else { LANES };
    let source = TiffSource {
        chunks: places,
        packing,
        coding: number.coding,
        file_bytes,
        lanes: (0..lanes).map(|_| Mutex::new(None)).collect(),
        open: AtomicUsize::new(0),
    };
    let metres = Transfer::metres([declared_nodata, options.nodata]);
    Ok(Found {
        grid,
        kind: number.kind,
        declared_nodata,
        bytes_on_disk: file_bytes,
        chunks: ChunkGrid { flipped, padded: chunks.padded && packing == Packing::Lzw, ..chunks },
        transfer: Transfer { scale, offset_m, ..metres },
        source: Source::Tiff(source),
    })
}

impl TiffSource {
    /// Decoders held open.
    pub fn open_decoders(&self) -> usize {
        self.open.load(Ordering::Relaxed)
    }

    /// Decodes one strip or tile.
    pub fn decode(
        &self,
        of: &Raster,
        chunk: u64,
        extent: [u32; 2],
    ) -> Result<Samples, RasterError> {
        let index = usize::try_from(chunk).ok();
        let Some(&(at, bytes)) = index.and_then(|index| self.chunks.get(index)) else {
            return Err(RasterError::broken(&of.name, format!("chunk {chunk} is missing")));
        };
        if bytes == 0 {
            return Ok(Samples::Void);
        }
        let numbers = u64::from(extent[0]) * u64::from(extent[1]);
        let decoded = numbers * u64::from(of.chunks.number_bytes);
        let plain = self.packing == Packing::Plain;
        let most = if plain { bytes } else { bytes.saturating_mul(EXPANSION_MAX) };
        if at.saturating_add(bytes) > self.file_bytes || decoded > most {
            let found = format!(
                "chunk {chunk} lies at byte {at} with {bytes} bytes, which cannot be: the file \
                 has {} and the chunk decodes to {decoded}",
                self.file_bytes
            );
            return Err(RasterError::broken(&of.name, found));
        }
        let number = u32::try_from(chunk).expect("there are fewer chunks than 2^21");
        let mut lane = self.lane();
        let mut decoder = match lane.take() {
            Some(decoder) => {
                self.open.fetch_sub(1, Ordering::Relaxed);
                of.store.drop_decoders(1);
                decoder
            }
            None => open_decoder(&of.name, Bands::Heights)?.0,
        };
        let read = if of.chunks.padded && (chunk + 1).is_multiple_of(of.chunks.across(&of.grid)) {
            self.decode_padded(of, &mut decoder, self.chunks[number as usize])
        } else {
            decoder.read_chunk(number)
        };
        let read = read.map_err(|error| from_tiff(&of.name, error))?;
        if of.store.keep_decoder() {
            self.open.fetch_add(1, Ordering::Relaxed);
            *lane = Some(decoder);
        }
        samples(&of.name, read)
    }

    /// Decodes an LZW tile with its padding.
    fn decode_padded(
        &self,
        of: &Raster,
        decoder: &mut FileDecoder,
        (at, bytes): (u64, u64),
    ) -> TiffResult<DecodingResult> {
        let size = [of.chunks.width, of.chunks.height];
        let numbers = u64::from(size[0]) * u64::from(size[1]);
        // LZW makes 12 bits of 8 at worst; what lies behind that is not the tile's.
        let most = numbers * u64::from(of.chunks.number_bytes) * 3 / 2 + 1024;
        decoder.inner().seek(SeekFrom::Start(at))?;
        padded::decode(self.coding, size, decoder.inner(), bytes.min(most))
    }

    /// A decoder's place that nobody uses; where all are in use, the first to come free of one.
    fn lane(&self) -> MutexGuard<'_, Option<FileDecoder>> {
        let free = self.lanes.iter().find_map(Mutex::try_lock);
        free.unwrap_or_else(|| self.lanes[0].lock())
    }
}

/// A decoder of a file that is no trap, and the file's size.
pub(crate) fn open_decoder(path: &Path, bands: Bands) -> Result<(FileDecoder, u64), RasterError> {
    let io = |error| RasterError::io(path, error);
    let file = File::open(path).map_err(io)?;
    let bytes = file.metadata().map_err(io)?.len();
    let mut reader = BufReader::new(file);
    directory::check(path, &mut reader, bytes, bands)?;
    reader.rewind().map_err(io)?;
    let decoder = Decoder::new(reader).map_err(|error| from_tiff(path, error))?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(CHUNK_BYTES_MAX).expect("128 MiB");
    Ok((decoder.with_limits(limits), bytes))
}

pub(crate) fn from_tiff(path: &Path, error: TiffError) -> RasterError {
    match error {
        TiffError::IoError(error) => RasterError::io(path, error),
        TiffError::UnsupportedError(error) => {
            let advice =
                "convert it: gdal_translate -co TILED=YES -co COMPRESS=DEFLATE in.tif out.tif";
            RasterError::unsupported(path, error.to_string(), advice)
        }
        error => RasterError::broken(path, format!("the TIFF is damaged: {error}")),
    }
}

/// How heights are stored.
struct NumberKind {
    kind: &'static str,
    bytes: u32,
    coding: Coding,
}

fn number_kind(path: &Path, decoder: &mut FileDecoder) -> Result<NumberKind, RasterError> {
    let wrong = |error| from_tiff(path, error);
    let color = decoder.colortype().map_err(wrong)?;
    let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(wrong)?;
    let format = format.and_then(|formats| formats.first().copied()).unwrap_or(1);
    let ColorType::Gray(bits) = color else {
        let advice = "one band of heights is read: gdal_translate -b 1 in.tif out.tif";
        return Err(RasterError::unsupported(path, format!("bands of {color:?}"), advice));
    };
    let kind = match (SampleFormat::from_u16_exhaustive(format), bits) {
        (SampleFormat::Uint, 8) => "GeoTIFF uint8",
        (SampleFormat::Uint, 16) => "GeoTIFF uint16",
        (SampleFormat::Uint, 32) => "GeoTIFF uint32",
        (SampleFormat::Int, 8) => "GeoTIFF int8",
        (SampleFormat::Int, 16) => "GeoTIFF int16",
        (SampleFormat::Int, 32) => "GeoTIFF int32",
        (SampleFormat::IEEEFP, 32) => "GeoTIFF float32",
        (SampleFormat::IEEEFP, 64) => "GeoTIFF float64",
        (format, bits) => {
            let found = format!("numbers of {bits} bits, {format:?}");
            let advice = "8, 16 and 32-bit integers and 32 and 64-bit floats are read: \
                          gdal_translate -ot Float32 in.tif out.tif";
            return Err(RasterError::unsupported(path, found, advice));
        }
    };
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation);
    if photometric.map_err(wrong)? == Some(0) {
        let advice = "turn it round: gdal_translate -co PHOTOMETRIC=MINISBLACK in.tif out.tif";
        return Err(RasterError::unsupported(path, "its zero means white", advice));
    }
    let predictor = decoder.find_tag_unsigned(Tag::Predictor).map_err(wrong)?.unwrap_or(1);
    let order = decoder.byte_order();
    let coding = Coding { order, bits: bits.into(), format: format.into(), predictor };
    Ok(NumberKind { kind, bytes: u32::from(bits) / 8, coding })
}

pub(crate) fn packing(path: &Path, decoder: &mut FileDecoder) -> Result<Packing, RasterError> {
    let wrong = |error| from_tiff(path, error);
    let code = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(wrong)?.unwrap_or(1);
    match CompressionMethod::from_u16_exhaustive(code) {
        CompressionMethod::None => Ok(Packing::Plain),
        CompressionMethod::LZW => Ok(Packing::Lzw),
        CompressionMethod::Deflate
        | CompressionMethod::OldDeflate
        | CompressionMethod::PackBits => Ok(Packing::Other),
        method => {
            let advice = "none, deflate, LZW and packbits are read: \
                          gdal_translate -co COMPRESS=DEFLATE -co TILED=YES in.tif out.tif";
            Err(RasterError::unsupported(path, format!("compression {method:?}"), advice))
        }
    }
}

fn chunk_grid(
    path: &Path,
    decoder: &mut FileDecoder,
    size: [u32; 2],
    number_bytes: u32,
) -> Result<ChunkGrid, RasterError> {
    let (width, height) = decoder.chunk_dimensions();
    let padded = decoder.get_chunk_type() == ChunkType::Tile;
    let [width, height] = match decoder.get_chunk_type() {
        ChunkType::Strip => [width, height.min(size[1])],
        ChunkType::Tile => [width, height],
    };
    let bytes = u128::from(width) * u128::from(height) * u128::from(number_bytes);
    if bytes > u128::from(CHUNK_BYTES_MAX) {
        let found = format!("a strip or tile of {width} × {height} takes {bytes} bytes");
        let advice = format!(
            "at most {CHUNK_BYTES_MAX} are held at once: gdal_translate -co TILED=YES \
             -co COMPRESS=DEFLATE -co BIGTIFF=IF_SAFER in.tif out.tif"
        );
        return Err(RasterError::unsupported(path, found, advice));
    }
    Ok(ChunkGrid { width, height, number_bytes, flipped: false, padded })
}

/// Where the chunks are; the decoder has checked that there are as many as the size asks for.
pub(crate) fn chunk_places(
    path: &Path,
    decoder: &mut FileDecoder,
) -> Result<Vec<(u64, u64)>, RasterError> {
    let [offsets, counts] = match decoder.get_chunk_type() {
        ChunkType::Strip => [Tag::StripOffsets, Tag::StripByteCounts],
        ChunkType::Tile => [Tag::TileOffsets, Tag::TileByteCounts],
    };
    let wrong = |error| from_tiff(path, error);
    let offsets = decoder.get_tag_u64_vec(offsets).map_err(wrong)?;
    let counts = decoder.get_tag_u64_vec(counts).map_err(wrong)?;
    Ok(offsets.into_iter().zip(counts).collect())
}

pub(crate) fn geo_tags(path: &Path, decoder: &mut FileDecoder) -> Result<GeoTags, RasterError> {
    let mut doubles = |tag| match decoder
        .find_tag(tag)
        .and_then(|value| value.map_or(Ok(Vec::new()), Value::into_f64_vec))
    {
        Ok(numbers) => Ok(numbers),
        Err(error) => Err(from_tiff(path, error)),
    };
    let pixel_scale = doubles(Tag::ModelPixelScaleTag)?;
    let tie_points = doubles(Tag::ModelTiepointTag)?;
    let transformation = doubles(Tag::ModelTransformationTag)?;
    let keys = decoder.find_tag_unsigned_vec(Tag::GeoKeyDirectoryTag);
    let keys = keys.map_err(|error| from_tiff(path, error))?.unwrap_or_default();
    Ok(GeoTags { pixel_scale, tie_points, transformation, keys })
}

fn text(path: &Path, decoder: &mut FileDecoder, tag: Tag) -> Result<String, RasterError> {
    let value = decoder.find_tag(tag).map_err(|error| from_tiff(path, error))?;
    match value {
        Some(Value::Ascii(text)) => Ok(text),
        _ => Ok(String::new()),
    }
}

/// GDAL writes the void as decimal text.
pub(crate) fn nodata(path: &Path, decoder: &mut FileDecoder) -> Result<Option<f64>, RasterError> {
    let text = text(path, decoder, GDAL_NODATA)?;
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let number = text.parse().map_err(|_| {
        RasterError::broken(path, format!("its nodata value {text:?} is no number"))
    })?;
    Ok(Some(number))
}

/// GDAL's scale and offset of the band.
fn scale(path: &Path, decoder: &mut FileDecoder) -> Result<(f64, f64), RasterError> {
    let text = text(path, decoder, GDAL_METADATA)?;
    let item =
        |role: &str, otherwise: f64| {
            let Some((_, rest)) = text.split_once(&format!("role=\"{role}\">")) else {
                return Ok(otherwise);
            };
            let number = rest.split('<').next().unwrap_or_default().trim();
            number.parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| {
                RasterError::broken(path, format!("its {role} {number:?} is no number"))
            })
        };
    Ok((item("scale", 1.0)?, item("offset", 0.0)?))
}

fn samples(path: &Path, read: DecodingResult) -> Result<Samples, RasterError> {
    Ok(match read {
        DecodingResult::U8(of) => Samples::U8(of),
        DecodingResult::I8(of) => Samples::I8(of),
        DecodingResult::U16(of) => Samples::U16(of),
        DecodingResult::I16(of) => Samples::I16(of),
        DecodingResult::U32(of) => Samples::U32(of),
        DecodingResult::I32(of) => Samples::I32(of),
        DecodingResult::F32(of) => Samples::F32(of),
        DecodingResult::F64(of) => Samples::F64(of),
        _ => return Err(RasterError::broken(path, "the decoder's type of number changed")),
    })
}

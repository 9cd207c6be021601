//! Web Mercator pyramids of PNG tiles with heights in their colours.
//!
//! In:    a template such as `tiles/{z}/{x}/{y}.png`; Terrarium or terrain-RGB.
//! Out:   one raster: the box round all tiles of the deepest zoom; missing tiles are void.
//! Keeps: the template.
//! Not here: fetching tiles, shallower zooms.

use super::Source;
use super::samples::{Samples, Transfer};
use super::{ChunkGrid, Found, Grid, MERCATOR_RADIUS_M, OpenOptions, Projection, RasterError};
use overfly_core::geodesy::narrow;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Deepest zoom: 512-pixel tiles of the next one would not count in 32 bits.
const ZOOM_MAX: u32 = 22;

/// Largest tile file. 512² pixels of four bytes, uncompressed, are 1 MiB.
const FILE_BYTES_MAX: u64 = 4 << 20;

/// What the PNG decoder may allocate for one tile.
const DECODER_BYTES: usize = 16 << 20;

/// Edges a tile may have, in pixels.
const EDGES: [u32; 2] = [256, 512];

/// How a tile's colours say heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileEncoding {
    /// red · 256 + green + blue / 256 − 32768 metres.
    Terrarium,
    /// −10000 + (red · 65536 + green · 256 + blue) / 10 metres, as Mapbox has it.
    TerrainRgb,
}

impl TileEncoding {
    /// Height of a colour in metres.
    pub fn height_m(self, [red, green, blue]: [u8; 3]) -> f64 {
        let [red, green, blue] = [red, green, blue].map(f64::from);
        match self {
            Self::Terrarium => red * 256.0 + green + blue / 256.0 - 32768.0,
            Self::TerrainRgb => (red * 65536.0 + green * 256.0 + blue) / 10.0 - 10000.0,
        }
    }
}

/// Tiles of one zoom.
#[derive(Debug)]
pub(crate) struct TileSource {
    template: String,
    zoom: u32,
    /// Tile numbers of the grid's upper left chunk.
    first: [u32; 2],
    /// Chunks side by side.
    across: u32,
    edge: u32,
    encoding: TileEncoding,
}

/// Whether a path is a template and no file.
pub(crate) fn is_template(path: &Path) -> bool {
    path.to_string_lossy().contains("{z}")
}

/// Finds the deepest zoom of a template, and its tiles.
pub(crate) fn open(template: &Path, options: &OpenOptions) -> Result<Found, RasterError> {
    let text = template.to_string_lossy().into_owned();
    let zooms = survey(template, &text)?;
    let Some((&zoom, found)) = zooms.last_key_value() else {
        let advice = "a folder of {z}/{x}/{y}.png tiles or of .tif, .hgt, .hgt.zip and 16-bit \
                      .png files is read";
        return Err(RasterError::unsupported(template, "no tiles and no elevation files", advice));
    };
    let sample = fill(&text, zoom, found.sample);
    let pixels = read_pixels(&sample)?
        .ok_or_else(|| RasterError::broken(&sample, "the tile went away while it was looked at"))?;
    let encoding = match options.encoding {
        Some(encoding) => encoding,
        None => obvious_encoding(template, &pixels)?,
    };
    let [columns, rows] = [0, 1].map(|axis| found.last[axis] - found.first[axis] + 1);
    let edge = pixels.edge;
    let step = 2.0 * PI * MERCATOR_RADIUS_M / (f64::from(1_u32 << zoom) * f64::from(edge));
    let west = f64::from(found.first[0]) * f64::from(edge) + 0.5;
    let north = f64::from(found.first[1]) * f64::from(edge) + 0.5;
    let half = PI * MERCATOR_RADIUS_M;
    let origin = [west * step - half, half - north * step];
    let size = [columns * edge, rows * edge];
    let source =
        TileSource { template: text, zoom, first: found.first, across: columns, edge, encoding };
    Ok(Found {
        grid: Grid::new(Projection::WebMercator, size, origin, [step, -step]),
        kind: match encoding {
            TileEncoding::Terrarium => "Terrarium tiles",
            TileEncoding::TerrainRgb => "terrain-RGB tiles",
        },
        declared_nodata: None,
        bytes_on_disk: found.bytes,
        chunks: ChunkGrid {
            width: edge,
            height: edge,
            number_bytes: 4,
            flipped: false,
            padded: false,
        },
        transfer: Transfer::metres([None, None]),
        source: Source::Tiles(source),
    })
}

impl TileSource {
    /// Reads one tile.
    pub fn decode(&self, chunk: u64) -> Result<Samples, RasterError> {
        let [x, y] = [chunk % u64::from(self.across), chunk / u64::from(self.across)]
            .map(|at| u32::try_from(at).expect("chunks are numbered within the grid"));
        let path = fill(&self.template, self.zoom, [self.first[0] + x, self.first[1] + y]);
        let Some(pixels) = read_pixels(&path)? else { return Ok(Samples::Void) };
        if pixels.edge != self.edge {
            let found = format!("a tile of {} pixels among tiles of {}", pixels.edge, self.edge);
            return Err(RasterError::broken(&path, found));
        }
        let height = |pixel: &[u8]| match *pixel {
            [red, green, blue, opaque] if opaque > 0 => {
                narrow(self.encoding.height_m([red, green, blue]))
            }
            _ => f32::NAN,
        };
        Ok(Samples::F32(pixels.rgba.chunks_exact(4).map(height).collect()))
    }
}

/// The tiles of one zoom, as far as a survey counts them.
struct Zoom {
    first: [u32; 2],
    last: [u32; 2],
    bytes: u64,
    /// One tile that is there.
    sample: [u32; 2],
}

/// Looks through the folders that a template names. Other files in them are passed over.
fn survey(template: &Path, text: &str) -> Result<BTreeMap<u32, Zoom>, RasterError> {
    let fixed: PathBuf = template
        .components()
        .take_while(|part| !part.as_os_str().to_string_lossy().contains('{'))
        .collect();
    let depth = template.components().count() - fixed.components().count();
    let root = if fixed.as_os_str().is_empty() { PathBuf::from(".") } else { fixed.clone() };
    let mut zooms = BTreeMap::new();
    let pattern = Path::new(text).strip_prefix(&fixed).unwrap_or(template).to_string_lossy();
    let mut folders = vec![(root, String::new(), depth)];
    while let Some((folder, below, depth)) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| RasterError::io(&folder, error))?;
        for entry in entries {
            let entry = entry.map_err(|error| RasterError::io(&folder, error))?;
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            if depth > 1 && entry.path().is_dir() {
                folders.push((entry.path(), format!("{name}/"), depth - 1));
            } else if let Some([zoom, x, y]) = matched(&pattern, &name) {
                let bytes = entry.metadata().map_or(0, |data| data.len());
                note(&mut zooms, zoom, [x, y], bytes);
            }
        }
    }
    Ok(zooms)
}

fn note(zooms: &mut BTreeMap<u32, Zoom>, zoom: u32, at: [u32; 2], bytes: u64) {
    if zoom > ZOOM_MAX || at.iter().any(|&part| part >> zoom != 0) {
        return;
    }
    let seen = zooms.entry(zoom).or_insert(Zoom { first: at, last: at, bytes: 0, sample: at });
    seen.bytes = seen.bytes.saturating_add(bytes);
    // The same sample in whatever order a file system lists its files.
    seen.sample = seen.sample.min(at);
    let [x, y] = at;
    seen.first = [seen.first[0].min(x), seen.first[1].min(y)];
    seen.last = [seen.last[0].max(x), seen.last[1].max(y)];
}

/// The numbers that a name has where the pattern has {z}, {x} and {y}.
fn matched(pattern: &str, name: &str) -> Option<[u32; 3]> {
    let mut numbers = [None; 3];
    let (mut pattern, mut name) = (pattern, name);
    while let Some(open) = pattern.find('{') {
        name = name.strip_prefix(&pattern[..open])?;
        let axis =
            ["{z}", "{x}", "{y}"].iter().position(|part| pattern[open..].starts_with(part))?;
        let digits = name.bytes().take_while(u8::is_ascii_digit).count();
        numbers[axis] = Some(name[..digits].parse().ok()?);
        (pattern, name) = (&pattern[open + 3..], &name[digits..]);
    }
    if name != pattern {
        return None;
    }
    let [zoom, x, y] = numbers;
    Some([zoom?, x?, y?])
}

fn fill(template: &str, zoom: u32, [x, y]: [u32; 2]) -> PathBuf {
    let path = template.replace("{z}", &zoom.to_string()).replace("{x}", &x.to_string());
    PathBuf::from(path.replace("{y}", &y.to_string()))
}

/// A square of colours.
struct Pixels {
    edge: u32,
    rgba: Vec<u8>,
}

/// Reads a tile; `None` where there is no such file.
fn read_pixels(path: &Path) -> Result<Option<Pixels>, RasterError> {
    let bytes = match fs::metadata(path).map(|data| data.len()) {
        Ok(count) if count > FILE_BYTES_MAX => {
            return Err(RasterError::broken(path, format!("a tile of {count} bytes")));
        }
        Ok(_) => fs::read(path),
        Err(error) => Err(error),
    };
    match bytes {
        Ok(bytes) => decode_pixels(path, &bytes).map(Some),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(RasterError::io(path, error)),
    }
}

fn decode_pixels(path: &Path, bytes: &[u8]) -> Result<Pixels, RasterError> {
    let limits = Limits { bytes: DECODER_BYTES };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(Transformations::EXPAND | Transformations::ALPHA);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let wrong = |error| RasterError::broken(path, format!("the PNG is damaged: {error}"));
    let header = decoder.read_header_info().map_err(wrong)?;
    let (width, height, depth) = (header.width, header.height, header.bit_depth);
    if width != height || !EDGES.contains(&width) || depth == BitDepth::Sixteen {
        let found = format!("a tile of {width} × {height} pixels, {depth:?} bits");
        let advice = "tiles of 256 × 256 or 512 × 512 pixels with 8 bits a colour are read";
        return Err(RasterError::unsupported(path, found, advice));
    }
    let mut reader = decoder.read_info().map_err(wrong)?;
    let count = reader.output_buffer_size().unwrap_or(0);
    let mut data = vec![0; count];
    let info = reader.next_frame(&mut data).map_err(wrong)?;
    data.truncate(info.buffer_size());
    let rgba = match info.color_type {
        ColorType::Rgba => data,
        ColorType::GrayscaleAlpha => {
            data.chunks_exact(2).flat_map(|of| [of[0], of[0], of[0], of[1]]).collect()
        }
        color => return Err(RasterError::broken(path, format!("a tile of {color:?}"))),
    };
    Ok(Pixels { edge: width, rgba })
}

/// The encoding that makes every height of a tile one of the Earth's, if the other makes none.
fn obvious_encoding(path: &Path, pixels: &Pixels) -> Result<TileEncoding, RasterError> {
    let fits = |encoding: TileEncoding| {
        let mut opaque = pixels.rgba.chunks_exact(4).filter(|pixel| pixel[3] > 0).peekable();
        let some = opaque.peek().is_some();
        some && opaque.all(|pixel| {
            let height_m = encoding.height_m([pixel[0], pixel[1], pixel[2]]);
            (-11_500.0..9_500.0).contains(&height_m)
        })
    };
    match (fits(TileEncoding::Terrarium), fits(TileEncoding::TerrainRgb)) {
        (true, false) => Ok(TileEncoding::Terrarium),
        (false, true) => Ok(TileEncoding::TerrainRgb),
        _ => {
            let found = "its colours do not tell how they mean heights";
            let advice = "say so: --encoding terrarium or --encoding terrain-rgb";
            Err(RasterError::unsupported(path, found, advice))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_agree_with_their_definitions() {
        assert_eq!(TileEncoding::Terrarium.height_m([128, 0, 0]), 0.0);
        assert_eq!(TileEncoding::Terrarium.height_m([145, 40, 128]), 4392.5);
        assert_eq!(TileEncoding::TerrainRgb.height_m([1, 134, 160]), 0.0);
        assert_eq!(TileEncoding::TerrainRgb.height_m([0, 0, 0]), -10000.0);
    }

    #[test]
    fn names_match_templates_in_any_order_of_parts() {
        assert_eq!(matched("{z}/{x}/{y}.png", "7/66/44.png"), Some([7, 66, 44]));
        assert_eq!(matched("t_{y}_{x}_{z}@2x.png", "t_44_66_7@2x.png"), Some([7, 66, 44]));
        for wrong in ["7/66/44.jpg", "7/66/.png", "7/66/44.png~", "a/66/44.png", "7/66"] {
            assert_eq!(matched("{z}/{x}/{y}.png", wrong), None, "{wrong}");
        }
    }
}

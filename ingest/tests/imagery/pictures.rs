//! Pictures of chosen colours, as files, and finished archives to look into.
//!
//! In:    a colour for every pixel or place.
//! Out:   PNG and TIFF files; archives; the colour of an archive at a place.
//! Keeps: nothing.
//! Not here: what is expected of them.

use overfly_archive::{Imagery, Location, OpenOptions};
use overfly_core::datasource::colour::{COLOUR_BITS, COLOUR_SIDE};
use overfly_core::datasource::{ColourTile, PageKey};
use overfly_core::geodesy::trig::{atan2, cos, exp, sin};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_ingest::raster::Projection;
use overfly_ingest::{ImageryOptions, ImageryReport, IngestError, build_imagery};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

/// A smooth colour of the body, by latitude and longitude; the same from all sides at the poles.
pub fn smooth(lon_rad: f64, lat_rad: f64) -> [f64; 3] {
    let (x, y) = (cos(lon_rad) * cos(lat_rad), sin(lon_rad) * cos(lat_rad));
    let z = sin(lat_rad);
    [128.0 + 90.0 * y, 128.0 + 100.0 * z, 120.0 + 70.0 * (x * x - y * y) + 30.0 * z * x]
}

/// The nearest bytes.
pub fn bytes_of(colour: [f64; 3]) -> [u8; 3] {
    colour.map(|part| part.round() as u8)
}

/// A picture in memory.
#[derive(Clone)]
pub struct Drawing {
    pub size: [u32; 2],
    pub pixels: Vec<[u8; 4]>,
}

impl Drawing {
    /// By column and row.
    pub fn new(size: [u32; 2], pixel: impl Fn(u32, u32) -> [u8; 4]) -> Self {
        let pixel = &pixel;
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| pixel(x, y))).collect();
        Self { size, pixels }
    }

    /// The whole body, equirectangular, in the smooth colour.
    pub fn world(width: u32) -> Self {
        let step = std::f64::consts::TAU / f64::from(width);
        Self::new([width, width / 2], |x, y| {
            let lon = (f64::from(x) + 0.5) * step - std::f64::consts::PI;
            let lat = std::f64::consts::FRAC_PI_2 - (f64::from(y) + 0.5) * step;
            let [red, green, blue] = bytes_of(smooth(lon, lat));
            [red, green, blue, 255]
        })
    }

    /// The whole Mercator square in the smooth colour.
    pub fn mercator(width: u32) -> Self {
        let step = std::f64::consts::TAU / f64::from(width);
        Self::new([width; 2], |x, y| {
            let lon = (f64::from(x) + 0.5) * step - std::f64::consts::PI;
            let north = std::f64::consts::PI - (f64::from(y) + 0.5) * step;
            let grown = exp(north);
            let lat = atan2(0.5 * (grown - 1.0 / grown), 1.0);
            let [red, green, blue] = bytes_of(smooth(lon, lat));
            [red, green, blue, 255]
        })
    }

    /// As PNG: RGB where nothing is transparent, else RGBA.
    pub fn write_png(&self, path: &Path) -> PathBuf {
        let opaque = self.pixels.iter().all(|pixel| pixel[3] == 255);
        let bands = if opaque { 3 } else { 4 };
        let color = if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba };
        let data: Vec<u8> = self.pixels.iter().flat_map(|pixel| pixel[..bands].to_vec()).collect();
        write_png(path, self.size, (color, png::BitDepth::Eight), &data);
        path.to_path_buf()
    }

    /// As TIFF of RGBA, with these georeferencing tags.
    pub fn write_tiff(&self, path: &Path, georeference: &Georeference) -> PathBuf {
        let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
        let [width, height] = self.size;
        let mut image = encoder.new_image::<colortype::RGBA8>(width, height).unwrap();
        image.rows_per_strip(7).unwrap();
        let tags = image.encoder();
        // Extra samples: unassociated alpha.
        tags.write_tag(Tag::ExtraSamples, &[2_u16][..]).unwrap();
        georeference.write(|tag, numbers| tags.write_tag(tag, numbers).unwrap());
        if let Some(code) = georeference.code {
            let (model, key) = if code == 3857 { (1, 3072) } else { (2, 2048) };
            let keys = [1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, 1, key, 0, 1, code];
            tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
        }
        image.write_data(self.pixels.as_flattened()).unwrap();
        path.to_path_buf()
    }
}

/// Where a TIFF says it lies.
#[derive(Default)]
pub struct Georeference {
    /// EPSG code; without one there are no tags at all.
    pub code: Option<u16>,
    /// Corner of the first pixel, and the way to the next column and row.
    pub corner: [f64; 2],
    pub step: [f64; 2],
}

impl Georeference {
    fn write(&self, mut put: impl FnMut(Tag, &[f64])) {
        if self.code.is_none() {
            return;
        }
        let ([x, y], [east, south]) = (self.corner, self.step);
        // A transformation can say that rows run north; a scale cannot.
        let matrix =
            [east, 0.0, 0.0, x, 0.0, south, 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        put(Tag::ModelTransformationTag, &matrix);
    }
}

/// A PNG of any kind.
pub fn write_png(
    path: &Path,
    [width, height]: [u32; 2],
    (color, depth): (png::ColorType, png::BitDepth),
    data: &[u8],
) {
    let mut encoder = png::Encoder::new(File::create(path).unwrap(), width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 200, 100, 50]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
}

/// Options for a picture of the whole Earth.
pub fn options(input: &Path, output: &Path) -> ImageryOptions {
    ImageryOptions {
        input: input.to_path_buf(),
        projection: None,
        bounds_deg: None,
        attribution: String::new(),
        output: output.to_path_buf(),
        body: ("Earth".into(), Ellipsoid::WGS84),
    }
}

/// Options for a picture in Mercator.
pub fn mercator_options(input: &Path, output: &Path) -> ImageryOptions {
    ImageryOptions { projection: Some(Projection::WebMercator), ..options(input, output) }
}

/// Builds without a stop or a word.
pub fn build(options: &ImageryOptions) -> Result<ImageryReport, IngestError> {
    build_imagery(options, &AtomicBool::new(false), &|_| {})
}

/// An archive that was just built.
pub struct Atlas {
    pub archive: Imagery,
    pub report: ImageryReport,
    /// Tiles that places were looked up in.
    known: RefCell<BTreeMap<PageKey, Option<ColourTile>>>,
}

impl Atlas {
    /// Builds and opens.
    pub fn build(options: &ImageryOptions) -> Self {
        let report = build(options).unwrap();
        let location = Location::File(options.output.clone());
        let archive = Imagery::open_imagery(&location, &OpenOptions::default()).unwrap();
        Self { archive, report, known: RefCell::default() }
    }

    /// A tile, if there is one.
    pub fn tile(&self, key: PageKey) -> Option<ColourTile> {
        self.archive.colour(key).unwrap()
    }

    /// The bilinear colour of the finest tile at a place.
    pub fn at(&self, lon_rad: f64, lat_rad: f64) -> Option<[f64; 4]> {
        let depth = self.archive.facts().depth;
        let n = Geodetic { lat_rad, lon_rad, height_m: 0.0 }.normal();
        let quadrant = match (n.x >= 0.0, n.y >= 0.0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        let across = f64::from(1_u32 << (depth + COLOUR_BITS));
        let sum = n.x.abs() + n.y.abs() + n.z.abs();
        let [x, y] = [n.x.abs() / sum * across, n.y.abs() / sum * across];
        let [u, v] = if n.z >= 0.0 { [x, y] } else { [across - y, across - x] };
        let cell = |at: f64| (at as u32).min((1 << (depth + COLOUR_BITS)) - 1);
        let (i, j) = (cell(u), cell(v));
        let key = PageKey::new(quadrant, depth, i >> COLOUR_BITS, j >> COLOUR_BITS);
        let mut known = self.known.borrow_mut();
        let tile = known.entry(key).or_insert_with(|| self.tile(key)).as_ref()?;
        let side = (COLOUR_SIDE - 1) as u32;
        let (a, b) = (u - f64::from(i), v - f64::from(j));
        let texel = |di: u32, dj: u32| {
            let at = (j % side + dj) as usize * COLOUR_SIDE + (i % side + di) as usize;
            tile.rgba[at].map(f64::from)
        };
        let corners = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        let mixed = |part: usize| corners.iter().zip(weights).map(|(c, w)| c[part] * w).sum();
        Some(core::array::from_fn(mixed))
    }
}

/// The `index`th of many places, evenly spread over the sphere: longitude and latitude.
pub fn place(index: u64) -> [f64; 2] {
    let share = |bits: u64| (bits >> 11) as f64 / (1_u64 << 53) as f64;
    let bits = overfly_core::digest::mix(index);
    let z = 2.0 * share(bits) - 1.0;
    let lon = std::f64::consts::TAU * share(overfly_core::digest::mix(bits)) - std::f64::consts::PI;
    [lon, atan2(z, (1.0 - z * z).sqrt())]
}

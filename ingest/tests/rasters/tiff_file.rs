//! Small GeoTIFF files of every layout, written by hand.
//!
//! In:    numbers, a layout, georeferencing.
//! Out:   the bytes of a file.
//! Keeps: nothing.
//! Not here: reading; only the compressors are those of the `tiff` crate.

use std::io::Write;
use tiff::encoder::compression::{CompressionAlgorithm, Deflate, DeflateLevel, Lzw, Packbits};

/// How numbers are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Packing {
    Plain,
    Lzw,
    Deflate,
    Packbits,
}

/// A number's type: TIFF's sample format and bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

/// What the file shall be.
#[derive(Clone, Debug)]
pub struct TiffFile {
    pub size: [u32; 2],
    pub values: Vec<f64>,
    pub number: Number,
    /// `None`: strips of `rows_per_strip`.
    pub tile: Option<[u32; 2]>,
    pub rows_per_strip: u32,
    pub packing: Packing,
    /// 1 none, 2 differences, 3 differences of floats' bytes.
    pub predictor: u16,
    pub big_endian: bool,
    pub big_tiff: bool,
    /// Easting and southing of a pixel; none if empty.
    pub scale: Vec<f64>,
    pub tie: Vec<f64>,
    pub transformation: Vec<f64>,
    /// Key and value of short geo keys.
    pub keys: Vec<[u16; 2]>,
    pub nodata: Option<String>,
    pub metadata: Option<String>,
    pub bands: u16,
    /// Chunks left out of the file, as GDAL does with SPARSE_OK.
    pub sparse: Vec<usize>,
}

impl TiffFile {
    /// One degree of areas whose corner is 10 E, 50 N, in int16 strips.
    pub fn new(size: [u32; 2], values: Vec<f64>) -> Self {
        let [columns, rows] = size.map(f64::from);
        Self {
            size,
            values,
            number: Number::I16,
            tile: None,
            rows_per_strip: 3,
            packing: Packing::Plain,
            predictor: 1,
            big_endian: false,
            big_tiff: false,
            scale: vec![1.0 / columns, 1.0 / rows, 0.0],
            tie: vec![0.0, 0.0, 0.0, 10.0, 50.0, 0.0],
            transformation: Vec::new(),
            keys: vec![[1024, 2], [1025, 1], [2048, 4326], [2054, 9102]],
            nodata: None,
            metadata: None,
            bands: 1,
            sparse: Vec::new(),
        }
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Out { bytes: Vec::new(), big_endian: self.big_endian };
        out.bytes.extend(if self.big_endian { b"MM" } else { b"II" });
        let directory_at = if self.big_tiff { 8 } else { 4 };
        if self.big_tiff {
            [43, 8, 0].into_iter().for_each(|number| out.int(number, 2));
            out.int(0, 8);
        } else {
            out.int(42, 2);
            out.int(0, 4);
        }
        let places = self.write_chunks(&mut out);
        let start = out.bytes.len() as u64;
        self.write_directory(&mut out, &places);
        let width = if self.big_tiff { 8 } else { 4 };
        let mut pointer = Out { bytes: Vec::new(), big_endian: self.big_endian };
        pointer.int(start, width);
        out.bytes[directory_at..directory_at + width].copy_from_slice(&pointer.bytes);
        out.bytes
    }

    fn write_chunks(&self, out: &mut Out) -> Vec<[u64; 2]> {
        let [width, height] = self.tile.unwrap_or([self.size[0], self.rows_per_strip]);
        let [across, down] = [self.size[0].div_ceil(width), self.size[1].div_ceil(height)];
        let mut places = Vec::new();
        for chunk in 0..across * down {
            let corner = [chunk % across * width, chunk / across * height];
            let rows =
                if self.tile.is_some() { height } else { height.min(self.size[1] - corner[1]) };
            if self.sparse.contains(&(chunk as usize)) {
                places.push([0, 0]);
                continue;
            }
            let raw: Vec<u8> =
                (0..rows).flat_map(|row| self.row(corner[0], corner[1] + row, width)).collect();
            let mut packed = Vec::new();
            let written = match self.packing {
                Packing::Plain => packed.write(&raw).map(|count| count as u64),
                Packing::Lzw => Lzw.write_to(&mut packed, &raw),
                Packing::Packbits => Packbits.write_to(&mut packed, &raw),
                Packing::Deflate => {
                    Deflate::with_level(DeflateLevel::Fast).write_to(&mut packed, &raw)
                }
            };
            assert_eq!(written.unwrap(), packed.len() as u64);
            places.push([out.bytes.len() as u64, packed.len() as u64]);
            out.bytes.extend(packed);
        }
        places
    }

    /// One row of a chunk as bytes, padded by repeating, predicted.
    fn row(&self, column: u32, row: u32, width: u32) -> Vec<u8> {
        let row = row.min(self.size[1] - 1);
        let value = |at: u32| {
            let column = (column + at).min(self.size[0] - 1);
            self.values[(row * self.size[0] + column) as usize]
        };
        let values: Vec<f64> = (0..width).map(value).collect();
        match self.predictor {
            3 => self.float_row(&values),
            2 => {
                let bits: Vec<u64> = values.iter().map(|&value| self.number.bits(value)).collect();
                let before = std::iter::once(0).chain(bits.iter().copied());
                let differences = bits.iter().zip(before).map(|(now, last)| now.wrapping_sub(last));
                self.join(differences)
            }
            _ => self.join(values.iter().map(|&value| self.number.bits(value))),
        }
    }

    fn join(&self, numbers: impl Iterator<Item = u64>) -> Vec<u8> {
        let mut out = Out { bytes: Vec::new(), big_endian: self.big_endian };
        numbers.for_each(|number| out.int(number, self.number.width()));
        out.bytes
    }

    /// Predictor 3: all first bytes, then all second ones, …; then differences of bytes.
    fn float_row(&self, values: &[f64]) -> Vec<u8> {
        let width = self.number.width();
        let mut bytes = Vec::new();
        for byte in (0..width).rev() {
            bytes.extend(values.iter().map(|&value| (self.number.bits(value) >> (8 * byte)) as u8));
        }
        for at in (1..bytes.len()).rev() {
            bytes[at] = bytes[at].wrapping_sub(bytes[at - 1]);
        }
        bytes
    }

    fn write_directory(&self, out: &mut Out, places: &[[u64; 2]]) {
        let mut keys = vec![1, 1, 0, self.keys.len() as u64];
        keys.extend(self.keys.iter().flat_map(|&[key, value]| [key.into(), 0, 1, value.into()]));
        let packing = match self.packing {
            Packing::Plain => 1,
            Packing::Lzw => 5,
            Packing::Deflate => 8,
            Packing::Packbits => 32773,
        };
        let (format, bits) = (self.number.format(), 8 * self.number.width() as u64);
        let [offsets, counts] = [0, 1].map(|of| places.iter().map(|place| place[of]).collect());
        let mut tags = vec![
            Tag::ints(256, 4, vec![self.size[0].into()]),
            Tag::ints(257, 4, vec![self.size[1].into()]),
            Tag::ints(258, 3, vec![bits; self.bands.into()]),
            Tag::ints(259, 3, vec![packing]),
            Tag::ints(262, 3, vec![1]),
            Tag::ints(277, 3, vec![self.bands.into()]),
            Tag::ints(317, 3, vec![self.predictor.into()]),
            Tag::ints(339, 3, vec![format; self.bands.into()]),
        ];
        let wide = if self.big_tiff { 16 } else { 4 };
        if let Some([width, height]) = self.tile {
            tags.push(Tag::ints(322, 4, vec![width.into()]));
            tags.push(Tag::ints(323, 4, vec![height.into()]));
            tags.push(Tag::ints(324, wide, offsets));
            tags.push(Tag::ints(325, wide, counts));
        } else {
            tags.push(Tag::ints(273, wide, offsets));
            tags.push(Tag::ints(278, 4, vec![self.rows_per_strip.into()]));
            tags.push(Tag::ints(279, wide, counts));
        }
        tags.push(Tag::doubles(33550, &self.scale));
        tags.push(Tag::doubles(33922, &self.tie));
        tags.push(Tag::doubles(34264, &self.transformation));
        if !self.keys.is_empty() {
            tags.push(Tag::ints(34735, 3, keys));
        }
        tags.push(Tag::text(42112, self.metadata.as_deref()));
        tags.push(Tag::text(42113, self.nodata.as_deref()));
        tags.retain(|tag| !tag.values.is_empty());
        tags.sort_by_key(|tag| tag.number);
        out.directory(&tags, self.big_tiff);
    }
}

impl Number {
    pub fn width(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn format(self) -> u64 {
        match self {
            Self::U8 | Self::U16 | Self::U32 => 1,
            Self::I8 | Self::I16 | Self::I32 => 2,
            Self::F32 | Self::F64 => 3,
        }
    }

    fn bits(self, value: f64) -> u64 {
        match self {
            Self::F32 => (value as f32).to_bits().into(),
            Self::F64 => value.to_bits(),
            _ => value as i64 as u64,
        }
    }
}

struct Tag {
    number: u16,
    kind: u16,
    values: Vec<u64>,
}

impl Tag {
    fn ints(number: u16, kind: u16, values: Vec<u64>) -> Self {
        Self { number, kind, values }
    }

    fn doubles(number: u16, values: &[f64]) -> Self {
        Self { number, kind: 12, values: values.iter().map(|value| value.to_bits()).collect() }
    }

    fn text(number: u16, text: Option<&str>) -> Self {
        let bytes = text.map(|text| text.bytes().chain([0]).map(u64::from).collect());
        Self { number, kind: 2, values: bytes.unwrap_or_default() }
    }

    fn width(&self) -> usize {
        match self.kind {
            2 => 1,
            3 => 2,
            4 => 4,
            _ => 8,
        }
    }
}

struct Out {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl Out {
    fn int(&mut self, number: u64, width: usize) {
        if self.big_endian {
            self.bytes.extend(&number.to_be_bytes()[8 - width..]);
        } else {
            self.bytes.extend(&number.to_le_bytes()[..width]);
        }
    }

    fn directory(&mut self, tags: &[Tag], big_tiff: bool) {
        let (count_width, field) = if big_tiff { (8, 8) } else { (2, 4) };
        self.int(tags.len() as u64, count_width);
        let entry = 4 + 2 * field;
        let mut values_at = self.bytes.len() + tags.len() * entry + field;
        let mut values = Out { bytes: Vec::new(), big_endian: self.big_endian };
        for tag in tags {
            self.int(tag.number.into(), 2);
            self.int(tag.kind.into(), 2);
            self.int(tag.values.len() as u64, field);
            let mut own = Out { bytes: Vec::new(), big_endian: self.big_endian };
            tag.values.iter().for_each(|&value| own.int(value, tag.width()));
            if own.bytes.len() <= field {
                own.bytes.resize(field, 0);
                self.bytes.extend(own.bytes);
            } else {
                self.int(values_at as u64, field);
                values_at += own.bytes.len();
                values.bytes.extend(own.bytes);
            }
        }
        self.int(0, field);
        self.bytes.extend(values.bytes);
    }
}

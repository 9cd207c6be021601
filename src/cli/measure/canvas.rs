//! A picture that charts are drawn on: points and letters, without any system library.
//!
//! In:    what `plotters` draws.
//! Out:   a PNG.
//! Keeps: the pixels.
//! Not here: the charts (`charts`).

use crate::cli::{Failure, write_whole};
use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};
use image::{ImageFormat, RgbImage};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};
use std::convert::Infallible;
use std::io::Cursor;
use std::path::Path;

/// Pixels, three bytes each.
pub struct Canvas {
    image: RgbImage,
}

/// Side of a letter's grid.
const GRID: i32 = 8;

impl Canvas {
    /// A white one.
    pub fn new([width, height]: [u32; 2]) -> Self {
        Self { image: RgbImage::from_pixel(width, height, image::Rgb([255; 3])) }
    }

    /// Writes it as PNG.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let mut bytes = Cursor::new(Vec::new());
        self.image.write_to(&mut bytes, ImageFormat::Png)?;
        write_whole(path, &bytes.into_inner())
    }
}

/// Pixels of a letter's side for a font size: whole dots, so that letters stay sharp.
fn dot_px(size: f64) -> i32 {
    if size < 20.0 { 1 } else { 2 }
}

fn length_px(text: &str, size: f64) -> i32 {
    let letters = i32::try_from(text.chars().count()).unwrap_or(i32::MAX / 64);
    letters * GRID * dot_px(size)
}

/// Where a dot of a text lies, given where it would lie if the text ran to the right.
fn turned(transform: &FontTransform, (x, y): (i32, i32)) -> (i32, i32) {
    match transform {
        FontTransform::Rotate90 => (-y, x),
        FontTransform::Rotate180 => (-x, -y),
        FontTransform::Rotate270 => (y, -x),
        _ => (x, y),
    }
}

impl DrawingBackend for &mut Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.image.dimensions()
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn draw_pixel(
        &mut self,
        (x, y): BackendCoord,
        BackendColor { alpha, rgb: (r, g, b) }: BackendColor,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        let place = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        let Some(pixel) = place.and_then(|(x, y)| self.image.get_pixel_mut_checked(x, y)) else {
            return Ok(());
        };
        for (old, new) in pixel.0.iter_mut().zip([r, g, b]) {
            let mixed = f64::from(*old) * (1.0 - alpha) + f64::from(new) * alpha;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a byte")]
            let mixed = mixed.round().clamp(0.0, 255.0) as u8;
            *old = mixed;
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let size = (length_px(text, style.size()), GRID * dot_px(style.size()));
        let (width, height) = turned(&style.transform(), size);
        Ok((width.unsigned_abs(), height.unsigned_abs()))
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        (x, y): BackendCoord,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        let dot = dot_px(style.size());
        let length = length_px(text, style.size());
        let left = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Center => -length / 2,
            HPos::Right => -length,
        };
        let top = match style.anchor().v_pos {
            VPos::Top => 0,
            VPos::Center => -GRID * dot / 2,
            VPos::Bottom => -GRID * dot,
        };
        let turn = style.transform();
        let ink = (0_i32..).zip(text.chars()).flat_map(|(index, letter)| {
            let corner = (left + index * GRID * dot, top);
            dots(letter).map(move |place| (corner.0 + place.0 * dot, corner.1 + place.1 * dot))
        });
        for corner in ink {
            for (i, j) in (0..dot).flat_map(|i| (0..dot).map(move |j| (i, j))) {
                let (dx, dy) = turned(&turn, (corner.0 + i, corner.1 + j));
                self.draw_pixel((x + dx, y + dy), style.color())?;
            }
        }
        Ok(())
    }
}

/// The set dots of a letter; none where the font has no such letter.
fn dots(letter: char) -> impl Iterator<Item = (i32, i32)> {
    let rows = BASIC_FONTS.get(letter).or_else(|| LATIN_FONTS.get(letter)).unwrap_or_default();
    let cells = (0..GRID).flat_map(|y| (0..GRID).map(move |x| (x, y)));
    cells.filter(move |&(x, y)| rows[y.unsigned_abs() as usize] >> x & 1 == 1)
}

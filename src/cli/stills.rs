//! Stills of a replay, and the sheet that shows them together.
//!
//! In:    RGBA pictures of drawn frames.
//! Out:   PNG files, written beside and renamed; a contact sheet.
//! Keeps: small copies for the sheet.
//! Not here: drawing.

use super::{Failure, write_whole};
use image::imageops::{FilterType, overlay, resize};
use image::{ImageFormat, Rgba, RgbaImage};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Pictures side by side on the sheet.
const COLUMNS: u32 = 2;
/// Width of a picture on the sheet in pixels.
const SMALL_PX: u32 = 640;
/// Space around the pictures of the sheet in pixels.
const GAP_PX: u32 = 6;

/// Which frames of `count` to take as stills: evenly spread, first and last among them.
pub fn chosen(first: usize, count: usize, stills: usize) -> Vec<usize> {
    let last = count.saturating_sub(1);
    let mut frames: Vec<usize> = match stills {
        0 => Vec::new(),
        1 => vec![first + last / 2],
        n => (0..n).map(|i| first + (i * last + (n - 1) / 2) / (n - 1)).collect(),
    };
    frames.dedup();
    frames
}

/// The stills of one run.
pub struct Stills {
    folder: PathBuf,
    name: String,
    small: Vec<RgbaImage>,
    /// Files written so far.
    pub files: Vec<PathBuf>,
}

impl Stills {
    /// Stills to be written to `folder` under names that begin with `name`.
    pub fn new(folder: PathBuf, name: &str) -> Self {
        Self { folder, name: name.to_owned(), small: Vec::new(), files: Vec::new() }
    }

    /// Writes one picture: `size_px` RGBA rows, top first.
    pub fn add(
        &mut self,
        frame: usize,
        view: &str,
        size_px: [u32; 2],
        pixels: Vec<u8>,
    ) -> Result<(), Failure> {
        let picture = RgbaImage::from_raw(size_px[0], size_px[1], pixels)
            .ok_or("the renderer gave a picture of another size")?;
        self.write(&picture, &format!("{}-{view}{frame:06}.png", self.name))?;
        let height = (SMALL_PX * size_px[1] / size_px[0]).max(1);
        self.small.push(resize(&picture, SMALL_PX, height, FilterType::Triangle));
        Ok(())
    }

    /// Writes the contact sheet, if there are pictures.
    pub fn finish(mut self) -> Result<Vec<PathBuf>, Failure> {
        let Some((width, height)) = self.small.first().map(RgbaImage::dimensions) else {
            return Ok(self.files);
        };
        let count = u32::try_from(self.small.len())?;
        let (columns, rows) = (COLUMNS.min(count), count.div_ceil(COLUMNS));
        let mut sheet = RgbaImage::from_pixel(
            columns * (width + GAP_PX) + GAP_PX,
            rows * (height + GAP_PX) + GAP_PX,
            Rgba([24, 24, 24, 255]),
        );
        for (index, small) in (0_u32..).zip(&self.small) {
            let x = GAP_PX + index % COLUMNS * (width + GAP_PX);
            let y = GAP_PX + index / COLUMNS * (height + GAP_PX);
            overlay(&mut sheet, small, i64::from(x), i64::from(y));
        }
        self.write(&sheet, &format!("{}-contact.png", self.name))?;
        Ok(self.files)
    }

    fn write(&mut self, picture: &RgbaImage, file: &str) -> Result<(), Failure> {
        let path = self.folder.join(file);
        write_image(&path, picture)?;
        self.files.push(path);
        Ok(())
    }
}

/// Writes a picture of RGBA rows, top first, as PNG.
pub fn write_png(path: &Path, size_px: [u32; 2], pixels: Vec<u8>) -> Result<(), Failure> {
    let picture = RgbaImage::from_raw(size_px[0], size_px[1], pixels)
        .ok_or("the renderer gave a picture of another size")?;
    write_image(path, &picture)
}

fn write_image(path: &Path, picture: &RgbaImage) -> Result<(), Failure> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    write_whole(path, bytes.get_ref())
}

#[cfg(test)]
mod tests {
    use super::chosen;

    #[test]
    fn stills_are_spread_from_the_first_frame_to_the_last() {
        assert_eq!(chosen(10, 100, 4), [10, 43, 76, 109]);
        assert_eq!(chosen(0, 100, 1), [49]);
        assert_eq!(chosen(0, 3, 8), [0, 1, 2]);
        assert_eq!(chosen(0, 100, 0), [0_usize; 0]);
    }
}

//! A picture and its halves, on disk: each level is half as wide and high as the one before.
//!
//! In:    rows from north to south, sRGB and alpha.
//! Out:   blocks of any level, as light that is weighted by alpha.
//! Keeps: an unnamed file, which vanishes with the process; the blocks used last, 96 MiB.
//! Not here: reading pictures (`picture`), which level a texel takes (`texels`).
//!
//! Every level covers exactly the picture's extent, so a pixel of a level is the mean over its
//! share of the pixels before, whole or not: nothing shifts, and what goes round still does. Sums
//! are whole numbers.

use bytemuck::cast_slice;
use lru::LruCache;
use overfly_core::datasource::colour::light_of;
use parking_lot::Mutex;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

/// Pixels along a side of a block.
pub const BLOCK_SIDE: u32 = 128;
const BLOCK_PIXELS: usize = (BLOCK_SIDE * BLOCK_SIDE) as usize;
const BLOCK_BYTES: usize = BLOCK_PIXELS * size_of::<Pixel>();
const CACHE_BYTES: usize = 96 << 20;
/// A level no wider and no higher than this is the last.
const LAST_SIDE: u32 = 64;

/// Red, green and blue light times alpha, and alpha: 65535 is all of it.
pub type Pixel = [u16; 4];
/// Pixels of one block, row by row; those beyond the level's edge mean nothing.
pub type Block = [Pixel];

/// Where a level lies in the file.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// Columns and rows.
    pub size: [u32; 2],
    first_block: u64,
}

impl Level {
    fn across(&self) -> u32 {
        self.size[0].div_ceil(BLOCK_SIDE)
    }

    fn blocks(&self) -> u64 {
        u64::from(self.across()) * u64::from(self.size[1].div_ceil(BLOCK_SIDE))
    }
}

/// The finished levels.
pub struct Mips {
    file: File,
    levels: Vec<Level>,
    recent: Mutex<LruCache<u64, Arc<Block>>>,
}

impl Mips {
    /// The levels, the picture itself first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Number of the block that holds a pixel of a level.
    pub fn block_of(&self, level: usize, [x, y]: [u32; 2]) -> u64 {
        let of = &self.levels[level];
        of.first_block
            + u64::from(y / BLOCK_SIDE) * u64::from(of.across())
            + u64::from(x / BLOCK_SIDE)
    }

    /// A block.
    ///
    /// # Errors
    /// It cannot be read back.
    pub fn block(&self, number: u64) -> io::Result<Arc<Block>> {
        if let Some(block) = self.recent.lock().get(&number) {
            return Ok(block.clone());
        }
        let mut pixels = vec![[0; 4]; BLOCK_PIXELS];
        let bytes = bytemuck::cast_slice_mut(&mut pixels);
        self.file.read_exact_at(bytes, number * BLOCK_BYTES as u64)?;
        let block: Arc<Block> = pixels.into();
        let mut recent = self.recent.lock();
        recent.put(number, block.clone());
        while recent.len() * BLOCK_BYTES > CACHE_BYTES {
            recent.pop_lru();
        }
        Ok(block)
    }
}

/// Levels in the making.
pub struct Making {
    file: File,
    rows: Vec<Rows>,
    /// One row as light.
    light: Vec<Pixel>,
}

/// One level in the making.
struct Rows {
    level: Level,
    /// A row of blocks.
    band: Vec<Pixel>,
    done: u32,
    halving: Option<Halving>,
}

/// From rows of one level to those of the next.
struct Halving {
    from: [u32; 2],
    to: [u32; 2],
    /// Sums over the rows so far, a column of the next level each.
    sums: Vec<[u64; 4]>,
    /// One row, summed along it; and one column beyond, which stays empty.
    row: Vec<[u64; 4]>,
    /// Rows taken, and how far the sums reach, in parts of which a row of the next level has
    /// `from[1]` and one of this level `to[1]`.
    taken: u64,
    made: u64,
    out: Vec<Pixel>,
}

impl Making {
    /// Nothing yet of a picture of this size, in a folder.
    ///
    /// # Errors
    /// If no file can be made there.
    pub fn new(folder: &Path, size: [u32; 2]) -> io::Result<Self> {
        let mut rows: Vec<Rows> = Vec::new();
        let (mut next, mut first_block) = (Some(size), 0);
        while let Some(size) = next {
            let level = Level { size, first_block };
            first_block += level.blocks();
            let is_last = size.iter().all(|&side| side <= LAST_SIDE);
            next = (!is_last).then(|| size.map(|side| side.div_ceil(2)));
            let band = vec![[0; 4]; level.across() as usize * BLOCK_PIXELS];
            rows.push(Rows {
                level,
                band,
                done: 0,
                halving: next.map(|to| Halving::new(size, to)),
            });
        }
        let light = Vec::with_capacity(size[0] as usize);
        Ok(Self { file: tempfile::tempfile_in(folder)?, rows, light })
    }

    /// Takes the next row in.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn push(&mut self, row: &[[u8; 4]]) -> io::Result<()> {
        self.light.clear();
        self.light.extend(row.iter().map(|&texel| light(texel)));
        push(&self.file, &mut self.rows, &self.light)
    }

    /// The levels, once all rows are in.
    pub fn finish(self) -> Mips {
        let levels = self.rows.iter().map(|rows| rows.level).collect();
        Mips { file: self.file, levels, recent: Mutex::new(LruCache::unbounded()) }
    }
}

fn light([red, green, blue, alpha]: [u8; 4]) -> Pixel {
    let weighted = |byte: u8| {
        let product = u32::from(light_of(byte)) * u32::from(alpha);
        u16::try_from((product + 127) / 255).expect("no more than the light")
    };
    [weighted(red), weighted(green), weighted(blue), u16::from(alpha) * 257]
}

/// Puts a row into the first of these levels, and what comes of it into the others.
fn push(file: &File, levels: &mut [Rows], row: &[Pixel]) -> io::Result<()> {
    let Some((first, others)) = levels.split_first_mut() else { return Ok(()) };
    first.put(file, row)?;
    let Some(halving) = &mut first.halving else { return Ok(()) };
    halving.along(row);
    while halving.down() {
        push(file, others, &halving.out)?;
    }
    Ok(())
}

impl Rows {
    fn put(&mut self, file: &File, row: &[Pixel]) -> io::Result<()> {
        let (side, line) = (BLOCK_SIDE as usize, (self.done % BLOCK_SIDE) as usize);
        for (block, part) in row.chunks(side).enumerate() {
            let start = block * BLOCK_PIXELS + line * side;
            self.band[start..start + part.len()].copy_from_slice(part);
        }
        self.done += 1;
        if self.done.is_multiple_of(BLOCK_SIDE) || self.done == self.level.size[1] {
            let down = u64::from((self.done - 1) / BLOCK_SIDE);
            let block = self.level.first_block + down * u64::from(self.level.across());
            file.write_all_at(cast_slice(&self.band), block * BLOCK_BYTES as u64)?;
        }
        Ok(())
    }
}

impl Halving {
    fn new(from: [u32; 2], to: [u32; 2]) -> Self {
        let width = to[0] as usize;
        Self {
            from,
            to,
            sums: vec![[0; 4]; width],
            row: vec![[0; 4]; width + 1],
            taken: 0,
            made: 0,
            out: vec![[0; 4]; width],
        }
    }

    /// Sums a row over the columns of the next level.
    fn along(&mut self, row: &[Pixel]) {
        let [from, to] = [self.from[0], self.to[0]].map(u64::from);
        self.row.fill([0; 4]);
        let (mut column, mut border) = (0, from);
        for (at, pixel) in (0..).zip(row) {
            // A column is `to` parts wide here, one of the next level `from`: two at most meet it.
            let (start, end): (u64, u64) = (at * to, (at + 1) * to);
            let pixel = pixel.map(u64::from);
            add(&mut self.row[column], pixel, border.min(end) - start);
            add(&mut self.row[column + 1], pixel, end.saturating_sub(border));
            if border <= end {
                (column, border) = (column + 1, border + from);
            }
        }
        self.taken += 1;
    }

    /// Adds what is left of the last row; says whether a row of the next level is finished.
    fn down(&mut self) -> bool {
        let [from, to] = [self.from[1], self.to[1]].map(u64::from);
        let start = self.made.max((self.taken - 1) * to);
        let end = self.taken * to;
        let border = (start / from + 1) * from;
        let reached = border.min(end);
        if start == reached {
            return false;
        }
        for (sum, &part) in self.sums.iter_mut().zip(&self.row) {
            add(sum, part, reached - start);
        }
        self.made = reached;
        if reached < border {
            return false;
        }
        let whole = u64::from(self.from[0]) * from;
        for (out, sum) in self.out.iter_mut().zip(&mut self.sums) {
            *out = sum.map(|part| {
                u16::try_from((part + whole / 2) / whole).expect("a mean of 16-bit numbers")
            });
            *sum = [0; 4];
        }
        true
    }
}

fn add(sum: &mut [u64; 4], part: [u64; 4], weight: u64) {
    sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part * weight);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mips(size: [u32; 2], pixel: impl Fn(u32, u32) -> [u8; 4]) -> Mips {
        let folder = tempfile::tempdir().unwrap();
        let mut making = Making::new(folder.path(), size).unwrap();
        for y in 0..size[1] {
            let row: Vec<_> = (0..size[0]).map(|x| pixel(x, y)).collect();
            making.push(&row).unwrap();
        }
        making.finish()
    }

    fn pixel(mips: &Mips, level: usize, [x, y]: [u32; 2]) -> Pixel {
        let block = mips.block(mips.block_of(level, [x, y])).unwrap();
        block[(y % BLOCK_SIDE * BLOCK_SIDE + x % BLOCK_SIDE) as usize]
    }

    #[test]
    fn the_first_level_is_the_picture_and_one_colour_stays_it() {
        let speckled = mips([300, 150], |x, y| [(x % 251) as u8, (y % 251) as u8, 7, 255]);
        let sizes: Vec<_> = speckled.levels().iter().map(|level| level.size).collect();
        assert_eq!(sizes, [[300, 150], [150, 75], [75, 38], [38, 19]]);
        for at in [[0, 0], [127, 127], [128, 128], [299, 149], [250, 3]] {
            let [x, y] = at.map(|at| light_of((at % 251) as u8));
            assert_eq!(pixel(&speckled, 0, at), [x, y, light_of(7), 65535]);
        }
        let plain = mips([301, 149], |_, _| [200, 100, 50, 128]);
        for level in 0..plain.levels().len() {
            let [width, height] = plain.levels()[level].size;
            for at in [[0, 0], [width - 1, 0], [width / 2, height - 1]] {
                assert_eq!(pixel(&plain, level, at), light([200, 100, 50, 128]), "{level} {at:?}");
            }
        }
    }

    #[test]
    fn every_level_keeps_the_mean_of_light_whatever_the_size() {
        for size in [[256, 128], [301, 149], [97, 200]] {
            let mips = mips(size, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }, 0, 0, 255]);
            let mean = |level: usize| {
                let [width, height] = mips.levels()[level].size;
                let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
                let sum: u64 = places.map(|at| u64::from(pixel(&mips, level, at)[0])).sum();
                sum as f64 / f64::from(width * height)
            };
            for level in 1..mips.levels().len() {
                assert!((mean(level) - mean(0)).abs() < 1.0, "{size:?} {level}");
            }
        }
    }
}

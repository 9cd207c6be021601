//! The colour of a texel: the mean of the picture over what the texel stands for.
//!
//! In:    a picture with its halves, its grid; a lattice point and a depth.
//! Out:   sRGB and alpha, the same from every tile that holds the point.
//! Keeps: [`Texels`]: the blocks of one tile.
//! Not here: which tiles there are (`place`), writing them (the parent).
//!
//! A texel's foot is a tent, as wide to either side as texels are apart there, laid over the halves
//! of the picture whose pixels are just smaller; where texels are denser than pixels it is bilinear.
//! Towards a pole pixels become narrow and the tent many columns wide, at the pole itself all of
//! them: so all longitudes meet in one colour there.

use super::mips::{BLOCK_SIDE, Block, Mips};
use super::place::texel_step;
use crate::block::lon_lat_of;
use crate::raster::{Grid, MERCATOR_RADIUS_M, Projection};
use glam::IVec3;
use overfly_core::datasource::PageKey;
use overfly_core::datasource::colour::{COLOUR_SIDE, COLOUR_TEXELS, byte_of, texel_point};
use overfly_core::geodesy::trig;
use overfly_core::lattice::normal_of;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Latitudes from here on are the pole, in degrees; places this near to an edge are on it.
const POLE_DEG: f64 = 90.0 - 1e-9;
const EDGE_PIXELS: f64 = 1e-6;
/// Blocks that one tile holds on to at most.
const BLOCKS_MAX: usize = 1024;

/// What all tiles are made from.
pub struct Canvas {
    mips: Mips,
    grid: Grid,
    /// Depth of the last tiles.
    depth: u8,
    /// Cosine of latitude of every row, by level.
    cosines: Vec<Vec<f64>>,
    /// Whether the first and the last row end at a pole.
    ends_at_pole: [bool; 2],
}

impl Canvas {
    /// A picture that lies so, for tiles down to `depth`.
    pub fn new(mips: Mips, grid: Grid, depth: u8) -> Self {
        let rows = f64::from(grid.rows);
        let cosines = |height: u32| {
            let row = |y: u32| (f64::from(y) + 0.5) * rows / f64::from(height) - 0.5;
            (0..height).map(|y| trig::cos(grid.lon_lat(0.0, row(y))[1]).abs()).collect()
        };
        let cosines = mips.levels().iter().map(|level| cosines(level.size[1])).collect();
        let is_pole = |row: f64| grid.lon_lat(0.0, row)[1].abs().to_degrees() >= POLE_DEG;
        let ends_at_pole = [is_pole(-0.5), is_pole(rows - 0.5)];
        Self { mips, grid, depth, cosines, ends_at_pole }
    }

    /// The texels of a tile; `None` where it shows nothing.
    ///
    /// # Errors
    /// The picture cannot be read back.
    pub fn tile(&self, key: PageKey) -> io::Result<Option<Box<[[u8; 4]]>>> {
        let mut texels = Texels { canvas: self, blocks: BTreeMap::new() };
        let places = (0..COLOUR_TEXELS).map(|at| [at % COLOUR_SIDE, at / COLOUR_SIDE]);
        let rgba: io::Result<Box<[_]>> =
            places.map(|[i, j]| texels.at(texel_point(key, i, j), key.depth())).collect();
        Ok(Some(rgba?).filter(|rgba| rgba.iter().any(|texel| texel[3] > 0)))
    }
}

/// The texels of one tile.
struct Texels<'a> {
    canvas: &'a Canvas,
    blocks: BTreeMap<u64, Arc<Block>>,
}

/// What a texel stands for.
struct Foot {
    level: usize,
    /// Column and row of its middle in the level's pixels.
    middle: [f64; 2],
    /// Rows that the tent reaches to either side.
    rows: f64,
    /// Columns that it reaches where a row is as long as the equator.
    columns: f64,
    /// Cosine of its latitude.
    cosine: f64,
    /// Whether what lies outside the picture counts as nothing, or not at all.
    outside_counts: bool,
}

/// Light weighted by alpha, alpha, and the weight of all.
#[derive(Clone, Copy, Default)]
struct Sum {
    light: [f64; 4],
    weight: f64,
}

impl Sum {
    fn add(&mut self, light: [f64; 4], weight: f64) {
        (0..4).for_each(|part| self.light[part] += weight * light[part]);
        self.weight += weight;
    }

    fn mean(&self) -> [f64; 4] {
        self.light.map(|part| part / self.weight)
    }
}

impl Texels<'_> {
    fn at(&mut self, point: IVec3, depth: u8) -> io::Result<[u8; 4]> {
        let Some(foot) = self.canvas.foot(point, depth) else { return Ok([0; 4]) };
        let height = i64::from(self.canvas.mips.levels()[foot.level].size[1]);
        let mut sum = Sum::default();
        for (row, weight) in tent(foot.middle[1], foot.rows) {
            if (0..height).contains(&row) {
                let mean = self.row(&foot, row.unsigned_abs())?;
                mean.into_iter().for_each(|mean| sum.add(mean, weight));
            } else if foot.outside_counts && !self.canvas.ends_at_pole[usize::from(row >= height)] {
                sum.weight += weight;
            }
        }
        Ok(if sum.weight > 0.0 { colour(sum.mean()) } else { [0; 4] })
    }

    /// The mean along a row; `None` where it has no pixel there and that does not count.
    fn row(&mut self, foot: &Foot, row: u64) -> io::Result<Option<[f64; 4]>> {
        let canvas = self.canvas;
        let width = i64::from(canvas.mips.levels()[foot.level].size[0]);
        let row = u32::try_from(row).expect("a row of the level");
        let cosine = foot.cosine.min(canvas.cosines[foot.level][row as usize]);
        let reach = (foot.columns / cosine).max(1.0);
        let mut sum = Sum::default();
        if canvas.grid.wraps && (cosine == 0.0 || 2.0 * reach >= width as f64) {
            for column in 0..width {
                self.add(foot.level, [column, row.into()], 1.0, &mut sum)?;
            }
            return Ok(Some(sum.mean()));
        }
        // Beyond the picture's edges there is nothing to add, so the tent need not go on there.
        let reach = reach.min(2.0 * width as f64 + foot.middle[0].abs());
        for (column, weight) in tent(foot.middle[0], reach) {
            let round = column.rem_euclid(width);
            if round == column || canvas.grid.wraps {
                self.add(foot.level, [round, row.into()], weight, &mut sum)?;
            } else if foot.outside_counts {
                sum.weight += weight;
            }
        }
        Ok((sum.weight > 0.0).then(|| sum.mean()))
    }

    fn add(&mut self, level: usize, at: [i64; 2], weight: f64, sum: &mut Sum) -> io::Result<()> {
        let at = at.map(|at| u32::try_from(at).expect("a pixel of the level"));
        let mips = &self.canvas.mips;
        let number = mips.block_of(level, at);
        let block = match self.blocks.get(&number) {
            Some(block) => block,
            None => {
                if self.blocks.len() >= BLOCKS_MAX {
                    self.blocks.clear();
                }
                let block = mips.block(number)?;
                self.blocks.entry(number).or_insert(block)
            }
        };
        let pixel = block[((at[1] % BLOCK_SIDE) * BLOCK_SIDE + at[0] % BLOCK_SIDE) as usize];
        sum.add(pixel.map(f64::from), weight);
        Ok(())
    }
}

impl Canvas {
    /// What the texel at a lattice point stands for; `None` where the picture has no such place.
    fn foot(&self, point: IVec3, depth: u8) -> Option<Foot> {
        let normal = normal_of(point);
        let [lon, lat] = lon_lat_of(normal);
        let [column, row] = self.grid.place(lon, lat)?;
        let edges = [column, row].map(|at| at + 0.5);
        let is_last = depth == self.depth;
        let within =
            |at: f64, count: u32| at >= -EDGE_PIXELS && at <= f64::from(count) + EDGE_PIXELS;
        let inside = within(edges[1], self.grid.rows)
            && (self.grid.wraps || within(edges[0], self.grid.columns));
        if is_last && !inside {
            return None;
        }
        // Texels are a lattice step times this apart: by the area that one of them stands for.
        let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
        let apart = texel_step(depth) * sum * sum.sqrt();
        let cosine = (normal.x * normal.x + normal.y * normal.y).sqrt();
        let [east, north] = match self.grid.projection {
            Projection::PlateCarree => self.grid.step.map(|step| step.abs().to_radians()),
            Projection::WebMercator => {
                let [east, north] = self.grid.step.map(|step| step.abs() / MERCATOR_RADIUS_M);
                [east, north * cosine]
            }
        };
        let sizes = [f64::from(self.grid.columns), f64::from(self.grid.rows)];
        let reach = [apart / east, apart / north];
        let narrowest = [reach[0] / cosine, reach[1]];
        let shrunk = |level: usize, axis: usize| {
            f64::from(self.mips.levels()[level].size[axis]) / sizes[axis]
        };
        let fits = |level: &usize| (0..2).all(|axis| narrowest[axis] * shrunk(*level, axis) >= 1.0);
        let level = (1..self.mips.levels().len()).take_while(fits).last().unwrap_or(0);
        let middle = [0, 1].map(|axis| edges[axis] * shrunk(level, axis) - 0.5);
        Some(Foot {
            level,
            middle,
            rows: (reach[1] * shrunk(level, 1)).max(1.0),
            columns: reach[0] * shrunk(level, 0),
            cosine,
            outside_counts: !is_last,
        })
    }
}

/// Whole numbers around `middle` with their weights: 1 there, 0 at `reach` from it.
fn tent(middle: f64, reach: f64) -> impl Iterator<Item = (i64, f64)> {
    #[expect(clippy::cast_possible_truncation, reason = "within a few widths of a picture")]
    let [first, last] = [(middle - reach).floor() as i64, (middle + reach).ceil() as i64];
    let weigh = move |at: i64| (at, 1.0 - (at as f64 - middle).abs() / reach);
    (first..=last).map(weigh).filter(|(_, weight)| *weight > 0.0)
}

/// Light weighted by alpha as sRGB and alpha.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 65535")]
fn colour([red, green, blue, alpha]: [f64; 4]) -> [u8; 4] {
    let byte = (alpha / 257.0).round() as u8;
    if byte == 0 {
        return [0; 4];
    }
    let [red, green, blue] = [red, green, blue]
        .map(|light| byte_of((light / alpha * 65535.0).round().clamp(0.0, 65535.0) as u16));
    [red, green, blue, byte]
}

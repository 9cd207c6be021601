//! The noise that the ground's detail is made from: a texture that repeats, made at the start.
//!
//! In:    nothing: it is the same for every planet, and the same bits on every machine.
//! Out:   [`Detail`], on the device.
//! Keeps: image and sampler.
//! Not here: how it lies on the ground (`shaders/grain.wgsl`).
//!
//! A texel is two values around 0 and the gradient of the first. A value is a sum of octaves, each a
//! spline over a lattice of random numbers that have no mean over few cells: so every octave has one
//! size only, and a tile has nothing as large as itself that would show its repetition.

use crate::error::Fault;
use crate::vk::buffer::{Buffer, BufferInfo};
use crate::vk::image::{self, Image, ImageInfo, Sampler};
use crate::vk::{Device, commands::OneOff};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::geodesy::narrow;
use std::sync::Arc;

/// Texels along a side.
const SIDE: usize = 512;
/// Mip levels, the last of one texel.
const LEVELS: u32 = SIDE.ilog2() + 1;
/// Cells along a side and strength of each octave.
const OCTAVES: [(usize, f32); 6] =
    [(8, 0.6), (16, 0.9), (32, 1.0), (64, 1.0), (128, 1.0), (256, 0.7)];
/// Octaves of at least so many cells have creases in the second value: as tufts and stones do.
const CREASED: usize = 64;
/// Root of the mean square of every channel: more would be cut off too often.
const SPREAD: f32 = 0.33;
/// Taps of longer footprints cost more than they show.
const ANISOTROPY_MAX: f32 = 8.0;

/// The texture on the device.
pub(crate) struct Detail {
    pub(crate) image: Image,
    pub(crate) sampler: Sampler,
}

impl Detail {
    pub(crate) fn new(device: &Arc<Device>, one_off: &mut OneOff) -> Result<Self, Fault> {
        let bytes = texels();
        let mut staging = Buffer::new(
            device,
            &BufferInfo {
                name: "ground detail, staged",
                bytes: bytes.len() as u64,
                usage: vk::BufferUsageFlags::TRANSFER_SRC,
                location: MemoryLocation::CpuToGpu,
            },
        )?;
        staging.mapped_mut().copy_from_slice(&bytes);
        let side = u32::try_from(SIDE).expect("sides are short");
        let info = ImageInfo {
            name: "ground detail",
            size_px: [side, side],
            format: vk::Format::R8G8B8A8_UNORM,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
            aspect: vk::ImageAspectFlags::COLOR,
        };
        let image = Image::layered(device, &info, [LEVELS, 1])?;
        one_off.run(|device, buffer| image::fill(device, buffer, (&staging, &image), 4))?;
        let sampler = Sampler::repeating(device, "ground detail", ANISOTROPY_MAX)?;
        Ok(Self { image, sampler })
    }
}

/// A field of `SIDE` rows and columns that goes on at its other side.
type Field = Vec<f32>;

/// All levels one after the other, rows from the top, four bytes a texel.
fn texels() -> Vec<u8> {
    let (mut height, mut first, mut second) = (field(), field(), field());
    for (seed, (cells, strength)) in (0_u32..).step_by(2).zip(OCTAVES) {
        let own = octave(cells, seed);
        let other = octave(cells, seed + 1);
        let size = 1.0 / whole(cells);
        add(&mut first, &own, |v| strength * v);
        // Bumps are as steep in every octave.
        add(&mut height, &own, |v| strength * size * v);
        if cells < CREASED {
            add(&mut second, &other, |v| strength * v);
        } else {
            add(&mut second, &other, |v| strength * v.abs());
        }
    }
    let [mut across, mut down] = gradient(&height);
    level_out(&mut first, 0.0);
    level_out(&mut second, 0.0);
    let spread = spread_of(&across).max(spread_of(&down));
    level_out(&mut across, spread);
    level_out(&mut down, spread);
    let mut level = [first, second, across, down];
    let mut bytes = Vec::with_capacity(SIDE * SIDE * 16 / 3);
    let mut side = SIDE;
    loop {
        for at in 0..side * side {
            bytes.extend(level.each_ref().map(|channel| offset_byte(channel[at])));
        }
        if side == 1 {
            return bytes;
        }
        level = level.map(|channel| halved(&channel, side));
        side /= 2;
    }
}

fn field() -> Field {
    vec![0.0; SIDE * SIDE]
}

fn add(sum: &mut [f32], own: &[f32], shaped: impl Fn(f32) -> f32) {
    for (sum, &v) in sum.iter_mut().zip(own) {
        *sum += shaped(v);
    }
}

/// Small whole numbers, exactly.
fn whole(n: usize) -> f32 {
    narrow(f64::from(u32::try_from(n).expect("sides are short")))
}

/// A number in -1 to 1 for a lattice point. Source: Wellons, "hash-prospector", triple32.
fn random(x: usize, y: usize, seed: u32) -> f32 {
    let place = u32::try_from(y * SIDE + x).expect("sides are short");
    let mut h = place.wrapping_add(seed.wrapping_mul(0x9e37_79b1));
    for (shift, factor) in [(17, 0xed5a_d4bb), (11, 0xac4c_1b51), (15, 0x3184_8bab)] {
        h = (h ^ (h >> shift)).wrapping_mul(factor);
    }
    h ^= h >> 14;
    narrow(f64::from(h) / f64::from(u32::MAX) * 2.0 - 1.0)
}

/// A smooth field with one bump in about every second cell of a `cells` by `cells` lattice; root of
/// the mean square 1.
fn octave(cells: usize, seed: u32) -> Field {
    let lattice: Vec<f32> =
        (0..cells * cells).map(|at| random(at % cells, at / cells, seed)).collect();
    // Less the mean of its neighbourhood: what is wider than a few cells is other octaves' part.
    let near = |at: usize, step: usize| {
        let wrap = |n: usize| (n + step + cells - 1) % cells;
        wrap(at)
    };
    let mut points = vec![0.0; cells * cells];
    for (at, point) in points.iter_mut().enumerate() {
        let (x, y) = (at % cells, at / cells);
        let around = (0..9).map(|k| lattice[near(y, k / 3) * cells + near(x, k % 3)]);
        *point = lattice[at] - around.sum::<f32>() / 9.0;
    }
    let mut rows = vec![0.0; cells * SIDE];
    for y in 0..cells {
        for x in 0..SIDE {
            let (first, weights) = taps(x, cells);
            let tap = |k: usize| weights[k] * points[y * cells + (first + k) % cells];
            rows[y * SIDE + x] = tap(0) + tap(1) + (tap(2) + tap(3));
        }
    }
    let mut out = field();
    for y in 0..SIDE {
        let (first, weights) = taps(y, cells);
        for x in 0..SIDE {
            let tap = |k: usize| weights[k] * rows[(first + k) % cells * SIDE + x];
            out[y * SIDE + x] = tap(0) + tap(1) + (tap(2) + tap(3));
        }
    }
    let scale = 1.0 / spread_of(&out);
    out.iter_mut().for_each(|v| *v *= scale);
    out
}

/// The four cells that a texel takes part in, from the first on, and how much of each: the uniform
/// cubic spline.
fn taps(texel: usize, cells: usize) -> (usize, [f32; 4]) {
    let step = SIDE / cells;
    let t = (whole(texel % step) + 0.5) / whole(step);
    let u = 1.0 - t;
    let weights = [
        u * u * u / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
        t * t * t / 6.0,
    ];
    (texel / step, weights)
}

fn mean_of(field: &[f32]) -> f32 {
    let sum: f64 = field.iter().map(|&v| f64::from(v)).sum();
    narrow(sum / f64::from(whole(field.len())))
}

/// Root of the mean square.
fn spread_of(field: &[f32]) -> f32 {
    let sum: f64 = field.iter().map(|&v| f64::from(v) * f64::from(v)).sum();
    narrow((sum / f64::from(whole(field.len()))).sqrt())
}

/// Takes the mean off, and scales by what brings `spread`, or else its own, to [`SPREAD`].
fn level_out(field: &mut [f32], spread: f32) {
    let mean = mean_of(field);
    field.iter_mut().for_each(|v| *v -= mean);
    let scale = SPREAD / if spread > 0.0 { spread } else { spread_of(field) };
    field.iter_mut().for_each(|v| *v *= scale);
}

/// Central differences along rows and columns.
fn gradient(height: &[f32]) -> [Field; 2] {
    let (mut across, mut down) = (field(), field());
    for y in 0..SIDE {
        let (above, below) = ((y + SIDE - 1) % SIDE * SIDE, (y + 1) % SIDE * SIDE);
        for x in 0..SIDE {
            let at = y * SIDE;
            across[at + x] = height[at + (x + 1) % SIDE] - height[at + (x + SIDE - 1) % SIDE];
            down[at + x] = height[below + x] - height[above + x];
        }
    }
    [across, down]
}

/// The next mip level of a square field: means of four.
fn halved(field: &[f32], side: usize) -> Field {
    let half = side / 2;
    let mean = |at: usize| {
        let corner = at / half * 2 * side + at % half * 2;
        let below = corner + side;
        0.25 * (field[corner] + field[corner + 1] + (field[below] + field[below + 1]))
    };
    (0..half * half).map(mean).collect()
}

/// 128 is 0, and 255 is 1: software devices read signed bytes at half the speed.
fn offset_byte(v: f32) -> u8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 255")]
    let byte = (v.clamp(-1.0, 1.0) * 127.0 + 128.0).round_ties_even() as u8;
    byte
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(bytes: &[u8], number: u32) -> &[u8] {
        let size = |level: u32| 4 * (SIDE >> level) * (SIDE >> level);
        let start: usize = (0..number).map(size).sum();
        &bytes[start..start + size(number)]
    }

    fn channel(texels: &[u8], number: usize) -> impl Iterator<Item = f64> {
        texels.iter().skip(number).step_by(4).map(|b| (f64::from(*b) - 128.0) / 127.0)
    }

    #[test]
    fn the_texture_is_the_same_bits_on_every_machine() {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in texels() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        assert_eq!(hash, 0x4069_fd67_b9b4_9568, "{hash:#018x}");
    }

    #[test]
    fn all_levels_are_there_and_the_last_is_the_mean_of_nothing() {
        let bytes = texels();
        assert_eq!(bytes.len(), (0..LEVELS).map(|l| level(&bytes, l).len()).sum::<usize>());
        assert!(level(&bytes, LEVELS - 1).iter().all(|&b| b.abs_diff(128) <= 1));
    }

    #[test]
    fn every_channel_is_as_strong_as_said_and_seldom_cut_off() {
        let bytes = texels();
        for number in 0..4 {
            let all: Vec<f64> = channel(level(&bytes, 0), number).collect();
            let count = f64::from(whole(all.len()));
            let spread = (all.iter().map(|v| v * v).sum::<f64>() / count).sqrt();
            assert!((spread - f64::from(SPREAD)).abs() < 0.02, "channel {number}: {spread}");
            let cut = all.iter().filter(|v| v.abs() >= 1.0).count();
            assert!(cut * 100 < all.len(), "channel {number}: {cut} texels are cut off");
        }
    }

    #[test]
    fn a_tile_has_nothing_as_large_as_itself() {
        let bytes = texels();
        // Means of a sixteenth of the tile each: a sixth of what single texels are, all in all.
        for number in 0..4 {
            let wide: Vec<f64> = channel(level(&bytes, LEVELS - 3), number).collect();
            let spread = (wide.iter().map(|v| v * v).sum::<f64>() / 16.0).sqrt();
            assert!(spread < 0.2 * f64::from(SPREAD), "channel {number}: {spread}");
        }
    }

    #[test]
    fn opposite_sides_go_on_into_each_other() {
        let bytes = texels();
        let top = level(&bytes, 0);
        let step = |a: usize, b: usize| {
            (0..SIDE).map(move |x| {
                let at = |y: usize| f64::from(top[4 * (y * SIDE + x)]);
                let step = at(a) - at(b);
                step * step
            })
        };
        let seam: f64 = step(SIDE - 1, 0).sum();
        let inside: f64 = step(SIDE / 2, SIDE / 2 + 1).sum();
        assert!(seam < 1.5 * inside, "{seam} across the seam, {inside} inside");
    }
}

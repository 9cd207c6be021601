//! Imagery: squares of sRGB texels that lie over pages, one with each page's key.
//!
//! In:    texels of a tile, or of an ancestor.
//! Out:   [`ColourTile`]; texels of a descendant; one tile's texels over another's.
//! Keeps: nothing but the table between sRGB and light.
//! Not here: making tiles (`overfly_ingest`), their bytes (`overfly_archive`), drawing them.
//!
//! Texels lie on the tile's corners and borders, as samples of pages do, twice as dense: a texel
//! is a function of lattice point and depth, so neighbours share the texels of their border to the
//! bit, and bilinear colour goes on across it without an apron.

use super::key::{DEPTH_MAX, PageKey};
use crate::digest::Chain;
use crate::lattice::{RADIUS, fold};
use glam::IVec3;
use std::sync::LazyLock;

/// A tile's texels are 2^7 + 1 a side.
pub const COLOUR_BITS: u8 = 7;
/// Texels along one side of a tile.
pub const COLOUR_SIDE: usize = (1 << COLOUR_BITS) + 1;
/// Texels of a tile.
pub const COLOUR_TEXELS: usize = COLOUR_SIDE * COLOUR_SIDE;
/// Tiles no deeper than this: their texels are 2 lattice units apart.
pub const COLOUR_DEPTH_MAX: u8 = DEPTH_MAX - 1;

/// Alpha of what hides everything beneath it.
const OPAQUE: u8 = 255;

/// The colour of one page's cell: 65 KiB.
#[derive(Clone, PartialEq, Debug)]
pub struct ColourTile {
    /// Which cell.
    pub key: PageKey,
    /// sRGB and straight alpha; texel (i, j) at `j * COLOUR_SIDE + i`, i along u and j along v.
    /// Where alpha is 0 there is no imagery, and the colour is 0, too.
    pub rgba: Box<[[u8; 4]]>,
    /// Hash of the texels.
    pub content: u64,
}

/// sRGB bytes as light of 16 bits, and back.
struct Tables {
    light: [u16; 256],
    byte: Box<[u8]>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(Tables::new);

impl Tables {
    fn new() -> Self {
        let light = core::array::from_fn(|byte| rounded(decoded(byte as f64 / 255.0) * 65535.0));
        // The byte whose light is nearest by sRGB's own measure: borders lie at half bytes.
        let mut byte = vec![OPAQUE; 1 << 16].into_boxed_slice();
        let mut first = 0;
        for value in 0..OPAQUE {
            let end = decoded((f64::from(value) + 0.5) / 255.0) * 65535.0;
            let end = usize::from(rounded(end.ceil()));
            byte[first..end].fill(value);
            first = end;
        }
        Self { light, byte }
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 65535")]
fn rounded(light: f64) -> u16 {
    light.round() as u16
}

/// sRGB's share of light. Source: IEC 61966-2-1.
fn decoded(share: f64) -> f64 {
    if share <= 0.040_45 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) }
}

/// The light of an sRGB byte, 65535 for white.
pub fn light_of(byte: u8) -> u16 {
    TABLES.light[usize::from(byte)]
}

/// The sRGB byte of a light; the inverse of [`light_of`].
pub fn byte_of(light: u16) -> u8 {
    TABLES.byte[usize::from(light)]
}

/// The lattice point of a tile's texel.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "at most 128")]
pub fn texel_point(key: PageKey, i: usize, j: usize) -> IVec3 {
    let (u, v) = key.origin();
    let step = (RADIUS >> COLOUR_BITS) >> key.depth();
    fold(key.quadrant(), u + i as i32 * step, v + j as i32 * step)
}

/// Hash of texels.
pub fn content_of(rgba: &[[u8; 4]]) -> u64 {
    let mut chain = Chain::default();
    for pair in rgba.chunks(2) {
        let [a, b] = [pair[0], pair.get(1).copied().unwrap_or_default()].map(u32::from_le_bytes);
        chain.add(u64::from(a) << 32 | u64::from(b));
    }
    chain.0
}

impl ColourTile {
    /// A tile of these texels.
    ///
    /// # Panics
    /// If they are not [`COLOUR_TEXELS`].
    pub fn new(key: PageKey, rgba: Box<[[u8; 4]]>) -> Self {
        assert_eq!(rgba.len(), COLOUR_TEXELS, "texels of a tile");
        let content = content_of(&rgba);
        Self { key, rgba, content }
    }

    /// The texels of a descendant's cell, bilinear between this tile's own, in light.
    ///
    /// # Panics
    /// If `key` lies outside of this tile's cell.
    pub fn texels_of(&self, key: PageKey) -> Box<[[u8; 4]]> {
        assert_eq!(key.ancestor(self.key.depth()), self.key, "a descendant");
        let finer = key.depth() - self.key.depth();
        let first = [key.x(), key.y()].map(|at| (at as usize & ((1 << finer) - 1)) << COLOUR_BITS);
        let at = |along: usize| {
            let cell = (along >> finer).min(COLOUR_SIDE - 2);
            (cell, (along - (cell << finer)) as f64 / (1_u64 << finer) as f64)
        };
        let places = (0..COLOUR_TEXELS).map(|index| [index % COLOUR_SIDE, index / COLOUR_SIDE]);
        places.map(|[i, j]| self.between(at(first[0] + i), at(first[1] + j))).collect()
    }

    /// The colour at a share of a cell between texels.
    fn between(&self, (i, a): (usize, f64), (j, b): (usize, f64)) -> [u8; 4] {
        let corner = |di: usize, dj: usize, weight: f64| {
            let [red, green, blue, alpha] = self.rgba[(j + dj) * COLOUR_SIDE + i + di];
            let weight = weight * f64::from(alpha);
            let [red, green, blue] = [red, green, blue].map(|byte| f64::from(light_of(byte)));
            [red * weight, green * weight, blue * weight, weight]
        };
        // In pairs: on a border two corners weigh nothing, and the sum of the other two is the same
        // from either side.
        let add = |a: [f64; 4], b: [f64; 4]| core::array::from_fn(|c| a[c] + b[c]);
        let near = add(corner(0, 0, (1.0 - a) * (1.0 - b)), corner(1, 0, a * (1.0 - b)));
        let far = add(corner(0, 1, (1.0 - a) * b), corner(1, 1, a * b));
        straight(add(near, far))
    }
}

/// sRGB and alpha of light that is weighted by alpha, which is 0 to 255.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded to a byte")]
fn straight([red, green, blue, alpha]: [f64; 4]) -> [u8; 4] {
    let byte = alpha.round().clamp(0.0, 255.0) as u8;
    if byte == 0 {
        return [0; 4];
    }
    let [red, green, blue] =
        [red, green, blue].map(|light| byte_of(rounded((light / alpha).clamp(0.0, 65535.0))));
    [red, green, blue, byte]
}

/// Lays texels over others: where alpha is 0 the lower ones show, where it is between they mix in
/// light. Says whether something could still show from beneath.
pub fn lay_over(upper: &mut [[u8; 4]], lower: &[[u8; 4]]) -> bool {
    let mut open = false;
    for (over, &under) in upper.iter_mut().zip(lower) {
        *over = match over[3] {
            OPAQUE => continue,
            0 => under,
            _ => mixed(*over, under),
        };
        open |= over[3] != OPAQUE;
    }
    open
}

fn mixed(over: [u8; 4], under: [u8; 4]) -> [u8; 4] {
    let share = f64::from(over[3]);
    let rest = f64::from(under[3]) * (1.0 - share / 255.0);
    let light =
        |at: usize| f64::from(light_of(over[at])) * share + f64::from(light_of(under[at])) * rest;
    straight([light(0), light(1), light(2), share + rest])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(key: PageKey, texel: impl Fn(IVec3) -> [u8; 4]) -> ColourTile {
        let places = (0..COLOUR_TEXELS).map(|at| [at % COLOUR_SIDE, at / COLOUR_SIDE]);
        ColourTile::new(key, places.map(|[i, j]| texel(texel_point(key, i, j))).collect())
    }

    /// Some colour that differs from point to point.
    fn speckled(point: IVec3) -> [u8; 4] {
        let bits = crate::digest::mix(crate::lattice::key_of(point));
        let [a, b, c, d, ..] = bits.to_le_bytes();
        [a, b, c, if d < 64 { 0 } else { d }]
    }

    #[test]
    fn every_byte_comes_back_from_light_and_light_rises() {
        for byte in 0..=255 {
            assert_eq!(byte_of(light_of(byte)), byte);
            assert!(byte == 0 || light_of(byte) > light_of(byte - 1));
        }
        assert_eq!((light_of(0), light_of(255), byte_of(65535)), (0, 65535, 255));
        // Half of the light is byte 188 (187.5 by the formula), not 128.
        assert_eq!(byte_of(32768), 188);
    }

    #[test]
    fn texels_are_samples_of_pages_twice_as_dense_and_share_their_borders() {
        let key = PageKey::new(2, 5, 11, 30);
        let last = COLOUR_SIDE - 1;
        assert_eq!(texel_point(key, 0, last), key.sample(0, 64));
        assert_eq!(texel_point(key, 2, 6), key.sample(1, 3));
        let beside = PageKey::new(2, 5, 12, 30);
        for j in 0..COLOUR_SIDE {
            assert_eq!(texel_point(key, last, j), texel_point(beside, 0, j));
        }
    }

    #[test]
    fn texels_of_descendants_meet_their_own_and_each_other() {
        let parent = tile(PageKey::new(1, 3, 5, 2), speckled);
        assert_eq!(
            parent.texels_of(parent.key),
            parent.rgba.iter().map(|&rgba| { if rgba[3] == 0 { [0; 4] } else { rgba } }).collect()
        );
        let [left, right] = [parent.key.child(0), parent.key.child(1)];
        let (near, far) = (parent.texels_of(left), parent.texels_of(right));
        let last = COLOUR_SIDE - 1;
        for j in 0..COLOUR_SIDE {
            assert_eq!(near[j * COLOUR_SIDE + last], far[j * COLOUR_SIDE]);
        }
        assert_eq!(near[4 * COLOUR_SIDE + 6][3], parent.rgba[2 * COLOUR_SIDE + 3][3]);
        // Another parent has the same colours on the border that it shares.
        let beside = tile(PageKey::new(1, 3, 6, 2), speckled);
        let deep = |tile: &ColourTile, x: u32| tile.texels_of(PageKey::new(1, 6, x, 2 * 8 + 5));
        let (near, far) = (deep(&parent, 5 * 8 + 7), deep(&beside, 6 * 8));
        for j in 0..COLOUR_SIDE {
            assert_eq!(near[j * COLOUR_SIDE + last], far[j * COLOUR_SIDE]);
        }
    }

    #[test]
    fn what_lies_beneath_shows_through_holes_and_mixes_in_light() {
        let mut upper = vec![[9, 8, 7, 255], [0; 4], [255, 255, 255, 128], [255, 0, 0, 128]];
        let lower = [[1, 1, 1, 255], [2, 3, 4, 200], [0, 0, 0, 255], [0; 4]];
        assert!(lay_over(&mut upper, &lower));
        assert_eq!(upper[..2], [[9, 8, 7, 255], [2, 3, 4, 200]]);
        assert_eq!(upper[2..], [[188, 188, 188, 255], [255, 0, 0, 128]]);
        assert!(!lay_over(&mut upper, &[[5, 5, 5, 255]; 4]));
        assert_eq!(upper[0], [9, 8, 7, 255]);
    }
}

//! Tiles as bytes: predicted from coarse to fine, coded by an adaptive range coder.
//!
//! In:    a [`Tile`]; or its bytes, its key and the facts of its archive.
//! Out:   the other form, or what is wrong with the bytes.
//! Keeps: nothing.
//! Not here: the coder itself (`coder`), archives (`overfly_archive`).
//!
//! A tile's samples are coded level by level, as the mesh refines: first the corners, then the
//! centres of cells and the middles of their sides, each predicted by a cubic through four known
//! samples. Between known neighbours on both sides a smooth surface is foretold far better than
//! from its rows alone. What is left is coded in the context of how rough it was nearby. Every
//! second sample is in the parent tile already and is taken from there: so a pyramid costs no more
//! than its last level.

use super::coder::{Bit, Decoder, Encoder, Number};
use super::facts::ArchiveFacts;
use super::key::{PAGE_BITS, PAGE_SIDE, PageKey};
use super::page::SAMPLES;
use super::tile::{FULL, LayerTile, MARK_SIDE, Mark, Tile, sea_level_grid, sea_level_side};
use crate::digest::Chain;
use core::fmt;

/// First byte of every tile: the version of this coding.
const VERSION: u8 = 1;
/// No height is as many quanta from sea level.
const QUANTA_END: i32 = 1 << 24;
/// Classes of roughness nearby, and of levels.
const ROUGH: usize = 13;
const FINE: usize = 3;

/// Why bytes are no tile.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TileFault {
    /// Too short to be one.
    Short {
        /// Bytes there are.
        found: usize,
    },
    /// Coded by another version of overfly.
    Version {
        /// What it says.
        found: u8,
    },
    /// The check sum is another: the bytes were damaged.
    Damaged,
    /// Whole, but it names layers that its archive does not have.
    Layers,
    /// Whole, but its numbers make no ground.
    Numbers,
}

impl fmt::Display for TileFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { found } => write!(f, "a tile of {found} bytes is none"),
            Self::Version { found } => {
                write!(f, "the tile is of version {found}; this program reads {VERSION}")
            }
            Self::Damaged => f.write_str("the tile is damaged: its check sum does not agree"),
            Self::Layers => f.write_str("the tile names layers that its archive does not have"),
            Self::Numbers => f.write_str("the tile's numbers make no ground"),
        }
    }
}

impl std::error::Error for TileFault {}

/// One walk over a tile's numbers serves both directions.
enum Stream<'a> {
    Writes(Encoder),
    Reads(Decoder<'a>),
}

impl Stream<'_> {
    /// Writes `value` and returns it, or reads a value.
    fn number(&mut self, context: &mut Number, value: i32) -> i32 {
        match self {
            Self::Writes(encoder) => {
                encoder.number(context, value);
                value
            }
            Self::Reads(decoder) => decoder.number(context),
        }
    }

    fn bit(&mut self, context: &mut Bit, bit: bool) -> bool {
        match self {
            Self::Writes(encoder) => {
                encoder.bit(context, bit);
                bit
            }
            Self::Reads(decoder) => decoder.bit(context),
        }
    }
}

/// A tile as bytes. `parent` is the tile above it, if there is one in the archive.
///
/// # Panics
/// If a layer is not one of the archive's, or a height is 2^24 quanta or more from sea level.
pub fn encode(tile: &Tile, parent: Option<&Tile>, facts: &ArchiveFacts) -> Vec<u8> {
    let mut mask = 0_u16;
    for layer in &tile.layers {
        assert!(usize::from(layer.layer) < facts.layers.len(), "an archive's own layer");
        assert!(layer.quanta.iter().all(|q| q.abs() < QUANTA_END), "heights are of a planet");
        mask |= 1 << layer.layer;
    }
    let [low, high] = mask.to_le_bytes();
    let mut stream = Stream::Writes(Encoder::new(vec![VERSION, low, high]));
    let mut contexts = Contexts::new();
    for layer in &tile.layers {
        let known = Known::of(parent, tile.key, layer.layer);
        contexts.layer(&mut stream, (tile.key, known), facts, &mut layer.clone());
    }
    let Stream::Writes(encoder) = stream else { unreachable!("it was made to write") };
    let mut bytes = encoder.finish();
    let sum = check_sum(tile.key, &bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// The tile that the bytes are. `parent` is the decoded tile above it, if the archive has one.
///
/// # Errors
/// What is wrong with them. Whatever the bytes, memory is that of one tile.
pub fn decode(
    bytes: &[u8],
    key: PageKey,
    parent: Option<&Tile>,
    facts: &ArchiveFacts,
) -> Result<Tile, TileFault> {
    let Some((bytes, sum)) = bytes.split_last_chunk::<4>().filter(|(rest, _)| rest.len() >= 3)
    else {
        return Err(TileFault::Short { found: bytes.len() });
    };
    if bytes[0] != VERSION {
        return Err(TileFault::Version { found: bytes[0] });
    }
    if check_sum(key, bytes) != u32::from_le_bytes(*sum) {
        return Err(TileFault::Damaged);
    }
    let mask = u16::from_le_bytes([bytes[1], bytes[2]]);
    let mut tile = Tile { key, layers: Vec::with_capacity(mask.count_ones() as usize) };
    let mut stream = Stream::Reads(Decoder::new(&bytes[3..]));
    let mut contexts = Contexts::new();
    for layer in (0..16_u8).filter(|layer| mask >> layer & 1 == 1) {
        let known = facts.layers.get(usize::from(layer));
        if known.is_none_or(|known| known.depth < key.depth()) {
            return Err(TileFault::Layers);
        }
        let mut plane = LayerTile {
            layer,
            quanta: Box::new([0; SAMPLES]),
            weights: None,
            filled: None,
            sea_level: Vec::new(),
            marks: Box::new([Mark::default(); MARK_SIDE * MARK_SIDE]),
        };
        let known = Known::of(parent, key, layer);
        contexts.layer(&mut stream, (key, known), facts, &mut plane);
        if plane.quanta.iter().any(|quanta| quanta.unsigned_abs() >= QUANTA_END.unsigned_abs()) {
            return Err(TileFault::Numbers);
        }
        tile.layers.push(plane);
    }
    let Stream::Reads(decoder) = stream else { unreachable!("it was made to read") };
    if decoder.is_exhausted() { Err(TileFault::Numbers) } else { Ok(tile) }
}

fn check_sum(key: PageKey, bytes: &[u8]) -> u32 {
    let mut chain = Chain(key.bits());
    for part in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..part.len()].copy_from_slice(part);
        chain.add(u64::from_le_bytes(word));
    }
    chain.add(bytes.len() as u64);
    (chain.0 >> 32) as u32
}

/// The part of a parent's layer that a tile refines: its sample (0, 0) in it.
#[derive(Clone, Copy)]
struct Known<'a> {
    layer: &'a LayerTile,
    first: usize,
}

impl<'a> Known<'a> {
    fn of(parent: Option<&'a Tile>, key: PageKey, layer: u8) -> Option<Self> {
        let parent = parent.filter(|parent| key.parent() == Some(parent.key))?;
        let half = (PAGE_SIDE - 1) / 2;
        let (column, row) = (key.child_index() % 2 * half, key.child_index() / 2 * half);
        // One without any weight holds nothing: it may not even have been looked at.
        let holds = |plane: &&LayerTile| {
            plane.weights.as_ref().is_none_or(|weights| weights.iter().any(|&weight| weight > 0))
        };
        let layer = parent.layers.iter().find(|plane| plane.layer == layer).filter(holds)?;
        Some(Self { layer, first: row * PAGE_SIDE + column })
    }

    /// Where the parent holds sample `at`, if it does.
    fn place(&self, at: usize) -> Option<usize> {
        let (i, j) = (at % PAGE_SIDE, at / PAGE_SIDE);
        (i % 2 == 0 && j % 2 == 0).then(|| self.first + j / 2 * PAGE_SIDE + i / 2)
    }
}

/// What the stream has learnt so far.
struct Contexts {
    has: [Bit; 3],
    height: [[Number; ROUGH]; FINE],
    corner: Number,
    weight: [Number; 3],
    filled: [Bit; 4],
    sea: [Number; 3],
    mark: [Number; 6],
    edge: [Bit; 2],
    range: [Number; 2],
}

impl Contexts {
    fn new() -> Self {
        Self {
            has: [Bit::NEW; 3],
            height: [[Number::NEW; ROUGH]; FINE],
            corner: Number::NEW,
            weight: [Number::NEW; 3],
            filled: [Bit::NEW; 4],
            sea: [Number::NEW; 3],
            mark: [Number::NEW; 6],
            edge: [Bit::NEW; 2],
            range: [Number::NEW; 2],
        }
    }

    fn layer(
        &mut self,
        stream: &mut Stream<'_>,
        (key, known): (PageKey, Option<Known<'_>>),
        facts: &ArchiveFacts,
        layer: &mut LayerTile,
    ) {
        self.weights(stream, known, layer);
        self.fillings(stream, known, layer);
        self.heights(stream, known, layer);
        let depth = facts.layers[usize::from(layer.layer)].depth;
        self.sea_level(stream, key.depth(), sea_level_grid(depth), &mut layer.sea_level);
        self.marks(stream, &mut layer.marks[..]);
    }

    fn weights(
        &mut self,
        stream: &mut Stream<'_>,
        known: Option<Known<'_>>,
        layer: &mut LayerTile,
    ) {
        if !stream.bit(&mut self.has[0], layer.weights.is_some()) {
            layer.weights = None;
            return;
        }
        let weights = layer.weights.get_or_insert_with(|| Box::new([0; SAMPLES]));
        for at in 0..SAMPLES {
            if let Some((known, place)) = known.and_then(|k| Some((k, k.place(at)?))) {
                weights[at] = known.layer.weight(place);
                continue;
            }
            let (left, below) = neighbours(&weights[..], at, FULL);
            let (class, expected) = match (i32::from(left), i32::from(below)) {
                (left, below) if left == below => (usize::from(left % 255 == 0), left),
                (left, below) => (2, (left + below) / 2),
            };
            let value = i32::from(weights[at]);
            let value = expected + stream.number(&mut self.weight[class], value - expected);
            weights[at] = u8::try_from(value.clamp(0, 255)).expect("clamped");
        }
    }

    fn fillings(
        &mut self,
        stream: &mut Stream<'_>,
        known: Option<Known<'_>>,
        layer: &mut LayerTile,
    ) {
        if !stream.bit(&mut self.has[1], layer.filled.is_some()) {
            layer.filled = None;
            return;
        }
        let filled = layer.filled.get_or_insert_with(|| Box::new([false; SAMPLES]));
        for at in 0..SAMPLES {
            if let Some((known, place)) = known.and_then(|k| Some((k, k.place(at)?))) {
                filled[at] = known.layer.filled.as_ref().is_some_and(|filled| filled[place]);
                continue;
            }
            let (left, below) = neighbours(&filled[..], at, false);
            let class = usize::from(left) + 2 * usize::from(below);
            filled[at] = stream.bit(&mut self.filled[class], filled[at]);
        }
    }

    fn heights(
        &mut self,
        stream: &mut Stream<'_>,
        known: Option<Known<'_>>,
        layer: &mut LayerTile,
    ) {
        let mut heights = Heights::of(layer);
        let levels = if let Some(known) = known {
            heights.take(known);
            1
        } else {
            self.corners(stream, &mut heights);
            PAGE_BITS
        };
        for (level, sides) in (0..levels).rev().flat_map(|level| [(level, false), (level, true)]) {
            for place in new_places(1 << level, sides) {
                self.sample(stream, &mut heights, place, (level, sides));
            }
        }
    }

    fn corners(&mut self, stream: &mut Stream<'_>, heights: &mut Heights<'_>) {
        let last = PAGE_SIDE - 1;
        let mut expected = 0;
        for at in [0, last, last * PAGE_SIDE, last * PAGE_SIDE + last] {
            if !heights.is_seen(at) {
                heights.quanta[at] = 0;
                continue;
            }
            let left = heights.quanta[at].wrapping_sub(expected);
            let left = stream.number(&mut self.corner, left);
            heights.quanta[at] = expected.wrapping_add(left);
            expected = heights.quanta[at];
        }
    }

    /// A sample that a level adds, in the context of how rough it was around it.
    fn sample(
        &mut self,
        stream: &mut Stream<'_>,
        heights: &mut Heights<'_>,
        (i, j): (usize, usize),
        (level, sides): (u8, bool),
    ) {
        let at = j * PAGE_SIDE + i;
        if !heights.is_seen(at) {
            heights.quanta[at] = 0;
            return;
        }
        let step = 1 << level;
        let class = usize::from(level).min(FINE - 1);
        let guess = heights.guess((i, j), (step, sides));
        let Guess { expected, spread } =
            guess.unwrap_or(Guess { expected: heights.before, spread: 4 });
        let rough = roughness(&heights.sizes, (i, j), step, spread);
        let left = heights.quanta[at].wrapping_sub(expected);
        let left = stream.number(&mut self.height[class][rough], left);
        heights.quanta[at] = expected.wrapping_add(left);
        heights.before = heights.quanta[at];
        heights.sizes[at] = u8::try_from(left.unsigned_abs().min(254)).expect("capped") + 1;
    }

    fn sea_level(
        &mut self,
        stream: &mut Stream<'_>,
        depth: u8,
        grid: u8,
        sea_level: &mut Vec<i32>,
    ) {
        if !stream.bit(&mut self.has[2], !sea_level.is_empty()) {
            sea_level.clear();
            return;
        }
        let side = sea_level_side(depth, grid);
        sea_level.resize(side * side, 0);
        for at in 0..side * side {
            let (i, j) = (at % side, at / side);
            let known = |back: usize| sea_level[at - back];
            let (class, expected) = match (i, j) {
                (0, 0) => (0, 0),
                (_, 0) => (1, known(1)),
                (0, _) => (1, known(side)),
                _ => (2, known(1).wrapping_add(known(side)).wrapping_sub(known(side + 1))),
            };
            let left = sea_level[at].wrapping_sub(expected);
            let value = expected.wrapping_add(stream.number(&mut self.sea[class], left));
            // No geoid is so far from its ellipsoid: this only keeps damaged numbers in bounds.
            sea_level[at] = value.clamp(-QUANTA_END, QUANTA_END);
        }
    }

    fn marks(&mut self, stream: &mut Stream<'_>, marks: &mut [Mark]) {
        let mut before = Mark::default();
        for at in 0..marks.len() {
            let side = MARK_SIDE;
            let near = if at % side == 0 && at >= side { marks[at - side] } else { before };
            let mark = &mut marks[at];
            let mut byte = |which: usize, value: &mut u8, near: u8| {
                let left = i32::from(*value) - i32::from(near);
                let left = stream.number(&mut self.mark[which], left);
                let sum = i32::from(near).saturating_add(left).clamp(0, 255);
                *value = u8::try_from(sum).expect("clamped");
            };
            byte(0, &mut mark.error_odd, near.error_odd);
            byte(1, &mut mark.error_even, near.error_even);
            byte(2, &mut mark.variation, near.variation);
            byte(3, &mut mark.slope, near.slope);
            byte(4, &mut mark.roughness, near.roughness);
            byte(5, &mut mark.roughest, near.roughest);
            mark.edge = stream.bit(&mut self.edge[usize::from(near.edge)], mark.edge);
            for (which, near) in near.range.into_iter().enumerate().filter(|_| mark.edge) {
                let left = i32::from(mark.range[which]) - i32::from(near);
                let left = stream.number(&mut self.range[which], left);
                let sum = i32::from(near).saturating_add(left);
                let [least, most] = [i16::MIN, i16::MAX].map(i32::from);
                mark.range[which] = i16::try_from(sum.clamp(least, most)).expect("clamped");
            }
            before = *mark;
        }
    }
}

/// The numbers to the left of and below `at`, or what stands in for them at the border.
fn neighbours<T: Copy>(plane: &[T], at: usize, outside: T) -> (T, T) {
    let below = if at >= PAGE_SIDE { plane[at - PAGE_SIDE] } else { outside };
    let left = if at.is_multiple_of(PAGE_SIDE) { below } else { plane[at - 1] };
    (left, if at >= PAGE_SIDE { below } else { left })
}

/// Places that a halving of the step adds: the centres of cells, or the middles of their sides.
fn new_places(step: usize, sides: bool) -> impl Iterator<Item = (usize, usize)> {
    let rows = (0..PAGE_SIDE).step_by(step);
    rows.flat_map(move |j| {
        let odd = (j / step) % 2 == 1;
        let first = match (sides, odd) {
            (false, true) | (true, false) => Some(step),
            (true, true) => Some(0),
            (false, false) => None,
        };
        let columns = first.into_iter().flat_map(move |first| (first..PAGE_SIDE).step_by(2 * step));
        columns.map(move |i| (i, j))
    })
}

/// What a sample is expected to be, and how much the two ways of expecting it differ.
struct Guess {
    expected: i32,
    spread: u32,
}

/// The heights of a layer, as far as they are known, and what was left over on the way.
struct Heights<'a> {
    quanta: &'a mut [i32; SAMPLES],
    weights: Option<&'a [u8; SAMPLES]>,
    /// One more than what was left over, capped; 0 where nothing was coded.
    sizes: [u8; SAMPLES],
    /// The height coded last.
    before: i32,
}

impl<'a> Heights<'a> {
    fn of(layer: &'a mut LayerTile) -> Self {
        let LayerTile { quanta, weights, .. } = layer;
        Self { quanta, weights: weights.as_deref(), sizes: [0; SAMPLES], before: 0 }
    }

    fn is_seen(&self, at: usize) -> bool {
        self.weights.is_none_or(|weights| weights[at] > 0)
    }

    /// Takes every second sample from the parent.
    fn take(&mut self, known: Known<'_>) {
        for (at, place) in (0..SAMPLES).filter_map(|at| Some((at, known.place(at)?))) {
            self.quanta[at] = if self.is_seen(at) { known.layer.quanta[place] } else { 0 };
        }
    }

    /// From the known samples one and three steps away, along the axes or the diagonals; `None` where
    /// none of them is seen.
    fn guess(&self, (i, j): (usize, usize), (step, sides): (usize, bool)) -> Option<Guess> {
        let ways: [(isize, isize); 2] = if sides { [(1, 0), (0, 1)] } else { [(1, 1), (1, -1)] };
        let step = step.cast_signed();
        let at = |(di, dj): (isize, isize), steps: isize| -> Option<i64> {
            let i = i.checked_add_signed(di * steps * step).filter(|&i| i < PAGE_SIDE)?;
            let j = j.checked_add_signed(dj * steps * step).filter(|&j| j < PAGE_SIDE)?;
            let at = j * PAGE_SIDE + i;
            self.is_seen(at).then(|| i64::from(self.quanta[at]))
        };
        let [one, other] = ways.map(|way| {
            let (before, after) = (at(way, -1)?, at(way, 1)?);
            let middle = match (at(way, -3), at(way, 3)) {
                (Some(first), Some(last)) => (9 * (before + after) - first - last + 8) >> 4,
                _ => (before + after) >> 1,
            };
            Some((middle, before.abs_diff(after)))
        });
        let cut = |value: i64| {
            let most = i64::from(i32::MAX / 2);
            i32::try_from(value.clamp(-most, most)).expect("clamped")
        };
        let (expected, spread) = match (one, other) {
            (Some((a, rise)), Some((b, run))) => {
                (cut((a + b) >> 1), a.abs_diff(b) + rise / 4 + run / 4)
            }
            (Some((a, _)), None) | (None, Some((a, _))) => (cut(a), 4),
            (None, None) => {
                let near = ways.into_iter().flat_map(|way| [at(way, -1), at(way, 1)]);
                (cut(near.flatten().next()?), 4)
            }
        };
        Some(Guess { expected, spread: u32::try_from(spread.min(1 << 20)).expect("capped") })
    }
}

/// The class of a sample by the sizes of what was left over around it.
fn roughness(sizes: &[u8; SAMPLES], (i, j): (usize, usize), step: usize, spread: u32) -> usize {
    const AROUND: [(isize, isize); 10] =
        [(-2, 0), (0, -2), (-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (0, -1), (1, 0), (0, 1)];
    let step = step.cast_signed();
    let (mut sum, mut count) = (0_u32, 0_u32);
    for (di, dj) in AROUND {
        let i = i.checked_add_signed(di * step).filter(|&i| i < PAGE_SIDE);
        let j = j.checked_add_signed(dj * step).filter(|&j| j < PAGE_SIDE);
        let (Some(i), Some(j)) = (i, j) else { continue };
        let size = u32::from(sizes[j * PAGE_SIDE + i]);
        sum += size.saturating_sub(1);
        count += u32::from(size > 0);
    }
    let nearby = (sum * 8).checked_div(count).unwrap_or(2 * spread);
    let active = nearby + spread;
    (32 - (active + 1).leading_zeros() as usize - 1).min(ROUGH - 1)
}

#[cfg(test)]
mod tests;

//! Columns over a block of points, and noise evaluated column by column.
//!
//! In:    up to [`BLOCK`] points, the lanes of them that matter, lattices.
//! Out:   columns of noise, the same bits as `noise` gives point by point.
//! Keeps: nothing.
//! Not here: one octave's arithmetic (`noise`), which octaves a planet has (`earthlike`).
//!
//! Every loop here runs over lanes, which do not know of each other, and calls what one point calls
//! too. So the compiler makes vectors of them, as wide as the machine has. Everything is inlined
//! into the one function that is compiled for several machines.
#![expect(
    clippy::needless_range_loop,
    reason = "iterators count with checks, and loops with checks are not made into vectors"
)]

use glam::DVec3;

use super::noise::Lattices;

/// Points evaluated together.
pub(super) const BLOCK: usize = 64;
/// The widest vector; loops run over whole ones.
const WIDTH: usize = 8;

/// One number for each point of a block.
pub(super) type Column = [f64; BLOCK];

pub(super) const ZEROS: Column = [0.0; BLOCK];

/// One vector for each point of a block.
#[derive(Clone, Copy)]
pub(super) struct Vectors {
    pub x: Column,
    pub y: Column,
    pub z: Column,
}

impl Vectors {
    pub(super) const ZERO: Vectors = Vectors { x: ZEROS, y: ZEROS, z: ZEROS };

    #[inline(always)]
    pub(super) fn at(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, to: DVec3) {
        (self.x[i], self.y[i], self.z[i]) = (to.x, to.y, to.z);
    }
}

/// The lanes of some points of a block, moved together: what most points do not need is evaluated
/// for those that do.
pub(super) struct Chosen {
    lanes: [u8; BLOCK],
    count: usize,
    /// Of so many.
    of: usize,
}

impl Chosen {
    /// Those of the first `count` lanes that are wanted.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "lanes are fewer than 256")]
    pub(super) fn of(count: usize, wanted: &[bool; BLOCK]) -> Chosen {
        let mut chosen = Chosen { lanes: [0; BLOCK], count: 0, of: count.min(BLOCK) };
        for i in 0..chosen.of {
            chosen.lanes[chosen.count.min(BLOCK - 1)] = i as u8;
            chosen.count += usize::from(wanted[i]);
        }
        chosen
    }

    #[inline(always)]
    pub(super) fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub(super) fn lanes(&self) -> core::ops::Range<usize> {
        lanes(self.count)
    }

    /// The chosen lanes of a column, moved together.
    #[inline(always)]
    pub(super) fn pick(&self, from: &Column) -> Column {
        if self.count == self.of {
            return *from;
        }
        let mut picked = ZEROS;
        for i in 0..self.count.min(BLOCK) {
            picked[i] = from[usize::from(self.lanes[i]) % BLOCK];
        }
        picked
    }

    #[inline(always)]
    pub(super) fn pick_vectors(&self, from: &Vectors) -> Vectors {
        Vectors { x: self.pick(&from.x), y: self.pick(&from.y), z: self.pick(&from.z) }
    }

    /// Puts lanes back where they were chosen.
    #[inline(always)]
    pub(super) fn put(&self, from: &Column, to: &mut Column) {
        if self.count == self.of {
            *to = *from;
            return;
        }
        for i in 0..self.count.min(BLOCK) {
            to[usize::from(self.lanes[i]) % BLOCK] = from[i];
        }
    }

    #[inline(always)]
    pub(super) fn put_vectors(&self, from: &Vectors, to: &mut Vectors) {
        self.put(&from.x, &mut to.x);
        self.put(&from.y, &mut to.y);
        self.put(&from.z, &mut to.z);
    }
}

/// The lanes of so many points, and what fills up the last vector.
#[inline(always)]
pub(super) fn lanes(count: usize) -> core::ops::Range<usize> {
    0..(count.min(BLOCK).wrapping_add(WIDTH - 1) & !(WIDTH - 1)).min(BLOCK)
}

/// [`super::noise::Cell::value`] of the `k`-th lattice.
#[inline(always)]
pub(super) fn values<const N: usize>(
    (lattices, k): (&Lattices<N>, usize),
    at_m: &Vectors,
    count: usize,
) -> Column {
    let mut values = ZEROS;
    for i in lanes(count) {
        let cell = lattices.cell(k, at_m.at(i));
        values[i] = cell.value_in(&cell.simplex());
    }
    values
}

/// [`super::noise::Cell::narrow_value`] of the `k`-th lattice.
#[inline(always)]
pub(super) fn narrow_values<const N: usize>(
    (lattices, k): (&Lattices<N>, usize),
    at_m: &Vectors,
    count: usize,
) -> Column {
    let mut values = ZEROS;
    for i in lanes(count) {
        let cell = lattices.cell(k, at_m.at(i));
        values[i] = cell.narrow_value_in(&cell.simplex());
    }
    values
}

/// [`super::noise::Cell::fine_value`] of the `k`-th lattice.
#[inline(always)]
pub(super) fn fine_values<const N: usize>(
    (lattices, k): (&Lattices<N>, usize),
    at_m: &Vectors,
    count: usize,
) -> Column {
    let mut values = ZEROS;
    for i in lanes(count) {
        let cell = lattices.cell(k, at_m.at(i));
        values[i] = cell.fine_value_in(&cell.simplex());
    }
    values
}

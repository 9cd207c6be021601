//! A block of points of the cratered planet at once, for whichever vectors the machine has.
//!
//! In:    up to [`BLOCK`] normals.
//! Out:   their samples, the same bits as [`Cratered::sample`] gives.
//! Keeps: nothing.
//! Not here: what an octave and a crater add (`cratered`, `craters`), columns (`lanes`).
#![expect(
    clippy::needless_range_loop,
    reason = "iterators count with checks, and loops with checks are not made into vectors"
)]

use glam::DVec3;
use multiversion::multiversion;

use super::super::craters::{Ball, CORNERS, Craters, Dent, ball};
use super::super::lanes::{BLOCK, Column, Vectors, ZEROS, lanes};
use super::super::noise::Lattice;
use super::{Cratered, Pile, Plain, Sample};

/// What all octaves read.
struct Site {
    count: usize,
    n: Vectors,
    at_m: Vectors,
}

/// Columns of [`Plain`].
struct Plains {
    height_m: Column,
    pool: Column,
    mare: Column,
    ruggedness: Column,
}

/// Columns of [`Pile`].
struct Piles {
    height_m: Column,
    dents_m: Column,
    fresh: Column,
    shore: Column,
}

/// Columns of [`Dent`].
struct Dents {
    height_m: Column,
    fresh: Column,
}

/// What is known of the cells around the points of a block.
struct Balls {
    hashes: [[u64; BLOCK]; CORNERS],
    far2: [Column; CORNERS],
    cut2: [Column; CORNERS],
}

/// Craters that reach points of a block: the cell and the point of each, cell by cell.
struct Hits {
    places: [(u8, u8); CORNERS * BLOCK],
    count: usize,
}

/// Samples of up to [`BLOCK`] normals; targets as in `earthlike`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx512vbmi2+bmi2",
    "x86_64+avx2+bmi2"
))]
pub(super) fn fill(body: &Cratered, normals: &[DVec3], out: &mut [Sample]) {
    body.fill(normals, out);
}

impl Cratered {
    #[inline(always)]
    fn fill(&self, normals: &[DVec3], out: &mut [Sample]) {
        let count = normals.len().min(BLOCK);
        let mut site = Site { count, n: Vectors::ZERO, at_m: Vectors::ZERO };
        for i in 0..count {
            site.n.set(i, normals[i]);
        }
        for i in lanes(count) {
            site.at_m.set(i, site.n.at(i) * self.radius_m);
        }
        let plains = self.plains(&site);
        let mut piles =
            Piles { height_m: plains.height_m, dents_m: ZEROS, fresh: ZEROS, shore: ZEROS };
        for (k, octave) in self.octaves.iter().enumerate() {
            let values = noise(&octave.ground, &site);
            for i in lanes(count) {
                let mut pile = piles.at(i);
                pile.raise(octave, k, plains.ruggedness[i], values[i]);
                piles.set(i, pile);
            }
            let Some(craters) = &octave.craters else { continue };
            let dents = craters.dents(&site, &values);
            for i in lanes(count) {
                let dent = Dent { height_m: dents.height_m[i], fresh: dents.fresh[i] };
                let mut pile = piles.at(i);
                pile.dent(octave, self.relief, plains.mare[i], &craters.cut(dent));
                piles.set(i, pile);
            }
        }
        for (i, sample) in out.iter_mut().enumerate().take(count) {
            *sample = self.finished(site.n.at(i), &plains.at(i), &piles.at(i));
        }
    }

    #[inline(always)]
    fn plains(&self, site: &Site) -> Plains {
        let mut noises = [ZEROS; 4];
        for (values, lattice) in noises.iter_mut().zip(self.swell.iter().chain(&self.maria)) {
            *values = noise(lattice, site);
        }
        let mut plains = Plains { height_m: ZEROS, pool: ZEROS, mare: ZEROS, ruggedness: ZEROS };
        for i in lanes(site.count) {
            let swell = [noises[0][i], noises[1][i]];
            plains.set(i, self.plain(swell, [noises[2][i], noises[3][i]]));
        }
        plains
    }
}

impl Craters {
    /// All dents of the class, not yet cut.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "corners and lanes are fewer than 256")]
    fn dents(&self, site: &Site, wobbles: &Column) -> Dents {
        let mut balls =
            Balls { hashes: [[0; BLOCK]; CORNERS], far2: [ZEROS; CORNERS], cut2: [ZEROS; CORNERS] };
        let mut hits = Hits { places: [(0, 0); CORNERS * BLOCK], count: 0 };
        for corner in 0..CORNERS {
            let mut is_hit = [false; BLOCK];
            for i in lanes(site.count) {
                let nook = self.nook(site.at_m.at(i));
                let hash = self.hash(&nook, corner);
                let ball = ball(&nook, corner, hash, site.n.at(i));
                balls.hashes[corner][i] = hash;
                (balls.far2[corner][i], balls.cut2[corner][i]) = (ball.far2, ball.cut2);
                is_hit[i] = self.is_hit(hash) & ball.reaches();
            }
            for (i, _) in is_hit.iter().enumerate().take(site.count).filter(|(_, hit)| **hit) {
                hits.places[hits.count % (CORNERS * BLOCK)] = (corner as u8, i as u8);
                hits.count += 1;
            }
        }
        let mut dents = Dents { height_m: ZEROS, fresh: ZEROS };
        for places in hits.places[..hits.count.min(CORNERS * BLOCK)].chunks(BLOCK) {
            self.add(places, &balls, wobbles, &mut dents);
        }
        dents
    }

    /// Adds craters where they are, in their order.
    #[inline(always)]
    fn add(&self, places: &[(u8, u8)], balls: &Balls, wobbles: &Column, dents: &mut Dents) {
        let (mut hashes, mut wobble) = ([0; BLOCK], ZEROS);
        let (mut far2, mut cut2) = (ZEROS, ZEROS);
        let places = &places[..places.len().min(BLOCK)];
        for (k, &(corner, i)) in places.iter().enumerate() {
            let (corner, i) = (usize::from(corner) % CORNERS, usize::from(i) % BLOCK);
            hashes[k] = balls.hashes[corner][i];
            (far2[k], cut2[k]) = (balls.far2[corner][i], balls.cut2[corner][i]);
            wobble[k] = wobbles[i];
        }
        let mut added = Dents { height_m: ZEROS, fresh: ZEROS };
        for k in lanes(places.len()) {
            let ball = Ball { far2: far2[k], cut2: cut2[k] };
            let dent = self.crater(hashes[k], &ball, wobble[k]);
            (added.height_m[k], added.fresh[k]) = (dent.height_m, dent.fresh);
        }
        for (k, &(_, i)) in places.iter().enumerate() {
            dents.height_m[usize::from(i) % BLOCK] += added.height_m[k];
            dents.fresh[usize::from(i) % BLOCK] += added.fresh[k];
        }
    }
}

#[inline(always)]
fn noise(lattice: &Lattice, site: &Site) -> Column {
    let mut values = ZEROS;
    for i in lanes(site.count) {
        let cell = lattice.cell(site.at_m.at(i));
        values[i] = cell.value_in(&cell.simplex());
    }
    values
}

impl Plains {
    #[inline(always)]
    fn at(&self, i: usize) -> Plain {
        Plain {
            height_m: self.height_m[i],
            pool: self.pool[i],
            mare: self.mare[i],
            ruggedness: self.ruggedness[i],
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, plain: Plain) {
        self.height_m[i] = plain.height_m;
        self.pool[i] = plain.pool;
        self.mare[i] = plain.mare;
        self.ruggedness[i] = plain.ruggedness;
    }
}

impl Piles {
    #[inline(always)]
    fn at(&self, i: usize) -> Pile {
        Pile {
            height_m: self.height_m[i],
            dents_m: self.dents_m[i],
            fresh: self.fresh[i],
            shore: self.shore[i],
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, pile: Pile) {
        self.height_m[i] = pile.height_m;
        self.dents_m[i] = pile.dents_m;
        self.fresh[i] = pile.fresh;
        self.shore[i] = pile.shore;
    }
}

//! A block of points of the Earth-like planet at once, for whichever vectors the machine has.
//!
//! In:    up to [`BLOCK`] normals.
//! Out:   their samples, the same bits as [`Earthlike::sample`] gives.
//! Keeps: nothing.
//! Not here: what an octave adds (`earthlike`), columns (`lanes`).

use glam::DVec3;
use multiversion::multiversion;

use super::super::lanes::{
    BLOCK, Chosen, Column, Vectors, ZEROS, fine_values, lanes, narrow_values,
};
use super::super::outline::Shapes;
use super::{
    ABYSSAL, Details, Earthlike, Fine, Ground, Layers, Mood, Range, Sample, above_abyss, along,
    is_quiet, steering,
};
use crate::datasource::procedural::bounds::UNERODED;

/// What all stages read.
struct Site {
    count: usize,
    n: Vectors,
    at_m: Vectors,
    shapes: Shapes,
}

/// Columns of [`Range`].
struct Ranges {
    height_m: Column,
    slope: Vectors,
    crest: Column,
}

/// Columns of [`Fine`].
#[derive(Clone, Copy)]
struct Fines {
    height_m: Column,
    local: Column,
    swell: Column,
    last: Column,
}

/// Columns of [`Mood`].
struct Moods {
    lively: Column,
    rugged: Column,
    streams: Column,
}

/// Samples of up to [`BLOCK`] normals. AVX-512 is asked for as of Ice Lake, where it costs no
/// clock. No target contracts or reorders arithmetic, so all give the same bits.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx512vbmi2+bmi2",
    "x86_64+avx2+bmi2"
))]
pub(super) fn fill(body: &Earthlike, normals: &[DVec3], out: &mut [Sample]) {
    body.fill(normals, out);
}

impl Earthlike {
    #[inline(always)]
    fn fill(&self, normals: &[DVec3], out: &mut [Sample]) {
        let count = normals.len().min(BLOCK);
        let (mut n, mut at_m) = (Vectors::ZERO, Vectors::ZERO);
        for (i, &normal) in normals.iter().enumerate().take(count) {
            n.set(i, normal);
        }
        for i in lanes(count) {
            at_m.set(i, n.at(i) * self.radius_m);
        }
        let shapes = self.outline.shapes(&at_m, &n, count);
        let site = Site { count, n, at_m, shapes };
        let (mut heights_m, mut slopes) = (ZEROS, Vectors::ZERO);
        self.coasts(&site, &mut heights_m);
        self.mountains(&site, &mut heights_m, &mut slopes);
        for i in lanes(count) {
            heights_m[i] += self.base_m(&site.shapes.at(i));
            slopes.set(i, along(site.n.at(i), slopes.at(i)));
        }
        self.gullies(&site, &mut heights_m, &mut slopes);
        let mut fines = Fines { height_m: heights_m, local: ZEROS, swell: ZEROS, last: ZEROS };
        let mut steep = ZEROS;
        for i in lanes(count) {
            steep[i] = slopes.at(i).length_squared();
            let shape = site.shapes.at(i);
            fines.set(i, Fine::on(&Ground { height_m: heights_m[i], steep: steep[i], shape }));
        }
        self.details(&site, &mut fines);
        self.finish(&site, &steep, &fines, out);
    }

    /// Heights of the coasts where there are no mountains.
    #[inline(always)]
    fn coasts(&self, site: &Site, heights_m: &mut Column) {
        let (mut quiet, mut shelf) = ([false; BLOCK], [false; BLOCK]);
        for i in lanes(site.count) {
            let shape = site.shapes.at(i);
            quiet[i] = is_quiet(&shape);
            shelf[i] = quiet[i] && above_abyss(shape.base_m) > 0.0;
        }
        self.coast(0..ABYSSAL, &Chosen::of(site.count, &quiet), site, heights_m);
        let shelf = Chosen::of(site.count, &shelf);
        self.coast(ABYSSAL..self.ridges.len(), &shelf, site, heights_m);
    }

    #[inline(always)]
    fn coast(
        &self,
        octaves: core::ops::Range<usize>,
        chosen: &Chosen,
        site: &Site,
        heights_m: &mut Column,
    ) {
        if chosen.count() == 0 {
            return;
        }
        let at_m = chosen.pick_vectors(&site.at_m);
        let base_m = chosen.pick(&site.shapes.base_m);
        let mut coasts_m = chosen.pick(heights_m);
        for k in octaves {
            let values = narrow_values((&self.ridge_lattices, k), &at_m, chosen.count());
            let coast_m = self.ridges[k].coast_m;
            let share = |base_m: f64| if k < ABYSSAL { 1.0 } else { above_abyss(base_m) };
            for i in chosen.lanes() {
                coasts_m[i] += share(base_m[i]) * coast_m * values[i];
            }
        }
        chosen.put(&coasts_m, heights_m);
    }

    /// Heights and slopes of coasts and ridges where there are mountains.
    #[inline(always)]
    fn mountains(&self, site: &Site, heights_m: &mut Column, slopes: &mut Vectors) {
        let mut loud = [false; BLOCK];
        for i in lanes(site.count) {
            loud[i] = !is_quiet(&site.shapes.at(i));
        }
        let chosen = Chosen::of(site.count, &loud);
        if chosen.count() == 0 {
            return;
        }
        let at_m = chosen.pick_vectors(&site.at_m);
        let mountain = chosen.pick(&site.shapes.mountain);
        let ruggedness = chosen.pick(&site.shapes.ruggedness);
        let mut ranges =
            Ranges { height_m: ZEROS, slope: Vectors::ZERO, crest: [Range::FOOT.crest; BLOCK] };
        for octave in &self.ridges {
            for i in chosen.lanes() {
                let cell = octave.lattice.cell(at_m.at(i));
                let noise = cell.value_and_gradient_in(&cell.simplex());
                ranges.set(i, octave.ridge(&ranges.at(i), mountain[i], noise));
            }
        }
        for i in chosen.lanes() {
            ranges.slope.set(i, ranges.slope.at(i) * steering(ruggedness[i]));
        }
        chosen.put(&ranges.height_m, heights_m);
        chosen.put_vectors(&ranges.slope, slopes);
    }

    #[inline(always)]
    fn gullies(&self, site: &Site, heights_m: &mut Column, slopes: &mut Vectors) {
        let mut is_eroded = [false; BLOCK];
        for i in lanes(site.count) {
            is_eroded[i] = site.shapes.ruggedness[i] - UNERODED > 0.0;
        }
        let chosen = Chosen::of(site.count, &is_eroded);
        if chosen.count() == 0 {
            return;
        }
        let (n, at_m) = (chosen.pick_vectors(&site.n), chosen.pick_vectors(&site.at_m));
        let ruggedness = chosen.pick(&site.shapes.ruggedness);
        let (mut gullies_m, mut slope) = (ZEROS, chosen.pick_vectors(slopes));
        for octave in &self.gullies {
            for i in chosen.lanes() {
                let cell = octave.lattice.cell(at_m.at(i));
                let steering = self.steering(n.at(i), slope.at(i));
                let (value, change) =
                    octave.lattice.stripes_in(&cell, &cell.simplex(), steering.side);
                let eroded = ruggedness[i] - UNERODED;
                let amplitude_m = octave.amplitude_m * eroded * steering.strength;
                gullies_m[i] += amplitude_m * value;
                slope.set(i, slope.at(i) + change * amplitude_m);
            }
        }
        let mut raised_m = chosen.pick(heights_m);
        for i in chosen.lanes() {
            raised_m[i] += gullies_m[i];
        }
        chosen.put(&raised_m, heights_m);
        chosen.put_vectors(&slope, slopes);
    }

    /// Long details everywhere but in the abyss, short ones where it is not deep.
    #[inline(always)]
    fn details(&self, site: &Site, fines: &mut Fines) {
        let (long, short) = self.long_and_short();
        let mut wanted = [false; BLOCK];
        for i in lanes(site.count) {
            wanted[i] = above_abyss(site.shapes.base_m[i]) > 0.0;
        }
        let chosen = Chosen::of(site.count, &wanted);
        self.long_details(long, &chosen, site, fines);
        for i in lanes(site.count) {
            wanted[i] = wanted[i] && self.deep(fines.height_m[i]) < 1.0;
        }
        let chosen = Chosen::of(site.count, &wanted);
        self.short_details(short, &chosen, site, fines);
    }

    #[inline(always)]
    fn long_details(&self, long: &[Details], chosen: &Chosen, site: &Site, fines: &mut Fines) {
        if chosen.count() == 0 {
            return;
        }
        let at_m = chosen.pick_vectors(&site.at_m);
        let base_m = chosen.pick(&site.shapes.base_m);
        let ruggedness = chosen.pick(&site.shapes.ruggedness);
        let mut picked = fines.picked(chosen);
        for (four, k) in octaves_of(long) {
            let values = fine_values((&four.lattices, k), &at_m, chosen.count());
            for i in chosen.lanes() {
                let strength = (above_abyss(base_m[i]), ruggedness[i]);
                picked.set(i, four.octaves[k].roll(&picked.at(i), strength, values[i]));
            }
        }
        fines.put(chosen, &picked);
    }

    #[inline(always)]
    fn short_details(&self, short: &[Details], chosen: &Chosen, site: &Site, fines: &mut Fines) {
        if chosen.count() == 0 {
            return;
        }
        let at_m = chosen.pick_vectors(&site.at_m);
        let base_m = chosen.pick(&site.shapes.base_m);
        let ruggedness = chosen.pick(&site.shapes.ruggedness);
        let mut picked = fines.picked(chosen);
        let mut moods = Moods { lively: ZEROS, rugged: ZEROS, streams: ZEROS };
        for i in chosen.lanes() {
            moods.set(i, self.mood(&picked.at(i), above_abyss(base_m[i]), ruggedness[i]));
        }
        for (four, k) in octaves_of(short) {
            let values = fine_values((&four.lattices, k), &at_m, chosen.count());
            for i in chosen.lanes() {
                picked.set(i, four.octaves[k].roughen(&picked.at(i), &moods.at(i), values[i]));
            }
        }
        fines.put(chosen, &picked);
    }

    #[inline(always)]
    fn finish(&self, site: &Site, steep: &Column, fines: &Fines, out: &mut [Sample]) {
        let weather = narrow_values((&self.climate, 0), &site.at_m, site.count);
        let wide = narrow_values((&self.climate, 1), &site.at_m, site.count);
        let narrow = narrow_values((&self.climate, 2), &site.at_m, site.count);
        let mut layers = [Layers::default(); BLOCK];
        for i in lanes(site.count) {
            let shape = site.shapes.at(i);
            let ground = Ground { height_m: fines.height_m[i], steep: steep[i], shape };
            let climate = [weather[i], wide[i], narrow[i]];
            layers[i] = self.layers(site.n.at(i), &ground, fines.last[i], climate);
        }
        for (i, sample) in out.iter_mut().enumerate().take(site.count) {
            let (height_m, ruggedness) = (fines.height_m[i], site.shapes.ruggedness[i]);
            *sample = Sample { height_m, layers: layers[i], ruggedness };
        }
    }
}

/// Every octave: its four, and which of them.
#[inline(always)]
fn octaves_of(details: &[Details]) -> impl Iterator<Item = (&Details, usize)> {
    details.iter().flat_map(|four| (0..four.octaves.len()).map(move |k| (four, k)))
}

impl Ranges {
    #[inline(always)]
    fn at(&self, i: usize) -> Range {
        Range { height_m: self.height_m[i], slope: self.slope.at(i), crest: self.crest[i] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, range: Range) {
        self.height_m[i] = range.height_m;
        self.slope.set(i, range.slope);
        self.crest[i] = range.crest;
    }
}

impl Fines {
    #[inline(always)]
    fn at(&self, i: usize) -> Fine {
        Fine {
            height_m: self.height_m[i],
            local: self.local[i],
            swell: self.swell[i],
            last: self.last[i],
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, fine: Fine) {
        self.height_m[i] = fine.height_m;
        self.local[i] = fine.local;
        self.swell[i] = fine.swell;
        self.last[i] = fine.last;
    }

    #[inline(always)]
    fn picked(&self, chosen: &Chosen) -> Fines {
        Fines {
            height_m: chosen.pick(&self.height_m),
            local: chosen.pick(&self.local),
            swell: chosen.pick(&self.swell),
            last: chosen.pick(&self.last),
        }
    }

    #[inline(always)]
    fn put(&mut self, chosen: &Chosen, picked: &Fines) {
        chosen.put(&picked.height_m, &mut self.height_m);
        chosen.put(&picked.local, &mut self.local);
        chosen.put(&picked.swell, &mut self.swell);
        chosen.put(&picked.last, &mut self.last);
    }
}

impl Moods {
    #[inline(always)]
    fn at(&self, i: usize) -> Mood {
        Mood { lively: self.lively[i], rugged: self.rugged[i], streams: self.streams[i] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, mood: Mood) {
        self.lively[i] = mood.lively;
        self.rugged[i] = mood.rugged;
        self.streams[i] = mood.streams;
    }
}

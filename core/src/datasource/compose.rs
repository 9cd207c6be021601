//! The ground of a scene: the planet, and over it the layers of all archives, coarse to fine.
//!
//! In:    the procedural planet and its detail; tiles around one page.
//! Out:   heights, sea level, layers and bounds at lattice points.
//! Keeps: [`Bed`]: what a scene's ground is made of. [`Plots`]: the tiles of one page.
//! Not here: a tile's own numbers (`tile`), pages (`generate`).
//!
//! Let B be what lies beneath a layer with weight w and height A: the ground is (1 − w)B + wA.
//! Every term is a pure function of the lattice point, so the ground is one too, and it is
//! continuous where weights and heights are. Bounds follow the same order: where a layer has full
//! weight all around, its own marks hold; where it has none, those beneath; between, a triangle
//! with edges e strays by no more than either does by itself plus Δw(e)·max|A − B|, since
//! wC − Σμwᵢ Cᵢ = w(C − ΣμCᵢ) + Σμ(w − wᵢ)Cᵢ for C = A − B.

use super::facts::{ArchiveFacts, Datum, LayerFacts};
use super::key::{PAGE_BITS, PageKey};
use super::page::Origin;
use super::procedural::detail::Detail;
use super::procedural::{Layers, Planet, Sample, Style};
use super::tile::{FULL, LayerTile, Mark, RANGE_UNIT_M, Reading, Tile, metres_of, sea_level_grid};
use crate::geodesy::Ellipsoid;
use crate::lattice::{RADIUS, normal_of, signs, unfold};
use glam::IVec3;
use std::sync::Arc;

/// What a scene's ground is made of.
pub struct Bed {
    /// The planet beneath; `None`: the ellipsoid.
    pub planet: Option<Planet>,
    /// Detail below the last level of archives.
    pub detail: Option<Detail>,
    /// Facts of the archives, the topmost first, as the scene lists them.
    pub archives: Vec<ArchiveFacts>,
    /// The body's shape.
    pub body: Ellipsoid,
    /// The kind of climate.
    pub style: Style,
}

/// The ground at one lattice point.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// Height above sea level in metres.
    pub height_m: f64,
    /// Sea level above the ellipsoid in metres.
    pub sea_level_m: f64,
    /// Hidden layers; rock lacks what steepness adds where the ground is real.
    pub layers: Layers,
    /// Where the height comes from.
    pub origin: Origin,
    /// How rugged the procedural planet is here, if it was looked at.
    pub ruggedness: f64,
}

/// How far the ground around a point may be from what is drawn of it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Doubt {
    /// Least and greatest height within reach, above sea level.
    pub range_m: [f64; 2],
    /// Greatest difference between the ground at a diamond's centre and within its reach.
    pub variation_m: f64,
    /// Bounds for triangles of odd and even levels.
    pub error_m: [f64; 2],
}

/// What is asked of the ground around a point.
#[derive(Clone, Copy, Debug)]
pub struct Scope {
    /// How far diamonds and their descendants reach. Metres.
    pub reach_m: f64,
    /// The same in sample steps of the page.
    pub reach_steps: f64,
    /// Edges of triangles of odd and even levels. Metres.
    pub edges_m: [f64; 2],
}

/// What is in doubt: the ground around a lattice point of one page.
struct Question<'a> {
    bed: &'a Bed,
    key: PageKey,
    point: IVec3,
    scope: &'a Scope,
    /// Marks are read from tiles so many levels up.
    coarser: u8,
}

/// One layer of one archive, and its tiles around one page.
struct Plot<'a> {
    facts: &'a LayerFacts,
    archive: &'a ArchiveFacts,
    grid: u8,
    /// Distance of the samples of its last level in metres.
    step_m: f64,
    tiles: Vec<(PageKey, Option<&'a LayerTile>)>,
}

/// The tiles of one page, by layers from the bottom up.
pub struct Plots<'a> {
    bed: &'a Bed,
    plots: Vec<Plot<'a>>,
    readings: Vec<Reading>,
}

/// The layers that show at a point.
struct Top {
    /// Index of the lowest that was read.
    first: usize,
    /// It lets nothing through.
    covers: bool,
}

/// A tile that a page is made from.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Need {
    /// Index among the scene's archives.
    pub archive: usize,
    /// Which tile.
    pub key: PageKey,
}

/// What lies beneath where there is no planet, or where it does not show.
const NOTHING: Sample = Sample {
    height_m: 0.0,
    layers: Layers { roughness: 0, rock: 0, moisture: 0, temperature: 0 },
    ruggedness: 0.0,
};
/// Points whose readings are kept while the planet is sampled.
const AT_ONCE: usize = 512;
/// Slope and curvature of the geoid, many times over: metres a metre.
const GEOID_SLOPE: f64 = 6e-4;
const GEOID_RESIDUAL: f64 = 2e-4;
const GEOID_MOST_M: f64 = 220.0;
/// A step of a sample in metres is at most this times a body's greatest radius of curvature
/// over 2^grid: √6 at the middle of a face.
const STEP_MOST: f64 = 2.449_5;

impl Bed {
    /// Whether pages need no tiles.
    pub fn is_procedural(&self) -> bool {
        self.archives.is_empty()
    }

    /// Whether sea level is anywhere off the ellipsoid.
    pub fn has_geoid(&self) -> bool {
        self.archives.iter().any(|archive| archive.datum == Datum::Egm96)
    }

    /// The tiles that the cells `keys` are made from. Marks of deep patches are read from tiles
    /// `coarser` levels up.
    pub fn needs(&self, keys: &[PageKey], coarser: u8) -> Vec<Need> {
        let mut needs = Vec::new();
        for (archive, facts) in self.archives.iter().enumerate() {
            for (key, layer) in
                keys.iter().flat_map(|key| facts.layers.iter().map(move |l| (key, l)))
            {
                let depth = key.depth().min(layer.depth);
                needs.push(Need { archive, key: key.ancestor(depth) });
            }
            for layer in &facts.layers {
                let depth = mark_depth(keys[0], layer, coarser);
                needs.push(Need { archive, key: keys[0].ancestor(depth) });
            }
        }
        needs.sort_unstable();
        needs.dedup();
        needs
    }

    /// Least and greatest height of the drawn surface above the ellipsoid, anywhere.
    pub fn surface_range_m(&self, sea: bool) -> [f64; 2] {
        let drawn = |height_m: f64| if sea && height_m < 0.0 { 0.0 } else { height_m };
        let planet = self.planet.as_ref().map_or([0.0; 2], Planet::height_range_m);
        let mut range = planet.map(drawn);
        for archive in &self.archives {
            let geoid_m = if archive.datum == Datum::Egm96 { GEOID_MOST_M / 2.0 } else { 0.0 };
            let [low_m, high_m] = archive.height_range_m;
            let detail_m = self.detail_most_m(archive);
            let low_m = if sea { (low_m - detail_m).max(-geoid_m) } else { low_m - detail_m };
            // Blending may lift what lies beneath by the geoid, and lower it.
            range = [range[0].min(low_m) - geoid_m, range[1].max(high_m + detail_m) + geoid_m];
        }
        range
    }

    fn detail_most_m(&self, archive: &ArchiveFacts) -> f64 {
        let Some(detail) = &self.detail else { return 0.0 };
        let steps_m = archive.layers.iter().map(|layer| self.step_m(layer));
        steps_m.fold(0.0, |most_m, step_m| detail.most_m(step_m, 1.0).max(most_m))
    }

    fn step_m(&self, layer: &LayerFacts) -> f64 {
        STEP_MOST * self.body.curvature_radii_m()[1] / f64::from(1_u32 << (layer.depth + PAGE_BITS))
    }

    fn planet_at(&self, point: IVec3) -> Sample {
        self.planet.as_ref().map_or(NOTHING, |planet| planet.sample(normal_of(point)))
    }

    fn planet_at_all(&self, points: impl Iterator<Item = IVec3>) -> Vec<Sample> {
        let normals: Vec<_> = points.map(normal_of).collect();
        let mut samples = vec![NOTHING; normals.len()];
        if let Some(planet) = &self.planet {
            planet.samples(&normals, &mut samples);
        }
        samples
    }
}

/// Depth of the tile whose marks speak of a page's diamonds.
fn mark_depth(key: PageKey, layer: &LayerFacts, coarser: u8) -> u8 {
    key.depth().saturating_sub(coarser).min(layer.depth)
}

/// Whether a lattice point lies in a cell, its border included.
pub fn holds(key: PageKey, point: IVec3) -> bool {
    let (sx, sy) = signs(key.quadrant());
    if sx * point.x < 0 || sy * point.y < 0 {
        return false;
    }
    let (u, v) = unfold(key.quadrant(), point);
    let (u0, v0) = key.origin();
    let inside = |along: i32| (0..=key.side()).contains(&along);
    inside(u - u0) && inside(v - v0)
}

impl<'a> Plots<'a> {
    /// The tiles of a page, which came for `needs` in the same order.
    pub fn new(bed: &'a Bed, needs: &[Need], tiles: &'a [Option<Arc<Tile>>]) -> Self {
        let mut plots = Vec::new();
        for (index, archive) in bed.archives.iter().enumerate().rev() {
            let own = needs.iter().zip(tiles).filter(|(need, _)| need.archive == index);
            let own: Vec<_> = own.map(|(need, tile)| (need.key, tile.as_deref())).collect();
            let layers = 0..archive.layers.len();
            plots.extend(layers.map(|layer| Plot::new(bed, archive, layer, &own)));
        }
        let readings = vec![Reading::default(); plots.len()];
        Self { bed, plots, readings }
    }

    /// The ground at a lattice point of the page or next to it.
    pub fn ground(&mut self, point: IVec3) -> Ground {
        let top = self.read(point);
        let beneath = if top.covers { NOTHING } else { self.bed.planet_at(point) };
        self.raised(point, top.first, &beneath)
    }

    /// [`Plots::ground`] of each of many points, to the bit: the planet is sampled at all at once.
    pub fn grounds(&mut self, points: &[IVec3]) -> Vec<Ground> {
        let mut grounds = Vec::with_capacity(points.len());
        for points in points.chunks(AT_ONCE) {
            let (mut tops, mut readings) = (Vec::new(), Vec::new());
            for &point in points {
                tops.push(self.read(point));
                readings.extend_from_slice(&self.readings);
            }
            let bare = points.iter().zip(&tops).filter(|(_, top)| !top.covers);
            let beneath = self.bed.planet_at_all(bare.map(|(&point, _)| point));
            let mut beneath = beneath.iter();
            let own = self.plots.len();
            for (i, (&point, top)) in points.iter().zip(&tops).enumerate() {
                self.readings.copy_from_slice(&readings[own * i..][..own]);
                let sample = (!top.covers).then(|| beneath.next()).flatten();
                grounds.push(self.raised(point, top.first, sample.unwrap_or(&NOTHING)));
            }
        }
        grounds
    }

    /// Reads layers from the top down to one that covers all beneath.
    fn read(&mut self, point: IVec3) -> Top {
        let mut top = Top { first: self.plots.len(), covers: false };
        while top.first > 0 && !top.covers {
            top.first -= 1;
            self.readings[top.first] = self.plots[top.first].read(point);
            top.covers = self.readings[top.first].weight == 1.0;
        }
        top
    }

    /// The ground that layers make of what lies beneath the first that was read.
    fn raised(&self, point: IVec3, first: usize, beneath: &Sample) -> Ground {
        let mut ground = Ground {
            height_m: beneath.height_m,
            sea_level_m: 0.0,
            layers: beneath.layers,
            origin: Origin::Procedural,
            ruggedness: beneath.ruggedness,
        };
        let mut roughness = f64::from(beneath.layers.roughness) / 255.0;
        for index in first..self.plots.len() {
            let reading = self.readings[index];
            if reading.weight > 0.0 {
                let rough = self.plots[index].roughness(point);
                let detail_m = self.detail_m(index, point, rough);
                let beneath = 1.0 - reading.weight;
                ground.height_m =
                    ground.height_m * beneath + reading.weighted_m + reading.weight * detail_m;
                ground.sea_level_m =
                    ground.sea_level_m * beneath + reading.weight * reading.sea_level_m;
                roughness = roughness * beneath + rough * reading.weight;
            }
            if reading.weight >= 0.5 {
                ground.origin = origin_of(&reading);
            }
        }
        if ground.origin != Origin::Procedural {
            ground.layers = climate(self.bed.style, normal_of(point).z, ground.height_m, roughness);
        }
        ground
    }

    fn detail_m(&self, index: usize, point: IVec3, roughness: f64) -> f64 {
        let Some(detail) = &self.bed.detail else { return 0.0 };
        let plot = &self.plots[index];
        let is_between = self.readings[index].between != [0.0; 2];
        if !is_between || !plot.is_last_level(point) {
            return 0.0;
        }
        detail.height_m(normal_of(point), plot.step_m, roughness, self.readings[index].between)
    }

    /// Bounds around a lattice point of the page `key`, at which the ground is `ground`.
    pub fn doubt(&self, key: PageKey, point: IVec3, scope: &Scope, coarser: u8) -> Doubt {
        let question = Question { bed: self.bed, key, point, scope, coarser };
        let mut doubt = self.doubt_of_planet(point, scope);
        for plot in &self.plots {
            plot.add_doubt(&question, &mut doubt);
        }
        doubt
    }

    fn doubt_of_planet(&self, point: IVec3, scope: &Scope) -> Doubt {
        let Some(planet) = &self.bed.planet else {
            return Doubt { range_m: [0.0; 2], variation_m: 0.0, error_m: [0.0; 2] };
        };
        // Where real ground covers it all around, the planet does not matter.
        if self.plots.iter().any(|plot| plot.covers_around(point)) {
            return Doubt { range_m: [0.0; 2], variation_m: 0.0, error_m: [0.0; 2] };
        }
        let sample = planet.sample(normal_of(point));
        let slope = planet.ruggedness_slope_per_m();
        let ruggedness = (sample.ruggedness + slope * scope.reach_m).min(1.0);
        let variation_m = planet.variation_m(scope.reach_m, ruggedness);
        Doubt {
            range_m: [sample.height_m - variation_m, sample.height_m + variation_m],
            variation_m,
            error_m: scope.edges_m.map(|edge_m| planet.residual_m(edge_m, ruggedness)),
        }
    }
}

impl<'a> Plot<'a> {
    /// Layer `layer` of an archive, of whose tiles these are around the page.
    fn new(
        bed: &Bed,
        archive: &'a ArchiveFacts,
        layer: usize,
        tiles: &[(PageKey, Option<&'a Tile>)],
    ) -> Self {
        let facts = &archive.layers[layer];
        let is_own = |plane: &&LayerTile| usize::from(plane.layer) == layer;
        let of_layer = |tile: &'a Tile| tile.layers.iter().find(is_own);
        let reached = tiles.iter().filter(|(key, _)| key.depth() <= facts.depth);
        let mut tiles: Vec<_> =
            reached.map(|&(key, tile)| (key, tile.and_then(of_layer))).collect();
        // The finest tile that holds a point is asked first.
        tiles.sort_by_key(|(key, _)| core::cmp::Reverse(key.depth()));
        let (grid, step_m) = (sea_level_grid(facts.depth), bed.step_m(facts));
        Self { facts, archive, grid, step_m, tiles }
    }

    fn tile_at(&self, point: IVec3) -> Option<(PageKey, &'a LayerTile)> {
        let (key, tile) = self.tiles.iter().find(|(key, _)| holds(*key, point))?;
        Some((*key, (*tile)?))
    }

    fn read(&self, point: IVec3) -> Reading {
        let Some((key, tile)) = self.tile_at(point) else { return Reading::default() };
        tile.read(key, point, self.facts.quantum_m, self.grid)
    }

    fn roughness(&self, point: IVec3) -> f64 {
        self.tile_at(point).map_or(0.0, |(key, tile)| tile.roughness(key, point))
    }

    fn is_last_level(&self, point: IVec3) -> bool {
        self.tile_at(point).is_some_and(|(key, _)| key.depth() == self.facts.depth)
    }

    /// Whether this layer alone is seen everywhere within reach, by the finest marks there are.
    fn covers_around(&self, point: IVec3) -> bool {
        let holding = self.tiles.iter().filter(|(key, _)| holds(*key, point));
        let mut marks = holding.map(|(key, tile)| {
            tile.is_some_and(|tile| {
                let mark = tile.mark_around(*key, point);
                !mark.edge && tile.read(*key, point, 1.0, self.grid).weight == 1.0
            })
        });
        let first = marks.next().unwrap_or(false);
        first && marks.all(|covers| covers)
    }

    /// Turns the doubt about what lies beneath into that about the ground with this layer on it.
    fn add_doubt(&self, question: &Question<'_>, doubt: &mut Doubt) {
        let &Question { key, point, scope, coarser, .. } = question;
        if key.depth() < coarser {
            // No mark speaks of as much as this page's diamonds can reach.
            let [low_m, high_m] = self.archive.height_range_m;
            let geoid_m = if self.archive.datum == Datum::Egm96 { GEOID_MOST_M / 2.0 } else { 0.0 };
            let [least_m, most_m] = doubt.range_m;
            doubt.range_m = [least_m.min(low_m - geoid_m), most_m.max(high_m + geoid_m)];
            let most_m = doubt.range_m[1] - doubt.range_m[0];
            doubt.variation_m = most_m;
            doubt.error_m = doubt.error_m.map(|error_m| error_m + most_m);
            return;
        }
        let depth = mark_depth(key, self.facts, coarser);
        let tile = self.tiles.iter().find(|(key, _)| key.depth() == depth && holds(*key, point));
        let Some((mark_key, Some(tile))) = tile else { return };
        let mark = tile.mark_around(*mark_key, point);
        let reading = tile.read(*mark_key, point, self.facts.quantum_m, self.grid);
        let around_m = tile.range_around(*mark_key, point, self.facts.quantum_m);
        let own = self.own_doubt(question, *mark_key, (&mark, around_m), &reading);
        if !mark.edge && reading.weight == 1.0 {
            *doubt = own;
        } else if mark.edge && mark.range[0] <= mark.range[1] {
            let [low_m, high_m] = own.range_m;
            let difference_m = (high_m - doubt.range_m[0]).max(doubt.range_m[1] - low_m).max(0.0);
            for (level, edge_m) in scope.edges_m.into_iter().enumerate() {
                let change = 2.5 * edge_m / self.facts.blend_m + 2.0 / f64::from(FULL);
                let mixed_m = doubt.error_m[level].max(own.error_m[level]);
                doubt.error_m[level] = mixed_m + change.min(1.0) * difference_m;
            }
            doubt.range_m = [doubt.range_m[0].min(low_m), doubt.range_m[1].max(high_m)];
            doubt.variation_m = doubt.range_m[1] - doubt.range_m[0];
        }
    }

    /// What this layer alone leaves in doubt, where it has weight.
    fn own_doubt(
        &self,
        question: &Question<'_>,
        mark_key: PageKey,
        (mark, around_m): (&Mark, [f64; 2]),
        reading: &Reading,
    ) -> Doubt {
        let &Question { bed, key, scope, .. } = question;
        let roughness = f64::from(mark.roughest) / 15.0;
        let detail = bed.detail.as_ref();
        let is_beyond = key.depth() > self.facts.depth;
        let mut error_m = [mark.error_odd, mark.error_even].map(metres_of);
        let mut variation_m = around_m[1] - around_m[0];
        let most_m = detail.map_or(0.0, |detail| detail.most_m(self.step_m, roughness));
        if is_beyond {
            // A walk of L along a face is at most √2·L steps along its axes.
            let shrink = f64::from(1_u32 << (key.depth() - mark_key.depth()));
            let to_last = f64::from(1_u32 << (self.facts.depth - mark_key.depth()));
            let steps = scope.reach_steps / shrink * to_last;
            let walk_m = 1.415 * steps * metres_of(mark.slope);
            variation_m = variation_m.min(walk_m);
            error_m = scope.edges_m.map(|edge_m| {
                detail.map_or(0.0, |d| d.residual_m(edge_m, self.step_m, roughness))
                    + self.bend_m(bed, edge_m, mark)
            });
            variation_m +=
                detail.map_or(0.0, |d| d.variation_m(scope.reach_m, self.step_m, roughness));
        } else {
            let bends = scope.edges_m.map(|edge_m| self.bend_m(bed, edge_m, mark));
            error_m = [error_m[0] + bends[0] + most_m, error_m[1] + bends[1] + most_m];
            variation_m += most_m;
        }
        let range_m = if mark.edge {
            let [low, high] = mark.range.map(|unit| f64::from(unit) * RANGE_UNIT_M);
            [low - most_m, high + most_m]
        } else if is_beyond {
            [reading.weighted_m - variation_m, reading.weighted_m + variation_m]
        } else {
            [around_m[0] - most_m, around_m[1] + most_m]
        };
        Doubt { range_m, variation_m, error_m }
    }

    /// Lines straight on the lattice are not quite straight in space: along an edge e the two
    /// drift apart by e²/ρ at most, which shows as height where the ground is steep.
    fn bend_m(&self, bed: &Bed, edge_m: f64, mark: &Mark) -> f64 {
        let bend = (2.0 * edge_m / bed.body.curvature_radii_m()[0]).min(1.0);
        let rise_m = metres_of(mark.slope) * (1.0 + 2.0 * edge_m / self.step_m * STEP_MOST);
        bend * rise_m.min(2.0 * metres_of(mark.variation))
    }
}

/// Bounds on how far sea level strays from an edge and over a distance.
pub fn geoid_doubt_m(bed: &Bed, edge_m: f64, distance_m: f64) -> [f64; 2] {
    if bed.has_geoid() {
        [GEOID_RESIDUAL * edge_m, GEOID_SLOPE * distance_m].map(|m| m.min(GEOID_MOST_M))
    } else {
        [0.0; 2]
    }
}

/// Where the height of a layer comes from.
fn origin_of(reading: &Reading) -> Origin {
    if reading.filled { Origin::Filled } else { Origin::Measured }
}

/// A share as a byte: 255 is all of it.
#[expect(clippy::cast_possible_truncation, reason = "clamped to a byte")]
fn byte(share: f64) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Hidden layers of real ground. What steepness adds to rock is added with the normals.
fn climate(style: Style, sin_lat: f64, height_m: f64, roughness: f64) -> Layers {
    let north = sin_lat * sin_lat;
    let ramp = |low: f64, high: f64, x: f64| ((x - low) / (high - low)).clamp(0.0, 1.0);
    match style {
        Style::Earthlike => {
            let above_m = height_m.max(0.0);
            let polar = north * north * north * north;
            let celsius = 30.0 - 36.0 * north - 18.0 * polar - 0.0065 * above_m;
            let tropics = 1.0 - ramp(0.0, 0.12, north);
            let deserts = ramp(0.05, 0.18, north) * (1.0 - ramp(0.25, 0.45, north));
            let moist = 0.6 + 0.25 * tropics - 0.30 * deserts - 0.15 * ramp(100.0, 1200.0, above_m);
            Layers {
                roughness: byte(roughness),
                rock: byte(0.45 * ramp(1800.0, 4200.0, above_m) + 0.1 * roughness),
                moisture: byte(moist),
                temperature: byte((celsius + 40.0) / 80.0),
            }
        }
        Style::Cratered => Layers {
            roughness: byte(roughness),
            rock: byte(0.3 + 0.3 * roughness),
            moisture: 0,
            temperature: byte((60.0 - 70.0 * north) / 80.0),
        },
    }
}

/// The cell of some depth that holds a lattice point; of several, any.
pub fn cell_of(point: IVec3, depth: u8) -> PageKey {
    let quadrant = (0..4).find(|&quadrant| {
        let (sx, sy) = signs(quadrant);
        sx * point.x >= 0 && sy * point.y >= 0
    });
    let quadrant = quadrant.expect("the four quadrants cover the square");
    let (u, v) = unfold(quadrant, point);
    let last = (1_u32 << depth) - 1;
    let place = |along: i32| (along.unsigned_abs() >> (30 - depth)).min(last);
    debug_assert!(u <= RADIUS && v <= RADIUS);
    PageKey::new(quadrant, depth, place(u), place(v))
}

//! Makes the pages of a scene: on the host's threads, never in a frame.
//!
//! In:    a page key, the tiles it needs, its colour; the scene's ground, the body, the patch depth.
//! Out:   a [`Page`]. A pure function of these: any thread, any order, same bits.
//! Keeps: nothing but the immutable ground.
//! Not here: heights (`compose`, `procedural`), fetching tiles (the host's loader).

use super::colour::ColourTile;
use super::compose::{Bed, Ground, Need, Plots, Scope, cell_of, geoid_doubt_m, holds};
use super::facts::ArchiveFacts;
use super::key::{PAGE_SIDE, PageKey};
use super::page::{BOUND_SIDE, BOUND_STRIDE, Bound, Origin, Page, SAMPLES, Survey};
use super::probes::{Findings, Probes, Site, Spot, hidden, surprise};
use super::procedural::detail::Detail;
use super::procedural::{Planet, Style};
use super::tile::Tile;
use crate::digest::Chain;
use crate::geodesy::{Ellipsoid, narrow};
use crate::lattice::{cross_of, normal_of, unfold};
use crate::lod::reach::{DIAGONAL, EXTENT_EVEN, NORM_MIN, edges};
use crate::settings::SceneSettings;
use glam::{DVec3, IVec3};
use std::sync::Arc;

/// Everything that the pages of one scene are made from.
pub struct Generator {
    bed: Bed,
    body: Ellipsoid,
    patch_depth: u8,
    sea: bool,
}

/// What no probe shows, by [`Levels`], metres.
#[derive(Clone, Copy)]
struct Unseen {
    /// Of the ground.
    hidden_m: Levels,
    /// Of the ellipsoid under the triangles.
    sagitta_m: Levels,
    /// Whether edges are longer than [`WIDE_M`].
    is_wide: bool,
}

/// Odd and even levels of a page, and all that finer pages serve.
type Levels = [f64; 3];

/// Between probes of wider cells whole mountains stand by the sea: there a quarter of what any block
/// rises counts too. Metres.
const WIDE_M: f64 = 1e4;
/// Sine of the slope that is half rock, as far as steepness goes.
const STEEP: f64 = 0.4;

impl Generator {
    /// The generator of a scene without archives.
    pub fn new(settings: &SceneSettings) -> Self {
        Self::with_archives(settings, Vec::new())
    }

    /// The generator of a scene, with the facts of its archives in the scene's order.
    pub fn with_archives(settings: &SceneSettings, archives: Vec<ArchiveFacts>) -> Self {
        let source = settings.procedural_source();
        let style = if settings.sea { Style::Earthlike } else { Style::Cratered };
        Self {
            bed: Bed {
                planet: source.map(|source| Planet::new(&source)),
                detail: source
                    .filter(|_| !archives.is_empty())
                    .map(|source| Detail::new(&source, settings.detail())),
                archives,
                body: settings.body,
                style: source.map_or(style, |source| source.style),
            },
            body: settings.body,
            patch_depth: settings.lod.patch_depth,
            sea: settings.sea,
        }
    }

    /// The procedural planet, if the scene has one.
    pub fn planet(&self) -> Option<&Planet> {
        self.bed.planet.as_ref()
    }

    /// Facts of the archives, in the scene's order.
    pub fn archives(&self) -> &[ArchiveFacts] {
        &self.bed.archives
    }

    /// Least and greatest height of the drawn surface above the ellipsoid, anywhere, in metres.
    pub fn surface_range_m(&self) -> [f64; 2] {
        self.bed.surface_range_m(self.sea)
    }

    /// The tiles that a page is made from, its neighbours' included: normals at its border are
    /// those of the ground on both sides. Empty in scenes without archives.
    pub fn needs(&self, key: PageKey) -> Vec<Need> {
        if self.bed.is_procedural() {
            return Vec::new();
        }
        let mut keys = vec![key];
        let last = PAGE_SIDE - 1;
        let middle = last / 2;
        for (i, j) in
            [0, middle, last].into_iter().flat_map(|j| [0, middle, last].map(move |i| (i, j)))
        {
            let arms = cross_of(key.sample(i, j), key.step());
            let outside = arms.into_iter().filter(|&arm| place_within(key, arm).is_none());
            keys.extend(outside.map(|arm| cell_of(arm, key.depth())));
        }
        self.bed.needs(&keys, self.coarser())
    }

    /// Makes one page of a scene without archives.
    pub fn page(&self, key: PageKey) -> Arc<Page> {
        self.page_from(key, &[])
    }

    /// Makes one page; `tiles` are what [`Self::needs`] asked for, in its order.
    ///
    /// # Panics
    /// If there are fewer or more tiles.
    pub fn page_from(&self, key: PageKey, tiles: &[Option<Arc<Tile>>]) -> Arc<Page> {
        self.page_with(key, tiles, None)
    }

    /// Makes one page as [`Self::page_from`] does, with the imagery of its cell on it.
    ///
    /// # Panics
    /// If there are fewer or more tiles, or the colour is another cell's.
    pub fn page_with(
        &self,
        key: PageKey,
        tiles: &[Option<Arc<Tile>>],
        colour: Option<Arc<ColourTile>>,
    ) -> Arc<Page> {
        assert!(colour.as_ref().is_none_or(|colour| colour.key == key), "the cell's own colour");
        let needs = self.needs(key);
        assert_eq!(needs.len(), tiles.len(), "a tile, or none, for every need");
        let mut page = self.blank(key, colour);
        let mut plots = Plots::new(&self.bed, &needs, tiles);
        self.fill_samples(&mut page, &mut plots);
        self.fill_normals(&mut page, &mut plots);
        page.content = content_of(&page);
        Arc::from(page)
    }

    /// The same page with its samples alone, in a third of the time: heights, layers and survey to
    /// the last bit, no bounds (they are infinite: nothing is known between samples), no normals
    /// (all are those of the third axis). For who reads heights; never for a terrain.
    ///
    /// # Panics
    /// If there are fewer or more tiles than [`Self::needs`] asked for.
    pub fn bare_page_from(&self, key: PageKey, tiles: &[Option<Arc<Tile>>]) -> Arc<Page> {
        let needs = self.needs(key);
        assert_eq!(needs.len(), tiles.len(), "a tile, or none, for every need");
        let mut page = self.blank(key, None);
        page.bounds.fill(Bound::UNKNOWN);
        let mut plots = Plots::new(&self.bed, &needs, tiles);
        let points: Vec<_> = places().map(|(i, j)| key.sample(i, j)).collect();
        let grounds = plots.grounds(&points);
        grounds.iter().enumerate().for_each(|(at, ground)| put(&mut page, at, ground));
        page.content = content_of(&page);
        Arc::from(page)
    }

    fn blank(&self, key: PageKey, colour: Option<Arc<ColourTile>>) -> Box<Page> {
        let survey = Survey {
            sea_level_m: [0.0; SAMPLES],
            sea_level_variation_m: 0.0,
            origin: [Origin::Procedural; SAMPLES],
        };
        Box::new(Page {
            key,
            heights_m: [0.0; SAMPLES],
            normals: [[0; 2]; SAMPLES],
            layers: [[0; 4]; SAMPLES],
            bounds: [Bound::default(); BOUND_SIDE * BOUND_SIDE],
            survey: (!self.bed.is_procedural()).then(|| Box::new(survey)),
            colour,
            content: 0,
        })
    }

    /// Height of the ground itself above the ellipsoid at a lattice point of the page `key`, below
    /// water too, detail and all; `tiles` are what [`Self::needs`] asked for.
    pub fn ground_m(&self, key: PageKey, point: IVec3, tiles: &[Option<Arc<Tile>>]) -> f64 {
        let needs = self.needs(key);
        assert_eq!(needs.len(), tiles.len(), "a tile, or none, for every need");
        let ground = Plots::new(&self.bed, &needs, tiles).ground(point);
        ground.height_m + ground.sea_level_m
    }

    /// Marks hold for patches of depth 4; deeper ones reach farther, as from coarser tiles.
    fn coarser(&self) -> u8 {
        self.patch_depth.saturating_sub(4) / 2
    }

    fn fill_samples(&self, page: &mut Page, plots: &mut Plots<'_>) {
        let points: Vec<_> = places().map(|(i, j)| page.key.sample(i, j)).collect();
        let grounds = plots.grounds(&points);
        for (((i, j), point), ground) in places().zip(points).zip(&grounds) {
            put(page, j * PAGE_SIDE + i, ground);
            if i % BOUND_STRIDE == 0 && j % BOUND_STRIDE == 0 {
                let place = j / BOUND_STRIDE * BOUND_SIDE + i / BOUND_STRIDE;
                page.bounds[place] = self.bound(page, point, ground, plots);
            }
        }
        if self.bed.is_procedural() {
            self.tighten(page, &grounds, plots);
        }
    }

    /// Lowers the bounds of a page of the planet to what the ground around its samples shows.
    fn tighten(&self, page: &mut Page, own: &[Ground], plots: &mut Plots<'_>) {
        let site = Site {
            key: page.key,
            patch_depth: self.patch_depth,
            style: self.bed.style,
            sea: self.sea,
        };
        let spot =
            |ground: &Ground| Spot { height_m: ground.height_m, ruggedness: ground.ruggedness };
        let own: Vec<_> = own.iter().map(spot).collect();
        let look = |points: &[IVec3]| plots.grounds(points).iter().map(spot).collect();
        let Some(probes) = Probes::new(site, &own, look) else { return };
        for (j, i) in (0..BOUND_SIDE).flat_map(|j| (0..BOUND_SIDE).map(move |i| (j, i))) {
            let at = BOUND_STRIDE * j * PAGE_SIDE + BOUND_STRIDE * i;
            let bound = &mut page.bounds[j * BOUND_SIDE + i];
            let found = probes.around(i, j);
            let point = page.key.sample(BOUND_STRIDE * i, BOUND_STRIDE * j);
            let Scope { edges_m, .. } = self.scope(page.key, point);
            let unseen = Unseen {
                hidden_m: self.hidden_m(page.key, edges_m, found.ruggedness),
                sagitta_m: self.sagittas_m(edges_m),
                is_wide: edges_m[0] > WIDE_M,
            };
            let height_m = f64::from(page.heights_m[at]);
            let seen = self.seen_bound(&found, height_m, unseen);
            let min = |a: f32, b: f32| if b < a { b } else { a };
            *bound = Bound {
                error_odd_m: min(bound.error_odd_m, seen.error_odd_m),
                error_even_m: min(bound.error_even_m, seen.error_even_m),
                error_finer_m: min(bound.error_finer_m, seen.error_finer_m),
                variation_m: min(bound.variation_m, seen.variation_m),
            };
        }
    }

    /// The bound that follows from what was seen within reach, and from what was not.
    fn seen_bound(&self, found: &Findings, height_m: f64, unseen: Unseen) -> Bound {
        let Unseen { hidden_m, sagitta_m, .. } = unseen;
        let [low_m, high_m] = found.range_m;
        let surprise = |seen_m: f64| surprise(self.bed.style) * seen_m;
        let residual_m = self.levels(found.residual_m.map(surprise));
        // Between probes the ground may rise by another block's relief.
        let doubt_m = found.relief_m + residual_m[0];
        let (low_m, high_m) = (low_m - doubt_m, high_m + doubt_m);
        let (below_m, above_m) = (height_m - low_m, high_m - height_m);
        let rise_m =
            if unseen.is_wide && self.sea && low_m < 0.0 { 0.25 * found.relief_m } else { 0.0 };
        let shore_m = found.shore_m.map(|cut_m| if cut_m > rise_m { cut_m } else { rise_m });
        let shore_m = self.levels(shore_m);
        // Deep water hides what hides in it.
        let is_drowned = self.sea && high_m + hidden_m[0] < 0.0;
        let [error_odd_m, error_even_m, error_finer_m] = [0, 1, 2].map(|level| {
            let error_m = residual_m[level] + hidden_m[level] + shore_m[level];
            narrow((if is_drowned { 0.0 } else { error_m } + sagitta_m[level]) * ROUNDING)
        });
        Bound {
            error_odd_m,
            error_even_m,
            error_finer_m,
            variation_m: narrow(
                (if below_m > above_m { below_m } else { above_m }) * ROUNDING + 1e-3,
            ),
        }
    }

    /// What is known of the finer ones of a page's levels holds for all that are finer still.
    fn levels(&self, [odd, even]: [f64; 2]) -> Levels {
        // A page serves an odd level and then an even one; with single triangles the even one first.
        [odd, even, if self.patch_depth == 0 { odd } else { even }]
    }

    /// How far chords of the ellipsoid sag, at most: those of the next finer page are half as long.
    fn sagittas_m(&self, edges_m: [f64; 2]) -> Levels {
        let [curvature_min, _] = self.body.curvature_radii_m();
        let [odd_m, even_m] = edges_m.map(|edge_m| edge_m * edge_m / (8.0 * curvature_min));
        [odd_m, even_m, if odd_m > even_m { odd_m } else { even_m } / 4.0]
    }

    /// What no probe shows where the ground is no more rugged than this wherever it was looked at.
    fn hidden_m(&self, key: PageKey, edges_m: [f64; 2], seen: f64) -> Levels {
        let planet = self.bed.planet.as_ref().expect("who probes has a planet");
        // From any place to the nearest that was looked at.
        let [_, curvature_max] = self.body.curvature_radii_m();
        let away_m = DIAGONAL / 4.0 * f64::from(key.step()) / NORM_MIN * curvature_max;
        let ruggedness = (seen + planet.ruggedness_slope_per_m() * away_m).min(1.0);
        let share = hidden(ruggedness);
        self.levels(edges_m.map(|edge_m| share * planet.residual_m(edge_m, ruggedness)))
    }

    /// What a diamond near a sample and its descendants can reach, and the longest edges there.
    fn scope(&self, key: PageKey, point: IVec3) -> Scope {
        let step = f64::from(key.step());
        let leaf_side = step * f64::from(1_u32 << (self.patch_depth / 2));
        let reach = EXTENT_EVEN * leaf_side + DIAGONAL * step * 4.0;
        let norm = (point.as_dvec3().length() - reach).max(NORM_MIN);
        let [_, curvature_max] = self.body.curvature_radii_m();
        let metres = |lattice: f64| lattice / norm * curvature_max;
        Scope {
            reach_m: metres(reach),
            reach_steps: reach / step,
            edges_m: edges(self.patch_depth).map(|edge| metres(edge * step)),
        }
    }

    /// The bounds around a sample, over all that a diamond near it and its descendants can reach.
    fn bound(&self, page: &mut Page, point: IVec3, ground: &Ground, plots: &Plots<'_>) -> Bound {
        let key = page.key;
        let scope = self.scope(key, point);
        let edges_m = scope.edges_m;
        let sagitta_m = self.sagittas_m(edges_m);
        if self.bed.is_procedural() {
            return self.bound_of_planet(&scope, sagitta_m, ground);
        }
        let doubt = plots.doubt(key, point, &scope, self.coarser());
        let [low_m, high_m] = doubt.range_m;
        let variation_m = doubt.variation_m;
        let corner_m = |shore: bool| if shore { (high_m - low_m) / 4.0 } else { 0.0 };
        let error = |level: usize| {
            let [geoid_m, _] = geoid_doubt_m(&self.bed, edges_m[level], 0.0);
            let error_m = |shore: bool| doubt.error_m[level] + corner_m(shore);
            self.drawn(ground.height_m, variation_m, error_m) + geoid_m
        };
        let error_m = self.levels([error(0), error(1)]);
        let [_, sea_level_m] = geoid_doubt_m(&self.bed, 0.0, scope.reach_m);
        if let Some(survey) = &mut page.survey {
            let widest_m = survey.sea_level_variation_m.max(narrow(sea_level_m));
            survey.sea_level_variation_m = widest_m;
        }
        bound_of(error_m, sagitta_m, variation_m * ROUNDING + 1e-3)
    }

    fn bound_of_planet(&self, scope: &Scope, sagitta_m: Levels, ground: &Ground) -> Bound {
        let planet = self.bed.planet.as_ref().expect("a scene without archives has a planet");
        let slope = planet.ruggedness_slope_per_m();
        let ruggedness = (ground.ruggedness + slope * scope.reach_m).min(1.0);
        let variation_m = planet.variation_m(scope.reach_m, ruggedness);
        let error = |level: usize| {
            let edge_m = scope.edges_m[level];
            let rise_m = || planet.variation_m(edge_m, ruggedness);
            let corner_m = |shore: bool| if shore { rise_m() / 4.0 } else { 0.0 };
            let error_m = |shore: bool| planet.residual_m(edge_m, ruggedness) + corner_m(shore);
            self.drawn(ground.height_m, variation_m, error_m)
        };
        let error_m = self.levels([error(0), error(1)]);
        bound_of(error_m, sagitta_m, variation_m)
    }

    /// The error of what is drawn: none under water, that of a shore where ground and sea level
    /// meet within reach, else that of the ground. Where water meets land, an edge that rises by d
    /// cuts the corner by d/4 at most.
    fn drawn(&self, height_m: f64, variation_m: f64, error_m: impl Fn(bool) -> f64) -> f64 {
        let drowned = self.sea && height_m + variation_m < 0.0;
        let shore = self.sea && !drowned && height_m - variation_m < 0.0;
        if drowned { 0.0 } else { error_m(shore) }
    }

    /// Normals by central differences over the lattice cross, whichever page its arms lie in; and
    /// the rock that shows where real ground is steep.
    fn fill_normals(&self, page: &mut Page, plots: &mut Plots<'_>) {
        let arms_of = |(i, j)| cross_of(page.key.sample(i, j), page.key.step());
        let is_border = |at: usize| at.is_multiple_of(PAGE_SIDE - 1);
        let border = places().filter(|&(i, j)| is_border(i) || is_border(j));
        let outside = border.flat_map(arms_of).filter(|&arm| place_within(page.key, arm).is_none());
        let outside: Vec<_> = outside.collect();
        // In the order in which they are come across.
        let mut beyond = plots.grounds(&outside).into_iter();
        for (i, j) in places() {
            let point = page.key.sample(i, j);
            let arms = cross_of(point, page.key.step());
            let [a, b, c, d] = arms.map(|arm| self.position(page, &mut beyond, arm));
            let normal = (a - c).cross(b - d).normalize();
            let up = normal_of(point);
            let inward = normal.dot(up) < 0.0;
            let normal = if inward { -normal } else { normal };
            let at = j * PAGE_SIDE + i;
            page.normals[at] = encode(normal);
            if page.survey.as_ref().is_some_and(|s| s.origin[at] != Origin::Procedural) {
                page.layers[at][1] = bared(page.layers[at][1], normal.dot(up));
            }
        }
    }

    /// Where a point of the page lies, or the next of the points beyond it.
    fn position(
        &self,
        page: &Page,
        beyond: &mut impl Iterator<Item = Ground>,
        point: IVec3,
    ) -> DVec3 {
        let normal = normal_of(point);
        let height_m = match place_within(page.key, point) {
            Some(at) => f64::from(page.heights_m[at]) + page.sea_level_m(at),
            None => {
                let ground = beyond.next().expect("all arms that leave the page were looked at");
                f64::from(narrow(ground.height_m)) + f64::from(narrow(ground.sea_level_m))
            }
        };
        self.body.surface_from_normal(normal) + normal * height_m
    }
}

/// Rounding of bounds through f32, many times over.
const ROUNDING: f64 = 1.0 + 1e-6;

fn bound_of(error_m: Levels, sagitta_m: Levels, variation_m: f64) -> Bound {
    let [error_odd_m, error_even_m, error_finer_m] =
        [0, 1, 2].map(|level| narrow(error_m[level] + sagitta_m[level]));
    Bound { error_odd_m, error_even_m, error_finer_m, variation_m: narrow(variation_m) }
}

/// Writes one sample.
fn put(page: &mut Page, at: usize, ground: &Ground) {
    page.heights_m[at] = narrow(ground.height_m);
    let layers = ground.layers;
    page.layers[at] = [layers.roughness, layers.rock, layers.moisture, layers.temperature];
    if let Some(survey) = &mut page.survey {
        survey.sea_level_m[at] = narrow(ground.sea_level_m);
        survey.origin[at] = ground.origin;
    }
}

/// Column and row of every sample, row by row.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..PAGE_SIDE).flat_map(|j| (0..PAGE_SIDE).map(move |i| (i, j)))
}

/// Index of the sample at a lattice point, if it is one of the page `key`.
fn place_within(key: PageKey, point: IVec3) -> Option<usize> {
    holds(key, point).then(|| {
        let (u, v) = unfold(key.quadrant(), point);
        let (u0, v0) = key.origin();
        let place = |along: i32| usize::try_from(along / key.step()).expect("inside the page");
        place(v - v0) * PAGE_SIDE + place(u - u0)
    })
}

/// Rock, with what steepness bares of it; `flat` is the cosine of the slope.
#[expect(clippy::cast_possible_truncation, reason = "at most 255")]
fn bared(rock: u8, flat: f64) -> u8 {
    let steep = (1.0 - flat * flat).max(0.0);
    let share = steep / (steep + STEEP * STEEP);
    let rock = f64::from(rock) + 0.9 * 255.0 * share;
    rock.min(255.0).round() as u8
}

/// A unit vector in octahedral encoding, ±32767 is ±1. Error: 4e-5 rad.
#[expect(clippy::cast_possible_truncation, reason = "rounded to within ±32767")]
pub fn encode(unit: DVec3) -> [i16; 2] {
    let p = unit / (unit.x.abs() + unit.y.abs() + unit.z.abs());
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if p.z >= 0.0 {
        (p.x, p.y)
    } else {
        ((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    [(x * 32767.0).round() as i16, (y * 32767.0).round() as i16]
}

fn content_of(page: &Page) -> u64 {
    let mut chain = Chain::default();
    for at in 0..SAMPLES {
        let [a, b] = page.normals[at].map(|c| u64::from(c.cast_unsigned()));
        let layers = u64::from(u32::from_le_bytes(page.layers[at]));
        chain.add(u64::from(page.heights_m[at].to_bits()) << 32 | a << 16 | b);
        chain.add(layers);
    }
    if let Some(survey) = &page.survey {
        chain.add(u64::from(survey.sea_level_variation_m.to_bits()));
        let samples = survey.sea_level_m.iter().zip(&survey.origin);
        samples.for_each(|(m, &origin)| chain.add(u64::from(m.to_bits()) << 8 | origin as u64));
    }
    for bound in &page.bounds {
        let errors_m = [bound.error_odd_m, bound.error_even_m, bound.error_finer_m];
        let bits = errors_m.into_iter().chain([bound.variation_m]).map(f32::to_bits);
        bits.for_each(|b| chain.add(u64::from(b)));
    }
    if let Some(colour) = &page.colour {
        chain.add(colour.content);
    }
    chain.0
}

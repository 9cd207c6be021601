//! One frame, stage by stage, as nodes of the job graph: the table of contents of this crate.
//!
//! In:    [`FrameInput`] by [`Terrain::begin`].
//! Out:   [`FrameOutput`] by [`Terrain::finish`].
//! Keeps: [`Terrain`]: one cell a stage's state; the graph's order means that no lock ever waits.
//! Not here: the stages' own work (`datasource`, `lod`, `mesh`), threads and clock (`jobs`).

pub mod data;

pub use data::{FrameCounts, FrameInput, FrameOutput, RangeDraws, ViewDraws};

use crate::camera::{Camera, ViewFault};
use crate::columns::Id;
use crate::datasource::generate::Generator;
use crate::datasource::pages::{Admission, Pages};
use crate::datasource::{Page, PageKey};
use crate::digest::Chain;
use crate::geodesy::narrow;
use crate::limits::{BASE_DIAMONDS, DEEPEST, Limits, SettingsFault, check_surface};
use crate::lod::cover::{Cover, Planet, judge};
use crate::lod::refine::{Knobs, Mesh, Refinement};
use crate::lod::screen_error::{Horizon, Sight, motion_between};
use crate::lod::{audit, want};
use crate::mesh::build::{BLOCK, Block as BuildBlock, Ground, build_block, store};
use crate::mesh::drape::{Drape, NewTile, PatchDrape};
use crate::mesh::morph::{Moment, Morphing};
use crate::mesh::patches::Patches;
use crate::mesh::place::{self, BLOCK_GRAIN, LIST_GRAIN, Placed, empty_draws, place_blocks};
use crate::mesh::unrest::Unrest;
use crate::settings::SceneSettings;
use overfly_jobs::{ArithmeticFault, Graph, Span, StageId, Team, check_arithmetic};
use parking_lot::{Mutex, RwLock, RwLockReadGuard};
use std::sync::Arc;

/// Names of the stages, in the order in which data moves.
pub const STAGES: [Span; 6] = [CAMERA, ADMIT, PRIORITISE, REFINE, BUILD, PLACE];

const CAMERA: Span = Span("camera");
const ADMIT: Span = Span("datasource.admit");
const PRIORITISE: Span = Span("lod.prioritise");
const REFINE: Span = Span("lod.refine");
const BUILD: Span = Span("mesh.build");
const PLACE: Span = Span("mesh.place");

/// Diamonds judged in one chunk: some 10 µs of work.
const GRAIN: usize = 256;

/// The surface, and what the planet hangs on it.
pub struct Lod {
    /// Diamonds and when to look at which.
    pub mesh: Mesh,
    /// Bounds, pages and patches of each diamond.
    pub cover: Cover,
    /// The sights of the last frame that was not held, from which motion is counted.
    pub(crate) sights: Vec<Sight>,
    judges_all: bool,
}

/// What this frame's views see from.
#[derive(Default)]
struct Eyes {
    cameras: Vec<Camera>,
    /// As the LOD judges them.
    sights: Vec<Sight>,
}

/// The frame's clock: the input's time, but that it always runs on. Where the input stands, as in
/// a pause, or goes back, as in a seek, all morphs are over: so that a terrain which comes up in no
/// time is where it belongs, and splits along a diamond's ancestors stay in the order of time.
#[derive(Default)]
struct Clock {
    input_s: Option<f64>,
    now_ms: u32,
}

impl Clock {
    /// Goes on to an input's time, or by `morph_ms` where that stands, lies behind or half the
    /// range on.
    fn advance(&mut self, input_s: f64, morph_ms: u32) -> u32 {
        let step_ms = match self.input_s.replace(input_s) {
            None => milliseconds(input_s),
            Some(before_s) if input_s > before_s => {
                Some(milliseconds(input_s).wrapping_sub(milliseconds(before_s)))
                    .filter(|&step_ms| step_ms <= u32::MAX / 2)
                    .unwrap_or(morph_ms)
            }
            Some(_) => morph_ms,
        };
        self.now_ms = self.now_ms.wrapping_add(step_ms);
        self.now_ms
    }
}

/// The terrain of one scene: everything that lives from frame to frame.
pub struct Terrain {
    settings: SceneSettings,
    limits: Limits,
    horizon: Horizon,
    /// How vertices morph; `None` where `morph_s` is 0.
    morphing: Option<Morphing>,
    /// Imagery over the patches; `None` where the scene has none.
    drape: Mutex<Option<Drape>>,
    input: Mutex<FrameInput>,
    clock: Mutex<Clock>,
    eyes: RwLock<Eyes>,
    pages: RwLock<Pages>,
    lod: RwLock<Lod>,
    patches: RwLock<Patches>,
    build_blocks: Mutex<Vec<BuildBlock>>,
    unrest: Mutex<Unrest>,
    placed: Mutex<Vec<Placed>>,
    output: Mutex<FrameOutput>,
}

impl Terrain {
    /// The terrain of a scene, with no page yet; every pool is allocated here.
    ///
    /// # Panics
    /// Where [`Self::checked`] finds a fault, with the same words.
    pub fn new(settings: &SceneSettings, generator: &Generator) -> Self {
        Self::checked(settings, generator).unwrap_or_else(|fault| panic!("settings: {fault}"))
    }

    /// The terrain of a scene, with no page yet; every pool is allocated here.
    ///
    /// # Errors
    /// A setting is outside its range, or the sources go deeper than the body; nothing was
    /// allocated.
    pub fn checked(settings: &SceneSettings, generator: &Generator) -> Result<Self, SettingsFault> {
        let limits = Limits::checked(settings)?;
        check_surface(settings, generator.surface_range_m())?;
        Ok(Self::made(settings, limits, generator))
    }

    fn made(settings: &SceneSettings, limits: Limits, generator: &Generator) -> Self {
        let patch_depth = settings.lod.patch_depth;
        let morphing = Morphing::new(settings.lod.morph_s, patch_depth);
        let morphs = morphing.is_some();
        let arena = if morphs { Patches::morphing } else { Patches::new };
        let mut patches = arena(patch_depth, limits.leaves);
        let drape = (!settings.imagery.is_empty()).then(|| Drape::new(limits.pages));
        if drape.is_some() {
            patches.drapes = vec![PatchDrape::NONE; limits.leaves as usize];
        }
        Self {
            horizon: Horizon::new(&settings.body, generator.surface_range_m()),
            morphing,
            drape: Mutex::new(drape),
            input: Mutex::default(),
            clock: Mutex::default(),
            eyes: RwLock::default(),
            pages: RwLock::new(Pages::new(limits.pages)),
            lod: RwLock::new(Lod {
                mesh: Mesh::new(limits.diamonds, knobs_of(settings, &limits)),
                cover: Cover::new(limits.diamonds, morphs),
                sights: Vec::new(),
                judges_all: false,
            }),
            unrest: Mutex::new(Unrest::new(limits.leaves, morphs)),
            build_blocks: Mutex::new(BuildBlock::for_patches(
                limits.built,
                patches.vertices_per_patch,
                morphs,
            )),
            placed: Mutex::default(),
            patches: RwLock::new(patches),
            output: Mutex::default(),
            settings: settings.clone(),
            limits,
        }
    }

    /// The scene's settings.
    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    /// The capacities of all pools.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Takes the next frame's input; run the graph, then call [`Self::finish`].
    ///
    /// # Errors
    /// A view, a time or a page that cannot be used, or a thread whose arithmetic is not IEEE
    /// 754's: nothing was taken and the terrain is as it was.
    pub fn begin(&self, input: &mut FrameInput) -> Result<(), ViewFault> {
        self.check(input)?;
        core::mem::swap(&mut *self.input.lock(), input);
        Ok(())
    }

    /// What [`Self::begin`] checks before it takes anything.
    ///
    /// # Errors
    /// The same.
    pub fn check(&self, input: &FrameInput) -> Result<(), ViewFault> {
        let broken = |fault: ArithmeticFault| ViewFault::Arithmetic { sentence: fault.sentence() };
        check_arithmetic().map_err(broken)?;
        input.views.iter().try_for_each(crate::camera::View::check)?;
        if !input.time_s.is_finite() {
            return Err(ViewFault::Time { found_s: input.time_s });
        }
        let deepest_m = -narrow(DEEPEST * self.horizon.curvature_m[0]);
        input.arrived.iter().try_for_each(|page| check_page(page, deepest_m))
    }

    /// Hands over the frame's output, and takes the old one's memory for the next.
    pub fn finish(&self, output: &mut FrameOutput) {
        let mut own = self.output.lock();
        core::mem::swap(&mut *own, output);
        own.frame = output.frame + 1;
    }

    /// The patch arena, for a renderer's uploads.
    pub fn patches(&self) -> RwLockReadGuard<'_, Patches> {
        self.patches.read()
    }

    /// Tiles of imagery in their layers, for a renderer that comes late.
    pub fn tiles(&self) -> Vec<NewTile> {
        self.drape.lock().as_ref().map_or_else(Vec::new, |drape| drape.tiles().collect())
    }

    /// Diamonds, agenda and cover, for tests and tools.
    pub fn lod(&self) -> RwLockReadGuard<'_, Lod> {
        self.lod.read()
    }

    /// The resident pages, for tests and tools.
    pub fn pages(&self) -> RwLockReadGuard<'_, Pages> {
        self.pages.read()
    }

    /// Output of the frame in the making, for a stage after `mesh.place`.
    pub fn output(&self) -> &Mutex<FrameOutput> {
        &self.output
    }

    /// Whether every frame judges every diamond, whatever the motion: the same mesh for more work,
    /// which is what tests and benchmarks compare with.
    pub fn judge_all(&self, always: bool) {
        self.lod.write().judges_all = always;
    }

    /// Holds every link, seat, page use and patch against each other.
    ///
    /// # Errors
    /// What does not agree, in words.
    pub fn audit(&self) -> Result<(), String> {
        let (lod, pages, patches) = (self.lod.read(), self.pages.read(), self.patches.read());
        let judge = |diamonds: &_, id, band| judge(&lod.cover, &lod.sights, (diamonds, id), band);
        lod.mesh.check(&judge)?;
        audit::consistent(&lod.mesh, &lod.cover, &pages, &patches)?;
        audit::closed(&lod.mesh.diamonds, &lod.cover, &patches)
    }
}

/// Whether a page can be drawn: heights and bounds finite, no ground below `deepest_m`. Some
/// microseconds, little beside making one.
fn check_page(page: &Page, deepest_m: f32) -> Result<(), ViewFault> {
    let bounds = page
        .bounds
        .iter()
        .flat_map(|b| [b.error_odd_m, b.error_even_m, b.error_finer_m, b.variation_m]);
    check_all(page.key, ("height", deepest_m), page.heights_m.iter().copied())?;
    check_all(page.key, ("bound", 0.0), bounds)
}

fn check_all(
    key: PageKey,
    (field, least_m): (&'static str, f32),
    mut values: impl Iterator<Item = f32> + Clone,
) -> Result<(), ViewFault> {
    let holds = |m: f32| (m >= least_m) & (m <= f32::MAX);
    // Without a way out of the loop it is vector code.
    if values.clone().fold(true, |all, m| all & holds(m)) {
        return Ok(());
    }
    let found_m = values.find(|&m| !holds(m)).expect("not all of them hold");
    Err(ViewFault::Page { key, field, found_m, allowed_m: [least_m, f32::MAX] })
}

/// Adds the stages to a graph whose context holds a terrain; returns the last stage.
pub fn add_stages<C: Sync + 'static>(graph: &mut Graph<C>, terrain: fn(&C) -> &Terrain) -> StageId {
    let camera = graph.stage(CAMERA, &[], move |c, _| see(terrain(c)));
    let admit = graph.stage(ADMIT, &[], move |c, _| admit(terrain(c)));
    let prioritise =
        graph.stage(PRIORITISE, &[camera, admit], move |c, team| prioritise(terrain(c), team));
    let refine = graph.stage(REFINE, &[prioritise], move |c, _| refine_surface(terrain(c)));
    let build = graph.stage(BUILD, &[refine], move |c, team| build(terrain(c), team));
    graph.stage(PLACE, &[build], move |c, team| place(terrain(c), team))
}

/// Cameras and sights of this frame's views.
fn see(terrain: &Terrain) {
    let input = terrain.input.lock();
    let mut eyes = terrain.eyes.write();
    let Eyes { cameras, sights } = &mut *eyes;
    cameras.clear();
    sights.clear();
    cameras.extend(input.views.iter().map(|view| Camera::new(view, &terrain.settings.body)));
    sights.extend(cameras.iter().map(|camera| Sight::new(camera, terrain.horizon)));
}

/// Arrived pages in, idle ones out.
fn admit(terrain: &Terrain) {
    let mut pages = terrain.pages.write();
    let mut output = terrain.output.lock();
    // The list of arrived pages is taken out of the input, so that `see` may read the views.
    let mut arrived = core::mem::take(&mut terrain.input.lock().arrived);
    output.evicted.clear();
    let (time_s, held) = {
        let input = terrain.input.lock();
        (input.time_s, input.hold_lod)
    };
    let morph_ms = terrain.morphing.as_ref().map_or(0, |morphing| morphing.duration_ms);
    output.time_ms = terrain.clock.lock().advance(time_s, morph_ms);
    let frame = output.frame;
    let done = if held {
        refuse_all(&mut arrived, &mut output.evicted)
    } else {
        pages.admit(&mut arrived, frame, &mut output.evicted)
    };
    terrain.input.lock().arrived = arrived;
    output.counts = FrameCounts {
        admitted: done.admitted,
        evicted: done.evicted,
        refused: done.refused,
        pages: pages.resident(),
        ..FrameCounts::default()
    };
    output.digest.pages = pages.digest();
}

/// While the mesh is held no page comes in and none goes: whoever needs one asks for it later.
fn refuse_all(arrived: &mut Vec<Arc<Page>>, evicted: &mut Vec<Arc<Page>>) -> Admission {
    let refused = u32::try_from(arrived.len()).expect("few pages");
    evicted.append(arrived);
    Admission { refused, ..Admission::default() }
}

/// A time in whole milliseconds, modulo 2^32; 0 where it is not finite.
fn milliseconds(time_s: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, reason = "the remainder is below 2^32")]
    let ms = (time_s * 1e3).floor().rem_euclid(4_294_967_296.0) as u32;
    ms
}

fn knobs_of(settings: &SceneSettings, limits: &Limits) -> Knobs {
    let lod = &settings.lod;
    Knobs {
        tolerance_px: lod.tolerance.0,
        leaves_max: limits.leaves,
        splits_max: lod.splits_max,
        merges_max: lod.merges_max,
        level_max: lod.level_max,
    }
}

/// Judges, in parallel, the diamonds that the motion of the views made due.
fn prioritise(terrain: &Terrain, team: &Team<'_>) {
    if terrain.input.lock().hold_lod {
        // The sights of the last frame that judged stay: motion goes on from there.
        return;
    }
    let eyes = terrain.eyes.read();
    let mut lod = terrain.lod.write();
    let Lod { mesh, cover, sights, judges_all } = &mut *lod;
    let motion = if *judges_all { None } else { motion_between(sights, &eyes.sights) };
    sights.clear();
    sights.extend_from_slice(&eyes.sights);
    let cover = &*cover;
    let judge = |diamonds: &_, id, band| judge(cover, &eyes.sights, (diamonds, id), band);
    let evaluations = mesh.prioritise(&judge, motion, &|placements, body| {
        team.for_each_chunk(placements, GRAIN, body);
    });
    terrain.output.lock().counts.evaluations = evaluations;
}

/// Splits and merges.
fn refine_surface(terrain: &Terrain) {
    let eyes = terrain.eyes.read();
    let mut lod = terrain.lod.write();
    let mut pages = terrain.pages.write();
    let mut patches = terrain.patches.write();
    let mut output = terrain.output.lock();
    let Lod { mesh, cover, .. } = &mut *lod;
    let output = &mut *output;
    output.wanted.clear();
    output.wanted.reserve(terrain.settings.lod.wanted_max.max(BASE_DIAMONDS) as usize);
    if terrain.input.lock().hold_lod {
        let patch_depth = terrain.settings.lod.patch_depth;
        count(&mut output.counts, mesh, &Refinement::default(), patch_depth);
        cover.young_px = 0.0;
        output.digest.mesh = cover.digest();
        return;
    }
    let mut planet = Planet {
        cover,
        pages: &mut pages,
        patches: &mut patches,
        sights: &eyes.sights,
        body: &terrain.settings.body,
        horizon: terrain.horizon,
        sea: terrain.settings.sea,
        lod: &terrain.settings.lod,
        frame: output.frame,
        now_ms: output.time_ms,
    };
    let mut done = Refinement::default();
    if mesh.diamonds.base().is_none()
        && let Some(roots) = planet.pages.roots()
    {
        let base = mesh.create_base();
        planet.follow_base(&mesh.diamonds, base, roots);
    }
    if mesh.diamonds.base().is_some() {
        done = mesh.refine(&mut planet);
        let most = terrain.settings.lod.wanted_max;
        want::list(
            &mut mesh.lacking,
            planet.pages.room(planet.frame + 1).min(most),
            &mut output.wanted,
        );
    } else {
        want::roots(planet.pages, &mut output.wanted);
    }
    count(&mut output.counts, mesh, &done, terrain.settings.lod.patch_depth);
    if let Some(morphing) = &terrain.morphing {
        let now = (output.time_ms, morphing.duration_ms);
        planet.cover.look_at_young(&mesh.diamonds, planet.sights, now);
    }
    output.counts.wanted = u32::try_from(output.wanted.len()).expect("a bounded list");
    output.digest.mesh = planet.cover.digest();
}

fn count(counts: &mut FrameCounts, mesh: &Mesh, done: &Refinement, patch_depth: u8) {
    counts.leaves = mesh.diamonds.leaves();
    counts.triangles = counts.leaves << patch_depth;
    counts.diamonds = mesh.diamonds.live();
    counts.splits = done.splits;
    counts.merges = done.merges;
    counts.evaluations = done.evaluations;
    counts.blocked = done.blocked;
    counts.error_px_bound = done.error_px_bound;
}

/// Vertices of new leaves, in parallel over blocks of slots.
fn build(terrain: &Terrain, team: &Team<'_>) {
    let (lod, pages) = (terrain.lod.read(), terrain.pages.read());
    let mut patches = terrain.patches.write();
    let mut blocks = terrain.build_blocks.lock();
    let mut output = terrain.output.lock();
    output.built.clear();
    // Whoever keeps the output pays for its bound once, and not in a busy frame.
    output.built.reserve(terrain.limits.built as usize);
    patches.drain_fresh(&mut output.built);
    let SceneSettings { body, sea, .. } = &terrain.settings;
    let Lod { mesh, cover, sights, .. } = &*lod;
    let diamonds = &mesh.diamonds;
    let now_ms = output.time_ms;
    let moment = terrain.morphing.as_ref().map(|morphing| Moment { morphing, now_ms });
    let ground = Ground { diamonds, cover, pages: &pages, body, sea: *sea, moment };
    let output = &mut *output;
    let slots = &output.built;
    let used = &mut blocks[..slots.len().div_ceil(BLOCK)];
    team.for_each_chunk(used, 1, |first, chunk| {
        let from = first * BLOCK;
        let to = slots.len().min(from + BLOCK);
        build_block(&ground, &patches, &slots[from..to], &mut chunk[0]);
    });
    store(&mut patches, slots, used);
    if let Some(morphing) = &terrain.morphing {
        let mut unrest = terrain.unrest.lock();
        unrest.add(slots);
        let unrest_px = unrest.error_px(&patches, cover, sights, (now_ms, morphing.duration_ms));
        // Both bound what is drawn of splits that still morph.
        let least_px = if unrest_px < cover.young_px { unrest_px } else { cover.young_px };
        let bound_px = &mut output.counts.error_px_bound;
        *bound_px = if least_px > *bound_px { least_px } else { *bound_px };
    }
    output.counts.built = u32::try_from(slots.len()).expect("slots are counted in u32");
    if let Some(drape) = &mut *terrain.drape.lock() {
        drape_over(drape, (&mut patches, &ground), output);
    }
    output.digest.vertices = patches.digest();
}

/// What lies over the new patches.
fn drape_over(
    drape: &mut Drape,
    (patches, ground): (&mut Patches, &Ground<'_>),
    output: &mut FrameOutput,
) {
    let FrameOutput { built, tiles, time_ms, .. } = output;
    tiles.clear();
    for &slot in &*built {
        let leaf = patches.leaf[slot as usize].expect("only live slots are built");
        let (id, side) = (Id::new(leaf.diamond), usize::from(leaf.side));
        let page = ground.cover.pages[id][side].expect("a leaf's side is there");
        let corners = ground.diamonds.shape(id).triangle(side);
        let over =
            drape.over(ground.pages, (page, corners), (patches.patch_depth, *time_ms), tiles);
        patches.drapes[slot as usize] = over;
    }
}

/// Draws of every view, in parallel over blocks of slots, then over parts of the lists.
fn place(terrain: &Terrain, team: &Team<'_>) {
    let eyes = terrain.eyes.read();
    let patches = terrain.patches.read();
    let mut placed = terrain.placed.lock();
    let mut output = terrain.output.lock();
    let (depth, leaves) = (&terrain.settings.depth, terrain.limits.leaves);
    // A host may have taken views out, or put others in.
    let ranges = depth.splits_m.len() + 1;
    let fits = |view: &ViewDraws| view.ranges.len() == ranges;
    if output.views.len() != eyes.cameras.len() || !output.views.iter().all(fits) {
        let draws = |camera: &Camera| empty_draws(*camera, depth, leaves);
        output.views = eyes.cameras.iter().map(draws).collect();
    }
    placed.resize_with(eyes.cameras.len(), || Placed::new(leaves));
    let mut digest = Chain::default();
    let mut drawn = 0;
    for ((view, placed), camera) in output.views.iter_mut().zip(&mut *placed).zip(&eyes.cameras) {
        view.camera = *camera;
        for (range, (near_m, far_m)) in
            view.ranges.iter_mut().zip(place::ranges_of(camera.near_m, depth))
        {
            (range.near_m, range.far_m) = (near_m, far_m);
        }
        let (aim, blocks) = placed.begin(view, &patches);
        team.for_each_chunk(blocks, BLOCK_GRAIN, |first, blocks| {
            place_blocks(&patches, &aim, first, blocks);
        });
        digest.add(placed.count(view));
        for (index, range) in view.ranges.iter_mut().enumerate() {
            drawn += range.patches.len();
            team.for_each_chunk(&mut range.patches, LIST_GRAIN, |first, out| {
                placed.list(index, first, out);
            });
        }
    }
    output.counts.drawn = u32::try_from(drawn).expect("patches times ranges fits");
    output.digest.draws = digest.0;
}

//! Flies one flight as shipped and, beside it, judging everything: frame by frame in turn.
//!
//! In:    a [`Case`].
//! Out:   [`Columns`]: times, counts of every frame.
//! Keeps: pages of the flight, so that repeats do not make them again.
//! Not here: percentiles and the table (`report`).

use crate::recursion::Recursion;
use overfly::core::camera::View;
use overfly::core::datasource::{Page, PageKey};
use overfly::core::frame::{FrameCounts, FrameInput, FrameOutput, STAGES};
use overfly::core::settings::SceneSettings;
use overfly::jobs::now_ns;
use overfly::loader::Loader;
use overfly::replay::{Flight, view_of};
use overfly::{FrameError, Overfly};
use std::collections::BTreeMap;
use std::error::Error;
use std::ops::Range;
use std::sync::Arc;

const SIZE_PX: [u32; 2] = [1280, 720];

/// Most frames of a lead-in.
const LEAD_IN_MAX: usize = 600;

/// Index of the whole frame in [`Times`]; the stages come before it.
pub const FRAME: usize = STAGES.len();
/// Index of `lod.prioritise` and `lod.refine` together.
pub const DECIDE: usize = FRAME + 1;

/// The stages that decide what the mesh is: `lod.prioritise` and `lod.refine`.
const DECIDING: [usize; 2] = [2, 3];

/// Milliseconds of one frame: its stages, then [`FRAME`] and [`DECIDE`].
pub type Times = [f64; STAGES.len() + 2];

/// What is flown, and how.
pub struct Case<'a> {
    /// A bundled flight.
    pub flight: &'a str,
    pub scene: SceneSettings,
    pub frames: usize,
    pub windows: usize,
    pub workers: usize,
    pub repeats: usize,
    /// Recursion is timed in every so many frames.
    pub every: usize,
    pub alone: bool,
}

/// One kind of evaluation over all frames.
#[derive(Default)]
pub struct Side {
    pub ms: Vec<Times>,
    pub counts: Vec<FrameCounts>,
}

/// All frames of a case.
#[derive(Default)]
pub struct Columns {
    /// Which frame of the flight.
    pub index: Vec<usize>,
    pub lazy: Side,
    /// Empty when `lazy` flew alone.
    pub full: Side,
    /// Milliseconds of the walks, and what they visited.
    pub recursion_ms: Vec<f64>,
    pub visits: Vec<u64>,
}

/// A scene that flies.
struct Craft {
    overfly: Overfly,
    input: FrameInput,
    output: FrameOutput,
    frame_ns: u64,
}

/// The crafts of one run, and the state of its loading.
struct Run<'a> {
    case: &'a Case<'a>,
    flight: &'a Flight,
    lazy: Craft,
    full: Option<Craft>,
    recursion: Recursion,
    views: Vec<View>,
    columns: Columns,
    frames: usize,
}

/// All pages that a flight asked for so far.
struct Store {
    loader: Loader,
    pages: BTreeMap<PageKey, Arc<Page>>,
}

/// Flies a case as often as it says and keeps the least of each time.
pub fn fly(case: &Case<'_>) -> Result<Columns, Box<dyn Error>> {
    let guide = Overfly::new(&case.scene, 0)?;
    let flight = guide.flight(case.flight)?;
    let mut store = Store { loader: guide.loader(1)?, pages: BTreeMap::new() };
    let mut least: Option<Columns> = None;
    for _ in 0..case.repeats {
        let columns = fly_once(case, &flight, &mut store)?;
        least = Some(match least {
            None => columns,
            Some(before) => least_of(before, &columns),
        });
    }
    Ok(least.expect("a case is flown at least once"))
}

fn fly_once(
    case: &Case<'_>,
    flight: &Flight,
    store: &mut Store,
) -> Result<Columns, Box<dyn Error>> {
    let full = if case.alone { None } else { Some(Craft::new(case)?) };
    if let Some(craft) = &full {
        craft.overfly.terrain().judge_all(true);
    }
    let mut run = Run {
        case,
        flight,
        lazy: Craft::new(case)?,
        full,
        recursion: Recursion::new(&case.scene),
        views: Vec::new(),
        columns: Columns::default(),
        frames: 0,
    };
    for window in windows(flight.poses.len(), case) {
        lead_in(&mut run, store, window.start)?;
        for index in window {
            frame(&mut run, store, index)?;
            run.keep(index);
        }
    }
    Ok(run.columns)
}

/// Frames of the flight, evenly spread: the first window begins where it does, the last one ends
/// where it does.
fn windows(poses: usize, case: &Case<'_>) -> Vec<Range<usize>> {
    let count = if case.frames >= poses { 1 } else { case.windows };
    let length = (case.frames.min(poses) / count).max(1);
    let start = |window| if count > 1 { window * (poses - length) / (count - 1) } else { 0 };
    (0..count).map(start).map(|start| start..start + length).collect()
}

/// Holds the clock until nothing changes any more.
fn lead_in(run: &mut Run<'_>, store: &mut Store, index: usize) -> Result<(), FrameError> {
    for _ in 0..LEAD_IN_MAX {
        frame(run, store, index)?;
        let c = &run.lazy.output.counts;
        if c.leaves > 0 && c.splits + c.merges + c.wanted == 0 {
            break;
        }
    }
    Ok(())
}

/// One frame of each craft, in alternating order.
fn frame(run: &mut Run<'_>, store: &mut Store, index: usize) -> Result<(), FrameError> {
    let (scene, pose) = (&run.case.scene, &run.flight.poses[index]);
    let view = |lens| view_of(pose, lens, SIZE_PX, &scene.body);
    run.views.clear();
    run.views.extend(scene.views.iter().map(view));
    let wanted = run.lazy.output.wanted.clone();
    let crafts = [Some(&mut run.lazy), run.full.as_mut()];
    for craft in crafts.into_iter().flatten() {
        craft.input.time_s = pose.time_s;
        craft.input.views.clear();
        craft.input.views.extend_from_slice(&run.views);
        store.fetch(&wanted, &mut craft.input.arrived);
    }
    run.frames += 1;
    let Some(full) = &mut run.full else { return run.lazy.frame() };
    if run.frames.is_multiple_of(2) {
        run.lazy.frame()?;
        full.frame()?;
    } else {
        full.frame()?;
        run.lazy.frame()?;
    }
    assert_eq!(run.lazy.output.digest, full.output.digest, "frame {index}: not the same picture");
    assert_eq!(run.lazy.output.wanted, full.output.wanted, "frame {index}: not the same pages");
    Ok(())
}

impl Craft {
    fn new(case: &Case<'_>) -> Result<Self, Box<dyn Error>> {
        Ok(Self {
            overfly: Overfly::new(&case.scene, case.workers)?,
            input: FrameInput::default(),
            output: FrameOutput::default(),
            frame_ns: 0,
        })
    }

    fn frame(&mut self) -> Result<(), FrameError> {
        let begin_ns = now_ns();
        let done = self.overfly.frame(&mut self.input, &mut self.output);
        self.frame_ns = now_ns() - begin_ns;
        done
    }

    fn times(&self) -> Times {
        let mut times = [0.0; STAGES.len() + 2];
        for (ms, &stage) in times.iter_mut().zip(&STAGES) {
            *ms = ms_of(self.overfly.spans().stage_ns(stage).expect("every stage ran"));
        }
        times[FRAME] = ms_of(self.frame_ns);
        times[DECIDE] = DECIDING.iter().map(|&stage| times[stage]).sum();
        times
    }

    fn keep(&self, side: &mut Side) {
        side.ms.push(self.times());
        side.counts.push(self.output.counts);
    }
}

impl Run<'_> {
    /// Keeps what the frame took, and recurses over its mesh if it is its turn.
    fn keep(&mut self, index: usize) {
        let columns = &mut self.columns;
        self.lazy.keep(&mut columns.lazy);
        columns.index.push(index);
        let Some(full) = &self.full else { return };
        full.keep(&mut columns.full);
        if !(columns.index.len() - 1).is_multiple_of(self.case.every) {
            return;
        }
        let sights = self.recursion.sights(&self.views);
        let lod = self.lazy.overfly.terrain().lod();
        let begin_ns = now_ns();
        let visit = std::hint::black_box(self.recursion.walk(&lod, &sights));
        columns.recursion_ms.push(ms_of(now_ns() - begin_ns));
        columns.visits.push(u64::from(visit.visits));
        let diamonds = self.lazy.output.counts.diamonds;
        assert_eq!(visit.visits, diamonds, "frame {index}: every diamond is visited once");
    }
}

impl Store {
    /// Appends these pages, in this order; those not made yet are waited for.
    fn fetch(&mut self, keys: &[PageKey], arrived: &mut Vec<Arc<Page>>) {
        let lacking = keys.iter().filter(|key| !self.pages.contains_key(key));
        let lacking: Vec<PageKey> = lacking.copied().collect();
        let mut made = Vec::new();
        self.loader.fetch(&lacking, &mut made);
        self.pages.extend(made.into_iter().map(|page| (page.key, page)));
        arrived.extend(keys.iter().map(|key| self.pages[key].clone()));
    }
}

/// The least of each time of two runs, whose counts are the same.
fn least_of(mut one: Columns, other: &Columns) -> Columns {
    let sides = [(&mut one.lazy, &other.lazy), (&mut one.full, &other.full)];
    for (one, other) in sides {
        assert_eq!(one.counts, other.counts, "a flight does the same every time");
        let pairs = one.ms.iter_mut().flatten().zip(other.ms.iter().flatten());
        pairs.for_each(|(one, other)| *one = one.min(*other));
    }
    let pairs = one.recursion_ms.iter_mut().zip(&other.recursion_ms);
    pairs.for_each(|(one, other)| *one = one.min(*other));
    one
}

fn ms_of(ns: u64) -> f64 {
    ns as f64 * 1e-6
}

//! A flight flown frame by frame for those who look at each frame: no recording.
//!
//! In:    a flight or recording, a scene, workers, a delay of the loader.
//! Out:   the terrain after each frame, and the frame's output.
//! Keeps: [`Flown`].
//! Not here: `replay` with all that it keeps (`run`), what is made of the frames.

use super::Failure;
use super::source::Source;
use crate::heap::counted;
use overfly::core::datasource::{Page, PageKey};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::jobs::now_ns;
use overfly::loader::Loader;
use overfly::replay::measure::PagePart;
use overfly::sources::Sources;
use overfly::{FrameError, Overfly};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Name of the function that runs a frame and nothing else: who counts its instructions looks for it.
pub const COUNTED: &str = "counted_frame";
/// Most frames in which the terrain comes up before a flight.
const LEAD_IN_MAX: usize = 2000;

/// A scene and the flight that is flown over it.
pub struct Flown {
    /// The scene with everything that it needs to run.
    pub overfly: Overfly,
    /// What is flown.
    pub source: Source,
    /// The last frame's.
    pub output: FrameOutput,
    /// How long the last frame took, in nanoseconds; waiting for its pages is not part of it.
    pub frame_ns: u64,
    /// Heap calls of the last frame, by its caller and its workers.
    pub allocations: u64,
    /// Bytes of the pages that arrived in the last frame, as they came out of archives and generator.
    pub decoded_bytes: usize,
    /// How long each frame of the last lead-in took.
    pub lead_in_ns: Vec<u64>,
    scene: SceneSettings,
    input: FrameInput,
    loader: Loader,
    size_px: [u32; 2],
    /// Frames that a page takes beyond the next, and those on their way with when they are due.
    delay: usize,
    coming: VecDeque<(usize, PageKey)>,
    count: usize,
}

/// A page, or as much of it as measuring needs; none where its data cannot be had.
pub fn page_of(sources: &Sources, (key, part): (PageKey, PagePart)) -> Option<Arc<Page>> {
    let page = match part {
        PagePart::Heights => sources.bare_page(key),
        PagePart::Whole => sources.page(key),
    };
    page.ok()
}

/// See [`COUNTED`].
#[inline(never)]
fn counted_frame(
    overfly: &mut Overfly,
    input: &mut FrameInput,
    output: &mut FrameOutput,
) -> Result<(), FrameError> {
    overfly.frame(input, output)
}

/// How a flight is flown.
#[derive(Clone, Copy)]
pub struct Manner {
    /// Worker threads beside the caller.
    pub workers: usize,
    /// Size of the picture that errors are counted in.
    pub size_px: [u32; 2],
    /// How much later than in the next frame pages arrive, in seconds of the flight.
    pub delay_s: f64,
}

impl Flown {
    /// Opens a flight over a scene.
    pub fn open(name: &str, scene: &SceneSettings, manner: Manner) -> Result<Self, Failure> {
        let overfly = Overfly::new(scene, manner.workers)?;
        let source = Source::open(name, scene, &overfly)?;
        let loader = overfly.loader(super::replay::default_workers().max(1))?;
        let rate_hz = source.rate_hz();
        let delay = (0..).find(|&frames| f64::from(frames) >= manner.delay_s * rate_hz);
        Ok(Self {
            overfly,
            size_px: source.size_px().unwrap_or(manner.size_px),
            source,
            output: FrameOutput::default(),
            frame_ns: 0,
            allocations: 0,
            decoded_bytes: 0,
            lead_in_ns: Vec::new(),
            scene: scene.clone(),
            input: FrameInput::default(),
            loader,
            delay: usize::try_from(delay.unwrap_or(0_u32))?,
            coming: VecDeque::new(),
            count: 0,
        })
    }

    /// Holds the clock before frame `first` until the terrain has come up. False if it was stopped.
    pub fn lead_in(&mut self, first: usize, stop: &AtomicBool) -> Result<bool, Failure> {
        let recorded = self.source.lead_in();
        let is_followed = self.source.is_followed();
        self.lead_in_ns.clear();
        for index in 0..if is_followed { recorded } else { LEAD_IN_MAX } {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            self.run(if is_followed { index } else { first + recorded }, !is_followed)?;
            self.lead_in_ns.push(self.frame_ns);
            let c = &self.output.counts;
            let idle = c.splits + c.merges + c.wanted == 0;
            if !is_followed && c.leaves > 0 && idle && self.coming.is_empty() {
                break;
            }
        }
        Ok(true)
    }

    /// Runs one frame.
    pub fn frame(&mut self, index: usize) -> Result<(), Failure> {
        self.run(index + self.source.lead_in(), false)
    }

    /// Runs one frame and draws its first view: RGBA rows, top first. There must be a renderer.
    pub fn frame_drawn(&mut self, index: usize) -> Result<Vec<u8>, Failure> {
        self.frame(index)?;
        self.overfly.draw(&self.output, 0)?;
        let pixels = self.overfly.with_renderer(|renderer| renderer.read_pixels());
        Ok(pixels.transpose()?.ok_or("there is no renderer")?)
    }

    /// Time of the last frame's input in seconds.
    pub fn time_s(&self) -> f64 {
        self.input.time_s
    }

    /// Pages on their way to the terrain.
    pub fn queue_depth(&self) -> usize {
        self.coming.len()
    }

    fn run(&mut self, played: usize, held: bool) -> Result<(), Failure> {
        if !self.source.load(played) {
            return Err(self.source.fault());
        }
        self.source.fill(&self.scene, self.size_px, &mut self.input)?;
        if held {
            self.input.time_s -= 1.0 / self.source.rate_hz();
            self.input.hold_lod = false;
        }
        if let Some(scene) = &self.input.scene {
            let sun = scene.sun;
            if **scene != (SceneSettings { sun, ..self.scene.clone() }) {
                let name = self.source.name();
                return Err(format!(
                    "{name}: the ground becomes another in frame {played}; only `replay` follows \
                     that, here allowed is a change of the sun"
                )
                .into());
            }
        }
        let arriving = self.arriving();
        self.loader.fetch(&arriving, &mut self.input.arrived);
        self.decoded_bytes = self.input.arrived.iter().map(|page| page.bytes()).sum();
        let Self { overfly, input, output, .. } = self;
        let begin_ns = now_ns();
        let (ran, allocations) = counted(|| counted_frame(overfly, input, output));
        self.frame_ns = now_ns() - begin_ns;
        self.allocations = allocations;
        Ok(ran?)
    }

    /// The pages of this frame: as recorded; else what was wanted and is due.
    fn arriving(&mut self) -> Vec<PageKey> {
        if let Some(keys) = self.source.arrived() {
            return keys.to_vec();
        }
        for &key in &self.output.wanted {
            if self.coming.iter().all(|&(_, known)| known != key) {
                self.coming.push_back((self.count + self.delay, key));
            }
        }
        let due = self.coming.iter().take_while(|&&(due, _)| due <= self.count).count();
        self.count += 1;
        self.coming.drain(..due).map(|(_, key)| key).collect()
    }
}

//! The loop of a replay: frame by frame from a source through the terrain to what is kept.
//!
//! In:    a [`Run`], made from the arguments; the terrain.
//! Out:   columns, digests, stills, a recording.
//! Keeps: [`Run`].
//! Not here: arguments, tables and exit codes (`replay`).

use super::Failure;
use super::columns::Columns;
use super::source::Source;
use super::stills::{Stills, write_png};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::Overfly;
use overfly::config;
use overfly::core::datasource::PageKey;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::jobs::now_ns;
use overfly::loader::Loader;
use overfly::replay::{RecordedFrame, RunDigest, Writer};
use std::collections::{BTreeSet, VecDeque};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most frames of a flight's lead-in.
const LEAD_IN_MAX: usize = 600;

/// What one run works with, beside the terrain.
pub struct Run {
    pub scene: SceneSettings,
    pub source: Source,
    /// Frames that run; those before `reported.start` only lead there.
    pub ran: Range<usize>,
    pub reported: Range<usize>,
    pub size_px: [u32; 2],
    /// Frames that a page takes beyond the next.
    pub delay: usize,
    /// Pages on their way: the frame in which they arrive, counted with the lead-in.
    pub coming: VecDeque<(usize, PageKey)>,
    /// Frames run so far, lead-in included.
    pub count: usize,
    pub stills: Vec<usize>,
    pub draws: bool,
    /// Folder for a picture of every frame.
    pub video: Option<PathBuf>,
    pub loader: Loader,
    /// Archives of which it was said that they fail.
    pub named: BTreeSet<String>,
    pub recorder: Option<Writer>,
    pub columns: Columns,
    pub digest: RunDigest,
    pub diverged: Option<(usize, &'static str)>,
    pub pictures: Stills,
}

/// All frames, or those before one that cannot be read: the source's ending says so. False if Ctrl-C
/// ended them early.
pub fn fly(run: &mut Run, overfly: &mut Overfly) -> Result<bool, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    let style = "{bar:40} {pos}/{len} frames, {per_sec}, {eta} left {msg}";
    let bar = ProgressBar::new(run.ran.len() as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    bar.set_message("the terrain comes up");
    if !lead_in(run, overfly, &stop, (&mut input, &mut output))? {
        bar.abandon();
        return Ok(false);
    }
    bar.set_message("");
    for index in run.ran.clone() {
        if stop.load(Ordering::Relaxed) {
            bar.abandon();
            return Ok(false);
        }
        if !frame(run, overfly, (index, true), (&mut input, &mut output))? {
            bar.abandon();
            return Ok(true);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if run.ran.end == run.source.frames() {
        // There is no such frame: this finds how the file ends.
        run.source.load(run.ran.end + run.source.lead_in());
    }
    Ok(true)
}

/// Holds the clock until the terrain has come up: a flight's first pose until nothing changes, a
/// recording's frames before its time moves. False if Ctrl-C ended it.
fn lead_in(
    run: &mut Run,
    overfly: &mut Overfly,
    stop: &AtomicBool,
    (input, output): (&mut FrameInput, &mut FrameOutput),
) -> Result<bool, Failure> {
    let recorded = run.source.lead_in();
    let is_followed = run.source.is_followed();
    for index in 0..if is_followed { recorded } else { LEAD_IN_MAX } {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let begin = if is_followed { index } else { run.ran.start + recorded };
        if !frame(run, overfly, (begin, false), (input, output))? {
            break;
        }
        let c = &output.counts;
        let settled = c.leaves > 0 && c.splits + c.merges + c.wanted == 0 && run.coming.is_empty();
        if !is_followed && settled {
            break;
        }
    }
    Ok(true)
}

/// One frame: pages in, stages, what comes out. Frames of the lead-in are recorded and checked,
/// but not counted. False where the source has no such frame.
fn frame(
    run: &mut Run,
    overfly: &mut Overfly,
    (index, counted): (usize, bool),
    (input, output): (&mut FrameInput, &mut FrameOutput),
) -> Result<bool, Failure> {
    let begin_ns = now_ns();
    let played = index + if counted { run.source.lead_in() } else { 0 };
    if !run.source.load(played) {
        return Ok(false);
    }
    run.source.fill(&run.scene, run.size_px, input)?;
    if !counted && !run.source.is_followed() {
        // The lead-in's clock stands one frame before the first: so a recording tells them apart.
        input.time_s -= 1.0 / run.source.rate_hz();
        input.hold_lod = false;
    }
    let scene = input.scene.as_ref().map(|scene| config::write(scene)).transpose()?;
    let sources = overfly.sources().clone();
    let arriving = arriving(run, &output.wanted);
    run.loader.fetch(&arriving, &mut input.arrived);
    if input.arrived.len() < arriving.len() {
        name_faults(run);
    }
    let arrived = input.arrived.iter().map(|page| page.key).collect();
    let FrameInput { time_s, hold_lod, .. } = *input;
    let mut record = RecordedFrame { time_s, arrived, hold_lod, scene, ..Default::default() };
    if run.recorder.is_some() {
        record.views.extend_from_slice(&input.views);
    }
    let reported = counted && run.reported.contains(&index);
    let still = run.stills.contains(&index);
    let drawn = run.draws && reported && (still || run.stills.is_empty());
    let ready_ns = now_ns();
    if drawn {
        follow_size(run, overfly, input)?;
        overfly.frame_drawn(input, output, 0)?;
    } else {
        overfly.frame(input, output)?;
    }
    let end_ns = now_ns();
    if !Arc::ptr_eq(&sources, overfly.sources()) {
        run.loader = overfly.loader(super::replay::default_workers().max(1))?;
        run.coming.clear();
    }
    if still && drawn {
        take_stills(run, overfly, index, output)?;
    }
    if let Some(folder) = run.video.as_ref().filter(|_| drawn) {
        let file = folder.join(format!("frame-{:06}.png", index - run.reported.start));
        let pixels = overfly.with_renderer(|renderer| renderer.read_pixels());
        let pixels = pixels.transpose()?.ok_or("there is no renderer any more")?;
        write_png(&file, run.size_px, pixels)?;
    }
    if let Some(recorder) = &mut run.recorder {
        record.digest = output.digest;
        recorder.frame(&record)?;
    }
    if run.diverged.is_none()
        && let Some(stage) = run.source.difference(&output.digest)
    {
        run.diverged = Some((index, stage));
    }
    if reported {
        run.digest.add(&output.digest);
        run.columns.add(end_ns - ready_ns, ready_ns - begin_ns, overfly.spans(), output);
    }
    Ok(true)
}

/// A recording of a window may change its size.
fn follow_size(run: &mut Run, overfly: &mut Overfly, input: &FrameInput) -> Result<(), Failure> {
    let Some(size_px) = input.views.first().map(|view| view.size_px) else { return Ok(()) };
    if size_px != run.size_px {
        overfly.with_renderer(|renderer| renderer.resize(size_px)).transpose()?;
        run.size_px = size_px;
    }
    Ok(())
}

/// Says of each archive once that it fails, and how. The ground stays coarser there.
fn name_faults(run: &mut Run) {
    for (key, error) in run.loader.faults() {
        let archive = error.archive().unwrap_or("the planet").to_owned();
        if run.named.insert(archive) {
            let depth = key.depth();
            eprintln!("overfly: {error}; the ground is coarser there (a page of depth {depth})");
        }
    }
}

/// The pages of this frame: as recorded; else what was wanted and is due.
fn arriving(run: &mut Run, wanted: &[PageKey]) -> Vec<PageKey> {
    if let Some(keys) = run.source.arrived() {
        return keys.to_vec();
    }
    for &key in wanted {
        if run.coming.iter().all(|&(_, known)| known != key) {
            run.coming.push_back((run.count + run.delay, key));
        }
    }
    let due = run.coming.iter().take_while(|&&(due, _)| due <= run.count).count();
    run.count += 1;
    run.coming.drain(..due).map(|(_, key)| key).collect()
}

/// A still of each view; the first is drawn already.
fn take_stills(
    run: &mut Run,
    overfly: &mut Overfly,
    index: usize,
    output: &FrameOutput,
) -> Result<(), Failure> {
    for view in 0..output.views.len() {
        if view > 0 {
            overfly.draw(output, view)?;
        }
        let name = match run.scene.views.get(view) {
            Some(lens) if output.views.len() > 1 => format!("{}-", lens.name),
            _ => String::new(),
        };
        let pixels = overfly.with_renderer(|renderer| renderer.read_pixels());
        if let Some(pixels) = pixels.transpose()? {
            run.pictures.add(index, &name, run.size_px, pixels)?;
        }
    }
    Ok(())
}

//! `overfly.replay`: a flight or a recording played, its counts and times as columns.
//!
//! In:    a flight or recording, a scene, a range of frames.
//! Out:   [`Replay`]: numpy columns, digests, whether they are those recorded.
//! Keeps: nothing.
//! Not here: the loop's frames (`player`).

use crate::arrays::array;
use crate::player::{Player, Wish};
use crate::raised::refused;
use crate::terrain::BOUND;
use numpy::PyArrayDyn;
use overfly::core::frame::{FrameCounts, STAGES};
use overfly::jobs::Span;
use overfly::replay::RunDigest;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A replay: one value a frame in every column.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct Replay {
    /// Name of the flight or recording.
    pub name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Index of the first frame of the columns.
    pub first_frame: usize,
    /// Time of the flight in seconds.
    pub time_s: Py<PyArrayDyn<f64>>,
    /// How long each frame took in milliseconds; waiting for pages is not part of it.
    pub frame_ms: Py<PyArrayDyn<f64>>,
    /// How long each frame waited for its pages, in milliseconds.
    pub waited_ms: Py<PyArrayDyn<f64>>,
    /// How long each stage took in milliseconds, by name.
    pub stages_ms: Py<PyDict>,
    /// Counts by name, int64; `error_px_bound` is float64.
    pub counts: Py<PyDict>,
    /// The state after each frame, uint64, in columns `pages`, `mesh`, `vertices` and `draws`.
    pub digests: Py<PyArrayDyn<u64>>,
    /// The digest of all frames, as `overfly replay` prints it.
    pub digest: String,
    /// Whether all frames are those recorded; `None` where there is nothing to hold them against: a
    /// flight, or a clip whose terrain came up anew.
    pub same: Option<bool>,
    /// First frame and stage that left the recording.
    pub diverged: Option<(usize, &'static str)>,
    /// What of the file cannot be read; the frames before it were played.
    pub damage: Option<String>,
}

/// Columns of one run.
#[derive(Default)]
struct Columns {
    time_s: Vec<f64>,
    frame_ms: Vec<f64>,
    waited_ms: Vec<f64>,
    stages_ms: Vec<Vec<f64>>,
    counts: Vec<Vec<f64>>,
    digests: Vec<u64>,
    digest: RunDigest,
    diverged: Option<(usize, &'static str)>,
}

impl Columns {
    /// Runs a frame and adds it.
    fn add(&mut self, player: &mut Player, index: usize) -> PyResult<()> {
        let took = player.frame(index)?;
        let ms = |ns: u64| ns as f64 / 1e6;
        self.time_s.push(player.time_s());
        self.frame_ms.push(ms(took.frame_ns));
        self.waited_ms.push(ms(took.waited_ns));
        self.stages_ms.resize(STAGES.len(), Vec::new());
        for (column, &Span(name)) in self.stages_ms.iter_mut().zip(&STAGES) {
            column.push(ms(player.overfly.spans().stage_ns(Span(name)).unwrap_or(0)));
        }
        let counts = player.output.counts.columns();
        self.counts.resize(counts.len(), Vec::new());
        for (column, (_, value)) in self.counts.iter_mut().zip(counts) {
            column.push(value);
        }
        let digest = player.output.digest;
        self.digests.extend(digest.parts());
        self.digest.add(&digest);
        if self.diverged.is_none() {
            self.diverged = player.difference(index, &digest).map(|stage| (index, stage));
        }
        Ok(())
    }
}

/// Plays a bundled flight (rainier, descent, poles) or an `.ovf` file; keeps what each frame did.
///
/// A recording brings its scene and is held against what was recorded. `frames` is (first, end),
/// the end excluded; where it does not begin at 0 the terrain comes up there and nothing is held
/// against the recording, unless `from_start` runs all frames before it. `scene` is as in
/// `Terrain`; `workers` are threads beside the caller, by default one for each other core.
///
/// >>> import overfly
/// >>> run = overfly.replay("poles", frames=(100, 110), scene="small", size_px=(320, 240))
/// >>> run.counts["triangles"].shape, run.same
/// ((10,), None)
#[pyfunction]
#[pyo3(signature = (flight, *, frames=None, scene=None, workers=None, size_px=(1280, 720),
                    from_start=false),
       text_signature = "(flight, *, frames=None, scene=None, workers=None, size_px=(1280, 720), \
                         from_start=False)")]
#[expect(clippy::too_many_arguments, reason = "keywords of Python, with defaults")]
pub fn replay(
    py: Python<'_>,
    flight: PathBuf,
    frames: Option<(usize, usize)>,
    scene: Option<PathBuf>,
    workers: Option<usize>,
    size_px: (u32, u32),
    from_start: bool,
) -> PyResult<Replay> {
    let wish = Wish { flight, scene, workers, size_px };
    let (player, columns, first) = py.detach(|| run(&wish, frames, from_start))?;
    let Columns { time_s, digests, digest, diverged, .. } = columns;
    let shape = [time_s.len()];
    let (stages_ms, counts) = (PyDict::new(py), PyDict::new(py));
    for (&Span(name), column) in STAGES.iter().zip(columns.stages_ms) {
        stages_ms.set_item(name, array(py, column, &shape)?)?;
    }
    for ((name, _), column) in FrameCounts::default().columns().iter().zip(columns.counts) {
        if *name == BOUND {
            counts.set_item(name, array(py, column, &shape)?)?;
        } else {
            #[expect(clippy::cast_possible_truncation, reason = "counts are u32")]
            let whole = column.into_iter().map(|value| value as i64).collect();
            counts.set_item(name, array::<i64>(py, whole, &shape)?)?;
        }
    }
    Ok(Replay {
        name: player.name.clone(),
        rate_hz: player.rate_hz,
        first_frame: first,
        digests: array(py, digests, &[shape[0], 4])?,
        time_s: array(py, time_s, &shape)?,
        frame_ms: array(py, columns.frame_ms, &shape)?,
        waited_ms: array(py, columns.waited_ms, &shape)?,
        stages_ms: stages_ms.unbind(),
        counts: counts.unbind(),
        digest: format!("{:016x}", digest.value()),
        same: player.is_followed().then_some(diverged.is_none()),
        diverged,
        damage: player.damage,
    })
}

/// Flies; what was flown, and the first frame of the columns.
fn run(
    wish: &Wish,
    frames: Option<(usize, usize)>,
    from_start: bool,
) -> PyResult<(Player, Columns, usize)> {
    let mut player = Player::open(wish)?;
    let reported = player.chosen(frames)?;
    if from_start && !player.is_followed() {
        return Err(refused("from_start is true, but a flight has no states to be held against"));
    }
    let begin = if from_start { 0 } else { reported.start };
    if begin > 0 {
        player.forget_states();
    }
    player.lead_in(begin)?;
    let mut columns = Columns::default();
    for index in begin..reported.start {
        player.frame(index)?;
        let digest = player.output.digest;
        let left = player.difference(index, &digest).map(|stage| (index, stage));
        columns.diverged = columns.diverged.or(left);
    }
    for index in reported.clone() {
        columns.add(&mut player, index)?;
    }
    player.overfly.close();
    Ok((player, columns, reported.start))
}

//! A scene that runs: frames, heights of what is there, exact heights, a recording.
//!
//! In:    a scene, views frame by frame; places, points, rays, regions.
//! Out:   [`FrameResult`]; answers of the ground.
//! Keeps: [`Terrain`]: the running scene, its tickets, a surveyor from the first exact height on.
//! Not here: flights and recordings that are played (`player`), words of answers (`ground`).

use crate::arrays::{Numbers, checked, place, places, point, points};
use crate::ground::{Contacts, Heights, Ray, Readiness, query_of};
use crate::player::{scene_of, threads};
use crate::raised::{OverflyError, failed, interrupted, refused};
use crate::view::View;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly::core::ground::{Answer, Ground, Query, Region};
use overfly::core::settings::SceneSettings;
use overfly::jobs::now_ns;
use overfly::surveyor::Surveyor;
use overfly::{FrameError, Host, Overfly, Pages, Ticket, Workers, config};
use parking_lot::Mutex;
use pyo3::exceptions::PyTimeoutError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// Pages that the surveyor keeps: 128 MiB.
const SURVEYED_PAGES: usize = 2048;
/// Places between two looks for Ctrl-C.
const CHUNK: usize = 256;
/// How often readiness is looked at while it is waited for.
const LOOK: Duration = Duration::from_millis(2);

/// A scene that runs: frames, heights, a recording.
///
/// `scene` is a preset (earth, moon, small), the path of a scene file, or its text. `workers` are
/// threads beside the caller, 0 to 64: what comes out is the same bits for any number. With `pages`
/// "waited" a frame waits for what the frame before it wanted, so that runs repeat bit for bit;
/// with "as_ready" frames wait for nothing and pages come when they are ready.
///
/// Objects may be used from several threads, and in a `with` statement, which closes them.
///
/// >>> import overfly
/// >>> with overfly.Terrain("small") as terrain:
/// ...     view = overfly.View(10.0, 20.0, 400.0)
/// ...     for i in range(30):
/// ...         result = terrain.frame(i / 60, [view])
/// >>> result.frame, result.counts["leaves"] > 100
/// (29, True)
#[pyclass(frozen, module = "overfly")]
pub struct Terrain {
    /// Empty once it is closed.
    running: Mutex<Option<Running>>,
    /// Empty until the first exact height.
    surveyor: Mutex<Option<Surveyor>>,
    scene: SceneSettings,
}

struct Running {
    overfly: Overfly,
    input: FrameInput,
    output: FrameOutput,
    tickets: BTreeMap<u64, Ticket>,
    given: u64,
}

fn closed() -> PyErr {
    OverflyError::new_err("the terrain is closed")
}

/// A region from degrees and metres.
fn region(lat_deg: f64, lon_deg: f64, radius_m: f64) -> PyResult<Region> {
    let centre = place(lat_deg, lon_deg)?;
    Ok(Region { centre, radius_m: checked(("radius_m", [0.0, 1e9]), radius_m)? })
}

impl Terrain {
    /// Works on the running scene, without the interpreter's lock.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Running) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        py.detach(|| work(self.running.lock().as_mut().ok_or_else(closed)?))
    }

    /// The ground of all pages that are there now.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Ground> {
        self.with(py, |running| Ok(running.overfly.ground()))
    }

    fn ready(&self, py: Python<'_>, region: Region, level: u8) -> PyResult<Readiness> {
        let found = self.with(py, |running| {
            running.overfly.readiness(region, level).map_err(|fault| failed(&fault))
        });
        found.map(Readiness::from)
    }

    fn survey(&self, places: &[Geodetic], query: Query) -> PyResult<Vec<Answer>> {
        let mut answers = Vec::with_capacity(places.len());
        for chunk in places.chunks(CHUNK) {
            self.survey_chunk(chunk, query, &mut answers)?;
            interrupted()?;
        }
        Ok(answers)
    }

    /// Holds the surveyor for no longer than this: others may ask in between.
    fn survey_chunk(
        &self,
        places: &[Geodetic],
        query: Query,
        answers: &mut Vec<Answer>,
    ) -> PyResult<()> {
        let mut kept = self.surveyor.lock();
        let surveyor = match &mut *kept {
            Some(surveyor) => surveyor,
            none => {
                let running = self.running.lock();
                let overfly = &running.as_ref().ok_or_else(closed)?.overfly;
                none.insert(overfly.surveyor(SURVEYED_PAGES))
            }
        };
        for &at in places {
            answers.push(surveyor.height(at, query).map_err(|error| failed(&error))?);
        }
        Ok(())
    }
}

#[expect(clippy::too_many_arguments, reason = "keywords of Python, with defaults")]
#[pymethods]
impl Terrain {
    #[new]
    #[pyo3(signature = (scene=PathBuf::from("earth"), *, workers=0, pages="waited"),
           text_signature = "(scene='earth', *, workers=0, pages='waited')")]
    fn new(py: Python<'_>, scene: PathBuf, workers: usize, pages: &str) -> PyResult<Self> {
        let pages = match pages {
            "waited" => Pages::Waited { threads: threads() },
            "as_ready" => Pages::AsReady { threads: threads() },
            _ => {
                return Err(refused(format!(
                    "pages is `{pages}`, allowed are waited and as_ready"
                )));
            }
        };
        if workers > 64 {
            return Err(refused(format!("workers is {workers}, allowed is 0 to 64")));
        }
        let scene = scene_of(&scene)?;
        let host = Host { workers: Workers::Own(workers), pages, ..Host::default() };
        let overfly = py.detach(|| Overfly::new(&scene, host)).map_err(|error| failed(&error))?;
        let running = Running {
            overfly,
            input: FrameInput::default(),
            output: FrameOutput::default(),
            tickets: BTreeMap::new(),
            given: 0,
        };
        Ok(Self { running: Mutex::new(Some(running)), surveyor: Mutex::default(), scene })
    }

    /// Equatorial radius in metres and flattening of the scene's body.
    #[getter]
    fn body(&self) -> (f64, f64) {
        let Ellipsoid { a_m, f } = self.scene.body;
        (a_m, f)
    }

    /// The scene as a scene file's text.
    #[getter]
    fn scene_text(&self) -> PyResult<String> {
        config::write(&self.scene).map_err(|fault| failed(&fault))
    }

    /// Runs one frame at `time_s` seconds for a list of views, the most important first. With
    /// `hold_lod` the mesh stays as it is.
    #[pyo3(signature = (time_s, views, *, hold_lod=false))]
    fn frame(
        &self,
        py: Python<'_>,
        time_s: f64,
        views: Vec<PyRef<'_, View>>,
        hold_lod: bool,
    ) -> PyResult<FrameResult> {
        let body = &self.scene.body;
        let views: Vec<_> = views.iter().map(|view| view.seen_from(view.at(), body)).collect();
        let made = self.with(py, |running| {
            let Running { overfly, input, output, .. } = running;
            (input.time_s, input.hold_lod) = (time_s, hold_lod);
            input.views.clone_from(&views);
            overfly.frame(input, output).map_err(|error| match error {
                FrameError::View(fault) => refused(fault.to_string()),
                error => failed(&error),
            })?;
            Ok((output.frame, output.counts, output.digest))
        });
        let (frame, counts, digest) = made?;
        let columns = PyDict::new(py);
        for (name, value) in counts.columns().into_iter().filter(|(name, _)| *name != BOUND) {
            #[expect(clippy::cast_possible_truncation, reason = "counts are u32")]
            columns.set_item(name, value as i64)?;
        }
        Ok(FrameResult {
            frame,
            counts: columns.unbind(),
            bound_px: counts.error_px_bound,
            digest: format!("{:016x}", digest.all()),
        })
    }

    /// Heights of the ground that is there now, at latitudes and longitudes in degrees: numbers or
    /// arrays of one shape. Waits for nothing.
    ///
    /// `query` is "best" (the finest page there: it changes as pages come and go), "exact:N" (that
    /// of lattice level N, a pure function of scene and place: what physics needs, see `request`),
    /// or "within:M" (the coarsest that is known to be within M metres of everything finer).
    ///
    /// >>> import overfly
    /// >>> terrain = overfly.Terrain("small")
    /// >>> nothing = terrain.heights([0.0, 1.0], [0.0, 1.0])
    /// >>> nothing.height_m.tolist(), nothing.status.tolist() == [overfly.Status.NOT_READY] * 2
    /// ([nan, nan], True)
    #[pyo3(signature = (lat_deg, lon_deg, query="best"))]
    fn heights(
        &self,
        py: Python<'_>,
        lat_deg: Numbers<'_>,
        lon_deg: Numbers<'_>,
        query: &str,
    ) -> PyResult<Heights> {
        let query = query_of(query)?;
        let (places, shape) = places(&lat_deg, &lon_deg)?;
        let ground = self.snapshot(py)?;
        let mut answers = vec![Answer::NotReady; places.len()];
        py.detach(|| ground.heights(&places, query, &mut answers));
        Heights::of(py, &answers, &shape)
    }

    /// Heights as `heights` gives them, but exact everywhere: what a question needs is loaded or
    /// made before it is answered, and an archive that cannot be read raises. "best" is the level
    /// of the finest data here, or where there is none the procedural planet's at about 1 m.
    ///
    /// >>> import overfly
    /// >>> terrain = overfly.Terrain("earth")
    /// >>> found = terrain.exact_heights([46.85, 46.86], [-121.76, -121.76], "exact:30")
    /// >>> found.height_m.shape, found.status.tolist() == [overfly.Status.OK] * 2
    /// ((2,), True)
    #[pyo3(signature = (lat_deg, lon_deg, query="best"))]
    fn exact_heights(
        &self,
        py: Python<'_>,
        lat_deg: Numbers<'_>,
        lon_deg: Numbers<'_>,
        query: &str,
    ) -> PyResult<Heights> {
        let query = query_of(query)?;
        let (places, shape) = places(&lat_deg, &lon_deg)?;
        let answers = py.detach(|| self.survey(&places, query))?;
        Heights::of(py, &answers, &shape)
    }

    /// The ground below body-fixed points (x, y and z in metres along the last axis), from what is
    /// there now: height above it, contact, normal. `ecef_from_geodetic` makes such points.
    #[pyo3(signature = (ecef_m, query="best"))]
    fn agl(&self, py: Python<'_>, ecef_m: Numbers<'_>, query: &str) -> PyResult<Contacts> {
        let query = query_of(query)?;
        let (points, shape) = points("ecef_m", &ecef_m)?;
        let ground = self.snapshot(py)?;
        let agl = |&point| ground.agl(Ecef(point), query);
        let answers: Vec<_> = py.detach(|| points.iter().map(agl).collect());
        Contacts::of(py, &answers, &shape)
    }

    /// The first place where a ray meets the ground that is there now, from a body-fixed point into
    /// a body-fixed direction of any length.
    #[pyo3(signature = (origin_m, direction, max_m=f64::INFINITY, query="best"),
           text_signature = "($self, origin_m, direction, max_m=inf, query='best')")]
    fn ray(
        &self,
        py: Python<'_>,
        origin_m: Numbers<'_>,
        direction: Numbers<'_>,
        max_m: f64,
        query: &str,
    ) -> PyResult<Ray> {
        let query = query_of(query)?;
        let (origin, ray) = (point("origin_m", &origin_m)?, point("direction", &direction)?);
        checked(("max_m", [0.0, f64::INFINITY]), max_m)?;
        if ray.length() == 0.0 {
            return Err(refused("direction is [0, 0, 0], allowed is any other"));
        }
        let ground = self.snapshot(py)?;
        Ok(Ray::of(py.detach(|| ground.ray(Ecef(origin), ray, max_m, query))))
    }

    /// Has the pages loaded that heights of `level` need within `radius_m` of a place. They come in
    /// the background and stay until `release`, whatever the camera does. Returns a ticket.
    fn request(
        &self,
        py: Python<'_>,
        lat_deg: f64,
        lon_deg: f64,
        radius_m: f64,
        level: u8,
    ) -> PyResult<u64> {
        let region = region(lat_deg, lon_deg, radius_m)?;
        self.with(py, |running| {
            let ticket = running.overfly.request(region, level).map_err(|error| failed(&error))?;
            running.given += 1;
            running.tickets.insert(running.given, ticket);
            Ok(running.given)
        })
    }

    /// Gives a requested region back.
    fn release(&self, py: Python<'_>, ticket: u64) -> PyResult<()> {
        self.with(py, |running| {
            let known = running.tickets.remove(&ticket);
            let known = known.ok_or_else(|| refused(format!("there is no ticket {ticket}")))?;
            running.overfly.release(known);
            Ok(())
        })
    }

    /// How much of what heights of `level` need within `radius_m` of a place is there.
    fn readiness(
        &self,
        py: Python<'_>,
        lat_deg: f64,
        lon_deg: f64,
        radius_m: f64,
        level: u8,
    ) -> PyResult<Readiness> {
        self.ready(py, region(lat_deg, lon_deg, radius_m)?, level)
    }

    /// Waits until all that was asked for with `request` is there; TimeoutError if that takes
    /// longer than `timeout_s`.
    ///
    /// >>> import overfly
    /// >>> terrain = overfly.Terrain("small")
    /// >>> ticket = terrain.request(10.0, 20.0, 50.0, 20)
    /// >>> terrain.wait_ready(10.0, 20.0, 50.0, 20)
    /// >>> int(terrain.heights(10.0, 20.0, "exact:20").status) == overfly.Status.OK
    /// True
    /// >>> terrain.release(ticket)
    #[pyo3(signature = (lat_deg, lon_deg, radius_m, level, timeout_s=60.0))]
    fn wait_ready(
        &self,
        py: Python<'_>,
        lat_deg: f64,
        lon_deg: f64,
        radius_m: f64,
        level: u8,
        timeout_s: f64,
    ) -> PyResult<()> {
        let region = region(lat_deg, lon_deg, radius_m)?;
        checked(("timeout_s", [0.0, 1e9]), timeout_s)?;
        let begin_ns = now_ns();
        loop {
            let Readiness { missing, .. } = self.ready(py, region, level)?;
            if missing == 0 {
                return Ok(());
            }
            if (now_ns() - begin_ns) as f64 / 1e9 >= timeout_s {
                let what = format!("{missing} pages are not there after {timeout_s} s");
                return Err(PyTimeoutError::new_err(what));
            }
            py.detach(|| std::thread::sleep(LOOK));
            py.check_signals()?;
        }
    }

    /// Records every frame from now on into an `.ovf` file, which `finish_recording` completes; to
    /// be asked for before the first frame. `name` and `rate_hz` are what a replay shows.
    #[pyo3(signature = (path, *, name="python", rate_hz=60.0))]
    fn record(&self, py: Python<'_>, path: PathBuf, name: &str, rate_hz: f64) -> PyResult<()> {
        checked(("rate_hz", [1e-3, 1e6]), rate_hz)?;
        self.with(py, |running| {
            running.overfly.record(&path, name, rate_hz).map_err(|error| failed(&error))
        })
    }

    /// Completes the recording; how many frames it has.
    fn finish_recording(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |running| running.overfly.finish_recording().map_err(|error| failed(&error)))
    }

    /// Ends the scene: its threads and its memory are given back. Twice does no harm.
    fn close(&self, py: Python<'_>) {
        py.detach(|| {
            let surveyor = self.surveyor.lock().take();
            let running = self.running.lock().take();
            drop((surveyor, running));
        });
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, py: Python<'_>, _raised: &Bound<'_, pyo3::types::PyTuple>) {
        self.close(py);
    }
}

/// The one of the counts that is none.
pub const BOUND: &str = "error_px_bound";

/// What a frame ended in.
#[pyclass(frozen, get_all, module = "overfly")]
pub struct FrameResult {
    /// Frames run before this one.
    pub frame: u64,
    /// Counts of the work done and of what there is, by name.
    pub counts: Py<PyDict>,
    /// Bound on the error on the screen in pixels.
    pub bound_px: f64,
    /// The state: equal inputs end in equal digests, on any machine and with any workers.
    pub digest: String,
}

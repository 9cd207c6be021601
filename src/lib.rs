//! The terrain backend of a flight simulator: a whole planet, a known error, a frame rate that
//! holds.
//!
//! In:    a scene, a pose each frame, pages from a loader; places and regions.
//! Out:   draws, finished pictures, counts and a digest of each frame; heights of the ground.
//! Keeps: [`Overfly`]: terrain, workers, graph, renderer, open archives, requested ground, recording.
//! Not here: the stages (`overfly_core`), Vulkan (`overfly_render_vk`), files (`overfly_replay`).
#![forbid(unsafe_code)]

pub use overfly_archive as archive;
pub use overfly_config as config;
pub use overfly_core as core;
pub use overfly_jobs as jobs;
pub use overfly_replay as replay;

pub mod columns;
#[cfg(feature = "vulkan")]
mod drawing;
#[cfg(not(feature = "vulkan"))]
#[path = "undrawn.rs"]
mod drawing;
pub mod error;
pub mod host;
/// Archives from rasters.
#[cfg(feature = "ingest")]
pub mod ingest {
    pub use overfly_ingest::*;
}
pub mod loader;
mod pages;
mod record;
/// Our renderer.
#[cfg(feature = "vulkan")]
pub mod render_vk {
    pub use overfly_render_vk::*;
}
mod requests;
mod resident;
pub mod sources;
pub mod surveyor;

pub use columns::{ColumnsFault, DrawColumns, VertexColumns};
pub use drawing::*;
pub use error::{ChangeError, FlightError, FrameError, OpenError};
pub use host::{Host, HostThreads, Pages, Workers};
pub use record::RecordError;
pub use requests::{RequestError, Ticket};

/// The README's program is compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

use crate::archive::OpenOptions;
use crate::core::datasource::{Page, PageKey};
use crate::core::frame::{FrameInput, FrameOutput, Terrain, add_stages};
use crate::core::geodesy::Geodetic;
use crate::core::ground::{Ground, Query, Readiness, Region, RegionFault};
use crate::core::scene::world_of;
use crate::core::settings::SceneSettings;
use crate::jobs::{Graph, Spans};
use crate::replay::Flight;
use drawing::Drawing;
use loader::Loader;
use pages::Loading;
use parking_lot::Mutex;
use record::Recorder;
use requests::Requests;
use resident::ResidentGround;
use sources::{SourceError, Sources};
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;
use surveyor::Surveyor;

/// Pages that a surveyor for a flight keeps: 32 MiB.
const FLIGHT_PAGES: usize = 512;

/// What the stages of one graph share.
struct House {
    terrain: Terrain,
    drawing: Mutex<Drawing>,
}

/// A scene with everything that it needs to run.
pub struct Overfly {
    house: House,
    graph: Graph<House>,
    /// Its last stage where there is no renderer.
    workers: Arc<jobs::Workers>,
    sources: Arc<Sources>,
    ground: ResidentGround,
    requests: Requests,
    world: hecs::World,
    scene: SceneSettings,
    patience: OpenOptions,
    loading: Loading,
    recorder: Option<Recorder>,
    frames: u64,
}

impl Overfly {
    /// A scene with what its host brings; a number is so many own workers. Opens the scene's
    /// archives: blocks where one is on a server.
    ///
    /// # Errors
    /// The system refuses a thread, there are above 64 workers, or an archive cannot be used.
    pub fn new(settings: &SceneSettings, host: impl Into<Host>) -> Result<Self, OpenError> {
        let Host { workers, pages, patience } = host.into();
        let sources = Arc::new(Sources::open(settings, &patience).map_err(OpenError::Source)?);
        let loading = Loading::new(pages, &sources).map_err(OpenError::Loader)?;
        let terrain = Terrain::new(settings, sources.generator());
        let mut graph = Graph::new();
        let placed = add_stages(&mut graph, |house: &House| &house.terrain);
        let pages_max = terrain.limits().pages;
        Ok(Self {
            house: House { terrain, drawing: Mutex::new(Drawing::after(placed)) },
            graph,
            workers: Arc::new(workers.start().map_err(OpenError::Workers)?),
            ground: ResidentGround::new(settings.body, settings.sea),
            requests: Requests::new(sources.clone(), pages_max),
            sources,
            world: world_of(settings),
            scene: settings.clone(),
            patience,
            loading,
            recorder: None,
            frames: 0,
        })
    }

    /// Runs one frame. Pages are taken out of `input.arrived`.
    ///
    /// # Errors
    /// A view that cannot be used, or a bug.
    pub fn frame(
        &mut self,
        input: &mut FrameInput,
        output: &mut FrameOutput,
    ) -> Result<(), FrameError> {
        self.house.terrain.check(input).map_err(FrameError::View)?;
        if let Some(scene) = input.scene.take() {
            self.change(&scene, &mut input.arrived).map_err(FrameError::Scene)?;
        }
        self.loading.collect(&mut input.arrived);
        if let Some(recorder) = &mut self.recorder {
            recorder.note(input);
        }
        self.ground.note(input.arrived.iter().map(|page| page.key));
        let time_s = input.time_s;
        self.house.terrain.begin(input).map_err(FrameError::View)?;
        self.house.drawing.get_mut().note_scene(&self.world, time_s);
        let ran = self.graph.run(&self.house, &self.workers);
        self.house.terrain.finish(output);
        self.frames += 1;
        self.ground.note(output.evicted.iter().map(|page| page.key));
        self.requests.collect(|key| self.ground.note(std::iter::once(key)));
        self.loading.request(&output.wanted);
        ran.map_err(FrameError::Stage)?;
        if let Some(recorder) = &mut self.recorder {
            recorder.write(output.digest).map_err(FrameError::Record)?;
        }
        Ok(())
    }

    /// Goes over to another scene. Where more than the sun is another the terrain begins anew, tickets
    /// are void, and pages that arrive with the change are not taken.
    fn change(
        &mut self,
        scene: &SceneSettings,
        arrived: &mut Vec<Arc<Page>>,
    ) -> Result<(), ChangeError> {
        let now = &self.scene;
        if now == scene {
            return Ok(());
        }
        let fixed = [
            ("body", now.body == scene.body),
            ("lod", now.lod == scene.lod),
            ("depth", now.depth == scene.depth),
            ("memory", now.memory == scene.memory),
            ("vertices", now.vertices == scene.vertices),
            ("imagery", now.imagery == scene.imagery),
        ];
        if let Some((setting, _)) = fixed.iter().find(|(_, same)| !same) {
            return Err(ChangeError::Fixed { setting });
        }
        let is_other_ground = now.sources != scene.sources || now.sea != scene.sea;
        let sources = is_other_ground.then(|| Sources::open(scene, &self.patience));
        let sources = sources.transpose().map_err(ChangeError::Source)?.map(Arc::new);
        if let Some(sources) = &sources {
            self.loading.follow(sources).map_err(ChangeError::Loader)?;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.note_scene(scene).map_err(ChangeError::Record)?;
        }
        if let Some(sources) = sources {
            self.requests.begin_anew(sources.clone());
            self.sources.close();
            self.sources = sources;
            self.house.terrain = Terrain::new(scene, self.sources.generator());
            self.ground = ResidentGround::new(scene.body, scene.sea);
            arrived.clear();
            let House { terrain, drawing } = &mut self.house;
            drawing.get_mut().begin_anew(terrain);
        }
        self.world = world_of(scene);
        self.scene = scene.clone();
        Ok(())
    }

    /// Records every frame from now on into a file that [`Self::finish_recording`] completes. To be
    /// asked for before the first frame; `name` and `rate_hz` are what a replay shows.
    ///
    /// # Errors
    /// Frames were run already, the file system refuses, or the scene has no text.
    pub fn record(&mut self, path: &Path, name: &str, rate_hz: f64) -> Result<(), RecordError> {
        if self.frames > 0 {
            return Err(RecordError::Late { frames: self.frames });
        }
        let contents = self.sources.contents();
        let scene = (&self.scene, contents.as_slice());
        self.recorder = Some(Recorder::create(path, (name, rate_hz), scene)?);
        Ok(())
    }

    /// Completes the recording; how many frames it has. Without this it reads to its last frame.
    ///
    /// # Errors
    /// There is none, or the file system refuses.
    pub fn finish_recording(&mut self) -> Result<u64, RecordError> {
        self.recorder.take().ok_or(RecordError::None)?.finish()
    }

    /// The workers, for threads of the host to help: see [`HostThreads::Lent`].
    pub fn crew(&self) -> Arc<jobs::Workers> {
        self.workers.clone()
    }

    /// The terrain: settings, limits, audits.
    pub fn terrain(&self) -> &Terrain {
        &self.house.terrain
    }

    /// The scene as it is now.
    pub fn scene(&self) -> &SceneSettings {
        &self.scene
    }

    /// The optional parts of the scene; change them between frames. What is changed here is not
    /// recorded: see `FrameInput::scene`.
    pub fn world_mut(&mut self) -> &mut hecs::World {
        &mut self.world
    }

    /// Times of the last frame's stages.
    pub fn spans(&self) -> &Spans {
        self.graph.spans()
    }

    /// Where this scene's pages come from: its archives and the generator.
    pub fn sources(&self) -> &Arc<Sources> {
        &self.sources
    }

    /// A loader with `threads` threads for this scene's pages.
    ///
    /// # Errors
    /// If the system refuses a thread.
    pub fn loader(&self, threads: usize) -> std::io::Result<Loader> {
        Loader::new(self.sources.clone(), threads)
    }

    /// The ground of all pages that are resident now: the LOD's, and those of requested regions.
    /// A snapshot that never changes, for any thread.
    ///
    /// Costs some 20 µs for each page that came since the last call, the first call for all of
    /// them; a scene of which nobody asks it pays nothing.
    pub fn ground(&mut self) -> Ground {
        self.follow().clone()
    }

    fn follow(&mut self) -> &Ground {
        self.requests.collect(|key| self.ground.note(std::iter::once(key)));
        self.ground.follow(&self.house.terrain.pages(), &self.requests)
    }

    /// Has the pages loaded that heights of `level` need anywhere in a region, as before a jump;
    /// they are part of [`Self::ground`] as they come, in later frames, and stay until
    /// [`Self::release`]. All requests together hold at most as many pages as the LOD may.
    ///
    /// # Errors
    /// The region is none, or it is too large.
    pub fn request(&mut self, region: Region, level: u8) -> Result<Ticket, RequestError> {
        let pages_max = self.requests.pages_max();
        let pages = self.follow().pages_of(region, level, pages_max);
        let pages = pages.map_err(RequestError::Region)?;
        let resident = self.house.terrain.pages();
        self.requests.add(pages, |key| resident::resident(&resident, key))
    }

    /// Gives a requested region back: its pages stay only where the LOD or another ticket has them.
    pub fn release(&mut self, ticket: Ticket) {
        let gone = |key: PageKey| self.ground.note(std::iter::once(key));
        self.requests.release(&ticket, gone);
    }

    /// How much of what heights of `level` need in a region is part of [`Self::ground`].
    ///
    /// # Errors
    /// The region is none, or needs more than a million pages.
    pub fn readiness(&mut self, region: Region, level: u8) -> Result<Readiness, RegionFault> {
        self.follow().readiness(region, level)
    }

    /// Pages, of requested regions and of a loader of ours, that could not be loaded when they were
    /// last asked for.
    pub fn faults(&self) -> impl Iterator<Item = (PageKey, &SourceError)> {
        self.requests.faults().chain(self.loading.faults())
    }

    /// Answers for tools, which wait until the pages that they need are loaded.
    pub fn surveyor(&self, pages_max: usize) -> Surveyor {
        Surveyor::new(self.sources.clone(), pages_max)
    }

    /// Exact height of the ground above the ellipsoid at a place, in metres, beneath water too: a
    /// pure function of the scene and the place, whatever is loaded. Where an archive has data it
    /// is that with its detail, else the procedural planet itself.
    ///
    /// # Errors
    /// The archive has data there, and it cannot be read.
    pub fn ground_height_m(&self, at: Geodetic) -> Result<f64, SourceError> {
        ground_height_m(&self.sources, at)
    }

    /// A bundled flight over this scene's body and ground: `rainier`, `descent` or `poles`. Where
    /// data cannot be read it keeps above the coarser ground that can.
    ///
    /// # Errors
    /// There is no flight of that name, or there is no ground beneath it at all.
    pub fn flight(&self, name: &str) -> Result<Flight, FlightError> {
        let body = &self.house.terrain.settings().body;
        let surveyor = Surveyor::beneath_water(self.sources.clone(), FLIGHT_PAGES);
        let (surveyor, failed) = (RefCell::new(surveyor), RefCell::new(None));
        let height_m = |at| {
            let mut surveyor = surveyor.borrow_mut();
            let error = match ground_height_m(&self.sources, at) {
                Ok(height_m) => return height_m,
                Err(error) => error,
            };
            let coarser = surveyor.coarser(at, Query::BestResident).found();
            coarser.map_or_else(
                || {
                    failed.borrow_mut().get_or_insert(error);
                    0.0
                },
                |ground| ground.height_m,
            )
        };
        let flight = crate::replay::flight(name, body, &height_m);
        match (failed.into_inner(), flight) {
            (Some(error), _) => Err(FlightError::Ground(error)),
            (None, flight) => flight.ok_or_else(|| FlightError::Unknown(name.to_owned())),
        }
    }

    /// Leaves archives on servers alone from now on: loaders that wait for a silent one give up.
    /// For a host that wants to end; dropping it does the same.
    pub fn close(&self) {
        self.sources.close();
    }
}

impl Drop for Overfly {
    fn drop(&mut self) {
        self.close();
    }
}

fn ground_height_m(sources: &Sources, at: Geodetic) -> Result<f64, SourceError> {
    let place = crate::core::ground::Place::of(at.normal());
    if sources.data_level(place)?.is_some() {
        return sources.ground_m(at);
    }
    let planet = sources.generator().planet();
    Ok(planet.map_or(0.0, |planet| planet.sample(at.normal()).height_m))
}

//! Terrains as C holds them: making, destroying, and threads of the host that help.
//!
//! In:    a scene, what the host brings; handles.
//! Out:   handles; help for frames; pages that threads of the host made.
//! Keeps: the table of all terrains of the process.
//! Not here: frames (`frame`), what comes out of them (`columns`), the ground (`ground`).

use crate::border::{Caller, answer};
use crate::host::{brought, ovf_host};
use crate::news::News;
use crate::scene::{ovf_scene, settings};
use crate::status::{Fault, OVF_BUSY, OVF_PAGE, OVF_PANIC, OVF_STALE, ovf_status};
use crate::table::Table;
use crate::tasks::Tasks;
use overfly::core::datasource::{Page, PageKey};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::mesh::topology;
use overfly::jobs;
use overfly::sources::Sources;
use overfly::{Overfly, Ticket};
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

/// Most terrains that are open at once.
const TERRAINS_MAX: usize = 256;

static TERRAINS: Table<Place, TERRAINS_MAX> = Table::new(1, "terrain");

/// A terrain: a scene that runs. A number and no pointer: it may be copied, and one that was
/// destroyed, or never was, is refused. All zeros name none.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ovf_terrain {
    /// Not for the host.
    pub bits: u64,
}

/// A terrain, and what threads may reach while a frame runs.
struct Place {
    /// Empty once it was destroyed.
    state: Mutex<Option<Box<State>>>,
    crew: Arc<jobs::Workers>,
    tasks: Arc<Tasks>,
    supply: Mutex<Supply>,
}

/// Pages that threads of the host make.
struct Supply {
    sources: Arc<Sources>,
    /// Made since the last frame.
    made: Vec<Arc<Page>>,
}

/// A terrain, for the one call that has it.
pub struct State {
    /// The scene that runs.
    pub overfly: Overfly,
    /// Reused from frame to frame.
    pub input: FrameInput,
    /// What the last frame ended in.
    pub output: FrameOutput,
    /// The index pattern of its patches.
    pub indices: Vec<u32>,
    /// Held regions by number.
    pub tickets: BTreeMap<u64, Ticket>,
    /// Numbers given to regions so far.
    pub ticket_serial: u64,
    /// Time of the last frame.
    pub time_s: f64,
    /// What renderers of this terrain were not told yet.
    pub news: Vec<Weak<News>>,
    /// A call was left by a panic, or a stage was: nobody knows what holds.
    broken: bool,
}

impl State {
    /// Keeps what the last frame made new for each renderer, until it records.
    pub fn note_news(&mut self) {
        let output = &self.output;
        self.news.retain(|news| {
            let news = news.upgrade();
            news.inspect(|news| news.note(&output.built, &output.tiles)).is_some()
        });
    }
}

impl Place {
    fn new(overfly: Overfly, tasks: Arc<Tasks>) -> Self {
        let supply = Supply { sources: overfly.sources().clone(), made: Vec::new() };
        let patch_depth = overfly.scene().lod.patch_depth;
        let crew = overfly.crew();
        let state = State {
            overfly,
            input: FrameInput::default(),
            output: FrameOutput::default(),
            indices: topology::indices(patch_depth),
            tickets: BTreeMap::new(),
            ticket_serial: 0,
            time_s: 0.0,
            news: Vec::new(),
            broken: false,
        };
        Self { state: Mutex::new(Some(Box::new(state))), crew, tasks, supply: Mutex::new(supply) }
    }
}

/// Runs `act` on a terrain, which nobody else has meanwhile.
pub fn with<T>(
    terrain: ovf_terrain,
    act: impl FnOnce(&mut State) -> Result<T, Fault>,
) -> Result<T, Fault> {
    let place = TERRAINS.hold(terrain.bits)?;
    let mut state = place.state.try_lock().ok_or_else(busy)?;
    let state = state.as_mut().ok_or_else(gone)?;
    if state.broken {
        let sentence = "the terrain is of no use since a bug of overfly's: destroy it";
        return Err(Fault::new(OVF_PANIC, sentence));
    }
    state.broken = true;
    let outcome = act(state);
    state.broken = outcome.as_ref().is_err_and(|fault| fault.status == OVF_PANIC);
    outcome
}

/// Runs `act` on a terrain with the pages that the host's threads made for it, as a frame does.
pub fn with_made<T>(
    terrain: ovf_terrain,
    act: impl FnOnce(&mut State) -> Result<T, Fault>,
) -> Result<T, Fault> {
    let place = TERRAINS.hold(terrain.bits)?;
    with(terrain, |state| {
        state.input.arrived.append(&mut place.supply.lock().made);
        let outcome = act(state);
        let sources = state.overfly.sources();
        let mut supply = place.supply.lock();
        if !Arc::ptr_eq(&supply.sources, sources) {
            // What is made of other sources does not belong here, and regions were held of them.
            *supply = Supply { sources: sources.clone(), made: Vec::new() };
            state.tickets.clear();
            let tiles = state.overfly.terrain().tiles();
            state.news.iter().filter_map(Weak::upgrade).for_each(|news| news.note(&[], &tiles));
        }
        outcome
    })
}

fn busy() -> Fault {
    Fault::new(OVF_BUSY, "the terrain is in another call: one at a time")
}

fn gone() -> Fault {
    Fault::new(OVF_STALE, "the terrain was destroyed a moment ago")
}

/// Opens a scene. `host` may be null. Blocks where an archive is on a server.
///
/// The 1 in its name is the version of this border: a library with another one lacks the symbol,
/// and the program does not start instead of going wrong.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_new_v1(
    scene: *const ovf_scene,
    host: *const ovf_host,
    terrain: *mut ovf_terrain,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("terrain", terrain)?;
        let settings = settings(caller, scene)?;
        let (host, tasks) = brought(caller, host)?;
        let bits = TERRAINS.insert(Place::new(Overfly::new(&settings, host)?, tasks))?;
        caller.put_plain("terrain", terrain, ovf_terrain { bits })
    })
}

/// Ends a terrain: its threads end, a recording is left as it is, snapshots of its ground stay. Waits
/// for reads that are under way. No function of the host is called after it returns, but `read` by a
/// thread of the host that is in `ovf_terrain_load_page`.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_terrain_destroy(terrain: ovf_terrain) -> ovf_status {
    answer!(|_: &Caller| {
        let place = TERRAINS.hold(terrain.bits)?;
        let state = place.state.try_lock().ok_or_else(busy)?.take().ok_or_else(gone)?;
        TERRAINS.remove(terrain.bits)?;
        drop(state);
        Ok(())
    })
}

/// Lends the calling thread to the frame that runs now, until it ends. For any thread;
/// `*helped` is 1 where it had work, 0 at once where there is no frame, or no seat: then the host
/// does something else first.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_terrain_work(terrain: ovf_terrain, helped: *mut u32) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("helped", helped)?;
        let place = TERRAINS.hold(terrain.bits)?;
        caller.put_plain("helped", helped, u32::from(place.crew.join_as_worker()))
    })
}

/// Runs a task that `spawn` was given. For any thread. Does nothing where the task was run already
/// or its frame is over.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_terrain_run_task(terrain: ovf_terrain, task: u64) -> ovf_status {
    answer!(|_: &Caller| {
        let place = TERRAINS.hold(terrain.bits)?;
        if let Some(task) = place.tasks.take(task) {
            task.run();
        }
        Ok(())
    })
}

/// Makes a page on the calling thread, for the next frame. For any thread, several at once, also
/// while a frame runs; blocks while archives are read. For `OVF_PAGES_HOST`; `key` is one that
/// `ovf_terrain_wanted` gave. Some 2 ms of work where nothing has to be waited for.
///
/// A page that fails may be tried again; until then the ground there stays coarser.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_terrain_load_page(terrain: ovf_terrain, key: u64) -> ovf_status {
    answer!(|_: &Caller| {
        let place = TERRAINS.hold(terrain.bits)?;
        let Some(key) = PageKey::from_bits(key) else {
            return Err(Fault::invalid(format!("key is {key:#x}, which names no page")));
        };
        let sources = place.supply.lock().sources.clone();
        let made = sources.coloured_page(key).map_err(|error| Fault::of(OVF_PAGE, &error))?;
        let mut supply = place.supply.lock();
        if Arc::ptr_eq(&supply.sources, &sources) {
            supply.made.push(made.0);
        }
        Ok(())
    })
}

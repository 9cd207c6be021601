//! The frames of `serve`: listen, run the terrain, answer, wait.
//!
//! In:    a [`Plan`]; datagrams.
//! Out:   messages to the host, a recording, counts.
//! Keeps: the terrain and its loader, the ground of the last frame, the protocol's state.
//! Not here: arguments and the table (`serve`), the protocol (`overfly_link`).

use super::places::Places;
use super::sockets::{Link, Sockets};
use crate::cli::Failure;
use overfly::Overfly;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::ground::Ground;
use overfly::core::settings::SceneSettings;
use overfly::ingest::geoid::Geoid;
use overfly::jobs::now_ns;
use overfly::loader::Loader;
use overfly::replay::{Header, RecordedFrame, Writer};
use overfly::sources::Sources;
use overfly_link::cigi::{FrameFacts, Mode, Question, Server, Setup, World, ask};
use overfly_link::fgfs;
use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What a session is made of.
pub struct Plan {
    pub setup: Setup,
    pub scene: SceneSettings,
    /// Its text, for the recording.
    pub scene_text: String,
    pub workers: usize,
    pub sockets: Sockets,
    pub rate_hz: f64,
    pub size_px: [u32; 2],
    pub record: Option<PathBuf>,
}

/// What altitudes count from.
pub enum SeaLevel {
    Ellipsoid,
    Geoid(Box<Geoid>),
}

impl SeaLevel {
    fn height_m(&self, lat_rad: f64, lon_rad: f64) -> f64 {
        match self {
            Self::Ellipsoid => 0.0,
            Self::Geoid(geoid) => geoid.undulation_m(lat_rad, lon_rad),
        }
    }
}

/// FlightGear's packets.
#[derive(Default)]
struct NativeFdmCounts {
    taken: u64,
    dropped: u64,
    /// Why the last was dropped.
    fault: Option<fgfs::NativeFdmFault>,
}

/// A session under way.
pub struct Session {
    overfly: Overfly,
    loader: Loader,
    sockets: Sockets,
    server: Server,
    input: FrameInput,
    output: FrameOutput,
    ground: Ground,
    level: u8,
    sea_level: SeaLevel,
    places: Places,
    recorder: Option<Writer>,
    message: Vec<u8>,
    size_px: [u32; 2],
    period_ns: u64,
    begin_ns: u64,
    native_fdm: NativeFdmCounts,
    late: u64,
    /// Archives of which it was said that they fail.
    named: BTreeSet<String>,
}

/// The terrain of a scene, with its own threads.
fn open_terrain(scene: &SceneSettings, workers: usize) -> Result<(Overfly, Loader), Failure> {
    let overfly = Overfly::new(scene, workers)?;
    let loader = overfly.loader(workers.max(1))?;
    Ok((overfly, loader))
}

/// Lends the ground of a level to the protocol, and hears what is asked of it.
fn with_world(
    (ground, level): (&Ground, u8),
    sea_level: &SeaLevel,
    places: &Places,
    run: impl FnOnce(&World<'_>),
) {
    let ask = |question: &Question| {
        let reply = ask(ground, level, question).reply;
        places.note(question, &reply);
        reply
    };
    let sea_level_m = |lat_rad: f64, lon_rad: f64| sea_level.height_m(lat_rad, lon_rad);
    run(&World { body: *ground.body(), sea_level_m: &sea_level_m, ask: &ask });
}

impl Session {
    /// Opens the scene and the recording.
    pub fn open(plan: Plan) -> Result<Self, Failure> {
        let (mut overfly, loader) = open_terrain(&plan.scene, plan.workers)?;
        let recorder = plan.record.as_ref().map(|path| {
            let mut header = Header::recording("serve", plan.rate_hz, &plan.scene)
                .over_contents(&overfly.sources().contents());
            header.scene_text = plan.scene_text;
            Writer::create(path, &header)
        });
        let body = plan.scene.body;
        Ok(Self {
            recorder: recorder.transpose()?,
            ground: overfly.ground(),
            overfly,
            loader,
            sockets: plan.sockets,
            server: Server::new(plan.setup),
            input: FrameInput::default(),
            output: FrameOutput::default(),
            level: 0,
            sea_level: SeaLevel::Ellipsoid,
            places: Places::new(0, body),
            message: Vec::new(),
            size_px: plan.size_px,
            period_ns: Duration::from_secs_f64(1.0 / plan.rate_hz).as_nanos().try_into()?,
            begin_ns: now_ns(),
            native_fdm: NativeFdmCounts::default(),
            late: 0,
            named: BTreeSet::new(),
        })
    }

    /// Where the scene's ground comes from.
    pub fn sources(&self) -> &Sources {
        self.overfly.sources()
    }

    /// The links, and where they listen.
    pub fn addresses(&self) -> Vec<(&'static str, SocketAddr)> {
        self.sockets.addresses()
    }

    /// Answers are heights of this lattice level, and altitudes count from this sea level.
    pub fn answer_from(&mut self, level: u8, sea_level: SeaLevel) {
        let body = *self.ground.body();
        (self.level, self.sea_level, self.places) = (level, sea_level, Places::new(level, body));
    }

    /// Frame after frame, until asked to stop or so many are done. False where it was asked.
    pub fn run(&mut self, stop: &AtomicBool, frames: Option<u64>) -> Result<bool, Failure> {
        let mut next_ns = now_ns();
        let mut done = 0;
        while frames.is_none_or(|frames| done < frames) {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            self.listen();
            self.frame()?;
            done += 1;
            next_ns += self.period_ns;
            match next_ns.checked_sub(now_ns()) {
                Some(wait_ns) => std::thread::sleep(Duration::from_nanos(wait_ns)),
                None => {
                    self.late += 1;
                    next_ns = now_ns();
                }
            }
        }
        Ok(true)
    }

    fn listen(&mut self) {
        let (server, counts) = (&mut self.server, &mut self.native_fdm);
        self.sockets.receive(|link, datagram| match link {
            Link::Cigi => server.receive(datagram),
            Link::NativeFdm => match fgfs::decode(datagram) {
                Ok(ownship) => {
                    counts.taken += 1;
                    server.drive(&ownship);
                    true
                }
                Err(fault) => {
                    counts.dropped += 1;
                    counts.fault = Some(fault);
                    false
                }
            },
        });
    }

    fn frame(&mut self) -> Result<(), Failure> {
        let time_ns = now_ns() - self.begin_ns;
        self.look();
        self.input.time_s = Duration::from_nanos(time_ns).as_secs_f64();
        self.loader.request(&self.output.wanted, 0);
        self.loader.collect(&mut self.input.arrived);
        self.name_faults();
        let arrived = self.input.arrived.iter().map(|page| page.key).collect();
        let FrameInput { time_s, hold_lod, .. } = self.input;
        let mut record = RecordedFrame { time_s, arrived, hold_lod, ..Default::default() };
        if self.recorder.is_some() {
            record.views.clone_from(&self.input.views);
        }
        self.overfly.frame(&mut self.input, &mut self.output)?;
        if let Some(recorder) = &mut self.recorder {
            record.digest = self.output.digest;
            recorder.frame(&record)?;
        }
        self.ground = self.overfly.ground();
        self.answer(time_ns);
        self.sockets.send(&self.message);
        self.places.follow(&mut self.overfly, now_ns());
        Ok(())
    }

    /// What the views see from, by the ground of the last frame.
    fn look(&mut self) {
        let (server, views, size_px) = (&self.server, &mut self.input.views, self.size_px);
        let asked = (&self.ground, self.level);
        with_world(asked, &self.sea_level, &self.places, |world| {
            server.views(world, size_px, views);
        });
    }

    fn answer(&mut self, time_ns: u64) {
        let counts = &self.output.counts;
        let settled = counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0;
        #[expect(clippy::cast_possible_truncation, reason = "ticks are modulo 2^32")]
        let facts = FrameFacts { ticks: (time_ns / 10_000) as u32, settled };
        let (server, message) = (&mut self.server, &mut self.message);
        let asked = (&self.ground, self.level);
        with_world(asked, &self.sea_level, &self.places, |world| {
            server.frame(world, facts, message);
        });
    }

    /// Says of each archive once that it fails, and how.
    fn name_faults(&mut self) {
        for (_, error) in self.loader.faults().chain(self.overfly.faults()) {
            let archive = error.archive().unwrap_or("the planet").to_owned();
            if self.named.insert(archive) {
                eprintln!("overfly: {error}; the ground is coarser there");
            }
        }
    }

    /// What happened, by name; what never happened is left out.
    pub fn table(&self) -> Vec<(&'static str, u64)> {
        let mut table: Vec<_> = self.server.counters().columns().into();
        let lost = self.sockets.lost;
        table.extend([
            ("frames that took too long", self.late),
            ("native FDM packets", self.native_fdm.taken),
            ("native FDM packets dropped", self.native_fdm.dropped),
            ("datagrams of strangers", lost.strangers),
            ("datagrams not received", lost.unread),
            ("messages not sent", lost.unsent),
            ("places not asked for", self.places.refused),
        ]);
        table.retain(|&(name, count)| count > 0 || name == "frames");
        table
    }

    /// Ends the recording, and says what may need words.
    pub fn close(self) -> Result<(), Failure> {
        if let Some(fault) = self.native_fdm.fault {
            eprintln!("overfly: the last native FDM packet that was dropped: {fault}");
        }
        let in_standby = self.server.counters().standby > 0 && self.server.mode() == Mode::Standby;
        if in_standby {
            eprintln!("overfly: the host left IG Mode at Reset/Standby: its packets do not count");
        }
        self.overfly.close();
        self.recorder.map_or(Ok(()), Writer::finish)?;
        Ok(())
    }
}

//! A session of looking and flying: what keys change, and the state that they change.
//!
//! In:    a [`Plan`], then [`Action`]s.
//! Out:   [`Session`], ready for its next frame.
//! Keeps: the terrain, its loader, the eye, the flight, the recording, what is shown.
//! Not here: running a frame (`turn`), windows (`window`).

use super::fly::{Eye, Motion};
use super::hud::Times;
use super::keys::{Action, Way};
use super::play::Transport;
use super::screenshot::Sidecar;
use super::track::Track;
use crate::cli::Failure;
use glam::DVec3;
use overfly::core::camera::View;
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::trig::{cos, sin};
use overfly::core::ground::Contact;
use overfly::core::scene::Sun;
use overfly::core::settings::{SceneSettings, SunSettings};
use overfly::core::units::Pixels;
use overfly::loader::Loader;
use overfly::render_vk::{DrawError, DrawReport, Renderer, RendererSettings, Show, StartError};
use overfly::replay::{Header, WriteError, Writer};
use overfly::{Overfly, config};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// Frames a second of recordings, as their header says; each frame keeps its own time.
const RECORDED_HZ: f64 = 60.0;
/// How long a notice stays, in seconds.
const NOTICE_S: f64 = 4.0;
/// One notch of the wheel.
const FASTER: f64 = 1.25;
const FACTORS: [f64; 2] = [1.0 / 256.0, 256.0];
/// Tolerances in pixels that keys choose from.
const TOLERANCES_PX: [f64; 12] = [0.125, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 16.0];

/// What a session begins with.
pub struct Plan {
    /// A preset or a scene file, as it was named.
    pub scene_name: String,
    /// Its text, for recordings and sidecars.
    pub scene_text: String,
    /// What that resolves to.
    pub scene: SceneSettings,
    /// Threads beside the main one.
    pub workers: usize,
    /// A bundled flight or an `.ovf` file, if one is to be followed.
    pub flight: Option<String>,
    /// Where to begin instead of a place in the sun.
    pub eye: Option<Eye>,
    /// Where frames are recorded to.
    pub record: Option<PathBuf>,
    /// Folder for screenshots.
    pub pictures: PathBuf,
    /// What the ground is coloured by at first.
    pub show: Show,
    /// Draws with the validation layer.
    pub validate: bool,
}

/// What is shown and what is not.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Switches {
    pub show: Show,
    pub boxes: bool,
    pub links: bool,
    pub graph: bool,
    pub hud: bool,
    pub help: bool,
    pub frozen: bool,
    /// The next frame becomes a screenshot.
    pub shoots: bool,
}

/// The state of a session.
pub struct Session {
    pub(super) plan: Plan,
    pub(super) overfly: Overfly,
    pub(super) loader: Loader,
    pub(super) input: FrameInput,
    pub(super) output: FrameOutput,
    pub(super) eye: Eye,
    pub(super) track: Option<Track>,
    pub(super) transport: Transport,
    /// The flight is shown, and not the free eye.
    pub(super) follows: bool,
    /// Time since the session began, in seconds: it never stands still, so that vertices that morph
    /// arrive while a flight is paused.
    pub(super) time_s: f64,
    /// When the last frame began, by the clock.
    pub(super) began_ns: Option<u64>,
    pub(super) held: [bool; 6],
    /// Where the mouse went since the last frame: right and up, in pixels.
    pub(super) look_px: [f64; 2],
    pub(super) factor: f64,
    /// Hours by which the sun is later than the scene says.
    later_h: f64,
    pub(super) switches: Switches,
    /// What just happened, and when that is forgotten.
    pub(super) notice: Option<(String, f64)>,
    pub(super) times: Times,
    /// Numbers of the last frame.
    pub(super) lines: Vec<String>,
    /// The ground beneath the eye in the last frame, where it is loaded.
    pub(super) contact: Option<Contact>,
    pub(super) report: DrawReport,
    /// What the last frame showed; empty before the first.
    pub(super) view: Option<View>,
    /// Lines in the scene, in ECEF metres, with their colours.
    pub(super) segments: Vec<([DVec3; 2], [u8; 4])>,
    pub(super) recorder: Option<Writer>,
    /// Archives of which it was said that they fail.
    pub(super) named: BTreeSet<String>,
    /// What validation said of renderers that are gone.
    validation: Vec<String>,
    /// Somebody asked for the end.
    pub quits: bool,
    /// Frames run.
    pub frames: u64,
}

impl Session {
    /// Opens scene, flight and recording; draws nothing until there is a renderer.
    ///
    /// # Errors
    /// One of them cannot be opened.
    pub fn new(plan: Plan) -> Result<Self, Failure> {
        let overfly = Overfly::new(&plan.scene, plan.workers)?;
        let open = |name: &String| Track::open(name, &plan.scene, &overfly);
        let track = plan.flight.as_ref().map(open).transpose()?;
        let transport = track
            .as_ref()
            .map_or(Transport::new(1, 1.0), |track| Transport::new(track.frames, track.rate_hz));
        let recorder = plan.record.as_ref().map(|path| {
            let name = track.as_ref().map_or("view", |track| track.name.as_str());
            let mut header = Header::recording(name, RECORDED_HZ, &plan.scene)
                .over_contents(&overfly.sources().contents());
            header.scene_text.clone_from(&plan.scene_text);
            Writer::create(path, &header)
        });
        let switches = Switches {
            show: plan.show,
            boxes: false,
            links: false,
            graph: false,
            hud: true,
            help: false,
            frozen: false,
            shoots: false,
        };
        Ok(Self {
            eye: plan.eye.unwrap_or_else(|| in_the_sun(&plan.scene)),
            follows: track.is_some() && plan.eye.is_none(),
            loader: overfly.loader(plan.workers.max(1))?,
            recorder: recorder.transpose()?,
            input: FrameInput::default(),
            output: FrameOutput::default(),
            time_s: 0.0,
            began_ns: None,
            held: [false; 6],
            look_px: [0.0; 2],
            factor: 1.0,
            later_h: 0.0,
            notice: Some(("F1: keys".into(), NOTICE_S)),
            times: Times::default(),
            lines: Vec::new(),
            contact: None,
            report: DrawReport::default(),
            view: None,
            segments: Vec::new(),
            named: BTreeSet::new(),
            validation: Vec::new(),
            quits: false,
            frames: 0,
            plan,
            overfly,
            track,
            transport,
            switches,
        })
    }

    /// Says something for a moment.
    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.notice = Some((text.into(), self.time_s + NOTICE_S));
    }

    /// Does what somebody wants. `down` is whether a key went down or up; only flying cares.
    ///
    /// # Errors
    /// The scene cannot be opened again with another tolerance.
    pub fn act(&mut self, action: Action, down: bool) -> Result<(), Failure> {
        if let Action::Fly(way) = action {
            self.held[way as usize] = down;
            return Ok(());
        }
        if !down {
            return Ok(());
        }
        let switches = &mut self.switches;
        match action {
            Action::Fly(_) => {}
            Action::Look([right, up]) => {
                self.look_px = [self.look_px[0] + right, self.look_px[1] + up];
            }
            Action::Speed(notches) => self.faster(notches),
            Action::PlayPause | Action::Step(_) | Action::Seek(_) | Action::Follow => {
                self.play(action);
            }
            Action::Later(hours) => self.later(hours),
            Action::Freeze => switches.frozen = !switches.frozen,
            Action::Show(index) => {
                switches.show = Show::ALL.get(index).copied().unwrap_or_default();
                let name = switches.show.name();
                self.say(name);
            }
            Action::Boxes => switches.boxes = !switches.boxes,
            Action::Links => switches.links = !switches.links,
            Action::Graph => switches.graph = !switches.graph,
            Action::Hud => switches.hud = !switches.hud,
            Action::Help => switches.help = !switches.help,
            Action::Tolerance(coarser) => self.tolerance(coarser > 0)?,
            Action::Screenshot => switches.shoots = true,
            Action::Quit => self.quits = true,
        }
        Ok(())
    }

    /// Lets all keys go: for a window that hears of them no more.
    pub fn let_go(&mut self) {
        self.held = [false; 6];
    }

    /// Where the held keys fly to.
    pub(super) fn motion(&self) -> Motion {
        let axis = |plus: Way, minus: Way| {
            f64::from(i8::from(self.held[plus as usize]) - i8::from(self.held[minus as usize]))
        };
        Motion {
            ahead: axis(Way::Ahead, Way::Back),
            right: axis(Way::Right, Way::Left),
            up: axis(Way::Up, Way::Down),
        }
    }

    fn faster(&mut self, notches: f64) {
        let base = if notches > 0.0 { FASTER } else { 1.0 / FASTER };
        let mut left = notches.abs().min(100.0);
        while left >= 1.0 {
            self.factor *= base;
            left -= 1.0;
        }
        // Touch pads send parts of a notch.
        self.factor *= 1.0 + (base - 1.0) * left;
        self.factor = self.factor.clamp(FACTORS[0], FACTORS[1]);
        self.say(format!("speed x {:.2}", self.factor));
    }

    fn play(&mut self, action: Action) {
        if self.track.is_none() {
            self.say("no flight: name one on the command line");
            return;
        }
        match action {
            // Whoever comes back from elsewhere wants to see it play.
            Action::PlayPause if !self.follows && self.transport.playing() => {}
            Action::PlayPause => self.transport.toggle(),
            Action::Step(frames) => self.transport.step(frames),
            Action::Seek(seek) => self.transport.seek(seek),
            _ => {}
        }
        self.follows = true;
    }

    fn later(&mut self, hours: f64) {
        self.later_h += hours;
        let Some(sun) = self.sun() else {
            self.say("this scene has no sun");
            return;
        };
        self.place_sun(sun);
        self.say(format!("sun {:+.2} h", self.later_h));
    }

    /// The sun as late as somebody wanted it, if there is one.
    pub(super) fn sun(&self) -> Option<SunSettings> {
        self.plan.scene.sun.map(|sun| later(sun, self.later_h))
    }

    fn place_sun(&mut self, settings: SunSettings) {
        for sun in self.overfly.world_mut().query_mut::<&mut Sun>() {
            sun.settings = settings;
        }
    }

    /// Another tolerance is another scene: it is opened anew, and the ground comes up again.
    fn tolerance(&mut self, coarser: bool) -> Result<(), Failure> {
        if self.recorder.is_some() {
            self.say("not while recording: a recording is of one scene");
            return Ok(());
        }
        let now = self.plan.scene.lod.tolerance.0;
        let Some(wanted) = next_tolerance(now, coarser) else { return Ok(()) };
        self.plan.scene.lod.tolerance = Pixels(wanted);
        let messages = self.overfly.with_renderer(|renderer| renderer.validation_messages());
        self.validation.extend(messages.unwrap_or_default());
        self.overfly.close();
        self.overfly = Overfly::new(&self.plan.scene, self.plan.workers)?;
        self.loader = self.overfly.loader(self.plan.workers.max(1))?;
        (self.input, self.output) = (FrameInput::default(), FrameOutput::default());
        self.contact = None;
        if let Some(sun) = self.sun() {
            self.place_sun(sun);
        }
        self.say(format!("tolerance {wanted} px"));
        Ok(())
    }

    /// Whether there is something to draw with.
    pub fn has_renderer(&mut self) -> bool {
        self.overfly.with_renderer(|_| ()).is_some()
    }

    /// Draws on a window from now on.
    ///
    /// # Errors
    /// There is no Vulkan, or none for this window.
    pub fn start_renderer<W>(&mut self, size_px: [u32; 2], window: Arc<W>) -> Result<(), StartError>
    where
        W: HasWindowHandle + HasDisplayHandle + Send + Sync + 'static,
    {
        let limits = self.overfly.terrain().limits();
        let settings = RendererSettings {
            validation: self.plan.validate,
            ..RendererSettings::of(&self.plan.scene, limits, size_px)
        };
        self.overfly.set_renderer(Renderer::for_window(&settings, window)?);
        Ok(())
    }

    /// Pictures have another size from now on.
    ///
    /// # Errors
    /// Vulkan failed.
    pub fn resize(&mut self, size_px: [u32; 2]) -> Result<(), DrawError> {
        self.overfly.with_renderer(|renderer| renderer.resize(size_px)).unwrap_or(Ok(()))
    }

    /// Shows the frame's picture; a window that cannot take it now takes the next.
    ///
    /// # Errors
    /// Vulkan failed.
    pub fn present(&mut self) -> Result<(), DrawError> {
        let shown = self.overfly.with_renderer(|renderer| renderer.present());
        shown.transpose().map(|_| ())
    }

    /// Ends the recording, if there is one: its frames and its file.
    ///
    /// # Errors
    /// The file system refused.
    pub fn finish(&mut self) -> Result<Option<(u64, PathBuf)>, WriteError> {
        self.overfly.close();
        let Some(recorder) = self.recorder.take() else { return Ok(None) };
        let frames = recorder.frames();
        recorder.finish()?;
        Ok(self.plan.record.clone().map(|path| (frames, path)))
    }

    /// What validation said so far.
    pub fn validation_messages(&mut self) -> Vec<String> {
        let mut messages = self.validation.clone();
        let now = self.overfly.with_renderer(|renderer| renderer.validation_messages());
        messages.extend(now.unwrap_or_default());
        messages
    }

    /// Everything that the last frame's picture depends on.
    pub(super) fn sidecar(&self) -> Sidecar {
        let sun = self.sun().map(|sun| sun.direction_at(self.time_s).to_array());
        let place = self.eye.place();
        let degrees = [place.lat_rad.to_degrees(), place.lon_rad.to_degrees(), place.height_m];
        let sidecar = Sidecar {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: self.plan.scene_name.clone(),
            scene_digest: super::screenshot::text_digest(&self.plan.scene_text),
            show: self.switches.show.name().into(),
            size_px: [1, 1],
            tolerance_px: self.plan.scene.lod.tolerance.0,
            time_s: self.time_s,
            sun,
            eye_m: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            field_of_view_rad: 1.0,
            near_m: 1.0,
            place: degrees,
        };
        match &self.view {
            Some(view) => sidecar.with_view(view),
            None => sidecar,
        }
    }
}

/// The next tolerance of the list; `None` at its ends.
fn next_tolerance(now: f64, coarser: bool) -> Option<f64> {
    let mut list = TOLERANCES_PX.into_iter();
    if coarser { list.find(|&px| px > now) } else { list.rfind(|&px| px < now) }
}

/// The sun so many hours later. One that stands still turns about the body's axis.
fn later(sun: SunSettings, hours: f64) -> SunSettings {
    match sun {
        SunSettings::Fixed { direction: d } => {
            let angle_rad = -(hours * 15.0).to_radians();
            let (s, c) = (sin(angle_rad), cos(angle_rad));
            let direction = DVec3::new(c * d.x - s * d.y, s * d.x + c * d.y, d.z);
            SunSettings::Fixed { direction }
        }
        SunSettings::Clock { start_unix_s, runs } => {
            SunSettings::Clock { start_unix_s: start_unix_s + hours * 3600.0, runs }
        }
    }
}

/// An eye over the lit side, as high as a space station, that looks down at the horizon.
fn in_the_sun(scene: &SceneSettings) -> Eye {
    use overfly::core::geodesy::Geodetic;
    use overfly::core::geodesy::trig::atan2;
    use overfly::core::units::Radians;
    let sun = scene.sun.map_or(DVec3::X, |sun| sun.direction_at(0.0));
    let noon_rad = atan2(sun.y, sun.x);
    let height_m = 0.06 * scene.body.a_m;
    // Mid-morning, so that mountains have a dark side.
    let at = Geodetic { lat_rad: 0.5, lon_rad: noon_rad - 0.6, height_m };
    Eye::new(at, Radians::from_degrees(150.0), Radians::from_degrees(-28.0))
}

/// A scene by name: a preset or a file; its text and what it resolves to.
///
/// # Errors
/// It cannot be read, or it has faults.
pub fn scene_of(name: &str) -> Result<(String, SceneSettings), Failure> {
    let scene = config::load(name)?;
    let text = match config::preset(name) {
        Some(text) => text.to_owned(),
        None => std::fs::read_to_string(name)?,
    };
    Ok((text, scene))
}

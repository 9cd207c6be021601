//! One frame of a session: time passes, the eye moves, pages come, a picture is drawn and kept.
//!
//! In:    a [`Session`], how much time passed, the size of the picture.
//! Out:   a picture on the renderer, a recorded frame, perhaps a screenshot.
//! Keeps: nothing of its own.
//! Not here: what keys change (`session`), windows (`window`).

use super::fly::{Eye, speed_m_s};
use super::hud::{self, Panels, Readout};
use super::session::{Session, Switches};
use super::{keys, screenshot};
use crate::cli::Failure;
use overfly::core::camera::View;
use overfly::core::datasource::Page;
use overfly::core::ground::Query;
use overfly::jobs::now_ns;
use overfly::replay::RecordedFrame;

/// Seconds of a frame that took longer: nothing leaps after a pause.
const STEP_MAX_S: f64 = 0.1;
/// A frame is never shorter, so that time never stands still.
const STEP_MIN_S: f64 = 1e-4;

/// Boxes and links are shown so many heights above the ground away.
const REACH_HEIGHTS: f64 = 5.0;
const SEGMENTS_MAX: usize = 6000;
const BOXES: [u8; 4] = [90, 200, 255, 140];
const LINKS: [u8; 4] = [255, 130, 200, 160];

/// The picture that a frame is for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Canvas {
    /// Width and height in pixels, at least 1.
    pub size_px: [u32; 2],
    /// Pixels of a pixel of the font.
    pub text_scale: f64,
}

impl Session {
    /// Runs and draws a frame, `passed_s` seconds after the last.
    ///
    /// # Errors
    /// Vulkan or the recording's file failed, or a bug.
    pub fn frame(&mut self, passed_s: f64, canvas: Canvas) -> Result<(), Failure> {
        let step_s = passed_s.clamp(STEP_MIN_S, STEP_MAX_S);
        self.time_s += step_s;
        if self.follows {
            self.transport.advance(step_s);
        }
        let view = self.next_view(step_s, canvas.size_px);
        self.input.time_s = self.time_s;
        self.input.hold_lod = self.switches.frozen;
        self.input.views.clear();
        self.input.views.push(view);
        self.view = Some(view);
        self.loader.request(&self.output.wanted, 0);
        self.loader.collect(&mut self.input.arrived);
        self.name_faults();
        self.paint(canvas);
        let arrived = self.input.arrived.iter().map(|page| page.key).collect();
        let begin_ns = now_ns();
        let last_ns = self.began_ns.replace(begin_ns).unwrap_or(begin_ns);
        let drawn = self.overfly.frame_drawn(&mut self.input, &mut self.output, 0);
        let work_ms = milliseconds(now_ns() - begin_ns);
        self.report = drawn?.unwrap_or_default();
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(&RecordedFrame {
                time_s: self.time_s,
                views: vec![view],
                arrived,
                hold_lod: self.switches.frozen,
                scene: None,
                digest: self.output.digest,
            })?;
        }
        if std::mem::take(&mut self.switches.shoots) {
            self.shoot()?;
        }
        self.times.add(milliseconds(begin_ns - last_ns), work_ms);
        self.read();
        self.frames += 1;
        Ok(())
    }

    /// What is seen in this frame: the flight, or what the free eye flew to.
    fn next_view(&mut self, step_s: f64, size_px: [u32; 2]) -> View {
        let body = self.plan.scene.body;
        let lens = &self.plan.scene.views[0];
        let (motion, look_px) = (self.motion(), std::mem::take(&mut self.look_px));
        let moves = motion != super::fly::Motion::default() || look_px != [0.0; 2];
        if let Some(track) = self.track.as_mut().filter(|_| self.follows) {
            let view = View { size_px, ..track.view(self.transport.frame()) };
            self.eye = Eye::of_view(&view, &body);
            if !moves {
                return view;
            }
            self.follows = false;
        }
        let px_rad = lens.field_of_view.0 / f64::from(size_px[1]);
        self.eye.turn(look_px[0] * px_rad, look_px[1] * px_rad);
        let speed = speed_m_s(self.height_to_fly_m(), self.factor);
        self.eye.fly(motion, speed * step_s, &body);
        let ground = self.overfly.ground().agl(self.eye.point(&body), Query::BestResident).found();
        if let Some(contact) = ground {
            self.eye.keep_above(contact.ground.height_m);
        }
        self.eye.view(&self.plan.scene.views[0], size_px, &body)
    }

    /// Above the ground, or above the ellipsoid where no ground is loaded.
    fn height_to_fly_m(&self) -> f64 {
        self.contact.map_or(self.eye.place().height_m, |contact| contact.agl_m)
    }

    /// Says of each archive once that it fails, and how.
    fn name_faults(&mut self) {
        let mut new = None;
        for (_, error) in self.loader.faults() {
            if self.named.insert(error.archive().unwrap_or("the planet").to_owned()) {
                eprintln!("overfly: {error}; the ground is coarser there");
                new = Some(format!("{error}; the ground is coarser there"));
            }
        }
        if let Some(text) = new {
            self.say(text);
        }
    }

    /// What this frame shows, and the last one's numbers over it; over a screenshot nothing.
    fn paint(&mut self, canvas: Canvas) {
        let switches = self.switches;
        if self.notice.as_ref().is_some_and(|&(_, until_s)| until_s <= self.time_s) {
            self.notice = None;
        }
        self.find_segments();
        let looks = self.overfly.looks_mut();
        looks.show = switches.show;
        looks.overlay.clear();
        if switches.shoots {
            return;
        }
        for &([a, b], colour) in &self.segments {
            looks.overlay.segment(a, b, colour);
        }
        let help = if switches.help { keys::help() } else { Vec::new() };
        let panels = Panels {
            // Both together are not readable in a small window.
            lines: if switches.hud && !switches.help { &self.lines[..] } else { &[] },
            help: &help,
            notice: self.notice.as_ref().map(|(text, _)| text.as_str()),
            times: switches.graph.then_some(&self.times),
        };
        hud::paint(&panels, canvas.size_px, canvas.text_scale, &mut looks.overlay);
    }

    /// Bounds and links of the last frame's mesh near the eye, where they are wanted.
    fn find_segments(&mut self) {
        self.segments.clear();
        let Switches { boxes, links, .. } = self.switches;
        if !boxes && !links {
            return;
        }
        let eye = self.eye.point(&self.plan.scene.body).0;
        let reach_m = self.height_to_fly_m().abs().max(1.0) * REACH_HEIGHTS;
        let terrain = self.overfly.terrain();
        let mut found = Vec::new();
        if boxes {
            terrain.bound_lines(eye, reach_m, SEGMENTS_MAX, &mut found);
            self.segments.extend(found.drain(..).map(|ends| (ends, BOXES)));
        }
        if links {
            terrain.diamond_lines(eye, reach_m, SEGMENTS_MAX, &mut found);
            self.segments.extend(found.drain(..).map(|ends| (ends, LINKS)));
        }
    }

    fn shoot(&mut self) -> Result<(), Failure> {
        let pixels = self.overfly.with_renderer(|renderer| renderer.read_pixels()).transpose()?;
        let Some(pixels) = pixels else { return Ok(()) };
        match screenshot::write(&self.plan.pictures, pixels, &self.sidecar()) {
            Ok(path) => {
                say!("wrote {} and its .ron", path.display());
                self.say(format!("wrote {}", path.display()));
            }
            // A full disk is no reason to end a flight.
            Err(error) => {
                eprintln!("overfly: {error}");
                self.say(error.to_string());
            }
        }
        Ok(())
    }

    /// Reads the frame's numbers, for the next one to show.
    fn read(&mut self) {
        let body = self.plan.scene.body;
        let point = self.eye.point(&body);
        self.contact = self.overfly.ground().agl(point, Query::BestResident).found();
        if !self.switches.hud {
            return;
        }
        let stages = self.overfly.spans().stages();
        let stages_ms: Vec<(&'static str, f64)> =
            stages.map(|s| (s.span.0, milliseconds(s.end_ns - s.begin_ns))).collect();
        let place = self.eye.place();
        let sea_m = self.contact.map(|contact| contact.ground.sea_level_m);
        let degrees = [self.eye.heading(), self.eye.pitch()].map(|angle| angle.to_degrees());
        self.lines = hud::lines(&Readout {
            place,
            agl_m: self.contact.map(|contact| contact.agl_m),
            msl_m: sea_m.map(|sea_m| place.height_m - sea_m),
            look_deg: degrees,
            speed_m_s: speed_m_s(self.height_to_fly_m(), self.factor),
            counts: &self.output.counts,
            pages_bytes: u64::from(self.output.counts.pages) * size_of::<Page>() as u64,
            device: self.output.device,
            drawn: [self.report.draws.into(), self.report.triangles],
            stages_ms: &stages_ms,
            frame_ms: self.times.mean_ms(),
            tolerance_px: self.plan.scene.lod.tolerance.0,
            show: self.switches.show.name(),
            states: &self.states(),
        });
    }

    /// What is not as usual, in lines.
    fn states(&self) -> Vec<String> {
        let mut states = Vec::new();
        if let Some(track) = &self.track {
            let [at_s, end_s] = self.transport.times_s();
            let how = match (self.follows, self.transport.playing()) {
                (false, _) => "left; R goes back",
                (true, true) => "playing",
                (true, false) => "paused",
            };
            states.push(format!("{} {at_s:.2} of {end_s:.2} s, {how}", track.name));
        }
        if let Some(recorder) = &self.recorder {
            states.push(format!("recording frame {}", recorder.frames()));
        }
        if self.switches.frozen {
            states.push("level of detail frozen".into());
        }
        states
    }
}

fn milliseconds(ns: u64) -> f64 {
    ns as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::keys::{Action, Way};
    use crate::viewer::session::{Plan, scene_of};
    use overfly::Overfly;
    use overfly::core::frame::{FrameInput, FrameOutput};
    use overfly::render_vk::Show;
    use overfly::replay::{Ending, Recording, first_difference};
    use std::path::Path;

    const CANVAS: Canvas = Canvas { size_px: [320, 240], text_scale: 1.0 };

    fn session(flight: Option<&str>, record: Option<&Path>) -> Session {
        let (scene_text, scene) = scene_of("small").unwrap();
        Session::new(Plan {
            scene_name: "small".into(),
            scene_text,
            scene,
            workers: 0,
            flight: flight.map(str::to_owned),
            eye: None,
            record: record.map(Path::to_path_buf),
            pictures: "out/view".into(),
            show: Show::Shaded,
            validate: false,
        })
        .unwrap()
    }

    fn frames(session: &mut Session, frames: u32) {
        (0..frames).for_each(|_| session.frame(1.0 / 60.0, CANVAS).unwrap());
    }

    /// Frames until the terrain has come up: pages arrive when they are ready.
    fn settle(session: &mut Session) {
        loop {
            frames(session, 1);
            let counts = &session.output.counts;
            if counts.leaves > 0 && counts.splits + counts.merges + counts.wanted == 0 {
                return;
            }
            std::thread::yield_now();
        }
    }

    fn tap(session: &mut Session, action: Action) {
        session.act(action, true).unwrap();
        session.act(action, false).unwrap();
    }

    #[test]
    fn what_was_flown_by_hand_replays_to_the_same_digests() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("flown.ovf");
        let mut session = session(None, Some(&file));
        session.act(Action::Fly(Way::Ahead), true).unwrap();
        session.act(Action::Fly(Way::Down), true).unwrap();
        frames(&mut session, 60);
        session.act(Action::Fly(Way::Ahead), false).unwrap();
        session.act(Action::Fly(Way::Down), false).unwrap();
        settle(&mut session);
        tap(&mut session, Action::Look([90.0, -30.0]));
        tap(&mut session, Action::Tolerance(1));
        for frame in 0..60 {
            if frame == 20 || frame == 40 {
                tap(&mut session, Action::Freeze);
            }
            session.frame(0.013, Canvas { size_px: [333, 200], ..CANVAS }).unwrap();
        }
        let flown = session.frames;
        assert_eq!(session.finish().unwrap(), Some((flown, file.clone())));
        let recording = Recording::open(&file).unwrap();
        assert!(matches!(recording.ending, Ending::Complete));
        let scene = overfly::config::read(&recording.header.scene_text, "recorded").unwrap();
        assert!(recording.header.differs_from(&scene).is_empty());
        let mut overfly = Overfly::new(&scene, 1).unwrap();
        let mut loader = overfly.loader(1).unwrap();
        let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
        let mut arrived = 0;
        for (index, frame) in recording.frames.iter().enumerate() {
            (input.time_s, input.views) = (frame.time_s, frame.views.clone());
            input.hold_lod = frame.hold_lod;
            loader.fetch(&frame.arrived, &mut input.arrived);
            overfly.frame(&mut input, &mut output).unwrap();
            arrived += frame.arrived.len();
            assert_eq!(first_difference(&frame.digest, &output.digest), None, "frame {index}");
        }
        assert!(arrived > 10, "only {arrived} pages arrived");
    }

    #[test]
    fn a_flight_plays_is_left_by_hand_and_taken_up_again() {
        let mut session = session(Some("poles"), None);
        frames(&mut session, 30);
        assert!(session.follows && session.transport.playing());
        let shown = session.transport.frame();
        assert!(shown > 10);
        let view = session.view.unwrap();
        let track = session.track.as_mut().unwrap();
        assert_eq!(view, View { size_px: CANVAS.size_px, ..track.view(shown) });
        session.act(Action::Fly(Way::Right), true).unwrap();
        frames(&mut session, 5);
        assert!(!session.follows);
        assert!(session.transport.frame() <= shown + 1, "it stands while it is left");
        session.let_go();
        frames(&mut session, 1);
        let left = session.view.unwrap();
        frames(&mut session, 3);
        assert_eq!(session.view.unwrap(), left, "holding still changes nothing");
        tap(&mut session, Action::Follow);
        tap(&mut session, Action::Seek(crate::viewer::play::Seek::End));
        frames(&mut session, 1);
        let track = session.track.as_mut().unwrap();
        let last = View { size_px: CANVAS.size_px, ..track.view(track.frames - 1) };
        assert_eq!(session.view.unwrap(), last);
        assert!(session.lines.iter().any(|line| line.contains("paused")), "{:?}", session.lines);
    }

    #[test]
    fn another_tolerance_keeps_the_eye_and_a_frozen_mesh_stays() {
        let mut session = session(None, None);
        settle(&mut session);
        let eye = session.eye;
        tap(&mut session, Action::Tolerance(-1));
        tap(&mut session, Action::Tolerance(-1));
        settle(&mut session);
        assert_eq!(session.eye, eye);
        assert_eq!(session.plan.scene.lod.tolerance.0, 0.5);
        assert!(session.output.frame < session.frames, "the ground came up anew");
        tap(&mut session, Action::Freeze);
        frames(&mut session, 1);
        let mesh = session.output.digest.mesh;
        session.act(Action::Fly(Way::Down), true).unwrap();
        frames(&mut session, 20);
        assert_eq!(session.output.digest.mesh, mesh);
        tap(&mut session, Action::Freeze);
        frames(&mut session, 20);
        assert_ne!(session.output.digest.mesh, mesh);
    }

    #[test]
    fn a_sidecar_names_what_the_frame_showed() {
        let mut session = session(None, None);
        tap(&mut session, Action::Show(5));
        tap(&mut session, Action::Later(2.0));
        frames(&mut session, 2);
        let sidecar = session.sidecar();
        assert_eq!((sidecar.show.as_str(), sidecar.scene.as_str()), ("normals", "small"));
        assert_eq!(sidecar.view(), session.view.unwrap());
        let noon = session.plan.scene.sun.unwrap().direction_at(0.0);
        let sun = glam::DVec3::from_array(sidecar.sun.unwrap());
        let apart = sun.truncate().angle_to(noon.truncate()).to_degrees();
        assert!((apart - 30.0).abs() < 1e-9, "two hours are 30°: {apart}");
    }
}

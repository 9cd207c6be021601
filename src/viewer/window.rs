//! The window: its events become actions, each redraw becomes a frame.
//!
//! In:    a [`Plan`], a size, perhaps a script; what the window system sends.
//! Out:   frames on the screen; what was done, in [`Summary`].
//! Keeps: [`App`]: the window and the session while it is open.
//! Not here: what actions and frames are (`session`, `turn`).

use super::keys::{self, Action};
use super::script::{Command, Script};
use super::session::{Plan, Session};
use super::turn::Canvas;
use crate::cli::Failure;
use overfly::jobs::now_ns;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::PhysicalKey;
use winit::window::{Window, WindowId};

/// Where a frame's time is not measured: of a script's frames.
const SCRIPT_STEP_S: f64 = 1.0 / 60.0;
/// Pixels that a touch pad scrolls for a notch of a wheel.
const NOTCH_PX: f64 = 40.0;
/// Pictures of this height and more have text of twice the size.
const TALL_PX: u32 = 1400;

/// What a window is opened with.
pub struct Options {
    /// What it shows.
    pub plan: Plan,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Closes after so many frames.
    pub frames: Option<u64>,
    /// What is done before each frame.
    pub script: Option<Script>,
}

/// What was done until a window closed.
pub struct Summary {
    /// Frames drawn.
    pub frames: u64,
    /// How often the picture took another size.
    pub resizes: u32,
    /// Frames recorded, and where.
    pub recorded: Option<(u64, PathBuf)>,
    /// What validation said.
    pub validation: Vec<String>,
}

/// There is nothing to open a window on, or nothing to draw with.
#[derive(Debug)]
pub struct NoScreen(String);

impl fmt::Display for NoScreen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; `overfly still` and `overfly replay --stills` need no window", self.0)
    }
}

impl std::error::Error for NoScreen {}

fn no_window(error: impl fmt::Display) -> NoScreen {
    let hint = if cfg!(target_os = "linux") {
        " (is DISPLAY set? Windows are X11's; on Debian they need libx11-6, libx11-xcb1, \
         libxcursor1, libxi6, libxrandr2 and libxkbcommon-x11-0)"
    } else {
        ""
    };
    // winit begins with the line of its own source that found out.
    let text = error.to_string();
    let what = text
        .split_once(".rs:")
        .map_or(text.as_str(), |(_, rest)| rest.split_once(": ").map_or(rest, |(_, what)| what));
    NoScreen(format!("no window can be opened: {what}{hint}"))
}

/// Opens a window, and flies in it until it is closed.
///
/// # Errors
/// [`NoScreen`]; or scene, flight, recording or a frame failed.
pub fn run(options: Options) -> Result<Summary, Failure> {
    let event_loop = EventLoop::new().map_err(no_window)?;
    event_loop.set_control_flow(ControlFlow::Wait);
    let proxy = event_loop.create_proxy();
    ctrlc::set_handler(move || {
        // An event loop that is gone needs no message.
        let _ = proxy.send_event(());
    })?;
    let session = Session::new(options.plan)?;
    let mut app = App {
        session: Some(session),
        wanted_px: options.size_px,
        frames_left: options.frames,
        script: options.script,
        todo: Vec::new(),
        window: None,
        drawn_px: [0, 0],
        hidden: false,
        last_ns: None,
        shift: false,
        drags: false,
        cursor_px: [0.0; 2],
        summary: Summary { frames: 0, resizes: 0, recorded: None, validation: Vec::new() },
        failure: None,
    };
    event_loop.run_app(&mut app).map_err(no_window)?;
    app.failure.map_or(Ok(app.summary), Err)
}

struct App {
    /// Gone once the window closes, before the window system goes.
    session: Option<Session>,
    wanted_px: [u32; 2],
    frames_left: Option<u64>,
    script: Option<Script>,
    todo: Vec<Command>,
    window: Option<Arc<Window>>,
    /// Size of the renderer's pictures; zero before there is a renderer.
    drawn_px: [u32; 2],
    /// Nobody can see the window.
    hidden: bool,
    /// When the last frame began; empty after a pause.
    last_ns: Option<u64>,
    shift: bool,
    drags: bool,
    cursor_px: [f64; 2],
    summary: Summary,
    failure: Option<Failure>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let done = self.open(event_loop);
        self.note(event_loop, done);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let done = self.event(event);
        self.note(event_loop, done);
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, (): ()) {
        event_loop.exit();
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        let Some(mut session) = self.session.take() else { return };
        self.summary.frames = session.frames;
        match session.finish() {
            Ok(recorded) => self.summary.recorded = recorded,
            Err(error) => {
                self.failure.get_or_insert(error.into());
            }
        }
        self.summary.validation = session.validation_messages();
        drop(session);
        self.window = None;
    }
}

impl App {
    /// Ends the event loop where something failed, or somebody wants it to end.
    fn note(&mut self, event_loop: &ActiveEventLoop, done: Result<(), Failure>) {
        if let Err(error) = done {
            self.failure.get_or_insert(error);
        }
        let quits = self.session.as_ref().is_none_or(|session| session.quits);
        if quits || self.failure.is_some() {
            event_loop.exit();
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Failure> {
        if self.window.is_some() {
            return Ok(());
        }
        let [width, height] = self.wanted_px;
        let attributes = Window::default_attributes()
            .with_title("overfly")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(no_window)?;
        window.request_redraw();
        self.window = Some(Arc::new(window));
        Ok(())
    }

    fn event(&mut self, event: WindowEvent) -> Result<(), Failure> {
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.act(Action::Quit, true),
            WindowEvent::RedrawRequested => self.redraw(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                self.ask_for_frame();
                Ok(())
            }
            WindowEvent::Occluded(hidden) => {
                self.hidden = hidden;
                self.ask_for_frame();
                Ok(())
            }
            WindowEvent::Focused(false) => {
                self.drags = false;
                if let Some(session) = &mut self.session {
                    session.let_go();
                }
                Ok(())
            }
            WindowEvent::ModifiersChanged(modifiers) => {
                self.shift = modifiers.state().shift_key();
                Ok(())
            }
            WindowEvent::KeyboardInput { event, .. } => self.key(&event),
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.drags = state == ElementState::Pressed;
                Ok(())
            }
            WindowEvent::CursorMoved { position, .. } => {
                let [x, y] = std::mem::replace(&mut self.cursor_px, [position.x, position.y]);
                let moved_px = [position.x - x, y - position.y];
                if self.drags { self.act(Action::Look(moved_px), true) } else { Ok(()) }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(moved) => moved.y / NOTCH_PX,
                };
                self.act(Action::Speed(notches), true)
            }
            _ => Ok(()),
        }
    }

    fn key(&mut self, event: &KeyEvent) -> Result<(), Failure> {
        let PhysicalKey::Code(code) = event.physical_key else { return Ok(()) };
        let Some(action) = keys::action(code, self.shift) else { return Ok(()) };
        if event.repeat && !keys::repeats(action) {
            return Ok(());
        }
        self.act(action, event.state == ElementState::Pressed)
    }

    fn act(&mut self, action: Action, down: bool) -> Result<(), Failure> {
        self.session.as_mut().map_or(Ok(()), |session| session.act(action, down))
    }

    fn ask_for_frame(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    /// A frame, and the wish for the next. A window that nobody sees has none: the next one comes
    /// when it is seen again.
    fn redraw(&mut self) -> Result<(), Failure> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        let size_px = <[u32; 2]>::from(window.inner_size());
        if size_px.contains(&0) || (self.hidden && self.script.is_none()) {
            self.last_ns = None;
            return Ok(());
        }
        self.follow_script(&window, size_px)?;
        let Some(session) = &mut self.session else { return Ok(()) };
        if session.quits {
            return Ok(());
        }
        if !session.has_renderer() {
            let started = session.start_renderer(size_px, window.clone());
            started.map_err(|error| NoScreen(format!("cannot draw in a window: {error}")))?;
            self.drawn_px = size_px;
        }
        if self.drawn_px != size_px {
            session.resize(size_px)?;
            self.drawn_px = size_px;
            self.summary.resizes += 1;
        }
        let now_ns = now_ns();
        let passed_s = match (&self.script, self.last_ns) {
            (Some(_), _) | (None, None) => SCRIPT_STEP_S,
            (None, Some(last_ns)) => (now_ns - last_ns) as f64 / 1e9,
        };
        self.last_ns = Some(now_ns);
        let text_scale = text_scale(size_px, window.scale_factor());
        session.frame(passed_s, Canvas { size_px, text_scale })?;
        session.present()?;
        if let Some(left) = &mut self.frames_left {
            *left = left.saturating_sub(1);
            session.quits |= *left == 0;
        }
        window.request_redraw();
        Ok(())
    }

    fn follow_script(&mut self, window: &Window, size_px: [u32; 2]) -> Result<(), Failure> {
        let Some(script) = &mut self.script else { return Ok(()) };
        script.before_frame(size_px, &mut self.todo);
        for command in std::mem::take(&mut self.todo) {
            match command {
                Command::Press(action) => self.act(action, true)?,
                Command::Release(action) => self.act(action, false)?,
                Command::Resize([width, height]) => {
                    // What it says at once is what the next event says, or the one after.
                    let _ = window.request_inner_size(PhysicalSize::new(width, height));
                }
                Command::Stuck([width, height]) => {
                    let now = size_px.map(|side| side.to_string()).join("x");
                    let wanted = format!("{width}x{height}");
                    return Err(format!("--script: the window stays {now}, not {wanted}").into());
                }
            }
        }
        Ok(())
    }
}

/// Pixels of a pixel of the font: whole ones, so that it stays sharp.
fn text_scale(size_px: [u32; 2], scale_factor: f64) -> f64 {
    let least = if size_px[1] >= TALL_PX { 2.0 } else { 1.0 };
    scale_factor.round().clamp(least, 8.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_as_large_as_the_screen_asks_in_whole_pixels() {
        let scales = [(720, 1.0), (720, 1.4), (720, 2.0), (1440, 1.0), (2160, 3.0), (720, 0.0)];
        let found = scales.map(|(height, factor)| text_scale([1280, height], factor));
        assert_eq!(found, [1.0, 1.0, 2.0, 2.0, 3.0, 1.0]);
    }

    #[test]
    fn what_is_missing_is_said_with_what_helps() {
        let text = no_window("no display").to_string();
        assert!(text.contains("no display") && text.contains("overfly still"), "{text}");
    }
}

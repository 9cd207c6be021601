//! `overfly still`: one picture from one place, settled.
//!
//! In:    a scene, a place, a direction, what to show.
//! Out:   a PNG, written beside and renamed; one line of figures; an exit code.
//! Keeps: nothing.
//! Not here: pictures of a flight (`replay`), drawing (`overfly::render_vk`).

use super::replay::{default_workers, parse_size};
use super::{DIVERGED, Failure, INTERRUPTED, NO_DEVICE, place_of, stills};
use crate::viewer::screenshot::Sidecar;
use glam::DVec3;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::{Pixels, Radians};
use overfly::loader::Loader;
use overfly::render_vk::{Renderer, RendererSettings, Show};
use overfly::{Overfly, config};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most frames until the terrain has come up.
const FRAMES_MAX: usize = 4000;
/// Imagery that is new has faded in after this.
const FADE_S: f64 = overfly::core::mesh::drape::FADE_MS as f64 / 1e3;
/// Colour of the lines that show the camera of the LOD.
const FRUSTUM: [u8; 4] = [255, 210, 60, 255];
const BOXES: [u8; 4] = [90, 200, 255, 140];
const LINKS: [u8; 4] = [255, 130, 200, 160];
/// Most boxes and links of a picture.
const LINES_MAX: usize = 6000;

/// What `still` takes.
#[derive(clap::Args)]
pub struct Arguments {
    /// A scene file or a preset (earth, moon, small). [default: earth, or the sidecar's]
    #[arg(long)]
    scene: Option<String>,
    /// Where the eye is: degrees, and metres above the ellipsoid.
    #[arg(
        long,
        value_name = "LAT,LON,ALT",
        allow_hyphen_values = true,
        value_parser = parse_at,
        required_unless_present = "sidecar"
    )]
    at: Option<At>,
    /// Draws the picture of a screenshot's .ron again: its scene, eye, size, sun and view.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["at", "agl", "fov", "time"])]
    sidecar: Option<PathBuf>,
    /// ALT is above the ground instead.
    #[arg(long)]
    agl: bool,
    /// Where it looks: degrees clockwise from north, degrees above the horizon, and if it leans,
    /// degrees to the right.
    #[arg(
        long,
        value_name = "HEADING,PITCH",
        allow_hyphen_values = true,
        default_value = "0,0",
        value_parser = parse_look
    )]
    look: Look,
    /// What to show: shaded, wireframe, level, error, residency, normals, range or culled.
    /// [default: shaded, or the sidecar's]
    #[arg(long, value_name = "NAME", value_parser = parse_show)]
    view: Option<Show>,
    /// Draws the bounds of patches near the eye.
    #[arg(long)]
    boxes: bool,
    /// Draws the links of diamonds near the eye to their parents.
    #[arg(long)]
    links: bool,
    /// Vertical field of view in degrees. [default: the scene's first view's]
    #[arg(long, value_name = "DEG", value_parser = parse_fov)]
    fov: Option<f64>,
    /// Size of the picture in pixels. [default: 1280x720, or the sidecar's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Seconds of the flight: where the sun of a running clock has come to.
    #[arg(long, value_name = "S", default_value = "0", value_parser = parse_time)]
    time: f64,
    /// Most triangles, instead of the scene's.
    #[arg(long, value_name = "N")]
    triangles: Option<u32>,
    /// Error on the screen that may stay, in pixels, instead of the scene's.
    #[arg(long, value_name = "PX")]
    tolerance: Option<f64>,
    /// Draws with Vulkan's validation layer; any message makes the exit code 1.
    #[arg(long)]
    validate: bool,
    /// The PNG to write.
    #[arg(short, long, value_name = "FILE", default_value = "still.png")]
    out: PathBuf,
}

/// Degrees, degrees, metres.
#[derive(Clone, Copy)]
struct At {
    lat_deg: f64,
    lon_deg: f64,
    alt_m: f64,
}

/// Degrees.
#[derive(Clone, Copy)]
struct Look {
    heading_deg: f64,
    pitch_deg: f64,
    roll_deg: f64,
}

fn number((name, [least, most]): (&str, [f64; 2]), text: &str) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|value| (least..=most).contains(value));
    value.ok_or_else(|| format!("{name} `{text}` is not a number from {least} to {most}"))
}

fn parse_at(text: &str) -> Result<At, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let &[lat, lon, alt] = &parts[..] else {
        return Err(format!("`{text}` is not LAT,LON,ALT"));
    };
    Ok(At {
        lat_deg: number(("latitude", [-90.0, 90.0]), lat)?,
        lon_deg: number(("longitude", [-180.0, 360.0]), lon)?,
        alt_m: number(("altitude", [-20_000.0, 1e12]), alt)?,
    })
}

fn parse_look(text: &str) -> Result<Look, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let (heading, pitch, roll) = match parts[..] {
        [heading, pitch] => (heading, pitch, "0"),
        [heading, pitch, roll] => (heading, pitch, roll),
        _ => return Err(format!("`{text}` is not HEADING,PITCH or HEADING,PITCH,ROLL")),
    };
    Ok(Look {
        heading_deg: number(("heading", [-360.0, 360.0]), heading)?,
        pitch_deg: number(("pitch", [-90.0, 90.0]), pitch)?,
        roll_deg: number(("roll", [-180.0, 180.0]), roll)?,
    })
}

/// What a debug view is called.
pub fn parse_show(text: &str) -> Result<Show, String> {
    Show::from_name(text).ok_or_else(|| {
        let names: Vec<_> = Show::ALL.iter().map(|show| show.name()).collect();
        format!("`{text}` is none of {}", names.join(", "))
    })
}

fn parse_fov(text: &str) -> Result<f64, String> {
    number(("field of view", [0.01, 179.0]), text)
}

fn parse_time(text: &str) -> Result<f64, String> {
    number(("time", [0.0, 1e9]), text)
}

/// What is to be drawn.
struct Subject {
    scene: SceneSettings,
    show: Show,
    size_px: [u32; 2],
    time_s: f64,
    /// The view of a sidecar.
    view: Option<View>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let inputs = [arguments.scene.as_ref().map(PathBuf::from), arguments.sidecar.clone()];
    let inputs = inputs.into_iter().flatten();
    let mut taken = inputs.filter_map(|path| std::fs::canonicalize(path).ok()).collect();
    let out = place_of(&arguments.out, &mut taken)?;
    let subject = subject_of(arguments)?;
    let mut overfly = Overfly::new(&subject.scene, default_workers())?;
    let limits = overfly.terrain().limits();
    let settings = RendererSettings {
        validation: arguments.validate,
        ..RendererSettings::of(&subject.scene, limits, subject.size_px)
    };
    let renderer = match Renderer::new(&settings) {
        Ok(renderer) => renderer,
        Err(error) => {
            eprintln!("overfly: no picture: {error}");
            return Ok(ExitCode::from(NO_DEVICE));
        }
    };
    say!("drawing on {}", renderer.device_line());
    overfly.set_renderer(renderer);
    let view = match subject.view {
        Some(view) => view,
        None => view_of(arguments, &subject, &overfly)?,
    };
    let mut shot = Shot {
        loader: overfly.loader(default_workers().max(1))?,
        input: FrameInput::default(),
        output: FrameOutput::default(),
        overfly,
    };
    if !shot.settle(&view, subject.time_s)? {
        shot.overfly.close();
        return Ok(ExitCode::from(INTERRUPTED));
    }
    let bound_px = shot.output.counts.error_px_bound;
    shot.take(arguments, &subject, &view)?;
    let Shot { overfly, output, .. } = &mut shot;
    let pixels = overfly.with_renderer(Renderer::read_pixels).expect("it was set above")?;
    stills::write_png(&out, subject.size_px, pixels)?;
    let counts = &output.counts;
    say!(
        "wrote {}: {} triangles, {} patches drawn, {} pages, error bound {bound_px:.2} px",
        out.display(),
        counts.triangles,
        counts.drawn,
        counts.pages,
    );
    let messages = overfly.with_renderer(|renderer| renderer.validation_messages());
    let messages = messages.unwrap_or_default();
    messages.iter().for_each(|message| eprintln!("overfly: validation: {message}"));
    overfly.close();
    if arguments.validate {
        say!("validation messages: {}", messages.len());
    }
    Ok(if messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(DIVERGED) })
}

fn subject_of(arguments: &Arguments) -> Result<Subject, Failure> {
    let mut subject = if let Some(path) = &arguments.sidecar {
        let sidecar = Sidecar::read(path)?;
        let (_, _, scene) = sidecar.scene(arguments.scene.as_deref())?;
        let show = parse_show(&sidecar.show)?;
        let (size_px, time_s) = (sidecar.size_px, sidecar.time_s);
        Subject { scene, show, size_px, time_s, view: Some(sidecar.view()) }
    } else {
        let scene = config::load(arguments.scene.as_deref().unwrap_or("earth"))?;
        let (show, size_px) = (Show::Shaded, [1280, 720]);
        Subject { scene, show, size_px, time_s: arguments.time, view: None }
    };
    let lod = &mut subject.scene.lod;
    if let Some(triangles) = arguments.triangles {
        let least = 8_u32 << lod.patch_depth;
        if !(least..=16_000_000).contains(&triangles) {
            return Err(format!("--triangles {triangles}: allowed is {least} to 16000000").into());
        }
        lod.triangles_max = triangles;
    }
    if let Some(tolerance) = arguments.tolerance {
        if !(0.01..=1e6).contains(&tolerance) {
            return Err(format!("--tolerance {tolerance}: allowed is 0.01 to 1e6").into());
        }
        lod.tolerance = Pixels(tolerance);
    }
    subject.show = arguments.view.unwrap_or(subject.show);
    subject.size_px = arguments.size.unwrap_or(subject.size_px);
    if let Some(view) = &mut subject.view {
        view.size_px = subject.size_px;
    }
    Ok(subject)
}

/// The view that was asked for, with an eye that is not below the ground.
fn view_of(arguments: &Arguments, subject: &Subject, overfly: &Overfly) -> Result<View, Failure> {
    let scene = &subject.scene;
    let At { lat_deg, lon_deg, alt_m } = arguments.at.expect("clap asks for it");
    let below = Geodetic::from_degrees(lat_deg, lon_deg, 0.0);
    let ground_m = overfly.ground_height_m(below)?;
    let surface_m = if scene.sea { ground_m.max(0.0) } else { ground_m };
    let height_m = if arguments.agl { surface_m + alt_m } else { alt_m };
    if height_m <= surface_m {
        let note = format!(
            "--at: {height_m:.1} m is not above the ground, which is {surface_m:.1} m there; \
             --agl counts from the ground"
        );
        return Err(note.into());
    }
    let at = Geodetic { height_m, ..below };
    let Look { heading_deg, pitch_deg, roll_deg } = arguments.look;
    let [heading, pitch, roll] = [heading_deg, pitch_deg, roll_deg].map(Radians::from_degrees);
    let lens = &scene.views[0];
    Ok(View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, heading, pitch, roll),
        field_of_view: arguments.fov.map_or(lens.field_of_view, Radians::from_degrees),
        size_px: subject.size_px,
        near_m: lens.near_m,
    })
}

/// What a still is taken with.
struct Shot {
    overfly: Overfly,
    loader: Loader,
    input: FrameInput,
    output: FrameOutput,
}

impl Shot {
    /// Runs frames at one time until nothing changes any more. False if Ctrl-C ended it.
    fn settle(&mut self, view: &View, time_s: f64) -> Result<bool, Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        let asked = stop.clone();
        ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
        let style = "{spinner} the terrain comes up: {msg}";
        let bar = ProgressBar::new_spinner()
            .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
        for _ in 0..FRAMES_MAX {
            if stop.load(Ordering::Relaxed) {
                bar.abandon();
                return Ok(false);
            }
            self.fill(view, time_s);
            self.loader.fetch(&self.output.wanted, &mut self.input.arrived);
            self.overfly.frame(&mut self.input, &mut self.output)?;
            let c = &self.output.counts;
            bar.set_message(format!("{} triangles, {} pages", c.triangles, c.pages));
            bar.tick();
            if c.leaves > 0 && c.splits + c.merges + c.wanted == 0 {
                break;
            }
        }
        bar.finish_and_clear();
        for (key, error) in self.loader.faults() {
            eprintln!("overfly: {error} (a page of depth {})", key.depth());
        }
        Ok(true)
    }

    fn fill(&mut self, view: &View, time_s: f64) {
        self.input.time_s = time_s;
        self.input.views.clear();
        self.input.views.push(*view);
    }

    /// Draws the settled terrain, all vertices at their own places.
    fn take(
        &mut self,
        arguments: &Arguments,
        subject: &Subject,
        view: &View,
    ) -> Result<(), Failure> {
        let settled_s = subject.time_s + subject.scene.lod.morph_s.max(FADE_S) + 0.01;
        let observer =
            if subject.show == Show::Culled { observer_of(view, &subject.scene) } else { *view };
        self.decorate(arguments, view, &observer);
        self.fill(&observer, settled_s);
        self.input.hold_lod = true;
        self.overfly.looks_mut().show = subject.show;
        self.overfly.frame_drawn(&mut self.input, &mut self.output, 0)?;
        Ok(())
    }

    /// Lines of the scene: the camera that the LOD works for, boxes, links.
    fn decorate(&mut self, arguments: &Arguments, view: &View, observer: &View) {
        let Self { overfly, .. } = self;
        let mut lines: Vec<([DVec3; 2], [u8; 4])> = Vec::new();
        if view != observer {
            let reach_m = (observer.eye.0 - view.eye.0).length() * 3.0;
            lines.extend(frustum(view, reach_m).map(|ends| (ends, FRUSTUM)));
        }
        let (terrain, mut found) = (overfly.terrain(), Vec::new());
        let height_m = terrain.settings().body.geodetic_from_ecef(view.eye).height_m;
        let reach_m = height_m.abs().max(1.0) * 20.0;
        if arguments.boxes {
            terrain.bound_lines(view.eye.0, reach_m, LINES_MAX, &mut found);
            lines.extend(found.drain(..).map(|ends| (ends, BOXES)));
        }
        if arguments.links {
            terrain.diamond_lines(view.eye.0, reach_m, LINES_MAX, &mut found);
            lines.extend(found.drain(..).map(|ends| (ends, LINKS)));
        }
        let overlay = &mut overfly.looks_mut().overlay;
        overlay.clear();
        lines.into_iter().for_each(|([a, b], colour)| overlay.segment(a, b, colour));
    }
}

/// Behind and above a camera, looking down at what it sees.
fn observer_of(view: &View, scene: &SceneSettings) -> View {
    let at = scene.body.geodetic_from_ecef(view.eye);
    let up = at.normal();
    let forward = view.orientation * DVec3::NEG_Z;
    let level = (forward - up * forward.dot(up)).normalize_or(at.enu_axes().y_axis);
    let back_m = at.height_m.abs().max(5.0) * 4.0;
    let eye = view.eye.0 - level * back_m + up * back_m;
    let target = view.eye.0 + level * back_m;
    let ahead = (target - eye).normalize();
    let right = ahead.cross(up).normalize();
    let axes = glam::DMat3::from_cols(right, right.cross(ahead), -ahead);
    View {
        eye: overfly::core::geodesy::Ecef(eye),
        orientation: glam::DQuat::from_mat3(&axes),
        ..*view
    }
}

/// The edges of what a camera sees, as far as `reach_m`.
fn frustum(view: &View, reach_m: f64) -> [[DVec3; 2]; 8] {
    let [width, height] = view.size_px.map(f64::from);
    let tan_y = overfly::core::geodesy::trig::tan(view.field_of_view.0 / 2.0);
    let tan_x = tan_y * width / height;
    let corner = |x: f64, y: f64| {
        let ray = DVec3::new(x * tan_x, y * tan_y, -1.0);
        view.eye.0 + view.orientation * ray * reach_m
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    core::array::from_fn(|i| {
        let from = if i < 4 { view.eye.0 } else { corners[(i + 1) % 4] };
        [from, corners[i % 4]]
    })
}

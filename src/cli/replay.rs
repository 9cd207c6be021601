//! `overfly replay`: from arguments to a run, from a run to tables, files and an exit code.
//!
//! In:    a flight or recording, a scene, the options.
//! Out:   a table, stills, a recording, JSON; an exit code.
//! Keeps: nothing.
//! Not here: the loop (`run`), formats (`overfly::replay`).

use super::columns::Columns;
use super::run::{Run, fly};
use super::source::{Source, recording_header};
use super::still::parse_show;
use super::stills::{Stills, chosen};
use super::{
    BAD_INPUT, DIVERGED, Failure, INTERRUPTED, json, place_of, read_by, report, write_whole,
};
use overfly::core::settings::SceneSettings;
use overfly::render_vk::{Renderer, RendererSettings, Show};
use overfly::replay::{Ending, Header, RunDigest, Writer};
use overfly::{OpenError, Overfly, config};
use std::collections::{BTreeSet, VecDeque};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

/// What `replay` takes.
#[derive(clap::Args)]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles), an .ovf file or one that `import` reads.
    flight: String,
    /// A scene file or a preset (earth, moon, small). A recording brings its own.
    #[arg(long)]
    scene: Option<String>,
    /// Worker threads beside the main one, 0 to 64. The results are the same for any number.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=64))]
    workers: Option<u8>,
    /// Only these frames, the end excluded. The terrain comes up at A, wherever in the file that is;
    /// frames of a recording are then not held against what was recorded, unless A is 0.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<Range<usize>>,
    /// Runs a recording from its beginning and reports only --frames, so that they are the very
    /// frames that were recorded, and are held against them.
    #[arg(long, requires = "frames")]
    from_start: bool,
    /// Size of the pictures; with a flight the level of detail follows it. [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Draws nothing: no Vulkan is needed.
    #[arg(long, conflicts_with = "stills")]
    no_render: bool,
    /// Draws with Vulkan's validation layer; any message makes the exit code 1.
    #[arg(long, conflicts_with = "no_render")]
    validate: bool,
    /// Draws only N frames, evenly spread, and writes them as PNG with a contact sheet. Without
    /// this every frame is drawn and none is written.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    stills: Option<u16>,
    /// What pictures show: shaded, wireframe, level, error, residency, normals, range or culled.
    #[arg(long, value_name = "NAME", default_value = "shaded", value_parser = parse_show)]
    view: Show,
    /// Draws every frame and writes it as DIR/frame-000000.png and so on, for a video.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["stills", "no_render"])]
    video: Option<PathBuf>,
    /// Records views, page arrivals and digests of every frame.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Pages arrive this many milliseconds of the flight's time after the next frame, as from a
    /// slow disk. The frames are the same on every machine: a frame waits for a page that is due.
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=60_000))]
    loader_delay_ms: Option<u32>,
    /// Folder for stills. [default: out/FLIGHT]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Writes counts and stage times of every frame, as columns.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Frames as A..B.
pub fn parse_frames(text: &str) -> Result<Range<usize>, String> {
    let wrong = || format!("`{text}` is not A..B with whole numbers and A below B");
    let (a, b) = text.split_once("..").ok_or_else(wrong)?;
    let range = a.parse().map_err(|_| wrong())?..b.parse().map_err(|_| wrong())?;
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
}

/// A picture's width and height.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let wrong = || format!("`{text}` is not WxH with whole numbers from 1 to 8192");
    let (w, h) = text.split_once('x').ok_or_else(wrong)?;
    let side = |text: &str| match text.parse() {
        Ok(side @ 1..=8192) => Ok(side),
        _ => Err(wrong()),
    };
    Ok([side(w)?, side(h)?])
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let places = places(arguments)?;
    let header = recording_header(&arguments.flight)?;
    let (scene_name, scene) = scene_of(arguments, header.as_ref())?;
    let workers = arguments.workers.map_or_else(default_workers, usize::from);
    let mut overfly =
        Overfly::new(&scene, workers).map_err(|error| named(error, header.is_some(), arguments))?;
    let mut run = prepare(arguments, &places, scene, &mut overfly)?;
    say!(
        "{} over {scene_name}, frames {}..{} at {} Hz, {workers} workers",
        run.source.name(),
        run.reported.start,
        run.reported.end,
        run.source.rate_hz(),
    );
    if run.source.raised_m() > 0.0 {
        say!("raised by {:.0} m to stay clear of this scene's ground", run.source.raised_m());
    }
    let finished = fly(&mut run, &mut overfly);
    // Whatever the loader still waits for, nobody needs it any more.
    overfly.close();
    let finished = finished?;
    if let Some(recorder) = run.recorder.take() {
        let frames = recorder.frames();
        recorder.finish()?;
        let path = places.record.as_ref().expect("there was a recorder");
        say!("recorded {frames} frames, lead-in included: {}", path.display());
    }
    say!("{}", report::table(&run.columns).trim_end());
    say!("digest {:016x} of {} frames", run.digest.value(), run.digest.frames());
    if let Some(path) = &places.json {
        let facts = json::Facts {
            flight: run.source.name(),
            scene: &scene_name,
            settings_digest: run.scene.digest(),
            workers,
            first_frame: run.reported.start,
            digest: run.digest.value(),
            diverged: run.diverged,
        };
        write_whole(path, json::text(&facts, &run.columns).as_bytes())?;
        say!("wrote {}", path.display());
    }
    for file in run.pictures.finish()? {
        say!("wrote {}", file.display());
    }
    if let Some(folder) = &run.video {
        let (folder, rate_hz) = (folder.display(), run.source.rate_hz());
        say!("wrote the frames to {folder}; a video of them, where ffmpeg is installed:");
        let input = format!("-framerate {rate_hz} -i {folder}/frame-%06d.png");
        say!("  ffmpeg {input} -c:v libx264 -pix_fmt yuv420p {folder}/flight.mp4");
    }
    let messages = overfly.with_renderer(|renderer| renderer.validation_messages());
    let messages = messages.unwrap_or_default();
    messages.iter().for_each(|message| eprintln!("overfly: validation: {message}"));
    if arguments.validate {
        say!("validation messages: {}", messages.len());
    }
    let code = verdict((&run.source, &run.reported), run.diverged, finished);
    Ok(if messages.is_empty() { code } else { ExitCode::from(DIVERGED) })
}

/// An archive that cannot be opened: a recording knows its name, and not always its place.
fn named(error: OpenError, is_recording: bool, arguments: &Arguments) -> Failure {
    if is_recording && arguments.scene.is_none() && matches!(error, OpenError::Source(_)) {
        let hint = "the recording's scene names it so; --scene FILE says where it is now";
        return format!("{error} ({hint})").into();
    }
    error.into()
}

fn verdict(
    (source, reported): (&Source, &Range<usize>),
    diverged: Option<(usize, &'static str)>,
    finished: bool,
) -> ExitCode {
    match source.ending() {
        None | Some(Ending::Complete) => {}
        Some(Ending::Unfinished) => {
            say!("the file has no end mark: its writer was stopped after its last frame");
        }
        Some(Ending::Damaged(error)) => {
            let lead_in = source.lead_in();
            eprintln!(
                "overfly: {error} ({lead_in} of them lead-in); the frames before it were played"
            );
        }
    }
    if let Some((frame, stage)) = diverged {
        eprintln!("overfly: diverged from the recording in frame {frame}, stage {stage}");
        return ExitCode::from(DIVERGED);
    }
    if matches!(source.ending(), Some(Ending::Damaged(_))) {
        return ExitCode::from(BAD_INPUT);
    }
    if !finished {
        eprintln!("overfly: interrupted; everything up to here was kept");
        return ExitCode::from(INTERRUPTED);
    }
    if source.is_followed() {
        say!("same as recorded");
    } else if source.is_recording() {
        let first = reported.start;
        say!("the terrain came up at frame {first}: not held against what was recorded");
        say!("(--from-start runs the recording from its beginning and does that)");
    }
    ExitCode::SUCCESS
}

/// The scene to use, and how it is called: what was asked for, else the recording's own, else Earth.
fn scene_of(
    arguments: &Arguments,
    header: Option<&Header>,
) -> Result<(String, SceneSettings), Failure> {
    match (&arguments.scene, header) {
        (Some(name), _) => Ok((name.clone(), config::load(name)?)),
        (None, Some(header)) if !header.scene_text.is_empty() => {
            let name = format!("the scene in {}", arguments.flight);
            let scene = config::read(&header.scene_text, &name)?;
            Ok((name, scene))
        }
        (None, _) => Ok(("earth".into(), config::load("earth")?)),
    }
}

/// As many threads as there are cores, the caller among them.
pub fn default_workers() -> usize {
    std::thread::available_parallelism().map_or(0, |cores| cores.get() - 1).min(64)
}

/// Where the run writes to.
struct Places {
    record: Option<PathBuf>,
    json: Option<PathBuf>,
}

/// Checks every output before anything runs; none may be an input or another output.
fn places(arguments: &Arguments) -> Result<Places, Failure> {
    let mut taken = read_by([Some(&arguments.flight), arguments.scene.as_ref()]);
    let mut place = |path: &Option<PathBuf>| -> Result<Option<PathBuf>, Failure> {
        path.as_deref().map(|path| place_of(path, &mut taken)).transpose()
    };
    let places = Places { record: place(&arguments.record)?, json: place(&arguments.json)? };
    for (option, folder) in [("--out", &arguments.out), ("--video", &arguments.video)] {
        if let Some(folder) = folder.as_ref().filter(|path| path.exists() && !path.is_dir()) {
            let folder = folder.display();
            return Err(format!("{option} {folder}: is there and is not a folder").into());
        }
    }
    Ok(places)
}

fn prepare(
    arguments: &Arguments,
    places: &Places,
    scene: SceneSettings,
    overfly: &mut Overfly,
) -> Result<Run, Failure> {
    let mut source = Source::open(&arguments.flight, &scene, overfly)?;
    let count = source.frames();
    let reported = arguments.frames.clone().unwrap_or(0..count);
    if count == 0 {
        verdict((&source, &reported), None, true);
        let lead_in = source.lead_in();
        return Err(format!(
            "{} holds no frame beyond {lead_in} in which the terrain came up",
            arguments.flight
        )
        .into());
    }
    if reported.end > count {
        let name = &arguments.flight;
        let asked = format!("{}..{}", reported.start, reported.end);
        return Err(format!("--frames {asked}: {name} has {count} frames, 0..{count}").into());
    }
    let is_recording = source.is_recording();
    if arguments.from_start && !is_recording {
        return Err("--from-start: a flight has no states to be held against".into());
    }
    if is_recording && reported.start > 0 && !arguments.from_start {
        source.forget_states();
    }
    if is_recording && (arguments.size.is_some() || arguments.loader_delay_ms.is_some()) {
        return Err("--size and --loader-delay-ms do not go with a recording: it holds both".into());
    }
    if source.is_followed() && arguments.record.is_some() && arguments.frames.is_some() {
        let how = "recorded whole, or a clip of it that does not run from its start";
        return Err(format!("--record of a recording that runs from its start: it is {how}").into());
    }
    let size_px = source.size_px().or(arguments.size).unwrap_or([1280, 720]);
    overfly.looks_mut().show = arguments.view;
    let draws = !arguments.no_render && add_renderer(overfly, &scene, size_px, arguments.validate)?;
    let stills = arguments.stills.map_or(0, usize::from);
    let delay_s = f64::from(arguments.loader_delay_ms.unwrap_or(0)) / 1e3;
    let delay = (0..).find(|&frames| f64::from(frames) >= delay_s * source.rate_hz());
    let folder = PathBuf::from("out").join(source.name());
    let recorder = places.record.as_ref().map(|path| {
        let mut header = Header::recording(source.name(), source.rate_hz(), &scene)
            .over_contents(&overfly.sources().contents());
        header.scene_text = scene_text(arguments, &source);
        Writer::create(path, &header)
    });
    Ok(Run {
        ran: if source.is_followed() { 0..reported.end } else { reported.clone() },
        stills: chosen(reported.start, reported.len(), stills),
        draws,
        size_px,
        delay: usize::try_from(delay.unwrap_or(0_u32))?,
        coming: VecDeque::new(),
        count: 0,
        loader: overfly.loader(default_workers().max(1))?,
        recorder: recorder.transpose()?,
        named: BTreeSet::new(),
        columns: Columns::new(places.json.is_some()),
        digest: RunDigest::default(),
        diverged: None,
        video: arguments.video.clone().filter(|_| draws),
        pictures: Stills::new(arguments.out.clone().unwrap_or(folder), source.name()),
        reported,
        source,
        scene,
    })
}

/// The scene as text, so that a recording is whole in itself.
fn scene_text(arguments: &Arguments, source: &Source) -> String {
    match (&arguments.scene, source.header()) {
        (None, Some(header)) => header.scene_text.clone(),
        (name, _) => {
            let name = name.as_deref().unwrap_or("earth");
            let preset = config::preset(name).map(str::to_owned);
            preset.unwrap_or_else(|| std::fs::read_to_string(name).unwrap_or_default())
        }
    }
}

/// Gives the terrain a renderer; says so and goes on where there is no Vulkan.
fn add_renderer(
    overfly: &mut Overfly,
    scene: &SceneSettings,
    size_px: [u32; 2],
    validation: bool,
) -> Result<bool, Failure> {
    let limits = overfly.terrain().limits();
    let settings = RendererSettings { validation, ..RendererSettings::of(scene, limits, size_px) };
    match Renderer::new(&settings) {
        Ok(renderer) => {
            say!("drawing on {}", renderer.device_line());
            overfly.set_renderer(renderer);
            Ok(true)
        }
        Err(error) => {
            say!("not drawing: {error}");
            Ok(false)
        }
    }
}

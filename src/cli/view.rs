//! `overfly view`: from arguments to a window, from a window to lines and an exit code.
//!
//! In:    a flight or recording, a scene, where to begin, the options.
//! Out:   a window; a recording, screenshots; an exit code.
//! Keeps: nothing.
//! Not here: everything that happens in the window (`viewer`).

use super::replay::{default_workers, parse_size};
use super::source::recording_header;
use super::still::parse_show;
use super::{DIVERGED, Failure, NO_DEVICE, place_of, read_by};
use crate::viewer::fly::Eye;
use crate::viewer::screenshot::Sidecar;
use crate::viewer::script::{STEPS, Script};
use crate::viewer::session::{Plan, scene_of};
use crate::viewer::window::{self, NoScreen, Options, Summary};
use crate::viewer::{keys, script};
use overfly::config;
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::render_vk::Show;
use std::path::PathBuf;
use std::process::ExitCode;

/// What `view` takes.
#[derive(clap::Args)]
#[command(after_help = after_help())]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles), an .ovf file or one that `import` reads,
    /// to follow. Without one, or with --at, the eye is free.
    flight: Option<String>,
    /// A scene file or a preset (earth, moon, small). [default: the recording's own, else earth]
    #[arg(long)]
    scene: Option<String>,
    /// Where to begin: degrees, and metres above the ellipsoid.
    #[arg(long, value_name = "LAT,LON,ALT", value_parser = parse_place, allow_hyphen_values = true)]
    at: Option<Geodetic>,
    /// Where to look at first: degrees clockwise from north, and upwards.
    #[arg(long, value_name = "HEADING,PITCH", value_parser = parse_look, requires = "at",
          allow_hyphen_values = true, default_value = "0,-10")]
    look: [f64; 2],
    /// Size of the window at first, in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1280x720")]
    size: [u32; 2],
    /// What the ground is coloured by at first: shaded, wireframe, level, error, residency,
    /// normals, range or culled.
    #[arg(long, value_name = "NAME", value_parser = parse_show, default_value = "shaded")]
    view: Show,
    /// Begins where a screenshot was taken: the .ron beside it, with its scene, tolerance and sun.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["flight", "at", "record", "view"])]
    sidecar: Option<PathBuf>,
    /// Worker threads beside the main one, 0 to 64.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=64))]
    workers: Option<u8>,
    /// Records views, page arrivals and digests of every frame, for `overfly replay`.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Folder for screenshots.
    #[arg(long, value_name = "DIR", default_value = "out/view")]
    out: PathBuf,
    /// Closes the window after N frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Draws with Vulkan's validation layer; any message makes the exit code 1.
    #[arg(long)]
    validate: bool,
    /// Does what hands would do, for tests and demonstrations: steps with `;` between them, 60
    /// frames to a second. See below.
    #[arg(long, value_name = "STEPS")]
    script: Option<String>,
}

fn after_help() -> String {
    let keys: Vec<String> = keys::help().iter().map(|line| format!("  {line}")).collect();
    format!(
        "Keys (letters by their places on a US keyboard):\n{}\n\nSteps of a script: {STEPS}.\n\n\
         Examples:\n  overfly view\n  overfly view rainier --record flown.ovf\n  \
         overfly view --at 46.85,-121.76,5000 --look 180,-20\n  \
         overfly view --scene moon --script \"frames 60; key W 120; key P; quit\"",
        keys.join("\n")
    )
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let numbers: [f64; N] = numbers?.try_into().ok()?;
    numbers.iter().all(|number| number.is_finite()).then_some(numbers)
}

fn parse_place(text: &str) -> Result<Geodetic, String> {
    let fits = |[lat, lon, alt]: &[f64; 3]| {
        lat.abs() <= 90.0 && (-180.0..=360.0).contains(lon) && (-1e4..=1e8).contains(alt)
    };
    let place = numbers(text).filter(fits);
    let [lat, lon, alt] = place.ok_or_else(|| {
        format!(
            "`{text}` is not LAT,LON,ALT: degrees from -90 to 90 and -180 to 360, metres from \
             -10000 to 100000000"
        )
    })?;
    Ok(Geodetic::from_degrees(lat, lon, alt))
}

fn parse_look(text: &str) -> Result<[f64; 2], String> {
    let fits = |[heading, pitch]: &[f64; 2]| heading.abs() <= 360.0 && pitch.abs() <= 90.0;
    numbers(text).filter(fits).ok_or_else(|| {
        format!("`{text}` is not HEADING,PITCH: degrees from -360 to 360 and -90 to 90")
    })
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let options = options(arguments)?;
    let Summary { frames, resizes, recorded, validation } = match window::run(options) {
        Ok(summary) => summary,
        Err(error) if error.is::<NoScreen>() => {
            eprintln!("overfly: {error}");
            return Ok(ExitCode::from(NO_DEVICE));
        }
        Err(error) => return Err(error),
    };
    say!("{frames} frames, {resizes} resizes");
    if let Some((frames, path)) = recorded {
        say!("recorded {frames} frames: {}", path.display());
    }
    validation.iter().for_each(|message| eprintln!("overfly: validation: {message}"));
    if arguments.validate {
        say!("validation messages: {}", validation.len());
    }
    Ok(if validation.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(DIVERGED) })
}

fn options(arguments: &Arguments) -> Result<Options, Failure> {
    let mut taken = read_by([arguments.flight.as_ref(), arguments.scene.as_ref()]);
    let record = arguments.record.as_deref().map(|path| place_of(path, &mut taken)).transpose()?;
    let script = arguments.script.as_ref().map(|text| text.parse::<Script>()).transpose();
    let script = script.map_err(|fault: script::ScriptFault| format!("--script: {fault}"))?;
    let (begin, (scene_name, scene_text, scene)) = begin(arguments)?;
    Ok(Options {
        plan: Plan {
            scene_name,
            scene_text,
            scene,
            workers: arguments.workers.map_or_else(default_workers, usize::from),
            flight: arguments.flight.clone(),
            eye: begin.eye,
            record,
            pictures: arguments.out.clone(),
            show: begin.show,
            validate: arguments.validate,
        },
        size_px: begin.size_px,
        frames: arguments.frames,
        script,
    })
}

/// Where a window begins.
struct Begin {
    eye: Option<Eye>,
    show: Show,
    size_px: [u32; 2],
}

/// Name, text and settings.
type Scene = (String, String, SceneSettings);

/// Where to begin, and in which scene: as a screenshot was taken, or as the arguments say.
fn begin(arguments: &Arguments) -> Result<(Begin, Scene), Failure> {
    let Some(path) = &arguments.sidecar else {
        let [heading, pitch] = arguments.look.map(Radians::from_degrees);
        let eye = arguments.at.map(|at| Eye::new(at, heading, pitch));
        let begin = Begin { eye, show: arguments.view, size_px: arguments.size };
        return Ok((begin, scene(arguments)?));
    };
    let sidecar = Sidecar::read(path)?;
    let scene = sidecar.scene(arguments.scene.as_deref())?;
    let view = sidecar.view();
    let show = parse_show(&sidecar.show)?;
    let eye = Some(Eye::of_view(&view, &scene.2.body));
    Ok((Begin { eye, show, size_px: view.size_px }, scene))
}

/// The scene of the arguments; a recording brings its own.
fn scene(arguments: &Arguments) -> Result<Scene, Failure> {
    let header = arguments.flight.as_deref().map(recording_header).transpose()?.flatten();
    match (&arguments.scene, header) {
        (None, Some(header)) if !header.scene_text.is_empty() => {
            let name = format!("the scene in {}", header.name);
            let scene = config::read(&header.scene_text, &name)?;
            Ok((name, header.scene_text, scene))
        }
        (name, _) => {
            let name = name.as_deref().unwrap_or("earth");
            let (text, scene) = scene_of(name)?;
            Ok((name.to_owned(), text, scene))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_looks_are_read_and_refused_with_their_ranges() {
        let place = parse_place("-33.9, 151.2, 30").unwrap();
        assert_eq!(place, Geodetic::from_degrees(-33.9, 151.2, 30.0));
        assert_eq!(parse_look("270,-90"), Ok([270.0, -90.0]));
        for text in ["", "1,2", "91,0,0", "0,0,1e9", "0,0,NaN", "1,2,3,4"] {
            assert!(parse_place(text).unwrap_err().contains("LAT,LON,ALT"), "{text}");
        }
        for text in ["10", "0,91", "400,0", "north,0"] {
            assert!(parse_look(text).unwrap_err().contains("HEADING,PITCH"), "{text}");
        }
    }

    #[test]
    fn help_has_every_key_and_every_step() {
        let help = after_help();
        assert!(keys::help().iter().all(|line| help.contains(line)));
        assert!(help.contains("resize WxH"));
    }
}

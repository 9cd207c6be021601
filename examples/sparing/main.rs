//! Counts what a scene without any optional part costs, for holding one build against another.
//!
//! In:    `--with PART`: a part that the picture has all the same.
//! Out:   a line a count, `name value`; 2 if this build lacks the part, in words.
//! Keeps: nothing.
//! Not here: which builds are held against each other (`cargo xtask sparing`).
//!
//! The scene has a sun, a sea, imagery, morphs or several depth ranges as little as it has a sky. A
//! build without Vulkan says the lines of the frames alone.

#[path = "../../tests/counting.rs"]
mod counting;
#[cfg(feature = "vulkan")]
mod picture;
#[cfg(not(feature = "vulkan"))]
#[path = "no_picture.rs"]
mod picture;
#[cfg(feature = "vulkan")]
mod tap;

use overfly::core::frame::{FrameInput, FrameOutput};
use overfly::core::settings::SceneSettings;
use overfly::{Overfly, config, replay};
use std::error::Error;
use std::process::ExitCode;

/// What a picture may have besides bare ground.
const PARTS: [&str; 6] = ["sea", "sun", "imagery", "sky", "debug", "overlay"];
/// Frames of the flight, from the first: the terrain comes up in them.
const FRAMES: usize = 240;
const SIZE_PX: [u32; 2] = [320, 180];

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let part = match words[..] {
        [] => None,
        ["--with", part] if PARTS.contains(&part) => Some(part),
        _ => {
            eprintln!("usage: sparing [--with PART], allowed are {}", PARTS.join(", "));
            return ExitCode::from(2);
        }
    };
    match fly().and_then(|()| picture::draw(&bare(), SIZE_PX, part)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sparing: {error}");
            ExitCode::from(2)
        }
    }
}

/// The small planet, and nothing that it could do without.
fn bare() -> SceneSettings {
    let mut scene = config::load("small").expect("it is a preset");
    (scene.sea, scene.sun) = (false, None);
    scene.lod.morph_s = 0.0;
    scene.depth.splits_m.clear();
    scene
}

/// Opens the scene and flies without drawing. Pages are made between frames, where nothing counts.
fn fly() -> Result<(), Box<dyn Error>> {
    let scene = bare();
    let before = counting::so_far();
    let mut overfly = Overfly::new(&scene, 0)?;
    say_heap("open", before);
    let mut loader = overfly.loader(1)?;
    let flight = overfly.flight("descent")?;
    let (mut input, mut output) = (FrameInput::default(), FrameOutput::default());
    let (mut sums, mut digest) = (Vec::new(), 0_u64);
    let mut heap = counting::so_far();
    for pose in &flight.poses[..FRAMES] {
        input.views.clear();
        input.views.push(replay::view_of(pose, &scene.views[0], SIZE_PX, &scene.body));
        let before = counting::so_far();
        loader.fetch(&output.wanted, &mut input.arrived);
        let fetched = counting::so_far();
        heap = [0, 1].map(|i| heap[i] + fetched[i] - before[i]);
        overfly.frame(&mut input, &mut output)?;
        let counts = output.counts.columns();
        sums.resize(counts.len(), ("", 0.0));
        for (sum, (name, count)) in sums.iter_mut().zip(counts) {
            *sum = (name, sum.1 + count);
        }
        digest = output.digest.parts().iter().fold(digest, |all, part| all.rotate_left(1) ^ part);
    }
    say_heap("frames", heap);
    let jobs: Vec<_> = overfly.spans().stages().map(|record| record.span.0).collect();
    println!("frames.jobs {}", jobs.join(","));
    sums.iter().for_each(|(name, sum)| println!("frames.{name} {sum}"));
    println!("frames.digest {digest:016x}");
    Ok(())
}

/// What was allocated since `before`.
fn say_heap(what: &str, before: [u64; 2]) {
    let [calls, bytes] = counting::so_far();
    println!("{what}.allocations {}\n{what}.bytes {}", calls - before[0], bytes - before[1]);
}

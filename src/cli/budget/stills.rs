//! What was seen in the worst frames of a run.
//!
//! In:    the plan of the run, the frames; a Vulkan device.
//! Out:   small pictures, as JPEG.
//! Keeps: nothing.
//! Not here: which frames are worst (`html`), drawing (`overfly::render_vk`).
//!
//! The flight is flown once more: to draw a frame takes time of its own, which is in no figure.

use super::fly::Plan;
use crate::cli::Failure;
use crate::cli::flown::Flown;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};
use image::{DynamicImage, RgbaImage};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::render_vk::{Renderer, RendererSettings};
use std::sync::atomic::{AtomicBool, Ordering};

/// Width of a still in pixels.
const WIDTH_PX: u32 = 480;
/// JPEG's, of 100.
const QUALITY: u8 = 80;
/// Frames that are flown before one that is drawn, after the terrain has come up.
const RUN_UP: usize = 30;

/// One of them.
pub struct Still {
    /// Frame of the columns.
    pub frame: usize,
    /// A JPEG file.
    pub jpeg: Vec<u8>,
}

/// Draws frames of the run, ascending or not; `first` is the flight's frame of the columns' first.
/// A stop ends it early with what there is. `None`, and why it was told, where there is no Vulkan.
pub fn draw(
    plan: &Plan,
    (first, frames): (usize, &[usize]),
    stop: &AtomicBool,
) -> Result<Result<Vec<Still>, String>, Failure> {
    let mut flown = Flown::open(&plan.flight, &plan.scene, plan.manner)?;
    let size_px = flown.source.size_px().unwrap_or(plan.manner.size_px);
    let limits = flown.overfly.terrain().limits();
    let renderer = match Renderer::new(&RendererSettings::of(&plan.scene, limits, size_px)) {
        Ok(renderer) => renderer,
        Err(error) => return Ok(Err(format!("The worst frames have no stills: {error}."))),
    };
    flown.overfly.set_renderer(renderer);
    let mut ordered = frames.to_vec();
    ordered.sort_unstable();
    let style = "{bar:40} {pos}/{len} stills, {eta} left";
    let bar = ProgressBar::new(ordered.len() as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    let is_recording = flown.source.size_px().is_some();
    let (mut next, mut stills) = (0, Vec::new());
    for frame in ordered {
        let at = first + frame;
        if !is_recording || next == 0 {
            // A recording is played from its beginning.
            next = if is_recording { 0 } else { at.saturating_sub(RUN_UP) };
            if !flown.lead_in(next, stop)? {
                break;
            }
        }
        while next < at && !stop.load(Ordering::Relaxed) {
            flown.frame(next)?;
            next += 1;
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let pixels = flown.frame_drawn(at)?;
        next = at + 1;
        stills.push(Still { frame, jpeg: jpeg(size_px, pixels)? });
        bar.inc(1);
    }
    bar.finish_and_clear();
    flown.overfly.close();
    Ok(Ok(stills))
}

/// RGBA rows, top first, as a small JPEG.
fn jpeg(size_px: [u32; 2], pixels: Vec<u8>) -> Result<Vec<u8>, Failure> {
    let [width, height] = size_px;
    let picture = RgbaImage::from_raw(width, height, pixels)
        .ok_or("the renderer gave a picture of another size")?;
    let small = WIDTH_PX.min(width);
    let picture = resize(&picture, small, (small * height / width).max(1), FilterType::Triangle);
    let mut bytes = Vec::new();
    DynamicImage::from(picture)
        .to_rgb8()
        .write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY))?;
    Ok(bytes)
}

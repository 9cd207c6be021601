//! A host with its own Vulkan device: overfly records into the host's command buffers.
//!
//! In:    `--out FILE`.
//! Out:   a PNG of hills; device and validation messages on standard output; 1 if there are any.
//! Keeps: nothing.
//! Not here: the host's Vulkan (`host_vulkan`, `host_vulkan/frames.rs` first).

mod host_vulkan;

use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::frames::{Pane, draw};
use host_vulkan::host::{Host, Idle};
use host_vulkan::journey::{Eye, Journey};
use host_vulkan::{Outcome, finish, out_file};
use overfly::render_vk::{HostRenderer, RendererSettings};
use std::process::ExitCode;
use std::rc::Rc;

const SIZE_PX: [u32; 2] = [960, 540];
/// Frames that fly after the terrain has come up.
const FRAMES: u32 = 8;
const START: Eye =
    Eye { lat_deg: 46.85, lon_deg: -121.76, above_m: 900.0, heading_deg: 40.0, pitch_deg: -8.0 };

fn main() -> Outcome<ExitCode> {
    let file = out_file("own_vulkan.png")?;
    let host = Rc::new(Host::new()?);
    let (messages, validates) = (host.messages(), host.validates);
    let pixels = fly(&host)?;
    // Everything that was made of the device is gone: now the layer tells what was forgotten.
    drop(host);
    finish(&file, (&pixels, SIZE_PX), validates.then_some(&messages))
}

fn fly(host: &Rc<Host>) -> Outcome<Vec<u8>> {
    let mut journey = Journey::earth(SIZE_PX)?;
    let settings = RendererSettings { frames_in_flight: IN_FLIGHT, ..journey.settings() };
    let mut canvas = Canvas::new(host, SIZE_PX, &settings)?;
    // SAFETY: the handles are the host's own, as it says, and outlive the renderer; the queue is
    // used by this thread only; `_idle` is dropped before the renderer.
    let renderer = unsafe { HostRenderer::new(&settings, &host.lend(), &canvas.target()) };
    let mut renderer = renderer?;
    let _idle = Idle(host);
    renderer.note_tiles(&journey.overfly.terrain().tiles());
    journey.settle(START, &mut [&mut renderer])?;
    for step in 0..FRAMES {
        let eye = Eye { lon_deg: START.lon_deg + 1e-4 * f64::from(step), ..START };
        journey.frame(eye, &mut [&mut renderer])?;
        let Journey { overfly, output, .. } = &mut journey;
        let drawn = overfly.with_picture(output, 0, |picture| {
            let pane = Pane { renderer: &mut renderer, picture, at_px: [0, 0] };
            draw(&mut canvas, &mut [pane], |_, _| {})
        });
        drawn.ok_or("the frame has a view")??;
    }
    canvas.read_pixels()
}

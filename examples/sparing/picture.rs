//! Pictures of a scene on a host's device, every call counted.
//!
//! In:    a scene; a part that the pictures have besides the ground.
//! Out:   lines: calls of Vulkan by name, a digest of all, memory, the report, the pixels.
//! Keeps: nothing.
//! Not here: the calls (`tap`), the host's own (`host_vulkan`).

#[allow(dead_code, reason = "an example of its own, of which this needs a part")]
#[path = "../host_vulkan/mod.rs"]
mod host_vulkan;

use crate::tap;
use glam::DVec3;
use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::host::{Host, Idle};
use host_vulkan::journey::{Eye, Journey};
use overfly::core::scene::FrameParts;
use overfly::core::settings::SceneSettings;
use overfly::jobs::Team;
use overfly::render_vk::{
    Backdrop, DrawReport, HostDevice, HostFrame, HostRenderer, Overlay, Picture, RendererSettings,
    Show,
};
use std::error::Error;
use std::rc::Rc;

/// Pictures of the same view: the first uploads all, the others nothing.
const PICTURES: usize = 3;
const EYE: Eye =
    Eye { lat_deg: 20.0, lon_deg: 30.0, above_m: 900.0, heading_deg: 40.0, pitch_deg: -50.0 };

/// Draws, where there is a device.
pub fn draw(
    scene: &SceneSettings,
    size_px: [u32; 2],
    part: Option<&str>,
) -> Result<(), Box<dyn Error>> {
    let host = match Host::new() {
        Ok(host) => Rc::new(host),
        Err(error) => {
            println!("skipped: pictures, since there is no Vulkan ({error})");
            return Ok(());
        }
    };
    let mut journey = Journey::new(scene.clone(), size_px)?;
    let imagery = part == Some("imagery");
    let settings = RendererSettings { imagery, frames_in_flight: IN_FLIGHT, ..journey.settings() };
    let mut canvas = Canvas::new(&host, size_px, &settings)?;
    let lent = HostDevice { device: tap::tapped(&host.device), ..host.lend() };
    // SAFETY: the handles are the host's own, and outlive the renderer; functions of the device are
    // passed on; the queue is used by this thread only; `_idle` is dropped before the renderer.
    let mut renderer = unsafe { HostRenderer::new(&settings, &lent, &canvas.target()) }?;
    let _idle = Idle(&host);
    journey.settle(EYE, &mut [&mut renderer])?;
    let mut report = DrawReport::default();
    // The scene has no archive of imagery, so a renderer that is made for it has nothing to draw.
    for _ in 0..if imagery { 0 } else { PICTURES } {
        let Journey { overfly, output, .. } = &mut journey;
        let drawn = overfly.with_picture(output, 0, |picture| {
            draw_one(&mut canvas, &mut renderer, (picture, part))
        });
        report = drawn.ok_or("the frame has a view")??;
    }
    tap::calls().iter().for_each(|(name, count)| println!("vulkan.{name} {count}"));
    println!("vulkan.digest {:016x}", tap::digest());
    let totals = renderer.device_totals();
    println!("vulkan.memory {} of {} bytes", totals.allocations, totals.bytes);
    println!("vulkan.pipelines {}", report.pipelines);
    println!("vulkan.draws {} in {} commands", report.draws, report.commands);
    println!("picture.digest {:016x}", tap::fold(0, &canvas.read_pixels()?));
    Ok(())
}

/// One picture, with the part.
fn draw_one(
    canvas: &mut Canvas,
    renderer: &mut HostRenderer,
    (bare, part): (&Picture<'_>, Option<&str>),
) -> Result<DrawReport, Box<dyn Error>> {
    let has = |name| part == Some(name);
    let mut overlay = Overlay::default();
    if has("overlay") {
        overlay.text([2.0, 2.0], 1.0, [255; 4], "more");
    }
    let parts = FrameParts { sea: has("sea"), sun_direction: has("sun").then_some(DVec3::X) };
    let picture = Picture {
        parts: &parts,
        show: if has("debug") { Show::Normals } else { Show::Shaded },
        overlay: &overlay,
        backdrop: if has("sky") { Backdrop::Sky } else { Backdrop::Colour([0.0; 3]) },
        ..*bare
    };
    let (buffer, index) = canvas.begin()?;
    let frame = HostFrame { buffer, index };
    // SAFETY: the buffer is being recorded, outside the pass, then in it, then outside again; `begin`
    // has waited for the frame that had this index; overfly's pipelines were made for this pass.
    let report = unsafe {
        let report = renderer.record_uploads(frame, &picture, &Team::alone())?;
        canvas.begin_pass(buffer);
        renderer.record_range(frame, 0, [0, 0])?;
        renderer.record_overlay(frame, [0, 0])?;
        canvas.host.device.cmd_end_render_pass(buffer);
        report
    };
    canvas.submit()?;
    Ok(report)
}

//! A host's cockpit among overfly's ground: both in the nearest depth range, by one depth buffer.
//!
//! In:    `--out FILE`.
//! Out:   a PNG from the seat of a parked aircraft, whose wheels are partly in the ground; messages
//!        of the validation layer on standard output; 1 if there are any.
//! Keeps: nothing.
//! Not here: the host's Vulkan (`host_vulkan`).

mod host_vulkan;

use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::frames::{Pane, draw};
use host_vulkan::host::{Host, Idle};
use host_vulkan::journey::{Eye, Journey};
use host_vulkan::solids::{Corner, Solids};
use host_vulkan::{Outcome, finish, out_file};
use overfly::render_vk::{HostRenderer, RendererSettings, projection};
use std::process::ExitCode;
use std::rc::Rc;

const SIZE_PX: [u32; 2] = [960, 540];
const SEAT: Eye =
    Eye { lat_deg: 46.85, lon_deg: -121.76, above_m: 1.4, heading_deg: 300.0, pitch_deg: -24.0 };
const DARK: [f32; 3] = [0.02, 0.02, 0.025];
const GREY: [f32; 3] = [0.12, 0.12, 0.13];
const RED: [f32; 3] = [0.5, 0.03, 0.02];

fn main() -> Outcome<ExitCode> {
    let file = out_file("cockpit.png")?;
    let host = Rc::new(Host::new()?);
    let (messages, validates) = (host.messages(), host.validates);
    let pixels = sit(&host)?;
    drop(host);
    finish(&file, (&pixels, SIZE_PX), validates.then_some(&messages))
}

fn sit(host: &Rc<Host>) -> Outcome<Vec<u8>> {
    let mut journey = Journey::earth(SIZE_PX)?;
    let settings = RendererSettings { frames_in_flight: IN_FLIGHT, ..journey.settings() };
    let order = settings.depth_order;
    let mut canvas = Canvas::new(host, SIZE_PX, &settings)?;
    let solids = Solids::new(&canvas, &cockpit(), order)?;
    // SAFETY: the handles are the host's own, as it says, and outlive the renderer; the queue is
    // used by this thread only; `_idle` is dropped before the renderer.
    let renderer = unsafe { HostRenderer::new(&settings, &host.lend(), &canvas.target()) };
    let mut renderer = renderer?;
    let _idle = Idle(host);
    renderer.note_tiles(&journey.overfly.terrain().tiles());
    journey.settle(SEAT, &mut [&mut renderer])?;
    let Journey { overfly, output, .. } = &mut journey;
    let drawn = overfly.with_picture(output, 0, |picture| {
        // The cockpit is drawn as the nearest range's ground is, right after it.
        let nearest = projection(picture.view, 0, order).ok_or("a view has a nearest range")?;
        let pane = Pane { renderer: &mut renderer, picture, at_px: [0, 0] };
        draw(&mut canvas, &mut [pane], |canvas, buffer| {
            // SAFETY: `draw` calls this inside the canvas's pass.
            unsafe { solids.draw(canvas, buffer, &nearest) };
        })
    });
    drawn.ok_or("the frame has a view")??;
    canvas.read_pixels()
}

/// Everything between 0.3 and 2.5 m before the eye: x right, y up, z backward, metres.
fn cockpit() -> Vec<Corner> {
    let mut all = Vec::new();
    // The panel below, its glare shield, the rim of the roof.
    quad(
        &mut all,
        DARK,
        [[-1.0, -0.9, -0.5], [1.0, -0.9, -0.5], [1.0, -0.33, -0.6], [-1.0, -0.33, -0.6]],
    );
    quad(
        &mut all,
        GREY,
        [[-1.0, -0.33, -0.6], [1.0, -0.33, -0.6], [0.8, -0.36, -0.75], [-0.8, -0.36, -0.75]],
    );
    quad(
        &mut all,
        DARK,
        [[-0.6, 0.215, -0.4], [0.6, 0.215, -0.4], [0.6, 0.3, -0.3], [-0.6, 0.3, -0.3]],
    );
    for side in [-1.0, 1.0] {
        let at = |[x, y, z]: [f32; 3]| [side * x, y, z];
        // A pillar, the leg of a wheel, and the wheel, which stands in the grass.
        quad(
            &mut all,
            GREY,
            [[0.62, -0.35, -0.6], [0.66, -0.35, -0.6], [0.42, 0.4, -0.5], [0.38, 0.4, -0.5]]
                .map(at),
        );
        quad(
            &mut all,
            RED,
            [[0.2, -0.2, -1.2], [0.28, -0.2, -1.2], [0.62, -0.76, -2.1], [0.54, -0.76, -2.1]]
                .map(at),
        );
        wheel(&mut all, at([0.58, -0.82, -2.1]), 0.17);
    }
    all
}

/// A disc that faces the eye: corners of a dodecagon, in quarters of a turn.
fn wheel(all: &mut Vec<Corner>, [x, y, z]: [f32; 3], radius_m: f32) {
    let first = [[1.0, 0.0], [0.866, 0.5], [0.5, 0.866]];
    let quarter = |[u, v]: [f32; 2]| [-v, u];
    let mut rim: Vec<[f32; 2]> = first.to_vec();
    for corner in 3..12 {
        rim.push(quarter(rim[corner - 3]));
    }
    let corner = |[u, v]: [f32; 2]| [x + radius_m * u, y + radius_m * v, z];
    for (from, to) in (0..12).map(|i| (rim[i], rim[(i + 1) % 12])) {
        let corners = [[x, y, z], corner(from), corner(to)];
        all.extend(corners.map(|at_m| Corner { at_m, colour: DARK }));
    }
}

/// Two triangles.
fn quad(all: &mut Vec<Corner>, colour: [f32; 3], corners: [[f32; 3]; 4]) {
    let [a, b, c, d] = corners.map(|at_m| Corner { at_m, colour });
    all.extend([a, b, c, a, c, d]);
}

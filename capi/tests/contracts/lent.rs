//! A host's Vulkan as C hands it over, and one of its frames.
//!
//! In:    the host of the root's examples; a terrain.
//! Out:   structs of the border, renderers, pictures drawn; whether there is a device.
//! Keeps: nothing.
//! Not here: what is tested (`drawing`, `renderers`).

/// What is around overfly's draws in the root's examples.
#[path = "../../../examples/host_vulkan"]
#[expect(dead_code, reason = "the examples use the rest")]
pub mod host_vulkan {
    pub mod canvas;
    pub mod frames;
    pub mod host;

    /// What most of it returns.
    pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;
}

use super::calls::*;
use host_vulkan::canvas::{Canvas, IN_FLIGHT};
use host_vulkan::host::Host;
use overfly::core::camera::{View, orientation_from_attitude};
use overfly::core::geodesy::Geodetic;
use overfly::core::settings::SceneSettings;
use overfly::core::units::Radians;
use overfly::render_vk::ash::{self, vk};
use overfly::render_vk::devices;
use overfly_c::drawing::*;
use overfly_c::frame::*;
use overfly_c::overlay::*;
use overfly_c::renderer::*;
use overfly_c::scene::ovf_edit;
use overfly_c::terrain::*;
use std::process::Command;
use std::ptr::{null, null_mut};
use std::rc::Rc;
use vk::Handle;

/// Size of the pictures.
pub const SIZE_PX: [u32; 2] = [640, 360];

/// Down at the ground of `small`, nearer with each frame.
pub fn dive(frame: usize) -> ovf_view {
    ovf_view { eye_height_m: 150.0 - frame as f64, pitch_rad: -1.0, ..look(frame) }
}

/// The same view, as the façade takes it.
pub fn dive_in_rust(frame: usize, scene: &SceneSettings) -> View {
    let (lat_rad, lon_rad, height_m) = (0.25, 0.3 + 0.001 * frame as f64, 150.0 - frame as f64);
    let at = Geodetic { lat_rad, lon_rad, height_m };
    View {
        eye: scene.body.ecef_from_geodetic(at),
        orientation: orientation_from_attitude(at, Radians(1.5), Radians(-1.0), Radians(0.0)),
        ..look_in_rust(frame, scene)
    }
}

/// Runs a frame with these views, with an edit or without.
pub fn fly_views(terrain: ovf_terrain, frame: usize, views: &[ovf_view], edit: Option<&ovf_edit>) {
    let input = ovf_frame_input {
        view_count: u32::try_from(views.len()).unwrap(),
        views: views.as_ptr(),
        time_s: frame as f64 / 60.0,
        edit: edit.map_or(null(), std::ptr::from_ref),
        ..sized()
    };
    // SAFETY: all pointers are of values that outlive the call.
    must(unsafe { ovf_terrain_frame(terrain, &raw const input, null_mut()) });
}

/// Dives so many frames.
pub fn dived(terrain: ovf_terrain, frames: usize) {
    (0..frames).for_each(|frame| fly_views(terrain, frame, &[dive(frame)], None));
}

/// Whether there is a device; says so where there is none.
pub fn device(test: &str) -> bool {
    let found = devices().is_ok_and(|devices| !devices.is_empty());
    let required = std::env::var("OVERFLY_REQUIRE_GPU").is_ok_and(|value| value == "1");
    assert!(found || !required, "OVERFLY_REQUIRE_GPU=1 and no Vulkan device");
    if !found {
        println!("{test} skipped: no Vulkan device");
    }
    found
}

/// Whether to go on. Without a device not; and the layer reads its environment when it is loaded,
/// so the test runs in a process of its own.
pub fn go_on(module: &str, test: &str) -> bool {
    const CHECKS: &str = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    if !device(test) {
        return false;
    }
    if std::env::var_os("VK_LAYER_ENABLES").is_some() {
        return true;
    }
    let mut child = Command::new(std::env::current_exe().unwrap());
    let child = child.args(["--exact", &format!("{module}::{test}"), "--nocapture"]);
    assert!(child.env("VK_LAYER_ENABLES", CHECKS).status().unwrap().success());
    false
}

/// Ends the host and asserts that the layer had nothing to say, objects that are left included.
pub fn end(host: Rc<Host>) {
    let (messages, validates) = (host.messages(), host.validates);
    assert_eq!(Rc::strong_count(&host), 1, "something of the host is still in use");
    drop(host);
    let messages = messages.lock().unwrap();
    assert!(messages.is_empty(), "{}", messages.join("\n"));
    if !validates {
        println!("messages unchecked: no validation layer");
    }
}

/// What C says of a host's device.
pub fn lent(host: &Host) -> ovf_device {
    // SAFETY: loading runs the Vulkan loader's initialisers, which are sound. The host has it too, so
    // it stays when this goes.
    let entry = unsafe { ash::Entry::load() }.unwrap();
    let find = entry.static_fn().get_instance_proc_addr;
    // SAFETY: a pointer to a function, which is cast back before it is called.
    let find = unsafe { std::mem::transmute::<vk::PFN_vkGetInstanceProcAddr, AnyFunction>(find) };
    let pointer = |raw: u64| usize::try_from(raw).unwrap() as *mut _;
    ovf_device {
        queue_family: host.family,
        api_version: vk::API_VERSION_1_1,
        debug_utils: u32::from(host.validates),
        multi_draw_indirect: 1,
        get_instance_proc_addr: Some(find),
        instance: pointer(host.instance.handle().as_raw()),
        physical_device: pointer(host.physical.as_raw()),
        device: pointer(host.device.handle().as_raw()),
        queue: pointer(host.queue.as_raw()),
        ..sized()
    }
}

/// Any function, as C names it.
pub type AnyFunction = unsafe extern "C" fn();

/// What C says of a canvas.
pub fn target(canvas: &Canvas) -> ovf_target {
    let target = canvas.target();
    let number = |format: vk::Format| u32::try_from(format.as_raw()).unwrap();
    ovf_target {
        subpass: target.subpass,
        render_pass: target.render_pass.as_raw(),
        colour_format: number(target.colour_format),
        depth_format: number(target.depth_format),
        samples: target.samples.as_raw(),
        ..sized()
    }
}

/// A renderer of a terrain for a canvas.
pub fn renderer_of(terrain: ovf_terrain, canvas: &Canvas) -> ovf_renderer {
    renderer_with(terrain, canvas, IN_FLIGHT)
}

/// The same, with so many frames in flight.
pub fn renderer_with(terrain: ovf_terrain, canvas: &Canvas, frames_in_flight: u32) -> ovf_renderer {
    let (device, target) = (lent(&canvas.host), target(canvas));
    let settings = ovf_renderer_settings { frames_in_flight, ..sized() };
    let mut renderer = ovf_renderer { bits: 0 };
    // SAFETY: the handles are good; each test waits until the device is idle before it destroys the
    // renderer, and that before canvas and host.
    must(unsafe { ovf_renderer_new_v1(terrain, &settings, &device, &target, &raw mut renderer) });
    renderer
}

/// One of the canvas's frames, as C names it.
pub fn frame_of((buffer, index): (vk::CommandBuffer, u32)) -> ovf_host_frame {
    let command_buffer = usize::try_from(buffer.as_raw()).unwrap() as *mut _;
    ovf_host_frame { index, command_buffer, ..sized() }
}

/// Records a picture as C does, and submits it.
pub fn draw_in_c(
    canvas: &mut Canvas,
    renderer: ovf_renderer,
    picture: ovf_picture,
) -> ovf_draw_report {
    let (buffer, index) = canvas.begin().unwrap();
    let frame = frame_of((buffer, index));
    let mut report = sized::<ovf_draw_report>();
    // SAFETY: all pointers are of values that outlive the calls; the buffer is being recorded,
    // outside the pass, then in it; `begin` has waited for the frame that had this index.
    unsafe {
        must(ovf_renderer_record_uploads(renderer, &frame, &picture, &raw mut report));
        canvas.begin_pass(buffer);
        for range in (0..report.ranges).rev() {
            canvas.clear_depth(buffer);
            must(ovf_renderer_record_range(renderer, &frame, range, 0, 0));
        }
        must(ovf_renderer_record_overlay(renderer, &frame, 0, 0));
        canvas.host.device.cmd_end_render_pass(buffer);
    }
    canvas.submit().unwrap();
    report
}

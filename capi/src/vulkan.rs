//! The host's Vulkan: bare handles become a renderer, and the renderer's calls are made.
//!
//! In:    handles that C vouched for, checked not to be null.
//! Out:   a renderer; copies and draws in command buffers of the host.
//! Keeps: nothing.
//! Not here: which renderer (`renderer`), what is recorded when (`drawing`).
//!
//! A [`Caller`] stands for what the host promised: the head of `overfly.h` has its rules of Vulkan.

use crate::border::Caller;
use crate::drawing::ovf_host_frame;
use crate::renderer::{ovf_device, ovf_target};
use crate::status::{Fault, OVF_NULL_POINTER};
use overfly::jobs::Team;
use overfly::render_vk::ash::vk::{self, Handle};
use overfly::render_vk::{
    DrawError, DrawReport, HostDevice, HostFrame, HostRenderer, HostTarget, Picture,
    RendererSettings, StartError,
};
use std::ffi::c_void;

/// Any function, as `ovf_device.get_instance_proc_addr` is given. The header has this spelt out.
pub type AnyFunction = unsafe extern "C" fn();

/// A renderer on a device of the host.
pub fn made(
    _: &Caller,
    settings: &RendererSettings,
    (find, device): (AnyFunction, &ovf_device),
    target: &ovf_target,
) -> Result<HostRenderer, StartError> {
    // SAFETY: the host vouched that it is `vkGetInstanceProcAddr`, cast to what C can name without
    // Vulkan's header.
    let find = unsafe { std::mem::transmute::<AnyFunction, vk::PFN_vkGetInstanceProcAddr>(find) };
    let handles = (handle(device.instance), handle(device.device));
    let debug_utils = device.debug_utils != 0;
    // SAFETY: the host vouched for the handles.
    let (instance, handle_of_device) =
        unsafe { HostDevice::functions(find, handles, debug_utils) }?;
    let host = HostDevice {
        instance,
        physical_device: handle(device.physical_device),
        device: handle_of_device,
        queue: handle(device.queue),
        queue_family: device.queue_family,
        api_version: device.api_version,
        features: vk::PhysicalDeviceFeatures::default()
            .multi_draw_indirect(device.multi_draw_indirect != 0)
            .sampler_anisotropy(device.sampler_anisotropy != 0),
        debug_utils,
    };
    let raw = |number: u32| i32::try_from(number).unwrap_or(i32::MAX);
    let target = HostTarget {
        render_pass: vk::RenderPass::from_raw(target.render_pass),
        subpass: target.subpass,
        colour_format: vk::Format::from_raw(raw(target.colour_format)),
        depth_format: vk::Format::from_raw(raw(target.depth_format)),
        samples: vk::SampleCountFlags::from_raw(target.samples),
    };
    // SAFETY: the host vouched for all of it, until it has destroyed the renderer.
    unsafe { HostRenderer::new(settings, &host, &target) }
}

/// Where the host records.
pub fn frame_of(caller: &Caller, frame: *const ovf_host_frame) -> Result<HostFrame, Fault> {
    let frame = caller.sized("frame", frame)?;
    refuse_null("frame: command_buffer", frame.command_buffer)?;
    Ok(HostFrame { buffer: handle(frame.command_buffer), index: frame.index })
}

/// Records the copies of a picture.
pub fn uploads(
    _: &Caller,
    renderer: &mut HostRenderer,
    frame: HostFrame,
    picture: &Picture<'_>,
) -> Result<DrawReport, DrawError> {
    // SAFETY: the host vouched for the command buffer, where it stands in it, what the device has
    // finished, and the order of its submits.
    unsafe { renderer.record_uploads(frame, picture, &Team::alone()) }
}

/// Records the draws of a depth range.
pub fn range(
    _: &Caller,
    renderer: &HostRenderer,
    frame: HostFrame,
    (range, at_px): (u32, [i32; 2]),
) -> Result<(), DrawError> {
    // SAFETY: as above, and for pass, area and cleared depth; corners are not negative.
    unsafe { renderer.record_range(frame, range as usize, at_px) }
}

/// Records the overlay of the picture that was uploaded last.
pub fn overlay(
    _: &Caller,
    renderer: &HostRenderer,
    frame: HostFrame,
    at_px: [i32; 2],
) -> Result<(), DrawError> {
    // SAFETY: as for a range.
    unsafe { renderer.record_overlay(frame, at_px) }
}

/// Refuses a handle that is null.
pub fn refuse_null(name: &str, handle: *mut c_void) -> Result<(), Fault> {
    let fault = || Fault::new(OVF_NULL_POINTER, format!("{name} is null"));
    if handle.is_null() { Err(fault()) } else { Ok(()) }
}

fn handle<H: Handle>(pointer: *mut c_void) -> H {
    H::from_raw(pointer.expose_provenance() as u64)
}

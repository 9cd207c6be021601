//! Renderers as C holds them: on a Vulkan device of the host, for one terrain.
//!
//! In:    a terrain; Vulkan's handles, as pointers and numbers; where the host draws.
//! Out:   handles of renderers; the device memory that they take.
//! Keeps: the table of all renderers of the process.
//! Not here: frames (`drawing`), calls of Vulkan (`vulkan`).

use crate::border::{Caller, answer};
use crate::news::News;
use crate::scene::flag;
use crate::status::{Fault, OVF_BUSY, OVF_NULL_POINTER, OVF_PANIC, OVF_STALE, ovf_status};
use crate::table::{Held, Table};
use crate::terrain::{ovf_terrain, with};
use crate::vulkan::{AnyFunction, made, refuse_null};
use bytemuck::Zeroable;
use overfly::render_vk::{HostRenderer, RendererSettings};
use parking_lot::RwLock;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most renderers that are open at once.
const RENDERERS_MAX: usize = 256;

/// Frames in flight where the host names none.
const FRAMES_USUAL: u32 = 2;
/// Most of them.
const FRAMES_MAX: u32 = 16;

/// The last format of Vulkan 1.0: drivers need not expect to be asked about numbers that are none.
const FORMAT_MAX: u32 = 184;

static RENDERERS: Table<Place, RENDERERS_MAX> = Table::new(3, "renderer");

/// What draws a terrain into command buffers of the host. A number, as `ovf_terrain` is.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ovf_renderer {
    /// Not for the host.
    pub bits: u64,
}

/// A Vulkan device of the host, which stays the host's. Handles are cast to pointers; nothing of
/// Vulkan is looked for but through `get_instance_proc_addr`.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_device {
    /// `sizeof(ovf_device)`.
    pub struct_size: u32,
    /// Family of `queue`, which draws and computes. What is recorded is submitted to it.
    pub queue_family: u32,
    /// `VkApplicationInfo::apiVersion` of the instance, at least that of Vulkan 1.1.
    pub api_version: u32,
    /// 1: the instance has `VK_EXT_debug_utils`, and objects are named; 0: it has not.
    pub debug_utils: u32,
    /// 1: the device was made with `multiDrawIndirect`, which is needed.
    pub multi_draw_indirect: u32,
    /// 1: it was made with `samplerAnisotropy`: the ground's texture is sharper far off; 0: not.
    pub sampler_anisotropy: u32,
    /// `vkGetInstanceProcAddr`, cast to `void (*)(void)`.
    pub get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    /// `VkInstance`.
    pub instance: *mut c_void,
    /// `VkPhysicalDevice`.
    pub physical_device: *mut c_void,
    /// `VkDevice`.
    pub device: *mut c_void,
    /// `VkQueue`, used by `ovf_renderer_new_v1` and at no other time.
    pub queue: *mut c_void,
}

/// Where the host draws: a subpass with one colour attachment and depth, without multiview.
///
/// What is drawn is linear light: the colour has an sRGB format or floats. Any pass will do later
/// that is compatible with this one.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_target {
    /// `sizeof(ovf_target)`.
    pub struct_size: u32,
    /// Which subpass.
    pub subpass: u32,
    /// `VkRenderPass`, cast; stays until the renderer is destroyed.
    pub render_pass: u64,
    /// `VkFormat` of the colour attachment.
    pub colour_format: u32,
    /// `VkFormat` of the depth attachment, as `ovf_limits.depth_format` has it, with stencil or
    /// without: `VK_FORMAT_D32_SFLOAT…` for `OVF_DEPTH_D32F`, those of 24 bits for `OVF_DEPTH_D24`.
    pub depth_format: u32,
    /// `VkSampleCountFlagBits` of both.
    pub samples: u32,
    /// 0.
    pub reserved: u32,
}

/// What a renderer is made for, beside its terrain.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_renderer_settings {
    /// `sizeof(ovf_renderer_settings)`.
    pub struct_size: u32,
    /// Frames that the device may be behind, 1 to 16; 0 is 2. A host that shows several views takes
    /// as many for each.
    pub frames_in_flight: u32,
}

/// Device memory of a renderer.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_device_memory {
    /// `sizeof(ovf_device_memory)`, set by the host.
    pub struct_size: u32,
    /// Buffers and images.
    pub allocations: u32,
    /// Bytes of all of them.
    pub bytes: u64,
}

/// A renderer and what it draws.
pub struct Place {
    /// Empty once it was destroyed. Threads that record ranges share it.
    drawn: RwLock<Option<Box<HostRenderer>>>,
    /// What it was not told yet.
    pub news: Arc<News>,
    /// Whose ground it draws; may be gone.
    pub terrain: ovf_terrain,
    /// A call was left by a panic: nobody knows what holds.
    broken: AtomicBool,
}

/// Notes that a call was left by a panic.
struct Watch<'a>(&'a AtomicBool);

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

impl Place {
    fn watch(&self) -> Result<Watch<'_>, Fault> {
        if self.broken.load(Ordering::Relaxed) {
            let sentence = "the renderer is of no use since a bug of overfly's: destroy it";
            return Err(Fault::new(OVF_PANIC, sentence));
        }
        Ok(Watch(&self.broken))
    }
}

/// Runs `act` on a renderer, which nobody else has meanwhile.
pub fn alone<T>(
    renderer: ovf_renderer,
    act: impl FnOnce(&mut HostRenderer, &Place) -> Result<T, Fault>,
) -> Result<T, Fault> {
    let place = hold(renderer)?;
    let mut drawn = place.drawn.try_write().ok_or_else(busy)?;
    let _watch = place.watch()?;
    act(drawn.as_mut().ok_or_else(gone)?, &place)
}

/// Runs `act` on a renderer that nobody changes meanwhile.
pub fn shared<T>(
    renderer: ovf_renderer,
    act: impl FnOnce(&HostRenderer) -> Result<T, Fault>,
) -> Result<T, Fault> {
    let place = hold(renderer)?;
    let drawn = place.drawn.try_read().ok_or_else(busy)?;
    let _watch = place.watch()?;
    act(drawn.as_ref().ok_or_else(gone)?)
}

fn hold(renderer: ovf_renderer) -> Result<Held<Place>, Fault> {
    RENDERERS.hold(renderer.bits)
}

fn busy() -> Fault {
    Fault::new(OVF_BUSY, "the renderer is in another call: one at a time")
}

fn gone() -> Fault {
    Fault::new(OVF_STALE, "the renderer was destroyed a moment ago")
}

/// Makes a renderer of a terrain: takes memory on the host's device, makes pipelines, copies what
/// never changes and tests the driver's arithmetic. Submits to the queue and waits; nobody else uses
/// the queue meanwhile. Other calls on the terrain may go on. `settings` may be null.
///
/// The 1 in its name is the version of this border, as in `ovf_terrain_new_v1`.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_renderer_new_v1(
    terrain: ovf_terrain,
    settings: *const ovf_renderer_settings,
    device: *const ovf_device,
    target: *const ovf_target,
    renderer: *mut ovf_renderer,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_plain("renderer", renderer)?;
        let frames_in_flight = frames(caller, settings)?;
        let (find, device) = device_of(caller, device)?;
        let target = target_of(caller, target)?;
        let (settings, news) = with(terrain, |state| {
            let (scene, terrain) = (state.overfly.scene(), state.overfly.terrain());
            let of_scene = RendererSettings::of(scene, terrain.limits(), [1, 1]);
            let settings = RendererSettings { frames_in_flight, ..of_scene };
            let news = Arc::new(News::new(settings.patches_max, terrain.tiles()));
            state.news.retain(|news| news.strong_count() > 0);
            state.news.push(Arc::downgrade(&news));
            Ok((settings, news))
        })?;
        let drawn = Box::new(made(caller, &settings, (find, &device), &target)?);
        let (drawn, broken) = (RwLock::new(Some(drawn)), AtomicBool::new(false));
        let bits = RENDERERS.insert(Place { drawn, news, terrain, broken })?;
        caller.put_plain("renderer", renderer, ovf_renderer { bits })
    })
}

fn frames(caller: &Caller, settings: *const ovf_renderer_settings) -> Result<u32, Fault> {
    if settings.is_null() {
        return Ok(FRAMES_USUAL);
    }
    match caller.sized("settings", settings)?.frames_in_flight {
        0 => Ok(FRAMES_USUAL),
        found @ 1..=FRAMES_MAX => Ok(found),
        found => {
            let most = FRAMES_MAX;
            let sentence = format!("settings: frames_in_flight is {found}, allowed is 0 to {most}");
            Err(Fault::invalid(sentence))
        }
    }
}

/// The device, with nothing in it that is null or neither yes nor no.
fn device_of(
    caller: &Caller,
    device: *const ovf_device,
) -> Result<(AnyFunction, ovf_device), Fault> {
    let device = caller.sized("device", device)?;
    for (name, handle) in [
        ("device: instance", device.instance),
        ("device: physical_device", device.physical_device),
        ("device: device", device.device),
        ("device: queue", device.queue),
    ] {
        refuse_null(name, handle)?;
    }
    flag("device: debug_utils", device.debug_utils)?;
    flag("device: sampler_anisotropy", device.sampler_anisotropy)?;
    if device.multi_draw_indirect != 1 {
        let found = device.multi_draw_indirect;
        let sentence = format!("device: multi_draw_indirect is {found}, allowed is 1");
        return Err(Fault::invalid(sentence));
    }
    let none = || Fault::new(OVF_NULL_POINTER, "device: get_instance_proc_addr is null");
    Ok((device.get_instance_proc_addr.ok_or_else(none)?, device))
}

/// The target, with a pass and with a format that Vulkan may be asked about.
fn target_of(caller: &Caller, target: *const ovf_target) -> Result<ovf_target, Fault> {
    let target = caller.sized("target", target)?;
    if target.render_pass == 0 {
        return Err(Fault::new(OVF_NULL_POINTER, "target: render_pass is null"));
    }
    let (found, most) = (target.colour_format, FORMAT_MAX);
    if found == 0 || found > most {
        let sentence = format!("target: colour_format is {found}, allowed is 1 to {most}");
        return Err(Fault::invalid(sentence));
    }
    Ok(target)
}

/// Ends a renderer, whose terrain may be gone already: gives all back that it took of the device,
/// which has finished whatever was recorded. To be called before the host destroys the device.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_renderer_destroy(renderer: ovf_renderer) -> ovf_status {
    answer!(|_: &Caller| {
        let place = hold(renderer)?;
        let drawn = place.drawn.try_write().ok_or_else(busy)?.take().ok_or_else(gone)?;
        RENDERERS.remove(renderer.bits)?;
        drop(drawn);
        Ok(())
    })
}

/// Tells that a command buffer with uploads was thrown away instead of submitted: all of the ground
/// is uploaded again.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_renderer_note_lost(renderer: ovf_renderer) -> ovf_status {
    answer!(|_: &Caller| alone(renderer, |drawn, place| {
        let tiles = with(place.terrain, |state| Ok(state.overfly.terrain().tiles()))?;
        drawn.note_lost();
        place.news.note(&[], &tiles);
        Ok(())
    }))
}

/// Device memory that a renderer takes now.
///
/// # Safety
/// The rules of pointers, above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ovf_renderer_memory(
    renderer: ovf_renderer,
    memory: *mut ovf_device_memory,
) -> ovf_status {
    answer!(|caller: &Caller| {
        caller.check_out("memory", memory)?;
        let totals = shared(renderer, |drawn| Ok(drawn.device_totals()))?;
        let (allocations, bytes) = (totals.allocations, totals.bytes);
        caller.put("memory", memory, ovf_device_memory { struct_size: 0, allocations, bytes })
    })
}

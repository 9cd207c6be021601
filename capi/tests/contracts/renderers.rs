//! Renderers: what is refused, whose they are, and what happens to them in which order.
//!
//! In:    null, wrong sizes and constants, devices that are none; several threads; a Vulkan device.
//! Out:   test results; half of them skipped by name without a device.
//! Keeps: nothing.
//! Not here: what is drawn (`drawing`).

use super::calls::*;
use super::lent::host_vulkan::canvas::{Canvas, IN_FLIGHT};
use super::lent::host_vulkan::host::Host;
use super::lent::*;
use overfly::config;
use overfly::render_vk::RendererSettings;
use overfly::render_vk::ash::{self, vk};
use overfly_c::drawing::*;
use overfly_c::renderer::*;
use overfly_c::status::*;
use overfly_c::terrain::*;
use std::ffi::c_char;
use std::ptr::{dangling_mut, null, null_mut};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Asserts how a call ended, and that its sentence names what was wrong.
#[track_caller]
fn ends(status: ovf_status, wanted: ovf_status, says: &str) {
    assert_eq!(status, wanted, "{}", last_error());
    let said = last_error();
    assert!(said.contains(says), "`{said}` does not say `{says}`");
}

/// A number that can only be the handle of nothing.
const NONE: ovf_renderer = ovf_renderer { bits: 0 };

/// Finds no function, whatever it is asked for, as `vkGetInstanceProcAddr` does.
unsafe extern "system" fn finds_nothing(
    _: vk::Instance,
    _: *const c_char,
) -> vk::PFN_vkVoidFunction {
    None
}

/// A device whose handles lead nowhere.
fn no_device() -> ovf_device {
    let find: vk::PFN_vkGetInstanceProcAddr = finds_nothing;
    // SAFETY: a pointer to a function, which is cast back before it is called.
    let find = unsafe { std::mem::transmute::<vk::PFN_vkGetInstanceProcAddr, AnyFunction>(find) };
    ovf_device {
        multi_draw_indirect: 1,
        get_instance_proc_addr: Some(find),
        instance: dangling_mut::<u64>().cast(),
        physical_device: dangling_mut::<u64>().cast(),
        device: dangling_mut::<u64>().cast(),
        queue: dangling_mut::<u64>().cast(),
        ..sized()
    }
}

/// What making a renderer says to a device and a target that were changed.
fn made(
    terrain: ovf_terrain,
    (device, target): (ovf_device, ovf_target),
    change: fn(&mut ovf_device, &mut ovf_target, &mut ovf_renderer_settings),
) -> ovf_status {
    let (mut device, mut target, mut settings) = (device, target, sized());
    change(&mut device, &mut target, &mut settings);
    let mut renderer = NONE;
    // SAFETY: handles are null or good; whatever else was changed is found before it is used.
    let status =
        unsafe { ovf_renderer_new_v1(terrain, &settings, &device, &target, &raw mut renderer) };
    assert_eq!(renderer, NONE, "nothing is written where nothing was made");
    status
}

#[test]
fn devices_that_are_none_are_refused_before_vulkan_is_asked() {
    let terrain = open_small(None);
    let lent = (no_device(), ovf_target { render_pass: 8, colour_format: 43, ..sized() });
    let made = |change| made(terrain, lent, change);
    ends(made(|it, _, _| it.instance = null_mut()), OVF_NULL_POINTER, "device: instance is null");
    ends(made(|it, _, _| it.physical_device = null_mut()), OVF_NULL_POINTER, "physical_device is");
    ends(made(|it, _, _| it.device = null_mut()), OVF_NULL_POINTER, "device: device is null");
    ends(made(|it, _, _| it.queue = null_mut()), OVF_NULL_POINTER, "device: queue is null");
    let no_function = made(|it, _, _| it.get_instance_proc_addr = None);
    ends(no_function, OVF_NULL_POINTER, "device: get_instance_proc_addr is null");
    ends(made(|_, it, _| it.render_pass = 0), OVF_NULL_POINTER, "target: render_pass is null");
    ends(made(|it, _, _| it.debug_utils = 2), OVF_INVALID, "debug_utils is 2, allowed is 0 or 1");
    ends(made(|it, _, _| it.sampler_anisotropy = 9), OVF_INVALID, "sampler_anisotropy is 9");
    let needed = made(|it, _, _| it.multi_draw_indirect = 0);
    ends(needed, OVF_INVALID, "multi_draw_indirect is 0, allowed is 1");
    ends(made(|_, it, _| it.colour_format = 0), OVF_INVALID, "colour_format is 0, allowed is 1 to");
    ends(made(|_, it, _| it.colour_format = u32::MAX), OVF_INVALID, "colour_format is 4294967295");
    ends(
        made(|_, _, it| it.frames_in_flight = 17),
        OVF_INVALID,
        "frames_in_flight is 17, allowed is",
    );
    for struct_size in [0, 4, 63, u32::MAX] {
        let bad = |change| made_sized(terrain, lent, struct_size, change);
        ends(bad(|it, _, _, n| it.struct_size = n), OVF_STRUCT_SIZE, "sizeof(ovf_device)");
        ends(bad(|_, it, _, n| it.struct_size = n), OVF_STRUCT_SIZE, "sizeof(ovf_target)");
        let settings = bad(|_, _, it, n| it.struct_size = n);
        ends(settings, OVF_STRUCT_SIZE, "sizeof(ovf_renderer_settings)");
    }
    ends(made(|_, _, _| {}), OVF_INVALID, "get_instance_proc_addr is without vkDestroyInstance");
    let (device, target) = lent;
    let mut renderer = NONE;
    // SAFETY: what is not null is good, but for handles, which nobody asks.
    unsafe {
        let r = &raw mut renderer;
        let no_target = ovf_renderer_new_v1(terrain, null(), &device, null(), r);
        ends(no_target, OVF_NULL_POINTER, "target is null");
        let nothing = ovf_renderer_new_v1(terrain, null(), null(), &target, r);
        ends(nothing, OVF_NULL_POINTER, "device is null");
        let nowhere = ovf_renderer_new_v1(terrain, null(), &device, &target, null_mut());
        ends(nowhere, OVF_NULL_POINTER, "renderer is null");
        must(ovf_terrain_destroy(terrain));
        let stale = ovf_renderer_new_v1(terrain, null(), &device, &target, r);
        ends(stale, OVF_STALE, "was destroyed, or never was");
    }
}

/// As [`made`], with a size.
fn made_sized(
    terrain: ovf_terrain,
    (mut device, mut target): (ovf_device, ovf_target),
    struct_size: u32,
    change: fn(&mut ovf_device, &mut ovf_target, &mut ovf_renderer_settings, u32),
) -> ovf_status {
    let mut settings = sized();
    change(&mut device, &mut target, &mut settings, struct_size);
    // SAFETY: all structs are whole, whatever they say.
    unsafe { ovf_renderer_new_v1(terrain, &settings, &device, &target, &mut { NONE }) }
}

#[test]
fn frames_that_are_none_are_refused_and_handles_that_are_none_are_stale() {
    let terrain = open_small(None);
    let good = ovf_host_frame { command_buffer: dangling_mut::<u64>().cast(), ..sized() };
    let picture: ovf_picture = sized();
    let other = ovf_renderer { bits: terrain.bits };
    let uploads = |frame: *const _, picture: *const _, report: *mut _| {
        // SAFETY: pointers are null or good; there is no renderer that would use the handle.
        unsafe { ovf_renderer_record_uploads(other, frame, picture, report) }
    };
    let shown = |picture: ovf_picture| uploads(&good, &picture, null_mut());
    let unbuffered: ovf_host_frame = sized();
    ends(uploads(null(), &picture, null_mut()), OVF_NULL_POINTER, "frame is null");
    ends(uploads(&unbuffered, &picture, null_mut()), OVF_NULL_POINTER, "command_buffer is null");
    ends(uploads(&good, null(), null_mut()), OVF_NULL_POINTER, "picture is null");
    let small = ovf_host_frame { struct_size: 12, ..good };
    ends(uploads(&small, &picture, null_mut()), OVF_STRUCT_SIZE, "sizeof(ovf_host_frame)");
    let mut report = ovf_draw_report { struct_size: 39, draws: 7, ..sized() };
    ends(uploads(&good, &picture, &mut report), OVF_STRUCT_SIZE, "sizeof(ovf_draw_report)");
    assert_eq!(report.draws, 7);
    ends(shown(ovf_picture { struct_size: 8, ..picture }), OVF_STRUCT_SIZE, "sizeof(ovf_picture)");
    ends(shown(ovf_picture { show: 8, ..picture }), OVF_INVALID, "show is 8, allowed is 0 to 7");
    ends(shown(ovf_picture { backdrop: 2, ..picture }), OVF_INVALID, "backdrop is 2, allowed is");
    ends(shown(picture), OVF_STALE, "is not the handle of a renderer");
    let range = |frame: *const _, at: [i32; 2]| {
        // SAFETY: as above.
        unsafe { ovf_renderer_record_range(other, frame, 0, at[0], at[1]) }
    };
    ends(range(null(), [0, 0]), OVF_NULL_POINTER, "frame is null");
    ends(range(&good, [-1, 0]), OVF_INVALID, "left_px is -1, allowed is 0 to 2147483647");
    ends(range(&good, [0, i32::MIN]), OVF_INVALID, "top_px is -2147483648");
    ends(range(&good, [0, 0]), OVF_STALE, "is not the handle of a renderer");
    for bits in [0, 1, u64::MAX, terrain.bits] {
        let renderer = ovf_renderer { bits };
        assert_eq!(ovf_renderer_destroy(renderer), OVF_STALE);
        assert_eq!(ovf_renderer_note_lost(renderer), OVF_STALE);
        // SAFETY: pointers are null or good.
        unsafe {
            assert_eq!(ovf_renderer_memory(renderer, &mut sized()), OVF_STALE);
            assert_eq!(ovf_renderer_memory(renderer, null_mut()), OVF_NULL_POINTER);
            let memory = ovf_device_memory { struct_size: 15, ..sized() };
            assert_eq!(ovf_renderer_memory(renderer, &mut { memory }), OVF_STRUCT_SIZE);
        }
    }
    flown(terrain, 1);
    let project = |view, range, columns: *mut f32| {
        // SAFETY: pointers are null or of 16 numbers.
        unsafe { ovf_terrain_projection(terrain, view, range, columns) }
    };
    let mut columns = [7.0; 16];
    ends(project(0, 0, null_mut()), OVF_NULL_POINTER, "columns is null");
    ends(project(1, 0, columns.as_mut_ptr()), OVF_INVALID, "view is 1, allowed is below 1");
    ends(project(0, 3, columns.as_mut_ptr()), OVF_INVALID, "range is 3, allowed is below 3");
    assert_eq!(columns, [7.0; 16]);
    must(ovf_terrain_destroy(terrain));
}

/// A canvas for `small`, on a host of its own.
fn canvas() -> Canvas {
    let host = Rc::new(Host::new().unwrap());
    let overfly = opened_in_rust();
    let scene = config::load("small").unwrap();
    let settings = RendererSettings::of(&scene, overfly.terrain().limits(), SIZE_PX);
    Canvas::new(&host, SIZE_PX, &settings).unwrap()
}

fn close(canvas: Canvas) {
    let host = Rc::clone(&canvas.host);
    drop(canvas);
    end(host);
}

fn memory_of(renderer: ovf_renderer) -> ovf_device_memory {
    let mut memory = sized();
    // SAFETY: the pointer is of a value that outlives the call.
    must(unsafe { ovf_renderer_memory(renderer, &raw mut memory) });
    memory
}

#[test]
fn what_a_host_lends_wrongly_is_named() {
    if !go_on("renderers", "what_a_host_lends_wrongly_is_named") {
        return;
    }
    let mut canvas = canvas();
    let terrain = open_small(Some(&waiting()));
    let lent = (lent(&canvas.host), target(&canvas));
    let said = |change| made(terrain, lent, change);
    ends(said(|it, _, _| it.queue_family = 99), OVF_INVALID, "queue_family is 99");
    let old = said(|it, _, _| it.api_version = vk::API_VERSION_1_0);
    ends(old, OVF_VULKAN, "Vulkan 1.0.0 is too old, 1.1 is needed");
    let whole = said(|_, it, _| it.colour_format = 98);
    ends(whole, OVF_INVALID, "colour_format is R32_UINT, allowed is one that the device draws to");
    ends(said(|_, it, _| it.depth_format = 125), OVF_INVALID, "allowed is one of 32 bits (D32F)");
    ends(said(|_, it, _| it.depth_format = u32::MAX), OVF_INVALID, "depth_format is");
    for samples in [0, 3, 64] {
        let target = ovf_target { samples, ..lent.1 };
        let status = made(terrain, (lent.0, target), |_, _, _| {});
        ends(status, OVF_INVALID, "allowed is one count that the device has");
    }
    dived(terrain, 2);
    let renderer = renderer_of(terrain, &canvas);
    let frame = frame_of(canvas.begin().unwrap());
    let beyond = ovf_host_frame { index: IN_FLIGHT, ..frame };
    let picture: ovf_picture = sized();
    // SAFETY: all pointers are of values that outlive the calls; the buffer is being recorded,
    // outside a pass; what is refused records nothing.
    unsafe {
        let early = ovf_renderer_record_range(renderer, &frame, 0, 0, 0);
        ends(early, OVF_INVALID, "nothing was drawn yet");
        let unknown = ovf_renderer_record_uploads(renderer, &beyond, &picture, null_mut());
        ends(unknown, OVF_INVALID, "frame: index is 2, allowed is below 2");
        let unseen = ovf_picture { view: 1, ..picture };
        let unseen = ovf_renderer_record_uploads(renderer, &frame, &unseen, null_mut());
        ends(unseen, OVF_INVALID, "view is 1, allowed is below 1");
        must(ovf_renderer_record_uploads(renderer, &frame, &picture, null_mut()));
        let unknown = ovf_renderer_record_range(renderer, &frame, 3, 0, 0);
        ends(unknown, OVF_INVALID, "there is no depth range 3, the frame's view has 3");
        let unknown = ovf_renderer_record_range(renderer, &beyond, 0, 0, 0);
        ends(unknown, OVF_INVALID, "frame: index is 2");
    }
    canvas.submit().unwrap();
    assert!(draw_in_c(&mut canvas, renderer, picture).draws > 0, "it goes on as if nothing was");
    canvas.host.wait_idle().unwrap();
    must(ovf_renderer_destroy(renderer));
    must(ovf_terrain_destroy(terrain));
    close(canvas);
}

#[test]
fn a_renderer_outlives_its_terrain_and_is_destroyed_once() {
    if !go_on("renderers", "a_renderer_outlives_its_terrain_and_is_destroyed_once") {
        return;
    }
    let mut canvas = canvas();
    let terrain = open_small(Some(&waiting()));
    let (renderer, other) = (renderer_of(terrain, &canvas), renderer_of(terrain, &canvas));
    dived(terrain, 20);
    let picture: ovf_picture = sized();
    let first = draw_in_c(&mut canvas, renderer, picture);
    let drawn = canvas.read_pixels().unwrap();
    let again = draw_in_c(&mut canvas, renderer, picture);
    let of_other = draw_in_c(&mut canvas, other, picture);
    assert!(canvas.read_pixels().unwrap() == drawn, "two renderers of one terrain");
    assert!(first.uploaded_patches > 0 && again.uploaded_patches == 0);
    assert_eq!(of_other.uploaded_patches, first.uploaded_patches);
    must(ovf_renderer_note_lost(renderer));
    let lost = draw_in_c(&mut canvas, renderer, picture);
    assert_eq!(lost.uploaded_patches, first.uploaded_patches, "all of it comes again");
    assert!(memory_of(renderer).bytes > 1 << 20 && memory_of(renderer).allocations > 4);
    must(ovf_terrain_destroy(terrain));
    assert_eq!(ovf_renderer_note_lost(renderer), OVF_STALE);
    // Each frame in flight still has its picture.
    canvas.host.wait_idle().unwrap();
    let (buffer, index) = canvas.begin().unwrap();
    let frame = frame_of((buffer, index));
    // SAFETY: as in `draw_in_c`.
    unsafe {
        let stale = ovf_renderer_record_uploads(renderer, &frame, &picture, null_mut());
        ends(stale, OVF_STALE, "the terrain");
        canvas.begin_pass(buffer);
        for range in (0..first.ranges).rev() {
            canvas.clear_depth(buffer);
            must(ovf_renderer_record_range(renderer, &frame, range, 0, 0));
        }
        canvas.host.device.cmd_end_render_pass(buffer);
    }
    canvas.submit().unwrap();
    assert!(canvas.read_pixels().unwrap() == drawn);
    must(ovf_renderer_destroy(renderer));
    assert_eq!(ovf_renderer_destroy(renderer), OVF_STALE);
    assert!(last_error().contains("was destroyed, or never was"), "{}", last_error());
    must(ovf_renderer_destroy(other));
    close(canvas);
}

#[test]
fn ranges_are_recorded_by_threads_at_once_and_other_calls_end_as_busy() {
    if !go_on("renderers", "ranges_are_recorded_by_threads_at_once_and_other_calls_end_as_busy") {
        return;
    }
    let mut canvas = canvas();
    let terrain = open_small(Some(&waiting()));
    let renderer = renderer_of(terrain, &canvas);
    dived(terrain, 20);
    let index = canvas.next;
    draw_in_c(&mut canvas, renderer, sized());
    canvas.host.wait_idle().unwrap();
    let host = Rc::clone(&canvas.host);
    let (device, family, pass) = (&host.device, host.family, canvas.pass);
    std::thread::scope(|scope| {
        for range in 0..3 {
            scope.spawn(move || record_often(renderer, (device, family, pass), (index, range)));
        }
    });
    let (stops, busy) = (AtomicBool::new(false), AtomicU64::new(0));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stops.load(Ordering::Relaxed) {
                // SAFETY: the pointer is of a value that outlives the call.
                let status = unsafe { ovf_renderer_memory(renderer, &mut sized()) };
                assert!([OVF_OK, OVF_BUSY].contains(&status), "{}", last_error());
                busy.fetch_add(u64::from(status == OVF_BUSY), Ordering::Relaxed);
            }
        });
        while busy.load(Ordering::Relaxed) == 0 {
            let status = ovf_renderer_note_lost(renderer);
            assert!([OVF_OK, OVF_BUSY].contains(&status), "{}", last_error());
            busy.fetch_add(u64::from(status == OVF_BUSY), Ordering::Relaxed);
        }
        stops.store(true, Ordering::Relaxed);
    });
    must(ovf_renderer_destroy(renderer));
    must(ovf_terrain_destroy(terrain));
    drop(host);
    close(canvas);
}

/// Records a range again and again, into a buffer of this thread's.
fn record_often(
    renderer: ovf_renderer,
    (device, family, pass): (&ash::Device, u32, vk::RenderPass),
    (index, range): (u32, u32),
) {
    let (pool, buffer) = secondary(device, family, pass);
    let frame = frame_of((buffer, index));
    for _ in 0..200 {
        // SAFETY: the pointer is of a value that outlives the call; the buffer is this thread's, and
        // continues the pass.
        must(unsafe { ovf_renderer_record_range(renderer, &frame, range, 0, 0) });
    }
    // SAFETY: the pool is the device's, and nothing of it was submitted.
    unsafe { device.destroy_command_pool(pool, None) };
}

/// A secondary command buffer that is being recorded, and its pool.
fn secondary(
    device: &ash::Device,
    family: u32,
    pass: vk::RenderPass,
) -> (vk::CommandPool, vk::CommandBuffer) {
    let of_pool = vk::CommandPoolCreateInfo::default().queue_family_index(family);
    // SAFETY: the family is the device's, the pass stays, and the pool is used by this thread only.
    unsafe {
        let pool = device.create_command_pool(&of_pool, None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::SECONDARY)
            .command_buffer_count(1);
        let buffer = device.allocate_command_buffers(&info).unwrap()[0];
        let inherits = vk::CommandBufferInheritanceInfo::default().render_pass(pass);
        let begin = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(&inherits);
        device.begin_command_buffer(buffer, &begin).unwrap();
        (pool, buffer)
    }
}

//! Notes the calls of Vulkan that a library makes of a device that is lent to it.
//!
//! In:    a device.
//! Out:   the same device, whose functions note what is made, recorded and submitted, and with which
//!        numbers; handles and pointers, which differ from run to run, are left out.
//! Keeps: the device's own functions, counts and a digest: one device a process.
//! Not here: what the calls do.

use overfly::render_vk::ash::{self, vk};
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{Mutex, OnceLock};

static REAL: OnceLock<ash::DeviceFnV1_0> = OnceLock::new();
static NOTED: Mutex<Noted> = Mutex::new(Noted { calls: BTreeMap::new(), digest: 0 });

struct Noted {
    calls: BTreeMap<&'static str, u64>,
    digest: u64,
}

/// How often each function was called.
pub fn calls() -> Vec<(&'static str, u64)> {
    let noted = NOTED.lock().expect("nobody panics with it");
    noted.calls.iter().map(|(&name, &count)| (name, count)).collect()
}

/// Of all calls in their order, with their numbers.
pub fn digest() -> u64 {
    NOTED.lock().expect("nobody panics with it").digest
}

/// More bytes into a digest. Source: FNV-1a.
pub fn fold(digest: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(digest, |digest, &byte| {
        (digest ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

fn note(name: &'static str, numbers: &[u64]) {
    let mut noted = NOTED.lock().expect("nobody panics with it");
    *noted.calls.entry(name).or_default() += 1;
    noted.digest = fold(noted.digest ^ 0xcbf2_9ce4_8422_2325, name.as_bytes());
    for number in numbers {
        noted.digest = fold(noted.digest, &number.to_le_bytes());
    }
}

fn real() -> &'static ash::DeviceFnV1_0 {
    REAL.get().expect("kept before a function was lent")
}

/// Functions that note their call and pass it on, and the device that has them.
macro_rules! taps {
    ($($name:ident ($($argument:ident: $kind:ty),*) $(-> $out:ty)? { $($number:expr),* })*) => {
        $(
            unsafe extern "system" fn $name($($argument: $kind),*) $(-> $out)? {
                // SAFETY: what is pointed to is good while the call lasts, as Vulkan asks of callers.
                #[allow(unused_unsafe, reason = "some note plain numbers only")]
                let numbers = unsafe { [$(u64::from($number)),*] };
                note(stringify!($name), &numbers);
                // SAFETY: the caller's promises are those that the function asks for.
                unsafe { (real().$name)($($argument),*) }
            }
        )*

        /// The device, whose calls are noted from now on.
        pub fn tapped(device: &ash::Device) -> ash::Device {
            let mut first = REAL.get_or_init(|| device.fp_v1_0().clone()).clone();
            $(first.$name = $name;)*
            let (second, third) = (device.fp_v1_1().clone(), device.fp_v1_2().clone());
            let fourth = device.fp_v1_3().clone();
            ash::Device::from_parts_1_3(device.handle(), first, second, third, fourth)
        }
    };
}

type Allocator<'a> = *const vk::AllocationCallbacks<'a>;

taps! {
    allocate_memory(
        device: vk::Device, info: *const vk::MemoryAllocateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::DeviceMemory
    ) -> vk::Result {
        (*info).allocation_size, (*info).memory_type_index
    }
    create_buffer(
        device: vk::Device, info: *const vk::BufferCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::Buffer
    ) -> vk::Result {
        (*info).size, (*info).usage.as_raw()
    }
    create_image(
        device: vk::Device, info: *const vk::ImageCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::Image
    ) -> vk::Result {
        (*info).extent.width, (*info).extent.height, (*info).mip_levels, (*info).array_layers
    }
    create_image_view(
        device: vk::Device, info: *const vk::ImageViewCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::ImageView
    ) -> vk::Result {
        (*info).subresource_range.level_count
    }
    create_sampler(
        device: vk::Device, info: *const vk::SamplerCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::Sampler
    ) -> vk::Result {
        (*info).max_anisotropy.to_bits()
    }
    create_shader_module(
        device: vk::Device, info: *const vk::ShaderModuleCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::ShaderModule
    ) -> vk::Result {
        (*info).code_size as u64
    }
    create_descriptor_set_layout(
        device: vk::Device, info: *const vk::DescriptorSetLayoutCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::DescriptorSetLayout
    ) -> vk::Result {
        (*info).binding_count
    }
    create_descriptor_pool(
        device: vk::Device, info: *const vk::DescriptorPoolCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::DescriptorPool
    ) -> vk::Result {
        (*info).max_sets, (*info).pool_size_count
    }
    create_pipeline_layout(
        device: vk::Device, info: *const vk::PipelineLayoutCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::PipelineLayout
    ) -> vk::Result {
        (*info).set_layout_count, (*info).push_constant_range_count
    }
    create_graphics_pipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32,
        infos: *const vk::GraphicsPipelineCreateInfo<'_>, by: Allocator<'_>, out: *mut vk::Pipeline
    ) -> vk::Result {
        count, (*infos).stage_count
    }
    create_compute_pipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32,
        infos: *const vk::ComputePipelineCreateInfo<'_>, by: Allocator<'_>, out: *mut vk::Pipeline
    ) -> vk::Result {
        count
    }
    create_command_pool(
        device: vk::Device, info: *const vk::CommandPoolCreateInfo<'_>, by: Allocator<'_>,
        out: *mut vk::CommandPool
    ) -> vk::Result {
        (*info).queue_family_index
    }
    update_descriptor_sets(
        device: vk::Device, writes: u32, written: *const vk::WriteDescriptorSet<'_>, copies: u32,
        copied: *const vk::CopyDescriptorSet<'_>
    ) {
        writes, copies
    }
    queue_submit(
        queue: vk::Queue, count: u32, infos: *const vk::SubmitInfo<'_>, fence: vk::Fence
    ) -> vk::Result {
        count, (*infos).command_buffer_count
    }
    cmd_bind_pipeline(
        buffer: vk::CommandBuffer, point: vk::PipelineBindPoint, pipeline: vk::Pipeline
    ) {
        point.as_raw().unsigned_abs()
    }
    cmd_bind_descriptor_sets(
        buffer: vk::CommandBuffer, point: vk::PipelineBindPoint, layout: vk::PipelineLayout,
        first: u32, count: u32, sets: *const vk::DescriptorSet, offsets: u32, offset: *const u32
    ) {
        first, count, offsets
    }
    cmd_push_constants(
        buffer: vk::CommandBuffer, layout: vk::PipelineLayout, stages: vk::ShaderStageFlags,
        offset: u32, size: u32, values: *const c_void
    ) {
        offset, size, fold(0, std::slice::from_raw_parts(values.cast(), size as usize))
    }
    cmd_bind_vertex_buffers(
        buffer: vk::CommandBuffer, first: u32, count: u32, buffers: *const vk::Buffer,
        offsets: *const vk::DeviceSize
    ) {
        first, count
    }
    cmd_bind_index_buffer(
        buffer: vk::CommandBuffer, indices: vk::Buffer, offset: vk::DeviceSize, kind: vk::IndexType
    ) {
        offset
    }
    cmd_draw(buffer: vk::CommandBuffer, vertices: u32, instances: u32, first: u32, instance: u32) {
        vertices, instances, first, instance
    }
    cmd_draw_indexed_indirect(
        buffer: vk::CommandBuffer, rows: vk::Buffer, offset: vk::DeviceSize, count: u32, stride: u32
    ) {
        offset, count, stride
    }
    cmd_dispatch(buffer: vk::CommandBuffer, x: u32, y: u32, z: u32) {
        x, y, z
    }
    cmd_set_viewport(
        buffer: vk::CommandBuffer, first: u32, count: u32, viewports: *const vk::Viewport
    ) {
        first, count
    }
    cmd_set_scissor(
        buffer: vk::CommandBuffer, first: u32, count: u32, scissors: *const vk::Rect2D
    ) {
        first, count
    }
    cmd_copy_buffer(
        buffer: vk::CommandBuffer, from: vk::Buffer, to: vk::Buffer, count: u32,
        regions: *const vk::BufferCopy
    ) {
        count, (*regions).size
    }
    cmd_copy_buffer_to_image(
        buffer: vk::CommandBuffer, from: vk::Buffer, to: vk::Image, layout: vk::ImageLayout,
        count: u32, regions: *const vk::BufferImageCopy
    ) {
        count
    }
    cmd_pipeline_barrier(
        buffer: vk::CommandBuffer, before: vk::PipelineStageFlags, after: vk::PipelineStageFlags,
        flags: vk::DependencyFlags, memory: u32, memories: *const vk::MemoryBarrier<'_>,
        buffers: u32, buffer_barriers: *const vk::BufferMemoryBarrier<'_>, images: u32,
        image_barriers: *const vk::ImageMemoryBarrier<'_>
    ) {
        memory, buffers, images
    }
}

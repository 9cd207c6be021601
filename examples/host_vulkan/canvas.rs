//! What the host draws on: two images, a pass over them, command buffers for two frames.
//!
//! In:    a host, a size, the kind of depth.
//! Out:   [`Canvas`]; the picture's bytes.
//! Keeps: images, memory, pass, framebuffer, command buffers, fences.
//! Not here: what is recorded in a frame (`frames`).

use super::Outcome;
use super::host::Host;
use overfly::core::settings::{DepthFormat, DepthOrder};
use overfly::render_vk::ash::vk;
use overfly::render_vk::{HostTarget, RendererSettings};
use std::rc::Rc;

/// Stores linear light with the sRGB curve.
const COLOUR: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Frames that the device may be behind.
pub const IN_FLIGHT: u32 = 2;

/// An image with its memory and view.
struct Plane {
    image: vk::Image,
    memory: vk::DeviceMemory,
    view: vk::ImageView,
}

/// The command buffer of a frame in flight, and the fence that its submit signals.
pub struct Slot {
    pub buffer: vk::CommandBuffer,
    pub fence: vk::Fence,
}

/// A target that all frames share.
pub struct Canvas {
    pub size_px: [u32; 2],
    pub pass: vk::RenderPass,
    pub slots: Vec<Slot>,
    pub next: u32,
    framebuffer: vk::Framebuffer,
    colour: Plane,
    depth: Plane,
    depth_format: vk::Format,
    /// What depth is cleared to: infinitely far.
    far: f32,
    pixels: (vk::Buffer, vk::DeviceMemory),
    pool: vk::CommandPool,
    pub host: Rc<Host>,
}

impl Canvas {
    /// A canvas with depth as overfly's settings have it.
    pub fn new(host: &Rc<Host>, size_px: [u32; 2], settings: &RendererSettings) -> Outcome<Self> {
        let depth_format = match settings.depth_format {
            DepthFormat::D32F => vk::Format::D32_SFLOAT,
            DepthFormat::D24 => vk::Format::X8_D24_UNORM_PACK32,
        };
        let far = match settings.depth_order {
            DepthOrder::Reversed => 0.0,
            DepthOrder::Forward => 1.0,
        };
        let read = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let colour = (COLOUR, read, vk::ImageAspectFlags::COLOR);
        let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
        let depth = (depth_format, usage, vk::ImageAspectFlags::DEPTH);
        let colour = plane(host, size_px, colour)?;
        let depth = plane(host, size_px, depth)?;
        let pass = create_pass(host, depth_format)?;
        let views = [colour.view, depth.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views)
            .width(size_px[0])
            .height(size_px[1])
            .layers(1);
        let flags = vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER;
        let of_pool =
            vk::CommandPoolCreateInfo::default().flags(flags).queue_family_index(host.family);
        // SAFETY: pass and views are the device's, and of this size; the family is its queue's.
        let (framebuffer, pool) = unsafe {
            let framebuffer = host.device.create_framebuffer(&info, None)?;
            (framebuffer, host.device.create_command_pool(&of_pool, None)?)
        };
        let bytes = 4 * u64::from(size_px[0]) * u64::from(size_px[1]);
        let pixels = mapped_buffer(host, bytes, vk::BufferUsageFlags::TRANSFER_DST)?;
        let slots = slots(host, pool)?;
        let (next, host) = (0, Rc::clone(host));
        Ok(Self {
            size_px,
            pass,
            slots,
            next,
            framebuffer,
            colour,
            depth,
            depth_format,
            far,
            pixels,
            pool,
            host,
        })
    }

    /// Where pipelines for this canvas draw.
    pub fn target(&self) -> HostTarget {
        HostTarget {
            render_pass: self.pass,
            subpass: 0,
            colour_format: COLOUR,
            depth_format: self.depth_format,
            samples: vk::SampleCountFlags::TYPE_1,
        }
    }

    /// All of it.
    fn area(&self) -> vk::Rect2D {
        let [width, height] = self.size_px;
        vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } }
    }

    /// Begins the pass: clears everything.
    ///
    /// # Safety
    /// - The buffer is being recorded, outside a pass.
    pub unsafe fn begin_pass(&self, buffer: vk::CommandBuffer) {
        let depth = vk::ClearDepthStencilValue { depth: self.far, stencil: 0 };
        let clear = [vk::ClearValue::default(), vk::ClearValue { depth_stencil: depth }];
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass)
            .framebuffer(self.framebuffer)
            .render_area(self.area())
            .clear_values(&clear);
        let contents = vk::SubpassContents::INLINE;
        // SAFETY: the caller's promise; pass and framebuffer belong together.
        unsafe { self.host.device.cmd_begin_render_pass(buffer, &info, contents) };
    }

    /// Clears the depth inside the pass, before the next range.
    ///
    /// # Safety
    /// - The buffer is being recorded, inside the pass.
    pub unsafe fn clear_depth(&self, buffer: vk::CommandBuffer) {
        let depth = vk::ClearDepthStencilValue { depth: self.far, stencil: 0 };
        let clear = [vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::DEPTH,
            color_attachment: 0,
            clear_value: vk::ClearValue { depth_stencil: depth },
        }];
        let rects = [vk::ClearRect { rect: self.area(), base_array_layer: 0, layer_count: 1 }];
        // SAFETY: the caller's promise; the subpass has depth, and the area is all of it.
        unsafe { self.host.device.cmd_clear_attachments(buffer, &clear, &rects) };
    }

    /// Sets viewport and scissor to all of it.
    ///
    /// # Safety
    /// - The buffer is being recorded.
    pub unsafe fn whole(&self, buffer: vk::CommandBuffer) {
        let [width, height] = self.size_px.map(|n| overfly::core::geodesy::narrow(f64::from(n)));
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
        // SAFETY: the caller's promise; the area is within the device's limits.
        unsafe {
            self.host.device.cmd_set_viewport(buffer, 0, &[viewport]);
            self.host.device.cmd_set_scissor(buffer, 0, &[self.area()]);
        }
    }

    /// The last picture, once it is finished: four bytes a pixel, rows from the top.
    pub fn read_pixels(&mut self) -> Outcome<Vec<u8>> {
        let (image, buffer) = (self.colour.image, self.pixels.0);
        let [width, height] = self.size_px;
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let region = vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(vk::Extent3D { width, height, depth: 1 });
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        let (copy, read) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let commands = self.begin()?.0;
        let device = &self.host.device;
        // SAFETY: the pass left the image in this layout, and its last dependency covers copies;
        // the buffer has four bytes a pixel.
        unsafe {
            device.cmd_copy_image_to_buffer(commands, image, layout, buffer, &[region]);
            let flags = vk::DependencyFlags::empty();
            device.cmd_pipeline_barrier(commands, copy, read, flags, &[to_host], &[], &[]);
        }
        self.submit()?;
        self.host.wait_idle()?;
        let (device, memory) = (&self.host.device, self.pixels.1);
        let bytes = 4 * width as usize * height as usize;
        // SAFETY: the memory is mapped by nobody else, holds so many bytes, and the device is idle.
        unsafe {
            let all = vk::MemoryMapFlags::empty();
            let from = device.map_memory(memory, 0, vk::WHOLE_SIZE, all)?;
            let pixels = std::slice::from_raw_parts(from.cast::<u8>(), bytes).to_vec();
            device.unmap_memory(memory);
            Ok(pixels)
        }
    }

    /// Waits for the next frame in flight and begins its command buffer. Returns both.
    pub fn begin(&mut self) -> Outcome<(vk::CommandBuffer, u32)> {
        let Slot { buffer, fence } = self.slots[self.next as usize];
        let device = &self.host.device;
        let once = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
        let info = vk::CommandBufferBeginInfo::default().flags(once);
        // SAFETY: the fence is signalled at first, and later by the submit of this buffer.
        unsafe {
            device.wait_for_fences(&[fence], true, u64::MAX)?;
            device.begin_command_buffer(buffer, &info)?;
        }
        Ok((buffer, self.next))
    }

    /// Ends and submits what was begun.
    pub fn submit(&mut self) -> Outcome<()> {
        let Slot { buffer, fence } = self.slots[self.next as usize];
        self.next = (self.next + 1) % IN_FLIGHT;
        let (device, queue) = (&self.host.device, self.host.queue);
        let buffers = [buffer];
        let info = [vk::SubmitInfo::default().command_buffers(&buffers)];
        // SAFETY: the buffer is being recorded, outside a pass, and was waited for with its fence.
        unsafe {
            device.end_command_buffer(buffer)?;
            device.reset_fences(&[fence])?;
            Ok(device.queue_submit(queue, &info, fence)?)
        }
    }
}

impl Drop for Canvas {
    fn drop(&mut self) {
        let device = &self.host.device;
        // SAFETY: all were made by this device and are destroyed once, when it is idle.
        unsafe {
            let _ = device.device_wait_idle();
            self.slots.iter().for_each(|slot| device.destroy_fence(slot.fence, None));
            device.destroy_command_pool(self.pool, None);
            device.destroy_buffer(self.pixels.0, None);
            device.free_memory(self.pixels.1, None);
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.pass, None);
            for plane in [&self.colour, &self.depth] {
                device.destroy_image_view(plane.view, None);
                device.destroy_image(plane.image, None);
                device.free_memory(plane.memory, None);
            }
        }
    }
}

fn slots(host: &Host, pool: vk::CommandPool) -> Outcome<Vec<Slot>> {
    let info =
        vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(IN_FLIGHT);
    let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
    // SAFETY: the pool is the device's and used by this thread only.
    unsafe {
        let buffers = host.device.allocate_command_buffers(&info)?;
        let slot = |buffer| Ok(Slot { buffer, fence: host.device.create_fence(&signalled, None)? });
        buffers.into_iter().map(slot).collect()
    }
}

fn plane(
    host: &Host,
    [width, height]: [u32; 2],
    (format, usage, aspect): (vk::Format, vk::ImageUsageFlags, vk::ImageAspectFlags),
) -> Outcome<Plane> {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(vk::Extent3D { width, height, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(usage);
    let device = &host.device;
    // SAFETY: the size is small and the formats are common; the image gets memory of its own, as
    // large as it asks for.
    unsafe {
        let image = device.create_image(&info, None)?;
        let needs = device.get_image_memory_requirements(image);
        let kind =
            host.memory_type(needs.memory_type_bits, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
        let take =
            vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind);
        let memory = device.allocate_memory(&take, None)?;
        device.bind_image_memory(image, memory, 0)?;
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
        let look = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range);
        Ok(Plane { image, memory, view: device.create_image_view(&look, None)? })
    }
}

/// A buffer that the host reaches.
pub fn mapped_buffer(
    host: &Host,
    bytes: u64,
    usage: vk::BufferUsageFlags,
) -> Outcome<(vk::Buffer, vk::DeviceMemory)> {
    let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
    let reach = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    let device = &host.device;
    // SAFETY: size and usage are not zero; the buffer gets memory of its own, as large as it asks
    // for.
    unsafe {
        let buffer = device.create_buffer(&info, None)?;
        let needs = device.get_buffer_memory_requirements(buffer);
        let kind = host.memory_type(needs.memory_type_bits, reach)?;
        let take =
            vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind);
        let memory = device.allocate_memory(&take, None)?;
        device.bind_buffer_memory(buffer, memory, 0)?;
        Ok((buffer, memory))
    }
}

/// A pass that clears both images and leaves colour for copying.
fn create_pass(host: &Host, depth_format: vk::Format) -> Outcome<vk::RenderPass> {
    let attachment = |format, store, layout| {
        vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(store)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .final_layout(layout)
    };
    let (kept, left) = (vk::AttachmentStoreOp::STORE, vk::AttachmentStoreOp::DONT_CARE);
    let depth_layout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    let attachments = [
        attachment(COLOUR, kept, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
        attachment(depth_format, left, depth_layout),
    ];
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let colours = [vk::AttachmentReference { attachment: 0, layout }];
    let depth = vk::AttachmentReference { attachment: 1, layout: depth_layout };
    let subpasses = [vk::SubpassDescription::default()
        .color_attachments(&colours)
        .depth_stencil_attachment(&depth)];
    let draw = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
        | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    let write =
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let read =
        vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ;
    let copy = vk::PipelineStageFlags::TRANSFER;
    // After the last frame's drawing and its copy; before the copy of this one.
    let before = vk::SubpassDependency::default()
        .src_subpass(vk::SUBPASS_EXTERNAL)
        .src_stage_mask(draw | copy)
        .src_access_mask(write)
        .dst_stage_mask(draw)
        .dst_access_mask(write | read);
    let after = vk::SubpassDependency::default()
        .dst_subpass(vk::SUBPASS_EXTERNAL)
        .src_stage_mask(draw)
        .src_access_mask(write)
        .dst_stage_mask(copy)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let dependencies = [before, after];
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses)
        .dependencies(&dependencies);
    // SAFETY: all that `info` points to is alive.
    Ok(unsafe { host.device.create_render_pass(&info, None) }?)
}

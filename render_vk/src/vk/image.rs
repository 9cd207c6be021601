//! Images with their memory and one view, and samplers.
//!
//! In:    size, format, usage, levels, layers.
//! Out:   [`Image`], [`Sampler`].
//! Keeps: image, view, memory.
//! Not here: which images a picture needs (`targets`, `detail`).

use super::memory::Want;
use super::{Buffer, Device};
use crate::error::{Fault, failed};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::sync::Arc;

/// What an image is made from.
pub(crate) struct ImageInfo<'a> {
    pub(crate) name: &'a str,
    pub(crate) size_px: [u32; 2],
    pub(crate) format: vk::Format,
    pub(crate) usage: vk::ImageUsageFlags,
    pub(crate) aspect: vk::ImageAspectFlags,
}

/// A two-dimensional image in device memory.
pub(crate) struct Image {
    pub(crate) handle: vk::Image,
    /// All of it: an array where it has several layers.
    pub(crate) view: vk::ImageView,
    pub(crate) aspect: vk::ImageAspectFlags,
    pub(crate) size_px: [u32; 2],
    pub(crate) levels: u32,
    layers: u32,
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Image {
    /// An image of one level and one layer.
    pub(crate) fn new(device: &Arc<Device>, info: &ImageInfo<'_>) -> Result<Self, Fault> {
        Self::layered(device, info, [1, 1])
    }

    /// An image of several mip levels and layers.
    pub(crate) fn layered(
        device: &Arc<Device>,
        info: &ImageInfo<'_>,
        [levels, layers]: [u32; 2],
    ) -> Result<Self, Fault> {
        let (size_px, aspect) = (info.size_px, info.aspect);
        let [width, height] = size_px;
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(info.format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(levels)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(info.usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the size was checked against the device's limits, and the formats are ones that
        // Vulkan requires for these usages.
        let handle = unsafe { device.handle.create_image(&create, None) }
            .map_err(failed("vkCreateImage"))?;
        let (view, allocation) = (vk::ImageView::null(), None);
        let device = Arc::clone(device);
        let mut image = Self { handle, view, aspect, size_px, levels, layers, allocation, device };
        let device = Arc::clone(&image.device);
        device.name(handle, info.name);
        image.bind(info.name)?;
        image.look(info)?;
        Ok(image)
    }

    /// All levels and layers.
    pub(crate) fn all(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(self.aspect)
            .level_count(self.levels)
            .layer_count(self.layers)
    }

    fn bind(&mut self, name: &str) -> Result<(), Fault> {
        let device = &self.device;
        // SAFETY: the image was made by this device.
        let requirements = unsafe { device.handle.get_image_memory_requirements(self.handle) };
        let location = MemoryLocation::GpuOnly;
        let allocation =
            device.memory.take(&Want { name, requirements, location, linear: false })?;
        // SAFETY: the allocation was made for these requirements and belongs to this image only.
        let bound = unsafe {
            device.handle.bind_image_memory(self.handle, allocation.memory(), allocation.offset())
        };
        self.allocation = Some(allocation);
        bound.map_err(failed("vkBindImageMemory"))
    }

    fn look(&mut self, info: &ImageInfo<'_>) -> Result<(), Fault> {
        let kind = if self.layers > 1 {
            vk::ImageViewType::TYPE_2D_ARRAY
        } else {
            vk::ImageViewType::TYPE_2D
        };
        let create = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(kind)
            .format(info.format)
            .subresource_range(self.all());
        // SAFETY: the image has memory, and the range is all of it.
        self.view = unsafe { self.device.handle.create_image_view(&create, None) }
            .map_err(failed("vkCreateImageView"))?;
        self.device.name(self.view, info.name);
        Ok(())
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: both were made by this device and are destroyed once, the view first; a null
        // view is ignored. The renderer waits for the queue before it drops its images.
        unsafe {
            self.device.handle.destroy_image_view(self.view, None);
            self.device.handle.destroy_image(self.handle, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.memory.give_back(allocation);
        }
    }
}

/// Fills all levels of an image of one layer from a buffer that has them one after the other, and
/// leaves it for reading in fragment shaders.
pub(crate) fn fill(
    device: &Device,
    buffer: vk::CommandBuffer,
    (from, image): (&Buffer, &Image),
    texel_bytes: u64,
) {
    let mut regions = Vec::new();
    let mut at = 0;
    for level in 0..image.levels {
        let [width, height] = image.size_px.map(|n| (n >> level).max(1));
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(image.aspect)
            .mip_level(level)
            .layer_count(1);
        regions.push(
            vk::BufferImageCopy::default()
                .buffer_offset(at)
                .image_subresource(layers)
                .image_extent(vk::Extent3D { width, height, depth: 1 }),
        );
        at += u64::from(width) * u64::from(height) * texel_bytes;
    }
    assert!(at <= from.bytes && image.layers == 1, "the buffer holds all levels of one layer");
    let turn = vk::ImageMemoryBarrier::default()
        .image(image.handle)
        .subresource_range(image.all())
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED);
    let written = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    let before = turn
        .old_layout(vk::ImageLayout::UNDEFINED)
        .new_layout(written)
        .dst_access_mask(vk::AccessFlags::TRANSFER_WRITE);
    let after = turn
        .old_layout(written)
        .new_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::SHADER_READ);
    let start = vk::PipelineStageFlags::TOP_OF_PIPE;
    let copy = vk::PipelineStageFlags::TRANSFER;
    let read = vk::PipelineStageFlags::FRAGMENT_SHADER;
    let flags = vk::DependencyFlags::empty();
    let (from, image, device) = (from.handle, image.handle, &device.handle);
    // SAFETY: the buffer is being recorded, outside a pass; the image is new, so nothing uses it;
    // the regions are its levels, and the host wrote `from`, which holds them, before the submit.
    unsafe {
        device.cmd_pipeline_barrier(buffer, start, copy, flags, &[], &[], &[before]);
        device.cmd_copy_buffer_to_image(buffer, from, image, written, &regions);
        device.cmd_pipeline_barrier(buffer, copy, read, flags, &[], &[], &[after]);
    }
}

/// How shaders read an image between its texels and levels.
pub(crate) struct Sampler {
    pub(crate) handle: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    /// Linear between texels and levels, going on at the other side, with so much anisotropy as
    /// the device has, up to `anisotropy`; none on software devices, which walk every texel of a
    /// long footprint: Mesa's takes 100 times as long for a picture.
    pub(crate) fn repeating(
        device: &Arc<Device>,
        name: &str,
        anisotropy: f32,
    ) -> Result<Self, Fault> {
        Self::new(device, name, anisotropy, vk::SamplerAddressMode::REPEAT)
    }

    /// As [`Self::repeating`], but that the outermost texels go on beyond the border.
    pub(crate) fn clamped(
        device: &Arc<Device>,
        name: &str,
        anisotropy: f32,
    ) -> Result<Self, Fault> {
        Self::new(device, name, anisotropy, vk::SamplerAddressMode::CLAMP_TO_EDGE)
    }

    fn new(
        device: &Arc<Device>,
        name: &str,
        anisotropy: f32,
        beyond: vk::SamplerAddressMode,
    ) -> Result<Self, Fault> {
        let most = if device.is_software() { 1.0 } else { device.anisotropy_max };
        let anisotropy = anisotropy.min(most);
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .address_mode_u(beyond)
            .address_mode_v(beyond)
            .anisotropy_enable(anisotropy > 1.0)
            .max_anisotropy(anisotropy)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the anisotropy is within the limit.
        let handle = unsafe { device.handle.create_sampler(&info, None) }
            .map_err(failed("vkCreateSampler"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once; the renderer waits for the queue before
        // it drops its samplers.
        unsafe { self.device.handle.destroy_sampler(self.handle, None) };
    }
}

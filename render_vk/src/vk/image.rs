//! Images with their memory and one view.
//!
//! In:    size, format, usage.
//! Out:   [`Image`].
//! Keeps: image, view, memory.
//! Not here: which images a picture needs (`targets`).

use super::Device;
use super::memory::Want;
use crate::error::{Fault, failed};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::sync::Arc;

/// What an attachment is made from.
pub(crate) struct ImageInfo<'a> {
    pub(crate) name: &'a str,
    pub(crate) size_px: [u32; 2],
    pub(crate) format: vk::Format,
    pub(crate) usage: vk::ImageUsageFlags,
    pub(crate) aspect: vk::ImageAspectFlags,
}

/// A two-dimensional image of one level and one layer, in device memory.
pub(crate) struct Image {
    pub(crate) handle: vk::Image,
    pub(crate) view: vk::ImageView,
    pub(crate) aspect: vk::ImageAspectFlags,
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Image {
    pub(crate) fn new(device: &Arc<Device>, info: &ImageInfo<'_>) -> Result<Self, Fault> {
        let [width, height] = info.size_px;
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(info.format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(info.usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the size was checked against the device's limits, and the formats are ones that
        // Vulkan requires for these usages.
        let handle = unsafe { device.handle.create_image(&create, None) }
            .map_err(failed("vkCreateImage"))?;
        let view = vk::ImageView::null();
        let (aspect, owner) = (info.aspect, Arc::clone(device));
        let mut image = Self { handle, view, aspect, allocation: None, device: owner };
        device.name(handle, info.name);
        image.bind(info.name)?;
        image.look(info)?;
        Ok(image)
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
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(info.aspect)
            .level_count(1)
            .layer_count(1);
        let create = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(info.format)
            .subresource_range(range);
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

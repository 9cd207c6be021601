//! The images of a window, and how a picture gets there.
//!
//! In:    a device with a surface, the finished picture.
//! Out:   [`Swapchain`]; pictures on the screen.
//! Keeps: swapchain, semaphores, two command buffers.
//! Not here: the window itself, drawing the picture.
//!
//! The picture is drawn beside the window and copied into it: so it is the same with and without
//! one, it can be read at any time, and a window of another size costs nothing but a remade chain.

use super::Device;
use super::commands::{Fence, Pool, begin, end};
use super::image::Image;
use super::transfer;
use crate::error::{Fault, StartError, failed};
use ash::{khr, vk};
use std::sync::Arc;

/// Presents that may be unfinished.
const SLOTS: usize = 2;

/// Whether a picture got to the screen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Presented {
    /// It did.
    Shown,
    /// It did not: the window is minimised, or has changed and is asked again next time.
    Skipped,
}

struct Slot {
    pool: Pool,
    buffer: vk::CommandBuffer,
    fence: Fence,
    acquired: Semaphore,
}

/// The chain of a window's images; made anew when the window has changed.
pub(crate) struct Swapchain {
    functions: khr::swapchain::Device,
    handle: vk::SwapchainKHR,
    images: Vec<vk::Image>,
    /// Signalled when an image may be presented, one each.
    finished: Vec<Semaphore>,
    size_px: [u32; 2],
    /// What to ask for where the surface leaves the size to the chain.
    wanted_px: [u32; 2],
    format: vk::SurfaceFormatKHR,
    stale: bool,
    slots: Vec<Slot>,
    next: usize,
    device: Arc<Device>,
}

struct Semaphore {
    handle: vk::Semaphore,
    device: Arc<Device>,
}

impl Semaphore {
    fn new(device: &Arc<Device>, name: &str) -> Result<Self, Fault> {
        let info = vk::SemaphoreCreateInfo::default();
        // SAFETY: creating a semaphore has no condition.
        let handle = unsafe { device.handle.create_semaphore(&info, None) }
            .map_err(failed("vkCreateSemaphore"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device) })
    }
}

impl Drop for Semaphore {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_semaphore(self.handle, None) };
    }
}

impl Swapchain {
    /// No chain yet: it is made with the first picture.
    pub(crate) fn new(device: &Arc<Device>, wanted_px: [u32; 2]) -> Result<Self, StartError> {
        let functions = khr::swapchain::Device::new(device.instance().0, &device.handle);
        let slot = |index: usize| -> Result<Slot, Fault> {
            let mut pool = Pool::new(device, &format!("present {index}"))?;
            let buffer = pool.buffer(vk::CommandBufferLevel::PRIMARY)?;
            let fence = Fence::new(device, &format!("present {index}"))?;
            let acquired = Semaphore::new(device, &format!("acquired {index}"))?;
            Ok(Slot { pool, buffer, fence, acquired })
        };
        Ok(Self {
            functions,
            handle: vk::SwapchainKHR::null(),
            images: Vec::new(),
            finished: Vec::new(),
            size_px: [0; 2],
            wanted_px,
            format: format_of(device)?,
            stale: true,
            slots: (0..SLOTS).map(slot).collect::<Result<_, Fault>>()?,
            next: 0,
            device: Arc::clone(device),
        })
    }

    /// The window has changed its size.
    pub(crate) fn resize(&mut self, size_px: [u32; 2]) {
        self.wanted_px = size_px;
        self.stale = true;
    }

    /// Copies a drawn picture to the screen, scaled where the window is of another size.
    pub(crate) fn present(
        &mut self,
        picture: &Image,
        size_px: [u32; 2],
    ) -> Result<Presented, Fault> {
        if self.stale && !self.remake()? {
            return Ok(Presented::Skipped);
        }
        let slot = &mut self.slots[self.next];
        slot.fence.wait()?;
        let acquired = slot.acquired.handle;
        // SAFETY: chain and semaphore are this device's; the last wait for the semaphore is over,
        // since the slot's fence was waited for.
        let image = unsafe {
            self.functions.acquire_next_image(self.handle, u64::MAX, acquired, vk::Fence::null())
        };
        let (index, suboptimal) = match image {
            Ok(found) => found,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                return Ok(Presented::Skipped);
            }
            Err(result) => return Err(failed("vkAcquireNextImageKHR")(result)),
        };
        self.stale = suboptimal;
        slot.pool.reset()?;
        begin(&self.device, slot.buffer)?;
        let target = (self.images[index as usize], self.size_px);
        transfer::blit(&self.device, slot.buffer, (picture, size_px), target);
        end(&self.device, slot.buffer)?;
        let finished = self.finished[index as usize].handle;
        slot.fence.submit_between(slot.buffer, &[acquired], &[finished])?;
        self.next = (self.next + 1) % SLOTS;
        let (chains, images, waits) = ([self.handle], [index], [finished]);
        let info = vk::PresentInfoKHR::default()
            .swapchains(&chains)
            .image_indices(&images)
            .wait_semaphores(&waits);
        // SAFETY: the image was acquired and is in the layout for presenting once the semaphore is
        // signalled; the queue is only used through a `&mut Renderer`.
        match unsafe { self.functions.queue_present(self.device.queue, &info) } {
            Ok(suboptimal) => self.stale |= suboptimal,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                return Ok(Presented::Skipped);
            }
            Err(result) => return Err(failed("vkQueuePresentKHR")(result)),
        }
        Ok(Presented::Shown)
    }

    /// Makes the chain for the window as it is now. False if the window has no area.
    fn remake(&mut self) -> Result<bool, Fault> {
        let surface = self.device.surface().expect("a swapchain's device has a surface");
        let (_, physical) = self.device.instance();
        // SAFETY: device and surface belong to one instance.
        let able = unsafe {
            surface.functions.get_physical_device_surface_capabilities(physical, surface.handle)
        };
        let able = able.map_err(failed("vkGetPhysicalDeviceSurfaceCapabilitiesKHR"))?;
        let size_px = if able.current_extent.width == u32::MAX {
            let (least, most) = (able.min_image_extent, able.max_image_extent);
            [
                self.wanted_px[0].clamp(least.width, most.width),
                self.wanted_px[1].clamp(least.height, most.height),
            ]
        } else {
            [able.current_extent.width, able.current_extent.height]
        };
        if size_px.contains(&0) {
            return Ok(false);
        }
        self.device.wait_idle()?;
        let most = if able.max_image_count == 0 { u32::MAX } else { able.max_image_count };
        let extent = vk::Extent2D { width: size_px[0], height: size_px[1] };
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.handle)
            .min_image_count((able.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(able.current_transform)
            .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(self.handle);
        // SAFETY: the surface is the device's instance's, every value is one that it allows, and
        // nothing uses the old chain: the device is idle.
        let made = unsafe { self.functions.create_swapchain(&info, None) };
        self.destroy();
        match made {
            Ok(handle) => self.handle = handle,
            // The window went on changing.
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => return Ok(false),
            Err(result) => return Err(failed("vkCreateSwapchainKHR")(result)),
        }
        self.device.name(self.handle, "window");
        // SAFETY: the chain is alive.
        self.images = unsafe { self.functions.get_swapchain_images(self.handle) }
            .map_err(failed("vkGetSwapchainImagesKHR"))?;
        let finished = |image: usize| Semaphore::new(&self.device, &format!("finished {image}"));
        self.finished = (0..self.images.len()).map(finished).collect::<Result<_, _>>()?;
        for (index, &image) in self.images.iter().enumerate() {
            self.device.name(image, &format!("window image {index}"));
        }
        (self.size_px, self.stale) = (size_px, false);
        Ok(true)
    }

    fn destroy(&mut self) {
        self.finished.clear();
        self.images.clear();
        // SAFETY: made by this device and destroyed once, when the queue is idle; a null chain is
        // ignored.
        unsafe { self.functions.destroy_swapchain(self.handle, None) };
        self.handle = vk::SwapchainKHR::null();
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // The owner waited for the queue, which presents go through too.
        self.destroy();
    }
}

/// A format of the surface that stores the sRGB curve as the picture does.
fn format_of(device: &Device) -> Result<vk::SurfaceFormatKHR, StartError> {
    let surface = device.surface().expect("a swapchain's device has a surface");
    let (_, physical) = device.instance();
    // SAFETY: device and surface belong to one instance.
    let formats =
        unsafe { surface.functions.get_physical_device_surface_formats(physical, surface.handle) };
    let formats = formats.map_err(failed("vkGetPhysicalDeviceSurfaceFormatsKHR"))?;
    let srgb =
        [vk::Format::B8G8R8A8_SRGB, vk::Format::R8G8B8A8_SRGB, vk::Format::A8B8G8R8_SRGB_PACK32];
    let found = formats.into_iter().find(|f| srgb.contains(&f.format));
    found.ok_or_else(|| StartError::NoSurface { reason: "it has no 8-bit sRGB format".into() })
}

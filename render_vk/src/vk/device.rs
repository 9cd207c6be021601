//! The logical device and its one queue.
//!
//! In:    an instance; the best physical device is taken.
//! Out:   [`Device`], shared by all owners of objects.
//! Keeps: device, queue, memory allocator, instance.
//! Not here: other objects.

use super::instance::{Instance, Surface, Window};
use super::memory::Memory;
use crate::error::{Fault, StartError, failed};
use ash::{ext, khr, vk};
use core::mem::ManuallyDrop;

/// A device with one queue that draws, computes and copies.
pub(crate) struct Device {
    pub(crate) memory: ManuallyDrop<Memory>,
    pub(crate) names: Option<ext::debug_utils::Device>,
    pub(crate) handle: ash::Device,
    pub(crate) queue: vk::Queue,
    pub(crate) family: u32,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    line: String,
    physical: vk::PhysicalDevice,
    // Last: everything above is destroyed before the instance.
    instance: Instance,
}

impl Device {
    /// Opens the best device: discrete before integrated before virtual before software.
    pub(crate) fn new(validation: bool, window: Option<Window>) -> Result<Self, StartError> {
        let instance = Instance::new(validation, window)?;
        let (physical, family) = choose(&instance)?;
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(family)
            .queue_priorities(&priorities)];
        // SAFETY: the physical device belongs to the instance.
        let has = unsafe { instance.handle.get_physical_device_features(physical) };
        if has.multi_draw_indirect == vk::FALSE {
            return Err(StartError::NoFeature { feature: "multiDrawIndirect" });
        }
        let features = vk::PhysicalDeviceFeatures::default()
            .multi_draw_indirect(true)
            .sampler_anisotropy(has.sampler_anisotropy == vk::TRUE);
        let swapchain = instance.surface.as_ref().map(|_| khr::swapchain::NAME.as_ptr());
        let extensions: Vec<_> = swapchain.into_iter().collect();
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&features);
        // SAFETY: the physical device belongs to the instance, the family exists with at least
        // one queue, the device has the features, and the surface's own check found the extension.
        let handle = unsafe { instance.handle.create_device(physical, &info, None) }
            .map_err(failed("vkCreateDevice"))?;
        let memory = match Memory::new(&instance.handle, physical, &handle) {
            Ok(memory) => memory,
            Err(fault) => {
                // SAFETY: nothing was made from the device yet.
                unsafe { handle.destroy_device(None) };
                return Err(fault.into());
            }
        };
        // SAFETY: queue 0 of the family was created with the device.
        let queue = unsafe { handle.get_device_queue(family, 0) };
        let names =
            instance.has_names.then(|| ext::debug_utils::Device::new(&instance.handle, &handle));
        let about = instance.info(physical);
        let line = format!("{}, {}, Vulkan {}", about.name, about.driver, about.api_version);
        let limits = instance.properties(physical).limits;
        let memory = ManuallyDrop::new(memory);
        let device =
            Self { memory, names, handle, queue, family, limits, line, physical, instance };
        device.name(device.queue, "queue");
        Ok(device)
    }

    /// Name, driver and API version.
    pub(crate) fn line(&self) -> &str {
        &self.line
    }

    /// Where pictures are presented, if there is a window.
    pub(crate) fn surface(&self) -> Option<&Surface> {
        self.instance.surface.as_ref()
    }

    /// The Vulkan functions that belong to the instance, and the physical device.
    pub(crate) fn instance(&self) -> (&ash::Instance, vk::PhysicalDevice) {
        (&self.instance.handle, self.physical)
    }

    /// Whether the device is a program on the host's processor.
    pub(crate) fn is_software(&self) -> bool {
        self.instance.properties(self.physical).device_type == vk::PhysicalDeviceType::CPU
    }

    /// What the device can do with optimally tiled images of a format.
    pub(crate) fn image_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let (instance, physical) = self.instance();
        // SAFETY: the physical device belongs to the instance.
        unsafe { instance.get_physical_device_format_properties(physical, format) }
            .optimal_tiling_features
    }

    /// Messages of the validation layer so far.
    pub(crate) fn messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// Waits until the queue has nothing left to do.
    pub(crate) fn wait_idle(&self) -> Result<(), Fault> {
        // SAFETY: the queue is only used through a `&mut Renderer`, so no submit runs meanwhile.
        unsafe { self.handle.device_wait_idle() }.map_err(failed("vkDeviceWaitIdle"))
    }
}

/// The best physical device of Vulkan 1.1 and its queue family.
fn choose(instance: &Instance) -> Result<(vk::PhysicalDevice, u32), StartError> {
    let mut best: Option<(u32, vk::PhysicalDevice, u32)> = None;
    let mut newest = 0;
    for physical in instance.physical_devices()? {
        let properties = instance.properties(physical);
        newest = newest.max(properties.api_version);
        let rank = match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => 4,
            vk::PhysicalDeviceType::INTEGRATED_GPU => 3,
            vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
            _ => 1,
        };
        let Some(family) = family_of(instance, physical) else { continue };
        let usable = properties.api_version >= vk::API_VERSION_1_1;
        if usable && best.is_none_or(|(known, _, _)| rank > known) {
            best = Some((rank, physical, family));
        }
    }
    match best {
        Some((_, physical, family)) => Ok((physical, family)),
        None if newest > 0 && newest < vk::API_VERSION_1_1 => {
            Err(StartError::TooOld { found: super::instance::version_text(newest) })
        }
        None => Err(StartError::NoDevice),
    }
}

/// The first family that draws and computes; such a family can always copy.
fn family_of(instance: &Instance, physical: vk::PhysicalDevice) -> Option<u32> {
    // SAFETY: the device belongs to the instance, which is alive.
    let families = unsafe { instance.handle.get_physical_device_queue_family_properties(physical) };
    let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let mut able = (0..).zip(&families).filter(|(_, f)| f.queue_flags.contains(both));
    able.find(|&(family, _)| presents(instance, physical, family)).map(|(family, _)| family)
}

/// Whether a family can present to the instance's surface; true without one.
fn presents(instance: &Instance, physical: vk::PhysicalDevice, family: u32) -> bool {
    let Some(Surface { functions, handle, .. }) = &instance.surface else { return true };
    // SAFETY: device and surface belong to the instance, and the device has the family.
    unsafe { functions.get_physical_device_surface_support(physical, family, *handle) }
        .unwrap_or(false)
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: every owner of an object keeps an `Arc<Device>`, so all objects are gone. The
        // memory is dropped once, here, before the device that its blocks belong to.
        unsafe {
            ManuallyDrop::drop(&mut self.memory);
            self.handle.destroy_device(None);
        }
    }
}

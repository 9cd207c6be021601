//! The logical device and its one queue.
//!
//! In:    an instance, of whose devices the best is taken; or a host's device.
//! Out:   [`Device`], shared by all owners of objects.
//! Keeps: memory allocator; device, queue and instance, unless they are the host's.
//! Not here: other objects.

use super::host::HostDevice;
use super::instance::{self, Instance, Surface, Window};
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
    /// Most anisotropy of samplers; 1 is none.
    pub(crate) anisotropy_max: f32,
    line: String,
    physical: vk::PhysicalDevice,
    // Last: everything above is destroyed before the instance.
    origin: Origin,
}

/// Whose the device is.
enum Origin {
    /// Destroyed on drop, then the instance.
    Own(Instance),
    /// The host's, who destroys both.
    Lent(ash::Instance),
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
        // SAFETY: queue 0 of the family was created with the device.
        let queue = unsafe { handle.get_device_queue(family, 0) };
        let host = HostDevice {
            instance: instance.handle.clone(),
            physical_device: physical,
            device: handle,
            queue,
            queue_family: family,
            api_version: instance.version,
            features,
            debug_utils: instance.has_names,
        };
        let device = Self::over(&host, Origin::Own(instance))?;
        device.name(device.queue, "queue");
        Ok(device)
    }

    /// A host's device, which stays the host's.
    ///
    /// # Safety
    /// - As [`crate::HostRenderer::new`] has it of the device.
    pub(crate) unsafe fn lent(host: &HostDevice) -> Result<Self, StartError> {
        // SAFETY: the caller's promise.
        unsafe { host.check() }?;
        Self::over(host, Origin::Lent(host.instance.clone()))
    }

    /// Takes over what `host` names, which is good and of `origin`.
    fn over(host: &HostDevice, origin: Origin) -> Result<Self, StartError> {
        let (instance, physical) = (&host.instance, host.physical_device);
        let memory = match Memory::new(instance, physical, &host.device) {
            Ok(memory) => memory,
            Err(fault) => {
                if matches!(origin, Origin::Own(_)) {
                    // SAFETY: nothing was made from the device yet.
                    unsafe { host.device.destroy_device(None) };
                }
                return Err(fault.into());
            }
        };
        let names = || ext::debug_utils::Device::new(instance, &host.device);
        let about = instance::info(instance, host.api_version, physical);
        let limits = instance::properties(instance, physical).limits;
        let anisotropic = host.features.sampler_anisotropy == vk::TRUE;
        Ok(Self {
            memory: ManuallyDrop::new(memory),
            names: host.debug_utils.then(names),
            handle: host.device.clone(),
            queue: host.queue,
            family: host.queue_family,
            anisotropy_max: if anisotropic { limits.max_sampler_anisotropy } else { 1.0 },
            limits,
            line: format!("{}, {}, Vulkan {}", about.name, about.driver, about.api_version),
            physical,
            origin,
        })
    }

    /// Name, driver and API version.
    pub(crate) fn line(&self) -> &str {
        &self.line
    }

    /// Where pictures are presented, if there is a window.
    pub(crate) fn surface(&self) -> Option<&Surface> {
        match &self.origin {
            Origin::Own(instance) => instance.surface.as_ref(),
            Origin::Lent(_) => None,
        }
    }

    /// The Vulkan functions that belong to the instance, and the physical device.
    pub(crate) fn instance(&self) -> (&ash::Instance, vk::PhysicalDevice) {
        match &self.origin {
            Origin::Own(instance) => (&instance.handle, self.physical),
            Origin::Lent(instance) => (instance, self.physical),
        }
    }

    /// Whether the device is a program on the host's processor.
    pub(crate) fn is_software(&self) -> bool {
        let (instance, physical) = self.instance();
        instance::properties(instance, physical).device_type == vk::PhysicalDeviceType::CPU
    }

    /// What the device can do with optimally tiled images of a format.
    pub(crate) fn image_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let (instance, physical) = self.instance();
        instance::image_features(instance, physical, format)
    }

    /// Messages of the validation layer so far; none of a host's, who has its own.
    pub(crate) fn messages(&self) -> Vec<String> {
        match &self.origin {
            Origin::Own(instance) => instance.messages(),
            Origin::Lent(_) => Vec::new(),
        }
    }

    /// Waits until the queue has nothing left to do.
    pub(crate) fn wait_idle(&self) -> Result<(), Fault> {
        // SAFETY: only a renderer with a device of its own waits so, and its queue is only used
        // through a `&mut Renderer`, so no submit runs meanwhile.
        unsafe { self.handle.device_wait_idle() }.map_err(failed("vkDeviceWaitIdle"))
    }
}

/// The best physical device of Vulkan 1.1 and its queue family.
fn choose(instance: &Instance) -> Result<(vk::PhysicalDevice, u32), StartError> {
    let mut best: Option<(u32, vk::PhysicalDevice, u32)> = None;
    let mut newest = 0;
    for physical in instance.physical_devices()? {
        let properties = instance::properties(&instance.handle, physical);
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
            Err(StartError::TooOld { found: instance::version_text(newest) })
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
            if matches!(self.origin, Origin::Own(_)) {
                self.handle.destroy_device(None);
            }
        }
    }
}

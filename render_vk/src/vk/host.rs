//! A host's device, and where on it the host draws.
//!
//! In:    handles that the host lends; `vkGetInstanceProcAddr` of hosts without `ash`.
//! Out:   [`HostDevice`], [`HostTarget`], checked as far as Vulkan tells; [`required_features`].
//! Keeps: nothing.
//! Not here: drawing there (`record`), a device of our own (`device`).

use super::instance::{image_features, properties, version_text};
use super::pipeline::Subpass;
use crate::error::StartError;
use ash::vk;
use core::ffi::{CStr, c_void};
use core::ptr::null;
use overfly_core::settings::DepthFormat;

/// A device that a host lends; nothing of it is ever destroyed here.
#[derive(Clone)]
pub struct HostDevice {
    /// The instance that the device was made from.
    pub instance: ash::Instance,
    /// The driver's device.
    pub physical_device: vk::PhysicalDevice,
    /// The device; [`required_features`] are enabled.
    pub device: ash::Device,
    /// A queue, used while a renderer is made and at no other time.
    pub queue: vk::Queue,
    /// The queue's family, which draws and computes. What is recorded later is submitted to this
    /// queue, or to another one of the family.
    pub queue_family: u32,
    /// What the instance's `VkApplicationInfo::apiVersion` was; at least Vulkan 1.1.
    pub api_version: u32,
    /// The features that the device was made with. `samplerAnisotropy` is used where it is on: the
    /// ground's texture is sharper far off.
    pub features: vk::PhysicalDeviceFeatures,
    /// Whether the instance has `VK_EXT_debug_utils`: objects are named then.
    pub debug_utils: bool,
}

/// Where a host draws: a subpass with one colour attachment and depth, without multiview.
///
/// What is drawn is linear light, so the colour attachment has an sRGB format or floats. Pictures
/// may be drawn in any pass that is compatible with `render_pass`, in the subpass of this number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HostTarget {
    /// The pass, or one that is compatible; lent for as long as the renderer lives.
    pub render_pass: vk::RenderPass,
    /// Which of its subpasses.
    pub subpass: u32,
    /// Format of the colour attachment.
    pub colour_format: vk::Format,
    /// Format of the depth attachment: of the kind that the settings name, with or without stencil.
    pub depth_format: vk::Format,
    /// Samples of both.
    pub samples: vk::SampleCountFlags,
}

/// The features that a host enables when it makes the device; extensions are not needed.
pub fn required_features() -> vk::PhysicalDeviceFeatures {
    vk::PhysicalDeviceFeatures::default().multi_draw_indirect(true)
}

/// Looks functions up and keeps the name of the first that is not there: `ash` would end the process
/// when it is called.
struct Finder<F> {
    find: F,
    missing: Option<String>,
}

impl<F: FnMut(&CStr) -> vk::PFN_vkVoidFunction> Finder<F> {
    /// For tables of which not every function is used.
    fn optional(&mut self, name: &CStr) -> *const c_void {
        (self.find)(name).map_or(null(), |function| function as *const c_void)
    }

    fn needed(&mut self, name: &CStr) -> *const c_void {
        let found = self.optional(name);
        if found.is_null() && self.missing.is_none() {
            self.missing = Some(name.to_string_lossy().into_owned());
        }
        found
    }

    fn check(&self) -> Result<(), StartError> {
        match &self.missing {
            None => Ok(()),
            Some(name) => refused(
                "get_instance_proc_addr",
                format!("without {name}"),
                "one that finds the functions of Vulkan 1.1 and of enabled extensions",
            ),
        }
    }
}

impl HostDevice {
    /// Instance and device of a host that has bare handles and does not use `ash`. `debug_utils` as
    /// in the field of that name.
    ///
    /// # Safety
    /// - `find` is `vkGetInstanceProcAddr` of the instance's loader, and both handles are good.
    ///
    /// # Errors
    /// [`StartError::Host`]: a function that is needed cannot be found.
    pub unsafe fn functions(
        find: vk::PFN_vkGetInstanceProcAddr,
        (instance, device): (vk::Instance, vk::Device),
        debug_utils: bool,
    ) -> Result<(ash::Instance, ash::Device), StartError> {
        // SAFETY: the caller's promise; names end with a NUL.
        let find = |name: &CStr| unsafe { find(instance, name.as_ptr()) };
        let mut finder = Finder { find, missing: None };
        let first = ash::InstanceFnV1_0::load(|name| finder.needed(name));
        finder.needed(c"vkGetPhysicalDeviceProperties2");
        finder.check()?;
        let of_device = first.get_device_proc_addr;
        let instance = ash::Instance::from_parts_1_3(
            instance,
            first,
            ash::InstanceFnV1_1::load(|name| finder.optional(name)),
            ash::InstanceFnV1_3::load(|name| finder.optional(name)),
        );
        // SAFETY: it was found, and the device is good.
        let find = |name: &CStr| unsafe { of_device(device, name.as_ptr()) };
        let mut finder = Finder { find, missing: None };
        let first = ash::DeviceFnV1_0::load(|name| finder.needed(name));
        if debug_utils {
            finder.needed(c"vkSetDebugUtilsObjectNameEXT");
        }
        finder.check()?;
        let device = ash::Device::from_parts_1_3(
            device,
            first,
            ash::DeviceFnV1_1::load(|name| finder.optional(name)),
            ash::DeviceFnV1_2::load(|name| finder.optional(name)),
            ash::DeviceFnV1_3::load(|name| finder.optional(name)),
        );
        Ok((instance, device))
    }

    /// Checks what Vulkan tells of a device that was not made here.
    ///
    /// # Safety
    /// - The handles are null or good.
    pub(crate) unsafe fn check(&self) -> Result<(), StartError> {
        use vk::Handle;
        for (field, handle) in [
            ("instance", self.instance.handle().as_raw()),
            ("physical_device", self.physical_device.as_raw()),
            ("device", self.device.handle().as_raw()),
            ("queue", self.queue.as_raw()),
        ] {
            if handle == 0 {
                return refused(field, "null".into(), "a handle");
            }
        }
        let of_device = properties(&self.instance, self.physical_device).api_version;
        let version = self.api_version.min(of_device);
        if version < vk::API_VERSION_1_1 {
            return Err(StartError::TooOld { found: version_text(version) });
        }
        if self.features.multi_draw_indirect == vk::FALSE {
            return refused("features", "without multiDrawIndirect".into(), "required_features()");
        }
        // SAFETY: the physical device is the instance's, which is alive: the caller's promise.
        let families = unsafe {
            self.instance.get_physical_device_queue_family_properties(self.physical_device)
        };
        let family = families.get(self.queue_family as usize);
        let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        if !family.is_some_and(|family| family.queue_flags.contains(both)) {
            let allowed = "a family that draws and computes";
            return refused("queue_family", self.queue_family.to_string(), allowed);
        }
        Ok(())
    }
}

impl HostTarget {
    /// Checks what Vulkan tells without the pass.
    ///
    /// # Safety
    /// - `host` is good.
    pub(crate) unsafe fn check(
        &self,
        host: &HostDevice,
        depth: DepthFormat,
    ) -> Result<Subpass, StartError> {
        if self.render_pass == vk::RenderPass::null() {
            refused("render_pass", "null".into(), "a handle")?;
        }
        let (instance, physical) = (&host.instance, host.physical_device);
        let able = |format| image_features(instance, physical, format);
        if !able(self.colour_format).contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND) {
            let found = format!("{:?}", self.colour_format);
            refused("colour_format", found, "one that the device draws to and blends")?;
        }
        let (formats, allowed): (&[vk::Format], _) = match depth {
            DepthFormat::D32F => {
                (&[vk::Format::D32_SFLOAT, vk::Format::D32_SFLOAT_S8_UINT], "one of 32 bits (D32F)")
            }
            DepthFormat::D24 => (
                &[vk::Format::X8_D24_UNORM_PACK32, vk::Format::D24_UNORM_S8_UINT],
                "one of 24 bits (D24)",
            ),
        };
        let attachment = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
        if !formats.contains(&self.depth_format) || !able(self.depth_format).contains(attachment) {
            refused("depth_format", format!("{:?}", self.depth_format), allowed)?;
        }
        let limits = properties(instance, physical).limits;
        let samples =
            limits.framebuffer_color_sample_counts & limits.framebuffer_depth_sample_counts;
        if self.samples.as_raw().count_ones() != 1 || !samples.contains(self.samples) {
            let found = format!("{:?}", self.samples);
            refused("samples", found, "one count that the device has")?;
        }
        Ok(Subpass { pass: self.render_pass, index: self.subpass, samples: self.samples })
    }
}

fn refused(field: &'static str, found: String, allowed: &'static str) -> Result<(), StartError> {
    Err(StartError::Host { field, found, allowed })
}

//! The Vulkan library, an instance, and what devices and layers it offers.
//!
//! In:    whether to validate; a window, if there is one to draw to.
//! Out:   [`Instance`]; lists of devices and layers.
//! Keeps: the loaded library, the instance, the messenger, the window and its surface.
//! Not here: the logical device (`device`).
//!
//! Validation includes synchronisation. Layers up to 1.3.2xx check hazards across command buffers
//! only if the environment says `VK_LAYER_ENABLES=
//! VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT`; newer ones always do.

use super::messages::Messenger;
use crate::error::{StartError, failed};
use ash::{ext, khr, vk};
use core::any::Any;
use core::ffi::{CStr, c_char};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};
use std::sync::Arc;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// A window to draw to, and whoever keeps its handles good.
pub(crate) struct Window {
    pub(crate) display: RawDisplayHandle,
    pub(crate) window: RawWindowHandle,
    pub(crate) owner: Arc<dyn Any + Send + Sync>,
}

/// Where pictures are presented.
pub(crate) struct Surface {
    pub(crate) functions: khr::surface::Instance,
    pub(crate) handle: vk::SurfaceKHR,
    _window: Arc<dyn Any + Send + Sync>,
}

/// The library, loaded at run time, and an instance of it.
pub(crate) struct Instance {
    messenger: Option<Messenger>,
    pub(crate) surface: Option<Surface>,
    pub(crate) handle: ash::Instance,
    /// Whether objects can be named.
    pub(crate) has_names: bool,
    /// Newest Vulkan of loader and instance.
    pub(crate) version: u32,
    // Last: unloads the library.
    _entry: ash::Entry,
}

/// A device as `overfly doctor` shows it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DeviceInfo {
    /// What the driver calls it.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: &'static str,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan version of the device.
    pub api_version: String,
}

/// A Vulkan version as people write it.
pub(crate) fn version_text(version: u32) -> String {
    let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
    format!("{major}.{minor}.{}", vk::api_version_patch(version))
}

fn load() -> Result<(ash::Entry, u32), StartError> {
    // SAFETY: loading runs the library's initialisers; the Vulkan loader's are sound.
    let entry = unsafe { ash::Entry::load() }
        .map_err(|e| StartError::NoLibrary { reason: e.to_string() })?;
    // SAFETY: the entry points are loaded; the call has no other condition.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(failed("vkEnumerateInstanceVersion"))?
        .unwrap_or(vk::API_VERSION_1_0);
    Ok((entry, version))
}

fn layer_names(entry: &ash::Entry) -> Result<Vec<String>, StartError> {
    // SAFETY: the entry points are loaded; the call has no other condition.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(failed("vkEnumerateInstanceLayerProperties"))?;
    let name = |l: &vk::LayerProperties| {
        l.layer_name_as_c_str().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    Ok(layers.iter().map(name).collect())
}

/// Names of the installed layers.
///
/// # Errors
/// [`StartError::NoLibrary`] without a Vulkan loader.
pub fn layers() -> Result<Vec<String>, StartError> {
    layer_names(&load()?.0)
}

/// Devices in the order the loader lists them.
///
/// # Errors
/// [`StartError::NoLibrary`] without a Vulkan loader, [`StartError::NoDevice`] without a driver.
pub fn devices() -> Result<Vec<DeviceInfo>, StartError> {
    let instance = Instance::new(false, None)?;
    let info = |device| info(&instance.handle, instance.version, device);
    Ok(instance.physical_devices()?.into_iter().map(info).collect())
}

impl Instance {
    pub(crate) fn new(validation: bool, window: Option<Window>) -> Result<Self, StartError> {
        let (entry, version) = load()?;
        if version < vk::API_VERSION_1_1 {
            return Err(StartError::TooOld { found: version_text(version) });
        }
        if validation && !layer_names(&entry)?.iter().any(|n| n.as_bytes() == LAYER.to_bytes()) {
            return Err(StartError::NoLayer);
        }
        // SAFETY: the entry points are loaded; the call has no other condition.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .map_err(failed("vkEnumerateInstanceExtensionProperties"))?;
        let has_names =
            extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        let display = window.as_ref().map(|window| window.display);
        let handle = create(&entry, version, (validation, has_names), display)?;
        let (messenger, surface) = (None, None);
        let mut instance = Self { messenger, surface, handle, has_names, version, _entry: entry };
        if validation && has_names {
            let messenger = Messenger::new(&instance._entry, &instance.handle)
                .map_err(failed("vkCreateDebugUtilsMessengerEXT"))?;
            instance.messenger = Some(messenger);
        }
        if let Some(Window { display, window, owner }) = window {
            let (entry, handle) = (&instance._entry, &instance.handle);
            let functions = khr::surface::Instance::new(entry, handle);
            // SAFETY: the instance has the display's extensions; `owner` keeps both handles good
            // for as long as the surface, which the instance destroys first.
            let surface =
                unsafe { ash_window::create_surface(entry, handle, display, window, None) };
            let surface = surface.map_err(failed("creating a surface"))?;
            instance.surface = Some(Surface { functions, handle: surface, _window: owner });
        }
        Ok(instance)
    }

    /// Messages of the validation layer; none without validation.
    pub(crate) fn messages(&self) -> Vec<String> {
        self.messenger.as_ref().map_or_else(Vec::new, Messenger::texts)
    }

    /// All devices, at least one.
    pub(crate) fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>, StartError> {
        // SAFETY: the instance is alive; the call has no other condition.
        let devices = unsafe { self.handle.enumerate_physical_devices() };
        match devices {
            Ok(devices) if devices.is_empty() => Err(StartError::NoDevice),
            Ok(devices) => Ok(devices),
            Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Err(StartError::NoDevice),
            Err(result) => Err(failed("vkEnumeratePhysicalDevices")(result).into()),
        }
    }
}

/// What the driver says of a device of the instance.
pub(crate) fn properties(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
) -> vk::PhysicalDeviceProperties {
    // SAFETY: the device belongs to the instance, which is alive: whoever lends them says so.
    unsafe { instance.get_physical_device_properties(device) }
}

/// What a device of the instance can do with optimally tiled images of a format.
pub(crate) fn image_features(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    format: vk::Format,
) -> vk::FormatFeatureFlags {
    // SAFETY: the device belongs to the instance, which is alive: whoever lends them says so.
    unsafe { instance.get_physical_device_format_properties(device, format) }
        .optimal_tiling_features
}

/// A device of an instance that was made for Vulkan `version`.
pub(crate) fn info(
    instance: &ash::Instance,
    version: u32,
    device: vk::PhysicalDevice,
) -> DeviceInfo {
    let properties = properties(instance, device);
    let text = |name: Result<&CStr, _>| {
        name.map(|n: &CStr| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    if version.min(properties.api_version) >= vk::API_VERSION_1_2 {
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: instance and device have Vulkan 1.2, which knows both structures.
        unsafe { instance.get_physical_device_properties2(device, &mut all) };
    }
    let [name, info] = [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()];
    DeviceInfo {
        name: text(properties.device_name_as_c_str()),
        kind: match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            vk::PhysicalDeviceType::CPU => "cpu",
            _ => "other",
        },
        driver: format!("{} {}", text(name), text(info)).trim().to_owned(),
        api_version: version_text(properties.api_version),
    }
}

fn create(
    entry: &ash::Entry,
    version: u32,
    (validation, has_names): (bool, bool),
    display: Option<RawDisplayHandle>,
) -> Result<ash::Instance, StartError> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"overfly")
        .engine_name(c"overfly")
        .api_version(version.min(vk::API_VERSION_1_2));
    let mut extensions: Vec<*const c_char> = Vec::new();
    let mut layers: Vec<*const c_char> = Vec::new();
    if has_names {
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    if let Some(display) = display {
        let needed = ash_window::enumerate_required_extensions(display)
            .map_err(|e| StartError::NoSurface { reason: e.to_string() })?;
        extensions.extend_from_slice(needed);
    }
    if validation {
        layers.push(LAYER.as_ptr());
        extensions.push(ext::validation_features::NAME.as_ptr());
    }
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_extension_names(&extensions)
        .enabled_layer_names(&layers);
    if validation {
        info = info.push_next(&mut features);
    }
    // SAFETY: all names are null-terminated constants, and everything `info` points to outlives
    // the call.
    match unsafe { entry.create_instance(&info, None) } {
        Ok(instance) => Ok(instance),
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(StartError::NoDevice),
        Err(vk::Result::ERROR_EXTENSION_NOT_PRESENT) if display.is_some() => {
            Err(StartError::NoSurface { reason: "the driver knows no windows of this kind".into() })
        }
        Err(result) => Err(failed("vkCreateInstance")(result).into()),
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.messenger = None;
        if let Some(surface) = self.surface.take() {
            // SAFETY: made from this instance and destroyed once; swapchains keep the device and
            // so the instance alive, so none is left.
            unsafe { surface.functions.destroy_surface(surface.handle, None) };
        }
        // SAFETY: everything made from the instance keeps it alive through `Device`, so nothing
        // is left of it now; the messenger went a line above.
        unsafe { self.handle.destroy_instance(None) };
    }
}

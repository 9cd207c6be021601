//! The host's instance, device and queue, and what the validation layer says of them.
//!
//! In:    nothing: the first usable device is taken.
//! Out:   [`Host`], which lends itself to overfly.
//! Keeps: library, instance, messenger, device; messages outlive it.
//! Not here: anything to draw on (`canvas`).

use super::Outcome;
use overfly::render_vk::ash::{self, ext, vk};
use overfly::render_vk::{HostDevice, required_features};
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex};

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Errors and warnings of the validation layer, the oldest first.
pub type Messages = Arc<Mutex<Vec<String>>>;

/// Everything that is made once.
pub struct Host {
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub family: u32,
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    /// Whether the validation layer is on.
    pub validates: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Messages,
    // Last: unloads the library.
    _entry: ash::Entry,
}

/// Waits, when it goes, until the device has nothing left to do.
pub struct Idle<'a>(pub &'a Host);

impl Drop for Idle<'_> {
    fn drop(&mut self) {
        // A lost device has nothing left to do.
        let _ = self.0.wait_idle();
    }
}

impl Host {
    /// Opens the first device, under the validation layer if it is installed.
    pub fn new() -> Outcome<Self> {
        // SAFETY: loading runs the Vulkan loader's initialisers, which are sound.
        let entry = unsafe { ash::Entry::load() }?;
        // SAFETY: the entry points are loaded; there is no other condition.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }?;
        let validates = layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(LAYER));
        let instance = create_instance(&entry, validates)?;
        let messages = Messages::default();
        let messenger = validates.then(|| listen(&entry, &instance, &messages)).transpose()?;
        let (physical, family) = choose(&instance)?;
        let device = create_device(&instance, physical, family)?;
        // SAFETY: the device was made with one queue of the family.
        let queue = unsafe { device.get_device_queue(family, 0) };
        Ok(Self {
            device,
            queue,
            family,
            instance,
            physical,
            validates,
            messenger,
            messages,
            _entry: entry,
        })
    }

    /// What overfly needs to know of the device.
    pub fn lend(&self) -> HostDevice {
        HostDevice {
            instance: self.instance.clone(),
            physical_device: self.physical,
            device: self.device.clone(),
            queue: self.queue,
            queue_family: self.family,
            api_version: vk::API_VERSION_1_1,
            features: required_features(),
            debug_utils: self.validates,
        }
    }

    /// What the layer says from the start to beyond the end of the host.
    pub fn messages(&self) -> Messages {
        self.messages.clone()
    }

    /// Waits until the device has nothing left to do.
    pub fn wait_idle(&self) -> Outcome<()> {
        // SAFETY: the host is used by one thread, so nothing is submitted meanwhile.
        Ok(unsafe { self.device.device_wait_idle() }?)
    }

    /// A kind of memory that `bits` allow and that has `flags`.
    pub fn memory_type(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> Outcome<u32> {
        // SAFETY: the physical device is the instance's.
        let all = unsafe { self.instance.get_physical_device_memory_properties(self.physical) };
        let kinds = (0..).zip(all.memory_types_as_slice());
        let mut fit = kinds
            .filter(|&(i, kind)| bits & (1_u32 << i) != 0 && kind.property_flags.contains(flags));
        Ok(fit.next().ok_or("no memory of the kind that is needed")?.0)
    }
}

fn create_instance(entry: &ash::Entry, validates: bool) -> Outcome<ash::Instance> {
    let about = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
    let sync = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&sync);
    let (mut layers, mut extensions): (Vec<*const c_char>, Vec<*const c_char>) = (vec![], vec![]);
    if validates {
        layers.push(LAYER.as_ptr());
        extensions.push(ext::debug_utils::NAME.as_ptr());
        extensions.push(ext::validation_features::NAME.as_ptr());
    }
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&about)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validates {
        info = info.push_next(&mut features);
    }
    // SAFETY: the names are null-terminated constants, and all that `info` points to is alive.
    Ok(unsafe { entry.create_instance(&info, None) }?)
}

/// The first device with a family that draws and computes.
fn choose(instance: &ash::Instance) -> Outcome<(vk::PhysicalDevice, u32)> {
    let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    // SAFETY: the instance is alive.
    for physical in unsafe { instance.enumerate_physical_devices() }? {
        // SAFETY: the device is the instance's.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let mut able = (0..).zip(families).filter(|(_, family)| family.queue_flags.contains(both));
        if let Some((family, _)) = able.next() {
            return Ok((physical, family));
        }
    }
    Err("no Vulkan device that draws".into())
}

fn create_device(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    family: u32,
) -> Outcome<ash::Device> {
    let queues =
        [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
    // A host adds the features that it needs itself.
    let features = required_features();
    let info =
        vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&features);
    // SAFETY: physical device and family are the instance's; a device without the features makes
    // the call fail.
    Ok(unsafe { instance.create_device(physical, &info, None) }?)
}

fn listen(
    entry: &ash::Entry,
    instance: &ash::Instance,
    messages: &Messages,
) -> Outcome<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)> {
    let functions = ext::debug_utils::Instance::new(entry, instance);
    let severity = vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
        | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING;
    let kinds = vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
        | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE;
    let user: *const Mutex<Vec<String>> = Arc::as_ptr(messages);
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(severity)
        .message_type(kinds)
        .pfn_user_callback(Some(collect))
        .user_data(user.cast_mut().cast());
    // SAFETY: the instance has the extension; the host keeps the messages longer than this.
    let handle = unsafe { functions.create_debug_utils_messenger(&info, None) }?;
    Ok((functions, handle))
}

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kinds: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes good data, and `user` as it was given to it.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Mutex<Vec<String>>>()) };
    // SAFETY: a message is a null-terminated string, alive during the call.
    let text = unsafe { data.message_as_c_str() }.unwrap_or_default();
    if let Ok(mut messages) = messages.lock() {
        messages.push(text.to_string_lossy().into_owned());
    }
    vk::FALSE
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: whoever made something of the device has the host and destroyed it before.
        unsafe {
            self.device.destroy_device(None);
            if let Some((functions, messenger)) = self.messenger.take() {
                functions.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

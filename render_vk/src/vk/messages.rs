//! What the validation layer says.
//!
//! In:    calls of the layer, from any thread.
//! Out:   errors and warnings as text.
//! Keeps: the first few hundred messages and the count of all.
//! Not here: switching the layer on (`instance`).

use ash::{ext, vk};
use core::ffi::{CStr, c_void};
use parking_lot::Mutex;

/// Messages beyond this are counted, not kept.
const KEPT_MAX: usize = 256;

#[derive(Default)]
struct Collected {
    texts: Vec<String>,
    more: u64,
}

/// Collects messages for as long as it lives.
pub(crate) struct Messenger {
    functions: ext::debug_utils::Instance,
    handle: vk::DebugUtilsMessengerEXT,
    // Boxed, so that its address stays when the messenger moves.
    collected: Box<Mutex<Collected>>,
}

impl Messenger {
    pub(crate) fn new(entry: &ash::Entry, instance: &ash::Instance) -> Result<Self, vk::Result> {
        let functions = ext::debug_utils::Instance::new(entry, instance);
        let collected = Box::new(Mutex::new(Collected::default()));
        let user: *const Mutex<Collected> = &raw const *collected;
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR
                    | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(collect))
            .user_data(user.cast_mut().cast());
        // SAFETY: the instance has the extension; `user` outlives the messenger, because drop
        // destroys the messenger before the box.
        let handle = unsafe { functions.create_debug_utils_messenger(&info, None) }?;
        Ok(Self { functions, handle, collected })
    }

    /// The messages so far, the oldest first; a last line tells of those not kept.
    pub(crate) fn texts(&self) -> Vec<String> {
        let collected = self.collected.lock();
        let mut texts = collected.texts.clone();
        if collected.more > 0 {
            texts.push(format!("and {} more messages", collected.more));
        }
        texts
    }
}

impl Drop for Messenger {
    fn drop(&mut self) {
        // SAFETY: the handle was made by these functions and is destroyed once; the instance is
        // alive, because its owner drops the messenger first.
        unsafe { self.functions.destroy_debug_utils_messenger(self.handle, None) };
    }
}

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data, and `user` as it was given: the boxed mutex.
    let (data, collected) = unsafe { (&*data, &*user.cast::<Mutex<Collected>>()) };
    let text = |pointer: *const core::ffi::c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: strings of callback data are null-terminated and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    let mut collected = collected.lock();
    if collected.texts.len() < KEPT_MAX {
        let line = format!("{}: {}", text(data.p_message_id_name), text(data.p_message));
        collected.texts.push(line);
    } else {
        collected.more += 1;
    }
    vk::FALSE
}

//! Debug names of objects.
//!
//! In:    an object and its name.
//! Out:   the name in debuggers and validation messages, if the extension is there.
//! Keeps: nothing.
//! Not here: anything that a program reads back.

use super::Device;
use ash::vk;
use std::ffi::CString;

impl Device {
    /// Names an object. Without the extension it does nothing: names never fail a call.
    pub(crate) fn name(&self, object: impl vk::Handle, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else { return };
        let info =
            vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object was made by this device, the name outlives the call, and nobody else
        // uses the object yet: owners name what they have just made.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }
}

//! Thin owners of Vulkan objects: made by `new`, destroyed on drop, named for debuggers.
//!
//! In:    plain descriptions.
//! Out:   objects whose methods are safe to call inside this crate.
//! Keeps: the objects; each owner keeps its device alive.
//! Not here: what is drawn (`passes`, `record`).

pub(crate) mod buffer;
pub(crate) mod commands;
pub(crate) mod descriptors;
pub(crate) mod device;
pub(crate) mod host;
pub(crate) mod image;
pub(crate) mod instance;
pub(crate) mod memory;
pub(crate) mod messages;
pub(crate) mod names;
pub(crate) mod pipeline;
pub(crate) mod swapchain;
pub(crate) mod transfer;

pub(crate) use buffer::Buffer;
pub(crate) use device::Device;

//! Vulkan renderer of overfly: uploads, depth-range passes, parallel recording.

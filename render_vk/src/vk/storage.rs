//! A descriptor set that holds one storage buffer: all that the self-test needs.
//!
//! In:    a buffer.
//! Out:   [`StorageSet`].
//! Keeps: set layout, pool, set.
//! Not here: drawing, which needs no descriptors.

use super::{Buffer, Device};
use crate::error::{Fault, failed};
use ash::vk;
use std::sync::Arc;

/// Binding 0 of set 0, visible to compute shaders.
pub(crate) struct StorageSet {
    pub(crate) layout: vk::DescriptorSetLayout,
    pub(crate) set: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    device: Arc<Device>,
}

impl StorageSet {
    pub(crate) fn new(device: &Arc<Device>, buffer: &Buffer) -> Result<Self, Fault> {
        let null = (vk::DescriptorSetLayout::null(), vk::DescriptorSet::null());
        let pool = vk::DescriptorPool::null();
        let mut made = Self { layout: null.0, set: null.1, pool, device: Arc::clone(device) };
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)];
        let layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: `layout` points to live arrays.
        made.layout = unsafe { device.handle.create_descriptor_set_layout(&layout, None) }
            .map_err(failed("vkCreateDescriptorSetLayout"))?;
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)];
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: `pool` points to live arrays.
        made.pool = unsafe { device.handle.create_descriptor_pool(&pool, None) }
            .map_err(failed("vkCreateDescriptorPool"))?;
        let layouts = [made.layout];
        let sets = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(made.pool)
            .set_layouts(&layouts);
        // SAFETY: the pool has room for exactly this set.
        made.set = unsafe { device.handle.allocate_descriptor_sets(&sets) }
            .map_err(failed("vkAllocateDescriptorSets"))?[0];
        let buffers =
            [vk::DescriptorBufferInfo::default().buffer(buffer.handle).range(buffer.bytes)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(made.set)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&buffers);
        // SAFETY: set and buffer are alive, and no submitted work uses the set.
        unsafe { device.handle.update_descriptor_sets(&[write], &[]) };
        device.name(made.layout, "self-test");
        device.name(made.pool, "self-test");
        device.name(made.set, "self-test");
        Ok(made)
    }
}

impl Drop for StorageSet {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle; null handles are
        // ignored.
        unsafe {
            self.device.handle.destroy_descriptor_pool(self.pool, None);
            self.device.handle.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

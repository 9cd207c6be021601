//! Descriptor sets: which buffers and images shaders see under which number.
//!
//! In:    bindings, then what they hold.
//! Out:   [`SetLayout`], [`Set`].
//! Keeps: layouts; for each set a pool of its own, because there are few.
//! Not here: what the bindings mean (`passes`).

use super::{Buffer, Device};
use crate::error::{Fault, failed};
use ash::vk;
use std::sync::Arc;

/// One binding: its number is its place in the layout.
#[derive(Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) kind: vk::DescriptorType,
    pub(crate) stages: vk::ShaderStageFlags,
}

/// What a binding holds.
pub(crate) enum Resource<'a> {
    Buffer(&'a Buffer),
    /// In the layout for reading in shaders.
    Image(vk::ImageView),
    Sampler(vk::Sampler),
}

/// What the sets of one number look like.
pub(crate) struct SetLayout {
    pub(crate) handle: vk::DescriptorSetLayout,
    bindings: Vec<Binding>,
    name: String,
    device: Arc<Device>,
}

impl SetLayout {
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        bindings: &[Binding],
    ) -> Result<Self, Fault> {
        let numbered = (0..).zip(bindings).map(|(number, binding)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(binding.kind)
                .descriptor_count(1)
                .stage_flags(binding.stages)
        });
        let numbered: Vec<_> = numbered.collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&numbered);
        // SAFETY: `info` points to live arrays.
        let handle = unsafe { device.handle.create_descriptor_set_layout(&info, None) }
            .map_err(failed("vkCreateDescriptorSetLayout"))?;
        device.name(handle, name);
        let (bindings, name) = (bindings.to_vec(), name.to_owned());
        Ok(Self { handle, bindings, name, device: Arc::clone(device) })
    }
}

impl Drop for SetLayout {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, when the queue is idle.
        unsafe { self.device.handle.destroy_descriptor_set_layout(self.handle, None) };
    }
}

/// A set of a layout, with all bindings filled.
pub(crate) struct Set {
    pub(crate) handle: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    device: Arc<Device>,
}

impl Set {
    /// A set that holds one resource for each binding.
    pub(crate) fn new(layout: &SetLayout, resources: &[Resource<'_>]) -> Result<Self, Fault> {
        assert_eq!(layout.bindings.len(), resources.len(), "every binding is filled");
        let device = &layout.device;
        let size = |binding: &Binding| {
            vk::DescriptorPoolSize::default().ty(binding.kind).descriptor_count(1)
        };
        let sizes: Vec<_> = layout.bindings.iter().map(size).collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: `info` points to live arrays.
        let pool = unsafe { device.handle.create_descriptor_pool(&info, None) }
            .map_err(failed("vkCreateDescriptorPool"))?;
        let null = vk::DescriptorSet::null();
        let mut set = Self { handle: null, pool, device: Arc::clone(device) };
        let layouts = [layout.handle];
        let info =
            vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool has room for exactly this set.
        set.handle = unsafe { device.handle.allocate_descriptor_sets(&info) }
            .map_err(failed("vkAllocateDescriptorSets"))?[0];
        device.name(set.pool, &layout.name);
        device.name(set.handle, &layout.name);
        for ((number, binding), resource) in (0..).zip(&layout.bindings).zip(resources) {
            set.write(number, binding.kind, resource);
        }
        Ok(set)
    }

    fn write(&self, number: u32, kind: vk::DescriptorType, resource: &Resource<'_>) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.handle)
            .dst_binding(number)
            .descriptor_type(kind);
        let mut buffers = [vk::DescriptorBufferInfo::default()];
        let mut images = [vk::DescriptorImageInfo::default()];
        let write = match resource {
            Resource::Buffer(buffer) => {
                buffers[0] = buffers[0].buffer(buffer.handle).range(buffer.bytes);
                write.buffer_info(&buffers)
            }
            Resource::Image(view) => {
                let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
                images[0] = images[0].image_view(*view).image_layout(read);
                write.image_info(&images)
            }
            Resource::Sampler(sampler) => {
                images[0] = images[0].sampler(*sampler);
                write.image_info(&images)
            }
        };
        // SAFETY: set and resource are alive, and no submitted work uses the set yet.
        unsafe { self.device.handle.update_descriptor_sets(&[write], &[]) };
    }
}

impl Drop for Set {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, with its set, when the queue is idle.
        unsafe { self.device.handle.destroy_descriptor_pool(self.pool, None) };
    }
}

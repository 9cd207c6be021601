//! Commands outside a pass: copies, barriers, the self-test's dispatch, the hazard on purpose.
//!
//! In:    a command buffer that is being recorded; buffers and images.
//! Out:   commands in it, with the barriers that they need.
//! Keeps: nothing.
//! Not here: draws (`record`).

use super::image::Image;
use super::pipeline::{Layout, Pipeline};
use super::storage::StorageSet;
use super::{Buffer, Device};
use ash::vk;

/// Copies staged data to a vertex or index buffer, after earlier draws and before later ones.
pub(crate) fn copies(
    device: &Device,
    buffer: vk::CommandBuffer,
    (from, to): (&Buffer, &Buffer),
    regions: &[vk::BufferCopy],
) {
    let before = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::TRANSFER_WRITE);
    let after = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::VERTEX_ATTRIBUTE_READ | vk::AccessFlags::INDEX_READ);
    let copy = vk::PipelineStageFlags::TRANSFER;
    let read = vk::PipelineStageFlags::VERTEX_INPUT;
    // SAFETY: the buffer is being recorded, outside a pass; the regions are inside both buffers
    // and do not overlap; the host wrote `from` before the submit.
    unsafe {
        barrier(device, buffer, (read | copy, copy), before);
        device.handle.cmd_copy_buffer(buffer, from.handle, to.handle, regions);
        barrier(device, buffer, (copy, read), after);
    }
}

/// One memory barrier.
///
/// # Safety
/// - `buffer` is being recorded, outside a pass, by this thread only.
unsafe fn barrier(
    device: &Device,
    buffer: vk::CommandBuffer,
    (from, to): (vk::PipelineStageFlags, vk::PipelineStageFlags),
    memory: vk::MemoryBarrier<'_>,
) {
    let flags = vk::DependencyFlags::empty();
    // SAFETY: the caller records `buffer` outside a pass.
    unsafe {
        device.handle.cmd_pipeline_barrier(buffer, from, to, flags, &[memory], &[], &[]);
    }
}

/// Copies the picture to the pixel buffer and leaves the image as drawing left it.
pub(crate) fn read_back(
    device: &Device,
    buffer: vk::CommandBuffer,
    (image, pixels): (&Image, &Buffer),
    size_px: [u32; 2],
) {
    let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let read = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    let all = vk::ImageSubresourceRange::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .level_count(1)
        .layer_count(1);
    let turn = vk::ImageMemoryBarrier::default()
        .image(image.handle)
        .subresource_range(all)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED);
    let to_read = turn
        .old_layout(drawn)
        .new_layout(read)
        .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let to_drawn = turn
        .old_layout(read)
        .new_layout(drawn)
        .src_access_mask(vk::AccessFlags::TRANSFER_READ)
        .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
    let to_host = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let [width, height] = size_px;
    let region = vk::BufferImageCopy::default()
        .image_subresource(layers)
        .image_extent(vk::Extent3D { width, height, depth: 1 });
    let output = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
    let copy = vk::PipelineStageFlags::TRANSFER;
    let flags = vk::DependencyFlags::empty();
    let (image, pixels) = (image.handle, pixels.handle);
    let device = &device.handle;
    // SAFETY: the buffer is being recorded, outside a pass; a picture was drawn, so the image is
    // in the layout that passes end in; the pixel buffer has four bytes a pixel.
    unsafe {
        device.cmd_pipeline_barrier(buffer, output, copy, flags, &[], &[], &[to_read]);
        device.cmd_copy_image_to_buffer(buffer, image, read, pixels, &[region]);
        device.cmd_pipeline_barrier(buffer, copy, output, flags, &[], &[], &[to_drawn]);
        let host = vk::PipelineStageFlags::HOST;
        device.cmd_pipeline_barrier(buffer, copy, host, flags, &[to_host], &[], &[]);
    }
}

/// Dispatches the two-sum over `groups` of 64 items.
pub(crate) fn self_test(
    device: &Device,
    buffer: vk::CommandBuffer,
    (pipeline, layout): (&Pipeline, &Layout),
    set: &StorageSet,
    groups: u32,
) {
    let compute = vk::PipelineBindPoint::COMPUTE;
    let to_host = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::SHADER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let stages = (vk::PipelineStageFlags::COMPUTE_SHADER, vk::PipelineStageFlags::HOST);
    // SAFETY: the buffer is being recorded, outside a pass; pipeline and set have this layout, and
    // the set's buffer holds 64 items a group.
    unsafe {
        let handle = &device.handle;
        handle.cmd_bind_pipeline(buffer, compute, pipeline.handle);
        handle.cmd_bind_descriptor_sets(buffer, compute, layout.handle, 0, &[set.set], &[]);
        handle.cmd_dispatch(buffer, groups, 1, 1);
        barrier(device, buffer, stages, to_host);
    }
}

/// Reads with a copy what the copy before it wrote, with nothing in between: a hazard.
pub(crate) fn hazard(device: &Device, buffer: vk::CommandBuffer, scratch: &Buffer) {
    let region = |src_offset, dst_offset| vk::BufferCopy { src_offset, dst_offset, size: 16 };
    let both = scratch.handle;
    // SAFETY: the buffer is being recorded, outside a pass; both regions are inside the scratch
    // buffer, whose contents nobody reads, so it does not matter what the race leaves there.
    unsafe {
        device.handle.cmd_copy_buffer(buffer, both, both, &[region(0, 16)]);
        device.handle.cmd_copy_buffer(buffer, both, both, &[region(16, 32)]);
    }
}

//! Commands outside a pass: copies, barriers, the self-test's dispatch, the hazard on purpose.
//!
//! In:    a command buffer that is being recorded; buffers and images.
//! Out:   commands in it, with the barriers that they need.
//! Keeps: nothing.
//! Not here: draws (`record`).

use super::descriptors::Set;
use super::image::Image;
use super::pipeline::{Layout, Pipeline};
use super::{Buffer, Device};
use ash::vk;

/// Copies staged data to a buffer that vertices are made of, after earlier draws and before later ones.
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
        .dst_access_mask(
            vk::AccessFlags::VERTEX_ATTRIBUTE_READ
                | vk::AccessFlags::INDEX_READ
                | vk::AccessFlags::SHADER_READ,
        );
    let copy = vk::PipelineStageFlags::TRANSFER;
    let read = vk::PipelineStageFlags::VERTEX_INPUT | vk::PipelineStageFlags::VERTEX_SHADER;
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

/// Copies an image to a buffer and leaves it as drawing left it.
pub(crate) fn read_back(
    device: &Device,
    buffer: vk::CommandBuffer,
    (image, pixels): (&Image, &Buffer),
    size_px: [u32; 2],
) {
    let is_depth = image.aspect.contains(vk::ImageAspectFlags::DEPTH);
    let (drawn, write, stage) = if is_depth {
        (
            vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE,
            vk::PipelineStageFlags::LATE_FRAGMENT_TESTS,
        )
    } else {
        (
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            vk::AccessFlags::COLOR_ATTACHMENT_WRITE,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
        )
    };
    let read = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    let all = vk::ImageSubresourceRange::default()
        .aspect_mask(image.aspect)
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
        .src_access_mask(write)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let to_drawn = turn
        .old_layout(read)
        .new_layout(drawn)
        .src_access_mask(vk::AccessFlags::TRANSFER_READ)
        .dst_access_mask(write);
    let to_host = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let aspect = if is_depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(aspect).layer_count(1);
    let [width, height] = size_px;
    let region = vk::BufferImageCopy::default()
        .image_subresource(layers)
        .image_extent(vk::Extent3D { width, height, depth: 1 });
    let copy = vk::PipelineStageFlags::TRANSFER;
    let flags = vk::DependencyFlags::empty();
    let (image, pixels) = (image.handle, pixels.handle);
    let device = &device.handle;
    // SAFETY: the buffer is being recorded, outside a pass; a picture was drawn, so the image is
    // in the layout that passes end in; the pixel buffer has four bytes a pixel.
    unsafe {
        device.cmd_pipeline_barrier(buffer, stage, copy, flags, &[], &[], &[to_read]);
        device.cmd_copy_image_to_buffer(buffer, image, read, pixels, &[region]);
        device.cmd_pipeline_barrier(buffer, copy, stage, flags, &[], &[], &[to_drawn]);
        let host = vk::PipelineStageFlags::HOST;
        device.cmd_pipeline_barrier(buffer, copy, host, flags, &[to_host], &[], &[]);
    }
}

/// Dispatches the two-sum over `groups` of 64 items.
pub(crate) fn self_test(
    device: &Device,
    buffer: vk::CommandBuffer,
    (pipeline, layout): (&Pipeline, &Layout),
    set: &Set,
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
        handle.cmd_bind_descriptor_sets(buffer, compute, layout.handle, 0, &[set.handle], &[]);
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

/// Copies the picture, scaled where sizes differ, into an image of a window, and leaves the picture
/// as drawing left it.
pub(crate) fn blit(
    device: &Device,
    buffer: vk::CommandBuffer,
    (picture, from_px): (&Image, [u32; 2]),
    (window, to_px): (vk::Image, [u32; 2]),
) {
    let all = vk::ImageSubresourceRange::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .level_count(1)
        .layer_count(1);
    let turn = |image, from: Use, to: Use| {
        vk::ImageMemoryBarrier::default()
            .image(image)
            .subresource_range(all)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .old_layout(from.0)
            .src_access_mask(from.1)
            .new_layout(to.0)
            .dst_access_mask(to.1)
    };
    let nothing = vk::AccessFlags::empty();
    let read = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::AccessFlags::TRANSFER_READ);
    let written = (vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::AccessFlags::TRANSFER_WRITE);
    let drawn =
        (vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
    let unknown = (vk::ImageLayout::UNDEFINED, nothing);
    let shown = (vk::ImageLayout::PRESENT_SRC_KHR, nothing);
    let before = [turn(picture.handle, drawn, read), turn(window, unknown, written)];
    let after = [turn(picture.handle, read, drawn), turn(window, written, shown)];
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let corner = |size_px: [u32; 2]| {
        let [x, y] = size_px.map(|n| i32::try_from(n).expect("sizes are below the device's limit"));
        vk::Offset3D { x, y, z: 1 }
    };
    let region = vk::ImageBlit::default()
        .src_subresource(layers)
        .src_offsets([vk::Offset3D::default(), corner(from_px)])
        .dst_subresource(layers)
        .dst_offsets([vk::Offset3D::default(), corner(to_px)]);
    let filter = if from_px == to_px { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
    let output = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
    let copy = vk::PipelineStageFlags::TRANSFER;
    let flags = vk::DependencyFlags::empty();
    let device = &device.handle;
    // SAFETY: the buffer is being recorded, outside a pass; a picture was drawn, so it is in the
    // layout that passes end in; the window's image was acquired, and the submit's copies wait for
    // that.
    unsafe {
        device.cmd_pipeline_barrier(buffer, output | copy, copy, flags, &[], &[], &before);
        device.cmd_blit_image(buffer, picture.handle, read.0, window, written.0, &[region], filter);
        device.cmd_pipeline_barrier(buffer, copy, output, flags, &[], &[], &after);
    }
}

/// A layout and the accesses in it.
type Use = (vk::ImageLayout, vk::AccessFlags);

/// A barrier around writes to levels and layers of an image that fragment shaders read.
fn image_turn<'a>(
    image: vk::Image,
    range: vk::ImageSubresourceRange,
    (from, to): (Use, Use),
) -> vk::ImageMemoryBarrier<'a> {
    vk::ImageMemoryBarrier::default()
        .image(image)
        .subresource_range(range)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .old_layout(from.0)
        .src_access_mask(from.1)
        .new_layout(to.0)
        .dst_access_mask(to.1)
}

const SHADER_READ: Use = (vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, vk::AccessFlags::SHADER_READ);

/// Clears all of a new image to nothing and leaves it for reading in fragment shaders.
pub(crate) fn make_readable(device: &Device, buffer: vk::CommandBuffer, image: &Image) {
    let all = image.all();
    let unknown = (vk::ImageLayout::UNDEFINED, vk::AccessFlags::empty());
    let written = (vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::AccessFlags::TRANSFER_WRITE);
    let before = image_turn(image.handle, all, (unknown, written));
    let after = image_turn(image.handle, all, (written, SHADER_READ));
    let (copy, read) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::FRAGMENT_SHADER);
    let flags = vk::DependencyFlags::empty();
    let nothing = vk::ClearColorValue { float32: [0.0; 4] };
    let device = &device.handle;
    // SAFETY: the buffer is being recorded, outside a pass; the image is new and may be copied to.
    unsafe {
        device.cmd_pipeline_barrier(buffer, copy, copy, flags, &[], &[], &[before]);
        device.cmd_clear_color_image(buffer, image.handle, written.0, &nothing, &[all]);
        device.cmd_pipeline_barrier(buffer, copy, read, flags, &[], &[], &[after]);
    }
}

/// Fills all levels of one layer from a place in a buffer that has them one after the other, four
/// bytes a texel, after earlier draws and before later ones.
pub(crate) fn fill_layer(
    device: &Device,
    buffer: vk::CommandBuffer,
    (from, mut at): (&Buffer, u64),
    (image, layer): (&Image, u32),
) {
    let range =
        vk::ImageSubresourceRange { base_array_layer: layer, layer_count: 1, ..image.all() };
    let written = (vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::AccessFlags::TRANSFER_WRITE);
    let before = image_turn(image.handle, range, (SHADER_READ, written));
    let after = image_turn(image.handle, range, (written, SHADER_READ));
    let (copy, read) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::FRAGMENT_SHADER);
    let flags = vk::DependencyFlags::empty();
    let device = &device.handle;
    // SAFETY: the buffer is being recorded, outside a pass; the layer is one of the image's, which
    // is in the layout for reading; the host wrote all levels into `from` before the submit.
    unsafe {
        device.cmd_pipeline_barrier(buffer, read, copy, flags, &[], &[], &[before]);
        for level in 0..image.levels {
            let [width, height] = image.size_px.map(|n| (n >> level).max(1));
            let layers = vk::ImageSubresourceLayers::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .mip_level(level)
                .base_array_layer(layer)
                .layer_count(1);
            let region = vk::BufferImageCopy::default()
                .buffer_offset(at)
                .image_subresource(layers)
                .image_extent(vk::Extent3D { width, height, depth: 1 });
            device.cmd_copy_buffer_to_image(
                buffer,
                from.handle,
                image.handle,
                written.0,
                &[region],
            );
            at += 4 * u64::from(width) * u64::from(height);
        }
        device.cmd_pipeline_barrier(buffer, copy, read, flags, &[], &[], &[after]);
    }
}

//! The patch arena on the device, and which of its slots are out of date.
//!
//! In:    slots built by the frame, the patch arena of core.
//! Out:   staged vertices and the copies that bring them to the device.
//! Keeps: vertex and index buffer, one bit a slot.
//! Not here: recording the copies (`record`).

use crate::error::Fault;
use crate::vk::buffer::{Buffer, BufferInfo, bytes_of};
use crate::vk::{Device, commands::OneOff};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::mesh::{PatchVertex, Patches, topology};
use std::sync::Arc;

/// Vertices staged at once; a frame that has more to upload waits in between.
const STAGING_BYTES: u64 = 4 << 20;

/// Vertices of all patches, as the device has them.
pub(crate) struct Arena {
    pub(crate) vertices: Buffer,
    pub(crate) indices: Buffer,
    pub(crate) indices_per_patch: u32,
    pub(crate) vertices_per_patch: u32,
    /// Bit s % 64 of word s / 64: what the device has of slot s is out of date.
    stale: Vec<u64>,
}

/// What one staging buffer took.
#[derive(Clone, Copy, Default)]
pub(crate) struct Staged {
    pub(crate) patches: u32,
    pub(crate) bytes: u64,
    /// The staging buffer was full before the end.
    pub(crate) more: bool,
}

impl Arena {
    /// An arena all of whose slots are out of date.
    pub(crate) fn new(
        device: &Arc<Device>,
        one_off: &mut OneOff,
        patch_depth: u8,
        patches_max: u32,
    ) -> Result<Self, Fault> {
        let segments = topology::segments(patch_depth);
        let vertices_per_patch = (segments + 1) * (segments + 2) / 2;
        let pattern: Vec<u16> = topology::indices(patch_depth)
            .into_iter()
            .map(|i| u16::try_from(i).expect("a patch has at most 153 vertices"))
            .collect();
        let vertices = Buffer::new(
            device,
            &BufferInfo {
                name: "patch vertices",
                bytes: u64::from(patches_max) * patch_bytes(vertices_per_patch),
                usage: vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
                location: MemoryLocation::GpuOnly,
            },
        )?;
        let indices = index_buffer(device, one_off, &pattern)?;
        Ok(Self {
            vertices,
            indices,
            indices_per_patch: 3 << patch_depth,
            vertices_per_patch,
            stale: vec![u64::MAX; patches_max.div_ceil(64) as usize],
        })
    }

    /// A buffer to stage vertices in; holds at least one patch.
    pub(crate) fn staging(&self, device: &Arc<Device>, name: &str) -> Result<Buffer, Fault> {
        let patch = patch_bytes(self.vertices_per_patch);
        let info = BufferInfo {
            name,
            bytes: STAGING_BYTES.min(self.vertices.bytes) / patch * patch,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            location: MemoryLocation::CpuToGpu,
        };
        Buffer::new(device, &info)
    }

    /// The device's copies of these slots are out of date. Slots beyond the arena are ignored.
    pub(crate) fn mark(&mut self, slots: &[u32]) {
        for &slot in slots {
            if let Some(word) = self.stale.get_mut(slot as usize / 64) {
                *word |= 1 << (slot % 64);
            }
        }
    }

    /// As after [`Arena::new`]: nothing that the device has is trusted.
    pub(crate) fn mark_all(&mut self) {
        self.stale.fill(u64::MAX);
    }

    /// Stages live slots that are out of date, in order of slot, until the buffer is full. They
    /// count as up to date from now on: `copies` must be executed.
    pub(crate) fn stage(
        &mut self,
        patches: &Patches,
        staging: &mut Buffer,
        copies: &mut Vec<vk::BufferCopy>,
    ) -> Staged {
        copies.clear();
        let mut staged = Staged::default();
        let patch = patch_bytes(self.vertices_per_patch);
        let (room, bytes) = (staging.bytes, staging.mapped_mut());
        let mut next = 0;
        while let Some(slot) = self.out_of_date(next, patches) {
            if staged.bytes == room {
                staged.more = true;
                break;
            }
            self.stale[slot as usize / 64] &= !(1 << (slot % 64));
            let from = usize::try_from(staged.bytes).expect("staging is mapped, so it fits");
            let vertices = bytes_of(patches.vertices_of(slot));
            bytes[from..][..vertices.len()].copy_from_slice(vertices);
            push_copy(copies, staged.bytes, u64::from(slot) * patch, patch);
            staged.bytes += patch;
            staged.patches += 1;
            next = slot + 1;
        }
        staged
    }

    /// The first live slot at or after `next` that is out of date.
    fn out_of_date(&self, mut next: u32, patches: &Patches) -> Option<u32> {
        while next < patches.used_end() {
            let left = self.stale[next as usize / 64] >> (next % 64);
            if left == 0 {
                next = (next / 64 + 1) * 64;
                continue;
            }
            next += left.trailing_zeros();
            if matches!(patches.leaf.get(next as usize), Some(Some(_))) {
                return Some(next);
            }
            next += 1;
        }
        None
    }
}

fn patch_bytes(vertices_per_patch: u32) -> u64 {
    u64::from(vertices_per_patch) * size_of::<PatchVertex>() as u64
}

/// Adds a copy, or lengthens the last one where it goes on.
fn push_copy(copies: &mut Vec<vk::BufferCopy>, src_offset: u64, dst_offset: u64, size: u64) {
    if let Some(last) = copies.last_mut()
        && last.src_offset + last.size == src_offset
        && last.dst_offset + last.size == dst_offset
    {
        last.size += size;
        return;
    }
    copies.push(vk::BufferCopy { src_offset, dst_offset, size });
}

fn index_buffer(
    device: &Arc<Device>,
    one_off: &mut OneOff,
    pattern: &[u16],
) -> Result<Buffer, Fault> {
    let bytes = bytes_of(pattern);
    let size = bytes.len() as u64;
    let mut staging = Buffer::new(
        device,
        &BufferInfo {
            name: "patch indices, staged",
            bytes: size,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            location: MemoryLocation::CpuToGpu,
        },
    )?;
    staging.mapped_mut().copy_from_slice(bytes);
    let indices = Buffer::new(
        device,
        &BufferInfo {
            name: "patch indices",
            bytes: size,
            usage: vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            location: MemoryLocation::GpuOnly,
        },
    )?;
    let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
    one_off.run(|device, buffer| {
        crate::vk::transfer::copies(device, buffer, (&staging, &indices), &copy);
    })?;
    Ok(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_slots_become_one_copy() {
        let mut copies = Vec::new();
        for (at, slot) in [3_u64, 4, 5, 9].into_iter().enumerate() {
            push_copy(&mut copies, 40 * at as u64, 40 * slot, 40);
        }
        let list: Vec<_> = copies.iter().map(|c| (c.src_offset, c.dst_offset, c.size)).collect();
        assert_eq!(list, [(0, 120, 120), (120, 360, 40)]);
    }
}

//! Buffers with their memory.
//!
//! In:    size, usage, where it lives; plain data to write.
//! Out:   [`Buffer`].
//! Keeps: buffer and memory.
//! Not here: copies on the device (`record`).

use super::Device;
use super::memory::Want;
use crate::error::{Fault, failed};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use overfly_core::inspect::PatchInfo;
use overfly_core::mesh::drape::PatchDrape;
use overfly_core::mesh::{PatchMorph, PatchVertex};
use std::sync::Arc;

/// Data that is uploaded as its bytes.
///
/// # Safety
/// - The type has no padding: every byte of a value is initialised.
/// - Any bytes are a value of it.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: `repr(C)`, 24 + 4 + 4 + 4 bytes with alignment 4 make 36: no gap.
unsafe impl Plain for PatchVertex {}
// SAFETY: `repr(C)`, 12 + 4 + 4 + 4 bytes with alignment 4 make 24: no gap.
unsafe impl Plain for PatchMorph {}
// SAFETY: `repr(C)`, floats and words of four bytes each.
unsafe impl Plain for PatchDrape {}
// SAFETY: bytes have no padding.
unsafe impl Plain for [u8; 4] {}
// SAFETY: `repr(C)`, a float and four bytes: no gap.
unsafe impl Plain for PatchInfo {}
// SAFETY: `repr(C)`, floats and words of four bytes each.
unsafe impl Plain for crate::matrices::ViewTerms {}
// SAFETY: `repr(C)`, floats and words of four bytes each.
unsafe impl Plain for crate::matrices::RangeTerms {}
// SAFETY: `repr(C)`, two floats and four bytes.
unsafe impl Plain for crate::overlay::OverlayVertex {}
// SAFETY: `repr(C)`, five words of four bytes.
unsafe impl Plain for vk::DrawIndexedIndirectCommand {}
// SAFETY: floats have no padding, nor have arrays of them.
unsafe impl Plain for [f32; 3] {}
// SAFETY: integers and floats have no padding, nor have arrays of them.
unsafe impl Plain for u16 {}
// SAFETY: as above.
unsafe impl Plain for f32 {}
// SAFETY: as above.
unsafe impl Plain for [f32; 4] {}

/// The bytes of plain data.
pub(crate) fn bytes_of<T: Plain>(items: &[T]) -> &[u8] {
    // SAFETY: a `Plain` type's bytes are all initialised, u8 has no alignment, and the length is
    // the slice's own.
    unsafe { core::slice::from_raw_parts(items.as_ptr().cast(), size_of_val(items)) }
}

/// What a buffer is made from.
pub(crate) struct BufferInfo<'a> {
    pub(crate) name: &'a str,
    pub(crate) bytes: u64,
    pub(crate) usage: vk::BufferUsageFlags,
    pub(crate) location: MemoryLocation,
}

/// A buffer and its memory.
pub(crate) struct Buffer {
    pub(crate) handle: vk::Buffer,
    pub(crate) bytes: u64,
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Buffer {
    pub(crate) fn new(device: &Arc<Device>, info: &BufferInfo<'_>) -> Result<Self, Fault> {
        let create = vk::BufferCreateInfo::default()
            .size(info.bytes)
            .usage(info.usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: size and usage are not zero, by the callers in this crate.
        let handle = unsafe { device.handle.create_buffer(&create, None) }
            .map_err(failed("vkCreateBuffer"))?;
        let mut buffer =
            Self { handle, bytes: info.bytes, allocation: None, device: Arc::clone(device) };
        device.name(handle, info.name);
        // SAFETY: the buffer was made by this device.
        let requirements = unsafe { device.handle.get_buffer_memory_requirements(handle) };
        let want = Want { name: info.name, requirements, location: info.location, linear: true };
        let allocation = device.memory.take(&want)?;
        // SAFETY: the allocation was made for these requirements and belongs to this buffer only.
        let bound = unsafe {
            device.handle.bind_buffer_memory(handle, allocation.memory(), allocation.offset())
        };
        buffer.allocation = Some(allocation);
        bound.map_err(failed("vkBindBufferMemory"))?;
        Ok(buffer)
    }

    /// The mapped bytes to write. The device must not use the buffer meanwhile.
    ///
    /// # Panics
    /// If the buffer lives where the host cannot reach it.
    pub(crate) fn mapped_mut(&mut self) -> &mut [u8] {
        let allocation = self.allocation.as_mut().expect("a made buffer has memory");
        let size = usize::try_from(self.bytes).expect("it is mapped, so it fits the address space");
        &mut allocation.mapped_slice_mut().expect("staging buffers are mapped")[..size]
    }

    /// The mapped bytes as rows to write, as many as fit whole.
    ///
    /// # Panics
    /// As [`Buffer::mapped_mut`], or if the memory is not aligned for the rows.
    pub(crate) fn rows_mut<T: Plain>(&mut self) -> &mut [T] {
        let bytes = self.mapped_mut();
        assert!(bytes.as_ptr().cast::<T>().is_aligned(), "Vulkan aligns mapped memory to 64 bytes");
        let rows = bytes.len() / size_of::<T>();
        // SAFETY: the bytes are `rows` rows long, aligned, borrowed for as long as the slice; any
        // bytes are a value of the plain types, whose fields are integers and floats.
        unsafe { core::slice::from_raw_parts_mut(bytes.as_mut_ptr().cast(), rows) }
    }

    /// The mapped bytes to read, once the device has written them and its fence was waited for.
    ///
    /// # Panics
    /// As [`Buffer::mapped_mut`].
    pub(crate) fn mapped(&self) -> &[u8] {
        let allocation = self.allocation.as_ref().expect("a made buffer has memory");
        let size = usize::try_from(self.bytes).expect("it is mapped, so it fits the address space");
        &allocation.mapped_slice().expect("readback buffers are mapped")[..size]
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once; the renderer waits for the queue before
        // it drops its buffers.
        unsafe { self.device.handle.destroy_buffer(self.handle, None) };
        if let Some(allocation) = self.allocation.take() {
            self.device.memory.give_back(allocation);
        }
    }
}

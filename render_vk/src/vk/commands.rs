//! Command pools, fences, and work that is waited for at once.
//!
//! In:    a device; closures that record.
//! Out:   [`Pool`], [`Fence`], [`OneOff`].
//! Keeps: the objects.
//! Not here: the commands of a frame (`record`).

use super::Device;
use crate::error::{Fault, failed};
use ash::vk;
use std::sync::Arc;

/// A command pool whose buffers are all begun anew after a reset.
pub(crate) struct Pool {
    handle: vk::CommandPool,
    device: Arc<Device>,
    name: String,
}

impl Pool {
    pub(crate) fn new(device: &Arc<Device>, name: &str) -> Result<Self, Fault> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.family);
        // SAFETY: the family is the one that the device was made with.
        let handle = unsafe { device.handle.create_command_pool(&info, None) }
            .map_err(failed("vkCreateCommandPool"))?;
        device.name(handle, name);
        Ok(Self { handle, device: Arc::clone(device), name: name.to_owned() })
    }

    /// Takes all commands out of the pool's buffers. They must not be pending.
    pub(crate) fn reset(&mut self) -> Result<(), Fault> {
        let flags = vk::CommandPoolResetFlags::empty();
        // SAFETY: the caller waited for the fence of the submit that used the buffers, and `&mut`
        // keeps other threads away.
        unsafe { self.device.handle.reset_command_pool(self.handle, flags) }
            .map_err(failed("vkResetCommandPool"))
    }

    /// One more buffer; it lives as long as the pool.
    pub(crate) fn buffer(
        &mut self,
        level: vk::CommandBufferLevel,
    ) -> Result<vk::CommandBuffer, Fault> {
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.handle)
            .level(level)
            .command_buffer_count(1);
        // SAFETY: the pool is this device's, and `&mut` keeps other threads away.
        let buffers = unsafe { self.device.handle.allocate_command_buffers(&info) }
            .map_err(failed("vkAllocateCommandBuffers"))?;
        self.device.name(buffers[0], &self.name);
        Ok(buffers[0])
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once, with its buffers; the renderer waits for
        // the queue before it drops its pools.
        unsafe { self.device.handle.destroy_command_pool(self.handle, None) };
    }
}

/// A fence, and whether something was submitted that will signal it.
pub(crate) struct Fence {
    handle: vk::Fence,
    pending: bool,
    device: Arc<Device>,
}

impl Fence {
    pub(crate) fn new(device: &Arc<Device>, name: &str) -> Result<Self, Fault> {
        let info = vk::FenceCreateInfo::default();
        // SAFETY: creating a fence has no condition.
        let handle =
            unsafe { device.handle.create_fence(&info, None) }.map_err(failed("vkCreateFence"))?;
        device.name(handle, name);
        Ok(Self { handle, pending: false, device: Arc::clone(device) })
    }

    /// Waits for the last submit, if it was not waited for yet.
    pub(crate) fn wait(&mut self) -> Result<(), Fault> {
        if !self.pending {
            return Ok(());
        }
        // SAFETY: the fence is this device's; a submit that signals it is pending, and once it is
        // over nothing uses the fence.
        unsafe {
            let device = &self.device.handle;
            device
                .wait_for_fences(&[self.handle], true, u64::MAX)
                .map_err(failed("vkWaitForFences"))?;
            device.reset_fences(&[self.handle]).map_err(failed("vkResetFences"))?;
        }
        self.pending = false;
        Ok(())
    }

    /// Submits one recorded primary buffer.
    pub(crate) fn submit(&mut self, buffer: vk::CommandBuffer) -> Result<(), Fault> {
        self.submit_between(buffer, &[], &[])
    }

    /// Submits one recorded primary buffer, whose copies wait for one semaphore each of `after`,
    /// and which signals those of `before`.
    pub(crate) fn submit_between(
        &mut self,
        buffer: vk::CommandBuffer,
        after: &[vk::Semaphore],
        before: &[vk::Semaphore],
    ) -> Result<(), Fault> {
        assert!(!self.pending, "a fence is waited for before it is used again");
        let buffers = [buffer];
        let stages = [vk::PipelineStageFlags::TRANSFER];
        let submits = [vk::SubmitInfo::default()
            .command_buffers(&buffers)
            .wait_semaphores(after)
            .wait_dst_stage_mask(&stages[..after.len()])
            .signal_semaphores(before)];
        // SAFETY: the buffer is recorded and not pending, the fence is unsignalled and not in use,
        // and the queue is only reached through a `&mut Renderer`; a host's only while a renderer
        // is made, for which the host lends it.
        unsafe { self.device.handle.queue_submit(self.device.queue, &submits, self.handle) }
            .map_err(failed("vkQueueSubmit"))?;
        self.pending = true;
        Ok(())
    }
}

impl Drop for Fence {
    fn drop(&mut self) {
        // SAFETY: made by this device and destroyed once; the renderer waits for the queue before
        // it drops its fences.
        unsafe { self.device.handle.destroy_fence(self.handle, None) };
    }
}

/// Begins a buffer that is submitted once.
pub(crate) fn begin(device: &Device, buffer: vk::CommandBuffer) -> Result<(), Fault> {
    let info =
        vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the buffer's pool was reset, so it is in its initial state, and the caller is the
    // only one who records it.
    unsafe { device.handle.begin_command_buffer(buffer, &info) }
        .map_err(failed("vkBeginCommandBuffer"))
}

/// Ends a buffer.
pub(crate) fn end(device: &Device, buffer: vk::CommandBuffer) -> Result<(), Fault> {
    // SAFETY: the buffer was begun by the caller, who is the only one who records it.
    unsafe { device.handle.end_command_buffer(buffer) }.map_err(failed("vkEndCommandBuffer"))
}

/// Records, submits and waits: for start-up, overflowing uploads and reading back.
pub(crate) struct OneOff {
    pool: Pool,
    buffer: vk::CommandBuffer,
    fence: Fence,
    device: Arc<Device>,
}

impl OneOff {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self, Fault> {
        let mut pool = Pool::new(device, "one-off")?;
        let buffer = pool.buffer(vk::CommandBufferLevel::PRIMARY)?;
        let fence = Fence::new(device, "one-off")?;
        Ok(Self { pool, buffer, fence, device: Arc::clone(device) })
    }

    /// Runs what `record` records, after everything submitted before, and waits for it.
    pub(crate) fn run(
        &mut self,
        record: impl FnOnce(&Device, vk::CommandBuffer),
    ) -> Result<(), Fault> {
        self.fence.wait()?;
        self.pool.reset()?;
        begin(&self.device, self.buffer)?;
        record(&self.device, self.buffer);
        end(&self.device, self.buffer)?;
        self.fence.submit(self.buffer)?;
        self.fence.wait()
    }
}

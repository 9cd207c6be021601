//! Device memory, cut from larger blocks.
//!
//! In:    requirements of a buffer or image and where it should live.
//! Out:   allocations.
//! Keeps: the blocks, until the device goes.
//! Not here: the buffers and images themselves.

use crate::error::Fault;
use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationError, AllocationSizes, AllocatorDebugSettings, MemoryLocation};
use overfly_core::frame::data::DeviceTotals;
use parking_lot::Mutex;

/// Size of a block: small, because a scene has few and known objects.
const BLOCK_BYTES: u64 = 8 << 20;

/// All memory of one device.
pub(crate) struct Memory {
    held: Mutex<Held>,
}

struct Held {
    allocator: Allocator,
    totals: DeviceTotals,
}

/// What an allocation is for.
pub(crate) struct Want<'a> {
    pub(crate) name: &'a str,
    pub(crate) requirements: vk::MemoryRequirements,
    pub(crate) location: MemoryLocation,
    /// Buffers are linear, images not.
    pub(crate) linear: bool,
}

impl Memory {
    pub(crate) fn new(
        instance: &ash::Instance,
        physical: vk::PhysicalDevice,
        device: &ash::Device,
    ) -> Result<Self, Fault> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::new(BLOCK_BYTES, BLOCK_BYTES),
        })
        .map_err(|e| fault("the allocator", 0, &e))?;
        Ok(Self { held: Mutex::new(Held { allocator, totals: DeviceTotals::default() }) })
    }

    pub(crate) fn take(&self, want: &Want<'_>) -> Result<Allocation, Fault> {
        let mut held = self.held.lock();
        let allocation = held
            .allocator
            .allocate(&AllocationCreateDesc {
                name: want.name,
                requirements: want.requirements,
                location: want.location,
                linear: want.linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|e| fault(want.name, want.requirements.size, &e))?;
        held.totals.allocations += 1;
        held.totals.bytes += allocation.size();
        Ok(allocation)
    }

    /// What is taken now.
    pub(crate) fn totals(&self) -> DeviceTotals {
        self.held.lock().totals
    }

    pub(crate) fn give_back(&self, allocation: Allocation) {
        // Fails only for allocations of another allocator, and there is one.
        let mut held = self.held.lock();
        held.totals.allocations -= 1;
        held.totals.bytes -= allocation.size();
        let freed = held.allocator.free(allocation);
        debug_assert!(freed.is_ok());
    }
}

fn fault(name: &str, bytes: u64, error: &AllocationError) -> Fault {
    let name = match error {
        AllocationError::OutOfMemory => name.to_owned(),
        other => format!("{name}: {other}"),
    };
    Fault::Memory { name, bytes }
}

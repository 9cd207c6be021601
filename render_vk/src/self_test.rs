//! Does the driver keep float arithmetic as written?
//!
//! In:    points and eyes of a fixed pseudo-random sequence.
//! Out:   an error if a two-sum on the device differs from the one on the host.
//! Keeps: nothing.
//! Not here: the pass that asks drivers for it (`spirv_pass.rs`).

use crate::error::StartError;

use crate::shaders;
use crate::vk::buffer::{Buffer, BufferInfo, bytes_of};
use crate::vk::descriptors::{Binding, Resource, Set, SetLayout};
use crate::vk::pipeline::{Layout, Pipeline};
use crate::vk::{Device, commands::OneOff, transfer};
use ash::vk;
use gpu_allocator::MemoryLocation;
use overfly_core::geodesy::{Ecef, TwoFloat};
use std::sync::Arc;

/// Four groups of 64 invocations.
const ITEMS: u32 = 256;
/// Point and eye, each high and low; the answer.
const ROWS: usize = 5;

/// Compares 256 eye-relative points, from 1 m to 30 000 km away, bit for bit.
pub(crate) fn run(device: &Arc<Device>, one_off: &mut OneOff) -> Result<(), StartError> {
    let cases = cases();
    let rows: Vec<[f32; 4]> = cases
        .iter()
        .flat_map(|(point, eye)| [point.hi, point.lo, eye.hi, eye.lo, [0.0; 3]])
        .map(|[x, y, z]| [x, y, z, 0.0])
        .collect();
    let bytes = bytes_of(&rows);
    let info = BufferInfo {
        name: "self-test",
        bytes: bytes.len() as u64,
        usage: vk::BufferUsageFlags::STORAGE_BUFFER,
        location: MemoryLocation::GpuToCpu,
    };
    let mut buffer = Buffer::new(device, &info)?;
    buffer.mapped_mut().copy_from_slice(bytes);
    let (kind, stages) = (vk::DescriptorType::STORAGE_BUFFER, vk::ShaderStageFlags::COMPUTE);
    let set_layout = SetLayout::new(device, "self-test", &[Binding { kind, stages }])?;
    let set = Set::new(&set_layout, &[Resource::Buffer(&buffer)])?;
    let layouts = [set_layout.handle];
    let layout_info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
    let layout = Layout::new(device, "self-test", &layout_info)?;
    let pipeline = Pipeline::compute(device, &layout, "self-test", &shaders::self_test())?;
    one_off.run(|device, commands| {
        transfer::self_test(device, commands, (&pipeline, &layout), &set, ITEMS / 64);
    })?;
    let answers = buffer.mapped().chunks_exact(ROWS * 16);
    let wrong = cases.iter().zip(answers).filter(|&(case, bytes)| !agrees(case, bytes)).count();
    match u32::try_from(wrong).expect("there are 256 cases") {
        0 => Ok(()),
        wrong => Err(StartError::Contracted { wrong, of: ITEMS }),
    }
}

fn agrees((point, eye): &(TwoFloat, TwoFloat), item: &[u8]) -> bool {
    let expected = point.relative_to(eye).0.to_array();
    let answer = &item[16 * (ROWS - 1)..];
    expected.iter().zip(answer.chunks_exact(4)).all(|(e, bytes)| e.to_ne_bytes() == bytes)
}

/// Points of the Earth's size and eyes at growing distances from them.
fn cases() -> Vec<(TwoFloat, TwoFloat)> {
    let mut state = 1_u64;
    let mut next = || {
        // Knuth's MMIX generator: any numbers will do that are not round.
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let high = u32::try_from(state >> 32).expect("32 bits are left");
        f64::from(high) / f64::from(u32::MAX) * 2.0 - 1.0
    };
    let mut vector = || glam::DVec3::new(next(), next(), next());
    let case = |i: u32| {
        // Near differences of the high parts are exact; only the far ones lose something.
        let away_m = f64::from(1_u32 << (i % 26));
        let point = vector() * 6_378_137.0;
        let eye = point + vector() * away_m;
        (Ecef(point).two_float(), Ecef(eye).two_float())
    };
    (0..ITEMS).map(case).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cases_would_show_a_lost_low_part() {
        let plain = |(point, eye): &(TwoFloat, TwoFloat)| {
            let axis = |i: usize| (point.hi[i] - eye.hi[i]) + (point.lo[i] - eye.lo[i]);
            [axis(0), axis(1), axis(2)]
        };
        let cases = cases();
        let differ =
            cases.iter().filter(|c| plain(c) != c.0.relative_to(&c.1).0.to_array()).count();
        assert!(differ > 10, "only {differ} of {} cases tell", cases.len());
    }
}

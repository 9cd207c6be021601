//! Draws a view of the planet with Vulkan, without a window.
//!
//! In:    [`ViewDraws`] and [`Patches`] of a frame, [`FrameParts`], a [`Team`].
//! Out:   a picture, [`DrawReport`], [`StartError`] or [`DrawError`].
//! Keeps: Vulkan objects; which patch slots the device has.
//! Not here: what is drawn (`overfly_core`), windows.
//!
//! The Vulkan loader is found at run time: a program without it, or without a driver, gets a
//! [`StartError`] that says what to install.
//!
//! # One picture
//!
//! Vertices of patches that are new on the device are staged and copied. Each depth range, from far
//! to near, is one instance of a render pass that clears the depth; the farthest clears the colour
//! and ends with the sky. Patches are recorded into secondary command buffers, in parallel. Two
//! frames are in flight: recording one overlaps with the device drawing the other.
#![deny(unsafe_code)]

mod error;
mod matrices;
mod passes;
#[expect(unsafe_code, reason = "recording is calls of Vulkan")]
mod record;
mod self_test;
mod shaders;
mod targets;
mod upload;
#[expect(unsafe_code, reason = "owners of Vulkan objects")]
mod vk;

pub use crate::error::{DrawError, StartError};
pub use crate::vk::instance::{DeviceInfo, devices, layers};

use crate::matrices::ViewTerms;
use crate::passes::Passes;
use crate::record::{Frame, Scene};
use crate::targets::Targets;
use crate::upload::{Arena, Staged};
use crate::vk::buffer::{Buffer, BufferInfo};
use crate::vk::{Device, commands::OneOff, transfer};
use gpu_allocator::MemoryLocation;
use overfly_core::frame::data::ViewDraws;
use overfly_core::mesh::{Patches, topology};
use overfly_core::scene::FrameParts;
use overfly_jobs::Team;
use std::sync::Arc;

/// What a renderer is made for. All memory is taken at the start.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RendererSettings {
    /// A patch is 2^k triangles; 0, 2, 4, 6 or 8, as in the scene's settings.
    pub patch_depth: u8,
    /// Slots of the patch arena; at least 1.
    pub patches_max: u32,
    /// Width and height of the pictures in pixels.
    pub size_px: [u32; 2],
    /// Most depth ranges of a view; 1 to 16.
    pub ranges_max: u32,
    /// Pictures that the device may be behind; 1 to 4, usually 2.
    pub frames_in_flight: u32,
    /// Whether to run under the validation layer, with synchronisation checks. Slow.
    pub validation: bool,
}

/// How much work a picture was.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DrawReport {
    /// Patches copied to the device.
    pub uploaded_patches: u32,
    /// The same in bytes.
    pub uploaded_bytes: u64,
    /// Patches drawn, summed over depth ranges; the sky is not counted.
    pub draws: u32,
    /// Secondary command buffers, the sky's included.
    pub secondaries: u32,
    /// Triangles of all draws.
    pub triangles: u64,
}

/// Draws pictures of one size.
pub struct Renderer {
    settings: RendererSettings,
    targets: Targets,
    passes: Passes,
    arena: Arena,
    one_off: OneOff,
    frames: Vec<Frame>,
    next_frame: usize,
    copies: Vec<ash::vk::BufferCopy>,
    drawn: bool,
    device: Arc<Device>,
}

impl Renderer {
    /// Opens the best device and takes all memory.
    ///
    /// # Errors
    /// [`StartError`]: no loader, driver or layer, a setting beyond the device, a driver that
    /// reorders float arithmetic, or a failed call.
    pub fn new(settings: &RendererSettings) -> Result<Self, StartError> {
        check(settings)?;
        let device = Arc::new(Device::new(settings.validation)?);
        check_limits(settings, &device.limits)?;
        let mut one_off = OneOff::new(&device)?;
        self_test::run(&device, &mut one_off)?;
        let targets = Targets::new(&device, settings.size_px)?;
        let passes = Passes::new(&device, &targets)?;
        let (depth, slots) = (settings.patch_depth, settings.patches_max);
        let arena = Arena::new(&device, &mut one_off, depth, slots)?;
        let frames = (0..settings.frames_in_flight)
            .map(|index| Frame::new(&device, &arena, index))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            settings: *settings,
            targets,
            passes,
            arena,
            one_off,
            frames,
            next_frame: 0,
            copies: Vec::new(),
            drawn: false,
            device,
        })
    }

    /// Tells which slots were built in a frame: their vertices on the device are out of date. To
    /// be called every frame, drawn or not. Slots beyond the arena are ignored.
    pub fn note_built(&mut self, slots: &[u32]) {
        self.arena.mark(slots);
    }

    /// Draws a view. Returns once the work is submitted; at most
    /// [`RendererSettings::frames_in_flight`] pictures are unfinished.
    ///
    /// # Errors
    /// [`DrawError`]: view or arena do not fit the settings, or a call failed. After a failed call
    /// every patch is uploaded again.
    pub fn draw(
        &mut self,
        view: &ViewDraws,
        patches: &Patches,
        parts: &FrameParts,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        self.check_draw(view, patches)?;
        let terms = ViewTerms::new(&view.camera, parts);
        let report = self.draw_checked(view, terms, patches, team);
        if report.is_err() {
            self.arena.mark_all();
        }
        report
    }

    fn draw_checked(
        &mut self,
        view: &ViewDraws,
        terms: ViewTerms,
        patches: &Patches,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        let frame = self.next_frame;
        self.next_frame = (frame + 1) % self.frames.len();
        self.frames[frame].fence.wait()?;
        let uploaded = self.stage(frame, patches)?;
        let scene = Scene {
            device: &self.device,
            targets: &self.targets,
            passes: &self.passes,
            arena: &self.arena,
            view,
            terms,
        };
        let frame = &mut self.frames[frame];
        let secondaries = frame.record_secondaries(&scene, team)?;
        let primary = frame.record_primary(&scene, &self.copies)?;
        frame.fence.submit(primary)?;
        self.drawn = true;
        let draws: usize = view.ranges.iter().map(|range| range.patches.len()).sum();
        Ok(DrawReport {
            uploaded_patches: uploaded.patches,
            uploaded_bytes: uploaded.bytes,
            draws: u32::try_from(draws).expect("slots and ranges are few"),
            secondaries,
            triangles: (draws as u64) << self.settings.patch_depth,
        })
    }

    /// Stages what is out of date. What fits the staging buffer is left in `copies`, to go with
    /// the frame; anything before that is copied and waited for here.
    fn stage(&mut self, frame: usize, patches: &Patches) -> Result<Staged, DrawError> {
        let mut all = Staged::default();
        loop {
            let staging = &mut self.frames[frame].staging;
            let part = self.arena.stage(patches, staging, &mut self.copies);
            all.patches += part.patches;
            all.bytes += part.bytes;
            if !part.more {
                return Ok(all);
            }
            let (staging, vertices) = (&self.frames[frame].staging, &self.arena.vertices);
            let copies = &self.copies;
            self.one_off.run(|device, buffer| {
                transfer::copies(device, buffer, (staging, vertices), copies);
            })?;
        }
    }

    fn check_draw(&self, view: &ViewDraws, patches: &Patches) -> Result<(), DrawError> {
        let settings = &self.settings;
        if view.camera.size_px != settings.size_px {
            let renderer = settings.size_px;
            return Err(DrawError::Size { view: view.camera.size_px, renderer });
        }
        if view.ranges.len() > settings.ranges_max as usize {
            let max = settings.ranges_max;
            return Err(DrawError::Ranges { found: view.ranges.len(), max });
        }
        let renderer = (settings.patch_depth, settings.patches_max);
        let found = (patches.patch_depth, patches.leaf.len());
        if found.0 != renderer.0 || found.1 > renderer.1 as usize {
            return Err(DrawError::Patches { found, renderer });
        }
        let live = |slot: u32| matches!(patches.leaf.get(slot as usize), Some(Some(_)));
        let mut slots = view.ranges.iter().flat_map(|range| &range.patches);
        match slots.find(|&&slot| !live(slot)) {
            Some(&slot) => Err(DrawError::Slot { slot }),
            None => Ok(()),
        }
    }

    /// The last picture, once it is finished: four bytes a pixel, red, green, blue with the sRGB
    /// curve and 255; rows from the top.
    ///
    /// # Errors
    /// [`DrawError::NothingDrawn`] before the first draw, or a failed call.
    pub fn read_pixels(&mut self) -> Result<Vec<u8>, DrawError> {
        if !self.drawn {
            return Err(DrawError::NothingDrawn);
        }
        let targets = &self.targets;
        self.one_off.run(|device, buffer| {
            transfer::read_back(
                device,
                buffer,
                (&targets.colour, &targets.pixels),
                targets.size_px,
            );
        })?;
        Ok(targets.pixels.mapped().to_vec())
    }

    /// Waits until the device has finished all pictures: for those who measure.
    ///
    /// # Errors
    /// A failed call.
    pub fn wait(&mut self) -> Result<(), DrawError> {
        for frame in &mut self.frames {
            frame.fence.wait()?;
        }
        Ok(())
    }

    /// Name of the device, its driver and its Vulkan version, in one line.
    pub fn device_line(&self) -> String {
        self.device.line().to_owned()
    }

    /// Errors and warnings of the validation layer so far, each with its VUID; empty without
    /// validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.messages()
    }

    /// Reads after writing without a barrier, on a small buffer of its own: whoever relies on
    /// [`Renderer::validation_messages`] being empty checks with this that it can be otherwise.
    ///
    /// # Errors
    /// A failed call.
    pub fn cause_hazard_on_purpose(&mut self) -> Result<(), DrawError> {
        let usage =
            ash::vk::BufferUsageFlags::TRANSFER_SRC | ash::vk::BufferUsageFlags::TRANSFER_DST;
        let location = MemoryLocation::GpuOnly;
        let info = BufferInfo { name: "scratch of the hazard", bytes: 64, usage, location };
        let scratch = Buffer::new(&self.device, &info)?;
        self.one_off.run(|device, buffer| transfer::hazard(device, buffer, &scratch))?;
        Ok(())
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // Owners may be destroyed only when nothing uses them. A lost device uses nothing.
        let _ = self.device.wait_idle();
    }
}

fn setting(field: &'static str, found: u64, allowed: String) -> Result<(), StartError> {
    Err(StartError::Setting { field, found, allowed })
}

/// Checks what does not depend on the device.
fn check(settings: &RendererSettings) -> Result<(), StartError> {
    let depth = settings.patch_depth;
    if depth > 8 || depth % 2 == 1 {
        return setting("patch_depth", depth.into(), "0, 2, 4, 6 or 8".into());
    }
    let segments = topology::segments(depth);
    let vertices_per_patch = (segments + 1) * (segments + 2) / 2;
    // Vertex offsets of draws are signed.
    let patches_end = i32::MAX.unsigned_abs() / vertices_per_patch;
    for (field, found, max) in [
        ("patches_max", settings.patches_max, patches_end),
        ("ranges_max", settings.ranges_max, 16),
        ("frames_in_flight", settings.frames_in_flight, 4),
    ] {
        if found == 0 || found > max {
            return setting(field, found.into(), format!("1 to {max}"));
        }
    }
    Ok(())
}

/// Checks the picture's size.
fn check_limits(
    settings: &RendererSettings,
    limits: &ash::vk::PhysicalDeviceLimits,
) -> Result<(), StartError> {
    let image = limits.max_image_dimension2_d;
    let largest = [
        image.min(limits.max_framebuffer_width).min(limits.max_viewport_dimensions[0]),
        image.min(limits.max_framebuffer_height).min(limits.max_viewport_dimensions[1]),
    ];
    for (found, max) in settings.size_px.into_iter().zip(largest) {
        if found == 0 || found > max {
            return setting("size_px", found.into(), format!("1 to {max}"));
        }
    }
    Ok(())
}

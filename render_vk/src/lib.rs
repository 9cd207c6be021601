//! Draws a view of the planet with Vulkan: into pictures, into a window, on a host's own device.
//!
//! In:    a [`Picture`]: draws and patches of a frame, what to show; a [`Team`]; a host's handles.
//! Out:   a picture, [`DrawReport`], [`StartError`] or [`DrawError`].
//! Keeps: Vulkan objects; which patch slots the device has.
//! Not here: what is drawn (`overfly_core`), windows and their events (the host).
//!
//! The Vulkan loader is found at run time: a program without it, or without a driver, gets a
//! [`StartError`] that says what to install.
//!
//! # One picture
//!
//! Vertices of patches that are new on the device are staged and copied. Each depth range, from far
//! to near, is one instance of a render pass that clears the depth; the farthest clears the colour
//! and ends with the sky, the nearest ends with the overlay. The rows of one multi-draw-indirect a
//! range, and the vertices that the host places, are written in parallel; so are the secondary
//! command buffers. Two frames are in flight: recording one overlaps with the device drawing the
//! other. A window gets a copy of the finished picture.
//!
//! [`Renderer`] owns device, targets and submits; [`HostRenderer`] records the same copies and draws
//! into a host's command buffers, inside the host's passes. [`ash`] is the one that it speaks.
#![deny(unsafe_code)]

mod detail;
mod drawing;
mod error;
mod eye;
mod imagery;
mod matrices;
mod overlay;
mod parts;
mod passes;
mod picture;
#[expect(unsafe_code, reason = "recording is calls of Vulkan")]
mod record;
mod rings;
mod self_test;
mod settings;
mod shaders;
mod targets;
mod upload;
#[expect(unsafe_code, reason = "owners of Vulkan objects")]
mod vk;

pub use ash;

pub use crate::error::{DrawError, StartError};
pub use crate::matrices::projection;
pub use crate::overlay::{CELL_PX, Colour, Overlay};
pub use crate::picture::{Backdrop, Picture, Show};
pub use crate::record::host::{HostFrame, HostRenderer};
pub use crate::settings::RendererSettings;
pub use crate::vk::host::{HostDevice, HostTarget, required_features};
pub use crate::vk::instance::{DeviceInfo, devices, layers};
pub use crate::vk::swapchain::Presented;

use crate::drawing::Drawing;
use crate::record::secondaries::{Frame, Scene};
use crate::targets::{RangePasses, Targets};
use crate::vk::buffer::{Buffer, BufferInfo};
use crate::vk::instance::Window;
use crate::vk::swapchain::Swapchain;
use crate::vk::{Device, commands::OneOff, transfer};
use gpu_allocator::MemoryLocation;
use overfly_core::frame::data::DeviceTotals;
use overfly_core::geodesy::narrow;
use overfly_core::mesh::drape::NewTile;
use overfly_core::settings::DepthFormat;
use overfly_jobs::Team;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::sync::Arc;

/// How much work a picture was.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DrawReport {
    /// Patches copied to the device.
    pub uploaded_patches: u32,
    /// The same in bytes.
    pub uploaded_bytes: u64,
    /// Patches drawn, summed over depth ranges; the sky is not counted.
    pub draws: u32,
    /// Indirect draw commands that draw them.
    pub commands: u32,
    /// Secondary command buffers, the sky's included.
    pub secondaries: u32,
    /// Triangles of all draws.
    pub triangles: u64,
    /// Pipelines made so far; the same from frame to frame unless a new kind of view is asked for.
    pub pipelines: u32,
}

/// Most depth ranges of a view.
const RANGES_MAX: u32 = 16;

/// Draws pictures of one size, which can be changed, on a device of its own.
pub struct Renderer {
    range_passes: RangePasses,
    targets: Targets,
    drawing: Drawing,
    one_off: OneOff,
    frames: Vec<Frame>,
    next_frame: usize,
    drawn: bool,
    window: Option<Swapchain>,
    device: Arc<Device>,
}

impl Renderer {
    /// Opens the best device and takes all memory. Draws without a window.
    ///
    /// # Errors
    /// [`StartError`]: no loader, driver or layer, a setting beyond the device, a driver that
    /// reorders float arithmetic, or a failed call.
    pub fn new(settings: &RendererSettings) -> Result<Self, StartError> {
        Self::start(settings, None)
    }

    /// As [`Self::new`], on the best device that can draw to a window; [`Self::present`] shows
    /// pictures there. The renderer keeps `window` for as long as it lives.
    ///
    /// # Errors
    /// As [`Self::new`], or [`StartError::NoSurface`].
    pub fn for_window<W>(settings: &RendererSettings, window: Arc<W>) -> Result<Self, StartError>
    where
        W: HasWindowHandle + HasDisplayHandle + Send + Sync + 'static,
    {
        let reason =
            |e: raw_window_handle::HandleError| StartError::NoSurface { reason: e.to_string() };
        let display = window.display_handle().map_err(reason)?.as_raw();
        let handle = window.window_handle().map_err(reason)?.as_raw();
        Self::start(settings, Some(Window { display, window: handle, owner: window }))
    }

    fn start(settings: &RendererSettings, window: Option<Window>) -> Result<Self, StartError> {
        settings.check()?;
        let has_window = window.is_some();
        let device = Arc::new(Device::new(settings.validation, window)?);
        RendererSettings::check_size(settings.size_px, &device.limits)?;
        let mut one_off = OneOff::new(&device)?;
        let range_passes = RangePasses::new(&device, settings.depth_format, settings.keep_depth)?;
        let targets = Targets::new(&device, &range_passes, settings.size_px)?;
        let drawing = Drawing::new(&device, settings, range_passes.subpass(), &mut one_off)?;
        let frames = (0..settings.frames_in_flight).map(|index| Frame::new(&device, index));
        let frames = frames.collect::<Result<_, _>>()?;
        let window = has_window.then(|| Swapchain::new(&device, settings.size_px)).transpose()?;
        Ok(Self {
            range_passes,
            targets,
            drawing,
            one_off,
            frames,
            next_frame: 0,
            drawn: false,
            window,
            device,
        })
    }

    /// What it was made for; the size as it is now.
    pub fn settings(&self) -> &RendererSettings {
        &self.drawing.settings
    }

    /// Tells which slots were built in a frame: their vertices on the device are out of date. To
    /// be called every frame, drawn or not. Slots beyond the arena are ignored.
    pub fn note_built(&mut self, slots: &[u32]) {
        self.drawing.arena.mark(slots);
    }

    /// Tells which tiles of imagery are new in their layers, as [`Self::note_built`] of patches. A
    /// renderer that comes late is told of all that the terrain has.
    pub fn note_tiles(&mut self, tiles: &[NewTile]) {
        self.drawing.note_tiles(tiles);
    }

    /// Changes the size of the pictures, and tells the window's chain of it. Waits for all
    /// pictures that are being drawn.
    ///
    /// # Errors
    /// [`DrawError::Resize`]: beyond the device, the size stays as it was; or a failed call.
    pub fn resize(&mut self, size_px: [u32; 2]) -> Result<(), DrawError> {
        let limits = &self.device.limits;
        RendererSettings::check_size(size_px, limits)
            .map_err(|error| DrawError::Resize(Box::new(error)))?;
        if let Some(window) = &mut self.window {
            window.resize(size_px);
        }
        if size_px != self.settings().size_px {
            self.wait()?;
            self.device.wait_idle()?;
            self.targets = Targets::new(&self.device, &self.range_passes, size_px)?;
            self.drawing.settings.size_px = size_px;
            self.drawn = false;
        }
        Ok(())
    }

    /// Draws a picture. Returns once the work is submitted; at most
    /// [`RendererSettings::frames_in_flight`] pictures are unfinished.
    ///
    /// # Errors
    /// [`DrawError`]: view or arena do not fit the settings, or a call failed. After a failed call
    /// every patch is uploaded again.
    pub fn draw(
        &mut self,
        picture: &Picture<'_>,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        let (view, renderer) = (picture.view.camera.size_px, self.settings().size_px);
        if view != renderer {
            return Err(DrawError::Size { view, renderer });
        }
        let index = self.next_frame;
        self.frames[index].fence.wait()?;
        let report = self.drawing.prepare(index, picture, team)?;
        self.next_frame = (index + 1) % self.frames.len();
        let scene = Scene {
            drawing: &self.drawing,
            index,
            range_passes: &self.range_passes,
            targets: &self.targets,
            backdrop: picture.backdrop,
        };
        match self.frames[index].submit(&scene, team) {
            Ok(secondaries) => {
                self.drawn = true;
                Ok(DrawReport { secondaries, ..report })
            }
            Err(error) => {
                self.drawing.arena.mark_all();
                Err(error)
            }
        }
    }

    /// Shows the last picture in the window, scaled where their sizes differ.
    ///
    /// # Errors
    /// [`DrawError::NoWindow`], [`DrawError::NothingDrawn`], or a failed call.
    pub fn present(&mut self) -> Result<Presented, DrawError> {
        let Some(window) = &mut self.window else { return Err(DrawError::NoWindow) };
        if !self.drawn {
            return Err(DrawError::NothingDrawn);
        }
        Ok(window.present(&self.targets.colour, self.targets.size_px)?)
    }

    /// The last picture, once it is finished: four bytes a pixel, red, green, blue with the sRGB
    /// curve and 255; rows from the top.
    ///
    /// # Errors
    /// [`DrawError::NothingDrawn`] before the first draw, or a failed call.
    pub fn read_pixels(&mut self) -> Result<Vec<u8>, DrawError> {
        self.read(false)
    }

    /// The depth of the nearest range in the last picture, rows from the top: from 0 to 1 as the
    /// settings' format and order have it, cleared where that range drew nothing.
    ///
    /// # Errors
    /// [`DrawError::NoDepthKept`] if the settings do not ask for it, [`DrawError::NothingDrawn`]
    /// before the first draw, or a failed call.
    pub fn read_depth(&mut self) -> Result<Vec<f32>, DrawError> {
        if !self.settings().keep_depth {
            return Err(DrawError::NoDepthKept);
        }
        let bytes = self.read(true)?;
        let words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
        Ok(match self.settings().depth_format {
            DepthFormat::D32F => words.map(f32::from_ne_bytes).collect(),
            DepthFormat::D24 => {
                let depth = |b| f64::from(u32::from_ne_bytes(b) & 0xff_ffff) / f64::from(0xff_ffff);
                words.map(|b| narrow(depth(b))).collect()
            }
        })
    }

    fn read(&mut self, depth: bool) -> Result<Vec<u8>, DrawError> {
        if !self.drawn {
            return Err(DrawError::NothingDrawn);
        }
        let targets = &self.targets;
        let image = if depth { &targets.depth } else { &targets.colour };
        self.one_off.run(|device, buffer| {
            transfer::read_back(device, buffer, (image, &targets.pixels), targets.size_px);
        })?;
        Ok(targets.pixels.mapped().to_vec())
    }

    /// Device memory that is taken now.
    pub fn device_totals(&self) -> DeviceTotals {
        self.device.memory.totals()
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

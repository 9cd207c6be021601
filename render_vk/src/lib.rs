//! Draws a view of the planet with Vulkan, into pictures or into a window.
//!
//! In:    a [`Picture`]: draws and patches of a frame, what to show; a [`Team`].
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
#![deny(unsafe_code)]

mod detail;
mod error;
mod eye;
mod imagery;
mod matrices;
mod overlay;
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

pub use crate::error::{DrawError, StartError};
pub use crate::overlay::{CELL_PX, Colour, Overlay};
pub use crate::picture::{Backdrop, Picture, Show};
pub use crate::settings::RendererSettings;
pub use crate::vk::instance::{DeviceInfo, devices, layers};
pub use crate::vk::swapchain::Presented;

use crate::imagery::Imagery;
use crate::matrices::{Fixed, ViewTerms};
use crate::overlay::OverlayVertex;
use crate::passes::{PassInfo, Passes};
use crate::record::{Frame, Scene};
use crate::targets::{RangePasses, Targets};
use crate::upload::{Arena, Copies, Staged};
use crate::vk::buffer::{Buffer, BufferInfo};
use crate::vk::instance::Window;
use crate::vk::swapchain::Swapchain;
use crate::vk::{Device, commands::OneOff, transfer};
use gpu_allocator::MemoryLocation;
use overfly_core::frame::data::DeviceTotals;
use overfly_core::geodesy::narrow;
use overfly_core::mesh::Patches;
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

/// Draws pictures of one size, which can be changed.
pub struct Renderer {
    settings: RendererSettings,
    fixed: Fixed,
    range_passes: RangePasses,
    targets: Targets,
    passes: Passes,
    arena: Arena,
    imagery: Option<Imagery>,
    one_off: OneOff,
    frames: Vec<Frame>,
    next_frame: usize,
    copies: Copies,
    corners: Vec<OverlayVertex>,
    /// All live slots, for the view that shows what was culled.
    live: Vec<u32>,
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
        self_test::run(&device, &mut one_off)?;
        let range_passes = RangePasses::new(&device, settings.depth_format, settings.keep_depth)?;
        let targets = Targets::new(&device, &range_passes, settings.size_px)?;
        let info = PassInfo { device: &device, passes: &range_passes, settings };
        let passes = Passes::new(&info, &mut one_off)?;
        let arena = Arena::new(&device, &mut one_off, settings)?;
        let drapes = passes.imagery.as_ref().zip(arena.drapes.as_ref());
        let imagery = drapes.map(|drapes| Imagery::new(&device, &mut one_off, drapes));
        let imagery = imagery.transpose()?;
        let frames = (0..settings.frames_in_flight)
            .map(|index| Frame::new(&device, &arena, (&passes, settings), index))
            .collect::<Result<_, _>>()?;
        let window = has_window.then(|| Swapchain::new(&device, settings.size_px)).transpose()?;
        Ok(Self {
            settings: *settings,
            fixed: Fixed {
                morph_ms: narrow(f64::from(settings.morph_ms())),
                tolerance_px: narrow(settings.tolerance_px),
                vertices_per_patch: settings.vertices_per_patch(),
            },
            range_passes,
            targets,
            passes,
            arena,
            imagery,
            one_off,
            frames,
            next_frame: 0,
            copies: Copies::default(),
            corners: Vec::new(),
            live: Vec::new(),
            drawn: false,
            window,
            device,
        })
    }

    /// What it was made for; the size as it is now.
    pub fn settings(&self) -> &RendererSettings {
        &self.settings
    }

    /// Tells which slots were built in a frame: their vertices on the device are out of date. To
    /// be called every frame, drawn or not. Slots beyond the arena are ignored.
    pub fn note_built(&mut self, slots: &[u32]) {
        self.arena.mark(slots);
    }

    /// Tells which tiles of imagery are new in their layers, as [`Self::note_built`] of patches. A
    /// renderer that comes late is told of all that the terrain has.
    pub fn note_tiles(&mut self, tiles: &[NewTile]) {
        if let Some(imagery) = &mut self.imagery {
            imagery.note(tiles);
        }
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
        if size_px != self.settings.size_px {
            self.wait()?;
            self.device.wait_idle()?;
            self.targets = Targets::new(&self.device, &self.range_passes, size_px)?;
            self.settings.size_px = size_px;
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
        self.check_draw(picture)?;
        let report = self.draw_checked(picture, team);
        if report.is_err() {
            self.arena.mark_all();
        }
        report
    }

    fn draw_checked(
        &mut self,
        picture: &Picture<'_>,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        let frame = self.next_frame;
        self.next_frame = (frame + 1) % self.frames.len();
        self.frames[frame].fence.wait()?;
        let uploaded = self.stage(frame, picture.patches)?;
        self.stage_tiles(frame)?;
        let settings = &self.settings;
        let info = PassInfo { device: &self.device, passes: &self.range_passes, settings };
        let is_debug = picture.show != Show::Shaded;
        self.passes.complete(&info, (is_debug, !picture.overlay.is_empty()))?;
        let mut lists: [&[u32]; RANGES_MAX as usize] = [&[]; RANGES_MAX as usize];
        let lists = &mut lists[..picture.view.ranges.len()];
        if picture.show == Show::Culled {
            let slots = (0_u32..).zip(&picture.patches.leaf);
            self.live.clear();
            self.live.extend(slots.filter(|(_, leaf)| leaf.is_some()).map(|(slot, _)| slot));
            lists.fill(&self.live);
        } else {
            let ranges = picture.view.ranges.iter().map(|range| &range.patches[..]);
            lists.iter_mut().zip(ranges).for_each(|(list, range)| *list = range);
        }
        let Frame { rings, .. } = &mut self.frames[frame];
        rings.write_view(ViewTerms::new(picture, &self.fixed));
        rings.write_places(picture, lists.iter().copied(), settings.morph_ms(), team);
        rings.write_overlay(picture, &mut self.corners)?;
        if is_debug {
            rings.write_infos(&self.passes, settings.patches_max, picture.infos)?;
        }
        let scene = Scene {
            device: &self.device,
            settings,
            range_passes: &self.range_passes,
            targets: &self.targets,
            passes: &self.passes,
            arena: &self.arena,
            imagery: self.imagery.as_ref(),
            picture,
            lists,
        };
        let frame = &mut self.frames[frame];
        let (secondaries, commands) = frame.record_secondaries(&scene, team)?;
        let primary = frame.record_primary(&scene, &self.copies)?;
        frame.fence.submit(primary)?;
        self.drawn = true;
        let draws: usize = lists.iter().map(|list| list.len()).sum();
        Ok(DrawReport {
            uploaded_patches: uploaded.patches,
            uploaded_bytes: uploaded.bytes,
            draws: u32::try_from(draws).expect("slots and ranges are few"),
            commands,
            secondaries,
            triangles: (draws as u64) << self.settings.patch_depth,
            pipelines: self.passes.count(),
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
            let (staging, arena, copies) = (&self.frames[frame].staging, &self.arena, &self.copies);
            self.one_off.run(|device, buffer| copies.record(device, buffer, (staging, arena)))?;
        }
    }

    /// As [`Self::stage`], for tiles of imagery.
    fn stage_tiles(&mut self, frame: usize) -> Result<(), DrawError> {
        let Some(imagery) = &mut self.imagery else { return Ok(()) };
        let tiles = self.frames[frame].tiles.as_mut().expect("made where there is imagery");
        while imagery.stage(tiles) {
            self.one_off.run(|device, buffer| imagery.record(device, buffer, tiles))?;
        }
        Ok(())
    }

    fn check_draw(&self, picture: &Picture<'_>) -> Result<(), DrawError> {
        let (settings, view, patches) = (&self.settings, picture.view, picture.patches);
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
        if settings.morphs() == patches.morphs.is_empty() {
            return Err(DrawError::Morphs { found: patches.morphs.len() });
        }
        if settings.imagery == patches.drapes.is_empty() {
            return Err(DrawError::Drapes { found: patches.drapes.len() });
        }
        let longest = view.ranges.iter().map(|range| range.patches.len()).max().unwrap_or(0);
        if longest > settings.patches_max as usize {
            return Err(DrawError::Draws { found: longest, max: settings.patches_max });
        }
        let live = |slot: u32| matches!(patches.leaf.get(slot as usize), Some(Some(_)));
        let mut slots = view.ranges.iter().flat_map(|range| &range.patches);
        match slots.find(|&&slot| !live(slot)) {
            Some(&slot) => Err(DrawError::Slot { slot }),
            None => Ok(()),
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
        Ok(window.present(&self.targets.colour, self.settings.size_px)?)
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
        if !self.settings.keep_depth {
            return Err(DrawError::NoDepthKept);
        }
        let bytes = self.read(true)?;
        let words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
        Ok(match self.settings.depth_format {
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

//! What pictures are drawn with, whoever owns device and targets: pipelines, patches, imagery.
//!
//! In:    a device, a subpass to draw into; pictures.
//! Out:   [`Drawing`]: everything of a picture staged and written, ready to be recorded.
//! Keeps: pipelines, the arena, imagery; what is written for each frame in flight.
//! Not here: recording (`record`), targets and submits (`Renderer`, or the host).

use crate::error::{DrawError, Fault, StartError};
use crate::imagery::{Imagery, TileStaging};
use crate::matrices::{Fixed, ViewTerms};
use crate::overlay::OverlayVertex;
use crate::parts::{Asked, Lit};
use crate::passes::{PassInfo, Passes};
use crate::picture::{Backdrop, Picture, Show};
use crate::record::Plan;
use crate::rings::Rings;
use crate::settings::RendererSettings;
use crate::upload::{Arena, Staged, Staging};
use crate::vk::pipeline::Subpass;
use crate::vk::{Device, commands::OneOff};
use crate::{DrawReport, RANGES_MAX, self_test};
use overfly_core::geodesy::narrow;
use overfly_core::mesh::Patches;
use overfly_core::mesh::drape::NewTile;
use overfly_jobs::Team;
use std::sync::Arc;

/// Everything to draw with, for one kind of target.
pub(crate) struct Drawing {
    pub(crate) settings: RendererSettings,
    pub(crate) passes: Passes,
    pub(crate) arena: Arena,
    pub(crate) imagery: Option<Imagery>,
    pub(crate) in_flight: Vec<InFlight>,
    into: Subpass,
    fixed: Fixed,
    corners: Vec<OverlayVertex>,
    /// All live slots, for the view that shows what was culled.
    live: Vec<u32>,
    pub(crate) device: Arc<Device>,
}

/// What must not be touched while the device works on a picture.
pub(crate) struct InFlight {
    pub(crate) rings: Rings,
    pub(crate) plan: Plan,
    /// Never empty: the first is kept, others are for one picture.
    pub(crate) staging: Vec<Staging>,
    /// As `staging`; empty without imagery.
    pub(crate) tiles: Vec<TileStaging>,
    name: String,
}

impl Drawing {
    /// Takes all memory and makes the ground's pipeline.
    pub(crate) fn new(
        device: &Arc<Device>,
        settings: &RendererSettings,
        into: Subpass,
        one_off: &mut OneOff,
    ) -> Result<Self, StartError> {
        self_test::run(device, one_off)?;
        let passes = Passes::new(&PassInfo { device, into, settings }, one_off)?;
        let arena = Arena::new(device, one_off, settings)?;
        let drapes = passes.imagery.as_ref().zip(arena.drapes.as_ref());
        let imagery = drapes.map(|drapes| Imagery::new(device, one_off, drapes));
        let imagery = imagery.transpose()?;
        let in_flight = |index| InFlight::new(device, &arena, (&passes, settings), index);
        Ok(Self {
            settings: *settings,
            in_flight: (0..settings.frames_in_flight).map(in_flight).collect::<Result<_, _>>()?,
            passes,
            arena,
            imagery,
            into,
            fixed: Fixed {
                morph_ms: narrow(f64::from(settings.morph_ms())),
                tolerance_px: narrow(settings.tolerance_px),
                vertices_per_patch: settings.vertices_per_patch(),
            },
            corners: Vec::new(),
            live: Vec::new(),
            device: Arc::clone(device),
        })
    }

    /// Tiles of imagery that are new in their layers.
    pub(crate) fn note_tiles(&mut self, tiles: &[NewTile]) {
        if let Some(imagery) = &mut self.imagery {
            imagery.note(tiles);
        }
    }

    /// Stages and writes all that a picture needs, for the device to work on under `index`. The
    /// device must have finished what was there before.
    ///
    /// # Errors
    /// The picture does not fit, or a call failed; then every patch is uploaded again. There is
    /// nothing to record in either case.
    pub(crate) fn prepare(
        &mut self,
        index: usize,
        picture: &Picture<'_>,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        self.in_flight[index].plan.clear();
        self.check(picture)?;
        let report = self.prepare_checked(index, picture, team);
        if report.is_err() {
            self.arena.mark_all();
        }
        report
    }

    fn prepare_checked(
        &mut self,
        index: usize,
        picture: &Picture<'_>,
        team: &Team<'_>,
    ) -> Result<DrawReport, DrawError> {
        let uploaded = self.stage(index, picture.patches)?;
        self.stage_tiles(index)?;
        let Self { settings, passes, .. } = self;
        let info = PassInfo { device: &self.device, into: self.into, settings };
        let is_debug = picture.show != Show::Shaded;
        passes.complete(
            &info,
            Asked {
                lit: Lit::of(picture.parts),
                imagery: settings.imagery,
                sky: picture.backdrop == Backdrop::Sky,
                debug: is_debug,
                overlay: !picture.overlay.is_empty(),
            },
        )?;
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
        let InFlight { rings, plan, .. } = &mut self.in_flight[index];
        rings.write_view(ViewTerms::new(picture, &self.fixed));
        rings.write_places(picture, lists.iter().copied(), settings.morph_ms(), team);
        rings.write_overlay(picture, &mut self.corners)?;
        if is_debug {
            rings.write_infos(passes, settings.patches_max, picture.infos)?;
        }
        let mut draws = 0;
        for slots in &*lists {
            rings.write_draws((draws, slots), &self.arena, team);
            draws += slots.len();
        }
        let commands = plan.set(picture, lists, settings.depth_order);
        Ok(DrawReport {
            uploaded_patches: uploaded.patches,
            uploaded_bytes: uploaded.bytes,
            draws: u32::try_from(draws).expect("slots and ranges are few"),
            commands,
            secondaries: 0,
            triangles: (draws as u64) << settings.patch_depth,
            pipelines: passes.count(),
        })
    }

    /// Stages what is out of date, in as many buffers as it takes.
    fn stage(&mut self, index: usize, patches: &Patches) -> Result<Staged, Fault> {
        let InFlight { staging, name, .. } = &mut self.in_flight[index];
        staging.truncate(1);
        let mut all = Staged::default();
        loop {
            let last = staging.last_mut().expect("the first is kept");
            let part = self.arena.stage(patches, last);
            all.patches += part.patches;
            all.bytes += part.bytes;
            if !part.more {
                return Ok(all);
            }
            staging.push(self.arena.staging(&self.device, name)?);
        }
    }

    /// As [`Self::stage`], for tiles of imagery.
    fn stage_tiles(&mut self, index: usize) -> Result<(), Fault> {
        let Some(imagery) = &mut self.imagery else { return Ok(()) };
        let InFlight { tiles, name, .. } = &mut self.in_flight[index];
        tiles.truncate(1);
        while imagery.stage(tiles.last_mut().expect("made where there is imagery")) {
            tiles.push(TileStaging::new(&self.device, name)?);
        }
        Ok(())
    }

    fn check(&self, picture: &Picture<'_>) -> Result<(), DrawError> {
        let (settings, view, patches) = (&self.settings, picture.view, picture.patches);
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
}

impl InFlight {
    fn new(
        device: &Arc<Device>,
        arena: &Arena,
        (passes, settings): (&Passes, &RendererSettings),
        index: u32,
    ) -> Result<Self, Fault> {
        let name = format!("frame {index}");
        let tiles = settings.imagery.then(|| TileStaging::new(device, &name)).transpose()?;
        Ok(Self {
            rings: Rings::new(device, passes, settings, &name)?,
            plan: Plan::default(),
            staging: vec![arena.staging(device, &name)?],
            tiles: tiles.into_iter().collect(),
            name,
        })
    }
}

//! Imagery over patches: which tile lies over each new patch, and in which layer of how many.
//!
//! In:    new patches, the pages that serve them.
//! Out:   [`PatchDrape`] by slot; tiles that are new in a layer.
//! Keeps: which tile is in which layer; layers of pages that are gone are used again.
//! Not here: making tiles (`datasource::colour`), textures (`overfly_render_vk`).
//!
//! A patch shows the finest resident tile around it. The tile fades in over the next coarser one
//! from the time on at which it was first shown: a function of the tile, so that all patches under
//! it agree. A leaf's page and all its ancestors stay while the leaf is there, so no layer that a
//! live patch names is ever taken from it.

use super::topology::segments;
use crate::columns::{Column, Id};
use crate::datasource::colour::ColourTile;
use crate::datasource::pages::Pages;
use crate::datasource::{Page, PageKey};
use crate::geodesy::narrow;
use crate::lattice::unfold;
use glam::IVec3;
use std::sync::Arc;

/// Layers of a scene with imagery: 45 MiB of texture with its smaller levels.
pub const LAYERS: u32 = 512;

/// The layer of a place without imagery.
pub const NO_LAYER: u32 = u32::MAX;

/// How long a tile takes to cover the coarser one, in milliseconds of the flight.
pub const FADE_MS: u32 = 250;

/// Where a patch lies in a tile: 32 bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct TilePlace {
    /// Place of the patch's apex, each coordinate 0 to 1 across the tile.
    pub apex: [f32; 2],
    /// One step of the patch from the apex towards the start of its hypotenuse.
    pub to_start: [f32; 2],
    /// One step towards the end.
    pub to_end: [f32; 2],
    /// Layer of the tile, or [`NO_LAYER`].
    pub layer: u32,
    /// When the tile was first shown, in milliseconds modulo 2^32.
    pub since_ms: u32,
}

/// What lies over one patch: 64 bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[repr(C)]
pub struct PatchDrape {
    /// The finest tile.
    pub tile: TilePlace,
    /// The next coarser one, from which it fades.
    pub before: TilePlace,
}

const _: () = assert!(size_of::<PatchDrape>() == 64);

impl TilePlace {
    /// No imagery.
    pub const NONE: Self =
        Self { apex: [0.0; 2], to_start: [0.0; 2], to_end: [0.0; 2], layer: NO_LAYER, since_ms: 0 };
}

impl PatchDrape {
    /// No imagery.
    pub const NONE: Self = Self { tile: TilePlace::NONE, before: TilePlace::NONE };
}

/// What is in one layer.
#[derive(Clone)]
struct Layer {
    page: Id<Page>,
    tile: Arc<ColourTile>,
    since_ms: u32,
}

/// A tile that is new in its layer.
pub type NewTile = (u32, Arc<ColourTile>);

/// All layers.
pub struct Drape {
    layers: Vec<Option<Layer>>,
    /// The layer that a page's tile was put in last.
    layer_of: Column<Page, u32>,
    /// Where the search for a layer goes on.
    hand: u32,
}

impl Drape {
    /// Empty layers for as many pages as there can be.
    pub fn new(pages: u32) -> Self {
        Self {
            layers: vec![None; LAYERS as usize],
            layer_of: Column::new(pages, || NO_LAYER),
            hand: 0,
        }
    }

    /// What lies over a patch of `page` with these corners: apex, hypotenuse start and end. Tiles
    /// that it puts into a layer are appended to `new`.
    pub fn over(
        &mut self,
        pages: &Pages,
        (page, corners): (Id<Page>, [IVec3; 3]),
        (patch_depth, now_ms): (u8, u32),
        new: &mut Vec<NewTile>,
    ) -> PatchDrape {
        let mut drape = PatchDrape::NONE;
        let mut next = Some(page);
        while let Some(id) = next {
            next = pages.parent[id];
            let Some(layer) = self.layer_of_page(pages, id, now_ms, new) else { continue };
            let place = self.place(layer, (pages.get(id).key, corners), patch_depth);
            if drape.tile.layer == NO_LAYER {
                drape.tile = place;
            } else {
                drape.before = place;
                break;
            }
        }
        drape
    }

    /// The layer of a page's own tile, which it is put into if need be; `None` without a tile, or
    /// where every layer is in use.
    fn layer_of_page(
        &mut self,
        pages: &Pages,
        id: Id<Page>,
        now_ms: u32,
        new: &mut Vec<NewTile>,
    ) -> Option<u32> {
        let tile = pages.get(id).colour.as_ref()?;
        let known = self.layer_of[id];
        if let Some(Some(layer)) = self.layers.get(known as usize)
            && layer.page == id
            && Arc::ptr_eq(&layer.tile, tile)
        {
            return Some(known);
        }
        let gone = |layer: &Option<Layer>| {
            layer.as_ref().is_none_or(|layer| {
                let page = pages.page[layer.page].as_deref();
                page.and_then(|page| page.colour.as_ref())
                    .is_none_or(|tile| !Arc::ptr_eq(tile, &layer.tile))
            })
        };
        let search = (0..LAYERS).map(|i| (self.hand + i) % LAYERS);
        let free = { search }.find(|&layer| gone(&self.layers[layer as usize]))?;
        self.layers[free as usize] = Some(Layer { page: id, tile: tile.clone(), since_ms: now_ms });
        self.layer_of[id] = free;
        self.hand = (free + 1) % LAYERS;
        new.push((free, tile.clone()));
        Some(free)
    }

    fn place(
        &self,
        layer: u32,
        (key, corners): (PageKey, [IVec3; 3]),
        patch_depth: u8,
    ) -> TilePlace {
        let (u0, v0) = key.origin();
        let side = f64::from(key.side());
        let [apex, start, end] = corners.map(|corner| {
            let (u, v) = unfold(key.quadrant(), corner);
            [f64::from(u - u0) / side, f64::from(v - v0) / side]
        });
        let steps = f64::from(segments(patch_depth));
        let step = |to: [f64; 2]| [0, 1].map(|i: usize| narrow((to[i] - apex[i]) / steps));
        let since_ms = self.layers[layer as usize].as_ref().map_or(0, |layer| layer.since_ms);
        TilePlace {
            apex: apex.map(narrow),
            to_start: step(start),
            to_end: step(end),
            layer,
            since_ms,
        }
    }

    /// Every tile that is in a layer: for a renderer that comes late.
    pub fn tiles(&self) -> impl Iterator<Item = NewTile> {
        let numbered = (0_u32..).zip(&self.layers);
        numbered.filter_map(|(layer, held)| Some((layer, held.as_ref()?.tile.clone())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasource::colour::COLOUR_TEXELS;
    use crate::datasource::page::{BOUND_SIDE, Bound, SAMPLES};
    use crate::lattice::{RADIUS, fold};

    fn page(key: PageKey, has_colour: bool) -> Arc<Page> {
        let colour = has_colour.then(|| {
            let rgba = vec![[1, 2, 3, 255]; COLOUR_TEXELS].into_boxed_slice();
            Arc::new(ColourTile { key, rgba, content: key.bits() })
        });
        Arc::new(Page {
            key,
            heights_m: [0.0; SAMPLES],
            normals: [[0; 2]; SAMPLES],
            layers: [[0; 4]; SAMPLES],
            bounds: [Bound::default(); BOUND_SIDE * BOUND_SIDE],
            survey: None,
            colour,
            content: key.bits(),
        })
    }

    fn resident(colours: &[bool]) -> (Pages, Vec<Id<Page>>) {
        let mut pages = Pages::new(64);
        let mut keys = vec![PageKey::root(0)];
        for _ in 1..colours.len() {
            keys.push(keys[keys.len() - 1].child(0));
        }
        let mut arrived = keys.iter().zip(colours).map(|(&key, &has)| page(key, has)).collect();
        let done = pages.admit(&mut arrived, 0, &mut Vec::new());
        assert_eq!(done.admitted as usize, colours.len());
        let ids = keys.iter().map(|&key| pages.find(key).unwrap()).collect();
        (pages, ids)
    }

    #[test]
    fn a_patch_shows_the_finest_tile_around_it_over_the_next_coarser_one() {
        let (pages, ids) = resident(&[true, false, true, false]);
        let mut drape = Drape::new(64);
        let mut new = Vec::new();
        let eighth = RADIUS / 8;
        let corners = [(0, 0), (eighth, 0), (0, eighth)].map(|(u, v)| fold(0, u, v));
        let over = drape.over(&pages, (ids[3], corners), (4, 700), &mut new);
        let shown: Vec<_> = new.iter().map(|(layer, tile)| (*layer, tile.key.depth())).collect();
        assert_eq!(shown, [(0, 2), (1, 0)]);
        assert_eq!((over.tile.layer, over.tile.since_ms, over.before.layer), (0, 700, 1));
        // An eighth of the square is half of the tile of depth 2, in four steps.
        assert_eq!((over.tile.apex, over.tile.to_start), ([0.0, 0.0], [0.125, 0.0]));
        assert_eq!(over.before.to_end, [0.0, 1.0 / 32.0]);
        let again = drape.over(&pages, (ids[3], corners), (4, 900), &mut new);
        assert_eq!((new.len(), again), (2, over));
        assert_eq!(drape.tiles().count(), 2);
    }

    #[test]
    fn without_imagery_nothing_lies_over_a_patch() {
        let (pages, ids) = resident(&[false, false]);
        let mut drape = Drape::new(64);
        let corners = [IVec3::Z, IVec3::X, IVec3::Y].map(|axis| axis * RADIUS);
        let over = drape.over(&pages, (ids[1], corners), (4, 1), &mut Vec::new());
        assert_eq!(over, PatchDrape::NONE);
    }
}

//! How far vertices that are still on their way may stray on the screen.
//!
//! In:    patches that were built, where their vertices begin, the time, the views.
//! Out:   a bound in pixels.
//! Keeps: the slots of patches that had not arrived when last looked at.
//! Not here: the bound of patches that have (`lod::refine`), what is on its way (`morph`).
//!
//! What is drawn of a patch is its own triangles, moved by no more than its vertices are: so it
//! strays from the ground by at most the leaf's error and the longest way that is left.

use super::patches::Patches;
use crate::columns::Id;
use crate::lod::cover::Cover;
use crate::lod::screen_error::{Region, Sight, priority_px};
use glam::DVec3;

/// Patches on their way.
pub struct Unrest {
    slots: Vec<u32>,
    is_listed: Vec<bool>,
}

impl Unrest {
    /// With room for as many as there are slots; for none where the scene does not morph.
    pub fn new(slots: u32, morphs: bool) -> Self {
        let slots = if morphs { slots as usize } else { 0 };
        Self { slots: Vec::with_capacity(slots), is_listed: vec![false; slots] }
    }

    /// Adds patches that were just built.
    pub fn add(&mut self, built: &[u32]) {
        for &slot in built {
            let Some(is_listed) = self.is_listed.get_mut(slot as usize) else { return };
            if !core::mem::replace(is_listed, true) {
                self.slots.push(slot);
            }
        }
    }

    /// The greatest error in pixels of a patch on its way at `now_ms`; forgets what has arrived.
    pub fn error_px(
        &mut self,
        patches: &Patches,
        cover: &Cover,
        sights: &[Sight],
        now: (u32, u32),
    ) -> f64 {
        let mut most_px = 0.0;
        let Self { slots, is_listed } = self;
        slots.retain(|&slot| {
            let way_m = way_m(patches, slot, now);
            let leaf = patches.leaf[slot as usize].filter(|_| way_m > 0.0);
            is_listed[slot as usize] = leaf.is_some();
            let leaf_px = leaf.map_or(0.0, |leaf| {
                let region = cover.region[Id::new(leaf.diamond)];
                priority_px(&Region { error_m: region.error_m + way_m, ..region }, sights)
            });
            most_px = if leaf_px > most_px { leaf_px } else { most_px };
            leaf.is_some()
        });
        most_px
    }
}

/// The longest way that is left to a vertex of a patch, metres.
fn way_m(patches: &Patches, slot: u32, (now_ms, morph_ms): (u32, u32)) -> f64 {
    let ways = patches.morphs_of(slot).iter().map(|morph| {
        let from = DVec3::from_array(morph.from_m.map(f64::from));
        from.length() * f64::from(morph.left(now_ms, morph_ms))
    });
    ways.fold(0.0, |most, way_m| if way_m > most { way_m } else { most })
}

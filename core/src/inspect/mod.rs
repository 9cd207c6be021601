//! What people want to see of the mesh besides the ground: for debug views and overlays.
//!
//! In:    a terrain between two frames.
//! Out:   [`PatchInfo`] by slot; line segments.
//! Keeps: nothing; a frame that nobody inspects does none of this.
//! Not here: drawing it (`overfly_render_vk`).
//!
//! Everything here walks the whole mesh and may allocate: some tens of nanoseconds a patch, for
//! debug views only.

mod bound;
mod drawn;

pub use drawn::{DrawnLeaf, DrawnMesh};

use crate::datasource::pages::Pages;
use crate::frame::Terrain;
use crate::geodesy::trig::{cos, sin};
use crate::geodesy::{Ellipsoid, frames::narrow};
use crate::lattice::normal_of;
use crate::lod::cover::{Cover, Serving};
use crate::lod::screen_error::priority_px;
use crate::lod::{DiamondId, Diamonds};
use crate::settings::LodSettings;
use glam::DVec3;

/// What debug views show of one patch.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[repr(C)]
pub struct PatchInfo {
    /// Bound on its error on the screen in pixels, the worst of the last frame's views, also where
    /// the LOD was held; 0 where none sees it.
    pub error_px: f32,
    /// Level of its leaf triangle.
    pub level: u8,
    /// Depth of its page.
    pub page_depth: u8,
    /// Levels by which it is coarser than the tolerance asks because a page is not there: two
    /// levels halve an error. 0 where its split did not wait for a page when the LOD last judged.
    pub lacking: u8,
    /// 1 where the frustum and the horizon of one of these views let it be seen, else 0.
    pub seen: u8,
}

const _: () = assert!(size_of::<PatchInfo>() == 8);

/// Segments of a circle that stands for a sphere.
const SEGMENTS: usize = 16;

impl Terrain {
    /// Fills one [`PatchInfo`] a patch slot, up to
    /// [`Patches::used_end`](crate::mesh::Patches::used_end); the default where a slot is free.
    ///
    /// As the views of the last frame that was not held see it.
    /// Judges every leaf anew: a frame's work many times over, for debug views.
    pub fn inspect(&self, infos: &mut Vec<PatchInfo>) {
        let (lod, pages, patches) = (self.lod(), self.pages(), self.patches());
        let (diamonds, cover, sights) = (&lod.mesh.diamonds, &lod.cover, &lod.sights);
        infos.clear();
        infos.resize(patches.used_end() as usize, PatchInfo::default());
        for id in diamonds.ids().filter(|&id| !diamonds[id].is_split()) {
            let region = &cover.region[id];
            let info = PatchInfo {
                error_px: narrow(priority_px(region, sights)),
                level: diamonds[id].level(),
                seen: u8::from(sights.iter().any(|sight| sight.sees(region))),
                ..PatchInfo::default()
            };
            let sides = cover.patches[id].into_iter().zip(cover.pages[id]);
            for (slot, page) in sides.filter_map(|(slot, page)| slot.zip(page)) {
                let page_depth = pages.get(page).key.depth();
                infos[slot as usize] = PatchInfo { page_depth, ..info };
            }
        }
        let LodSettings { patch_depth, tolerance, .. } = self.settings().lod;
        let serving = Serving { cover, pages: &pages, patch_depth };
        let mut waiting = Vec::new();
        lod.mesh.agenda.list_waiting(&mut waiting);
        waiting.retain(|&id| waits_for_page(&serving, diamonds, id));
        for slot in waiting.into_iter().flat_map(|id| cover.patches[id]).flatten() {
            let info = &mut infos[slot as usize];
            info.lacking = levels_over(f64::from(info.error_px) / tolerance.0);
        }
    }

    /// The bounding spheres of live patches within `reach_m` of `near`, the nearest first: three
    /// circles each, of [`BOUND_LINES`] segments together, in planes of the body's axes. Clears
    /// `out`, then adds whole spheres while there are no more than `most` segments. ECEF metres.
    pub fn bound_lines(&self, near: DVec3, reach_m: f64, most: usize, out: &mut Vec<[DVec3; 2]>) {
        out.clear();
        let patches = self.patches();
        let spheres = (0..patches.used_end()).filter_map(|slot| patches.sphere(slot));
        let mut found: Vec<_> = spheres
            .map(|(centre, radius_m)| ((centre - near).length() - radius_m, centre, radius_m))
            .filter(|&(away_m, ..)| away_m <= reach_m)
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, centre, radius_m) in found.into_iter().take(most / BOUND_LINES) {
            let axes = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)];
            axes.into_iter().for_each(|axes| circle(centre, radius_m, axes, out));
        }
    }

    /// From the centre of each unsplit diamond within `reach_m` of `near` to the centres of both
    /// its parents, the nearest diamonds first; all on the drawn surface without morphs. Clears
    /// `out`, then adds whole diamonds while there are no more than `most` segments. ECEF metres.
    pub fn diamond_lines(&self, near: DVec3, reach_m: f64, most: usize, out: &mut Vec<[DVec3; 2]>) {
        out.clear();
        let (lod, pages) = (self.lod(), self.pages());
        let diamonds = &lod.mesh.diamonds;
        let settings = self.settings();
        let ground = Centres {
            diamonds,
            cover: &lod.cover,
            pages: &pages,
            body: &settings.body,
            sea: settings.sea,
        };
        let unsplit = diamonds.ids().filter(|&id| !diamonds[id].is_split());
        let mut found: Vec<_> = unsplit
            .map(|id| (ground.place(id), id))
            .map(|(place, id)| ((place - near).length(), place, id))
            .filter(|&(away_m, ..)| away_m <= reach_m)
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, place, id) in found {
            let parents = diamonds[id].parents().into_iter().flatten();
            if out.len() + parents.clone().count() > most {
                break;
            }
            out.extend(parents.map(|parent| [place, ground.place(parent)]));
        }
    }
}

/// Segments that [`Terrain::bound_lines`] draws a sphere with.
pub const BOUND_LINES: usize = 3 * SEGMENTS;

fn circle(centre: DVec3, radius_m: f64, (right, up): (DVec3, DVec3), out: &mut Vec<[DVec3; 2]>) {
    let at = |i: usize| {
        let turn_rad = core::f64::consts::TAU / SEGMENTS as f64 * (i % SEGMENTS) as f64;
        centre + (right * cos(turn_rad) + up * sin(turn_rad)) * radius_m
    };
    out.extend((0..SEGMENTS).map(|i| [at(i), at(i + 1)]));
}

/// Levels by which an error that is so many times the tolerance is too coarse.
fn levels_over(ratio: f64) -> u8 {
    // The least n with 2ⁿ at least the square, which is ⌈2·log₂⌉.
    let mut square = ratio * ratio;
    let mut levels = 0_u8;
    while square > 1.0 && levels < u8::MAX {
        square /= 2.0;
        levels += 1;
    }
    levels
}

/// Whether a diamond cannot be split, with those of its ancestors that must be, for want of a page.
fn waits_for_page(serving: &Serving<'_>, diamonds: &Diamonds, id: DiamondId) -> bool {
    // One parent at least is split, so this is a walk along a chain.
    let mut unsplit = diamonds[id].parents().into_iter().flatten();
    unsplit.any(|parent| !diamonds[parent].is_split() && waits_for_page(serving, diamonds, parent))
        || serving.kids_ready(diamonds, id).is_err()
}

/// Where the centres of diamonds lie.
struct Centres<'a> {
    diamonds: &'a Diamonds,
    cover: &'a Cover,
    pages: &'a Pages,
    body: &'a Ellipsoid,
    sea: bool,
}

impl Centres<'_> {
    /// Each of a diamond's pages holds its centre.
    fn place(&self, id: DiamondId) -> DVec3 {
        let page = self.cover.pages[id].into_iter().flatten().next();
        let page = self.pages.get(page.expect("a record has a side"));
        let centre = self.diamonds[id].centre();
        let surface_m = page.surface_m(page.sample_index(centre), self.sea);
        let normal = normal_of(centre);
        self.body.surface_from_normal(normal) + normal * surface_m
    }
}

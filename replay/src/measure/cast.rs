//! Rays of the picture against the ground itself.
//!
//! In:    the projection, the reference ground of a frame.
//! Out:   where the ray of a pixel meets the ground.
//! Keeps: nothing.
//! Not here: the ground (`reference`), which rays a frame casts (`rays`).

use super::nearby::Nearby;
use super::reference::{Hit, MakePage, Reference};
use super::screen::Screen;
use glam::{DVec2, DVec3};

/// Casts rays of one frame.
#[derive(Clone, Copy)]
pub struct Caster<'a> {
    /// The ground.
    pub reference: &'a Reference,
    /// The projection.
    pub screen: &'a Screen,
    /// Makes pages of it.
    pub make: MakePage<'a>,
}

impl<'a> Caster<'a> {
    /// What may lie within a rectangle of the picture: its upper left and its lower right pixel.
    pub fn within(&self, low: DVec2, high: DVec2) -> Nearby<'a> {
        Nearby::new(self.reference, self.screen, [low, high], self.make)
    }

    /// Where the ray of a pixel of that rectangle meets the ground.
    pub fn meet(&self, nearby: &mut Nearby<'a>, pixel: DVec2) -> Option<Hit> {
        let hit = nearby.meet(self.screen.tangents(pixel));
        hit.filter(|hit| hit.depth_m >= self.screen.near_m)
    }

    /// What lies at eight places around a pixel; `None` where some are outside of the picture.
    pub fn around(&self, pixel: DVec2, radius_px: f64) -> Option<[Option<Hit>; 8]> {
        let reach = DVec2::splat(radius_px);
        let [width, height] = self.screen.size_px;
        let (low, high) = (pixel - reach, pixel + reach);
        if low.min_element() < 0.0 || high.x > width || high.y > height {
            return None;
        }
        let mut nearby = self.within(low, high);
        let aslant = core::f64::consts::FRAC_1_SQRT_2;
        let turns = [(1.0, 0.0), (aslant, aslant), (0.0, 1.0), (-aslant, aslant)];
        let all = turns.map(|(x, y)| DVec2::new(x, y) * radius_px);
        let [a, b, c, d] = all.map(|step| self.meet(&mut nearby, pixel + step));
        let [e, f, g, h] = all.map(|step| self.meet(&mut nearby, pixel - step));
        Some([a, b, c, d, e, f, g, h])
    }
}

/// The four planes through the eye around a rectangle of the picture, pointing inward.
pub fn pyramid(screen: &Screen, low: DVec2, high: DVec2) -> [DVec3; 4] {
    let corner = |x: f64, y: f64| screen.to_body(screen.tangents(DVec2::new(x, y)));
    let corners = [
        corner(low.x, low.y),
        corner(high.x, low.y),
        corner(high.x, high.y),
        corner(low.x, high.y),
    ];
    let middle = corners[0] + corners[1] + corners[2] + corners[3];
    [0, 1, 2, 3].map(|i| {
        let plane = corners[(i + 1) % 4].cross(corners[i]).normalize();
        if plane.dot(middle) < 0.0 { -plane } else { plane }
    })
}

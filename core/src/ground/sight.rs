//! Lines of sight: whether two points see each other, and how far the ground stays below.
//!
//! In:    two points, refraction, query.
//! Out:   [`Sight`].
//! Keeps: nothing.
//! Not here: how the ground is searched (`walk`).

use super::Ground;
use super::answer::{Answer, Hit, Query, Refraction, Sight};
use super::choose::is_sound;
use super::walk::{Goal, Line, Walk};
use crate::geodesy::Ecef;

impl Ground {
    /// Whether anything of the surface of `query` lies between two points, and if not, how much
    /// there is to spare. The same for (b, a) as for (a, b), but that a hit is the first from `a`.
    ///
    /// `Coarser` and `NotReady` as for [`Self::ray`]; what blocks the sight for certain is told
    /// even if other ground is not there.
    pub fn line_of_sight(
        &self,
        a: Ecef,
        b: Ecef,
        refraction: Refraction,
        query: Query,
    ) -> Answer<Sight> {
        if !a.0.is_finite() || !b.0.is_finite() || !is_sound(query) {
            return Answer::Refused;
        }
        let swapped =
            b.0.to_array().partial_cmp(&a.0.to_array()) == Some(core::cmp::Ordering::Less);
        let line = if swapped { self.line(b, a, refraction) } else { self.line(a, b, refraction) };
        let ends = [self.agl(a, query), self.agl(b, query)];
        let [Some(at_a), Some(at_b)] = ends.map(Answer::found) else { return Answer::NotReady };
        let mut clearance_m = at_a.agl_m.min(at_b.agl_m);
        let mut coarser = ends.iter().any(|end| matches!(end, Answer::Coarser(_)));
        let mut closest = None;
        if clearance_m >= 0.0 && line.length_m > 0.0 {
            let mut walk = Walk::new(self, line, query, Goal::Clearance);
            walk.margin_m = clearance_m;
            walk.run();
            coarser |= walk.coarser_from_m.is_finite();
            if walk.unknown_from_m.is_finite() && walk.margin_m >= 0.0 {
                return Answer::NotReady;
            }
            (clearance_m, closest) = (walk.margin_m, walk.met);
        }
        if clearance_m >= 0.0 {
            return Answer::of(Sight::Clear { clearance_m }, coarser);
        }
        let first = self.first_hit(self.line(a, b, refraction), query).found().flatten();
        let hit = first.or_else(|| {
            let met = closest?;
            let point = Ecef(line.at(met.distance_m));
            let distance_m = (point.0 - a.0).length();
            Some(Hit { distance_m, point, normal: met.normal.normalize(), level: met.level })
        });
        let normal = at_b.ground.normal;
        // Only the far end itself is under ground.
        let at_end = Hit { distance_m: line.length_m, point: b, normal, level: at_b.ground.level };
        Answer::of(Sight::Blocked(hit.unwrap_or(at_end)), coarser)
    }

    fn line(&self, from: Ecef, to: Ecef, refraction: Refraction) -> Line {
        let away = to.0 - from.0;
        let length_m = away.length();
        let direction = if length_m > 0.0 { away / length_m } else { away };
        let body = &self.shape.body;
        let mean_m = (2.0 * body.a_m + body.b_m()) / 3.0;
        let bend_per_m = match refraction {
            Refraction::None => 0.0,
            Refraction::FourThirds => 1.0 / (8.0 * mean_m),
        };
        Line { origin: from.0, direction, length_m, bend_per_m }
    }
}

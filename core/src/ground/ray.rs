//! Rays: the first place where one meets the ground.
//!
//! In:    origin, direction, length, query.
//! Out:   [`Hit`], or that there is none, or that nobody knows.
//! Keeps: nothing.
//! Not here: how the ground is searched (`walk`), bent lines between two points (`sight`).

use super::Ground;
use super::answer::{Answer, Hit, Query};
use super::choose::is_sound;
use super::walk::{Goal, Line, Walk};
use crate::geodesy::Ecef;
use glam::DVec3;

impl Ground {
    /// The first place where a ray passes below the surface of `query`, none if it does not within
    /// `max_m`; 0 m away where it begins there. `direction` may have any length but 0; `max_m` may
    /// be infinite.
    ///
    /// `Coarser` if, before the hit, it passed so low over ground coarser than asked for that the
    /// finer might have been in its way; `NotReady` if over ground of which nothing is resident.
    pub fn ray(
        &self,
        origin: Ecef,
        direction: DVec3,
        max_m: f64,
        query: Query,
    ) -> Answer<Option<Hit>> {
        let length = direction.length();
        let sound = origin.0.is_finite() && length > 0.0 && length.is_finite() && max_m >= 0.0;
        if !sound || !is_sound(query) {
            return Answer::Refused;
        }
        let direction = direction / length;
        // Beyond the far side of the body there is nothing.
        let length_m = max_m.min(origin.0.length() + 4.0 * self.shape.body.a_m);
        self.first_hit(Line { origin: origin.0, direction, length_m, bend_per_m: 0.0 }, query)
    }

    /// The first place where a line passes below the surface.
    pub(super) fn first_hit(&self, line: Line, query: Query) -> Answer<Option<Hit>> {
        let origin = Ecef(line.origin);
        let below = |hit: Answer<Hit>| hit.map(Some);
        let start = self.agl(origin, query);
        if let Some(contact) = start.found()
            && contact.agl_m < 0.0
        {
            let (normal, level) = (contact.ground.normal, contact.ground.level);
            return below(start.map(|_| Hit { distance_m: 0.0, point: origin, normal, level }));
        }
        let mut walk = Walk::new(self, line, query, Goal::FirstHit);
        walk.run();
        if walk.unknown_from_m <= walk.end_m {
            return Answer::NotReady;
        }
        let hit = walk.met.map(|met| Hit {
            distance_m: met.distance_m,
            point: Ecef(line.at(met.distance_m)),
            normal: met.normal.normalize(),
            level: met.level,
        });
        Answer::of(hit, walk.coarser_from_m <= walk.end_m)
    }
}

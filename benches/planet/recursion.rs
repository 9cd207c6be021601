//! Recursion: the whole mesh visited from the base, every priority recomputed from its bounds.
//!
//! In:    the diamonds of a frame, their regions, the views' sights.
//! Out:   how many diamonds were visited, and how many of them the tolerance would split.
//! Keeps: the stack, so that its growth is not timed.
//! Not here: splits, merges, queues, patches: what a recursion would cost beyond evaluations.

use overfly::core::camera::{Camera, View};
use overfly::core::datasource::generate::Generator;
use overfly::core::frame::Lod;
use overfly::core::lod::DiamondId;
use overfly::core::lod::screen_error::{Horizon, Sight, priority_px};
use overfly::core::settings::SceneSettings;

/// Walks a scene's mesh.
pub struct Recursion {
    scene: SceneSettings,
    horizon: Horizon,
    stack: Vec<DiamondId>,
}

/// What a walk found.
pub struct Visit {
    /// Diamonds visited: all that have a record, each once.
    pub visits: u32,
    /// Those whose error is above the tolerance.
    pub above: u32,
}

impl Recursion {
    /// Over the meshes of a scene.
    pub fn new(scene: &SceneSettings) -> Self {
        Self {
            horizon: Horizon::new(&scene.body, Generator::new(scene).surface_range_m()),
            scene: scene.clone(),
            stack: Vec::with_capacity(1024),
        }
    }

    /// The sights of a frame's views.
    pub fn sights(&self, views: &[View]) -> Vec<Sight> {
        let sight = |view: &View| Sight::new(&Camera::new(view, &self.scene.body), self.horizon);
        views.iter().map(sight).collect()
    }

    /// Visits every split diamond and every leaf once: a diamond with two split parents comes from
    /// the first.
    pub fn walk(&mut self, lod: &Lod, sights: &[Sight]) -> Visit {
        let diamonds = &lod.mesh.diamonds;
        let mut visit = Visit { visits: 0, above: 0 };
        self.stack.extend(diamonds.base().into_iter().flatten());
        while let Some(id) = self.stack.pop() {
            let error_px = priority_px(&lod.cover.region[id], sights);
            visit.visits += 1;
            visit.above += u32::from(error_px > self.scene.lod.tolerance.0);
            let record = &diamonds[id];
            if !record.is_split() {
                continue;
            }
            let comes_from_here = |&kid: &DiamondId| {
                let record = &diamonds[kid];
                record.side_of(id) == 0 || !record.has_side(0)
            };
            self.stack.extend(record.kids().into_iter().flatten().filter(comes_from_here));
        }
        visit
    }
}

//! The optional parts of a scene: few, varied things, as entities.
//!
//! In:    [`hecs::World`] with [`Sun`] and [`Sea`] components, owned by the host.
//! Out:   [`FrameParts`]: what a renderer draws this frame; an absent part costs nothing.
//! Keeps: nothing; the world belongs to the host.
//! Not here: terrain (columns, never entities).

use crate::settings::SceneSettings;
use glam::DVec3;

/// Light from infinitely far away.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sun {
    /// Body-fixed unit vector towards the sun.
    pub direction: DVec3,
}

/// Ground below height 0 is shown as water.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sea;

/// What of the optional parts is there in one frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FrameParts {
    /// Body-fixed unit vector towards the sun, if there is one.
    pub sun_direction: Option<DVec3>,
    /// Whether ground below height 0 is water.
    pub sea: bool,
}

/// The world of a scene file: an entity for each part that it names.
pub fn world_of(settings: &SceneSettings) -> hecs::World {
    let mut world = hecs::World::new();
    if let Some(sun) = &settings.sun {
        world.spawn((Sun { direction: sun.direction },));
    }
    if settings.sea {
        world.spawn((Sea,));
    }
    world
}

/// Reads the parts out of the world, once a frame. Of several suns the first spawned counts.
pub fn extract(world: &hecs::World) -> FrameParts {
    FrameParts {
        sun_direction: world.query::<&Sun>().iter().next().map(|sun| sun.direction),
        sea: world.query::<&Sea>().iter().next().is_some(),
    }
}

//! The optional parts of a scene: few, varied things, as entities.
//!
//! In:    [`hecs::World`] with [`Sun`] and [`Sea`] components, owned by the host.
//! Out:   [`FrameParts`]: what a renderer draws this frame; an absent part costs nothing.
//! Keeps: nothing; the world belongs to the host.
//! Not here: terrain (columns, never entities), where the sun stands (`sun`).

use crate::settings::{SceneSettings, SunSettings};
use glam::DVec3;

/// Light from infinitely far away.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sun {
    /// Where it stands, and whether it moves; a host may change them between frames.
    pub settings: SunSettings,
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
    if let Some(settings) = settings.sun {
        world.spawn((Sun { settings },));
    }
    if settings.sea {
        world.spawn((Sea,));
    }
    world
}

/// Reads the parts out of the world, once a frame, as they are at a time of the flight in seconds.
/// Of several suns the first spawned counts.
pub fn extract(world: &hecs::World, time_s: f64) -> FrameParts {
    let mut suns = world.query::<&Sun>();
    FrameParts {
        sun_direction: suns.iter().next().map(|sun| sun.settings.direction_at(time_s)),
        sea: world.query::<&Sea>().iter().next().is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_the_sun_of_its_time_and_only_the_parts_that_are_there() {
        let mut world = hecs::World::new();
        assert_eq!(extract(&world, 0.0), FrameParts::default());
        let clock = SunSettings::Clock { start_unix_s: 0.0, runs: true };
        let sun = world.spawn((Sun { settings: clock },));
        world.spawn((Sea,));
        let at = |world: &hecs::World, time_s| extract(world, time_s).sun_direction;
        assert_eq!(at(&world, 7.0), Some(clock.direction_at(7.0)));
        assert_ne!(at(&world, 7.0), at(&world, 8.0));
        assert!(extract(&world, 7.0).sea);
        let fixed = SunSettings::Fixed { direction: DVec3::X };
        world.get::<&mut Sun>(sun).unwrap().settings = fixed;
        assert_eq!(at(&world, 7.0), Some(DVec3::X));
    }
}

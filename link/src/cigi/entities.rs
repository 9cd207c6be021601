//! Entities: where they are, and which hangs on which.
//!
//! In:    Entity Control and Conformal Clamped Entity Control.
//! Out:   poses.
//! Keeps: at most [`ENTITIES_MAX`] entities; those beyond [`CHAIN_MAX`] in a chain have no pose.
//! Not here: views (`views`), requests (`requests`).

use super::packet::{Attitude, Clamp, ClampedEntity, EntityControl, EntityState, MslPlace, Placed};
use super::pose::{Pose, ned, on_slope, turned};
use super::question::World;
use super::{CHAIN_MAX, ENTITIES_MAX};
use std::collections::BTreeMap;

#[derive(Clone, Copy)]
struct Entity {
    placed: Placed,
    clamp: Clamp,
    attitude: Attitude,
}

/// Why a packet about an entity changed nothing.
pub enum Refused {
    /// It, or what it is to hang on, is not there; or the chain would close or be too long.
    Missing,
    /// There are too many.
    Full,
}

/// All entities of a host.
#[derive(Default)]
pub struct Entities {
    by_id: BTreeMap<u16, Entity>,
}

impl Entities {
    pub fn len(&self) -> usize {
        self.by_id.len()
    }

    pub fn clear(&mut self) {
        self.by_id.clear();
    }

    pub fn contains(&self, id: u16) -> bool {
        self.by_id.contains_key(&id)
    }

    /// Makes, moves or attaches an entity.
    pub fn control(&mut self, control: &EntityControl) -> Result<(), Refused> {
        let EntityControl { entity: id, placed, clamp, attitude, .. } = *control;
        debug_assert!(control.state != EntityState::Destroyed, "that is destroy");
        if let Placed::Child { parent, .. } = placed {
            self.check_parent(id, parent)?;
        }
        if !self.by_id.contains_key(&id) && self.by_id.len() >= ENTITIES_MAX {
            return Err(Refused::Full);
        }
        self.by_id.insert(id, Entity { placed, clamp, attitude });
        Ok(())
    }

    /// A parent must be there, must not hang on the child, and must leave room below it.
    fn check_parent(&self, id: u16, parent: u16) -> Result<(), Refused> {
        let mut above = parent;
        for _ in 0..CHAIN_MAX {
            if above == id {
                return Err(Refused::Missing);
            }
            match self.by_id.get(&above) {
                None => return Err(Refused::Missing),
                Some(Entity { placed: Placed::Top(_), .. }) => return Ok(()),
                Some(Entity { placed: Placed::Child { parent, .. }, .. }) => above = *parent,
            }
        }
        Err(Refused::Missing)
    }

    /// Moves an entity, and leaves its altitude, pitch, roll and clamp as they are.
    pub fn clamped(&mut self, moved: &ClampedEntity) -> Result<(), Refused> {
        let entity = self.by_id.get_mut(&moved.entity).ok_or(Refused::Missing)?;
        let Placed::Top(place) = &mut entity.placed else { return Err(Refused::Missing) };
        (place.lat_rad, place.lon_rad) = (moved.lat_rad, moved.lon_rad);
        entity.attitude.yaw_rad = moved.yaw_rad;
        Ok(())
    }

    /// Takes an entity and all that hangs on it away.
    pub fn destroy(&mut self, id: u16) {
        if self.by_id.remove(&id).is_none() {
            return;
        }
        let mut gone = vec![id];
        while let Some(parent) = gone.pop() {
            let hangs = |placed: Placed| match placed {
                Placed::Top(_) => false,
                Placed::Child { parent: on, .. } => on == parent,
            };
            let lost = self.by_id.extract_if(.., |_, entity| hangs(entity.placed));
            gone.extend(lost.map(|(id, _)| id));
        }
    }

    /// Where an entity is and how it lies; empty where it is not there.
    pub fn pose(&self, id: u16, world: &World<'_>) -> Option<Pose> {
        let mut chain = [None; CHAIN_MAX + 1];
        let mut entity = *self.by_id.get(&id)?;
        let mut depth = 0;
        while let Placed::Child { parent, offset_m } = entity.placed {
            *chain.get_mut(depth)? = Some((offset_m, entity.attitude));
            depth += 1;
            entity = *self.by_id.get(&parent)?;
        }
        let Placed::Top(place) = entity.placed else { return None };
        let top = top_pose(place, &entity, world);
        let links = chain[..depth].iter().rev().flatten();
        Some(links.fold(top, |pose, &(offset_m, attitude)| pose.then(offset_m, attitude)))
    }
}

fn top_pose(place: MslPlace, entity: &Entity, world: &World<'_>) -> Pose {
    let at = world.geodetic(place);
    let attitude = entity.attitude;
    if entity.clamp == Clamp::None {
        return Pose::on(&world.body, at, attitude);
    }
    let surface = world.surface(at);
    let mut on = at;
    let mut axes = ned(at) * turned(attitude);
    if let Some(surface) = surface {
        on.height_m = surface.height_m + place.altitude_m;
        if entity.clamp == Clamp::Conformal {
            axes = on_slope(at, surface.normal, attitude);
        }
    }
    Pose { at: world.body.ecef_from_geodetic(on), axes, certain: surface.is_some() }
}

//! Views and view groups: what rides where on an entity, through which lens.
//!
//! In:    View Control and View Definition, the views that there are from the start.
//! Out:   the views of a frame.
//! Keeps: at most [`VIEWS_MAX`] views and [`GROUPS_MAX`] groups.
//! Not here: entities (`entities`).
//! Source: CIGI ICD 3.3, 3.2, 4.1.16 and 4.1.21; see [`crate::cigi`].

use super::entities::{Entities, Refused};
use super::packet::{Attitude, ViewControl, ViewDefinition, ViewTarget};
use super::pose::Pose;
use super::question::World;
use super::{GROUPS_MAX, VIEWS_MAX};
use glam::DVec3;
use overfly_core::camera::View;
use overfly_core::geodesy::trig::{atan2, tan};
use overfly_core::units::Radians;
use std::collections::BTreeMap;

/// Narrower and wider than this no lens becomes, in radians: 0.01° and 179°.
const FIELD_OF_VIEW_RAD: [f64; 2] = [1.745e-4, 3.124];

/// A view as it is before the host says otherwise.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lens {
    /// Vertical field of view in radians.
    pub field_of_view_rad: f64,
    /// Turned to the right of the entity's nose, in radians.
    pub yaw_rad: f64,
    /// Turned up from it.
    pub pitch_rad: f64,
    /// Nothing nearer is drawn, in metres.
    pub near_m: f64,
}

/// A place on an entity.
#[derive(Clone, Copy, Default)]
struct Mount {
    entity: u16,
    offset_m: DVec3,
    attitude: Attitude,
}

#[derive(Clone, Copy)]
struct ViewState {
    group: u8,
    lens: Lens,
    mount: Mount,
    half_rad: [Option<f64>; 4],
}

/// All views of a host.
pub struct Views {
    lenses: Vec<Lens>,
    views: BTreeMap<u16, ViewState>,
    /// Groups that a View Control moved.
    groups: BTreeMap<u8, Mount>,
}

impl Mount {
    fn control(&mut self, control: &ViewControl) {
        self.entity = control.entity;
        for (axis, offset_m) in control.offset_m.into_iter().enumerate() {
            self.offset_m[axis] = offset_m.unwrap_or(self.offset_m[axis]);
        }
        let [roll, pitch, yaw] = control.turn_rad;
        let old = self.attitude;
        self.attitude = Attitude {
            roll_rad: roll.unwrap_or(old.roll_rad),
            pitch_rad: pitch.unwrap_or(old.pitch_rad),
            yaw_rad: yaw.unwrap_or(old.yaw_rad),
        };
    }
}

impl ViewState {
    fn of(lens: Lens) -> Self {
        let attitude = Attitude { yaw_rad: lens.yaw_rad, pitch_rad: lens.pitch_rad, roll_rad: 0.0 };
        let mount = Mount { attitude, ..Mount::default() };
        Self { group: 0, lens, mount, half_rad: [None; 4] }
    }

    /// The least vertical field of view whose symmetric frustum holds all half-angles.
    fn field_of_view_rad(&self, [width, height]: [u32; 2]) -> f64 {
        if self.half_rad == [None; 4] {
            return self.lens.field_of_view_rad;
        }
        let aspect = f64::from(width.max(1)) / f64::from(height.max(1));
        let [left, right, top, bottom] = self.half_rad.map(|half| tan(half.unwrap_or(0.0).abs()));
        let half = top.max(bottom).max(left.max(right) / aspect);
        let [least, most] = FIELD_OF_VIEW_RAD;
        (2.0 * atan2(half, 1.0)).clamp(least, most)
    }
}

impl Views {
    /// The views of `lenses`, numbered from 0, on the ownship; the first is also the lens of views
    /// that a host adds.
    pub fn new(lenses: Vec<Lens>) -> Self {
        let mut views = Self { lenses, views: BTreeMap::new(), groups: BTreeMap::new() };
        views.reset();
        views
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        let states = self.lenses.iter().map(|&lens| ViewState::of(lens));
        self.views = (0..).zip(states).take(VIEWS_MAX).collect();
        self.groups.clear();
    }

    pub fn len(&self) -> usize {
        self.views.len()
    }

    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    fn view(&mut self, id: u16) -> Result<&mut ViewState, Refused> {
        let first = self.lenses.first().copied().ok_or(Refused::Full)?;
        if !self.views.contains_key(&id) && self.views.len() >= VIEWS_MAX {
            return Err(Refused::Full);
        }
        let new = Lens { yaw_rad: 0.0, pitch_rad: 0.0, ..first };
        Ok(self.views.entry(id).or_insert_with(|| ViewState::of(new)))
    }

    /// Moves and turns a view, or a group.
    pub fn control(&mut self, control: &ViewControl) -> Result<(), Refused> {
        match control.target {
            ViewTarget::View(id) => self.view(id)?.mount.control(control),
            ViewTarget::Group(id) => {
                if !self.groups.contains_key(&id) && self.groups.len() >= GROUPS_MAX {
                    return Err(Refused::Full);
                }
                self.groups.entry(id).or_default().control(control);
            }
        }
        Ok(())
    }

    /// Gives a view another lens or group.
    pub fn define(&mut self, definition: &ViewDefinition) -> Result<(), Refused> {
        let view = self.view(definition.view)?;
        view.group = definition.group;
        view.lens.near_m = definition.near_m.unwrap_or(view.lens.near_m);
        for (half, given) in view.half_rad.iter_mut().zip(definition.half_rad) {
            *half = given.or(*half);
        }
        Ok(())
    }

    /// The views whose entity is there, by number.
    pub fn list(
        &self,
        entities: &Entities,
        world: &World<'_>,
        size_px: [u32; 2],
        out: &mut Vec<View>,
    ) {
        out.clear();
        for view in self.views.values() {
            let Some(pose) = self.pose(view, entities, world) else { continue };
            out.push(View {
                eye: pose.at,
                orientation: pose.camera(),
                field_of_view: Radians(view.field_of_view_rad(size_px)),
                size_px,
                near_m: view.lens.near_m,
            });
        }
    }

    /// A view stands on its entity; in a group that was moved, it stands in the group's axes, and
    /// the group on its entity.
    fn pose(&self, view: &ViewState, entities: &Entities, world: &World<'_>) -> Option<Pose> {
        let group = self.groups.get(&view.group).filter(|_| view.group != 0);
        let entity = group.unwrap_or(&view.mount).entity;
        let base = entities.pose(entity, world)?;
        let base = group.map_or(base, |group| base.then(group.offset_m, group.attitude));
        Some(base.then(view.mount.offset_m, view.mount.attitude))
    }
}

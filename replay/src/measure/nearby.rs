//! The ground before one part of the picture, found out ray by ray.
//!
//! In:    the reference's tree, an eye, planes around some rays.
//! Out:   where each of these rays first meets the ground.
//! Keeps: the boxes that lie before these rays, the nearest first.
//! Not here: making and keeping plates (`reference`), a single plate (`plate`).
//!
//! A box is a rectangle of the picture and a least depth: a ray looks at those around its pixel in
//! the order of their depth, until they are farther than what it has met. The first ray that looks
//! at a box finds out what is in it: a plate that is fine enough, or the boxes of four children.

use super::boxes::{Box3, Origin};
use super::cast::pyramid;
use super::plate::{Meeting, Part, Plate};
use super::reference::{DEPTH_LAST, Hit, MakePage, Node, Reference};
use super::screen::Screen;
use glam::{DMat3, DVec2, DVec3};
use overfly_core::geodesy::Ecef;
use overfly_core::lod::screen_error::Horizon;

/// The ground before a part of the picture.
pub struct Nearby<'a> {
    reference: &'a Reference,
    screen: Screen,
    planes: [DVec3; 4],
    /// The part of the picture: tangents to the right and up.
    low: DVec2,
    high: DVec2,
    horizon: Horizon,
    /// To the horizon; nothing is beyond it where the eye is below all ground.
    reach_m: Option<f64>,
    make: MakePage<'a>,
    stands: Vec<Stand<'a>>,
    /// The nearest first.
    due: Vec<Due<'a>>,
}

/// A plate that is fine enough, as the eye sees it.
struct Stand<'a> {
    plate: &'a Plate,
    /// The eye in the plate's axes, also as boxes have it.
    eye: DVec3,
    origin: Origin,
}

/// A box before the rays.
struct Due<'a> {
    /// Nothing in it is nearer.
    depth_m: f64,
    /// Its rectangle: tangents to the right and up.
    low: DVec2,
    high: DVec2,
    what: What<'a>,
}

#[derive(Clone, Copy)]
enum What<'a> {
    /// A part of a stand.
    Part(u32, Part),
    /// What is in it is not known yet. The plate is the parent's: a page that cannot be made is
    /// stood in for by it.
    Child(&'a Node, &'a Plate),
}

/// Plates are cut in four so often, where a ray comes by.
const CUTS: u8 = 1;
/// Rectangles are so much larger than they need be, as a share of a tangent of 1.
const MARGIN: f64 = 1e-9;

impl<'a> Nearby<'a> {
    /// What lies before the eye within a rectangle of the picture, given by its upper left and its
    /// lower right pixel.
    pub(super) fn new(
        reference: &'a Reference,
        screen: &Screen,
        pixels: [DVec2; 2],
        make: MakePage<'a>,
    ) -> Self {
        let [left_up, right_down] = pixels.map(|pixel| screen.tangents(pixel).truncate());
        let body = reference.body();
        let roots = reference.roots().filter_map(|root| Some((root, reference.plate(root, make)?)));
        let roots: Vec<(&Node, &Plate)> = roots.collect();
        let floors_m = roots.iter().filter_map(|&(root, plate)| {
            Some(plate.low_m - reference.finer((root, plate), make)?.error_max_m)
        });
        let floor_m = floors_m.fold(0.0, f64::min).max(-0.5 * body.b_m());
        let horizon = Horizon::new(body, [floor_m, 0.0]);
        let eye_up_m = body.geodetic_from_ecef(Ecef(screen.eye)).height_m;
        let mut nearby = Self {
            reference,
            screen: *screen,
            planes: pyramid(screen, pixels[0], pixels[1]),
            low: left_up.min(right_down),
            high: left_up.max(right_down),
            horizon,
            reach_m: (eye_up_m > floor_m).then(|| horizon.tangent_m(eye_up_m)),
            make,
            stands: Vec::new(),
            due: Vec::new(),
        };
        roots.into_iter().for_each(|(root, plate)| nearby.add(root, plate));
        nearby
    }

    /// Adds a plate if it is fine enough, else its children.
    fn add(&mut self, node: &'a Node, plate: &'a Plate) {
        let eye = plate.local(self.screen.eye);
        let nearest_m = plate.whole().distance(eye).max(self.screen.near_m);
        let cell_px = plate.cell_m * self.screen.scale_px / nearest_m;
        if cell_px <= self.reference.cell_px() || node.key.depth() >= DEPTH_LAST {
            self.stand(plate);
            return;
        }
        let Some(finer) = self.reference.finer((node, plate), self.make) else {
            self.stand(plate);
            return;
        };
        let planes = self.planes.map(|plane| plate.axes * plane);
        let high_m = plate.high_m + finer.error_max_m;
        let reach_m = self.reach_m.map_or(f64::INFINITY, |m| m + self.horizon.tangent_m(high_m));
        for (index, kid) in node.kids().iter().enumerate() {
            let around = finer.quarter(index);
            let is_seen = planes.iter().all(|plane| farthest(&around, *plane, eye) >= 0.0);
            // Whether it is there already makes no difference: results must not hang on that.
            if is_seen && around.distance(eye) <= reach_m {
                self.insert(&around, plate, What::Child(kid, plate));
            }
        }
    }

    /// Adds a plate as it is.
    fn stand(&mut self, plate: &'a Plate) {
        let eye = plate.local(self.screen.eye);
        let index = u32::try_from(self.stands.len()).expect("below 2^32 plates");
        self.stands.push(Stand { plate, eye, origin: plate.origin(eye) });
        self.insert(&plate.whole(), plate, What::Part(index, Part::WHOLE));
    }

    /// Puts a box, in the axes of a plate, where its depth belongs.
    fn insert(&mut self, around: &Box3, plate: &Plate, what: What<'a>) {
        let screen = &self.screen;
        let [right, up, forward] = screen.axes.map(|axis| plate.axes * axis);
        let turn = DMat3::from_cols(right, up, forward).transpose();
        let middle = turn * ((around.low + around.high) * 0.5 - plate.local(screen.eye));
        let half = (around.high - around.low) * 0.5;
        let [x, y, z] = [turn.x_axis * half.x, turn.y_axis * half.y, turn.z_axis * half.z];
        let deep_m = x.z.abs() + y.z.abs() + z.z.abs();
        if middle.z + deep_m < screen.near_m {
            return;
        }
        let depth_m = middle.z - deep_m;
        let (mut low, mut high) = (DVec2::NEG_INFINITY, DVec2::INFINITY);
        if depth_m >= screen.near_m {
            let sides = [(x, y), (x, -y), (-x, y), (-x, -y)].map(|(x, y)| middle + x + y);
            let corners = sides.into_iter().flat_map(|side| [side + z, side - z]);
            let tangents = corners.map(|corner| corner.truncate() / corner.z);
            let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            (low, high) = tangents.fold(start, |(low, high), t| (low.min(t), high.max(t)));
        }
        let (low, high) = (low - MARGIN, high + MARGIN);
        if (low.cmpgt(self.high) | high.cmplt(self.low)).any() {
            return;
        }
        let at = self.due.partition_point(|due| due.depth_m < depth_m);
        self.due.insert(at, Due { depth_m, low, high, what });
    }

    /// Finds out what is in a box, or cuts it in four.
    fn open(&mut self, at: usize) {
        match self.due.remove(at).what {
            What::Part(index, part) => {
                let plate = self.stands[index as usize].plate;
                for part in part.quarters() {
                    self.insert(&plate.part(part), plate, What::Part(index, part));
                }
            }
            What::Child(node, parent) => match self.reference.plate(node, self.make) {
                Some(plate) => self.add(node, plate),
                None => self.stand(parent),
            },
        }
    }

    /// Where one of these rays first meets the ground; its depth is 1 in camera axes.
    pub fn meet(&mut self, tangents: DVec3) -> Option<Hit> {
        let direction = self.screen.to_body(tangents);
        let ray = tangents.truncate();
        let mut best: Option<(Meeting, &Plate)> = None;
        let mut end = f64::INFINITY;
        let mut at = 0;
        while let Some(due) = self.due.get(at) {
            if due.depth_m > end {
                break;
            }
            at += 1;
            if !(ray.cmpge(due.low) & ray.cmple(due.high)).all() {
                continue;
            }
            match due.what {
                What::Part(index, part) if part.bits == CUTS => {
                    let stand = &self.stands[index as usize];
                    let ray = (stand.eye, stand.plate.axes * direction);
                    let found = stand.plate.meet(part, &stand.origin, ray, end);
                    end = found.as_ref().map_or(end, |found| found.t);
                    best = found.map(|found| (found, stand.plate)).or(best);
                }
                What::Part(..) | What::Child(..) => {
                    self.open(at - 1);
                    // What was in it may be a bit nearer than the box. What was met stays met.
                    at = 0;
                }
            }
        }
        best.map(|(found, plate)| self.reference.hit(&found, plate))
    }
}

/// Greatest value of a plane through `eye` over a box.
fn farthest(around: &Box3, plane: DVec3, eye: DVec3) -> f64 {
    let (a, b) = ((around.low - eye) * plane, (around.high - eye) * plane);
    a.max(b).element_sum()
}

//! Priority of a diamond: the guaranteed projected error, the maximum over the views.
//!
//! In:    [`Region`] of a diamond, [`Sight`] of each view, a threshold.
//! Out:   an error bound in pixels; 0 where nothing of the region can be seen; verdicts: on which
//!        side of the threshold the bound is, and for how much motion that is certain.
//! Keeps: nothing.
//! Not here: where bounds come from (`cover`), what is done with verdicts (`agenda`).
//!
//! Distance. Let ρ be the ellipsoid's least radius of curvature. A ball of radius ρ rolls inside
//! it, so for ground points with normals n, m and heights h, k the squared distance is at least
//! |(ρ+h)n − (ρ+k)m|² = (h−k)² + (ρ+h)(ρ+k)|n−m|².
//! Horizon. A ball of the greatest radius of curvature contains it, so from height h nothing of
//! height k is seen farther than the sum of both tangent lengths to that ball, lowered to the
//! deepest ground. Frustum. A plane's greatest value over the region is bounded term by term.
//! Each bound only tightens when cap and height interval shrink. A diamond's own error counts from
//! where its own triangles may be, the lesser one of its kids from where theirs may be, the least one
//! of all others from where any descendant may be: a kid's errors are at most those of its parents'
//! next part, so priorities are nested, and tight even where a diamond is as large as it is far.
//!
//! Lens. Errors are vertical. At X from the eye, with depth z = f·X along the view direction f, a
//! vertical error e at normal n is e·|z·n − (f·n)·X|/z² large on a screen at unit depth: e/q, where
//! q, the *lens distance*, is what the picture's middle would show the error at. All ground of the
//! region lies in a ball of radius r around C with normals within the cap ε, so |X| ≤ D = |C| + r and,
//! with Z a lower bound on z, q is at least each of
//! - d·cos²θ, θ the angle of the picture's corner: as |z·n − (f·n)·X| = |f×(n×X)| ≤ |X|;
//! - Z/A, A = |n⊥| + T·|f·n| with the normal's part n⊥ across f and the tangent T of the corner;
//! - Z²/F, F = min(|f×(n×X)| at C + r + εD, D): that vector changes by at most |dX| + |X||dn|.
//!
//! Ground below the eye has a fourth bound, see `downward`. Z is the greater of f·C − r and d·cos θ: what is not in the picture does not count. A lens that
//! shrinks errors is trusted up to d/max(T, 1/4), so that parents far above the threshold last.
//! Balls are nested as caps are, so q only grows when a region shrinks.
//!
//! Certainty. The error is on the threshold where q = R = e·f/threshold. If the eye moves by m, the
//! heights change by at most m and √((ρ+h)(ρ+k))·|n−m| by at most λm (λ is 1 nearby, see `stretch`
//! below), so d changes by at most λm. Where the threshold over f falls or rises by a share Δ, R
//! changes by at most RΔ. A plane's value over the region changes by at most m, and by L·φ when its
//! unit normal changes by φ, L the region's farthest point. The horizon's reach changes with the
//! tangent length of the eye. Z changes by at most (1+λ)m + Dφ, A by (1+T)φ, F by (1+ε)m + Dφ; so
//! Z − RA changes by at most (1+λ)m + (D + (1+T)R)φ. √(RF) rises by at most √(R/F)/2 times F's change,
//! and falls by at most 1.2 times as much while F has lost no more than half. D itself changes by m,
//! which counts as long as m is below D/10. So a slack in metres, divided by what it loses for each
//! metre, stays positive for as long as `Lasts` tells.

use super::agenda::Verdict;
use super::downward::Downward;
use super::margin::{Margin, greater, least};
use super::wheel::{Family, Lasts, Motion};
use crate::camera::Camera;
use crate::geodesy::Ellipsoid;
use glam::DVec3;

/// What bounds a diamond and all its descendants.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Region {
    /// Surface normal at the diamond's centre.
    pub normal: DVec3,
    /// Ellipsoid point of that normal, ECEF metres.
    pub surface: DVec3,
    /// Chord from `normal` to the farthest normal of the region.
    pub cap: f64,
    /// Least height of the ground in the region, metres.
    pub low_m: f64,
    /// Greatest height of the ground in the region, metres.
    pub high_m: f64,
    /// Chord from `normal` to the farthest normal of the diamond's own two triangles.
    pub own_cap: f64,
    /// The same of its kids' triangles.
    pub kids_cap: f64,
    /// Bound on the height error of drawing the diamond unsplit, metres.
    pub error_m: f64,
    /// Bound on that of drawing its kids, metres; at most `error_m`.
    pub kids_m: f64,
    /// Bound on that of drawing any of their descendants, metres; at most `kids_m`.
    pub finer_m: f64,
    /// Length of the tangent from `high_m` down to the deepest ground, metres.
    pub tangent_m: f64,
}

/// What the body contributes to every priority.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Horizon {
    /// Least and greatest radius of curvature of the ellipsoid, metres.
    pub curvature_m: [f64; 2],
    /// The deepest surface of the whole body, metres.
    pub floor_m: f64,
    /// The highest ground of the whole body, metres.
    pub peak_m: f64,
}

impl Horizon {
    /// Of a body whose drawn surface lies within `surface_range_m` above the ellipsoid.
    pub fn new(body: &Ellipsoid, surface_range_m: [f64; 2]) -> Self {
        let [floor_m, peak_m] = surface_range_m;
        Self { curvature_m: body.curvature_radii_m(), floor_m, peak_m }
    }

    /// Length of the tangent from a height down to the deepest ground.
    pub fn tangent_m(&self, height_m: f64) -> f64 {
        let (r, above) = (self.curvature_m[1] + self.floor_m, height_m - self.floor_m);
        if above > 0.0 { (above * (2.0 * r + above)).sqrt() } else { 0.0 }
    }
}

/// What one view contributes to every priority.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sight {
    eye: DVec3,
    normal: DVec3,
    height_m: f64,
    planes: [DVec3; 4],
    forward: DVec3,
    pixels_per_radian: f64,
    /// Least cosine between the view direction and anything in the picture, and its square.
    corner_cosine: f64,
    corner_cosine2: f64,
    /// Tangent of that angle.
    corner_tangent: f64,
    half_tangents: [f64; 2],
    near_m: f64,
    tangent_m: f64,
    downward: Downward,
    /// Greatest √((ρ + k)/(ρ + h)) of any ground k and any eye h for which verdicts last.
    steepness: f64,
    horizon: Horizon,
}

/// Eyes deeper than this share of the least radius of the floor get no lasting verdicts: close to
/// the body's centre the normal under the eye turns without bound.
const DEEPEST_EYE: f64 = 0.9;

impl Sight {
    /// The sight of a camera over a body.
    ///
    /// Pixels per radian are those of the picture's middle; the lens accounts for the rest.
    pub fn new(camera: &Camera, horizon: Horizon) -> Self {
        let below = camera.height_m <= horizon.floor_m;
        let rho = horizon.curvature_m[0];
        let deepest_m = DEEPEST_EYE * (rho + horizon.floor_m);
        let steepness = ((rho + horizon.peak_m) / deepest_m).sqrt();
        Self {
            eye: camera.eye.0,
            normal: camera.normal,
            height_m: camera.height_m,
            planes: camera.side_planes,
            forward: camera.forward,
            pixels_per_radian: camera.pixels_per_radian,
            corner_cosine: (1.0 / camera.corner_factor).sqrt(),
            corner_cosine2: 1.0 / camera.corner_factor,
            corner_tangent: (camera.corner_factor - 1.0).sqrt(),
            half_tangents: camera.half_tangents,
            near_m: camera.near_m,
            downward: Downward::new(camera, deepest_m),
            // From below all ground the horizon hides nothing.
            tangent_m: if below { f64::INFINITY } else { horizon.tangent_m(camera.height_m) },
            steepness,
            horizon,
        }
    }

    /// What happened between an earlier sight of this view and this one; `None` where no verdict
    /// may last: another near distance, an eye through the floor of all ground or far below it.
    pub fn motion_since(&self, before: &Self) -> Option<Motion> {
        let rho = self.horizon.curvature_m[0];
        let deepest_m = DEEPEST_EYE * (rho + self.horizon.floor_m) - rho;
        let same = self.near_m == before.near_m
            && self.tangent_m.is_finite() == before.tangent_m.is_finite();
        if !same || self.height_m < deepest_m || before.height_m < deepest_m {
            return None;
        }
        let turned = |now: DVec3, was: DVec3| (now - was).length();
        let turns = self.planes.iter().zip(&before.planes).map(|(now, was)| turned(*now, *was));
        let turn = turns.fold(turned(self.forward, before.forward), f64::max);
        let change = |now: f64, was: f64| (now - was).abs() / now.min(was);
        let zoom = change(self.pixels_per_radian, before.pixels_per_radian)
            + change(self.corner_cosine2, before.corner_cosine2)
            + change(self.corner_tangent, before.corner_tangent)
            + change(self.half_tangents[0], before.half_tangents[0])
            + change(self.half_tangents[1], before.half_tangents[1]);
        let lift_m = if self.tangent_m.is_finite() {
            (self.tangent_m - before.tangent_m).abs()
        } else {
            0.0
        };
        Some(Motion {
            path_m: (self.eye - before.eye).length(),
            step_m: DVec3::ZERO,
            lift_m,
            turn,
            // Products of small changes, many times over.
            zoom: zoom * (1.0 + zoom),
        })
    }

    /// Lower bound on the distance from the eye to the ground of the region, metres.
    pub fn distance_m(&self, region: &Region) -> f64 {
        self.distances_m(region)[PARTS - 1]
    }

    /// Lower bound on the distance to ground of the region whose normal is a chord away.
    fn distance_beyond_m(&self, region: &Region, chord: f64) -> f64 {
        let chord = if chord > 0.0 { chord } else { 0.0 };
        let above = self.height_m - region.high_m;
        let below = region.low_m - self.height_m;
        let vertical = if above > 0.0 {
            above
        } else if below > 0.0 {
            below
        } else {
            0.0
        };
        let rho = self.horizon.curvature_m[0];
        let across = (rho + self.height_m) * (rho + region.low_m) * chord * chord;
        (vertical * vertical + if across > 0.0 { across } else { 0.0 }).sqrt()
    }

    /// Bound on the change of [`Self::distance_m`] for each metre that the eye moves.
    ///
    /// With c the chord between the normals the gradient is at most √((ρ+k)/(ρ+h))·(1 + c/2); a
    /// slack is never more than a tenth of ρ, so c grows by less than what is added here.
    fn stretch(&self, region: &Region) -> f64 {
        self.steepness * (1.1 + (self.normal - region.normal).length())
    }

    /// By how much each part of a region is in the frustum, metres: negative outside.
    fn frustum_margins_m(&self, region: &Region) -> [f64; PARTS] {
        let to_surface = region.surface - self.eye;
        let Region { low_m, high_m, .. } = *region;
        let caps = caps_of(region);
        let mut margins_m = [f64::INFINITY; PARTS];
        for plane in &self.planes {
            let along = plane.dot(region.normal);
            let surface_m = plane.dot(to_surface);
            for (margin_m, cap) in margins_m.iter_mut().zip(caps) {
                let lift = |height_m: f64| height_m * along + height_m.abs() * cap;
                let spread_m = 1.01 * self.horizon.curvature_m[1] * cap;
                *margin_m =
                    least(*margin_m, surface_m + spread_m + greater(lift(low_m), lift(high_m)));
            }
        }
        margins_m
    }

    /// Lower bounds on the distance to each part of a region, metres.
    fn distances_m(&self, region: &Region) -> [f64; PARTS] {
        let chord = (self.normal - region.normal).length();
        caps_of(region).map(|cap| self.distance_beyond_m(region, chord - cap))
    }

    /// What this view sees of the parts of a region that are so far away at least.
    fn look(&self, region: &Region, distances_m: [f64; PARTS]) -> [Look; PARTS] {
        let (caps, errors_m) = (caps_of(region), errors_of(region));
        let inside_m = self.frustum_margins_m(region);
        [0, 1, 2].map(|part| {
            let above_m = self.tangent_m + region.tangent_m - distances_m[part];
            let (cap, error_m) = (caps[part], errors_m[part]);
            let distance_m = greater(distances_m[part], self.near_m);
            Look { cap, error_m, distance_m, seen_by_m: least(above_m, inside_m[part]) }
        })
    }

    /// What all parts of a region have in common before a lens.
    fn aim(&self, region: &Region) -> Aim {
        let (low_m, high_m) = (region.low_m, region.high_m);
        let away = region.surface - self.eye + region.normal * (0.5 * (low_m + high_m));
        let depth_m = self.forward.dot(away);
        let along = self.forward.dot(region.normal);
        Aim {
            lower_m: self.height_m - high_m,
            chord: (self.normal - region.normal).length(),
            tallest_m: greater(low_m.abs(), high_m.abs()),
            half_m: 0.5 * (high_m - low_m),
            away_m: away.length(),
            depth_m,
            along,
            seen_m: (depth_m * region.normal - along * away).length(),
            aside: self.forward.cross(region.normal).length(),
        }
    }

    /// How the screen's plane enlarges errors of a part of a region.
    fn lens(&self, aim: &Aim, &Look { cap, distance_m, .. }: &Look) -> Lens {
        let ball_m = (1.01 * self.horizon.curvature_m[1] + aim.tallest_m) * cap + aim.half_m;
        let far_m = aim.away_m + ball_m;
        let corner_m = distance_m * self.corner_cosine;
        let seen_m = least(aim.seen_m + ball_m + cap * far_m, far_m);
        let aside = least(aim.aside + cap, 1.0);
        let ahead = least(aim.along.abs() + cap, 1.0);
        Lens {
            distance_m,
            depth_m: greater(aim.depth_m - ball_m, corner_m),
            across: greater(aside + self.corner_tangent * ahead, SHRINK_MIN),
            seen_m: greater(seen_m, SHRINK_MIN * far_m),
            far_m,
            cap,
            lower_m: aim.lower_m,
            chord: aim.chord + cap,
        }
    }

    /// What a lens that shrinks errors is trusted with, over the distance.
    fn shrink_max(&self) -> f64 {
        1.0 / greater(least(self.corner_tangent, 1.0), SHRINK_MIN)
    }

    /// The distance at which the middle of the picture would show an error as large.
    fn lens_distance_m(&self, lens: &Lens) -> f64 {
        let corner_m = lens.distance_m * self.corner_cosine2;
        let across_m = lens.depth_m / lens.across;
        let seen_m = lens.depth_m * lens.depth_m / lens.seen_m;
        let most_m = lens.distance_m * self.shrink_max();
        let lens_m = least(greater(greater(corner_m, across_m), seen_m), most_m);
        greater(lens_m, self.downward.lens_distance_m(lens.lower_m, lens.chord))
    }

    /// Error in pixels of a part of a region, and its lens where it is seen.
    fn part(&self, aim: &Aim, look: &Look) -> Option<(f64, Lens)> {
        (look.seen_by_m >= 0.0).then(|| {
            let lens = self.lens(aim, look);
            let error_px = look.error_m * self.pixels_per_radian / self.lens_distance_m(&lens);
            (error_px, lens)
        })
    }

    /// Whether this view may see any of the region.
    pub fn sees(&self, region: &Region) -> bool {
        self.look(region, self.distances_m(region))[PARTS - 1].seen_by_m >= 0.0
    }

    /// Error bound of the region on this view's screen, in pixels.
    pub fn error_px(&self, region: &Region) -> f64 {
        let looks = self.look(region, self.distances_m(region));
        let aim = self.aim(region);
        worst_px(&looks.map(|look| self.part(&aim, &look)))
    }

    /// Not less than the distance to any point of the region by which a turn moves it, metres.
    fn farthest_m(&self, region: &Region) -> f64 {
        let (low, high) = (region.low_m.abs(), region.high_m.abs());
        (region.surface - self.eye).length() + if low > high { low } else { high }
    }

    /// A slack in metres of motion, from one in metres of distance; rounding taken off.
    fn path_of(&self, region: &Region, slack_m: f64, scale_m: f64) -> f64 {
        let most_m = 0.1 * self.horizon.curvature_m[0];
        let path_m = (slack_m - 1e-9 * scale_m - 1e-6) / self.stretch(region);
        if path_m < most_m { path_m } else { most_m }
    }

    /// The lens distance at which an error is on the threshold, also where that is 0.
    fn reach_m(&self, error_m: f64, threshold_px: f64) -> f64 {
        let reach_m = error_m * self.pixels_per_radian / threshold_px;
        if error_m > 0.0 { least(reach_m, REACH_MAX_M) } else { 0.0 }
    }

    /// For how long a leaf stays below `threshold_px` in this view, or its error.
    fn leaf(&self, region: &Region, threshold_px: f64) -> Verdict {
        let distances_m = self.distances_m(region);
        let parts_m = distances_m.map(|distance_m| greater(distance_m, self.near_m));
        let reaches_m = errors_of(region).map(|error_m| self.reach_m(error_m, threshold_px));
        let far_m = |part: usize| parts_m[part] - reaches_m[part] / self.corner_cosine2;
        let far_m = least(least(far_m(0), far_m(1)), far_m(2));
        if far_m > 0.0 {
            let scale_m = parts_m[0];
            let slack_m = self.path_of(region, far_m, scale_m);
            return Verdict::Certain(Lasts { family: Family::Far, scale_m, slack_m });
        }
        let looks = self.look(region, distances_m);
        let aim = self.aim(region);
        let parts = looks.map(|look| self.part(&aim, &look));
        let error_px = worst_px(&parts);
        if error_px >= threshold_px {
            return Verdict::Urgent(error_px);
        }
        let (stretch, farthest_m) = (self.stretch(region), self.farthest_m(region));
        let margin = |part: usize| match &parts[part] {
            None => sight((stretch, farthest_m), looks[part].seen_by_m).turned(),
            Some((_, lens)) => self.below(lens, reaches_m[part], stretch),
        };
        let [own, kids, finer] = [0, 1, 2].map(margin);
        self.lasts(Family::Hidden, own.and(kids).and(finer))
    }

    /// A verdict that lasts as long as a margin; the stretch counts on no longer a way than this.
    fn lasts(&self, family: Family, margin: Margin) -> Verdict {
        let slack_m = least(margin.path_m(), 0.1 * self.horizon.curvature_m[0]);
        Verdict::Certain(Lasts { family, scale_m: margin.per_radian_m / margin.per_m, slack_m })
    }

    /// For how long a lens distance stays beyond `reach_m`: as long as its best bound does.
    fn below(&self, lens: &Lens, reach_m: f64, stretch: f64) -> Margin {
        let near = self.margin_of_distance(lens, reach_m, stretch);
        let [corner, across, seen] = self.margins(lens, reach_m, stretch, 1.0);
        let down = self.downward.margin(lens.lower_m, lens.chord, reach_m);
        near.and(corner.or(across).or(seen)).or(down)
    }

    /// For how long a lens distance stays within `reach_m`: as long as each of its bounds does, or
    /// the distance is near enough for any lens.
    fn above(&self, lens: &Lens, reach_m: f64, stretch: f64) -> Margin {
        let near = self.margin_of_distance(lens, reach_m, stretch).turned();
        let [corner, across, seen] = self.margins(lens, reach_m, stretch, 1.2).map(Margin::turned);
        let half = Margin {
            slack_m: 0.5 * lens.seen_m,
            per_m: 1.0 + lens.cap,
            per_radian_m: 1.1 * lens.far_m,
        };
        let down = self.downward.margin(lens.lower_m, lens.chord, reach_m).turned();
        near.or(corner.and(across).and(seen).and(half)).and(down)
    }

    /// By how much the most that a lens may make of the distance is beyond `reach_m`.
    fn margin_of_distance(&self, lens: &Lens, reach_m: f64, stretch: f64) -> Margin {
        let slack_m = lens.distance_m - reach_m / self.shrink_max();
        let per_radian_m = reach_m + lens.distance_m;
        Margin { slack_m, per_m: stretch, per_radian_m }.rounded(lens.distance_m)
    }

    /// By how much each bound on the lens distance is beyond `reach_m`; `steeper` is by how much
    /// more than its slope a root changes.
    fn margins(&self, lens: &Lens, reach_m: f64, stretch: f64, steeper: f64) -> [Margin; 3] {
        let tangent = 1.0 + self.corner_tangent;
        let far_m = 1.1 * lens.far_m;
        let corner = Margin {
            slack_m: lens.distance_m - reach_m / self.corner_cosine2,
            per_m: stretch,
            per_radian_m: (reach_m + lens.distance_m) / self.corner_cosine2,
        };
        let across = Margin {
            slack_m: lens.depth_m - reach_m * lens.across,
            per_m: 1.0 + stretch,
            per_radian_m: far_m + tangent * reach_m + reach_m * lens.across,
        };
        let root_m = (reach_m * lens.seen_m).sqrt();
        let slope = 0.5 * steeper * root_m / lens.seen_m;
        let seen = Margin {
            slack_m: lens.depth_m - root_m,
            per_m: 1.0 + stretch + slope * (1.0 + lens.cap),
            per_radian_m: far_m * (1.0 + slope) + root_m,
        };
        [corner, across, seen].map(|margin| margin.within(lens.far_m))
    }

    /// For how long a parent stays above `threshold_px` in this view, or its error.
    fn parent(&self, region: &Region, threshold_px: f64) -> Verdict {
        let looks = self.look(region, self.distances_m(region));
        let aim = self.aim(region);
        let parts = looks.map(|look| self.part(&aim, &look));
        let error_px = worst_px(&parts);
        if error_px <= threshold_px {
            return Verdict::Urgent(error_px);
        }
        let (stretch, farthest_m) = (self.stretch(region), self.farthest_m(region));
        let margin = |part: usize| match &parts[part] {
            Some((error_px, lens)) if *error_px > threshold_px => {
                let reach_m = self.reach_m(looks[part].error_m, threshold_px);
                let sight = sight((stretch, farthest_m), looks[part].seen_by_m);
                self.above(lens, reach_m, stretch).and(sight)
            }
            _ => Margin { slack_m: f64::NEG_INFINITY, per_m: 1.0, per_radian_m: 0.0 },
        };
        let [own, kids, finer] = [0, 1, 2].map(margin);
        self.lasts(Family::Needed, own.or(kids).or(finer))
    }
}

/// By how much something is seen, for a stretch and the distance of the farthest of it.
fn sight((per_m, farthest_m): (f64, f64), slack_m: f64) -> Margin {
    Margin { slack_m, per_m, per_radian_m: farthest_m }.rounded(farthest_m)
}

/// A region before a view, as far as its parts share it.
struct Aim {
    /// How much lower than the eye all of it is, metres.
    lower_m: f64,
    /// Chord between the eye's normal and the region's.
    chord: f64,
    /// Greatest height above or below the ellipsoid, and half their range, metres.
    tallest_m: f64,
    half_m: f64,
    /// Distance and depth of the ball's centre, metres.
    away_m: f64,
    depth_m: f64,
    /// The normal's part along the view direction, and across.
    along: f64,
    aside: f64,
    /// |z·n − (f·n)·X| at the centre, metres.
    seen_m: f64,
}

/// How the screen's plane enlarges errors of ground in a ball.
struct Lens {
    /// Nothing of the ground is nearer, metres.
    distance_m: f64,
    /// Nothing of it in the picture is less deep, metres: Z.
    depth_m: f64,
    /// A: at most so much of a vertical error lies across the view direction.
    across: f64,
    /// F, metres.
    seen_m: f64,
    /// Nothing of it is farther, metres: D.
    far_m: f64,
    /// Chord from the ball's normal to the farthest normal: ε.
    cap: f64,
    /// How much lower than the eye all of it is, metres.
    lower_m: f64,
    /// Chord from the eye's normal to the farthest normal.
    chord: f64,
}

/// Farther than anything is, and far from overflow.
const REACH_MAX_M: f64 = 1e60;

/// A lens is never taken to shrink errors by more than this, so that what depends on it changes
/// slowly.
const SHRINK_MIN: f64 = 0.25;

/// The most motion of any view between two frames; `None` where no verdict may last, as when
/// there are more or fewer views.
pub fn motion_between(before: &[Sight], now: &[Sight]) -> Option<Motion> {
    if before.len() != now.len() {
        return None;
    }
    let of = |(now, before): (&Sight, &Sight)| now.motion_since(before);
    now.iter().zip(before).map(of).try_fold(Motion::default(), |most, one| Some(most.most(one?)))
}

/// Parts of a region: the diamond's own triangles, its kids', those of all finer descendants. Where
/// a part may be contains where those before it may be.
const PARTS: usize = 3;

fn caps_of(region: &Region) -> [f64; PARTS] {
    [region.own_cap, region.kids_cap, region.cap]
}

fn errors_of(region: &Region) -> [f64; PARTS] {
    [region.error_m, region.kids_m, region.finer_m]
}

/// What a view sees of a part of a region.
#[derive(Clone, Copy)]
struct Look {
    cap: f64,
    error_m: f64,
    /// Lower bound on the distance, at least the near distance.
    distance_m: f64,
    /// The lesser margin before horizon and frustum, metres: negative where the part is hidden.
    seen_by_m: f64,
}

/// The greatest error of what is seen.
fn worst_px(parts: &[Option<(f64, Lens)>; PARTS]) -> f64 {
    let errors_px = parts.iter().flatten().map(|part| part.0);
    errors_px.fold(0.0, greater)
}

/// Error bound of a region's own triangles alone, over all views: what is drawn while it is a leaf.
pub fn own_px(region: &Region, sights: &[Sight]) -> f64 {
    let part = |sight: &Sight| {
        let looks = sight.look(region, sight.distances_m(region));
        sight.part(&sight.aim(region), &looks[0]).map_or(0.0, |(error_px, _)| error_px)
    };
    sights.iter().map(part).fold(0.0, greater)
}

/// Priority of a region: the largest error over all views.
pub fn priority_px(region: &Region, sights: &[Sight]) -> f64 {
    sights.iter().fold(0.0, |worst, sight| {
        let error_px = sight.error_px(region);
        if error_px > worst { error_px } else { worst }
    })
}

/// The verdict on a leaf: certain while it is below the threshold in every view.
pub fn judge_leaf(region: &Region, sights: &[Sight], threshold_px: f64) -> Verdict {
    let both = |all, one| match (all, one) {
        (Verdict::Urgent(a), Verdict::Urgent(b)) => Verdict::Urgent(if a > b { a } else { b }),
        (Verdict::Urgent(px), _) | (_, Verdict::Urgent(px)) => Verdict::Urgent(px),
        (Verdict::Certain(a), Verdict::Certain(b)) => Verdict::Certain(Lasts {
            family: if b.family == Family::Hidden { b.family } else { a.family },
            scale_m: a.scale_m.max(b.scale_m),
            slack_m: a.slack_m.min(b.slack_m),
        }),
    };
    let verdicts = sights.iter().map(|sight| sight.leaf(region, threshold_px));
    verdicts.reduce(both).unwrap_or(Verdict::Certain(Lasts::FOREVER))
}

/// The verdict on a parent: certain while it is above the threshold in one view.
pub fn judge_parent(region: &Region, sights: &[Sight], threshold_px: f64) -> Verdict {
    sights.iter().map(|sight| sight.parent(region, threshold_px)).fold(
        Verdict::Urgent(0.0),
        |all, one| match (all, one) {
            (Verdict::Certain(a), Verdict::Certain(b)) => {
                Verdict::Certain(if b.slack_m > a.slack_m { b } else { a })
            }
            (Verdict::Certain(lasts), _) | (_, Verdict::Certain(lasts)) => Verdict::Certain(lasts),
            (Verdict::Urgent(a), Verdict::Urgent(b)) => Verdict::Urgent(if a > b { a } else { b }),
        },
    )
}
